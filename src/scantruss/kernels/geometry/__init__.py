"""Compiled geometry: vectors, triangles, search boxes and the k-d tree."""
