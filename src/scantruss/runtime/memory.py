"""How much memory this process may take, and work in which little is searched for what can be reclaimed."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

UNKNOWN_MEMORY = 4e9  # bytes, where a machine reports nothing
RARELY = 100_000  # objects more until a search for cycles among them


def available_memory() -> float:
    """Return how many bytes of memory this process may still take, as far as the machine reports it."""
    found = [_meminfo(), _limit_of_group(), _limit_of_process()]
    return min((value for value in found if value is not None), default=UNKNOWN_MEMORY)


@contextmanager
def nothing_collected() -> Iterator[None]:
    """Search for no cycles among objects meanwhile: of the many rows of a file none has any, and each search goes through all."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


@contextmanager
def made_before_set_aside() -> Iterator[None]:
    """Search only what is made meanwhile for cycles, and rarely: what was imported stays, as does most that a kernel is loaded with."""
    often = gc.get_threshold()
    if often[0] == RARELY:  # by a block around this one
        yield
        return
    gc.freeze()
    gc.set_threshold(RARELY)
    try:
        yield
    finally:
        gc.freeze()  # what was made meanwhile grows old, too: a search of the young ones would go through all of it
        gc.set_threshold(*often)
        gc.unfreeze()


def _meminfo() -> float | None:
    """What the machine has left; if it does not report that, half of all that it has."""
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
