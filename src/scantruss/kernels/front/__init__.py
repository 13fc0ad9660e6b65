"""Compiled loops of the advancing front."""
