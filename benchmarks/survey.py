"""`grid` as a user calls it, on every scan at several lengths: python -m benchmarks.survey FOLDER_OR_SCAN... --out DIR [--lengths 10].

The lengths lie evenly over the range that `info` names, on a scale of ratios; all scans have their turn at one before any has a
second. Each line of DIR/survey.jsonl is a run: the verdict, the line of a refusal, and what an independent measure finds. With
`--check FILE` that measure is a program that is called as `FILE GRID.obj --cloud SCAN --length L --json`. At the end a table, what a
grid that passed must not have, the lines of all refusals, and sheets of the pictures of all that passed (DIR/sheet_*.png). Runs that
are there already are not done again.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

import scantruss as st
from scantruss.check.limits import NOISES_OFF
from scantruss.export.drawing.sheet import encode_sheet
from scantruss.scan.member_length import length_range, round_length

SUFFIXES = {".ply", ".xyz", ".csv", ".las", ".laz", ".e57", ".pcd", ".obj"}
MOST_MEMBERS = 30_000  # of a run, estimated by the square of the extent
LEAST_ANGLE, SHORTEST, LONGEST, FARTHEST, MOST_MISSED = 15.0, 0.5, 1.8, 0.1, 0.05  # what a grid that can be built keeps
ON_A_SHEET = 12  # pictures
ROUNDING = 1e-3  # of the figures of a text file


def scans_in(places: Iterable[Path]) -> list[Path]:
    """Return the scans among files and in folders, in their order; scans in frames of their own are not looked for."""
    found: list[Path] = []
    for place in places:
        files = sorted(place.iterdir()) if place.is_dir() else [place]
        found += [file for file in files if file.suffix.lower() in SUFFIXES]
    return found


def lengths_of(cloud: st.PointCloud, count: int) -> list[float]:
    """Return lengths from the largest to the least that the scan carries, every third first [scan unit]."""
    low, high = length_range(cloud)
    least = float(np.sqrt(np.prod(np.sort(np.ptp(cloud.points, axis=0))[1:]) * 3.5 / MOST_MEMBERS))
    low = max(low, round_length(least, "up"))
    order = np.concatenate([np.arange(count - 1 - first, -1, -3) for first in range(3)])
    wished = low * (high / low) ** (order / max(count - 1, 1)) if low <= high else np.array([low])
    return list(dict.fromkeys(min(max(round_length(length, "nearest"), low), high) for length in wished.tolist()))


def run(scan: Path, length: float, folder: Path, effort: str, seconds: float) -> dict[str, Any]:
    """Make a grid by the command line and return what it says."""
    stem = folder / f"{scan.stem}_{length:g}"
    files = [f"{stem}.json", f"{stem}.obj", f"{stem}.png"]
    words = [
        sys.executable,
        "-m",
        "scantruss",
        "grid",
        str(scan),
        *files,
        "--length",
        f"{length:g}",
        "--effort",
        effort,
    ]
    row: dict[str, Any] = {"scan": scan.name, "length": length}
    started = perf_counter()
    try:
        ended = subprocess.run([*words, "--force"], capture_output=True, text=True, check=False, timeout=seconds)
    except subprocess.TimeoutExpired:
        return row | {"verdict": "stopped", "seconds": seconds, "line": f"not done after {seconds:g} s"}
    lines = ended.stderr.strip().splitlines()
    row |= {"status": ended.returncode, "seconds": perf_counter() - started}
    if ended.returncode:
        return row | {"verdict": "refused", "line": lines[-1] if lines else "", "notes": lines[:-1]}
    grid = st.read_grid(f"{stem}.json")
    assert grid.certificate is not None
    verdict = "warnings" if grid.certificate.warnings else "passed"
    warnings = [f"{warning.kind}: {warning.words}" for warning in grid.certificate.warnings]
    return row | {"verdict": verdict, "warnings": warnings, "notes": lines, "certificate": grid.certificate.to_dict()}


def measured(row: dict[str, Any], scan: Path, folder: Path, program: Path) -> dict[str, Any]:
    """Return the figures of an independent program on the grid of a run; those of its faults alone where it does not end well."""
    obj = folder / f"{scan.stem}_{row['length']:g}.obj"
    words = [sys.executable, str(program), str(obj), "--cloud", str(scan), "--length", f"{row['length']:g}", "--json"]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    try:
        found = dict(json.loads(ended.stdout))
    except ValueError:
        return {"error": ended.stderr.strip()[-200:]}
    grid, cloud = st.read_grid(folder / f"{scan.stem}_{row['length']:g}.json"), st.read_points(scan)
    return found | {"node_off_least": farthest_node(grid, cloud), "spacing": cloud.spacing}


def farthest_node(grid: st.Grid, cloud: st.PointCloud) -> float:
    """Return how far a node lies off the scan at least: off planes through 4 to 24 points, or the nearest point, the least of these."""
    nodes = grid.nodes if grid.deviation is None else grid.nodes[np.isfinite(grid.deviation)]
    points = cloud.points + cloud.origin - grid.origin
    away, which = cKDTree(points).query(nodes, k=24)
    least = away[:, 0]
    for count in (4, 6, 8, 12, 24):
        around = points[which[:, :count]]
        middle = around.mean(axis=1, keepdims=True)
        normal = np.linalg.svd(around - middle)[2][:, 2]
        least = np.minimum(least, np.abs(((nodes - middle[:, 0]) * normal).sum(axis=1)))
    return float(least.max(initial=0.0))


def objections(row: dict[str, Any]) -> list[str]:
    """Return why an engineer would throw a grid away that passed, and where the certificate is not what the other program finds."""
    other, length, found = row.get("check", {}), row["length"], row["certificate"]
    if "error" in other or not other:
        return [f"not checked: {other.get('error', '')}"] if other else []
    off = min(other["node_dev_max"], other["node_off_least"])
    room = (
        FARTHEST * length + NOISES_OFF * found["noise"] + other["spacing"]
    )  # at an edge no plane fits, and points stand apart
    said_out = sum(part["share"] for part in found["left_out"] if part["kind"] != "far")  # outliers, a floor, no data
    limits = (
        (other["angle_min"] < LEAST_ANGLE, f"angle {other['angle_min']:.1f}"),
        (other["L_min"] < SHORTEST * length, f"member {other['L_min'] / length:.2f} L"),
        (other["L_max"] > LONGEST * length, f"member {other['L_max'] / length:.2f} L"),
        (off > room, f"node {off / length:.2f} L off"),
        (other["cloud_uncovered"] - said_out > MOST_MISSED, f"{other['cloud_uncovered']:.1%} uncovered"),
        (not (other["manifold"] and other["oriented"]), "no oriented manifold"),
        (not other.get("topology_ok", True), "not the true topology"),
    )  # fmt: skip
    pairs = (
        ("smallest_angle", found["smallest_angle"]["value"], other["angle_min"], 0.05),
        ("shortest_member", found["shortest_member"]["value"], other["L_min"], ROUNDING * length),
        ("longest_member", found["longest_member"]["value"], other["L_max"], ROUNDING * length),
        ("boundary_loops", found["boundary_loops"], other["boundary_loops"], 0),
        ("euler", found["euler"], other["euler"], 0),
        ("pieces", found["pieces"], other["components"], 0),
    )
    said = [words for wrong, words in limits if wrong]
    return said + [
        f"{name} {ours:.4g}, not {theirs:.4g}" for name, ours, theirs, room in pairs if abs(ours - theirs) > room
    ]


def rows_so_far(file: Path) -> Iterator[dict[str, Any]]:
    """Yield the runs that were kept."""
    if file.exists():
        yield from map(json.loads, file.read_text(encoding="utf-8").splitlines())


def table(rows: Iterable[dict[str, Any]]) -> str:
    """Return a line for each scan, and all refusals and objections below."""
    by_scan: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        by_scan.setdefault(row["scan"], []).append(row)
    lines, below = ["scan  passed  warnings  refused  stopped"], []
    for name, own in by_scan.items():
        count = Counter(row["verdict"] for row in own)
        lines.append("  ".join([name, *(str(count[word]) for word in ("passed", "warnings", "refused", "stopped"))]))
        for row in own:
            words = row["line"] if is_without_grid(row) else "; ".join(objections(row))
            below += [f"{name} {row['length']:g} {row['verdict']}: {words}"] if words else []
    kinds = Counter(
        re.sub(r"[-+]?\d[\d.,e%-]*", "#", row["line"]) for row in chain(*by_scan.values()) if is_without_grid(row)
    )
    return "\n".join([*lines, "", *below, "", *(f"{count} x {words}" for words, count in kinds.most_common())])


def is_without_grid(row: dict[str, Any]) -> bool:
    """Whether a run gave no grid."""
    return row["verdict"] in ("refused", "stopped")


def write_sheets(rows: Iterable[dict[str, Any]], folder: Path) -> None:
    """Write the pictures of all grids that passed, some on a sheet."""
    made = [row for row in rows if not is_without_grid(row)]
    for begin in range(0, len(made), ON_A_SHEET):
        some = made[begin : begin + ON_A_SHEET]
        files = [folder / f"{Path(row['scan']).stem}_{row['length']:g}.png" for row in some]
        titles = [f"{row['scan']} {row['length']:g}: {row['verdict']}" for row in some]
        shown = [(title, file.read_bytes()) for title, file in zip(titles, files, strict=True)]
        (folder / f"sheet_{begin // ON_A_SHEET:03}.png").write_bytes(encode_sheet(shown))


def main() -> int:
    """Run what is missing and print the table; the exit status is 1 if a grid passed that should not have."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="+", type=Path, help="scans, or folders of scans")
    parser.add_argument("--out", type=Path, required=True, help="folder of grids, pictures and survey.jsonl")
    parser.add_argument("--lengths", type=int, default=10, help="lengths for each scan (default 10)")
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--seconds", type=float, default=120.0, help="time after which a run is stopped (default 120)")
    parser.add_argument("--check", type=Path, help="program that measures a grid against its scan")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    kept = options.out / "survey.jsonl"
    done = {(row["scan"], row["length"]) for row in rows_so_far(kept)}
    wished = []
    for scan in scans_in(options.places):
        try:
            each = lengths_of(st.read_points(scan), options.lengths)
            wished += [(turn, scan, length) for turn, length in enumerate(each)]
        except st.ScanTrussError as error:
            print(f"{scan.name}: {error}", flush=True)
    for _, scan, length in sorted(wished, key=lambda each: each[0]):
        if (scan.name, length) in done:
            continue
        row = run(scan, length, options.out, options.effort, options.seconds)
        if options.check and not is_without_grid(row):
            row["check"] = measured(row, scan, options.out, options.check)
        with kept.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
    rows = list(rows_so_far(kept))
    print(table(rows))
    write_sheets(rows, options.out)
    return int(any(not is_without_grid(row) and objections(row) for row in rows))


if __name__ == "__main__":
    sys.exit(main())
