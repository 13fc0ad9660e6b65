"""Balls that are dragged over the scan with the mouse or a finger."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .drawn_lines import ScannedPoints
from .picking import nearest_point

if TYPE_CHECKING:
    from .view import StudioView

POINTS_WHILE_DRAGGED = 40_000  #: of the scan, among which the place under a moving pointer is looked for


def place_under(view: StudioView, pointer: np.ndarray, exactly: bool = True) -> np.ndarray | None:
    """Return the point of the scan (3,) under a pointer, in its own frame; None beside the scan.

    Parameters
    ----------
    pointer : (3,)
        A place of the scene that the camera sees under the pointer.
    exactly : bool
        Whether all points count, or as many as can be looked through while it moves.
    """
    session = view.session
    if session.cloud is None:
        return None
    scanned = ScannedPoints.of(session.cloud, session.settings).places
    if not exactly:
        scanned = scanned[:: max(1, len(scanned) // POINTS_WHILE_DRAGGED)]
    origin = np.array(view.client.camera.position)
    ahead = pointer - origin
    found = nearest_point(view.frame.to_scene(scanned), origin, ahead / np.linalg.norm(ahead), view.near)
    return None if found is None else np.asarray(scanned[found], float)


class DraggedBalls:
    """Balls on the scan, each of which is dragged to another point of it.

    Parameters
    ----------
    name : str
        Of the part of the scene.
    drop : callable
        ``drop(number, place)`` when a ball is let go at a point (3,) of the scan.
    moves : callable, optional
        ``moves(number, place)`` while it is dragged.
    """

    def __init__(
        self,
        view: StudioView,
        name: str,
        drop: Callable[[int, np.ndarray], None],
        moves: Callable[[int, np.ndarray], None] | None = None,
    ) -> None:
        self._view, self._name, self._drop, self._moves = view, name, drop, moves
        self._places = np.zeros((0, 3), np.float32)
        self._last: np.ndarray | None = None

    def show(self, places: np.ndarray, color: np.ndarray, radius: float) -> None:
        """Draw the balls at places (N, 3) of the scene."""
        self._places = places
        self._view.scene.balls(self._name, places, color, radius)
        if len(places):
            self._view.scene.api.get_handle_by_name(self._name).on_drag("left")(self._view.in_order(self._dragged))

    def _dragged(self, event: Any) -> None:
        number, ends = event.instance_index, event.phase == "end"
        if number is None or number >= len(self._places):
            return
        found = place_under(self._view, np.array(event.end_position), exactly=ends)
        if event.phase == "start":
            self._last = None
        self._last = found if found is not None else self._last
        if self._last is None:
            return
        if ends:
            place = self._last
            self._view.do(lambda: self._drop(number, place))
            return
        at = self._places.copy()
        at[number] = self._view.frame.to_scene(self._last[None])[0]
        event.target.batched_positions = at
        if self._moves is not None:
            self._moves(number, self._last)
