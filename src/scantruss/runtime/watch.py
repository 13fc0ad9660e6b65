"""A watch on the steps of a stage: what is not foreseen ends in a refusal that names the place, never in a run without end.

Every loop ends by a law, but the steps that the law allows may be far more than a stage needs. The watch allows a multiple of those.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import FrontError

SPARE_STEPS = 1000  # further steps that any stage may take


class Watch:
    """Counts the steps of a stage."""

    def __init__(self, words: str, expected: float, multiple: float) -> None:
        """Watch a stage.

        words : what is wrong where it takes more steps, and what to do. expected : steps that it needs. multiple : of them that it may take
        """
        self._words, self._left = words, multiple * expected + SPARE_STEPS

    def note(self, steps: float, where: Sequence[float] | np.ndarray) -> None:
        """Note that steps have been taken; where : the place of the last one, in the scan's own frame.

        Raises
        ------
        FrontError
            The stage has taken more steps than it may; names the place.
        """
        self._left -= steps
        if self._left < 0.0:
            x, y, z = (float(c) for c in where)
            raise FrontError(self._words, where=(x, y, z))
