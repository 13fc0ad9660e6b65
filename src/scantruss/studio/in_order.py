"""What a person does on a page, taken in its order.

Viser calls functions side by side, so that a press may overtake what was typed before it.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any


class InOrder:
    """One thread that takes what happens on a page one after the other, as it comes."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "scantruss page")

    def __call__(self, take: Callable[[Any], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
        """Return what viser calls with an event, so that ``take(event)`` comes after those before it."""

        async def call(event: Any) -> None:  # viser awaits what is asynchronous, one event after the other
            self.add(take, event)

        return call

    def add(self, take: Callable[..., None], *what: Any) -> None:
        """Call ``take(*what)`` after all that has come; on a page that is closed nothing."""
        with contextlib.suppress(RuntimeError):  # closed
            self._thread.submit(_take, take, *what)

    def close(self) -> None:
        """Take what has come, and nothing more."""
        self._thread.shutdown()


def _take(take: Callable[..., None], *what: Any) -> None:
    try:
        take(*what)
    except Exception:  # the page goes on
        sys.excepthook(*sys.exc_info())
