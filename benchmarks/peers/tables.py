"""The rows of the comparison in words and tables: what is lost, what was found, every figure."""

from __future__ import annotations

import csv
import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import groupby

from .runs import Row
from .ways import WAYS

OURS = tuple(found.name for found in WAYS if found.ours)
QUICK, NORMAL = "ScanTruss quick", "ScanTruss normal"
POINTS_WAY = "Instant Meshes on the points"


@dataclass(frozen=True)
class Measure:
    """A figure on which ways are compared."""

    name: str  #: of the figure or time
    words: str
    ours: str  #: which of our efforts is held against the others
    more: bool  #: more is better
    show: str  #: how it is written
    least: float  #: a smaller difference is no loss

    def better(self, one: float, other: float) -> bool:
        """Whether one is better than the other by more than the least difference."""
        gain = one - other if self.more else other - one
        return gain > self.least


MEASURES = (
    Measure("searches", "time in neighbour searches", QUICK, False, ".2f", 0.0),
    Measure("added", "memory added by the work, MB", QUICK, False, ".0f", 1.0),
    Measure("shape_mean", "mean G", NORMAL, True, ".4f", 1e-4),
    Measure("shape_std", "std G", NORMAL, False, ".3f", 1e-3),
    Measure("cv", "CV of the members", NORMAL, False, ".3f", 1e-3),
    Measure("angle_min", "smallest angle", NORMAL, True, ".0f", 1.0),
    Measure("valence6", "share of inner nodes with six members", NORMAL, True, ".2f", 1e-2),
    Measure("deviation", "mean distance of the nodes from the true surface, members", NORMAL, False, ".4f", 1e-4),
    Measure("boundary", "boundary off the true one, members", NORMAL, False, ".2f", 1e-2),
    Measure("uncovered", "share of the scan not covered", NORMAL, False, ".4f", 1e-4),
)


def by_cloud(rows: Iterable[Row]) -> list[list[Row]]:
    """Return the rows cloud by cloud."""
    return [list(group) for _, group in groupby(rows, key=lambda row: row.cloud)]


def row_of(rows: Iterable[Row], name: str) -> Row | None:
    return next((row for row in rows if row.way == name), None)


def losses(rows: Sequence[Row]) -> list[str]:
    """Return where a way whose grid is right is better than ours, by measure; and where ours is not right."""
    found = [
        f"{row.way} on {row.cloud.title}: {row.result if not row.done else 'wrong topology'} {row.words}".rstrip() + "."
        for row in rows
        if row.way in OURS and not row.right and row.result != "missing"
    ]
    for measure in MEASURES:
        counts: dict[str, list[tuple[float, float]]] = {}
        clouds = 0
        for group in by_cloud(rows):
            ours = row_of(group, measure.ours)
            if ours is None or not ours.done:
                continue
            clouds += 1
            for row in group:
                values = row.value(measure.name), ours.value(measure.name)
                if row.way not in OURS and row.right and measure.better(*values):
                    counts.setdefault(row.way, []).append(values)
        for name, pairs in sorted(counts.items(), key=lambda item: -len(item[1])):
            theirs, own = (statistics.median(column) for column in zip(*pairs, strict=True))
            found.append(
                f"{measure.words}: {name} is better than {measure.ours} on {len(pairs)} of {clouds} clouds"
                f" ({theirs:{measure.show}} against {own:{measure.show}}, medians there)."
            )
    return found + [f"Aim missed: {words}." for words, met in aims(rows) if not met]


def _all(groups: list[list[Row]], test: Callable[[list[Row]], bool | None]) -> tuple[int, int]:
    """Return on how many clouds a test holds, and on how many it says anything."""
    answers = [answer for answer in map(test, groups) if answer is not None]
    return sum(answers), len(answers)


