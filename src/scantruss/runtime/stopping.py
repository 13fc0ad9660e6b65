"""Ctrl-C and SIGTERM end a command within `SECONDS_TO_END` and leave nothing half-written, whatever it is in the middle of.

Python tells the main thread of a signal only between two of its own steps. Most work comes back to it in time and ends in order.
Where it does not, in a long kernel, in a library that waits or swallows the interruption, in threads that are still joined, a
watch cleans up in its place and ends the process.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from types import FrameType

SECONDS_TO_END = 0.5  # time in which the main thread may end by itself [s]
SIGNAL_STATUS: dict[int, int] = {signal.SIGINT: 130, signal.SIGTERM: 143}
SIGNAL_WORDS: dict[int, str] = {signal.SIGINT: "interrupted", signal.SIGTERM: "stopped"}


class Stopped(KeyboardInterrupt):
    """The process was asked to end."""


class _State:
    """What is known of this process."""

    asked: int | None = None  #: the first signal that asked it to end
    printed = False  #: whether the line that says why it ends is printed
    written = False  #: results have been put into place
    moving = threading.RLock()  #: held while results are put into place


_clean_ups: list[Callable[[], None]] = []


def asked() -> int | None:
    """Return the signal that asked this command to end, if one did."""
    return _State.asked


def note_printed() -> None:
    """Note that the one line is out that says why a command ends; the watch writes none then."""
    _State.printed = True


def words_of_stop(number: int) -> str:
    """Return what to say of an end by a signal."""
    what = "what was written is whole" if _State.written else "nothing was written"
    return f"{SIGNAL_WORDS[number]}; {what}"


@contextmanager
def signals_heard() -> Iterator[None]:
    """Raise `Stopped` on the first signal to end, for as long as a command runs; then remove what it left half-written."""
    _State.asked, _State.printed, _State.written = None, False, False
    with ExitStack() as stack:
        stack.callback(setattr, sys, "unraisablehook", sys.unraisablehook)
        sys.unraisablehook = partial(_say_unless_asked, sys.unraisablehook)
        for number in SIGNAL_STATUS:
            if callable(kept := signal.getsignal(number)) or kept == signal.SIG_DFL:
                with suppress(ValueError):  # only the main thread may
                    signal.signal(number, _raise_once)
                    stack.callback(signal.signal, number, kept)
        try:
            yield
        finally:
            with signals_held():
                clean_up()


def _say_unless_asked(say: Callable[[sys.UnraisableHookArgs], object], lost: sys.UnraisableHookArgs) -> None:
    """Say what went wrong where nothing can be raised, but not once the process was asked to end.

    Then it is `Stopped` itself, and the watch ends the process, or an object that the stop left half-made and that cannot be
    taken down, as LLVM's.
    """
    if _State.asked is None:
        say(lost)


def _raise_once(number: int, frame: FrameType | None) -> None:
    if _State.asked is None:
        _State.asked = number
        raise Stopped


@contextmanager
def signals_held() -> Iterator[None]:
    """Hold signals to end back until the block is done; processes started in it never receive Ctrl-C."""
    came: list[int] = []
    with ExitStack() as stack:
        stack.callback(_raise_all, came)
        if threading.current_thread() is threading.main_thread():
            for number in SIGNAL_STATUS:
                if callable(kept := signal.getsignal(number)):
                    signal.signal(number, lambda number, frame: came.append(number))
                    stack.callback(signal.signal, number, kept)
        if hasattr(signal, "pthread_sigmask"):  # processes and threads inherit the mask
            stack.callback(signal.pthread_sigmask, signal.SIG_SETMASK, signal.pthread_sigmask(signal.SIG_BLOCK, []))
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield


def _raise_all(numbers: list[int]) -> None:
    for number in numbers:
        signal.raise_signal(number)


@contextmanager
def put_into_place() -> Iterator[None]:
    """Move results into place: all of them, or none, whatever asks the process to end meanwhile."""
    with signals_held(), _State.moving:
        yield
        _State.written = True


def left_behind(clean: Callable[[], None]) -> None:
    """Have something half-written removed at the end of the command, until `is_clean` says that it is gone."""
    _clean_ups.append(clean)


def is_clean(clean: Callable[[], None]) -> None:
    """Forget what is no longer there."""
    with suppress(ValueError):
        _clean_ups.remove(clean)


def clean_up() -> None:
    """Remove all that is half-written."""
    for clean in reversed(_clean_ups.copy()):
        clean()
        is_clean(clean)


def watch() -> None:
    """End this process `SECONDS_TO_END` after it was asked to, where it has not ended by itself."""
    ear, mouth = socket.socketpair()
    mouth.setblocking(False)
    signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=_end_late, args=(ear, mouth), name="scantruss stops", daemon=True).start()


def leave_to_watch() -> None:
    """Have the watch alone hear of signals from now on, while the process ends."""
    for number in SIGNAL_STATUS:
        if callable(signal.getsignal(number)):
            signal.signal(number, lambda number, frame: None)


def _end_late(ear: socket.socket, mouth: socket.socket) -> None:
    number = _next_signal(ear)
    threading.Event().wait(SECONDS_TO_END)
    with _State.moving:
        for clean in reversed(_clean_ups.copy()):
            with suppress(Exception):
                clean()
        if not _State.printed:
            os.write(2, f"scantruss: {words_of_stop(number)}\n".encode())
        os._exit(SIGNAL_STATUS[number])


def _next_signal(ear: socket.socket) -> int:
    """Wait for a signal to end; other signals send bytes too."""
    while (number := ear.recv(1)[0]) not in SIGNAL_STATUS:
        pass
    return number
