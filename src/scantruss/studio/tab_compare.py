"""Tab: keep designs and set two of them side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .colours import colors_of, legend_of
from .compare import comparison, deviation, drawn_members, kept_design
from .frame import BESIDE_FIRST, DRAWN_EXTENT
from .state import Design

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

PRESENT = "the present one"
NO_OTHER = "-"
TAKE = "Take {} as the present one"
NAME_SIZE = 1.3  #: of the name of a design [usual label]
LABEL_ABOVE = 0.3  #: of the name of a design over its highest node [scene]


class CompareTab:
    """Designs that are kept, their figures, and one beside another."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        self.name = gui.add_text("name", "A")
        keep = gui.add_button("Keep this design", color="blue")
        self.other = gui.add_dropdown(
            "beside", (NO_OTHER,), hint="a kept design, drawn beside the present one: one camera for both"
        )
        self.over = gui.add_checkbox("over the present one", False, hint="in its place instead of beside it")
        self.distance = gui.add_checkbox("colour by distance", False, hint="of its nodes from the present one")
        self.taken = gui.add_button(TAKE.format("it"), disabled=True, hint="Undo takes that back")
        drop = gui.add_button("Forget that design")
        self.table = gui.add_html("")
        view.corrects(self.name)
        keep.on_click(view.step(lambda: view.session.keep_design(self.name.value)))
        drop.on_click(view.step(self._drop))
        self.taken.on_click(view.step(lambda: view.session.take_design(self.other.value)))
        self.other.on_update(view.step(self._choose))
        self.over.on_update(view.step(self._lay_over))
        self.distance.on_update(view.step(lambda: self._draw(view.session.state)))

    def _choose(self) -> None:
        self._draw(self.view.session.state)
        self.view.overview(self.beside)
        self.view.look.draw()

    @property
    def beside(self) -> int:
        """How many designs are drawn beside one another."""
        return 1 if self.other.value == NO_OTHER or self.over.value else 2

    def _lay_over(self) -> None:
        self.distance.value = self.over.value
        self._choose()

    @property
    def is_over(self) -> bool:
        """Whether a design is drawn over the present one."""
        return bool(self.over.value) and self.other.value != NO_OTHER

    def _drop(self) -> None:
        if self.other.value != NO_OTHER:
            self.view.session.drop_design(self.other.value)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the designs of a state."""
        if (
            before is not None
            and before.designs is state.designs
            and before.grid is state.grid
            and before.report is state.report
        ):
            return
        if before is None or before.designs is not state.designs:
            self.other.options = (NO_OTHER, *(each.name for each in state.designs))
            self.name.value = (
                next(name for name in map(chr, range(65, 91)) if name not in self.other.options)
                if len(state.designs) < 26
                else ""
            )
        shown = list(state.designs)
        if state.grid is not None:
            shown.append(kept_design(state, PRESENT))
        self.table.content = comparison(shown) if state.designs else ""
        self._draw(state)

    def _draw(self, state: StudioState) -> None:
        scene, chosen = self.view.scene, self._chosen(state)
        self.taken.disabled = chosen is None
        self.taken.label = TAKE.format("it" if chosen is None else chosen.name)
        if chosen is None or state.cloud is None:
            self.view.legends.show("beside", None)
            scene.remove("/beside/members", "/beside/panels", "/beside/name", "/beside/present")
            return
        frame = self.view.frame
        aside = 0.0 if self.is_over else BESIDE_FIRST * DRAWN_EXTENT
        there = np.array([aside, 0.0, 0.0], np.float32)
        all_nodes, members = drawn_members(chosen)
        nodes, corners = (frame.to_scene(each) + there for each in (all_nodes, chosen.grid.scan_nodes))
        values, words = lengths_of(chosen), "member length"
        if self.distance.value and state.grid is not None:
            values, members, nodes = (
                deviation(chosen.grid, state.grid)[chosen.grid.edges].mean(axis=1),
                chosen.grid.edges,
                corners,
            )
            words = "distance from the present design"
        colors, low, high = colors_of(values, None, self.ends)
        legend = legend_of(f"{chosen.name}: {words}", chosen.grid.unit, low, high, False)
        self.view.legends.show("beside", legend)
        scene.lines("/beside/members", nodes[members], colors)
        scene.panels("/beside/panels", corners, chosen.grid.triangles, None, 0.25, chosen.grid.panel_table)
        if self.is_over or state.grid is None:
            scene.remove("/beside/present")
            self._name(
                "/beside/name", f"{chosen.name}, over {PRESENT}" if state.grid is not None else chosen.name, nodes
            )
            return
        self._name("/beside/name", chosen.name, nodes)
        self._name("/beside/present", PRESENT, frame.to_scene(state.grid.scan_nodes))

    def _name(self, part: str, words: str, nodes: np.ndarray) -> None:
        """Write a name above the far side of a grid with nodes (V, 3) in the scene, so that it hides nothing when it is first seen."""
        low, high = nodes.min(axis=0), nodes.max(axis=0)
        above = (float(low[0] + high[0]) / 2, float(high[1]), float(high[2]) + LABEL_ABOVE)
        self.view.scene.api.add_label(part, words, position=above, anchor="bottom-center", font_screen_scale=NAME_SIZE)

    @property
    def ends(self) -> tuple[float, float] | None:
        """Ends of one scale of member lengths, of the present design and the one beside it [scan unit]; None where there is none."""
        chosen, shown = self._chosen(self.view.session.state), self.view.shown_model()
        if chosen is None or shown is None or self.distance.value:
            return None
        both = np.concatenate([lengths_of(chosen), shown[0].lengths / self.view.unit_of(shown[0])])
        return float(both.min()), float(both.max())

    def _chosen(self, state: StudioState) -> Design | None:
        return next((each for each in state.designs if each.name == self.other.value), None)


def lengths_of(design: Design) -> np.ndarray:
    """Return the lengths of the members of a design that are drawn (M,) [scan unit]."""
    nodes, members = drawn_members(design)
    return np.asarray(np.linalg.norm(nodes[members[:, 1]] - nodes[members[:, 0]], axis=1))
