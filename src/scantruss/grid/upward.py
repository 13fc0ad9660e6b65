"""Which way is up: z where unit or file say so, else what the shape of a grid tells; pictures and doubts of structures ask here."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..scan.cloud import SURVEY_UNITS
from .panels import turned_panels

if TYPE_CHECKING:
    from ..scan.cloud import PointCloud
    from .grid import Grid

AGAINST_GRAVITY = np.array([0.0, 0.0, 1.0])
OPEN_SHELL = 0.5  # length of the mean normal by area above which a shell is open: it faces one way on the whole
LEAST_FACING = 0.08  # length of the mean normal by area above which it decides which way is up if no flat face does
# part of the direction that such a shell faces along an axis above which it is that axis
ALONG_AXIS = math.cos(math.radians(25.0))
# upward part of the direction that such a shell faces, below which it stands if z is up: as a facade
LEVEL_FACING = 0.5
LEAST_RISE = 0.12  # depth of a shell along the axis that it faces above which that axis is up [longest side]
FACE_DEPTH = 0.02  # how flat the face is on which something stands [longest side]
FLAT_FACE = 0.1  # least share of such a face in the plan
Z_WEIGHT = {1: 1.0, 2: 3.0}  # how much flat faces at both ends of an axis count: most scans have z up
TALLER = 1.15  # how much longer the side of a body is along which it stands
# thickness up to which a body lies flat, and one that is long in x, as an animal on its legs is [middle side]
FLAT_BODY, FLAT_LONG_BODY = 0.5, 0.25
POLYGON_DIRECTIONS = 64  # directions in which a convex polygon is sought


def known_upward(grid: Grid, cloud: PointCloud | None) -> np.ndarray | None:
    """Return the direction against gravity (3,) if unit or file give it: scans of buildings and terrain have z up.

    So have those with a level floor under the grid, which is looked for along z alone.
    """
    on_floor = grid.certificate is not None and any(part.kind == "floor" for part in grid.certificate.left_out)
    known = grid.unit in SURVEY_UNITS or (cloud is not None and cloud.z_is_up) or on_floor
    return AGAINST_GRAVITY if known else None


def guessed_up(grid: Grid, cloud: PointCloud | None = None) -> str:
    """Return the axis that is up in pictures of a grid, such as y or -x, where its shape tells of another one than z; else ""."""
    if known_upward(grid, cloud) is not None or not len(grid.triangles):
        return ""
    upward = likely_upward(grid.nodes, facing_of(grid.nodes, grid.triangles))
    axis = int(np.abs(upward).argmax())
    name = f"{'-' if upward[axis] < 0.0 else ''}{'xyz'[axis]}"
    return "" if name == "z" else name


def picture_notes(grid: Grid, cloud: PointCloud | None = None) -> list[str]:
    """Return a note where a picture of a grid shows another axis up than files and structures have."""
    up = guessed_up(grid, cloud)
    return (
        [f"the picture shows {up} up, which is guessed from the shape; in files and structures z is up"] if up else []
    )


def facing_up(grid: Grid) -> Grid:
    """Return a grid on a map turned over where it is an open sheet that faces down, as a quarry whose centre lies above it; else as it is.

    It is turned over when it is made: which way its scan faces has a say in its front.
    """
    found = grid.certificate
    if facing_of(grid.nodes, grid.triangles)[2] > -OPEN_SHELL:
        return grid
    return grid.replace(
        triangles=np.ascontiguousarray(grid.triangles[:, ::-1]),
        panels=None if grid.panels is None else turned_panels(grid.panels, np.ones(len(grid.panels), np.bool_)),
        certificate=None if found is None else replace(found, node_bias=-found.node_bias),
    )


def facing_of(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the mean normal of a surface by area (3,): the shorter, the more closed it is."""
    a, b, c = nodes[triangles.T]
    normal = np.cross(b - a, c - a)
    facing: np.ndarray = normal.sum(axis=0) / (float(np.linalg.norm(normal, axis=1).sum()) or 1.0)
    return facing


