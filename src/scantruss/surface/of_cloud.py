"""What is known of the points of a cloud whatever member length is wanted, kept as long as the cloud lives."""

from __future__ import annotations

import weakref

import numpy as np

from ..scan.clean.lone import find_lone
from ..scan.clean.outliers import some_stand_alone
from ..scan.cloud import PointCloud

_OUTLIERS_OF_CLOUDS: weakref.WeakKeyDictionary[PointCloud, bool] = weakref.WeakKeyDictionary()
_LONE_OF_CLOUDS: weakref.WeakKeyDictionary[PointCloud, dict[float, np.ndarray]] = weakref.WeakKeyDictionary()


def cloud_has_outliers(cloud: PointCloud) -> bool:
    """Whether outliers are looked for at every length, since `clean` finds some in the cloud."""
    if cloud not in _OUTLIERS_OF_CLOUDS:
        _OUTLIERS_OF_CLOUDS[cloud] = some_stand_alone(cloud.points, cloud.spacing)
    return _OUTLIERS_OF_CLOUDS[cloud]


def lone_of_cloud(cloud: PointCloud, distance: float) -> np.ndarray:
    """Return which points (N,) bool have nothing else near them; distance as `Settings.outlier_distance`."""
    kept = _LONE_OF_CLOUDS.setdefault(cloud, {})
    if distance not in kept:
        kept[distance] = find_lone(cloud.points, cloud.bounds, cloud.spacing, distance)
    return kept[distance]
