"""The machine we run on."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor


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
    with ThreadPoolExecutor(parts) as pool:
        list(pool.map(work, range(parts), bounds[:-1], bounds[1:]))
