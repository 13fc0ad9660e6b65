"""Commands that are stopped: each must end soon with one line, with nothing half-written and nothing left running."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

LIMIT = 2.0  # time in which a command must end [s]
ENDS = {signal.SIGINT: (130, "interrupted"), signal.SIGTERM: (143, "stopped")}


@dataclass(frozen=True)
class Command:
    """What is run in a folder of its own, and all that it writes."""

    words: tuple[str, ...]
    results: frozenset[str]
    prepares: bool = False  #: what another needs


def make_scan(path: Path, points: int) -> None:
    """Write a roof of 100 by 80 with an opening, in waves, as binary PLY."""
    rng = np.random.default_rng(0)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {points}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    with path.open("wb") as file:
        file.write(header.encode())
        for part in np.array_split(np.arange(points), -(-points // 1_000_000)):
            x, y = rng.uniform(0, 100, len(part)), rng.uniform(0, 80, len(part))
            near = np.hypot(x - 60, y - 40) < 10
            x[near] = rng.uniform(0, 40, near.sum())
            z = 8 * np.sin(x / 12) * np.cos(y / 15) + 0.01 * rng.normal(size=len(part))
            file.write(np.column_stack([x, y, z]).astype("<f4").tobytes())


class Run:
    """A command in a folder of its own."""

    def __init__(self, command: Command, folder: Path) -> None:
        self.command = command
        self.folder, self.temporary = folder / "run", folder / "tmp"
        self.folder.mkdir()
        self.temporary.mkdir()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "scantruss", *command.words],
            cwd=self.folder,
            env=os.environ | {"TMPDIR": str(self.temporary)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def stop(self, number: int) -> None:
        """Send a signal as a terminal or a supervisor does."""
        if number == signal.SIGINT:
            os.killpg(self.process.pid, number)
        else:
            self.process.send_signal(number)

    def faults(self, number: int, seconds: float, said: str) -> list[str]:
        """Return what is not as it should be after a stop that took so long."""
        found = [f"took {seconds:.2f} s"] if seconds > LIMIT else []
        there = {path.name for path in self.folder.iterdir()}
        whole = self.command.results if self.command.results <= there else frozenset()
        if there - whole:
            found.append(f"left {' '.join(sorted(there))}")
        status, word = ENDS[signal.Signals(number)]
        lines = said.splitlines()
        if self.process.returncode in (status, -number) and not lines:
            pass  # before the program has begun to listen
        elif self.process.returncode != 0 or not whole:  # not just done
            last = lines[-1] if lines else ""
            expected = f"scantruss: {word}; {'what was written is whole' if whole else 'nothing was written'}"
            if self.process.returncode != status or last != expected:
                found.append(f"status {self.process.returncode}: {last}")
        found += [f"still runs: {line}" for line in processes_of(self.process.pid)]
        found += [f"left {path.name} among temporary files" for path in self.temporary.iterdir()]
        return found


def processes_of(group: int) -> list[str]:
    """Return the command lines of all living processes of a group, those that are just ending given a moment."""
    for _ in range(20):
        words = ["ps", "-A", "-ww", "-o", "pgid=,stat=,args="]
        rows = [line.split(None, 2) for line in subprocess.check_output(words, text=True).splitlines()]
        left = [row[2] for row in rows if row[0] == str(group) and row[1][0] != "Z" and len(row) > 2]
        if not left:
            break
        time.sleep(0.05)
    return left


def seconds_of(command: Command) -> float:
    """Return how long a command runs to its end."""
    with tempfile.TemporaryDirectory() as folder:
        started = time.monotonic()
        run = Run(command, Path(folder))
        said = run.process.communicate()[1]
        if run.process.returncode:
            raise SystemExit(f"{' '.join(command.words)} ends with status {run.process.returncode}: {said}")
        return time.monotonic() - started


def stop_at(command: Command, moment: float, number: int) -> tuple[float, list[str]]:
    """Return how long a command takes to end that is stopped so long after its start [s], and what is wrong then."""
    with tempfile.TemporaryDirectory() as folder:
        run = Run(command, Path(folder))
        try:
            run.process.communicate(timeout=moment)
            return 0.0, []  # it was done before
        except subprocess.TimeoutExpired:
            run.stop(number)
        stopped = time.monotonic()
        said = run.process.communicate()[1]
        seconds = time.monotonic() - stopped
        return seconds, run.faults(number, seconds, said)
