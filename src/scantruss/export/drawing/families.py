"""Picture of few lengths: the number of lengths against the largest misfit, sorted as they are and after moving the nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...grid.grid import Grid
from ...layouts.families import few_lengths, least_misfit
from .structure import drawing_defaults, png_of

COUNTS = (3, 5, 7, 9, 12, 16, 20)  #: lengths that are tried


def encode_families(grid: Grid, tolerance: float, counts: Sequence[int] = COUNTS) -> bytes:
    """Return the picture as PNG; misfits over the mean member."""
    from matplotlib.figure import Figure

    mean = float(grid.lengths.mean())
    made = [few_lengths(grid, tolerance, count) for count in counts]
    after = [100 * least_misfit(each.grid.lengths, count) / mean for each, count in zip(made, counts, strict=True)]
    with drawing_defaults():
        figure = Figure(figsize=(8, 5.6), dpi=100, facecolor="white")
        axes: Any = figure.add_subplot()
        axes.plot(
            counts, [100 * least_misfit(grid.lengths, k) / mean for k in counts], "o--", label="sorted as they are"
        )
        axes.plot(counts, after, "o-", label="after moving the nodes")
        for count, misfit, each in zip(counts, after, made, strict=True):
            words = f"{100 * float(np.max(each.moved)) / mean:.2g} % moved"
            axes.annotate(words, (count, misfit), (4, 5), textcoords="offset points", fontsize=7)
        axes.set_xlabel("lengths")
        axes.set_ylabel("largest misfit [% of the mean member]")
        axes.set_ylim(bottom=0)
        axes.grid(alpha=0.3)
        axes.legend()
        return png_of(figure)
