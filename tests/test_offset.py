"""The edge of the surface lies a little beyond the outermost points; how far, tells how unevenly these lie."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist
from shapes import make
from small_clouds import sheet
from steps import steps_of

import scantruss as st
from scantruss.boundary import find
from scantruss.boundary import offset as module
from scantruss.boundary.corners import CURVE_STEP, find_corners
from scantruss.boundary.curves import heights_along, outward, resample, room_across, runs_around
from scantruss.boundary.density import density_along
from scantruss.boundary.offset import NO_BIAS, SamplingBias
from scantruss.cli.main import main
from scantruss.kernels.surface.local_surface import Surface
from scantruss.surface.samples import sample_surface

RADIUS = 8.0


def disc(density: float, seed: int = 0) -> np.ndarray:
    """Points at random on a flat disc, so many for an area."""
    rng = np.random.default_rng(seed)
    count = rng.poisson(density * np.pi * RADIUS**2)
    r, turn = RADIUS * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), 0 * r])


def boundary_of(points: np.ndarray, length: float = 1.0, **settings: Any) -> tuple[st.Boundary, np.ndarray]:
    cloud = st.PointCloud.from_array(points)
    return steps_of(cloud, st.Settings(length=length, **settings)).boundary, cloud.origin


def short_of(places: np.ndarray, origin: np.ndarray, radius: float = RADIUS) -> np.ndarray:
    """How far places end before the edge of the disc."""
    return radius - np.linalg.norm((places + origin)[:, :2], axis=1)


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What `sampling_bias_of` is asked, and how far beyond it answers."""
    asked, full = [], module.sampling_bias_of

    def spy(surface: Surface, points: np.ndarray, *rest: Any) -> Any:
        found = full(surface, points, *rest)
        asked.append((points, found.beyond))
        return found

    monkeypatch.setattr(find, "sampling_bias_of", spy)
    return asked


@pytest.mark.parametrize("density", [15, 40, 120, 500, 2000])
@pytest.mark.parametrize("scale", [1.0, 30.0])
def test_points_by_chance_end_before_the_edge_as_far_as_said(density: int, scale: float, seen: list[Any]) -> None:
    _, origin = boundary_of(scale * disc(density), scale)
    ((touched, beyond),) = seen
    truth = short_of(resample(touched, CURVE_STEP * scale), origin, scale * RADIUS).mean()
    assert beyond == pytest.approx(truth, rel=0.25)


@pytest.mark.parametrize("density", [40, 120, 500])
@pytest.mark.parametrize("seed", range(3))
def test_the_curve_is_nearer_to_the_edge_but_hardly_beyond(
    density: int, seed: int, seen: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    points = disc(density, seed)
    now, origin = boundary_of(points)
    beyond = seen[0][1]
    monkeypatch.setattr(find, "sampling_bias_of", lambda *_: NO_BIAS)
    before, _ = boundary_of(points)
    short, far = (short_of(one.loops[0].points, origin) for one in (now, before))
    assert abs(short).mean() <= 0.7 * abs(far).mean() and abs(short).max() < abs(far).max()
    assert np.maximum(-short, 0.0).mean() <= 0.1 * beyond
    assert short.std() <= 0.75 * far.std()


def lattice() -> np.ndarray:
    x, y = np.meshgrid(np.arange(0, 10.05, 0.1), np.arange(0, 8.05, 0.1))
    return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])


@pytest.mark.parametrize("name", ["lattice", "valve_vertices", "mask"])
def test_points_on_the_edge_itself_are_its_end(name: str, seen: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    points, length = lattice(), 1.0
    if name != "lattice":
        points, length = make(name).points, make(name).length
    found, _ = boundary_of(points, length)
    assert seen and all(beyond == 0.0 for _, beyond in seen)
    monkeypatch.setattr(find, "sampling_bias_of", lambda *_: NO_BIAS)
    same, _ = boundary_of(points, length)
    assert [loop.points.tobytes() for loop in found.loops] == [loop.points.tobytes() for loop in same.loops]


def test_the_paper_ends_at_the_boundary_points(seen: list[Any]) -> None:
    boundary_of(disc(100), method="paper")
    assert not seen


def circle(count: int, radius: float = 5.0, wave: float = 0.0, waves: int = 0) -> np.ndarray:
    turn = np.arange(count) * 2 * np.pi / count
    r = radius + wave * np.cos(waves * turn)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), 0 * turn])


