"""Text fields of a page: what is typed counts after a pause, or before the next press, and nothing writes over it meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from threading import RLock, Timer
from typing import Any

from .in_order import InOrder

TYPING_PAUSE = 0.6  #: after which what was typed counts [s]


class TypedFields:
    """Knows which fields have text that waits.

    Parameters
    ----------
    in_order : InOrder
        Of the page.
    do : callable
        ``do(step)`` takes a step; whether it was not refused.
    """

    def __init__(self, in_order: InOrder, do: Callable[[Callable[[], None]], bool]) -> None:
        self._in_order, self._do = in_order, do
        self._waiting: dict[int, tuple[Callable[[], None], Timer]] = {}  # by the field, which has no hash of its own
        self._lock = RLock()

    def on_typed(self, field: Any, step: Callable[[], None]) -> None:
        """Take a step when no more is typed into a field; what the server writes there calls nothing."""

        async def note(event: Any) -> None:  # at once, for a press may follow
            if event.client is None:
                return
            timer = Timer(TYPING_PAUSE, self._in_order.add, (self.take, field))
            timer.daemon = True
            with self._lock:
                if (before := self._waiting.get(id(field))) is not None:
                    before[1].cancel()
                self._waiting[id(field)] = step, timer
            timer.start()

        field.on_update(note)

    def take(self, *fields: Any) -> bool:
        """Take the steps of what was typed into fields, of all where none are named; whether none was refused."""
        with self._lock:
            named = [id(each) for each in fields] if fields else list(self._waiting)
        return all([self._take_one(each) for each in named])

    def _take_one(self, field: int) -> bool:
        """Take the step of one field, while what was typed into others waits, so that nothing writes over it."""
        with self._lock:
            step, timer = self._waiting.pop(field, (None, None))
        if step is None or timer is None:
            return True
        timer.cancel()
        return self._do(step)

    def show(self, field: Any, text: str) -> None:
        """Write a text into a field, unless something that was typed there waits."""
        with self._lock:
            if id(field) not in self._waiting:
                field.value = text
