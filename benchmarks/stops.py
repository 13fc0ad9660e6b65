"""Stop commands at random moments: `python -m benchmarks.stops`; status 1 if one does not end as it should.

Scans of ten million points and of one million are made, each command runs once to its end, then runs are stopped at moments drawn
between its start and its end, or within `--latest` seconds of its start, by Ctrl-C as a terminal sends it (to all processes) or by
SIGTERM (to the first alone). Each must end within two seconds with its status and one line that says so, with nothing half-written
and no process or temporary file left.
"""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from stopped_runs import ENDS, Command, make_scan, seconds_of, stop_at


def commands(folder: Path, large: int, small: int) -> dict[str, Command]:
    """Return the commands to be stopped, their scans made."""
    scan, shell, grid = str(folder / "scan.ply"), str(folder / "shell.ply"), str(folder / "grid.json")
    make_scan(Path(scan), large)
    make_scan(Path(shell), small)
    return {
        "grid, quick, 10,000 nodes": Command(("grid", shell, grid, "--length", "0.98", "--effort", "quick"), frozenset(), prepares=True),
        "info": Command(("info", scan), frozenset()),
        "clean": Command(("clean", scan, "out.ply"), frozenset(["out.ply"])),
        "thin": Command(("thin", scan, "-o", "out.ply", "--spacing", "0.2", "--boundary", "--workers", "2"), frozenset(["out.ply"])),
        "grid": Command(
            ("grid", scan, "out.obj", "out.csv", "out.png", "--length", "1.75"),
            frozenset(["out.obj", "out.csv", "out_nodes.csv", "out.png", "out.settings.json"]),
        ),
        "sweep": Command(
            ("sweep", shell, "--length", "2,3", "--effort", "quick", "-o", "out", "--workers", "2"), frozenset(["out"])
        ),
        "print": Command(
            ("print", grid, "out.3mf", "--member-diameter", ".2", "--node-diameter", ".3"), frozenset(["out.3mf"])
        ),
        "grid, best, 10,000 nodes": Command(
            ("grid", shell, "out.json", "--length", "0.98", "--effort", "best"),
            frozenset(["out.json", "out.settings.json"]),
        ),
    }  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Stop what the arguments name and say how it ended."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, default=50)
    parser.add_argument("--latest", type=float, help="latest moment [s]; nothing runs to its end first")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--large", type=int, default=10_000_000, help="points of the large scan")
    parser.add_argument("--small", type=int, default=1_000_000, help="points of the small one")
    options = parser.parse_args(arguments)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # what is started in the background would ignore it
    rng, wrong, slowest = np.random.default_rng(options.seed), 0, 0.0
    with tempfile.TemporaryDirectory() as folder:
        some = commands(Path(folder), options.large, options.small)
        times = {}
        for name, command in some.items():
            times[name] = options.latest
            if not times[name] or command.prepares:
                times[name] = seconds_of(command)
                print(f"{name}: {times[name]:.1f} s", flush=True)
        for _ in range(options.moments):
            name = str(rng.choice([name for name, command in some.items() if not command.prepares]))
            moment, number = rng.uniform(0, times[name]), int(rng.choice(list(ENDS)))
            seconds, faults = stop_at(some[name], moment, number)
            wrong, slowest = wrong + bool(faults), max(slowest, seconds)
            word = signal.Signals(number).name
            print(f"{name}, {word} after {moment:.2f} s: {seconds:.2f} s {'; '.join(faults)}".rstrip(), flush=True)
    print(f"{options.moments} stops, {wrong} of them wrong, the slowest took {slowest:.2f} s")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
