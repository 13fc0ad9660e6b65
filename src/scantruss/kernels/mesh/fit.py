"""Fit of a grid to a scan: nodes settle where members are even and the triangles pass near the samples of the scan.

To the energy of the members and triangles (`kernels.mesh.equalize`) comes, for each sample, the square of its distance from its triangle,
and for each node the square of its distance from the plane of the points around it. Each sample keeps its place in its triangle, and the
direction from there, while nodes move; so both parts are quadratic in the place of a node.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..boundary.curves import Curves, slide
from ..geometry.boxes import SearchBoxes
from ..geometry.planes import plane_of
from ..geometry.triangles import foot_on_triangle
from ..geometry.vectors import along, cross, dot, norm, put_vector, row, subtract, unit
from .distances import RADIUS_GROWTHS, REACH_GROWS, nearest_points
from .equalize import LONGEST_STEP, TRIANGLE_STIFFNESS, star_energy
from .grid import Net

STEP_OF_FIT = 1.3  # over-relaxation of a step, in that to the least energy of a node
STEPS_OF_FIT, STEP_SHORTENED = 3, 0.35  # steps of a node that are tried, each shorter than the one before by this
NOISES_ASIDE = 3.0  # share of the distance of a node from its plane that noise explains [rms of the points]
AT_ITS_FOOT = 1e-9  # distance of a sample from its triangle that counts as none [side of the triangle]


class Pull(NamedTuple):
    """How the samples of a scan draw the nodes of the triangles that they are nearest to."""

    start: np.ndarray  #: (C + 1,) int64, those of node v are start[v]:start[v + 1]
    sample: np.ndarray  #: (E,) int64
    share: np.ndarray  #: (E,) share of the node in the foot of the sample
    off: np.ndarray  #: (S,) distance of the foot from the sample, along `direction` [scan unit]
    direction: np.ndarray  #: (S, 3) unit vectors
    weight: np.ndarray  #: (S,) of the square of that distance [1 / scan unit^2]


class Planes(NamedTuple):
    """The planes of the points around nodes."""

    middle: np.ndarray  #: (C, 3)
    normal: np.ndarray  #: (C, 3) unit normals
    noise: np.ndarray  #: (C,) rms distance of those points from their plane [scan unit]


@kernel
def put_feet_of_samples(
    samples: np.ndarray,
    nodes: np.ndarray,
    triangles: np.ndarray,
    nearest: np.ndarray,
    shares: np.ndarray,
    off: np.ndarray,
    direction: np.ndarray,
) -> None:
    """Fill in, for each sample (S, 3), the shares (S, 3) of the corners of its triangle in its foot there, and how far off that lies.

    nearest : (S,) int64 triangle of each sample, -1 for none, whose shares are zero
    direction : (S, 3), along which `off` (S,) is measured: from the sample to its foot, or the normal where they are one
    """
    for s in range(len(samples)):
        shares[s, 0] = shares[s, 1] = shares[s, 2] = off[s] = 0.0
        t = nearest[s]
        if t < 0:
            continue
        a, b, c = row(nodes, triangles[t, 0]), row(nodes, triangles[t, 1]), row(nodes, triangles[t, 2])
        foot = foot_on_triangle(row(samples, s), a, b, c)
        put_vector(shares[s], foot)
        place = along(along(along((0.0, 0.0, 0.0), foot[0], a), foot[1], b), foot[2], c)
        away = subtract(place, row(samples, s))
        far, side = norm(away), norm(subtract(b, a))
        if far > AT_ITS_FOOT * side:
            off[s] = far
            put_vector(direction[s], unit(away))
        else:
            put_vector(direction[s], unit(cross(subtract(b, a), subtract(c, a))))


@kernel
def put_planes(
    which: np.ndarray,
    nodes: np.ndarray,
    points: np.ndarray,
    boxes: SearchBoxes,
    around: int,
    near: float,
    planes: Planes,
) -> None:
    """Fill in the plane of the `around` points nearest to each of some nodes (K,), `which`.

    boxes : the points by box. near : first search radius [scan unit]
    """
    wanted = min(around, len(points))
    found, squares, offsets = np.empty(wanted, np.int64), np.empty(wanted), np.empty((wanted, 3))
    for k in range(len(which)):
        v, reach = which[k], near
        count = nearest_points(boxes, points, row(nodes, v), reach, found, squares)
        for _ in range(RADIUS_GROWTHS):
            if count == wanted:
                break
            reach *= REACH_GROWS
            count = nearest_points(boxes, points, row(nodes, v), reach, found, squares)
        first = row(points, found[0])
        for i in range(count):
            put_vector(offsets[i], subtract(row(points, found[i]), first))
        mean, normal, off, _ = plane_of(offsets, count)
        put_vector(planes.middle[v], along(first, 1.0, mean))
        put_vector(planes.normal[v], normal)
        planes.noise[v] = math.sqrt(off / count)


@kernel
def settle_to_fit(
    net: Net,
    patches: np.ndarray,
    curves: Curves,
    which: np.ndarray,
    is_free: np.ndarray,
    pull: Pull,
    planes: Planes,
    length: float,
    weight: float,
    weight_of_planes: float,
    farthest: float,
    sweeps: int,
) -> float:
    """Settle some nodes (K,), `which`, in sweeps; returns by how much the energy fell in the last.

    is_free : (C,) int64, 1 for nodes that move in space, 0 for those that slide along their curve
    weight : of the lengths of members against the shapes of triangles
    weight_of_planes : of the square of the distance of a node from its plane [1 / member length^2]
    farthest : from its plane, beyond `NOISES_ASIDE` times the noise, where no node moves away from it any more [member lengths]
    """
    gain = 0.0
    for _ in range(sweeps):
        gain = 0.0
        for k in range(len(which)):
            gain += _settle_node(
                net,
                patches,
                curves,
                which[k],
                is_free[which[k]] == 1,
                pull,
                planes,
                length,
                weight,
                weight_of_planes,
                farthest,
            )
    return gain


@kernel
def _settle_node(
    net: Net,
    patches: np.ndarray,
    curves: Curves,
    v: int,
    is_free: bool,
    pull: Pull,
    planes: Planes,
    length: float,
    weight: float,
    weight_of_planes: float,
    farthest: float,
) -> float:
    """Move node v one step downhill; returns by how much its energy fell, and takes the feet of its samples along."""
    local = length * net.desired[v]
    x, y, z = net.nodes[v, 0], net.nodes[v, 1], net.nodes[v, 2]
    before, gx, gy, gz = star_energy(net, patches, v, x, y, z, length, weight, True)
    stiff = net.degree[v] * (weight + TRIANGLE_STIFFNESS) / (local * local)
    xx = yy = zz = stiff
    xy = xz = yz = 0.0
    for entry in range(pull.start[v], pull.start[v + 1]):
        s, share = pull.sample[entry], pull.share[entry]
        ux, uy, uz = row(pull.direction, s)
        before += pull.weight[s] * pull.off[s] * pull.off[s]
        f = 2.0 * pull.weight[s] * share * pull.off[s]
        gx, gy, gz = gx + f * ux, gy + f * uy, gz + f * uz
        f = 2.0 * pull.weight[s] * share * share
        xx, yy, zz = xx + f * ux * ux, yy + f * uy * uy, zz + f * uz * uz
        xy, xz, yz = xy + f * ux * uy, xz + f * ux * uz, yz + f * uy * uz
    normal = row(planes.normal, v)
    ux, uy, uz = normal
    height, f = dot(subtract((x, y, z), row(planes.middle, v)), normal), weight_of_planes / (local * local)
    before += f * height * height
    gx, gy, gz = gx + 2.0 * f * height * ux, gy + 2.0 * f * height * uy, gz + 2.0 * f * height * uz
    xx, yy, zz = xx + 2.0 * f * ux * ux, yy + 2.0 * f * uy * uy, zz + 2.0 * f * uz * uz
    xy, xz, yz = xy + 2.0 * f * ux * uy, xz + 2.0 * f * ux * uz, yz + 2.0 * f * uy * uz
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    determinant = xx * a + xy * b + xz * c  # positive: `stiff` is
    dx = -(a * gx + b * gy + c * gz) / determinant
    dy = -(b * gx + (xx * zz - xz * xz) * gy + (xy * xz - xx * yz) * gz) / determinant
    dz = -(c * gx + (xy * xz - xx * yz) * gy + (xx * yy - xy * xy) * gz) / determinant
    step = STEP_OF_FIT * math.sqrt(dx * dx + dy * dy + dz * dz)
    t = STEP_OF_FIT if step <= LONGEST_STEP * local else STEP_OF_FIT * LONGEST_STEP * local / step
    for _ in range(STEPS_OF_FIT):
        place, arc = (x + t * dx, y + t * dy, z + t * dz), net.arc[v]
        if not is_free:
            arc, px, py, pz = slide(curves, net.curve[v], arc, LONGEST_STEP * local, place[0], place[1], place[2])
            place = (px, py, pz)
        moved = subtract(place, (x, y, z))
        over = height + dot(moved, normal)
        after = star_energy(net, patches, v, place[0], place[1], place[2], length, weight, False)[0] + f * over * over
        for entry in range(pull.start[v], pull.start[v + 1]):
            s = pull.sample[entry]
            off = pull.off[s] + pull.share[entry] * dot(row(pull.direction, s), moved)
            after += pull.weight[s] * off * off
        if after < before and abs(over) <= max(farthest * local + NOISES_ASIDE * planes.noise[v], abs(height)):
            for entry in range(pull.start[v], pull.start[v + 1]):
                s = pull.sample[entry]
                pull.off[s] += pull.share[entry] * dot(row(pull.direction, s), moved)
            put_vector(net.nodes[v], place)
            net.arc[v] = arc
            return before - after
        t *= STEP_SHORTENED
    return 0.0
