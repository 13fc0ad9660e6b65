"""Pictures of few parts: the number of lengths or kinds against the largest misfit, sorted as they are and after moving the nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...grid.alike import JOINTS
from ...layouts.trade import Traded
from .structure import drawing_defaults, png_of

LEAST_TICK = 0.04  #: between two numbers below the picture, over its width


def encode_lengths(trade: Sequence[Traded], off_before: float | None) -> bytes:
    """Return the picture of the trade of lengths as PNG; misfits over the mean member.

    off_before : farthest node of the grid as it was off the scan, over the mean member
    """
    return _picture("lengths", "largest misfit [% of the mean member]", trade, off_before)


def encode_kinds(trade: Sequence[Traded], parts: str) -> bytes:
    """Return the picture of the trade of joints or panels as PNG; parts: what they are called."""
    measure = "of unit directions" if parts == JOINTS else "of corners, over the mean member"
    words = f"largest misfit, root mean square\n{measure} [%]"
    return _picture(f"kinds of {parts}", words, trade, trade[0].off_scan)


def _picture(counted: str, measure: str, points: Sequence[Traded], off_before: float | None) -> bytes:
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
