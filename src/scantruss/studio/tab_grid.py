"""Tab: how the grid is drawn: colours, histogram, certificate, section, pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..export.page_tables import PageColumn, colorings_of
from ..grid.panels import panel_of_triangles
from .certificate_list import CertificateList
from .colours import BRUSHED, DIMMED, colors_of, histogram_of, legend_of, legend_of_names, marked, rgb_of, values_of
from .drawn_lines import numbers_of
from .frame import SectionPlane
from .legend import ColourLegend
from .pictures import PictureTool
from .scale import round_ends, set_scale
from .scene import (
    BALL_RADIUS,
    FAINT,
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
    from .state import StudioState
    from .view import StudioView

PLAIN_GRID, BY_LENGTH, BY_SECTION = "plain", "member length", "section"
WHOLE = "none"


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
        self.coloring.on_update(step(lambda: self._chosen(view.session.state)))
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
        shown = self.view.shown_model()
        tables = {} if shown is None else shown[1]
        self._choices = {one["words"]: one for one in (colorings_of(tables) if shown is not None else [])}
        if shown is not None and shown[0].truss is not None:
            sections = sorted(shown[0].truss.sections, key=lambda one: one.area)
            names = tuple(dict.fromkeys(one.name for one in sections))
            self._choices[BY_SECTION] = {"kind": "members", "name": "section", "words": BY_SECTION, "names": names}
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
        self.range.visible = self.count.visible = self.between.visible = column is not None
        if column is None:
            self.legend.content = self.bars.content = ""
        else:
            choice = self._choices[self.coloring.value]
            names, middle = choice.get("names"), choice.get("middle")
            values = (
                values_of(column) if names is None else 1.0 + np.array([names.index(each) for each in column.values])
            )
            _, low, high = colors_of(values, middle)
            self._values = values
            begin, end, step = round_ends(low, high)
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

    def draw(self, for_picture: bool = False) -> None:
        """Draw the grid or structure; for a picture as finely as may be, however long that takes."""
        scene, shown = self.view.scene, self.view.shown_model()
        if shown is None:
            scene.remove(*GRID_PARTS)
            self.view.legends.show("grid", None)
            return
        model, _ = shown
        places = self.view.places(model)
        legend: ColourLegend | None = None
        colors: dict[str, np.ndarray | None] = {"members": None, "nodes": None, "panels": None}
        if self._values is not None:
            choice = self._choices[self.coloring.value]
            middle, unit = choice.get("middle"), getattr(self._column(), "unit", "")
            _, low, high = colors_of(self._values, middle)
            scale_ends = self.view.compare.ends if choice["words"] == BY_LENGTH else None
            if scale_ends is not None:
                scale_ends = (scale_ends[0] * self.view.unit_of(model), scale_ends[1] * self.view.unit_of(model))
            most, too_much = choice.get("most", (np.inf, ""))
            if high > most:
                scale_ends = (min(low, most), most)
            own, *shown_ends = colors_of(self._values, middle, scale_ends)
            own = marked(own, self._values, most, too_much)
            legend = legend_of(self.coloring.value, unit, shown_ends[0], shown_ends[1], middle is not None)
            if high > most:
                legend = legend.with_mark(rgb_of(too_much), f"more than {most:g}")
            if "names" in choice:
                legend = legend_of_names(choice["words"], choice["names"], self._values)
            self.legend.content = legend.html()
            begin, end = self.range.value
            is_whole = begin <= low and end >= high
            scale = shown_ends[0], shown_ends[1]
            self.bars.content = histogram_of(
                self._values,
                low,
                high,
                lambda values: marked(colors_of(values, middle, scale)[0], values, most, too_much),
                None if is_whole else (begin, end),
            )
            selected = None if is_whole else (self._values >= begin) & (self._values <= end)
            colors[choice["kind"]] = drawn_colors(own, selected)
            said = "" if selected is None else f"{int(selected.sum()):,} of "
            self.count.content = f"{said}{len(self._values):,} {choice['kind']}"
        section, size = self.section, float(np.linalg.norm(np.diff(places[model.members], axis=1), axis=2).mean())
        of_members = plain_colors(len(model.members)) if colors["members"] is None else colors["members"]
        is_faint = self.view.structure.is_moved or self.view.compare.is_over
        self.view.legends.show("grid", None if is_faint else legend)
        if self.view.structure.is_moved:
            of_members = np.broadcast_to(DIMMED, of_members.shape)
            self.count.content = "grey as built, while the Structure tab shows a displaced shape"
        elif self.view.compare.is_over:
            of_members = np.broadcast_to(DIMMED, of_members.shape)
            self.count.content = "grey, while Compare draws another design over it"
        ends, of_members = cut(section, places[model.members], of_members)
        lines, bodies = self.members.value and not self.tubes.value, self.members.value and self.tubes.value
        as_rods = lines and not for_picture and drawn_as_rods(model, len(ends))
        lines = lines and not as_rods
        scene.members(
            "/grid/members", ends if lines else ends[:0], of_members if lines else of_members[:0],
            FAINT if is_faint else LINE_WIDTH, None if for_picture else MOST_DRAWN_LINES,
        )  # fmt: skip
        radius, sides = (ROD_RADIUS, ROD_SIDES) if as_rods else (TUBE_RADIUS, TUBE_SIDES)
        in_space = bodies or as_rods
        scene.tubes(
            "/grid/tubes",
            ends if in_space else ends[:0],
            of_members if in_space else of_members[:0],
            radius * size,
            sides,
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
        panels, of_panels = model.panels, colors["panels"]
        visible = (kept[panels] | (panels < 0)).all(axis=1)
        visible &= (self.panels.value or of_panels is not None) and not self.view.structure.is_moved
        scene.panels(
            "/grid/panels",
            places,
            model.triangles[visible[panel_of_triangles(panels)]],
            None if of_panels is None else of_panels[visible],
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
