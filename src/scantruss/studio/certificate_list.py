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
PINS_APART = 0.5  #: least distance of two pins [scene]
MOST_NUMBERS = 3  #: that a pin says; of more it says how many
NO_GRID_YET = "no grid yet"


class CertificateList:
    """The certificate and its places."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        self.words = gui.add_markdown(NO_GRID_YET)
        self.pins = gui.add_checkbox("draw pins", False)
        self.places = gui.add_dropdown(
            "place", ("-",), hint="numbered as the pins; those that would lie on each other are one"
        )
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
        scene, drawn = self.view.scene, list[tuple[str, np.ndarray]]()
        if self.pins.value and self._pins:
            drawn = merged(self.view.frame.to_scene(np.array([pin.where for pin in self._pins])))
        scene.remove(*(f"/pins/{k}" for k in range(len(drawn), self._drawn)))
        self._drawn = len(drawn)
        for k, (words, place) in enumerate(drawn):
            scene.api.add_label(f"/pins/{k}", words, position=tuple(place.tolist()), anchor="center-center")

    def _fly(self) -> None:
        number = int(self.places.value.partition(" ")[0]) - 1 if self.places.value[0].isdigit() else -1
        grid = self.view.session.grid
        if grid is not None and 0 <= number < len(self._pins):
            frame = self.view.frame
            place = frame.to_scene(np.array(self._pins[number].where)[None])[0]
            self.view.fly(place, PIN_REACH * float(grid.lengths.mean()) * frame.factor)


def merged(places: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Return pins at places (N, 3) of the scene, one for those that would lie on each other: its numbers, and its place (3,)."""
    groups: list[list[int]] = []
    for number, place in enumerate(places):
        near = (group for group in groups if np.linalg.norm(places[group[0]] - place) < PINS_APART)
        if (group := next(near, None)) is None:
            groups.append([number])
        else:
            group.append(number)
    more = [f" +{len(group) - MOST_NUMBERS}" if len(group) > MOST_NUMBERS else "" for group in groups]
    words = [", ".join(str(k + 1) for k in group[:MOST_NUMBERS]) for group in groups]
    return [(said + plus, places[group].mean(axis=0)) for said, plus, group in zip(words, more, groups, strict=True)]
