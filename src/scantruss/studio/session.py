"""Session: the steps that change what a studio works on, each of which can be taken back; no browser is needed."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import RLock
from typing import Any

from ..errors import InputError
from ..export.model import Model
from ..grid.grid import Grid
from ..pipeline import grid_from_cloud
from ..runtime.files import temporary_folder
from ..runtime.progress import Progress
from ..scan.cloud import PointCloud
from ..scan.member_length import exact_range, length_range, suggest_length
from ..settings import Settings
from ..structure.options import loads_of_words
from ..structure.statics import Solution
from .compare import kept_design
from .features import Feature, find_features, switched_off
from .opening import DATA_FOLDER, EXAMPLES, next_free, read_whole
from .outputs import command_of, files_of, model_to_show
from .project import read_project, save_project
from .solving import check_words, solved_state
from .state import History, StudioState
from .worker import StoppedError, Worker, words_of

LARGEST_UPLOAD = 500_000_000  #: of a scan that comes through the page [bytes]
MOST_LIVE_MEMBERS = 60_000  #: of a quick grid that is made while the length changes
STRUCTURE_WORDS = ("supports", "support_type", "section", "material", "loads")  #: what the page asks for


class Session:
    """The state of a studio, and the steps that change it.

    Parameters
    ----------
    project : Path, optional
        File that is saved after each step.
    folder : Path, optional
        Where a scan that is opened gets a project file, if `project` is not given; none: nothing is saved.
    """

    def __init__(self, project: Path | None = None, *, folder: Path | None = None) -> None:
        self.place, self.folder = project, folder
        self.state = StudioState()
        self.history = History()
        self.features: list[Feature] = []
        self.wants_features = False  #: whether holes and ridges are looked for after each grid
        self.message = ""  #: why the last step was refused, in the words of the command line
        self.stage, self.share = "", 0.0
        self.worker = Worker(self._end, self._progress)
        self._listeners: list[Callable[[], None]] = []
        self._turn = 0  # counts what makes the result of a running task unwanted
        self._features_of: tuple[PointCloud, Settings] | None = None
        self._lock, self._saving = RLock(), RLock()

    @property
    def cloud(self) -> PointCloud | None:
        """The scan."""
        return self.state.cloud

    @property
    def settings(self) -> Settings:
        """Settings of the next grid."""
        return self.state.settings

    @property
    def grid(self) -> Grid | None:
        """The grid."""
        return self.state.grid

    @property
    def solution(self) -> Solution | None:
        """The structure, solved."""
        return self.state.solution

    # ---- who listens

    def listen(self, tell: Callable[[], None]) -> Callable[[], None]:
        """Call `tell`, from any thread, whenever something has changed; return what ends that."""
        self._listeners.append(tell)
        return lambda: self._listeners.remove(tell) if tell in self._listeners else None

    def tell(self) -> None:
        """Say that something has changed."""
        for tell in list(self._listeners):
            try:
                tell()
            except StoppedError:
                raise
            except Exception:  # of a page that has just closed; the others still hear of it
                sys.excepthook(*sys.exc_info())

    # ---- steps

    def change(self, words: str, *, goes_on: bool = False, **changes: Any) -> None:
        """Take a step that can be taken back.

        Parameters
        ----------
        words : str
            What undo would take back.
        goes_on : bool
            Whether it goes on with the step before, where that has the same words.
        """
        with self._lock:
            self.history.note(words, self.state, goes_on=goes_on)
            self.state = replace(self.state, **changes)
        self.message = ""

    def begin(self, state: StudioState) -> None:
        """Begin with a state, with nothing to take back."""
        with self._lock:
            self.state, self.history, self._turn = state, History(), self._turn + 1

    def undo(self) -> None:
        """Take the last step back."""
        self._go(self.history.undo)

    def redo(self) -> None:
        """Take the step again that was taken back last."""
        self._go(self.history.redo)

    def _go(self, way: Callable[[StudioState], StudioState | None]) -> None:
        self.worker.stop()
        with self._lock:
            other = way(self.state)
            if other is None:
                return
            self.state, self._turn, self.message = other, self._turn + 1, ""
        self.save()
        self._look_for_features()
        self.tell()

    # ---- the scan

    def open(self, path: Path) -> None:
        """Open a scan or a project.

        Raises
        ------
        ScanTrussError
            It cannot be read.
        """
        if path.suffix.lower() == ".scantruss":
            state, solved = read_project(path)
            self.begin(solved_state(state) if solved else state)
            return
        self._start(read_whole(path))

    def open_upload(self, name: str, content: bytes) -> None:
        """Open a scan or a project that came through the page, as a step of the worker."""

        def read(progress: Progress) -> None:
            if len(content) > LARGEST_UPLOAD:
                raise InputError(
                    f"a scan of more than {LARGEST_UPLOAD:,} bytes; name it on the command line: scantruss studio SCAN"
                )
            own = Path(name.replace("\\", "/")).name
            progress("read", 0.1)
            with temporary_folder() as folder:
                path = folder / (own or "scan")
                path.write_bytes(content)
                if path.suffix.lower() == ".scantruss":
                    state, solved = read_project(path)
                    taken = solved_state(state) if solved else state
                    self.change(f"open {own}", **vars(taken))
                    self._saved_beside(own)
                    return
                cloud = read_whole(path)
            self._start(replace(cloud, name=own))
            self._make("quick", progress, live=True)

        self.worker.ask(read)

    def open_example(self, name: str) -> None:
        """Open a bundled scan and make its quick grid, as a step of the worker."""
        file, settings = EXAMPLES[name]

        def read(progress: Progress) -> None:
            self._start(read_whole(DATA_FOLDER / file), settings)
            self._make("quick", progress, live=True)

        self.worker.ask(read)

    def _start(self, cloud: PointCloud, settings: Settings | None = None) -> None:
        made = settings or Settings(length=suggest_length(cloud), unit=cloud.unit)
        self.change(
            f"open {cloud.name}", cloud=cloud, settings=made, grid=None, asked=None, is_live=False, solution=None, report=None
        )  # fmt: skip
        self._turn += 1
        self.features, self._features_of = [], None
        self._saved_beside(cloud.name or "scan")

    def _saved_beside(self, name: str) -> None:
        """Choose a project file, where there is none yet, and save."""
        if self.place is None and self.folder is not None:
            place = self.folder / f"{Path(name).stem}.scantruss"
            self.place = next_free(place) if place.exists() else place
        self.save()

    def set_unit(self, unit: str) -> None:
        """Take the unit of the scan's coordinates; the grid of the scan without it is gone."""
        self.stop()
        cloud = None if self.cloud is None else replace(self.cloud, unit=unit, system="")
        self._turn += 1
        self.change(
            "unit",
            cloud=cloud,
            settings=self.settings.replace(unit=unit),
            grid=None,
            asked=None,
            solution=None,
            report=None,
        )
        self.save()

    def length_bounds(self) -> tuple[float, float]:
        """Return the lengths that the slider offers: about the suggested one, within what the scan allows [scan unit]."""
        if self.cloud is None:
            return 0.5, 2.0
        low, high = length_range(self.cloud)
        wished = suggest_length(self.cloud)
        return max(low, wished / 3), max(low, min(high, wished * 3))

    # ---- the grid

    def set(self, words: str, **changes: Any) -> None:
        """Change settings of the next grid, and show a quick one with them.

        Raises
        ------
        InputError
            A value cannot be used.
        """
        self.change(words, settings=self.settings.replace(**changes))
        self.save()
        self.tell()
        self._ask_live()

    def live(self, length: float) -> bool:
        """Make a quick grid of a length, unless a run that was asked for is under way; the newest request wins."""
        self.change("slider", goes_on=True, settings=self.settings.replace(length=length))
        return self._ask_live()

    def show_quick(self) -> bool:
        """Make a quick grid of what was opened."""
        return self.cloud is not None and self.grid is None and self._ask_live()

    def _ask_live(self) -> bool:
        return self.worker.ask(lambda progress: self._make("quick", progress, live=True), quick=True)

    def generate(self) -> None:
        """Make the grid with the effort of the settings."""
        self.worker.ask(lambda progress: self._make(self.settings.effort, progress))

    def stop(self) -> None:
        """Stop what runs; the grid before it stays."""
        self.worker.stop()

    def _make(self, effort: str, progress: Progress, *, live: bool = False) -> None:
        cloud, settings, turn = self.cloud, self.settings, self._turn
        if cloud is None:
            raise InputError("there is no scan yet; open one")
        low, high = exact_range(cloud)
        if live and not low <= settings.length <= high:
            return  # Generate says why
        progress("boundary", 0.0)
        grid = grid_from_cloud(cloud, settings.replace(effort=effort), progress=progress)
        made: dict[str, Any] = {"grid": grid, "asked": settings, "is_live": live, "solution": None, "report": None}
        with self._lock:
            if turn != self._turn or (live and len(grid.edges) > MOST_LIVE_MEMBERS):
                return
            if live:
                self.state = replace(self.state, **made)
            else:
                self.change("generate", **made)
        if not live:
            self.save()
        self.tell()
        self._find_features(progress)

    # ---- holes, ridges, fixed nodes

    def show_features(self) -> None:
        """Look for holes and ridges from now on."""
        self.wants_features = True
        self._look_for_features()

    def _look_for_features(self) -> None:
        if self.wants_features:
            self.worker.ask(self._find_features, quick=True)

    def _find_features(self, progress: Progress) -> None:
        cloud, settings = self.cloud, self.settings.replace(fill_at=(), no_ridge_at=(), effort="quick")
        if not self.wants_features or cloud is None:
            return
        known = self._features_of
        if known is not None and known[0] is cloud and known[1] == settings:
            return
        progress("holes and ridges", 0.5)
        self.features = find_features(cloud, settings)
        self._features_of = (cloud, settings)

    def switch(self, number: int) -> None:
        """Close a hole or open it again, leave a ridge alone or follow it again, by its number among the features."""
        feature = self.features[number]
        named = switched_off(self.features, self.settings).get(number, ())
        places = getattr(self.settings, feature.kind)
        left = tuple(place for place in places if place not in named) if named else (*places, feature.place)
        self.set(f"{'hole' if feature.kind == 'fill_at' else 'ridge'} {number + 1}", **{feature.kind: left})

    def fix(self, places: tuple[tuple[float, ...], ...], words: str = "fixed node") -> None:
        """Take the positions that must become nodes, in the frame of the scan [scan unit]."""
        self.set(words, fixed=places)

    # ---- the structure

    def set_structure(self, **words: str) -> None:
        """Take what the page says of supports, section, material and loads.

        Raises
        ------
        InputError
            It names a file, which the page may not read, or cannot be used.
        """
        check_words(words)
        given: dict[str, Any] = dict(words)
        if "loads" in given:
            given["loads"] = loads_of_words(given["loads"])
        settings = self.state.structure_settings.replace(**given)
        if settings != self.state.structure_settings:
            self.change("structure", structure_settings=settings)

    def run_structure(self) -> None:
        """Make the structure of the grid and solve it."""

        def run(progress: Progress) -> None:
            progress("structure", 0.1)
            turn = self._turn
            solved = solved_state(self.state)
            if turn != self._turn or solved.grid is not self.grid:
                return
            self.change("run", solution=solved.solution, report=solved.report)
            self.save()

        self.worker.ask(run)

    # ---- designs, files

    def keep_design(self, name: str) -> None:
        """Keep the grid, and the figures of its structure, for comparison."""
        design = kept_design(self.state, name)
        others = tuple(each for each in self.state.designs if each.name != design.name)
        self.change(f"keep {design.name}", designs=(*others, design))
        self.save()
        self.tell()

    def drop_design(self, name: str) -> None:
        """Forget a design."""
        self.change(f"drop {name}", designs=tuple(each for each in self.state.designs if each.name != name))
        self.save()
        self.tell()

    def model(self, kind: str) -> Model:
        """Return the grid or the structure; see `outputs.model_to_show`."""
        return model_to_show(self.state, kind)

    def files(self, kind: str, suffix: str) -> dict[str, bytes]:
        """Return the files of a format by their names; see `outputs.files_of`."""
        return files_of(self.state, kind, suffix)

    def command(self) -> str:
        """Return the command lines that repeat the grid and the structure."""
        return command_of(self.state)

    def save(self) -> None:
        """Save the project, where there is a place for it: written beside it, then renamed."""
        with self._saving:
            if self.place is not None and self.cloud is not None:
                save_project(self.place, self.state)

    # ---- what the worker tells

    def _progress(self, stage: str, share: float) -> None:
        changed = stage != self.stage or abs(share - self.share) >= 0.02
        self.stage, self.share = stage, share
        if changed:
            self.tell()

    def _end(self, error: Exception | None) -> None:
        self.stage, self.share = "", 0.0
        self.message = "" if error is None else words_of(error)
        self.tell()
