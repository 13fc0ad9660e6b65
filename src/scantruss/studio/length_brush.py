"""A length field painted with a brush: round dabs of another member length on the scan."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..scan.clean.thinning import thin_to
from ..scan.cloud import PointCloud
from ..settings import Settings
from .colours import colors_of, legend_of
from .drawn_lines import ScannedPoints
from .frame import SceneFrame
from .picking import nearest_point

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

PAINT_MODE = "paint length"
MOST_PAINTED = 1500  #: places at which a painted length is kept
PAINTED_SIZE = 0.14  #: of such a place that is drawn [scene]
PLACE_DIGITS = 8  #: significant ones of a coordinate


def places_to_paint(cloud: PointCloud, settings: Settings) -> np.ndarray:
    """Return places all over a scan (K, 3) at which lengths are kept, a few members apart, in its own frame [scan unit]."""
    if cloud not in _PLACES:
        points, spacing = ScannedPoints.of(cloud, settings).places, 2.0 * settings.length
        middle = points.mean(axis=0)
        while True:  # ends: the spacing grows each turn, and one box holds all points in the end
            found = points[thin_to(points - middle, spacing)]
            if len(found) <= MOST_PAINTED:
                break
            spacing *= 1.3
        _PLACES[cloud] = np.array([[float(f"{c:.{PLACE_DIGITS}g}") for c in place] for place in found.tolist()])
    return _PLACES[cloud]


_PLACES: weakref.WeakKeyDictionary[PointCloud, np.ndarray] = weakref.WeakKeyDictionary()


def painted(cloud: PointCloud, settings: Settings, at: np.ndarray, radius: float, length: float) -> Settings:
    """Return settings with another length at all places within a radius of one on the scan.

    Raises
    ------
    InputError
        The radius or the length is no positive number, the length depends on the curvature, or no place is that near.
    """
    field = settings.length_field
    if isinstance(field, str) and field:
        raise InputError(f"the length field is {field}; take it away first: No field")
    if not (0 < radius < np.inf and 0 < length < np.inf):
        raise InputError(f"a brush needs a positive length and radius, got {length:g} and {radius:g}")
    if field:
        rows = np.array(field, float)
        rows[:, 3] *= settings.length / rows[:, 3].min()
    else:
        places = places_to_paint(cloud, settings)
        rows = np.column_stack([places, np.full(len(places), settings.length)])
    away = np.linalg.norm(rows[:, :3] - at, axis=1)
    rows[(away <= radius) | (away == away.min()), 3] = length
    rows[:, 3] = [float(f"{each:.6g}") for each in rows[:, 3]]
    return settings.replace(length=float(rows[:, 3].min()), length_field=tuple(map(tuple, rows.tolist())))


class LengthBrush:
    """Paints member lengths."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        paint = gui.add_button("Paint by clicks", hint="then click on the scan: each click is a round dab")
        self.length = gui.add_text("length there", "", hint="in the unit of the scan; empty: half of the length above")
        self.radius = gui.add_text("radius", "", hint="of a dab, in the unit of the scan; empty: 4 members")
        none = gui.add_button("No field", hint="one length everywhere")
        paint.on_click(view.step(lambda: setattr(view.click, "value", PAINT_MODE)))
        none.on_click(view.step(lambda: view.session.set("no length field", length_field="")))
        view.modes[PAINT_MODE] = self._click

    def _number(self, text: Any, usual: float) -> float:
        try:
            return float(text.value) if text.value.strip() else usual
        except ValueError:
            raise InputError(f"{text.label} needs a number, got {text.value!r}") from None

    def _click(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        session = self.view.session
        assert session.cloud is not None
        scanned = ScannedPoints.of(session.cloud, session.settings).places
        found = nearest_point(self.view.frame.to_scene(scanned), origin, ahead, self.view.near)
        if found is None:
            raise InputError("no point of the scan is there; click on the scan")
        field = session.settings.length_field
        usual = session.settings.length
        if field and not isinstance(field, str):
            rows = [row[3] for row in field]
            usual *= max(rows) / min(rows)
        made = painted(
            session.cloud, session.settings, scanned[found],
            self._number(self.radius, 4.0 * usual), self._number(self.length, 0.5 * usual),
        )  # fmt: skip
        session.set("paint", length=made.length, length_field=made.length_field, rows_along=())

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the painted lengths of a state."""
        field, settings = state.settings.length_field, state.settings
        same = (
            before is not None and before.settings.length_field == field and before.settings.length == settings.length
        )
        if same and before is not None and before.cloud is state.cloud:
            return
        self.view.scene.remove("/painted")
        if state.cloud is None or not field or isinstance(field, str):
            self.view.legends.show("painted", "")
            return
        rows = np.array(field, float)
        lengths = rows[:, 3] * settings.length / rows[:, 3].min()
        colors, low, high = colors_of(lengths, None)
        places = SceneFrame.of(state.cloud).to_scene(rows[:, :3])
        self.view.scene.points("/painted", places, colors, PAINTED_SIZE)
        self.view.legends.show("painted", legend_of("painted length", state.cloud.unit, low, high, False))
