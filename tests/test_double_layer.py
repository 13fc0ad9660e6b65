"""Double layers: what is under what, that they are no mechanisms, that members stay apart, and what is refused."""

import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from small_grids import dome, icosahedron, make_grid

import scantruss as st
from scantruss.cli.main import main
from scantruss.errors import InputError
from scantruss.layouts.clearance import angles_at_nodes, close_pairs
from scantruss.structure.modes import vibration_modes
from scantruss.structure.statics import factor_stiffness, solve

WAYS = ("dual", "same")


@pytest.mark.parametrize("second", WAYS)
def test_counts_and_depth(second: str) -> None:
    grid = dome(7)
    made = st.double_layer(grid, 2.0, second=second)
    nodes, edges, triangles = len(grid.nodes), len(grid.edges), len(grid.triangles)
    inner = int((grid.edge_uses == 2).sum())
    counts = (edges, inner, 3 * triangles) if second == "dual" else (edges, edges, nodes + edges)
    assert tuple(len(ids) for ids in made.groups.values()) == counts
    assert np.array_equal(made.nodes[:nodes], grid.nodes) and np.array_equal(made.members[:edges], grid.edges)
    first = grid.nodes[grid.triangles].mean(axis=1) if second == "dual" else grid.nodes
    assert np.linalg.norm(made.nodes[nodes:] - first, axis=1) == pytest.approx(2.0)
    assert (made.nodes[nodes:, 2] < first[:, 2]).all()


@pytest.mark.parametrize("second", WAYS)
def test_a_vertical_depth_is_along_z(second: str) -> None:
    grid = dome(7)
    made = st.double_layer(grid, 2.0, second=second, along="vertical")
    first = grid.nodes[grid.triangles].mean(axis=1) if second == "dual" else grid.nodes
    assert made.nodes[len(grid.nodes) :] == pytest.approx(first - [0, 0, 2.0])


def test_a_flat_grid_has_a_flat_second_layer_of_regular_pyramids() -> None:
    grid = dome(5)
    flat = grid.replace(nodes=grid.nodes * [1, 1, 0])
    depth = 4.0 * (2 / 3) ** 0.5  # of a regular tetrahedron
    made = st.double_layer(flat, depth, second="dual")
    webs = made.members[made.groups["web"]]
    lengths = np.linalg.norm(made.nodes[webs[:, 0]] - made.nodes[webs[:, 1]], axis=1)
    assert lengths == pytest.approx(4.0) and made.nodes[len(flat.nodes) :, 2] == pytest.approx(-depth)


@pytest.mark.parametrize("second", WAYS)
@pytest.mark.parametrize("kind", ["dome", "closed"])
def test_it_is_no_mechanism_with_pinned_joints(second: str, kind: str) -> None:
    grid = dome(6, 4.0, unit="m") if kind == "dome" else icosahedron(10.0, unit="m")
    truss = st.Truss.from_grid(
        grid, supports=np.arange(3), loads="self", double_layer=1.5, second_layer=second
    )  # three nodes of one triangle hold a rigid body
    assert truss.pinned
    least = vibration_modes(factor_stiffness(truss), 1).values[0]
    assert least > 0.1 and solve(truss)["self"].equilibrium_error < 1e-9


@pytest.mark.parametrize("layer", ["outer", "inner"])
def test_supports_are_on_the_layer_that_is_named_and_loads_on_the_outer(layer: str) -> None:
    grid = dome(6, 4.0, unit="m")
    truss = st.Truss.from_grid(grid, supports="boundary", loads="snow:1kN/m2", double_layer="1500mm", held_layer=layer)
    held, count = np.flatnonzero(truss.supports.any(axis=1)), len(grid.nodes)
    assert (held < count).all() if layer == "outer" else (held >= count).all()
    alone = st.Truss.from_grid(grid, supports="boundary", loads="snow:1kN/m2")
    loads, single = truss.cases[0].nodal, alone.cases[0].nodal
    assert loads is not None and single is not None and not loads[count:].any()
    assert loads[:count] == pytest.approx(single)


