"""Which way is up: z where unit or file say so, else what the shape of a grid tells; pictures and doubts of structures ask here."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.components import component_labels
from ..scan.checks import lies_on_map
from ..scan.cloud import SURVEY_UNITS
from .panels import turned_panels

if TYPE_CHECKING:
    from ..scan.cloud import PointCloud
    from .grid import Grid

AGAINST_GRAVITY = np.array([0.0, 0.0, 1.0])
OPEN_SHELL = 0.5  # length of the mean normal by area above which a shell is open: it faces one way on the whole
# length of the mean normal by area above which a piece faces one way, as a wall with the pavement before it; less is a bowl or a hull
FACES_ONE_WAY = 0.6
# downward part of that mean above which such a piece is turned over: a wall that leans faces as it does
FACES_DOWN = 0.2
LEAST_FACING = 0.08  # length of the mean normal by area above which it decides which way is up if no flat face does
# part of the direction that such a shell faces along an axis above which it is that axis
ALONG_AXIS = math.cos(math.radians(25.0))
LEAST_RISE = 0.12  # depth of a shell along the axis that it faces above which that axis is up [longest side]
FACE_DEPTH = 0.02  # how flat the face is on which something stands [longest side]
FLAT_FACE = 0.1  # least share of such a face in the plan
LEAST_FOOT = 0.06  # how much more of the plan the lower end must be flat than the upper one to be a foot
Z_WEIGHT = {1: 1.0, 2: 3.0}  # how much flat faces at both ends of an axis count: most scans have z up
Z_WEIGHT_UNLIKE = {1: 1.0, 2: 1.5}  # the same of ends that differ
FLAT_BASE = 0.2  # least share in the plan of the foot on which an open shell stands
UNLIKE_BASE = 0.5  # most of the upper end that may be as flat [share of the foot]
TALLER = 1.15  # how much longer the side of a body is along which it stands
# thickness up to which a body lies flat, and one that is long in x, as an animal on its legs is [middle side]
FLAT_BODY, FLAT_LONG_BODY = 0.5, 0.25
POLYGON_DIRECTIONS = 64  # directions in which a convex polygon is sought


def known_upward(grid: Grid, cloud: PointCloud | None) -> np.ndarray | None:
    """Return the direction against gravity (3,) if unit, file or a place on a map give it: scans of buildings and terrain have z up.

    So have those with a level floor under the grid, which is looked for along z alone.
    """
    on_floor = grid.certificate is not None and any(part.kind == "floor" for part in grid.certificate.left_out)
    of_survey = cloud is not None and (cloud.z_is_up or lies_on_map(cloud.origin, cloud.extent))
    known = grid.unit in SURVEY_UNITS or of_survey or on_floor
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
    words = (
        f"the picture shows {up} up, guessed from the shape (--unit m or foot: z up); in files and structures z is up"
    )
    return [words] if up else []


def facing_up(grid: Grid, cloud: PointCloud) -> Grid:
    """Return a grid of which each open piece that faces down is turned over: a roof above a floor, a quarry whose centre lies above it.

    Up is what is known or likely; normals that came with the scan decide instead. It is turned over when it is made: which way its scan
    faces has a say in its front. The mean bias of its nodes changes sign where all pieces are turned over, and is left where only some are.
    """
    if not len(grid.triangles) or cloud.normals is not None:
        return grid
    known = known_upward(grid, cloud)
    upward = likely_upward(grid.nodes, facing_of(grid.nodes, grid.triangles)) if known is None else known
    piece = component_labels(len(grid.nodes), *grid.edges.T)
    of_triangle, turned = piece[grid.triangles[:, 0]], np.zeros(len(grid.nodes), np.bool_)
    for each in np.unique(of_triangle):
        facing = facing_of(grid.nodes, grid.triangles[of_triangle == each])
        turned[piece == each] = np.linalg.norm(facing) > FACES_ONE_WAY and facing @ upward < -FACES_DOWN
    if not turned.any():
        return grid
    found, every = grid.certificate, bool(turned[grid.triangles].all())
    return grid.replace(
        triangles=np.where(turned[grid.triangles[:, :1]], grid.triangles[:, ::-1], grid.triangles),
        panels=None if grid.panels is None else turned_panels(grid.panels, turned[grid.panels[:, 0]]),
        certificate=replace(found, node_bias=-found.node_bias) if found is not None and every else found,
    )


def facing_of(nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the mean normal of a surface by area (3,): the shorter, the more closed it is."""
    a, b, c = nodes[triangles.T]
    normal = np.cross(b - a, c - a)
    facing: np.ndarray = normal.sum(axis=0) / (float(np.linalg.norm(normal, axis=1).sum()) or 1.0)
    return facing


