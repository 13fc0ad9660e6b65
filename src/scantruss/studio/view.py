"""The page of one browser: what its session holds, drawn by viser, and tabs whose controls call its steps."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from threading import RLock
from typing import Any

import numpy as np

from ..export.formats import GRID, STRUCTURE
from ..export.model import Model
from ..export.page_tables import Tables, tables_of
from ..grid.panels import panel_of_triangles
from ..structure.build import scale_of
from .button_rows import ButtonRows
from .colours import colorings_of_scan
from .frame import BESIDE_FIRST, DRAWN_EXTENT, ROOM_AROUND, SceneFrame, distance_to_see
from .head import Head
from .legends import Legends
from .outputs import model_to_show
from .picking import NEAR_ENOUGH, pick
from .presses import Presses
from .scene import FIRST_POINTS, Scene, is_layered
from .session import Session
from .state import StudioState
from .style import PANEL_STYLE
from .tab_compare import CompareTab
from .tab_constraints import ConstraintsTab
from .tab_design import DesignTab
from .tab_grid import GridTab
from .tab_out import OutTab
from .tab_scan import ScanTab
from .tab_structure import StructureTab

Click = Callable[[np.ndarray, np.ndarray], None]
"""What a click does, with the origin (3,) and the direction (3,) of its ray in the scene."""
SELECT = "select"
NATURAL_VIEW = 0.65  #: of the camera, upright [rad]
PLAN_VIEW = 0.08  #: the same of a plan, seen from so far that heights hardly matter [rad]
PLAN_FAR = 1.3  #: of the camera above a plan, so that all of it is seen [distance at which it fills the view]
PANEL_WIDTH, USUAL_WIDTH = 452, 1280  #: of the panel; of a page that has not said its own [pixel]
LEAST_PANEL, LARGEST_PANEL = 360, 0.5  #: on narrow pages: of the panel [pixel]; of the page
LEAST_DRAWING = 0.4  #: of a page that the drawing has beside the panel, which lies over it on narrower ones
FIRST_SEEN_FROM = np.array([0.8, -1.4, 0.9])  #: direction from which the scan is seen first
STEP_BUTTONS = {
    "Stop": "ends what runs; what was there before is kept",
    "Undo": "takes back what is said above (Ctrl+Z)",
    "Redo": "takes the step again that is said above (Ctrl+Y)",
    "See all": "moves the camera back to where all is seen",
}  #: and what each does
TABS = ("Scan", "Design", "Constraints", "Grid", "Compare", "Structure", "Out")
OPEN_TABS = (
    "open tabs"  #: label of the field, never seen, in which the page says which tabs are open (`page_script.js`)
)
SMALL_PICTURE, PICTURE_WAIT = (
    (8, 8),
    2.0,
)  #: size of a picture that is asked for first [pixel], and how long it may take [s]
REFUSAL_SECONDS = 10.0  #: for which a refusal stands on the drawing too [s]


class StudioView(Presses):
    """Binds a session to the scene and the controls of one page."""

    def __init__(self, session: Session, client: Any) -> None:
        super().__init__(session)
        self.client = client
        self.scene = Scene(client.scene)
        whole = float(client.camera.image_width or USUAL_WIDTH)
        panel = min(PANEL_WIDTH, max(LEAST_PANEL, LARGEST_PANEL * whole))
        self._width = max(whole - panel, LEAST_DRAWING * whole)  # of the drawing once the panel is beside it [pixel]
        self._lock = RLock()
        self._closed = False
        self._shown: StudioState | None = None
        self._refused = session.message
        self._model: tuple[StudioState, Model, Tables] | None = None
        if session.cloud is not None:  # seen while the controls are still being made
            self.scene.scan(session.state, colorings_of_scan(session.state)[0], None, FIRST_POINTS)
            self.overview()
            client.flush()
            self._wait_for_picture()
        self.modes: dict[str, Click] = {SELECT: self._select_under}  #: what a click in the scene can do
        gui = client.gui
        with client.atomic():
            gui.main_panel.dock_right()
            gui.main_panel.set_width(panel)
            gui.configure_theme(show_share_button=False, show_logo=False, control_width="large")
            gui.add_html(PANEL_STYLE)
            self.head = Head(gui)
            generate = gui.add_button("Generate", color="blue", hint="with the effort that Design says (Ctrl+Enter)")
            self.rows = ButtonRows(gui)
            self.steps = self.rows.add("steps", STEP_BUTTONS)
            self.click = gui.add_dropdown(
                "click to", (SELECT,), hint="what a click on the drawing does; select again once another tab is opened"
            )
            self.row = gui.add_markdown("", visible=False)
            self.legends = Legends(gui)
            tabs = gui.add_tab_group()
            made = {name: tabs.add_tab(name) for name in TABS}
            self._seen_tabs = {TABS[0]}
            with made["Scan"]:
                self.scan = ScanTab(self, gui)
            with made["Design"]:
                self.design = DesignTab(self, gui)
            with made["Constraints"]:
                self.constraints = ConstraintsTab(self, gui)
            with made["Grid"]:
                self.look = GridTab(self, gui)
            with made["Compare"]:
                self.compare = CompareTab(self, gui)
            with made["Structure"]:
                self.structure = StructureTab(self, gui)
            with made["Out"]:
                self.files = OutTab(self, gui)
            self.click.options = self.clicks
            gui.add_html(self.rows.html())
            gui.add_text(OPEN_TABS, "").on_update(self.chosen(self._open))
            generate.on_click(self.step(session.generate))  # before anybody can click
            self.steps.on_click(self.chosen(self._step))
            self._add_keys(gui)
        self.tabs = (self.design, self.constraints, self.structure, self.look, self.scan, self.compare, self.files)
        client.scene.on_click()(self.in_order(self._clicked))
        self._end = session.listen(self.update)
        self.update()

    def _wait_for_picture(self) -> None:
        """Let the page draw what it has, before it is kept busy with a hundred controls."""
        with contextlib.suppress(RuntimeError, TimeoutError):
            self.client.get_render(*SMALL_PICTURE, timeout=PICTURE_WAIT)

    def close(self) -> None:
        """Stop listening to the session; when this returns, nothing is written to the page any more."""
        self._end()
        super().close()
        with self._lock:  # after what is being shown
            self._closed = True

    # ---- controls

    def say(self, words: str) -> None:
        """Say something in passing."""
        self.client.add_notification("ScanTruss", words, auto_close_seconds=6.0)

    def _step(self, name: str) -> None:
        session = self.session
        dict(zip(STEP_BUTTONS, (session.stop, self.undo, session.redo, self.see_all), strict=True))[name]()

    def undo(self) -> None:
        """Drop the last corner of what is being drawn, else take the last step back."""
        if not self.scan.crop.take_back():
            self.session.undo()

    def _add_keys(self, gui: Any) -> None:
        """Let keys take steps too."""
        session = self.session
        for words, key, step in (
            ("Undo", "Z", self.undo),
            ("Redo", "Y", session.redo),
            ("Generate", "enter", session.generate),
        ):
            gui.add_command(words, hotkey=key, modifier="cmd/ctrl").on_trigger(self.step(step))

    # ---- tabs

    def is_open(self, tab: str) -> bool:
        """Whether a tab is seen."""
        return tab in self._seen_tabs

    def _open(self, words: str) -> None:
        """Let a click select again, for what it did, as a crop that is being drawn, belongs to the tab that was left."""
        seen = set(words.split(",")) & set(TABS)
        if seen != self._seen_tabs:
            self._seen_tabs = seen
            self.click.value = SELECT
            if "Scan" not in seen:
                self.scan.crop.put_away()
            self.structure.draw()

    # ---- clicks

    @property
    def clicks(self) -> tuple[str, ...]:
        """What a click can do."""
        return tuple(self.modes)

    def when_mode_changes(self, tell: Callable[[], None]) -> None:
        """Call `tell` whenever a click means something else."""
        self.click.on_update(lambda _: self.do_quietly(tell))

    @property
    def near(self) -> float:
        """Largest angle between a click and what it hits, as seen by the present camera [rad]."""
        return NEAR_ENOUGH * min(float(self.client.camera.fov) / NATURAL_VIEW, 1.0)

    def _clicked(self, event: Any) -> None:
        if self.session.cloud is None:
            return
        origin, ahead = np.array(event.ray_origin), np.array(event.ray_direction)
        ahead = ahead / np.linalg.norm(ahead)
        self.do(lambda: self.modes[self.click.value](origin, ahead))

    def _select_under(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        self.select(*(self.under(origin, ahead) or ("", 0)))

    def under(self, origin: np.ndarray, ahead: np.ndarray) -> tuple[str, int] | None:
        """Return the node, member or panel under a ray."""
        if (shown := self.shown_model()) is None:
            return None
        model, _ = shown
        triangles = model.triangles if self.look.panels.value else model.triangles[:0]
        found = None
        if is_layered(model):  # its panels hide nothing
            found = pick(self.places(model), model.members, triangles[:0], origin, ahead)
        found = found or pick(self.places(model), model.members, triangles, origin, ahead)
        if found is None or found[0] != "panels":
            return found
        return "panels", int(panel_of_triangles(model.panels)[found[1]])

    def select(self, kind: str, number: int) -> None:
        """Show the row of a node, member or panel in its schedule, and draw it in another colour."""
        shown = self.shown_model()
        self.row.visible = bool(kind) and shown is not None
        self.scene.remove("/selected/node", "/selected/member", "/selected/panel")
        if not kind or shown is None:
            return
        model, tables = shown
        cells = [
            (each.name, each.values[number], each.unit) for each in tables[kind] if each.values[number] is not None
        ]
        words = " · ".join(
            f"{name} **{value:.15g}** {unit}" if isinstance(value, float) else f"{name} **{value}**"
            for name, value, unit in cells
        )
        self.row.content = words
        self.scene.highlight(kind, number, self.places(model), model)

    # ---- what is shown

    @property
    def frame(self) -> SceneFrame:
        """The frame of the scene."""
        assert self.session.cloud is not None
        return SceneFrame.of(self.session.cloud)

    def shown_model(self) -> tuple[Model, Tables] | None:
        """Return the structure, or the grid, that is drawn, with its tables; None where there is none."""
        state = self.session.state
        if state.grid is None:
            return None
        kept = self._model
        if kept is None or kept[0].grid is not state.grid or kept[0].solution is not state.solution:
            model = model_to_show(state, STRUCTURE if state.solution is not None else GRID)
            kept = self._model = (state, model, tables_of(model, state.grid))
        return kept[1], kept[2]

    def metres(self) -> float:
        """Return the metres of one scan unit in the structure."""
        state = self.session.state
        asked = state.shown_structure
        return scale_of(state.settings.unit or (state.cloud.unit if state.cloud else "") or asked.unit, asked.scale)

    def unit_of(self, model: Model) -> float:
        """Return one scan unit in the unit of a model: a structure is in metres."""
        return 1.0 if model.truss is None else self.metres()

    def places(self, model: Model) -> np.ndarray:
        """Return where the nodes of a model are drawn (V, 3)."""
        return self.frame.to_scene(model.nodes / self.unit_of(model))

    def fly(self, where: np.ndarray, reach: float) -> None:
        """Move the camera to a place of the scene, as far off as `reach`."""
        with self.client.atomic():
            self.client.camera.position = tuple(where + reach * np.array([0.5, -0.5, 0.7]))
            self.client.camera.look_at = tuple(where)

    def plan(self) -> None:
        """Look at the scan from above, as on a plan."""
        high = PLAN_FAR * 0.5 * DRAWN_EXTENT / np.tan(0.5 * PLAN_VIEW)
        with self.client.atomic():
            self.client.camera.fov = PLAN_VIEW
            self.client.camera.position = (0.0, -1e-3 * high, high)
            self.client.camera.look_at = (0.0, 0.0, 0.0)

    @property
    def _aspect(self) -> float:
        """Width over height of the drawing, the panel beside it."""
        camera = self.client.camera
        return max(min(float(camera.image_width), self._width) / max(float(camera.image_height), 1.0), 0.3)

    def overview(self, designs: int = 1) -> None:
        """Move the camera so that all of the scan is seen, or of several designs side by side."""
        corners = self.frame.corners
        aside = np.array([BESIDE_FIRST * DRAWN_EXTENT * (designs - 1), 0.0, 0.0])
        self.see(np.concatenate([corners, corners + aside]))

    def _look_again(self, before: StudioState | None, state: StudioState) -> None:
        """Look at another scan or crop as a whole; where only some points went or came, as it was looked at before."""
        assert state.cloud is not None
        if (
            before is None
            or before.cloud is None
            or before.opened != state.opened
            or before.settings.crop != state.settings.crop
            or before.cloud.unit != state.cloud.unit
            or (before.whole is not None and state.whole is not None and before.whole.up != state.whole.up)
        ):
            self.overview()
            return
        known, now, camera = SceneFrame.of(before.cloud), SceneFrame.of(state.cloud), self.client.camera
        seen = now.to_scene(known.from_scene(np.array([camera.position, camera.look_at])))
        with self.client.atomic():
            camera.position, camera.look_at = tuple(seen[0].tolist()), tuple(seen[1].tolist())

    def see_all(self) -> None:
        """Move the camera back to where all that is drawn is seen."""
        if self.session.cloud is not None:
            self.overview(self.compare.beside)

    def see(self, places: np.ndarray) -> None:
        """Move the camera so that places of the scene (N, 3) are seen."""
        middle = (places.min(axis=0) + places.max(axis=0)) / 2
        far = ROOM_AROUND * distance_to_see(places - middle, FIRST_SEEN_FROM, NATURAL_VIEW, self._aspect)
        self.client.camera.fov = NATURAL_VIEW
        self.client.camera.position = tuple(middle + far * FIRST_SEEN_FROM / np.linalg.norm(FIRST_SEEN_FROM))
        self.client.camera.look_at = tuple(middle)

    def update(self) -> None:
        """Show what the session holds; called from any thread."""
        session = self.session
        with self._lock, self.client.atomic():
            if self._closed:
                return
            state = session.state
            self.head.show(session)
            if session.message and session.message != self._refused:  # the panel may have been scrolled
                self.client.add_notification(
                    "Refused", session.message, color="red", auto_close_seconds=REFUSAL_SECONDS
                )
            self._refused = session.message
            self.scene.front(None if state.cloud is None or session.front is None else self.frame, session.front)
            before, self._shown = self._shown, state
            for tab in self.tabs:
                tab.fill(before, state)
            if state.cloud is not None and (before is None or before.cloud is not state.cloud):
                self._look_again(before, state)
