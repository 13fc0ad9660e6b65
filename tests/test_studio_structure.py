"""The structure of the studio is that of the command line: sections, modes, masses."""

import io
import json
from pathlib import Path

import numpy as np
import openpyxl
import pytest
import trimesh
from studio_dome import done, session_of_dome
from studio_view import choose, view_of

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.formats import model_of, suffixes_of
from scantruss.export.page_tables import colorings_of, tables_of
from scantruss.studio.compare import structure_figures
from scantruss.studio.further_files import FURTHER_FILES, PRINTED, PRINTED_BALL, SCHEDULES, further_files
from scantruss.studio.outputs import settings_files
from scantruss.studio.session import Session
from scantruss.studio.structure_words import scale_of_text, text_of_scale, weight_bars
from scantruss.studio.tab_out import PROGRAMS


def check_further_files(session: Session, folder: Path) -> None:
    """Schedules, reports and the model to print, read by other programs."""
    grid = session.grid
    assert grid is not None
    found: dict[str, bytes] = {}
    for what in (each for each in FURTHER_FILES if not each.endswith(".pdf")):
        found |= further_files(session.state, what, 120.0)
    for name in ("grid-report.html", "structure-report.html"):
        assert b"<html" in found[name] and b"http-equiv" not in found[name] and len(found[name]) < 5_000_000
    members = openpyxl.load_workbook(io.BytesIO(found["schedules.xlsx"]))["Members"]
    assert members.max_row > len(grid.edges)
    (folder / "model.3mf").write_bytes(found["model.3mf"])
    solid = trimesh.load(folder / "model.3mf", force="mesh")
    millimetres = {"m": 1e3, "meter": 1e3, "meters": 1e3, "mm": 1.0, "millimeter": 1.0, "millimeters": 1.0, None: 1e3}
    longest = float(solid.extents.max()) * millimetres[solid.units]
    assert solid.is_watertight and abs(longest - 120.0) <= 2 * PRINTED_BALL
    with pytest.raises(st.InputError, match="positive"):
        further_files(session.state, PRINTED, 0.0)
    with pytest.raises(st.InputError, match="press Generate"):
        further_files(Session().state, SCHEDULES, 120.0)


def test_sizing_and_modes_are_those_of_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.set_structure(loads="self,snow:1kN/m2", size=2, buckling=2, frequencies=1, scale=2.0)
    session.run_structure()
    done(session)
    report = session.state.report
    assert report is not None and report.weights is not None and sorted(report.weights) == [1, 2]
    assert report.weights[2] == report.truss.mass <= report.weights[1]
    assert report.buckling is not None and len(report.buckling.values) == 2
    monkeypatch.chdir(tmp_path)
    for name, content in (settings_files(session.state) | session.files("grid", ".json")).items():
        Path(name).write_bytes(content)
    assert main("structure grid.json s.json --settings structure.toml --report r.json".split()) == 0
    ours, theirs = report.to_dict(), json.loads(Path("r.json").read_text())
    for name in ("sections", "weights", "utilization_max", "buckling", "frequencies"):
        assert json.loads(json.dumps(ours.get(name))) == theirs.get(name), name
    check_further_files(session, tmp_path)
    again = Session()
    again.open(tmp_path / "dome.scantruss")
    assert again.state.structure_settings == session.state.structure_settings
    assert again.state.report is not None and again.state.report.weights == report.weights


