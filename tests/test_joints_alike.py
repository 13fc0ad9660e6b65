"""Few joints: misfits against a slow twin, fewer kinds, symmetry and surface kept, and the command."""

import json
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from small_grids import dome, fan, make_grid, uneven

import scantruss as st
from scantruss.cli.main import main
from scantruss.errors import InputError
from scantruss.improve.images import Images
from scantruss.layouts import alike
from scantruss.layouts.joints_alike import stars_of
from scantruss.scan.rotation import turn_about


def best_misfit(one: np.ndarray, other: np.ndarray, turns: int = 7200) -> float:
    """The least root mean square between unit vectors in frames with z along the normals, trying many turns, all shifts and both sides."""
    angle = np.linspace(0, 2 * np.pi, turns, endpoint=False)
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    best = np.inf
    for k, side in product(range(len(one)), (one, one[::-1] * [1, -1, -1])):
        x, y, z = np.roll(side, -k, axis=0).T
        turned = np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(z, (turns, len(z)))], axis=2)
        best = min(best, float(np.sqrt(((turned - other) ** 2).sum(axis=2).mean(axis=1)).min()))
    return best


@pytest.mark.kernels
def test_misfits_are_those_of_the_best_turn() -> None:
    grid = uneven(5)
    stars = stars_of(grid)
    directions, sizes = stars.members(grid.nodes)
    own = stars.own(directions)
    inner = np.flatnonzero((stars.is_open == 0) & (stars.count == 6))[:4]
    misfit, shift = stars.misfits(directions, inner, mirrored=False)
    assert np.allclose(misfit[inner, np.arange(len(inner))], 0, atol=1e-7) and (misfit[stars.is_open == 1] == 2).all()
    for one in inner.tolist():
        for column, other in enumerate(inner.tolist()):
            assert misfit[one, column] == pytest.approx(best_misfit(own[one, :6], own[other, :6]), abs=1e-5)
            assert shift[one, column] // 6 in (0, 2)  # turned, or turned over
    ends = {frozenset((v, u)) for v in range(len(grid.nodes)) for u in stars.ring[v].tolist() if u >= 0}
    assert ends == {frozenset(edge) for edge in grid.edges.tolist()}
    assert sizes[stars.ring >= 0] == pytest.approx(
        np.linalg.norm(np.diff(grid.nodes[grid.edges], axis=1), axis=2).mean(), rel=0.3
    )


def test_rings_run_anticlockwise_from_the_boundary() -> None:
    stars = stars_of(fan())
    assert stars.is_open.tolist() == [0, 1, 1, 1, 1, 1, 1]
    for k in range(6):
        assert stars.ring[1 + k, :3].tolist() == [1 + (k + 1) % 6, 0, 1 + (k - 1) % 6]
    normals = stars.normals(stars.vectors(fan().nodes))
    assert normals == pytest.approx(np.tile([0.0, 0.0, 1.0], (7, 1)))


def test_aims_of_equal_joints_are_where_their_members_are() -> None:
    grid = dome(6)
    flat = grid.replace(nodes=grid.nodes * [1, 1, 0])
    found = st.few_joints(flat)
    stars = stars_of(flat)
    directions = stars.vectors(flat.nodes)
    misfit, shift = stars.misfits(directions, found.representative, mirrored=False)
    near = misfit.argmin(axis=1)
    every = np.arange(len(near))
    aims = alike._aims(stars, directions, near, shift[every, near], np.ones(len(near), bool), len(found.representative))
    assert aims == pytest.approx(directions, abs=1e-7)
    assert found.before == len(found.representative) and np.array_equal(found.grid.nodes, flat.nodes)


def test_there_are_fewer_kinds_of_joints_and_nodes_stay_on_the_surface() -> None:
    grid = uneven(7)
    grid = grid.replace(fixed=np.arange(len(grid.nodes)) == 24)
    mean = float(grid.lengths.mean())
    found = st.few_joints(grid, 0.02, 7)  # the fewest that it finds: it need not look for fewer
    assert len(found.representative) < 0.8 * found.before and found.counts.sum() == len(grid.nodes)
    assert found.misfit.max() <= 0.02 and found.moved.max() <= 0.41 * mean
    nodes = found.grid.nodes
    assert np.array_equal(nodes[24], grid.nodes[24]) and np.array_equal(found.grid.triangles, grid.triangles)
    wide = dome(7, 4.0).nodes[:, 0].max()
    surface = 0.3 * wide - 0.3 * (nodes[:, 0] ** 2 + nodes[:, 1] ** 2) / wide
    inner = np.setdiff1d(np.arange(len(nodes)), np.concatenate(grid.boundary_loops))
    assert np.abs(nodes[:, 2] - surface)[inner].max() < 0.05 * mean
    again = st.few_joints(grid, 0.02, 7)
    assert np.array_equal(again.grid.nodes, nodes)


@pytest.mark.parametrize(("bound", "kinds"), [(0.05, 10), (0.2, 7)])
def test_members_stay_as_even_as_is_asked_for_or_as_they_were(bound: float, kinds: int) -> None:
    grid = uneven(7)
    mean = float(grid.lengths.mean())
    found = st.few_joints(grid, 0.02, kinds, uneven=bound)  # the fewest that it finds
    beyond = np.abs(found.grid.lengths / mean - 1) - np.maximum(np.abs(grid.lengths / mean - 1), bound)
    assert len(found.counts) < found.before and beyond.max() <= 0.01


