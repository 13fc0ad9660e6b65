"""Polylines that the user gives: divided into small steps, their corners found, let down on the scan."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.mesh.point_location import nearest_sample
from ..kernels.surface.local_surface import SURFACE_PATCH, Surface, fit_patch, onto_patch, walk
from ..runtime.jit import new_record

if TYPE_CHECKING:
    from ..settings import Settings

POINTS_UNDER_LINE = 120.0  # points of the scan that a patch under a line or a boundary is fitted to
ZIGZAG_WIDTH = 0.03  # zigzags below this are straightened before corners are looked for [member lengths]


def simplify(points: np.ndarray, tolerance: float, closed: bool) -> np.ndarray:
    """Return the points (K, 3) of a polyline that are needed to keep it within a tolerance (Douglas and Peucker).

    Of a closed one, whose last point is its first, the point farthest from the first is kept too.
    """
    kept = np.zeros(len(points), bool)
    kept[[0, -1]] = True
    stack = [(0, len(points) - 1)]
    if closed:
        middle = int(((points - points[0]) ** 2).sum(axis=1).argmax())
        kept[middle] = True
        stack = [(0, middle), (middle, len(points) - 1)]
    while stack:
        first, last = stack.pop()
        if last - first < 2:
            continue
        inner = points[first + 1 : last]
        chord = points[last] - points[first]
        share = np.clip((inner - points[first]) @ chord / max(float(chord @ chord), 1e-300), 0.0, 1.0)
        away = np.linalg.norm(inner - points[first] - share[:, None] * chord, axis=1)
        if away.max() > tolerance:
            at = first + 1 + int(away.argmax())
            kept[at] = True
            stack += [(first, at), (at, last)]
    found: np.ndarray = points[kept]
    return found


def divide_polyline(vertices: np.ndarray, closed: bool, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return points (M, 3) at most a step apart along a polyline, its vertices among them, and which those are.

    The first point of a closed line, given again as its last, is not repeated.
    """
    parts, at = [], [0]
    for a, b in pairwise(vertices):
        count = max(int(np.ceil(np.linalg.norm(b - a) / step)), 1)
        parts.append(a + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (b - a))
        at.append(at[-1] + count)
    if closed:
        return np.concatenate(parts), np.array(at[:-1])
    return np.concatenate([*parts, vertices[-1:]]), np.array(at)


def corners_of_polyline(points: np.ndarray, vertices: np.ndarray, closed: bool, settings: Settings) -> list[int]:
    """Return which of the points (M, 3) of a line are corners, the sharpest first: where it turns by more than `corner_angle`."""
    places = points[vertices]
    whole = np.concatenate([places, places[:1]]) if closed else places
    coarse = simplify(whole, ZIGZAG_WIDTH * settings.length, closed)
    before, after = np.diff(coarse, axis=0), np.diff(coarse, axis=0)[1:]
    if closed:
        after = np.concatenate([after, before[:1]])
    else:
        before = before[:-1]
    cosine = (before * after).sum(axis=1)
    cosine /= np.maximum(np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1), 1e-300)
    turn = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    sharp = np.flatnonzero(turn > settings.corner_angle)
    sharp = sharp[np.argsort(-turn[sharp], kind="stable")]
    return [int(vertices[((places - coarse[k + 1]) ** 2).sum(axis=1).argmin()]) for k in sharp]


def feet_on_scan(points: np.ndarray, surface: Surface) -> tuple[np.ndarray, np.ndarray]:
    """Return the feet (M, 3) on the scan of the points of a polyline, and how far it leaves the scan there (M,) [scan unit]."""
    patch, feet, gaps, sample = new_record(SURFACE_PATCH), np.empty_like(points), np.empty(len(points)), -1
    for k, place in enumerate(points.tolist()):
        at = (place[0], place[1], place[2])
        sample = walk(surface, sample, at) if sample >= 0 else nearest_sample(surface, *at)
        if np.linalg.norm(surface.mean[sample] - points[k]) > 0.5 * surface.length:
            sample = nearest_sample(surface, *at)
        fit_patch(surface, patch, sample, at)
        feet[k] = onto_patch(patch, at)
        beside = float(np.linalg.norm(surface.mean[sample] - points[k])) - 2.0 * surface.radius
        gaps[k] = max(float(np.linalg.norm(feet[k] - points[k])), beside)
    return feet, gaps


def well_within(places: np.ndarray, polygon: np.ndarray, away: float) -> np.ndarray:
    """Return which places (F, 2) lie inside a closed polyline (M, 2), and not within a distance of its points (F,) bool."""
    start, end = polygon, np.roll(polygon, -1, axis=0)
    kept = np.zeros(len(places), np.bool_)
    for part in np.array_split(np.arange(len(places)), 1 + len(places) * len(polygon) // 1_000_000):
        p = places[part, None]
        crosses = (start[:, 1] <= p[..., 1]) != (end[:, 1] <= p[..., 1])
        rise = np.where(end[:, 1] == start[:, 1], 1.0, end[:, 1] - start[:, 1])
        left = p[..., 0] < start[:, 0] + (p[..., 1] - start[:, 1]) / rise * (end[:, 0] - start[:, 0])
        near = ((p - start) ** 2).sum(axis=2).min(axis=1) < away**2
        kept[part] = ((crosses & left).sum(axis=1) % 2 == 1) & ~near
    return kept
