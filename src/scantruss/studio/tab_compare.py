"""Tab: keep designs and set two of them side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .colouring import PLAIN_GRID, DrawnDesign
from .colours import PLAIN_COLOUR, colors_of, legend_of
from .compare import comparison, deviation, drawn_design, kept_design
from .frame import BESIDE_FIRST, DRAWN_EXTENT
from .scene import drawn_colors
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
        self.lack, self.table = gui.add_markdown("", visible=False), gui.add_html("")
        self._drawn: Design | None = None
        view.corrects(self.name)
        keep.on_click(view.step(lambda: view.session.keep_design(self.name.value)))
        drop.on_click(view.step(self._drop))
        self.taken.on_click(view.step(lambda: view.session.take_design(self.other.value)))
        self.other.on_update(view.step(self._choose))
        self.over.on_update(view.step(self._lay_over))
        self.distance.on_update(view.step(lambda: view.look.choose_again()))

    def _choose(self) -> None:
        self.view.overview(self.beside)
        self.view.look.choose_again()

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

    @property
    def is_by_distance(self) -> bool:
        """Whether a design is coloured by its distance from the present one, which is plain then."""
        state, chosen = self.view.session.state, self._chosen(self.view.session.state)
        is_measured = chosen is not None and state.grid is not None and chosen.grid.unit == state.grid.unit
        return bool(self.distance.value) and is_measured

    @property
    def drawn(self) -> DrawnDesign | None:
        """The design that is coloured by the same as the present one; None where there is none."""
        chosen = self._chosen(self.view.session.state)
        return None if chosen is None or self.is_by_distance else drawn_design(chosen)

    def say_lack(self, wanted: str) -> None:
        """Say which colouring the chosen design does not have; "" where it has what is wanted."""
        chosen, self.lack.visible = self._chosen(self.view.session.state), bool(wanted)
        if chosen is not None and wanted:
            has_none = drawn_design(chosen).model.truss is None and self.view.session.solution is not None
            present, unit = self.view.look.present, chosen.grid.unit or "no unit"
            is_other_unit = present is not None and present.scan_unit != chosen.grid.unit
            why = f"is in {unit}: no" if is_other_unit else "has no structure: no" if has_none else "has no"
            coloring = self.view.look.coloring.value
            both = coloring if coloring == PLAIN_GRID else f"coloured by {coloring}"
            self.lack.content = f"**{chosen.name}** {why} {wanted}; both are {both}"

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
        if self._chosen(state) is not self._drawn:
            self.view.look.choose_again()

    def draw(self) -> None:
        """Draw the chosen design beside the present one or over it, in colours that both share."""
        state = self.view.session.state
        scene, chosen = self.view.scene, self._chosen(state)
        self._drawn = chosen
        self.taken.disabled = chosen is None
        self.taken.label = TAKE.format("it" if chosen is None else chosen.name)
        if chosen is None or state.cloud is None:
            self.view.legends.show("beside", None)
            scene.remove("/beside/members", "/beside/nodes", "/beside/name", "/beside/present")
            scene.remove("/beside/panels", "/beside/panels coloured")
            return
        frame = self.view.frame
        aside = 0.0 if self.is_over else BESIDE_FIRST * DRAWN_EXTENT
        there = np.array([aside, 0.0, 0.0], np.float32)
        drawn, grid = drawn_design(chosen), chosen.grid
        nodes, corners = (
            frame.to_scene(each) + there for each in (drawn.model.nodes / drawn.unit_of_scan, grid.scan_nodes)
        )
        model, colors, legend = drawn.model, dict[str, np.ndarray](), None
        members, triangles, panels = model.members, model.triangles, model.panels
        if self.is_by_distance and state.grid is not None:
            members, triangles, panels, nodes = grid.edges, grid.triangles, grid.panel_table, corners
            colors["members"], low, high = colors_of(deviation(grid, state.grid)[members].mean(axis=1), None)
            legend = legend_of(f"{chosen.name}: distance from the present design", grid.unit, low, high, False)
        elif (scale := self.view.look.scale) is not None and len(scale.of_designs) > 1:
            values = scale.of_designs[1]
            colors[scale.choice["kind"]] = drawn_colors(scale.colors(values), self.view.look.selected(values))
            legend = scale.legend(f"{chosen.name}: ") if self.is_over else None  # else the one of both
        self.view.legends.show("beside", legend)
        scene.lines("/beside/members", nodes[members], colors.get("members", PLAIN_COLOUR))
        if "nodes" in colors:
            size = 0.2 * frame.factor * float(grid.lengths.mean())
            scene.points("/beside/nodes", nodes, np.ascontiguousarray(colors["nodes"]), size)
        else:
            scene.remove("/beside/nodes")
        scene.panels("/beside/panels", nodes, triangles, colors.get("panels"), 0.25, panels)
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

    def _chosen(self, state: StudioState) -> Design | None:
        return next((each for each in state.designs if each.name == self.other.value), None)
