"""One thread for BLAS: for matrices of some hundred rows several cost more than they save, the more so on a busy machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import RLock
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


@cache
def _libraries() -> ThreadpoolController:
    """The libraries that numpy and scipy have loaded; found once, as it takes milliseconds."""
    from threadpoolctl import ThreadpoolController  # which most grids do not load

    return ThreadpoolController()


@cache
def _turn() -> Any:
    """Held by who has the one thread: the limit is of the whole process, and must not end while another needs it."""
    return RLock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let BLAS use one thread within; others that ask for it wait meanwhile."""
    with _turn(), _libraries().limit(limits=1, user_api="blas"):
        yield


if hasattr(os, "register_at_fork"):  # a forked process has none of the threads that may hold it
    os.register_at_fork(after_in_child=_turn.cache_clear)
