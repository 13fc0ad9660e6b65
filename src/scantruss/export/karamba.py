"""Plain JSON for scripts in Grasshopper, such as those before Karamba: points, elements by node numbers, supports, sections, loads."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ..runtime.ours import MARK
from .model import Model, line_loads, temperatures
from .style import FileStyle

KARAMBA_FREEDOMS = ("ux", "uy", "uz", "rx", "ry", "rz")


def encode_karamba(model: Model, style: FileStyle) -> bytes:
    """Return lists in the unit of the model and in kN, each row of them a line; numbers of nodes and elements count from 0."""
    normals = None if model.truss is None else model.truss.axes[:, 2].tolist()
    elements = []
    for number, (start, end) in enumerate(model.members.tolist()):
        row: dict[str, Any] = {
            "id": model.member_marks[number],
            "nodes": [start, end],
            "group": model.groups[model.group_of[number]],
        }
        if model.truss is not None and normals is not None:
            row |= {"section": model.truss.sections[model.truss.section_of[number]].name, "z": normals[number]}
        elements.append(row)
    lists: dict[str, list[Any]] = {
        "points": model.nodes.tolist(),
        "point_ids": list(model.node_marks),
        "elements": elements,
        "panels": model.panel_loops,
        "supports": [_support(model, node) for node in model.supported.tolist()],
    }
    if model.truss is not None:
        lists |= _structure(model)
    head = {"format": "karamba-plain", "made_by": MARK, "length": model.unit, "force": "kN"}
    parts = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    for key, rows in lists.items():
        text = ",\n".join(json.dumps(row, ensure_ascii=False, allow_nan=False) for row in rows)
        parts.append(f"{json.dumps(key)}: [\n{text}\n]")
    return ("{\n" + ",\n".join(parts) + "\n}\n").encode("utf-8")


def _support(model: Model, node: int) -> dict[str, Any]:
    """Return how a node is held, with stiffnesses of springs [kN/m, kNm/rad]."""
    held = np.array([np.inf] * 3 + [0.0] * 3) if model.truss is None else model.truss.supports[node]
    springs = {
        way: value / 1e3 for way, value in zip(KARAMBA_FREEDOMS, held.tolist(), strict=True) if 0 < value < np.inf
    }
    return {"node": node, "fixed": np.isinf(held).tolist()} | ({"springs": springs} if springs else {})


def _structure(model: Model) -> dict[str, list[Any]]:
    """Return sections, material, loads by cases, and combinations of a structure."""
    truss = model.truss
    assert truss is not None
    names = ("name", "area", "inertia_y", "inertia_z", "torsion", "depth", "width", "thickness")
    material = {"name": truss.material.name, "E": truss.material.young / 1e3, "G": truss.material.shear / 1e3,
                "density": truss.material.density, "alpha": truss.material.alpha}  # fmt: skip
    loads: list[Any] = []
    for case in truss.cases:
        if case.self_weight:
            loads.append({"case": case.name, "gravity": [0.0, 0.0, -float(case.self_weight)]})
        nodal = np.zeros((0, 6)) if case.nodal is None else case.nodal / 1e3
        for node in np.flatnonzero(nodal.any(axis=1)).tolist():
            loads.append(
                {"case": case.name, "node": node, "force": nodal[node, :3].tolist(), "moment": nodal[node, 3:].tolist()}
            )
        line = line_loads(truss, case, weight=False) / 1e3
        for member in np.flatnonzero(line.any(axis=1)).tolist():
            loads.append({"case": case.name, "element": member, "line": line[member].tolist()})
        for member, change in enumerate(temperatures(truss, case, "JSON for Karamba").tolist()):
            if change:
                loads.append({"case": case.name, "element": member, "temperature": change})
        moved = np.zeros((0, 3)) if case.settlement is None else np.nan_to_num(case.settlement)
        for node in np.flatnonzero(moved.any(axis=1)).tolist():
            loads.append({"case": case.name, "node": node, "settlement": moved[node].tolist()})
    return {
        "sections": [{name: getattr(each, name) for name in names} for each in truss.sections],
        "materials": [material],
        "loads": loads,
        "combinations": [
            {"name": each.name, "state": each.state, "factors": dict(each.factors)} for each in truss.combinations
        ],
    }
