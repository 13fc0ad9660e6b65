"""Scales of sliders: from a round number to a round number by a round step."""

from __future__ import annotations

from typing import Any

import numpy as np


def set_scale(slider: Any, low: float, high: float, step: float) -> None:
    """Give a slider other ends and another step, with as many decimals as that needs."""
    slider.min, slider.max, slider.step = low, high, step
    slider.precision = decimals_of(step)


def decimals_of(step: float) -> int:
    """Return how many decimals a round step has."""
    return len(np.format_float_positional(step, trim="-").partition(".")[2])


def round_ends(low: float, high: float) -> tuple[float, float, float]:
    """Return round numbers around the ends of a scale, and a round step of about a 200th of it."""
    step = 10.0 ** np.floor(np.log10((high - low) / 100 or 0.01))
    begin, end = np.floor(low / step), np.floor(high / step) + 1
    return float(f"{begin * step:.12g}"), float(f"{end * step:.12g}"), float(f"{step:.12g}")
