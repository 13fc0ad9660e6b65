"""Double layers in the studio: asked for in fields, solved, seen through, kept, repeated by the command line, refused."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from studio_dome import done, session_of_dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.page_tables import tables_of
from scantruss.grid.marks import node_marks
from scantruss.layouts.double_layer import BOTTOM_MEMBERS, TOP_MEMBERS, WEB_MEMBERS
from scantruss.layouts.framework import Framework
from scantruss.structure.options import StructureSettings
from scantruss.studio.compare import drawn_design, structure_figures
from scantruss.studio.further_files import PRINTED, further_files
from scantruss.studio.layers_tool import AS_USUAL, LayersTool, words_of_depths
from scantruss.studio.outputs import settings_files
from scantruss.studio.session import Session
from scantruss.studio.support_places import asked_supports, for_new_scan
from scantruss.studio.tab_structure import StructureTab
from scantruss.studio.view import StudioView

DEPTH = "0.8"


def layered(folder: Path) -> Session:
    """Return a session with a double layer over a dome, solved."""
    session = session_of_dome(folder, 8.0)
    session.set_structure(double_layer=DEPTH)
    session.run_structure()
    done(session)
    return session


def test_a_double_layer_is_that_of_the_command_line_and_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session = layered(tmp_path)
    assert session.solution is not None and session.grid is not None
    truss = session.solution.truss
    assert set(truss.member_sets) == {TOP_MEMBERS, BOTTOM_MEMBERS, WEB_MEMBERS} and truss.pinned
    figures = dict(structure_figures(session.state))
    assert [figures[name].split()[0] for name in (TOP_MEMBERS, BOTTOM_MEMBERS, WEB_MEMBERS)] == [
        str(len(truss.member_sets[name])) for name in (TOP_MEMBERS, BOTTOM_MEMBERS, WEB_MEMBERS)
    ]
    monkeypatch.chdir(tmp_path)
    ours = session.files("structure", ".json")["structure.json"]
    session.keep_design("A")
    for name, content in (settings_files(session.state) | session.files("grid", ".json")).items():
        Path(name).write_bytes(content)
    assert main(session.command().splitlines()[-1].split()[1:]) == 0
    assert Path("structure.json").read_bytes() == ours
    rows = session.files("structure", ".csv")["structure.csv"].decode().splitlines()
    assert len(rows) == 1 + len(truss.members)
    again = Session()
    again.open(tmp_path / "dome.scantruss")
    assert again.state.structure_settings.double_layer == DEPTH and again.solution is not None
    assert again.files("structure", ".json")["structure.json"] == ours
    for kept in (session.state.designs[0], again.state.designs[0]):  # drawn with all its layers
        model = drawn_design(kept).model
        assert np.allclose(model.nodes, truss.nodes + truss.origin) and np.array_equal(model.members, truss.members)
    session.undo()
    session.undo()
    taken_back = session.state
    assert taken_back.solution is None and taken_back.structure_settings.double_layer == DEPTH
    session.undo()
    assert session.state.structure_settings.double_layer == ""
    session.run_structure()
    done(session)
    single = session.state.solution
    assert single is not None and len(single.truss.members) == len(session.grid.edges)
    assert not {TOP_MEMBERS, BOTTOM_MEMBERS, WEB_MEMBERS} & dict(structure_figures(session.state)).keys()


def test_all_layers_are_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    session, printed = layered(tmp_path), list[Any]()

    def keep(grid: Any, place: Path, *, scale: float, **_: Any) -> Any:
        printed.append((grid, scale))
        place.write_bytes(b"")
        return SimpleNamespace(notes=())

    monkeypatch.setattr("scantruss.export.printed.apart.print_apart", keep)
    further_files(session.state, PRINTED, 120.0)
    assert session.solution is not None
    ((grid, scale),) = printed
    assert isinstance(grid, Framework) and len(grid.edges) == len(session.solution.truss.members)
    assert np.isclose(np.ptp(grid.nodes, axis=0).max() * scale, 0.12)  # of metres, and 120 mm long


def test_a_depth_that_is_too_much_is_refused_and_the_structure_before_stays(tmp_path: Path) -> None:
    session = layered(tmp_path)
    before = session.solution
    for more, words in (
        ({"double_layer": "30"}, "too much where the grid bends"),
        ({"double_layer": "deep"}, "the depth of a double layer must be a number"),
        ({"double_layer": "grid.csv"}, "names a file"),
        ({"double_layer": DEPTH, "joints": "soft"}, "joints must be rigid, pinned or"),
    ):
        try:
            session.set_structure(**more)
            session.run_structure()
            assert session.worker.wait(60)
            said = session.message
        except st.InputError as error:
            said = str(error)
        assert words in said and "--" not in said and session.solution is before


def test_what_lies_below_the_panels_is_found_by_a_click(tmp_path: Path) -> None:
    session = layered(tmp_path)
    model = session.model("structure")
    view: Any = SimpleNamespace(
        shown_model=lambda: (model, tables_of(model)),
        places=lambda model: model.nodes,
        look=SimpleNamespace(panels=SimpleNamespace(value=True)),
    )
    assert model.truss is not None and session.grid is not None
    found = set()
    for member in model.truss.member_sets[BOTTOM_MEMBERS].tolist():
        begin, end = model.nodes[model.members[member]]
        place = begin + 0.3 * (end - begin)  # away from the members of the grid, which cross its middle
        found.add(StudioView.under(view, place + [0.0, 0.0, 30.0], np.array([0.0, 0.0, -1.0])) == ("members", member))
    assert True in found  # but for those that another hides
    level = np.array([model.nodes[corners].mean(axis=0) for corners in model.panel_loops])
    hit = {StudioView.under(view, place + [0.2, 0.1, 5.0], np.array([0.0, 0.0, -1.0])) for place in level}
    assert any(each is not None and each[0] == "panels" for each in hit)


def test_a_click_on_a_layer_below_names_no_node_of_the_grid(tmp_path: Path) -> None:
    """A structure of 1,000 nodes and more counts them with another digit than its grid."""
    session = layered(tmp_path)
    grid, model = session.grid, session.model("structure")
    assert grid is not None
    many: Any = SimpleNamespace(node_marks=tuple(f"N{number:04d}" for number in range(1, len(model.nodes) + 1)))
    said = list[Any]()
    view = SimpleNamespace(shown_model=lambda: (many, {}), session=session, say=said.append)
    tab: Any = SimpleNamespace(
        view=view,
        words={"supports": SimpleNamespace(value="")},
    )
    StructureTab.support(tab, ("nodes", 3))
    assert session.state.structure_settings.supports == node_marks(grid)[3] == "N004"
    assert asked_supports(session.state)[0].tolist() == [3], "which is drawn"
    with pytest.raises(st.InputError, match='"supports on" inner'):
        StructureTab.support(tab, ("nodes", len(grid.nodes)))
    assert session.state.structure_settings.supports == "N004"


def test_fields_say_what_is_asked_for_and_show_it() -> None:
    def control(label: str, known: Any, *, initial_value: str = "", **_: Any) -> Any:
        return SimpleNamespace(label=label, value=known if isinstance(known, str) else initial_value)

    class Folder(SimpleNamespace):
        """One that can be entered."""

        def __enter__(self) -> None:
            """Enter."""

        def __exit__(self, *_: object) -> None:
            """Leave."""

    folder = Folder(label="")
    gui = SimpleNamespace(add_folder=lambda label, **_: folder, add_text=control, add_dropdown=control)
    asked = StructureSettings(double_layer="1.2,800mm", second_layer="same", held_layer="inner", joints="2e5")
    tool = LayersTool(gui, asked)
    assert {name: tool.value(name) for name in tool.fields} == {name: getattr(asked, name) for name in tool.fields}
    assert tool.fields["layer_edges"].value == AS_USUAL and folder.label.endswith("(1.2 and 800mm same)")
    tool.fields["double_layer"].value = " 1.2, 800 mm "
    tool.show(asked, lambda field, text: pytest.fail("what says the same is left as it was typed"))
    tool.show(StructureSettings(layer_edges="closed"), lambda field, text: setattr(field, "value", text))
    assert tool.value("double_layer") == tool.value("joints") == "" and tool.value("layer_edges") == "closed"
    assert "(" not in folder.label and words_of_depths(asked.replace(double_layer="0.8")) == "0.8 m same"


def test_the_depth_belongs_to_the_scan() -> None:
    assert for_new_scan(StructureSettings(double_layer=DEPTH)).double_layer == ""
