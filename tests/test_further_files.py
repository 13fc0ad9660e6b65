"""GeoJSON, XLSX, 3MF, STL and STEP bodies read back by libraries that are not ours; the reference system of a scan in all that follows."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
import rasterio.crs
import shapely.geometry
import trimesh
from scan_files import geotiff, plate
from small_grids import dome
from small_trusses import make_truss
from test_convert import UTM, roof
from test_models import sheet

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.bodies import Bodies, bodies_of
from scantruss.export.formats import read_model
from scantruss.export.model import model_of_truss
from scantruss.export.outlines import outlines_of, polygon_of
from scantruss.export.style import FileStyle
from scantruss.structure.catalogue import find_section

SECTIONS = {"CHS114.3x5": "S355", "SHS100x5": "S355", "IPE100": "S355", "R100x200": "GL24h"}


def test_geojson_places_nodes_members_and_panels_in_the_reference_system(tmp_path: Path) -> None:
    truss = roof(4).replace(system="EPSG:25833")
    solution = st.solve(truss)
    st.write(solution, tmp_path / "Dach 屋顶.geojson")
    held = json.loads((tmp_path / "Dach 屋顶.geojson").read_text(encoding="utf-8"))
    assert rasterio.crs.CRS.from_user_input(held["crs"]["properties"]["name"]).to_epsg() == 25833
    by_kind: dict[str, list[Any]] = {"node": [], "member": [], "panel": []}
    for feature in held["features"]:
        by_kind[feature["properties"]["kind"]].append(
            (feature["properties"], shapely.geometry.shape(feature["geometry"]))
        )
    places = truss.nodes + UTM
    assert [found["mark"] for found, _ in by_kind["node"]] == list(truss.node_marks)
    assert np.abs([shape.coords[0] for _, shape in by_kind["node"]] - places).max() < 1e-6
    assert sum("held" in found for found, _ in by_kind["node"]) == truss.supports.any(axis=1).sum()
    for number, (found, shape) in enumerate(by_kind["member"]):
        start, end = truss.members[number]
        assert (found["mark"], found["start"]) == (truss.member_marks[number], truss.node_marks[start])
        assert np.abs(np.array(shape.coords) - places[[start, end]]).max() < 1e-6 and found["section"] == "CHS114.3x5"
        for case in solution.cases:
            assert abs(found[f"axial force {case.name} [N]"]) == np.abs(case.axial[number]).max()
    for (_, shape), triangle in zip(by_kind["panel"], truss.triangles, strict=True):
        assert shape.is_valid and np.abs(np.array(shape.exterior.coords)[:3] - places[triangle]).max() < 1e-6


def test_geojson_names_no_system_where_none_is_known(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    st.write(dome(3, origin=UTM, unit="m"), tmp_path / "net.json")
    names = [str(tmp_path / name) for name in ("net.json", "a.geojson", "b.ifc", "b.json")]
    assert main(["convert", *names[:2]]) == 0
    assert "give it with --system EPSG:CODE" in capsys.readouterr().err
    assert json.loads(Path(names[1]).read_text())["crs"] is None
    assert main(["convert", *names, "--system", "EPSG:25833"]) == 0
    assert "--system" not in capsys.readouterr().err
    assert json.loads(Path(names[1]).read_text())["crs"]["properties"]["name"].endswith("::25833")
    assert "IFCPROJECTEDCRS('EPSG:25833'" in Path(names[2]).read_text()
    assert read_model(names[3]).system == "EPSG:25833"
    for system, said in (("EPSG:32633", "leave --system out"), ("UTM33", "such as EPSG:25833")):
        assert main(["convert", names[3], str(tmp_path / "c.geojson"), "--system", system]) == 2
        assert said in capsys.readouterr().err
    st.write(dome(3, unit="mm"), tmp_path / "mm.json")
    assert main(["convert", str(tmp_path / "mm.json"), str(tmp_path / "c.geojson"), "--system", "EPSG:25833"]) == 2
    assert "in metres or feet" in capsys.readouterr().err


def test_the_reference_system_goes_from_the_scan_to_the_structure(tmp_path: Path) -> None:
    (tmp_path / "a.tif").write_bytes(geotiff(plate()))
    cloud = st.read_points(tmp_path / "a.tif")
    assert (cloud.system, cloud.unit) == ("EPSG:25833", "m")
    assert st.read_points(tmp_path / "a.tif", unit="mm").system == ""  # the coordinates are then said to be others
    grid = dome(3, unit="m", system=cloud.system)
    st.write(grid, tmp_path / "a.json")
    assert read_model(tmp_path / "a.json").system == "EPSG:25833"
    truss = st.Truss.from_grid(grid, supports="boundary")
    st.write(truss, tmp_path / "b.json")
    assert read_model(tmp_path / "b.json").system == truss.system == "EPSG:25833"
    assert st.Truss.from_grid(grid, supports="boundary", scale=2.0).system == ""


def rows_of(path: Path) -> dict[str, list[tuple[Any, ...]]]:
    return {sheet.title: list(sheet.iter_rows(values_only=True)) for sheet in openpyxl.load_workbook(path)}


def test_a_workbook_holds_all_of_a_structure(tmp_path: Path) -> None:
    truss = roof(4, joints=2e5, support_type="springs:5MN/m")
    solution = st.solve(truss)
    st.write(solution, tmp_path / "Dach 屋顶.xlsx")
    sheets = rows_of(tmp_path / "Dach 屋顶.xlsx")
    nodes = sheets["Nodes"][1:]
    assert [row[0] for row in nodes] == list(truss.node_marks) and sheets["Nodes"][0][1] == "x [m]"
    assert np.abs(np.array([row[1:4] for row in nodes], float) - truss.nodes - UTM).max() < 1e-6
    heads = sheets["Members"][0]
    members = [dict(zip(heads, row, strict=True)) for row in sheets["Members"][1:]]
    number = {mark: k for k, mark in enumerate(truss.node_marks)}
    assert [[number[row["start"]], number[row["end"]]] for row in members] == truss.members.tolist()
    assert {row["start My [Nm/rad]"] for row in members} == {2e5} and {row["section"] for row in members} == {
        "CHS114.3x5"
    }
    held = sheets["Supports"][1:]
    assert len(held) == truss.supports.any(axis=1).sum() and set(held[0][1:4]) == {5e6}
    assert len(sheets["Panels"]) == len(truss.triangles) + 1
    assert [row[:4] for row in sheets["Combinations"][1:]] == [
        (each.name, each.state, case, factor) for each in truss.combinations for case, factor in each.factors
    ]
    line = [row for row in sheets["Loads"] if row[0] == "snow"]
    (snow,) = (case for case in truss.cases if case.name == "snow")
    assert snow.nodal is not None
    found = np.zeros_like(snow.nodal)
    for row in line:
        found[number[row[3]]] = row[4:]
    np.testing.assert_array_equal(found, snow.nodal)
    for case in solution.cases:
        moved = np.array([row[2:] for row in sheets["Displacements"] if row[0] == case.name])
        np.testing.assert_array_equal(moved, case.displacements)
        ends = np.array([row[2:] for row in sheets["Forces"] if row[0] == case.name])
        np.testing.assert_allclose(ends.reshape(-1, 2, 6), case.along[:, [0, -1]])


def test_a_workbook_keeps_names_that_look_like_formulas(tmp_path: Path) -> None:
    st.write(sheet(), tmp_path / "a.xlsx")
    assert "Träger 'Süd' 中文 🙂" in {row[3] for row in rows_of(tmp_path / "a.xlsx")["Members"]}
    case = st.structure.truss.LoadCase("=A1 & <b>", nodal=np.ones((2, 6)))
    st.write(make_truss([(0, 0, 0), (1, 0, 0)], [(0, 1)], {0: (np.inf,) * 6}, case), tmp_path / "b.xlsx")
    assert rows_of(tmp_path / "b.xlsx")["Loads"][1][0] == "=A1 & <b>"


def volumes_of(bodies: Bodies, truss: st.Truss) -> tuple[np.ndarray, float]:
    """Return the volumes of the members between their balls (M,) and that of a ball."""
    return bodies.lengths * truss.of_section("area"), 4 / 3 * math.pi * bodies.ball**3


@pytest.mark.parametrize("name", SECTIONS)
def test_outlines_hold_the_area_of_their_section(name: str) -> None:
    """Arcs are replaced by chords, which lose 1.1 % of a round outline and nothing of a straight one."""
    section = find_section(name)
    areas = []
    for outline in outlines_of(section):
        (x, y), (u, v) = polygon_of(outline).T, np.roll(polygon_of(outline), -1, axis=0).T
        areas.append(float((x * v - u * y).sum() / 2))
    assert all(area > 0 for area in areas) and areas[0] - sum(areas[1:]) == pytest.approx(section.area, rel=0.012)


@pytest.mark.parametrize("name", SECTIONS)
def test_3mf_and_stl_hold_closed_bodies_where_the_structure_is(name: str, tmp_path: Path) -> None:
    truss = roof(3, section=name, material=SECTIONS[name])
    bodies = bodies_of(model_of_truss(truss), FileStyle())
    assert bodies is not None
    for suffix, size in ((".3mf", 1.0), (".stl", 1e3)):
        st.write(truss, tmp_path / f"a{suffix}")
        scene: Any = trimesh.load(tmp_path / f"a{suffix}")
        mesh = scene.to_geometry() if suffix == ".3mf" else scene
        mesh.merge_vertices()
        of_members, ball = volumes_of(bodies, truss)
        assert mesh.is_watertight and mesh.is_winding_consistent
        assert mesh.volume / size**3 == pytest.approx(of_members.sum() + len(truss.nodes) * ball, rel=0.03)
        low, high = mesh.bounds / size
        reach = bodies.ball + max(section.width + section.depth for section in truss.sections)
        assert (low > truss.nodes.min(axis=0) - reach).all() and (high < truss.nodes.max(axis=0) + reach).all()
        if suffix == ".3mf":
            assert scene.units in ("meter", "meters") and len(list(scene.graph.nodes_geometry)) == len(
                truss.nodes
            ) + len(truss.members)


def test_step_bodies_have_the_volumes_of_ours_in_open_cascade(tmp_path: Path) -> None:
    try:
        gmsh = pytest.importorskip("gmsh", exc_type=ImportError)
    except OSError as error:  # its wheel needs libraries of the system, such as libGLU
        pytest.skip(f"gmsh does not start: {error}")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        for name, material in SECTIONS.items():
            truss = roof(3, section=name, material=material)
            bodies = bodies_of(model_of_truss(truss), FileStyle())
            assert bodies is not None
            st.write(truss, tmp_path / "a.step", style=FileStyle(step="bodies"))
            gmsh.clear()
            found = gmsh.model.occ.importShapes(str(tmp_path / "a.step"))
            assert {dimension for dimension, _ in found} == {3}
            volumes = np.array([gmsh.model.occ.getMass(3, tag) for _, tag in found])
            of_members, ball = volumes_of(bodies, truss)
            np.testing.assert_allclose(volumes, [*of_members, *[ball] * len(truss.nodes)], rtol=1e-9)
            middles = np.array([gmsh.model.occ.getCenterOfMass(3, tag) for _, tag in found])
            np.testing.assert_allclose(middles, [*truss.nodes[truss.members].mean(axis=1), *truss.nodes], atol=1e-9)
    finally:
        gmsh.finalize()


def test_step_bodies_of_a_grid_need_a_tube(tmp_path: Path) -> None:
    with pytest.raises(st.FormatError, match="give --tube"):
        st.write(dome(3, unit="m"), tmp_path / "a.step", style=FileStyle(step="bodies"))
    (path,) = st.write(dome(3, unit="m"), tmp_path / "a.step", style=FileStyle(step="bodies", tube=(60.0, 3.0)))
    assert path.read_text().count("MANIFOLD_SOLID_BREP('M") == len(dome(3).edges)
    with pytest.raises(st.InputError, match="axes or bodies"):
        FileStyle(step="tubes")