def _quick_first(group: list[Row]) -> bool | None:
    """Whether quick is no slower than the fastest right peer, at better CV, G and boundary."""
    ours, peers = row_of(group, QUICK), [row for row in group if row.way not in OURS and row.right]
    if ours is None or not peers:
        return None
    fastest = min(peers, key=lambda row: row.value("searches"))
    boundary = not ours.value("boundary") > fastest.value("boundary")  # neither has one on a closed surface
    better = ours.value("cv") <= fastest.value("cv") and ours.value("shape_mean") >= fastest.value("shape_mean")
    return ours.right and ours.value("searches") <= fastest.value("searches") and better and boundary


def _half_of_instant(group: list[Row]) -> bool | None:
    """Whether normal takes at most half the time of Instant Meshes on the points, its boundary a tenth as far off."""
    ours, other = row_of(group, NORMAL), row_of(group, POINTS_WAY)
    if ours is None or other is None or not other.done:
        return None
    return (
        ours.right
        and ours.value("searches") <= other.value("searches") / 2
        and not ours.value("boundary") > other.value("boundary") / 10
    )


def _five_times(group: list[Row]) -> bool | None:
    """Whether normal is five times faster than every peer that keeps the boundary and reaches our G."""
    ours = row_of(group, NORMAL)
    if ours is None or not ours.done:
        return None
    peers = [
        row for row in group
        if row.way not in OURS and row.right and row.value("shape_mean") >= ours.value("shape_mean") and not row.value("boundary") > 0.1
    ]  # fmt: skip
    return all(5 * ours.value("searches") <= row.value("searches") for row in peers) if peers else None


AIMS = (
    ("`quick` no slower than the fastest way that is right, at better CV, G and boundary", _quick_first),
    (
        "`normal` at most half the time of Instant Meshes on the points, the boundary at most a tenth as far off",
        _half_of_instant,
    ),
    ("`normal` 5 x faster than any way that keeps the boundary within 0.1 member and reaches our G", _five_times),
)


def aims(rows: Sequence[Row]) -> list[tuple[str, bool]]:
    """Return the aims with the number of clouds on which they are met, and whether they are met on all."""
    found = []
    for words, test in AIMS:
        met, asked = _all(by_cloud(rows), test)
        where = (
            f"met on {met} of {asked} clouds to which it applies" if asked else "no way that it asks for on any cloud"
        )
        found.append((f"{words}: {where}", met == asked))
    return found


def _as_right(rows: Sequence[Row], name: str) -> bool:
    """Whether a way is right on every cloud to which it applies and on which ours is right."""
    ours = [row.cloud for row in rows if row.way == NORMAL and row.right]
    asked = [row for row in rows if row.way == name and row.cloud in ours and row.result != "does not apply"]
    return bool(asked) and all(row.right for row in asked)


def findings(rows: Sequence[Row]) -> list[str]:
    """Return one sentence a matter, each with a bold number."""
    found, groups = [], by_cloud(rows)
    here = dict.fromkeys(row.way for row in rows if row.way not in OURS and row.result != "missing")
    rights = [_as_right(rows, name) for name in here]
    if any(row.way == NORMAL for row in rows):
        right = sum(row.right for row in rows if row.way == NORMAL)
        found.append(
            f"Right topology: {NORMAL} on **{right} of {len(groups)}** clouds; of {len(rights)} other programs"
            f" {sum(rights)} on every cloud to which it applies."
        )
    for measure in MEASURES:
        pairs = []
        for group in groups:
            ours = row_of(group, measure.ours)
            values = [row.value(measure.name) for row in group if row.way not in OURS and row.right]
            values = [value for value in values if not math.isnan(value)]
            if ours is not None and ours.right and values and not math.isnan(ours.value(measure.name)):
                pairs.append((ours.value(measure.name), max(values) if measure.more else min(values)))
        if pairs:
            own, best = (statistics.median(column) for column in zip(*pairs, strict=True))
            words = measure.words[0].upper() + measure.words[1:]
            found.append(
                f"{words}: {measure.ours} **{own:{measure.show}}**, the best right way of others {best:{measure.show}}"
                f" (medians of {len(pairs)} clouds)."
            )
    return found


