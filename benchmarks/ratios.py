"""Two ways of doing the same, run in turn in one process tree: a ratio says more than seconds on a shared machine."""

from __future__ import annotations

import contextlib
import os
import platform
import statistics
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from time import perf_counter


@dataclass(frozen=True)
class Ratio:
    """Seconds of ours against seconds of the other way."""

    what: str
    ours: float  #: median [s]
    other: float  #: median [s]
    aim: float | None = None  #: the ratio should not be above this

    @property
    def ratio(self) -> float:
        return self.ours / self.other

    @property
    def lost(self) -> bool:
        """Whether the aim is missed; without an aim, whether ours is the slower."""
        return self.ratio > (1.0 if self.aim is None else self.aim)

    def row(self) -> str:
        aim = "" if self.aim is None else f"at most {self.aim:g}"
        return f"| {self.what} | {self.ours:.3g} | {self.other:.3g} | {self.ratio:.2f} | {aim} |"


HEADER = "| what | seconds | seconds of the other | ratio | aim |\n| --- | ---: | ---: | ---: | --- |"


def table(rows: list[Ratio]) -> str:
    """Return a table, what is lost first."""
    return "\n".join([HEADER, *(row.row() for row in sorted(rows, key=lambda row: not row.lost))])


def seconds(work: Callable[[], object]) -> float:
    """Return how long one call takes [s]."""
    started = perf_counter()
    work()
    return perf_counter() - started


def in_turn(
    what: str, ours: Callable[[], object], other: Callable[[], object], *, rounds: int, aim: float | None = None
) -> Ratio:
    """Return the ratio of the medians of both, run in turn so that a busy machine slows both alike."""
    pairs = [(seconds(ours), seconds(other)) for _ in range(rounds)]
    return Ratio(what, statistics.median(p[0] for p in pairs), statistics.median(p[1] for p in pairs), aim)


def machine(packages: Iterable[str] = ()) -> str:
    """Return cores and versions, no names; packages that are not there are left out."""
    known = []
    for name in dict.fromkeys(("numpy", "numba", "scipy", *packages)):
        with contextlib.suppress(PackageNotFoundError):
            known.append(f"{name} {version(name)}")
    system = f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}"
    return f"{os.cpu_count()} cores, {system}, {', '.join(known)}"
