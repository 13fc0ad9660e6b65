"""The samples of a scan chosen: large ones where it is smooth, else the usual ones, moved where it is rough."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..scan.clean.outliers import has_outliers, judge_points
from ..scan.cloud import Bounds, bounds_of
from ..settings import SAMPLE_SPACING, SMOOTH_SAMPLE_SPACING, Settings
from .body import PlainPlaces
from .given_normals import GivenNormals
from .linked_samples import (
    LINK_BOX,
    MANY_ROUGH,
    ROUGH_SAMPLE,
    THICKNESS_OF_SHEETS,
    Linked,
    is_rough,
    is_smooth,
    link_finer,
    link_samples,
    refined,
    settle_to_sheet,
    thin_dense,
)
from .mean_surface import mean_surface
from .sharp_edges import BESIDE_EDGE, beside_edges, coarse_samples, on_sharp_edges
from .size_field import Wish, wish_of

SPARSE_SPACING = 0.08  # point spacing above which larger samples are not tried [member lengths]
# distance of the samples of thin walls: at their lips there is room for two or three [member lengths]; and at least, as the points
# inside a wall lie farther apart than those outside [spacings of the points]
WALL_SAMPLE_SPACING, SPACINGS_INSIDE = 0.1, 1.8
UNEVEN_BEND = 20.0  # largest angle between mirrored normals on a smooth scan; at a ridge it is twice as large [degree]
# what a point of the scan was judged to be
KEPT, DUPLICATE, OUTLIER, SPARSE_POINT, ROD, LIMB, SLIT = 0, 1, 2, 3, 4, 5, 6
# thickness above which a sample shows that the scan is rough at the scale of a member [member lengths]
ROUGH_THICKNESS = 0.08


class Asked(NamedTuple):
    """The settings that determine the samples."""

    length: float
    box_size: float | None
    outlier_distance: float
    drop_duplicates: bool
    uneven: float  #: largest angle between mirrored normals where the scan bends evenly [degree]
    wish: Wish | None
    keep_rods: bool
    piece: str
    z_is_up: bool
    limb_girth: float  #: below which limbs are cut off [desired lengths]
    judge_always: bool  #: whether outliers are looked for, and not only points too far apart for the length
    smooth_scale: float  #: size of what is smoothed away [`length`]
    sharp_edges: bool  #: whether samples on sharp edges of bodies face away from them
    #: places from the origin near which thin limbs are taken off the enclosed body, and slits filled; (): everywhere, None: nowhere
    plain: PlainPlaces | None
    thin_walls: bool  #: whether the sides of thin walls are distinguished first

    @classmethod
    def of(cls, settings: Settings, origin: np.ndarray, z_is_up: bool = False) -> Asked:
        """Return those for a cloud with an origin."""
        outliers = settings.outlier_distance if settings.clean else 0.0
        repeated = settings.clean and settings.drop_duplicates
        uneven = min(UNEVEN_BEND, 0.5 * settings.ridge_angle) if settings.ridge_angle > 0.0 else UNEVEN_BEND
        wish, always = wish_of(settings, origin), settings.judge_outliers == "always" and settings.clean
        rods, piece, scale = settings.keep_rods, settings.piece, settings.smooth_scale or 0.0
        girth = 0.0 if settings.boundary else settings.limb_girth
        places = () if settings.plain_body else settings.plain_at
        plain = tuple(tuple((np.array(place, float) - origin).tolist()) for place in places)
        return cls(
            settings.length,
            settings.box_size,
            outliers,
            repeated,
            uneven,
            wish,
            rods,
            piece,
            z_is_up,
            girth,
            always,
            scale,
            settings.sharp_edges,
            plain if settings.is_plain else None,
            settings.thin_walls,
        )


class ChosenSamples(NamedTuple):
    """The samples of a scan, and the points among which they were chosen."""

    found: Linked
    radius: float  #: of a sample
    points: np.ndarray  #: (N, 3) the points given to the samples
    whole: np.ndarray  #: (M, 3) all points of the scan
    judged: np.ndarray | None  #: (M,) what each point given is: KEPT, OUTLIER, SPARSE_POINT; None if all are kept
    smooth: bool  #: whether the scan bends evenly everywhere
    rough: float = 0.0  #: share of the samples thicker than `ROUGH_THICKNESS`


def choose_samples_of(
    points: np.ndarray, bounds: Bounds, spacing: float, asked: Asked, given: GivenNormals | None, thinned: bool
) -> ChosenSamples:
    """Return larger samples where the scan allows it, else the usual ones."""
    return _smooth_samples(points, bounds, spacing, asked, given, thinned) or usual_samples(
        points, bounds, spacing, asked, given, thinned
    )


def _smooth_samples(
    points: np.ndarray, bounds: Bounds, spacing: float, asked: Asked, given: GivenNormals | None, thinned: bool
) -> ChosenSamples | None:
    """Return larger samples if no size is set and the scan is dense, smooth and without outliers, else None."""
    length, radius = asked.length, SMOOTH_SAMPLE_SPACING * asked.length
    exact = asked.box_size is not None or asked.judge_always or asked.smooth_scale or asked.sharp_edges
    if exact or asked.plain is not None or spacing > SPARSE_SPACING * length:
        return None
    some = thin_dense(points, bounds, radius, spacing) if thinned else points
    found = link_samples(some, radius, length, spacing, given)
    if has_outliers(found.neighbors) or not is_smooth(found, length, asked.uneven):
        return None
    return ChosenSamples(found, radius, some, points, None, True)


def usual_samples(
    points: np.ndarray, bounds: Bounds, spacing: float, asked: Asked, given: GivenNormals | None, thinned: bool
) -> ChosenSamples:
    """Return the samples of any scan without its outliers; those of a rough one are moved to the middle of its sheets.

    Or its points are moved to the mean surface before.
    """
    length, judged = asked.length, None
    radius = radius_of_samples(asked, spacing)
    some = thin_dense(points, bounds, radius, spacing) if thinned else points
    found = link_samples(some, radius, length, spacing, given)
    if asked.outlier_distance and (asked.judge_always or has_outliers(found.neighbors)):
        outlier, sparse = judge_points(points, asked.outlier_distance, length)
        if not asked.judge_always:  # they stand alone for members so short, but are no outliers
            outlier, sparse = np.zeros_like(outlier), outlier | sparse
        if outlier.any() or sparse.any():
            judged = np.where(outlier, OUTLIER, np.where(sparse, SPARSE_POINT, KEPT)).astype(np.uint8)
            points = np.ascontiguousarray(points[judged == KEPT])
            some = thin_dense(points, bounds_of(points), radius, spacing)
            found = link_samples(some, radius, length, spacing, given)
    if asked.smooth_scale:
        points = some = mean_surface(some, asked.smooth_scale * length, length)
        found = link_samples(some, radius, length, spacing)
    if is_rough(found, THICKNESS_OF_SHEETS * length):
        fine = link_finer(found, points, radius, length, spacing, given)
        if fine is not None:
            some, (found, radius) = points, fine
    rough = float((found.thickness > ROUGH_THICKNESS * length).mean())
    still = np.zeros(len(found.mean), np.bool_)
    if asked.sharp_edges:
        still = beside_edges(found, on_sharp_edges(found, found.normals.copy(), length), BESIDE_EDGE * length)
    if is_rough(found, ROUGH_SAMPLE * length, MANY_ROUGH):
        found = settle_to_sheet(found, some, radius, length, spacing, still)
    if asked.sharp_edges:
        coarse = coarse_samples(found, length)
        found = refined(found, some, coarse, max(0.5 * radius, spacing), length, spacing) if coarse.any() else found
    return ChosenSamples(found, radius, some, points, judged, False, rough)


def radius_of_samples(asked: Asked, spacing: float) -> float:
    """Return the least distance between samples; their search boxes are `LINK_BOX` times as wide.

    So they are never narrower than the spacing of the points, the lower bound of Eq. 1; holes need no upper one (docs/choices.md).
    """
    usual = SAMPLE_SPACING * asked.length
    if asked.thin_walls:
        usual = min(max(WALL_SAMPLE_SPACING * asked.length, SPACINGS_INSIDE * spacing), usual)
    return max(asked.box_size * asked.length if asked.box_size else usual, spacing / LINK_BOX)
