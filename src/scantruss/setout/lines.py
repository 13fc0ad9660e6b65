"""Lines to set out by: sections of the grid by vertical planes, and boundaries unrolled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..grid.grid import Grid
from ..layouts.framework import Framework
from .settings import MOST_SECTIONS, Cut, SetoutSettings

AT_NODE = 1e-9  # share of a member within which a section meets its node


@dataclass(frozen=True, eq=False)
class SectionLine:
    """Where a vertical plane cuts the grid [mm, building frame]."""

    name: str  #: such as "x = 2500"
    axis: int  #: of the direction across: 0 or 1
    place: float
    members: np.ndarray  #: (K,) the member at each point, sorted along the section
    nodes: np.ndarray  #: (K,) the node where the plane meets one, else -1
    points: np.ndarray  #: (K, 3)
    segments: np.ndarray  #: (S, 2, 3) of the cut through the panels

    @property
    def flat(self) -> np.ndarray:
        """(K, 2) along the section and up."""
        return self.points[:, [1 - self.axis, 2]]


@dataclass(frozen=True, eq=False)
class Unrolled:
    """A boundary loop unrolled on the vertical cylinder over its plan [mm]."""

    nodes: np.ndarray  #: (K,) from the lowest id on
    along: np.ndarray  #: (K + 1,) developed length in plan; the last closes the loop
    length: np.ndarray  #: (K + 1,) true length
    height: np.ndarray  #: (K + 1,) z
    turn: np.ndarray  #: (K,) of the loop in plan, left positive [degree]; NaN where a member stands upright


def cut_grid(grid: Grid, places: np.ndarray, plane: Cut) -> SectionLine:
    """Return the section of a grid, nodes at `places` (V, 3) [mm], by a vertical plane."""
    name, axis = f"{plane[0]} = {plane[1]:g}", "xy".index(plane[0])
    off = places[:, axis] - plane[1]
    side = off >= 0
    start, end = grid.edges.T
    cut = np.flatnonzero((side[start] != side[end]) & _set_out(grid))
    share = off[start[cut]] / (off[start[cut]] - off[end[cut]])
    node = np.where(share < AT_NODE, start[cut], np.where(share > 1 - AT_NODE, end[cut], -1))
    points = places[start[cut]] + share[:, None] * (places[end[cut]] - places[start[cut]])
    points = np.where(node[:, None] >= 0, places[node], points)
    order = np.lexsort((cut, points[:, 2], points[:, 1 - axis]))
    first = np.ones(len(order), bool)  # of several members that meet at a node the first stands
    seen: set[int] = set()
    for rank, number in enumerate(node[order].tolist()):
        first[rank] = number < 0 or number not in seen
        seen.add(number)
    order = order[first]
    segments = np.concatenate([_segments(grid, places, off), _inner_segments(grid, places, axis, plane[1])])
    return SectionLine(name, axis, plane[1], cut[order], node[order], points[order], segments)


def _set_out(grid: Grid) -> np.ndarray:
    """Return of which members (E,) the heights are set out: all but webs."""
    return grid.is_chord() if isinstance(grid, Framework) else np.ones(len(grid.edges), bool)


def _inner_segments(grid: Grid, places: np.ndarray, axis: int, place: float) -> np.ndarray:
    """Return the segments (S, 2, 3) in which a plane cuts the panels of lower layers."""
    found = [np.zeros((0, 2, 3))]
    panels = grid.layers.panels if isinstance(grid, Framework) and grid.layers is not None else ()
    for panel in panels:
        corners = places[panel]
        off, following = corners[:, axis] - place, np.roll(corners, -1, axis=0)
        beyond = following[:, axis] - place
        cut = np.flatnonzero((off >= 0) != (beyond >= 0))
        if len(cut) == 2:
            share = (off[cut] / (off[cut] - beyond[cut]))[:, None]
            found.append((corners[cut] + share * (following[cut] - corners[cut]))[None])
    return np.concatenate(found)


def _segments(grid: Grid, places: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Return the parts (S, 2, 3) of a section within triangles, by the distances of the nodes from its plane (V,)."""
    surface, side = grid.triangulated, off >= 0
    start, end = surface.edges.T
    cut = np.flatnonzero(side[start] != side[end])
    share = (off[start[cut]] / (off[start[cut]] - off[end[cut]]))[:, None]
    share = np.where(share < AT_NODE, 0.0, np.where(share > 1 - AT_NODE, 1.0, share))
    points = places[start[cut]] + share * (places[end[cut]] - places[start[cut]])
    at = np.full(len(surface.edges), -1)
    at[cut] = np.arange(len(cut))
    sides = at[surface.half_edge_edges.reshape(3, -1).T]
    return points[np.sort(sides[(sides >= 0).sum(axis=1) == 2], axis=1)[:, 1:]]


def unroll(grid: Grid, places: np.ndarray) -> list[Unrolled]:
    """Return the boundary loops of a grid unrolled, nodes at `places` (V, 3) [mm]; the longest first."""
    found = []
    for loop in grid.boundary_loops:
        nodes = np.roll(loop, -int(np.argmin(loop)))
        steps = np.diff(places[[*nodes, nodes[0]]], axis=0)
        flat = np.hypot(*steps[:, :2].T)
        before = np.roll(steps, 1, axis=0)
        turn = np.degrees(
            np.arctan2(
                before[:, 0] * steps[:, 1] - before[:, 1] * steps[:, 0], (before[:, :2] * steps[:, :2]).sum(axis=1)
            )
        )
        turn[(flat == 0) | (np.roll(flat, 1) == 0)] = np.nan
        along, length = (np.concatenate([[0.0], np.cumsum(each)]) for each in (flat, np.linalg.norm(steps, axis=1)))
        found.append(Unrolled(nodes, along, length, places[[*nodes, nodes[0]], 2], turn))
    return sorted(found, key=lambda each: -each.length[-1])


def section_lines(grid: Grid, places: np.ndarray, settings: SetoutSettings) -> list[SectionLine]:
    """Return the sections that are asked for; by default through the middle of x and y. Those of a spacing may meet nothing.

    Raises
    ------
    InputError
        A section that is named meets no member, or there are too many.
    """
    used = places[np.unique(grid.edges)]
    low, high = used.min(axis=0), used.max(axis=0)
    planes: list[Cut] = []
    if (step := settings.spacing) is not None:
        if (high - low)[:2].sum() / step > MOST_SECTIONS:
            raise InputError(f"sections {step:g} mm apart would be more than {MOST_SECTIONS}; give a larger spacing")
        for k, axis in enumerate("xy"):
            numbers = np.arange(np.floor(low[k] / step) + 1, np.ceil(high[k] / step))
            planes += [(axis, float(number * step)) for number in numbers]
    elif not settings.sections:
        planes = [(axis, float(round((low[k] + high[k]) / 2))) for k, axis in enumerate("xy")]
    found = [cut_grid(grid, places, plane) for plane in (*settings.sections, *planes)]
    for line in found[: len(settings.sections)]:
        if len(line.points) == 0:
            reach = f"{low[line.axis]:.0f} to {high[line.axis]:.0f} mm"
            raise InputError(f"the section {line.name} meets no member; they reach from {reach}")
    return [line for line in found if len(line.points)]
