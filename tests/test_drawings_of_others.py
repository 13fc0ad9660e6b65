"""Grids as other programs write them: polygons, closed polylines, blocks, mapped axes, bodies; each file is made by its library."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import ifcopenshell
import meshio
import numpy as np
import pytest
import rhino3dm
from ezdxf.math import Matrix44
from ezdxf.math import Vec3 as DxfVector
from small_cells import Loops, comb, grid_of, vault
from small_grids import dome
from test_convert import UTM

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.drawing_in import Drawing, grid_of_drawing
from scantruss.export.drawing_panels import without_diagonals
from scantruss.export.formats import FORMATS, read_model
from scantruss.export.ifc_in import draw_ifc
from scantruss.export.style import FileStyle

READ = [suffix for suffix, row in FORMATS.items() if row.draw]


def lines_of(loops: Loops) -> list[tuple[int, int]]:
    """The sides of panels, each once."""
    return sorted({(min(pair), max(pair)) for loop in loops for pair in pairwise([*loop, loop[0]])})


def places_of(grid: st.Grid) -> set[frozenset[tuple[float, ...]]]:
    """The panels by the places of their corners."""
    corners = np.round(grid.scan_nodes, 5) + 0.0
    return {frozenset(map(tuple, corners[loop].tolist())) for loop in grid.panel_loops}


def hold(path: Path, nodes: np.ndarray, loops: Loops, unit: str = "") -> st.Grid:
    """Hold a file to panels; return its grid."""
    model = read_model(path)
    assert model.grid is not None and model.unit == unit
    assert places_of(model.grid) == places_of(grid_of(nodes, loops))
    assert len(model.grid.edges) == len(lines_of(loops)) and model.grid.topology.orientable
    return model.grid


@pytest.mark.parametrize("make", [vault, comb])
@pytest.mark.parametrize("suffix", READ)
def test_quads_and_hexagons_are_read_back_with_their_marks(
    make: Callable[[], tuple[np.ndarray, Loops]], suffix: str, tmp_path: Path
) -> None:
    nodes, loops = make()
    grid = grid_of(nodes, loops, origin=UTM, unit="m")
    truss = st.Truss.from_grid(grid, supports="boundary")
    for what in (grid, truss):
        st.write(what, tmp_path / f"Dach 屋顶{suffix}", style=FileStyle(obj="both"))
        found = hold(tmp_path / f"Dach 屋顶{suffix}", nodes + UTM, loops, "m")
        assert np.abs(found.scan_nodes - grid.scan_nodes).max() < 1e-6  # in the same order
        np.testing.assert_array_equal(found.edges, grid.edges)


@pytest.mark.parametrize("suffix", READ)
def test_nodes_and_members_keep_their_marks(suffix: str, tmp_path: Path) -> None:
    grid = dome(5, origin=UTM, unit="m")
    st.write(st.Truss.from_grid(grid, supports="boundary"), tmp_path / f"a{suffix}")
    found = read_model(tmp_path / f"a{suffix}")
    assert np.abs(found.nodes - grid.scan_nodes).max() < 1e-6
    np.testing.assert_array_equal(found.members, grid.edges)


@pytest.mark.parametrize("suffix", READ)
def test_a_second_layer_is_never_left_out(suffix: str, tmp_path: Path) -> None:
    truss = st.Truss.from_grid(dome(4, unit="m"), supports="boundary", double_layer=1.0)
    st.write(truss, tmp_path / f"a{suffix}")
    model = read_model(tmp_path / f"a{suffix}")
    assert len(model.nodes) == len(truss.nodes)
    assert "on no panel" in model.notes[0] or "has no panels" in model.notes[0]
    assert np.abs(model.nodes - truss.nodes).max() < 1e-6
    assert {tuple(sorted(pair)) for pair in truss.members.tolist()} == set(map(tuple, model.members.tolist()))


def test_polygons_of_obj_files(tmp_path: Path) -> None:
    nodes, quads = vault()
    vertices = [f"v {x} {y} {z}" for x, y, z in nodes.tolist()]
    path = tmp_path / "a.obj"
    faces = ["f " + " ".join(f"{k + 1}/1/1" for k in loop) for loop in quads]
    path.write_text("\n".join(["mtllib a.mtl", *vertices, "vt 0 0", "vn 0 0 1", "usemtl b", *faces]), encoding="ascii")
    assert hold(path, nodes, quads).cells == "quad"
    last = quads[-1]
    mixed = [*quads[:-1], last[:3], [last[0], last[2], last[3]]]
    path.write_text("\n".join([*vertices, *("f " + " ".join(f"{k - len(nodes)}" for k in f) for f in mixed)]))
    hold(path, nodes, mixed)
    path.write_text("\n".join([*vertices, *("f " + " \\\n ".join(str(k + 1) for k in f) for f in quads)]))
    hold(path, nodes, quads)
    path.write_text("\n".join([*vertices, "f 1 2 8 7 2"]))
    with pytest.raises(st.FormatError, match="meets itself"):
        read_model(path)


def test_faces_and_edges_of_ply_files(tmp_path: Path) -> None:
    nodes, quads = vault()
    path = tmp_path / "a.ply"
    meshio.write(path, meshio.Mesh(nodes, [("quad", np.array(quads, np.int32))]))
    hold(path, nodes, quads)
    lines = np.array(lines_of(quads), "<i4")
    head = (
        f"ply\nformat %s 1.0\nelement vertex {len(nodes)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element edge {len(lines)}\nproperty int vertex1\nproperty int vertex2\nproperty uchar red\nend_header\n"
    )
    rows = [*(" ".join(map(repr, place)) for place in nodes.tolist()), *(f"{a} {b} 7" for a, b in lines.tolist())]
    path.write_text(head % "ascii" + "\n".join(rows) + "\n", encoding="ascii")
    hold(path, nodes, quads)
    edges = np.zeros(len(lines), [("a", "<i4"), ("b", "<i4"), ("red", "u1")])
    edges["a"], edges["b"] = lines.T
    path.write_bytes((head % "binary_little_endian").encode() + nodes.astype("<f8").tobytes() + edges.tobytes())
    hold(path, nodes, quads)
    edges["b"][0] = 99
    path.write_bytes((head % "binary_little_endian").encode() + nodes.astype("<f8").tobytes() + edges.tobytes())
    with pytest.raises(st.FormatError, match="names points that it does not have"):
        read_model(path)


def dxf_lines(space: Any, nodes: np.ndarray, quads: Loops) -> None:
    for a, b in lines_of(quads):
        space.add_line(nodes[a], nodes[b])


def dxf_closed_polylines(space: Any, nodes: np.ndarray, quads: Loops) -> None:
    for loop in quads:
        space.add_polyline3d(nodes[loop], close=True)


def dxf_faces(space: Any, nodes: np.ndarray, quads: Loops) -> None:
    for loop in quads:
        space.add_3dface(nodes[loop])


def dxf_mesh(space: Any, nodes: np.ndarray, quads: Loops) -> None:
    with space.add_mesh().edit_data() as data:
        data.vertices, data.faces = nodes.tolist(), [tuple(loop) for loop in quads]


def dxf_polyface(space: Any, nodes: np.ndarray, quads: Loops) -> None:
    space.add_polyface().append_faces([nodes[loop] for loop in quads])


def dxf_polymesh(space: Any, nodes: np.ndarray, quads: Loops) -> None:
    mesh = space.add_polymesh((6, 5))
    for k, place in enumerate(nodes):
        mesh.set_mesh_vertex((k % 6, k // 6), place)


def dxf_block_in_block(space: Any, nodes: np.ndarray, quads: Loops) -> None:
    inner, outer = space.doc.blocks.new("INNER"), space.doc.blocks.new("OUTER")
    dxf_lines(inner, (nodes - [1.0, 2.0, 3.0]) / 2, quads)
    outer.add_blockref("INNER", (1.0, 2.0, 3.0), {"xscale": 2.0, "yscale": 2.0, "zscale": 2.0})
    space.add_blockref("OUTER", (0.0, 0.0, 0.0))


def dxf_block_a_member(space: Any, nodes: np.ndarray, quads: Loops) -> None:
    """One line of unit length, placed, turned and scaled for each member."""
    space.doc.blocks.new("MEMBER").add_line((0, 0, 0), (1, 0, 0))
    for a, b in lines_of(quads):
        start, way = DxfVector(nodes[a]), DxfVector(nodes[b] - nodes[a])
        side = DxfVector(0, 0, 1).cross(way).normalize(way.magnitude)
        up = way.cross(side).normalize(way.magnitude)
        space.add_blockref("MEMBER", (0, 0, 0)).transform(Matrix44.ucs(way, side, up, start))


@pytest.mark.parametrize(
    "draw",
    [dxf_lines, dxf_closed_polylines, dxf_faces, dxf_mesh, dxf_polyface, dxf_polymesh, dxf_block_in_block, dxf_block_a_member],
)  # fmt: skip
def test_what_dxf_files_of_others_hold(draw: Callable[[Any, np.ndarray, Loops], None], tmp_path: Path) -> None:
    nodes, quads = vault()
    drawing = ezdxf.new("R2013")
    drawing.header["$INSUNITS"] = 5
    draw(drawing.modelspace(), nodes, quads)
    drawing.modelspace().add_text("Dach")
    drawing.saveas(tmp_path / "a.dxf")
    hold(tmp_path / "a.dxf", nodes, quads, "cm")


def test_what_is_left_of_a_dxf_file_is_counted(tmp_path: Path) -> None:
    nodes, quads = vault()
    drawing = ezdxf.new("R2013")
    dxf_faces(drawing.modelspace(), nodes, quads)
    drawing.modelspace().add_spline([(0, 0, 0), (1, 1, 1), (2, 0, 0)])
    drawing.modelspace().add_lwpolyline([(0, 0, 0, 0, 0.5), (1, 0)])
    drawing.saveas(tmp_path / "a.dxf")
    assert "not read: 1 SPLINE, 1 ARC" in read_model(tmp_path / "a.dxf").notes[0]


@pytest.mark.parametrize("block", [False, True])
@pytest.mark.parametrize("shape", ["mesh", "polylines", "lines"])
def test_what_rhino_files_of_others_hold(shape: str, block: bool, tmp_path: Path) -> None:
    nodes, quads = vault()
    places = nodes - [3.0, 0.0, 1.0] if block else nodes
    points = [rhino3dm.Point3d(*place) for place in places.tolist()]
    shapes: list[Any] = []
    if shape == "mesh":
        mesh = rhino3dm.Mesh()
        mesh.Vertices.UseDoublePrecisionVertices = True
        for place in places.tolist():
            mesh.Vertices.AddPoint3d(*place)
        for loop in quads:
            mesh.Faces.AddFace(*loop)
        shapes.append(mesh)
    elif shape == "polylines":
        for loop in quads:
            outline = rhino3dm.Polyline(5)
            for k in (*loop, loop[0]):
                outline.Add(points[k].X, points[k].Y, points[k].Z)
            shapes.append(outline.ToPolylineCurve())
    else:
        shapes = [rhino3dm.LineCurve(points[a], points[b]).ToNurbsCurve() for a, b in lines_of(quads)]
    file = rhino3dm.File3dm()
    file.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Meters
    if block:
        attributes = tuple(rhino3dm.ObjectAttributes() for _ in shapes)
        number = file.InstanceDefinitions.Add("roof", "", "", "", rhino3dm.Point3d(0, 0, 0), tuple(shapes), attributes)
        moved = rhino3dm.Transform.Translation(3.0, 0.0, 1.0)
        copy = rhino3dm.InstanceReference(file.InstanceDefinitions.FindIndex(number).Id, moved)
        file.Objects.AddInstanceObject(copy, rhino3dm.ObjectAttributes())
    else:
        for each in shapes:
            (file.Objects.AddMesh if shape == "mesh" else file.Objects.AddCurve)(each)
    file.Write(str(tmp_path / "a.3dm"), 8)
    hold(tmp_path / "a.3dm", nodes, quads, "m")


class Building:
    """An IFC file of members in a storey that is turned and moved, in millimetres."""

    def __init__(self) -> None:
        self.file = file = ifcopenshell.file(schema="IFC4")
        add = file.create_entity
        self.zero, self.z = add("IfcCartesianPoint", (0.0, 0.0, 0.0)), add("IfcDirection", (0.0, 0.0, 1.0))
        plain = add("IfcAxis2Placement3D", self.zero)
        self.context = add("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, plain)
        unit = add("IfcSIUnit", UnitType="LENGTHUNIT", Prefix="MILLI", Name="METRE")
        units = add("IfcUnitAssignment", (unit,))
        guid = ifcopenshell.guid.new
        project = add("IfcProject", guid(), RepresentationContexts=(self.context,), UnitsInContext=units)
        site_at = add("IfcLocalPlacement", None, self.placement((500_000_250.0, 4e9, 12_000.0), (0.8, 0.6, 0.0)))
        self.place = add("IfcLocalPlacement", site_at, self.placement((1000.0, 2000.0, 3000.0), (0.0, 1.0, 0.0)))
        site, storey = add("IfcSite", guid(), ObjectPlacement=site_at), add("IfcBuildingStorey", guid())
        storey.ObjectPlacement = self.place
        add("IfcRelAggregates", guid(), RelatingObject=project, RelatedObjects=(site,))
        add("IfcRelAggregates", guid(), RelatingObject=site, RelatedObjects=(storey,))
        self.storey = storey

    def placement(self, at: Any, x: Any, z: Any = (0.0, 0.0, 1.0)) -> Any:
        add = self.file.create_entity
        point, ahead, up = (
            add(kind, tuple(map(float, values)))
            for kind, values in (("IfcCartesianPoint", at), ("IfcDirection", x), ("IfcDirection", z))
        )
        return add("IfcAxis2Placement3D", point, up, ahead)

    def axis(self, kind: str, length: float) -> tuple[str, Any]:
        """The identifier and item of a representation along z."""
        add = self.file.create_entity
        end = add("IfcCartesianPoint", (0.0, 0.0, length))
        line = add("IfcPolyline", (self.zero, end))
        profile = add("IfcCircleProfileDef", ProfileType="AREA", Radius=30.0)
        if kind == "mapped":
            unit = add("IfcPolyline", (self.zero, add("IfcCartesianPoint", (0.0, 0.0, 1.0))))
            shape = add("IfcShapeRepresentation", self.context, "Axis", "Curve3D", (unit,))
            source = add("IfcRepresentationMap", self.placement((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), shape)
            to = add("IfcCartesianTransformationOperator3D", LocalOrigin=self.zero, Scale=length)
            return "Axis", add("IfcMappedItem", source, to)
        if kind == "trimmed":
            vector = add("IfcVector", self.z, 2.0)
            ends = [(add("IfcParameterValue", value),) for value in (0.0, length / 2)]
            return "Axis", add("IfcTrimmedCurve", add("IfcLine", self.zero, vector), *ends, True, "PARAMETER")
        if kind == "indexed":
            points = add("IfcCartesianPointList3D", ((0.0, 0.0, 0.0), (0.0, 0.0, length / 3), (0.0, 0.0, length)))
            return "Axis", add("IfcIndexedPolyCurve", points)
        if kind == "extruded":
            return "Body", add("IfcExtrudedAreaSolid", profile, None, self.z, length)
        if kind == "cut":
            plane = add("IfcPlane", self.placement((0.0, 0.0, length), (1.0, 0.0, 0.0)))
            solid = add("IfcExtrudedAreaSolid", profile, None, self.z, length)
            half = add("IfcHalfSpaceSolid", plane, False)
            return "Body", add("IfcBooleanClippingResult", "DIFFERENCE", solid, half)
        return "Body", add("IfcSweptDiskSolid", Directrix=line, Radius=30.0)

    def member(self, kind: str, name: str, start: np.ndarray, end: np.ndarray) -> None:
        add = self.file.create_entity
        way = end - start
        length = float(np.linalg.norm(way))
        aside = np.cross([0.0, 0.0, 1.0], way)
        frame = add("IfcLocalPlacement", self.place, self.placement(start, aside, way / length))
        identifier, item = self.axis(kind, length)
        type_ = {"mapped": "MappedRepresentation", "extruded": "SweptSolid", "cut": "Clipping"}.get(kind, "Curve3D")
        shape = add("IfcShapeRepresentation", self.context, identifier, type_, (item,))
        whole = add("IfcProductDefinitionShape", Representations=(shape,))
        part = add(name, ifcopenshell.guid.new(), ObjectPlacement=frame, Representation=whole)
        guid = ifcopenshell.guid.new()
        add("IfcRelContainedInSpatialStructure", guid, RelatedElements=(part,), RelatingStructure=self.storey)


@pytest.mark.parametrize("kind", ["mapped", "trimmed", "indexed", "extruded", "cut", "swept"])
def test_members_of_ifc_files_of_others(kind: str, tmp_path: Path) -> None:
    grid = dome(3, length=2.0)
    building = Building()
    for number, (start, end) in enumerate(grid.edges.tolist()):
        name = ("IfcMember", "IfcBeam", "IfcColumn")[number % 3]
        building.member(kind, name, 1e3 * grid.nodes[start], 1e3 * grid.nodes[end])
    building.file.write(str(tmp_path / "a.ifc"))
    found = read_model(tmp_path / "a.ifc")
    x, y, z = grid.nodes.T  # the storey turns by 90 degrees and moves, the site turns by atan 3/4 and moves
    x, y, z = 1.0 - y, 2.0 + x, z + 3.0
    there = np.stack([500_000.25 + 0.8 * x - 0.6 * y, 4e6 + 0.6 * x + 0.8 * y, 12.0 + z], axis=1)
    order = np.lexsort(np.round(found.nodes.T, 4))
    assert np.abs(found.nodes[order] - there[np.lexsort(np.round(there.T, 4))]).max() < 1e-6
    assert found.unit == "m" and len(found.members) == len(grid.edges) and len(found.triangles) == len(grid.triangles)
    by_body = kind in ("extruded", "cut", "swept")
    assert ("no axis but that of their body" in found.notes[0]) == by_body


def test_a_bent_axis_of_ifc_is_counted_not_read(tmp_path: Path) -> None:
    building = Building()
    building.member("indexed", "IfcBeam", np.zeros(3), np.array([0.0, 1000.0, 1000.0]))
    (points,) = building.file.by_type("IfcCartesianPointList3D")
    points.CoordList = ((0.0, 0.0, 0.0), (0.0, 50.0, 500.0), (0.0, 0.0, 1000.0))
    building.file.write(str(tmp_path / "a.ifc"))
    assert "1 members without a straight axis" in draw_ifc(tmp_path / "a.ifc").left


def test_meshes_and_graphs_of_compas_as_it_writes_them(tmp_path: Path) -> None:
    compas = pytest.importorskip("compas")
    parts: Any = pytest.importorskip("compas.datastructures")
    derived: Any = type("Shell", (parts.Mesh,), {})  # as other packages do
    nodes, quads = vault()
    path = tmp_path / "a.compas.json"
    compas.json_dump(parts.Mesh.from_vertices_and_faces(nodes.tolist(), quads), path)
    hold(path, nodes, quads)
    compas.json_dump({"steps": [1, {"shell": derived.from_vertices_and_faces(nodes.tolist(), quads)}]}, path)
    hold(path, nodes, quads)
    compas.json_dump([parts.Graph.from_nodes_and_edges(nodes.tolist(), lines_of(quads))], path)
    hold(path, nodes, quads)
    both = [parts.Mesh.from_vertices_and_faces(nodes.tolist(), quads) for _ in range(2)]
    compas.json_dump(both, path)
    assert "not read: 1 more Mesh or Graph" in read_model(path).notes[0]


def test_faces_without_lines_between_them_are_one_panel() -> None:
    nodes, quads = vault()
    halves = np.array([half for a, b, c, d in quads for half in ((a, b, c), (c, d, a))])
    lines = np.array(lines_of(quads))
    grid, (note,) = grid_of_drawing(Drawing(nodes, lines, halves), "a.obj")
    assert (
        places_of(grid) == places_of(grid_of(nodes, quads)) and f"{len(quads)} sides of its faces are no lines" in note
    )
    grid, (note,) = grid_of_drawing(Drawing(nodes, lines[:5], halves), "a.obj")  # some lines, as of a ridge
    assert len(grid.panel_table) == len(halves) and "no lines, and members all the same" in note
    around = lines[[{a, b} <= {0, 1, 2, 6, 8, 12, 13, 14} for a, b in lines.tolist()]]  # node 7 would lie within
    grid, _ = grid_of_drawing(Drawing(nodes, around, halves), "a.obj")
    assert len(grid.panel_table) == len(halves)


def test_lines_of_quads_leave_the_ends_of_a_tube_open() -> None:
    """Four lines around a tube have panels on both sides; those at its ends are closed, as an opening of three is."""
    turn = np.arange(4) * math.pi / 2
    nodes = np.array([(math.cos(t), math.sin(t), z) for z in (0.0, 1.0, 2.0) for t in turn])
    around = [(4 * z + k, 4 * z + (k + 1) % 4) for z in range(3) for k in range(4)]
    up = [(4 * z + k, 4 * z + k + 4) for z in range(2) for k in range(4)]
    grid, _ = grid_of_drawing(Drawing(nodes, np.array(around + up)), "a.obj")
    assert len(grid.panel_table) == 10 and grid.topology.euler == 2
    middle = nodes.mean(axis=0)
    corners = grid.nodes[grid.triangles]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (((corners.mean(axis=1) - middle) * areas).sum(axis=1) > 0).all()


def test_commands_take_quads_of_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    nodes, quads = vault()
    drawing = ezdxf.new("R2013")
    drawing.header["$INSUNITS"] = 6
    dxf_closed_polylines(drawing.modelspace(), nodes, quads)
    drawing.saveas("a.dxf")
    assert main("structure a.dxf b.json b.ifc b.saf.xlsx b.xlsx b.geojson --supports boundary".split()) == 0
    assert main("schedule a.dxf c.xlsx --tube 60x3".split()) == 0
    assert main("print a.dxf d.3mf --scale 1:50 --member-diameter 0.002 --node-diameter 0.004".split()) == 0


def test_a_closed_body_of_which_one_side_alone_is_drawn_keeps_its_faces() -> None:
    """Joined, they would have that side twice and no other, which is no outline."""
    faces = np.array([[0, 1, 2], [1, 0, 3], [0, 2, 3], [2, 1, 3]])
    assert np.array_equal(without_diagonals(faces, np.array([[0, 1]])), faces)
