"""Grids of quads and hexagons, made of a finished grid of triangles."""
