"""Quads on the scan."""
