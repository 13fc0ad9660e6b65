"""Holes and ridges of the scan: each is switched by its box or by a click."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from .features import HOLES, Feature, switched_off
from .picking import nearest_point

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

MOST_LISTED = 40  #: holes and ridges with a box of their own
ON_COLORS = {True: (0, 110, 180), False: (150, 60, 160)}  #: of holes that stay open; of ridges that are followed
OFF_COLOR = (160, 160, 160)
SWITCH_MODE = "switch hole or ridge"
FEATURE_WIDTH = 6.0  #: of a hole or ridge that is drawn [pixel]


class FeatureList:
    """The holes and ridges, drawn and listed."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view, self._gui = view, gui
        self.shown = gui.add_checkbox("find and draw them", False)
        self.none = gui.add_markdown(
            "none found: the scan has no hole that could be closed, and no ridge", visible=False
        )
        self._list = gui.add_folder(None)
        self._boxes: list[Any] = []
        self._drawn: tuple[list[Feature], frozenset[int]] = ([], frozenset())
        self.shown.on_update(view.step(self._find))
        view.modes[SWITCH_MODE] = self.clicked

    def _find(self) -> None:
        if self.shown.value:
            self.view.session.show_features()
            self.view.click.value = SWITCH_MODE
        else:
            self.view.session.wants_features = False
            if self.view.click.value == SWITCH_MODE:
                self.view.click.value = self.view.clicks[0]

    def clicked(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        """Switch the hole or ridge under a ray of the scene."""
        features, frame = self.view.session.features, self.view.frame
        if not self.shown.value or not features:
            raise InputError('no holes or ridges are drawn; tick "find and draw them" in Holes and ridges')
        places = np.concatenate([frame.to_scene(each.points) for each in features])
        owner = np.repeat(np.arange(len(features)), [len(each.points) for each in features])
        found = nearest_point(places, origin, ahead)
        if found is not None:
            self.view.session.switch(int(owner[found]))
        elif (part := self.view.under(origin, ahead)) is not None:
            self.view.select(*part)
        else:
            raise InputError("no hole or ridge is there; click on its line")

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the holes and ridges of a state."""
        features = self.view.session.features if self.shown.value and state.cloud is not None else []
        self.none.visible = self.shown.value and self.view.session.has_looked and not features
        off = frozenset(switched_off(features, state.settings))
        if self._drawn[0] is features or (not features and not self._drawn[0]):
            if self._drawn[1] == off:
                return
        if self._drawn[0] is not features:
            for box in self._boxes:
                box.remove()
            for k in range(len(self._drawn[0])):
                self.view.scene.remove(f"/features/{k}")
            with self._list:
                self._boxes = [self._box(k, each, k in off) for k, each in enumerate(features[:MOST_LISTED])]
        self._drawn = (features, off)
        for k, each in enumerate(features):
            is_hole = each.kind == HOLES
            color = OFF_COLOR if k in off else ON_COLORS[is_hole]
            self.view.scene.chain(
                f"/features/{k}", self.view.frame.to_scene(each.points), is_hole, color, FEATURE_WIDTH
            )
            if k < len(self._boxes):
                self._boxes[k].value = (k in off) == is_hole

    def _box(self, number: int, feature: Feature, is_off: bool) -> Any:
        """Return the box of a hole ("close") or a ridge ("follow")."""
        is_hole = feature.kind == HOLES
        words = f"{'close hole' if is_hole else 'follow ridge'} {number + 1}"
        box = self._gui.add_checkbox(words, is_off == is_hole, hint=feature.words)
        box.on_update(self.view.step(lambda: self.view.session.switch(number)))
        return box
