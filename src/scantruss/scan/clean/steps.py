"""All steps of cleaning, one after the other, each with a count of what it did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError, unit_words
from ...runtime.progress import Progress
from ...settings import JUDGE_OUTLIERS
from ..cloud import PointCloud, bounds_of, measure_spacing
from .duplicates import find_near_duplicates, find_repeated
from .lone import find_lone
from .nearby import REACH_TO, Nearby
from .noise import find_layers, fit_surfaces, onto_surfaces
from .normals import orient_to_one_side
from .outliers import find_outliers, some_stand_alone
from .pieces import find_loose_pieces
from .thinning import thin_to

FEWEST_POINTS_OF_A_SURFACE = 24  # fewest points of a surface
LAYER_ROUNDS = 3  # rounds of merging layers: those farther apart merge step by step


@dataclass(frozen=True)
class Step:
    """The result of one step."""

    name: str  #: duplicates, near_duplicates, outliers, pieces, layers, noise, spacing, normals
    count: int  #: points that it changed or left out
    words: str  #: one line for people


@dataclass(frozen=True, eq=False)
class CleanCloud:
    """A clean scan."""

    points: np.ndarray  #: (N, 3) [scan unit], relative to `origin`, in the order of the scan
    normals: np.ndarray | None  #: (N, 3) unit normals, one side of each piece
    kept: np.ndarray  #: (N,) int64 number of each point in the scan
    origin: np.ndarray  #: (3,) [scan unit]
    unit: str
    steps: tuple[Step, ...]  #: in the order in which they were done


def clean_points(
    points: np.ndarray | PointCloud,
    *,
    duplicates: float | None = 0.01,
    outlier_distance: float | None = 3.0,
    judge_outliers: str = "auto",
    loose_pieces: float | None = 0.005,
    layer_distance: float | None = 2.0,
    smooth: bool = True,
    spacing: float | None = None,
    normals: bool = True,
    unit: str = "",
    progress: Progress | None = None,
) -> CleanCloud:
    """Return a clean scan; None or False switches a step off.

    Parameters
    ----------
    points : (N, 3) array or PointCloud [scan unit]
    duplicates : float
        Points nearer to an earlier one than this share of the spacing in the densest part are left out, and all exact duplicates.
    outlier_distance : float
        Points this many times farther from others than their neighbours are left out, and points off the surface; 0 keeps all, as
        with `Settings.outlier_distance`.
    judge_outliers : str
        "auto" looks for them where points stand alone, as a grid does; "always" takes the most doubtful points of a good scan too.
    loose_pieces : float
        Detached pieces with less than this share of the points are left out; clouds that form no surface with up to four times as
        many, or of any number if they are narrow compared with the largest piece; 0 leaves out none.
    layer_distance : float
        Two layers up to this many mean spacings apart become one.
    smooth : bool
        Points move along the normal to the surface of the points around them.
    spacing : float, optional
        One point stays in each search box of this width [scan unit].
    normals : bool
        Normals are computed and turned to one side.
    unit : str
        Unit of an array of points.
    progress : callable, optional
        ``progress(stage, share)``.

    Raises
    ------
    InputError
        A number is out of range, or too few points are left.
    """
    _check(duplicates, outlier_distance, loose_pieces, layer_distance, spacing)
    if judge_outliers not in JUDGE_OUTLIERS:
        raise InputError(f"judge_outliers must be one of {', '.join(JUDGE_OUTLIERS)}, got {judge_outliers!r}")
    cloud = points if isinstance(points, PointCloud) else PointCloud.from_array(points, unit=unit)
    work = _Work(cloud, progress)
    if duplicates is not None:
        work.leave_out("duplicates", find_repeated(work.points), "duplicate points left out")
        work.leave_out("near_duplicates", find_near_duplicates(work.points, duplicates), "near duplicates left out")
    if outlier_distance:
        work.say("outliers")
        work.leave_out_outliers(outlier_distance, judge_outliers)
    work.check_enough()
    if loose_pieces is not None:
        work.say("pieces")
        near = work.nearby()
        loose = near.in_order(find_loose_pieces(near, loose_pieces))
        work.leave_out("pieces", loose, "points of loose small pieces left out")
        work.check_enough()
    if layer_distance is not None or smooth:
        work.say("noise")
        work.settle(layer_distance, smooth)
    if spacing is not None:
        work.leave_out("spacing", ~thin_to(work.points, spacing), f"points left out for a spacing of {spacing:g}")
        work.check_enough()
    found = work.face() if normals else None
    return CleanCloud(work.points, found, work.kept, cloud.origin, cloud.unit, tuple(work.steps))


def _check(*numbers: float | None) -> None:
    """Refuse numbers that are not positive."""
    names = ("duplicates", "outlier_distance", "loose_pieces", "layer_distance", "spacing")
    for name, value in zip(names, numbers, strict=True):
        if value is not None and not (isinstance(value, int | float) and 0 <= value < np.inf):
            raise InputError(f"{name} must be a number of 0 or more, got {value!r}")
        if name == "spacing" and value == 0:
            raise InputError("spacing must be positive, got 0")


class _Work:
    """A scan while it is cleaned."""

    def __init__(self, cloud: PointCloud, progress: Progress | None) -> None:
        self.points, self._unit = cloud.points, unit_words(cloud.unit)
        self.kept = np.arange(len(cloud.points))
        self.steps: list[Step] = []
        self._progress = progress
        self._normals: np.ndarray | None = None
        self._nearby: tuple[np.ndarray, Nearby] | None = None

    def nearby(self) -> Nearby:
        """Return the nearest of all points, looked up once as long as the points stay."""
        if self._nearby is None or self._nearby[0] is not self.points:
            self._nearby = (self.points, Nearby.of(self.points))
        return self._nearby[1]

    def say(self, stage: str) -> None:
        """Report which step begins."""
        if self._progress:
            self._progress(stage, 0.0)

    def add(self, name: str, count: int, words: str) -> None:
        """Count what a step did."""
        self.steps.append(Step(name, count, f"{count:,} {words}"))

    def leave_out(self, name: str, which: np.ndarray, words: str) -> None:
        """Leave out points (N,) bool."""
        count = int(which.sum())
        self.add(name, count, words)
        if count:
            self.points, self.kept = self.points[~which], self.kept[~which]
            if self._normals is not None:
                self._normals = self._normals[~which]

    def leave_out_outliers(self, distance: float, when: str) -> None:
        """Leave out what lies off every surface."""
        spacing = measure_spacing(self.points)
        outlier = find_lone(self.points, bounds_of(self.points), spacing, distance)
        if when == "always" or some_stand_alone(self.points, spacing):
            rest = np.flatnonzero(~outlier)
            outlier[rest] = find_outliers(np.ascontiguousarray(self.points[rest]), distance)
            self.leave_out("outliers", outlier, "outliers left out")
        elif outlier.any():
            self.leave_out("outliers", outlier, "outliers left out, which have nothing near them")
        else:
            self.add("outliers", 0, "outliers left out: no point stands alone; --judge-outliers always looks closer")

    def check_enough(self) -> None:
        """Refuse to go on with too few points."""
        if (count := len(self.points)) < FEWEST_POINTS_OF_A_SURFACE:
            raise InputError(
                f"only {count} point{' is' if count == 1 else 's are'} left after cleaning, {FEWEST_POINTS_OF_A_SURFACE} are needed;"
                " keep more (--keep-outliers, --keep-pieces), or a smaller --spacing"
            )

    def settle(self, layer_distance: float | None, smooth: bool) -> None:
        """Merge layers and remove the noise."""
        self.check_enough()
        near = self.nearby()
        surfaces = fit_surfaces(near)
        if layer_distance is not None:
            distance = layer_distance * float(np.median(near.reach)) * np.sqrt(np.pi / REACH_TO)
            merged = np.zeros(len(self.points), np.bool_)
            for _ in range(LAYER_ROUNDS):
                layers, between = find_layers(near, surfaces, distance, merged[near.tree.ids])
                if not layers.any():
                    break
                merged = near.in_order(layers)
                self.points = near.in_order(between)
                near = self.nearby()
                surfaces = fit_surfaces(near)
            self.add("layers", int(merged.sum()), "points of doubled layers merged into one")
        moved, normals = onto_surfaces(near, surfaces)
        if smooth:
            way = np.linalg.norm(moved - near.tree.points, axis=1)
            by = f"{np.sqrt((way**2).mean()):.3g}{self._unit}"
            self.add("noise", len(way), f"points moved onto the surface, by {by} (rms)")
            self.points = near.in_order(moved)
        self._normals = near.in_order(normals)

    def face(self) -> np.ndarray:
        """Return normals turned to one side."""
        self.say("normals")
        near = self.nearby()
        if self._normals is None:
            _, found = onto_surfaces(near, fit_surfaces(near))
        else:
            found = self._normals[near.tree.ids]
        oriented = orient_to_one_side(near, near.tree.points, found)
        words = (
            f"normals turned to one side of {oriented.pieces} pieces"
            if oriented.pieces > 1
            else "normals turned to one side"
        )
        if oriented.one_sided:
            words += "; the surface is one-sided (like a Moebius strip), so they change sides somewhere"
        self.add("normals", len(self.points), words)
        return near.in_order(oriented.normals)