def test_figures_say_what_they_are_of_and_absurd_ones_are_cut(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.set_structure(supports="boundary", section="CHS114.3x5", loads="self,snow:1e9kN/m2")
    session.run_structure()
    done(session)
    found = dict(structure_figures(session.state))
    assert found["supports"] == "boundary, pinned" and found["section"] == "CHS114.3x5 S355"
    assert found["loads"] == "self, snow:1e9kN/m2" and found["utilization"] == "> 1000"
    assert session.state.report is not None
    assert any("too large for a design" in words for words in session.state.report.warnings)


def test_the_page_says_whether_buckling_was_looked_at(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    for modes, said in ((0, "not looked at; set buckling modes to 1"), (1, "ULS")):
        session.set_structure(loads="self,snow:1kN/m2", buckling=modes)
        session.run_structure()
        done(session)
        assert said in dict(structure_figures(session.state))["lowest buckling factor"]


def test_scales_and_weights_are_words_of_the_page() -> None:
    assert scale_of_text("1:100") == 0.01 and scale_of_text("2") == 2.0 and set(PROGRAMS) == set(suffixes_of())
    for text in ("1:1", "1:500", "1:33", "200:1", "0.7", "2.5"):
        assert text_of_scale(scale_of_text(text)) == text
    for text in ("", "1:0", "x"):
        with pytest.raises(ValueError):
            scale_of_text(text)
    assert "12,300 kg" in weight_bars({1: 12300.0, 2: 9000.0})


def test_a_structure_has_the_colourings_of_its_grid_too(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.run_structure()
    done(session)
    grid = session.grid
    assert grid is not None and grid.settings is not None and session.solution is not None
    plain, structure = tables_of(session.model("grid")), tables_of(session.model("structure"), grid)
    offered = [(one["kind"], one["name"]) for one in colorings_of(structure)]
    assert set(offered) >= {(one["kind"], one["name"]) for one in colorings_of(plain)}
    assert {("members", "utilization"), ("members", "fold"), ("members", "length / desired")} <= set(offered)
    columns = [{each.name: each.values for each in tables["members"]} for tables in (plain, structure)]
    for name in ("fold", "length / desired"):
        assert columns[0][name] == columns[1][name]
    assert all(len({len(each.values) for each in table}) == 1 for table in structure.values())
    other = session_of_dome(tmp_path, 5.0).grid  # with other members: its columns would be of other parts
    assert "fold" not in [each.name for each in tables_of(session.model("structure"), other)["members"]]


def test_coordinates_far_from_the_origin_keep_their_digits(tmp_path: Path) -> None:
    grid = session_of_dome(tmp_path, 6.0).grid
    assert grid is not None
    away = grid.replace(origin=grid.origin + [674_580.25, 5_206_750.125, 653.5])
    for each in (grid, away):
        columns = {one.name: np.array(one.values) for one in tables_of(model_of(each))["nodes"] if one.name in "xyz"}
        read = np.stack([columns[axis] for axis in "xyz"], axis=1)
        assert np.abs(read - each.scan_nodes).max() < 1e-4


def test_a_number_of_sections_that_is_none_is_refused() -> None:
    with pytest.raises(st.InputError, match="size is a number of different sections"):
        Session().set_structure(size=-1)


def test_what_was_asked_for_since_the_structure_was_solved_is_kept_beside_it(tmp_path: Path) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.run_structure()
    done(session)
    before, solution = session.state.structure_settings, session.solution
    assert solution is not None and session.state.is_structure_stale is False
    session.set_structure(supports="N001")  # with which it is a mechanism
    state = session.state
    assert state.is_structure_stale and state.shown_structure == before
    again = Session()
    again.open(tmp_path / "dome.scantruss")  # of a server that was killed then
    assert again.state.structure_settings.supports == "N001" and again.state.shown_structure == before
    assert again.solution is not None and again.state.is_structure_stale
    for one, other in zip(solution.all_results(), again.solution.all_results(), strict=True):
        assert one.name == other.name and (one.displacements == other.displacements).all()
    assert b'supports = "boundary"' in settings_files(again.state)["structure.toml"]
    again.run_structure()
    assert again.worker.wait(120) and again.message and again.state.shown_structure == before


def test_the_end_of_a_front_is_what_is_seen_until_the_grid_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fronts come faster than pictures of them."""
    session = session_of_dome(tmp_path, 6.0)
    shown: list[bool] = []
    see = session._see_front

    def looked(nodes: np.ndarray, triangles: np.ndarray) -> None:
        see(nodes, triangles)
        shown.append(session.front is not None and session.front[1] is triangles)

    monkeypatch.setattr(session, "_see_front", looked)
    session.generate()
    done(session)
    assert session.grid is not None and session.front is None
    assert len(shown) > 3 and all(shown)


def test_every_loaded_node_has_an_arrow_or_the_legend_says_how_many_have(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = session_of_dome(tmp_path, 6.0)
    session.set_structure(section="CHS114.3x5", loads="self,snow:1kN/m2", frequencies=0)
    session.run_structure()
    done(session)
    assert session.grid is not None
    number = len(session.grid.nodes)
    with view_of(session) as view:

        def arrows() -> tuple[int, list[str]]:
            handle = view.scene.api.get_handle_by_name("/loads")
            words = [said for each in view.legends.shown if each.title == "loads" for _, said in each.marks]
            return 0 if handle is None else len(handle.points) // 5, words

        count, (said,) = arrows()
        assert count == number and said.startswith("snow, at most ") and said.endswith(f"on all {number} loaded nodes")
        monkeypatch.setattr("scantruss.studio.tab_structure.MOST_ARROWS", 7)
        view.structure.draw()
        count, (said,) = arrows()
        assert count == 7 and said.endswith(f"on 7 of {number} loaded nodes, evenly spread")
        choose(view, view.structure.loads, False)
        assert arrows() == (0, [])
        assert (
            "the weight of the nodes, as of balls, is not counted; the schedules in Out say"
            in view.structure.results.content
        )
