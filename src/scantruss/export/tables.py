"""XLSX: a grid or a structure as the sheets of one workbook, all that it holds in words and numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from ..runtime.ours import MADE_BY
from .model import Model
from .style import FileStyle
from .workbook import encode_workbook

if TYPE_CHECKING:
    from ..structure.results import Solution
    from ..structure.truss import LoadCase, Truss

FORCE_HEADS = ("Fx [N]", "Fy [N]", "Fz [N]", "Mx [Nm]", "My [Nm]", "Mz [Nm]")
MOTION_HEADS = ("ux [m]", "uy [m]", "uz [m]", "rx [rad]", "ry [rad]", "rz [rad]")
STIFFNESS_HEADS = ("ux [N/m]", "uy [N/m]", "uz [N/m]", "rx [Nm/rad]", "ry [Nm/rad]", "rz [Nm/rad]")
RELEASES = ("start My", "start Mz", "end My", "end Mz")  #: rotational springs at the ends of a member

SheetRow = tuple[Any, ...]


def encode_xlsx_model(model: Model, style: FileStyle) -> bytes:
    """Return the workbook; stiffness that is infinite is "rigid"."""
    sheets = {"Model": _model_sheet(model), **_geometry(model)}
    if model.truss is not None:
        sheets |= _structure_sheets(model.truss)
    if model.solution is not None:
        sheets |= _result_sheets(model.solution)
    return encode_workbook(sheets)


def _model_sheet(model: Model) -> list[SheetRow]:
    rows: list[SheetRow] = [
        ("made by", MADE_BY),
        ("unit", model.unit or "not known"),
        ("reference system", model.system or "not known"),
        *((f"origin {axis}", value) for axis, value in zip("xyz", model.origin.tolist(), strict=True)),
        ("nodes", len(model.local)),
        ("members", len(model.members)),
        ("panels", len(model.panels)),
    ]
    if model.truss is not None:
        rows += [("joints", "pinned" if model.truss.pinned else "rigid or springs"), ("scale", model.truss.scale)]
    return rows


def _geometry(model: Model) -> dict[str, list[SheetRow]]:
    """Return nodes, members and panels by their marks."""
    unit = f" [{model.unit}]" if model.unit else ""
    sets: list[list[str]] = [[] for _ in model.local]
    for name, ids in model.node_sets.items():
        for node in ids.tolist():
            sets[node].append(name)
    marks, truss = model.node_marks, model.truss
    columns: dict[str, list[Any]] = {
        "member": list(model.member_marks),
        "start": [marks[k] for k in model.members[:, 0].tolist()],
        "end": [marks[k] for k in model.members[:, 1].tolist()],
        "group": [model.groups[k] for k in model.group_of.tolist()],
        f"length{unit}": model.lengths.tolist(),
    }
    if truss is not None:
        columns["section"] = [truss.sections[k].name for k in truss.section_of.tolist()]
        columns |= {f"local z, {axis}": truss.axes[:, 2, k].tolist() for k, axis in enumerate("xyz")}
        springs = truss.end_stiffness.reshape(-1, 4)
        if not truss.pinned and np.isfinite(springs).any():
            columns |= {
                f"{name} [Nm/rad]": list(map(_stiff, springs[:, k].tolist())) for k, name in enumerate(RELEASES)
            }
    if model.utilization is not None:
        columns["utilization"] = [_known_or_none(value) for value in np.asarray(model.utilization, float).tolist()]
    places = zip(marks, *model.nodes.T.tolist(), map("|".join, sets), strict=True)
    return {
        "Nodes": [("node", *(f"{axis}{unit}" for axis in "xyz"), "sets"), *places],
        "Members": [tuple(columns), *zip(*columns.values(), strict=True)],
        "Panels": [
            ("panel", *(f"node {k + 1}" for k in range(model.panels.shape[1]))),
            *((mark, *(marks[k] for k in loop)) for mark, loop in zip(model.panel_marks, model.panel_loops, strict=True)),
        ],
    }  # fmt: skip


def _structure_sheets(truss: Truss) -> dict[str, list[SheetRow]]:
    """Return what makes a structure of a grid [m, N, kg, K]."""
    sections, materials = [asdict(each) for each in truss.sections], [asdict(truss.material)]
    held = np.flatnonzero(truss.supports.any(axis=1)).tolist()
    return {
        "Sections": [tuple(sections[0]), *(tuple(map(_plain_cell, each.values())) for each in sections)],
        "Material": [tuple(materials[0]), *(tuple(map(_plain_cell, each.values())) for each in materials)],
        "Supports": [
            ("node", *STIFFNESS_HEADS),
            *((truss.node_marks[k], *map(_stiff, truss.supports[k].tolist())) for k in held),
        ],
        "Loads": [
            ("case", "action", "load", "on", "x", "y", "z", "about x", "about y", "about z"),
            *(row for case in truss.cases for row in _loads_of(truss, case)),
        ],
        "Combinations": [
            ("combination", "state", "case", "factor"),
            *((each.name, each.state, case, factor) for each in truss.combinations for case, factor in each.factors),
        ],
    }  # fmt: skip


def _loads_of(truss: Truss, case: LoadCase) -> Iterator[SheetRow]:
    """Yield the loads of a case, each with its unit."""
    head = (case.name, case.action)
    if case.self_weight:
        yield (*head, "weight of the members times", "all members", case.self_weight)
    for what, marks, values in (
        ("force [N], moment [Nm]", truss.node_marks, case.nodal),
        ("line load [N/m]", truss.member_marks, case.line),
        ("temperature [K]", truss.member_marks, case.temperature),
        ("strain", truss.member_marks, case.strain),
        ("settlement [m]", truss.node_marks, None if case.settlement is None else np.nan_to_num(case.settlement)),
    ):
        if values is not None:
            table = values.reshape(len(marks), -1)
            for k in np.flatnonzero(table.any(axis=1)).tolist():
                yield (*head, what, marks[k], *table[k].tolist())


def _result_sheets(solution: Solution) -> dict[str, list[SheetRow]]:
    """Return displacements, reactions, and forces at both ends of members in local axes, on the face towards the end."""
    truss = solution.truss
    forces = ("N [N]", "Vy [N]", "Vz [N]", "T [Nm]", "My [Nm]", "Mz [Nm]")
    heads = [f"{place} {force}" for place in ("start", "end") for force in forces]
    sheets: dict[str, list[SheetRow]] = {
        "Displacements": [("case", "node", *MOTION_HEADS)],
        "Reactions": [("case", "node", *FORCE_HEADS)],
        "Forces": [("case", "member", *heads)],
    }
    for case in solution.cases:
        moved, react = case.displacements.tolist(), np.flatnonzero(case.reactions.any(axis=1)).tolist()
        marks = zip(truss.node_marks, moved, strict=True)
        sheets["Displacements"] += [(case.name, mark, *row) for mark, row in marks]
        sheets["Reactions"] += [(case.name, truss.node_marks[k], *case.reactions[k].tolist()) for k in react]
        ends = case.along[:, [0, -1]].reshape(len(truss.members), -1).tolist()
        sheets["Forces"] += [(case.name, mark, *row) for mark, row in zip(truss.member_marks, ends, strict=True)]
    return sheets


def _stiff(value: float) -> float | str:
    return "rigid" if math.isinf(value) else value


def _known_or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _plain_cell(value: Any) -> Any:
    return value if value is None or isinstance(value, str | int | float) else str(value)
