"""Compiled loops of the boundary: points, loops and the smoothed curves."""
