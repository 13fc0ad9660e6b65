"""Compiled loops of a grid: topology, improvement and checks."""
