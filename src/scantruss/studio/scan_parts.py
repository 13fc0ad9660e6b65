"""What is taken of a scan that was opened: by class and place, without points that cleaning or a hand removes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..scan.clean.steps import clean_points
from ..scan.cloud import PointCloud
from ..scan.formats.choose import choose, cropped_boxes, describe_points
from ..selection import Selection
from ..settings import Settings

UP_AXES = {
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)), "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)), "x": ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)), "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)), "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
}  # fmt: skip  #: x, y and z of a scan in axes of its file, by the axis that points up
CLEANING_STEPS = ("duplicates", "near_duplicates", "outliers", "pieces")  #: those that only remove points


@dataclass(frozen=True, eq=False)
class Cleaning:
    """What a cleaning does, with the numbers of the options of ``scantruss clean`` that repeat it."""

    outlier_distance: float
    loose_pieces: float
    removes: np.ndarray  #: (N,) bool, of the whole scan; of the points that are taken while it is proposed
    words: tuple[str, ...] = ()
    crop: tuple[str, ...] = ()  #: of the part that was cleaned

    @property
    def options(self) -> list[str]:
        """The options of ``scantruss clean``."""
        numbers = ["--outlier-distance", f"{self.outlier_distance:g}", "--loose-pieces", f"{self.loose_pieces:g}"]
        return [*numbers, "--judge-outliers", "always", "--keep-layers", "--no-smooth", "--no-normals"]


@dataclass(frozen=True, eq=False)
class WholeScan:
    """A scan as it was opened."""

    cloud: PointCloud
    classes: np.ndarray | None = None  #: (N,) of its points, where the file has them
    colors: np.ndarray | None = None  #: (N, 3) uint8, where the file has them
    up: str = "z"  #: axis of the file that points up, of `UP_AXES`

    @property
    def held_classes(self) -> tuple[int, ...]:
        """The classes that occur."""
        return () if self.classes is None else tuple(int(each) for each in np.unique(self.classes))


def cleaning_of(cloud: PointCloud, outlier_distance: float, loose_pieces: float) -> Cleaning:
    """Return what a cleaning would remove of a scan, as ``scantruss clean`` does it; outliers are always looked for, since a person judges.

    Raises
    ------
    InputError
        A number is out of range, or too few points would be left.
    """
    found = clean_points(
        cloud, outlier_distance=outlier_distance, judge_outliers="always", loose_pieces=loose_pieces, layer_distance=None,
        smooth=False, normals=False,
    )  # fmt: skip
    removes = np.ones(len(cloud.points), np.bool_)
    removes[found.kept] = False
    return Cleaning(
        outlier_distance,
        loose_pieces,
        removes,
        tuple(step.words for step in found.steps if step.name in CLEANING_STEPS and step.count),
    )


def taken_of_scan(
    whole: WholeScan, settings: Settings, cleaning: Cleaning | None = None, removed: np.ndarray | None = None
) -> np.ndarray:
    """Return which points of a scan are taken (N,), as if the file had been read with the classes and the crop of the settings.

    Parameters
    ----------
    cleaning : Cleaning, optional
        That was done.
    removed : (N,) bool, optional
        Points that were removed by hand.

    Raises
    ------
    InputError
        No point is left.
    """
    cloud = whole.cloud
    kept, _ = selected(whole, settings)
    for goes in (None if cleaning is None else cleaning.removes, removed):
        if goes is not None:
            kept = kept & ~goes
    if not kept.any():
        raise InputError(f"no point of {cloud.name or 'the scan'} is left")
    return kept


def selected(whole: WholeScan, settings: Settings) -> tuple[np.ndarray, dict[str, int]]:
    """Return which points of a scan have the classes and lie in the crop of the settings (N,), and how many do not, by its words.

    Raises
    ------
    InputError
        No point does.
    """
    cloud = whole.cloud
    if not (settings.classes or settings.crop):
        return np.ones(len(cloud.points), np.bool_), {}
    places = cloud.points + cloud.origin
    attributes = {} if whole.classes is None else {"class": whole.classes}
    if settings.classes and not attributes:
        raise InputError(f"{cloud.name or 'the scan'} has no classes to choose from")
    kept, left_out = choose(places, attributes, Selection(classes=settings.classes, crop=settings.crop))
    if not kept.any():
        said = ", ".join(f"{count:,} {words}" for words, count in left_out.items() if count)
        held = describe_points(places, attributes)
        raise InputError(
            f"no point of {cloud.name or 'the scan'} is left: of {len(places):,} points {said}; the scan has{held}"
        )
    return kept, left_out


def part_of_scan(
    whole: WholeScan, settings: Settings, cleaning: Cleaning | None = None, removed: np.ndarray | None = None
) -> PointCloud:
    """Return the points that are taken, see `taken_of_scan`, as if they were read: what options leave out of its file is counted."""
    part = _taken(whole.cloud, taken_of_scan(whole, settings, cleaning, removed))
    if cleaning is not None or removed is not None or whole.up != "z" or part is whole.cloud:
        return part  # of a file that holds no other points
    kept, counts = selected(whole, settings)
    boxes = cropped_boxes(whole.cloud.points + whole.cloud.origin, kept, Selection(crop=settings.crop))
    counted = tuple((words, count) for words, count in counts.items() if count)
    return replace(part, left_out=(*part.left_out, *counted), cropped=tuple(boxes.items()))


def turned_scan(whole: WholeScan, up: str) -> WholeScan:
    """Return a scan with another axis of its file upwards, turned about the origin; no reference system has such coordinates."""
    turn = np.array(UP_AXES[up], float) @ np.array(UP_AXES[whole.up], float).T
    cloud = whole.cloud
    normals = None if cloud.normals is None else np.ascontiguousarray(cloud.normals @ turn.T)
    made = PointCloud.from_array((cloud.points + cloud.origin) @ turn.T, cloud.unit, cloud.name, normals)
    made = replace(made, notes=cloud.notes, dropped=cloud.dropped, left_out=cloud.left_out)
    return replace(whole, cloud=made, up=up)


def _taken(cloud: PointCloud, kept: np.ndarray) -> PointCloud:
    """Return some points of a scan with an origin of their own, as of a file that holds no others."""
    if kept.all():
        return cloud
    normals = None if cloud.normals is None else cloud.normals[kept]
    part = PointCloud.from_array(cloud.points[kept] + cloud.origin, cloud.unit, cloud.name, normals)
    return replace(part, system=cloud.system, notes=cloud.notes, dropped=cloud.dropped, left_out=cloud.left_out)
