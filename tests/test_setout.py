"""Setting out: sections and boundaries by their geometry, steps that stand, drawings to scale, the same numbers in every file."""

import csv
import io
import re
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import openpyxl
import pytest
from ezdxf.entities.lwpolyline import LWPolyline
from small_grids import dome, fan, icosahedron, make_grid, two_pieces
from test_schedules import numbers, vectors

import scantruss as st
from scantruss.cli.main import main
from scantruss.runtime.ours import kind_of_ours
from scantruss.setout import assembly
from scantruss.setout.assembly import MOST_MOVE, MOST_TIMES, assembly_steps
from scantruss.setout.files import _page, encode_plan_dxf, encode_plan_pdf, scale_on, setout_paths
from scantruss.setout.lines import cut_grid
from scantruss.setout.sheets import LAYERS, _apart, make_sheets
from scantruss.structure.frame import freedoms, stiffness_matrix


def roof(**others: Any) -> st.Truss:
    given: dict[str, Any] = {"section": "CHS60.3x4", "supports": "corners", "loads": "self"}
    return st.Truss.from_grid(dome(7, 2.0, unit="m"), **(given | others))


def least_stiffness(truss: st.Truss, members: np.ndarray, props: np.ndarray) -> float:
    """Smallest eigenvalue of the stiffness of some members, its diagonal scaled to 1, by a dense solver."""
    part = truss.replace(
        members=truss.members[members], member_normals=truss.member_normals[members], section_of=truss.section_of[members],
        end_stiffness=truss.end_stiffness[members],
    )  # fmt: skip
    held = np.isinf(part.supports)
    held[props, :3] = True
    used = np.zeros(len(part.nodes), bool)
    used[part.members] = True
    free = np.flatnonzero((~held & used[:, None])[:, : freedoms(part)].ravel())
    matrix = stiffness_matrix(part).toarray()[np.ix_(free, free)]
    root = np.sqrt(matrix.diagonal())
    return float(np.linalg.eigvalsh(matrix / root / root[:, None])[0]) if len(free) else 1.0


@pytest.mark.parametrize("joints", ["rigid", "pinned"])
@pytest.mark.parametrize("supports", ["corners", "boundary"])
def test_each_step_stands_with_its_props_and_not_without(joints: str, supports: str) -> None:
    truss = roof(joints=joints, supports=supports)
    made = st.set_out(truss)
    final = made.steps[-1].moves
    low, high = (share * float(np.median(truss.lengths)) for share in MOST_MOVE)
    built = np.zeros(0, np.int64)
    for step in made.steps:
        built = np.concatenate([built, step.members])
        if len(built) == 0:
            assert len(step.props) == 0
            continue
        assert least_stiffness(truss, built, step.props) > 1e-12
        assert step.moves <= min(max(MOST_TIMES * final, low), high) * (1 + 1e-6) or len(made.steps[-1].props)
        if joints == "pinned" and len(step.props) == 0:
            assert least_stiffness(truss, built, step.props[:0]) > 1e-12
    assert sorted(built.tolist()) == list(range(len(truss.members)))
    assert joints == "rigid" or any(len(step.props) for step in made.steps) or supports == "boundary"


def test_a_mechanism_is_propped_at_its_nodes_and_a_stiff_step_is_left_alone() -> None:
    """A pinned fan over a held ring: flat, its middle has no resistance up or down; raised, it has."""
    flat, raised = fan(1000.0), fan(1000.0)
    raised = raised.replace(nodes=raised.nodes + np.eye(7, 1) * [0, 0, 300.0])
    for grid, props in ((flat, [0]), (raised, [])):
        truss = st.Truss.from_grid(grid, supports="boundary", joints="pinned", loads="self")
        steps = assembly_steps(truss, np.array([1, 0, 0, 0, 0, 0, 0]))
        assert [step.props.tolist() for step in steps] == [[], props]
        assert [len(step.members) for step in steps] == [6, 6]
    said = st.set_out(flat, st.SetoutSettings(supports="boundary", joints="pinned"))
    props_table = said.tables[-1]
    assert (
        props_table["node"] == ("N001",)
        and props_table["set at step"] == (1,)
        and props_table["released at step"] == (None,)
    )


