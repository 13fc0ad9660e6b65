"""Readers of lines and faces that others drew: OBJ, PLY, DXF, Rhino's 3DM and IFC."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FormatError
from ..scan.formats.kinds import read_head, reading_as
from ..settings import UNITS
from .drawing_in import Drawing
from .dxf import INSUNITS
from .rhino import UNIT_SYSTEMS

if TYPE_CHECKING:
    from ezdxf.entities import DXFEntity

PHYSICAL, ANALYTIC = ("IfcMember", "IfcBeam", "IfcColumn"), ("IfcStructuralCurveMember",)


class _Strokes:
    """Collects lines and faces by their corners."""

    def __init__(self) -> None:
        self.points: list[tuple[float, ...]] = []
        self.lines: list[tuple[int, int]] = []
        self.faces: list[tuple[int, ...]] = []
        self.others: dict[str, int] = {}  #: what is not read, and how often

    def path(self, places: list[tuple[float, ...]]) -> None:
        """Add the lines from place to place."""
        start = len(self.points)
        self.points += places
        self.lines += [(start + k, start + k + 1) for k in range(len(places) - 1)]

    def face(self, places: list[tuple[float, ...]]) -> None:
        """Add a face."""
        self.faces.append(tuple(range(len(self.points), len(self.points) + len(places))))
        self.points += places

    def other(self, kind: str) -> None:
        """Count what is not read."""
        self.others[kind] = self.others.get(kind, 0) + 1

    def drawing(self, path: Path, unit: str) -> Drawing:
        """Return the drawing."""
        left = (
            "; not read: " + ", ".join(f"{count:,} {kind}" for kind, count in self.others.items())
            if self.others
            else ""
        )
        lines = np.array(self.lines, np.int64).reshape(-1, 2)
        points = np.array(self.points, float).reshape(-1, 3)
        return Drawing(points, lines, three_corners(path, self.faces), unit, left)


def three_corners(path: Path, faces: list[tuple[int, ...]]) -> np.ndarray:
    """Return the (F, 3) faces.

    Raises
    ------
    FormatError
        One has more corners.
    """
    if more := [face for face in faces if len(face) != 3]:
        raise FormatError(
            f"{path.name} has {len(more):,} of {len(faces):,} faces with {len(more[0])} corners; split them into triangles"
        )
    return np.array(faces, np.int64).reshape(-1, 3)


def draw_obj(path: Path) -> Drawing:
    """Return the lines `l` and faces `f` of an OBJ file."""
    read_head(path)
    points: list[tuple[float, ...]] = []
    lines: list[tuple[int, int]] = []
    faces: list[tuple[int, ...]] = []
    unit = ""
    with path.open(encoding="latin-1") as file:
        for number, line in enumerate(file, 1):
            word, *rest = line.split() or [""]
            try:
                if word == "v":
                    points.append((float(rest[0]), float(rest[1]), float(rest[2])))
                elif word in ("l", "f"):
                    corners = [int(each.partition("/")[0]) for each in rest]
                    ids = [corner - 1 if corner > 0 else corner + len(points) for corner in corners]
                    if word == "f":
                        faces.append(tuple(ids))
                    lines += pairwise(ids) if word == "l" else ()
                elif word == "#" and rest[:1] == ["unit:"] and rest[-1] in UNITS:
                    unit = rest[-1]
            except (ValueError, IndexError):
                raise FormatError(f"{path.name}: line {number} is damaged: {line.strip()[:60]!r}") from None
    named = np.array([*lines, *(pair for face in faces for pair in pairwise(face))], np.int64)
    if named.size and (named.min() < 0 or named.max() >= len(points)):
        raise FormatError(f"{path.name} names points that it does not have; export it again")
    return Drawing(
        np.array(points, float).reshape(-1, 3),
        np.array(lines, np.int64).reshape(-1, 2),
        three_corners(path, faces),
        unit,
    )


def draw_ply(path: Path) -> Drawing:
    """Return the faces of a PLY file."""
    from ..scan.formats.ply import ply_faces, read_ply
    from ..scan.formats.ply_header import read_header

    points, header = read_ply(path).points, read_header(path)
    faces = [tuple(face) for some in ply_faces(path, header) for face in some.tolist()]
    found = three_corners(path, faces)
    if found.size and (found.min() < 0 or found.max() >= len(points)):
        raise FormatError(f"{path.name} names points that it does not have; export it again")
    return Drawing(points, faces=found, unit=header.unit)


def draw_dxf(path: Path) -> Drawing:
    """Return lines, polylines and faces of the model space of a DXF file; texts and blocks are left aside."""
    import ezdxf

    read_head(path)
    found = _Strokes()
    with reading_as(path, "a DXF file"):
        drawing = ezdxf.readfile(path)
        for entity in drawing.modelspace():
            _dxf_entity(entity, found)
        code = int(drawing.header.get("$INSUNITS", 0))
    return found.drawing(path, next((unit for unit, number in INSUNITS.items() if number == code), ""))


def _dxf_entity(entity: DXFEntity, found: _Strokes) -> None:
    kind: Any = entity.dxftype()
    made: Any = entity
    if kind == "LINE":
        found.path([tuple(made.dxf.start), tuple(made.dxf.end)])
    elif kind == "3DFACE":
        corners = [tuple(corner) for corner in made.wcs_vertices()]
        found.face(corners[:3] if corners[2:] and corners[-1] == corners[2] else corners)
    elif kind in ("POLYLINE", "LWPOLYLINE"):
        for part in made.virtual_entities():
            _dxf_entity(part, found)
    elif kind == "MESH":
        for corners in made.faces_as_vertices() if hasattr(made, "faces_as_vertices") else ():
            found.face([tuple(corner) for corner in corners])
    elif kind not in ("TEXT", "MTEXT", "INSERT", "POINT", "DIMENSION", "VIEWPORT"):
        found.other(kind)


def draw_3dm(path: Path) -> Drawing:
    """Return straight lines, polylines and meshes of a Rhino file."""
    import rhino3dm

    read_head(path)
    file = rhino3dm.File3dm.Read(str(path))
    if file is None:
        raise FormatError(f"{path} cannot be read as a Rhino file; save it again")
    found = _Strokes()
    for each in file.Objects:
        shape = each.Geometry
        if isinstance(shape, rhino3dm.Mesh):
            places = [_xyz(shape.Vertices.Point3dAt(k)) for k in range(len(shape.Vertices))]
            for k in range(len(shape.Faces)):
                corners = list(shape.Faces[k])
                found.face([places[corner] for corner in corners[: 3 if corners[3] == corners[2] else 4]])
        elif isinstance(shape, rhino3dm.PolylineCurve):
            found.path([_xyz(shape.Point(k)) for k in range(shape.PointCount)])
        elif isinstance(shape, rhino3dm.Curve) and shape.IsLinear():
            found.path([_xyz(shape.PointAtStart), _xyz(shape.PointAtEnd)])
        elif not isinstance(shape, rhino3dm.Point | rhino3dm.TextDot | rhino3dm.AnnotationBase):
            found.other("curves" if isinstance(shape, rhino3dm.Curve) else "surfaces and others")
    system = file.Settings.ModelUnitSystem
    unit = next((unit for unit, name in UNIT_SYSTEMS.items() if getattr(rhino3dm.UnitSystem, name) == system), "")
    return found.drawing(path, unit)


def _xyz(point: Any) -> tuple[float, ...]:
    return point.X, point.Y, point.Z


def draw_ifc(path: Path) -> Drawing:
    """Return the straight axes of the members, beams and columns of an IFC file in metres, or else those of its analysis model."""
    import ifcopenshell
    from ifcopenshell.util.unit import calculate_unit_scale

    read_head(path)
    found = _Strokes()
    with reading_as(path, "an IFC file"):
        file = ifcopenshell.open(str(path))
        scale = float(calculate_unit_scale(file))
        to_map, system = _map_of(file)
        for kinds, axis_of in ((PHYSICAL, _axis), (ANALYTIC, _edge)):
            for part in (part for kind in kinds for part in file.by_type(kind)):
                ends = axis_of(part)
                if ends is None:
                    found.other("members without a straight axis")
                else:
                    found.path([tuple((to_map[:3, :3] @ (scale * end) + to_map[:3, 3]).tolist()) for end in ends])
            if found.lines:
                break
    return replace(found.drawing(path, "m"), system=system)


def _map_of(file: Any) -> tuple[np.ndarray, str]:
    """Return the (4, 4) way from metres of an IFC file to its reference system, and that system; without one as they are, and ""."""
    to_map = np.eye(4)
    for each in file.by_type("IfcMapConversion") if file.schema != "IFC2X3" else ():
        unit = each.TargetCRS.MapUnit
        if (
            each.is_a() != "IfcMapConversion"
            or (unit is not None and unit.Name != "METRE")
            or each.Scale not in (None, 1.0)
        ):
            continue  # of other scales or units: the numbers stay those of the file
        x, y = (1.0, 0.0) if each.XAxisAbscissa is None else (each.XAxisAbscissa, each.XAxisOrdinate)
        size = math.hypot(x, y)
        to_map[:2, :2] = np.array([[x, -y], [y, x]]) / size
        to_map[:3, 3] = each.Eastings, each.Northings, each.OrthogonalHeight
        return to_map, str(each.TargetCRS.Name or "")
    return to_map, ""


def _placed(part: Any, places: list[Any]) -> list[np.ndarray]:
    from ifcopenshell.util.placement import get_local_placement

    matrix = np.eye(4) if part.ObjectPlacement is None else np.asarray(get_local_placement(part.ObjectPlacement), float)
    return [matrix[:3, :3] @ np.array([*place, 0.0, 0.0][:3], float) + matrix[:3, 3] for place in places]


def _items(part: Any) -> Iterator[Any]:
    for each in part.Representation.Representations if part.Representation else ():
        if each.RepresentationIdentifier in ("Axis", "Reference", None) or each.RepresentationType == "Edge":
            yield from each.Items


def _axis(part: Any) -> list[np.ndarray] | None:
    for item in _items(part):
        if item.is_a("IfcPolyline") and len(item.Points) == 2:
            return _placed(part, [point.Coordinates for point in item.Points])
        if item.is_a("IfcIndexedPolyCurve") and len(item.Points.CoordList) == 2:
            return _placed(part, list(item.Points.CoordList))
        if item.is_a("IfcTrimmedCurve") and item.BasisCurve.is_a("IfcLine"):
            trims = [trim for some in (item.Trim1, item.Trim2) for trim in some if not isinstance(trim, float)]
            points = [trim.Coordinates for trim in trims if hasattr(trim, "is_a") and trim.is_a("IfcCartesianPoint")]
            if len(points) == 2:
                return _placed(part, points)
    return None


def _edge(part: Any) -> list[np.ndarray] | None:
    for item in _items(part):
        if item.is_a("IfcEdge"):
            return _placed(part, [end.VertexGeometry.Coordinates for end in (item.EdgeStart, item.EdgeEnd)])
    return None
