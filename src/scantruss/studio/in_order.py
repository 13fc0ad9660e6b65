"""What a pointer does, taken in its order: viser calls functions side by side, so that the end of a drag may overtake its last move."""

from __future__ import annotations

import sys
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any


class InOrder:
    """One thread that takes the clicks and drags of a page one after the other, as they come."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "scantruss pointer")

    def __call__(self, take: Callable[[Any], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
        """Return what viser calls with an event, so that ``take(event)`` comes after those before it."""

        def take_event(event: Any) -> None:
            try:
                take(event)
            except Exception:  # the page goes on
                sys.excepthook(*sys.exc_info())

        async def call(event: Any) -> None:  # viser awaits what is asynchronous, one event after the other
            self._thread.submit(take_event, event)

        return call

    def close(self) -> None:
        """Take what has come, and nothing more."""
        self._thread.shutdown(wait=False)
