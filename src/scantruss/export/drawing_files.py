"""Readers of lines and faces that others drew: OBJ, PLY, DXF and Rhino's 3DM."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FormatError
from ..grid.panels import table_of
from ..scan.formats.kinds import read_head, reading_as
from ..settings import UNITS
from .drawing_in import Drawing
from .dxf import INSUNITS
from .rhino import UNIT_SYSTEMS

if TYPE_CHECKING:
    from ezdxf.entities import DXFEntity

OWN_BLOCKS = ("NODE", "SUPPORT")  #: blocks of our DXF files that are no members
NO_MEMBERS = (
    "TEXT",
    "MTEXT",
    "POINT",
    "DIMENSION",
    "VIEWPORT",
    "ATTDEF",
    "ATTRIB",
)  #: entities of DXF without a line or face
MOST_NESTED = 16  #: depth of blocks in blocks that is read

DrawnPlace = tuple[float, ...]


class DrawnParts:
    """Collects lines and faces by their corners."""

    def __init__(self) -> None:
        self.points: list[DrawnPlace] = []
        self.lines: list[tuple[int, int]] = []
        self.faces: list[list[int]] = []
        self.loops: list[list[int]] = []
        self.nodes: list[DrawnPlace] = []
        self.others: dict[str, int] = {}  #: what is not read, and how often

    def path(self, places: list[DrawnPlace]) -> None:
        """Add the lines from place to place, and a loop where they end where they began."""
        start = len(self.points)
        self.points += places
        self.lines += [(start + k, start + k + 1) for k in range(len(places) - 1)]
        if len(places) > 3 and places[0] == places[-1]:
            self.loops.append(list(range(start, start + len(places) - 1)))

    def face(self, places: list[DrawnPlace]) -> None:
        """Add a face; a corner that is there twice in turn counts once."""
        corners = [place for k, place in enumerate(places) if place != places[k - 1]]
        if len(corners) < 3:
            self.other("faces without an area")
            return
        self.faces.append(list(range(len(self.points), len(self.points) + len(corners))))
        self.points += corners

    def other(self, kind: str) -> None:
        """Count what is not read."""
        self.others[kind] = self.others.get(kind, 0) + 1

    def drawing(self, unit: str) -> Drawing:
        """Return the drawing."""
        left = (
            "; not read: " + ", ".join(f"{count:,} {kind}" for kind, count in self.others.items())
            if self.others
            else ""
        )
        lines = np.array(self.lines, np.int64).reshape(-1, 2)
        points = np.array(self.points, float).reshape(-1, 3)
        nodes = np.array(self.nodes, float).reshape(-1, 3)
        return Drawing(points, lines, table_of(self.faces), table_of(self.loops), nodes, unit, left)


def draw_obj(path: Path) -> Drawing:
    """Return the lines `l` and faces `f` of an OBJ file."""
    read_head(path)
    points: list[DrawnPlace] = []
    lines: list[tuple[int, int]] = []
    faces: list[list[int]] = []
    unit = before = ""
    with path.open(encoding="latin-1") as file:
        for number, written in enumerate(file, 1):
            line = before + written
            if line.rstrip().endswith("\\"):  # goes on in the next line
                before = line.rstrip()[:-1] + " "
                continue
            before = ""
            word, *rest = line.split() or [""]
            try:
                if word == "v":
                    points.append((float(rest[0]), float(rest[1]), float(rest[2])))
                elif word in ("l", "f"):
                    corners = [int(each.partition("/")[0]) for each in rest]
                    ids = [corner - 1 if corner > 0 else corner + len(points) for corner in corners]
                    if word == "f":
                        faces.append([node for k, node in enumerate(ids) if node != ids[k - 1]])
                    lines += pairwise(ids) if word == "l" else ()
                elif word == "#" and rest[:1] == ["unit:"] and rest[-1] in UNITS:
                    unit = rest[-1]
            except (ValueError, IndexError):
                raise FormatError(f"{path.name}: line {number} is damaged: {line.strip()[:60]!r}") from None
    named = [node for each in (*lines, *faces) for node in each]
    if named and not 0 <= min(named) <= max(named) < len(points):
        raise FormatError(f"{path.name} names points that it does not have; export it again")
    return Drawing(
        np.array(points, float).reshape(-1, 3),
        np.array(lines, np.int64).reshape(-1, 2),
        table_of([face for face in faces if len(face) > 2]),
        unit=unit,
    )


def draw_ply(path: Path) -> Drawing:
    """Return the faces and edges of a PLY file."""
    from ..scan.formats.ply import ply_edges, ply_faces, read_ply
    from ..scan.formats.ply_header import read_header

    points, header = read_ply(path).points, read_header(path)
    edges = ply_edges(path, header)
    found = [np.array(some, np.int64) for some in ply_faces(path, header) if some.shape[1] > 2]
    for named in (edges, *found):
        if named.size and not 0 <= named.min() <= named.max() < len(points):
            raise FormatError(f"{path.name} names points that it does not have; export it again")
    return Drawing(points, edges, table_of([face for some in found for face in some.tolist()]), unit=header.unit)


def draw_dxf(path: Path) -> Drawing:
    """Return lines, polylines, faces and meshes of the model space of a DXF file, those of its blocks too; texts are left aside."""
    import ezdxf

    read_head(path)
    found = DrawnParts()
    with reading_as(path, "a DXF file"):
        drawing = ezdxf.readfile(path)
        for entity in drawing.modelspace():
            _dxf_entity(entity, found)
        code = int(drawing.header.get("$INSUNITS", 0))
    return found.drawing(next((unit for unit, number in INSUNITS.items() if number == code), ""))


def _dxf_entity(entity: DXFEntity, found: DrawnParts, depth: int = 0) -> None:
    kind: Any = entity.dxftype()
    made: Any = entity
    if kind == "LINE":
        found.path([tuple(made.dxf.start), tuple(made.dxf.end)])
    elif kind == "3DFACE":
        found.face([tuple(corner) for corner in made.wcs_vertices()])
    elif kind == "POLYLINE" and made.is_3d_polyline:
        places = [tuple(vertex.dxf.location) for vertex in made.vertices]
        found.path(places + places[:1] * made.is_closed)
    elif kind == "LWPOLYLINE" and not made.has_arc:
        places = [tuple(place) for place in made.vertices_in_wcs()]
        found.path(places + places[:1] * made.closed)
    elif kind in ("POLYLINE", "LWPOLYLINE"):
        for part in made.virtual_entities():
            _dxf_entity(part, found, depth)
    elif kind == "MESH":
        places = [tuple(map(float, place)) for place in made.vertices]
        for face in made.faces:
            found.face([places[corner] for corner in face])
    elif kind == "INSERT" and depth < MOST_NESTED:
        if made.dxf.name in OWN_BLOCKS and made.has_attrib("MARK"):
            found.nodes += [tuple(made.dxf.insert)] * (made.dxf.name == OWN_BLOCKS[0])
            return
        for copy in made.multi_insert() if made.mcount > 1 else (made,):
            for part in copy.virtual_entities():
                _dxf_entity(part, found, depth + 1)
    elif kind not in NO_MEMBERS:
        found.other(kind)


def draw_3dm(path: Path) -> Drawing:
    """Return straight lines, polylines and meshes of a Rhino file, those of its blocks too."""
    import rhino3dm

    read_head(path)
    file = rhino3dm.File3dm.Read(str(path))
    if file is None:
        raise FormatError(f"{path} cannot be read as a Rhino file; save it again")
    found = DrawnParts()
    shapes = {str(each.Attributes.Id): each.Geometry for each in file.Objects}
    parts = {str(block.Id): [str(part) for part in block.GetObjectIds()] for block in file.InstanceDefinitions}
    within = {part for ids in parts.values() for part in ids}
    for each in file.Objects:
        if str(each.Attributes.Id) not in within:
            _rhino_shape(each.Geometry, found, shapes, parts)
    system = file.Settings.ModelUnitSystem
    return found.drawing(
        next((unit for unit, name in UNIT_SYSTEMS.items() if getattr(rhino3dm.UnitSystem, name) == system), "")
    )


def _rhino_shape(
    shape: Any, found: DrawnParts, shapes: dict[str, Any], parts: dict[str, list[str]], depth: int = 0
) -> None:
    import rhino3dm

    if isinstance(shape, rhino3dm.InstanceReference) and depth < MOST_NESTED:
        for part in parts.get(str(shape.ParentIdefId), ()):
            copy = shapes[part].Duplicate()
            copy.Transform(shape.Xform)
            _rhino_shape(copy, found, shapes, parts, depth + 1)
    elif isinstance(shape, rhino3dm.Mesh):
        places = [_xyz(shape.Vertices.Point3dAt(k)) for k in range(len(shape.Vertices))]
        for k in range(len(shape.Faces)):
            found.face([places[corner] for corner in shape.Faces[k]])
    elif isinstance(shape, rhino3dm.Curve) and shape.IsLinear():
        found.path([_xyz(shape.PointAtStart), _xyz(shape.PointAtEnd)])
    elif isinstance(shape, rhino3dm.Curve) and shape.IsPolyline():
        found.path([_xyz(place) for place in shape.TryGetPolyline()])
    elif isinstance(shape, rhino3dm.Point):
        found.nodes.append(_xyz(shape.Location))
    elif not isinstance(shape, rhino3dm.PointCloud | rhino3dm.TextDot | rhino3dm.AnnotationBase):
        found.other("curves" if isinstance(shape, rhino3dm.Curve) else "surfaces and others")


def _xyz(point: Any) -> DrawnPlace:
    return point.X, point.Y, point.Z
