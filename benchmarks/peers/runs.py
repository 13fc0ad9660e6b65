"""Start each run, end it when its time is over, measure its grid, and keep a row whatever happened."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from .clouds import Cloud, shape_of, spacing_of
from .figures import figures
from .ways import WAYS, Way

ROOT = Path(__file__).resolve().parents[2]
REPEATS = 3  #: of a first call that was short
KEPT = ROOT / "benchmarks" / "runs"  #: rows of earlier runs, on whatever machine: times are compared by searches


@dataclass(frozen=True)
class Row:
    """What became of one way on one cloud."""

    cloud: Cloud
    way: str
    result: str  #: done, missing, failed, refused, does not apply, crashed, out of time, not run
    words: str
    times: dict[str, float]  #: seconds, first, import, memory, added, search; empty unless done
    found: dict[str, Any]  #: as of Figures; empty unless done

    @property
    def done(self) -> bool:
        return self.result == "done"

    @property
    def right(self) -> bool:
        return self.done and bool(self.found["right"])

    def value(self, name: str) -> float:
        """Return a time or a figure; NaN where there is none. `searches`: seconds over those of the neighbour search."""
        if name == "searches":
            return self.value("seconds") / self.value("search")
        known = {**self.times, **self.found}.get(name)
        return float("nan") if known is None else float(known)

    def to_json(self) -> str:
        return json.dumps(asdict(self))

    @classmethod
    def from_dict(cls, record: dict[str, Any]) -> Row:
        return cls(**{**record, "cloud": Cloud(**record["cloud"])})


class Store:
    """Rows by what was run, one line each; a broken last line (a machine that went off) is left out."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: dict[str, Row] = {}
        if path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                with contextlib.suppress(ValueError, TypeError, KeyError):
                    record = json.loads(line)
                    key = record.pop("key")
                    self.rows[key] = Row.from_dict(record)

    def add(self, key: str, row: Row) -> None:
        """Keep a row, in place of those of the same run by another version or measured otherwise."""
        run = _run_of(key)
        self.rows = {known: kept for known, kept in self.rows.items() if _run_of(known) != run} | {key: row}
        lines = [json.dumps({"key": known, **asdict(kept)}) + "\n" for known, kept in self.rows.items()]
        self.path.parent.mkdir(parents=True, exist_ok=True)
        beside = self.path.with_suffix(".part")
        beside.write_text("".join(lines), encoding="utf-8")
        beside.replace(self.path)


def _run_of(key: str) -> str:
    """What was run, whatever the version: a key but for the identities."""
    cloud, way, _, _, limit, repeats = json.loads(key)
    return json.dumps([cloud, way, limit, repeats])


@cache
def identity(way: Way) -> str:
    return way.identity()


@cache
def warmed(way: Way) -> None:
    """Compile what a way compiles on its first run ever, so that this does not use up the time of a run."""
    with contextlib.suppress(Exception):  # the run itself will say what is wrong
        if way.warm is not None:
            way.warm()


@cache
def yardstick() -> str:
    """Return a digest of what makes the clouds and measures the grids: rows measured otherwise are measured anew."""
    own = [Path(__file__).parent / name for name in ("child.py", "clouds.py", "figures.py")]
    clouds = ("shapes.py", "scans.py", "surfaces.py", "truths.py")
    own += [ROOT / "benchmarks" / "measure.py", *(ROOT / "tests" / name for name in clouds)]
    return hashlib.sha256(b"".join(path.read_bytes() for path in own)).hexdigest()[:12]


def without_folders(words: str) -> str:
    """Return words in which a path has kept its last name: folders of one machine say nothing elsewhere."""
    return re.sub(r"(?<![\w.])(?:[A-Za-z]:)?[/\\](?:[^\s/\\:'\"()]+[/\\])+(?=\w)", "", words)


def key_of(cloud: Cloud, way: Way, limit: float, repeats: int) -> str:
    return json.dumps([asdict(cloud), way.name, identity(way), yardstick(), limit, repeats])


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and what it started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()
    process.wait()


def run_child(job: dict[str, Any], limit: float, module: str = "benchmarks.peers.child") -> dict[str, Any]:
    """Return the answer of a job done by a process of its own, or how that process ended."""
    answer, log = Path(job["answer"]), Path(job["log"])
    path = answer.with_suffix(".job")
    path.write_text(json.dumps(job), encoding="utf-8")
    search = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    started = perf_counter()
    with log.open("wb") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", module, str(path)], stdin=subprocess.DEVNULL, stdout=file, stderr=file,
            cwd=answer.parent, start_new_session=True, env=dict(os.environ, PYTHONPATH=search),
        )  # fmt: skip
        try:
            process.wait(limit)
        except subprocess.TimeoutExpired:
            return {"result": "out of time", "words": f"more than {limit:g} s"}
        finally:
            if process.poll() is None:  # also when we are interrupted
                _end(process)
    if answer.exists():
        return dict(json.loads(answer.read_text(encoding="utf-8")))
    how = f"signal {-process.returncode}" if process.returncode < 0 else f"exit status {process.returncode}"
    last = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    said = last[-1][:200] if process.returncode > 0 and last else ""
    return {"result": "crashed", "words": f"{how} after {perf_counter() - started:.0f} s {said}".strip()}


def run(cloud: Cloud, way: Way, limit: float, repeats: int = REPEATS) -> Row:
    """Return the row of one way on one cloud."""
    warmed(way)
    shape = shape_of(cloud)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        job = {
            "way": way.name, "points": str(folder / "points.npy"), "length": shape.length, "nodes": cloud.nodes, "repeats": repeats,
            "spacing": spacing_of(cloud),
            "grid": str(folder / "grid.npz"), "answer": str(folder / "answer.json"), "log": str(folder / "log.txt"),
        }  # fmt: skip
        np.save(folder / "points.npy", shape.points)
        answer = run_child(job, limit)
        result, words = answer.pop("result"), answer.pop("words")
        found: dict[str, Any] = {}
        if result == "done":
            try:
                with np.load(folder / "grid.npz") as grid:
                    found = figures(shape, grid["nodes"], grid["triangles"]).to_dict()
            except ValueError as error:
                result, words, answer = "failed", str(error), {}
    return Row(cloud, way.name, result, without_folders(words), answer, found)


def hopeless(cloud: Cloud, way: Way, rows: Iterable[Row]) -> bool:
    """Whether the way ran out of time on an easier cloud of the same surface."""
    return any(
        row.way == way.name and row.result == "out of time" and row.cloud != cloud and cloud.harder_than(row.cloud)
        for row in rows
    )


def all_rows(
    clouds: Iterable[Cloud],
    ways: Iterable[Way] = WAYS,
    *,
    limit: float,
    repeats: int = REPEATS,
    fresh: bool = False,
    kept: Path = KEPT,
) -> Iterator[Row]:
    """Yield the rows of all ways on all clouds; those known already are not run again unless `fresh`."""
    ways, store = tuple(ways), Store(kept / "rows.jsonl")
    rows: list[Row] = []
    for cloud in clouds:
        for way in ways:
            key = key_of(cloud, way, limit, repeats)
            row = None if fresh else store.rows.get(key)
            if row is None and hopeless(cloud, way, rows):
                row = Row(cloud, way.name, "not run", f"more than {limit:g} s on an easier cloud", {}, {})
            elif row is None:
                row = run(cloud, way, limit, repeats)
                store.add(key, row)
            rows.append(row)
            yield row
