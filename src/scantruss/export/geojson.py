"""GeoJSON: nodes, members and panels as points, lines and polygons in the reference system of the scan.

The standard of 2016 knows longitude and latitude only. GIS programs still take the member `crs` of that of 2008, as GDAL does; it is
null where no system is known, so that nobody takes lengths for degrees.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

from ..runtime.ours import MADE_BY
from .dxf import held_words
from .model import Model
from .style import FileStyle

URN = "urn:ogc:def:crs:EPSG::"  #: before the code of a reference system


def encode_geojson(model: Model, style: FileStyle) -> bytes:
    """Return a collection of features, each a line; heights are the third coordinates."""
    code = model.system.removeprefix("EPSG:") if model.system.startswith("EPSG:") else ""
    system = {"type": "name", "properties": {"name": URN + code}} if code else None
    head = {"type": "FeatureCollection", "name": "grid" if model.truss is None else "structure", "made_by": MADE_BY,
            "crs": system, "reference_system": model.system, "unit": model.unit}  # fmt: skip
    places = [f"[{x!r}, {y!r}, {z!r}]" for x, y, z in model.nodes.tolist()]
    nodes, members, panels = (list(map(_quoted, m)) for m in (model.node_marks, model.member_marks, model.panel_marks))
    held = {node: f', "held": {_quoted(held_words(model, node))}' for node in model.supported.tolist()}
    groups, lengths = list(map(_quoted, model.groups)), model.lengths.tolist()
    more = _of_members(model)
    rows = [
        f'{{"type": "Feature", "properties": {{"kind": "node", "mark": {mark}{held.get(k, "")}}}, '
        f'"geometry": {{"type": "Point", "coordinates": {places[k]}}}}}'
        for k, mark in enumerate(nodes)
    ]
    table = zip(members, model.members.tolist(), model.group_of.tolist(), lengths, more, strict=True)
    rows += [
        f'{{"type": "Feature", "properties": {{"kind": "member", "mark": {mark}, "group": {groups[group]}, "start": {nodes[a]}, '
        f'"end": {nodes[b]}, "length": {length!r}{also}}}, '
        f'"geometry": {{"type": "LineString", "coordinates": [{places[a]}, {places[b]}]}}}}'
        for mark, (a, b), group, length, also in table
    ]
    rows += [
        f'{{"type": "Feature", "properties": {{"kind": "panel", "mark": {mark}}}, '
        f'"geometry": {{"type": "Polygon", "coordinates": [[{", ".join(places[k] for k in [*loop, loop[0]])}]]}}}}'
        for mark, loop in zip(panels, model.panel_loops, strict=True)
    ]
    text = json.dumps(head, ensure_ascii=False)[:-1]
    features = ",\n".join(rows)
    return f'{text}, "features": [\n{features}\n]}}\n'.encode()


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _of_members(model: Model) -> list[str]:
    """Return what is known of each member of a structure: section, utilization, greatest axial force of each case."""
    columns: list[tuple[str, list[Any]]] = []
    if model.truss is not None:
        names = [_quoted(section.name) for section in model.truss.sections]
        columns.append(("section", [names[k] for k in model.truss.section_of.tolist()]))
    if model.utilization is not None:
        columns.append(
            ("utilization", [repr(u) if math.isfinite(u) else "null" for u in np.asarray(model.utilization).tolist()])
        )
    for case in () if model.solution is None else model.solution.cases:
        axial = np.where(-case.axial[:, 0] > case.axial[:, 1], case.axial[:, 0], case.axial[:, 1])
        columns.append((f"axial force {case.name} [N]", list(map(repr, axial.tolist()))))
    if not columns:
        return [""] * len(model.members)
    heads = "".join(f", {_quoted(name).replace('%', '%%')}: %s" for name, _ in columns)
    return [heads % row for row in zip(*(values for _, values in columns), strict=True)]
