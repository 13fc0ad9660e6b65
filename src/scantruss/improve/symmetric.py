"""Symmetries that a grid keeps exactly, mirror planes or a rotation: found in the scan or given, and grids made by them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..constraints.network import curves_of
from ..errors import FrontError, InputError
from ..kernels.boundary.curves import distances_from_curves
from ..scan.rotation import Rotation, check_rotation, find_rotation
from ..scan.symmetry import SYMMETRY_TOLERANCE, MirrorPlane, check_mirror_planes, find_mirror_planes
from ..settings.values import ROTATION_NUMBERS
from .mirrored import MIRROR_LINE as EDGE_LINE
from .mirrored import check_lines_kept, mirror_lines, mirrored_grid, sides_of
from .rotated import rotated_grid, seams_of

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid
    from ..settings import Settings

__all__ = ["EDGE_LINE", "Symmetry", "check_boundary_kept", "find_symmetry"]

ON_BOUNDARY = 0.4  # farthest that the boundary of the scan may lie from that of the images [member lengths]


def check_boundary_kept(made: Grid, boundary: Boundary, length: float) -> None:
    """Refuse images whose boundary is not that of the scan, since a hole or an edge of it has no counterpart.

    Raises
    ------
    FrontError
        Names the farthest place.
    """
    loops = [loop for loop in boundary.loops if loop.cut != "close"]
    curves = curves_of([made.nodes[np.array(own)] for own in made.boundary_loops], [True] * len(made.boundary_loops))
    places = np.concatenate([np.zeros((0, 3)), *(loop.points for loop in loops)])
    away = np.empty(len(places))
    distances_from_curves(curves, places, away)
    if len(away) and away.max() > ON_BOUNDARY * length:
        x, y, z = (places[away.argmax()] + made.origin).tolist()
        raise FrontError(
            f"the boundary of the scan has no counterpart near ({x:.5g}, {y:.5g}, {z:.5g}), as where a hole lies on one side only;"
            " close the hole with --fill-at, or leave --symmetry out",
            made,
            (x, y, z),
        )


class Symmetry(ABC):
    """What a grid keeps: it is made of one part and its images."""

    @property
    @abstractmethod
    def parts(self) -> int:
        """How many parts of a grid may be kept, tried in turn."""

    @property
    @abstractmethod
    def rows(self) -> list[tuple[float, ...]]:
        """As settings hold it."""

    @abstractmethod
    def edges(self, grid: Grid, length: float) -> list[list[np.ndarray]]:
        """Return choices of the lines (K, 3) at which a part ends, on a grid, in the frame of the scan."""

    @abstractmethod
    def made(self, grid: Grid, edges: list[np.ndarray], length: float, part: int) -> Grid:
        """Return a part of a grid that has these edges as rows, and its images."""


@dataclass(frozen=True, eq=False)
class _Mirrored(Symmetry):
    planes: Sequence[MirrorPlane]

    @property
    def parts(self) -> int:
        return len(sides_of(self.planes))

    @property
    def rows(self) -> list[tuple[float, ...]]:
        return [plane.row for plane in self.planes]

    def edges(self, grid: Grid, length: float) -> list[list[np.ndarray]]:
        return [mirror_lines(grid, self.planes, length)]

    def made(self, grid: Grid, edges: list[np.ndarray], length: float, part: int) -> Grid:
        made = mirrored_grid(grid, sides_of(self.planes)[part], length)
        check_lines_kept(grid, made, length, "the mirror planes")
        return made


@dataclass(frozen=True, eq=False)
class _Rotated(Symmetry):
    rotation: Rotation

    @property
    def parts(self) -> int:
        return 1

    @property
    def rows(self) -> list[tuple[float, ...]]:
        return [self.rotation.row]

    def edges(self, grid: Grid, length: float) -> list[list[np.ndarray]]:
        return seams_of(grid, self.rotation, length)

    def made(self, grid: Grid, edges: list[np.ndarray], length: float, part: int) -> Grid:
        made = rotated_grid(grid, self.rotation, edges, length)
        check_lines_kept(grid, made, length, "the rotation")
        return made


def find_symmetry(points: np.ndarray, settings: Settings) -> Symmetry:
    """Return the symmetry of a scan that the settings ask for.

    Parameters
    ----------
    points : (N, 3) float64 in the frame of the scan [scan unit]
    settings : Settings
        `symmetry`, `length`.

    Raises
    ------
    InputError
        The scan does not have it within a tenth of a member.
    """
    asked, tolerance = settings.symmetry, SYMMETRY_TOLERANCE * settings.length
    if asked == "rotation":
        return _Rotated(find_rotation(points, tolerance))
    if not isinstance(asked, str):
        if len(asked[0]) == ROTATION_NUMBERS:
            return _Rotated(check_rotation(points, asked[0], tolerance))
        return _Mirrored(check_mirror_planes(points, asked, tolerance))
    try:
        return _Mirrored(find_mirror_planes(points, tolerance))
    except InputError as error:
        try:
            return _Rotated(find_rotation(points, tolerance))
        except InputError:
            raise error from None
