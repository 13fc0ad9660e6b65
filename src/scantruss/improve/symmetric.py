"""Symmetries that a grid keeps exactly, mirror planes or a rotation: found in the scan or given, and grids made by them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..constraints.network import curves_of
from ..errors import FrontError, InputError
from ..kernels.boundary.curves import distances_from_curves
from ..scan.rotation import Rotation, check_half_turn, check_rotation, find_half_turn, find_rotation, turn_about
from ..scan.symmetry import SYMMETRY_TOLERANCE, MirrorPlane, check_mirror_planes, find_mirror_planes, three_of
from ..settings.values import ROTATION_NUMBERS
from .half_turned import half_turned_grid, half_turned_wedge, rows_of
from .mirrored import MIRROR_LINE as EDGE_LINE
from .mirrored import (
    Wedge,
    check_lines_kept,
    mirror_lines,
    mirrored_grid,
    sides_of_mirror,
    wedge_of,
    without_edge_lines,
)
from .rotated import rotated_grid, seams_of

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid
    from ..settings import Settings

__all__ = ["EDGE_LINE", "Symmetry", "check_boundary_kept", "find_symmetries"]

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
        return len(sides_of_mirror(self.planes))

    @property
    def rows(self) -> list[tuple[float, ...]]:
        return [plane.row for plane in self.planes]

    def edges(self, grid: Grid, length: float) -> list[list[np.ndarray]]:
        return [mirror_lines(grid, wedge_of(self.planes, grid.origin), length)]

    def made(self, grid: Grid, edges: list[np.ndarray], length: float, part: int) -> Grid:
        made = mirrored_grid(grid, wedge_of(sides_of_mirror(self.planes)[part], grid.origin), length)
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


@dataclass(frozen=True, eq=False)
class _HalfTurned(Symmetry):
    rotation: Rotation
    half_turn: Rotation

    @property
    def parts(self) -> int:
        return 1

    @property
    def rows(self) -> list[tuple[float, ...]]:
        return [self.rotation.row, self.half_turn.row]

    def edges(self, grid: Grid, length: float) -> list[list[np.ndarray]]:
        return [rows_of(grid, self._wedge(grid), length)]

    def made(self, grid: Grid, edges: list[np.ndarray], length: float, part: int) -> Grid:
        made = without_edge_lines(half_turned_grid(grid, self._wedge(grid), length))
        check_lines_kept(grid, made, length, "the half turns")
        return made

    def _wedge(self, grid: Grid) -> Wedge:
        return half_turned_wedge(self.rotation, self.half_turn, grid.origin)


def find_symmetries(points: np.ndarray, settings: Settings) -> list[Symmetry]:
    """Return the symmetry of a scan that the settings ask for, and after one with half turns that without.

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
        return _found_rotations(points, tolerance)
    if not isinstance(asked, str):
        if len(asked[0]) == ROTATION_NUMBERS:
            rotation = check_rotation(points, asked[0], tolerance)
            return [
                _Rotated(rotation)
                if len(asked) == 1
                else _HalfTurned(rotation, check_half_turn(points, rotation, asked[1], tolerance))
            ]
        return [_Mirrored(check_mirror_planes(points, asked, tolerance))]
    try:
        return [_Mirrored(find_mirror_planes(points, tolerance))]
    except InputError as error:
        try:
            return _found_rotations(points, tolerance)
        except InputError:
            raise error from None


def _found_rotations(points: np.ndarray, tolerance: float) -> list[Symmetry]:
    """Return the rotation of a scan with the half turns about lines of its surface, where it has these, and without."""
    rotation = find_rotation(points, tolerance)
    half_turn = find_half_turn(points, rotation, tolerance)
    plain = _Rotated(rotation)
    if half_turn is None:
        return [plain]
    between = turn_about(np.array(rotation.axis), math.pi / rotation.order) @ half_turn.axis
    return [_HalfTurned(rotation, each) for each in (half_turn, replace(half_turn, axis=three_of(between)))] + [plain]
