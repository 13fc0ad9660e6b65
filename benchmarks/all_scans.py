"""Twins and real scans by every way, a row each: `python -m benchmarks.all_scans --data DIR [--ways quick,normal] [names]`.

DIR, or the environment's SCANTRUSS_DATA, holds `twins` with `twins_truth.json` (length and topology of each) and `real`.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import statistics
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import scantruss as st

from .page import FILE, Section

REAL = {  # member lengths that suit the real scans, in their units
    "scallop.ply": 1.9, "scallop_dense.laz": 1.9, "bunny_zipper.ply": 0.006, "bunnyDouble.e57": 0.006, "humface.csv": 7.0,
    "demosthenes_lowres.ply": 0.15, "nefertiti_lowres.obj": 16.0, "kitten.xyz": 0.07, "hillside_hexbin-crop.las": 8.0,
    "quarry_samp53-utm-ground.pcd": 12.0, "srtm_bigtujunga_utm11.laz": 400.0,
}  # fmt: skip
WAYS = ("paper", "quick", "normal", "best")
COLUMNS = (
    "scan",
    "by",
    "mean G",
    "std G",
    "min G",
    "CV",
    "length",
    "angles",
    "six",
    "topology",
    "certificate",
    "seconds",
)
MEDIANS = ("mean G", "std G", "min G", "CV", "six", "seconds")  # shown on the page, of each way
NOTE = """\
Before: what the front of the default method leaves. Paper: to the letter, after its optimization. Quick, normal, best: the
efforts of the default method. G, CV, mean length in desired lengths, smallest and largest angle, share of inner nodes with six
members. Topology: right or wrong where the truth is known, else what came out as loops / Euler number; refused, and why.
Certificate: irregular members present - those forced, share of the scan within half a member of a triangle. Seconds: the whole
run in one process on points in memory, on a machine shared with other work. [Every row](scans.csv)."""
Row = tuple[str, ...]  # a cell of each column


@dataclass(frozen=True)
class Scan:
    """A scan, the member length that suits it, and what a right grid of it must be, where that is known."""

    path: Path
    length: float
    truth: dict[str, Any] = field(default_factory=dict)

    def judge(self, topology: st.Topology) -> str:
        """Return whether the topology is right, or what it is where that is not known."""
        if not self.truth:
            return f"{topology.boundary_loops} / {topology.euler}"
        wanted = tuple(self.truth[name] for name in ("boundary_loops", "euler_characteristic", "components"))
        right = wanted == (topology.boundary_loops, topology.euler, topology.components)
        return "right" if right and topology.manifold and topology.orientable else "wrong"


def data_folder(given: str | None = None) -> Path | None:
    """Return where the scans are: as given, or as the environment says; None where they are not."""
    named = given or os.environ.get("SCANTRUSS_DATA")
    return Path(named) if named and (Path(named) / "twins" / "twins_truth.json").exists() else None


def scans_in(data: Path, names: Iterable[str] = ()) -> list[Scan]:
    """Return the scans of a folder whose file names hold one of the names; all for none."""
    truth = json.loads((data / "twins" / "twins_truth.json").read_text(encoding="utf-8"))
    found = [Scan(data / "twins" / name, known["member_length"], known) for name, known in truth.items() if "." in name]
    found += [Scan(data / "real" / name, length) for name, length in REAL.items()]
    wanted = tuple(names)
    return [
        scan for scan in found if scan.path.exists() and (not wanted or any(word in scan.path.name for word in wanted))
    ]


def rows_of(scan: Scan, ways: Iterable[str] = WAYS) -> list[Row]:
    """Return a row for what the front leaves, and one for each way."""
    cloud = st.read_points(scan.path)
    before: list[Row] = []
    rows: list[Row] = []
    for way in ways:
        own: dict[str, Any] = {"method": "paper"} if way == "paper" else {"effort": way}
        started = perf_counter()
        try:
            grid = st.grid_from_points(cloud.points + cloud.origin, st.Settings(length=scan.length, **own))
        except st.ScanTrussError as error:
            words = f"{'right: ' if scan.truth.get('orientable') is False else ''}refused: {error}"
            rows.append((scan.path.name, way, *7 * ("",), words, "", f"{perf_counter() - started:.2f}"))
            continue
        seconds, certificate = perf_counter() - started, grid.certificate
        assert certificate is not None and grid.before is not None
        if way != "paper" and not before:
            before = [(scan.path.name, "before", *_figures(grid.before, scan.length), "", "", "")]
        extra = certificate.irregular - certificate.irregular_forced
        irregular = f"{certificate.irregular} - {certificate.irregular_forced} = {extra}"
        passed = f"passed, {irregular}, {certificate.scan_within_reach:.1%}"
        figures = _figures(grid.quality, scan.length)
        rows.append((scan.path.name, way, *figures, scan.judge(grid.topology), passed, f"{seconds:.2f}"))
    return before + rows


def _figures(quality: st.GridQuality, length: float) -> Row:
    return (
        f"{quality.shape_mean:.4f}", f"{quality.shape_std:.4f}", f"{quality.shape_min:.2f}", f"{quality.length_cv:.4f}",
        f"{quality.length_mean / length:.3f}", f"{quality.angle_min:.0f}-{quality.angle_max:.0f}", f"{quality.valence6:.2f}",
    )  # fmt: skip


def cell(row: Row, column: str) -> str:
    """Return the cell of a row in a column."""
    return row[COLUMNS.index(column)]


def summary(rows: Sequence[Row]) -> str:
    """Return the table of the ways: how many scans have a grid, and the medians of these."""
    lines = ["| by | grids | " + " | ".join(MEDIANS) + " |", "| --- | ---: |" + " ---: |" * len(MEDIANS)]
    for way in dict.fromkeys(cell(row, "by") for row in rows):
        own = [row for row in rows if cell(row, "by") == way and cell(row, "mean G")]
        tried = sum(cell(row, "by") == way for row in rows)
        medians = []
        for column in MEDIANS:
            values = [cell(row, column) for row in own if cell(row, column)]
            digits = max((len(value.partition(".")[2]) for value in values), default=0)
            medians.append(f"{statistics.median(map(float, values)):.{digits}f}" if values else "")
        lines.append(f"| {way} | {len(own)} of {tried} | " + " | ".join(medians) + " |")
    return "\n".join(lines)


def page_section(command: str, data: Path | None, folder: Path = FILE.parent) -> Section | None:
    """Return the section of docs/numbers.md, with every row in scans.csv beside it; None where the scans are not there."""
    if data is None:
        return None
    rows = [row for scan in scans_in(data) for row in rows_of(scan)]
    with (folder / "scans.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])
    bad = [row for row in rows if cell(row, "topology") == "wrong" or "refused" in cell(row, "topology")]
    wrong = sum(cell(row, "topology") == "wrong" for row in rows)
    finding = f"**{wrong}** of {len(rows)} rows are wrong, {len(bad) - wrong} refused."
    lost = tuple(
        f"{cell(row, 'scan')}, {cell(row, 'by')}: {cell(row, 'topology')}"
        for row in bad
        if "right: refused" not in cell(row, "topology")
    )
    return Section("Simulated and real scans", command, finding, f"{NOTE}\n\n{summary(rows)}", lost)


def main() -> int:
    """Print the rows that the arguments name; the exit status is 1 if any topology is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=[], help="parts of file names; none: all")
    parser.add_argument("--data", help="folder of the scans; SCANTRUSS_DATA if left out")
    parser.add_argument("--ways", default=",".join(WAYS))
    options = parser.parse_args()
    data = data_folder(options.data)
    if data is None:
        parser.error("no scans found; --data or SCANTRUSS_DATA names the folder that holds twins/twins_truth.json")
    print(" | ".join(COLUMNS))
    wrong = False
    for scan in scans_in(data, options.names):
        for row in rows_of(scan, options.ways.split(",")):
            print(" | ".join(row), flush=True)
            wrong |= cell(row, "topology") == "wrong"
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
