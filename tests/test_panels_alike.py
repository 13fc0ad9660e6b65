"""Few panels: misfits against a slow twin, slopes against differences, fewer kinds, surface and places kept, and the command."""

import json
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from small_grids import dome, uneven
from test_joints_alike import three_parts
from test_layouts_of_quads import grid_of, honeycomb, vault

import scantruss as st
from scantruss.cli.families import _of_kinds, families_parser
from scantruss.cli.main import main
from scantruss.errors import InputError
from scantruss.export.json import encode_json
from scantruss.improve.images import Images
from scantruss.layouts.joints_alike import stars_of
from scantruss.layouts.panels_alike import corners_of
from scantruss.layouts.part_vectors import PartVectors
from scantruss.layouts.trade import traded_kinds


def laid(one: np.ndarray, other: np.ndarray) -> float:
    """The least root mean square between corners of two panels about their middles, turned in space, for all shifts."""
    best = np.inf
    for k in range(len(one)):
        turned = np.roll(one, -k, axis=0)
        u, _, v = np.linalg.svd(turned.T @ other)
        turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v
        best = min(best, float(np.sqrt(((turned @ turn - other) ** 2).sum(axis=1).mean())))
    return best


def corners(grid: st.Grid, panel: int) -> np.ndarray:
    """Corners of a panel about their middle, over the mean member."""
    places = grid.nodes[grid.panel_loops[panel]]
    return (places - places.mean(axis=0)) / grid.lengths.mean()


@pytest.mark.kernels
@pytest.mark.parametrize("mirrored", [False, True])
def test_misfits_are_those_of_one_panel_laid_on_the_other(mirrored: bool) -> None:
    flat = uneven(5)
    for grid in (flat.replace(nodes=flat.nodes * [1, 1, 0]), vault(3, uneven=0.2)):
        parts = corners_of(grid)
        some = np.arange(6)
        misfit, _ = parts.misfits(parts.vectors(grid.nodes), some, mirrored=mirrored)
        for one, other in product(range(6), range(6)):
            mine, theirs = corners(grid, one), corners(grid, other)
            ways = [mine] + [mine[::-1] * [1, 1, -1]] * mirrored
            least = min(laid(each, theirs) for each in ways)
            assert misfit[one, other] == pytest.approx(least, abs=1e-6 if grid.panels is None else 3e-3)


@pytest.mark.parametrize("make", [corners_of, stars_of])
def test_misfits_in_blocks_are_those_at_once(
    make: Callable[[st.Grid], PartVectors], monkeypatch: pytest.MonkeyPatch
) -> None:
    grid = uneven(5)
    parts = make(grid)
    vectors, every = parts.vectors(grid.nodes), np.arange(len(parts.count))
    at_once = parts.misfits(vectors, every, mirrored=True)
    monkeypatch.setattr("scantruss.layouts.part_vectors.PAIRS_AT_ONCE", 3 * len(every))
    heard: list[None] = []
    in_blocks = parts.misfits(vectors, every, mirrored=True, heard=lambda: heard.append(None))
    assert len(heard) == -(-len(every) // 3)
    assert all(np.array_equal(*pair) for pair in zip(at_once, in_blocks, strict=True))


@pytest.mark.parametrize("call", [2, 20])
def test_a_trade_of_kinds_ends_where_its_progress_raises(call: int) -> None:
    grid, heard = uneven(5), list[float]()
    found = st.few_panels(grid, 0.02)

    def stop(_: str, share: float) -> None:
        heard.append(share)
        if len(heard) == call:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        traded_kinds(grid, found, progress=stop)
    assert len(heard) == call and heard == sorted(heard) and heard[-1] < 1.0


@pytest.mark.parametrize("make", [corners_of, stars_of])
def test_slopes_are_differences(make: Callable[[st.Grid], PartVectors]) -> None:
    grid = vault(3, uneven=0.2)
    parts = make(grid)
    ways = np.random.default_rng(2).standard_normal((len(grid.nodes), 2, 3))
    move = np.random.default_rng(3).standard_normal((len(grid.nodes), 2))
    small = 1e-6
    after, before = (parts.vectors(grid.nodes + sign * small * np.einsum("vkc,vk->vc", ways, move)) for sign in (1, -1))
    of = parts.nodes_of
    moves = np.where((of >= 0)[..., None], move[of], 0.0)
    change = np.einsum("nwcmk,nmk->nwc", parts.slopes(grid.nodes, ways), moves)
    assert change == pytest.approx((after - before) / (2 * small), abs=1e-6)


def mean_on_surface(grid: st.Grid) -> float:
    return float(np.abs(grid.nodes[:, 2] - (4.0 - 0.03 * ((grid.nodes[:, :2] - 8.0) ** 2).sum(axis=1))).max())


def test_panels_of_triangles_and_quads_come_to_fewer_kinds_on_their_surface() -> None:
    for grid, kinds in ((uneven(7), 2), (vault(8, uneven=0.12), 1)):  # the fewest that it finds
        grid = grid.replace(fixed=np.arange(len(grid.nodes)) == 24)
        mean = float(grid.lengths.mean())
        found = st.few_panels(grid, 0.02, kinds)
        made = found.grid
        assert len(found.representative) < 0.6 * found.before
        assert found.counts.sum() == len(grid.panel_table) == len(found.of)
        assert found.misfit.max() <= 0.02 and found.moved.max() <= 0.41 * mean
        for panel in range(0, len(found.of), 7):
            one = int(found.representative[found.of[panel]])
            assert laid(corners(made, panel), corners(made, one)) * made.lengths.mean() / mean <= 0.02 + 1e-9
        assert np.array_equal(made.nodes[24], grid.nodes[24]) and np.array_equal(made.panel_table, grid.panel_table)
        again = st.few_panels(grid, 0.02, kinds)
        assert np.array_equal(again.grid.nodes, made.nodes)
    assert mean_on_surface(made) < 0.05 * mean


def test_hexagons_that_are_alike_stay_as_they_are() -> None:
    found = st.few_panels(honeycomb())
    assert found.before == len(found.counts) == 1 and np.array_equal(found.grid.nodes, honeycomb().nodes)
    shaken = honeycomb().nodes + 0.04 * np.random.default_rng(1).standard_normal((len(honeycomb().nodes), 3)) * [
        1,
        1,
        0,
    ]
    few = st.few_panels(grid_of(shaken, honeycomb().panel_table), 0.01, 19)
    assert len(few.counts) <= 19 < 0.8 * few.before


def test_mirror_images_are_of_one_kind_where_it_is_asked_for() -> None:
    """A strip of scalene triangles, every other one a mirror image."""
    first = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.3, 0.8, 0]])
    away = np.array([3.0, 0, 0])
    nodes = np.concatenate([first, first * [-1, 1, 1] + away])
    grid = st.Grid(
        nodes=nodes,
        triangles=np.array([[0, 1, 2], [3, 5, 4]]),
        fixed=np.zeros(6, bool),
        unit="m",
        origin=np.zeros(3),
    )
    assert st.few_panels(grid, 0.001).before == 2
    same = st.few_panels(grid, 0.001, mirrored=True)
    assert same.before == 1 and same.mirrored.tolist() in ([False, True], [True, False])
    assert np.array_equal(same.grid.nodes, nodes)


