"""PointCloud: measured points relative to a local origin, and their spacing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np

from ..errors import InputError, words_of_number
from ..runtime.parallel import in_parts, processors, run_in_parts
from .checks import (
    LIKELY_CAUSE,
    check_sensible,
    find_invalid,
    find_no_data,
    find_no_data_place,
    have_one_height,
    invalid_values_note,
    no_data_note,
    no_data_place_note,
    usual_extent,
)
from .units import check_unit

Bounds = tuple[np.ndarray, np.ndarray]  #: the smallest and the largest coordinates, (3,) each [scan unit]

INVALID_COORDINATES = "with coordinates a million times too large"
AT_NO_DATA = "with a height that stands for no data"
AT_NO_DATA_PLACE = "at a place that stands for no data"
LARGEST_COORDINATE = 1e100  # coordinates beyond this overflow when squared
WITHOUT_COORDINATES = "with NaN or infinite coordinates"  # why points are not read
SURVEY_UNITS = ("m", "foot")  # scans in these have z up
SURVEY_FILES = (".las", ".laz", ".e57", ".pts", ".ptx")  # files of scans that have z up, whatever their unit
MOST_COPIES = 5  # times that a scan may be stored with every point repeated
POINTS_FOR_SPACING = 600  # points at which the spacing is measured
POINTS_FOR_FIRST_SPACING = 60  # points among them for a first estimate
POINTS_FOR_GAP = 200  # points at which the gap is measured
POINTS_FOR_SHARE = 60  # points at which a quick look tells how many have others near
COORDINATES_PER_THREAD = 50_000  # fewest points that are worth a thread


@dataclass(frozen=True, eq=False)
class PointCloud:
    """The points of a scan, clean and near the origin of their own frame."""

    points: np.ndarray  #: (N, 3) float64 [scan unit], relative to `origin`
    origin: np.ndarray  #: (3,) float64 [scan unit], so that national-grid coordinates lose nothing
    unit: str = ""  #: mm, cm, m, inch, foot, or "" if it is not known
    dropped: int = 0  #: points left out because a coordinate was NaN or infinite
    left_out: tuple[tuple[str, int], ...] = ()  #: why other points of the file were not taken, and how many
    name: str = ""  #: file the points came from
    notes: tuple[str, ...] = ()  #: what a user should know about how it was read
    normals: np.ndarray | None = None  #: (N, 3) that came with the points
    system: str = ""  #: reference system of the coordinates, such as EPSG:25833; "" where it is not known
    cropped: tuple[tuple[str, np.ndarray], ...] = ()  #: (2, 3) the box around what is left out by a crop, by its words

    def __repr__(self) -> str:
        """Give the number of points and the extent."""
        sides = " x ".join(words_of_number(side, 4) for side in self.bounds[1] - self.bounds[0])
        unit = f" {self.unit}" if self.unit else ""
        name = f"{self.name}: " if self.name else ""
        return f"PointCloud({name}{len(self.points):,} points, {sides}{unit})"

    @cached_property
    def bounds(self) -> Bounds:
        """Smallest and largest coordinates, (3,) each [scan unit]."""
        return bounds_of(self.points)

    @property
    def z_is_up(self) -> bool:
        """Whether z certainly points upwards: in surveys of buildings and terrain, judged by their unit or file."""
        return self.unit in SURVEY_UNITS or self.name.lower().endswith(SURVEY_FILES)

    @property
    def extent(self) -> float:
        """Longest side of the box around the points [scan unit]."""
        return float((self.bounds[1] - self.bounds[0]).max())

    @cached_property
    def usual_extent(self) -> float:
        """The same of the bulk of the points, where a few lie so far away that they are none of the scan; measured once [scan unit]."""
        usual = float(np.ptp(usual_extent(self.points), axis=0).max())
        return usual if 0.0 < usual < 0.5 * self.extent else self.extent

    @cached_property
    def spacing(self) -> float:
        """Typical distance between neighbouring points [scan unit]; measured once."""
        return measure_spacing(self.points, self.bounds)

    @cached_property
    def gap(self) -> float:
        """Typical distance to the sixth neighbour [scan unit]; measured once."""
        return measure_gap(self.points)

    def show(self) -> Any:
        """Return the scan as a view for a notebook: turn it, zoom; nothing is loaded from the network."""
        return import_module("scantruss.export.page").view_of_cloud(self)  # a layer above this one

    @classmethod
    def from_array(
        cls, points: np.ndarray, unit: str = "", name: str = "", normals: np.ndarray | None = None
    ) -> PointCloud:
        """Return a cloud from an (N, 3) array; checks shape and values, moves to a local origin.

        Parameters
        ----------
        points : (N, 3) array of numbers [scan unit]
            Points with a coordinate that is NaN or infinite are dropped and counted; so are a few a million times farther away
            than the others, with a note in `notes`.
        unit : str
            Unit of the coordinates: mm, cm, m, inch, foot, or "" if it is not known.
        name : str
            File the points came from; messages start with it.
        normals : (N, 3) array, optional
            Normals that came with the points: they distinguish the two sides of something thin.

        Returns
        -------
        PointCloud
            `points + origin` gives back every coordinate to the last bit.

        Raises
        ------
        InputError
            Wrong shape, no numbers, too few points, all points on a line, or values that no scan has.
        """
        check_unit(unit)
        prefix = f"{name}: " if name else ""
        array = _as_coordinates(points, prefix)
        clean, lower, upper = _drop_not_finite(array, prefix)
        dropped, notes, left_out = len(array) - len(clean), tuple[str, ...](), tuple[tuple[str, int], ...]()
        if normals is not None and dropped:
            normals = normals[np.isfinite(array).all(axis=1)]
        if (invalid := find_invalid(clean, lower, upper, prefix)) is not None:
            notes = (invalid_values_note(clean[invalid]),)
            left_out = ((AT_NO_DATA if have_one_height(clean[invalid]) else INVALID_COORDINATES, int(invalid.sum())),)
            clean = clean[~invalid]
            normals = normals if normals is None else normals[~invalid]
            lower, upper = bounds_of(clean)
        if (at_place := find_no_data_place(clean, lower, upper)) is not None:
            notes = (*notes, no_data_place_note(int(at_place.sum()), clean[at_place][0]))
            left_out = (*left_out, (AT_NO_DATA_PLACE, int(at_place.sum())))
            clean = np.ascontiguousarray(clean[~at_place])
            normals = normals if normals is None else normals[~at_place]
            lower, upper = bounds_of(clean)
        if (no_data := find_no_data(clean)) is not None:
            at, value = no_data
            notes = (*notes, no_data_note(int(at.sum()), value + 0.0))
            left_out = (*left_out, (AT_NO_DATA, int(at.sum())))
            clean = np.ascontiguousarray(clean[~at])
            normals = normals if normals is None else normals[~at]
            lower, upper = bounds_of(clean)
        extent = _check_extent(lower, upper, prefix)
        origin = _local_origin(lower, upper, extent)
        moved, sums = _moved(clean, origin)
        _check_not_on_a_line(len(moved), sums, extent, prefix)
        cloud = cls(
            moved, origin, unit=unit, dropped=dropped, left_out=left_out, name=name, notes=notes, normals=normals
        )
        cloud.__dict__["bounds"] = lower - origin, upper - origin  # exact, as all points
        return cloud


def _as_coordinates(points: np.ndarray, prefix: str) -> np.ndarray:
    """Return the points as an ordered (N, 3) float64 array, without a copy where they are one already."""
    try:
        array = np.asarray(points)
    except ValueError:
        raise InputError(f"{prefix}points must have shape (N, 3), got rows of different lengths") from None
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"{prefix}points must have shape (N, 3), got {array.shape}")
    if array.dtype.kind not in "fiu":
        raise InputError(f"{prefix}points must be real numbers, got {array.dtype}")
    with np.errstate(over="ignore", invalid="ignore"):
        return np.ascontiguousarray(array, np.float64)


def _drop_not_finite(array: np.ndarray, prefix: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the finite points with their lower and upper corner; refuse a cloud that is mostly not finite."""
    count = len(array)
    lower, upper = bounds_of(array)
    if not (np.isfinite(lower).all() and np.isfinite(upper).all()) and count:
        array = array[np.isfinite(array).all(axis=1)]
        if 2 * len(array) < count:
            raise InputError(
                f"{prefix}{count - len(array):,} of {count:,} points have NaN or infinite coordinates;"
                " at least half must be finite, so check the export of the scan"
            )
        lower, upper = bounds_of(array)
    if len(array) < 3:
        raise InputError(f"{prefix}at least 3 points are needed, got {len(array)}")
    return array, lower, upper