def test_the_search_for_props_ends_though_nothing_that_is_held_helps(monkeypatch: pytest.MonkeyPatch) -> None:
    none = np.zeros(0, np.int64)
    for found in ((np.array([0]), none), (none, np.array([0])), (none, none)):
        monkeypatch.setattr(assembly, "_examine", lambda part, found=found: found)
        props, moves = assembly._stand(roof(), none, 0.01)
        assert len(props) == len(roof().nodes) and moves == np.inf


def test_what_hangs_out_too_far_is_propped_though_it_is_no_mechanism() -> None:
    """A slender rigid strip held at one end bends; held at both, the whole moves less."""
    count = 30
    low, high = ([(x, y, 0.0) for x in range(count)] for y in (0.0, 0.8))
    triangles = [t for k in range(count - 1) for t in ((k, k + 1, count + k), (k + 1, count + k + 1, count + k))]
    grid = make_grid([*low, *high], triangles, unit="m")
    ends = np.array([0, count - 1, count, 2 * count - 1])
    truss = st.Truss.from_grid(grid, supports=ends, loads="self", section="CHS33.7x3.2")
    steps = st.set_out(truss).steps
    assert any(len(step.props) for step in steps) and len(steps[0].props) == 0


@pytest.mark.parametrize("make", [lambda: dome(7, 2.0, unit="m"), lambda: two_pieces(2.0, unit="m")])
def test_rings_grow_from_the_supports_and_take_each_member_once(make: Any) -> None:
    made = st.set_out(make(), st.SetoutSettings(supports="lowest:0.05"))
    step_of = np.full(len(made.grid.nodes), -1)
    for number, step in enumerate(made.steps):
        step_of[step.nodes] = number
    edges = made.grid.edges
    used = np.unique(edges)
    assert (step_of[used] >= 0).all()
    for number, step in enumerate(made.steps):
        np.testing.assert_array_equal(step.members, np.flatnonzero(step_of[edges].max(axis=1) == number))
    for node in used.tolist():
        near = step_of[np.concatenate([edges[edges[:, 0] == node, 1], edges[edges[:, 1] == node, 0]])]
        assert step_of[node] == 0 or near.min() == step_of[node] - 1
    supports, order = made.tables[0], made.tables[4]
    assert set(supports["node"]) <= {made.node_marks[k] for k in made.steps[0].nodes.tolist()}
    assert sorted(map(str, order["member"])) == sorted(made.member_marks)


@pytest.mark.parametrize("plane", [("x", 3100.0), ("y", 2500.0), ("x", 5000.0)])
def test_heights_lie_on_the_section_and_on_their_members(plane: tuple[str, float]) -> None:
    made = st.set_out(roof(), st.SetoutSettings(sections=(plane,)))
    [line] = made.section_lines
    axis = "xy".index(plane[0])
    np.testing.assert_allclose(line.points[:, axis], plane[1])
    ends = made.places[made.grid.edges[line.members]]
    between = np.linalg.norm(line.points - ends[:, 0], axis=1) + np.linalg.norm(line.points - ends[:, 1], axis=1)
    np.testing.assert_allclose(between, np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))
    off = made.places[made.grid.edges, axis] - plane[1]
    assert len(line.points) == ((off >= 0).sum(axis=1) == 1).sum() - sum(
        len(np.flatnonzero((made.grid.edges == node).any(axis=1) & ((off >= 0).sum(axis=1) == 1))) - 1
        for node in set(line.nodes[line.nodes >= 0].tolist())
    )
    assert (np.diff(line.flat[:, 0]) >= 0).all()
    whole = np.linalg.norm(np.diff(line.segments, axis=1)[:, 0], axis=1).sum()
    assert whole == pytest.approx(np.linalg.norm(np.diff(line.points, axis=0), axis=1).sum())  # one chain
    np.testing.assert_allclose(vectors(made.tables[1], ""), line.points)


def test_a_section_through_a_node_names_it() -> None:
    grid = fan(1000.0)
    line = cut_grid(grid, grid.nodes + 1e4, ("x", 1e4))
    assert 0 in line.nodes and len(line.points) == len(np.unique(line.points.round(6), axis=0))
    with pytest.raises(st.InputError, match="x = 20000 meets no member; they reach from 0 to 2000 mm"):
        st.set_out(grid, st.SetoutSettings(supports="boundary", sections=(("x", 2e4),)))


