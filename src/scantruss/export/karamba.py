"""Plain JSON for scripts in Grasshopper, such as those before Karamba: points, elements by node numbers, supports, sections, loads."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..errors import FormatError
from ..runtime.ours import MADE_BY
from .model import Model, line_loads, temperatures
from .style import FileStyle

KARAMBA_FREEDOMS = ("ux", "uy", "uz", "rx", "ry", "rz")


def encode_karamba(model: Model, style: FileStyle) -> bytes:
    """Return lists in the unit of the model and in kN, each row of them a line; numbers of nodes and elements count from 0."""
    groups = [_quoted_word(name) for name in model.groups]
    table = zip(model.member_marks, model.members.tolist(), model.group_of.tolist(), _more(model), strict=True)
    lists: dict[str, list[str]] = {
        "points": list(map(str, model.nodes.tolist())),
        "point_ids": list(map(_quoted_word, model.node_marks)),
        "elements": [
            f'{{"id": {_quoted_word(mark)}, "nodes": {ends}, "group": {groups[group]}{more}}}'
            for mark, ends, group, more in table
        ],
        "panels": list(map(str, model.panel_loops)),
        "supports": [_text_of(_support(model, node)) for node in model.supported.tolist()],
    }
    if model.truss is not None:
        lists |= _structure(model)
    head = {"format": "karamba-plain", "made_by": MADE_BY, "length": model.unit, "force": "kN"}
    parts = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    parts += ["{}: [\n{}\n]".format(json.dumps(key), ",\n".join(rows)) for key, rows in lists.items()]
    return ("{\n" + ",\n".join(parts) + "\n}\n").encode("utf-8")


def _text_of(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _quoted_word(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _more(model: Model) -> list[str]:
    """Return section and local z axis of each member of a structure, as they follow in its row."""
    if model.truss is None:
        return [""] * len(model.members)
    names = [_quoted_word(each.name) for each in model.truss.sections]
    table = zip(model.truss.section_of.tolist(), model.truss.axes[:, 2].tolist(), strict=True)
    return [f', "section": {names[section]}, "z": {z}' for section, z in table]


def _support(model: Model, node: int) -> dict[str, Any]:
    """Return how a node is held, with stiffnesses of springs [kN/m, kNm/rad]."""
    held = np.array([np.inf] * 3 + [0.0] * 3) if model.truss is None else model.truss.supports[node]
    springs = {
        way: value / 1e3 for way, value in zip(KARAMBA_FREEDOMS, held.tolist(), strict=True) if 0 < value < np.inf
    }
    return {"node": node, "fixed": np.isinf(held).tolist()} | ({"springs": springs} if springs else {})


def _structure(model: Model) -> dict[str, list[str]]:
    """Return sections, material, loads by cases, and combinations of a structure; lists of finite numbers read as JSON as they are."""
    truss = model.truss
    assert truss is not None
    names = ("name", "area", "inertia_y", "inertia_z", "torsion", "depth", "width", "thickness")
    material = {"name": truss.material.name, "E": truss.material.young / 1e3, "G": truss.material.shear / 1e3,
                "density": truss.material.density, "alpha": truss.material.alpha}  # fmt: skip
    loads: list[str] = []
    for case in truss.cases:
        head = f'{{"case": {_quoted_word(case.name)}'
        if case.self_weight:
            loads.append(f'{head}, "gravity": {[0.0, 0.0, -float(case.self_weight)]}}}')
        nodal = np.zeros((0, 6)) if case.nodal is None else case.nodal / 1e3
        for node, load in _rows_with_numbers(nodal):
            loads.append(f'{head}, "node": {node}, "force": {load[:3]}, "moment": {load[3:]}}}')
        for member, load in _rows_with_numbers(line_loads(truss, case, weight=False) / 1e3):
            loads.append(f'{head}, "element": {member}, "line": {load}}}')
        for member, (change,) in _rows_with_numbers(temperatures(truss, case, "JSON for Karamba")[:, None]):
            loads.append(f'{head}, "element": {member}, "temperature": {change!r}}}')
        moved = np.zeros((0, 3)) if case.settlement is None else np.nan_to_num(case.settlement)
        for node, place in _rows_with_numbers(moved):
            loads.append(f'{head}, "node": {node}, "settlement": {place}}}')
    return {
        "sections": [_text_of({name: getattr(each, name) for name in names}) for each in truss.sections],
        "materials": [_text_of(material)],
        "loads": loads,
        "combinations": [
            _text_of({"name": each.name, "state": each.state, "factors": dict(each.factors)})
            for each in truss.combinations
        ],
    }


def _rows_with_numbers(table: np.ndarray) -> Iterator[tuple[int, list[float]]]:
    """Yield the rows of a table that are not all zero, each with its number.

    Raises
    ------
    FormatError
        One is not finite, which JSON cannot hold.
    """
    if not np.isfinite(table).all():
        raise FormatError("JSON for Karamba holds finite loads only")
    rows = np.flatnonzero(table.any(axis=1))
    yield from zip(rows.tolist(), table[rows].tolist(), strict=True)
