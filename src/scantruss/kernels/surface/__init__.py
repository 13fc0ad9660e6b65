"""Compiled loops over the scanned surface: samples, normals, local quadrics, orientation and size fields."""
