"""What kind of thing was scanned: points that lie along lines or fill a volume are no surface, and two layers are no single one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError

if TYPE_CHECKING:
    from .samples import SurfaceSamples

PLACES = 40  # places that are looked at
FEWEST = 60  # samples below which nothing is said
MOST_SAMPLES = 5_000  # samples that show how the points spread around a place
LINE = 0.02  # second spread of what lies along a line, in its first
VOLUME = 0.45  # least spread of what fills a volume, in its largest
MOST_PLACES = 0.6  # share of the places from which on all is called so
LAYER_REACH = 0.7  # radius within which two layers are looked for [member lengths]
CLOSE_LAYERS = 0.5  # distance below which two layers are one to a grid [member lengths]
EACH_LAYER = 0.2  # share of the points that each of two layers has at least
CLEAR = 4.0  # distance of two layers, in the rms thickness of each
MANY_LAYERS = 0.3  # share of the places with two layers from which on that is said


def check_is_surface(samples: SurfaceSamples) -> None:
    """Refuse points that lie along lines or fill a volume.

    Raises
    ------
    InputError
        They are no scan of a surface.
    """
    mean = samples.surface.mean
    if len(mean) < FEWEST:
        return
    some = mean[:: len(mean) // MOST_SAMPLES + 1]
    lines = volumes = looked = 0
    for place in mean[_spread_evenly(len(mean))]:
        near = some[((some - place) ** 2).sum(axis=1) <= samples.surface.length**2]
        if len(near) < 5:
            continue
        looked += 1
        least, second, largest = np.linalg.eigvalsh(np.cov(near.T))
        lines += bool(second <= LINE * largest)
        volumes += bool(least >= VOLUME * largest)
    if lines > MOST_PLACES * looked:
        raise InputError(
            "the points lie along lines, not on a surface; a grid needs a scan of a surface, or longer members if these are"
            " the lines of a scanner"
        )
    if volumes > MOST_PLACES * looked:
        raise InputError(
            "the points fill a volume and lie on no surface; a grid needs the points of a surface alone, such as the outermost"
        )


def find_layers(samples: SurfaceSamples) -> tuple[float, float]:
    """Return how far apart two layers lie that are closer than half a member, and the share of places with two; 0, 0 for one."""
    surface = samples.surface
    if samples.smooth or len(surface.mean) < FEWEST:
        return 0.0, 0.0
    apart, looked = [], 0
    for sample in _spread_evenly(len(surface.mean)):
        away = surface.mean - surface.mean[sample]
        near = np.flatnonzero((away**2).sum(axis=1) <= (LAYER_REACH * surface.length) ** 2)
        own = [surface.points[surface.start[s] : surface.start[s + 1]] for s in near]
        points = np.concatenate(own) - surface.mean[sample]
        if len(points) < 20:
            continue
        looked += 1
        if 0.0 < (distance := _layer_distance(points)) < CLOSE_LAYERS * surface.length:
            apart.append(distance)
    share = len(apart) / max(looked, 1)
    return (float(np.median(apart)), share) if share >= MANY_LAYERS else (0.0, 0.0)


def _layer_distance(points: np.ndarray) -> float:
    """Return the distance of two layers of points (N, 3) that can be told apart, 0 where they cannot."""
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    height = np.sort(centred @ axes[2])
    first = max(int(EACH_LAYER * len(height)), 2)
    gaps = np.diff(height[first - 1 : len(height) - first + 1])
    cut = first + int(gaps.argmax())
    below, above = height[:cut], height[cut:]
    distance = float(above.mean() - below.mean())
    thickness = max(float(below.std()), float(above.std()))
    return distance if distance > CLEAR * thickness and float(gaps.max()) > 0.4 * distance else 0.0


def _spread_evenly(count: int) -> np.ndarray:
    """Return the numbers of some samples from everywhere; samples that follow each other lie near each other."""
    return np.unique(np.linspace(0, count - 1, PLACES).astype(np.int64))
