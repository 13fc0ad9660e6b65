"""Whether a scan is one surface: points along lines or in a volume are none, and two close layers are not one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, LinesError
from .mean_surface import RADIUS_OF_BALLS

if TYPE_CHECKING:
    from ..kernels.surface.local_surface import Surface
    from .samples import SurfaceSamples

PLACES_LOOKED_AT = 40  # places of a scan that are looked at
FEWEST_SAMPLES = 60  # samples below which nothing is concluded
SAMPLES_LOOKED_AT = 5_000  # most samples from which the variance around a place is taken
LINE_VARIANCE = 0.02  # largest second variance of points along a line [first variance]
SHARE_OF_A_LINE = 0.01  # share of the samples that a line has at least
VOLUME_VARIANCE = 0.45  # least smallest variance of points that fill a volume, within a member [largest variance]
# least smallest variance of points that fill a volume, within half a member [largest variance]
NEAR_VOLUME_VARIANCE = 0.25
DECISIVE_SHARE = 0.6  # share of the places above which a scan counts as lines
# share of the places above which a scan counts as a volume: places near its surface see only half of it
VOLUME_PLACES = 0.35
FEWEST_SAMPLES_AROUND_PLACE = 30  # samples within a member below which all that lie there are looked at
NEAREST_COUNTED = 16  # points around a place that always count
LAYER_REACH = 0.7  # radius within which two layers are looked for [member lengths]
CLOSE_LAYERS = 0.5  # distance below which a grid sees two layers as one [member lengths]
PLACES_OF_WALL = 200  # places of a scan at which the other side of a wall is looked for
FACES_AWAY_BY = 0.7  # cosine: the other side faces away, and lies behind
EACH_LAYER = 0.2  # least share of the points in each of two layers
LAYER_DISTANCE = 4.0  # least distance between two layers [rms thickness of the thicker one]
# share of the places with two layers from which on they are reported where they have become one by smoothing
SOME_LAYERS = 0.1
MANY_LAYERS = 0.3  # share of the places with two layers from which on they are reported


def check_is_surface(samples: SurfaceSamples) -> None:
    """Refuse points that lie along lines or fill a volume.

    Raises
    ------
    LinesError
        The points lie along lines, which longer members may make a surface of.
    InputError
        The points fill a volume.
    """
    mean = samples.surface.mean
    if len(mean) < FEWEST_SAMPLES:
        return
    some = mean[:: len(mean) // SAMPLES_LOOKED_AT + 1]
    lines = volumes = looked = 0
    for place in mean[_of_most_points(samples.surface)]:
        near = _within(some, place, samples.surface.length)
        near = near if len(near) >= FEWEST_SAMPLES_AROUND_PLACE else _within(mean, place, samples.surface.length)
        if len(near) < 5:
            continue
        looked += 1
        least, second, largest = _spread(near)
        lines += bool(second <= LINE_VARIANCE * largest)
        if least >= VOLUME_VARIANCE * largest:  # so do two sheets, but not from half as far
            least, _, largest = _spread(_nearest_points(samples.surface, place))
            volumes += bool(least >= NEAR_VOLUME_VARIANCE * largest)
    if lines > DECISIVE_SHARE * looked:
        raise LinesError(
            "the points lie along lines, not on a surface; a grid needs a scan of a surface, or longer members if these are"
            " the lines of a scanner",
            int((np.bincount(samples.piece) > SHARE_OF_A_LINE * len(mean)).sum()),
        )
    if volumes > VOLUME_PLACES * looked:
        raise InputError(
            "the points fill a volume and lie on no surface; a grid needs the points of a surface alone, such as the outermost:"
            " clean or crop the scan, or use a shorter length"
        )


def _spread(points: np.ndarray) -> np.ndarray:
    """Return the three principal variances of points (N, 3), least first; zeros for fewer than five points."""
    if len(points) < 5:
        return np.zeros(3)
    off = points - points.mean(axis=0)
    return np.linalg.eigvalsh(off.T @ off / (len(off) - 1))


def _within(places: np.ndarray, place: np.ndarray, radius: float) -> np.ndarray:
    """Return those of some places (N, 3) within a radius of one."""
    squares = sum((column - at) ** 2 for column, at in zip(places.T, place, strict=True))
    return places[squares <= radius**2]


def _nearest_points(surface: Surface, place: np.ndarray) -> np.ndarray:
    """Return the points (N, 3) within half a member of a place, or the nearest few where these are more."""
    points = _points_near(surface, place, surface.length)
    away = ((points - place) ** 2).sum(axis=1)
    return points[away <= max((0.5 * surface.length) ** 2, np.sort(away)[min(NEAREST_COUNTED, len(away)) - 1])]


def _points_near(surface: Surface, place: np.ndarray, radius: float) -> np.ndarray:
    """Return the points (N, 3) of all samples within a radius of a place; at least one must be there."""
    near = np.flatnonzero(((surface.mean - place) ** 2).sum(axis=1) <= radius**2)
    return np.concatenate([surface.points[surface.start[s] : surface.start[s + 1]] for s in near])


def layers_of_surface(samples: SurfaceSamples) -> tuple[float, float]:
    """Return the distance between two layers closer than half a member, and the share of places with two; 0, 0 for one layer."""
    surface = samples.surface
    if len(surface.mean) < FEWEST_SAMPLES:
        return 0.0, 0.0
    apart, looked, merged = [], 0, RADIUS_OF_BALLS * samples.moved
    reach, close = (max(least, merged) * surface.length for least in (LAYER_REACH, CLOSE_LAYERS))
    # samples with near numbers lie near each other, so these are from all over the scan
    for sample in np.unique(np.linspace(0, len(surface.mean) - 1, PLACES_LOOKED_AT).astype(np.int64)):
        place = surface.mean[sample]
        measured = (
            _within(samples.measured_points, place, reach) if samples.moved else _points_near(surface, place, reach)
        )
        points = measured - place
        if len(points) < 20:
            continue
        looked += 1
        if 0.0 < (distance := _layer_distance(points)) < close:
            apart.append(distance)
    share = len(apart) / max(looked, 1)
    return (float(np.median(apart)), share) if share >= (SOME_LAYERS if samples.moved else MANY_LAYERS) else (0.0, 0.0)


def wall_of_surface(samples: SurfaceSamples, reach: float) -> tuple[float, float]:
    """Return how thick the wall of a scan is that has both of its sides, as of a bowl, and the share of places at which there is one.

    Parameters
    ----------
    samples : SurfaceSamples
    reach : float
        A wall is not thicker than this [scan unit].
    """
    mean, normals = samples.surface.mean, samples.surface.normals
    apart = []
    places = np.unique(np.linspace(0, len(mean) - 1, PLACES_OF_WALL).astype(np.int64))
    for sample in places:
        away = mean - mean[sample]
        squares = (away**2).sum(axis=1)
        facing, depth = normals @ normals[sample], -(away @ normals[sample])
        other = (squares <= reach**2) & (facing < -FACES_AWAY_BY) & (depth > FACES_AWAY_BY * np.sqrt(squares))
        if other.any():
            apart.append(float(np.sqrt(squares[other].min())))
    return (float(np.median(apart)) if apart else 0.0, len(apart) / len(places))


def _layer_distance(points: np.ndarray) -> float:
    """Return the distance between two layers of points (N, 3), 0 if they look like one."""
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    height = np.sort(centred @ axes[2])
    first = max(int(EACH_LAYER * len(height)), 2)
    gaps = np.diff(height[first - 1 : len(height) - first + 1])
    cut = first + int(gaps.argmax())
    below, above = height[:cut], height[cut:]
    distance = float(above.mean() - below.mean())
    thickness = max(float(below.std()), float(above.std()))
    return distance if distance > LAYER_DISTANCE * thickness and float(gaps.max()) > 0.4 * distance else 0.0


def _of_most_points(surface: Surface) -> np.ndarray:
    """Return the numbers of the samples of some points from everywhere: outliers have few points, though many samples."""
    points = np.linspace(0, surface.start[-1] - 1, PLACES_LOOKED_AT).astype(np.int64)
    return np.unique(np.searchsorted(surface.start, points, side="right") - 1)
