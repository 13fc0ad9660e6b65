"""Layouts that are made of a grid: double layers, few lengths."""