@pytest.fixture(scope="module")
def plane() -> Surface:
    """The surface of a plate whose normals look up."""
    surface = sample_surface(st.PointCloud.from_array(sheet(14, 14, 0.1)), st.Settings(length=1.0)).surface
    return surface._replace(normals=np.tile([0.0, 0.0, 1.0], (len(surface.normals), 1)))


def test_heights_are_those_over_the_line_through_the_neighbours(plane: Surface) -> None:
    """On a regular polygon the sagitta of two sides; of a point pushed out by a little so much more."""
    turns = circle(60)
    assert heights_along(plane, turns) == pytest.approx(np.full(60, 5.0 * (1 - np.cos(2 * np.pi / 60))))
    assert heights_along(plane, turns[::-1].copy()) == pytest.approx(-heights_along(plane, turns))  # a hole
    turns[7] *= 1.01
    assert heights_along(plane, turns)[7] == pytest.approx(5.05 - 5.0 * np.cos(2 * np.pi / 60))


def test_outwards_is_away_from_the_surface(plane: Surface) -> None:
    """Of an outer boundary away from its middle, of the boundary of a hole towards it."""
    assert outward(plane, circle(200)) == pytest.approx(circle(200, 1.0))
    assert outward(plane, circle(200)[::-1].copy()) == pytest.approx(-circle(200, 1.0)[::-1])


@pytest.mark.parametrize("seed", range(5))
def test_the_room_across_is_that_of_a_look_at_all_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    r = 2.0 + sum(rng.normal(0, 0.25) * np.cos(k * turn + rng.random()) for k in range(2, 9))
    curve = resample(np.column_stack([r * np.cos(turn), r * np.sin(turn), 0.1 * np.cos(3 * turn)]), 0.05)
    reach, count = 0.8, len(curve)
    away = np.linalg.norm(curve[:, None] - curve, axis=2)
    steps = abs(np.arange(count)[:, None] - np.arange(count))
    away[np.minimum(steps, count - steps) <= round(3 * reach / 0.05)] = np.inf
    assert room_across(curve, reach, 0.05) == pytest.approx(np.minimum(away.min(axis=1), reach))


def test_a_step_that_leads_nowhere_has_endless_room_without_a_warning() -> None:
    """Also where the unit is so small that the room is a large number."""
    steps = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    out = np.array([[1.0, 0.0, 0.0]] * 3)
    with np.errstate(all="raise"):
        share = module.explained(steps, out, np.full(3, 1e12), np.full(3, 0.1), np.full(3, 2.0))
    assert share == pytest.approx([1.0, 1.0, 1.0])


def test_runs_go_on_around_the_end_of_a_curve() -> None:
    def told(text: str) -> list[int]:
        return runs_around(np.array([c == "x" for c in text])).tolist()

    assert told("xxx..x.") == [0, 0, 0, 1, 1, 2, 3]
    assert told("x..xx..xx") == [0, 1, 1, 2, 2, 3, 3, 0, 0]
    assert told("....") == [0, 0, 0, 0]


def bent(curve: np.ndarray, bias: SamplingBias, plane: Surface, **settings: Any) -> np.ndarray:
    """The curve of the edge without corners."""
    return module.offset_curve(curve, bias, st.Settings(length=1.0, corner_angle=170.0, **settings), plane)[0]


