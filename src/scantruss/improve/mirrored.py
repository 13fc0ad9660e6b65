"""Grids that are exactly symmetric: the part between two walls, mirror planes or lines of half turns, and its images."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..boundary.curves import length_along
from ..errors import FrontError
from ..grid.grid import Grid
from ..grid.line_sets import FIXED_LINE, LineSet
from ..grid.panels import triangles_of
from ..scan.rotation import turn_about
from ..scan.symmetry import MirrorPlane

ON_PLANE = 0.25  #: farthest node of a cut from its plane [member lengths]
LEAST_PIECE = 0.5  #: shorter pieces of the line in which a plane meets the grid are left out [member lengths]
MIRROR_LINE = "mirror"  #: begins the names of the lines on mirror planes


@dataclass(frozen=True, eq=False)
class Wedge:
    """The part of space that is kept: one side of a plane, or between two that meet in a line."""

    walls: list[tuple[np.ndarray, float]]  #: inner normals and offsets
    rays: list[np.ndarray | None]  #: along each wall, away from the line; None of a single plane
    centre: np.ndarray  #: (3,) on the line
    axis: np.ndarray | None  #: (3,) along the line
    copies: int
    half_turns: bool = False  #: about lines of the surface along each wall, instead of reflections

    def matrices(self) -> list[np.ndarray]:
        """Return the (3, 3) of all images about `centre`, one after the other around the line: odd ones reflect or turn over."""
        first = self.walls[0][0]
        mirror = np.eye(3) - 2.0 * np.outer(first, first)
        if self.axis is None:
            return [np.eye(3), mirror]
        if self.half_turns:
            mirror = mirror @ (np.eye(3) - 2.0 * np.outer(self.axis, self.axis))
        made = []
        for k in range(self.copies):
            angle = 2.0 * math.pi / self.copies * (k if k % 2 == 0 else k + 1)
            turn = turn_about(self.axis, angle)
            made.append(turn if k % 2 == 0 else turn @ mirror)
        return made


def wedge_of(planes: Sequence[MirrorPlane], origin: np.ndarray, *, half_turns: bool = False) -> Wedge:
    """Return the part that is kept, relative to an origin: at the first plane, on the side of its normal."""
    normal = np.array(planes[0].normal)
    centre = np.array(planes[0].point) - origin
    if len(planes) == 1:
        return Wedge([(normal, float(normal @ centre))], [None], centre, None, 2)
    others = np.array([plane.normal for plane in planes[1:]])
    offsets = np.array([float(np.dot(plane.point - origin, plane.normal)) for plane in planes])
    axis = np.cross(normal, others[0])
    axis /= np.linalg.norm(axis)
    table = np.concatenate([normal[None], others, axis[None]])
    centre = np.linalg.lstsq(table, np.append(offsets, float(axis @ centre)), rcond=None)[0]
    first = np.cross(normal, axis)  # along the first plane
    angle = math.pi / len(planes)
    second = math.cos(angle) * first + math.sin(angle) * normal
    inner = math.sin(angle) * first - math.cos(angle) * normal
    walls = [(normal, float(normal @ centre)), (inner, float(inner @ centre))]
    return Wedge(walls, [first, second], centre, np.cross(first, normal), 2 * len(planes), half_turns)


def sides_of_mirror(planes: Sequence[MirrorPlane]) -> list[Sequence[MirrorPlane]]:
    """Return the planes, and of a single one the same facing the other way: the other side can be kept as well."""
    if len(planes) > 1:
        return [planes]
    x, y, z = planes[0].normal
    return [planes, [replace(planes[0], normal=(-x, -y, -z))]]


def mirror_lines(grid: Grid, wedge: Wedge, length: float) -> list[np.ndarray]:
    """Return the lines (K, 3) in which the walls of the part that is kept meet a grid, in the frame of the scan."""
    found: list[np.ndarray] = []
    for (normal, offset), ray in zip(wedge.walls, wedge.rays, strict=True):
        for line in section_of(grid, normal, offset):
            pieces = [line] if ray is None else beyond_axis(line, wedge.centre, ray)
            long = [each for each in pieces if length_along(each) >= LEAST_PIECE * length]
            found += [each + grid.origin for each in long]
    if wedge.axis is None:
        return found
    starts = [each for each in found if np.linalg.norm(_off_axis(each[0] - grid.origin, wedge)) < 1e-9 * length]
    for each in starts[1:]:  # lines of both walls begin at one place of the axis
        near = min(starts, key=lambda other: float(np.linalg.norm(other[0] - each[0])))
        if np.linalg.norm(near[0] - each[0]) < length:
            each[0] = near[0]
    return found


def mirrored_grid(grid: Grid, wedge: Wedge, length: float) -> Grid:
    """Return the grid of the part that is kept and its images, of triangles or quads, which share the nodes on the walls.

    Raises
    ------
    FrontError
        The rows do not follow the planes: the part cannot be cut off along them.
    """
    middles = grid.nodes[grid.panel_table].mean(axis=1)
    inside = np.all([middles @ normal > offset for normal, offset in wedge.walls], axis=0)
    kept = grid.panel_table[inside]
    if len(kept) == 0:
        raise FrontError("no grid lies on the side of the mirror planes that is kept; leave --symmetry out", grid)
    nodes, on = _on_walls(grid, inside, wedge, length)
    used = np.unique(kept)
    depth = np.array([nodes[used] @ normal - offset for normal, offset in wedge.walls])
    beyond = used[((depth < 1e-9 * length) & ~on[:, used]).any(axis=0)]
    flat = kept[on[:, kept].all(axis=2).any(axis=0)]
    if len(bad := np.concatenate([beyond, flat.ravel()])):
        refuse_rows(grid, bad[0])
    at_wall = np.where(on[0], 0, np.where(on[-1], 1, -1)) if len(on) > 1 else np.where(on[0], 0, -1)
    on_axis = np.asarray(on.all(axis=0)) & (len(on) > 1)
    return united(grid, nodes, kept, at_wall, on_axis, wedge)


def check_lines_kept(before: Grid, made: Grid, length: float, symmetry: str = "the mirror planes") -> None:
    """Refuse images of which the fixed lines are not those that the user gave, since these are not symmetric.

    Raises
    ------
    FrontError
        A node of a fixed line lies farther than a quarter of a member from all lines of the images.
    """
    own = [line for line in before.line_sets if line.kind == FIXED_LINE and not line.name.startswith(MIRROR_LINE)]
    if not own:
        return
    start = made.nodes[made.lines[:, 0]]
    along = made.nodes[made.lines[:, 1]] - start
    for line in own:
        for node in line.nodes.tolist():
            away = before.nodes[node] - start
            share = np.clip((away * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300), 0.0, 1.0)
            if np.linalg.norm(away - share[:, None] * along, axis=1).min(initial=math.inf) > ON_PLANE * length:
                where = ", ".join(f"{c:.5g}" for c in before.scan_nodes[node])
                raise FrontError(
                    f"the fixed line {line.name} is not symmetric in {symmetry}, near ({where}); give its image too",
                    made,
                )


def united(
    grid: Grid,
    nodes: np.ndarray,
    kept: np.ndarray,
    at_wall: np.ndarray,
    on_axis: np.ndarray,
    wedge: Wedge,
    beyond: np.ndarray | None = None,
) -> Grid:
    """Return all images of the part as one grid; images of a node on a wall are one.

    Parameters
    ----------
    grid : Grid
    nodes : (V, 3) float64
    kept : (K, W)
        Panels of the part.
    at_wall : (V,)
        Number of the wall that a node is on, -1 for none.
    on_axis : (V,) bool
    wedge : Wedge
    beyond : (V,), optional
        Of a node beyond the second wall that it is the image of, -1 of the others: panels with one lie across the wall.
    """
    beyond = np.full(len(nodes), -1) if beyond is None else beyond
    used = np.unique(kept[beyond[kept] < 0])
    matrices = wedge.matrices()
    keys = np.empty((len(matrices), len(nodes)), np.int64)
    for k in range(len(matrices)):
        ray = (k + (at_wall if k % 2 == 0 else 1 - at_wall)) % len(matrices) if wedge.axis is not None else 0 * at_wall
        image = np.where(on_axis, 0, np.where(at_wall >= 0, ray, len(matrices) + k))
        keys[k] = np.arange(len(nodes)) * 3 * len(matrices) + image
    distinct, first, inverse = np.unique(keys[:, used].ravel(), return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    number = np.empty(len(distinct), np.int64)
    number[order] = np.arange(len(distinct))
    number_of = np.full((len(matrices), len(nodes)), -1)
    number_of[:, used] = number[inverse.ravel()].reshape(len(matrices), -1)
    image_of, source = np.divmod(first[order], len(used))
    source = used[source]
    places = nodes[source] - wedge.centre
    made = np.einsum("vij,vj->vi", np.array(matrices)[image_of], places) + wedge.centre
    made[image_of == 0] = nodes[source[image_of == 0]]
    others = np.flatnonzero(beyond >= 0)
    for k in range(len(matrices)):
        across = matrices[k] @ matrices[1]  # the image beyond the second wall
        there = int(np.argmin([np.abs(across - each).max() for each in matrices]))
        number_of[k, others] = number_of[there, beyond[others]]
    back = [0, *range(kept.shape[1] - 1, 0, -1)]  # corners of a panel seen from the other side
    inner = kept[(beyond[kept] < 0).all(axis=1)]  # what lies across a wall is in one of the two images
    panels = np.concatenate([number_of[k][kept if k % 2 == 0 else inner[:, back]] for k in range(len(matrices))])
    return with_panels(
        grid,
        made,
        panels,
        fixed=grid.fixed[source],
        lines=images_of_members(grid.lines, number_of),
        line_sets=images_of_lines(grid.line_sets, number_of),
        deviation=None if grid.deviation is None else grid.deviation[source],
        desired=None if grid.desired is None else grid.desired[source],
    )


def with_panels(grid: Grid, nodes: np.ndarray, panels: np.ndarray, **others: Any) -> Grid:
    """Return a grid with other nodes (V, 3), panels (P, 3) or quads (P, 4) as it has them, and other tables."""
    if grid.panels is None:
        return grid.replace(nodes=nodes, triangles=panels, **others)
    return grid.replace(nodes=nodes, triangles=triangles_of(nodes, panels), panels=panels, **others)


def without_edge_lines(grid: Grid) -> Grid:
    """Return a grid without the lines along which its parts meet; other lines stay, those along the same members too."""
    own = [line for line in grid.line_sets if not line.name.startswith(MIRROR_LINE)]
    on_edges = _members_of([line for line in grid.line_sets if line.name.startswith(MIRROR_LINE)])
    of_own = _members_of(own)
    lines = [
        pair for pair in np.sort(grid.lines, axis=1).tolist() if tuple(pair) in of_own or tuple(pair) not in on_edges
    ]
    return grid.replace(lines=np.array(lines, np.int64).reshape(-1, 2), line_sets=tuple(own))


def _members_of(lines: list[LineSet]) -> set[tuple[int, int]]:
    """Return the pairs of nodes, lower first, that follow each other on lines."""
    found = set()
    for line in lines:
        nodes = line.nodes.tolist()
        found |= {(min(a, b), max(a, b)) for a, b in zip(nodes, nodes[1:] + nodes[:1], strict=True)}
    return found


def images_of_members(lines: np.ndarray, number_of: np.ndarray) -> np.ndarray:
    """Return the images of members along lines (K, 2), each once; number_of: of each node in each image (M, V), -1 for none."""
    made = np.concatenate([each[lines] for each in number_of])
    return np.unique(np.sort(made[(made >= 0).all(axis=1)], axis=1), axis=0)


def images_of_lines(lines: Sequence[LineSet], number_of: np.ndarray) -> tuple[LineSet, ...]:
    """Return lines with their images, each line once; number_of: of each node in each image (M, V), -1 for none."""
    found: list[LineSet] = []
    seen: set[tuple[int, ...]] = set()
    for line in lines:
        for k, numbers in enumerate(number_of):
            nodes = numbers[line.nodes]
            nodes = nodes[nodes >= 0]
            if len(nodes) > 1 and (key := tuple(np.sort(nodes).tolist())) not in seen:
                seen.add(key)
                found.append(LineSet(line.name if k == 0 else f"{line.name} image {k}", line.kind, nodes))
    return tuple(found)


def _on_walls(grid: Grid, inside: np.ndarray, wedge: Wedge, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes, those of the cut brought onto the walls, and on which walls (W, V) they are."""
    uses = np.bincount(grid.panel_members[inside].ravel(), minlength=len(grid.edges))
    cut = np.unique(grid.edges[(uses == 1) & (grid.edge_uses == 2)])
    nodes = grid.nodes.copy()
    on = np.zeros((len(wedge.walls), len(nodes)), bool)
    off = np.abs([nodes[cut] @ normal - offset for normal, offset in wedge.walls])
    if len(cut) and (far := off.min(axis=0)).max() > ON_PLANE * length:
        refuse_rows(grid, cut[int(far.argmax())])
    if wedge.axis is not None and len(cut):
        from_axis = np.linalg.norm(_off_axis(nodes[cut], wedge), axis=1)
        at_axis = np.argmin(from_axis)
        if from_axis[at_axis] < ON_PLANE * length and (off[:, at_axis] < ON_PLANE * length).all():
            node = cut[at_axis]
            nodes[node] -= _off_axis(nodes[node], wedge)
            on[:, node] = True
            cut, off = np.delete(cut, at_axis), np.delete(off, at_axis, axis=1)
    wall = off.argmin(axis=0)
    for number, (normal, offset) in enumerate(wedge.walls):
        own = cut[wall == number]
        nodes[own] -= np.outer(nodes[own] @ normal - offset, normal)
        on[number, own] = True
    return nodes, on


