"""Session: all steps of a studio, from the scan to the files; no browser is needed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from ..constraints.fixed_nodes import check_fixed_positions
from ..errors import InputError
from ..export.model import Model
from ..pipeline import grid_from_cloud
from ..report.advice import Advice
from ..runtime.progress import Progress, WatchedProgress
from ..scan.cloud import PointCloud
from ..scan.member_length import check_length, exact_range
from ..settings import Settings
from ..structure.options import loads_of_words
from ..surface.samples import sample_surface
from .compare import kept_design, taken_design
from .features import Feature, corners_of_feature, features_to_switch, switched_off
from .outputs import EFFORT_OF_PREVIEW, Note, command_of_project, model_to_show, output_files, unsaid
from .solving import check_words, solved_state
from .state import NO_GRID, StudioState
from .support_places import placed_supports, supports_on
from .trade_steps import TradeSteps

SECONDS_OF_FRONT = 0.2  #: between two pictures of a front [s]
MOST_LIVE_MEMBERS = 60_000  #: of a quick grid that is made while the length changes
STRUCTURE_WORDS = ("supports", "support_type", "section", "material", "loads", "size_by")  #: what the page asks for


class Session(TradeSteps):
    """The state of a studio, and the steps that change it; see `Steps`."""

    def __init__(self, project: Path | None = None, *, folder: Path | None = None) -> None:
        super().__init__(project, folder=folder)
        self.features: list[Feature] = []
        self.wants_features = False  #: whether holes and ridges are looked for after each grid
        self._features_of: tuple[PointCloud, Settings] | None = None
        self._corners: tuple[PointCloud, Settings, np.ndarray] | None = None
        self.found: tuple[StudioState | None, str] = None, ""  #: what was found out, and the state of which that is so
        self.front: tuple[np.ndarray, np.ndarray] | None = None  #: nodes and triangles of a front that advances
        self._front_seen = 0.0

    def _forget_features(self) -> None:
        self.features, self._features_of = [], None

    # ---- the grid

    def set(self, words: str, **changes: Any) -> None:
        """Change settings of the next grid, and show a quick one with them.

        Raises
        ------
        InputError
            A value cannot be used.
        """
        settings = self.settings.replace(**changes)
        if settings == self.settings and self.grid is not None:
            return
        self.change(words, settings=settings)
        self._show_change()

    def _show_change(self) -> None:
        self.save()
        self.tell()
        self._ask_live()

    def set_quietly(self, words: str, **changes: Any) -> None:
        """Change settings that a quick grid does not heed."""
        self.change(words, settings=self.settings.replace(**changes))
        self.save()
        self.tell()

    def set_length(self, length: float) -> None:
        """Take a length of members, and show a quick grid with it.

        Raises
        ------
        InputError
            No grid of this scan can have it.
        """
        settings = self.state.with_main_length(length)
        if self.cloud is not None:
            check_length(self.cloud, settings)
        self.set("length", length=settings.length)

    def try_lengths(self) -> None:
        """Try lengths by quick grids, as ``scantruss info`` does, take the one that it suggests, and show its grid.

        Raises
        ------
        InputError
            There is no scan; or, once it is tried, no length gives a grid that passes.
        """
        if self.cloud is None:
            raise InputError("there is no scan yet; open one")
        self.worker.ask(self._try_lengths)

    def _try_lengths(self, progress: Progress) -> None:
        cloud, turn = self.cloud, self._turn
        assert cloud is not None
        advice = Advice(cloud, self.settings, lambda stage, share: progress(f"trying lengths: {stage}", share))
        length = advice.suggest()
        if not advice.passes:
            raise InputError("no length that was tried gives a grid that passes; Generate says what is in the way")
        with self._lock:
            if turn != self._turn:
                return
            self.change("length tried", settings=self.state.with_main_length(length))
        self.save()
        self._make(EFFORT_OF_PREVIEW, progress, live=True)
        passed = sum(trial.passed for trial in advice.tried)
        self.found = self.state, f"{len(advice.tried)} lengths tried, {passed} pass; {length:g} is taken"

    def paint(self, made: Settings) -> None:
        """Take settings with other lengths at some places; the length elsewhere stays."""
        main = self.state.main_length
        self.change("paint", settings=made, unpainted=main / made.length)
        self._show_change()

    def unpaint(self) -> None:
        """Take one length everywhere: that of where none was painted."""
        settings = self.settings.replace(length=self.state.main_length, length_field="")
        if settings != self.settings:
            self.change("no length field", settings=settings, unpainted=1.0)
            self._show_change()

    def live(self, length: float) -> bool:
        """Make a quick grid of a length, unless a run that was asked for is under way; the newest request wins."""
        self.change("slider", goes_on=True, settings=self.state.with_main_length(length))
        return self._ask_live()

    def show_quick(self) -> bool:
        """Make a quick grid of what was opened."""
        return self.cloud is not None and self.grid is None and self._ask_live()

    def _ask_live(self) -> bool:
        return self.worker.ask(lambda progress: self._make(EFFORT_OF_PREVIEW, progress, live=True), quick=True)

    def generate(self) -> None:
        """Make the grid with the effort of the settings."""
        self.worker.ask(lambda progress: self._make(self.settings.effort, progress))

    def _make(self, effort: str, progress: Progress, *, live: bool = False) -> None:
        cloud, settings, turn = self.cloud, self.settings, self._turn
        if cloud is None:
            raise InputError("there is no scan yet; open one")
        low, high = exact_range(cloud)
        if live and not low <= settings.length <= high:
            return  # Generate says why
        progress("boundary", 0.0)
        try:
            watched = progress if live else WatchedProgress(progress, self._see_front)
            own = {"effort": effort} | (
                {"planar": False} if live else {}
            )  # which takes thrice the time of a quick grid
            grid = grid_from_cloud(cloud, settings.replace(**own), progress=watched)
        finally:
            self.front = None
        made = NO_GRID | {"grid": grid, "asked": settings, "is_live": live}
        with self._lock:
            if turn != self._turn or (live and len(grid.edges) > MOST_LIVE_MEMBERS):
                return
            made |= supports_on(self.state, grid)
            if live:
                self.state = replace(self.state, **made)
            else:
                self.change("generate", **made)
        if not live:
            self.save()
        self.tell()
        self._find_features(progress)

    def _see_front(self, nodes: np.ndarray, triangles: np.ndarray) -> None:
        """Show a front while it advances, a few times a second; its end is there until the grid is."""
        self.front = nodes, triangles
        if monotonic() - self._front_seen >= SECONDS_OF_FRONT:
            self._front_seen = monotonic()
            self.tell()

    # ---- holes, ridges, fixed nodes

    def show_features(self) -> None:
        """Look for holes and ridges from now on."""
        self.wants_features = True
        self._look_for_features()

    def _look_for_features(self) -> None:
        if self.wants_features:
            self.worker.ask(self._find_features, quick=True, then=True)

    def _show_again(self) -> None:
        if not self.show_quick():  # which looks for them too
            self._look_for_features()

    @property
    def has_looked(self) -> bool:
        """Whether holes and ridges of the present scan have been looked for."""
        return self._features_of is not None and self._features_of[0] is self.cloud

    def _find_features(self, progress: Progress) -> None:
        cloud, settings = self.cloud, self.settings.replace(fill_at=(), no_ridge_at=(), effort="quick")
        if not self.wants_features or cloud is None:
            return
        known = self._features_of
        if known is not None and known[0] is cloud and known[1] == settings:
            return
        progress("holes and ridges", 0.5)
        self.features = features_to_switch(cloud, settings)
        self._features_of = (cloud, settings)

    def switch(self, number: int) -> None:
        """Close a hole or open it again, leave a ridge alone or follow it again, by its number among the features."""
        feature = self.features[number]
        named = switched_off(self.features, self.settings).get(number, ())
        places = getattr(self.settings, feature.kind)
        left = tuple(place for place in places if place not in named) if named else (*places, feature.place)
        self.set(f"{'hole' if feature.kind == 'fill_at' else 'ridge'} {number + 1}", **{feature.kind: left})

    def corner_near(self, place: np.ndarray) -> np.ndarray | None:
        """Return the corner (3,) of the boundary that lies within half a member of a place; None where none does [scan unit]."""
        cloud, settings = self.cloud, self.settings.replace(fixed=(), fixed_lines=(), effort="quick")
        if cloud is None:
            return None
        if self._corners is None or self._corners[0] is not cloud or self._corners[1] != settings:
            self._corners = (cloud, settings, corners_of_feature(cloud, settings))
        corners = self._corners[2]
        away = np.linalg.norm(corners - place, axis=1)
        return corners[int(away.argmin())] if len(corners) and away.min() <= settings.length / 2 else None

    def fix(self, places: tuple[tuple[float, ...], ...], words: str = "fixed node") -> None:
        """Take the positions that must become nodes, in the frame of the scan [scan unit].

        Raises
        ------
        InputError
            A new one is farther than half a member from the scan; it is not taken, for no grid could be made with it.
        """
        length = self.settings.length
        if self.cloud is not None and length and not self.settings.length_field:
            kept = {tuple(place) for place in self.settings.fixed}
            new = [place for place in places if place not in kept]
            check_fixed_positions(new, sample_surface(self.cloud, self.settings), length)
        self.set(words, fixed=places)

    # ---- the structure

    def set_structure(self, **words: str | float) -> None:
        """Take what the page says of supports, section, material, loads, sizing and modes.

        Raises
        ------
        InputError
            It names a file, which the page may not read, or cannot be used.
        """
        check_words({name: word for name, word in words.items() if isinstance(word, str)})
        given: dict[str, Any] = dict(words)
        if "loads" in given:
            given["loads"] = loads_of_words(str(given["loads"]))
        settings = self.state.structure_settings.replace(**given)
        if settings != self.state.structure_settings:
            places = placed_supports(settings.supports, self.state.support_places, self.grid)
            self.change("structure", structure_settings=settings, support_places=places)
            self.save()

    def run_structure(self) -> None:
        """Make the structure of the grid and solve it."""

        def run(progress: Progress) -> None:
            progress("structure", 0.1)
            turn = self._turn
            solved = solved_state(self.state, progress)
            if turn != self._turn or solved.grid is not self.grid:
                return
            self.change("run", solution=solved.solution, report=solved.report, solved_with=solved.solved_with)
            self.save()

        self.worker.ask(run, then=True)

    # ---- designs, files

    def keep_design(self, name: str) -> None:
        """Keep the grid, and the figures of its structure, for comparison."""
        design = kept_design(self.state, name)
        others = tuple(each for each in self.state.designs if each.name != design.name)
        self.change(f"keep {design.name}", designs=(*others, design))
        self.save()
        self.tell()

    def take_design(self, name: str) -> None:
        """Go on with a design that was kept."""
        changes = taken_design(self.state, name)
        if changes["grid"] is self.grid:
            return
        self.stop()
        self._turn += 1
        self.change(f"take {name}", **changes)
        self.save()
        self.tell()
        self._look_for_features()

    def drop_design(self, name: str) -> None:
        """Forget a design."""
        self.change(f"drop {name}", designs=tuple(each for each in self.state.designs if each.name != name))
        self.save()
        self.tell()

    def model(self, kind: str) -> Model:
        """Return the grid or the structure; see `outputs.model_to_show`."""
        return model_to_show(self.state, kind)

    def files(self, kind: str, suffix: str, note: Note = unsaid) -> dict[str, bytes]:
        """Return the files of a format by their names; see `outputs.files_of`."""
        return output_files(self.state, kind, suffix, note)

    def command(self) -> str:
        """Return the command lines that repeat the grid and the structure."""
        return command_of_project(self.state)