def test_words_of_a_section_stand_beside_each_other_near_their_places() -> None:
    places = np.array([0.0, 0.1, 0.2, 5.0, 9.0, 9.0])
    moved = _apart(places, 1.0)
    assert moved == pytest.approx([-0.9, 0.1, 1.1, 5.0, 8.5, 9.5])
    assert _apart(np.zeros(0), 1.0).tolist() == []
    made = st.set_out(dome(8, 2.0, unit="m"), st.SetoutSettings(supports="boundary"))
    for sheet in make_sheets(made):
        if sheet.title.startswith("Section"):
            written = sorted(each.place[0] for each in sheet.words if each.layer == "HEIGHTS")
            assert np.diff(written).min() > 1.69 * sheet.height


def test_unrolled_members_keep_their_length_and_a_loop_turns_once() -> None:
    made = st.set_out(roof(), st.SetoutSettings(rotation=30.0))
    [each] = made.boundaries
    nodes = [*each.nodes, each.nodes[0]]
    true = 1e3 * np.linalg.norm(np.diff(made.grid.nodes[nodes], axis=0), axis=1)
    np.testing.assert_allclose(np.hypot(np.diff(each.along), np.diff(each.height)), true)
    np.testing.assert_allclose(np.diff(each.length), true)
    assert abs(each.turn.sum()) == pytest.approx(360.0)
    assert each.nodes[0] == each.nodes.min()
    assert len(st.set_out(icosahedron(1000.0), st.SetoutSettings(supports="lowest:0.1")).boundaries) == 0


def test_supports_stand_where_the_scan_has_them_and_say_what_they_hold() -> None:
    grid = dome(4, 1000.0, origin=np.array([5e6, 1e6, 100.0]))
    settings = st.SetoutSettings(supports="corners", origin=(5e6, 1e6, 0.0), rotation=90.0)
    table = st.set_out(grid, settings).tables[0]
    chosen = [int(str(mark)[1:]) - 1 for mark in table["node"]]
    np.testing.assert_allclose(vectors(table, "scan"), grid.scan_nodes[chosen])
    x, y, z = grid.nodes[chosen].T
    np.testing.assert_allclose(vectors(table, ""), np.stack([y, -x, z + 100], axis=1), atol=1e-6)
    assert set(table["held"]) == {"xyz"} and set(table["turns held"]) == {None}
    fixed = st.set_out(st.Truss.from_grid(grid, supports="corners", support_type="fixed")).tables[0]
    assert set(fixed["turns held"]) == {"xyz"}
    truss = st.Truss.from_grid(grid, scale=3.0, supports="corners")
    np.testing.assert_allclose(vectors(st.set_out(truss).tables[0], "scan"), grid.scan_nodes[chosen] / 1e3)


def test_the_dxf_is_clean_in_millimetres_on_named_layers_and_true_to_size() -> None:
    made = st.set_out(roof())
    content = encode_plan_dxf(make_sheets(made))
    assert content == encode_plan_dxf(make_sheets(made))
    document = ezdxf.read(io.StringIO(content.decode()))
    assert not document.audit().errors and document.header["$INSUNITS"] == 4
    found = list(document.modelspace())
    assert {each.dxf.layer for each in found} <= {*LAYERS, "TITLES"}
    lines = {
        tuple(sorted(tuple(round(c, 3) for c in point[:2]) for point in each.get_points()))
        for each in document.modelspace().query("LWPOLYLINE")
        if isinstance(each, LWPolyline) and each.dxf.layer in ("MEMBERS", "BOUNDARY")
    }
    for edge in made.places[made.grid.edges][:, :, :2].round(3).tolist():
        assert tuple(sorted(map(tuple, edge))) in lines
    words = [each.dxf.text for each in found if each.dxftype() == "TEXT"]
    assert set(made.node_marks) | set(made.member_marks) | {"Plan"} <= set(words)


