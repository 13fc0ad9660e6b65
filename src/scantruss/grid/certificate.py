"""The certificate of a grid: what was checked, what was found, and where it is worst.

A grid that does not pass is refused by `pipeline`: rather no result than a wrong one that looks right.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .cover import boxes_of, distances_to_grid, distances_to_scan, scan_places
from .crossings import ENOUGH, find_crossings
from .irregular import count_irregular
from .quality import corner_angles, labels, pinched_nodes

if TYPE_CHECKING:
    from ..boundary import Boundary
    from ..settings import Settings
    from .grid import Grid

Place = tuple[float, float, float]

REACH = 0.5  #: members from the nearest triangle, or part of the scan, up to which one lies within reach of the other
LEFT_OUT = 0.2  #: share of the scan that a grid may leave out of reach
ASTRAY = 0.5  #: members from the scan, beside the radius of the holes that are closed, at which a triangle has left it
UNEVEN = 0.4  #: standard deviation of the lengths, in mean lengths, from which on a grid follows no surface
FOLDED = 10.0  #: angle between neighbouring triangles below which one lies on the other [degree]
OFF = 1e-6  #: members that a fixed node may be off its position: nothing but rounding


@dataclass(frozen=True)
class Worst:
    """The worst value of a figure and where it is, in the scan's own frame."""

    value: float
    where: Place


@dataclass(frozen=True)
class Fault:
    """What is wrong with a grid; "the grid " and `words` make a sentence."""

    kind: str  #: empty manifold orientable pieces loops crossing folded uneven cover astray fixed
    words: str
    where: Place | None = None  #: a place in the scan's own frame [scan unit]


