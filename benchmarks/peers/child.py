"""One run in a process of its own: `python -m benchmarks.peers.child JOB.json`; the clock runs only while the way works."""

from __future__ import annotations

import importlib
import json
import statistics
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

SHORT = 5.0  #: a first call shorter than this is repeated, and the median of the repetitions counts [s]
MEGA = 1e6
SLOW_SEARCH_POINTS = 200_000  #: with so many points the neighbour search is done thrice


def memory() -> tuple[float, float]:
    """Return the memory this process has now and the most it ever had [MB]; the first is 0 where the system does not say."""
    status = Path("/proc/self/status")
    if status.exists():  # getrusage would also count what the parent had before this process became another
        rows = dict(line.split(":", 1) for line in status.read_text(encoding="ascii", errors="replace").splitlines())
        now, most = (int(rows[key].split()[0]) * 1024 / MEGA for key in ("VmRSS", "VmHWM"))
        return now, most
    import resource

    return 0.0, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024) / MEGA


def forget_peak() -> None:
    """Let the peak start from here, where the system can (Linux)."""
    clear = Path("/proc/self/clear_refs")
    if clear.exists():
        clear.write_text("5", encoding="ascii")


def neighbour_search(points: np.ndarray) -> float:
    """Return the seconds of the yardstick: a k-d tree on the points and 16 neighbours of each, by two threads."""
    from scipy.spatial import cKDTree

    started = perf_counter()
    cKDTree(points).query(points, k=16, workers=2)
    return perf_counter() - started


def measured(job: dict[str, Any]) -> dict[str, Any]:
    """Return what became of a job; the grid goes to its file."""
    from .surfaces import Scan
    from .ways import NotForThisError, way

    chosen = way(job["way"])
    started = perf_counter()
    try:
        for module in chosen.modules:
            importlib.import_module(module)
    except (ImportError, OSError) as error:
        return {"result": "missing", "words": str(error).splitlines()[0]}
    imported = perf_counter() - started
    if chosen.warm is not None:
        chosen.warm()
    before, _ = memory()
    scan = Scan(np.load(job["points"]), job["length"], job["nodes"], job["spacing"])
    seconds: list[float] = []  # of each call
    least = 2 if chosen.warm is not None and job["repeats"] else 1  # what compiles is never told by its first call
    try:
        while len(seconds) < least or (len(seconds) <= job["repeats"] and seconds[0] < SHORT):
            forget_peak()
            started = perf_counter()
            mesh = chosen.run(scan)
            seconds.append(perf_counter() - started)
            _, most = memory()  # of the last call: what compiles is not told by its first
    except NotForThisError as error:
        return {"result": "does not apply", "words": str(error)}
    except Exception as error:
        refused = chosen.ours and type(error).__module__.startswith("scantruss")
        words = " ".join(f"{type(error).__name__}: {error}".split())[:300]
        return {"result": "refused" if refused else "failed", "words": words}
    np.savez(job["grid"], nodes=mesh.nodes, triangles=mesh.triangles)
    return {
        "result": "done",
        "words": "",
        "import": imported,
        "first": seconds[0],
        "seconds": statistics.median(seconds[1:] or seconds),
        "memory": most,
        "added": max(0.0, most - before),  # the points and the work; the programs and their imports not
        "search": statistics.median(
            neighbour_search(scan.points) for _ in range(3 if len(scan.points) <= SLOW_SEARCH_POINTS else 1)
        ),
    }


def main() -> None:
    """Do the job and write what became of it beside the grid."""
    job = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    answer = Path(job["answer"])
    beside = answer.with_suffix(".part")
    beside.write_text(json.dumps(measured(job)), encoding="utf-8")
    beside.replace(answer)


if __name__ == "__main__":
    main()
