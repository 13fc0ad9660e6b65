"""Tab: how the grid is drawn: colours, histogram, certificate, section, pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..grid.panels import panel_of_triangles
from .certificate_list import CertificateList
from .colouring import BY_LENGTH, PLAIN_GRID, DrawnDesign, SharedScale, choices_of
from .colours import BRUSHED, DIMMED_COLOUR, histogram_of
from .drawn_lines import numbers_of
from .frame import SectionPlane
from .pictures import PictureTool
from .scale import round_ends, set_scale
from .scene import (
    BALL_RADIUS,
    FAINT_LINE,
    GRID_PARTS,
    LINE_WIDTH,
    MOST_DRAWN_LINES,
    ROD_RADIUS,
    ROD_SIDES,
    TUBE_RADIUS,
    TUBE_SIDES,
    cut,
    drawn_as_rods,
    drawn_colors,
    is_layered,
    plain_colors,
)

if TYPE_CHECKING:
    from ..export.model import Model
    from .state import StudioState
    from .view import StudioView

WHOLE = "none"


class GridTab:
    """What is drawn of the grid, in which colours."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view, step = view, view.step
        self._choices: dict[str, dict[str, Any]] = {}
        self._wanted = ""  # the colouring that was chosen last, or taken for new results
        self.scale: SharedScale | None = None  #: of the present design and the one that is compared; None: plain
        self.coloring = gui.add_dropdown("grid", (PLAIN_GRID,))
        self.legend, self.bars = gui.add_html(""), gui.add_html("")
        self.range = gui.add_multi_slider(
            "from, to", 0.0, 1.0, 0.01, (0.0, 1.0), hint="what lies between them stands out"
        )
        self.between = gui.add_text(
            BRUSHED, "", hint="two values; a click on a bar, or dragging over several, fills it; empty: all"
        )
        self.count = gui.add_markdown("")
        self.members, self.panels = gui.add_checkbox("draw members", True), gui.add_checkbox("draw panels", True)
        self.nodes, self.tubes = gui.add_checkbox("draw nodes", False), gui.add_checkbox("as tubes and balls", False)
        with gui.add_folder("Certificate", expand_by_default=False):
            self.certificate = CertificateList(view, gui)
        self.axis = gui.add_dropdown("section across", (WHOLE, "x", "y", "z"))
        self.at = gui.add_slider("section at", 0.0, 1.0, 0.01, 0.5)
        self.dark = gui.add_checkbox("dark page", False)
        PictureTool(view, gui)
        for each in (self.members, self.panels, self.nodes, self.tubes, self.axis, self.at):
            each.on_update(step(self.draw))
        self.range.on_update(view.slid(self._slide))
        view.typed(self.between, self._brush)
        self.coloring.on_update(step(self._choose))
        for each in (self.axis, self.at):
            each.on_update(step(lambda: view.scan.draw()))
            each.on_update(step(lambda: view.structure.draw()))
        self.tubes.on_update(step(self._light))
        self.dark.on_update(step(self._theme))

    # ---- drawing

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Draw a state."""
        self.certificate.fill(before, state)
        if before is not None and before.grid is state.grid and before.solution is state.solution:
            return
        self.view.select("", 0)
        if before is None or (before.solution is not state.solution and state.solution is not None):
            self._wanted = ""
        self.choose_again()

    @property
    def present(self) -> DrawnDesign | None:
        """The grid or structure that is drawn; None where there is none."""
        shown, grid = self.view.shown_model(), self.view.session.state.grid
        if shown is None or grid is None:
            return None
        return DrawnDesign(*shown, self.view.unit_of(shown[0]), grid.unit)

    def choose_again(self) -> None:
        """List the colourings that all that is drawn has, and take the one that was wanted, where it is among them."""
        present, other = self.present, self.view.compare.drawn
        of_present = choices_of([present] if present is not None else [])
        if present is not None and self._wanted not in (*of_present, PLAIN_GRID):
            self._wanted = next(iter(of_present), PLAIN_GRID)
        both = [each for each in (present, other) if each is not None]
        self._choices = of_present if present is None or other is None else choices_of(both)
        self.coloring.options = (PLAIN_GRID, *self._choices)
        is_there = present is None or self._wanted in self._choices or self._wanted == PLAIN_GRID
        instead = BY_LENGTH if BY_LENGTH in self._choices else PLAIN_GRID
        self.coloring.value = PLAIN_GRID if present is None else self._wanted if is_there else instead
        self.view.compare.say_lack("" if is_there else self._wanted)
        self._show_choice()

    def _choose(self) -> None:
        self._wanted = self.coloring.value
        self._show_choice()

    def _show_choice(self) -> None:
        """Take the colouring that was chosen: its values, legend and histogram."""
        choice, present, other = self._choices.get(self.coloring.value), self.present, self.view.compare.drawn
        self.scale = None
        self.range.visible = self.count.visible = self.between.visible = choice is not None
        if choice is None or present is None:
            self.legend.content = self.bars.content = ""
        else:
            self.scale = SharedScale.of(choice, [present] if other is None else [present, other])
            begin, end, step = round_ends(*self.scale.ends)
            set_scale(self.range, begin, end, step)
            self.range.value = begin, end
            self.view.show_text(self.between, "")
        self.draw()

    def _slide(self) -> None:
        low, high = self.range.value
        self.view.show_text(self.between, f"{low:g}, {high:g}")
        self.draw()

    def _brush(self) -> None:
        text = self.between.value.strip()
        low, high = numbers_of(text, 2, f"{BRUSHED} needs two values") if text else (self.range.min, self.range.max)
        low, high = (min(max(each, self.range.min), self.range.max) for each in sorted((low, high)))
        self.range.value = (low, high)
        self.draw()

    def selected(self, values: np.ndarray) -> np.ndarray | None:
        """Return which values (N,) lie in the range that was chosen; None where all do."""
        assert self.scale is not None
        (begin, end), (low, high) = self.range.value, self.scale.ends
        return None if begin <= low and end >= high else (values >= begin) & (values <= end)

    @property
    def section(self) -> SectionPlane | None:
        """The section that is chosen."""
        if self.axis.value == WHOLE or self.view.session.cloud is None:
            return None
        cloud, axis = self.view.session.cloud, "xyz".index(self.axis.value)
        ends = self.view.frame.to_scene(np.stack(cloud.bounds) + cloud.origin)[:, axis]
        return SectionPlane(axis, float(ends[0] + self.at.value * (ends[1] - ends[0])))

    def draw(self, for_picture: bool = False) -> None:
        """Draw the grid or structure; for a picture as finely as may be, however long that takes."""
        scene, shown = self.view.scene, self.view.shown_model()
        if shown is None:
            scene.remove(*GRID_PARTS)
            self.view.legends.show("grid", None)
            self.view.compare.draw()
            return
        model, _ = shown
        places = self.view.places(model)
        colors = self._colors(len(model.members))
        size = float(np.linalg.norm(np.diff(places[model.members], axis=1), axis=2).mean())
        kept = np.ones(len(places), bool) if self.section is None else self.section.keeps(places)
        self._draw_members(model, places, colors["members"], size, for_picture)
        self._draw_nodes(places, kept, colors["nodes"], size)
        self._draw_panels(model, places, kept, colors["panels"])
        self.view.compare.draw()

    def _colors(self, members: int) -> dict[str, np.ndarray | None]:
        """Return the colours of members, nodes and panels, None where they are plain, and say in the tab what they mean."""
        colors: dict[str, np.ndarray | None] = {"members": None, "nodes": None, "panels": None}
        is_reference, is_over = self.view.compare.is_by_distance, self.view.compare.is_over
        is_moved, legend = self.view.structure.is_moved, None
        if (scale := self.scale) is not None:
            values, kind = scale.of_designs[0], scale.choice["kind"]
            legend, selected = scale.legend(), self.selected(values)
            self.legend.content = legend.html()
            chosen = None if selected is None else self.range.value
            self.bars.content = histogram_of(values, *scale.ends, scale.colors, chosen)
            if not (is_reference or is_over):
                colors[kind] = drawn_colors(scale.colors(values), selected)
            said = "" if selected is None else f"{int(selected.sum()):,} of "
            self.count.content = f"{said}{len(values):,} {kind}"
        self.view.legends.show("grid", None if is_moved or is_over or is_reference else legend)
        if is_moved:
            self.count.content = "grey as built, while the Structure tab shows a displaced shape"
        elif is_over:
            self.count.content = "grey, while Compare draws another design over it"
        elif is_reference:
            self.count.content = "plain, while Compare colours another design by its distance from this one"
        if is_moved or is_over:
            colors["members"] = np.broadcast_to(DIMMED_COLOUR, (members, 3))
        return colors

    def _draw_members(
        self, model: Model, places: np.ndarray, colors: np.ndarray | None, size: float, for_picture: bool
    ) -> None:
        """Draw the members (M,) as lines, rods or tubes; places : (V, 3), colors : (M, 3), size : mean length of a member."""
        of_members = plain_colors(len(model.members)) if colors is None else colors
        ends, of_members = cut(self.section, places[model.members], of_members)
        lines, bodies = self.members.value and not self.tubes.value, self.members.value and self.tubes.value
        as_rods = lines and not for_picture and drawn_as_rods(model, len(ends))
        lines = lines and not as_rods
        is_faint = self.view.structure.is_moved or self.view.compare.is_over
        self.view.scene.members(
            "/grid/members", ends if lines else ends[:0], of_members if lines else of_members[:0],
            FAINT_LINE if is_faint else LINE_WIDTH, None if for_picture else MOST_DRAWN_LINES,
        )  # fmt: skip
        radius, sides = (ROD_RADIUS, ROD_SIDES) if as_rods else (TUBE_RADIUS, TUBE_SIDES)
        in_space = bodies or as_rods
        self.view.scene.tubes(
            "/grid/tubes",
            ends if in_space else ends[:0],
            of_members if in_space else of_members[:0],
            radius * size,
            sides,
        )

    def _draw_nodes(self, places: np.ndarray, kept: np.ndarray, colors: np.ndarray | None, size: float) -> None:
        """Draw the nodes (V, 3) that the section keeps (V,), as balls, or as points in the colours (V, 3) of the legend."""
        wanted = self.nodes.value or self.tubes.value or colors is not None
        drawn = kept if wanted else np.zeros(len(places), bool)
        of_nodes = plain_colors(len(places)) if colors is None else colors
        as_balls = drawn if self.tubes.value and colors is None else drawn & False
        as_points = drawn & ~as_balls  # their colours are those of the legend, without shade
        self.view.scene.balls("/grid/balls", places[as_balls], of_nodes[as_balls], BALL_RADIUS * size)
        self.view.scene.points("/grid/nodes", places[as_points], np.ascontiguousarray(of_nodes[as_points]), 0.2 * size)

    def _draw_panels(self, model: Model, places: np.ndarray, kept: np.ndarray, colors: np.ndarray | None) -> None:
        """Draw the panels whose nodes the section keeps (V,), in colours (P, 3)."""
        panels = model.panels
        visible = (kept[panels] | (panels < 0)).all(axis=1)
        visible &= (self.panels.value or colors is not None) and not self.view.structure.is_moved
        self.view.scene.panels(
            "/grid/panels",
            places,
            model.triangles[visible[panel_of_triangles(panels)]],
            None if colors is None else colors[visible],
            0.35 if len(model.members) <= MOST_DRAWN_LINES or is_layered(model) else None,
            panels[visible],
        )

    # ---- theme

    def _light(self) -> None:
        cloud, ground = self.view.session.cloud, 0.0
        if cloud is not None:
            lowest = cloud.bounds[0] + cloud.origin
            ground = float(self.view.frame.to_scene(lowest[None])[0, 2])
        self.view.scene.light(self.tubes.value, self.dark.value, ground)

    def _theme(self) -> None:
        self.view.client.gui.configure_theme(
            show_share_button=False, show_logo=False, control_width="large", dark_mode=self.dark.value
        )
        if self.tubes.value:
            self._light()
