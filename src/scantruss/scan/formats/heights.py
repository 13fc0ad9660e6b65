"""Whether the heights of an airborne scan look like feet, judged by trees if the file does not say.

A laser pulse with several returns went through leaves, so that the points around it reach from the ground to the crowns: 10 to 30
m in woods. If half of such places are more than 45 units high, the unit is not the metre.
"""

from __future__ import annotations

import math

import numpy as np

TALLEST_WOODS = 45.0  # median height of woods that is not reached in metres
MOST_HEIGHTS = 400_000  # most points examined
BOXES_TO_DECIDE = 100  # boxes of either kind that are needed to decide


def look_like_feet(points: np.ndarray, returns: np.ndarray) -> str:
    """Return a note if heights look like feet, else "".

    Parameters
    ----------
    points : (N, 3) array
    returns : (N,) array
        Number of returns of the pulse of each point.
    """
    if len(points) < 1000 or int(returns.max(initial=0)) < 2:
        return ""
    high = _height_of_woods(points, returns)
    if high < TALLEST_WOODS:
        return ""
    return (
        f"where a pulse came back in several parts the points span a height of {high:.0f} (median): trees are rarely so"
        " tall in metres, so heights look like feet; if x and y are metres, say --unit m --z-unit foot"
    )


def _height_of_woods(points: np.ndarray, returns: np.ndarray) -> float:
    """Return the median span of heights in boxes with several returns, less that in boxes without; 0 where there are few."""
    x, y = points[:, 0], points[:, 1]
    if len(points) > MOST_HEIGHTS:  # a strip of the scan, with all its points
        share = 0.5 * MOST_HEIGHTS / len(points)
        low, high = np.quantile(x[:: max(1, len(x) // 100_000)], [0.5 - share, 0.5 + share])
        inside = np.flatnonzero((x >= low) & (x <= high))
        points, returns = points[inside], returns[inside]
        x, y = points[:, 0], points[:, 1]
    if len(points) < 1000:
        return 0.0
    size = math.sqrt(6.0 * float(np.ptp(x)) * float(np.ptp(y)) / len(points))
    if not size > 0 or not math.isfinite(size):
        return 0.0
    box = np.floor((x - x.min()) / size) * (float(np.ptp(y)) // size + 2) + np.floor((y - y.min()) / size)
    order = np.argsort(box, kind="stable")
    box, z, several = box[order], points[order, 2], returns[order] > 1
    start = np.flatnonzero(np.r_[True, box[1:] != box[:-1]])
    enough = np.diff(np.r_[start, len(box)]) >= 4
    span = np.maximum.reduceat(z, start) - np.minimum.reduceat(z, start)
    wooded = np.maximum.reduceat(several, start)
    bare, woods = span[enough & ~wooded], span[enough & wooded]
    if len(woods) < BOXES_TO_DECIDE:
        return 0.0
    return float(np.median(woods) - (np.median(bare) if len(bare) >= BOXES_TO_DECIDE else 0.0))
