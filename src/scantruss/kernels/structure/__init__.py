"""Kernels of structures: forces of members under large displacements."""
