"""Reads the members of an IFC file that others wrote: their axes, or the axes of their bodies where they have none."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..scan.formats.kinds import read_head, reading_as
from .drawing_files import DrawnParts, DrawnPlace
from .drawing_in import Drawing

PHYSICAL, ANALYTIC = ("IfcMember", "IfcBeam", "IfcColumn"), ("IfcStructuralCurveMember",)
AXES, BODIES = ("Axis", "Reference", None), ("Body",)  #: identifiers of representations
#: type of the plates that we write, whose faces say which members enclose a panel of more than four nodes
OUR_PANEL = "panel"
STRAIGHT = 1e-6  #: distance of a point of an axis from the line between its ends, over their distance, up to which it is straight

Ends = tuple[np.ndarray, np.ndarray]


def draw_ifc(path: Path) -> Drawing:
    """Return the straight axes of the members, beams and columns of an IFC file in metres, or else those of its analysis model."""
    import ifcopenshell
    from ifcopenshell.util.unit import calculate_unit_scale

    read_head(path)
    found, by_body = DrawnParts(), 0
    with reading_as(path, "an IFC file"):
        file = ifcopenshell.open(str(path))
        scale = float(calculate_unit_scale(file))
        to_map, system = _map_of(file)

        def on_map(place: np.ndarray) -> DrawnPlace:
            return tuple((to_map[:3, :3] @ (scale * place) + to_map[:3, 3]).tolist())

        for kinds in (PHYSICAL, ANALYTIC):
            for part in (part for kind in kinds for part in file.by_type(kind)):
                ends = _axis(part, AXES)
                if ends is None and (ends := _axis(part, BODIES)) is not None:
                    by_body += 1
                if ends is None:
                    found.other("members without a straight axis")
                else:
                    found.path([on_map(end) for end in ends])
            if found.lines:
                break
        for node in file.by_type("IfcDiscreteAccessory"):
            found.nodes.append(on_map(_place(node)[:3, 3]))
        for plate in file.by_type("IfcPlate"):
            if plate.ObjectType == OUR_PANEL:
                for face in _faces_of(plate):
                    found.face([on_map(corner) for corner in face])
    drawing = replace(found.drawing("m"), system=system)
    words = (
        f"; {by_body:,} members have no axis but that of their body, which ends where they are cut" if by_body else ""
    )
    return replace(drawing, left=words + drawing.left)


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


def _place(part: Any) -> np.ndarray:
    """Return the placement (4, 4) of a part in the unit of the file."""
    from ifcopenshell.util.placement import get_local_placement

    return np.eye(4) if part.ObjectPlacement is None else np.asarray(get_local_placement(part.ObjectPlacement), float)


def _faces_of(plate: Any) -> Iterator[list[np.ndarray]]:
    """Yield the corners of the triangles of a plate without thickness."""
    place = _place(plate)
    for shape in plate.Representation.Representations if plate.Representation else ():
        for item in shape.Items:
            if item.is_a("IfcTriangulatedFaceSet"):
                corners = [_moved(place, corner) for corner in item.Coordinates.CoordList]
                yield from ([corners[k - 1] for k in face] for face in item.CoordIndex)


def _axis(part: Any, identifiers: tuple[str | None, ...]) -> Ends | None:
    """Return the ends of the axis of a member in the unit of the file, of the first representation that has a straight one."""
    place = _place(part)
    for shape in part.Representation.Representations if part.Representation else ():
        if shape.RepresentationIdentifier in identifiers or (
            identifiers is AXES and shape.RepresentationType == "Edge"
        ):
            lines = [line for item in shape.Items for line in _lines_of(item, place)]
            if (ends := _straight(lines)) is not None:
                return ends
    return None


def _straight(lines: list[Ends]) -> Ends | None:
    """Return the ends of lines that follow one another straight on; None where they do not, or there are none."""
    if not lines:
        return None
    start, end = lines[0][0], lines[-1][1]
    way = end - start
    far = STRAIGHT * float(np.linalg.norm(way))
    places = np.array([place for line in lines for place in line])
    off = np.linalg.norm(np.cross(places - start, way), axis=1)
    joined = all(np.linalg.norm(one[1] - other[0]) <= far for one, other in pairwise(lines))
    return (start, end) if joined and far and (off <= far * np.linalg.norm(way)).all() else None


def _lines_of(item: Any, to: np.ndarray) -> Iterator[Ends]:
    """Yield the straight lines of a curve, and those along which a solid is extruded or swept, moved by a matrix (4, 4)."""
    from ifcopenshell.util.placement import get_axis2placement, get_mappeditem_transformation

    if item.is_a("IfcMappedItem"):
        moved = to @ np.asarray(get_mappeditem_transformation(item), float)
        for each in item.MappingSource.MappedRepresentation.Items:
            yield from _lines_of(each, moved)
    elif item.is_a("IfcGeometricSet"):
        for each in item.Elements:
            yield from _lines_of(each, to)
    elif item.is_a("IfcCompositeCurve"):
        for each in item.Segments:
            lines = list(_lines_of(each.ParentCurve, to))
            yield from lines if each.SameSense else [(end, start) for start, end in reversed(lines)]
    elif item.is_a("IfcBooleanResult"):  # a body that is cut
        yield from _lines_of(item.FirstOperand, to)
    elif item.is_a("IfcSweptDiskSolid"):
        yield from _lines_of(item.Directrix, to)
    elif item.is_a("IfcExtrudedAreaSolid"):
        place = to if item.Position is None else to @ np.asarray(get_axis2placement(item.Position), float)
        start = np.array([*_middle_of(item.SweptArea), 0.0])
        way = np.array(item.ExtrudedDirection.DirectionRatios, float)
        yield _moved(place, start), _moved(place, start + item.Depth * way / np.linalg.norm(way))
    else:
        yield from pairwise(_moved(to, place) for place in _corners_of(item))


def _corners_of(item: Any) -> list[Any]:
    """Return the ends and corners of a curve without bends; none of one that has some."""
    if item.is_a("IfcPolyline"):
        return [point.Coordinates for point in item.Points]
    if item.is_a("IfcIndexedPolyCurve"):
        bends = [each for each in item.Segments or () if not each.is_a("IfcLineIndex")]
        return [] if bends else list(item.Points.CoordList)
    if item.is_a("IfcEdge"):
        return [end.VertexGeometry.Coordinates for end in (item.EdgeStart, item.EdgeEnd)]
    if item.is_a("IfcTrimmedCurve") and item.BasisCurve.is_a("IfcLine"):
        ends = [_trim(item.BasisCurve, trims) for trims in (item.Trim1, item.Trim2)]
        return ends if item.SenseAgreement else ends[::-1]
    return []


def _trim(line: Any, trims: Any) -> Any:
    """Return a point on a line, which is named by a point or by its parameter."""
    for trim in trims:
        if trim.is_a("IfcCartesianPoint"):
            return trim.Coordinates
    start, way = np.array(line.Pnt.Coordinates, float), np.array(line.Dir.Orientation.DirectionRatios, float)
    return start + trims[0].wrappedValue * line.Dir.Magnitude * way / np.linalg.norm(way)


def _middle_of(profile: Any) -> tuple[float, float]:
    """Return the middle of a profile in its plane: its placement, or the middle of its outline."""
    if profile.is_a("IfcParameterizedProfileDef"):
        return (0.0, 0.0) if profile.Position is None else tuple(profile.Position.Location.Coordinates[:2])
    corners = (
        np.array(_corners_of(profile.OuterCurve)) if profile.is_a("IfcArbitraryClosedProfileDef") else np.zeros((0, 2))
    )
    return tuple(((corners.min(axis=0) + corners.max(axis=0)) / 2)[:2].tolist()) if len(corners) else (0.0, 0.0)


def _moved(to: np.ndarray, place: Any) -> np.ndarray:
    found: np.ndarray = to[:3, :3] @ np.array([*place, 0.0, 0.0][:3], float) + to[:3, 3]
    return found
