"""The boundary that the user gives: the grid ends exactly on it, what lies outside is left out, and its corners are nodes."""

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from test_fixed_lines import ball, height, over, plate
from typed import known

import scantruss as st
from scantruss import Settings, grid_from_points
from scantruss.cli.main import main
from scantruss.errors import InputError, LengthError
from scantruss.export.json import encode_json

Curve = tuple[tuple[float, float, float], ...]

CORNERS = ((-4, -3), (4, -3), (4, 3.5), (-4, 3.5))
TURNS = np.linspace(0, 2 * np.pi, 60, endpoint=False)


def ring(*corners: tuple[float, float]) -> Curve:
    """A closed polyline on the plate through places (x, y)."""
    return over(*corners, corners[0])[:-1]


def circle(x: float, y: float, radius: float) -> Curve:
    """A circle in plan on the plate, anticlockwise."""
    at = np.stack([x + radius * np.cos(TURNS), y + radius * np.sin(TURNS)])
    return tuple(zip(*at.tolist(), height(*at).tolist(), strict=True))


def distance_to(places: np.ndarray, curve: ArrayLike) -> np.ndarray:
    """Distance of each place from a closed polyline."""
    points = np.array(curve)
    best = np.full(len(places), np.inf)
    for a, b in pairwise([*points, points[0]]):
        share = np.clip((places - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(places - a - share[:, None] * (b - a), axis=1))
    return best


def contains(curve: Any, places: np.ndarray) -> np.ndarray:
    """Whether places (N, 3) lie inside a closed polyline in plan, by crossings."""
    inside = np.zeros(len(places), bool)
    for (x0, y0, _), (x1, y1, _) in pairwise([*curve, curve[0]]):
        if y0 != y1:
            crosses = (places[:, 1] < y0) != (places[:, 1] < y1)
            inside ^= crosses & (places[:, 0] < x0 + (places[:, 1] - y0) * (x1 - x0) / (y1 - y0))
    return inside


def outside_points(grid: st.Grid) -> int:
    """Points that the grid leaves out because they lie outside."""
    return sum(
        part.points for part in known(grid.certificate).left_out if part.words.startswith("outside of the boundary")
    )


def check_ends_on(grid: st.Grid, curves: Sequence[ArrayLike]) -> None:
    """Every boundary loop lies exactly on a curve of its own, and no node beyond it."""
    nodes = grid.nodes + grid.origin
    assert len(grid.boundary_loops) == len(curves)
    taken: set[int] = set()
    for loop in grid.boundary_loops:
        off = [distance_to(nodes[loop], curve).max() for curve in curves]
        taken.add(int(np.argmin(off)))
        assert min(off) < 1e-9
    assert len(taken) == len(curves)


@pytest.mark.parametrize("method", ["default", "paper"])
@pytest.mark.parametrize("turned", [False, True])
def test_the_grid_ends_exactly_on_the_boundary_and_its_corners_are_nodes(method: str, turned: bool) -> None:
    square = ring(*CORNERS)
    points, given = plate(), square[::-1] if turned else square
    grid = grid_from_points(points, Settings(length=1.0, method=method, boundary=(given,)))
    check_ends_on(grid, [square])
    nodes = grid.nodes + grid.origin
    for x, y in CORNERS:
        assert np.linalg.norm(nodes - [x, y, height(x, y)], axis=1).min() < 1e-9
    inside = contains(square, points)
    assert abs(outside_points(grid) - (~inside).sum()) <= 3  # of those that noise puts beyond the line
    found = known(grid.certificate)
    assert found.passed and found.judged_out == 0.0 and found.missing == 0.0 and found.scan_within_reach == 1.0
    assert found.points + outside_points(grid) == len(points)
    assert contains(np.array(square) * [1.001, 1.001, 1], nodes).all()


def test_inner_polylines_are_holes_in_whatever_order_and_direction() -> None:
    square, hole, slot = ring(*CORNERS), circle(1.5, 1.0, 1.2), ring((-3, -2), (-1, -2), (-1, -0.5), (-3, -0.5))
    points = plate()
    kept = contains(square, points) & ~contains(hole, points) & ~contains(slot, points)
    for given in ((square, hole, slot), (slot[::-1], hole, square), (hole[::-1], square[::-1], slot)):
        grid = grid_from_points(points, Settings(length=0.7, boundary=given))
        check_ends_on(grid, [square, hole, slot])
        assert abs(outside_points(grid) - (~kept).sum()) <= 5 and grid.topology.euler == -1


def test_a_hole_of_the_scan_that_is_not_given_is_closed_and_a_given_one_stays() -> None:
    points = plate()
    points = points[np.hypot(points[:, 0] - 1.0, points[:, 1]) > 1.8]
    square, hole = ring(*CORNERS), circle(1.0, 0.0, 1.9)
    closed = grid_from_points(points, Settings(length=1.0, boundary=(square,)))
    check_ends_on(closed, [square])
    assert [part.kind for part in known(closed.certificate).left_out if not part.points] == ["hole"]
    check_ends_on(grid_from_points(points, Settings(length=1.0, boundary=(square, hole))), [square, hole])


def test_the_grid_reaches_a_boundary_that_leaves_the_scan_by_less_than_half_a_member() -> None:
    beyond = ring((-5.3, -5.3), (5.3, -5.3), (5.3, 5.3), (-5.3, 5.3))
    grid = grid_from_points(plate(), Settings(length=1.0, boundary=(beyond,)))
    check_ends_on(grid, [beyond])
    assert known(grid.certificate).passed and outside_points(grid) == 0
    too_far = ring((-5.8, -5.2), (5.2, -5.2), (5.2, 5.2), (-5.8, 5.2))
    with pytest.raises(
        LengthError,
        match=r"boundary 1 leaves the scan by up to 0\.\d+, near \(-5\.8, .*half a member, 0\.5: move it, or add points",
    ):
        grid_from_points(plate(), Settings(length=1.0, boundary=(too_far,)))


def test_a_boundary_in_another_unit_is_refused_at_once_with_its_factor() -> None:
    in_mm = [(1000.0 * x, 1000.0 * y, 1000.0 * z) for x, y, z in ring(*CORNERS)]
    with pytest.raises(
        InputError, match=r"boundary 1, point 1 .* away from the scan; .*times 0\.001 all that are given"
    ):
        grid_from_points(plate(), Settings(length=1.0, boundary=(in_mm,)))


def test_an_open_polyline_is_refused_where_its_ends_do_not_meet_on_the_scan() -> None:
    """No other length is tried for it: an `InputError` that is no `LengthError`."""
    points = plate()
    points = points[np.hypot(*points[:, :2].T) > 3.0]
    angle = np.linspace(0.0, 1.2 * np.pi, 60)
    x, y = 4.0 * np.cos(angle), 4.0 * np.sin(angle)
    arc = np.stack([x, y, height(x, y)], axis=1)
    with pytest.raises(
        InputError, match="boundary 1 leaves the scan, where a straight line closes it, by up to"
    ) as refused:
        grid_from_points(points, Settings(length=1.0, boundary=(arc.tolist(),)))
    assert not isinstance(refused.value, LengthError)


def test_inside_is_where_the_rim_of_the_scan_is_not_and_on_a_closed_scan_the_larger_part() -> None:
    small = circle(2.0, -1.5, 2.0)  # a ninth of the plate
    grid = grid_from_points(plate(), Settings(length=0.8, boundary=(small,)))
    check_ends_on(grid, [small])
    assert np.hypot(*(grid.nodes + grid.origin)[:, :2].T - np.array([[2.0], [-1.5]])).max() < 2.001
    cap = 2.0 * np.stack([np.sin(0.9) * np.cos(TURNS), np.sin(0.9) * np.sin(TURNS), np.cos(0.9) + 0 * TURNS], axis=1)
    grid = grid_from_points(ball(), Settings(length=0.5, boundary=(cap.tolist(),)))
    check_ends_on(grid, [cap])
    assert (grid.nodes + grid.origin)[:, 2].min() < -1.9 and (grid.nodes + grid.origin)[:, 2].max() < 2.0 * np.cos(
        0.9
    ) + 0.01


def test_two_outer_boundaries_bound_two_pieces_and_a_ring_within_a_hole_an_island() -> None:
    left, right = ring((-4.5, -4), (-0.5, -4), (-0.5, 4), (-4.5, 4)), ring((0.6, -4), (4, -4), (4, 4), (0.6, 4))
    grid = grid_from_points(plate(), Settings(length=1.0, boundary=(left, right)))
    check_ends_on(grid, [left, right])
    assert grid.topology.components == 2
    square, hole, island = ring(*CORNERS), circle(0, 0.2, 2.4), circle(0, 0.2, 1.5)
    grid = grid_from_points(plate(), Settings(length=0.6, boundary=(square, hole, island)))
    check_ends_on(grid, [square, hole, island])
    assert grid.topology.components == 2


def test_of_corners_nearer_than_half_a_member_the_sharper_one_is_a_node() -> None:
    tooth = (
        (-4, -3),
        (4, -3),
        (4, 3.5),
        (0.3, 3.5),
        (0.0, 3.0),
        (-0.3, 3.5),
        (-4, 3.5),
    )  # 0.58 along both sides, tip sharpest
    for length, is_node in ((0.8, True), (1.4, False)):
        grid = grid_from_points(plate(), Settings(length=length, boundary=(ring(*tooth),)))
        check_ends_on(grid, [ring(*tooth)])
        off = [np.linalg.norm(grid.nodes + grid.origin - [x, y, height(x, y)], axis=1).min() for x, y in tooth]
        assert all(distance < 1e-9 for k, distance in enumerate(off) if k not in (3, 5))
        assert (max(off[3], off[5]) < 1e-9) == is_node


def test_a_far_frame_and_a_second_run_change_nothing() -> None:
    far = np.array([500_000.0, 4_500_000.0, 100.0])
    square = np.array(ring(*CORNERS))
    near = grid_from_points(plate(), Settings(length=1.0, boundary=(square.tolist(),)))
    moved = grid_from_points(plate() + far, Settings(length=1.0, boundary=((square + far).tolist(),)))
    assert np.abs(moved.nodes + moved.origin - far - near.nodes - near.origin).max() < 1e-6
    assert encode_json(near) == encode_json(
        grid_from_points(plate(), Settings(length=1.0, boundary=(square.tolist(),)))
    )


@pytest.mark.parametrize(
    ("rings", "error", "words"),
    [
        ((ring((0, 0), (0.5, 0), (0, 0.5)),), LengthError, r"boundary 1 is 1\.7.* long; three members, 3, are needed"),
        ((((0, 0, 0), (1, 0, 0), (0, 0, 0)),), st.InputError, "at least three different points, got 2"),
        ((((0, 0, 0), (1, 0, np.nan)),), st.InputError, "a boundary needs points of three finite coordinates"),
        ((5,), st.InputError, "boundary must be polylines"),
    ],
)
def test_a_boundary_that_cannot_be_is_refused(rings: Any, error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        grid_from_points(plate(3000), Settings(length=1.0, boundary=rings))


def test_the_command_takes_files_and_says_what_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    np.savetxt("scan.xyz", plate(), fmt="%.5f")
    square, hole = ring(*CORNERS), circle(1.5, 1.0, 1.2)
    text = "\n\n".join("\n".join(f"{x!r};{y!r};{z!r}" for x, y, z in curve) for curve in (square, hole))
    (tmp_path / "edge.csv").write_text("x;y;z\n" + text)
    assert main(["grid", "scan.xyz", "a.json", "a.png", "--length", "0.8", "--boundary", "edge.csv"]) == 0
    assert "outside of the boundary that was given" in capsys.readouterr().out
    grid = st.read_grid("a.json")
    check_ends_on(grid, [square, hole])
    assert len(json.loads((tmp_path / "a.json").read_text())["settings"]["boundary"]) == 2
    before = (tmp_path / "a.json").read_bytes()
    assert main(["grid", "scan.xyz", "a.json", "--settings", "a.settings.json"]) == 0
    assert (tmp_path / "a.json").read_bytes() == before
    assert main(["grid", "scan.xyz", "edge.csv", "--length", "0.8", "--boundary", "edge.csv"]) == 2
    assert "would overwrite the boundary" in capsys.readouterr().err
