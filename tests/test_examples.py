"""The paper's examples run, and their grids are what the shapes allow."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shapes import make

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


def test_other_programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import ezdxf
    import ifcopenshell
    import openpyxl
    import trimesh

    truss = run("11_other_programs", tmp_path, monkeypatch)
    count = len(truss.members)
    assert len(ifcopenshell.open(str(tmp_path / "stadium.ifc")).by_type("IfcStructuralCurveMember")) == count
    assert openpyxl.load_workbook(tmp_path / "stadium.saf.xlsx")["StructuralCurveMember"].max_row == count + 1
    assert len(ezdxf.readfile(tmp_path / "stadium.dxf").modelspace().query("LINE")) == count
    assert "members" in trimesh.load(tmp_path / "stadium.glb").geometry
