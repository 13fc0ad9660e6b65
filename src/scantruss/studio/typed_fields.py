"""Text fields of a page: what is typed counts after a pause, or before the next press, and nothing writes over it meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from threading import RLock, Timer
from time import monotonic
from typing import Any, NamedTuple

from .in_order import InOrder

TYPING_PAUSE = 0.6  #: after which what was typed counts [s]
ON_THE_WAY = 2.0  #: for which what was written may still be on its way to a busy page [s]


class _Typed(NamedTuple):
    """What was typed into a field and waits."""

    field: Any
    text: str
    step: Callable[[], None]
    timer: Timer
    is_crossed: bool  #: whether the page may have got meanwhile what was written before


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
        self._waiting: dict[int, _Typed] = {}  # by the field, which has no hash of its own
        self._written: dict[int, float] = {}  # when, likewise [s]
        self._lock = RLock()

    def on_typed(self, field: Any, step: Callable[[], None]) -> None:
        """Take a step when no more is typed into a field; what the server writes there calls nothing."""

        async def note(event: Any) -> None:  # at once, for a press may follow
            if event.client is None:
                return
            text = field.value  # before the lock: whoever writes meanwhile holds it
            timer = Timer(TYPING_PAUSE, self._in_order.add, (self.take, field))
            timer.daemon = True
            with self._lock:
                if (before := self._waiting.get(id(field))) is not None:
                    before.timer.cancel()
                is_crossed = monotonic() - self._written.get(id(field), -ON_THE_WAY) < ON_THE_WAY
                self._waiting[id(field)] = _Typed(field, text, step, timer, is_crossed)
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
            typed = self._waiting.get(field)
            if typed is None:
                return True
            typed.timer.cancel()
            if typed.is_crossed:  # the page gets its own text back
                typed.field.value = ""
            typed.field.value = typed.text
        return self._do(lambda: self._count(typed))

    def _count(self, typed: _Typed) -> None:
        """Take the step of what was typed, which waits until it is taken."""
        try:
            typed.step()
        finally:
            with self._lock:
                if self._waiting.get(id(typed.field)) is typed:  # else more has been typed meanwhile
                    del self._waiting[id(typed.field)]

    def show(self, field: Any, text: str) -> None:
        """Write a text into a field, unless something that was typed there waits."""
        with self._lock:
            if id(field) not in self._waiting and field.value != text:
                self._written[id(field)] = monotonic()
                field.value = text
