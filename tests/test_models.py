"""Rhino, GLB, VTU and STEP files read back by libraries that are not ours, or by a reader of their bare text."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import rhino3dm
import trimesh
from small_grids import cloud_over, dome, fan, make_grid
from test_convert import UTM, roof

import scantruss as st
from scantruss.export.glb import SIDES_OF_TUBE, colours_of, linear
from scantruss.export.model import model_of_truss
from scantruss.export.part21 import ifc_guid, quoted, real
from scantruss.export.style import FileStyle
from scantruss.grid.line_sets import LineSet

NAME = "Träger 'Süd' 中文 🙂"


def sheet(unit: str = "m") -> st.Grid:
    line = LineSet(NAME, "fixed line", np.array([0, 1, 2]))
    return fan(4.0, unit=unit, origin=UTM, fixed=(1,), lines=np.array([[0, 1], [1, 2]]), line_sets=(line,))


def test_rhino_holds_lines_points_and_a_mesh_in_double_precision(tmp_path: Path) -> None:
    grid = sheet()
    st.write(grid, tmp_path / "Dach 屋顶.3dm")
    file = rhino3dm.File3dm.Read(str(tmp_path / "Dach 屋顶.3dm"))
    assert file.Settings.ModelUnitSystem == rhino3dm.UnitSystem.Meters
    assert {layer.Name for layer in file.Layers} == {
        "members boundary", "members inner", f"members {NAME}", "nodes", "supports", "panels",
    }  # fmt: skip
    lines = [each for each in file.Objects if each.Geometry.ObjectType == rhino3dm.ObjectType.Curve]
    points = {
        each.Attributes.Name: each for each in file.Objects if each.Geometry.ObjectType == rhino3dm.ObjectType.Point
    }
    (mesh,) = (each.Geometry for each in file.Objects if each.Geometry.ObjectType == rhino3dm.ObjectType.Mesh)
    for number, each in enumerate(lines):
        for end, point in enumerate((each.Geometry.PointAtStart, each.Geometry.PointAtEnd)):
            assert np.abs(np.array([point.X, point.Y, point.Z]) - grid.scan_nodes[grid.edges[number, end]]).max() < 1e-6
        start, end_ = grid.edges[number] + 1
        texts = dict(each.Attributes.GetUserStrings())
        assert (texts["mark"], texts["start"], texts["end"]) == (f"M{number + 1:04d}", f"N{start:03d}", f"N{end_:03d}")
        assert file.Layers[each.Attributes.LayerIndex].Name == f"members {texts['group']}"
    for number, place in enumerate(grid.scan_nodes):
        point = points[f"N{number + 1:03d}"].Geometry.Location
        assert np.abs(np.array([point.X, point.Y, point.Z]) - place).max() < 1e-6
        point = mesh.Vertices.Point3dAt(number)
        assert np.abs(np.array([point.X, point.Y, point.Z]) - place).max() < 1e-6
    assert [list(mesh.Faces[k])[:3] for k in range(len(mesh.Faces))] == grid.triangles.tolist()
    assert points["N002"].Attributes.GetUserString("held") == "fixed node"
    assert (file.Created.year, file.LastEdited.year) == (1980, 1980) and file.ApplicationName.startswith("ScanTruss")
    ids = [str(each.Attributes.Id) for each in file.Objects]
    assert len(set(ids)) == len(ids)


def test_rhino_names_sections_and_supports_of_a_structure(tmp_path: Path) -> None:
    truss = roof(3, support_type="fixed")
    st.write(truss, tmp_path / "a.3dm")
    file = rhino3dm.File3dm.Read(str(tmp_path / "a.3dm"))
    texts = [dict(each.Attributes.GetUserStrings()) for each in file.Objects]
    assert {words["section"] for words in texts if "section" in words} == {"CHS114.3x5"}
    assert sum(words.get("held") == "ux uy uz rx ry rz" for words in texts) == truss.supports.any(axis=1).sum()


@pytest.mark.parametrize("kind", ["grid", "structure"])
def test_glb_stands_upright_where_the_grid_is(kind: str, tmp_path: Path) -> None:
    grid = dome(4, unit="mm", length=4000.0, origin=UTM * 1000)
    what = grid if kind == "grid" else st.solve(st.Truss.from_grid(grid, supports="boundary"))
    st.write(what, tmp_path / "a.glb", cloud=cloud_over(grid) if kind == "grid" else None)
    scene: Any = trimesh.load(tmp_path / "a.glb")
    parts = scene.geometry
    assert set(parts) == {"members", "nodes", "panels"} | ({"scan"} if kind == "grid" else set())
    upright = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # x, z, -y
    nodes = grid.nodes / 1000 @ upright.T
    placed = {scene.graph[node][1]: scene.graph[node][0] for node in scene.graph.nodes_geometry}
    panels = trimesh.transform_points(parts["panels"].vertices, placed["panels"])
    assert np.abs(panels[parts["panels"].faces] - nodes[grid.triangles]).max() < 1e-5
    tubes = trimesh.transform_points(parts["members"].vertices, placed["members"])
    assert len(parts["members"].faces) == 2 * SIDES_OF_TUBE * len(grid.edges)
    if kind == "structure":
        ends = nodes[grid.edges][:, :, None]
        first = tubes.reshape(len(grid.edges), 2, SIDES_OF_TUBE, 3)
        np.testing.assert_allclose(np.linalg.norm(first - ends, axis=-1), 0.1143 / 2, atol=1e-5)
        along = np.einsum("mesx,mx->mes", first - ends, (ends[:, 1] - ends[:, 0])[:, 0])
        assert np.abs(along).max() < 1e-4
    content = (tmp_path / "a.glb").read_bytes()
    head = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    assert head["nodes"][0]["extras"]["origin"] == pytest.approx(UTM.tolist()) and head["asset"]["version"] == "2.0"


def test_tubes_have_the_colour_of_their_utilization(tmp_path: Path) -> None:
    assert colours_of(np.array([0.0, 1.0, 2.0, np.nan])).tolist() == [
        [38, 130, 142, 255], [200, 30, 30, 255], [200, 30, 30, 255], [128, 128, 128, 255],
    ]  # fmt: skip
    assert linear(np.array([[255, 188, 0, 255]])).tolist() == [[255, 128, 0, 255]]  # 188 of a screen is half the light
    truss = roof(3)
    used = np.linspace(0, 1, len(truss.members))
    st.write(model_of_truss(truss, utilization=used), tmp_path / "a.glb")
    scene: Any = trimesh.load(tmp_path / "a.glb")
    shades = np.asarray(scene.geometry["members"].visual.vertex_attributes["color"])
    np.testing.assert_array_equal(shades.reshape(len(used), -1, 4)[:, 0], linear(colours_of(used)))


def test_vtu_holds_results_of_nodes_and_members(tmp_path: Path) -> None:
    truss = roof(4)
    solution = st.solve(truss)
    st.write(solution, tmp_path / "Dach 屋顶.vtu")
    found = meshio.read(tmp_path / "Dach 屋顶.vtu")
    assert np.abs(found.points - truss.nodes - UTM).max() < 1e-6
    np.testing.assert_array_equal(found.cells_dict["line"], truss.members)
    np.testing.assert_array_equal(found.cells_dict["triangle"], truss.triangles)
    np.testing.assert_array_equal(found.point_data["supported"], truss.supports.any(axis=1))
    for case in solution.cases:
        np.testing.assert_array_equal(found.point_data[f"displacement {case.name} [m]"], case.displacements[:, :3])
        force = found.cell_data_dict[f"axial force {case.name} [N]"]["line"]
        assert np.abs(force).tolist() == np.abs(case.axial).max(axis=1).tolist()
    np.testing.assert_allclose(found.cell_data_dict["length"]["line"], truss.lengths)
    assert np.isnan(found.cell_data_dict["length"]["triangle"]).all()
    st.write(sheet(), tmp_path / "b.vtu")
    assert NAME in (tmp_path / "b.vtu").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("unit", "size", "prefix"), [("mm", 1, ".MILLI."), ("m", 1, "$"), ("foot", 0.3048, "$"), ("cm", 1, ".CENTI.")]
)
def test_step_holds_the_axes_with_their_marks(unit: str, size: float, prefix: str, tmp_path: Path) -> None:
    grid = sheet(unit)
    st.write(grid, tmp_path / "a.stp")
    text = (tmp_path / "a.stp").read_text(encoding="ascii")
    lines = dict(re.findall(r"^#(\d+)=(.*);$", text, re.MULTILINE))
    used = {number for line in lines.values() for number in re.findall(r"#(\d+)", line)}
    assert used <= lines.keys() and text.startswith("ISO-10303-21;\n") and f"SI_UNIT({prefix},.METRE.)" in text
    curves = [line for line in lines.values() if line.startswith("TRIMMED_CURVE")]
    for curve, (start, end), number in zip(curves, grid.edges, range(1, 13), strict=True):
        mark, line, one, other = re.match(r"TRIMMED_CURVE\('(\w+)',#(\d+),\(#(\d+)\),\(#(\d+)\)", curve).groups()  # type: ignore[union-attr]
        places = [[float(c) for c in re.findall(r"-?\d+\.\d*(?:E-?\d+)?", lines[point])] for point in (one, other)]
        assert mark == f"M{number:04d}"
        assert np.abs(np.array(places) - grid.scan_nodes[[start, end]] * size).max() < 1e-6
        assert lines[line].startswith(f"LINE('{mark}',#{one},")
    assert r"'members Tr\X2\00E4\X0\ger ''S\X2\00FC\X0\d'' \X2\4E2D6587\X0\ \X4\0001F642\X0\'" in text


def test_texts_and_numbers_of_part_21() -> None:
    assert [real(value) for value in (1.0, -0.0, 1e-5, 1.5e300, 0.1)] == ["1.0", "-0.0", "1.E-05", "1.5E+300", "0.1"]
    assert quoted("a\\b'c\n") == r"'a\\b''c\X2\000A\X0\'"
    model = model_of_truss(roof(3))
    assert len(ifc_guid(model.guid("member", "M0001"))) == 22


@pytest.mark.parametrize("suffix", [".3dm", ".glb", ".vtu", ".step", ".dxf", ".ifc"])
def test_one_node_alone_is_written(suffix: str, tmp_path: Path) -> None:
    (path,) = st.write(make_grid([(0, 0, 0)], []), tmp_path / f"a{suffix}", style=FileStyle())
    assert path.stat().st_size > 0
