"""Grids of lines and faces that others drew."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import rhino3dm
import trimesh
from small_grids import dome, make_grid
from test_convert import UTM, roof

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.drawing_in import Drawing, grid_of_drawing
from scantruss.export.formats import read_model
from scantruss.export.style import FileStyle

OCTAHEDRON = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], float)
BIPYRAMID = np.array([(1, 0, 0), (-0.5, 0.9, 0), (-0.5, -0.9, 0), (0, 0, 1), (0, 0, -1)], float)


def panels(grid: st.Grid) -> set[frozenset[tuple[float, ...]]]:
    """The panels by the places of their corners."""
    return {frozenset(map(tuple, np.round(grid.scan_nodes[each], 5).tolist())) for each in grid.triangles}


def areas(grid: st.Grid) -> np.ndarray:
    a, b, c = (grid.nodes[corner] for corner in grid.triangles.T)
    return np.cross(b - a, c - a)


def drawn(points: Any, lines: Any = (), faces: Any = ()) -> st.Grid:
    """The grid of a drawing."""
    places = np.array(points, float).reshape(-1, 3)
    pairs, corners = (np.array(list(each), np.int64).reshape(-1, k) for each, k in ((lines, 2), (faces, 3)))
    return grid_of_drawing(Drawing(places, pairs, corners), "a.obj")[0]


@pytest.mark.parametrize(
    ("suffix", "style"),
    [(".obj", {}), (".obj", {"obj": "lines"}), (".obj", {"obj": "both"}), (".ply", {}), (".dxf", {}), (".3dm", {}), (".ifc", {}),
     (".compas.json", {})],
)  # fmt: skip
def test_what_is_written_is_read_back_as_the_same_grid(suffix: str, style: dict[str, Any], tmp_path: Path) -> None:
    grid = dome(6, origin=UTM, unit="m")
    st.write(grid, tmp_path / f"Dach 屋顶{suffix}", style=FileStyle(**style))
    model = read_model(tmp_path / f"Dach 屋顶{suffix}")
    assert model.grid is not None and model.unit == "m" and model.grid.certificate is None
    assert panels(model.grid) == panels(grid) and len(model.grid.nodes) == len(grid.nodes)
    assert (areas(model.grid)[:, 2] > 0).all() and np.abs(model.grid.nodes).max() < 1e3
    assert len(model.notes) == 1 and "no certificate" in model.notes[0]


def test_the_axes_of_an_analysis_model_are_read(tmp_path: Path) -> None:
    grid = dome(4, origin=UTM, unit="m")
    truss = st.Truss.from_grid(grid, supports="boundary")
    st.write(truss, tmp_path / "a.ifc", style=FileStyle(ifc="analysis"))
    found = read_model(tmp_path / "a.ifc").grid
    assert found is not None and panels(found) == panels(grid)


def test_a_drawing_of_ezdxf_with_inexact_ends_and_polylines(tmp_path: Path) -> None:
    grid = dome(5, unit="mm", length=3000.0)
    rng = np.random.default_rng(2)
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = 4
    space = drawing.modelspace()
    for number, (start, end) in enumerate(grid.edges.tolist()):
        ends = [tuple(grid.nodes[k] + rng.uniform(-0.5, 0.5, 3)) for k in (start, end)]
        if number % 2:
            space.add_line(*ends)
        else:
            space.add_polyline3d(ends)
    space.add_text("a")
    space.add_circle((0, 0), 5)
    drawing.saveas(tmp_path / "a.dxf")
    model = read_model(tmp_path / "a.dxf")
    assert model.grid is not None and model.unit == "mm" and "not read: 1 CIRCLE" in model.notes[0]
    assert len(model.grid.triangles) == len(grid.triangles) and len(model.grid.edges) == len(grid.edges)
    with pytest.raises(st.FormatError, match="pairs of ends within 154 of each other that are not joined"):
        read_model(tmp_path / "a.dxf", merge=0.1)


def test_meshes_of_other_libraries(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(1)
    for suffix in (".obj", ".ply"):
        ball.export(tmp_path / f"a{suffix}")
        found = read_model(tmp_path / f"a{suffix}").grid
        assert found is not None and found.topology.euler == 2 and len(found.triangles) == 80 and found.unit == ""
    file, mesh = rhino3dm.File3dm(), rhino3dm.Mesh()
    for place in OCTAHEDRON.tolist():
        mesh.Vertices.Add(*place)
    for face in trimesh.Trimesh(OCTAHEDRON).convex_hull.faces.tolist():
        mesh.Faces.AddFace(*face)
    file.Objects.AddMesh(mesh)
    file.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Feet
    file.Write(str(tmp_path / "a.3dm"), 8)
    found = read_model(tmp_path / "a.3dm").grid
    assert found is not None and found.topology.euler == 2 and found.unit == "foot"


def test_lines_of_closed_bodies_become_panels_that_look_outwards() -> None:
    pairs = [(a, b) for a, b in combinations(range(6), 2) if a // 2 != b // 2]
    grid = drawn(OCTAHEDRON, pairs)
    assert len(grid.triangles) == 8
    assert ((grid.nodes[grid.triangles].mean(axis=1) * areas(grid)).sum(axis=1) > 0).all()
    two = drawn(BIPYRAMID, [*combinations(range(3), 2), *((k, top) for k in range(3) for top in (3, 4))])
    assert len(two.triangles) == 6 and {0, 1, 2} not in [set(each) for each in two.triangles.tolist()]


def test_panels_of_lines_are_those_of_a_slow_search() -> None:
    grid = dome(7)
    edges = {tuple(edge) for edge in grid.edges.tolist()}
    slow = {
        frozenset(each) for each in combinations(range(len(grid.nodes)), 3) if edges.issuperset(combinations(each, 2))
    }
    found = drawn(grid.nodes, grid.edges[np.random.default_rng(0).permutation(len(grid.edges))][:, ::-1])
    assert {frozenset(map(tuple, grid.nodes[list(each)].tolist())) for each in slow} == {
        frozenset(map(tuple, found.nodes[each].tolist())) for each in found.triangles
    }


def test_faces_that_are_not_wound_alike_are_turned() -> None:
    grid = dome(5)
    faces = grid.triangles.copy()
    faces[3::4] = faces[3::4, ::-1]
    np.testing.assert_array_equal(drawn(grid.nodes, faces=faces).triangles[:, 0], faces[:, 0])
    assert (areas(drawn(grid.nodes, faces=faces))[:, 2] > 0).all()


MOEBIUS = [(0, 1, 2), (1, 3, 2), (2, 3, 4), (3, 0, 4), (4, 0, 1)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("v 0 0 0\n", "no lines and no faces"),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 2\n", "meets itself"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", "names points that it does not have"),
        ("v 0 0 0\nv 1 0\nf 1 2 3\n", "line 2 is damaged"),
        ("v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "not a number"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nf 1 2 3\nl 1 4\n", "no longer than"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n", "no surface"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n", "no surface"),
        ("".join(f"v {k * k} {k} {k**3}\n" for k in range(5)) + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in MOEBIUS), "one side"),
        ("", "is empty"),
    ],
)  # fmt: skip
def test_what_is_no_grid_is_refused_in_one_line(
    text: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.obj"
    path.write_text(text, encoding="ascii")
    assert main(["convert", str(path), str(tmp_path / "b.ply")]) == 2
    line = capsys.readouterr().err
    assert said in line and line.count("\n") == 1, line
    assert not (tmp_path / "b.ply").exists()


@pytest.mark.parametrize("suffix", [".dxf", ".3dm", ".ifc", ".ply"])
def test_damaged_files_are_refused_in_one_line(suffix: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"ISO-10303-21;\nnothing\n")
    assert main(["convert", str(path), str(tmp_path / "b.obj")]) == 2
    line = capfd.readouterr().err
    assert "Traceback" not in line and "scantruss: " in line


def test_compas_loads_mesh_and_graph(tmp_path: Path) -> None:
    compas = pytest.importorskip("compas")
    truss = roof(4)
    st.write(truss, tmp_path / "Dach 屋顶.compas.json")
    found = compas.json_load(tmp_path / "Dach 屋顶.compas.json")
    mesh, graph = found["mesh"], found["graph"]
    for each, places in ((mesh, mesh.vertices()), (graph, graph.nodes())):
        method = each.vertex_coordinates if each is mesh else each.node_coordinates
        assert np.abs(np.array([method(key) for key in places]) - truss.nodes - UTM).max() < 1e-6
    assert [mesh.face_vertices(face) for face in mesh.faces()] == truss.triangles.tolist()
    marks = {edge: graph.edge_attribute(edge, "mark") for edge in graph.edges()}
    assert marks == dict(zip(map(tuple, truss.members.tolist()), truss.member_marks, strict=True))
    held = [key for key in graph.nodes() if graph.node_attribute(key, "is_support")]
    assert held == np.flatnonzero(truss.supports.any(axis=1)).tolist()
    compas.json_dump(graph, tmp_path / "b.compas.json")  # by compas itself
    grid = read_model(tmp_path / "b.compas.json").grid
    assert grid is not None and panels(grid) == panels(dome(4, origin=UTM, unit="m"))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "cannot be read"),
        ('{"a": 1}', "no Mesh and no Graph"),
        ('{"dtype": "compas.datastructures/Mesh", "data": {"vertex": {}, "face": {"0": [1, 2, 3]}}}', "cannot be understood"),
    ],
)  # fmt: skip
def test_damaged_compas_files_are_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "a.compas.json").write_text(text, encoding="utf-8")
    with pytest.raises(st.FormatError, match=said):
        read_model(tmp_path / "a.compas.json")


@pytest.mark.parametrize(
    "words",
    [
        "structure net.dxf out.json --supports boundary",
        "schedule net.3dm out.csv --tube 60x3",
        "setout net.ifc out.csv --supports boundary",
        "print net.obj out.3mf --member-diameter 0.1 --node-diameter 0.3",
        "convert net.ply out.vtu",
    ],
)
def test_commands_take_grids_of_others_and_say_so(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    _, source, out, *_ = words.split()
    st.write(dome(4, origin=UTM, unit="m"), source)
    assert main([*words.split(), "--merge", "0.01"]) == 0
    said = capsys.readouterr()
    assert (said.out + said.err).count(f"{source} has no certificate: it was compared with no scan") == 1
    assert Path(out).stat().st_size > 0
    assert main([*words.split(), "--merge", "-1"]) == 2
    assert "--merge must be" in capsys.readouterr().err


def test_a_grid_with_an_opening_of_three_members_is_said_to_have_a_panel_there(tmp_path: Path) -> None:
    grid = make_grid([(0, 0, 0), (4, 0, 0), (2, 3, 0)], [(0, 1, 2)])
    st.write(grid, tmp_path / "a.obj", style=FileStyle(obj="lines"))
    assert "its panels are all 1 cycles of three lines" in read_model(tmp_path / "a.obj").notes[0]
