"""Improving a grid: flips, smoothing, equalizing and perturbation."""
