"""Figures and topology of a grid: against plain loops, hand-made grids, and the check beside the repository."""

import importlib
import sys
from collections.abc import Callable
from pathlib import Path

import naive_grid as naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from rough import rough_disc, rough_sphere, strip_of
from small_grids import dome, fan, icosahedron, make_grid, two_pieces

from scantruss import Grid, InputError
from scantruss.report.figures import count_holes, grid_lines

CHECK = Path(__file__).resolve().parents[2] / "shared" / "check"

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0.2), (2, 1, 0)]
GRIDS: dict[str, Callable[[], Grid]] = {
    "fan": fan,
    "icosahedron": icosahedron,
    "two pieces": two_pieces,
    "dome": dome,
    "ring": lambda: strip_of(12),
    "moebius": lambda: strip_of(13, 1),
    "pinched": lambda: make_grid(CORNERS, [(0, 1, 2), (2, 3, 4)]),
    "three at an edge": lambda: make_grid(CORNERS, [(0, 1, 2), (1, 0, 3), (0, 1, 4)]),
    "twice": lambda: make_grid(CORNERS, [(0, 1, 2), (1, 2, 0), (1, 3, 2)]),
    "rough disc": lambda: rough_disc(points=500).grid,
    "rough sphere": lambda: rough_sphere(points=500).grid,
}


@pytest.mark.parametrize("name", ["fan", "icosahedron", "dome", "rough disc", "moebius"])
def test_figures_agree_with_plain_loops(name: str) -> None:
    grid = GRIDS[name]()
    quality = grid.quality
    shape = [naive.shape(*grid.nodes[t]) for t in grid.triangles]
    lengths = [np.linalg.norm(grid.nodes[a] - grid.nodes[b]) for a, b in naive.wings(grid)]
    angles = [naive.angles(*grid.nodes[t]) for t in grid.triangles]
    inside = set(range(len(grid.nodes))) - {
        v for edge, third in naive.wings(grid).items() if len(third) == 1 for v in edge
    }
    six = [len(naive.neighbors(grid)[v]) == 6 for v in inside]
    assert quality.shape_mean == pytest.approx(np.mean(shape))
    assert quality.shape_std == pytest.approx(np.std(shape), abs=1e-9)
    assert quality.shape_min == pytest.approx(np.min(shape))
    assert quality.length_mean == pytest.approx(np.mean(lengths))
    assert quality.length_cv == pytest.approx(np.std(lengths) / np.mean(lengths), abs=1e-9)
    assert quality.angle_min == pytest.approx(np.min(angles)) and quality.angle_max == pytest.approx(np.max(angles))
    assert quality.valence6 == pytest.approx(np.mean(six) if six else 0.0)
    assert quality.node_deviation_mean is None


def test_deviation_is_that_of_the_nodes() -> None:
    grid = fan(deviation=np.array([0.0, 0.2, 0.1, 0, 0, 0, 0]))
    assert grid.quality.node_deviation_mean == pytest.approx(0.3 / 7)
    assert grid.quality.node_deviation_max == pytest.approx(0.2)


def test_an_empty_grid_has_zeros() -> None:
    grid = make_grid([], [])
    assert all(value == 0 for value in grid.quality.to_dict().values() if value is not None)
    assert grid.topology.to_dict() == {
        "components": 0, "boundary_loops": 0, "euler": 0, "manifold": True, "orientable": True,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "components", "loops", "euler", "manifold", "orientable"),
    [
        ("fan", 1, 1, 1, True, True),
        ("icosahedron", 1, 0, 2, True, True),
        ("two pieces", 2, 1, 3, True, True),
        ("ring", 1, 2, 0, True, True),
        ("moebius", 1, 1, 0, True, False),
        ("pinched", 1, 2, 1, False, True),
        ("three at an edge", 1, 2, 1, False, True),
        ("twice", 1, 1, 2, False, True),
    ],
)
def test_topology_of_known_grids(
    name: str, components: int, loops: int, euler: int, manifold: bool, orientable: bool
) -> None:
    topology = GRIDS[name]().topology
    assert (topology.components, topology.euler, topology.manifold) == (components, euler, manifold)
    if manifold:
        assert (topology.boundary_loops, topology.orientable) == (loops, orientable)


def test_loops_as_long_as_the_longest_of_their_piece_are_not_said_to_be_holes() -> None:
    """Of a hall on four feet three of its feet were said to be holes."""
    tube, wide = strip_of(12), strip_of(12)
    wide = wide.replace(nodes=wide.nodes * np.where(np.arange(len(wide.nodes)) < 12, 2.0, 1.0)[:, None])
    assert grid_lines(tube, 100)[1] == "1 piece, 2 boundary loops"
    assert grid_lines(wide, 100)[1] == "1 piece, 2 boundary loops, 1 of them a hole"
    assert grid_lines(fan(), 100)[1] == "1 piece, 1 boundary loop, no hole"


def test_every_loop_is_a_hole_but_the_outer_rim_of_its_piece() -> None:
    ring = strip_of(12)
    beside = np.vstack([ring.nodes, ring.nodes + (100, 0, 0)])
    two_rings = make_grid(beside, np.vstack([ring.triangles, ring.triangles + len(ring.nodes)]))
    for grid, holes in (
        (fan(), 0),
        (icosahedron(), 0),
        (two_pieces(), 0),
        (ring, 1),
        (two_rings, 2),
        (make_grid([], []), 0),
    ):
        assert count_holes(grid) == holes


@given(some.sets(some.integers(0, 19)), some.integers(0, 1))
def test_whether_a_grid_is_orientable_does_not_depend_on_how_its_triangles_lie(
    turned: set[int], half_turns: int
) -> None:
    for grid in (icosahedron(), strip_of(10, half_turns)):
        triangles = grid.triangles.copy()
        for t in turned:
            triangles[t] = triangles[t, ::-1]
        topology = grid.replace(triangles=triangles).topology
        assert topology == grid.topology


@pytest.mark.skipif(not CHECK.exists(), reason="../shared/check is not here")
@pytest.mark.parametrize("name", sorted(GRIDS))
def test_figures_agree_with_the_check_beside_the_repository(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [str(CHECK), *sys.path])
    measure_grid = importlib.import_module("quality").measure_grid

    grid = GRIDS[name]()
    theirs, quality, topology = measure_grid(grid.nodes, grid.triangles), grid.quality, grid.topology
    for ours, key in (
        (quality.shape_mean, "G_mean"), (quality.shape_std, "G_std"), (quality.shape_min, "G_min"),
        (quality.length_mean, "L_mean"), (quality.length_std, "L_std"), (quality.length_cv, "L_cv"),
        (quality.angle_min, "angle_min"), (quality.angle_max, "angle_max"), (quality.valence6, "valence6"),
    ):  # fmt: skip
        assert ours == pytest.approx(theirs[key], abs=1e-9), key
    for key in ("components", "boundary_loops", "euler", "manifold"):
        assert getattr(topology, key) == theirs[key], key


def test_the_name_of_a_file_is_no_cloud_to_plot() -> None:
    grid = fan()
    for draw, instead in ((grid.plot, r'plot\(\).save\("grid.png"\)'), (grid.show, "scantruss.write")):
        with pytest.raises(InputError, match=f"got a str; {instead}"):
            draw("grid.png")  # type: ignore[arg-type]
