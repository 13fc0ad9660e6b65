"""Checking a grid against its scan."""