def likely_upward(nodes: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Return the direction that is probably up (3,), where gravity is not known: y or z, along which the ends of an object differ most.

    It stands on a flat face, a foot or four legs, or has a lip above, and its two sides are much alike; where the ends differ nowhere, it
    stands on the larger ones. An open shell lies across the way it faces, with y or z of its file upwards: a net between masts and a bowl
    face down. But one that faces a side stands, as a facade, unless it faces along an axis and rises as a dome does. An object
    without flat faces stands along its longest side, or lies if it is flat.
    """
    openness = float(np.linalg.norm(facing))
    if openness > OPEN_SHELL:
        return AGAINST_GRAVITY.copy() if _is_facade(nodes, facing / openness) else _upward(facing / openness)
    shares = {axis: _end_shares(nodes, axis) for axis in (1, 2)}
    axis = max(shares, key=lambda each: np.ptp(shares[each]))
    if np.ptp(shares[axis]) <= FLAT_FACE:
        axis = max(shares, key=lambda each: Z_WEIGHT[each] * shares[each].min())
    if shares[axis].max() > FLAT_FACE:
        return np.eye(3)[axis]
    return _upward(facing / openness) if openness > LEAST_FACING else _standing(np.ptp(nodes, axis=0))


def _end_shares(nodes: np.ndarray, axis: int) -> np.ndarray:
    """Return the share in the plan of the flat faces at both ends of an axis (2,)."""
    across, height = np.delete(nodes, axis, axis=1), nodes[:, axis]
    depth = FACE_DEPTH * float(np.ptp(nodes, axis=0).max())
    ends = (height <= height.min() + depth, height >= height.max() - depth)
    return np.array([_area_around(across[end]) for end in ends]) / (float(np.prod(np.ptp(across, axis=0))) or 1.0)


def _is_facade(nodes: np.ndarray, facing: np.ndarray) -> bool:
    """Whether an open shell that faces some way (3,) stands if z is up, and is no shell that lies with another axis up."""
    extent, axis = np.ptp(nodes, axis=0), int(np.abs(facing).argmax())
    lies = abs(facing[axis]) > ALONG_AXIS and extent[axis] >= LEAST_RISE * extent.max()
    return bool(abs(facing[2]) < LEVEL_FACING and not lies)


def _area_around(flat: np.ndarray) -> float:
    """Return about the area of the smallest convex polygon around points (N, 2)."""
    if len(flat) < 3:
        return 0.0
    turn = np.linspace(0.0, 2.0 * np.pi, POLYGON_DIRECTIONS, endpoint=False)
    rays = np.stack([np.cos(turn), np.sin(turn)])
    corner = flat[(flat @ rays).argmax(axis=0)]
    after = np.roll(corner, -1, axis=0)
    return float(0.5 * abs((corner[:, 0] * after[:, 1] - corner[:, 1] * after[:, 0]).sum()))


def _upward(facing: np.ndarray) -> np.ndarray:
    """Return the direction itself, or the axis it is nearly along; the other way round if it is along -y or -z, which no file has up."""
    axis = int(np.argmax(np.abs(facing)))
    facing = -facing if axis in (1, 2) and facing[axis] < 0.0 else facing
    return np.eye(3)[axis] * np.sign(facing[axis]) if abs(facing[axis]) > ALONG_AXIS else facing


def _standing(extent: np.ndarray) -> np.ndarray:
    """Return the axis along which something without a flat face stands: y or z, as hardly a file has x up."""
    short, middle, long = np.argsort(extent, kind="stable")
    if long != 0 and extent[long] > TALLER * extent[middle]:
        return np.eye(3)[long]
    if short != 0 and extent[short] < (FLAT_BODY if long != 0 else FLAT_LONG_BODY) * extent[middle]:
        return np.eye(3)[short]
    return np.eye(3)[2 if extent[2] > TALLER * extent[1] else 1]
