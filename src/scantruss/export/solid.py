"""The printed model of Sec. 6: members and nodes as one watertight manifold solid."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, unit_words, words_of_number
from ..grid.certificate import check_passed
from ..grid.grid import Grid
from ..grid.marks import member_marks, node_marks
from ..layouts.framework import outer_normals
from ..runtime.files import write_files
from ..runtime.places import check_place
from .engraving import engraved, engraved_member
from .solid_files import Solid, encode_3mf, encode_stl

SUFFIXES = (".3mf", ".stl")
SLENDEREST_PRINTED = 2_000  #: largest length of a member, in diameters, that can be printed
MARKED_SIDES = 32  #: of balls with marks
PARTS_PER_UNION = 64  #: parts joined at a time; joining blocks of neighbours first is quicker than all at once


def print_model(
    grid: Grid,
    path: str | Path,
    *,
    member_diameter: float,
    node_diameter: float,
    scale: float = 1.0,
    sides: int = 12,
    marks: bool = False,
    keep_failed: bool = False,
    force: bool = False,
) -> Solid:
    """Write the grid as one watertight solid for a 3D printer.

    Parameters
    ----------
    grid : Grid
        The grid; its coordinates are multiplied by `scale`.
    path : str or Path
        File ending in .3mf (carries the unit) or .stl.
    member_diameter, node_diameter : float
        Diameters of the printed members and nodes, not scaled [unit of the grid].
    scale : float
        Size of the model over the size of the grid.
    sides : int
        Sides of a member.
    marks : bool
        Engrave the mark of each node on its ball.
    keep_failed : bool
        Print a grid even if it failed its certificate.
    force : bool
        Whether to write over files that ScanTruss did not write.

    Returns
    -------
    Solid
        What was written.

    Raises
    ------
    InputError
        The diameters do not suit the grid.
    CertificateError
        The grid failed its certificate.
    FormatError
        The file cannot be written.
    """
    path = check_place(path, SUFFIXES)
    check_passed(grid, keep_failed)
    solid = build_solid(
        grid, member_diameter=member_diameter, node_diameter=node_diameter, scale=scale, sides=sides, marks=marks
    )
    encode = encode_3mf if path.suffix.lower() == ".3mf" else encode_stl
    write_files({path: encode(solid)}, force=force)
    return solid


def build_solid(
    grid: Grid,
    *,
    member_diameter: float,
    node_diameter: float,
    scale: float = 1.0,
    sides: int = 12,
    marks: bool = False,
) -> Solid:
    """Return members (cylinders) and nodes (geodesic balls) of a grid, united.

    Parameters
    ----------
    grid : the grid; its coordinates are multiplied by `scale`
    member_diameter, node_diameter : diameters in the solid, not scaled [unit of the grid]
    scale : size of the solid over the size of the grid
    sides : sides of a member
    marks : engrave the marks of the nodes on their balls, those of the members along them

    Raises
    ------
    InputError
        Diameters that do not suit the grid, in words and figures.
    """
    check_diameters(grid, member_diameter, node_diameter, scale, sides)
    used, edges = np.unique(grid.edges, return_inverse=True)
    edges = edges.reshape(-1, 2)
    nodes = np.asarray(grid.nodes[used], np.float64) * scale
    bars = bars_of(nodes, edges, member_diameter / 2, sides)
    if marks:
        bars = marked_bars(grid, nodes, edges, bars, member_diameter / 2, (node_diameter / 2,) * 2, sides)
    parts = [*balls_of(grid, used, nodes, node_diameter / 2, sides, marks), *bars]
    order = _curve_order(np.concatenate([nodes, nodes[edges].mean(axis=1)]))
    pieces = _count_pieces(len(nodes), edges)
    return as_solid(unite([parts[k] for k in order]), grid.unit, pieces, len(edges) - len(nodes) + pieces)


def as_solid(body: Any, unit: str, pieces: int, genus: int) -> Solid:
    """Return what manifold3d made as a solid, with the pieces and openings that it has to have.

    Raises
    ------
    InputError
        It is not one closed surface around a volume.
    """
    mesh = body.to_mesh64()
    solid = Solid(
        vertices=np.ascontiguousarray(mesh.vert_properties[:, :3], np.float64),
        triangles=np.ascontiguousarray(mesh.tri_verts, np.int64),
        unit=unit,
        volume=float(body.volume()),
        components=len(body.decompose()),
        genus=0,
        expected_components=pieces,
        expected_genus=genus,
    )
    return _checked(solid)


def check_diameters(grid: Grid, member_diameter: float, node_diameter: float, scale: float, sides: int) -> None:
    """Refuse diameters and scales for which no solid looks like the grid."""
    for name, value in (("member diameter", member_diameter), ("node diameter", node_diameter), ("scale", scale)):
        if not (isinstance(value, int | float | np.number) and math.isfinite(value) and value > 0):
            raise InputError(f"the {name} must be a positive number, got {value}")
    if not (isinstance(sides, int | np.integer) and 3 <= sides <= 256):
        raise InputError(f"sides must be a whole number between 3 and 256, got {sides}")
    if len(grid.edges) == 0:
        raise InputError("the grid has no members, so there is nothing to print; give one with a triangle at least")
    unit = unit_words(grid.unit)
    if node_diameter < member_diameter:
        raise InputError(
            f"the node diameter {node_diameter:g}{unit} is smaller than the member diameter {member_diameter:g}{unit}; "
            f"a node must cover the ends of its members, so give at least {member_diameter:g}{unit}"
        )
    shortest = int(np.argmin(grid.lengths))
    length = float(grid.lengths[shortest]) * scale
    if member_diameter < length / SLENDEREST_PRINTED:
        raise InputError(
            f"members {words_of_number(length, 4)}{unit} long at scale {scale:g} would be {member_diameter:g}{unit} thick,"
            f" thinner than one in {SLENDEREST_PRINTED:,}; give a smaller scale or a larger diameter"
        )
    for name, value in (("member", member_diameter), ("node", node_diameter)):
        if value >= length:
            a, b = (node_marks(grid)[k] for k in grid.edges[shortest].tolist())
            raise InputError(
                f"the {name} diameter {value:g}{unit} is not smaller than the shortest member, {words_of_number(length, 4)}{unit} long "
                f"at scale {scale:g} (nodes {a} and {b}); give a smaller diameter or a larger scale"
            )


def balls_of(
    grid: Grid, ids: np.ndarray, nodes: np.ndarray, radius: float, sides: int, marks: bool = False
) -> list[Any]:
    """Return a ball for each of some nodes (K,) at their places in the solid (K, 3); `marks`: with their marks engraved outside."""
    from manifold3d import Manifold

    ball = Manifold.sphere(radius, max(sides, MARKED_SIDES) if marks else sides)
    if not marks:
        return [ball.translate(tuple(node)) for node in nodes.tolist()]
    names, normals = node_marks(grid), outer_normals(grid)
    return [
        engraved(ball, radius, names[k], normals[k]).translate(tuple(node))
        for k, node in zip(ids.tolist(), nodes.tolist(), strict=True)
    ]


def marked_bars(
    grid: Grid,
    nodes: np.ndarray,
    edges: np.ndarray,
    bars: list[Any],
    radius: float,
    taken: tuple[float, float],
    sides: int,
) -> list[Any]:
    """Return the members, or parts of them (E, 2), with their marks engraved outside; nodes of the solid.

    The marks stand in the middle of what is free: `taken` is what balls and joints take at the first end and at the second.
    """
    names, normals = member_marks(grid), outer_normals(grid)[grid.edges].sum(axis=1)
    made = []
    for name, normal, bar, (a, b) in zip(names, normals, bars, nodes[edges], strict=True):
        length = float(np.linalg.norm(b - a))
        way, room = (b - a) / length, length - sum(taken)
        made.append(engraved_member(bar, radius, sides, name, a + way * (taken[0] + room / 2), way, normal, room))
    return made


def bars_of(nodes: np.ndarray, edges: np.ndarray, radius: float, sides: int) -> list[Any]:
    """Return a cylinder for each member (E, 2) between nodes (V, 3) of the solid."""
    from manifold3d import Manifold

    bar = Manifold.cylinder(1.0, radius, radius, sides)
    return [bar.transform(frame) for frame in _frames(nodes, edges)]


def _frames(nodes: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return (E, 3, 4) transforms that turn, stretch and move a cylinder of length 1 along z onto each member."""
    axis = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    along = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    helper = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    first = np.cross(helper, along)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(along, first), axis, nodes[edges[:, 0]]], axis=2)


