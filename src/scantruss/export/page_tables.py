"""The rows that a page shows of nodes, members and panels, and the places of the certificate."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from ..check.folds import fold_angles
from ..errors import words_of_count, words_of_number
from ..grid.alike import JOINTS, PANELS
from ..grid.certificate import Certificate
from ..grid.grid import Grid
from ..grid.panels import planarity_of, shape_qualities_of, side_lengths_of
from ..layouts.kinds import families_of_grid, kinds_of_grid
from .drawing.structure import OVERUSED_COLOUR
from .model import Model

OFF_PLANE = "off its plane / diagonal"  # name of a column of panels
COLORINGS: tuple[tuple[str, str, str, float | None], ...] = (  # kind, column, words, middle of a diverging scale
    ("members", "utilization", "utilization", None),
    ("members", "axial force", "axial force of the greatest size, tension positive", 0.0),
    ("members", "length", "member length", None),
    ("members", "length / desired", "length over the desired length", 1.0),
    ("members", "fold", "angle between the panels, 180 where level", None),
    ("members", "family", "family of lengths, shortest first", None),
    ("panels", "kind", "kind of panel, the most frequent first", None),
    ("nodes", "kind", "kind of joint, the most frequent first", None),
    ("panels", "quality", "quality of panels, 1 regular", None),
    ("panels", OFF_PLANE, "panels off their plane, over the mean diagonal", None),
    ("nodes", "members", "members at a node", None),
    ("nodes", "distance from scan", "distance of nodes from the scan", None),
)


COLUMN_DIGITS, MOST_PLACE_DIGITS = 6, 15  #: of a number; of a coordinate far from the origin


class PageColumn(NamedTuple):
    """A column of a table in the page."""

    name: str
    unit: str
    values: list[Any]  #: one for each node, member or panel; None where it is not known


Tables = dict[str, list[PageColumn]]


def page_column(name: str, unit: str, values: Iterable[Any] | np.ndarray, digits: int = COLUMN_DIGITS) -> PageColumn:
    """Return a column of plain values; NaN becomes None, and numbers keep so many digits."""
    plain = values.tolist() if isinstance(values, np.ndarray) else list(values)
    if not any(isinstance(value, float) for value in plain):
        return PageColumn(name, unit, plain)
    if not all(isinstance(value, float) and math.isfinite(value) for value in plain):
        return PageColumn(name, unit, [_short(value, digits) if isinstance(value, float) else value for value in plain])
    return PageColumn(name, unit, list(map(float, (f"%.{digits}g " * len(plain) % tuple(plain)).split())))


def _short(value: float, digits: int) -> float | None:
    return float(f"{value:.{digits}g}") if math.isfinite(value) else None


class Pin(NamedTuple):
    """A place of the certificate."""

    words: str
    value: str
    where: tuple[float, float, float]  #: in the scan's own frame [scan unit]


def tables_of(model: Model, made_of: Grid | None = None) -> Tables:
    """Return the columns of nodes, members and panels, the marks first; coordinates in the frame of the scan.

    Parameters
    ----------
    made_of : Grid, optional
        What a structure was made of, whose columns come too where it has the same nodes and members.
    """
    unit, ends, corners = model.unit, model.members, model.panels
    valence = np.bincount(ends.ravel(), minlength=len(model.local))
    nodes = [page_column("node", "", model.node_marks)]
    digits = digits_of_places(model.nodes)
    nodes += [page_column(axis, unit, model.nodes[:, k], digits) for k, axis in enumerate("xyz")]
    nodes.append(page_column("members", "", valence))
    members = [
        page_column("member", "", model.member_marks),
        *(page_column(name, "", _marks(model, ends[:, k])) for k, name in enumerate(("start", "end"))),
        page_column("group", "", [model.groups[k] for k in model.group_of.tolist()]),
        page_column("length", unit, model.lengths),
    ]
    sides, width = side_lengths_of(model.local, corners), range(corners.shape[1])
    marks = [*model.node_marks, ""]
    panels = [
        page_column("panel", "", model.panel_marks),
        *(page_column(f"node {k + 1}", "", [marks[v] for v in corners[:, k].tolist()]) for k in width),
        *(page_column(f"side {k + 1}", unit, sides[:, k]) for k in width),
        page_column("quality", "", shape_qualities_of(model.local, corners)),
    ]
    if corners.shape[1] > 3:
        panels.append(page_column(OFF_PLANE, "", planarity_of(model.local, corners)))
    if model.truss is not None:
        held = np.isin(np.arange(len(model.local)), model.supported)
        nodes.append(page_column("support", "", ["yes" if each else "no" for each in held.tolist()]))
        members += _of_structure(model)
    grid = model.grid if model.truss is None else made_of
    if grid is not None and np.array_equal(np.sort(grid.edges), np.sort(model.members)):
        nodes += _of_grid(grid)
        members += _members_of_grid(grid)
        nodes += _kinds_of_grid(grid, JOINTS)
        panels += _kinds_of_grid(grid, PANELS)
    return {"nodes": nodes, "members": members, "panels": panels}


def digits_of_places(places: np.ndarray) -> int:
    """Return how many digits coordinates (N, 3) need, so that far from the origin six are left within their extent."""
    if not len(places):
        return COLUMN_DIGITS
    extent, far = float(np.ptp(places, axis=0).max()), float(np.abs(places).max())
    return (
        min(COLUMN_DIGITS + max(0, math.ceil(math.log10(far / extent))), MOST_PLACE_DIGITS)
        if extent > 0
        else MOST_PLACE_DIGITS
    )


def _marks(model: Model, ids: np.ndarray) -> list[str]:
    return [model.node_marks[k] for k in ids.tolist()]


def _of_grid(grid: Grid) -> list[PageColumn]:
    """Return what is known of the nodes of a grid alone."""
    columns = [page_column("fixed", "", ["yes" if each else "no" for each in grid.fixed.tolist()])]
    if grid.deviation is not None:
        columns.append(page_column("distance from scan", grid.unit, grid.deviation))
    return columns


def _members_of_grid(grid: Grid) -> list[PageColumn]:
    """Return what is known of the members of a grid alone."""
    columns = [page_column("fold", "degree", fold_angles(grid))] if grid.topology.manifold else []
    if grid.desired is not None or grid.settings is not None:
        length = grid.settings.length if grid.settings is not None else 1.0
        columns.insert(0, page_column("length / desired", "", grid.stretches(length)))
    if (families := families_of_grid(grid)) is not None:
        columns.append(page_column("family", "", 1 + families[1]))
    return columns


def _kinds_of_grid(grid: Grid, parts: str) -> list[PageColumn]:
    """Return the kinds of joints or panels, from 1, where they were made alike."""
    found = kinds_of_grid(grid, parts)
    if found is None:
        return []
    rank = np.argsort(np.argsort(-np.bincount(found.of[found.of >= 0]), kind="stable"), kind="stable")
    kinds = np.where(found.of >= 0, 1 + rank[found.of], -1).tolist()
    return [page_column("kind", "", [each if each > 0 else None for each in kinds])]


def _of_structure(model: Model) -> list[PageColumn]:
    """Return sections, forces and checks of the members of a structure."""
    truss, solution = model.truss, model.solution
    assert truss is not None
    columns = [page_column("section", "", [truss.sections[k].name for k in truss.section_of.tolist()])]
    if solution is not None:
        axial = np.stack([result.axial for result in solution.all_results()]) / 1000.0
        low, high = axial[:, :, 0].min(axis=0), axial[:, :, 1].max(axis=0)
        columns += [page_column("force min", "kN", low), page_column("force max", "kN", high)]
        columns.append(page_column("axial force", "kN", np.where(-low > high, low, high)))
    if model.utilization is not None:
        columns.append(page_column("utilization", "", model.utilization))
    if model.report is not None and model.report.utilization is not None:
        columns.append(page_column("governed by", "", model.report.governing))
    return columns


def colorings_of(tables: Tables) -> list[dict[str, Any]]:
    """Return the colourings for which there are values."""
    found = []
    for kind, name, words, middle in COLORINGS:
        values = next((each.values for each in tables[kind] if each.name == name), ())
        if any(value is not None for value in values):
            more: dict[str, Any] = {} if middle is None else {"middle": middle}
            if name == "utilization":
                more["most"] = [1.0, OVERUSED_COLOUR]  # what is more has a colour of its own, as in pictures
            found.append({"kind": kind, "name": name, "words": words, **more})
    return found


def pins_of(certificate: Certificate) -> list[Pin]:
    """Return the places of faults, warnings, the worst figures and what is left out."""
    unit = f" {certificate.unit}" if certificate.unit else ""
    pins = [
        Pin(f"{kind}: the grid {fault.words}", f"place {number}" if fault.also else "", where)
        for kind, faults in (("fault", certificate.faults), ("warning", certificate.warnings))
        for fault in faults
        for number, where in enumerate((fault.where, *fault.also), 1)
        if where is not None
    ]
    pins += [
        Pin(name, f"{words_of_number(worst.value, 4)}{' degrees' if of_angle else unit}", worst.where)
        for name, worst, of_angle in certificate.worst_places()
    ]
    return pins + [
        Pin(f"left out: {part.words}", words_of_count(part.points, "point") if part.points else "", part.where)
        for part in certificate.left_out
        if part.where is not None and part.kind != "far"
    ]
