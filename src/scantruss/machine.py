"""The machine we run on."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_parts(count: int, least: int, work: Callable[[int, int, int], object]) -> None:
    """Call ``work(part, begin, end)`` for all of `count` items, in parts of at least `least` items side by side.

    The work must not depend on the parts. Kernels release the GIL, so threads do.
    """
    parts = min(processors(), count // least)
    if parts < 2:
        work(0, 0, count)
        return
    bounds = [count * part // parts for part in range(parts + 1)]
    others = [_pool(parts - 1).submit(work, part, bounds[part], bounds[part + 1]) for part in range(1, parts)]
    try:
        work(0, 0, bounds[1])
    finally:
        wait(others)
    for other in others:
        other.result()


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Threads that are kept: starting some takes as long as many a kernel. Their work asks for no parts, or they would wait."""
    return ThreadPoolExecutor(threads, thread_name_prefix="scantruss")


if hasattr(os, "register_at_fork"):  # a forked process has none of the threads
    os.register_at_fork(after_in_child=_pool.cache_clear)