def by_x(points: np.ndarray) -> np.ndarray:
    """Return points (N, 3) by ascending x."""
    ordered: np.ndarray = points[np.argsort(points[:, 0], kind="stable")]
    return ordered


def bounds_of(array: np.ndarray) -> Bounds:
    """Return the smallest and largest coordinates, (3,) each; NaN if one is NaN or infinite."""
    if not len(array):
        return np.zeros(3), np.zeros(3)
    from ..kernels.geometry.bounds import widen_bounds

    array = np.ascontiguousarray(array)
    found = np.empty((processors(), 2, 3))
    found[:, 0], found[:, 1] = math.inf, -math.inf
    in_parts(len(array), COORDINATES_PER_THREAD, lambda part, begin, end: widen_bounds(array, found[part], begin, end))
    return found[:, 0].min(axis=0), found[:, 1].max(axis=0)


def _check_extent(lower: np.ndarray, upper: np.ndarray, prefix: str) -> float:
    """Return the longest side of the cloud; refuse points that coincide or overflow."""
    largest = float(max(np.abs(lower).max(), np.abs(upper).max()))
    if largest > LARGEST_COORDINATE:
        raise InputError(
            f"{prefix}coordinates must be smaller than {LARGEST_COORDINATE:g}, got {largest:.3g}; {LIKELY_CAUSE}"
        )
    extent = float((upper - lower).max())
    if extent <= max(4 * np.finfo(float).eps * largest, 1 / LARGEST_COORDINATE):
        raise InputError(f"{prefix}all points are at the same place; a grid needs points spread over a surface")
    check_sensible(extent, prefix)
    return extent


