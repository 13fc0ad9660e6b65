"""Compiled loops over the points of a scan."""
