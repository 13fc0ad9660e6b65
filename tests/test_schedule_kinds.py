"""Types of schedules are the kinds that joints and panels were made alike to, and mirror images of panels of any size are named."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_grids import uneven
from test_joints_alike import with_turned_over
from test_layouts_of_quads import grid_of, honeycomb, vault
from test_schedules import TUBE

import scantruss as st
from scantruss.export.json import encode_json
from scantruss.export.model import model_of_grid
from scantruss.export.page_tables import tables_of
from scantruss.layouts.alike import PartKinds
from scantruss.schedules.lines import schedule_lines
from scantruss.structure.json import encode_structure


def shaken_honeycomb() -> st.Grid:
    """Flat hexagons, each a little different."""
    flat = honeycomb()
    shift = 0.04 * np.random.default_rng(1).standard_normal(flat.nodes.shape) * [1, 1, 0]
    return grid_of(flat.nodes + shift, flat.panel_table)


def read_again(grid: st.Grid, folder: Path) -> st.Grid:
    """Write a grid as JSON and read it."""
    (folder / "grid.json").write_bytes(encode_json(grid))
    return st.read_grid(folder / "grid.json")


AS_THEY_ARE = 999  # kinds that are enough: more than there are


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(
    ("few", "grid", "enough"),
    [
        (st.few_panels, uneven(6), AS_THEY_ARE),
        (st.few_panels, uneven(4), 3),
        (st.few_panels, vault(6, uneven=0.12), AS_THEY_ARE),
        (st.few_panels, shaken_honeycomb(), AS_THEY_ARE),
        (st.few_joints, uneven(6), AS_THEY_ARE),
        (st.few_joints, vault(5, uneven=0.12), 9),
    ],
    ids=["triangles", "triangles moved", "quads", "hexagons", "joints of triangles", "joints of quads moved"],
)
def test_types_are_the_kinds_that_parts_were_made_alike_to(
    few: Any, grid: st.Grid, enough: int, mirrored: bool, tmp_path: Path
) -> None:
    found: PartKinds = few(grid, 0.02, enough, mirrored=mirrored)
    assert (found.moved.max() > 0) == (enough != AS_THEY_ARE)
    again = read_again(found.grid, tmp_path)
    unit = "" if again.unit else "m"
    schedules = st.schedule(again, replace(TUBE, unit=unit), keep_failed=True)
    of_panels = found.parts.called == "panel"
    types = schedules.panel_types if of_panels else schedules.node_types
    marks, images = types.columns[0].values, types["mirror image"]
    once = len({frozenset((a, b or a)) for a, b in zip(marks, images, strict=True)})
    if mirrored:
        assert once == len(found.counts) <= len(marks)
        pairs = {mark: image for mark, image in zip(marks, images, strict=True) if image is not None}
        assert all(pairs[image] == mark for mark, image in pairs.items())
    else:
        assert sorted(int(str(count)) for count in types["count"]) == sorted(found.counts.tolist())
    rows = schedules.panels if of_panels else schedules.nodes
    column = rows["panel type" if of_panels else "node type"]
    kinds = found.of[found.of >= 0]
    assert len(set(zip(column, kinds.tolist(), strict=True))) == len(marks)  # each type is of one kind
    worst = max(float(value) for value in types["largest misfit"] if isinstance(value, float))
    if of_panels:
        metres = {"m": 1000.0, "mm": 1.0}[again.unit or unit]
        assert worst <= 0.02 * metres * float(grid.lengths.mean()) * (1 + 1e-9)
    else:
        assert worst <= np.degrees(0.02) * 1.001
    assert any("2 %, as they were made alike" in line for line in schedule_lines(schedules, TUBE, again.alike))
    kind = next(
        each for each in tables_of(model_of_grid(again))["panels" if of_panels else "nodes"] if each.name == "kind"
    )
    assert max(kind.values) == len(found.counts)


def test_a_ball_that_is_turned_over_is_of_the_same_type_and_its_members_go_into_the_same_holes() -> None:
    grid = with_turned_over(uneven(6))
    made = st.schedule(st.few_joints(grid, 1e-3, AS_THEY_ARE).grid, TUBE, keep_failed=True)
    half = len(grid.nodes) // 2
    assert made.nodes["node type"][:half] == made.nodes["node type"][half:]
    own = np.array([made.drilling[f"ball {axis}"] for axis in "xyz"], float).T
    holes: dict[Any, dict[Any, np.ndarray]] = {}
    for node, hole, direction in zip(made.drilling["node"], made.drilling["hole"], own, strict=True):
        holes.setdefault(node, {})[hole] = direction
    one = dict(zip(made.node_types["node type"], made.node_types["representative"], strict=True))
    kind = dict(zip(made.nodes["node"], made.nodes["node type"], strict=True))
    for node in made.nodes["node"]:
        pairs = [
            (direction, holes[one[kind[node]]][hole])
            for each, hole, direction in zip(made.drilling["node"], made.drilling["hole of type"], own, strict=True)
            if each == node
        ]
        mine, theirs = np.array(pairs).transpose(1, 0, 2)
        assert np.abs(mine @ mine.T - theirs @ theirs.T).max() < 5e-3


def two_quads(second: np.ndarray) -> st.Grid:
    """A grid of two quads apart from each other: a scalene, twisted one, and another."""
    first = np.array([[0.0, 0, 0], [1.0, 0, 0.08], [1.3, 0.9, -0.02], [-0.1, 0.7, 0.1]])
    return grid_of(np.concatenate([first, second + [5.0, 0, 0]]), np.array([[0, 1, 2, 3], [4, 5, 6, 7]]))


FIRST = two_quads(np.zeros((4, 3))).nodes[:4]


def test_mirror_images_of_quads_are_named() -> None:
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    image = (FIRST * [-1, 1, 1])[::-1]  # anticlockwise again
    for nodes in (image, np.roll(image, 1, axis=0) @ turn.T):
        types = st.schedule(two_quads(nodes), replace(TUBE, unit="m"), keep_failed=True).panel_types
        assert types["count"] == (1, 1) and types["mirror image"] == ("PT002", "PT001")
    same = st.schedule(two_quads(np.roll(FIRST, 2, axis=0) @ turn.T), replace(TUBE, unit="m"), keep_failed=True)
    assert same.panel_types["count"] == (2,) and same.panel_types["mirror image"] == (None,)
    square = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 1, 0], [0.0, 1, 0]])
    own = st.schedule(two_quads(square), replace(TUBE, unit="m"), keep_failed=True).panel_types
    assert own["mirror image"] == (None, "PT002")


def test_quads_that_are_twisted_the_other_way_are_of_another_type() -> None:
    """Their sides and diagonals are the same."""
    types = st.schedule(two_quads(FIRST * [1, 1, -1]), replace(TUBE, unit="m"), keep_failed=True).panel_types
    assert types["count"] == (1, 1)


def test_members_name_their_family(tmp_path: Path) -> None:
    found = st.few_lengths(uneven(6), 0.02, 30)
    members = st.schedule(read_again(found.grid, tmp_path), replace(TUBE, unit="m"), keep_failed=True).members
    assert members["family"] == tuple(f"F{k + 1:02d}" for k in found.of.tolist())
    off = np.abs(np.array(members["length"], float) - np.array(members["family length"], float))
    assert off.max() == pytest.approx(1000 * np.abs(found.misfit).max())


@pytest.mark.parametrize("ball", [None, 40.0])
def test_lengths_are_those_of_the_families(ball: float | None, tmp_path: Path) -> None:
    """Members of one family between balls of the same sizes are cut alike; what is left over is named as misfit."""
    found = st.few_lengths(uneven(6), 0.02, 30)
    made = st.schedule(read_again(found.grid, tmp_path), replace(TUBE, unit="m", ball=ball), keep_failed=True)
    lengths, members = made.lengths, made.members
    deducted = [np.array(members[f"{end} deduction"], float) for end in ("start", "end")]
    cut = np.array(members["family length"], float) - sum(deducted)
    row_of = {mark: row for row, mark in enumerate(lengths["length type"])}
    row = np.array([row_of[mark] for mark in members["length type"]])
    assert np.abs(np.array(lengths["cut length"], float)[row] - cut).max() <= 1.0 + 1e-9
    misfit = np.abs(np.array(members["cut length"], float) - np.array(lengths["cut length"], float)[row])
    worst = [misfit[row == each].max() for each in range(len(row_of))]
    assert np.array(lengths["largest misfit"], float) == pytest.approx(worst, abs=1e-9)
    if ball:
        assert len(row_of) <= len(set(members["family"]))


def test_what_is_alike_holds_for_the_nodes_of_before(tmp_path: Path) -> None:
    grid = st.few_lengths(uneven(4), 0.02, 30).grid
    assert grid.alike is not None and grid.replace(certificate=None).alike is grid.alike
    assert grid.replace(nodes=2 * grid.nodes).alike is None
    values = json.loads(encode_json(grid))
    for wrong in ({"parts": "feet"}, {"tolerance": 0}, {"member": "long"}, {"more": 1}):
        (tmp_path / "a.json").write_text(json.dumps(values | {"alike": values["alike"] | wrong}))
        with pytest.raises(st.FormatError, match="damaged grid"):
            st.read_grid(tmp_path / "a.json")


@pytest.mark.parametrize(
    ("few", "enough", "table"),
    [(st.few_panels, 3, "panel_types"), (st.few_joints, AS_THEY_ARE, "node_types"), (None, 0, "lengths")],
)
def test_a_structure_keeps_what_was_made_alike(few: Any, enough: int, table: str, tmp_path: Path) -> None:
    """Its schedules have the types of those of its grid, at any scale, and after it was saved."""
    grid = st.few_lengths(uneven(4), 0.01, 3).grid if few is None else few(uneven(4), 0.02, enough).grid
    unit = "" if grid.unit else "m"
    truss = st.Truss.from_grid(grid, scale=3.0, unit=unit, supports="boundary", loads="self")
    (tmp_path / "roof.json").write_bytes(encode_structure(truss))
    again = st.read_structure(tmp_path / "roof.json")
    ours = st.schedule(again, st.ScheduleSettings())
    theirs = st.schedule(grid, replace(TUBE, unit=unit, scale=3.0), keep_failed=True)
    if few is None:
        assert ours.members["family"] == theirs.members["family"] and len(set(ours.members["family"])) == 3
    else:
        counts = getattr(ours, table)["count"]
        assert counts == getattr(theirs, table)["count"] and len(counts) > 1
    deep = st.Truss.from_grid(grid, unit=unit, supports="boundary", loads="self", double_layer=0.3)
    assert deep.alike is None