def _off_axis(places: np.ndarray, wedge: Wedge) -> np.ndarray:
    """Return what leads from the line of the planes to places."""
    assert wedge.axis is not None
    away = places - wedge.centre
    return np.asarray(away - (away @ wedge.axis)[..., None] * wedge.axis)


def section_of(grid: Grid, normal: np.ndarray, offset: float) -> list[np.ndarray]:
    """Return the open and closed lines (K, 3) in which a plane cuts the triangles of a grid."""
    above = grid.nodes @ normal - offset
    side = above >= 0
    start, end = grid.edges.T
    cut = np.flatnonzero(side[start] != side[end])
    share = above[start[cut]] / (above[start[cut]] - above[end[cut]])
    place = dict(
        zip(
            cut.tolist(),
            grid.nodes[start[cut]] + share[:, None] * (grid.nodes[end[cut]] - grid.nodes[start[cut]]),
            strict=True,
        )
    )
    near: dict[int, list[int]] = {edge: [] for edge in place}
    for edges in grid.half_edge_edges.reshape(3, -1).T.tolist():
        crossed = [edge for edge in edges if edge in place]
        if len(crossed) == 2:
            near[crossed[0]].append(crossed[1])
            near[crossed[1]].append(crossed[0])
    lines, left = [], set(near)
    for first in sorted(near, key=lambda edge: (len(near[edge]) != 1, edge)):  # open lines first, from their ends
        if first not in left:
            continue
        line, edge = [first], first
        left.discard(first)
        while following := [each for each in near[edge] if each in left]:  # each turn takes an edge
            edge = following[0]
            left.discard(edge)
            line.append(edge)
        if len(line) > 2 and first in near[edge]:
            line.append(first)
        lines.append(np.array([place[each] for each in line]))
    return lines


def beyond_axis(line: np.ndarray, centre: np.ndarray, ray: np.ndarray) -> list[np.ndarray]:
    """Return the pieces of a line on the side of a ray from the axis, each from the axis outwards where it meets that."""
    along = (line - centre) @ ray
    pieces: list[np.ndarray] = []
    now: list[np.ndarray] = []
    for k in range(len(line)):
        if k and (along[k] > 0) != (along[k - 1] > 0):
            share = along[k - 1] / (along[k - 1] - along[k])
            now.append(line[k - 1] + share * (line[k] - line[k - 1]))
            if along[k] <= 0:
                pieces.append(np.array(now[::-1]))
                now = []
        if along[k] > 0:
            now.append(line[k])
    if len(now) > 1:
        pieces.append(np.array(now))
    return pieces


def refuse_rows(grid: Grid, node: int, lines: str = "the mirror planes") -> None:
    """Refuse a grid of which the rows do not follow the planes, or other lines."""
    where = ", ".join(f"{c:.5g}" for c in grid.scan_nodes[node])
    raise FrontError(
        f"the rows do not follow {lines} at ({where}); try another --length, or leave --symmetry out", grid
    )
