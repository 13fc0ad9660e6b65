"""Drawings of a setting out: a plan, the sections and the unrolled boundaries, as lines and words in millimetres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..layouts.framework import Framework

if TYPE_CHECKING:
    from .make import SettingOut

MEMBER_LINES, BOUNDARY_LINES, SUPPORT_MARKS, NODE_MARKS, MEMBER_MARKS, SECTION_LINES, HEIGHT_LINES, GROUND_LINES = (
    "MEMBERS", "BOUNDARY", "SUPPORTS", "NODE_MARKS", "MEMBER_MARKS", "SECTIONS", "HEIGHTS", "GROUND",
)  # fmt: skip
LAYERS = (
    MEMBER_LINES,
    BOUNDARY_LINES,
    SUPPORT_MARKS,
    NODE_MARKS,
    MEMBER_MARKS,
    SECTION_LINES,
    HEIGHT_LINES,
    GROUND_LINES,
)
# where heights are written, and room between rows, over the height of words
HEIGHTS_BELOW, ROOM_BETWEEN_ROWS = 6.4, 22.0
# distance of words beside each other, and length of lines that lead to them, over the height of words
WORDS_BESIDE, LEADER_LENGTH = 1.3, 1.2
WORD_HEIGHT = 0.11  # height of marks over the median length of members, as they are seen in plan


@dataclass(frozen=True, eq=False)
class Words:
    """Words on a drawing, their middle at `place`."""

    layer: str
    text: str
    place: tuple[float, float]
    angle: float = 0.0  #: [degree]


@dataclass(frozen=True, eq=False)
class Sheet:
    """One drawing, true to size."""

    title: str
    lines: list[tuple[str, np.ndarray]]  #: layer and (K, 2) points
    words: list[Words]
    height: float  #: of the words

    @property
    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest corner, with room for the words."""
        points = np.concatenate([line for _, line in self.lines])
        return points.min(axis=0) - 10 * self.height, points.max(axis=0) + 5 * self.height


def make_sheets(made: SettingOut) -> list[Sheet]:
    """Return the plan, of layers one of each and of the webs between, a sheet for each section and one for each boundary."""
    flat = made.places[:, :2]
    spans = np.linalg.norm(np.diff(flat[made.grid.edges], axis=1)[:, 0], axis=1)
    height = WORD_HEIGHT * float(np.median(spans))
    return [
        *(_plan(made, height, title, members) for title, members in _plans(made)),
        *(_section(made, number, height) for number in range(len(made.section_lines))),
        *(_unrolled(made, number, height) for number in range(len(made.boundaries))),
    ]


def _plans(made: SettingOut) -> list[tuple[str, np.ndarray]]:
    """Return the titles of the plans and their members."""
    if not isinstance(made.grid, Framework) or made.grid.layers is None:
        return [("Plan", np.arange(len(made.grid.edges)))]
    groups = np.array(made.grid.own_groups)
    return [(f"Plan, {name}", np.flatnonzero(groups == name)) for name in dict.fromkeys(made.grid.own_groups)]


def _plan(made: SettingOut, height: float, title: str, members: np.ndarray) -> Sheet:
    flat, edges = made.places[:, :2], made.grid.edges[members]
    on_boundary = (made.grid.edge_uses == 1)[members]
    lines = [
        (BOUNDARY_LINES if outer else MEMBER_LINES, flat[edge])
        for edge, outer in zip(edges, on_boundary.tolist(), strict=True)
    ]
    held = np.intersect1d(np.flatnonzero(made.held.any(axis=1)), edges)
    lines += [(SUPPORT_MARKS, _diamond(flat[node], height)) for node in held]
    low, high = flat[np.unique(edges)].min(axis=0) - 3 * height, flat[np.unique(edges)].max(axis=0) + 3 * height
    words = []
    for section in made.section_lines:
        ends = np.array([low, high])
        ends[:, section.axis] = section.place
        lines.append((SECTION_LINES, ends))
        words.append(Words(SECTION_LINES, section.name, (float(ends[1, 0]), float(ends[1, 1]))))
    used = np.unique(edges)
    words += [
        Words(NODE_MARKS, made.node_marks[k], (x, y + 0.9 * height))
        for k, (x, y) in zip(used.tolist(), flat[used].tolist(), strict=True)
    ]
    for mark, (a, b) in zip([made.member_marks[k] for k in members.tolist()], flat[edges], strict=True):
        x, y = ((a + b) / 2).tolist()
        angle = float(np.degrees(np.arctan2(b[1] - a[1], b[0] - a[0])))
        words.append(Words(MEMBER_MARKS, mark, (x, y), (angle + 90.0) % 180.0 - 90.0))
    return Sheet(title, _with_room(lines, height), words, height)


