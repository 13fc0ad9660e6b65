"""PointCloud: measured points relative to a local origin; and how far apart they lie."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import InputError
from ..settings import UNITS

LARGEST = 1e100  # coordinates beyond this overflow when squared
SAMPLE = 600  # points at which the spacing is measured
FEW = 200  # points at which the gap is measured
MOST_PAIRS = 1 << 22  # distances looked at in one go


@dataclass(frozen=True, eq=False)
class PointCloud:
    """The points of a scan, clean and near the origin of their own frame."""

    points: np.ndarray  #: (N, 3) float64 [scan unit], relative to `origin`
    origin: np.ndarray  #: (3,) float64 [scan unit], so that national-grid coordinates lose nothing
    unit: str = ""  #: mm, cm, m, inch, foot, or "" where it is not known
    dropped: int = 0  #: points left out because a coordinate was NaN or infinite
    name: str = ""  #: file the points came from

    @cached_property
    def spacing(self) -> float:
        """Typical distance between neighbouring points [scan unit]; measured once."""
        return measure_spacing(self.points)

    @cached_property
    def gap(self) -> float:
        """Typical distance to the sixth neighbour [scan unit]; measured once."""
        return measure_gap(self.points)

    @classmethod
    def from_array(cls, points: np.ndarray, unit: str = "", name: str = "") -> PointCloud:
        """Return a cloud from an (N, 3) array; checks shape and values, moves to a local origin.

        Parameters
        ----------
        points : (N, 3) array of numbers [scan unit]
            Points with a coordinate that is NaN or infinite are dropped and counted.
        unit : str
            Unit of the coordinates: mm, cm, m, inch, foot, or "" where it is not known.
        name : str
            File the points came from; messages start with it.

        Returns
        -------
        PointCloud
            `points + origin` gives back every coordinate to the last bit.

        Raises
        ------
        InputError
            Wrong shape, no numbers, too few points, or all of them on a line.
        """
        if unit not in UNITS:
            raise InputError(f"unit must be one of {' '.join(u for u in UNITS if u)}, got {unit!r}")
        said = f"{name}: " if name else ""
        array = _as_coordinates(points, said)
        clean, lower, upper = _drop_not_finite(array, said)
        extent = _check_extent(lower, upper, said)
        origin = _local_origin(lower, upper, extent)
        moved = np.subtract(clean, origin, order="C")
        _check_not_on_a_line(moved, extent, said)
        return cls(points=moved, origin=origin, unit=unit, dropped=len(array) - len(clean), name=name)


def _as_coordinates(points: np.ndarray, said: str) -> np.ndarray:
    """Return the points as an (N, 3) float64 array, without a copy where they are one already."""
    try:
        array = np.asarray(points)
    except ValueError:
        raise InputError(f"{said}points must have shape (N, 3), got rows of different lengths") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{said}points must have shape (N, 3), got {array.shape}")
    if array.dtype.kind not in "fiu":
        raise InputError(f"{said}points must be real numbers, got {array.dtype}")
    with np.errstate(over="ignore"):
        return array.astype(np.float64, copy=False)


def _drop_not_finite(array: np.ndarray, said: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the finite points with their lower and upper corner; refuse a cloud that is mostly not finite."""
    count = len(array)
    lower, upper = _corners(array)
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()) and count:
        array = array[np.isfinite(array).all(axis=1)]
        if 2 * len(array) < count:
            raise InputError(
                f"{said}{count - len(array):,} of {count:,} points have NaN or infinite coordinates;"
                " at least half must be finite, so check the export of the scan"
            )
        lower, upper = _corners(array)
    if len(array) < 3:
        raise InputError(f"{said}at least 3 points are needed, got {len(array)}")
    return array, lower, upper


