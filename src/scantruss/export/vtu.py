"""VTU for ParaView and the like: members as lines, panels as triangles, quads or polygons, with what is known of them; binary as base64."""

from __future__ import annotations

import base64
import re
from xml.sax.saxutils import quoteattr

import numpy as np

from ..runtime.ours import MADE_BY
from .model import Model
from .style import FileStyle
from .workbook import NOT_IN_XML

TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}
LINE_CELL, TRIANGLE_CELL, POLYGON_CELL, QUAD_CELL = 3, 5, 7, 9  #: of VTK's cells
NOT_IN_COMMENTS = re.compile("--|[\x00-\x08\x0b-\x1f\ufffe\uffff]|-$")


def encode_vtu(model: Model, style: FileStyle) -> bytes:
    """Return the file of an unstructured grid in the frame of the scan; `id` counts members and panels, each from 0."""
    members, panels = len(model.members), len(model.panels)
    size = (model.panels >= 0).sum(axis=1)
    ends = np.concatenate([2 * np.arange(1, members + 1), 2 * members + np.cumsum(size)])
    kind = np.where(size == 3, TRIANGLE_CELL, np.where(size == 4, QUAD_CELL, POLYGON_CELL))
    cells = {
        "connectivity": np.concatenate([model.members.ravel(), model.panels[model.panels >= 0]]),
        "offsets": ends,
        "types": np.concatenate([np.full(members, LINE_CELL), kind]).astype(np.uint8),
    }
    fixed = np.zeros(len(model.local), np.int64)
    fixed[model.supported] = 1
    of_points = {"id": np.arange(len(model.local)), "supported": fixed}
    of_cells = {
        "id": np.concatenate([np.arange(members), np.arange(panels)]),
        "group": np.concatenate([model.group_of, np.full(panels, -1)]),
        "length": _of_members(model, model.lengths),
    }
    comments = [
        MADE_BY,
        f"unit: {model.unit or 'not known'}",
        "group: " + ", ".join(f"{k} {n}" for k, n in enumerate(model.groups)),
    ]
    if model.truss is not None:
        of_cells["section"] = np.concatenate([model.truss.section_of, np.full(panels, -1)])
        of_cells["area"] = _of_members(model, model.truss.of_section("area"))
        comments.append("section: " + ", ".join(f"{k} {each.name}" for k, each in enumerate(model.truss.sections)))
    if model.utilization is not None:
        of_cells["utilization"] = _of_members(model, model.utilization)
    if model.solution is not None:
        for case in model.solution.cases:
            of_points[f"displacement {case.name} [m]"] = np.ascontiguousarray(case.displacements[:, :3])
            of_points[f"reaction {case.name} [N]"] = np.ascontiguousarray(case.reactions[:, :3])
            axial = np.where(-case.axial[:, 0] > case.axial[:, 1], case.axial[:, 0], case.axial[:, 1])
            of_cells[f"axial force {case.name} [N]"] = _of_members(model, axial)
    parts = [
        '<?xml version="1.0" encoding="UTF-8"?>\n',
        *(f"<!-- {NOT_IN_COMMENTS.sub('?', words)} -->\n" for words in comments),
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n<UnstructuredGrid>\n',
        f'<Piece NumberOfPoints="{len(model.local)}" NumberOfCells="{members + panels}">\n',
        *_section("Points", {"Points": model.nodes}),
        *_section("Cells", cells),
        *_section("PointData", of_points),
        *_section("CellData", of_cells),
        "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    ]
    return "".join(parts).encode("utf-8")


def _of_members(model: Model, values: np.ndarray) -> np.ndarray:
    """Return values of members, and NaN for the panels."""
    return np.concatenate([values, np.full(len(model.panels), np.nan)])


def _section(name: str, arrays: dict[str, np.ndarray]) -> list[str]:
    """Return the lines of a section, an array a line."""
    lines = [f"<{name}>\n"]
    for key, array in arrays.items():
        data = array.astype(array.dtype.newbyteorder("<")).tobytes()
        words = base64.b64encode(len(data).to_bytes(8, "little") + data).decode("ascii")
        width = f' NumberOfComponents="{array.shape[1]}"' if array.ndim > 1 else ""
        lines.append(
            f'<DataArray type="{TYPES[array.dtype.name]}" Name={quoteattr(NOT_IN_XML.sub("?", key))}{width} format="binary">'
            f"{words}</DataArray>\n"
        )
    return [*lines, f"</{name}>\n"]
