"""Few lengths: how many are needed, what moves and what stays, and the command."""

import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from marks import compiled_only
from small_clouds import sheet
from small_grids import dome, make_grid, uneven

import scantruss as st
from scantruss.cli.main import main
from scantruss.errors import InputError
from scantruss.layouts import families
from scantruss.layouts.charts import Charts
from scantruss.layouts.families import least_misfit, lengths_needed


@pytest.mark.parametrize("share", [0.6, 0.95, 1.0])
def test_no_fewer_lengths_are_enough(share: float) -> None:
    lengths = np.random.default_rng(2).random(11)
    found = lengths_needed(lengths, 0.05, share)
    within = (np.abs(lengths[:, None] - found).min(axis=1) <= 0.05 + 1e-9).mean()
    assert within >= share - 1e-9 and (np.diff(found) > 0).all()
    for fewer in combinations(lengths + 0.05, len(found) - 1):  # the best windows begin at a length
        held = np.abs(lengths[:, None] - np.array(fewer)).min(axis=1, initial=np.inf) <= 0.05 + 1e-12
        assert held.mean() < share


def test_the_least_misfit_is_that_of_which_as_many_lengths_are_needed() -> None:
    lengths = np.random.default_rng(4).random(60)
    for count in (1, 3, 8):
        misfit = least_misfit(lengths, count)
        assert len(lengths_needed(lengths, misfit * 1.0001)) <= count < len(lengths_needed(lengths, misfit * 0.99))


def test_more_members_are_of_few_lengths_and_nodes_stay_on_the_surface() -> None:
    grid = uneven()
    grid = grid.replace(fixed=np.arange(len(grid.nodes)) == 27)
    mean = float(grid.lengths.mean())
    found = st.few_lengths(grid, 0.01, 6)
    before, after = (len(lengths_needed(each.lengths, 0.01 * mean)) for each in (grid, found.grid))
    assert after < before and len(found.counts) <= 6 and found.counts.sum() == len(grid.edges)
    nodes = found.grid.nodes
    assert np.array_equal(nodes[27], grid.nodes[27]) and np.array_equal(found.grid.triangles, grid.triangles)
    paraboloid = (
        0.3 * dome(8, 4.0).nodes[:, 0].max()
        - 0.3 * (nodes[:, 0] ** 2 + nodes[:, 1] ** 2) / dome(8, 4.0).nodes[:, 0].max()
    )
    inner = np.setdiff1d(np.arange(len(nodes)), np.concatenate(grid.boundary_loops))
    assert np.abs(nodes[:, 2] - paraboloid)[inner].max() < 0.05 * mean
    assert found.moved.max() <= 0.41 * mean and found.misfit == pytest.approx(
        found.grid.lengths - found.lengths[found.of]
    )


@pytest.mark.parametrize(("tolerance", "large", "count"), [(0.01, 7, 12), (0.005, 12, 20)])
def test_large_families_hold_nearly_all_members_and_small_ones_the_rest(
    tolerance: float, large: int, count: int
) -> None:
    grid = uneven(9)
    width = tolerance * float(grid.lengths.mean())
    found = st.few_lengths(grid, tolerance, count)
    for share, few in ((0.95, large), (1.0, count)):
        assert len(lengths_needed(found.grid.lengths, width, share)) <= few
        assert len(lengths_needed(grid.lengths, width, share)) > few
    assert np.abs(found.misfit).max() <= width * (1 + 1e-9)


def test_one_member_in_twenty_at_most_is_drawn_to_a_small_family() -> None:
    lengths = np.random.default_rng(8).normal(1, 0.06, 400)
    number = families._Number(4, 7)
    target = families._families_aimed_at(lengths, 0.01, number)
    large = families._middles(lengths, 0.01, 4, 400)
    off = np.abs(lengths[:, None] - large).min(axis=1)
    to_small = ~np.isin(target, large)
    assert 0 < to_small.sum() <= 20 and (np.abs(lengths - target) <= off + 1e-12).all()
    assert len(np.unique(target)) <= 7