@dataclass(frozen=True)
class Certificate:
    """What holds for a grid; lengths in the scan's unit, places in the scan's own frame."""

    unit: str
    faults: tuple[Fault, ...]
    manifold: bool
    orientable: bool
    pieces: int
    scan_pieces: int
    boundary_loops: int
    scan_loops: int  #: boundary loops of the scan that are kept, that is, not closed as small holes
    euler: int  #: nodes - members + triangles = 2 pieces - 2 handles - boundary loops
    handles: int | None  #: None where the grid is no oriented manifold
    crossings: int  #: pairs of triangles that cut, touch or cover each other; exact, and at most 100 are counted
    reach: float  #: half a member
    scan_within_reach: float  #: share of the scan that lies within `reach` of a triangle
    farthest_scan: Worst | None  #: distance of a part of the scan from the nearest triangle
    grid_within_reach: float  #: share of the triangles whose middle lies within `reach` of the scan
    farthest_triangle: Worst | None  #: distance of the middle of a triangle from the nearest part of the scan
    shortest_member: Worst | None
    longest_member: Worst | None
    smallest_angle: Worst | None  #: [degree]
    largest_angle: Worst | None  #: [degree]
    sharpest_fold: Worst | None  #: smallest angle between two triangles at a member, 180 where they are level [degree]
    node_deviation: (
        Worst | None
    )  #: distance of a node from the scanned surface, at most that from the nearest part of the scan
    fixed_error: Worst | None  #: distance of a fixed position from its node
    irregular: int  #: members too few or too many at the nodes, see `irregular`
    irregular_forced: int  #: ... that the Euler number and the angles of the rim force

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.faults

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; `passed` first."""
        return {"passed": self.passed, **asdict(self), "faults": [asdict(fault) for fault in self.faults]}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Certificate:
        """Return a certificate from plain values."""
        plain = {name: value for name, value in values.items() if name != "passed"}
        for name, value in plain.items():
            if isinstance(value, dict):
                plain[name] = Worst(float(value["value"]), _place(value["where"]))
        faults = [
            Fault(fault["kind"], fault["words"], None if fault["where"] is None else _place(fault["where"]))
            for fault in plain["faults"]
        ]
        return cls(**{**plain, "faults": tuple(faults)})

    def __str__(self) -> str:
        """Return all in one line."""
        if self.faults:
            return "FAILED: the grid " + "; ".join(f"{fault.words}{near(fault.where)}" for fault in self.faults)
        said = [
            "passed",
            "oriented manifold",
            f"{self.handles} handles" if self.handles else "",
            "no triangles cut each other",
            f"{self.scan_within_reach:.2%} of the scan and {self.grid_within_reach:.2%} of the triangles within"
            f" {self.reach:.3g} {self.unit}".rstrip(),
            f"irregular {self.irregular}, forced {self.irregular_forced}",
        ]
        return ", ".join(word for word in said if word)


def near(where: Place | None) -> str:
    """Return a place in words, to be put behind others; nothing where there is none."""
    return "" if where is None else f" (near {', '.join(f'{c:.6g}' for c in where)})"


def certify(grid: Grid, boundary: Boundary, settings: Settings) -> Certificate:
    """Return the certificate of a grid.

    Parameters
    ----------
    grid : Grid
        Of the same origin as the scan.
    boundary : Boundary
        Boundary loops of the scan, and the sites they were found in.
    settings : Settings
        `length` is the desired member length, `smallest_hole` tells which holes are closed, `fixed` where nodes must be.

    Returns
    -------
    Certificate
        Nothing is raised where it does not pass; see `Certificate.faults`.
    """
    found, length = grid.topology, settings.length
    sound = len(grid.triangles) > 0 and bool(np.isfinite(grid.nodes).all())
    crossings = find_crossings(grid.nodes, grid.triangles) if sound else np.zeros((0, 2), np.int64)
    places = scan_places(boundary.sites)
    boxes = boxes_of(places, 0.5 * length)
    middles = grid.nodes[grid.triangles].mean(axis=1) if sound else np.zeros((0, 3))
    left = distances_to_grid(places, boxes, grid, length) if sound else np.zeros(0)
    away = distances_to_scan(np.concatenate([middles, grid.nodes[: len(grid.nodes) * sound]]), places, boxes, length)
    astray, off = away[: len(middles)], away[len(middles) :]
    if sound and grid.deviation is not None:  # where a patch ends at a rim it may say more than there is
        off = np.fmin(off, grid.deviation)
    angles = corner_angles(grid.nodes, grid.triangles) if sound else np.zeros((0, 3))
    irregular, forced = count_irregular(grid, angles) if sound else (0, 0)
    closed = found.manifold and found.orientable
    certificate = Certificate(
        unit=grid.unit,
        faults=(),
        manifold=found.manifold,
        orientable=found.orientable,
        pieces=found.components,
        scan_pieces=len(boundary.sites.pieces),
        boundary_loops=found.boundary_loops,
        scan_loops=len(boundary.loops),
        euler=found.euler,
        handles=(2 * found.components - found.boundary_loops - found.euler) // 2 if closed else None,
        crossings=len(crossings),
        reach=REACH * length,
        scan_within_reach=float((left <= REACH * length).mean()) if sound else 0.0,
        farthest_scan=_worst(left, places, grid),
        grid_within_reach=float((astray <= REACH * length).mean()) if sound else 0.0,
        farthest_triangle=_worst(astray, middles, grid),
        node_deviation=_worst(off, grid.nodes, grid),
        fixed_error=_fixed_error(grid, settings) if sound else None,
        irregular=irregular,
        irregular_forced=forced,
        **_extremes(grid, angles),
    )
    if not sound:
        return replace(certificate, faults=(Fault("empty", "has no triangles"),))
    topology = _faults_of_topology(grid, certificate, boundary)
    return replace(certificate, faults=(*topology, *_faults_in_space(grid, certificate, crossings, settings)))


def _place(place: Any) -> Place:
    x, y, z = (float(c) for c in place)
    return x, y, z


def _worst(values: np.ndarray, places: np.ndarray, grid: Grid, sign: float = 1.0) -> Worst | None:
    """Return the largest of the values (K,), or the smallest for sign -1, and its place (K, 3); None of none."""
    known = np.flatnonzero(np.isfinite(values))
    if len(known) == 0:
        return None
    at = known[np.argmax(sign * values[known])]
    return Worst(float(values[at]), _place(places[at] + grid.origin))


def _extremes(grid: Grid, angles: np.ndarray) -> dict[str, Worst | None]:
    """Return the worst members, angles and fold."""
    names = ("shortest_member", "longest_member", "smallest_angle", "largest_angle", "sharpest_fold")
    if len(angles) == 0:
        return dict.fromkeys(names)
    halves = grid.nodes[grid.edges].mean(axis=1)
    corners = grid.nodes[grid.triangles].reshape(-1, 3)
    found = (
        _worst(grid.lengths, halves, grid, -1.0),
        _worst(grid.lengths, halves, grid),
        _worst(angles.ravel(), corners, grid, -1.0),
        _worst(angles.ravel(), corners, grid),
        _worst(fold_angles(grid), halves, grid, -1.0),
    )
    return dict(zip(names, found, strict=True))


def fold_angles(grid: Grid) -> np.ndarray:
    """Return the angle between the first two triangles at each member, (E,) [degree]: 180 level, 0 folded flat; NaN at the rim."""
    two = grid.edge_triangles
    a, b, c = (grid.nodes[grid.triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    first, second = normal[two[:, 0]], normal[two[:, 1]]
    angle = 180.0 - np.degrees(
        np.arctan2(np.linalg.norm(np.cross(first, second), axis=1), (first * second).sum(axis=1))
    )
    return np.where(two[:, 1] >= 0, angle, np.nan)


def _fixed_error(grid: Grid, settings: Settings) -> Worst | None:
    """Return the largest distance of a position of the settings from the nearest fixed node."""
    if not settings.fixed:
        return None
    positions = np.array(settings.fixed) - grid.origin
    nodes = grid.nodes[grid.fixed] if grid.fixed.any() else grid.nodes
    return _worst(np.linalg.norm(positions[:, None] - nodes, axis=2).min(axis=1), positions, grid)


def _faults_of_topology(grid: Grid, found: Certificate, boundary: Boundary) -> list[Fault]:
    faults = []
    if not found.manifold:
        faults.append(Fault("manifold", "is not manifold", _seam(grid)))
    if not found.orientable:
        faults.append(Fault("orientable", "is not orientable"))
    if found.pieces != found.scan_pieces:
        words = f"is in {found.pieces} pieces where the scan has {found.scan_pieces}"
        faults.append(Fault("pieces", words, _smallest_piece(grid)))
    if found.boundary_loops != found.scan_loops:
        words = f"has {found.boundary_loops} boundary loops where the scan has {found.scan_loops}"
        faults.append(Fault("loops", words, _odd_loop(grid, boundary)))
    return faults


def _seam(grid: Grid) -> Place | None:
    """Return a place where a grid is not manifold: a member of three triangles, or a node of two fans."""
    wide = np.flatnonzero(grid.edge_uses > 2)
    if len(wide):
        return _place(grid.nodes[grid.edges[wide[0]]].mean(axis=0) + grid.origin)
    pinched = pinched_nodes(grid)
    return _place(grid.nodes[pinched[0]] + grid.origin) if len(pinched) else None


def _smallest_piece(grid: Grid) -> Place:
    """Return a place on the piece of fewest triangles."""
    piece = labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])[grid.triangles[:, 0]]
    found, count = np.unique(piece, return_counts=True)
    return _place(grid.nodes[found[np.argmin(count)]] + grid.origin)


def _odd_loop(grid: Grid, boundary: Boundary) -> Place:
    """Return a place on the loop that lies farthest from all others: of the grid where it has more loops, else of the scan."""
    own, theirs = [grid.nodes[loop] for loop in grid.boundary_loops], [loop.points for loop in boundary.loops]
    many, few = (own, theirs) if len(own) > len(theirs) else (theirs, own)
    if not few:
        return _place(min(many, key=len)[0] + grid.origin)
    others = np.concatenate(few)
    away = [np.median([np.linalg.norm(others - place, axis=1).min() for place in loop[::4]]) for loop in many]
    return _place(many[int(np.argmax(away))][0] + grid.origin)


def _faults_in_space(grid: Grid, found: Certificate, crossings: np.ndarray, settings: Settings) -> list[Fault]:
    faults = []
    if len(crossings):
        pairs = "a pair" if len(crossings) == 1 else f"{len(crossings)} pairs"
        more = " or more" if len(crossings) == ENOUGH else ""
        where = _place(grid.nodes[grid.triangles[crossings[0]]].mean(axis=(0, 1)) + grid.origin)
        faults.append(Fault("crossing", f"has {pairs}{more} of triangles that cut each other", where))
    if found.sharpest_fold and found.sharpest_fold.value < FOLDED:
        faults.append(Fault("folded", "is folded over onto itself", found.sharpest_fold.where))
    uneven = grid.quality.length_cv
    if uneven > UNEVEN and found.longest_member:
        words = f"has members whose lengths are {uneven:.0%} apart"
        faults.append(Fault("uneven", words, found.longest_member.where))
    if 1.0 - found.scan_within_reach > LEFT_OUT and found.farthest_scan:
        faults.append(
            Fault("cover", f"leaves out {1.0 - found.scan_within_reach:.0%} of the scan", found.farthest_scan.where)
        )
    gone = (ASTRAY + settings.smallest_hole / (2 * math.pi)) * settings.length
    for worst in (found.farthest_triangle, found.node_deviation):
        if worst and worst.value > gone:
            faults.append(Fault("astray", "covers what the scan does not", worst.where))
            break
    if found.fixed_error and not found.fixed_error.value <= OFF * settings.length:
        faults.append(Fault("fixed", "has no node at a fixed position", found.fixed_error.where))
    return faults