def _local_origin(lower: np.ndarray, upper: np.ndarray, extent: float) -> np.ndarray:
    """Return an origin near the cloud from which every point differs by an exact float64.

    An axis keeps its own zero if that lies near the cloud. Otherwise the origin is the centre of the bounding box, rounded to a
    power of two no larger than the extent: coordinates and origin then differ by at most a factor of two, and such a difference
    is exact (Sterbenz).
    """
    step = 2.0 ** math.floor(math.log2(extent))
    centre = 0.5 * lower + 0.5 * upper
    origin: np.ndarray = np.where(np.abs(centre) < 2.0 * extent, 0.0, np.round(centre / step) * step)
    return origin


def _moved(points: np.ndarray, origin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the points from their own origin (N, 3), and the sums (9,) of their coordinates and of the products of these."""
    from ..kernels.geometry.bounds import POINTS_PER_BLOCK, move_points

    blocks = -(-len(points) // POINTS_PER_BLOCK)
    moved, sums = np.empty(points.shape), np.empty((blocks, 9))
    run_in_parts(blocks, COORDINATES_PER_THREAD // POINTS_PER_BLOCK, move_points, points, origin, moved, sums)
    return moved, sums.sum(axis=0)


def _check_not_on_a_line(count: int, sums: np.ndarray, extent: float, prefix: str) -> None:
    """Refuse points whose spread across their main direction is rounding.

    A strip is at least about one spacing wide, that is 1 / N of its length; anything much narrower is a line.
    """
    mean, products = sums[:3] / (count * extent), sums[3:] / (count * extent * extent)
    covariance = products[[0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(3, 3) - np.outer(mean, mean)
    _, middle, largest = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    least = min(max(0.1 / count, 1e-6), 1e-3)
    if middle <= least * least * largest:
        raise InputError(f"{prefix}all points lie on a line; a grid needs points spread over a surface")


def measure_spacing(points: np.ndarray, bounds: Bounds | None = None) -> float:
    """Return the typical distance between neighbouring points.

    The median of the distance to the nearest other point that does not coincide, at up to 600 points taken evenly
    from the file order; always the same for the same points.

    Parameters
    ----------
    points : (N, 3) array [scan unit]
    bounds : their smallest and largest coordinates, where these are known

    Returns
    -------
    float
        Spacing [scan unit]; 0 where all points coincide.
    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    if len(points) < 2:
        return 0.0
    sample = points[np.linspace(0, len(points) - 1, min(len(points), POINTS_FOR_SPACING)).astype(np.int64)]
    lower, upper = bounds or bounds_of(points)
    same = 8 * np.finfo(float).eps * float(max(np.abs(lower).max(), np.abs(upper).max()))
    sample, place = np.unique(sample, axis=0, return_inverse=True)
    if len(place) < len(points):
        reach = float(np.linalg.norm(upper - lower))
        some = _nearest_of(sample[:: len(sample) // POINTS_FOR_FIRST_SPACING + 1], sample, same)
        nearest = _refine(points, sample, some, np.bincount(place.ravel()), same, reach)
    else:
        parts = np.array_split(sample, len(sample) // 500 + 1)
        nearest = np.concatenate([_nearest_of(part, sample, same) for part in parts])
    spacing = float(np.median(nearest[place.ravel()]))
    return spacing if math.isfinite(spacing) else 0.0


def measure_gap(points: np.ndarray) -> float:
    """Return the median distance to the sixth neighbour, coincident points counted once: it measures the density of any pattern.

    Parameters
    ----------
    points : (N, 3) array [scan unit]

    Returns
    -------
    float
        About one spacing for points in a triangular pattern, 2.7 times the distance to the nearest for random ones.
    """
    most = min(6 * MOST_COPIES, len(points) - 1)
    gaps = []
    for squared in _squared_distances(points, POINTS_FOR_GAP):
        near = np.argpartition(squared, most)[: most + 1]
        _, places = np.unique(points[near], axis=0, return_index=True)
        apart = np.sort(squared[near[places]])
        gaps.append(apart[min(6, len(apart) - 1)])
    return float(np.sqrt(np.median(gaps)))


def share_with_six_near(points: np.ndarray, reach: float) -> float:
    """Return the share of points (N, 3), by some of them, with six others within reach, coincident ones counted once."""
    crowded = 0
    for squared in _squared_distances(points, POINTS_FOR_SHARE):
        near = np.flatnonzero(squared <= reach * reach)[: 6 * MOST_COPIES + 1]
        crowded += len(near) > 6 and len(set(map(tuple, points[near].tolist()))) > 6
    return crowded / min(len(points), POINTS_FOR_SHARE)


def _squared_distances(points: np.ndarray, count: int) -> Iterator[np.ndarray]:
    """Yield the squared distances (N,) of all points (N, 3) from each of some of them."""
    for place in points[np.linspace(0, len(points) - 1, min(len(points), count)).astype(np.int64)]:
        squared = np.zeros(len(points))
        for axis in range(3):
            squared += (points[:, axis] - place[axis]) ** 2
        yield squared


def _nearest_of(rows: np.ndarray, others: np.ndarray, same: float) -> np.ndarray:
    """Return the distance of each row to the nearest of the others that does not coincide, inf if none."""
    squared = np.zeros((len(rows), len(others)))
    for axis in range(3):
        squared += (rows[:, axis, None] - others[:, axis]) ** 2
    squared[squared <= same * same] = math.inf
    nearest: np.ndarray = np.sqrt(squared.min(axis=1))
    return nearest


def _refine(
    points: np.ndarray,
    sample: np.ndarray,
    some: np.ndarray,
    times: np.ndarray,
    same: float,
    reach: float,
) -> np.ndarray:
    """Return the nearest distances of the sample, exact up to their median, in the whole cloud.

    Neighbours are sought in search boxes around the points of the sample, which grow until more than half of the sample have one
    (repeated points count each time); the others are farther away than the median. `some` distances to
    the nearest of the sample (K,) say where to begin.
    """
    found = np.full(len(sample), math.inf)
    known = some[np.isfinite(some)]
    if not len(known):  # the sample coincides, yet other points may not
        known = np.array([reach])
    size = 1.5 * float(np.median(known)) * math.sqrt(len(sample) / len(points))
    size = max(size, 4 * same, 1e-12 * reach)
    while 2 * times[np.isfinite(found)].sum() <= times.sum() and size < 4 * reach:
        rows = np.flatnonzero(np.isinf(found))
        near = _search(points, np.ascontiguousarray(sample[rows]), size, same)
        done = np.isfinite(near)
        found[rows[done]] = near[done]
        size *= 2.0
    return found


def _search(points: np.ndarray, sample: np.ndarray, size: float, same: float) -> np.ndarray:
    """Return the distance of each point of the sample to the nearest point within `size`, inf if there is none."""
    from ..kernels.geometry.boxes import new_boxes
    from ..kernels.scan import nearby

    copies = nearby.BOXES_OF_A_PLACE * len(sample)
    boxes = new_boxes(sample.min(axis=0), sample.max(axis=0), 2.5 * size, copies, copies)
    marked = np.zeros(1 << 16, np.bool_)
    nearby.spread_sample(boxes, sample, size, marked)
    squares = np.full((processors(), len(sample)), math.inf)

    def search_part(part: int, begin: int, end: int) -> None:
        nearby.lower_to_nearest(points, boxes, sample, marked, size, same, squares[part], begin, end)

    in_parts(len(points), COORDINATES_PER_THREAD, search_part)
    nearest: np.ndarray = np.sqrt(squares.min(axis=0))
    return nearest