def test_the_distance_of_members_is_that_of_many_points_along_them() -> None:
    random = np.random.default_rng(3)
    nodes, members = random.random((40, 3)), random.permutation(40).reshape(-1, 2)
    members = np.concatenate([members, [[members[0, 0], members[1, 1]]]])
    pairs, found = close_pairs(nodes, members, 0.3)
    share = np.linspace(0, 1, 201)[:, None]
    along = [nodes[a] + share * (nodes[b] - nodes[a]) for a, b in members]
    slow = {
        (i, j): float(np.linalg.norm(along[i][:, None] - along[j], axis=2).min())
        for i, j in combinations(range(len(members)), 2)
        if not set(members[i]) & set(members[j])
    }
    assert {pair for pair, apart in slow.items() if apart < 0.3} <= set(map(tuple, pairs.tolist()))
    for pair, apart in zip(pairs.tolist(), found.tolist(), strict=True):
        assert apart == pytest.approx(slow[pair[0], pair[1]], abs=0.01) and apart <= slow[pair[0], pair[1]] + 1e-12


def test_angles_at_nodes_are_those_of_the_triangles() -> None:
    grid = icosahedron()
    pairs, angles = angles_at_nodes(grid.nodes, grid.edges)
    assert len(pairs) == 12 * 10 and np.isclose(angles, 60).sum() == 60 and np.isclose(angles, 108).sum() == 60


def fold(half: float = 20.0) -> st.Grid:
    """A narrow valley turned up: two strips at twice this angle [degree]."""
    y, side, down = np.arange(5.0), np.sin(np.radians(half)), np.cos(np.radians(half))
    rows = [np.stack([0 * y + k * side, y, -abs(k) * down + 0 * y], axis=1) for k in (-2, -1, 0, 1, 2)]
    triangles = [t for k in range(4) for j in range(4) for t in (
        (5 * k + j, 5 * k + 5 + j, 5 * k + j + 1), (5 * k + j + 1, 5 * k + 5 + j, 5 * k + 6 + j))]  # fmt: skip
    return make_grid(np.concatenate(rows), triangles, unit="m")


@pytest.mark.parametrize("second", WAYS)
def test_a_depth_that_a_fold_does_not_allow_is_refused_with_its_places(second: str) -> None:
    with pytest.raises(
        InputError, match=r"a depth of 1.2 m is too much where the grid bends: .* at N0\d\d \(.*smaller depth"
    ):
        st.double_layer(fold(), 1.2, second=second)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"depth": 0.0}, "must be positive"),
        ({"second": "third"}, "second layer must be dual or same"),
        ({"along": "x"}, "way of the depth must be normal or vertical"),
    ],
)
def test_what_cannot_be_used_is_refused(change: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        st.double_layer(dome(4), **({"depth": 1.0} | change))  # type: ignore[arg-type]


@pytest.mark.parametrize("second", WAYS)
def test_the_command_writes_layers_with_their_groups(
    second: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(dome(6, 4.0, unit="m"), "grid.json")
    words = f"structure grid.json out.json out.dxf again.json --supports boundary --double-layer 1.5 --second-layer {second}"
    assert main([*words.split(), "--report", "report.json", "--loads", "self,snow:1kN/m2"]) == 0
    assert Path("out.json").read_bytes() == Path("again.json").read_bytes()
    truss = st.read_structure("out.json")
    assert set(truss.member_sets) == {"top", "bottom", "web"}
    assert sum(map(len, truss.member_sets.values())) == len(truss.members)
    report = json.loads(Path("report.json").read_text())
    assert set(report["groups"]) == {"top", "bottom", "web"} and "small_angles" in report["layers"]
    top = truss.lengths[truss.member_sets["top"]]
    assert report["groups"]["top"]["length_cv"] == pytest.approx(top.std() / top.mean())
    sized = "structure grid.json sized.json --supports boundary --double-layer 1.5 --size 3 --size-by groups"
    assert main(sized.split()) == 0
    sections = st.read_structure("sized.json").section_of
    assert all(len(np.unique(sections[ids])) == 1 for ids in truss.member_sets.values()) or second == "same"


def test_members_that_come_closer_than_their_diameters_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(dome(5, 1.0, unit="m"), "grid.json")
    words = "structure grid.json out.json --supports boundary --double-layer 100mm --section CHS168.3x8"
    assert main(words.split()) == 0
    said = capsys.readouterr().out
    assert "pairs of members come closer than their diameters, the most M" in said and "below 30 degrees" in said


@pytest.mark.parametrize(("depth", "way"), [("0.15", "larger"), ("3", "smaller")])
def test_the_warning_of_small_angles_says_which_depth_opens_them(
    depth: str, way: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(dome(5, 1.0, unit="m").replace(nodes=dome(5, 1.0).nodes * [1.0, 1.0, 0.01]), "grid.json")
    words = f"structure grid.json out.json --supports boundary --double-layer {depth} --second-layer same"
    assert main(words.split()) == 0
    assert f"; a {way} depth opens them" in capsys.readouterr().out
