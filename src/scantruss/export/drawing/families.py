"""Pictures of few parts: the number of lengths or kinds against the largest misfit, sorted as they are and after moving the nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...grid.grid import Grid
from ...layouts.families import few_lengths, least_misfit
from .structure import drawing_defaults, png_of

COUNTS = (3, 5, 7, 9, 12, 16, 20)  #: lengths that are tried
LEAST_TICK = 0.04  #: between two numbers below the picture, over its width


def encode_families(
    grid: Grid,
    tolerance: float,
    counts: Sequence[int] = COUNTS,
    off_scan: Callable[[Grid], float] | None = None,
) -> bytes:
    """Return the picture of lengths as PNG; misfits over the mean member.

    off_scan : largest distance of the nodes of a grid from the scan [unit of the grid]; it is drawn below, over the mean member
    """
    mean = float(grid.lengths.mean())
    made = [few_lengths(grid, tolerance, count) for count in counts]
    return _picture(
        "lengths",
        "largest misfit [% of the mean member]",
        [
            _Point(
                count,
                least_misfit(each.grid.lengths, count) / mean,
                least_misfit(grid.lengths, count) / mean,
                float(np.max(each.moved)) / mean,
                None if off_scan is None else off_scan(each.grid) / mean,
            )
            for each, count in zip(made, counts, strict=True)
        ],
        None if off_scan is None else off_scan(grid) / mean,
    )


def encode_kinds(trade: list[dict[str, Any]], parts: str) -> bytes:
    """Return the picture of joints or panels as PNG, of the stages that `trade_of` tells; parts: what they are called."""
    points = [
        _Point(each["kinds"], each["misfit_max"], each["plain_misfit_max"], each["moved_max"], each.get("off_scan_max"))
        for each in trade
    ]
    measure = "of unit directions" if parts == "joints" else "of corners, over the mean member"
    return _picture(f"kinds of {parts}", f"largest misfit, root mean square\n{measure} [%]", points, points[0].off_scan)


class _Point(NamedTuple):
    """A number of lengths or kinds, and what it costs."""

    number: int
    misfit: float  #: the largest
    plain: float  #: the same of the grid as it was
    moved: float  #: farthest move of a node over the mean member
    off_scan: float | None  #: farthest node off the scan, over the mean member


def _picture(counted: str, measure: str, points: list[_Point], off_before: float | None) -> bytes:
    """Return the picture as PNG; all shares in percent."""
    from matplotlib.figure import Figure

    counts = [each.number for each in points]
    with drawing_defaults():
        figure = Figure(figsize=(8, 5.6), dpi=100, facecolor="white")
        parts: Any = figure.subplots(
            1 if off_before is None else 2,
            sharex=True,
            squeeze=False,
            height_ratios=[3, 1][: 1 + (off_before is not None)],
        )
        axes = parts[0, 0]
        axes.plot(counts, [100 * each.plain for each in points], "o--", label="sorted as they are")
        axes.plot(
            counts,
            [100 * each.misfit for each in points],
            "o-",
            label="after moving the nodes, the farthest by so many % of a member",
        )
        for each in points:
            axes.annotate(
                f"{100 * each.moved:.2g}", (each.number, 100 * each.misfit), (0, 6),
                textcoords="offset points", fontsize=7, ha="center",
            )  # fmt: skip
        axes.set_ylabel(measure)
        axes.legend()
        if off_before is not None:
            parts[1, 0].plot(counts, [100 * (each.off_scan or 0.0) for each in points], "o-", color="tab:orange")
            parts[1, 0].axhline(100 * off_before, linestyle="--")
            parts[1, 0].set_ylabel("farthest node\noff the scan [%]")
        for each in parts[:, 0]:
            each.margins(y=0.12)
            each.set_ylim(bottom=0)
            each.grid(alpha=0.3)
        parts[-1, 0].set_xlabel(counted)
        apart = LEAST_TICK * (max(counts) - min(counts))
        ticks = sorted(counts)[:1]
        for count in sorted(counts)[1:]:
            if count - ticks[-1] >= apart:
                ticks.append(count)
        parts[-1, 0].set_xticks(ticks)
        return png_of(figure)