def _section(made: SettingOut, number: int, height: float) -> Sheet:
    line = made.section_lines[number]
    flat = [1 - line.axis, 2]
    ground = float(made.places[np.unique(made.grid.edges), 2].min())
    lines = [(MEMBER_LINES, segment[:, flat]) for segment in line.segments]
    lines.append((GROUND_LINES, np.array([(line.flat[0, 0], ground), (line.flat[-1, 0], ground)])))
    words = []
    beside = _apart(line.flat[:, 0], WORDS_BESIDE * height).tolist()
    for (x, z), aside, node, member in zip(
        line.flat.tolist(), beside, line.nodes.tolist(), line.members.tolist(), strict=True
    ):
        lines.append((HEIGHT_LINES, np.array([(x, ground), (x, z)])))
        lines.append((HEIGHT_LINES, np.array([(x, ground), (aside, ground - LEADER_LENGTH * height)])))
        lines.append((MEMBER_LINES, np.array([(x, z), (aside, z + 0.4 * LEADER_LENGTH * height)])))
        mark = made.node_marks[node] if node >= 0 else made.member_marks[member]
        words.append(Words(NODE_MARKS if node >= 0 else MEMBER_MARKS, mark, (aside, z + 2.4 * height), 90.0))
        words.append(Words(HEIGHT_LINES, f"{x:.0f} / {z:.0f}", (aside, ground - HEIGHTS_BELOW * height), 90.0))
    return Sheet(f"Section {line.name}", _with_room(lines, height), words, height)


def _apart(places: np.ndarray, gap: float) -> np.ndarray:
    """Return places (K,) in their order, moved as little as can be so that they are a gap apart: isotonic regression."""
    groups: list[tuple[float, int]] = []  # mean and number of places that are moved together, their gaps taken off
    for place in (places - gap * np.arange(len(places))).tolist():
        mean, count = place, 1
        while groups and groups[-1][0] > mean:  # ends: each turn takes a group away
            other, more = groups.pop()
            mean, count = (mean * count + other * more) / (count + more), count + more
        groups.append((mean, count))
    return np.repeat([mean for mean, _ in groups], [count for _, count in groups]) + gap * np.arange(len(places))


def _unrolled(made: SettingOut, number: int, height: float) -> Sheet:
    """Return the boundary in rows no longer than the plan, each beginning at the node that ends the one before."""
    each = made.boundaries[number]
    ground, used = float(each.height.min()), np.unique(made.grid.edges)
    longest = max(float(np.ptp(made.places[used, :2], axis=0).max()), float(np.diff(each.along).max()))
    down = float(np.ptp(each.height)) + ROOM_BETWEEN_ROWS * height
    nodes = np.append(each.nodes, each.nodes[0])
    lines: list[tuple[str, np.ndarray]] = []
    words: list[Words] = []
    begin, row = 0, 0
    while begin < len(nodes) - 1:  # a row takes one member at least
        end = int(np.searchsorted(each.along, each.along[begin] + longest * (1 + 1e-9), "right"))
        shift = np.array([each.along[begin], ground + row * down])
        flat = np.stack([each.along, each.height], axis=1)[begin:end] - shift
        low = -row * down
        lines += [(BOUNDARY_LINES, flat), (GROUND_LINES, np.array([(0.0, low), (float(flat[-1, 0]), low)]))]
        for node, (x, z), along, true in zip(
            nodes[begin:end].tolist(), flat.tolist(), each.along[begin:end], each.height[begin:end], strict=True
        ):
            lines.append((HEIGHT_LINES, np.array([(x, low), (x, z)])))
            words.append(Words(NODE_MARKS, made.node_marks[node], (x, z + 2.2 * height), 90.0))
            words.append(Words(HEIGHT_LINES, f"{along:.0f} / {true:.0f}", (x, low - HEIGHTS_BELOW * height), 90.0))
            if made.held[node].any():
                lines.append((SUPPORT_MARKS, _diamond(np.array([x, z]), height)))
        begin, row = end - 1, row + 1
    return Sheet(f"Boundary {number + 1}, unrolled", _with_room(lines, height), words, height)


def _with_room(lines: list[tuple[str, np.ndarray]], height: float) -> list[tuple[str, np.ndarray]]:
    """Return lines of which none has no length: heights of nodes on the ground, members that stand upright."""
    return [(layer, line) for layer, line in lines if np.ptp(line, axis=0).max() > 1e-3 * height]


def _diamond(place: np.ndarray, height: float) -> np.ndarray:
    """Return a closed mark around a support."""
    return place[:2] + 0.7 * height * np.array([(1, 0), (0, 1), (-1, 0), (0, -1), (1, 0)])
