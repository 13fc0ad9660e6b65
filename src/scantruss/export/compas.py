"""COMPAS JSON: a Mesh of the panels and a Graph of the members with their marks, groups and sections; both are read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError
from ..runtime.ours import MARK
from .drawing_in import Drawing
from .model import Model
from .style import FileStyle

MESH, GRAPH = "compas.datastructures/Mesh", "compas.datastructures/Graph"
GRAPHS = (GRAPH, "compas.datastructures/Network")  #: what is read; Network is the older name


def encode_compas(model: Model, style: FileStyle) -> bytes:
    """Return a dictionary of a Mesh and a Graph, as `compas.json_load` takes it."""
    places = [dict(zip("xyz", place, strict=True)) for place in model.nodes.tolist()]
    held = set(model.supported.tolist())
    nodes = {
        str(k): place | {"mark": mark, "is_support": k in held}
        for k, (place, mark) in enumerate(zip(places, model.node_marks, strict=True))
    }
    edges: dict[str, dict[str, Any]] = {key: {} for key in nodes}
    for number, (start, end) in enumerate(model.members.tolist()):
        values = {"mark": model.member_marks[number], "group": model.groups[model.group_of[number]]}
        if model.truss is not None:
            values["section"] = model.truss.sections[model.truss.section_of[number]].name
        edges[str(start)][str(end)] = values
    common = {"made_by": MARK, "unit": model.unit}
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    graph = {
        "attributes": common, "default_node_attributes": zero, "default_edge_attributes": {}, "node": nodes, "edge": edges,
        "max_node": len(nodes) - 1,
    }  # fmt: skip
    faces = {str(number): corners for number, corners in enumerate(model.panel_loops)}
    mesh = {
        "attributes": common, "default_vertex_attributes": zero, "default_edge_attributes": {}, "default_face_attributes": {},
        "vertex": dict(zip(nodes, places, strict=True)), "face": faces,
        "facedata": {key: {"mark": mark} for key, mark in zip(faces, model.panel_marks, strict=True)}, "edgedata": {},
        "max_vertex": len(nodes) - 1, "max_face": len(faces) - 1,
    }  # fmt: skip
    parts = {"mesh": (MESH, mesh), "graph": (GRAPH, graph)}
    whole = {
        name: {"dtype": dtype, "data": data, "inheritance": [], "guid": str(model.guid("compas", name))}
        for name, (dtype, data) in parts.items()
    }
    lines = [f"{json.dumps(name)}: {json.dumps(each, ensure_ascii=False)}" for name, each in whole.items()]
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode("utf-8")


def draw_compas(path: Path) -> Drawing:
    """Return the faces of the first Mesh of a file, or else the lines of the first Graph."""
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(f"{path} cannot be read as COMPAS JSON: {str(error)[:80]}") from None
    found = [each for each in _typed(held) if each["dtype"] in (MESH, *GRAPHS)]
    found.sort(key=lambda each: each["dtype"] != MESH)
    if not found:
        raise FormatError(f"{path.name} holds no Mesh and no Graph of COMPAS")
    try:
        data: dict[str, Any] = found[0].get("data") or found[0]["value"]
        points, lines, faces = _parts(data, found[0]["dtype"] == MESH)
        unit = str(data.get("attributes", {}).get("unit", ""))
    except (KeyError, TypeError, ValueError, AttributeError):
        raise FormatError(f"{path.name} is damaged: its {found[0]['dtype']} cannot be understood") from None
    from .drawing_files import three_corners

    pairs = np.array(lines, np.int64).reshape(-1, 2)
    return Drawing(np.array(points, float).reshape(-1, 3), pairs, three_corners(path, faces), unit)


CompasParts = tuple[list[tuple[float, ...]], list[tuple[int, int]], list[tuple[int, ...]]]  # points, lines, faces


def _typed(held: Any) -> list[dict[str, Any]]:
    """Return the objects of COMPAS in a file: it is one, or a list or dictionary of some."""
    if isinstance(held, dict) and isinstance(held.get("dtype"), str):
        return [held]
    values = held.values() if isinstance(held, dict) else held if isinstance(held, list) else ()
    return [each for each in values if isinstance(each, dict) and isinstance(each.get("dtype"), str)]


def _parts(data: dict[str, Any], is_mesh: bool) -> CompasParts:
    nodes = data["vertex" if is_mesh else "node"]
    number = {key: k for k, key in enumerate(nodes)}
    points: list[tuple[float, ...]] = [
        (float(each["x"]), float(each["y"]), float(each.get("z", 0.0))) for each in nodes.values()
    ]
    if is_mesh:
        return points, [], [tuple(number[str(corner)] for corner in face) for face in data["face"].values()]
    return points, [(number[start], number[end]) for start, ends in data["edge"].items() for end in ends], []
