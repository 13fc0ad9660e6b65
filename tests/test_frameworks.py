"""Lines on no panel that others drew: props, ties and space frames become structures, and nothing of them is lost."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from small_grids import dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.drawing_in import Drawing, grid_of_drawing
from scantruss.export.formats import read_model
from scantruss.layouts.framework import Framework
from scantruss.structure.truss import LoadCase

POST = 3.0  # length of the columns [m]


def lines_of(truss: st.Truss | st.Grid) -> list[list[list[float]]]:
    return truss.nodes[truss.members].tolist()


def save_obj(path: Path, lines: Any, faces: Any = ()) -> Path:
    places = np.array(lines, float).reshape(-1, 3).tolist()
    text = ["# unit: m", *(f"v {x!r} {y!r} {z!r}" for x, y, z in places)]
    text += [f"l {2 * k + 1} {2 * k + 2}" for k in range(len(lines))]
    text += [" ".join(["f", *(str(k + 1) for k in face)]) for face in faces]
    path.write_text("\n".join(text) + "\n", encoding="ascii")
    return path


def grid_in(path: Path) -> st.Grid:
    grid = read_model(path).grid
    assert grid is not None
    return grid


def on_posts() -> tuple[st.Grid, list[list[list[float]]]]:
    """A dome with a column under every third node of its boundary."""
    grid = dome(6, unit="m")
    tops = grid.nodes[grid.boundary_loops[0][::3]]
    return grid, [[top, [top[0], top[1], top[2] - POST]] for top in tops.tolist()]


def test_a_dome_on_columns_keeps_its_panels_and_carries_its_load_to_the_feet(tmp_path: Path) -> None:
    grid, posts = on_posts()
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = 6
    for ends in [*lines_of(grid), *posts]:
        drawing.modelspace().add_line(*ends)
    drawing.saveas(tmp_path / "a.dxf")
    model = read_model(tmp_path / "a.dxf")
    assert len(model.triangles) == len(grid.triangles) and len(model.members) == len(grid.edges) + len(posts)
    assert model.groups == ("boundary", "frame", "inner") and (model.group_of == 1).sum() == len(posts)
    assert f"{len(posts)} of its {len(grid.edges) + len(posts)} lines are on no panel" in model.notes[0]
    truss = st.Truss.from_grid(grid_in(tmp_path / "a.dxf"), supports="ends", support_type="fixed", loads="snow:1kN/m2")
    assert len(np.flatnonzero(truss.supports.any(axis=1))) == len(posts)
    solution = st.solve(truss)["snow"]
    a, b, c = (grid.nodes[corner] for corner in grid.triangles.T)
    plan = np.abs(np.cross(b - a, c - a)[:, 2]).sum() / 2
    assert solution.reactions[:, 2].sum() == pytest.approx(1e3 * plan, rel=1e-9)
    feet = truss.members[model.group_of == 1]
    held = np.where(truss.supports[feet[:, 0]].any(axis=1), feet[:, 0], feet[:, 1])
    pressed = -solution.axial[model.group_of == 1].min(axis=1)
    np.testing.assert_allclose(pressed, solution.reactions[held, 2], rtol=1e-9)  # columns are upright


def test_a_tripod_of_lines_has_the_forces_of_the_textbook(tmp_path: Path) -> None:
    feet = [(math.cos(a), math.sin(a), 0.0) for a in (0.0, 2 * math.pi / 3, 4 * math.pi / 3)]
    model = read_model(save_obj(tmp_path / "a.obj", [[foot, (0.0, 0.0, 2.0)] for foot in feet]))
    assert isinstance(model.grid, Framework) and "no panels" in model.notes[0] and not len(model.triangles)
    truss = st.Truss.from_grid(model.grid, supports="ends", joints="pinned")
    load = np.zeros((4, 6))
    load[np.argmax(truss.nodes[:, 2]), 2] = -3e3
    truss = truss.replace(cases=(LoadCase("p", nodal=load),))
    np.testing.assert_allclose(st.solve(truss)["p"].axial, -1e3 * math.sqrt(5) / 2, rtol=1e-9)
    with pytest.raises(st.InputError, match="triangle"):
        st.Truss.from_grid(model.grid, supports="ends", loads="snow:1kN/m2")
    with pytest.raises(st.InputError, match="without panels"):
        st.Truss.from_grid(model.grid, supports="boundary")
    with pytest.raises(st.InputError, match="double layer"):
        st.Truss.from_grid(model.grid, supports="ends", double_layer=0.1)


@pytest.mark.parametrize("suffix", [".obj", ".dxf", ".3dm", ".ifc", ".ply", ".compas.json"])
def test_a_space_frame_that_is_read_back_moves_as_the_one_that_was_written(suffix: str, tmp_path: Path) -> None:
    truss = st.Truss.from_grid(dome(4, unit="m"), supports="boundary", double_layer=1.0, loads="self")
    st.write(truss, tmp_path / f"a{suffix}")
    model = read_model(tmp_path / f"a{suffix}")
    again = st.Truss.from_grid(
        grid_in(tmp_path / f"a{suffix}"),
        supports=np.flatnonzero(truss.supports.any(axis=1)),
        joints="pinned",
        loads="self",
        unit="" if model.unit else "m",
    )
    far = np.abs(st.solve(truss)["self"].displacements[:, :3]).max()
    off = st.solve(again)["self"].displacements[:, :3] - st.solve(truss)["self"].displacements[:, :3]
    assert np.abs(off).max() < 1e-4 * far


def test_every_command_takes_a_structure_on_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    grid, posts = on_posts()
    drawn = str(save_obj(tmp_path / "a.obj", [*lines_of(grid), *posts]))
    made = str(tmp_path / "a.json")
    assert main(["structure", drawn, made, "--supports", "ends", "--support-type", "fixed"]) == 0
    assert main(["schedule", made, str(tmp_path / "a.csv")]) == 0
    assert main(["setout", made, str(tmp_path / "a.dxf")]) == 0
    assert main(["print", drawn, str(tmp_path / "a.stl"), "--member-diameter", "0.2", "--node-diameter", "0.4"]) == 0
    assert main(["convert", made, str(tmp_path / "b.obj"), str(tmp_path / "b.csv")]) == 0
    members = (tmp_path / "b.csv").read_text(encoding="utf-8").splitlines()
    assert len(members) == 1 + len(grid.edges) + len(posts) and sum(",frame" in line for line in members) == len(posts)
    assert len(read_model(tmp_path / "b.obj").members) == len(grid.edges) + len(posts)
    capsys.readouterr()
    assert main(["convert", drawn, str(tmp_path / "c.json")]) == 2
    assert "scantruss structure" in capsys.readouterr().err.splitlines()[-1]


SQUARE = [[(0, 0, 0), (4, 0, 0)], [(4, 0, 0), (4, 4, 0)], [(4, 4, 0), (0, 4, 0)], [(0, 4, 0), (0, 0, 0)]]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([[(2, 0, 0), (2, -4, 0)]], "run through nodes"),
        ([[(2, 0.1, 0), (2, 3, 0)]], "past loose ends"),
        ([[(0.1, 0, 0.1), (0, 0, 4)]], "not joined, one at 0"),
    ],
)
def test_lines_that_only_seem_to_meet_are_refused(more: Any, said: str, tmp_path: Path) -> None:
    with pytest.raises(st.FormatError, match=said):
        read_model(save_obj(tmp_path / "a.obj", [*SQUARE, *more]))


def test_a_line_across_a_face_is_refused() -> None:
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)], float)
    faces = np.array([(0, 1, 2, 3)])
    sides = [(0, 1), (1, 2), (2, 3), (3, 0)]
    for diagonal in ((0, 2), (1, 3)):
        with pytest.raises(st.FormatError, match="across its faces"):
            grid_of_drawing(Drawing(points, np.array([*sides, diagonal, (0, 4)]), faces), "a.obj")
    assert len(grid_of_drawing(Drawing(points, np.array([*sides, (0, 4)]), faces), "a.obj")[0].edges) == 5


def test_four_props_that_a_floor_joins_are_no_panels() -> None:
    """A pyramid of four triangles on four legs: the ring under it is a cycle of four and no floor."""
    ring = [(1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0)]
    lines = [[ring[k], ring[k - 1]] for k in range(4)] + [[(0, 0, 1), place] for place in ring]
    lines += [[place, (*place[:2], -2)] for place in ring]
    points = np.array(lines, float).reshape(-1, 3)
    grid, notes = grid_of_drawing(Drawing(points, np.arange(len(points)).reshape(-1, 2)), "a.obj")
    assert len(grid.panel_table) == 4 and grid.panels is None and "4 of its 12 lines" in notes[0]
