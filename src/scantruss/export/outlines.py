"""Outlines of sections: closed loops of lines and arcs, and the closed surfaces of members made of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..structure.catalogue import Section

Place2 = tuple[float, float]  # along the local y and z of a member

SIDES_PER_QUARTER = 6  #: of a round outline where it becomes a polygon


@dataclass(frozen=True)
class Side:
    """A line of an outline, or an arc about a centre, from its start to the start of the next side."""

    start: Place2
    centre: Place2 | None = None
    turns_left: bool = True  #: whether an arc runs anticlockwise, as round corners do; fillets run clockwise


Outline = tuple[Side, ...]  # anticlockwise


def outlines_of(section: Section) -> tuple[Outline, ...]:
    """Return the outline of a section and, of a hollow one, that of its opening [m]."""
    wide, deep, wall = section.width, section.depth, section.thickness
    if section.shape == "CHS":
        return tuple(_circle(radius) for radius in (wide / 2, wide / 2 - wall) if radius > 0)
    if section.shape == "SHS":
        return _rounded(wide, deep, 1.5 * wall), _rounded(wide - 2 * wall, deep - 2 * wall, wall)
    if section.shape == "I":
        return (_i_section(section),)
    return (tuple(Side((y * wide / 2, z * deep / 2)) for y, z in ((1, -1), (1, 1), (-1, 1), (-1, -1))),)


def _circle(radius: float) -> Outline:
    return Side((radius, 0.0), (0.0, 0.0)), Side((-radius, 0.0), (0.0, 0.0))


def _rounded(wide: float, deep: float, radius: float) -> Outline:
    sides = []
    for y, z in ((1, -1), (1, 1), (-1, 1), (-1, -1)):
        centre = (y * (wide / 2 - radius), z * (deep / 2 - radius))
        across, along = (centre[0], z * deep / 2), (y * wide / 2, centre[1])
        start, end = (across, along) if y * z < 0 else (along, across)
        sides += [Side(start, centre), Side(end)]
    return tuple(sides)


def _i_section(section: Section) -> Outline:
    half, high, web = section.width / 2, section.depth / 2, section.thickness / 2
    inner, fillet = high - section.flange, section.fillet
    right = [Side((half, -high)), Side((half, -inner))]
    if fillet > 0:
        right += [
            Side((web + fillet, -inner), (web + fillet, fillet - inner), False), Side((web, fillet - inner)),
            Side((web, inner - fillet), (web + fillet, inner - fillet), False), Side((web + fillet, inner)),
        ]  # fmt: skip
    else:
        right += [Side((web, -inner)), Side((web, inner))]
    right += [Side((half, inner)), Side((half, high))]
    turned = [
        Side((-s.start[0], -s.start[1]), s.centre and (-s.centre[0], -s.centre[1]), s.turns_left) for s in right
    ]  # half a turn about the middle
    return (*right, *turned)


def polygon_of(outline: Outline) -> np.ndarray:
    """Return the corners of an outline whose arcs are replaced by chords (K, 2)."""
    corners = []
    for side, following in zip(outline, (*outline[1:], outline[0]), strict=True):
        corners.append(side.start)
        if side.centre is None:
            continue
        (y, z), radius = side.centre, math.dist(side.start, side.centre)
        first = math.atan2(side.start[1] - z, side.start[0] - y)
        sweep = (math.atan2(following.start[1] - z, following.start[0] - y) - first) % (2 * math.pi)
        sweep -= 0.0 if side.turns_left else 2 * math.pi
        count = max(round(SIDES_PER_QUARTER * abs(sweep) / (math.pi / 2)), 1)
        for k in range(1, count):
            angle = first + sweep * k / count
            corners.append((y + radius * math.cos(angle), z + radius * math.sin(angle)))
    return np.array(corners)


def prism_of(outlines: tuple[Outline, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return the closed surface of a member of length 1 along x: vertices (N, 3) and triangles (T, 3), anticlockwise seen from outside."""
    from manifold3d import triangulate

    loops = [polygon_of(outline)[:: 1 if k == 0 else -1] for k, outline in enumerate(outlines)]  # material on the left
    flat = np.concatenate(loops)
    count = len(flat)
    end = np.asarray(triangulate(loops), np.int64).reshape(-1, 3)
    sides, start = [], 0
    for loop in loops:
        this = start + np.arange(len(loop))
        following = np.roll(this, -1)
        sides += [
            np.stack([this, following, following + count], axis=1),
            np.stack([this, following + count, this + count], axis=1),
        ]
        start += len(loop)
    vertices = np.concatenate([np.insert(flat, 0, x, axis=1) for x in (0.0, 1.0)])
    return vertices, np.concatenate([end[:, ::-1], end + count, *sides])


def ball_of(radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the closed surface of a ball about 0: vertices (N, 3) and triangles (T, 3)."""
    from manifold3d import Manifold

    mesh = Manifold.sphere(radius, 4 * SIDES_PER_QUARTER).to_mesh64()
    return np.asarray(mesh.vert_properties[:, :3], float), np.asarray(mesh.tri_verts, np.int64)
