"""Steps with the scan: open it, take a part of it, clean it."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..runtime.files import temporary_folder
from ..runtime.progress import Progress
from ..scan.cloud import PointCloud
from ..scan.member_length import length_range, suggest_length
from ..settings import Settings
from .grid_files import changes_of_grid, is_grid_file, refuse_grid_without_scan
from .opening import DATA_FOLDER, EXAMPLES, called, marks_of, next_free, read_whole
from .project import read_project
from .scan_parts import Cleaning, WholeScan, cleaning_of, part_of_scan, turned_scan
from .solving import solved_again
from .state import NO_GRID, StudioState
from .steps import Steps
from .support_places import for_new_scan

PLACED_SETTINGS = (
    "crop", "length_field", "rows_along", "boundary", "plain_at", "fill_at", "fixed", "fixed_lines", "line_names", "symmetry",
    "no_ridge_at",
)  # fmt: skip  #: those that name places or directions
LARGEST_UPLOAD = 500_000_000  #: of a scan that comes through the page [bytes]
TOO_LARGE = f"a scan of more than {LARGEST_UPLOAD:,} bytes; name it on the command line: scantruss studio SCAN"


class ScanSteps(Steps):
    """Steps with the scan."""

    def __init__(self, project: Path | None = None, *, folder: Path | None = None) -> None:
        super().__init__(project, folder=folder)
        self.proposal: Cleaning | None = None  #: a cleaning that is shown before it is done
        self._proposal_of: PointCloud | None = None

    @abstractmethod
    def _make(self, effort: str, progress: Progress, *, live: bool = False) -> None:
        """Make a grid."""

    @abstractmethod
    def _forget_features(self) -> None:
        """Forget what was found on the scan before."""

    @abstractmethod
    def show_quick(self) -> bool:
        """Make a quick grid of what was opened."""

    def open(self, path: Path) -> None:
        """Open a scan or a project.

        Raises
        ------
        ScanTrussError
            It cannot be read.
        """
        if path.suffix.lower() == ".scantruss":
            state, solved = read_project(path)
            self.begin(solved_again(state) if solved else state)
            return
        refuse_grid_without_scan(path)
        cloud = read_whole(path)
        self._start(WholeScan(cloud, *marks_of(path, cloud)))

    def _take_grid(self, name: str, path: Path) -> None:
        """Take a saved grid of the scan that is open."""
        turn = self._turn
        changes = changes_of_grid(self.state, path)
        with self._lock:
            if turn != self._turn:
                return
            self._turn += 1
            self.change(f"open {name}", **changes)
        self._forget_features()
        self.save()

    def open_upload(self, name: str, content: bytes) -> None:
        """Open a scan or a project that came through the page, as a step of the worker."""

        def read(progress: Progress) -> None:
            if len(content) > LARGEST_UPLOAD:
                raise InputError(TOO_LARGE)
            own = Path(name.replace("\\", "/")).name
            progress("read", 0.1)
            with temporary_folder() as folder, called(own, path := folder / (own or "scan")):
                path.write_bytes(content)
                if path.suffix.lower() == ".scantruss":
                    state, solved = read_project(path)
                    number, place = self._place_for(own)
                    self._open_state(f"open {own}", solved_again(state) if solved else state, number, place)
                    return
                if is_grid_file(path):
                    progress("certificate", 0.5)
                    self._take_grid(own, path)
                    return
                cloud = read_whole(path)
                classes, colors = marks_of(path, cloud)
            self._start(WholeScan(replace(cloud, name=own), classes, colors))
            self._make("quick", progress, live=True)

        self.worker.ask(read)

    def open_path(self, name: str) -> None:
        """Open a scan or a project of the folder of the project, as a step of the worker.

        Raises
        ------
        InputError
            It lies elsewhere, or nothing is there.
        """
        home = self.folder if self.place is None else self.place.parent
        if home is None or not name.strip():
            raise InputError("a path needs the name of a file in the folder of the project")
        home = home.resolve()
        path = (home / name.strip()).resolve()
        if not path.is_relative_to(home):
            raise InputError(f"only files within {home} are opened by path; open others with the button above")
        if not path.is_file():
            raise InputError(f"there is no file {name.strip()} in {home}")

        def read(progress: Progress) -> None:
            progress("read", 0.1)
            if path.suffix.lower() == ".scantruss":
                with called(name.strip(), path):
                    state, solved = read_project(path)
                taken = solved_again(state) if solved else state
                place = next_free(path, self.is_taken) if self.is_taken(path) else path
                self._open_state(f"open {path.name}", taken, max(self._places) + 1, place)
                return
            with called(name.strip(), path):
                if is_grid_file(path):
                    progress("certificate", 0.5)
                    self._take_grid(path.name, path)
                    return
                cloud = read_whole(path)
            self._start(WholeScan(cloud, *marks_of(path, cloud)))
            self._make("quick", progress, live=True)

        self.worker.ask(read)

    def open_example(self, name: str) -> None:
        """Open a bundled scan and make its quick grid, as a step of the worker."""
        file, settings = EXAMPLES[name]

        def read(progress: Progress) -> None:
            self._start(WholeScan(read_whole(DATA_FOLDER / file)), settings)
            self._make("quick", progress, live=True)

        self.worker.ask(read)

    def _start(self, whole: WholeScan, settings: Settings | None = None) -> None:
        cloud = whole.cloud
        made = settings or Settings(length=suggest_length(cloud), unit=cloud.unit)
        state = replace(
            self.state, whole=whole, cloud=cloud, cleaning=None, removed=None, tape=(), settings=made, unpainted=1.0,
            structure_settings=for_new_scan(self.state.structure_settings), solved_with=None, support_places=(), **NO_GRID,
        )  # fmt: skip
        number, place = self._place_for(cloud.name or "scan")
        self._open_state(f"open {cloud.name}", state, number, place)

    def _place_for(self, name: str) -> tuple[int, Path | None]:
        """Return the number of what is being opened and its project file: the given one, or one of its own beside it."""
        place, number = self.place, max(self._places) + 1
        if self.cloud is None and place is not None:  # the project that was named has no scan yet
            return self.state.opened, place
        folder = self.folder if place is None else place.parent
        if folder is None:
            return number, None
        wished = folder / f"{Path(name).stem}.scantruss"
        return number, next_free(wished) if wished.exists() else wished

    def _open_state(self, words: str, state: StudioState, number: int, place: Path | None) -> None:
        """Go on with a state that was opened."""
        self._places[number] = place
        self.change(words, **vars(state) | {"opened": number})
        self._turn += 1
        self._forget_features()
        self.save()

    def set_unit(self, unit: str) -> None:
        """Take the unit of the scan's coordinates; the grid of the scan without it is gone.

        Raises
        ------
        InputError
            There is no scan, or it is still being read.
        """
        cloud, whole = self.cloud, self.state.whole
        if cloud is None:
            raise InputError("there is no scan yet; open one")
        self.stop()
        self._turn += 1
        part = replace(cloud, unit=unit, system="")
        if whole is not None:
            whole = replace(whole, cloud=part if whole.cloud is cloud else replace(whole.cloud, unit=unit, system=""))
        self.change("unit", cloud=part, whole=whole, settings=self.settings.replace(unit=unit), **NO_GRID)
        self.save()
        self.show_quick()

    def turn(self, up: str) -> None:
        """Turn the scan so that an axis of its file points up; what was placed on it, cropped or made of it is gone.

        Raises
        ------
        InputError
            There is no scan.
        """
        whole, cleaning, removed = self.state.whole, self.state.cleaning, self.state.removed
        if whole is None:
            raise InputError("there is no scan yet; open one")
        if whole.up == up:
            return
        self.stop()
        self._turn += 1
        self._forget_features()
        whole, usual = turned_scan(whole, up), Settings(length=self.state.main_length)
        settings = self.settings.replace(
            length=usual.length, **{name: getattr(usual, name) for name in PLACED_SETTINGS}
        )
        if cleaning is not None:  # its crop is gone, and what it removed stays so
            removed = cleaning.removes if removed is None else cleaning.removes | removed
        self.change(
            f"up {up}", whole=whole, cloud=part_of_scan(whole, settings, None, removed), cleaning=None, removed=removed, tape=(),
            settings=settings, unpainted=1.0, structure_settings=for_new_scan(self.state.structure_settings), solved_with=None,
            support_places=(), **NO_GRID,
        )  # fmt: skip
        self.save()
        self.tell()
        self.show_quick()

    def length_bounds(self) -> tuple[float, float]:
        """Return the lengths that the slider offers: about the suggested one, within what the scan allows [scan unit]."""
        if self.cloud is None:
            return 0.5, 2.0
        low, high = length_range(self.cloud)
        wished = suggest_length(self.cloud)
        return max(low, wished / 3), max(low, min(high, wished * 3))

    # ---- a part of the scan

    def crop(self, words: tuple[str, ...]) -> None:
        """Take what lies in all of some parts of space, in the words of ``--crop``; none: all of it.

        A cleaning stays done where nothing is taken that it has not looked at.

        Raises
        ------
        InputError
            A part of space cannot be read, or no point lies in it.
        """
        cleaning, settings = self.state.cleaning, self.settings.replace(crop=words)
        kept = cleaning if cleaning is not None and set(cleaning.crop) <= set(settings.crop) else None
        said = ("crop" if words else "no crop") + (", not cleaned" if kept is not cleaning else "")
        self._take(said, settings, kept, self.state.removed)

    def choose_classes(self, classes: tuple[int, ...]) -> None:
        """Take the points of some classes; none: all of them."""
        held = () if self.state.whole is None else self.state.whole.held_classes
        if held and not set(classes) - set(held) and set(classes) != set(held):
            self._take("classes", self.settings.replace(classes=classes), None, self.state.removed)
        else:
            self._take("all classes", self.settings.replace(classes=()), None, self.state.removed)

    def propose_cleaning(self, outlier_distance: float, loose_pieces: float) -> None:
        """Look for points that a cleaning would remove, which are shown before they go."""
        cloud = self.cloud
        if cloud is None:
            raise InputError("there is no scan yet; open one")

        def look(progress: Progress) -> None:
            progress("clean", 0.1)
            self.proposal, self._proposal_of = cleaning_of(cloud, outlier_distance, loose_pieces), cloud

        self.worker.ask(look)

    def proposed(self) -> Cleaning | None:
        """Return the cleaning that is proposed of the present scan."""
        return self.proposal if self._proposal_of is self.cloud and self.cloud is not None else None

    def forget_cleaning(self) -> None:
        """Propose no cleaning."""
        self.proposal = self._proposal_of = None
        self.tell()

    def clean(self) -> None:
        """Remove the points that are proposed.

        Raises
        ------
        InputError
            None are, or the scan has been cleaned.
        """
        proposal = self.proposed()
        if proposal is None or self.state.whole is None:
            raise InputError("nothing is shown in red yet; press Show what goes")
        if self.state.cleaning is not None:
            raise InputError("the scan has been cleaned already; take that back with Undo to clean it otherwise")
        if not proposal.removes.any():
            raise InputError("nothing is red: there is nothing to clean")
        removes = self.state.taken()
        removes[removes] = proposal.removes
        self._take(
            "clean", self.settings, replace(proposal, removes=removes, crop=self.settings.crop), self.state.removed
        )

    def remove_points(self, goes: np.ndarray) -> None:
        """Remove some of the points that are taken (M,) bool.

        Raises
        ------
        InputError
            None are named, or none would be left.
        """
        if self.state.whole is None:
            raise InputError("there is no scan yet; open one")
        if not goes.any():
            raise InputError("no points are marked; press Mark and drag a rectangle with Shift held")
        removed = self.state.taken()
        removed[removed] = goes
        if self.state.removed is not None:
            removed |= self.state.removed
        self._take("remove points", self.settings, self.state.cleaning, removed)

    def restore_points(self) -> None:
        """Take the points again that were removed by hand."""
        self._take("restore points", self.settings, self.state.cleaning, None)

    def measure(self, ends: tuple[tuple[float, ...], ...]) -> None:
        """Lay the tape between two places in the frame of the scan; none: put it away."""
        if ends == self.state.tape:
            return
        self.change("tape", tape=ends)
        self.save()
        self.tell()

    def _take(self, words: str, settings: Settings, cleaning: Cleaning | None, removed: np.ndarray | None) -> None:
        """Take a part of the scan."""
        whole = self.state.whole
        if whole is None:
            raise InputError("there is no scan yet; open one")
        part = part_of_scan(whole, settings, cleaning, removed)
        self.stop()
        self._turn += 1
        self._forget_features()
        self.change(words, cloud=part, cleaning=cleaning, removed=removed, settings=settings, **NO_GRID)
        self.save()
        self.tell()
        self.show_quick()
