"""Splicing: overlapping scans, each in a frame of its own, become one cloud in one frame."""

from .run import PairFit, Splice, splice_scans

__all__ = ["PairFit", "Splice", "splice_scans"]
