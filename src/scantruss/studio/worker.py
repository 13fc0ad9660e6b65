"""One thread that does what is asked for: the newest request wins, and what runs can be stopped."""

from __future__ import annotations

import sys
from collections.abc import Callable
from threading import Condition, Thread
from typing import NamedTuple

from ..errors import ScanTrussError, words_of_error
from ..runtime.progress import Progress
from .page_words import in_words_of_page

Task = Callable[[Progress], None]


class StoppedError(Exception):
    """Raised within a task that was stopped or overtaken."""


class _Asked(NamedTuple):
    """A task that was asked for."""

    do: Task
    quick: bool
    then: bool


class Worker:
    """Runs one task at a time, the newest that waits; `quick` ones give way to any other.

    Parameters
    ----------
    tell : callable
        ``tell(error)`` after every task: None where it was done or stopped.
    progress : callable
        ``progress(stage, share)`` while a task runs.
    """

    def __init__(self, tell: Callable[[Exception | None], None], progress: Progress) -> None:
        self._tell, self._progress = tell, progress
        self._waiting: list[_Asked] = []
        self._running: _Asked | None = None
        self._stop = False
        self._change = Condition()
        self._thread: Thread | None = None

    def ask(self, task: Task, *, quick: bool = False, then: bool = False) -> bool:
        """Do a task as soon as may be, in place of what waits; whether it is taken.

        Parameters
        ----------
        quick : bool
            It is not taken while a task that is not quick waits, or runs and has not been stopped. One that runs comes to its end: of many
            that are asked for one after the other, some are seen.
        then : bool
            It goes on with what waits and runs, which comes to its end first; where that is refused it is forgotten.
        """
        with self._change:
            running = None if self._stop else self._running
            if quick and not all(one is None or one.quick for one in (running, *self._waiting)):
                return False
            self._waiting = [*(self._waiting if then else ()), _Asked(task, quick, then)]
            self._stop = self._stop or not (then or quick)
            if self._thread is None:
                self._thread = Thread(target=self._serve, name="scantruss studio", daemon=True)
                self._thread.start()
            self._change.notify_all()
        return True

    def stop(self) -> None:
        """Stop what runs and forget what waits."""
        with self._change:
            self._waiting, self._stop = [], True

    def wait(self, seconds: float) -> bool:
        """Wait until nothing runs or waits; whether that is so."""
        with self._change:
            return self._change.wait_for(lambda: self._running is None and not self._waiting, seconds)

    def _heard(self, stage: str, share: float) -> None:
        if self._stop:
            raise StoppedError
        self._progress(stage, share)

    def _serve(self) -> None:
        while True:  # in a daemon thread: it ends with the process
            with self._change:
                self._change.wait_for(lambda: bool(self._waiting))
                self._running, self._stop = self._waiting.pop(0), False
                task = self._running.do
            fault: Exception | None = None
            try:
                task(self._heard)
            except StoppedError:
                pass
            except Exception as error:  # a crash of a run leaves the studio alive; it is shown
                fault = error
            try:
                self._tell(fault)
            except Exception:  # of the page; the worker goes on
                sys.excepthook(*sys.exc_info())
            with self._change:
                self._running = None
                if fault is not None:
                    self._waiting = [each for each in self._waiting if not each.then]
                self._change.notify_all()


def words_of(error: Exception) -> str:
    """Return an error in the words of the page, which are those of the command line but for names of options."""
    if isinstance(error, ScanTrussError):
        return in_words_of_page(" ".join(words_of_error(error).split()))
    if isinstance(error, MemoryError):
        return "not enough memory; use fewer points or a larger length"
    if isinstance(error, OSError):
        return str(error.strerror or error)
    return f"a bug in ScanTruss, {type(error).__name__}: {error}; the studio goes on"
