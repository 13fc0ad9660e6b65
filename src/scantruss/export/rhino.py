"""Rhino's .3dm by rhino3dm: lines, points and a mesh on layers, with marks as names and user texts."""

from __future__ import annotations

import base64
import struct
import zlib

from ..runtime.ours import MADE_BY
from .dxf import DXF_COLOURS, held_words, layers_of_members
from .model import Model
from .style import FileStyle

UNIT_SYSTEMS = {"": "Unset", "mm": "Millimeters", "cm": "Centimeters", "m": "Meters", "inch": "Inches", "foot": "Feet"}
SHADES = {5: (0, 0, 255, 255), 7: (90, 90, 90, 255), 3: (0, 160, 0, 255)}  #: of the colours of layers in DXF
HISTORY = struct.pack("<IQ", 0x20008021, 81)  #: head of the part with both dates, where nobody is named as author
DATE = struct.pack("<8i", 0, 0, 0, 1, 0, 80, 2, 0)  #: the first day of 1980


def encode_3dm(model: Model, style: FileStyle) -> bytes:
    """Return a file of Rhino 8 in the unit and the frame of the scan; the faces of the mesh are the panels in their order.

    Faces have four corners at most: those of panels with more are triangles, and each panel is a closed polyline too.
    """
    import rhino3dm

    file = rhino3dm.File3dm()
    file.ApplicationName = MADE_BY
    file.Settings.ModelUnitSystem = getattr(rhino3dm.UnitSystem, UNIT_SYSTEMS[model.unit])
    layers: dict[str, int] = {}

    def attributes(layer: str, mark: str, texts: dict[str, str]) -> rhino3dm.ObjectAttributes:
        """Return a name, an identifier, a layer and user texts."""
        if layer not in layers:
            made = rhino3dm.Layer()
            made.Name, made.Id = layer, model.guid("3dm layer", layer)
            made.Color = SHADES[next((colour for word, colour in DXF_COLOURS.items() if f" {word}" in layer), 3)]
            layers[layer] = file.Layers.Add(made)
        found = rhino3dm.ObjectAttributes()
        found.Name, found.Id, found.LayerIndex = mark, model.guid(f"3dm {layer}", mark), layers[layer]
        for key, text in texts.items():
            found.SetUserString(key, text)
        return found

    points = [rhino3dm.Point3d(*place) for place in model.nodes.tolist()]
    for number, layer in enumerate(layers_of_members(model)):
        start, end = model.members[number].tolist()
        texts = {
            "mark": model.member_marks[number],
            "group": model.groups[model.group_of[number]],
            "start": model.node_marks[start],
            "end": model.node_marks[end],
        }
        if model.truss is not None:
            texts["section"] = model.truss.sections[model.truss.section_of[number]].name
            texts["material"] = model.truss.material.name
        if model.utilization is not None:
            texts["utilization"] = repr(float(model.utilization[number]))
        file.Objects.AddLine(points[start], points[end], attributes(layer, model.member_marks[number], texts))
    held = set(model.supported.tolist())
    for number, (mark, point) in enumerate(zip(model.node_marks, points, strict=True)):
        texts = {"mark": mark} | ({"held": held_words(model, number)} if number in held else {})
        file.Objects.AddPoint(point, attributes("supports" if number in held else "nodes", mark, texts))
    if len(model.triangles):
        mesh = rhino3dm.Mesh()
        mesh.Vertices.UseDoublePrecisionVertices = True
        for place in model.nodes.tolist():
            mesh.Vertices.AddPoint3d(*place)
        faces = model.panel_loops if model.panels.shape[1] <= 4 else model.triangles.tolist()
        for face in faces:
            mesh.Faces.AddFace(*face)
        file.Objects.AddMesh(mesh, attributes("panels", "panels", {"first": model.panel_marks[0]}))
    for mark, loop in zip(model.panel_marks, model.panel_loops if model.panels.shape[1] > 4 else (), strict=False):
        outline = rhino3dm.Polyline(len(loop) + 1)
        for node in (*loop, loop[0]):
            outline.Add(points[node].X, points[node].Y, points[node].Z)
        file.Objects.AddPolyline(outline, attributes("outlines of panels", mark, {"mark": mark}))
    return _without_dates(base64.b64decode(file.Encode(rhino3dm.File3dmWriteOptions())))


def _without_dates(content: bytes) -> bytes:
    """Return a file with the dates of its creation and last change set to that of all our files."""
    at = content.index(HISTORY) + len(HISTORY)
    body = bytearray(content[at : at + 77])
    body[5:37] = body[41:73] = DATE
    return content[:at] + bytes(body) + zlib.crc32(body).to_bytes(4, "little") + content[at + 81 :]
