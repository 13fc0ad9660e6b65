"""The colours that points of a scan have in their file, whatever range its numbers have."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

COLOR_ATTRIBUTES = ("red", "green", "blue")
PACKED_COLOR = "rgb"  # all three in one number, as PCD has them
MOST_OF_BYTE, MOST_OF_WORD = 255.0, 65535.0  # largest value of a colour of 8 bits, of 16 bits


def own_colors(attributes: Mapping[str, np.ndarray]) -> np.ndarray | None:
    """Return the colours of points (N, 3) uint8 from the attributes of `COLOR_ATTRIBUTES` or `PACKED_COLOR`; None without these.

    Numbers up to 1, 255 or 65,535 are distinguished by the largest; a file of all dark words is taken for bytes.
    """
    if all(name in attributes for name in COLOR_ATTRIBUTES):
        values = np.stack([np.asarray(attributes[name], np.float64) for name in COLOR_ATTRIBUTES], axis=1)
    elif PACKED_COLOR in attributes:
        packed = _packed(np.asarray(attributes[PACKED_COLOR], np.float64))
        values = np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], axis=1).astype(np.float64)
    else:
        return None
    values = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    most = float(values.max(initial=0.0))
    if most <= 0.0:
        return None  # black everywhere: colours that nobody has measured
    if most <= 1.0 and PACKED_COLOR not in attributes:
        values = values * MOST_OF_BYTE
    elif most > MOST_OF_BYTE:
        values = values * (MOST_OF_BYTE / MOST_OF_WORD)
    return np.clip(np.rint(values), 0, MOST_OF_BYTE).astype(np.uint8)


def _packed(numbers: np.ndarray) -> np.ndarray:
    """Return the whole numbers (N,) of packed colours, which PCD also writes as the bits of a float of 32 bits."""
    whole = np.isfinite(numbers) & (numbers == np.floor(numbers)) & (np.abs(numbers) < 2.0**32)
    if whole.all():
        return numbers.astype(np.int64)
    return numbers.astype(np.float32).view(np.uint32).astype(np.int64)
