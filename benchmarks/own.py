"""Our own figures as JSON, and two of these compared: `python -m benchmarks own FILE`, `python -m benchmarks compare OLD NEW`."""

from __future__ import annotations

import json
import statistics
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import scantruss as st

from .peers.child import neighbour_search
from .peers.clouds import Cloud, shape_of
from .peers.figures import figures
from .ratios import machine, seconds

FILE = Path(__file__).resolve().parents[1] / "docs" / "numbers.json"
FORMAT = 1
JOBS = (  # cloud, efforts, rounds
    (Cloud("scallop", 100_000, 1_000, 0.3), ("quick", "normal"), 9),
    (Cloud("great_court", 100_000, 1_000, 0.0), ("quick", "normal"), 9),
    (Cloud("sphere", 100_000, 1_000, 0.3), ("quick", "normal"), 9),
    (Cloud("scallop", 100_000, 10_000, 0.0), ("quick", "normal"), 5),
    (Cloud("scallop", 1_000_000, 1_000, 0.3), ("quick", "normal"), 5),
)
TOLERANCE = 0.25  #: a time may grow by this share; two runs of the same code differed by up to 15 % on a shared machine
WORSE = {  # figure: by how much it may get worse, and its sign when more is better
    "shape_mean": (0.0005, 1), "shape_std": (0.001, -1), "cv": (0.001, -1), "angle_min": (3.0, 1), "valence6": (0.01, 1),
    "deviation": (0.0005, -1), "deviation_max": (0.01, -1), "boundary": (0.02, -1), "uncovered": (0.001, -1), "right": (0.0, 1),
}  # fmt: skip


def record(quick: bool = False) -> dict[str, Any]:
    """Return times as multiples of the neighbour search on the same points, with their quartiles, and figures of the grids."""
    times, quality = {}, {}
    for cloud, efforts, rounds in JOBS[: 3 if quick else None]:
        shape = shape_of(cloud)
        for effort in efforts:
            name, settings = f"{cloud.title}, {effort}", st.Settings(length=shape.length, effort=effort)
            grid = st.grid_from_points(shape.points, settings)
            found = figures(shape, grid.nodes + grid.origin, grid.triangles)
            quality[name] = {key: value for key, value in found.to_dict().items() if key in WORSE and value is not None}
            ratios = [
                seconds(lambda: st.grid_from_points(shape.points, settings)) / neighbour_search(shape.points)  # noqa: B023
                for _ in range(3 if quick else rounds)
            ]
            low, middle, high = statistics.quantiles(ratios, n=4, method="inclusive")
            times[name] = {"ratio": middle, "low": low, "high": high}
            print(f"{name}: {middle:.2f} neighbour searches", flush=True)
    return {"format": FORMAT, "machine": machine(), "times": times, "quality": quality}


def save(found: dict[str, Any], file: Path) -> None:
    """Write figures as JSON."""
    file.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n", encoding="utf-8", newline="\n")


def load(file: Path) -> dict[str, Any]:
    """Return the figures of a file."""
    found = json.loads(file.read_text(encoding="utf-8"))
    if not isinstance(found, dict) or found.get("format") != FORMAT:
        raise ValueError(f"{file.name} is no file of `python -m benchmarks own`, format {FORMAT}")
    return found


@dataclass(frozen=True)
class Change:
    """One figure before and after."""

    name: str
    figure: str
    old: float
    new: float
    mark: str  #: slower, worse, or empty

    def line(self) -> str:
        ratio = f"x {self.new / self.old:.3f}" if self.old else "" if self.new == self.old else "from 0"
        return f"{self.mark or '-':7s} {self.name}: {self.figure} {self.old:.5g} -> {self.new:.5g} {ratio}".rstrip()


def slower(old: dict[str, float], new: dict[str, float], tolerance: float) -> bool:
    """Whether a time grew by more than the tolerance and the middle halves of both runs lie apart."""
    return new["ratio"] > (1 + tolerance) * old["ratio"] and new["low"] > old["high"]


def changes(old: dict[str, Any], new: dict[str, Any], tolerance: float = TOLERANCE) -> list[Change]:
    """Return all figures that both have."""
    found = []
    for name, before in old["times"].items():
        after = new["times"].get(name)
        if after:
            mark = "slower" if slower(before, after, tolerance) else ""
            found.append(Change(name, "neighbour searches", before["ratio"], after["ratio"], mark))
    for name, figures_before in old["quality"].items():
        for key, value in figures_before.items():
            got = new["quality"].get(name, {}).get(key)
            if got is not None and key in WORSE:
                least, sign = WORSE[key]
                found.append(
                    Change(name, key, float(value), float(got), "worse" if sign * (value - got) > least else "")
                )
    return found


def compare(old: Path, new: Path, tolerance: float = TOLERANCE) -> int:
    """Print what changed, what is slower or worse first; return 1 if anything is, 2 if nothing can be compared."""
    before, after = load(old), load(new)
    found = sorted(changes(before, after, tolerance), key=lambda change: not change.mark)
    alone = set(before["times"]).symmetric_difference(after["times"])
    for change in found:
        print(change.line())
    for name in sorted(alone):
        print(f"only in {'the old' if name in before['times'] else 'the new'}: {name}")
    if before["machine"] != after["machine"]:
        print(f"different machines: {before['machine']}; {after['machine']}")
    bad = sum(bool(change.mark) for change in found)
    print(f"{bad} of {len(found)} figures slower by more than {tolerance:.0%} or worse")
    return 2 if not found else int(bad > 0)
