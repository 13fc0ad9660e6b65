"""The length field: the desired member length all over the scan, as a multiple of the shortest one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..kernels.geometry.boxes import new_boxes
from ..kernels.mesh.coverage import nearest_distances, put_places
from ..kernels.surface import size_field as kernels
from ..kernels.surface.local_surface import Surface
from ..runtime.parallel import in_parts
from ..settings import Settings, shortest_and_longest

LARGEST_RATIO = 1.2  # largest ratio of the desired lengths of two successive members
STEEPEST_GROWTH = (
    0.7 * 2.0 * (LARGEST_RATIO - 1.0) / (LARGEST_RATIO + 1.0)
)  # growth per distance; 0.7 because links make distances longer
FLAT_BULGE = 0.002  # bulge of the longest member below which it counts as flat [its length]
LESS_CURVED_SHARE = 0.95  # share of the scan that is less curved than the places with the shortest members
NOISE_DEVIATIONS = 4.6  # standard deviations of a curvature up to which it may be noise
# patches in which a curvature may be measured; noise falls with their width [usual patches]
WIDEST_CURVATURE_PATCH = 4.0
FARTHEST_FROM_SCAN = 1.0  # largest distance of a given length from the scan [that length]
LENGTHS_PER_THREAD = 200  # fewest samples worth a thread of their own


@dataclass(frozen=True)
class Wish:
    """The lengths that the settings ask for, in the frame of the cloud."""

    field: str | Sequence[Sequence[float]]
    length: float  #: the shortest [scan unit]
    origin: tuple[float, float, float]  #: of the cloud; the given places are not relative to it [scan unit]


def wish_of(settings: Settings, origin: np.ndarray) -> Wish | None:
    """Return the lengths that the settings ask for, None if one length is desired everywhere."""
    if not settings.length_field:
        return None
    x, y, z = origin.tolist()
    return Wish(settings.length_field, settings.length, (x, y, z))


def length_field(surface: Surface, wish: Wish | None) -> np.ndarray:
    """Return the desired length at each sample (S,) [shortest length], graded so that successive members differ little.

    Raises
    ------
    InputError
        A given length lies farther from the scan than it is long.
    """
    if wish is None:
        return np.ones(len(surface.mean))
    shortest, longest = shortest_and_longest(wish.field)
    most = longest / shortest
    field = _by_curvature(surface, most) if isinstance(wish.field, str) else _by_given(surface, wish, shortest)
    kernels.grade(surface.mean, surface.neighbors, field, STEEPEST_GROWTH / wish.length)
    return np.clip(field, 1.0, most)


def _by_given(surface: Surface, wish: Wish, shortest: float) -> np.ndarray:
    """Return the blend of the given lengths at each sample (S,) [shortest length]."""
    rows = np.array(wish.field, float)
    scale = wish.length / shortest
    places, values = np.ascontiguousarray(rows[:, :3] - wish.origin), rows[:, 3] / shortest
    _check_near(surface, rows, places, scale)
    field = np.empty(len(surface.mean))
    spread = float(np.ptp(places, axis=0).max()) or wish.length
    box = max(spread / np.sqrt(len(places)), 1e-6 * spread)
    boxes = new_boxes(places.min(axis=0), places.max(axis=0), box, len(places), len(places))
    kernels.blend_lengths(surface.mean, places, np.ascontiguousarray(values), boxes, box, field)
    return field


def _check_near(surface: Surface, rows: np.ndarray, places: np.ndarray, scale: float) -> None:
    """Refuse given lengths (K, 4) that lie off the scan: they are of another part, frame or unit."""
    mean = surface.mean
    allowed = FARTHEST_FROM_SCAN * scale * rows[:, 3] + 1.5 * surface.step
    low, high = mean.min(axis=0), mean.max(axis=0)
    far = np.maximum(low - places, places - high).max(axis=1) > allowed
    inside = np.flatnonzero(~far)
    step = max(4.0 * surface.step, 0.01 * float((high - low).max()))
    boxes = new_boxes(low, high, step, len(mean), len(mean))
    put_places(boxes, mean)
    away = np.empty(len(inside))
    nearest_distances(np.ascontiguousarray(places[inside]), mean, boxes, step, away)
    far[inside] = away > allowed[inside]
    if count := int(far.sum()):
        k = int(np.argmax(far))
        place = ", ".join(f"{c:.10g}" for c in rows[k, :3])
        raise InputError(
            f"{count} of {len(rows)} given lengths lie off the scan, as that at ({place}); each must lie on the scan,"
            f" within its own length ({scale * rows[k, 3]:.4g} there)"
        )


def _by_curvature(surface: Surface, most: float) -> np.ndarray:
    """Return the length at each sample (S,) with which all members bulge alike, from 1 to `most` shortest lengths.

    A member of length l over a curvature k bulges by k l^2 / 8. The most curved twentieth of the scan gets the shortest length, unless
    even the longest member would be flat there.
    """
    bends = measured_bends(surface)
    shortest = surface.length
    bulge = max(float(np.quantile(bends, LESS_CURVED_SHARE)) * shortest**2 / 8.0, FLAT_BULGE * most * shortest)
    lengths = np.sqrt(8.0 * bulge / np.maximum(bends, 1e-300)) / shortest
    return np.clip(lengths, 1.0, most)


def measured_bends(surface: Surface) -> np.ndarray:
    """Return the larger principal curvature of the scan at each sample (S,); 0 where it may be noise [1 / scan unit].

    It is measured by the widest patches that agree with narrower ones except for noise (Lepski), and what is left of the noise is
    taken off as in the estimate of James and Stein: a curvature well above it stays as it is.
    """
    chosen = np.zeros(len(surface.mean), np.bool_)
    kernels.choose_apart(surface.neighbors, chosen)
    samples = np.flatnonzero(chosen)
    low, high, best = np.zeros(len(samples)), np.full(len(samples), np.inf), np.zeros(len(samples))
    for share in (0.0, 0.5, 1.0):
        bend, doubt = _curvatures(surface, samples, WIDEST_CURVATURE_PATCH**share)
        noise = NOISE_DEVIATIONS * doubt
        low, high = np.maximum(low, bend - noise), np.minimum(high, bend + noise)
        sure = bend * np.maximum(1.0 - (noise / np.maximum(bend, 1e-300)) ** 2, 0.0)
        best = np.where(low <= high, sure, best)
    bends = np.zeros(len(chosen))
    bends[samples] = best
    bends = _spread(surface.neighbors, bends, chosen)
    everywhere = np.ones_like(chosen)
    return np.minimum(bends, _spread(surface.neighbors, bends, everywhere))  # curvature at one sample alone is noise


def _curvatures(surface: Surface, samples: np.ndarray, wider: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the curvature at some samples and its standard deviation, (P,) each [1 / scan unit], by patches so many times wider."""
    from .scratch import with_own_scratch

    scaled = surface._replace(
        patch_radius=surface.patch_radius * wider, patch_points=max(surface.patch_points / wider**2, 1.0)
    )
    found, deviations = np.empty(len(samples)), np.empty(len(samples))

    def measure_part(part: int, begin: int, end: int) -> None:
        kernels.measure_curvatures(with_own_scratch(scaled), samples, found, deviations, begin, end)

    in_parts(len(samples), LENGTHS_PER_THREAD, measure_part)
    return found, deviations


def _spread(neighbors: np.ndarray, values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return values at all samples (S,): the mean of the known ones at a sample and its neighbours."""
    weight = np.where(neighbors >= 0, known[neighbors], False)
    total = weight.sum(axis=1) + known
    summed = (weight * values[neighbors]).sum(axis=1) + known * values
    return np.where(total > 0, summed / np.maximum(total, 1), values)
