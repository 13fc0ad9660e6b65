"""The paper's examples run, and their grids are what the shapes allow; those of structures stand, and are as the docs say."""

from __future__ import annotations

import importlib
import importlib.util
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shapes import make

import scantruss as st

FOLDER = Path(__file__).resolve().parents[1] / "examples"


def run(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Import an example by its file and return what its main returns."""
    monkeypatch.syspath_prepend(str(FOLDER))
    spec = importlib.util.spec_from_file_location(f"example_{name}", FOLDER / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.main(folder)


def assert_right(grid: Any, name: str) -> None:
    """The topology of the shape; the whole surface is covered; the nodes lie on it."""
    shape, found = make(name, 10), grid.topology
    assert found.manifold and found.orientable
    assert (found.boundary_loops, found.euler, found.components) == (len(shape.loops), shape.euler, shape.components)
    a, b, c = (grid.nodes[grid.triangles[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(shape.area, rel=0.03)
    assert shape.distance(grid.nodes + grid.origin).mean() < 0.5 * shape.noise


def assert_good(grid: Any) -> None:
    """What the default method promises of the examples of the paper."""
    quality = grid.quality
    assert quality.shape_mean >= 0.985 and quality.shape_std <= 0.020 and quality.length_cv <= 0.08
    assert quality.length_mean == pytest.approx(grid.settings.length, rel=0.03)


def test_scallop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = run("01_scallop", tmp_path, monkeypatch)
    assert_right(grid, "scallop")
    assert_good(grid)
    assert (tmp_path / "scallop.png").stat().st_size > 10_000
    nodes = grid.nodes + grid.origin
    for corner in make("scallop", 10).corners:
        assert np.linalg.norm(nodes - corner, axis=1).min() < 0.1 * grid.settings.length


def test_clam(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grids = run("02_clam", tmp_path, monkeypatch)
    for grid in grids.values():
        assert_right(grid, "clam")
    assert_good(grids["default"])
    assert grids["paper"].quality.shape_mean > grids["paper"].before.shape_mean


def test_limpet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = run("03_limpet", tmp_path, monkeypatch)
    assert_right(grid, "limpet")
    assert (tmp_path / "limpet.3mf").stat().st_size > 10_000


def test_cloth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = run("04_cloth", tmp_path, monkeypatch)
    assert_right(grid, "cloth")
    assert_good(grid)
    for corner in make("cloth", 10).corners:
        assert np.linalg.norm(grid.nodes + grid.origin - corner, axis=1).min() < 0.1 * grid.settings.length


def test_two_holes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grids = run("05_two_holes", tmp_path, monkeypatch)
    assert set(grids) == {"external", "all"}
    for grid in grids.values():
        assert_right(grid, "two_holes")


def test_stadium(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = run("06_stadium", tmp_path, monkeypatch)
    assert_right(grid, "stadium")
    assert len(grid.boundary_loops) == 2


def test_fixed_nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid = run("07_fixed_nodes", tmp_path, monkeypatch)
    assert_right(grid, "scallop")
    assert grid.fixed.sum() == 3
    assert np.ptp(make("scallop", 10).fixed, axis=0).max() > 50  # far apart
    for position in grid.settings.fixed:
        assert np.linalg.norm(grid.nodes + grid.origin - position, axis=1).min() < 1e-9
    assert grid.quality.shape_min > 0.5


def test_great_court(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All checks pass, the plan is that of the court, and the table in the docs has these figures."""
    figures = run("08_great_court", tmp_path, monkeypatch)
    assert figures["utilization_max"] <= 1 and figures["buckling_factors"][0] >= 10 and len(figures["sections"]) <= 2
    assert figures["warnings"] == [] and (tmp_path / "roof.html").stat().st_size > 100_000
    plan = 73.25 * 97.15 - np.pi * 22.245**2
    assert -figures["cases"]["snow"]["applied"][2] == pytest.approx(600 * plan, rel=0.01)
    assert figures["cases"]["self"]["applied"][2] == pytest.approx(-1.1 * 9.80665 * figures["mass"])
    text = (FOLDER.parent / "docs" / "structure.md").read_text(encoding="utf-8")
    table = text.partition("| of the court |")[2].partition("\n\n")[0]
    rows = dict(re.findall(r"^\| ([a-z ]+) \| ([\d.,]+) \|", table, re.MULTILINE))
    ours = {
        "nodes": figures["nodes"],
        "members": figures["members"],
        "mass": figures["mass"] / 1e3,
        "greatest utilization": figures["utilization_max"],
        "greatest displacement": 1e3
        * max(case["displacement_max"] for case in figures["cases"].values() if case["state"] == "SLS"),
        "greatest compression": -figures["force_min"] / 1e3,
        "buckling factor": figures["buckling_factors"][0],
        "lowest frequency": figures["frequencies"][0],
    }
    assert {name: float(value.replace(",", "")) for name, value in rows.items()} == pytest.approx(ours, rel=0.03)


def test_timber_limpet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    report = run("09_timber_limpet", tmp_path, monkeypatch)
    assert report.utilization is None and "GL24h R120x240 is not steel" in report.warnings[0]
    assert "not steel" in (tmp_path / "limpet.html").read_text(encoding="utf-8")
    assert report.buckling.values[0] > 1 and max(case.equilibrium_error for case in report.cases) < 1e-9
    assert report.truss.lengths.mean() == pytest.approx(200 * 7.8e-3, rel=0.05)


def test_canopy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It stands on its nine feet, passes, and wind lifts it."""
    report = run("10_canopy", tmp_path, monkeypatch)
    held = report.truss.supports.any(axis=1)
    assert held.sum() == 9 and report.utilization.max() <= 1 and report.buckling.values[0] >= 10
    cases = {case.name: case for case in report.cases}
    assert cases["wind"].applied[2] > 0 > cases["snow"].applied[2]
    assert (tmp_path / "canopy.json").exists()


def test_other_programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import ezdxf
    import ifcopenshell
    import openpyxl
    import trimesh

    truss = run("11_other_programs", tmp_path, monkeypatch)
    count = len(truss.members)
    assert len(ifcopenshell.open(str(tmp_path / "court.ifc")).by_type("IfcStructuralCurveMember")) == count
    assert openpyxl.load_workbook(tmp_path / "court.saf.xlsx")["StructuralCurveMember"].max_row == count + 1
    assert len(ezdxf.readfile(tmp_path / "court.dxf").modelspace().query("LINE")) == count
    assert "members" in trimesh.load(tmp_path / "court.glb").geometry


def test_free_grid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quads of a barrel are those of freeGrid's baseline: 441 joints of 4 kinds, 840 members of one length."""
    monkeypatch.syspath_prepend(str(FOLDER))
    module = importlib.import_module("13_free_grid")
    monkeypatch.setattr(module.st, "few_joints", partial(st.few_joints, count=4))  # what is tried for fewer finds none
    found = module.main(tmp_path, ["barrel"], 20_000)["barrel"]
    assert (len(found.grid.nodes), len(found.grid.edges), len(found.grid.panel_table)) == (441, 840, 400)
    assert len(found.representative) == 4 and found.grid.quality.length_cv < 0.005
    assert found.grid.lengths.sum() == pytest.approx(1311, abs=4) and module.planarity(found.grid) < 1.001
    assert (tmp_path / "barrel.obj").exists()


def test_double_layer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts come in pairs that are equal or mirror images, and every file is there."""
    truss, made = run("12_double_layer", tmp_path, monkeypatch)
    assert set(truss.member_sets) == {"top", "bottom", "web"} and len(made.members) == len(truss.members)
    assert len(made.lengths) < 0.7 * len(truss.members)
    images = made.node_types["mirror image"]
    assert sum(image is None for image in images) < 0.1 * len(images)
    assert {path.suffix for path in tmp_path.iterdir()} == {".csv", ".pdf", ".stl"}
