"""Searches in one surface by several threads."""

from __future__ import annotations

import numpy as np

from ..kernels.surface.local_surface import Surface


def with_own_scratch(surface: Surface) -> Surface:
    """Return the same surface with scratch arrays of its own, for another thread."""
    return surface._replace(
        stamp=np.zeros(surface.stamp.shape, np.int64),
        queue=np.empty_like(surface.queue),
        counter=np.zeros_like(surface.counter),
    )
