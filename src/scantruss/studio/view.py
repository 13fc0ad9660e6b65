"""The page of the studio: what a session holds, drawn by viser, and controls that call its steps."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from threading import RLock
from typing import Any

import numpy as np

from ..errors import InputError, ScanTrussError
from ..export.formats import GRID, STRUCTURE, suffixes_of
from ..export.page_tables import PageColumn, Pin, colorings_of, pins_of, tables_of
from ..settings import UNITS
from ..settings.records import EFFORTS
from ..structure.supports import HELD
from .session import STRUCTURE_WORDS, Session, words_of

DRAWN_POINTS = 100_000  #: of the scan
DRAWN_EXTENT = 10.0  #: of the scan in the scene, whose camera is made for such sizes
SLIDER_STEPS = 100
RISING = np.array([(68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37)], float)
DIVERGING = np.array([(178, 24, 43), (239, 138, 98), (200, 200, 200), (103, 169, 207), (33, 102, 172)], float)
PLAIN = np.array([60, 90, 110], np.uint8)
PANEL_COLOR = (205, 216, 223)


def ramp(share: np.ndarray, stops: np.ndarray) -> np.ndarray:
    """Return (N, 3) uint8 colours of shares from 0 to 1."""
    at = np.clip(share, 0.0, 1.0) * (len(stops) - 1)
    return np.stack([np.interp(at, np.arange(len(stops)), stops[:, k]) for k in range(3)], axis=1).astype(np.uint8)


def colors_of(column: PageColumn, middle: float | None) -> tuple[np.ndarray, float, float]:
    """Return (N, 3) uint8 colours of the values of a column, and what the ends of the scale stand for."""
    values = np.array([np.nan if value is None else value for value in column.values], float)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    if middle is not None:
        far = max(high - middle, middle - low) or 1e-9
        low, high = middle - far, middle + far
    share = np.full(len(values), 0.5) if high <= low else (values - low) / (high - low)
    colors = ramp(np.nan_to_num(share), RISING if middle is None else DIVERGING)
    colors[np.isnan(values)] = PLAIN
    return colors, low, high


class StudioView:
    """Binds a session to the scene and the controls of a server."""

    def __init__(self, session: Session, server: Any) -> None:
        self.session, self.server, self._lock = session, server, RLock()
        self._drawn: tuple[Any, ...] = ()
        self._scan: Any = None
        self._pins: list[Pin] = []
        server.scene.set_up_direction("+z")
        server.gui.main_panel.dock_right()
        server.gui.configure_theme(show_share_button=False, control_width="large")
        gui = server.gui
        self.message = gui.add_markdown("")
        self.progress = gui.add_progress_bar(0.0, visible=False)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Grid"):
            self._grid_tab(gui)
        with tabs.add_tab("Structure"):
            self._structure_tab(gui)
        with tabs.add_tab("Files"):
            self._files_tab(gui)
        session.tell = self.update
        self.update()

    # ---- controls

    def _grid_tab(self, gui: Any) -> None:
        upload = gui.add_upload_button("Open a scan")
        self.about = gui.add_markdown("")
        self.unit = gui.add_dropdown("unit", tuple(name or "not known" for name in UNITS), initial_value="not known")
        self.slider = gui.add_slider("length", 0.5, 2.0, 0.01, 1.0, hint="a quick grid is made while it moves")
        self.length = gui.add_text("exactly", "1")
        self.effort = gui.add_dropdown("effort", EFFORTS)
        generate, stop = gui.add_button("Generate", color="blue"), gui.add_button("Stop")
        self.figures = gui.add_markdown("")
        self.coloring = gui.add_dropdown("colour", ("plain",))
        self.legend = gui.add_html("")
        self.show_scan, self.show_panels = gui.add_checkbox("scan", True), gui.add_checkbox("panels", True)
        self.certificate = gui.add_markdown("")
        self.places = gui.add_dropdown("place", ("-",))
        fly = gui.add_button("Fly there")
        upload.on_upload(lambda event: self.session.open_upload(upload.value.name, upload.value.content))
        self.slider.on_update(self._step(lambda: self._slide()))
        self.length.on_update(self._step(self._typed))
        self.unit.on_update(self._step(self._set_unit))
        self.effort.on_update(self._step(lambda: self._change(effort=self.effort.value)))
        generate.on_click(self._step(self.session.generate))
        stop.on_click(self._step(self.session.stop))
        fly.on_click(self._step(self._fly))
        for each in (self.coloring, self.show_scan, self.show_panels):
            each.on_update(self._step(self._draw))

    def _structure_tab(self, gui: Any) -> None:
        kept = self.session.structure_settings
        loads = ",".join(map(str, kept.loads))
        self.words = {
            "supports": gui.add_text(
                "supports", kept.supports, hint="corners, boundary, lowest:H, fixed, line:NAME, loop:N, N001"
            ),
            "support_type": gui.add_dropdown("held as", tuple(HELD), initial_value=kept.support_type),
            "section": gui.add_text("section", kept.section),
            "material": gui.add_text("material", kept.material),
            "loads": gui.add_text("loads", loads, hint="self,snow:1kN/m2,wind:0.8kN/m2:-0.7"),
        }
        run = gui.add_button("Run", color="blue")
        self.results = gui.add_markdown("")
        run.on_click(self._step(self._run))

    def _files_tab(self, gui: Any) -> None:
        self.files: dict[str, Any] = {}
        for kind in (GRID, STRUCTURE):
            self.files[kind] = gui.add_dropdown(kind, tuple(suffixes_of(kind)), initial_value=".json")
            gui.add_button(f"Download the {kind}").on_click(self._download(kind))
        gui.add_button("Download the settings").on_click(self._download(""))
        self.command = gui.add_markdown("")

    def _step(self, step: Callable[[], None]) -> Callable[[Any], None]:
        """Return what a control calls: errors are shown on the page, and what the server sets calls nothing."""

        def call(event: Any) -> None:
            if event.client is None:
                return
            try:
                step()
            except ScanTrussError as error:
                self.session.message = words_of(error)
                self.update()

        return call

    def _download(self, kind: str) -> Callable[[Any], None]:
        def send(event: Any) -> None:
            try:
                files = (
                    self.session.files(kind, self.files[kind].value)
                    if kind
                    else {"grid.settings.json": self.session.settings_file()}
                )
            except ScanTrussError as error:
                self.session.message = words_of(error)
                self.update()
                return
            for name, content in files.items():
                event.client.send_file_download(name, content, save_immediately=True)

        return send

    # ---- steps

    def _change(self, **changes: Any) -> None:
        self.session.settings = self.session.settings.replace(**changes)

    def _slide(self) -> None:
        length = float(f"{self.slider.value:.4g}")
        self.length.value = f"{length:g}"
        self.session.live(length)

    def _typed(self) -> None:
        try:
            length = float(self.length.value)
        except ValueError:
            raise InputError(f"length needs a number, got {self.length.value!r}") from None
        self._change(length=length)

    def _set_unit(self) -> None:
        self.session.set_unit("" if self.unit.value == "not known" else self.unit.value)
        self.update()

    def _run(self) -> None:
        self.session.set_structure(**{name: self.words[name].value for name in STRUCTURE_WORDS})
        self.session.run_structure()

    def _fly(self) -> None:
        number = int(self.places.value.partition(" ")[0]) - 1 if self.places.value[0].isdigit() else -1
        if not 0 <= number < len(self._pins):
            return
        place = self._in_scene(np.array(self._pins[number].where))
        grid = self.session.grid
        reach = 8.0 * (float(grid.lengths.mean()) if grid is not None else 1.0) * self._factor
        for client in self.server.get_clients().values():
            client.camera.position = tuple(place + reach * np.array([0.5, -0.5, 0.7]))
            client.camera.look_at = tuple(place)

    # ---- what is shown

    def update(self) -> None:
        """Show what the session holds; called from any thread."""
        session = self.session
        with self._lock, self.server.atomic():
            self.message.content = (
                f"**Refused:** {session.message}" if session.message else f"{session.stage or 'ready'}"
            )
            self.progress.visible, self.progress.value = bool(session.stage), 100.0 * session.share
            state = (session.cloud, session.grid, session.solution, session.settings.unit)
            if len(self._drawn) == len(state) and all(a is b for a, b in zip(self._drawn, state, strict=True)):
                return
            if self._drawn and self._drawn[1] is None and session.grid is not None:
                self.show_scan.value = False  # it hides the grid
            new_scan = not self._drawn or self._drawn[0] is not session.cloud
            self._drawn = state
            self._say(new_scan)
            self._draw()

    def _say(self, new_scan: bool) -> None:
        """Fill in words and controls."""
        session, grid, cloud = self.session, self.session.grid, self.session.cloud
        unit = f" {cloud.unit}" if cloud is not None and cloud.unit else ""
        if new_scan and cloud is not None:
            low, high = session.length_bounds()
            step = float(f"{(high - low) / SLIDER_STEPS or 1.0:.1g}")
            self.slider.min, self.slider.max, self.slider.step = low, max(high, low + step), step
            self.slider.value = min(max(session.settings.length, low), high)
            self.length.value = f"{session.settings.length:g}"
            self.effort.value = session.settings.effort
            self.unit.value = cloud.unit or "not known"
            self.about.content = (
                f"**{cloud.name or 'scan'}**: {len(cloud.points):,} points, {cloud.extent:.4g}{unit} long"
            )
        if cloud is None:
            self.about.content = "Open a scan: any format that `scantruss info` reads."
        choices = ["plain"]
        self._pins, self.figures.content, self.certificate.content = [], "", ""
        if grid is not None:
            quality, certificate = grid.quality, grid.certificate
            quick = " (quick, not saved)" if session.is_live else ""
            self.figures.content = (
                f"{len(grid.nodes):,} nodes, {len(grid.edges):,} members{quick}\n\n"
                f"length {quality.length_mean:.4g}{unit}, CV {quality.length_cv:.4f}, G {quality.shape_mean:.4f}"
            )
            if certificate is not None:
                warned = "".join(f"\n\n**warning:** the grid {each.words}" for each in certificate.warnings)
                self.certificate.content, self._pins = f"certificate: {certificate}{warned}", pins_of(certificate)
            self._tables = tables_of(session.model(STRUCTURE if session.solution is not None else GRID))
            self._choices = {one["words"]: one for one in colorings_of(self._tables) if one["kind"] == "members"}
            choices += list(self._choices)
        self.places.options = tuple(f"{k + 1} {pin.words} {pin.value}".strip() for k, pin in enumerate(self._pins)) or (
            "-",
        )
        kept = self.coloring.value
        self.coloring.options = tuple(choices)
        best = choices[1] if len(choices) > 1 else "plain"
        self.coloring.value = best if kept not in choices or kept == "plain" or session.solution is not None else kept
        self.results.content = self._structure_words()
        self.command.content = f"```\n{session.command()}\n```"

    def _structure_words(self) -> str:
        """Return the greatest figures of the structure."""
        report = self.session.report
        if report is None:
            return ""
        values = report.to_dict()
        service = [case for case in report.cases if case.state == "SLS"] or report.cases
        moves = max(service, key=lambda case: case.displacement_max)
        used = values["utilization_max"]
        rows = [
            f"utilization {'-' if used is None else f'{used:.2f}'}",
            f"displacement {1e3 * moves.displacement_max:.3g} mm under {moves.name}",
            f"axial forces {values['force_min'] / 1e3:.4g} to {values['force_max'] / 1e3:.4g} kN",
            f"mass {report.truss.mass:,.0f} kg without nodes",
            *(f"**warning:** {words}" for words in report.warnings),
        ]
        return "\n\n".join(rows)

    @property
    def _factor(self) -> float:
        cloud = self.session.cloud
        return DRAWN_EXTENT / cloud.extent if cloud is not None else 1.0

    def _in_scene(self, places: np.ndarray) -> np.ndarray:
        """Return places in the frame of the scan as the scene has them: small and around the origin."""
        cloud = self.session.cloud
        assert cloud is not None
        found: np.ndarray = (places - cloud.origin - (cloud.bounds[0] + cloud.bounds[1]) / 2) * self._factor
        return found

    def _draw(self) -> None:
        """Draw scan, members and panels."""
        session, scene = self.session, self.server.scene
        with self._lock:
            if session.cloud is None:
                return
            if self._scan is not session.cloud:
                self._scan = session.cloud
                points = session.cloud.points[:: max(1, -(-len(session.cloud.points) // DRAWN_POINTS))]
                height = points[:, 2] - points[:, 2].min()
                self._points = scene.add_point_cloud(
                    "/scan", self._in_scene(points + session.cloud.origin).astype(np.float32),
                    ramp(height / (height.max() or 1.0), RISING), point_size=0.02, precision="float32",
                )  # fmt: skip
                self.server.initial_camera.position = tuple(DRAWN_EXTENT * share for share in (0.4, -0.75, 0.5))
                self.server.initial_camera.look_at = (0.0, 0.0, 0.0)
            self._points.visible = self.show_scan.value
            self.legend.content = ""
            if session.grid is None:
                scene.remove_by_name("/grid")
                return
            grid = session.grid
            nodes = self._in_scene(grid.scan_nodes).astype(np.float32)
            colors = np.broadcast_to(PLAIN, (len(grid.edges), 3))
            if choice := self._choices.get(self.coloring.value):
                column = next(one for one in self._tables["members"] if one.name == choice["name"])
                colors, low, high = colors_of(column, choice.get("middle"))
                self.legend.content = legend_of(choice["words"], column.unit, low, high, "middle" in choice)
            scene.add_line_segments(
                "/grid/members",
                nodes[grid.edges],
                np.repeat(colors[:, None], 2, axis=1),
                thickness=3.0,
                thickness_units="screen",
            )
            scene.add_mesh_simple(
                "/grid/panels",
                nodes,
                grid.triangles,
                color=PANEL_COLOR,
                side="double",
                flat_shading=True,
                visible=self.show_panels.value,
                opacity=0.25,
            )


def legend_of(words: str, unit: str, low: float, high: float, diverging: bool) -> str:
    """Return the legend of a colouring as HTML."""
    stops = ",".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in (DIVERGING if diverging else RISING))
    ends = "".join(f"<span>{value:.4g}</span>" for value in (low, (low + high) / 2, high))
    name = escape(f"{words} [{unit}]" if unit else words)
    return (
        f'<div style="padding:0 .6em;font-size:.85em">{name}<div style="height:.8em;background:linear-gradient(to right,{stops})"></div>'
        f'<div style="display:flex;justify-content:space-between">{ends}</div></div>'
    )
