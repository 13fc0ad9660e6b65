"""The trade of few different parts: how many there are against how nearly alike, how far nodes move and how even the lengths stay."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..grid.alike import Alike
from ..grid.grid import Grid
from ..runtime.progress import Progress
from .alike import PartKinds, fewest_kinds
from .families import few_lengths, least_misfit
from .moved import moved_grid
from .part_vectors import UNLIKE_MISFIT

COUNTS_TRIED = (20, 16, 12, 9, 7, 5, 3)  #: lengths that are tried
MISFIT_BISECTIONS = 20  #: of the least misfit
MOST_STAGES = 8  #: in the trade of kinds, of all that were on the way

OffScan = Callable[[Grid], float]
"""Largest distance of the nodes of a grid from the scan [unit of the grid]."""


class Traded(NamedTuple):
    """A number of lengths or kinds, and what it costs; misfits and moves over the mean member of the grid as it was."""

    number: int
    misfit: float  #: the largest
    plain: float  #: that with which the grid as it was would be of so many
    moved: float  #: farthest move of a node
    cv: float  #: std / mean of the lengths
    off_scan: float | None  #: farthest node off the scan
    grid: Grid

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain values."""
        known = {} if self.off_scan is None else {"off_scan_max": self.off_scan}
        return {
            "kinds": self.number,
            "misfit_max": self.misfit,
            "plain_misfit_max": self.plain,
            "moved_max": self.moved,
            "length_cv": self.cv,
        } | known


def traded_lengths(
    grid: Grid,
    tolerance: float,
    counts: Sequence[int] = COUNTS_TRIED,
    off_scan: OffScan | None = None,
    progress: Progress | None = None,
) -> Iterator[Traded]:
    """Yield what some numbers of lengths cost; see `few_lengths`."""
    mean = float(grid.lengths.mean())
    for count in counts:
        found = few_lengths(grid, tolerance, count, progress)
        yield Traded(
            number=count,
            misfit=least_misfit(found.grid.lengths, count) / mean,
            plain=least_misfit(grid.lengths, count) / mean,
            moved=float(np.max(found.moved)) / mean,
            cv=found.grid.quality.length_cv,
            off_scan=None if off_scan is None else off_scan(found.grid) / mean,
            grid=found.grid,
        )


def traded_kinds(
    before: Grid, found: PartKinds, off_scan: OffScan | None = None, progress: Progress | None = None
) -> list[Traded]:
    """Return what numbers of kinds cost: of the grid as it was, and with which counts end, eight at most; plain misfits by bisection.

    Parameters
    ----------
    before : Grid
    found : PartKinds
        Of that grid.
    progress : callable, optional
        Called with what the parts are and the share of the work that is done at least; it may raise to cancel.
    """
    which = np.unique(np.linspace(0, len(found.stages) - 1, MOST_STAGES).round().astype(int))
    mean, asked = float(before.lengths.mean()), found.grid.alike
    assert asked is not None
    nodes = found.stages[0].nodes
    steps, done = len(which) * MISFIT_BISECTIONS, 0

    def heard() -> None:
        if progress:
            progress(asked.parts, done / steps)

    misfit, _ = found.parts.misfits(
        found.parts.vectors(nodes), np.arange(len(found.of)), mirrored=found.mirror_images_alike, heard=heard
    )
    trade = []
    for stage in (found.stages[k] for k in which):
        low, high = 0.0, UNLIKE_MISFIT
        for _ in range(MISFIT_BISECTIONS):
            heard()
            done += 1
            middle = (low + high) / 2
            few = len(fewest_kinds(misfit <= middle, found.parts.count > 0)) <= len(stage.kinds)
            low, high = (low, middle) if few else (middle, high)
        grid = moved_grid(before, stage.nodes, Alike(**asked.to_dict() | {"count": len(stage.kinds)}))
        trade.append(
            Traded(
                number=len(stage.kinds),
                misfit=stage.misfit,
                plain=high,
                moved=float(np.linalg.norm(stage.nodes - nodes, axis=1).max()) / mean,
                cv=grid.quality.length_cv,
                off_scan=None if off_scan is None else off_scan(grid) / mean,
                grid=grid,
            )
        )
    return trade