def _curve_order(places: np.ndarray) -> np.ndarray:
    """Return the order of places along a curve that keeps neighbours together (Morton's)."""
    low = places.min(axis=0)
    size = float((places.max(axis=0) - low).max()) or 1.0
    cell = np.minimum((places - low) / size * 1024, 1023).astype(np.int64)
    key = np.zeros(len(places), np.int64)
    for bit in range(10):
        for axis in range(3):
            key |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return np.argsort(key, kind="stable")


def unite(parts: list[Any]) -> Any:
    """Return the union of all parts, block by block."""
    from manifold3d import Manifold, OpType

    while len(parts) > 1:
        parts = [
            Manifold.batch_boolean(parts[k : k + PARTS_PER_UNION], OpType.Add)
            for k in range(0, len(parts), PARTS_PER_UNION)
        ]
    return parts[0]


def _count_pieces(count: int, edges: np.ndarray) -> int:
    """Return how many connected pieces the nodes form by their members."""
    label = np.arange(count)
    while True:
        lowest = label.copy()
        np.minimum.at(lowest, edges[:, 0], label[edges[:, 1]])
        np.minimum.at(lowest, edges[:, 1], label[edges[:, 0]])
        lowest = lowest[lowest]
        if np.array_equal(lowest, label):
            return len(np.unique(label))
        label = lowest


def is_watertight(triangles: np.ndarray) -> bool:
    """Whether every side of a triangle is met exactly once by a side in the opposite direction.

    Parameters
    ----------
    triangles : (M, 3) ids of vertices
    """
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    count = int(triangles.max(initial=-1)) + 1
    there, back = start * count + end, end * count + start
    distinct = np.unique(there)
    return len(triangles) > 0 and len(distinct) == len(there) and np.array_equal(distinct, np.unique(back))


def _checked(solid: Solid) -> Solid:
    """Return the solid with its genus, refused if it is not one closed surface around a volume."""
    euler = len(np.unique(solid.triangles)) - len(solid.triangles) * 3 // 2 + len(solid.triangles)
    if not (solid.volume > 0 and solid.components >= 1 and is_watertight(solid.triangles)):
        raise InputError(
            f"the grid gives no watertight solid (volume {words_of_number(solid.volume, 4)}, {solid.components} bodies); "
            f"check the grid and try slightly different diameters"
        )
    return replace(solid, genus=solid.components - euler // 2)