def likely_upward(nodes: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """Return the direction that is probably up (3,), where gravity is not known: an axis of the file, z where little tells of another.

    It stands on a flat face, a foot or four legs, or has a lip above, and its two sides are much alike: y or z, along which the ends
    differ most, and the lower one is flat rather than the upper. Where they differ nowhere, it stands on the larger ones. An object
    without flat faces stands along its longest side, or lies if it is flat. An open shell lies across the axis that it faces, if it rises
    along that as a dome does, with y or z upwards: a net between masts and a bowl face down. But with a flat base at the low end of z, as
    the foot of an apse or the pavement before a facade, it stands.
    """
    openness, shares = float(np.linalg.norm(facing)), {axis: _end_shares(nodes, axis) for axis in (1, 2)}
    axis, extent = int(np.abs(facing).argmax()), np.ptp(nodes, axis=0)
    faces_axis = abs(facing[axis]) > ALONG_AXIS * openness
    upward = np.eye(3)[axis] * (np.sign(facing[axis]) if axis == 0 else 1.0)  # no file has -y or -z up
    if openness > OPEN_SHELL:
        lies = faces_axis and extent[axis] >= LEAST_RISE * extent.max()
        return upward if lies and not _is_base(shares[2]) else AGAINST_GRAVITY.copy()
    foot = {each: float(shares[each][0] - shares[each][1]) for each in (1, 2)}
    unlike = [each for each in (1, 2) if foot[each] > LEAST_FOOT or -foot[each] > FLAT_FACE]
    if unlike:
        return np.eye(3)[max(unlike, key=lambda each: (foot[each] > 0.0, Z_WEIGHT_UNLIKE[each] * abs(foot[each])))]
    largest = max(shares, key=lambda each: Z_WEIGHT[each] * shares[each].min())
    if shares[largest].max() > FLAT_FACE:
        return np.eye(3)[largest]
    return upward if openness > LEAST_FACING and faces_axis else _standing(extent)


def _end_shares(nodes: np.ndarray, axis: int) -> np.ndarray:
    """Return the share in the plan of the flat faces at both ends of an axis (2,)."""
    across, height = np.delete(nodes, axis, axis=1), nodes[:, axis]
    depth = FACE_DEPTH * float(np.ptp(nodes, axis=0).max())
    ends = (height <= height.min() + depth, height >= height.max() - depth)
    return np.array([_area_around(across[end]) for end in ends]) / (float(np.prod(np.ptp(across, axis=0))) or 1.0)


def _is_base(shares: np.ndarray) -> bool:
    """Whether the lower end of an axis is a flat base and the upper one no such face, by their shares (2,)."""
    return bool(shares[0] > FLAT_BASE and shares[1] < UNLIKE_BASE * shares[0])


def _area_around(flat: np.ndarray) -> float:
    """Return about the area of the smallest convex polygon around points (N, 2)."""
    if len(flat) < 3:
        return 0.0
    turn = np.linspace(0.0, 2.0 * np.pi, POLYGON_DIRECTIONS, endpoint=False)
    rays = np.stack([np.cos(turn), np.sin(turn)])
    corner = flat[(flat @ rays).argmax(axis=0)]
    after = np.roll(corner, -1, axis=0)
    return float(0.5 * abs((corner[:, 0] * after[:, 1] - corner[:, 1] * after[:, 0]).sum()))


def _standing(extent: np.ndarray) -> np.ndarray:
    """Return the axis along which something without a flat face stands: y or z, as hardly a file has x up."""
    short, middle, long = np.argsort(extent, kind="stable")
    if long != 0 and extent[long] > TALLER * extent[middle]:
        return np.eye(3)[long]
    if short != 0 and extent[short] < (FLAT_BODY if long != 0 else FLAT_LONG_BODY) * extent[middle]:
        return np.eye(3)[short]
    return np.eye(3)[2 if extent[2] > TALLER * extent[1] else 1]
