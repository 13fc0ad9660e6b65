"""Whether a grid can be built: limits on members, angles, folds and distances from the scan, and what comes near them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from ..boundary.curves import length_along
from ..errors import Place, words_of_count, words_of_number, words_of_place, words_of_share
from ..grid.certificate import Certificate, Fault, place_of
from ..grid.panels import inner_angles_of
from ..settings import CheckSettings
from .folds import fold_angles

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..settings import Settings
    from .distances import Distances

WARN_ANGLE = 25.0  # angle of a triangle below which it is poor [degree]
WARN_WIDE = 150.0  # angle within a panel of more than three nodes above which it is poor [degree]
WARN_SHORT, WARN_LONG = 0.6, 1.6  # members below and above which they are poor [desired lengths]
HEXAGON_BOUNDARY = 3.0**0.5  # members of the boundary of even hexagons [desired lengths]
WARN_FOLD = 45.0  # angle between neighbouring triangles below which the fold is poor [degree]
WARN_OFFSET = 0.05  # distance of a node from the scan, beyond its noise, from which on that is poor [member lengths]
NOISES_OFF = 3.0  # rms distances of points from their plane that are noise
# what keeps limbs that are left out as too thin
LIMBS_KEPT = "shorter members keep limbs, which must be three of them round"
PLACES_KEPT = 30  # places of a fault that are kept, the worst first
# distance within which a point of the scan and a triangle are in reach of each other [member lengths]
COVER_REACH = 0.5
ROUNDED_BY = 0.25  # distance from the grid above which a point is rounded off [member lengths]
# share of the points that are rounded off above which it is a fault: 0.23 where nodes jump between two layers, 0.16 at most on others
MOST_ROUNDED = 0.2
SAID_ALONE = ("far", "limbs", "slits")  # kinds of what a grid misses that are listed with their own counts
# share of the points that a grid may miss or round off, and ScanTruss may leave out by itself, without a word
WARN_LEFT_OUT = 0.01


@dataclass(frozen=True)
class Figure:
    """A figure with a limit: its values, where they are, and from where on they are poor or faulty."""

    kind: str
    values: np.ndarray
    places: np.ndarray  #: (K, 3) where each value is
    worst: float  #: the limit of the settings
    poor: float  #: where warnings begin
    words: str  #: what is said, with the value
    largest: bool = True  #: large values are the bad ones

    def beyond(self, limit: float) -> Fault | None:
        """Return the fault of the worst value if it is beyond a limit."""
        sign = 1.0 if self.largest else -1.0
        bad = np.flatnonzero(sign * self.values > sign * limit)
        if not len(bad):
            return None
        worst = bad[np.argsort(-sign * self.values[bad], kind="stable")]
        more = f" ({len(bad):,} such places)" if len(bad) > 1 else ""
        at, *others = (place_of(place) for place in self.places[worst[:PLACES_KEPT]])
        return Fault(self.kind, self.words.format(self.values[worst[0]]) + more, at, tuple(others))


def limits_of(grid: Grid, found: Distances, settings: Settings) -> tuple[list[Fault], list[Fault]]:
    """Return the faults of a grid that cannot be built, and warnings where it only just can.

    Members between two fixed nodes and angles of triangles with three are as long and as wide as the settings say.
    """
    faults, warnings = [], []
    for figure in _figures(grid, found, settings):
        fault = figure.beyond(figure.worst)
        if fault is not None:
            faults.append(fault)
        elif (warning := figure.beyond(figure.poor)) is not None:
            warnings.append(warning)
    return faults, warnings


def _figures(grid: Grid, found: Distances, settings: Settings) -> list[Figure]:
    """Return all figures of a grid that have limits."""
    at_nodes = np.full(len(grid.nodes), settings.length) if grid.desired is None else grid.desired
    free = ~grid.fixed[grid.edges].all(axis=1)
    middles = grid.nodes[grid.edges].mean(axis=1) + grid.origin
    lengths = grid.lengths[free] / at_nodes[grid.edges].mean(axis=1)[free]
    panels = grid.panel_table
    angles = np.where((grid.fixed[panels] | (panels < 0)).all(axis=1)[:, None], np.nan, grid.corner_angles)
    shapeable = np.isfinite(angles)
    corners = grid.nodes[panels[shapeable]] + grid.origin
    inner = _inner_angles(grid)
    folds, hexagons = fold_angles(grid), grid.cells == "hexagon"
    measured = np.isfinite(found.nodes) & ~grid.fixed
    if settings.boundary:  # its nodes lie where the user says
        measured[grid.edges[grid.edge_uses == 1]] = False
    off = np.maximum(found.nodes - NOISES_OFF * found.noise, 0.0)[measured] / at_nodes[measured]
    return [
        Figure("angle", angles[shapeable], corners, settings.min_angle, WARN_ANGLE,
               "has an angle of {:.1f} degrees", largest=False),
        Figure("wide", inner[np.isfinite(inner)], grid.nodes[panels[np.isfinite(inner)]] + grid.origin,
               180.0 + settings.min_angle, WARN_WIDE, "has a panel with an angle of {:.0f} degrees"),
        Figure("short", lengths, middles[free], settings.min_length, WARN_SHORT,
               "has a member of {:.2f} desired lengths", largest=False),
        Figure("long", lengths, middles[free], settings.max_length, WARN_LONG * (HEXAGON_BOUNDARY if hexagons else 1.0),
               "has a member of {:.2f} desired lengths"),
        Figure("folded", folds[np.isfinite(folds)], middles[np.isfinite(folds)], settings.min_fold, WARN_FOLD,
               "is folded to {:.1f} degrees", largest=False),
        Figure("offset", off, grid.nodes[measured] + grid.origin, settings.max_offset, WARN_OFFSET,
               "has a node {:.2f} members off the scan, its noise aside"),
    ]  # fmt: skip


def _inner_angles(grid: Grid) -> np.ndarray:
    """Return the angles within panels of more than three nodes (P, K), NaN where none is judged: corners of the scan cut hexagons."""
    if grid.cells == "triangle":
        return np.full(grid.panel_table.shape, np.nan)
    angles = inner_angles_of(grid.nodes, grid.panel_table)
    if grid.cells == "hexagon":
        on_boundary = np.zeros(len(grid.nodes), np.bool_)
        on_boundary[grid.edges[grid.edge_uses == 1]] = True
        angles[on_boundary[grid.panel_table]] = np.nan
    return angles


def mostly_rounded(rounded: float, at: Place) -> list[Fault]:
    """Return a fault where a grid rounds off too much of its scan; parameters as of `places_to_look_at`."""
    if rounded <= MOST_ROUNDED:
        return []
    return [Fault("rounded", f"rounds off {rounded:.0%} of the points by more than a quarter of a member", at)]


def places_to_look_at(found: Certificate, missed_at: Place, rounded: float = 0.0) -> list[Fault]:
    """Return warnings of what a grid leaves out: each place farther than a member, and much that it misses or ScanTruss left out.

    What is said of one of these is not counted again with the others that it misses.

    missed_at : the worst place that it misses by less than a member
    rounded : share of the points that lie farther than `ROUNDED_BY` members from the grid, but not so far that it misses them
    """
    unit = f" {found.unit}" if found.unit else ""
    warnings = [
        Fault(
            "far",
            f"misses {words_of_count(part.points, 'point')} ({words_of_share(part.share)})"
            f" by up to {words_of_number(part.farthest, 3)}{unit}",
            part.where,
        )
        for part in found.left_out
        if part.kind == "far" and part.where is not None and part.farthest is not None
    ]
    alone = [part for part in found.left_out if part.kind in SAID_ALONE]
    if (nearer := found.missing - sum(part.share for part in alone)) > WARN_LEFT_OUT:
        farther = any(part.kind == "far" for part in alone)
        words = f"misses {nearer:.1%} of the points by {'half a member to a member' if farther else 'more than half a member'}"
        warnings.append(Fault("missed", words, missed_at))
    if rounded > WARN_LEFT_OUT:
        words = (
            f"rounds off {rounded:.0%} of the points by more than a quarter of a member; shorter members follow them"
        )
        warnings.append(Fault("rounded", words, missed_at))
    if found.judged_out > WARN_LEFT_OUT:
        warnings.append(Fault("left out", f"leaves out {found.judged_out:.1%} of the points that were read"))
    return warnings


def with_ridges_given_up(grid: Grid, parts: Sequence[np.ndarray]) -> Grid:
    """Return a grid with a warning of the parts of ridges that it gives up, the longest first, each (K, 3); as it is without any."""
    return _with_ridges(grid, parts, "gives up ridges where no grid passes with them")


def with_ridges_lost(grid: Grid, parts: Sequence[np.ndarray]) -> Grid:
    """Return a grid with a warning of the parts of folds that it cuts across, as `with_ridges_given_up`."""
    return _with_ridges(
        grid,
        parts,
        "cuts across ridges of the scan",
        "lost",
        "; shorter members or a smaller --ridge-angle may follow them",
    )


def _with_ridges(grid: Grid, parts: Sequence[np.ndarray], said: str, kind: str = "ridge", advice: str = "") -> Grid:
    """Return a grid with a warning of parts of ridges: what is `said`, how long they are, and where the longest goes."""
    found = grid.certificate
    if found is None or not parts:
        return grid
    unit, longest = f" {grid.unit}" if grid.unit else "", parts[0]
    whole, of_longest = (words_of_number(each, 3) for each in (sum(map(length_along, parts)), length_along(longest)))
    more = f" in {len(parts)} parts, the longest {of_longest}{unit}," if len(parts) > 1 else ""
    first, last = (words_of_place(longest[end]) for end in (0, -1))
    ends = f"from ({first}) to ({last})" if first != last else f"in a ring through ({first})"
    words = f"{said}: {whole}{unit}{more} {ends}{advice}"
    at, *others = (place_of(part[len(part) // 2]) for part in parts[:PLACES_KEPT])
    warning = Fault(kind, words, at, tuple(others))
    return grid.replace(certificate=replace(found, warnings=(*found.warnings, warning)))


def widened_limits(settings: Settings) -> tuple[str, ...]:
    """Return the limits that the settings make wider than the defaults, in words."""
    said = []
    for spec in fields(CheckSettings):
        value, wider = getattr(settings, spec.name), not spec.name.startswith("min")
        if value != spec.default and (value > spec.default) == wider:
            said.append(f"{spec.name.replace('_', ' ')} {value:g} instead of {spec.default:g}")
    return tuple(said)
