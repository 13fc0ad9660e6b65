"""One thread for BLAS: for matrices of some hundred rows several cost more than they save, the more so on a busy machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import Any

from threadpoolctl import ThreadpoolController


class _Users:
    """Who asks for one thread at this moment; the limit is of the whole process."""

    def __init__(self) -> None:
        self.lock, self.count = Lock(), 0
        self.limit: Any = None


_USERS = _Users()


@cache
def _libraries() -> ThreadpoolController:
    """The libraries that numpy and scipy have loaded; found once, as it takes milliseconds."""
    return ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS use one thread within; as many as before once the last user is done."""
    with _USERS.lock:
        _USERS.count += 1
        if _USERS.count == 1:
            _USERS.limit = _libraries().limit(limits=1, user_api="blas")
    try:
        yield
    finally:
        with _USERS.lock:
            _USERS.count -= 1
            if _USERS.count == 0:
                _USERS.limit.restore_original_limits()