def test_mirror_images_of_joints_are_of_one_kind_where_it_is_asked_for() -> None:
    flat = three_parts()  # of which mirror images are the same turned over
    grid = flat.replace(nodes=flat.nodes * [1, 1, 0] - [0, 0, 0.1] * (flat.nodes**2).sum(axis=1, keepdims=True))
    both = grid.replace(
        nodes=np.concatenate([grid.nodes, grid.nodes * [-1, 1, 1] + [9, 0, 0]]),
        triangles=np.concatenate([grid.triangles, grid.triangles[:, ::-1] + len(grid.nodes)]),
        fixed=np.zeros(2 * len(grid.nodes), bool),
    )
    apart, same = (st.few_joints(both, 1e-3, 999, mirrored=mirrored) for mirrored in (False, True))
    assert same.before < apart.before and same.mirrored.any() and not apart.mirrored.any()
    assert same.before <= st.few_joints(grid, 1e-3, 999).before
    assert same.misfit.max() <= 1e-3 and np.array_equal(same.grid.nodes, both.nodes)


def with_turned_over(grid: st.Grid) -> st.Grid:
    """A grid and beside it the same turned over, both with their outsides up."""
    return grid.replace(
        nodes=np.concatenate([grid.nodes, grid.nodes * [1, -1, -1] + [0, 40, 0]]),
        triangles=np.concatenate([grid.triangles, grid.triangles[:, ::-1] + len(grid.nodes)]),
        fixed=np.zeros(2 * len(grid.nodes), bool),
    )


@pytest.mark.parametrize("mirrored", [False, True])
def test_joints_that_are_turned_over_are_of_one_kind(mirrored: bool) -> None:
    grid = uneven(6)
    both = with_turned_over(grid)
    once, twice = (st.few_joints(each, 1e-3, 999, mirrored=mirrored) for each in (grid, both))
    assert once.before == twice.before and np.array_equal(twice.of[: len(grid.nodes)], twice.of[len(grid.nodes) :])
    assert twice.misfit.max() <= 1e-3 and not (twice.mirrored.any() and not mirrored)
    stars = stars_of(both)
    directions = stars.vectors(both.nodes)
    misfit, shift = stars.misfits(directions, twice.representative, mirrored=mirrored)
    every = np.arange(len(both.nodes))
    near = misfit.argmin(axis=1)
    aims = alike._aims(stars, directions, near, shift[every, near], misfit.min(axis=1) < 1e-3, len(twice.counts))
    assert aims == pytest.approx(directions, abs=2e-3)


def three_parts() -> st.Grid:
    """A flat grid of three parts about the origin, each uneven in the same way, with a rotation in its settings."""
    ring = np.array([[1.0, 0.0, 0.0], [0.55, 0.8, 0.0]])
    outer = np.array([[2.1, 0.1, 0.0], [1.6, 1.1, 0.0], [0.9, 1.7, 0.0], [0.0, 2.0, 0.0]])
    turn = turn_about(np.array([0.0, 0.0, 1.0]), 2 * np.pi / 3)
    nodes = [np.zeros((1, 3))]
    for k in range(3):
        nodes.append(np.concatenate([ring, outer]) @ np.linalg.matrix_power(turn, k).T)
    triangles = []
    for k in range(3):
        a, b, p, q, r, s = range(1 + 6 * k, 7 + 6 * k)
        c, t = 1 + 6 * ((k + 1) % 3), 3 + 6 * ((k + 1) % 3)
        triangles += [(0, a, b), (0, b, c), (a, p, q), (a, q, b), (b, q, r), (b, r, c), (c, r, s), (c, s, t)]
    settings = st.Settings(length=1.0, symmetry=[(0, 0, 0, 0, 0, 1, 3)])
    return make_grid(np.concatenate(nodes), triangles, settings=settings)


def test_what_is_symmetric_stays_so() -> None:
    grid = three_parts()
    images = Images.of_grid(grid)
    assert len(images.matrices) == 3
    shaken = grid.nodes + 0.1 * np.random.default_rng(3).standard_normal(grid.nodes.shape)
    alike = images.alike(shaken)
    for matrix, of in zip(images.matrices, images.of, strict=True):
        assert alike[of] == pytest.approx(alike @ matrix.T, abs=1e-14)
    assert images.alike(alike) == pytest.approx(alike, abs=1e-14)
    for made in (st.few_joints(grid, 0.05, 6).grid, st.few_lengths(grid, 0.02, 4).grid):
        assert len(Images.of_grid(made).matrices) == 3 and not np.array_equal(made.nodes, grid.nodes)
    assert len(Images.of_grid(grid.replace(nodes=shaken)).matrices) == 1  # the settings say so, the nodes do not


@pytest.mark.parametrize("tolerance", [0.0, 0.5])
def test_a_tolerance_that_cannot_be_used_is_refused(tolerance: float) -> None:
    with pytest.raises(InputError, match="the tolerance of joints is"):
        st.few_joints(dome(4), tolerance)


def test_the_command_makes_few_joints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(uneven(6), "grid.json")
    words = "families grid.json out.json --parts joints --tolerance 2% --report report.json"
    assert main(words.split()) == 0
    report = json.loads(Path("report.json").read_text())
    assert sum(each["nodes"] for each in report["kinds"]) == 36 and len(report["kinds"]) < report["kinds_before"]
    assert "kinds of joints before" in capsys.readouterr().out
    assert main([*words.split(), "--force", "--plot", "plot.png"]) == 0
    trade = [each["kinds"] for each in report["trade"]]
    assert trade == sorted(set(trade), reverse=True) and Path("plot.png").stat().st_size > 10_000
    assert trade[0] == report["kinds_before"] and trade[-1] == len(report["kinds"])