def test_what_is_symmetric_stays_so_and_fewer_can_be_enough() -> None:
    grid = three_parts()
    found = st.few_panels(grid, 0.05)
    assert len(Images.of_grid(found.grid).matrices) == 3
    rough = uneven(6)
    few, enough = (st.few_panels(rough, 0.01, count) for count in (3, 25))  # 3 are the fewest that it finds
    assert len(few.counts) < len(enough.counts) <= 25 < few.before


def test_the_trade_begins_with_the_grid_as_it_was() -> None:
    grid = uneven(6)
    found = st.few_panels(grid, 0.02)
    trade = [each.to_dict() for each in traded_kinds(grid, found)]
    assert trade[0]["moved_max"] == 0 and trade[0]["kinds"] == found.before
    assert trade[0]["plain_misfit_max"] <= 0.02 + 1e-5
    plain = [each["plain_misfit_max"] for each in trade]
    assert plain == sorted(plain) and plain[-1] > 0.02
    assert all(each["misfit_max"] <= 0.02 for each in trade)


@pytest.mark.parametrize("far", [0.04, 0.06])
def test_nodes_far_off_the_scan_are_warned_of(far: float) -> None:
    grid = uneven(5)
    found = st.few_panels(grid, 0.05)
    values = families_parser().parse_args(["grid.json", "out.json", "--parts", "panels", "--tolerance", "5%"])
    _, words, _ = _of_kinds(grid, found, values, lambda _: far * float(grid.lengths.mean()))
    assert any("members off the scan" in line for line in words) == (far > 0.05)


@pytest.mark.parametrize(
    ("tolerance", "count", "said"), [(0.0, 1, "the tolerance of panels is"), (0.01, 0, "must be 1 or more")]
)
def test_what_cannot_be_used_is_refused(tolerance: float, count: int, said: str) -> None:
    with pytest.raises(InputError, match=said):
        st.few_panels(dome(4), tolerance, count)


def test_the_command_makes_few_panels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("vault.json").write_bytes(encode_json(vault(6, uneven=0.12)))
    words = "families vault.json out.json --parts panels --mirrored same --tolerance 2% --report report.json --plot plot.png"
    assert main([*words.split(), "--keep-failed"]) == 0
    report = json.loads(Path("report.json").read_text())
    assert sum(each["panels"] for each in report["kinds"]) == 36 and len(report["kinds"]) < report["kinds_before"]
    assert sum(each["mirrored"] for each in report["kinds"]) > 0 and {each["nodes"] for each in report["kinds"]} == {4}
    assert "kinds of panels before" in capsys.readouterr().out
    first = Path("out.json").read_bytes()
    assert main([*words.split(), "--keep-failed", "--force"]) == 0 and Path("out.json").read_bytes() == first
    for wrong in ("--parts lengths --mirrored same", "--parts panels --uneven 20%", "--parts joints --uneven 95%"):
        assert main(["families", "vault.json", "none.json", *wrong.split(), "--keep-failed"]) == 2
        assert not Path("none.json").exists()
