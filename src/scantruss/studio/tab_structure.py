"""Tab: supports, section, material and loads; what they do to the grid."""

from __future__ import annotations

import contextlib
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, words_of_number
from ..structure.build import scale_of
from ..structure.groups import WAYS_TO_GROUP
from ..structure.options import loads_of_words
from ..structure.report_lines import node_lines, sizing_lines
from ..structure.supports import HELD_BY_TYPE
from .colours import colors_of, legend_of
from .compare import structure_figures
from .frame import DRAWN_EXTENT
from .layers_tool import LAYER_CHOICES, LayersTool
from .legend import ColourLegend
from .outputs import PREVIEW_WORDS
from .page_words import in_words_of_page
from .picking import nearest_point
from .scene import barbed, spread
from .session import STRUCTURE_WORDS
from .state import DEFAULT_STRUCTURE
from .structure_words import scale_of_text, text_of_scale, times_of, weight_bars, words_of_asked
from .support_places import asked_supports, is_untouched, marks_of_grid, switched

if TYPE_CHECKING:
    from .state import StudioState
    from .view import StudioView

SHOWN_DISPLACEMENT = 0.06  #: of the greatest displacement, as it is drawn first [extent of the scan]
LOAD_ARROW = 0.08  #: of the greatest load [extent of the scan]
SUPPORT_COLOR = np.array((20, 130, 60), np.uint8)
LOAD_COLOR = np.array((235, 120, 10), np.uint8)
#: of loads, for more hide the members; where more nodes are loaded, as many of them, far from one another
MOST_ARROWS = 160
NO_LOAD = 1e-9  #: share of the greatest load of a node up to which another has none
ARROW_WIDTH = 2.0  #: of a load [pixel]
SUPPORT_RADIUS = 0.09  #: of a support that is drawn [scene]
ANIMATION_SECONDS, FRAME_SECONDS = 6.0, 0.08  #: of a mode that is shown [s]
SWINGS_OF_MODE = 3  #: of a mode while it is shown
AROUND_CLICK = 0.03  #: of a node that a click means to support [rad]
AS_BUILT = "as built"
SUPPORT_MODE = "place support"
SIZING = "Sizing and modes"
FROM_LISTS = ("support_type", "size_by", *LAYER_CHOICES)  #: what is chosen from a list


