"""What is wrong with a grid, in words and with a place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..errors import Place
from ..grid.certificate import Certificate, Fault, place_of
from ..grid.marks import node_marks
from ..grid.topology import pinched_nodes
from ..kernels.geometry.components import component_labels
from .crossings import MOST_CROSSINGS
from .limits import NOISES_OFF, PLACES_KEPT, WARN_OFFSET

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid
    from ..settings import Settings
    from .distances import Distances

#: members from the scan, beside the radius of the holes that are closed, at which a triangle has left it
OFF_SURFACE = 0.5
UNEVEN_LENGTHS = 0.4  #: standard deviation of the lengths, in mean lengths, from which on a grid follows no surface
FIXED_TOLERANCE = 1e-6  #: members that a fixed node may be off its position: nothing but rounding


def faults_of_topology(grid: Grid, found: Certificate, boundary: Boundary) -> list[Fault]:
    """Return what is wrong with a grid apart from where it lies."""
    faults = []
    if not found.manifold:
        faults.append(Fault("manifold", "is not manifold", _seam(grid)))
    elif not found.orientable:  # what is not manifold is one-sided at its seam
        faults.append(Fault("orientable", "is not orientable"))
    if found.pieces != found.scan_pieces:
        words = f"is in {found.pieces} pieces where the scan has {found.scan_pieces}".replace(" 1 pieces", " 1 piece")
        faults.append(Fault("pieces", words, _smallest_piece(grid)))
    if found.boundary_loops != found.scan_loops:
        words = f"has {found.boundary_loops} boundary loops where the scan has {found.scan_loops}"
        words = words.replace(" 1 boundary loops", " 1 boundary loop")
        faults.append(Fault("loops", words, _odd_loop(grid, boundary)))
    return faults


def _seam(grid: Grid) -> Place | None:
    """Return a place where a grid is not manifold: a member of three triangles, or a node of two fans."""
    wide = np.flatnonzero(grid.edge_uses > 2)
    if len(wide):
        return place_of(grid.nodes[grid.edges[wide[0]]].mean(axis=0) + grid.origin)
    pinched = pinched_nodes(grid)
    return place_of(grid.nodes[pinched[0]] + grid.origin) if len(pinched) else None


def _smallest_piece(grid: Grid) -> Place:
    """Return a place on the piece of fewest triangles."""
    piece = component_labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])[grid.triangles[:, 0]]
    found, count = np.unique(piece, return_counts=True)
    return place_of(grid.nodes[found[np.argmin(count)]] + grid.origin)


def _odd_loop(grid: Grid, boundary: Boundary) -> Place:
    """Return a place on the loop that lies farthest from all others: of the grid where it has more loops, else of the scan."""
    own, theirs = [grid.nodes[loop] for loop in grid.boundary_loops], [loop.points for loop in boundary.loops]
    many, few = (own, theirs) if len(own) > len(theirs) else (theirs, own)
    if not few:
        return place_of(min(many, key=len)[0] + grid.origin)
    others = np.concatenate(few)
    away = [np.median([np.linalg.norm(others - place, axis=1).min() for place in loop[::4]]) for loop in many]
    return place_of(many[int(np.argmax(away))][0] + grid.origin)


def _length_at(grid: Grid, where: Place, settings: Settings) -> float:
    """Return the length desired at a place: that at the nearest node [scan unit]."""
    if grid.desired is None:
        return settings.length
    away = ((grid.nodes + grid.origin - np.array(where)) ** 2).sum(axis=1)
    return float(grid.desired[away.argmin()])


def faults_in_space(
    grid: Grid, found: Certificate, crossings: np.ndarray, settings: Settings, patch: Place | None = None
) -> list[Fault]:
    """Return what is wrong with where the nodes are; `crossings` (P, 2) are triangles that cut each other.

    patch : the middle of the largest patch of the scan that is missed
    """
    faults = []
    if len(crossings):
        pairs = "a pair" if len(crossings) == 1 else f"{len(crossings)} pairs"
        more = " or more" if len(crossings) == MOST_CROSSINGS else ""
        middles = grid.nodes[grid.triangles[crossings]].mean(axis=(1, 2)) + grid.origin
        where, *others = (place_of(middle) for middle in middles[:PLACES_KEPT])
        words = f"has {pairs}{more} of triangles that cut each other"
        faults.append(Fault("crossing", words, where, tuple(others)))
    quality = grid.quality
    uneven = quality.length_cv if quality.stretch_cv is None else quality.stretch_cv
    if uneven > UNEVEN_LENGTHS and found.longest_member:
        words = f"has members whose lengths are {uneven:.0%} apart"
        faults.append(Fault("uneven", words, found.longest_member.where))
    if found.scan_distance and found.missing > settings.allow_missing:
        limbs = sum(part.share for part in found.left_out if part.kind == "limbs")
        thin = f", {limbs:.1%} on limbs too thin for the members" if limbs else ""
        words = f"leaves out {found.missing:.1%} of the scan{thin}"
        faults.append(Fault("cover", words, patch or found.scan_distance.largest.where))
    gone = OFF_SURFACE + settings.bridged_boundary_length / (2 * math.pi * settings.length)
    worst = found.triangle_distance.largest if found.triangle_distance else None
    if worst and worst.value > gone * _length_at(grid, worst.where, settings):
        faults.append(Fault("astray", "covers what the scan does not", worst.where))
    if found.fixed_error and not found.fixed_error.value <= FIXED_TOLERANCE * settings.length:
        faults.append(Fault("fixed", "has no node at a fixed position", found.fixed_error.where))
    return faults


def fixed_off_scan(grid: Grid, found: Distances, length: float) -> list[Fault]:
    """Return a warning of fixed nodes that make a spike or a dent, as they were put off the scan, with the mark of the worst."""
    own = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    off = np.where(grid.fixed & np.isfinite(found.nodes), found.nodes, 0.0) / own
    nodes = np.flatnonzero(off > WARN_OFFSET + NOISES_OFF * found.noise / own)
    if not len(nodes):
        return []
    nodes = nodes[np.argsort(-off[nodes], kind="stable")]
    worst, unit = nodes[0], f" {grid.unit}" if grid.unit else ""
    more = f" ({len(nodes)} such places)" if len(nodes) > 1 else ""
    words = (
        f"has its node {node_marks(grid)[worst]} {off[worst]:.2f} members, {found.nodes[worst]:.3g}{unit}, off the scan,"
        f" as its position is fixed{more}"
    )
    at, *others = (place_of(grid.nodes[node] + grid.origin) for node in nodes[:PLACES_KEPT])
    return [Fault("fixed", words, at, tuple(others))]
