"""What a grid must keep: nodes at fixed positions (Sec. 4.2), fixed lines and ridges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..boundary.find import Boundary, with_line_ends
from ..errors import Place
from ..kernels.mesh.point_location import nearest_sample
from .fixed_lines import add_polylines
from .fixed_nodes import check_fixed_positions
from .lines_of_folds import is_long_edge, is_made
from .network import NO_LINES, Lines, Network
from .ridge_ends import Ridge
from .ridges import add_ridges, cut_around, find_ridges, fold_lines, given_up, without
from .ridges_at_boundary import with_ridge_ends

if TYPE_CHECKING:
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples


@dataclass(frozen=True, eq=False)
class Constraints:
    """What a grid must keep."""

    positions: np.ndarray  #: (K, 3) places of fixed nodes, relative to the cloud's origin [scan unit]
    lines: Lines = NO_LINES  #: fixed lines and ridges

    def __repr__(self) -> str:
        """Say how many there are of each."""
        ridges = sum(whole.ridge for whole in self.lines.whole)
        return f"Constraints({len(self.positions)} fixed nodes, {len(self.lines.whole) - ridges} fixed lines, {ridges} ridges)"


def find_constraints(
    samples: SurfaceSamples,
    boundary: Boundary,
    settings: Settings,
    faults: Sequence[Place] = (),
    wide: tuple[int, ...] = (),
) -> tuple[Boundary, Constraints]:
    """Return what the grid must keep: fixed nodes, fixed lines and the ridges of the scan; and the boundary with the ends of lines.

    Parameters
    ----------
    samples : SurfaceSamples
        The surface samples of the scan.
    boundary : Boundary
    settings : Settings
        `fixed`, `fixed_lines`, `ridge_angle`, `length`, `corner_angle`.
    faults : places [scan unit], optional
        Where grids failed that followed the ridges: there they are given up.
    wide : numbers, optional
        Wide folds that are ridges too, see `ridges.find_ridges`.

    Returns
    -------
    boundary : Boundary
        The one given, with the places where lines end among the points of its loops.
    constraints : Constraints

    Raises
    ------
    InputError
        A fixed position is farther than half a member from the scan or nearer than that to another; a fixed line is too short or
        leaves the scan.
    """
    positions = check_fixed_positions(settings.fixed, samples, settings.length)
    ridges = ridges_away_from(faults, samples, settings, wide)
    boundary = with_ridge_ends(boundary, ridges, samples, settings.length)
    lines = find_lines(samples, boundary, ridges, settings)
    ended = tuple(with_line_ends(loop, lines.stops_on(k)) for k, loop in enumerate(boundary.loops))
    return replace(boundary, loops=ended), Constraints(positions, lines)


def ridges_away_from(
    faults: Sequence[Place], samples: SurfaceSamples, settings: Settings, wide: tuple[int, ...] = ()
) -> list[Ridge]:
    """Return the ridges that the grid is to follow, without what lies near faults, places [scan unit]."""
    return cut_around(
        wanted_ridges(samples, settings, wide), np.reshape(faults, (-1, 3)) - samples.origin, settings.length
    )


def ridges_given_up(
    faults: Sequence[Place], samples: SurfaceSamples, settings: Settings, wide: tuple[int, ...] = ()
) -> list[np.ndarray]:
    """Return the parts of ridges near faults that the grid is not to follow, the longest first, each (K, 3) [scan unit]."""
    parts = given_up(
        wanted_ridges(samples, settings, wide), np.reshape(faults, (-1, 3)) - samples.origin, settings.length
    )
    return [part + samples.origin for part in parts]


def wanted_ridges(samples: SurfaceSamples, settings: Settings, wide: tuple[int, ...] = ()) -> list[Ridge]:
    """Return the ridges that the grid is to follow; see `ridges.find_ridges`."""
    wanted = settings.ridge_angle > 0.0 and settings.method == "default" and not samples.smooth
    ridges = [ridge for ridge in find_ridges(samples, settings, wide) if _on_pieces(ridge, samples)] if wanted else []
    return without(ridges, [np.array(place, float) - samples.origin for place in settings.no_ridge_at], settings.length)


def wide_folds(samples: SurfaceSamples, settings: Settings) -> list[np.ndarray]:
    """Return the places (K, 3) along each line of folds that turn over nearly a member; none where no ridges are wanted."""
    wanted = settings.ridge_angle > 0.0 and settings.method == "default" and not samples.smooth
    return [folds["place"] for folds in fold_lines(samples, settings).wide] if wanted else []


def made_folds(samples: SurfaceSamples, settings: Settings) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the numbers of those as even as what was made, and of these and long edges: ridges where a grid follows them as well."""
    found = fold_lines(samples, settings).wide
    made = tuple(number for number, folds in enumerate(found) if is_made(folds))
    return made, tuple(number for number, folds in enumerate(found) if number in made or is_long_edge(folds))


def _on_pieces(ridge: Ridge, samples: SurfaceSamples) -> bool:
    """Whether a ridge lies on the pieces of the scan that get a grid, for the most part."""
    if samples.kept.all():
        return True
    nearest = [nearest_sample(samples.surface, *place) for place in ridge.places.tolist()]
    return bool(samples.kept[nearest].mean() > 0.5)


def find_lines(samples: SurfaceSamples, boundary: Boundary, ridges: list[Ridge], settings: Settings) -> Lines:
    """Return the fixed lines and the ridges of a scan, each a curve that becomes a chain of members."""
    if not settings.fixed_lines and not ridges:
        return NO_LINES
    network = Network([(loop.points, loop.corner_at) for loop in boundary.loops], settings.length)
    add_polylines(network, samples, settings)
    add_ridges(network, ridges)
    return network.lines()
