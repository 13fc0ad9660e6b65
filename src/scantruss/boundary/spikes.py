"""Spikes of a boundary curve: tongues and bays too narrow for members are cut off, but not the pointed corners of the surface."""

from __future__ import annotations

import numpy as np

from ..kernels.boundary import room as kernels
from ..kernels.surface.local_surface import Surface
from .corners import CURVE_STEP
from .curves import normals_along, resample

# tongues and bays narrower than these widths are cut off, one width after the other [member lengths]
SPIKE_LENGTHS = (0.6, 0.3, 0.16)
TIP_ANGLE = 25.0  # least angle of a pointed corner, in which a triangle has room [degree]
# length of the curve before and after it, from which its sides run straight to the tip [member lengths]
SIDES_BEFORE_TIP = 0.5
COSINE_BEFORE_TIP = 0.85  # least cosine of the angle between them: a spike on a straight boundary turns off at its foot
OFF_SIDES = 0.05  # distance of the places of a pointed corner from its sides (rms), at most [member lengths]
PLACES_LOST_AT_MOUTH = 3.0  # farthest that the curve has moved where such a corner was cut off [steps]


def without_spikes(
    surface: Surface, curve: np.ndarray, length: float, *, keeps_tips: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return a closed curve (M, 3) of equal steps without tongues and bays in which no member has room, and the pointed corners it keeps.

    length : desired member length [scan unit]
    """
    tips: list[np.ndarray] = []
    for width in SPIKE_LENGTHS:
        curve, cut = cut_spikes(surface, curve, width * length, CURVE_STEP * length)
        tips += [part for part, foot in cut if keeps_tips and is_tip(part, foot, surface, length)]
    for tip in tips:
        curve = _put_back(curve, tip, CURVE_STEP * length)
    return curve, np.array([part[top_of(part)] for part in tips]).reshape(-1, 3)


def top_of(part: np.ndarray) -> int:
    """Return the number of the place farthest from the mouth of a tongue (L, 3)."""
    return int(np.linalg.norm(part - 0.5 * (part[0] + part[-1]), axis=1).argmax())


def cut_spikes(
    surface: Surface, curve: np.ndarray, width: float, step: float
) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """Cut off tongues and bays of a closed curve that are narrower than `width`: no member fits into them.

    Two places nearer than `width`, with more than 2.5 but less than 30 widths of the curve (or half of it) between them, are
    joined directly.

    Returns
    -------
    curve : (K, 3) what is left
    cut : what was cut off, each places (L, 3) along the curve, and places before the first and after the last of them (2, 3)
    """
    cut: list[tuple[np.ndarray, np.ndarray]] = []
    beside = round(SIDES_BEFORE_TIP / CURVE_STEP)
    for _ in range(len(curve)):  # each cut takes away more places than it adds
        normals = normals_along(surface, curve)
        high = min(len(curve) // 2, round(30.0 * width / step))
        at, gap = kernels.widest_spike(curve, normals, width, round(2.5 * width / step), high)
        if gap == 0:
            break
        curve = np.roll(curve, -at, axis=0)
        cut.append((curve[: gap + 1], curve[[-beside, (gap + beside) % len(curve)]]))
        curve = resample(np.concatenate([curve[:1], curve[gap:]]), step)
    return curve, cut


def is_tip(part: np.ndarray, foot: np.ndarray, surface: Surface, length: float) -> bool:
    """Return whether a part of a curve (L, 3) that was cut off is a pointed corner: the sides before and after it run on to its tip.

    foot : (2, 3) places of the curve before and after it
    """
    mouth = part[-1] - part[0]
    top = top_of(part)
    sides = [part[top] - part[0], part[top] - part[-1]]
    sizes = [float(np.linalg.norm(side)) for side in sides]
    if min(sizes) == 0.0 or sides[0] @ sides[1] > np.cos(np.radians(TIP_ANGLE)) * sizes[0] * sizes[1]:
        return False
    for end, side, size, before in zip((part[0], part[-1]), sides, sizes, foot, strict=True):
        ahead = end - before
        if ahead @ side < COSINE_BEFORE_TIP * size * float(np.linalg.norm(ahead)):
            return False
    arms = (part[: top + 1] - part[0], part[top:] - part[-1])
    off = np.concatenate(
        [np.linalg.norm(np.cross(arm, side / size), axis=1) for arm, side, size in zip(arms, sides, sizes, strict=True)]
    )
    normal = normals_along(surface, part)[[0, -1]].mean(axis=0)
    out = np.cross(mouth, normal)  # the surface lies to the left
    return bool(np.sqrt((off**2).mean()) < OFF_SIDES * length and (sides[0] + sides[1]) @ out > 0.0)


def _put_back(curve: np.ndarray, tip: np.ndarray, step: float) -> np.ndarray:
    """Return a closed curve (M, 3) with a pointed corner (L, 3) that was cut off; as it is where more was cut off there since."""
    away = [np.linalg.norm(curve - end, axis=1) for end in (tip[0], tip[-1])]
    begin, end = (int(each.argmin()) for each in away)
    if max(float(each.min()) for each in away) > PLACES_LOST_AT_MOUTH * step:
        return curve
    rolled = np.roll(curve, -end, axis=0)  # from its end on around to its begin
    kept = (begin - end) % len(curve)
    if kept < len(curve) // 2:
        return curve
    return resample(np.concatenate([rolled[: kept + 1], tip]), step)
