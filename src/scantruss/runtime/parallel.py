"""The machine we run on."""

from __future__ import annotations

import atexit
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import cache, partial
from queue import SimpleQueue
from threading import Thread
from typing import Any, TypeVar

Result = TypeVar("Result")
Share = TypeVar("Share")


@cache
def processors() -> int:
    """Return how many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def in_parts(count: int, least: int, work: Callable[[int, int, int], object], each: int = 1) -> None:
    """Call ``work(part, begin, end)`` for all of `count` items, in parts of at least `least` items side by side.

    The work must not depend on the parts. Kernels release the GIL, so threads do. There are `each` parts for a processor: several
    where some take longer than others. Who asks does the parts that no thread has come to.
    """
    parts = min(each * processors(), count // least)
    if parts < 2:
        work(0, 0, count)
        return
    bounds = [count * part // parts for part in range(parts + 1)]
    takers: dict[int, object] = {}
    done: SimpleQueue[BaseException | None] = SimpleQueue()

    def help_out() -> None:
        for part in _taken(takers, parts, object()):
            try:
                work(part, bounds[part], bounds[part + 1])
                done.put(None)
            except BaseException as error:
                done.put(error)

    for _ in range(min(parts, processors()) - 1):
        _pool(processors() - 1).put(help_out)
    own = object()
    try:
        for part in _taken(takers, parts, own):
            work(part, bounds[part], bounds[part + 1])
    finally:  # after an error: what nobody has begun is left
        errors = [done.get() for part in range(parts) if takers.setdefault(part, own) is not own]
    for error in errors:
        if error is not None:
            raise error


def run_in_parts(count: int, least: int, kernel: Callable[..., object], *arguments: Any) -> None:
    """Call ``kernel(*arguments, begin, end)`` for all of `count` items, in parts of at least `least` items side by side."""
    in_parts(count, least, lambda _, begin, end: kernel(*arguments, begin, end))


def _taken(takers: dict[int, object], parts: int, taker: object) -> Iterator[int]:
    """Parts that nobody has taken yet; each is the taker's from then on."""
    return (part for part in range(parts) if takers.setdefault(part, taker) is taker)


def two_at_once(work: Callable[[Share], Result], shares: Sequence[Share]) -> list[Result]:
    """Return what the work returns for each share: the first two are done side by side, then the rest, which may see what both did."""
    results: dict[int, Result] = {}

    def part(_: int, begin: int, end: int) -> None:
        results.update((k, work(shares[k])) for k in range(begin, end))

    side_by_side = min(2, len(shares))
    in_parts(side_by_side, 1, part)
    part(0, side_by_side, len(shares))
    return [results[k] for k in range(len(shares))]


def side_by_side(*works: Callable[[], Any]) -> tuple[Any, ...]:
    """Return what each of a few independent works returns; they run side by side where processors are free."""
    results: dict[int, Any] = {}

    def part(_: int, begin: int, end: int) -> None:
        results.update((k, works[k]()) for k in range(begin, end))

    in_parts(len(works), 1, part, len(works))
    return tuple(results[k] for k in range(len(works)))


def threaded_map(
    work: Callable[[Share], Result], jobs: Sequence[Share], report: Callable[[float], None] | None
) -> list[Result]:
    """Return what the work returns for each job, in their order, with a thread for each processor.

    For long jobs that use the threads of `in_parts` themselves. The share of the jobs that is done is reported; after an error no
    further job begins.
    """
    done = []
    workers = min(processors(), len(jobs))
    with ExitStack() as stack:
        results: Iterable[Result]
        if workers < 2:
            results = map(work, jobs)
        else:
            pool = stack.enter_context(ThreadPoolExecutor(workers))
            futures = [pool.submit(partial(work, job)) for job in jobs]
            stack.callback(lambda: [future.cancel() for future in futures])
            results = (future.result() for future in futures)
        for count, result in enumerate(results, 1):
            done.append(result)
            if report:
                report(count / len(jobs))
    return done


@cache
def _pool(threads: int) -> SimpleQueue[Callable[[], object]]:
    """Threads that are kept, as starting some takes as long as many a kernel, and do what is put here."""
    jobs: SimpleQueue[Callable[[], object]] = SimpleQueue()

    def serve() -> None:
        while True:
            jobs.get()()

    begun = [Thread(target=serve, name="scantruss", daemon=True) for _ in range(threads)]
    for thread in begun:
        thread.start()

    def end() -> None:
        for _ in begun:
            jobs.put(sys.exit)  # which ends the thread that does it
        for thread in begun:
            thread.join()

    atexit.register(end)
    return jobs


if hasattr(os, "register_at_fork"):  # a forked process has none of the threads
    os.register_at_fork(after_in_child=_pool.cache_clear)
