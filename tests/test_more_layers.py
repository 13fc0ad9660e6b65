"""More layers, how they end at the boundary, where they are reduced, and what is made of them."""

import csv
from pathlib import Path

import numpy as np
import pytest
import trimesh
from small_grids import dome, icosahedron
from test_double_layer import fold

import scantruss as st
from scantruss.cli.main import main
from scantruss.errors import InputError
from scantruss.layouts.double_layer import STEEPEST_SHARE
from scantruss.schedules.make import schedule
from scantruss.schedules.settings import ScheduleSettings
from scantruss.setout.make import set_out
from scantruss.setout.sheets import make_sheets
from scantruss.structure.layered import grid_in_metres
from scantruss.structure.modes import vibration_modes
from scantruss.structure.report import report_structure
from scantruss.structure.statics import factor_stiffness, solve

WAYS = [(second, edges) for second in ("dual", "same") for edges in ("tapered", "closed")]


def layered(second: str, edges: str = "", depth: str = "1.5,1") -> st.Truss:
    """A dome of two layers or more, held along its boundary."""
    return st.Truss.from_grid(
        dome(6, 4.0, unit="m"), supports="boundary", loads="self,snow:1kN/m2", double_layer=depth, second_layer=second,
        layer_edges=edges,
    )  # fmt: skip


@pytest.mark.parametrize(("second", "edges"), WAYS)
def test_layers_however_they_end_are_no_mechanisms(second: str, edges: str) -> None:
    grid = dome(6, 4.0, unit="m")
    truss = st.Truss.from_grid(
        grid, supports=np.arange(3), loads="self", double_layer="1,1,0.8", second_layer=second, layer_edges=edges
    )
    factored = factor_stiffness(truss)
    assert vibration_modes(factored, 1).values[0] > 0.1 and solve(truss, factored)["self"].equilibrium_error < 1e-9
    pairs = np.sort(truss.members, axis=1)
    assert len(np.unique(pairs, axis=0)) == len(pairs) and (pairs[:, 0] != pairs[:, 1]).all()


@pytest.mark.parametrize(("second", "edges"), WAYS)
def test_the_panels_of_lower_layers_are_bounded_by_members_and_cover_them(second: str, edges: str) -> None:
    grid = dome(6, 4.0, unit="m")
    flat = grid.replace(nodes=grid.nodes * [1, 1, 0])
    made = st.double_layer(flat, 1.5, second=second, edges=edges)
    chords = {tuple(sorted(pair)) for name in ("top", "bottom") for pair in made.members[made.groups[name]].tolist()}
    uses: dict[tuple[int, ...], int] = {}
    area = 0.0
    for panel in made.layers.panels:
        corners = made.nodes[panel]
        area += float(np.cross(corners, np.roll(corners, -1, axis=0))[:, 2].sum() / 2)
        for a, b in zip(panel.tolist(), np.roll(panel, -1).tolist(), strict=True):
            key = tuple(sorted((a, b)))
            assert key in chords
            uses[key] = uses.get(key, 0) + 1
    assert set(uses.values()) <= {1, 2}
    corners = flat.nodes[flat.triangles]
    whole = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area < whole - 1 if (second, edges) == ("dual", "tapered") else area == pytest.approx(whole)


def test_depths_add_up_from_layer_to_layer() -> None:
    made = st.double_layer(dome(6), [2.0, 1.0, 0.5], second="same", along="vertical")
    count = len(dome(6).nodes)
    drop = [made.nodes[:count, 2] - made.nodes[k * count : (k + 1) * count, 2] for k in (1, 2, 3)]
    assert [float(each.mean()) for each in drop] == pytest.approx([2.0, 3.0, 3.5])
    assert made.layers.names == ("top", "layer 2", "layer 3", "bottom") and set(made.groups) >= {"web 1", "web 3"}


def test_tapered_layers_meet_in_the_boundary_and_keep_a_corner_without_inner_nodes() -> None:
    grid = dome(6)
    made = st.double_layer(grid, 1.0, second="same", edges="tapered")
    rim = np.unique(grid.edges[grid.edge_uses == 1])
    meets = made.under[rim] == rim
    ears = np.unique(grid.triangles[np.isin(grid.triangles, rim).all(axis=1)])
    assert np.array_equal(rim[~meets], np.intersect1d(rim, ears)) and meets.sum() > len(rim) / 2


@pytest.mark.parametrize("second", ["dual", "same"])
def test_where_the_grid_bends_sharply_the_depth_is_reduced_and_named(second: str) -> None:
    grid, depth = fold(50.0), 1.5
    with pytest.raises(InputError, match="too much where the grid bends"):
        st.double_layer(grid, depth, second=second)
    made = st.double_layer(grid, depth, second=second, bends="reduce")
    assert made.layers.share.min() < 1.0
    if second == "same":
        share = made.layers.share[made.under]
        assert np.abs(np.diff(share[grid.edges], axis=1)).max() <= STEEPEST_SHARE + 1e-12
        assert np.linalg.norm(made.nodes[made.under] - grid.nodes, axis=1) == pytest.approx(depth * share)
    truss = st.Truss.from_grid(
        grid, supports="corners", loads="self", double_layer=depth, second_layer=second, sharp_bends="reduce"
    )
    said = " ".join(report_structure(solve(truss)).warnings)
    assert "the depth is reduced where the grid bends sharply, to 0." in said and "at N0" in said