def test_a_small_family_is_where_the_rest_is_nearest() -> None:
    rest = np.array([0.70, 0.71, 0.72, 1.3])
    beyond = np.array([10.0, 9.0, 8.0, 3.0])
    (found,) = families._small_families(rest, 0.01, beyond, 1)
    costs = {c: (np.minimum(beyond, np.maximum(np.abs(rest - c) / 0.01 - 1, 0)) ** 2).sum() for c in [*rest, found]}
    assert costs[found] == min(costs.values()) == pytest.approx(9.0)
    assert families._small_families(rest, 0.01, beyond, 2) == pytest.approx([0.71, 1.3], abs=0.0101)


def test_corners_stay_and_round_boundaries_of_few_members_slide() -> None:
    at = np.arange(25)
    begin = at[(at < 20) & (at % 5 < 4)]
    halves = [np.stack([begin, begin + 5, begin + 6], axis=1), np.stack([begin, begin + 6, begin + 1], axis=1)]
    square = make_grid(np.stack([at // 5, at % 5, 0 * at], axis=1).astype(float), np.concatenate(halves))
    (loop,) = square.boundary_loops
    free = Charts.of_grid(square).free
    assert set(np.flatnonzero(~free[:, 0])) == {0, 4, 20, 24}
    assert not free[loop, 1].any() and free[np.setdiff1d(at, loop)].all()
    angle = np.arange(9) * 2 * np.pi / 9
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    nodes = np.concatenate([ring, 2 * ring])
    k = np.arange(9)
    triangles = np.concatenate(
        [np.stack([k, k + 9, (k + 1) % 9 + 9], 1), np.stack([k, (k + 1) % 9 + 9, (k + 1) % 9], 1)]
    )
    charts = Charts.of_grid(make_grid(nodes, triangles))
    assert charts.free[:, 0].all() and not charts.free[:, 1].any()
    along = charts.moved(np.full((18, 2), 0.05) * charts.free)
    assert np.linalg.norm(along[:9], axis=1) == pytest.approx(np.ones(9), abs=1e-3)


def test_equal_members_stay_as_they_are() -> None:
    grid = dome(5)
    flat = grid.replace(nodes=grid.nodes * [1, 1, 0])
    found = st.few_lengths(flat, 0.01, 1)
    assert np.array_equal(found.grid.nodes, flat.nodes) and found.counts.tolist() == [len(flat.edges)]


@pytest.mark.parametrize(
    ("tolerance", "count", "said"), [(0.0, 3, "tolerance of families"), (0.01, 0, "must be 1 or more")]
)
def test_what_cannot_be_used_is_refused(tolerance: float, count: int, said: str) -> None:
    with pytest.raises(InputError, match=said):
        st.few_lengths(dome(4), tolerance, count)


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    st.write(uneven(), "grid.json")
    words = "families grid.json out.json --tolerance 1% --count 6 --report report.json"
    assert main(words.split()) == 0
    report = json.loads(Path("report.json").read_text())
    assert sum(each["members"] for each in report["families"]) == len(uneven().edges)
    first = Path("out.json").read_bytes()
    assert main([*words.split(), "--force"]) == 0 and Path("out.json").read_bytes() == first
    assert "--scan SCAN checks it again" in capsys.readouterr().out
    assert main("families none.json out2.json".split()) == 2 and main("families grid.json grid.json".split()) == 2
    assert main("families grid.json out2.json --tolerance x".split()) == 2 and not Path("out2.json").exists()


@compiled_only
def test_the_verdict_on_the_new_grid_is_said_at_the_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = sheet(12, 8, 0.2)
    points[:, 2] = 0.01 * points[:, 0] ** 2
    np.savetxt(tmp_path / "roof.xyz", points)
    grid, out = str(tmp_path / "grid.json"), str(tmp_path / "few.json")
    st.write(st.grid_from_scan(tmp_path / "roof.xyz", st.Settings(length=1.5, effort="quick")), grid)
    assert main(["families", grid, out, "--scan", str(tmp_path / "roof.xyz"), "--keep-failed"]) == 0
    *_, verdict, wrote = (line for line in capsys.readouterr().out.splitlines() if not line.startswith("warning"))
    assert verdict == f"certificate: {st.read_grid(out).certificate}" and wrote == f"wrote {out}"
