"""Speed as ratios of one run: against the neighbour search, its growth, the memory, the command, the first run ever."""

from __future__ import annotations

import math
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from shapes import Shape, make

import scantruss as st
from scantruss.runtime.jit import INSTALLED_FOLDER

from .page import Section
from .peers.child import neighbour_search
from .peers.runs import run_child
from .ratios import Ratio, in_turn, seconds, table

SHAPE = "scallop"
LENGTH = 3.2  #: about 1,000 nodes on the scallop [mm]
IMPORTS = (sys.executable, "-c", "import numpy, scipy.spatial, numba")
SIZES = (  # points, nodes, effort, rounds, at most so many neighbour searches
    (100_000, 1_000, "quick", 15, 0.5),
    (100_000, 1_000, "normal", 15, 1.0),
    (1_000_000, 1_000, "normal", 5, 0.06),
    (10_000_000, 1_000, "normal", 2, 0.03),
    (1_000_000, 10_000, "normal", 3, 0.5),
)
GROWTH_POINTS, GROWTH_NODES = (100_000, 1_000_000, 10_000_000), (1_000, 10_000, 100_000)
JOB_FILES = {"points": "points.npy", "grid": "grid.npz", "answer": "answer.json", "log": "log.txt"}
NOTE = """\
The scallop, its points in memory, the whole call to the final grid, warm. Neighbour search: scipy's cKDTree built on the same
points and asked for 16 neighbours of each by two threads. Both sides in turn, medians. The cloud's own share of a time over
the nodes: its stages read and boundary with the fewest nodes. Exponents: least squares over logarithms. Memory: what points
and work together add to a process of their own at its peak, over the bytes of the points (24 each), so 1 is the points alone.
First runs: nothing is stored in the user's folder. Installing the package compiles the kernels of the usual commands, which takes
somewhat longer than a first run that compiles all. Such a run is met where the processor, Python or numba is another than when it
was installed, or the kernels were edited."""


@lru_cache(maxsize=2)
def scallop(points: int) -> Shape:
    return make(SHAPE, points)


def length_for(shape: Shape, nodes: int) -> float:
    """Return the member that gives about so many nodes."""
    return math.sqrt(2 * shape.area / (math.sqrt(3) * nodes))


