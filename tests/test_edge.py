"""The edge of the surface lies a little beyond the outermost points; how far, tells how unevenly these lie."""

import numpy as np
import pytest
from shapes import make
from small_clouds import sheet

import scantruss as st
from scantruss import boundary as module
from scantruss.corners import STEP
from scantruss.curves import heights_along, moved_out, resample
from scantruss.scan.sites import prepare_sites

RADIUS = 8.0


def disc(density, seed=0):
    """Points by chance on a flat disc, so many for an area."""
    rng = np.random.default_rng(seed)
    count = rng.poisson(density * np.pi * RADIUS**2)
    r, turn = RADIUS * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), 0 * r])


def boundary_of(points, length=1.0, **settings):
    cloud = st.PointCloud.from_array(points)
    return st.find_boundary(cloud, st.Settings(length=length, **settings)), cloud.origin


def short_of(places, origin, radius=RADIUS):
    """How far places end before the edge of the disc."""
    return radius - np.linalg.norm((places + origin)[:, :2], axis=1)


@pytest.fixture
def seen(monkeypatch):
    """What `surface_beyond` is asked and answers."""
    asked, full = [], module.surface_beyond

    def spy(surface, points, density, radius):
        asked.append((points, full(surface, points, density, radius)))
        return asked[-1][1]

    monkeypatch.setattr(module, "surface_beyond", spy)
    return asked


@pytest.mark.parametrize("density", [15, 40, 120, 500, 2000])
@pytest.mark.parametrize("scale", [1.0, 30.0])
def test_points_by_chance_end_before_the_edge_as_far_as_said(density, scale, seen):
    _, origin = boundary_of(scale * disc(density), scale)
    ((touched, beyond),) = seen
    truth = short_of(resample(touched, STEP * scale), origin, scale * RADIUS).mean()
    assert beyond == pytest.approx(truth, rel=0.25)


@pytest.mark.parametrize("density", [40, 120, 500])
@pytest.mark.parametrize("seed", range(3))
def test_the_curve_is_nearer_to_the_edge_but_hardly_beyond(density, seed, seen, monkeypatch):
    points = disc(density, seed)
    boundary, origin = boundary_of(points)
    beyond = seen[0][1]
    monkeypatch.setattr(module, "surface_beyond", lambda *_: 0.0)
    before, _ = boundary_of(points)
    short, far = (short_of(one.loops[0].points, origin) for one in (boundary, before))
    assert abs(short).mean() <= 0.7 * abs(far).mean() and abs(short).max() < abs(far).max()
    assert np.maximum(-short, 0.0).mean() <= 0.1 * beyond
    assert short.std() <= 0.9 * far.std()


def lattice():
    x, y = np.meshgrid(np.arange(0, 10.05, 0.1), np.arange(0, 8.05, 0.1))
    return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])


@pytest.mark.parametrize("name", ["lattice", "valve_vertices", "mask"])
def test_points_on_the_edge_itself_are_its_end(name, seen, monkeypatch):
    points, length = lattice(), 1.0
    if name != "lattice":
        points, length = make(name).points, make(name).length
    boundary, _ = boundary_of(points, length)
    assert seen and all(beyond == 0.0 for _, beyond in seen)
    monkeypatch.setattr(module, "surface_beyond", lambda *_: 0.0)
    same, _ = boundary_of(points, length)
    assert [loop.points.tobytes() for loop in boundary.loops] == [loop.points.tobytes() for loop in same.loops]


def test_the_paper_ends_at_the_boundary_points(seen):
    boundary_of(disc(100), method="paper")
    assert not seen


def circle(count, radius=5.0, wave=0.0, waves=0):
    turn = np.arange(count) * 2 * np.pi / count
    r = radius + wave * np.cos(waves * turn)
    return np.column_stack([r * np.cos(turn), r * np.sin(turn), 0 * turn])


@pytest.fixture(scope="module")
def plane():
    """The surface of a plate whose normals look up."""
    surface = prepare_sites(st.PointCloud.from_array(sheet(14, 14, 0.1)), st.Settings(length=1.0)).surface
    return surface._replace(normals=np.tile([0.0, 0.0, 1.0], (len(surface.normals), 1)))


def test_heights_are_those_over_the_line_through_the_neighbours(plane):
    """On a regular polygon the sagitta of two sides; of a point pushed out by a little so much more."""
    turns = circle(60)
    assert heights_along(plane, turns) == pytest.approx(np.full(60, 5.0 * (1 - np.cos(2 * np.pi / 60))))
    assert heights_along(plane, turns[::-1].copy()) == pytest.approx(-heights_along(plane, turns))  # a hole
    turns[7] *= 1.01
    assert heights_along(plane, turns)[7] == pytest.approx(5.05 - 5.0 * np.cos(2 * np.pi / 60))


def test_a_curve_moves_out_by_the_distance(plane):
    """An outer rim becomes larger, the rim of a hole smaller."""
    assert np.linalg.norm(moved_out(plane, circle(200), 0.3), axis=1) == pytest.approx(np.full(200, 5.3))
    assert np.linalg.norm(moved_out(plane, circle(200)[::-1].copy(), 0.3), axis=1) == pytest.approx(np.full(200, 4.7))


@pytest.mark.parametrize("beyond", [0.005, 0.02])
@pytest.mark.parametrize("wave, waves", [(0.3, 16), (0.1, 25), (0.02, 32)])
def test_more_smoothing_moves_a_curve_no_farther_than_chance_did(wave, waves, beyond, plane, monkeypatch):
    """Where that much would not be enough it moves nothing: real bays and tongues stay."""
    curve, settings = resample(circle(4000, wave=wave, waves=waves), STEP), st.Settings(length=1.0, corner_angle=120.0)
    more = module.smooth_loop(curve, 0, beyond, settings, plane).points
    monkeypatch.setattr(module, "WIDE", module.WINDOW)
    usual = module.smooth_loop(curve, 0, beyond, settings, plane).points
    assert 0.0 < np.linalg.norm(more - usual, axis=1).max() <= 1.0001 * module.MOVED * beyond
    monkeypatch.undo()
    monkeypatch.setattr(module, "MOVED", 1e-6)
    assert (module.smooth_loop(curve, 0, beyond, settings, plane).points == usual).mean() > 0.99


def test_what_chance_explains_is_smoothed_more(plane, monkeypatch):
    curve, settings = resample(circle(4000), STEP), st.Settings(length=1.0)
    curve *= 1.0 + 0.002 * np.random.default_rng(0).normal(size=(len(curve), 1))
    more = module.smooth_loop(curve, 0, 0.02, settings, plane).points
    monkeypatch.setattr(module, "WIDE", module.WINDOW)
    usual = module.smooth_loop(curve, 0, 0.02, settings, plane).points
    assert np.linalg.norm(more, axis=1).std() < 0.8 * np.linalg.norm(usual, axis=1).std()
