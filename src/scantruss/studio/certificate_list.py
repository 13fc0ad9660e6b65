"""The certificate of a grid, its places as pins and to fly to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..export.page_tables import Pin, pins_of
from .page_words import in_words_of_page

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

PIN_REACH = 8.0  #: from which a place of the certificate is looked at [mean member length]
NO_GRID_YET = "no grid yet"


class CertificateList:
    """The certificate and its places."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        self.words = gui.add_markdown(NO_GRID_YET)
        self.pins = gui.add_checkbox("draw pins", False)
        self.places = gui.add_dropdown("place", ("-",), hint="numbered as the pins")
        fly = gui.add_button("Fly there")
        self._pins: list[Pin] = []
        self._drawn = 0
        self.pins.on_update(view.step(self._draw))
        fly.on_click(view.step(self._fly))

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the certificate of a state."""
        if before is not None and before.grid is state.grid:
            return
        certificate = None if state.grid is None else state.grid.certificate
        self._pins = [] if certificate is None else pins_of(certificate)
        if certificate is None:
            self.words.content = NO_GRID_YET
        else:
            warned = "".join(
                f"\n\n**warning:** the grid {in_words_of_page(each.words)}" for each in certificate.warnings
            )
            self.words.content = f"certificate: {in_words_of_page(str(certificate))}{warned}"
        words = tuple(f"{k} {pin.words} {pin.value}".strip() for k, pin in enumerate(self._pins, 1))
        self.places.options = words or ("-",)
        self._draw()

    def _draw(self) -> None:
        scene, count = self.view.scene, len(self._pins) if self.pins.value else 0
        scene.remove(*(f"/pins/{k}" for k in range(count, self._drawn)))
        self._drawn = count
        if count:
            places = self.view.frame.to_scene(np.array([pin.where for pin in self._pins]))
            for k, place in enumerate(places.tolist()):
                scene.api.add_label(f"/pins/{k}", f"{k + 1}", position=tuple(place))

    def _fly(self) -> None:
        number = int(self.places.value.partition(" ")[0]) - 1 if self.places.value[0].isdigit() else -1
        grid = self.view.session.grid
        if grid is not None and 0 <= number < len(self._pins):
            frame = self.view.frame
            place = frame.to_scene(np.array(self._pins[number].where)[None])[0]
            self.view.fly(place, PIN_REACH * float(grid.lengths.mean()) * frame.factor)
