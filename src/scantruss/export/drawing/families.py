"""Picture of few lengths: the number of lengths against the largest misfit, sorted as they are and after moving the nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...grid.grid import Grid
from ...layouts.families import few_lengths, least_misfit
from .structure import drawing_defaults, png_of

COUNTS = (3, 5, 7, 9, 12, 16, 20)  #: lengths that are tried


def encode_families(
    grid: Grid,
    tolerance: float,
    counts: Sequence[int] = COUNTS,
    off_scan: Callable[[Grid], float] | None = None,
) -> bytes:
    """Return the picture as PNG; misfits over the mean member.

    off_scan : largest distance of the nodes of a grid from the scan [unit of the grid]; it is drawn below, over the mean member
    """
    from matplotlib.figure import Figure

    mean = float(grid.lengths.mean())
    made = [few_lengths(grid, tolerance, count) for count in counts]
    after = [100 * least_misfit(each.grid.lengths, count) / mean for each, count in zip(made, counts, strict=True)]
    with drawing_defaults():
        figure = Figure(figsize=(8, 5.6), dpi=100, facecolor="white")
        parts: Any = figure.subplots(
            1 if off_scan is None else 2, sharex=True, squeeze=False, height_ratios=[3, 1][: 1 + bool(off_scan)]
        )
        axes = parts[0, 0]
        axes.plot(
            counts, [100 * least_misfit(grid.lengths, k) / mean for k in counts], "o--", label="sorted as they are"
        )
        axes.plot(counts, after, "o-", label="after moving the nodes")
        for count, misfit, each in zip(counts, after, made, strict=True):
            words = f"{100 * float(np.max(each.moved)) / mean:.2g} % moved"
            axes.annotate(words, (count, misfit), (0, 6), textcoords="offset points", fontsize=7, ha="center")
        axes.set_ylabel("largest misfit [% of the mean member]")
        axes.margins(y=0.12)
        axes.legend()
        if off_scan is not None:
            far = [100 * off_scan(each.grid) / mean for each in made]
            parts[1, 0].plot(counts, far, "o-", color="tab:orange")
            parts[1, 0].axhline(100 * off_scan(grid) / mean, linestyle="--")
            parts[1, 0].set_ylabel("farthest node\noff the scan [%]")
        for each in parts[:, 0]:
            each.set_ylim(bottom=0)
            each.grid(alpha=0.3)
        parts[-1, 0].set_xlabel("lengths")
        parts[-1, 0].set_xticks(counts)
        return png_of(figure)
