"""The mean surface of a scan that is rough, or folds over, at the scale of a member."""

from __future__ import annotations

import numpy as np

from ..kernels.geometry.boxes import new_boxes
from ..kernels.geometry.quadric import TERMS_OF_PLANE, TERMS_OF_QUADRIC
from ..kernels.surface import mean_surface as kernels
from ..kernels.surface.samples import put_all
from ..runtime.parallel import in_parts
from ..scan.cloud import bounds_of
from .linked_samples import samples_of_points

RADIUS_OF_BALLS = 1.5  # radius of the balls over which surfaces are fitted [scales]
#: terms of the surfaces to which the points move, one pass after the other: planes draw the layers of an overhang together
TERMS_OF_PASSES = (TERMS_OF_PLANE, TERMS_OF_QUADRIC, TERMS_OF_QUADRIC)
FITTED_STEP = 0.125  # distance of the points to which surfaces are fitted [radii]
MOVED_STEP = 0.1  # distance of the points that are moved [member lengths]
FITS_PER_THREAD = 500  # fewest places for a thread of their own


def mean_surface(points: np.ndarray, scale: float, length: float) -> np.ndarray:
    """Return points (M, 3) on the surface that is left where all that is smaller than a scale is smoothed away.

    Points far off the others, such as plants, weigh less. The boundary stays where it is.

    Parameters
    ----------
    points : (N, 3) array
        Points without outliers [scan unit].
    scale : float
        Size of what is smoothed away [scan unit].
    length : float
        Desired member length [scan unit].
    """
    places, radius = samples_of_points(points, MOVED_STEP * length)[2], RADIUS_OF_BALLS * scale
    for terms in TERMS_OF_PASSES:
        around = samples_of_points(places, FITTED_STEP * radius)[2]
        boxes = new_boxes(*bounds_of(around), radius, len(around), len(around))
        put_all(boxes, around, np.arange(len(around)))
        in_parts(
            len(places),
            FITS_PER_THREAD,
            lambda _, begin, end: kernels.move_to_mean(places, around, boxes, radius, terms, begin, end),  # noqa: B023
        )
    return places
