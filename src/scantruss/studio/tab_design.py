"""Tab: open a scan, choose the length and make the grid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..export.page_tables import Pin, pins_of
from ..settings import UNITS
from ..settings.records import EFFORTS, PREFER
from .feature_list import FeatureList
from .fixed_list import FixedNodes
from .opening import EXAMPLES

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

SLIDER_STEPS = 100
UNKNOWN_UNIT = "not known"
PIN_REACH = 8.0  #: from which a place of the certificate is looked at [mean member length]


class DesignTab:
    """Scan, length, grid, its certificate, and what it must keep."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view, session, step = view, view.session, view.step
        self._pins: list[Pin] = []
        with gui.add_folder("Scan"):
            upload = gui.add_upload_button(
                "Open a scan or project", hint="at most 500 MB; a larger one: scantruss studio SCAN"
            )
            self.example = gui.add_dropdown("example", tuple(EXAMPLES))
            opened = gui.add_button("Open the example")
            self.about = gui.add_markdown("")
            self.unit = gui.add_dropdown(
                "unit", tuple(name or UNKNOWN_UNIT for name in UNITS), initial_value=UNKNOWN_UNIT
            )
        with gui.add_folder("Grid"):
            self.slider = gui.add_slider("length", 0.5, 2.0, 0.01, 1.0, hint="a quick grid is made while it moves")
            self.length = gui.add_text("exactly", "1", hint="any length, in the unit of the scan")
            self.effort = gui.add_dropdown("effort", EFFORTS)
            self.prefer = gui.add_dropdown(
                "prefer", PREFER, hint="what matters more: equal members or regular triangles"
            )
            generate, stop = gui.add_button("Generate", color="blue"), gui.add_button("Stop")
            self.figures = gui.add_markdown("")
        with gui.add_folder("Certificate", expand_by_default=False):
            self.certificate = gui.add_markdown("no grid yet")
            self.places = gui.add_dropdown("place", ("-",))
            fly = gui.add_button("Fly there")
        with gui.add_folder("Fixed nodes", expand_by_default=False):
            self.fixed = FixedNodes(view, gui)
        with gui.add_folder("Holes and ridges", expand_by_default=False):
            self.features = FeatureList(view, gui)
        upload.on_upload(lambda event: session.open_upload(upload.value.name, upload.value.content))
        opened.on_click(step(lambda: session.open_example(self.example.value)))
        self.slider.on_update(step(self._slide))
        self.length.on_update(step(self._typed))
        self.unit.on_update(step(lambda: session.set_unit("" if self.unit.value == UNKNOWN_UNIT else self.unit.value)))
        self.effort.on_update(
            step(lambda: session.change("effort", settings=session.settings.replace(effort=self.effort.value)))
        )
        self.prefer.on_update(step(lambda: session.set("prefer", prefer=self.prefer.value)))
        generate.on_click(step(session.generate))
        stop.on_click(step(session.stop))
        fly.on_click(step(self._fly))

    def _slide(self) -> None:
        length = float(f"{self.slider.value:.4g}")
        self.length.value = f"{length:g}"
        self.view.session.live(length)

    def _typed(self) -> None:
        try:
            length = float(self.length.value)
        except ValueError:
            raise InputError(f"length needs a number, got {self.length.value!r}") from None
        self.view.session.set("length", length=length)

    def _fly(self) -> None:
        number = int(self.places.value.partition(" ")[0]) - 1 if self.places.value[0].isdigit() else -1
        grid = self.view.session.grid
        if grid is not None and 0 <= number < len(self._pins):
            frame = self.view.frame
            place = frame.to_scene(np.array(self._pins[number].where)[None])[0]
            self.view.fly(place, PIN_REACH * float(grid.lengths.mean()) * frame.factor)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show a state."""
        session, cloud, grid = self.view.session, state.cloud, state.grid
        unit = f" {cloud.unit}" if cloud is not None and cloud.unit else ""
        if cloud is None:
            self.about.content = "Open a scan: any format that `scantruss info` reads."
        elif before is None or before.cloud is not cloud:
            low, high = (float(f"{bound:.3g}") for bound in session.length_bounds())
            step = float(f"{(high - low) / SLIDER_STEPS or 1.0:.1g}")
            self.slider.min, self.slider.max, self.slider.step = low, max(high, low + step), step
            saved = f"; saved as {session.place.name} after each step" if session.place is not None else "; not saved"
            self.about.content = (
                f"**{cloud.name or 'scan'}**: {len(cloud.points):,} points, {cloud.extent:.4g}{unit} long{saved}"
            )
            self.unit.value = cloud.unit or UNKNOWN_UNIT
        settings = state.settings
        if before is None or before.settings is not settings or before.cloud is not cloud:
            if abs(self.slider.value - settings.length) > 1e-9 * settings.length:
                self.slider.value = min(max(settings.length, self.slider.min), self.slider.max)
            self.length.value, self.effort.value, self.prefer.value = (
                f"{settings.length:g}",
                settings.effort,
                settings.prefer,
            )
        if before is None or before.grid is not grid or before.is_live != state.is_live:
            self._fill_grid(state, unit)
        self.fixed.fill(before, state)
        self.features.fill(before, state)

    def _fill_grid(self, state: StudioState, unit: str) -> None:
        grid = state.grid
        self._pins = []
        if grid is None:
            self.figures.content, self.certificate.content = "", "no grid yet"
        else:
            quality, certificate = grid.quality, grid.certificate
            quick = " (quick, not saved)" if state.is_live else ""
            self.figures.content = (
                f"{len(grid.nodes):,} nodes, {len(grid.edges):,} members{quick}\n\n"
                f"length {quality.length_mean:.4g}{unit}, CV {quality.length_cv:.4f}, G {quality.shape_mean:.4f}"
            )
            if certificate is not None:
                warned = "".join(f"\n\n**warning:** the grid {each.words}" for each in certificate.warnings)
                self.certificate.content, self._pins = f"certificate: {certificate}{warned}", pins_of(certificate)
                self.figures.content += "\n\ncertificate: " + ("passed" if certificate.passed else "**failed**")
        words = tuple(f"{k} {pin.words} {pin.value}".strip() for k, pin in enumerate(self._pins, 1))
        self.places.options = words or ("-",)
        places = [pin.where for pin in self._pins]
        for k in range(max(len(places), getattr(self, "_drawn_pins", 0))):
            self.view.scene.remove(f"/pins/{k}")
        self._drawn_pins = len(places)
        if places and self.view.look.pins.value:
            at = self.view.frame.to_scene(np.array(places))
            for k, place in enumerate(at):
                self.view.scene.api.add_label(
                    f"/pins/{k}", f"{k + 1} {self._pins[k].words}", position=tuple(place.tolist())
                )
