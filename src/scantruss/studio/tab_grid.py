"""Tab: how the grid is drawn: colours, histogram, certificate, section, pictures."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..export.page_tables import PageColumn, colorings_of
from .certificate_list import CertificateList
from .colours import DIMMED, colors_of, histogram_of, legend_of, values_of
from .frame import SectionPlane
from .scene import BALL_RADIUS, GRID_PARTS, MOST_DRAWN_LINES, TUBE_RADIUS, cut, drawn_colors, plain_colors

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

PLAIN_GRID = "plain"
WHOLE = "none"
LARGE_PICTURE = (2160, 3840)  #: height and width of a picture [pixel]
TURN_SIZE = (540, 960)  #: height and width of a turntable [pixel]
TURN_FRAMES, TURN_MILLISECONDS = 36, 100  #: of a turntable, and how long each is shown
PICTURE_PATIENCE = 120.0  #: how long the browser may take for a picture [s]


class GridTab:
    """What is drawn of the grid, in which colours."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view, step = view, view.step
        self._choices: dict[str, dict[str, Any]] = {}
        self._values: np.ndarray | None = None
        self.coloring = gui.add_dropdown("grid", (PLAIN_GRID,))
        self.legend, self.bars = gui.add_html(""), gui.add_html("")
        self.range = gui.add_multi_slider(
            "from, to", 0.0, 1.0, 0.01, (0.0, 1.0), hint="what lies between them stands out"
        )
        self.count = gui.add_markdown("")
        self.members, self.panels = gui.add_checkbox("draw members", True), gui.add_checkbox("draw panels", True)
        self.nodes, self.tubes = gui.add_checkbox("draw nodes", False), gui.add_checkbox("as tubes and balls", False)
        with gui.add_folder("Certificate", expand_by_default=False):
            self.certificate = CertificateList(view, gui)
        self.axis = gui.add_dropdown("section across", (WHOLE, "x", "y", "z"))
        self.at = gui.add_slider("section at", 0.0, 1.0, 0.01, 0.5)
        self.dark = gui.add_checkbox("dark page", False)
        picture, turn = gui.add_button("Picture, 3840 x 2160"), gui.add_button("Turntable, GIF")
        for each in (self.members, self.panels, self.nodes, self.tubes, self.axis, self.at, self.range):
            each.on_update(step(self.draw))
        self.coloring.on_update(step(lambda: self._chosen(view.session.state)))
        for each in (self.axis, self.at):
            each.on_update(step(lambda: view.scan.draw()))
        self.tubes.on_update(step(lambda: view.scene.light(self.tubes.value)))
        self.dark.on_update(step(self._theme))
        picture.on_click(step(self._picture))
        turn.on_click(step(self._turntable))

    # ---- drawing

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Draw a state."""
        self.certificate.fill(before, state)
        if before is not None and before.grid is state.grid and before.solution is state.solution:
            return
        self.view.select("", 0)
        shown = self.view.shown_model()
        tables = {} if shown is None else shown[1]
        self._choices = {one["words"]: one for one in (colorings_of(tables) if shown is not None else [])}
        kept = self.coloring.value
        self.coloring.options = (PLAIN_GRID, *self._choices)
        best = next(iter(self._choices), PLAIN_GRID)
        has_new_results = before is None or before.solution is not state.solution
        self.coloring.value = (
            kept if kept in self._choices and not (has_new_results and state.solution is not None) else best
        )
        self._chosen(state)

    def _chosen(self, state: StudioState) -> None:
        """Take the colouring that was chosen: its values, legend and histogram."""
        self._values = None
        column = self._column()
        self.range.visible = self.count.visible = column is not None
        if column is None:
            self.legend.content = self.bars.content = ""
        else:
            values, middle = values_of(column), self._choices[self.coloring.value].get("middle")
            _, low, high = colors_of(values, middle)
            self._values = values
            step = (high - low) / 200 or 0.01
            self.range.min, self.range.max, self.range.step = low, high + step, step
            self.range.value = (low, high + step)
            self.legend.content = legend_of(self.coloring.value, column.unit, low, high, middle is not None)
            self.bars.content = histogram_of(values, low, high, middle is not None)
        self.draw()

    def _column(self) -> PageColumn | None:
        choice, shown = self._choices.get(self.coloring.value), self.view.shown_model()
        if choice is None or shown is None:
            return None
        return next((one for one in shown[1][choice["kind"]] if one.name == choice["name"]), None)

    @property
    def section(self) -> SectionPlane | None:
        """The section that is chosen."""
        if self.axis.value == WHOLE or self.view.session.cloud is None:
            return None
        cloud, axis = self.view.session.cloud, "xyz".index(self.axis.value)
        ends = self.view.frame.to_scene(np.stack(cloud.bounds) + cloud.origin)[:, axis]
        return SectionPlane(axis, float(ends[0] + self.at.value * (ends[1] - ends[0])))

    def draw(self) -> None:
        """Draw the grid or structure."""
        scene, shown = self.view.scene, self.view.shown_model()
        if shown is None:
            scene.remove(*GRID_PARTS)
            return
        model, _ = shown
        places = self.view.places(model)
        colors: dict[str, np.ndarray | None] = {"members": None, "nodes": None, "panels": None}
        if self._values is not None:
            choice = self._choices[self.coloring.value]
            own, low, high = colors_of(self._values, choice.get("middle"))
            begin, end = self.range.value
            is_whole = begin <= low and end >= high
            selected = None if is_whole else (self._values >= begin) & (self._values <= end)
            colors[choice["kind"]] = drawn_colors(own, selected)
            said = "" if selected is None else f"{int(selected.sum()):,} of "
            self.count.content = f"{said}{len(self._values):,} {choice['kind']}"
        section, size = self.section, float(np.linalg.norm(np.diff(places[model.members], axis=1), axis=2).mean())
        of_members = plain_colors(len(model.members)) if colors["members"] is None else colors["members"]
        if self.view.structure.is_moved:
            of_members = np.broadcast_to(DIMMED, of_members.shape)
            self.count.content = "grey as built, while the Structure tab shows a displaced shape"
        elif self.view.compare.is_over:
            of_members = np.broadcast_to(DIMMED, of_members.shape)
            self.count.content = "grey, while Compare draws another design over it"
        ends, of_members = cut(section, places[model.members], of_members)
        lines, bodies = self.members.value and not self.tubes.value, self.members.value and self.tubes.value
        scene.members("/grid/members", ends if lines else ends[:0], of_members if lines else of_members[:0])
        scene.tubes(
            "/grid/tubes", ends if bodies else ends[:0], of_members if bodies else of_members[:0], TUBE_RADIUS * size
        )
        kept = np.ones(len(places), bool) if section is None else section.keeps(places)
        drawn = (
            kept if self.nodes.value or self.tubes.value or colors["nodes"] is not None else np.zeros(len(places), bool)
        )
        of_nodes = plain_colors(len(places)) if colors["nodes"] is None else colors["nodes"]
        as_balls = drawn if self.tubes.value and colors["nodes"] is None else drawn & False
        as_points = drawn & ~as_balls  # their colours are those of the legend, without shade
        scene.balls("/grid/balls", places[as_balls], of_nodes[as_balls], BALL_RADIUS * size)
        scene.points("/grid/nodes", places[as_points], np.ascontiguousarray(of_nodes[as_points]), 0.2 * size)
        triangles, of_panels = model.triangles, colors["panels"]
        visible = np.ones(len(triangles), bool) if section is None else kept[triangles].all(axis=1)
        visible &= self.panels.value or of_panels is not None
        scene.panels(
            "/grid/panels",
            places,
            triangles[visible],
            None if of_panels is None else of_panels[visible],
            0.35 if len(model.members) <= MOST_DRAWN_LINES else None,
        )

    # ---- theme and pictures

    def _theme(self) -> None:
        self.view.client.gui.configure_theme(
            show_share_button=False, show_logo=False, control_width="large", dark_mode=self.dark.value
        )

    def _picture(self) -> None:
        height, width = LARGE_PICTURE
        pixels = self._shot(height, width)
        self._send("scantruss.png", [pixels], "PNG")

    def _turntable(self) -> None:
        if self.view.session.cloud is None:
            raise InputError("there is no scan yet; open one")
        camera = self.view.client.camera
        position, target = np.array(camera.position), np.array(camera.look_at)
        frames = []
        for k in range(TURN_FRAMES):
            turn = 2 * np.pi * k / TURN_FRAMES
            around = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
            place = target + around @ (position - target)
            frames.append(self._shot(*TURN_SIZE, wxyz=facing(place, target), position=tuple(place), fov=camera.fov))
        self._send("turntable.gif", frames, "GIF")

    def _shot(self, height: int, width: int, **camera: Any) -> np.ndarray:
        """Return what the browser draws, (height, width, 3) uint8."""
        try:
            pixels: np.ndarray = self.view.client.get_render(height, width, timeout=PICTURE_PATIENCE, **camera)
        except (RuntimeError, TimeoutError):
            raise InputError("the browser gave no picture; keep the page open and in front") from None
        return pixels

    def _send(self, name: str, frames: list[np.ndarray], kind: str) -> None:
        from PIL import Image

        first, *others = [Image.fromarray(np.ascontiguousarray(each[:, :, :3])) for each in frames]
        more = {"save_all": True, "append_images": others, "duration": TURN_MILLISECONDS, "loop": 0} if others else {}
        stream = io.BytesIO()
        first.save(stream, kind, **more)
        self.view.client.send_file_download(name, stream.getvalue(), save_immediately=True)


def facing(place: np.ndarray, target: np.ndarray) -> tuple[float, float, float, float]:
    """Return the quaternion w, x, y, z of a camera at a place that looks at a target, z being up."""
    ahead = (target - place) / np.linalg.norm(target - place)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right = right / (np.linalg.norm(right) or 1.0)
    turn = np.stack([right, np.cross(ahead, right), ahead], axis=1)  # x right, y down, z ahead
    w = 0.5 * np.sqrt(max(1.0 + np.trace(turn), 1e-12))
    x, y, z = (turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1])
    return float(w), float(x / (4 * w)), float(y / (4 * w)), float(z / (4 * w))