COLUMNS = (
    ("seconds", "seconds", ".2f"),
    ("searches", "searches", ".1f"),
    ("added", "memory", ".0f"),
    ("nodes", "nodes", ".0f"),
    ("length", "length", ".3f"),
    ("shape_mean", "mean G", ".4f"),
    ("shape_std", "std G", ".3f"),
    ("cv", "CV", ".3f"),
    ("angle_min", "angle", ".0f"),
    ("valence6", "six", ".2f"),
    ("deviation", "off", ".4f"),
    ("boundary", "boundary", ".2f"),
    ("uncovered", "bare", ".4f"),
)


def _cell(value: float, show: str) -> str:
    return "" if math.isnan(value) else "none" if math.isinf(value) else f"{value:{show}}"


def topology(row: Row) -> str:
    """Return whether the topology is right, or what it is instead of what."""
    if not row.done:
        return f"{row.result}: {row.words}" if row.words else row.result
    if row.right:
        return "right"
    f = row.found
    loose = "" if f["manifold"] else ", not manifold"
    pieces = "" if f["components"] == 1 else f", {f['components']} pieces"
    return f"wrong: loops {f['loops']} not {f['true_loops']}, Euler {f['euler']} not {f['true_euler']}{loose}{pieces}"


def every_run(rows: Iterable[Row]) -> str:
    """Return every row as CSV."""
    kept = StringIO()
    writer = csv.writer(kept, lineterminator="\n")
    writer.writerow(["cloud", "points", "about nodes", "noise", "way", "topology", *(words for _, words, _ in COLUMNS)])
    for row in rows:
        cloud = row.cloud.shape, row.cloud.points, row.cloud.nodes, f"{row.cloud.noise:g}"
        writer.writerow([*cloud, row.way, topology(row), *(_cell(row.value(name), show) for name, _, show in COLUMNS)])
    return kept.getvalue()


def summary(rows: Sequence[Row]) -> str:
    """Return the table of all clouds with as many points and nodes: medians, and how many grids are right."""
    shown = [column for column in COLUMNS if column[0] != "nodes"]
    lines = ["| way | right | to ours | " + " | ".join(words for _, words, _ in shown) + " |"]
    lines.append("| --- | ---: | ---: |" + " ---: |" * len(shown))
    groups = by_cloud(rows)
    for name in dict.fromkeys(row.way for row in rows):
        own = [row for row in rows if row.way == name]
        if all(row.result == "missing" for row in own):
            lines.append(f"| {name} | missing |" + " |" * (len(shown) + 1))
            continue
        ratios = []
        for group in groups:
            ours, row = row_of(group, NORMAL), row_of(group, name)
            if ours is not None and row is not None and ours.done and row.done:
                ratios.append(row.value("searches") / ours.value("searches"))
        cells = [_median([row.value(column) for row in own], show) for column, _, show in shown]
        lines.append(
            f"| {name} | {sum(row.right for row in own)} of {len(own)} | {_median(ratios, '.1f')} | "
            + " | ".join(cells)
            + " |"
        )
    return "\n".join(lines)


def _median(values: Iterable[float], show: str) -> str:
    known = [value for value in values if not math.isnan(value)]
    return _cell(statistics.median(known), show) if known else ""


def ways_table() -> str:
    """Return what each way was told, and its licence."""
    lines = ["| way | licence | parameters |", "| --- | --- | --- |"]
    return "\n".join([*lines, *(f"| {w.name} | {w.licence} | {w.told} |" for w in WAYS)])


def packages() -> tuple[str, ...]:
    """Return all distributions that take part but our own."""
    return tuple(dict.fromkeys(name for found in WAYS for name in found.packages if name != "scantruss"))
