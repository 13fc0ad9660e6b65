"""Quads and hexagons in the studio: chosen, made, drawn as whole panels, picked, kept and repeated by the command line."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from marks import compiled_only
from studio_dome import done, session_of_dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.formats import model_of
from scantruss.export.page_tables import colorings_of, tables_of
from scantruss.grid.grid import Grid
from scantruss.grid.panels import panel_of_triangles, triangles_of
from scantruss.settings import Settings
from scantruss.studio.cells_tool import CellsTool, changes_for_cells, words_of_panels, words_of_planes
from scantruss.studio.compare import grid_figures
from scantruss.studio.outputs import settings_files
from scantruss.studio.scene import DRAWN_SHARE, Scene
from scantruss.studio.session import Session
from scantruss.studio.view import StudioView


def flat_quads() -> Grid:
    """Return a grid of two by two level quads of side 1."""
    nodes = np.array([[x, y, 0.0] for y in range(3) for x in range(3)], float)
    panels = np.array([[v, v + 1, v + 4, v + 3] for v in (0, 1, 3, 4)], np.int64)
    return Grid(
        nodes=nodes, triangles=triangles_of(nodes, panels), panels=panels, fixed=np.zeros(9, bool), origin=np.zeros(3)
    )


def test_choosing_other_cells_leaves_what_they_cannot_have() -> None:
    quads = Settings(length=1.0, cells="quad", rows="curvature", planar=True)
    for cells, rows, planar in (
        ("triangle", "boundary", False),
        ("hexagon", "boundary", True),
        ("quad", "curvature", True),
    ):
        other = quads.replace(**changes_for_cells(quads, cells))
        assert (other.cells, other.rows, other.planar) == (cells, rows, planar)
    arrow = Settings(length=1.0, rows_along=(0, 0, 0, 1, 0, 0))
    with pytest.raises(st.InputError, match="press No arrow first"):
        changes_for_cells(arrow, "quad")
    assert changes_for_cells(arrow, "triangle")["cells"] == "triangle"


def test_cells_that_are_refused_are_not_shown_as_chosen() -> None:
    """The list falls back to what is set, or the page would say quads over a grid of triangles."""
    chosen: dict[str, Any] = {}
    arrow = Settings(length=1.0, rows_along=(0, 0, 0, 1, 0, 0))
    session = SimpleNamespace(settings=arrow, set=lambda *_, **__: pytest.fail("it must be refused before"))
    view: Any = SimpleNamespace(session=session, chosen=lambda take: take)

    def control(name: str, initial: Any, **_: Any) -> Any:
        made = SimpleNamespace(value=initial, visible=True, on_update=lambda take: chosen.update({name: take}))
        return made

    gui = SimpleNamespace(add_dropdown=lambda name, options, **_: control(name, options[0]), add_checkbox=control)
    tool = CellsTool(view, gui)
    tool.cells.value = "quad"
    with pytest.raises(st.InputError):
        chosen["cells"]("quad")
    assert tool.cells.value == "triangle" and not tool.rows.visible and not tool.planar.visible


def test_panels_are_drawn_whole_each_in_its_own_colour() -> None:
    grid, drawn = flat_quads(), list[Any]()
    api = SimpleNamespace(
        remove_by_name=lambda name: None,
        add_mesh_trimesh=lambda name, body: drawn.append(body),
        add_mesh_simple=lambda name, corners, faces, **_: drawn.append(SimpleNamespace(vertices=corners, faces=faces)),
    )
    scene: Any = SimpleNamespace(api=api, remove=lambda *names: None)
    assert grid.panels is not None
    colors = np.array([[0, 0, 255], [0, 255, 0], [255, 0, 0], [255, 255, 255]], np.uint8)
    for given in (None, colors):
        Scene.panels(scene, "panels", grid.nodes, grid.triangles, given, None, grid.panels)
        body = drawn.pop()
        of_panel = np.repeat(panel_of_triangles(grid.panels), 3)
        for panel in range(4):
            own = np.unique(np.round(body.vertices[of_panel == panel], 5), axis=0)
            assert len(own) == 4 and np.allclose(
                np.ptp(own, axis=0)[:2], DRAWN_SHARE
            )  # one square, no gap at its diagonal
        if given is not None:
            shades = body.visual.vertex_colors[:, :3]
            assert all(len(np.unique(shades[of_panel == panel], axis=0)) == 1 for panel in range(4))
            assert len(np.unique(shades, axis=0)) == 4


def test_a_click_finds_the_panel_and_not_one_of_its_triangles() -> None:
    grid = flat_quads()
    assert grid.panels is not None
    model = model_of(grid)
    view: Any = SimpleNamespace(
        shown_model=lambda: (model, tables_of(model)),
        places=lambda model: model.nodes,
        look=SimpleNamespace(panels=SimpleNamespace(value=True)),
    )
    for number, corners in enumerate(grid.panels.tolist()):
        middle = grid.nodes[corners].mean(axis=0)
        for off in ([0.2, -0.1, 0], [-0.2, 0.1, 0]):  # on both of its triangles
            eye = middle + off + [0.0, 0.0, 5.0]
            assert StudioView.under(view, eye, np.array([0.0, 0.0, -1.0])) == ("panels", number)


def test_figures_name_the_panels() -> None:
    quads = flat_quads()
    assert words_of_panels(quads) == ", 4 quads" and words_of_planes(quads) == ", off plane 0.00%"
    assert dict(grid_figures(quads))["panels"] == "4 quads" and "farthest off its plane" in dict(grid_figures(quads))
    triangles = quads.replace(triangles=quads.triangles)
    assert words_of_panels(triangles) == words_of_planes(triangles) == ""
    assert dict(grid_figures(triangles))["panels"] == "8 triangles"


@compiled_only
def test_quads_and_hexagons_are_made_kept_and_repeated_by_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = session_of_dome(tmp_path, 8.0)
    monkeypatch.chdir(tmp_path)
    for cells, planar in (("quad", True), ("hexagon", False)):
        session.set(f"cells {cells}", **changes_for_cells(session.settings, cells))
        done(session)
        assert session.grid is not None and session.grid.cells == cells and session.state.is_live
        session.set_quietly("planar panels", planar=planar)
        session.generate()
        done(session)
        grid = session.grid
        assert grid is not None and grid.settings is not None and grid.certificate is not None
        assert grid.cells == cells and grid.settings.planar == planar and not session.state.is_stale
        offered = {(one["kind"], one["name"]) for one in colorings_of(tables_of(session.model("grid")))}
        assert {("panels", "quality"), ("panels", "off its plane / diagonal")} <= offered
        for name, content in settings_files(session.state).items():
            Path(name).write_bytes(content)
        first, words = session.command().splitlines()[:2]
        assert f"--cells {cells}" in words and main(first.split()[1:]) == 0
        assert Path("grid.json").read_bytes() == session.files("grid", ".json")["grid.json"]
        session.set_structure(supports="boundary", support_type="fixed")
        session.run_structure()
        done(session)
        again = Session()
        again.open(tmp_path / "dome.scantruss")
        assert again.settings == session.settings and again.grid is not None and again.solution is not None
        assert again.grid.panels is not None and (again.grid.panels == grid.panels).all()
        assert session.solution is not None
        assert [r.displacements.tobytes() for r in again.solution.all_results()] == [
            r.displacements.tobytes() for r in session.solution.all_results()
        ]
        for name in ("grid.json", "grid.settings.json"):
            Path(name).unlink()
    for _ in range(20):  # back to the triangles before
        session.undo()
    assert session.grid is None or session.grid.cells == "triangle"
    assert session.settings.cells == "triangle"
