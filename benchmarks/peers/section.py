"""The section "Against everyone" of docs/numbers.md, the parameters in docs/peers.md, every run in docs/peers.csv, and the plots."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path

from ..page import FILE, Section
from . import tables
from .clouds import Cloud
from .plots import draw
from .runs import REPEATS, Row, all_rows
from .ways import WAYS, Way

LIMIT = 300.0  #: of one run, with its imports and repetitions [s]
QUICK_LIMIT, QUICK_REPEATS = 30.0, 1
QUICK_CLOUDS = (Cloud("scallop", 100_000, 1_000, 0.3), Cloud("great_court", 100_000, 1_000, 0.0))
QUICK_WAYS = tuple(way for way in WAYS if way.name != "ScanTruss best")
INTRO = """\
# Against everyone: parameters

What each program was told, and its licence. Its results are in [numbers](numbers.md#against-everyone), where the columns are
explained, and [every run, as CSV](peers.csv)."""
NOTE = """\
Each run is a separate process with a time limit, on points in memory. Only the work is timed, without imports and reading. A
first call under 5 s is repeated three times (with --quick once) and the median counts, for every program. Ours is always
repeated, so that no call that compiles counts (the first run ever is in the section Speed). Conversions into the types of a
package count as its time, as do thinning and normals. Memory: what the work and the points add to the process at its peak
(/proc), in MB, without the program itself. Searches: seconds over those of a neighbour search (scipy cKDTree, 16 neighbours, two
threads) in the same process just after; times are compared by these, as rows may come from runs under different load. To ours:
searches over those of ScanTruss normal, median of the clouds. Length: mean member length over the desired one. Angle: the
smallest. Six: share of inner nodes with six members. Off: mean distance of the nodes from the true surface, in members. Boundary:
largest distance between the boundary of the grid and the true one, either way, in members. Bare: share of the scan farther than
half a member from the grid. Right: manifold, orientable, with the loops, pieces and Euler number of the true surface. Noise is
the standard deviation of each coordinate, over the median distance to the nearest neighbour. Out of time or not run (out of time
already on an easier cloud of the same surface): the limit was not enough. The other programs are only run here; ScanTruss neither
ships nor imports them. On Linux Open3D needs libusb-1.0 of the system; without it all its rows are missing."""


def section(rows: Sequence[Row], command: str, folder: Path = FILE.parent) -> Section:
    """Return the section of some rows; the complete tables and the plots are written beside the page."""
    names = draw(rows, folder)
    (folder / "peers.csv").write_text(tables.every_run(rows), encoding="utf-8", newline="\n")
    (folder / "peers.md").write_text(f"{INTRO}\n\n{tables.ways_table()}\n", encoding="utf-8", newline="\n")
    ordered = sorted(rows, key=lambda row: (row.cloud.points, row.cloud.nodes))
    parts = []
    for (points, nodes), group in groupby(ordered, key=lambda row: (row.cloud.points, row.cloud.nodes)):
        some = list(group)
        count = len(tables.by_cloud(sorted(some, key=lambda row: row.cloud.title)))
        title = f"### {points:,} points, about {nodes:,} nodes: medians of {count} cloud{'s' * (count > 1)}"
        parts.append(f"{title}\n\n{tables.summary(sorted(some, key=lambda row: row.cloud.title))}")
    findings = tables.findings(rows)
    met = [f"- {words}." for words, _ in tables.aims(rows)]
    clouds = "Clouds: " + "; ".join(dict.fromkeys(row.cloud.title for row in rows)) + "." if len(parts) == 1 else ""
    text = "\n\n".join(
        part
        for part in (
            "\n".join(f"- {finding}" for finding in findings[1:]),
            "Aims:\n\n" + "\n".join(met),
            NOTE,
            clouds,
            "[Every run](peers.csv); [parameters and licences of each program](peers.md).",
            f"![seconds and CV of all grids]({names[0]})\n\n![boundary and CV of all grids]({names[1]})",
            *parts,
        )
        if part
    )
    lost = tuple(tables.losses(rows))
    return Section("Against everyone", command, findings[0] if findings else "", text, lost, tables.packages())


def measured(
    clouds: Iterable[Cloud], ways: Iterable[Way], *, limit: float, repeats: int = REPEATS, fresh: bool = False
) -> list[Row]:
    """Return the rows, telling each as it comes."""
    rows = []
    for row in all_rows(clouds, ways, limit=limit, repeats=repeats, fresh=fresh):
        took = f" {row.times['seconds']:.2f} s" if row.done else ""
        print(f"{row.cloud.title}: {row.way}: {tables.topology(row)}{took}", flush=True)
        rows.append(row)
    return rows
