"""Noise and doubled layers: points move along the normal to the surface of the points around them, so that boundaries stay."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels.scan import noise as kernels
from ...kernels.surface.patches import Patches, empty_patches
from ...kernels.surface.size_field import choose_apart
from ...runtime.parallel import in_parts
from .nearby import NEIGHBORS_OF_A_POINT, Nearby

NARROWEST_PATCH = 28.0  # points of the narrowest patch
WIDEST_PATCH = 2.0  # radius of the widest patch over that of the narrowest
WORSE_FIT = 1.1  # factor by which a wider patch may fit worse than the narrowest
POINTS_PER_PATCH = 8  # one of this many nearest points has a patch
LEAST_LAYERED = 0.02  # share of the points that must lie in layers; a few seem to at random
LAYERED_KURTOSIS = 2.1  # kurtosis of the distances from a patch below which they are those of two layers; 3 for noise
LAYERED_PATCH = 3.0  # radius of a patch that holds two layers equally, in the largest distance of layers
FOLLOWED_SHARE = 0.5  # a narrower patch that fits better than this share shows a single surface
PATCHES_PER_THREAD = 200  # fewest patches that are worth a thread


class Surfaces(NamedTuple):
    """Patches at some of the points."""

    number: np.ndarray  #: (N,) int64 patch of each point, -1 for most
    centres: np.ndarray  #: (C,) int64 point of each patch
    patches: Patches
    flatness: (
        np.ndarray
    )  #: (C,) fourth moment of the distances of the points from each patch over the square of the second


def fit_surfaces(near: Nearby) -> Surfaces:
    """Fit patches all over a scan, as wide as the surface allows."""
    chosen = np.zeros(len(near.neighbors), np.bool_)
    choose_apart(np.ascontiguousarray(near.neighbors[:, :POINTS_PER_PATCH]), chosen)
    centres = np.flatnonzero(chosen)
    number = np.full(len(chosen), -1, np.int64)
    number[centres] = np.arange(len(centres))
    reach = np.sqrt(near.squares[:, -1])
    known = np.where(near.neighbors >= 0, reach[near.neighbors], np.inf)
    radii = (np.median(known, axis=1) * np.sqrt(NARROWEST_PATCH / NEIGHBORS_OF_A_POINT))[centres]
    radii[~np.isfinite(radii)] = np.linalg.norm(np.ptp(near.tree.points, axis=0))
    narrow, _ = _fit(near, centres, radii, 1.0, np.full(len(centres), np.inf))
    usual = _around(near, number, narrow.rms)[centres]
    return Surfaces(number, centres, *_fit(near, centres, radii, WIDEST_PATCH, WORSE_FIT * usual))


def _fit(
    near: Nearby, centres: np.ndarray, radii: np.ndarray, widest: float, usual: np.ndarray
) -> tuple[Patches, np.ndarray]:
    """Return patches of radii up to `widest` that fit as well as usual, and how flat the distances from each are distributed (C,)."""
    patches, flatness = empty_patches(len(centres)), np.empty(len(centres))
    in_parts(
        len(centres),
        PATCHES_PER_THREAD,
        lambda _, begin, end: kernels.fit_patches(
            near.tree, centres, radii, widest, usual, patches, flatness, begin, end
        ),
    )
    return patches, flatness


def _around(near: Nearby, number: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return for each point (N,) the median of the values (C,) of the patches around it."""
    own = np.column_stack([np.arange(len(number)), near.neighbors])
    patch = np.where(own >= 0, number[own], -1)
    found = np.sort(np.where(patch >= 0, values[patch], np.inf), axis=1)
    count = (patch >= 0).sum(axis=1)
    middle = found[np.arange(len(found)), np.maximum(count - 1, 0) // 2]
    return np.where(count > 0, middle, np.median(values))


def onto_surfaces(near: Nearby, surfaces: Surfaces) -> tuple[np.ndarray, np.ndarray]:
    """Return the projections of the points onto the patches around them, and the normals there, of either sign; (N, 3), by tree rows."""
    points = near.tree.points
    moved, normals = np.empty_like(points), np.empty_like(points)
    in_parts(
        len(points),
        PATCHES_PER_THREAD,
        lambda _, begin, end: kernels.onto_patches(
            near.tree, surfaces.number, surfaces.patches, near.neighbors, moved, normals, begin, end
        ),
    )
    return moved, normals


def find_layers(near: Nearby, surfaces: Surfaces, distance: float, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return which points lie in two layers no farther apart than `distance` [scan unit], and their places on the merged layer.

    Points `known` (N,) from an earlier round, which are half merged, are included.

    Two layers lie at two distances from the surface between them, half of the points at each; noise lies mostly near zero. A
    patch that holds both equally is several times wider than they are apart. A corrugated surface looks the same, but a narrower
    patch follows it.

    Returns
    -------
    layers : ndarray
        (N,) bool, rows of the tree.
    between : ndarray
        (N, 3) rows of the tree; other points where they are [scan unit].
    """
    broad = _broad(near, surfaces, distance)
    apart = known | _two(near, surfaces, broad, distance)
    layers = apart | _two(near, surfaces, surfaces, distance)
    between = near.tree.points.copy()
    for rows, patches in ((apart, broad), (layers & ~apart, surfaces)):
        if rows.any():
            between[rows] = onto_surfaces(near, patches)[0][rows]
    return layers, between


def _broad(near: Nearby, surfaces: Surfaces, distance: float) -> Surfaces:
    """Return patches at the same points, wide enough for two layers."""
    centres = surfaces.centres
    radii = np.maximum(LAYERED_PATCH * distance, surfaces.patches.radius)
    patches, flatness = _fit(near, centres, radii, 1.0, np.full(len(centres), np.inf))
    return surfaces._replace(patches=patches, flatness=flatness)


def _two(near: Nearby, narrow: Surfaces, surfaces: Surfaces, distance: float) -> np.ndarray:
    """Return which points lie at two distances from the patches around them (N,), rows of the tree; none where only a few do."""
    thick = surfaces.patches.rms
    apart = (2.0 * thick <= distance) & (narrow.patches.rms >= FOLLOWED_SHARE * thick)
    calm = _around(near, surfaces.number, np.where(apart, surfaces.flatness, 3.0))
    own = np.where(near.neighbors >= 0, calm[near.neighbors], 3.0)
    layers = np.median(own, axis=1) < LAYERED_KURTOSIS
    return layers if layers.mean() > LEAST_LAYERED else np.zeros(len(layers), np.bool_)
