"""Limbs: what is three members round stays to its end; what is thinner is cut off at a clean ring, closed or open, and said."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typed import known

import scantruss as st
from scantruss.check.left_out import _beyond_cut
from scantruss.check.sheets import broken_limb, webbed_limb
from scantruss.cli.main import main
from scantruss.kernels.surface.girths import FACING_OPPOSITE, follow_girths, mark_opposite, measure_girths
from scantruss.surface.chosen_samples import KEPT, LIMB
from scantruss.surface.faced_surface import faced_surface
from scantruss.surface.limbs import SMALLEST_RING
from scantruss.surface.linked_samples import link_samples
from scantruss.surface.samples import SurfaceSamples, sample_surface

BODY, TIP = 3.0, 14.0  # radius of the body, where the limb ends [member]


def turned(radius: np.ndarray, x: np.ndarray, density: float, seed: int) -> np.ndarray:
    """Points on a surface of revolution around the x axis, of a profile (K,)."""
    rng = np.random.default_rng(seed)
    steps = np.hypot(np.diff(x), np.diff(radius)) * 0.5 * (radius[1:] + radius[:-1])
    total = np.concatenate([[0.0], np.cumsum(2 * np.pi * steps)])
    place = (np.arange(int(density * total[-1])) + rng.random(int(density * total[-1]))) / density
    at, turn = np.interp(place, total, x), rng.uniform(0, 2 * np.pi, len(place))
    out = np.interp(place, total, radius)
    return np.column_stack([at, out * np.cos(turn), out * np.sin(turn)])


def body(girth: float, tip: float, density: float = 30.0, seed: int = 0) -> np.ndarray:
    """A ball with a limb whose girth falls from one value to another and that ends in half a ball; the member is 1."""
    x = np.concatenate([BODY * np.cos(np.linspace(np.pi, 0, 400)), np.linspace(-2, TIP, 2000)])
    x = np.unique(x)
    radius = np.sqrt(np.maximum(BODY**2 - x**2, 0.0))
    limb = np.interp(x, [2.0, TIP], [girth, tip]) / (2 * np.pi)
    end = tip / (2 * np.pi)
    limb = np.where(x > TIP - end, np.sqrt(np.maximum(end**2 - (x - TIP + end) ** 2, 0.0)), limb)
    blend = np.maximum(0.6 - np.abs(radius - limb), 0) ** 2 / 2.4  # smooth maximum
    return turned(np.where(x > 0, np.maximum(radius, limb) + blend * (x < TIP - 1), radius), x, density, seed)


def girth_at(x: np.ndarray, girth: float, tip: float) -> np.ndarray:
    return np.asarray(np.interp(x, [2.0, TIP], [girth, tip]))


def samples_of(points: np.ndarray, **settings: float) -> SurfaceSamples:
    return sample_surface(st.PointCloud.from_array(points), st.Settings(**{"length": 1.0} | settings))  # type: ignore[arg-type]


@pytest.mark.parametrize(("tip", "is_cut"), [(4.0, False), (1.2, True)])
def test_samples_that_were_not_cut_are_those_without_cutting(tip: float, is_cut: bool) -> None:
    """They are not made again, and so not the lines of folds either."""
    cloud, settings = st.PointCloud.from_array(body(5.0, tip)), st.Settings(length=1.0)
    first, without = sample_surface(cloud, settings), sample_surface(cloud, settings.replace(limb_girth=0.0))
    anew = samples_of(body(5.0, tip), limb_girth=0.0)
    assert bool(first.rings) == is_cut and (without is first) != is_cut
    assert np.array_equal(without.surface.mean, anew.surface.mean) and np.array_equal(without.judged, anew.judged)


@pytest.mark.parametrize("seed", range(3))
def test_a_tapering_limb_is_cut_where_it_is_three_members_round(seed: int) -> None:
    points = body(5.0, 1.2, seed=seed)
    samples = samples_of(points)
    (ring,) = samples.rings
    x = ring.points + samples.origin
    assert np.ptp(x[:, 0]) < 0.3, "the ring lies across the limb"
    assert girth_at(x[:, 0], 5.0, 1.2).mean() == pytest.approx(3.0, abs=0.35)
    assert ring.girth == pytest.approx(2 * np.pi * np.hypot(x[:, 1], x[:, 2]).mean(), rel=0.02)
    cut, ahead = samples.judged == LIMB, points[:, 0] > x[:, 0].mean()
    assert not cut[points[:, 0] < x[:, 0].min() - 0.05].any() and (cut == ahead).mean() > 0.998


@pytest.mark.parametrize(("girth", "tip"), [(3.4, 3.4), (3.1, 3.1), (4.5, 3.2), (6.0, 4.0)])
def test_a_limb_of_three_members_round_is_kept_to_its_blunt_end(girth: float, tip: float) -> None:
    points = body(girth, tip)
    assert not samples_of(points).rings
    grid = st.grid_from_points(points, st.Settings(length=1.0, effort="quick"))
    certificate = known(grid.certificate)
    assert certificate.passed and certificate.missing < 0.002 and known(grid.settings).limb_girth == 3.0
    assert (grid.topology.components, grid.topology.boundary_loops, grid.topology.euler) == (1, 0, 2)
    assert grid.scan_nodes[:, 0].max() > TIP - 0.6


@pytest.mark.parametrize("length", [0.6, 0.88, 1.23])
def test_the_peak_of_a_tent_is_no_limb(length: float) -> None:
    """Its masts are as steep as 67 degrees, so that no three members go around it for the last one."""
    draw = np.random.default_rng(15)
    x, y, drawn = draw.uniform([-7.0, -4.0, 0.0], [7.0, 4.0, 2.6], (30_000, 3)).T
    rise = 5.2 * np.exp(-np.hypot(np.abs(x) - 3.5, y) / 2.2)
    even = drawn < np.sqrt(1.0 + (rise / 2.2) ** 2)
    points = np.column_stack([x, y, rise])[even]
    assert not samples_of(points, length=length).rings
    grid = st.grid_from_points(points, st.Settings(length=length))
    certificate = known(grid.certificate)
    assert certificate.passed and not [part for part in certificate.left_out if part.kind == "limbs"]
    for side in (-1.0, 1.0):
        near = np.hypot(grid.scan_nodes[:, 0] - 3.5 * side, grid.scan_nodes[:, 1]) < length
        assert grid.scan_nodes[near, 2].max() > points[side * points[:, 0] > 0.0, 2].max() - 0.35 * length


@pytest.mark.parametrize("cut_thin", ["close", "open"])
def test_a_limb_cut_off_is_closed_by_a_cap_or_left_open_and_told(cut_thin: str) -> None:
    points = body(4.5, 1.5)
    grid = st.grid_from_points(points, st.Settings(length=1.0, effort="quick", cut_thin=cut_thin, allow_missing=0.2))
    certificate, loops = known(grid.certificate), int(cut_thin == "open")
    assert certificate.passed and known(grid.settings).limb_girth == 3.0
    assert (grid.topology.components, grid.topology.boundary_loops, grid.topology.euler) == (1, loops, 2 - loops)
    (part,) = (part for part in certificate.left_out if part.kind == "limbs")
    end = grid.scan_nodes[:, 0].max()
    assert girth_at(end, 4.5, 1.5) == pytest.approx(3.0, abs=0.35)
    assert part.points == pytest.approx((points[:, 0] > end + 0.5).sum(), rel=0.05) and not part.asked
    assert known(part.size) == pytest.approx(TIP - end - 0.5, abs=0.4) and known(part.where)[0] > end
    assert certificate.missing == pytest.approx(part.share, abs=0.002)
    on_ring = np.flatnonzero(grid.scan_nodes[:, 0] > end - 0.15)
    assert len(on_ring) == 3, "a triangular tube ends in a triangle"


def test_the_cap_of_a_limb_is_no_hole_and_no_opening_that_is_closed() -> None:
    """It is said with the limb; of three nodes its triangle is too small to count, of a ring of more it is not."""
    points = body(5.5, 4.4)
    settings = st.Settings(length=1.0, effort="quick", limb_girth=4.8, allow_missing=0.3)
    certificate = known(st.grid_from_points(points, settings).certificate)
    assert "limbs" in {part.kind for part in certificate.left_out}
    assert not {"hole", "gap"} & {part.kind for part in certificate.left_out}
    assert "closed" not in {warning.kind for warning in certificate.warnings}


@pytest.mark.parametrize(("cut_thin", "loops"), [("close", 0), ("open", 1)])
def test_the_open_end_of_a_thin_leg_is_a_ring_and_no_hole(cut_thin: str, loops: int) -> None:
    """A front that ran over it as over a hole put a node far beyond it, where there is no scan."""
    far, points = 8.0, body(3.5, 3.5)
    leg = points[points[:, 0] < far]
    grid = st.grid_from_points(leg, st.Settings(length=1.0, effort="quick", cut_thin=cut_thin))
    assert len(grid.boundary_loops) == loops
    assert far - 0.2 < (grid.nodes + grid.origin)[:, 0].max() < far + 0.05


def test_a_cap_adds_no_member() -> None:
    """Of a ring of three nodes: open or closed, the members are the same."""
    points = body(4.5, 1.5)
    settings = st.Settings(length=1.0, effort="quick", allow_missing=0.2)
    closed, open_ = (st.grid_from_points(points, settings.replace(cut_thin=way)) for way in ("close", "open"))
    assert np.array_equal(closed.nodes, open_.nodes) and np.array_equal(closed.edges, open_.edges)
    assert len(closed.triangles) == len(open_.triangles) + 1


def test_more_left_out_than_allowed_fails_with_words(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.save(tmp_path / "a.npy", body(4.0, 0.9))
    words = ["grid", str(tmp_path / "a.npy"), str(tmp_path / "a.obj"), "--length", "1", "--effort", "quick"]
    assert main([*words, "--allow-missing", "0.01"]) != 0
    said = "".join(capsys.readouterr())
    assert "of the scan" in said and "--allow-missing" in said and not (tmp_path / "a.obj").exists()
    assert main([*words, "--allow-missing", "0.3"]) == 0
    assert "on a limb, handle or neck too thin" in "".join(capsys.readouterr())


def test_limb_girth_0_cuts_nothing_off() -> None:
    assert not samples_of(body(4.5, 1.5), limb_girth=0.0).rings


def handle(girth: float, middle: float = 4.0, bend: float = 2.5, density: float = 30.0, seed: int = 0) -> np.ndarray:
    """A ball with a handle: a part of a ring that stands in it, by its middle and its radius."""
    rng = np.random.default_rng(seed)
    ball = rng.normal(size=(int(density * 4 * np.pi * 16), 3))
    ball *= 4.0 / np.linalg.norm(ball, axis=1)[:, None]
    thick = girth / (2 * np.pi)
    around, turn = rng.uniform(0, 2 * np.pi, (2, int(density * 2 * np.pi * bend * girth)))
    out = bend + thick * np.cos(turn)
    ring = np.column_stack([middle + out * np.cos(around), out * np.sin(around), thick * np.sin(turn)])
    away = np.hypot(np.hypot(ball[:, 0] - middle, ball[:, 1]) - bend, ball[:, 2])
    return np.concatenate([ball[away > thick], ring[np.linalg.norm(ring, axis=1) > 4.0]])


def test_a_thin_handle_is_cut_off_at_both_ends() -> None:
    points = handle(2.3)
    samples = samples_of(points)
    assert len(samples.rings) == 2 and len(samples.pieces) == 1
    cut, off = samples.judged == LIMB, points[:, 0] > 4.5
    assert cut[off].all() and not cut[np.linalg.norm(points, axis=1) < 4.01].any()


@pytest.mark.parametrize(
    ("girth", "middle", "bend", "density", "seed"),
    [
        (1.5, 6.0, 2.8, 60.0, 1),  # so thin that the normals of the usual samples on it tell nothing
        (1.5, 2.5, 3.2, 30.0, 0),  # at so acute an angle with the body that fine samples turn it inside out
        (2.6, 3.0, 2.0, 30.0, 0),
    ],
)
def test_a_handle_is_cut_off_however_thin_and_at_whatever_angle(
    girth: float, middle: float, bend: float, density: float, seed: int
) -> None:
    points = handle(girth, middle, bend, density, seed)
    samples = samples_of(points)
    assert len(samples.rings) == 2 and len(samples.pieces) == 1
    cut, away = samples.judged == LIMB, np.linalg.norm(points, axis=1)
    assert cut[away > 5.3].all() and cut[away < 4.01].mean() < 0.005


@pytest.mark.parametrize(("girth", "middle", "bend"), [(1.0, 4.0, 2.0), (1.5, 4.0, 2.5), (2.0, 4.3, 2.5)])
def test_a_thin_handle_is_cut_off_at_the_body(girth: float, middle: float, bend: float) -> None:
    """It was cut where a neighbourhood of a member shows its axis, and the stubs that were left stood up as fins."""
    points = handle(girth, middle, bend, 60.0)
    samples = samples_of(points, allow_missing=0.2)
    assert len(samples.rings) == 2 and len(samples.pieces) == 1
    cut, away = samples.judged == LIMB, np.linalg.norm(points, axis=1)
    assert cut[away > 4.3].all() and cut[away < 4.001].mean() < 0.01
    assert all(ring.girth == pytest.approx(girth, rel=0.1) for ring in samples.rings)


def test_no_node_stands_up_where_a_handle_was_cut_off() -> None:
    points = handle(1.2, 4.0, 2.0, 60.0)
    grid = st.grid_from_points(points, st.Settings(length=1.0, effort="quick", allow_missing=0.2))
    assert np.linalg.norm(grid.scan_nodes, axis=1).max() < 4.15


def test_a_handle_is_cut_off_at_the_body_however_little_may_be_missing() -> None:
    """It was cut farther out where less may be missing, and passed with stubs that stood up as fins."""
    points = handle(1.5, density=60.0)
    share = (samples_of(points).judged == LIMB).mean()
    with pytest.raises(
        st.CertificateError, match=r"limbs too thin for the members.*--allow-missing 0\.\d+ accepts that"
    ):
        st.grid_from_points(points, st.Settings(length=1.0, effort="quick", allow_missing=float(share) - 0.01))


def test_a_hole_through_a_body_is_no_limb_that_is_turned() -> None:
    rng = np.random.default_rng(0)
    around, across = rng.uniform(0, 2 * np.pi, 4000), rng.uniform(-2.0, 2.0, 4000)
    hole = np.column_stack([0.3 * np.cos(around), 0.3 * np.sin(around), across])
    x, y, side = rng.uniform(-4.0, 4.0, 8000), rng.uniform(-4.0, 4.0, 8000), rng.choice([-2.0, 2.0], 8000)
    faces = np.column_stack([x, y, side])[np.hypot(x, y) > 0.3]
    x, z, wall = rng.uniform(-4.0, 4.0, 8000), rng.uniform(-2.0, 2.0, 8000), rng.choice([-4.0, 4.0], 8000)
    walls = np.concatenate([np.column_stack([x, wall, z])[::2], np.column_stack([wall, x, z])[::2]])
    assert not samples_of(np.concatenate([hole, faces, walls])).rings


def test_a_handle_is_broken_where_a_part_of_it_is_missed_between_two_that_are_followed() -> None:
    points, length = handle(2.3), 1.0
    samples = samples_of(points, limb_girth=0.0)
    limb = (points[:, 0] > 4.5) & (np.linalg.norm(points, axis=1) > 4.01)
    along = np.arctan2(points[:, 1], points[:, 0] - 4.0)  # along the handle, 0 at its middle

    def broken(missed: np.ndarray) -> Any:
        return broken_limb(samples, limb, np.where(limb & missed, 1.5 * length, 0.0), length)

    middle = known(broken(np.abs(along) < 0.6))
    assert np.linalg.norm(np.array(middle) - [6.5, 0.0, 0.0]) < 0.8
    assert broken(along > 0.3) is not None  # one side up to the body
    assert broken(np.abs(along) < 0.0) is None


def test_a_handle_is_followed_whole_or_not_at_all() -> None:
    """A cup passed with a stub of a member and a half of its handle, an amphora with webs of triangles."""
    points, thin = handle(2.3), handle(1.2)
    away = np.linalg.norm(points, axis=1) - 4.0

    def wrong(points: np.ndarray, missed: np.ndarray) -> Any:
        cut, samples = samples_of(points), samples_of(points, limb_girth=0.0)
        return webbed_limb(samples, cut, np.where(missed, 0.6, 0.0), 1.0, 0.5)

    along = np.arctan2(points[:, 1], points[:, 0] - 4.0)  # along the handle, 0 at its middle
    on_handle = (points[:, 0] > 0.0) & (away > 0.1)
    assert wrong(points, on_handle & (along > 0.3)) is not None
    assert wrong(points, on_handle) is None
    assert wrong(points, np.zeros(len(points), bool)) is None
    assert wrong(thin, np.zeros(len(thin), bool)) is not None  # no tube of three members goes around


def test_a_limb_that_ends_sooner_is_not_broken() -> None:
    points = body(4.5, 1.5)
    samples = samples_of(points, limb_girth=0.0)
    limb = points[:, 0] > 6.0
    assert broken_limb(samples, limb, np.where(points[:, 0] > 9.0, 2.0, 0.0), 1.0) is None
    assert broken_limb(samples, limb, np.where(np.abs(points[:, 0] - 9.0) < 1.0, 2.0, 0.0), 1.0) is not None


def test_a_handle_of_three_members_is_not() -> None:
    assert not samples_of(handle(3.3)).rings


def dumbbell(girth: float) -> np.ndarray:
    """Two balls of radius 2.5, 11 apart, joined by a neck of a girth; the member is 1."""
    x = np.linspace(-2.5, 13.5, 4000)
    radius = np.sqrt(np.maximum(2.5**2 - np.minimum(x**2, (x - 11.0) ** 2), 0.0))
    neck = np.where((x > 0.0) & (x < 11.0), girth / (2 * np.pi), 0.0)
    blend = np.maximum(0.6 - np.abs(radius - neck), 0) ** 2 / 2.4
    return turned(np.where(neck > 0.0, np.maximum(radius, neck) + blend, radius), x, 30.0, 0)


def test_a_neck_that_joins_two_bodies_stays_down_to_two_and_a_half_members() -> None:
    """A handle as thin goes: what it joins hangs together without it."""
    points = dumbbell(2.6)
    assert not samples_of(points).rings
    grid = st.grid_from_points(points, st.Settings(length=1.0, effort="quick"))
    assert known(grid.certificate).pieces == 1 and known(grid.settings).limb_girth == st.Settings(length=1.0).limb_girth
    assert len(samples_of(handle(2.6)).rings) == 2


def test_bodies_that_a_neck_too_thin_joins_are_pieces_with_a_warning_where_it_was_cut_off() -> None:
    grid = st.grid_from_points(dumbbell(1.9), st.Settings(length=1.0, effort="quick", allow_missing=0.1))
    found = known(grid.certificate)
    (warning,) = (each for each in found.warnings if each.kind == "apart")
    assert found.pieces == 2 and warning.words.startswith("is in 2 pieces")
    away = np.linalg.norm(dumbbell(1.9) - known(warning.where), axis=1)  # on the scan, where the neck was cut off
    assert away.min() < 1e-6 and 2.0 < min(abs(known(warning.where)[0] - x) for x in (0.0, 11.0)) < 4.0
    apart = np.concatenate([dumbbell(0.0)[:, [1, 0, 2]], body(1.9, 1.9) + [0.0, 20.0, 0.0]])  # a limb that joins none
    grid = st.grid_from_points(apart, st.Settings(length=1.0, effort="quick", allow_missing=0.1))
    assert known(grid.certificate).pieces == 3
    assert "apart" not in {each.kind for each in known(grid.certificate).warnings}


def test_sheets_strips_and_holes_are_no_limbs() -> None:
    """Nor is a scan that is thin everywhere, as there would be nothing left."""
    rng = np.random.default_rng(1)
    x, y = rng.uniform(0, 12, 8000), rng.uniform(0, 1.2, 8000)
    assert not samples_of(np.column_stack([x, y, 0.05 * x * x])).rings
    wall = np.column_stack([rng.uniform(0, 9, (2, 9000)).T, rng.choice([0.0, 0.4], 9000)])
    assert not samples_of(wall).rings
    assert not samples_of(turned(np.full(2, 0.4), np.array([0.0, 20.0]), 40, 0)).rings


@pytest.mark.kernels
def test_girths_of_a_cone_are_those_of_its_circles() -> None:
    radius, axis_x = np.array([0.55, 0.35]), np.array([0.0, 4.0])
    points = turned(radius, axis_x, 120.0, 3)
    cloud = st.PointCloud.from_array(points)
    found = link_samples(cloud.points, 0.1, 1.0, cloud.spacing)
    surface, _, _ = faced_surface(found, 0.1, 1.0, cloud.spacing)
    count = len(surface.mean)
    girth, axis = np.empty(count), np.zeros((count, 3))
    measure_girths(surface, np.arange(count), 4.0, 0.15, girth, axis, 0, count)
    x = surface.mean[:, 0] + cloud.origin[0]
    inner = (x > 0.5) & (x < 3.5)
    assert np.isfinite(girth[inner]).mean() > 0.98
    seen = inner & np.isfinite(girth)
    true = 2 * np.pi * np.interp(x[seen], axis_x, radius)
    assert np.abs(girth[seen] / true - 1.0).max() < 0.12 and np.median(np.abs(axis[seen, 0])) > 0.99
    hole, some = np.full(count, np.nan), np.flatnonzero(seen)[::7]
    inside = surface._replace(normals=-surface.normals)
    measure_girths(inside, some, 4.0, 0.15, hole, axis, 0, len(some))
    assert np.array_equal(hole[some], -girth[some]) and np.isnan(np.delete(hole, some)).all()


@pytest.mark.kernels
def test_the_axis_of_a_cone_is_found_from_one_that_is_about_right() -> None:
    radius, axis_x = np.array([0.45, 0.25]), np.array([0.0, 4.0])
    points = turned(radius, axis_x, 120.0, 3)
    cloud = st.PointCloud.from_array(points)
    surface, _, _ = faced_surface(link_samples(cloud.points, 0.1, 1.0, cloud.spacing), 0.1, 1.0, cloud.spacing)
    count = len(surface.mean)
    girth, axis = np.full(count, np.nan), np.tile([np.cos(0.5), np.sin(0.5), 0.0], (count, 1))
    x = surface.mean[:, 0] + cloud.origin[0]
    some = np.flatnonzero((x > 0.5) & (x < 3.5))
    follow_girths(surface, some, np.full(len(some), 3.5), 0.15, girth, axis)
    true = 2 * np.pi * np.interp(x[some], axis_x, radius)
    seen = np.isfinite(girth[some])
    assert seen.mean() > 0.95 and np.abs(girth[some][seen] / true[seen] - 1.0).max() < 0.12
    assert np.median(np.abs(axis[some, 0])) > 0.99 and np.isnan(np.delete(girth, some)).all()
    follow_girths(surface, some, 0.5 * true, 0.15, girth, axis)
    assert np.isinf(girth[some]).all(), "larger than a limb may be there"


@pytest.mark.kernels
def test_opposite_samples_are_those_of_plain_distances() -> None:
    points = handle(2.3)[::40]
    cloud = st.PointCloud.from_array(points)
    found = link_samples(cloud.points, 0.5, 1.0, cloud.spacing)
    surface, _, _ = faced_surface(found, 0.5, 1.0, cloud.spacing)
    marks = np.zeros(len(surface.mean), np.bool_)
    mark_opposite(surface, found.boxes, 1.3, marks, 0, len(marks))
    near = np.linalg.norm(surface.mean[:, None] - surface.mean, axis=2) <= 1.3
    assert np.array_equal(marks, (near & (surface.normals @ surface.normals.T < FACING_OPPOSITE)).any(axis=1))


def test_a_wire_on_a_ball_leaves_no_boundary() -> None:
    points = body(1.2, 1.2)
    samples = samples_of(points)
    (ring,) = samples.rings
    assert not ring.bounds and ring.girth < SMALLEST_RING


def test_small_pieces_that_hung_on_a_limb_count_as_that_limb() -> None:
    """A hoof beyond a fetlock that was cut off, one that lies elsewhere, and a point of a piece that has a grid."""
    line = np.arange(0.0, 2.0, 0.1)
    limb, hoof, crumb = (np.column_stack([x + line, 0.0 * line, 0.0 * line]) for x in (0.0, 2.0, 9.0))
    judged = np.repeat([LIMB, KEPT, KEPT], len(line)).astype(np.uint8)
    samples: Any = SimpleNamespace(judged=judged, scan=np.concatenate([limb, hoof, crumb]))
    which = np.arange(len(line), 3 * len(line))
    piece = np.repeat([4, 7], len(line))
    members = np.ones(len(judged))
    assert (_beyond_cut(samples, which, piece, members) == (piece == 4)).all()
    assert not _beyond_cut(samples, which, np.full(len(which), -1), members).any()
    samples.judged = np.full(len(judged), KEPT, np.uint8)
    assert not _beyond_cut(samples, which, piece, members).any()
