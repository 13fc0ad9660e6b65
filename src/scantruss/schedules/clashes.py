"""Warnings with places: what is hard or impossible to build as it stands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..layouts.clearance import close_pairs
from ..scan.clean.nearby import Nearby
from .bolts import PITCHES, tension_resistance
from .records import Schedule, Value, column

if TYPE_CHECKING:
    from .parts import Parts

SAME_SIZE = 1e-9  # share of a length or angle within which two are the same
SHORTEST_MEAN, LONGEST_MEAN = 100.0, 20_000.0  # mean length of members beyond which the scale may be wrong [mm]
NO_MOMENT = 1e-6  # [m]: moment over force up to which it is one of rounding
HEAVY_BALLS = "balls are heavier than the node allowance of the structure"
TOO_HEAVY = 1.1  # times its allowance for nodes from which the balls of a structure are too heavy for it
SOME_WEIGHT = 0.02  # share of the mass of the members up to which balls are not worth a warning
MOST_IN_BALLS = 50.0  # share of the length of all members above which the balls are too large for them [%]
WarningRow = tuple[Value, ...]


def warnings_table(parts: Parts) -> Schedule:
    """Return a row for each place that is hard or impossible to build: what, which, how much, the limit and where."""
    rows = [
        *_scale(parts),
        *_small_angles(parts),
        *_clashes(parts),
        *_large_balls(parts),
        *_touching_balls(parts),
        *_crossing(parts),
        *_folds(parts),
        *_of_structure(parts),
        *_heavy_balls(parts),
    ]
    heads = ("warning", "at", "with", "value", "limit", "measure")
    units = {"scan x": parts.unit, "scan y": parts.unit, "scan z": parts.unit}
    names = [*heads, *units]
    values = list(zip(*rows, strict=True)) or [()] * len(names)
    return Schedule(
        "Warnings", tuple(column(name, units.get(name, ""), each) for name, each in zip(names, values, strict=True))
    )


def _scale(parts: Parts) -> list[WarningRow]:
    """Members so short or long that the scale or unit may be wrong."""
    mean = float(parts.length.mean())
    if SHORTEST_MEAN <= mean <= LONGEST_MEAN:
        return []
    limit = SHORTEST_MEAN if mean < SHORTEST_MEAN else LONGEST_MEAN
    return [("is the scale right? mean length of members", None, None, mean, limit, "mm", None, None, None)]


def _at_node(
    parts: Parts, words: str, chosen: np.ndarray, value: np.ndarray, limit: np.ndarray, measure: str
) -> list[WarningRow]:
    """Rows for pairs of members at a node."""
    one, two = (parts.joints.pairs[chosen, k] for k in (0, 1))
    nodes = parts.joints.node[one]
    return [
        (
            words,
            parts.node_marks[node],
            f"{parts.member_marks[a]} {parts.member_marks[b]}",
            each,
            most,
            measure,
            *parts.grid.scan_nodes[node].tolist(),
        )
        for node, a, b, each, most in zip(
            nodes.tolist(),
            parts.joints.member[one].tolist(),
            parts.joints.member[two].tolist(),
            value[chosen].tolist(),
            limit[chosen].tolist(),
            strict=True,
        )
    ]


def _small_angles(parts: Parts) -> list[WarningRow]:
    """Members that meet at a small angle."""
    angle, limit = parts.joints.angle, parts.settings.least_angle
    chosen = np.flatnonzero(angle < limit * (1.0 - SAME_SIZE))
    return _at_node(parts, "small angle between members", chosen, angle, np.full(len(angle), limit), "degree")


def _clashes(parts: Parts) -> list[WarningRow]:
    """Members that overlap outside their ball, and members of which the balls leave nothing."""
    ball = 2.0 * parts.radius[parts.joints.node[parts.joints.pairs[:, 0]]]
    chosen = np.flatnonzero(2.0 * parts.clear > ball * (1.0 + SAME_SIZE))
    rows = _at_node(parts, "members overlap outside the ball", chosen, ball, 2.0 * parts.clear, "mm")
    for member in np.flatnonzero(parts.cut <= parts.length * SAME_SIZE).tolist():
        a, b = parts.grid.edges[member].tolist()
        place = parts.grid.scan_nodes[[a, b]].mean(axis=0)
        rows.append(
            ("balls leave no member", parts.member_marks[member], f"{parts.node_marks[a]} {parts.node_marks[b]}",
             float(parts.cut[member]), 0.0, "mm", *place.tolist())
        )  # fmt: skip
    return rows


def _large_balls(parts: Parts) -> list[WarningRow]:
    """Balls in which most of the members end, as those of tubes too thick for their length [% of the length of the members]."""
    share = 100.0 * (1.0 - float(np.maximum(parts.cut, 0.0).sum() / parts.length.sum()))
    if share <= MOST_IN_BALLS:
        return []
    measure = "% of the length of the members"
    return [("balls take most of the members", None, None, share, MOST_IN_BALLS, measure, None, None, None)]


def _touching_balls(parts: Parts) -> list[WarningRow]:
    """Balls of nodes without a common member that touch, each compared with the nearest nodes."""
    used = np.flatnonzero(parts.joints.valence)
    nearby = Nearby.of(parts.grid.nodes[used])
    neighbors = nearby.in_order(np.where(nearby.neighbors < 0, -1, nearby.tree.ids[nearby.neighbors]))
    item, rank = np.nonzero(neighbors >= 0)
    one, two = used[item], used[neighbors[item, rank]]
    pairs = np.unique(np.sort(np.stack([one, two], axis=1), axis=1), axis=0)
    count = len(parts.grid.nodes)
    joined = np.isin(pairs @ [count, 1], parts.grid.edges @ [count, 1])
    apart = np.linalg.norm(parts.grid.nodes[pairs[:, 0]] - parts.grid.nodes[pairs[:, 1]], axis=1) * parts.size
    least = parts.radius[pairs].sum(axis=1)
    chosen = np.flatnonzero(~joined & (apart <= least * (1.0 + SAME_SIZE)))
    return [
        ("balls touch", parts.node_marks[a], parts.node_marks[b], distance, most, "mm",
         *parts.grid.scan_nodes[[a, b]].mean(axis=0).tolist())
        for (a, b), distance, most in zip(pairs[chosen].tolist(), apart[chosen].tolist(), least[chosen].tolist(), strict=True)
    ]  # fmt: skip


def _crossing(parts: Parts) -> list[WarningRow]:
    """Members of layers without a common node that come closer than their diameters."""
    if parts.joints.one_layer:
        return []
    width = parts.stock.width
    pairs, apart = close_pairs(parts.grid.nodes * parts.size, parts.grid.edges, width / 2.0)
    return [
        ("members closer than their diameters", parts.member_marks[a], parts.member_marks[b], distance, least, "mm",
         *parts.grid.scan_nodes[parts.grid.edges[[a, b]]].mean(axis=(0, 1)).tolist())
        for (a, b), distance, least in zip(pairs.tolist(), apart.tolist(), width[pairs].mean(axis=1).tolist(), strict=True)
    ]  # fmt: skip


def _folds(parts: Parts) -> list[WarningRow]:
    """Sharp folds between panels."""
    fold = np.minimum(parts.fold, 360.0 - parts.fold)
    limit = parts.settings.least_fold
    rows: list[WarningRow] = []
    for member in np.flatnonzero(fold < limit * (1.0 - SAME_SIZE)).tolist():
        one, two = parts.grid.edge_panels[member].tolist()
        place = parts.grid.scan_nodes[parts.grid.edges[member]].mean(axis=0)
        rows.append(
            ("sharp fold", parts.member_marks[member], f"{parts.panel_marks[one]} {parts.panel_marks[two]}",
             float(fold[member]), limit, "degree", *place.tolist())
        )  # fmt: skip
    return rows


def _of_structure(parts: Parts) -> list[WarningRow]:
    """Members of a structure that are slender, used beyond 1, or without a bolt that carries them; moments that no bolt carries."""
    if (forces := parts.forces) is None:
        return []
    limit = parts.settings.slenderness
    found = [("slender member", forces.slenderness, limit, "", forces.slenderness > limit * (1.0 + SAME_SIZE))]
    if (used := forces.utilization) is not None:
        found.append(("utilization above one", used, 1.0, "", used > 1.0))
    rows: list[WarningRow] = []
    if parts.bolt is not None:
        most = tension_resistance(max(PITCHES), parts.settings.bolts) / 1000.0
        found.append(("no bolt carries the tension", forces.high / 1000.0, most, "kN", parts.bolt == 0))
        moment = (
            0.0 if forces.truss.pinned else float(forces.moment.max()) / 1000.0
        )  # hinges leave moments between nodes only
        if moment > NO_MOMENT * max(1.0, float(forces.high.max()) / 1000.0):
            at = parts.member_marks[int(forces.moment.argmax())]
            rows.append(
                ("bolts are chosen for tension and carry no moments", at, None, moment, None, "kNm", None, None, None)
            )
    for words, value, most, measure, chosen in found:
        for member in np.flatnonzero(chosen).tolist():
            place = parts.grid.scan_nodes[parts.grid.edges[member]].mean(axis=0)
            rows.append((words, parts.member_marks[member], None, float(value[member]), most, measure, *place.tolist()))
    return rows


def _heavy_balls(parts: Parts) -> list[WarningRow]:
    """Balls that weigh more than the self-weight of the structure allows for its nodes [% of the mass of its members]."""
    balls = parts.ball_masses
    if balls is None or parts.forces is None or not parts.forces.truss.mass:
        return []
    truss = parts.forces.truss
    weight = sum(case.self_weight for case in truss.cases)
    share, allowed = float(balls.sum()) / truss.mass, weight - 1.0
    if weight <= 0.0 or share <= max(TOO_HEAVY * allowed, SOME_WEIGHT):
        return []
    return [(HEAVY_BALLS, None, None, 100.0 * share, 100.0 * allowed, "% of the mass of the members", None, None, None)]
