"""Where to look at a grid from, and what is seen from there."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...grid.upward import OPEN_SHELL, facing_of, likely_upward
from .style import angles_of

EYE_DISTANCE = 3.4  #: of the eye from the middle, in radii of the grid; a mild perspective
ANGLES = {  # azimuth and elevation of the views of a drawing [degree]
    "top": (0.0, 90.0), "bottom": (0.0, -90.0), "front": (0.0, 0.0), "back": (180.0, 0.0),
    "left": (-90.0, 0.0), "right": (90.0, 0.0),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Camera:
    """An eye that looks at the middle of a grid."""

    middle: np.ndarray  #: (3,) [scan unit]
    right: np.ndarray  #: (3,) unit vector, to the right in the picture
    up: np.ndarray  #: (3,) unit vector, upwards in the picture
    back: np.ndarray  #: (3,) unit vector, from the middle to the eye
    ground: np.ndarray  #: (3,) unit vector, upwards in space
    distance: float  #: from the middle to the eye [scan unit]
    zoom: float = 1.0  #: [pixel] per scan unit at the middle
    shift: tuple[float, float] = (0.0, 0.0)  #: [pixel]

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (N, 2) places in the picture [pixel] and (N,) nearness, larger in front [scan unit]."""
        local = points - self.middle
        near = local @ self.back
        flat = np.stack([local @ self.right, local @ self.up], axis=1) * self.scale(near)[:, None]
        return flat + np.array(self.shift), near

    def scale(self, near: np.ndarray) -> np.ndarray:
        """Return how large things are that are so near: [pixel] per scan unit."""
        scale: np.ndarray = self.zoom * self.distance / np.maximum(self.distance - near, 0.05 * self.distance)
        return scale

    def nearness(self, scale: np.ndarray) -> np.ndarray:
        """Return how near things are that are so large: the opposite of `scale`."""
        return self.distance * (1.0 - self.zoom / scale)

    def around(self, points: np.ndarray) -> Camera:
        """Return a camera that looks the same way at the middle of other points."""
        low, high = points.min(axis=0), points.max(axis=0)
        radius = float(np.linalg.norm(high - low)) / 2 or 1.0
        return replace(self, middle=(low + high) / 2, distance=EYE_DISTANCE * radius, zoom=1.0, shift=(0.0, 0.0))

    def framed(self, points: np.ndarray, box: tuple[float, float, float, float]) -> Camera:
        """Return the camera with zoom and shift such that the points fill a box (left, bottom, right, top) [pixel]."""
        flat, _ = replace(self, zoom=1.0, shift=(0.0, 0.0)).project(points)
        low, high = flat.min(axis=0), flat.max(axis=0)
        left, bottom, right, top = box
        wide, tall = np.maximum(high - low, 1e-300)
        zoom = min((right - left) / wide, (top - bottom) / tall)
        middle = (low + high) / 2 * zoom
        shift = ((left + right) / 2 - float(middle[0]), (bottom + top) / 2 - float(middle[1]))
        return replace(self, zoom=float(zoom), shift=shift)


def choose_camera(
    nodes: np.ndarray, triangles: np.ndarray, upward: np.ndarray | None = None, view: str = "auto"
) -> Camera:
    """Return a camera that looks at a grid from a side.

    "auto" looks obliquely from above: the more an open shell faces upwards, the more from above. The other views are those of a
    drawing: the front is where one looks along y, or against z where y is up.

    Parameters
    ----------
    nodes : np.ndarray
        (V, 3) [scan unit].
    triangles : np.ndarray
        (T, 3) ids of nodes.
    upward : np.ndarray, optional
        (3,) unit vector against gravity; what is likely if it is not known, see `likely_upward`.
    view : str
        One of `VIEWS`, or "AZIMUTH,ELEVATION".
    """
    facing = facing_of(nodes, triangles)
    ground = likely_upward(nodes, facing) if upward is None else upward
    if view in ("auto", "behind"):
        openness = abs(float(facing @ ground))  # the triangles of a scan may all look down
        front = _front(nodes, ground, facing, openness)
        lying = _is_lying(nodes, ground)
        rise = math.radians(12 + 36 * min(max(openness / 0.8, 0.45 if lying else 0.0), 1.0))
        front = -front if view == "behind" else front
    else:
        azimuth, elevation = angles_of(view) or ANGLES[view]
        first, second = _sides(ground)
        turn, rise = math.radians(azimuth), math.radians(elevation)
        front = math.cos(turn) * first + math.sin(turn) * second
    back = math.cos(rise) * front + math.sin(rise) * ground
    right = np.cross(ground, front)
    right /= np.linalg.norm(right)
    return Camera(np.zeros(3), right, np.cross(back, right), back, ground, 1.0).around(nodes)


def _is_lying(nodes: np.ndarray, ground: np.ndarray) -> bool:
    """Whether something is much wider than it is high."""
    height, across = np.ptp(nodes @ ground), max(float(np.ptp(nodes @ side)) for side in _sides(ground))
    return bool(height < 0.5 * across)


def _sides(ground: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the horizontal directions towards a viewer in front, and to the viewer's right."""
    forward = np.array([0.0, 0.0, 1.0]) if abs(ground[1]) > 0.8 else np.array([0.0, -1.0, 0.0])
    first = forward - (forward @ ground) * ground
    first /= np.linalg.norm(first)
    return first, np.cross(ground, first)


def _front(nodes: np.ndarray, ground: np.ndarray, facing: np.ndarray, openness: float) -> np.ndarray:
    """Return a horizontal direction to the eye: slightly off the front, or across the longer side of a lying object."""
    first, second = _sides(ground)
    level = facing - (facing @ ground) * ground
    turn = math.radians(28)
    if openness > 0.5:
        width, depth = np.ptp(nodes @ second), np.ptp(nodes @ first)
        if depth > 1.1 * width:
            first, second = second, -first
    elif np.linalg.norm(level) > OPEN_SHELL:  # as a facade does
        first = level / np.linalg.norm(level)
        second = np.cross(ground, first)
    front: np.ndarray = math.cos(turn) * first - math.sin(turn) * second
    return front
