"""Fixed lines: chains of members on the scan, through corners and meetings, that no move takes apart."""

import csv
import json
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from rough import rough_disc
from typed import known

from scantruss import Grid, InputError, Settings, grid_from_points, write
from scantruss.boundary.polylines import corners_of_polyline, divide_polyline, simplify
from scantruss.cli.positions import read_polylines
from scantruss.constraints.network import Network, curves_of
from scantruss.errors import FormatError
from scantruss.export.json import encode_json, read_grid
from scantruss.export.style import FileStyle
from scantruss.improve.working_mesh import close_net, open_net
from scantruss.kernels.boundary.curves import at_arc, is_open, slide
from scantruss.kernels.mesh import grid as moves
from scantruss.kernels.mesh.local_search import COLLAPSE, is_allowed

NOISE = 0.003


def height(x: Any, y: Any) -> Any:
    return 0.02 * x * y + 0.03 * y * y


def plate(count: int = 9000, seed: int = 0) -> np.ndarray:
    """Points of a plate, curved and twisted, 10 members wide."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-5, 5, (count, 2))
    side = np.linspace(-5, 5, 300)
    curves = np.concatenate(
        [np.stack([c, d], axis=1) for s in (-5.0, 5.0) for c, d in ((side, s + 0 * side), (s + 0 * side, side))]
    )
    xy = np.concatenate([xy, curves])
    return np.column_stack([xy, height(*xy.T)]) + NOISE * rng.normal(size=(len(xy), 3))


def over(*corners: tuple[float, float], step: float = 0.2) -> tuple[tuple[float, float, float], ...]:
    """A polyline on the plate through places (x, y)."""
    xy, _ = divide_polyline(np.array([(*c, 0.0) for c in corners], float), False, step)
    return tuple(zip(xy[:, 0].tolist(), xy[:, 1].tolist(), height(xy[:, 0], xy[:, 1]).tolist(), strict=True))


def ball(count: int = 6000) -> np.ndarray:
    """Points of a sphere of radius 2."""
    places = np.random.default_rng(1).normal(size=(count, 3))
    return 2.0 * places / np.linalg.norm(places, axis=1)[:, None]


def degrees(grid: Grid) -> Counter[int]:
    """How many members of lines each node of a line has."""
    return Counter(grid.lines.ravel().tolist())


def far_from(places: np.ndarray, polylines: Sequence[ArrayLike]) -> float:
    """Largest distance of places from polylines, by sampling these densely."""
    dense = np.concatenate([divide_polyline(np.array(line), False, 0.01)[0] for line in polylines])
    return max(float(np.linalg.norm(dense - place, axis=1).min()) for place in places)


def check_chains(grid: Grid, polylines: Sequence[ArrayLike], noise: float = 0.05, chord: float = 0.12) -> None:
    """All members of lines are members, their nodes lie on the polylines, and they cover these."""
    edges = set(map(tuple, grid.edges.tolist()))
    assert all(tuple(member) in edges for member in grid.lines.tolist())
    nodes = grid.nodes + grid.origin
    assert far_from(nodes[np.unique(grid.lines)], polylines) < noise
    members = [tuple(map(tuple, nodes[pair].tolist())) for pair in grid.lines]
    assert far_from(np.concatenate([divide_polyline(np.array(p), False, 0.05)[0] for p in polylines]), members) < chord
    lengths = np.linalg.norm(nodes[grid.lines[:, 0]] - nodes[grid.lines[:, 1]], axis=1)
    assert lengths.min() / known(grid.settings).length > 0.5 and lengths.max() / known(grid.settings).length < 1.5


@pytest.mark.parametrize("method", ["default", "paper"])
def test_a_line_from_rim_to_rim_is_a_chain_of_members(method: str) -> None:
    line = over((-5, -1.3), (5, 1.1))
    grid = grid_from_points(plate(), Settings(length=1.0, method=method, fixed_lines=(line,)))
    check_chains(grid, [line])
    ends = [node for node, count in degrees(grid).items() if count == 1]
    assert len(ends) == 2 and set(degrees(grid).values()) == {1, 2}
    assert set(ends) <= set(grid.boundary_loops[0].tolist())
    assert grid.topology.euler == 1 and grid.topology.boundary_loops == 1
    assert grid.quality.shape_mean > (0.98 if method == "default" else 0.96)


def test_crossing_lines_share_a_node_and_corners_are_nodes() -> None:
    first, second = over((-3, -3), (-3, 2), (2.5, 2)), over((-1, 4), (-1, -4.2))
    grid = grid_from_points(plate(), Settings(length=1.0, fixed_lines=(first, second)))
    check_chains(grid, [first, second])
    counts = degrees(grid)
    assert sorted(Counter(counts.values()).items())[0] == (1, 4) and list(counts.values()).count(4) == 1
    nodes = grid.nodes + grid.origin
    crossing = nodes[next(node for node, count in counts.items() if count == 4)]
    assert np.linalg.norm(crossing - [-1, 2, height(-1, 2)]) < 0.06
    corner = np.array([-3, 2, height(-3, 2)])
    assert np.linalg.norm(nodes[list(counts)] - corner, axis=1).min() < 0.02
    assert (
        min(np.linalg.norm(nodes[n][:2] - [-1, -4.2]) for n, c in counts.items() if c == 1) < 0.02
    )  # far from the boundary


def test_a_closed_line_is_a_ring_also_on_a_closed_scan() -> None:
    angle = np.linspace(0, 2 * np.pi, 80)
    ring = np.stack([2 * np.cos(angle), 2 * np.sin(angle), 0 * angle], axis=1)
    ring[-1] = ring[0]
    tip = np.stack([0 * angle[:20], 2 * np.sin(angle[:20]), 2 * np.cos(angle[:20])], axis=1)
    for method in ("default", "paper"):
        grid = grid_from_points(ball(), Settings(length=0.6, method=method, fixed_lines=(ring.tolist(),)))
        assert grid.topology.euler == 2 and grid.topology.boundary_loops == 0
        assert set(degrees(grid).values()) == {2} and len(grid.lines) in (20, 21, 22)
        assert np.abs(grid.nodes[np.unique(grid.lines), 2] + grid.origin[2]).max() < 0.02
    grid = grid_from_points(ball(), Settings(length=0.6, fixed_lines=(tip.tolist(),)))
    assert grid.topology.euler == 2 and sorted(Counter(degrees(grid).values()).items())[0] == (1, 2)


def test_an_end_near_the_rim_comes_to_it_and_one_far_from_it_does_not() -> None:
    line = over((-4.6, 0.3), (4.2, 0.3))
    grid = grid_from_points(plate(), Settings(length=1.0, fixed_lines=(line,)))
    on_boundary = set(grid.boundary_loops[0].tolist())
    ends = {node: grid.nodes[node, 0] + grid.origin[0] for node, count in degrees(grid).items() if count == 1}
    assert sorted((node in on_boundary, bool(x > 0)) for node, x in ends.items()) == [(False, True), (True, False)]
    assert min(ends.values()) < -4.95 and abs(max(ends.values()) - 4.2) < 0.02


def test_a_line_along_the_rim_is_the_rim() -> None:
    grid = grid_from_points(plate(), Settings(length=1.0, fixed_lines=(over((-5, -4), (-5, 4)),)))
    assert len(grid.lines) in (8, 9) and grid.topology.euler == 1
    assert np.abs(grid.nodes[grid.lines, 0] + grid.origin[0] + 5).max() < 0.05
    assert (grid.edge_uses[grid.edge_on_line] == 1).all()


RIM_LINES: dict[str, tuple[tuple[float, float], ...]] = {
    "part of one side": ((-5, -3.37), (-5, 2.71)),
    "around a corner of the plate": ((-5, -3.37), (-5, 5), (1.4, 5)),
    "from inside, along the rim and inside again": ((-2, 1), (-5, 1), (-5, -2.6), (-1, -2.6)),
    "shorter than a member": ((-5, 0.2), (-5, 1.1)),
    "the whole rim": ((-5, -5), (5, -5), (5, 5), (-5, 5), (-5, -5)),
}


@pytest.mark.parametrize("method", ["default", "paper"])
@pytest.mark.parametrize("corners", RIM_LINES.values(), ids=RIM_LINES)
def test_a_line_along_the_rim_has_nodes_at_its_ends_and_corners_and_its_own_set(
    method: str, corners: tuple[tuple[float, float], ...]
) -> None:
    grid = grid_from_points(plate(), Settings(length=1.0, method=method, fixed_lines=(over(*corners),)))
    (line,) = grid.line_sets
    assert (line.name, line.kind) == ("line 1", "fixed line")
    nodes = grid.nodes + grid.origin
    for x, y in corners:
        assert np.linalg.norm(nodes[line.nodes] - [x, y, height(x, y)], axis=1).min() < 0.03
    assert far_from(nodes[line.nodes], [over(*corners)]) < 0.03
    edges = set(map(tuple, grid.edges.tolist()))
    assert all(tuple(sorted(pair)) in edges for pair in pairwise(line.nodes.tolist()))
    sides = np.linalg.norm(np.diff(np.array(over(*corners, step=0.01)), axis=0), axis=1)
    assert line.length(grid) == pytest.approx(sides.sum(), rel=0.03)
    if corners[0] != corners[-1]:  # in the order of the line
        ends = [np.linalg.norm(np.array(over(*corners)[k]) - nodes[line.nodes[k]]) for k in (0, -1)]
        assert max(ends) < 0.03


def test_the_nodes_on_every_line_are_a_named_set_in_the_grid_and_its_files(tmp_path: Path) -> None:
    lines = (over((-5, 2), (5, 2)), over((-1, -4.2), (-1, 5)), over((-5, -3.4), (-5, 4)))
    settings = Settings(length=1.0, fixed_lines=lines, line_names=("tie", "spine; main", "eaves"))
    grid = grid_from_points(plate(), settings)
    sets = {line.name: set(line.nodes.tolist()) for line in grid.line_sets}
    assert list(sets) == ["tie", "spine; main", "eaves"]
    nodes = grid.nodes + grid.origin
    for name, line in zip(sets, lines, strict=True):
        assert far_from(nodes[list(sets[name])], [line]) < 0.05
    for pair, place in ((("tie", "spine; main"), (-1, 2)), (("tie", "eaves"), (-5, 2))):
        (shared,) = sets[pair[0]] & sets[pair[1]]
        assert np.linalg.norm(nodes[shared] - [*place, height(*place)]) < 0.06
    assert set(np.unique(grid.lines)) == set.union(*sets.values())
    (tmp_path / "grid.json").write_bytes(encode_json(grid))
    values = json.loads((tmp_path / "grid.json").read_text())
    assert {line["name"]: set(line["nodes"]) for line in values["fixed_lines"]} == sets and values["ridges"] == []
    again = read_grid(tmp_path / "grid.json")
    assert (
        encode_json(again) == encode_json(grid)
        and again.line_sets[1].nodes.tolist() == grid.line_sets[1].nodes.tolist()
    )
    for comma in (False, True):
        write(grid, tmp_path / "grid.csv", style=FileStyle(decimal_comma=comma))
        with (tmp_path / "grid_nodes.csv").open(newline="") as file:
            rows = list(csv.DictReader(file, delimiter=";" if comma else ","))
        found = {name: {int(row["id"]) for row in rows if name in row["lines"].split("|")} for name in sets}
        assert found == sets


def test_two_lines_of_one_name_have_one_set_and_names_must_fit() -> None:
    lines = (over((-3, -3), (3, -3)), over((-3, 2), (3, 2)))
    grid = grid_from_points(plate(), Settings(length=1.0, fixed_lines=lines, line_names=("tie", "tie")))
    (line,) = grid.line_sets
    assert set(np.round(grid.nodes[line.nodes, 1] + grid.origin[1], 1)) == {-3.0, 2.0}
    wrong: tuple[Any, ...] = (("tie",), "tie", ("tie", ""), ("tie", 5))
    for names in wrong:
        with pytest.raises(InputError, match="line_names"):
            Settings(length=1.0, fixed_lines=lines, line_names=names)


def test_lines_stay_through_all_efforts_and_the_same_input_gives_the_same_bytes() -> None:
    lines = (over((-5, 0), (5, 0)), over((0, -5), (0.5, 5)))
    for effort in ("quick", "best"):
        settings = Settings(length=2.0, effort=effort, fixed_lines=lines)
        first, second = (grid_from_points(plate(2000), settings) for _ in range(2))
        check_chains(first, lines, chord=0.2, noise=0.07)
        assert encode_json(first) == encode_json(second)


def test_fixed_nodes_beside_a_line_leave_it_a_line_and_those_on_it_are_its_nodes() -> None:
    line = over((-5, 0.2), (5, 0.2))
    on, beside = (1.3, 0.2, height(1.3, 0.2)), (-2.2, 0.75, height(-2.2, 0.75))
    for method in ("default", "paper"):
        settings = Settings(length=1.0, method=method, fixed=(on, beside), fixed_lines=(line,))
        grid = grid_from_points(plate(), settings)
        check_chains(grid, [line])
        fixed = np.flatnonzero(grid.fixed)
        assert sorted(degrees(grid)[n] for n in fixed.tolist()) == [0, 2]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ([(0, 0, 0), (1, 0, 3.0)], r"fixed line 1, point 2 \(1, 0, 3\) is 2\.9.* away from the scan; .* 0\.5"),
        (
            [(0, 0, 0), (0.2, 0, 0)],
            r"fixed line 1 is 0\.2 long; a line, that is at least half a member, 0\.5, is needed",
        ),
        ([(0, 0, 0), (0.3, 0, 0), (0.3, 0.3, 0), (0, 0, 0)], r"is 1\.0.* long; a ring, that is at least two members"),
        ([(0, -5, 0.75), (0, 5, 0.75)], r"leaves the scan by 0\.\d+ near \(.*\); .* give it more points"),
        ([(0, 0, 0)], "at least two different points, got 1"),
        ([(0, 0, 0), (0, 0, 0)], "at least two different points, got 1"),
        ([(0, 0), (1, 0)], "three finite coordinates"),
        ([(0, 0, np.nan), (1, 0, 0)], "three finite coordinates"),
        (5, "must be polylines"),
    ],
)
def test_lines_that_cannot_be_are_refused(line: list[tuple[float, float, float]], words: str) -> None:
    with pytest.raises(InputError, match=words):
        grid_from_points(plate(3000), Settings(length=1.0, fixed_lines=(line,)))


def test_a_file_may_hold_several_polylines(tmp_path: Path) -> None:
    file = tmp_path / "lines.csv"
    file.write_text("x,y,z\n0,0,0\n1,0,0\n# a note\n2,0,0\n\n\n0;1;0\n1;1;0\n")
    assert read_polylines(file) == [
        ("lines-1", [(0, 0, 0), (1, 0, 0), (2, 0, 0)]),
        ("lines-2", [(0, 1, 0), (1, 1, 0)]),
    ]
    file.write_text("name,x,y,z\nring beam,0,0,0\nring beam,1,0,0\ntie,0,1,0\ntie,1,1,0\n")
    assert read_polylines(file) == [("ring beam", [(0, 0, 0), (1, 0, 0)]), ("tie", [(0, 1, 0), (1, 1, 0)])]
    file.write_text("0 0 0\n1 0 0\n")
    assert read_polylines(file) == [("lines", [(0, 0, 0), (1, 0, 0)])]
    for text, words in (("0 0 0\n\n1 0 0\n", "polyline 1 of .* has 1 point"), ("a b c\n", "holds no fixed lines")):
        file.write_text(text)
        with pytest.raises(FormatError, match=words):
            read_polylines(file)
    with pytest.raises(FormatError, match="cannot read fixed lines"):
        read_polylines(tmp_path / "none.csv")


def test_a_saved_grid_knows_its_lines(tmp_path: Path) -> None:
    rough = rough_disc()
    grid = rough.grid.replace(lines=rough.grid.edges[3:7])
    (tmp_path / "grid.json").write_bytes(encode_json(grid))
    assert np.array_equal(read_grid(tmp_path / "grid.json").lines, grid.lines)
    values = json.loads(encode_json(grid))
    del values["lines"]  # a grid of an earlier version
    (tmp_path / "old.json").write_text(json.dumps(values))
    assert read_grid(tmp_path / "old.json").lines.shape == (0, 2)


def chain_through(grid: Grid, rng: np.random.Generator, closed: bool = False) -> list[int]:
    """A path of interior nodes along members, no two of which are neighbours but in order."""
    inside = np.setdiff1d(np.arange(len(grid.nodes)), np.concatenate(grid.boundary_loops))
    around: dict[int, set[int]] = {n: set() for n in range(len(grid.nodes))}
    for a, b in grid.edges.tolist():
        around[a].add(b)
        around[b].add(a)
    chain = [int(rng.choice(inside))]
    while True:
        ahead = [n for n in sorted(around[chain[-1]]) if n in inside and not around[n] & set(chain[:-1])]
        ahead = [n for n in ahead if n not in chain]
        if not ahead:
            return chain
        chain.append(int(rng.choice(ahead)))


@pytest.mark.kernels
@pytest.mark.parametrize("seed", range(6))
def test_no_row_of_moves_takes_a_chain_apart(seed: int) -> None:
    """Flips, collapses and splits at random edges: the line stays one path between the same two ends."""
    rng = np.random.default_rng(seed)
    rough = rough_disc(length=0.3, points=2000)
    chain = max((chain_through(rough.grid, rng) for _ in range(20)), key=len)
    grid = rough.grid.replace(lines=np.sort(np.array([chain[:-1], chain[1:]]).T, axis=1))
    net, source = open_net(grid)
    for v in chain[1:-1]:
        net.kind[v], net.curve[v] = moves.ON_CURVE, 0
    made: Counter[tuple[str, bool]] = Counter()
    for _ in range(1500):
        a = int(rng.choice(np.flatnonzero((net.degree > 0) & ((net.line != 0) | (rng.random() < 0.7)))))
        b = int(net.ring[a, rng.integers(net.degree[a])])
        name = rng.choice(["flip", "collapse", "split"])
        if getattr(moves, f"may_{name}")(net, a, b):
            on_line = moves.is_line(net, a, b)
            getattr(moves, name)(net, a, b)
            made[name, bool(on_line)] += 1
    assert made["collapse", True] > 2 and made["split", True] > 2 and not made["flip", True]
    assert made["flip", False] > 20 and made["collapse", False] > 20
    after = close_net(net, source, grid)
    edges = set(map(tuple, after.edges.tolist()))
    assert all(tuple(pair) in edges for pair in after.lines.tolist())
    counts = degrees(after)
    assert sorted(Counter(counts.values()).items())[0] == (1, 2) and set(counts.values()) <= {1, 2}
    ends = [after.nodes[n] for n, count in counts.items() if count == 1]
    wanted = [grid.nodes[chain[0]], grid.nodes[chain[-1]]]
    assert sorted(map(tuple, ends)) == sorted(map(tuple, wanted))
    assert len(after.lines) == len(counts) - 1  # one path, no ring beside it


@pytest.mark.parametrize(("pieces", "allowed"), [(1.4, True), (1.7, False)])
def test_the_last_node_of_a_line_stays_where_its_ends_are_too_far_apart(pieces: float, allowed: bool) -> None:
    """A member between two corners could not be split again, so a long one never comes to be."""
    rough = rough_disc(length=0.3, points=2000)
    first, middle, last = chain_through(rough.grid, np.random.default_rng(1))[:3]
    grid = rough.grid.replace(lines=np.sort(np.array([(first, middle), (middle, last)]), axis=1))
    net, _ = open_net(grid)
    net.kind[middle], net.curve[middle] = moves.ON_CURVE, 0
    assert moves.may_collapse(net, first, middle)
    length = float(np.linalg.norm(net.nodes[last] - net.nodes[first])) / pieces
    assert is_allowed(net, COLLAPSE, first, middle, length) == allowed
    net.kind[last], net.curve[last] = moves.ON_CURVE, 0  # then others are left
    assert is_allowed(net, COLLAPSE, first, middle, length)


@pytest.mark.kernels
@given(st.integers(0, 10_000))
def test_places_slide_along_an_open_curve_and_not_over_its_ends(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.uniform(0.1, 1.0, (6, 3)), axis=0)
    curves = curves_of([points], [False])
    assert is_open(curves, 0) and not is_open(curves_of([points], [True]), 0)
    total = float(curves.total[0])
    assert np.allclose(at_arc(curves, 0, total + 1.0)[1:], points[-1]) and np.allclose(
        at_arc(curves, 0, -1.0)[1:], points[0]
    )
    place = points[rng.integers(6)] + rng.normal(size=3)
    arc, *foot = slide(curves, 0, rng.uniform(0, total), 10.0 * total, *place)
    arcs = np.linspace(0, total, 2000)
    dense = np.stack([np.interp(arcs, curves.arc, points[:, c]) for c in range(3)], axis=1)
    best = np.linalg.norm(dense - place, axis=1).min()
    assert np.linalg.norm(np.array(foot) - place) == pytest.approx(best, abs=2 * total / 2000)
    assert 0.0 <= arc <= total


@given(st.integers(0, 10_000), st.booleans())
def test_a_simplified_polyline_keeps_within_the_tolerance(seed: int, closed: bool) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(size=(30, 3)), axis=0)
    if closed:
        points = np.concatenate([points, points[:1]])
    kept = simplify(points, 0.8, closed)
    assert set(map(tuple, kept)) <= set(map(tuple, points))
    dense = divide_polyline(kept, False, 0.02)[0]
    assert max(np.linalg.norm(dense - p, axis=1).min() for p in points) < 0.83


def test_corners_are_found_however_finely_a_line_is_drawn() -> None:
    settings = Settings(length=1.0)
    square = np.array([(0, 0, 0), (3, 0, 0), (3, 3, 0), (0, 3, 0), (0, 0, 0)], float)
    for step in (3.0, 0.21, 0.013):
        drawn, _ = divide_polyline(square, False, step)
        points, at = divide_polyline(simplify(drawn, 0.005, True), True, 0.05)
        corners = corners_of_polyline(points, at, True, settings)
        assert sorted(map(tuple, points[corners])) == sorted(map(tuple, square[:4]))
    angle = np.linspace(0, 2 * np.pi, 200)
    circle = 1.5 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    circle[-1] = circle[0]
    points, at = divide_polyline(simplify(circle, 0.005, True), True, 0.05)
    assert corners_of_polyline(points, at, True, settings) == []


def test_the_network_cuts_lines_where_they_meet() -> None:
    """A cross, a touch, a stub over a meeting, and a second line along the first."""
    side = np.array([(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0), (0, 0, 0)], float)
    loop, corners = divide_polyline(side, True, 0.05)
    network = Network([(loop, corners)], 1.0)

    def add(*places: tuple[float, float]) -> None:
        network.add(divide_polyline(np.array([(*p, 0.0) for p in places], float), False, 0.05)[0], False, [])

    add((0, 5), (10, 5))
    add((5, 2), (5, 8))
    add((3, 5.2), (3, 9.8))  # touches the first, comes near the boundary
    add((7, 8), (7, 4.8))  # goes a little over it
    add((1, 5.1), (9, 5.1))  # along it
    lines = network.lines()
    inner = sorted(tuple(np.round(p, 6)) for p, k in zip(lines.stops.tolist(), lines.on_loop, strict=True) if k < 0)
    assert inner == [(1, 5, 0), (3, 5, 0), (5, 2, 0), (5, 5, 0), (5, 8, 0), (7, 5, 0), (7, 8, 0), (9, 5, 0)]
    assert sorted(map(tuple, np.round(lines.stops_on(0), 6).tolist())) == [(0, 5, 0), (3, 10, 0), (10, 5, 0)]
    sizes = sorted(round(float(np.linalg.norm(np.diff(c, axis=0), axis=1).sum()), 1) for c in lines.curves)
    assert sizes == [1, 1, 2, 2, 2, 2, 3, 3, 3, 5]
    for curve, (first, last) in zip(lines.curves, lines.ends, strict=True):
        assert np.array_equal(curve[0], lines.stops[first]) and np.array_equal(curve[-1], lines.stops[last])