@pytest.mark.parametrize("paper", ["A4", "A1"])
def test_pages_are_to_scale_and_nothing_lies_beside_them(paper: str) -> None:
    made = st.set_out(roof(), st.SetoutSettings(paper=paper, spacing=3000.0))
    sheets = make_sheets(made)
    content = encode_plan_pdf(sheets, paper)
    assert content == encode_plan_pdf(sheets, paper) and b"CreationDate" not in content
    boxes = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", content)
    for sheet in sheets:
        scale, page = scale_on(sheet, paper)
        drawn = [path.vertices for each in _page(sheet, paper).axes[0].collections for path in each.get_paths()]
        for points in drawn:
            assert (points > 0).all() and (points < page).all()
        longest = max(np.linalg.norm(np.diff(line, axis=0), axis=1).max() for _, line in sheet.lines)
        on_paper = max(np.linalg.norm(np.diff(points, axis=0), axis=1).max() for points in drawn)
        assert on_paper * scale == pytest.approx(longest)
        assert (float(boxes[0][0]), float(boxes[0][1])) == pytest.approx(np.array(page) / 25.4 * 72, abs=0.01)


def test_the_command_writes_all_or_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(dome(5, 2.0, unit="m"), "grid.json")
    assert main("structure grid.json roof.json --supports corners".split()) == 0
    words = "setout roof.json a.csv -o a.xlsx -o a.dxf -o a.pdf --section x=3000 --section y=2000".split()
    for _ in range(2):  # our own are replaced
        assert main(words) == 0
    said = capsys.readouterr().out
    assert (
        "4 supports" in said
        and "along 2 sections" in said
        and "wrote a.csv a.xlsx a.dxf a.pdf; 5 more tables beside a.csv, as a_" in said
    )
    assert {kind_of_ours(path) for path in tmp_path.glob("a*")} == {"result"}
    assert len(setout_paths(Path("a.csv"))) == len(list(tmp_path.glob("a*.csv"))) == 6
    book = openpyxl.load_workbook("a.xlsx")
    made = st.set_out(st.read_structure("roof.json"), st.SetoutSettings(sections=(("x", 3000.0), ("y", 2000.0))))
    for table, path in zip(made.tables, setout_paths(Path("a.csv")), strict=True):
        with path.open(newline="") as file:
            rows = list(csv.reader(file))
        assert rows[0] == table.heads == [cell.value for cell in book[table.title][1]]
        assert len(rows) == len(table) + 1
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    for line, reason in (
        ("grid.json b.csv", "no supports"),
        ("roof.json b.csv --supports corners", "a structure has supports of its own"),
        ("roof.json b.obj", "no format"),
        ("roof.json b.csv --section z=3", "x=MM or y=MM"),
        ("roof.json b.csv --section 3", "x=2500"),
        ("roof.json b.csv --section x=99999", "meets no member"),
        ("roof.json b.csv --spacing 1", "larger spacing"),
        ("roof.json b.pdf --paper A9", "paper must be one of"),
        ("no.json b.csv", "there is no file no.json"),
    ):
        assert main(["setout", *line.split()]) == 2
        said = capsys.readouterr().err
        assert reason in said and said.count("\n") == 1, said
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert main("setout grid.json c.csv --supports boundary --joints pinned --quiet".split()) == 0


def test_without_ezdxf_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr("scantruss.setout.files.import_module", missing)
    with pytest.raises(st.FormatError, match=r"uv sync --extra cad"):
        st.write_setting_out(st.set_out(roof()), tmp_path / "a.dxf")
    assert list(tmp_path.iterdir()) == []


def test_the_page_explains_every_table_column_option_and_layer() -> None:
    page = (Path(__file__).resolve().parents[1] / "docs" / "setout.md").read_text(encoding="utf-8")
    for table in st.set_out(roof()).tables:
        [row] = re.findall(rf"^\| {table.title} \| (.*) \|$", page, re.MULTILINE)
        for each in table.columns:
            assert each.name in row or each.name in ("scan y", "scan z"), f"{table.title}: {each.name}"
    for name in (*st.SetoutSettings.__dataclass_fields__, *LAYERS):
        assert name in page
    assert numbers(st.set_out(roof()).tables[3], "members").sum() == len(roof().members)
