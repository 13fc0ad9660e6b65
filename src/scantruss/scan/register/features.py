"""Features of a scan: for every place, how the surface bends around it, independent of the pose of the scan.

Fast point feature histograms (Rusu, Blodow and Beetz 2009) with two changes that smooth shells need. The bins are quantiles of
the values of all scans together: on a shell with little relief most values are near zero, and equal bins would hold them all. And
near and far pairs are counted separately.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernels.scan import features as kernels
from ...runtime.parallel import run_in_parts
from .views import View

ANGLE_BINS = 11  # bins of each of the three angles of a feature
FEATURE_REACH = 6.0  # radius of a feature, in spacings of the view
FEATURE_STEPS = 1000.0  # steps to which a feature is rounded
VALUES_FOR_BINS = 200_000  # values of each scan from which the bins are found


def find_features(views: Sequence[View]) -> list[np.ndarray]:
    """Return the features (S, 2 * 3 * ANGLE_BINS) of each view, whole numbers as float32, comparable among these views."""
    edges = _edges(views)
    return [_histograms(view, edges) for view in views]


def features_from_behind(features: np.ndarray) -> np.ndarray:
    """Return what the features would be if the normals faced the other side: two of the three angles change sign."""
    parts = features.reshape(len(features), 2, 3, ANGLE_BINS).copy()
    parts[:, :, 1:] = parts[:, :, 1:, ::-1]
    return parts.reshape(features.shape)


def _edges(views: Sequence[View]) -> np.ndarray:
    """Return the bounds between bins (3, ANGLE_BINS - 1): quantiles of the values of all views, the same for both sides."""
    values = []
    for view in views:
        sample = np.empty((VALUES_FOR_BINS, 3))
        every = max(len(view.points) * 15 // VALUES_FOR_BINS, 1)
        reach = FEATURE_REACH * view.spacing
        count = kernels.sample_values(view.points, view.normals, view.boxes, reach, every, sample)
        values.append(sample[:count])
    sizes = np.sort(np.abs(np.concatenate(values)), axis=0)  # mirrored, they serve both sides
    halves = (
        [sizes[int(len(sizes) * (2 * part + 1) / ANGLE_BINS)] for part in range(ANGLE_BINS // 2)] if len(sizes) else []
    )
    upper = np.array(halves).reshape(-1, 3)
    return np.ascontiguousarray(np.concatenate([-upper[::-1], upper]).T)


def _histograms(view: View, edges: np.ndarray) -> np.ndarray:
    """Return the features of one view."""
    reach, count = FEATURE_REACH * view.spacing, len(view.points)
    plain = np.zeros((count, 6 * ANGLE_BINS))
    mixed = np.zeros_like(plain)
    run_in_parts(count, 300, kernels.point_histograms, view.points, view.normals, view.boxes, reach, edges, plain)
    run_in_parts(count, 300, kernels.mix_histograms, view.points, view.boxes, reach, plain, mixed)
    # roots weigh rare values as much as frequent ones; whole numbers up to FEATURE_STEPS can be multiplied and added exactly in float32
    return np.round(FEATURE_STEPS * np.sqrt(mixed)).astype(np.float32)
