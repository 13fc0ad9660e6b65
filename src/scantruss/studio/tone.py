"""Colours of lines: the page takes them as light and maps their tone, so that what is to be seen must be turned back first.

The mapping is ACESFilmicToneMapping of three.js (a fit by Stephen Hill), after which colours are encoded as sRGB (IEC 61966-2-1).
"""

from __future__ import annotations

import numpy as np

TONE_EXPOSURE = 0.6  #: by which light is divided first
INTO_ACES = np.array([(0.59719, 0.35458, 0.04823), (0.07600, 0.90834, 0.01566), (0.02840, 0.13383, 0.83777)])
OUT_OF_ACES = np.array([(1.60475, -0.53108, -0.07367), (-0.10208, 1.10813, -0.00605), (-0.00327, -0.07276, 1.07602)])
TONE_CURVE = (0.0245786, 0.000090537, 0.983729, 0.4329510, 0.238081)  #: y = (v(v + a) - b) / (v(cv + d) + e)
BRIGHTEST_TURNED_BACK = 0.98  #: of y that is turned back


def seen(colors: np.ndarray) -> np.ndarray:
    """Return the colours (N, 3) that are seen of lines in some colours (N, 3), from 0 to 255."""
    a, b, c, d, e = TONE_CURVE
    light = (np.asarray(colors, float) / 255.0 / TONE_EXPOSURE) @ INTO_ACES.T
    mapped = (light * (light + a) - b) / (light * (c * light + d) + e)
    linear = np.clip(mapped @ OUT_OF_ACES.T, 0.0, 1.0)
    encoded: np.ndarray = np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-12) ** (1 / 2.4) - 0.055
    )
    return 255.0 * encoded


def to_be_seen(colors: np.ndarray) -> np.ndarray:
    """Return the colours (N, 3) uint8 of lines that are seen in some colours (N, 3), as far as the page can show them."""
    a, b, c, d, e = TONE_CURVE
    share = np.asarray(colors, float) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    mapped = np.clip(linear @ np.linalg.inv(OUT_OF_ACES).T, 0.0, BRIGHTEST_TURNED_BACK)
    square, plain, rest = 1.0 - c * mapped, a - d * mapped, -b - e * mapped
    light = (-plain + np.sqrt(plain**2 - 4.0 * square * rest)) / (2.0 * square)
    found: np.ndarray = np.clip(np.rint(255.0 * TONE_EXPOSURE * (light @ np.linalg.inv(INTO_ACES).T)), 0, 255).astype(
        np.uint8
    )
    return found
