"""The points of a scan drawn over its grid: those that the grid follows, and those that it leaves out, by kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...boundary.find import find_boundary
from ...check.distances import distances_to_grid
from ...check.left_out import points_left_out
from ...check.limits import COVER_REACH
from ...errors import words_of_count
from ...grid.certificate import KINDS_LEFT_OUT
from ...surface.samples import sample_surface
from .strokes import placed

if TYPE_CHECKING:
    from ...grid.grid import Grid
    from ...scan.cloud import PointCloud

OUT_OF_REACH_COLOUR = np.array([0.80, 0.10, 0.10])
NO_GRID_COLOUR = np.array([0.45, 0.25, 0.65])
LEFT_OUT_COLOUR = np.array([0.85, 0.55, 0.05])
COLOUR_OF_PART = {
    "far": OUT_OF_REACH_COLOUR,
    "pieces": NO_GRID_COLOUR,
    "not chosen": NO_GRID_COLOUR,
    "rods": NO_GRID_COLOUR,
    "limbs": NO_GRID_COLOUR,
    "slits": NO_GRID_COLOUR,
    "floor": NO_GRID_COLOUR,
    "outliers": LEFT_OUT_COLOUR,
    "sparse": LEFT_OUT_COLOUR,
}


@dataclass(frozen=True, eq=False)
class Missed:
    """Points that a grid leaves out for one reason."""

    words: str
    points: np.ndarray  #: (K, 3) in the frame of the grid [scan unit]
    colour: np.ndarray  #: (3,)
    framed: bool  #: whether the picture is made to hold them; outliers may lie anywhere
    kind: str = ""  #: that of `LeftOut`


@dataclass(frozen=True, eq=False)
class Shown:
    """The points of a scan as a picture shows them."""

    followed: np.ndarray  #: (N, 3) in the frame of the grid [scan unit]
    missed: tuple[Missed, ...] = ()
    unread: tuple[str, ...] = ()  #: what is not shown, in words

    @property
    def framed(self) -> np.ndarray:
        """The points that the picture is made to hold (M, 3)."""
        return np.concatenate([self.followed, *(part.points for part in self.missed if part.framed)])


def shown_points(grid: Grid, cloud: PointCloud) -> Shown:
    """Return the points of a scan by what its grid makes of them; all are followed if the settings of the grid are not known."""
    points = placed(cloud, grid)
    if grid.settings is None:
        return Shown(points)
    length, samples = grid.settings.length, sample_surface(cloud, grid.settings)
    if grid.settings.boundary:
        samples, _ = find_boundary(samples, grid.settings)
        points = samples.scan + samples.origin - grid.origin
    distance, nearest = distances_to_grid(points, grid, length)
    desired = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    members = desired[grid.triangles].mean(axis=1)[nearest]
    kinds: dict[str, list[np.ndarray]] = {}
    for part, which in points_left_out(samples, distance, members, COVER_REACH * members):
        kinds.setdefault(part.kind, []).append(which)
    left = np.zeros(len(points), bool)
    missed = []
    for kind, groups in kinds.items():
        which = np.concatenate(groups)
        left[which] = True
        if kind in COLOUR_OF_PART:
            words = f"{words_of_count(len(which), 'point')}: {KINDS_LEFT_OUT[kind]}"
            missed.append(Missed(words, points[which], COLOUR_OF_PART[kind], kind not in ("outliers", "sparse"), kind))
    unread = tuple(f"{words_of_count(count, 'point')}: {words}, not shown" for words, count in samples.unread)
    return Shown(points[~left], tuple(missed), unread)
