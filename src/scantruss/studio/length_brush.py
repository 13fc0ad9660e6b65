"""A length field painted with a brush: dabs of another member length on the scan, by clicks or by dragging."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..scan.clean.thinning import thin_to
from ..scan.cloud import PointCloud
from ..settings import Settings
from .colours import colors_of, legend_of
from .dragging import place_under
from .drawn_lines import ScannedPoints, clicked_point
from .frame import SceneFrame

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

PAINT_MODE = "paint length"
MOST_PAINTED = 1500  #: places at which a painted length is kept
PAINTED_SIZE = 0.14  #: of such a place that is drawn [scene]
#: of a dab where none is typed: its length, its radius [length where none is painted]
DAB_LENGTH, DAB_RADIUS = 0.5, 4.0
UNSEEN_OPACITY = 0.01  #: opacity of the surface on which pointers are followed
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
    return settings.replace(
        length=float(rows[:, 3].min()), length_field=tuple(map(tuple, rows.tolist())), rows_along=()
    )


class LengthBrush:
    """Paints member lengths."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        paint = gui.add_button(
            "Paint", hint="then click on the scan, or drag over the grid: each place gets a round dab"
        )
        self.length = gui.add_text(
            "length there", "", hint=f"in the unit of the scan; empty: {DAB_LENGTH:g} of the length above"
        )
        self.radius = gui.add_text(
            "radius", "", hint=f"of a dab, in the unit of the scan; empty: {DAB_RADIUS:g} members"
        )
        self.usual = gui.add_markdown("")
        none = gui.add_button("No field", hint="one length everywhere")
        view.corrects(self.length, self.radius)
        paint.on_click(view.step(lambda: setattr(view.click, "value", PAINT_MODE)))
        none.on_click(view.step(view.session.unpaint))
        view.modes[PAINT_MODE] = self._click
        self._stroke: Settings | None = None  # while it is dragged
        self._surface: Any = None  # an unseen one, for pointers are followed on bodies only
        view.when_mode_changes(self._take_or_leave)

    def _number(self, text: Any, usual: float) -> float:
        try:
            return float(text.value) if text.value.strip() else usual
        except ValueError:
            raise InputError(f"{text.label} needs a number, got {text.value!r}") from None

    def _click(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        self._finish(self._dabbed(self.view.session.settings, clicked_point(self.view, origin, ahead)))

    def _dabbed(self, settings: Settings, place: np.ndarray) -> Settings:
        """Return settings with a dab at a place of the scan (3,)."""
        cloud, main = self.view.session.cloud, self.view.session.state.main_length
        assert cloud is not None
        radius, length = (
            self._number(self.radius, DAB_RADIUS * main),
            self._number(self.length, DAB_LENGTH * main),
        )
        return painted(cloud, settings, place, radius, length)

    def _finish(self, made: Settings) -> None:
        self.view.session.paint(made)

    # ---- dragging

    def _take_or_leave(self) -> None:
        self._show_surface()
        self._draw(self.view.session.settings)

    def _show_surface(self) -> None:
        """Follow pointers over the grid while the brush is in hand, and no longer then."""
        grid = self.view.session.grid if self.view.click.value == PAINT_MODE else None
        if self._surface is not None:
            self._surface.remove()
            self._surface = None
        if grid is not None:
            self._surface = self.view.scene.api.add_mesh_simple(
                "/paint surface", self.view.frame.to_scene(grid.scan_nodes), grid.triangles.astype(np.uint32),
                side="double", opacity=UNSEEN_OPACITY, cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
            self._surface.on_drag("left")(self.view.in_order(self._dragged))

    def _dragged(self, event: Any) -> None:
        """Take the places under a pointer that is dragged: one step in all."""
        if event.phase == "end":
            made, self._stroke = self._stroke, None
            if made is not None:
                self.view.do(lambda: self._finish(made))
            return
        if event.phase == "start":
            self._stroke = None
        place = place_under(self.view, np.array(event.end_position), exactly=False)
        if place is not None:
            self.view.do_quietly(lambda: self._go_on(place))

    def _go_on(self, place: np.ndarray) -> None:
        self._stroke = self._dabbed(self._stroke or self.view.session.settings, place)
        self._draw(self._stroke)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the painted lengths of a state."""
        if before is None or before.grid is not state.grid:
            self._show_surface()
        field, settings = state.settings.length_field, state.settings
        main, unit = state.main_length, f" {state.cloud.unit}" if state.cloud is not None and state.cloud.unit else ""
        self.usual.content = f"empty: length {DAB_LENGTH * main:.4g}, radius {DAB_RADIUS * main:.4g}{unit}"
        same = (
            before is not None and before.settings.length_field == field and before.settings.length == settings.length
        )
        if same and before is not None and before.cloud is state.cloud:
            return
        self._draw(settings)

    def _draw(self, settings: Settings) -> None:
        """Draw the painted lengths of some settings."""
        field, cloud = settings.length_field, self.view.session.cloud
        is_held = self.view.click.value == PAINT_MODE  # else it hides the grid
        if cloud is None or not field or isinstance(field, str) or not is_held:
            self.view.scene.remove("/painted")
            self.view.legends.show("painted", None)
            return
        rows = np.array(field, float)
        lengths = rows[:, 3] * settings.length / rows[:, 3].min()
        colors, low, high = colors_of(lengths, None)
        places = SceneFrame.of(cloud).to_scene(rows[:, :3])
        self.view.scene.points("/painted", places, colors, PAINTED_SIZE)
        self.view.legends.show("painted", legend_of("painted length", cloud.unit, low, high, False))