@pytest.mark.parametrize("second", ["dual", "same"])
def test_a_fold_too_narrow_for_any_depth_is_refused_all_the_same(second: str) -> None:
    with pytest.raises(InputError, match=r"less than 0\.5 of it apart at N0"):
        st.double_layer(fold(), 1.2, second=second, bends="reduce")


def test_a_closed_body_has_as_many_types_of_nodes_as_its_symmetry_says() -> None:
    truss = st.Truss.from_grid(
        icosahedron(10.0, unit="m"), supports=np.arange(3), loads="self", double_layer=1.5, second_layer="dual"
    )
    made = schedule(truss, ScheduleSettings(bolts="none"))
    assert made.node_types["count"] == (20, 12) and made.inner_panels is not None
    assert set(made.inner_panels["panel type"]) == {"IPT001"} and set(made.inner_panels["corners"]) == {5}
    assert max(made.inner_panels["out of plane"]) == pytest.approx(0, abs=1e-6)  # type: ignore[type-var]


def test_types_of_balls_do_not_depend_on_where_the_structure_stands() -> None:
    truss = layered("same", depth="1.5")
    turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    turned = truss.replace(
        nodes=truss.nodes @ turn.T,
        node_normals=truss.node_normals @ turn.T,
        member_normals=truss.member_normals @ turn.T,
    )
    one, two = (schedule(each, ScheduleSettings(bolts="none")) for each in (truss, turned))
    assert one.nodes["node type"] == two.nodes["node type"] and one.lengths["count"] == two.lengths["count"]


@pytest.mark.parametrize("second", ["dual", "same"])
def test_schedules_hold_every_member_of_every_layer(second: str) -> None:
    truss = layered(second)
    made = schedule(truss, ScheduleSettings())
    assert made.members["member"] == truss.member_marks and len(made.drilling) == 2 * len(truss.members)
    groups = {name: made.members["group"].count(name) for name in truss.member_sets}
    assert groups == {name: len(ids) for name, ids in truss.member_sets.items()}
    assert made.members["length"] == pytest.approx(1000 * truss.lengths)
    assert truss.layers is not None and made.inner_panels is not None
    layer = [truss.layers.names[k] for k in truss.layers.of_nodes]
    assert made.nodes["layer"] == tuple(layer) and len(made.inner_panels) == len(truss.layers.panels)
    mass = [row[6] for row in made.quantities.rows if row[0] == "members"]
    tube = truss.of_section("area") * truss.material.density
    cut = np.array(made.members["cut length"], float) / 1000
    assert sum(filter(None, mass)) == pytest.approx(float((tube * np.maximum(cut, 0)).sum()))  # type: ignore[arg-type]


def test_the_plan_of_each_layer_is_a_drawing_of_its_own_and_heights_leave_webs_out() -> None:
    truss = layered("dual", depth="1.5")
    made = set_out(truss)
    plans = [sheet.title for sheet in make_sheets(made) if sheet.title.startswith("Plan")]
    assert plans == ["Plan, top", "Plan, bottom", "Plan, web"]
    webs = set(truss.member_sets["web"].tolist())
    assert not any(webs & set(line.members.tolist()) for line in made.section_lines)
    assert sum(len(step.members) for step in made.steps) == len(truss.members)


def test_commands_make_everything_of_two_layers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(dome(4, 4.0, unit="m"), "grid.json")
    words = (
        "structure grid.json roof.json roof.obj roof.csv --supports boundary --double-layer 1.5 --layer-edges closed"
    )
    assert main([*words.split(), "--buckling", "1", "--path", "worst", "--path-steps", "3"]) == 0
    truss = st.read_structure("roof.json")
    again = tmp_path / "again.json"
    assert main([*words.replace("roof.", "r.").split()]) == 0 and truss.layers is not None
    st.write(truss, again)
    assert st.read_structure(again).layers is not None
    lines = Path("roof.obj").read_text().splitlines()
    outer = len(grid_in_metres(truss).edges) - sum(line.startswith("l ") for line in lines)
    assert outer == len(truss.member_sets["top"])
    with Path("roof.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(truss.members)
    assert main("schedule roof.json roof-parts.csv".split()) == 0 and Path("roof-parts_inner_panels.csv").exists()
    assert main("setout roof.json roof-site.xlsx".split()) == 0
    assert main("print roof.json roof.stl --member-diameter 0.1 --node-diameter 0.2".split()) == 0
    body = trimesh.load("roof.stl")
    assert body.is_watertight and body.volume > 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--double-layer 1,,2", "the depth of a double layer must be a number"),
        ("--double-layer 1 --layer-edges round", "edges of the layers must be tapered or closed"),
        ("--double-layer 1 --sharp-bends ignore", "way with sharp bends must be refuse or reduce"),
        ("--double-layer " + ",".join(["1"] * 9), "a grid can have 2 to 9 layers"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(
    words: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(dome(4, 4.0, unit="m"), "grid.json")
    assert main(f"structure grid.json roof.json --supports boundary {words}".split()) == 2
    error = capsys.readouterr().err.strip().splitlines()
    assert len(error) == 1 and said in error[0] and not Path("roof.json").exists()
