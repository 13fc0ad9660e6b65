"""Types that are mirror images of each other: made with the same jig, the other way round."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .clusters import Clusters, PanelSizes, misfits_of_node, misfits_of_panels
from .joints import Joints

NO_IMAGE = -1  # of a type without one among the types


def panel_images(types: Clusters, sizes: PanelSizes, tolerance: float) -> np.ndarray:
    """Return for each type of panel (K,) the one that is its mirror image within the tolerance, itself if it has an axis; else NO_IMAGE."""
    one, count = types.representative, sizes.count[types.representative]
    turned = sizes.mirrored(one)
    image = np.full(len(one), NO_IMAGE)
    for k in range(len(one)):
        same = np.flatnonzero(count == count[k])
        off = np.full(len(one), np.inf)
        off[same] = misfits_of_panels(turned, k, sizes, one[same])
        image[k] = image_of(off, k, tolerance)
    return image


def node_images(types: Clusters, joints: Joints, tolerance: float) -> np.ndarray:
    """Return for each type of node (K,) the one that is its mirror image within the tolerance, as `panel_images` does."""
    both = _with_images(joints)
    count, one = len(joints.valence), types.representative
    valence = joints.valence[one]
    tilt = np.bincount(joints.node, joints.tilt, count)[one] / np.maximum(valence, 1)
    image = np.full(len(one), NO_IMAGE)
    for k in range(len(one)):
        near = np.flatnonzero((valence == valence[k]) & (np.abs(tilt - tilt[k]) <= tolerance))
        off = np.full(len(one), np.inf)
        off[near] = misfits_of_node(both, count + int(one[k]), one[near]).min(axis=1)
        image[k] = image_of(off, k, tolerance)
    return image


def image_of(off: np.ndarray, own: int, tolerance: float) -> int:
    """Return the type with the least misfit, the own one where it fits."""
    if off[own] <= tolerance:
        return own
    best = int(off.argmin())
    return best if off[best] <= tolerance else NO_IMAGE


def _with_images(joints: Joints) -> Joints:
    """Return the joints and behind them their mirror images, ends anticlockwise again."""
    place = np.arange(len(joints.node))
    begin, end = joints.start[joints.node], joints.start[joints.node + 1]
    back = begin + end - 1 - place
    count = len(joints.valence)
    return replace(
        joints,
        own=np.concatenate([joints.own, joints.own[back] * [1.0, -1.0, 1.0]]),
        bolt=np.concatenate([joints.bolt, joints.bolt[back]]),
        node=np.concatenate([joints.node, joints.node + count]),
        start=np.concatenate([joints.start, joints.start[1:] + len(place)]),
    )
