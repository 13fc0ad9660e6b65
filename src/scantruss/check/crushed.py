"""Nodes at which a grid comes to a point where its scan does not: up a chimney, or on a foot or a knob that its members crush."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, place_of
from ..surface.chosen_samples import LIMB, SLIT
from .gaps import points_within
from .hanging import axes_of_nodes
from .limits import NOISES_OFF, PLACES_KEPT

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

# length of the mean of the unit vectors along the members of a node from which on that is pointed, and from which on it may be a spike:
# at the tip of a cone of 90 degrees it is 0.71
POINTED, SPIKE = 0.6, 0.7
# mean cosine between a spike and the normals of the sheet where its members end, at least: at knobs it is 0.69 at most
STANDS_ON_SHEET = 0.7
# pointed nodes within a distance of each other above which they are no spike but a part with a shape of its own, as an ear
MOST_SPIKES, BESIDE_SPIKE = 2, 3.0  # [member lengths]
AROUND_FOOT = 0.5  # radius around such an end in which points tell how the sheet lies [member lengths]
# radius around a pointed node in which the points tell whether the scan is pointed there too [member lengths]
AROUND_POINTED = 0.75
# distance from the grid, noise aside, from which on they lie off it [member lengths], and the share of them that do where it is not: at
# true corners and tips 0.4 at most
OFF_AT_POINT, MOSTLY_OFF = 0.1, 0.42
FEWEST_AT_POINT = 12  # fewest such points
# such nodes from which on a grid is frayed, and the share of the scan farther than a member from it that is missed beside them
FRAYED_FROM, FRAYED_MISSES = 6, 0.002


def spikes(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> list[Fault]:
    """Return a fault where a grid has spikes that stand on a sheet; parameters as of `crushed_parts`."""
    crushed, axes = _crushed_nodes(grid, samples, found, length)
    nodes = crushed[_stands_on_sheet(crushed, axes, grid, samples, length)]
    return _said("spike", "has a spike where its scan has none, as on a chimney or a stump", grid, nodes)


def crushed_parts(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> list[Fault]:
    """Return a warning where a grid comes to a point and its scan does not, but to no spike.

    Parameters
    ----------
    found : how far the points lie from the grid
    length : desired member length where the grid has none of its own [scan unit]
    """
    crushed, axes = _crushed_nodes(grid, samples, found, length)
    nodes = crushed[~_stands_on_sheet(crushed, axes, grid, samples, length)]
    words = "crushes a part of the scan that is narrow for its members, as a foot or a knob"
    return _said("crushed", words, grid, nodes, "; shorter members follow it")


def frayed(crushed: list[Fault], found: Distances, followed: np.ndarray, members: np.ndarray) -> list[Fault]:
    """Return a fault where a grid comes to a point at many places and misses the scan beside them, as a lip that its edge jumps along.

    Parameters
    ----------
    crushed : what `crushed_parts` returns
    followed : (N,) bool, points that the grid is to follow
    members : (N,) desired member length at each point [scan unit]
    """
    missed = float(np.mean(followed & (found.scan > members)))
    if missed < FRAYED_MISSES or not any(len(each.also) + 1 >= FRAYED_FROM for each in crushed):
        return []
    worst = crushed[0]
    places = len(worst.also) + 1
    more = " or more" if places == PLACES_KEPT else ""
    words = f"is frayed at {places} places{more}, where it comes to a point and misses {missed:.1%} of the scan"
    return [Fault("frayed", words, worst.where, worst.also)]


def _crushed_nodes(
    grid: Grid, samples: SurfaceSamples, found: Distances, length: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (K,) that are pointed though the points around them lie off the grid, the most of them first, and their axes (K, 3).

    Nodes of ridges and of the boundary are none, and those where a limb was cut off.
    """
    desired = np.full(len(grid.nodes), length) if grid.desired is None else grid.desired
    axes = axes_of_nodes(grid)[3]
    pointed = np.linalg.norm(axes, axis=1)
    pointed[grid.edges[grid.edge_triangles[:, 1] < 0]] = 0.0
    pointed[grid.lines] = 0.0
    candidates = np.flatnonzero(pointed > POINTED)
    if not len(candidates):
        return candidates, axes[candidates]
    order = np.argsort(samples.scan[:, 0], kind="stable")
    points, away, is_cut = samples.scan[order], found.scan[order], np.isin(samples.judged[order], (LIMB, SLIT))
    noise = NOISES_OFF * float(np.median(found.noise))
    share = np.zeros(len(grid.nodes))
    for node in candidates.tolist():
        place, reach = grid.nodes[node], AROUND_POINTED * desired[node]
        first, last = np.searchsorted(points[:, 0], (place[0] - reach, place[0] + reach))
        around = ((points[first:last] - place) ** 2).sum(axis=1) < reach**2
        if around.sum() >= FEWEST_AT_POINT and not is_cut[first:last][around].any():
            share[node] = np.mean(away[first:last][around] > OFF_AT_POINT * desired[node] + noise)
    crushed = np.flatnonzero(share > MOSTLY_OFF)
    crushed = crushed[np.argsort(-share[crushed], kind="stable")]
    return crushed, axes[crushed]


def _stands_on_sheet(
    nodes: np.ndarray, axes: np.ndarray, grid: Grid, samples: SurfaceSamples, length: float
) -> np.ndarray:
    """Return which pointed nodes (K,) with their axes (K, 3) are spikes that stand on a sheet (K,) bool."""
    stands = np.zeros(len(nodes), np.bool_)
    pointed = np.linalg.norm(axes, axis=1)
    sharp = np.flatnonzero(pointed > SPIKE)
    points = samples.points_by_x
    for number in sharp.tolist():
        apart = np.linalg.norm(grid.nodes[nodes] - grid.nodes[nodes[number]], axis=1)
        if (apart < BESIDE_SPIKE * length).sum() > MOST_SPIKES:
            continue
        feet = grid.edges[(grid.edges == nodes[number]).any(axis=1)].ravel()
        feet = feet[feet != nodes[number]]
        around = [points_within(grid.nodes[foot], AROUND_FOOT * length, points) for foot in feet]
        normals = [np.linalg.eigh(np.cov(each.T))[1][:, 0] for each in around if len(each) >= FEWEST_AT_POINT]
        if normals:
            stands[number] = np.abs(np.array(normals) @ axes[number]).mean() > STANDS_ON_SHEET * pointed[number]
    return stands


def _said(kind: str, words: str, grid: Grid, nodes: np.ndarray, advice: str = "") -> list[Fault]:
    """Return what is wrong with some nodes (K,), with their places; nothing where there is none."""
    if not len(nodes):
        return []
    more = f" ({len(nodes)} such places)" if len(nodes) > 1 else ""
    where, *others = (place_of(place + grid.origin) for place in grid.nodes[nodes[:PLACES_KEPT]])
    return [Fault(kind, words + more + advice, where, tuple(others))]
