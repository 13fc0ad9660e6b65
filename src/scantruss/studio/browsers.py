"""One session for each browser, so that two browsers on one server do not mix."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from pathlib import Path
from threading import RLock

from ..errors import InputError
from .opening import next_free
from .session import Session

MOST_BROWSERS = 16  #: on one server


class Browsers:
    """Knows which browser works in which session, by a key that only the browser has.

    Parameters
    ----------
    first : Session
        What the command line opened: it belongs to the first browser, and later to the next one that comes while nobody has it
        open. Each other browser gets a session of its own that begins with the same scan.
    """

    def __init__(self, first: Session) -> None:
        self._first, self._begun, self._place, self._lock = first, first.state, first.place, RLock()
        self._sessions: dict[str, Session] = {}
        self._open: dict[str, int] = {}  # pages that each browser has open
        self._taken = {first.place}
        first.is_taken = self._saved_by_others(first)

    def join(self, key: str | None) -> tuple[str, Session]:
        """Return the key and the session of a browser that has opened a page.

        Parameters
        ----------
        key : str, optional
            What the browser was given before; one that this server did not give out counts for nothing.

        Raises
        ------
        InputError
            Too many browsers are open.
        """
        with self._lock:
            if key is None or key not in self._sessions:
                key = secrets.token_urlsafe(16)
                self._sessions[key] = self._new()
            self._open[key] = self._open.get(key, 0) + 1
            return key, self._sessions[key]

    def leave(self, key: str) -> None:
        """Note that a browser has closed a page; its session stays, for it may come back."""
        with self._lock:
            self._open[key] = max(self._open.get(key, 0) - 1, 0)

    def stop(self) -> None:
        """Stop all that runs."""
        for session in {id(each): each for each in (self._first, *self._sessions.values())}.values():
            session.stop()

    def _new(self) -> Session:
        holders = [key for key, session in self._sessions.items() if session is self._first]
        if not any(self._open.get(key) for key in holders):
            for key in holders:
                del self._sessions[key]
            return self._first
        if sum(count > 0 for count in self._open.values()) >= MOST_BROWSERS:
            raise InputError(f"{MOST_BROWSERS} browsers have this studio open, which are the most; close one")
        place = None if self._place is None else self._free(self._place)
        session = Session(place, folder=self._first.folder)
        session.is_taken = self._saved_by_others(session)
        session.begin(self._begun)
        session.show_quick()
        return session

    def _saved_by_others(self, own: Session) -> Callable[[Path], bool]:
        """Return what tells whether a browser but this one saves a project in a place."""

        def is_taken(place: Path) -> bool:
            others = {id(each): each for each in (self._first, *self._sessions.values()) if each is not own}
            return any(each.place is not None and each.place.resolve() == place.resolve() for each in others.values())

        return is_taken

    def _free(self, place: Path) -> Path:
        """Return the next name beside a project that nobody has."""
        found = next_free(place, lambda other: other in self._taken)
        self._taken.add(found)
        return found
