"""Speed as ratios in one run: the warm run, the first run ever, and the command's help."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from shapes import make

import scantruss as st

from .ratios import Ratio, in_turn

POINTS = 100_000
LENGTH = 3.2  #: about 1,000 nodes on the scallop [mm]
NEIGHBOURS = 16


def command(*arguments: str, cache: Path | None = None) -> None:
    """Run the scantruss command of this Python, quietly; `cache` is where its machine code is kept."""
    environment = dict(os.environ, **({"NUMBA_CACHE_DIR": str(cache)} if cache else {}))
    run = [sys.executable, "-m", "scantruss", *arguments]
    subprocess.run(run, check=True, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def warm_run(rounds: int, workers: int, effort: str) -> Ratio:
    """Return the whole run on points in memory against a search of 16 neighbours of each point by so many threads."""
    from scipy.spatial import cKDTree

    points = make("scallop", POINTS).points
    settings = st.Settings(length=LENGTH, effort=effort)
    grid = st.grid_from_points(points, settings)  # compiles, or loads what was compiled
    return in_turn(
        f"grid of {POINTS:,} points, {len(grid.nodes):,} nodes, {effort}, warm / scipy cKDTree, {NEIGHBOURS} neighbours of each,"
        f" {workers} thread{'s' * (workers > 1)}",
        lambda: st.grid_from_points(points, settings),
        lambda: cKDTree(points).query(points, k=NEIGHBOURS, workers=workers),
        rounds=rounds,
        aim=1.0,
    )


def more_effort(rounds: int, effort: str, aim: float) -> Ratio:
    """Return the whole run with an effort against the quick one."""
    points = make("scallop", POINTS).points
    quick, more = (st.Settings(length=LENGTH, effort=name) for name in ("quick", effort))
    return in_turn(
        f"grid of {POINTS:,} points: effort {effort} / effort quick",
        lambda: st.grid_from_points(points, more),
        lambda: st.grid_from_points(points, quick),
        rounds=rounds,
        aim=aim,
    )


def first_run(rounds: int) -> Ratio:
    """Return the command's first run ever, which compiles, against the same command warm."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scan = folder / "scan.npy"
        np.save(scan, make("scallop", POINTS).points)
        grid = ("grid", str(scan), str(folder / "grid.obj"), "--length", str(LENGTH))
        command(*grid, cache=folder / "warm")
        fresh = iter(range(rounds))
        return in_turn(
            "the first run ever of `scantruss grid` (compiles) / the same command warm",
            lambda: command(*grid, cache=folder / f"cold{next(fresh)}"),
            lambda: command(*grid, cache=folder / "warm"),
            rounds=rounds,
            aim=12.0,
        )


def help_text(rounds: int) -> Ratio:
    """Return `scantruss --help` against the import of what the work needs."""
    imports = [sys.executable, "-c", "import numpy, scipy.spatial, numba"]
    return in_turn(
        "`scantruss --help` / `python -c 'import numpy, scipy.spatial, numba'`",
        lambda: command("--help"),
        lambda: subprocess.run(imports, check=True),
        rounds=rounds,
        aim=0.25,
    )


def first_figures(rounds: int = 7) -> list[Ratio]:
    """Return the ratios."""
    return [
        *(warm_run(2 * rounds + 1, workers, effort) for effort in ("quick", "normal") for workers in (1, 2)),
        more_effort(rounds, "normal", 3.0),
        more_effort(3, "best", 20.0),
        first_run(max(rounds // 2, 3)),
        help_text(rounds),
    ]


if __name__ == "__main__":
    for ratio in first_figures():
        print(ratio.row())