def command(*arguments: str, cache: Path | None = None, installed: bool = True) -> None:
    """Run the scantruss command of this Python, quietly; `cache` is where its machine code is kept, but for what was installed."""
    environment = dict(os.environ, SCANTRUSS_INSTALLED=str(int(installed)))
    if cache:
        environment["NUMBA_CACHE_DIR"] = str(cache)
    run = [sys.executable, "-m", "scantruss", *arguments]
    subprocess.run(run, check=True, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def warm_run(points: int, nodes: int, effort: str, rounds: int, aim: float) -> Ratio:
    """Return the whole run on points in memory against the neighbour search."""
    shape = scallop(points)
    settings = st.Settings(length=length_for(shape, nodes), effort=effort)
    if points <= 1_000_000:
        st.grid_from_points(
            shape.points, settings
        )  # compiles, or loads what was compiled; warm already for the largest
    what = f"{points:,} points, about {nodes:,} nodes, {effort} / neighbour search"
    return in_turn(
        what,
        lambda: st.grid_from_points(shape.points, settings),
        lambda: neighbour_search(shape.points),
        rounds=rounds,
        aim=aim,
    )


def more_effort(rounds: int, effort: str, aim: float) -> Ratio:
    """Return the whole run with an effort against the quick one."""
    points = scallop(100_000).points
    quick, more = (st.Settings(length=LENGTH, effort=name) for name in ("quick", effort))
    return in_turn(
        f"100,000 points: effort {effort} / effort quick",
        lambda: st.grid_from_points(points, more),
        lambda: st.grid_from_points(points, quick),
        rounds=rounds,
        aim=aim,
    )


def in_shell(rounds: int) -> list[Ratio]:
    """Return the command's own cost and its help, both against the import of what the work needs."""
    points, settings = scallop(100_000).points, st.Settings(length=LENGTH)
    with tempfile.TemporaryDirectory() as name:
        scan = Path(name) / "scan.npy"
        np.save(scan, points)
        grid = ("grid", str(scan), str(Path(name) / "grid.obj"), "--length", str(LENGTH))
        times = []
        for _ in range(rounds):
            shell, run = seconds(lambda: command(*grid)), seconds(lambda: st.grid_from_points(points, settings))
            times.append((shell - run, seconds(lambda: subprocess.run(IMPORTS, check=True))))
    more, imports = (statistics.median(column) for column in zip(*times, strict=True))
    words = "`python -c 'import numpy, scipy.spatial, numba'`"
    return [
        Ratio(f"`scantruss grid` of 100,000 points, warm, more than the run itself / {words}", more, imports, 2.0),
        in_turn(
            f"`scantruss --help` / {words}",
            lambda: command("--help"),
            lambda: subprocess.run(IMPORTS, check=True),
            rounds=rounds,
            aim=0.25,
        ),
    ]


def first_runs(rounds: int) -> list[Ratio]:
    """Return the command's first run ever against the same command warm: as installed, and where it compiles all by itself."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scan = folder / "scan.npy"
        np.save(scan, scallop(100_000).points)
        grid = ("grid", str(scan), str(folder / "grid.obj"), "--length", str(LENGTH))

        def against_warm(what: str, installed: bool) -> Ratio:
            warm, fresh = folder / f"warm{installed}", iter(range(rounds))
            command(*grid, cache=warm, installed=installed)
            return in_turn(
                f"{what} / the same command warm",
                lambda: command(*grid, cache=folder / f"cold{installed}{next(fresh)}", installed=installed),
                lambda: command(*grid, cache=warm, installed=installed),
                rounds=rounds,
                aim=8.0,
            )

        found = (
            "installed with its machine code" if INSTALLED_FOLDER else "installed without machine code of these kernels"
        )
        return [
            against_warm(f"the first run ever of `scantruss grid`, {found}", True),
            against_warm("the first run of `scantruss grid` that compiles all", False),
        ]


@dataclass(frozen=True)
class Growth:
    """How a time grows."""

    over: str  #: points or nodes
    sizes: tuple[int, ...]
    seconds: tuple[float, ...]
    aim: float

    @property
    def exponent(self) -> float:
        """The slope of the time over the size, both as logarithms."""
        return float(np.polyfit(np.log(self.sizes), np.log(np.maximum(self.seconds, 1e-6)), 1)[0])

    @property
    def lost(self) -> bool:
        return self.exponent > self.aim

    def row(self) -> str:
        sizes = ", ".join(f"{size:,}" for size in self.sizes)
        return f"| {self.over} {sizes} | {', '.join(f'{s:.3g}' for s in self.seconds)} | {self.exponent:.2f} | at most {self.aim:g} |"


def timed(points: int, nodes: int, rounds: int = 3) -> tuple[float, float]:
    """Return the seconds of a run and those of the stages that only the cloud makes long."""
    shape = scallop(points)
    settings = st.Settings(length=length_for(shape, nodes))
    found = []
    for _ in range(1 if points * nodes > 1e10 else rounds):
        grid = st.grid_from_points(shape.points, settings)
        found.append((grid.seconds["total"], grid.seconds["read"] + grid.seconds["boundary"]))
    whole, cloud = (statistics.median(column) for column in zip(*found, strict=True))
    return whole, cloud


def growth(points: Sequence[int] = GROWTH_POINTS, nodes: Sequence[int] = GROWTH_NODES) -> list[Growth]:
    """Return how the time of the normal effort grows with the points and with the nodes."""
    over_points = tuple(timed(count, 1_000)[0] for count in points)
    times = [timed(1_000_000, count) for count in nodes]
    own = times[0][1]
    return [
        Growth("points", tuple(points), over_points, 1.0),
        Growth("nodes", tuple(nodes), tuple(whole - own for whole, _ in times), 1.1),
    ]


@dataclass(frozen=True)
class Memory:
    """Peak memory of one run in a process of its own."""

    points: int
    multiple: float  #: of the bytes of the points; NaN where it could not be measured
    aim: float | None

    @property
    def lost(self) -> bool:
        return self.aim is not None and self.multiple > self.aim

    def row(self) -> str:
        return f"| {self.points:,} | {self.multiple:.1f} | {f'at most {self.aim:g}' if self.aim else ''} |"


def memory(counts: Iterable[int]) -> list[Memory]:
    """Return the peak memory with so many points and about 1,000 nodes."""
    found = []
    for count in counts:
        shape = scallop(count)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            np.save(folder / "points.npy", shape.points)
            job = {
                "way": "ScanTruss normal",
                "length": length_for(shape, 1_000),
                "nodes": 1_000,
                "spacing": 0.0,
                "repeats": 1,
                **{key: str(folder / file) for key, file in JOB_FILES.items()},
            }
            added = run_child(job, 600.0).get("added", math.nan)
        found.append(Memory(count, added * 1e6 / shape.points.nbytes, 3.0 if count >= 10_000_000 else None))
    return found


def section(command_line: str, quick: bool = False) -> Section:
    """Return the section; quick: 100,000 points only, and nothing that compiles."""
    sizes = [size for size in SIZES if not quick or size[0] == 100_000]
    rows = [
        warm_run(points, nodes, effort, min(rounds, 5) if quick else rounds, aim)
        for points, nodes, effort, rounds, aim in sizes
    ]
    rows += [more_effort(5 if quick else 15, "normal", 3.0), *in_shell(3 if quick else 7)]
    grows = [] if quick else growth()
    rooms = memory((100_000,) if quick else GROWTH_POINTS)
    if not quick:
        rows += [more_effort(9, "best", 20.0), *first_runs(3)]
    lost = [f"{row.what}: {row.ratio:.2f}, the aim is at most {row.aim:g}." for row in rows if row.lost]
    lost += [f"Time over {g.over}: exponent {g.exponent:.2f}, the aim is at most {g.aim:g}." for g in grows if g.lost]
    lost += [
        f"Memory with {m.points:,} points: {m.multiple:.1f} x the points, the aim is at most {m.aim}."
        for m in rooms
        if m.lost
    ]
    aims = len(rows) + len(grows) + sum(m.aim is not None for m in rooms)
    finding = f"**{aims - len(lost)} of {aims}** aims of speed and memory are met; quick takes **{rows[0].ratio:.2f}** neighbour searches."
    parts = [NOTE, table(rows)]
    if grows:
        head = "| time of normal over | seconds | exponent | aim |\n| --- | --- | ---: | --- |"
        parts.append("\n".join([head, *(g.row() for g in grows)]))
    parts.append(
        "\n".join(["| points | peak memory over the points | aim |\n| ---: | ---: | --- |", *(m.row() for m in rooms)])
    )
    return Section("Speed", command_line, finding, "\n\n".join(parts), tuple(lost))
