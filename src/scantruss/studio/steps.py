"""Steps: the state of a studio, what has led to it and who listens; no browser is needed."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import RLock
from time import monotonic
from typing import Any

from ..grid.grid import Grid
from ..scan.cloud import PointCloud
from ..settings import Settings
from ..structure.results import Solution
from .project import save_project
from .state import History, StudioState
from .worker import StoppedError, Worker, words_of


class Steps:
    """The state of a studio, changed by steps that can be taken back.

    Parameters
    ----------
    project : Path, optional
        File that is saved after each step.
    folder : Path, optional
        Where a scan that is opened gets a project file, if `project` is not given; none: nothing is saved.
    """

    def __init__(self, project: Path | None = None, *, folder: Path | None = None) -> None:
        self.folder = folder
        self.state = StudioState()
        self._places: dict[int, Path | None] = {self.state.opened: project}
        self.is_taken: Callable[[Path], bool] = lambda place: False  #: whether another browser saves a project there
        self.history = History()
        self.message = ""  #: why the last step was refused, in the words of the command line
        self.stage, self.share = "", 0.0
        self.began = 0.0  #: when what runs began, by the clock of `time.monotonic` [s]
        self.was_stopped = False  #: whether the last task was
        self.worker = Worker(self._end, self._progress)
        self._listeners: list[Callable[[], None]] = []
        self._turn = 0  # counts what makes the result of a running task unwanted
        self._lock, self._saving = RLock(), RLock()

    @property
    def place(self) -> Path | None:
        """The file in which the project is saved; None where it is not."""
        return self._places.get(self.state.opened)

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
            self._places = {state.opened: self.place}
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
        self._show_again()
        self.tell()

    def _show_again(self) -> None:
        """Make again what the page draws of a state and its record does not hold."""

    def stop(self) -> None:
        """Stop what runs; what was there before it stays."""
        self.worker.stop()
        self.tell()

    def save(self) -> None:
        """Save the project, where there is a place for it: written beside it, then renamed."""
        with self._saving:
            if self.place is not None and self.cloud is not None:
                save_project(self.place, self.state)

    # ---- what the worker tells

    def _progress(self, stage: str, share: float) -> None:
        changed = stage != self.stage or abs(share - self.share) >= 0.02
        if not self.stage:
            self.began = monotonic()
        self.stage, self.share, self.was_stopped = stage, share, False
        if changed:
            self.tell()

    def _end(self, error: Exception | None) -> None:
        self.stage, self.share, self.was_stopped = "", 0.0, self.worker.is_stopping
        self.message = "" if error is None else words_of(error)
        self.tell()
