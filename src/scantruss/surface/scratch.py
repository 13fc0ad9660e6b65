"""Searches in one surface by several threads."""

from __future__ import annotations

from threading import local
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from ..kernels.surface.local_surface import Surface

if TYPE_CHECKING:
    from ..scan.cloud import PointCloud
    from .chosen_samples import Asked
    from .samples import SurfaceSamples


class KeptSamples(local):
    """The samples of clouds that are kept, by each thread its own: in their scratch arrays two threads would write at once."""

    def __init__(self) -> None:
        self.of_clouds: WeakKeyDictionary[PointCloud, dict[Asked, SurfaceSamples]] = WeakKeyDictionary()


def with_own_scratch(surface: Surface) -> Surface:
    """Return the same surface with scratch arrays of its own, for another thread."""
    return surface._replace(
        stamp=np.zeros(surface.stamp.shape, np.int64),
        queue=np.empty_like(surface.queue),
        counter=np.zeros_like(surface.counter),
    )