class StructureTab:
    """The structure of the grid and its results."""

    def __init__(self, view: StudioView, gui: Any) -> None:
        self.view = view
        kept = view.session.state.structure_settings
        hint = "corners, boundary, lowest:H, fixed, ends, line:NAME, loop:N, N001, joined by +; or Place by clicks"
        self.preview = gui.add_markdown(PREVIEW_WORDS, visible=False)
        self.words = {"supports": gui.add_text("supports", kept.supports, hint=hint)}
        by_click = gui.add_button(
            "Place by clicks",
            hint="then click on nodes of the grid; the first takes the place of the usual supports, a second click takes it away",
        )
        self.lost = gui.add_markdown("", visible=False)
        self._asked: tuple[Any, ...] = ()  # of which the nodes and words that follow are
        self._held, self._why_none = np.zeros(0, np.int64), ""
        self.words |= {
            "support_type": gui.add_dropdown("held as", tuple(HELD_BY_TYPE), initial_value=kept.support_type),
            "section": gui.add_text("section", kept.section),
        }
        self.sized = gui.add_markdown("", visible=False)
        self.words |= {
            "material": gui.add_text("material", kept.material),
            "loads": gui.add_text("loads", ",".join(map(str, kept.loads)), hint="self,snow:1kN/m2,wind:0.8kN/m2:-0.7"),
        }
        self.metric = gui.add_markdown("", visible=False)
        self.numbers = {
            "scale": gui.add_text(
                "scale", text_of_scale(kept.scale), hint="structure to scan: 1:500 is a 500th, 500:1 as many times as large; or a number"
            )
        }  # fmt: skip
        self.folder = gui.add_folder(SIZING, expand_by_default=False)
        with self.folder:
            self.numbers["size"] = gui.add_text(
                "most sections",
                str(kept.size),
                hint="different sections that sizing chooses at most; 0: no sizing, the section above",
            )
            self.words["size_by"] = gui.add_dropdown(
                "each section for", WAYS_TO_GROUP, initial_value=kept.size_by, hint="what gets a section of its own"
            )
            self.numbers["buckling"] = gui.add_text(
                "buckling modes", str(kept.buckling), hint="of the combination that buckles first"
            )
            self.numbers["frequencies"] = gui.add_text("frequencies", str(kept.frequencies), hint="lowest natural ones")
        self.layers = LayersTool(gui, kept)
        run = gui.add_button("Run", color="blue")
        self.results, self.weights = gui.add_markdown(""), gui.add_html("")
        self.case = gui.add_dropdown("shape under", (AS_BUILT,), hint="load cases, combinations and modes")
        self.factor = gui.add_text(
            "enlarged", "", hint="how many times displacements are drawn; empty: so that they are seen"
        )
        self.loads, self.supports = gui.add_checkbox("loads", True), gui.add_checkbox("supports", True)
        animate = gui.add_button("Animate")
        by_click.on_click(view.step(lambda: setattr(view.click, "value", SUPPORT_MODE)))
        run.on_click(view.step(self._run))
        animate.on_click(view.aside(self._animate))
        self.case.on_update(view.step(self._choose))
        view.modes[SUPPORT_MODE] = self._support_under
        for each in (self.factor, self.loads, self.supports):
            each.on_update(view.step(self.draw))
        for name, each in (self.words | self.numbers | self.layers.fields).items():
            take = partial(self._take, name)
            if name in FROM_LISTS:
                each.on_update(view.step(take))
            else:
                view.typed(each, take)

    @property
    def is_moved(self) -> bool:
        """Whether a displaced shape is drawn."""
        return bool(self.case.value != AS_BUILT)

    def draw(self) -> None:
        """Draw supports, loads and the displaced shape, on the drawn side of the section."""
        self._draw(self.view.session.state)

    def _choose(self) -> None:
        self.draw()
        self.view.look.draw()

    def _run(self) -> None:
        self.view.session.set_structure(
            **{name: self._value(name) for name in (*self.words, *self.numbers, *self.layers.fields)}
        )
        self.view.session.run_structure()

    def _take(self, name: str) -> None:
        self.view.session.set_structure(**{name: self._value(name)})
        self.view.session.tell()

    def _value(self, name: str) -> Any:
        """Return what a field says."""
        if name in self.words:
            return self.words[name].value
        if name in self.layers.fields:
            return self.layers.value(name)
        each = self.numbers[name]
        try:
            return scale_of_text(each.value) if name == "scale" else int(each.value)
        except ValueError:
            needs = "a number or 1:100" if name == "scale" else "a whole number"
            raise InputError(f"{each.label} needs {needs}, got {each.value!r}") from None

    def _show_asked(self, state: StudioState) -> None:
        """Show what the next structure is asked for; a field that says it in other words is left alone."""
        asked = state.structure_settings
        for name in STRUCTURE_WORDS:
            value = getattr(asked, name)
            if name in FROM_LISTS:
                self.words[name].value = value
            elif name != "loads":
                self.view.show_text(self.words[name], value)
            elif loads_of_words(self.words[name].value) != value:
                self.view.show_text(self.words[name], ",".join(map(str, value)))
        self.layers.show(asked, self.view.show_text)
        for name, each in self.numbers.items():
            with contextlib.suppress(InputError):
                if self._value(name) == getattr(asked, name):
                    continue
            value = getattr(asked, name)
            self.view.show_text(each, text_of_scale(value) if name == "scale" else f"{value:g}")

    def _show_notes(self, state: StudioState) -> None:
        """Say what a person must know of the grid, the supports and the section before Run is pressed."""
        self.preview.visible = state.is_live
        size, unit = state.structure_settings.size, state.grid.unit if state.grid is not None else ""
        self.metric.visible = unit not in ("", "m")
        if self.metric.visible:
            metres = scale_of(unit, state.structure_settings.scale)
            self.metric.content = (
                f"lengths of the structure are in metres: 1 {unit} of the scan is {metres:.6g} m; loads also as 20psf"
            )
        self._look_for_supports(state)
        self.lost.content, self.lost.visible = f"**supports:** {self._why_none}", bool(self._why_none)
        chosen = f"chosen by sizing, at most {size}" if size else ""
        self.sized.content, self.sized.visible = f"the section is {chosen}; see below", bool(size)
        self.folder.label = f"{SIZING} (sections {chosen})" if size else SIZING

    def _support_under(self, origin: np.ndarray, ahead: np.ndarray) -> None:
        """Hold the node under a ray, or the nearest to what is there."""
        found, shown = self.view.under(origin, ahead), self.view.shown_model()
        if shown is not None and (found is None or found[0] != "nodes"):
            node = nearest_point(self.view.places(shown[0]), origin, ahead, AROUND_CLICK)
            found = found if node is None else ("nodes", node)
        self.support(found)

    def support(self, found: tuple[str, int] | None) -> None:
        """Hold the node under a click, or no longer."""
        shown = self.view.shown_model()
        if shown is None or found is None or found[0] != "nodes":
            raise InputError("no node is there; click on a node of the grid")
        known = marks_of_grid(self.view.session.state)
        if found[1] >= len(known):
            raise InputError(
                'that node is of a layer below; click on one of the grid, and say "supports on" inner to hold the last layer'
            )
        mark = known[found[1]]
        before = self.words["supports"].value
        replaces = is_untouched(self.view.session.state) and before == DEFAULT_STRUCTURE.supports
        supports = mark if replaces else switched(before, mark)
        self.words["supports"].value = supports
        self.view.session.set_structure(supports=supports)
        instead = f", in place of the usual {before}: type {before}+{mark} for both" if replaces else ""
        self.view.say(f"supports: {supports or 'none'}{instead}; press Run")

    def _look_for_supports(self, state: StudioState) -> None:
        """Look for the nodes that the next structure is supported at, once for each grid and what is asked."""
        asked = state.structure_settings
        key = (state.grid, asked.supports, asked.scale, asked.unit)
        if self._asked != key:
            self._asked = key
            self._held, self._why_none = asked_supports(state)

    def _draw_supports(self, state: StudioState) -> None:
        """Draw the supports of the structure that is shown; on this tab those that the next one is asked for, as they are typed."""
        scene, shown = self.view.scene, self.view.shown_model()
        is_next = state.solution is None or state.is_structure_stale
        if shown is None or not self.supports.value or (state.solution is None and not self.view.is_open("Structure")):
            scene.remove("/supports/held")
            return
        places = self.view.places(shown[0])
        held = self._held if is_next else shown[0].supported
        held = held[self._kept(places)[held]]
        scene.balls("/supports/held", places[held], SUPPORT_COLOR, SUPPORT_RADIUS)

    def fill(self, before: StudioState | None, state: StudioState) -> None:
        """Show the structure of a state."""
        if before is not None and before.structure_settings is not state.structure_settings:
            self._show_asked(state)
        self._show_notes(state)
        self._show_results(state)
        if before is not None and before.solution is state.solution and before.grid is state.grid:
            if before.structure_settings is not state.structure_settings:
                self._draw_supports(state)
            return
        weights = state.report.weights if state.report is not None else None
        self.weights.content = weight_bars(weights) if weights else ""
        cases: tuple[str, ...] = (AS_BUILT,)
        if state.solution is not None:
            cases += tuple(result.name for result in state.solution.all_results())
            cases += tuple(self._shapes(state))
        self.case.options = cases
        self._draw(state)

    def _show_results(self, state: StudioState) -> None:
        rows = [f"**before the last change**, {words_of_asked(state)}:"] if state.is_structure_stale else []
        rows += [f"{name} **{value}**" for name, value in structure_figures(state)]
        if state.report is not None:
            rows += [in_words_of_page(words) for words in node_lines(state.report.truss)]
            rows += sizing_lines(state.report)
            rows += [f"**warning:** {in_words_of_page(words)}" for words in state.report.warnings]
        self.results.content = "\n\n".join(rows)

    def _shapes(self, state: StudioState) -> dict[str, np.ndarray]:
        """Return the shapes (V, 3) of buckling and vibration by their names."""
        found: dict[str, np.ndarray] = {}
        report = state.report
        if report is not None and report.buckling is not None:
            values = enumerate(report.buckling.values.tolist())
            found |= {f"buckling {k + 1}, factor {value:.3g}": report.buckling.shapes[k] for k, value in values}
        if report is not None and report.vibration is not None:
            values = enumerate(report.vibration.values.tolist())
            found |= {f"mode {k + 1}, {value:.3g} Hz": report.vibration.shapes[k] for k, value in values}
        return found

    def _moved(self, state: StudioState) -> tuple[np.ndarray, float, bool] | None:
        """Return displacements (V, 3) of the chosen case [m], how many times they are drawn, and whether it is a mode."""
        if state.solution is None or state.report is None or self.case.value == AS_BUILT:
            return None
        shapes = self._shapes(state)
        is_mode = self.case.value in shapes
        moved = shapes[self.case.value] if is_mode else state.solution[self.case.value].displacements[:, :3]
        extent = DRAWN_EXTENT / self.view.frame.factor * self.view.metres()
        usual = SHOWN_DISPLACEMENT * extent / (float(np.linalg.norm(moved, axis=1).max()) or 1.0)
        try:
            factor = float(self.factor.value) if self.factor.value.strip() and not is_mode else usual
        except ValueError:
            raise InputError(f"enlarged needs a number, got {self.factor.value!r}") from None
        return moved, factor, is_mode

    def _draw(self, state: StudioState) -> None:
        scene, shown, legend = self.view.scene, self.view.shown_model(), None
        self._draw_supports(state)
        if shown is None or state.solution is None or shown[0].truss is None:
            scene.remove("/moved", "/loads")
            self.view.legends.show("shape", None)
            self.view.legends.show("loads", None)
            return
        model, _ = shown
        places = self.view.places(model)
        kept = self._kept(places)
        moved = self._moved(state)
        if moved is None:
            scene.remove("/moved")
        else:
            change, factor, is_mode = moved
            size = np.linalg.norm(change, axis=1)
            of_members = size[model.members].mean(axis=1)
            scale_ends = (0.0, float(size.max()) or 1.0) if is_mode else None  # a mode has no size of its own
            colors, low, high = colors_of(of_members if is_mode else 1e3 * of_members, None, scale_ends)
            drawn = kept[model.members].all(axis=1)
            ends = (places + self._in_scene(change, factor))[model.members[drawn]]
            scene.lines("/moved", ends, colors[drawn], 4.0)
            legend = legend_of(f"displacement, drawn {times_of(factor)} times", "mm", low, high, False)
            if is_mode:
                legend = legend_of(f"{self.case.value}: movement over the greatest", "", 0.0, 1.0, False)
        self.view.legends.show("shape", legend)
        self._draw_loads(state, places)

    def _kept(self, places: np.ndarray) -> np.ndarray:
        """Return which nodes at places (V, 3) of the scene the section leaves (V,)."""
        section = self.view.look.section
        return np.ones(len(places), bool) if section is None else section.keeps(places)

    def _in_scene(self, change: np.ndarray, factor: float) -> np.ndarray:
        return (change * (factor / self.view.metres() * self.view.frame.factor)).astype(np.float32)

    def _draw_loads(self, state: StudioState, places: np.ndarray) -> None:
        assert state.solution is not None
        cases = state.solution.truss.cases
        case = next((each for each in cases if each.name == self.case.value), cases[-1] if cases else None)
        if case is None or not self.loads.value:
            self.view.scene.remove("/loads")
            self.view.legends.show("loads", None)
            return
        truss, forces = state.solution.truss, np.zeros((len(places), 3))
        if case.nodal is not None:
            forces += case.nodal[:, :3]
        if case.line is not None:
            half = 0.5 * case.line * truss.lengths[:, None]
            for side in (0, 1):
                np.add.at(forces, truss.members[:, side], half)
        size = np.linalg.norm(forces, axis=1)
        greatest = float(size.max(initial=0.0))
        loaded = np.flatnonzero((size > NO_LOAD * greatest) & self._kept(places))
        drawn = loaded[spread(places[loaded], MOST_ARROWS)]
        along = forces[drawn] * (LOAD_ARROW * DRAWN_EXTENT / (greatest or 1.0))
        self.view.scene.lines("/loads", barbed(places[drawn], along), LOAD_COLOR, ARROW_WIDTH)
        self.view.legends.show("loads", legend_of_loads(case.name, greatest, len(drawn), len(loaded)))

    def _animate(self) -> None:
        state, shown = self.view.session.state, self.view.shown_model()
        if (moved := self._moved(state)) is None or shown is None:
            raise InputError("choose a load case or a mode to animate")
        change, factor, _ = moved
        places, members = self.view.places(shown[0]), shown[0].members
        members = members[self._kept(places)[members].all(axis=1)]
        scene = self.view.scene.api
        handle = scene.get_handle_by_name("/moved")
        step = self._in_scene(change, factor)
        if handle is None:
            raise InputError("nothing that moves is on the drawn side of the section")
        began = time.monotonic()
        while (spent := time.monotonic() - began) < ANIMATION_SECONDS:
            if scene.get_handle_by_name("/moved") is not handle:  # another shape is drawn meanwhile
                return
            swing = np.float32(np.sin(2 * np.pi * SWINGS_OF_MODE * spent / ANIMATION_SECONDS))
            with contextlib.suppress(RuntimeError):  # of one that has just been removed
                handle.points = (places + swing * step)[members]
            time.sleep(FRAME_SECONDS)
        self._draw(state)


def legend_of_loads(case: str, greatest: float, drawn: int, loaded: int) -> ColourLegend | None:
    """Return the legend of the arrows of a load case: the greatest load of a node [N], and how many of the loaded nodes have one."""
    if not loaded:
        return None
    where = f"all {loaded:,}" if drawn == loaded else f"{drawn:,} of {loaded:,}"
    red, green, blue = LOAD_COLOR.tolist()
    said = f"{case}, at most {words_of_number(greatest / 1e3, 3)} kN, on {where} loaded nodes{'' if drawn == loaded else ', evenly spread'}"
    return ColourLegend("loads", marks=(((red, green, blue), said),))