@pytest.mark.parametrize("density", [11.5, 115.0])
@pytest.mark.parametrize("wave, waves", [(0.3, 16), (0.1, 25), (0.02, 32)])
def test_more_smoothing_cuts_off_no_more_than_chance_did(
    wave: float, waves: int, density: float, plane: Surface, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tongues hardly longer, and only bays in which few points would lie: of real ones most stays."""
    curve = resample(circle(4000, wave=wave, waves=waves), CURVE_STEP)
    rng = SamplingBias(module.MEAN_BEYOND * density ** (-2 / 3) * 0.2 ** (-1 / 3), density)
    more = bent(curve, rng, plane)
    monkeypatch.setattr(module, "WIDER_WINDOWS", (module.SMOOTHING_WINDOW,))
    usual = bent(curve, rng, plane)
    moved = np.linalg.norm(more, axis=1) - np.linalg.norm(usual, axis=1)
    assert -1.3 * module.WINDOW_SHIFT * rng.beyond <= moved.min()
    bay = np.maximum(moved, 0.0).sum() * CURVE_STEP * density / waves
    assert bay <= 1.5 * module.POINTS_OF_CLOSED_BAY
    if wave == 0.3 and density > 100:  # some twenty points would lie in each bay
        assert np.ptp(np.linalg.norm(more, axis=1)) > 0.85 * np.ptp(np.linalg.norm(usual, axis=1))


def test_what_chance_explains_is_smoothed_more(plane: Surface, monkeypatch: pytest.MonkeyPatch) -> None:
    curve = resample(circle(4000), CURVE_STEP)
    curve *= 1.0 + 0.002 * np.random.default_rng(0).normal(size=(len(curve), 1))
    more = bent(curve, SamplingBias(0.02, 115.0), plane)
    monkeypatch.setattr(module, "WIDER_WINDOWS", (module.SMOOTHING_WINDOW,))
    usual = bent(curve, SamplingBias(0.02, 115.0), plane)
    assert np.linalg.norm(more, axis=1).std() < 0.6 * np.linalg.norm(usual, axis=1).std()


def test_a_slit_stays_open(plane: Surface) -> None:
    """The sides of a narrow hole do not come to lie over each other, however far the surface may go on."""
    x = np.linspace(-3.0, 3.0, 121)
    low, high = np.column_stack([x, 0 * x - 0.1, 0 * x]), np.column_stack([x[::-1], 0 * x + 0.1, 0 * x])
    curve = resample(np.concatenate([low, high])[::-1], CURVE_STEP)  # a hole: clockwise
    x, y, _ = bent(curve, SamplingBias(0.3, 5.0), plane).T
    assert 0.5 * (np.roll(x, -1) * y - x * np.roll(y, -1)).sum() > 0.4  # clockwise still: it was 1.2
    assert abs(y[abs(x) < 2.0]).min() > 0.02


def notched(depth: float, width: float = 0.6) -> np.ndarray:
    """An outer boundary with a triangular notch in a straight side."""
    half = width / 2
    turns = [(-5, -4), (-half, -4), (0, depth - 4), (half, -4), (5, -4), (5, 4), (-5, 4)]
    return resample(np.array([(x, y, 0.0) for x, y in turns]), CURVE_STEP)


@pytest.mark.parametrize("density, kept", [(10.0, False), (400.0, True)])
def test_a_notch_is_a_corner_where_points_would_lie_in_it(density: float, kept: bool, plane: Surface) -> None:
    """With 1.8 points to its area it is there by accident, with 72 not."""
    curve, settings = notched(0.6), st.Settings(length=1.0)
    at, _ = find_corners(curve, settings)
    corners = module.offset_curve(curve, SamplingBias(0.03, density), settings, plane)[1]
    assert len(at) > 4 and (len(corners) == 4 if not kept else len(corners) == len(at))


def test_no_two_corners_are_so_near_that_the_member_between_them_is_too_short() -> None:
    """The certificate asks for half the desired length, and nodes are put on the scan after that: of such corners one counts."""
    nearest = []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        turn, far = np.sort(rng.uniform(0.0, 2.0 * np.pi, 25)), rng.uniform(3.0, 5.0, 25)
        outline = np.column_stack([far * np.cos(turn), far * np.sin(turn), rng.uniform(-1.0, 1.0, 25)])
        _, places = find_corners(resample(outline, CURVE_STEP), st.Settings(length=1.0))
        nearest.append(pdist(places).min() if len(places) > 1 else np.inf)
    assert min(nearest) > 0.6


def test_a_bay_is_as_large_as_it_is(plane: Surface) -> None:
    """The triangle of a notch; none at a corner that points outwards."""
    curve = notched(1.0, 1.6)
    out = outward(plane, curve)
    tip = int(np.linalg.norm(curve - [0.0, -3.0, 0.0], axis=1).argmin())
    corner = int(np.linalg.norm(curve - [5.0, -4.0, 0.0], axis=1).argmin())
    area = module.bays_at(curve, np.array([tip, corner]), out)
    assert area[0] == pytest.approx(0.8, rel=0.05) and area[1] == np.inf


def test_a_sparse_scan_of_a_round_shell_has_hardly_a_corner() -> None:
    """Ten points for a node: what turns there, turns at random. Ten boundaries of fifty members had thirty."""
    corners = [len(loop.corners) for seed in range(10) for loop in boundary_of(disc(11.5, seed))[0].loops]
    assert sum(corners) <= 12


@pytest.mark.parametrize("seed", range(4))
def test_where_random_points_leave_the_corners_in_doubt_it_is_said_with_a_length_that_shows_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], seed: int
) -> None:
    """A square of 3,000 points: by members of three spacings it has three to seven corners; there is no doubt with many points."""
    for count, doubt in ((3000, True), (60_000, False)):
        np.save(
            tmp_path / "a.npy", np.pad(np.random.default_rng(seed).uniform(0.0, 10.0, (count, 2)), ((0, 0), (0, 1)))
        )
        assert main(["info", str(tmp_path / "a.npy"), "--length", "0.62", "--unit", "m"]) == 0
        found = re.search(r"corners may be missed or false; longer members, from (\S+) m,", capsys.readouterr().err)
        assert (found is not None) == doubt
        if found is not None:
            assert 1.1 * 0.62 <= float(found[1]) < 1.3  # hardly longer ones are not worth a word
            assert main(["info", str(tmp_path / "a.npy"), "--length", "1.3", "--unit", "m"]) == 0
            assert "may be none" not in capsys.readouterr().err


def test_where_a_boundary_is_sparse_is_said_though_most_of_it_is_dense() -> None:
    """A plate of 18 by 6 members, a fifth of it with 4 points to a member square: elsewhere there are 100."""
    rng = np.random.default_rng(7)
    dense, sparse = rng.uniform((0.0, 0.0), (14.4, 6.0), (8640, 2)), rng.uniform((14.4, 0.0), (18.0, 6.0), (86, 2))
    boundary, origin = boundary_of(np.pad(np.concatenate([dense, sparse]), ((0, 0), (0, 1))))
    (loop,) = boundary.loops
    assert loop.beyond > 2.0 * module.CORNERS_SHOW_TO
    assert (loop.points + origin)[loop.sparse_at, 0] > 14.0


@pytest.mark.parametrize("radius", [0.5, 0.55, 0.6])
@pytest.mark.parametrize("waves", [2, 3])
def test_a_small_round_opening_has_no_corners(radius: float, waves: int) -> None:
    """It turns by 90 degrees within sight everywhere: two corners made a leaf of it, 0.27 members off. A square one has four."""
    turns = resample(circle(400, radius, 0.02, waves), CURVE_STEP)
    assert len(find_corners(turns, st.Settings(length=1.0))[0]) == 0
    square = resample(np.array([(-0.8, -0.8, 0), (0.8, -0.8, 0), (0.8, 0.8, 0), (-0.8, 0.8, 0)], float), CURVE_STEP)
    assert len(find_corners(square, st.Settings(length=1.0))[0]) == 4


def scanned_from(corner: tuple[float, float], count: int, seed: int) -> np.ndarray:
    """Points of a plate in the shape of an L, as many to an area as a scanner 3 m over a corner measures: fewer far away."""
    rng = np.random.default_rng(seed)
    points = rng.uniform((-10.0, -7.0), (10.0, 7.0), (20 * count, 2))
    away = np.hypot(np.hypot(*(points - corner).T), 3.0)
    is_there = ((points[:, 0] < 2.0) | (points[:, 1] < 1.0)) & (rng.random(len(points)) < (3.0 / away) ** 1.5)
    return np.pad(points[is_there][:count], ((0, 0), (0, 1)))


@pytest.mark.parametrize("seed", range(3))
def test_far_from_the_scanner_the_boundary_is_found_as_among_points_of_that_density(seed: int) -> None:
    """Where there are ten times fewer points than near the scanner a narrow disc fell between them, up to a member deep."""
    turns = np.array([(-10, -7), (10, -7), (10, 1), (2, 1), (2, 7), (-10, 7)], float)
    loops, origin = boundary_of(scanned_from((-9.0, -5.0), 16_000, seed))
    (loop,) = loops.loops
    truth = resample(np.pad(turns, ((0, 0), (0, 1))), 0.01)
    away = cKDTree(truth).query(loop.points + origin)[0]
    assert np.sqrt(np.mean(away**2)) < 0.08 and away.max() < 0.4
    assert cKDTree(loop.points + origin).query(np.pad(turns, ((0, 0), (0, 1))))[0].max() < 0.4


@pytest.mark.kernels
def test_points_beside_a_place_are_those_on_its_inner_side() -> None:
    """On a plate with a point at each hundredth, as many as there are in half a disc; as the search of all points finds them."""
    cloud = st.PointCloud.from_array(sheet(6, 6, 0.1))
    surface = sample_surface(cloud, st.Settings(length=1.0)).surface
    curve = circle(40, 2.0)
    density = density_along(surface, curve, 0.7)
    away = curve[:, None] - surface.points
    inside = (np.linalg.norm(away, axis=2) < 0.7) & (np.einsum("mpc,mc->mp", away, outward(surface, curve)) > 0.0)
    mean = inside.sum(axis=1).mean() / (0.5 * np.pi * 0.7**2)
    assert density.mean() == pytest.approx(mean) and density == pytest.approx(np.full(40, 100.0), rel=0.1)
