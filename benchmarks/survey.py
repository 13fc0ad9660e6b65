"""`grid` as a user calls it, on every scan at several lengths: python -m benchmarks.survey FOLDER_OR_SCAN... --out DIR [--lengths 10].

Each line of DIR/survey.jsonl is a run: the verdict, the line of a refusal, and what an independent measure finds. With `--check FILE`
that measure is a program that is called as `FILE GRID.obj --cloud SCAN --length L --json`. At the end a table, and what a grid that
passed must not have. Runs that are there already are not done again.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

import scantruss as st
from scantruss.check.limits import NOISES_OFF
from scantruss.cli.main import main as scantruss_main
from scantruss.scan.member_length import length_range, round_length, suggest_length

SUFFIXES = {".ply", ".xyz", ".csv", ".las", ".laz", ".e57", ".pcd", ".obj"}
WIDEST = 3.0  # the longest length tried is so many times the usual one, the shortest as small a part of it
MOST_MEMBERS = 60_000  # of a run, estimated by the square of the extent
LEAST_ANGLE, SHORTEST, LONGEST, FARTHEST, MOST_MISSED = 15.0, 0.5, 1.8, 0.1, 0.05  # what a grid that can be built keeps
ROUNDING = 1e-3  # of the figures of a text file


def scans_in(places: Iterable[Path]) -> list[Path]:
    """Return the scans among files and in folders, in their order; scans in frames of their own are not looked for."""
    found: list[Path] = []
    for place in places:
        files = sorted(place.iterdir()) if place.is_dir() else [place]
        found += [file for file in files if file.suffix.lower() in SUFFIXES]
    return found


def lengths_of(cloud: st.PointCloud, count: int) -> list[float]:
    """Return lengths that the scan carries, the usual one first and then ever farther from it [scan unit]."""
    low, high = length_range(cloud)
    usual = suggest_length(cloud)
    least = float(np.sqrt(np.prod(np.sort(np.ptp(cloud.points, axis=0))[1:]) * 3.5 / MOST_MEMBERS))
    shares = np.exp(np.linspace(-np.log(WIDEST), np.log(WIDEST), count))
    wished = usual * shares[np.argsort(np.abs(np.log(shares)), kind="stable")]
    kept = (min(max(round_length(length, "nearest"), low, round_length(least, "up")), high) for length in wished)
    return list(dict.fromkeys(kept))


def run(scan: Path, length: float, folder: Path, effort: str) -> dict[str, Any]:
    """Make a grid by the command line and return what it says."""
    stem = folder / f"{scan.stem}_{length:g}"
    words = [
        "grid",
        str(scan),
        f"{stem}.json",
        f"{stem}.obj",
        f"{stem}.png",
        "--length",
        f"{length:g}",
        "--effort",
        effort,
    ]
    said, noted, started = io.StringIO(), io.StringIO(), perf_counter()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(noted):
        status = scantruss_main([*words, "--force"])
    lines = noted.getvalue().strip().splitlines()
    row: dict[str, Any] = {"scan": scan.name, "length": length, "status": status, "seconds": perf_counter() - started}
    if status:
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
    lines, below = ["scan  passed  warnings  refused"], []
    for name, own in by_scan.items():
        count = Counter(row["verdict"] for row in own)
        lines.append(f"{name}  {count['passed']}  {count['warnings']}  {count['refused']}")
        for row in own:
            words = row["line"] if row["verdict"] == "refused" else "; ".join(objections(row))
            below += [f"{name} {row['length']:g} {row['verdict']}: {words}"] if words else []
    return "\n".join([*lines, "", *below])


def main() -> int:
    """Run what is missing and print the table; the exit status is 1 if a grid passed that should not have."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("places", nargs="+", type=Path, help="scans, or folders of scans")
    parser.add_argument("--out", type=Path, required=True, help="folder of grids, pictures and survey.jsonl")
    parser.add_argument("--lengths", type=int, default=10, help="lengths for each scan (default 10)")
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--check", type=Path, help="program that measures a grid against its scan")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    kept = options.out / "survey.jsonl"
    done = {(row["scan"], row["length"]) for row in rows_so_far(kept)}
    for scan in scans_in(options.places):
        try:
            wished = lengths_of(st.read_points(scan), options.lengths)
        except st.ScanTrussError as error:
            wished, line = [], str(error)
            print(f"{scan.name}: {line}", flush=True)
        for length in wished:
            if (scan.name, length) in done:
                continue
            row = run(scan, length, options.out, options.effort)
            if options.check and row["verdict"] != "refused":
                row["check"] = measured(row, scan, options.out, options.check)
            with kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
    rows = list(rows_so_far(kept))
    print(table(rows))
    return int(any(row["verdict"] != "refused" and objections(row) for row in rows))


if __name__ == "__main__":
    sys.exit(main())
