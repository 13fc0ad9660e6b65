"""The machine we run on."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TypeVar

Result = TypeVar("Result")

UNKNOWN_MEMORY = 4e9  # bytes, where a machine tells nothing


def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_parts(count: int, least: int, work: Callable[[int, int, int], object], each: int = 1) -> None:
    """Call ``work(part, begin, end)`` for all of `count` items, in parts of at least `least` items side by side.

    The work must not depend on the parts. Kernels release the GIL, so threads do. There are `each` parts for a processor: several
    where some take longer than others.
    """
    parts = min(each * processors(), count // least)
    if parts < 2:
        work(0, 0, count)
        return
    bounds = [count * part // parts for part in range(parts + 1)]
    others = {part: _pool(processors() - 1).submit(work, part, *bounds[part : part + 2]) for part in range(1, parts)}
    try:
        work(0, 0, bounds[1])
        for part, other in others.items():
            if other.cancel():  # no thread has come to it
                work(part, *bounds[part : part + 2])
    finally:
        wait(other for other in others.values() if not other.cancel())
    for other in others.values():
        if not other.cancelled():
            other.result()


def alongside(work: Callable[[], Result]) -> Callable[[], Result]:
    """Begin some work on another processor, if one is free; return what waits for its result, or does it where nobody has begun.

    The result must not depend on when it is done; it is kept.
    """
    if processors() < 2:
        return cache(work)
    begun = _pool(processors() - 1).submit(work)
    return cache(lambda: work() if begun.cancel() else begun.result())


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    """Threads that are kept: starting some takes as long as many a kernel."""
    return ThreadPoolExecutor(threads, thread_name_prefix="scantruss")


if hasattr(os, "register_at_fork"):  # a forked process has none of the threads
    os.register_at_fork(after_in_child=_pool.cache_clear)


def available_memory() -> float:
    """Return how many bytes of memory this process may still take, as far as the machine tells."""
    found = [_meminfo(), _limit_of_group(), _limit_of_process()]
    return min((value for value in found if value is not None), default=UNKNOWN_MEMORY)


def _meminfo() -> float | None:
    """What the machine has left; where it does not tell, half of all that it has."""
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    with suppress(AttributeError, OSError, ValueError):
        return 0.5 * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None


def _limit_of_group() -> float | None:
    """What a container leaves us."""
    for limit, used in (
        ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ):
        with suppress(OSError, ValueError):  # the word "max" is no number
            return max(float(int(Path(limit).read_text())) - int(Path(used).read_text()), 0.0)
    return None


def _limit_of_process() -> float | None:
    """What `ulimit -v` leaves us."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            used = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()
            return max(float(limit - used), 0.0)
    return None
