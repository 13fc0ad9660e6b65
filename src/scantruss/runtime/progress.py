"""How long work reports its progress, and lets a front be seen while it advances."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    SeeFront = Callable[[np.ndarray, np.ndarray], None]
    """Called with the nodes (V, 3) [scan unit] and the triangles (T, 3) that a front has made so far."""

Progress = Callable[[str, float], None]
"""Called with the stage and the share of it that is done, 0 to 1; it may raise to cancel."""


class WatchedProgress:
    """Progress that also sees a front while it advances.

    Parameters
    ----------
    progress : callable, optional
        ``progress(stage, share)``.
    see_front : callable
        ``see_front(nodes, triangles)``, from the thread in which the front advances.
    """

    def __init__(self, progress: Progress | None, see_front: SeeFront) -> None:
        self._progress, self.see_front = progress, see_front

    def __call__(self, stage: str, share: float) -> None:
        """Pass on how far the work is."""
        if self._progress:
            self._progress(stage, share)


def seer_of(progress: Progress | None) -> SeeFront | None:
    """Return what sees a front while it advances; None where nothing does."""
    found: SeeFront | None = getattr(progress, "see_front", None)
    return found