def _corners(array: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and largest coordinates, (3,) each; a NaN shows in both."""
    if not len(array):
        return np.zeros(3), np.zeros(3)
    return (
        np.array([array[:, axis].min() for axis in range(3)]),
        np.array([array[:, axis].max() for axis in range(3)]),
    )


def _check_extent(lower: np.ndarray, upper: np.ndarray, said: str) -> float:
    """Return the longest side of the cloud; refuse points that coincide or overflow."""
    largest = float(max(np.abs(lower).max(), np.abs(upper).max()))
    if largest > LARGEST:
        raise InputError(f"{said}coordinates must be smaller than {LARGEST:g}, got {largest:.3g}")
    extent = float((upper - lower).max())
    if extent <= max(4 * np.finfo(float).eps * largest, 1 / LARGEST):
        raise InputError(f"{said}all points are at the same place; a grid needs points spread over a surface")
    return extent


def _local_origin(lower: np.ndarray, upper: np.ndarray, extent: float) -> np.ndarray:
    """Return an origin near the cloud from which every point differs by an exact float64.

    An axis keeps its own zero where that lies near the cloud. Elsewhere the origin is the centre of the bounding box,
    rounded to a power of two no larger than the extent: both then lie within a factor of two of each other, and such
    a difference is exact (Sterbenz).
    """
    step = 2.0 ** math.floor(math.log2(extent))
    centre = 0.5 * lower + 0.5 * upper
    origin: np.ndarray = np.where(np.abs(centre) < 2.0 * extent, 0.0, np.round(centre / step) * step)
    return origin


def _check_not_on_a_line(points: np.ndarray, extent: float, said: str) -> None:
    """Refuse points whose spread across their main direction is rounding.

    A strip is at least about one spacing wide, that is 1 / N of its length; what is much narrower is a line.
    """
    mean = np.array([points[:, axis].mean() for axis in range(3)]) / extent
    covariance = points.T @ points / (len(points) * extent * extent) - np.outer(mean, mean)
    _, middle, largest = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    least = min(max(0.1 / len(points), 1e-6), 1e-3)
    if middle <= least * least * largest:
        raise InputError(f"{said}all points lie on a line; a grid needs points spread over a surface")


def measure_spacing(points: np.ndarray) -> float:
    """Return the typical distance between neighbouring points.

    The median of the distance to the nearest other point that does not coincide, at up to 600 points taken evenly
    from the file order; always the same for the same points.

    Parameters
    ----------
    points : (N, 3) array [scan unit]

    Returns
    -------
    float
        Spacing [scan unit]; 0 where all points coincide.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    if len(points) < 2:
        return 0.0
    sample = points[np.linspace(0, len(points) - 1, min(len(points), SAMPLE)).astype(np.int64)]
    lower, upper = _corners(points)
    same = 8 * np.finfo(float).eps * float(max(np.abs(lower).max(), np.abs(upper).max()))
    sample, place = np.unique(sample, axis=0, return_inverse=True)
    parts = np.array_split(sample, len(sample) // 500 + 1)
    nearest = np.concatenate([_nearest_of(part, sample, same) for part in parts])
    if len(place) < len(points):
        reach = float(np.linalg.norm(upper - lower))
        nearest = _refine(points, lower, sample, nearest, np.bincount(place.ravel()), same, reach)
    spacing = float(np.median(nearest[place.ravel()]))
    return spacing if math.isfinite(spacing) else 0.0


def measure_gap(points: np.ndarray) -> float:
    """Return the median distance to the sixth neighbour, which tells the density however evenly the points lie.

    Parameters
    ----------
    points : (N, 3) array [scan unit]

    Returns
    -------
    float
        About one spacing for points in a triangular pattern, 2.7 times the distance to the nearest for random ones.
    """
    sixth = min(6, len(points) - 1)
    gaps = []
    for place in points[np.linspace(0, len(points) - 1, min(len(points), FEW)).astype(np.int64)]:
        squared = np.zeros(len(points))
        for axis in range(3):
            squared += (points[:, axis] - place[axis]) ** 2
        gaps.append(np.partition(squared, sixth)[sixth])
    return float(np.sqrt(np.median(gaps)))


def _nearest_of(rows: np.ndarray, others: np.ndarray, same: float) -> np.ndarray:
    """Return the distance of each row to the nearest of the others that does not coincide, inf where none."""
    squared = np.zeros((len(rows), len(others)))
    for axis in range(3):
        squared += (rows[:, axis, None] - others[:, axis]) ** 2
    squared[squared <= same * same] = math.inf
    nearest: np.ndarray = np.sqrt(squared.min(axis=1))
    return nearest


def _refine(
    points: np.ndarray,
    lower: np.ndarray,
    sample: np.ndarray,
    coarse: np.ndarray,
    times: np.ndarray,
    same: float,
    reach: float,
) -> np.ndarray:
    """Return the nearest distances of the sample, exact up to their median, in the whole cloud.

    Neighbours are looked for in the 27 search boxes around a point of the sample, whose size grows until more than half
    of the sample have theirs, each counted as often as it was taken; the others are farther than the median.
    """
    found = np.full(len(sample), math.inf)
    known = coarse[np.isfinite(coarse)]
    if not len(known):  # the sample coincides, yet other points may not
        known = np.array([reach])
    size = 1.5 * float(np.median(known)) * math.sqrt(len(sample) / len(points))
    size = max(size, 4 * same, 1e-12 * reach)
    while 2 * times[np.isfinite(found)].sum() <= times.sum() and size < 4 * reach:
        rows = np.flatnonzero(np.isinf(found))
        near = _search(points, lower, sample[rows], size, same)
        done = near <= size
        found[rows[done]] = near[done]
        size *= 2.0
    return found


def _search(points: np.ndarray, lower: np.ndarray, sample: np.ndarray, size: float, same: float) -> np.ndarray:
    """Return the distance of each point of the sample to the nearest point in its 27 search boxes, inf where none."""
    step = np.stack(np.meshgrid(*[np.arange(-1, 2)] * 3, indexing="ij"), axis=-1).reshape(27, 3)
    wanted = _hash(_box(sample, lower, size)[:, None, :] + step)
    marked = np.zeros(1 << 20, dtype=bool)
    marked[_slot(wanted)] = True
    places, keys = [], []
    for begin in range(0, len(points), 1 << 19):
        part = points[begin : begin + (1 << 19)]
        key = _hash(_box(part, lower, size))
        keep = np.flatnonzero(marked[_slot(key)])
        places.append(part[keep])
        keys.append(key[keep])
    place, key = np.concatenate(places), np.concatenate(keys)
    order = np.argsort(key, kind="stable")
    place, key = place[order], key[order]
    start, stop = np.searchsorted(key, wanted, "left"), np.searchsorted(key, wanted, "right")
    nearest = np.empty(len(sample))
    for row in range(len(sample)):
        nearest[row] = _nearest_in(place, start[row], stop[row], sample[row], same)
    return nearest


def _nearest_in(place: np.ndarray, start: np.ndarray, stop: np.ndarray, point: np.ndarray, same: float) -> float:
    """Return the distance of one point to the nearest place in the given ranges that does not coincide."""
    ranges = [place[a:b] for a, b in zip(start.tolist(), stop.tolist(), strict=True) if a < b]
    best = math.inf
    for part in [np.concatenate(ranges)] if sum(map(len, ranges)) < MOST_PAIRS else ranges:
        squared = ((part - point) ** 2).sum(axis=1)
        best = min(best, float(squared.min(initial=math.inf, where=squared > same * same)))
    return math.sqrt(best)


def _box(points: np.ndarray, lower: np.ndarray, size: float) -> np.ndarray:
    """Return the integer search box of each point, (..., 3) int64."""
    box: np.ndarray = np.floor((points - lower) / size).astype(np.int64)
    return box


def _hash(box: np.ndarray) -> np.ndarray:
    """Return one number for each box; boxes may share one, which costs time but no neighbour."""
    mixed: np.ndarray = box[..., 0] * 73856093 + box[..., 1] * 19349663 * 1013 + box[..., 2] * 83492791 * 1000003
    return mixed


def _slot(key: np.ndarray) -> np.ndarray:
    """Return the place of a key in a table of 2**20."""
    slot: np.ndarray = (key ^ (key >> 20)) & ((1 << 20) - 1)
    return slot
