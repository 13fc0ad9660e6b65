"""COMPAS JSON: a Mesh of the panels and a Graph of the members with their marks, groups and sections; both are read."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import FormatError
from ..grid.panels import table_of
from ..runtime.ours import MADE_BY
from .drawing_in import Drawing
from .model import Model
from .style import FileStyle

MESH, GRAPH = "compas.datastructures/Mesh", "compas.datastructures/Graph"
MOST_WITHIN = 8  #: depth of lists and dictionaries in each other that is looked through
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
    common = {"made_by": MADE_BY, "unit": model.unit}
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
    """Return the faces of the first Mesh of a file, with the lines of the first Graph where that has the same nodes; else these lines.

    What derives from a Mesh or a Graph is one too.
    """
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(f"{path} cannot be read as COMPAS JSON: {str(error)[:80]}") from None
    found = list(_typed(held))
    meshes = [each for each in found if _is_a(each, MESH)]
    graphs = [each for each in found if not _is_a(each, MESH)]
    if not found:
        raise FormatError(f"{path.name} holds no Mesh and no Graph of COMPAS")
    read, lines, faces = (meshes or graphs)[0], list[tuple[int, int]](), list[list[int]]()
    try:
        if meshes:
            points, faces = _mesh(_data(read))
            if graphs and len(_data(graphs[0])["node"]) == len(points):
                ends, lines = _graph(_data(graphs[0]))
                lines = lines if ends == points else []
        else:
            points, lines = _graph(_data(read))
        unit = str(_data(read).get("attributes", {}).get("unit", ""))
    except (KeyError, TypeError, ValueError, AttributeError):
        raise FormatError(f"{path.name} is damaged: its {read['dtype']} cannot be understood") from None
    others = len(found) - 1 - bool(meshes and lines)
    left = f"; not read: {others:,} more Mesh or Graph" if others else ""
    pairs = np.array(lines, np.int64).reshape(-1, 2)
    return Drawing(np.array(points, float).reshape(-1, 3), pairs, table_of(faces), unit=unit, left=left)


def _typed(held: Any, depth: int = 0) -> Iterator[dict[str, Any]]:
    """Yield the meshes and graphs of a file: it is one, or lists and dictionaries of some."""
    if isinstance(held, dict) and any(_is_a(held, kind) for kind in (MESH, *GRAPHS)):
        yield held
    elif isinstance(held, dict | list) and depth < MOST_WITHIN:
        for each in held.values() if isinstance(held, dict) else held:
            yield from _typed(each, depth + 1)


def _is_a(held: dict[str, Any], kind: str) -> bool:
    """Return whether an object of COMPAS is of a kind, or of one that derives from it."""
    inherited = held.get("inheritance")
    return kind == held.get("dtype") or (isinstance(inherited, list) and kind in inherited)


def _data(held: dict[str, Any]) -> dict[str, Any]:
    """Return what an object is made of; `value` is the older name."""
    found: dict[str, Any] = held.get("data") or held["value"]
    return found


def _places(nodes: dict[str, Any]) -> list[tuple[float, ...]]:
    return [(float(each["x"]), float(each["y"]), float(each.get("z", 0.0))) for each in nodes.values()]


def _mesh(data: dict[str, Any]) -> tuple[list[tuple[float, ...]], list[list[int]]]:
    number = {key: k for k, key in enumerate(data["vertex"])}
    return _places(data["vertex"]), [[number[str(corner)] for corner in face] for face in data["face"].values()]


def _graph(data: dict[str, Any]) -> tuple[list[tuple[float, ...]], list[tuple[int, int]]]:
    number = {key: k for k, key in enumerate(data["node"])}
    return _places(data["node"]), [(number[start], number[end]) for start, ends in data["edge"].items() for end in ends]
