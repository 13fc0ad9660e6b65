"""Points generated over closed holes: the surface continues as a thin plate of least bending."""

from __future__ import annotations

import numpy as np

from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface.local_surface import SURFACE_PATCH, Surface, fit_patch, onto_patch, patch_normal, walk
from ..runtime.blas import one_blas_thread
from ..runtime.jit import new_record
from ..surface.samples import SurfaceSamples
from .polylines import well_within

FILLING_SPACING = 0.1  # distance between the points generated over a hole [member lengths]
PLACES_AROUND_HOLE = 60  # places along the boundary of a hole from which its surroundings are sampled
LOOK_STEP = 0.3  # step of a ray away from the hole [member lengths]
RAY_LENGTHS = (1.5, 0.25)  # how far a ray goes: in member lengths, in diameters of the hole; the larger counts
RAY_LEAVES_SCAN = 0.6  # distance from the nearest sample at which a ray has left the scan [member lengths]
# cosine of the angle between the surroundings and the plane of the hole below which that plane is not used
LEAST_PLANE_COSINE = 0.35
FEWEST_PLACES_FOR_PLATE = 12  # fewest places around a hole through which a plate is fitted
PLATE_SMOOTHING = 1e-6  # smoothing of the plate [squared diameters of the hole]


def fill_holes(samples: SurfaceSamples, curves: list[np.ndarray]) -> np.ndarray:
    """Return points (F, 3) that continue the surface over holes [scan unit].

    Parameters
    ----------
    samples : SurfaceSamples
    curves : list of (M, 3)
        The closed boundary curve of each hole, of equal steps, the surface to its left.
    """
    parts = [_fill_hole(samples.surface, curve) for curve in curves]
    return np.concatenate([np.zeros((0, 3)), *parts])


def _fill_hole(surface: Surface, curve: np.ndarray) -> np.ndarray:
    """Points (F, 3) generated over one hole.

    The surroundings of the hole are mapped to a plane, and a thin plate for each coordinate is fitted to them there.
    """
    length = surface.length
    around = float(np.linalg.norm(np.roll(curve, -1, axis=0) - curve, axis=1).sum())
    start, away, places, normals = _look_around(
        surface, curve, max(RAY_LENGTHS[0] * length, RAY_LENGTHS[1] * around / np.pi)
    )
    if len(places) < FEWEST_PLACES_FOR_PLATE:
        return np.zeros((0, 3))
    axis = _axis(curve)
    least = float((normals @ axis).min())
    if least > LEAST_PLANE_COSINE:
        frame = _frame(axis)
        flat, hole_boundary = (places - curve.mean(axis=0)) @ frame.T, (curve - curve.mean(axis=0)) @ frame.T
        fine = min(1.0, 1.5 * least)
    else:  # the hole reaches around a bend: its boundary is mapped to a circle, its surroundings to rings
        radius, turn = around / (2 * np.pi), -2 * np.pi * np.arange(len(curve)) / len(curve)
        hole_boundary = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        flat = hole_boundary[start] * (1 + away / radius)[:, None]
        fine = 0.7
    inside = _lattice(hole_boundary, FILLING_SPACING * fine * length)
    return _thin_plate(flat, places, inside, PLATE_SMOOTHING * (around / np.pi) ** 2)


def _look_around(
    surface: Surface, curve: np.ndarray, sight: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Sample the scan along rays that leave a boundary at right angles.

    Returns
    -------
    start : (K,) int64 point of the curve where each ray began
    away : (K,) distance from there [scan unit]
    places, normals : (K, 3) on the scanned surface
    """
    length, patch = surface.length, new_record(SURFACE_PATCH)
    found: list[tuple[int, float, np.ndarray, np.ndarray]] = []
    sample = nearest_sample(surface, *curve[0].tolist())
    for i in range(0, len(curve), max(1, len(curve) // PLACES_AROUND_HOLE)):
        ahead = curve[(i + 3) % len(curve)] - curve[i - 3]
        sample = at = walk(surface, sample, tuple(curve[i]))
        place, normal = curve[i], surface.normals[sample]
        out = np.cross(normal, ahead)
        for k in range(1, int(sight / (LOOK_STEP * length)) + 1):
            out = out - normal * (out @ normal)
            place = place + LOOK_STEP * length * out / max(float(np.linalg.norm(out)), 1e-300)
            at = walk(surface, at, tuple(place))
            if np.linalg.norm(surface.mean[at] - place) > RAY_LEAVES_SCAN * length:
                break
            fit_patch(surface, patch, at, tuple(place))
            place = np.array(onto_patch(patch, tuple(place)))
            normal = np.array(patch_normal(patch, tuple(place)))
            found.append((i, k * LOOK_STEP * length, place, normal))
    start, away = [i for i, _, _, _ in found], [far for _, far, _, _ in found]
    places, normals = ([look[k] for look in found] for k in (2, 3))
    return np.array(start, np.int64), np.array(away), np.array(places), np.array(normals)


def _axis(curve: np.ndarray) -> np.ndarray:
    """Unit normal (3,) of the plane in which a closed curve encloses the largest area, the surface to its left seen from above."""
    arms = curve - curve.mean(axis=0)
    area = np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0)
    axis: np.ndarray = -area / max(float(np.linalg.norm(area)), 1e-300)
    return axis


def _frame(axis: np.ndarray) -> np.ndarray:
    """Two unit vectors (2, 3) at right angles to an axis and to each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)])


def _lattice(hole_boundary: np.ndarray, step: float) -> np.ndarray:
    """Places (F, 2) of a triangular pattern inside a closed polyline (M, 2), half a step from it."""
    low, high = hole_boundary.min(axis=0), hole_boundary.max(axis=0)
    rows, columns = np.arange(low[1], high[1], step * np.sqrt(0.75)), np.arange(low[0], high[0], step)
    x = columns + 0.5 * step * (np.arange(len(rows)) % 2)[:, None]
    places = np.column_stack([x.ravel(), np.repeat(rows, len(columns))])
    return places[well_within(places, hole_boundary, 0.5 * step)]


def _thin_plate(flat: np.ndarray, values: np.ndarray, wanted: np.ndarray, smoothing: float) -> np.ndarray:
    """Values (F, 3) at wanted places (F, 2) of the thin plates of least bending through values (K, 3) at places (K, 2)."""
    size = float(np.ptp(flat, axis=0).max())
    middle = flat.mean(axis=0)
    at, to = (flat - middle) / size, (wanted - middle) / size
    count = len(at)
    matrix = np.zeros((count + 3, count + 3))
    matrix[:count, :count] = _bending(at, at) + smoothing / size**2 * np.eye(count)
    matrix[:count, count:] = np.column_stack([np.ones(count), at])
    matrix[count:, :count] = matrix[:count, count:].T
    with one_blas_thread():  # the last bits of sums depend on how many there are
        weights = np.linalg.solve(matrix, np.concatenate([values, np.zeros((3, 3))]))
        parts = [
            _bending(part, at) @ weights[:count] + np.column_stack([np.ones(len(part)), part]) @ weights[count:]
            for part in np.array_split(to, 1 + len(to) * count // 1_000_000)
        ]
    return np.concatenate(parts)


def _bending(places: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The plate bent by a point load, r^2 log r, at each place (P, 2) for each of the others (Q, 2); (P, Q)."""
    squared = ((places[:, None] - others) ** 2).sum(axis=2)
    bent: np.ndarray = 0.5 * squared * np.log(np.maximum(squared, 1e-300))
    return bent
