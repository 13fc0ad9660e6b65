"""What lies under a click: rays from the eye against points, nodes, members and panels."""

from __future__ import annotations

import numpy as np

NEAR_ENOUGH = 0.012  #: largest angle between a ray and what it hits [rad]
SAME_DEPTH = 0.03  #: of points that may be hit, behind the first of them [share of its depth]


def along_and_off(places: np.ndarray, origin: np.ndarray, ahead: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the depths of places (N, 3) along a ray, and their distances from it over these depths; inf behind the eye."""
    depth = (places - origin) @ ahead
    off = np.linalg.norm(places - origin - depth[:, None] * ahead, axis=1)
    return depth, np.where(depth > 0, off / np.maximum(depth, 1e-12), np.inf)


def nearest_point(places: np.ndarray, origin: np.ndarray, ahead: np.ndarray, near: float = NEAR_ENOUGH) -> int | None:
    """Return which of some points (N, 3) a ray from `origin` (3,) in direction `ahead` (3,) hits first; None if it hits none."""
    depth, off = along_and_off(places, origin, ahead)
    hit = off < near
    if not hit.any():
        return None
    front = depth < depth[hit].min() * (1.0 + SAME_DEPTH)
    return int(np.where(hit & front, off, np.inf).argmin())


def place_on_scan(
    places: np.ndarray, origin: np.ndarray, ahead: np.ndarray, near: float = NEAR_ENOUGH
) -> np.ndarray | None:
    """Return the point (3,) of a scan (N, 3) that a ray hits first; None if it hits none."""
    found = nearest_point(places, origin, ahead, near)
    return None if found is None else np.asarray(places[found], float)


def nearest_member(ends: np.ndarray, origin: np.ndarray, ahead: np.ndarray) -> tuple[int, float] | None:
    """Return which of some segments (M, 2, 3) a ray hits first and at which depth; None if it hits none."""
    first, span = ends[:, 0] - origin, ends[:, 1] - ends[:, 0]
    across, gap = span - (span @ ahead)[:, None] * ahead, first - (first @ ahead)[:, None] * ahead
    share = np.clip(-(gap * across).sum(axis=1) / np.maximum((across**2).sum(axis=1), 1e-12), 0.0, 1.0)
    depth, off = along_and_off(ends[:, 0] + share[:, None] * span, origin, ahead)
    hit = off < NEAR_ENOUGH
    if not hit.any():
        return None
    number = int(np.where(hit, depth, np.inf).argmin())
    return number, float(depth[number])


def nearest_panel(corners: np.ndarray, origin: np.ndarray, ahead: np.ndarray) -> tuple[int, float] | None:
    """Return which of some triangles (T, 3, 3) a ray hits first and at which depth (Moeller and Trumbore 1997); None if none."""
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(ahead, two)
    size = (one * normal).sum(axis=1)
    usable = np.where(np.abs(size) > 1e-12, size, np.inf)
    away = origin - corners[:, 0]
    u = (away * normal).sum(axis=1) / usable
    other = np.cross(away, one)
    v, depth = (other @ ahead) / usable, (two * other).sum(axis=1) / usable
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (depth > 0) & np.isfinite(usable)
    if not hit.any():
        return None
    number = int(np.where(hit, depth, np.inf).argmin())
    return number, float(depth[number])


def pick(
    nodes: np.ndarray, members: np.ndarray, triangles: np.ndarray, origin: np.ndarray, ahead: np.ndarray
) -> tuple[str, int] | None:
    """Return the node, member or triangle of a panel under a ray as ("nodes", 3); what panels hide is not found.

    Parameters
    ----------
    nodes : (V, 3)
    members : (M, 2) int
    triangles : (T, 3) int
        Of the panels.
    """
    panel = nearest_panel(nodes[triangles], origin, ahead)
    limit = np.inf if panel is None else panel[1] * (1 + 2 * NEAR_ENOUGH)
    node = nearest_point(nodes, origin, ahead)
    if node is not None and float((nodes[node] - origin) @ ahead) <= limit:
        return "nodes", node
    member = nearest_member(nodes[members], origin, ahead)
    if member is not None and member[1] <= limit:
        return "members", member[0]
    return None if panel is None else ("panels", panel[0])
