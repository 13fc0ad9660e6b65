"""What the controls of a page call: one step after the other, as a person takes them, and what was typed before what is pressed."""

from __future__ import annotations

import sys
from abc import abstractmethod
from collections.abc import Callable, Coroutine
from threading import Thread
from typing import Any

from ..errors import ScanTrussError
from .in_order import InOrder
from .session import Session
from .typed_fields import TypedFields
from .worker import words_of

Act = Callable[[], None]
Call = Callable[[Any], Coroutine[Any, Any, None]]
"""What viser calls with an event, and awaits."""


class Presses:
    """Takes steps of a session from the controls of one page; what the server writes into a control calls none."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.in_order = InOrder()
        self._typed = TypedFields(self.in_order, self.do)
        self._sliding: list[Act] = []  # steps of sliders that are still to come

    @abstractmethod
    def update(self) -> None:
        """Show what the session holds."""

    def close(self) -> None:
        """Take no more."""
        self.in_order.close()

    # ---- what controls call

    def step(self, step: Act) -> Call:
        """Return what a control calls to take a step, after what was just typed."""
        return self.chosen(lambda _: step())

    def chosen(self, take: Callable[[Any], None]) -> Call:
        """Return what a control calls, so that ``take(value)`` gets the value that it had when it was pressed."""

        async def call(event: Any) -> None:
            if event.client is not None:
                self.in_order.add(self._take, take, getattr(event.target, "value", None))

        return call

    def slid(self, step: Act) -> Call:
        """Return what a slider calls: of values that come faster than steps are taken, the newest counts."""

        def take() -> None:
            self._sliding.remove(step)
            self._take(lambda _: step(), None)

        async def call(event: Any) -> None:
            if event.client is not None and step not in self._sliding:
                self._sliding.append(step)
                self.in_order.add(take)

        return call

    def aside(self, step: Act) -> Call:
        """Return what a control calls to take a step that lasts, while others go on."""

        def begin() -> None:
            Thread(target=self.do, args=(step,), name="scantruss aside", daemon=True).start()

        return self.step(begin)

    def typed(self, field: Any, step: Act) -> None:
        """Take a step when no more is typed into a text field."""
        self._typed.on_typed(field, step)

    def corrects(self, *fields: Any) -> None:
        """Say no more what was refused once somebody has typed into one of some fields, of which a press takes the text."""
        for each in fields:
            self.typed(each, lambda: None)

    def show_text(self, field: Any, text: str) -> None:
        """Write a text into a field, unless somebody is typing there."""
        self._typed.show(field, text)

    # ---- steps

    def _take(self, take: Callable[[Any], None], value: Any) -> None:
        if self._typed.take():
            self.do(lambda: take(value))

    def do(self, step: Act) -> bool:
        """Take a step; what is refused is said on the page. Return whether it was taken."""
        refused = False
        try:
            step()
        except Exception as error:  # the page goes on
            if not isinstance(error, ScanTrussError):
                sys.excepthook(*sys.exc_info())
            self.session.message, refused = words_of(error), True
        else:
            self.session.message = "" if not self.session.stage else self.session.message
        self.update()
        return not refused

    def do_quietly(self, step: Act) -> None:
        """Take a step of which there are many a second; what is refused is said on the page."""
        try:
            step()
        except Exception as error:  # the page goes on
            self.session.message = words_of(error)
            self.update()
