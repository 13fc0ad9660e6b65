"""The body that a scan encloses: thin limbs are taken off, slits filled, and all else stays as it is."""

from __future__ import annotations

import numpy as np
import pytest
from marks import compiled_only
from numpy.typing import NDArray
from scipy import ndimage

import scantruss as st
from scantruss.surface import body
from scantruss.surface.body import BODIES_KEPT, LIMB_RADIUS, SLIT_RADIUS, opened_body
from scantruss.surface.chosen_samples import KEPT, LIMB
from scantruss.surface.samples import sample_surface
from scantruss.surface.voxels import VoxelLattice, distance_from, euler_of_voxels

LENGTH, RADIUS, SPACING = 1.0, 4.0, 0.1
Points = NDArray[np.float64]


def ball(count: int = 20_000, seed: int = 0) -> Points:
    """Points on a ball about the origin."""
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    return np.asarray(RADIUS * directions / np.linalg.norm(directions, axis=1)[:, None])


def rod(radius: float, along: Points, seed: int = 1) -> Points:
    """Points on a tube of a radius around a curve (K, 3), and on the half ball at its end."""
    rng = np.random.default_rng(seed)
    steps = np.linalg.norm(np.diff(along, axis=0), axis=1)
    count = int(2 * np.pi * radius * steps.sum() / SPACING**2) + 12
    at = rng.integers(len(along) - 1, size=count)
    middle = along[at] + rng.random((count, 1)) * np.diff(along, axis=0)[at]
    out = rng.normal(size=(count, 3))
    ahead = np.diff(along, axis=0)[at] / steps[at, None]
    out -= (out * ahead).sum(axis=1, keepdims=True) * ahead
    tip = rng.normal(size=(60, 3))
    tip *= np.where(tip @ ahead[-1] < 0.0, -1.0, 1.0)[:, None]
    tube = middle + radius * out / np.linalg.norm(out, axis=1)[:, None]
    return np.concatenate([tube, along[-1] + radius * tip / np.linalg.norm(tip, axis=1)[:, None]])


def straight(far: float) -> Points:
    """A curve from inside the ball to a distance beyond it."""
    return np.linspace([RADIUS - 0.2, 0.0, 0.0], [RADIUS + far, 0.0, 0.0], 20)


def outside(points: Points) -> Points:
    """The points of a rod that do not lie in the ball."""
    return points[np.linalg.norm(points, axis=1) > RADIUS]


@pytest.mark.kernels
@pytest.mark.parametrize("reach", [0, 1, 3, 7])
@pytest.mark.parametrize("share", [0.0, 0.002, 0.05, 1.0])
def test_distances_between_voxels_are_exact_within_their_reach(reach: int, share: float) -> None:
    marked = np.random.default_rng(reach).random((37, 19, 23)) < share
    found = distance_from(marked, VoxelLattice(np.zeros(3), 0.5, marked.shape), 0.5 * reach)
    near = 0.5 * ndimage.distance_transform_edt(~marked) if marked.any() else np.full(marked.shape, np.inf)
    within = near <= 0.5 * reach
    assert (found[within] == near[within]).all() and (found[~within] > 0.5 * reach).all()


@pytest.mark.parametrize("radius", [0.2, 0.3, 0.35])
def test_a_thin_limb_is_taken_off_where_it_begins_and_nothing_else(radius: float) -> None:
    limb = outside(rod(radius, straight(3.0)))
    scan = np.concatenate([ball(), limb])
    opened = opened_body(scan, LENGTH, SPACING)
    assert opened is not None and not opened.slit.any()
    far = np.linalg.norm(scan, axis=1) - RADIUS
    assert opened.limb[far > 0.8].all()
    assert not opened.limb[np.linalg.norm(scan - [RADIUS, 0.0, 0.0], axis=1) > 4.0].any()
    assert not opened.limb[: len(ball())][np.linalg.norm(scan[: len(ball())] - [RADIUS, 0.0, 0.0], axis=1) > 0.8].any()
    assert len(opened.added) and (np.linalg.norm(opened.added - [RADIUS, 0.0, 0.0], axis=1) < 1.0).all()
    assert (np.abs(np.linalg.norm(opened.added, axis=1) - RADIUS) < 0.5).all()


def test_what_hung_on_a_limb_leaves_with_it() -> None:
    """A ball at the end of a thin rod has room for the ball of the opening, but would be left behind as an island."""
    limb, far = outside(rod(0.25, straight(3.0))), np.array([RADIUS + 3.5, 0.0, 0.0])
    end = far + 0.25 * ball(3_000, seed=4)
    scan = np.concatenate([ball(), limb[np.linalg.norm(limb - far, axis=1) > 1.0], end])
    opened = opened_body(scan, LENGTH, SPACING)
    assert opened is not None and opened.limb[np.linalg.norm(scan, axis=1) > RADIUS + 0.8].all()
    assert (np.linalg.norm(opened.added - [RADIUS, 0.0, 0.0], axis=1) < 1.0).all()


def test_limbs_are_taken_off_near_places_alone_where_there_are_any() -> None:
    limb = outside(rod(0.25, straight(3.0)))
    scan = np.concatenate([ball(), limb, limb * [-1.0, -1.0, 1.0]])
    ahead, behind = scan[:, 0] > RADIUS + 0.8, scan[:, 0] < -RADIUS - 0.8
    tip, other = (RADIUS + 3.0, 0.0, 0.0), (-RADIUS - 1.5, 0.0, 0.0)
    everywhere = opened_body(scan, LENGTH, SPACING)
    assert everywhere is not None and everywhere.limb[ahead | behind].all()
    for place, taken, kept in ((tip, ahead, behind), (other, behind, ahead)):
        opened = opened_body(scan, LENGTH, SPACING, None, (place,))
        assert opened is not None and opened.limb[taken].all() and not opened.limb[kept].any()
        assert (opened.limb <= everywhere.limb).all()
        assert (opened.added[:, 0] * place[0] > 0.0).all()
    both = opened_body(scan, LENGTH, SPACING, None, (tip, other))
    assert both is not None and (both.limb == everywhere.limb).all()
    assert {tuple(place) for place in both.added} <= {tuple(place) for place in everywhere.added}
    assert opened_body(scan, LENGTH, SPACING, None, ((0.0, 0.0, RADIUS),)) is None


@pytest.mark.parametrize("radius", [0.7, 1.0])
def test_a_limb_that_has_room_for_the_ball_stays(radius: float) -> None:
    assert radius > LIMB_RADIUS
    bare = ball()[np.linalg.norm(ball()[:, 1:], axis=1) + RADIUS * (ball()[:, 0] < 0.0) > radius]
    assert opened_body(np.concatenate([bare, outside(rod(radius, straight(3.0)))]), LENGTH, SPACING) is None


def test_a_ball_a_dome_and_a_sheet_stay_as_they_are() -> None:
    plan = 8.0 * np.random.default_rng(2).random((8_000, 2))
    half = ball()[ball()[:, 2] > 0.0]
    for scan in (ball(), half, np.column_stack([plan, 0.1 * plan[:, 0] ** 2])):
        assert opened_body(scan, LENGTH, SPACING) is None


def test_a_body_is_opened_once_for_the_same_points_and_length(monkeypatch: pytest.MonkeyPatch) -> None:
    """Looks at a scan by other settings ask for it again; of all that were opened the last are kept."""
    made: list[tuple[int, float]] = []
    monkeypatch.setattr(body, "_opened", lambda points, length, *_: made.append((len(points), length)))
    monkeypatch.setattr(body, "_OPENED", {})
    scan = ball(500)
    for points, length in ((scan, 1.0), (scan.copy(), 1.0), (scan[1:], 1.0), (scan, 2.0), (scan, 1.0)):
        opened_body(points, length, SPACING)
    assert made == [(500, 1.0), (499, 1.0), (500, 2.0)]
    for step in range(BODIES_KEPT):
        opened_body(scan, 3.0 + step, SPACING)
    opened_body(scan, 1.0, SPACING)
    assert made[-1] == (500, 1.0) and len(body._OPENED) == BODIES_KEPT


def test_an_open_body_is_closed_at_its_boundary_first() -> None:
    scan = np.concatenate([ball()[ball()[:, 2] > -3.2], outside(rod(0.25, straight(3.0)))])
    opened = opened_body(scan, LENGTH, SPACING)
    assert opened is not None
    assert opened.limb[np.linalg.norm(scan, axis=1) > RADIUS + 0.8].all()
    assert opened.limb[scan[:, 0] < 0.0].sum() == 0


@pytest.mark.parametrize("apart", [0.4, 0.55])
def test_a_sparse_part_of_the_scan_encloses_the_body_too(apart: float) -> None:
    """On the far side the points lie about half a member apart, as on the flat parts of a mesh."""
    scan = np.concatenate([ball(), outside(rod(0.3, straight(3.0)))])
    far, kept = np.flatnonzero(scan[:, 0] < -3.0), []
    left = scan[far]
    while len(left):
        kept.append(left[0])
        left = left[np.linalg.norm(left - left[0], axis=1) > apart]
    opened = opened_body(np.concatenate([np.delete(scan, far, axis=0), kept]), LENGTH, SPACING)
    assert opened is not None and opened.limb.any()


@pytest.mark.parametrize("seed", range(3))
def test_random_points_with_empty_places_between_them_enclose_the_body_too(seed: int) -> None:
    """Points at random, 3.3 to a member on average: somewhere on the ball a place without any is wider than the walls between them."""
    points, length = ball(7500, seed), 0.55
    limb = outside(rod(0.3 * length, straight(2.0)))
    scan = np.concatenate([points, limb])
    opened = opened_body(scan, length, 0.08)
    assert opened is not None
    far = np.linalg.norm(scan, axis=1) - RADIUS
    assert opened.limb[far > 0.8 * length].all()
    assert not opened.limb[np.linalg.norm(scan - [RADIUS, 0.0, 0.0], axis=1) > 2.0 + length].any()


def test_a_slit_is_filled() -> None:
    """Two boxes side by side on a common base, less than a ball of the slit apart."""
    assert 2 * SLIT_RADIUS > 0.4
    rng = np.random.default_rng(3)

    def inside(p: Points) -> NDArray[np.bool_]:
        slit = (np.abs(p[:, 0]) < 0.2) & (p[:, 2] > 0.0)
        return np.asarray((np.abs(p) < [4.0, 3.0, 3.0]).all(axis=1) & ~slit)

    faces = []
    for axis, places in ((0, (-4.0, -0.2, 0.2, 4.0)), (1, (-3.0, 3.0)), (2, (-3.0, 0.0, 3.0))):
        for place in places:
            p = rng.uniform([-4.0, -3.0, -3.0], [4.0, 3.0, 3.0], (9_000, 3))
            p[:, axis] = place
            step = 1e-6 * np.eye(3)[axis]
            faces.append(p[inside(p + step) != inside(p - step)])
    scan = np.concatenate(faces)
    opened = opened_body(scan, LENGTH, SPACING)
    assert opened is not None
    deep = (np.abs(scan[:, 0]) < 0.3) & (scan[:, 2] > 0.3) & (scan[:, 2] < 2.5) & (np.abs(scan[:, 1]) < 2.5)
    assert opened.slit[deep].mean() > 0.95
    assert not opened.slit[np.abs(scan[:, 0]) > 0.5].any()
    near = opened_body(scan, LENGTH, SPACING, None, ((0.0, 0.0, 1.5),))
    assert near is not None and (near.slit == opened.slit).all()
    assert opened_body(scan, LENGTH, SPACING, None, ((4.0, 0.0, -3.0),)) is None


@pytest.mark.parametrize("thick", [0.35, 0.7])
def test_the_floor_of_a_blind_hole_stays_however_thin_and_a_limb_beside_it_is_taken_off(thick: float) -> None:
    """A floor is thin as a limb is, but without it the hole would go through: grids had tunnels through such floors."""
    rng, low, high = np.random.default_rng(5), np.array([-4.0, -4.0, -1.5]), np.array([4.0, 4.0, 1.5])

    def inside(p: Points) -> NDArray[np.bool_]:
        hole = (np.hypot(p[:, 0], p[:, 1]) < 1.5) & (p[:, 2] > thick - 1.5)
        return np.asarray((p > low).all(axis=1) & (p < high).all(axis=1) & ~hole)

    faces = []
    for axis, places in ((0, (-4.0, 4.0)), (1, (-4.0, 4.0)), (2, (-1.5, thick - 1.5, 1.5))):
        for place in places:
            p = rng.uniform(low, high, (9_000, 3))
            p[:, axis] = place
            step = 1e-6 * np.eye(3)[axis]
            faces.append(p[inside(p + step) != inside(p - step)])
    turn, height = rng.uniform(0.0, 2.0 * np.pi, 3_000), rng.uniform(thick - 1.5, 1.5, 3_000)
    hole = np.column_stack([1.5 * np.cos(turn), 1.5 * np.sin(turn), height])
    limb = rod(0.25, np.linspace([3.8, 0.0, 0.0], [7.0, 0.0, 0.0], 20))
    scan = np.concatenate([*faces, hole, limb[limb[:, 0] > 4.0]])
    opened = opened_body(scan, LENGTH, SPACING)
    assert opened is not None and opened.limb[scan[:, 0] > 4.8].all()
    assert not opened.limb[np.hypot(scan[:, 0], scan[:, 1]) < 2.0].any()


@pytest.mark.parametrize(
    ("holes", "kind"), [([(slice(2, 4), slice(2, 4), slice(None))], 0), ([(slice(2, 4),) * 3], 2), ([], 1)]
)
def test_the_euler_characteristic_of_voxels_is_parts_less_tunnels_plus_hollows(
    holes: list[tuple[slice, ...]], kind: int
) -> None:
    block = np.ones((6, 6, 6), np.bool_)
    for hole in holes:
        block[hole] = False
    assert euler_of_voxels(block) == kind
    assert euler_of_voxels(np.concatenate([block, np.zeros_like(block), block])) == 2 * kind


def tailed() -> Points:
    """A ball with a tail that lies a third of a member off it: no front can tell the two apart."""
    turn = np.linspace(0.0, 2.0, 120)
    off = RADIUS + np.minimum(0.55, 3.0 * turn) - 0.02
    tail = np.column_stack([off * np.cos(turn), off * np.sin(turn), np.zeros_like(turn)])
    return np.concatenate([ball(), outside(rod(0.22, tail))])


@compiled_only
def test_a_body_with_a_thin_tail_beside_it_gets_a_grid_without_the_tail() -> None:
    settings = st.Settings(length=LENGTH, effort="quick")
    grid = st.grid_from_points(tailed(), settings)
    found = grid.certificate
    assert found is not None and found.passed
    assert (grid.topology.boundary_loops, grid.topology.euler) == (0, 2)
    samples = sample_surface(st.PointCloud.from_array(tailed()), settings.replace(plain_body=True))
    assert samples.measured < len(samples.surface.mean)


@compiled_only
def test_a_limb_near_a_place_is_left_out_and_said_and_one_elsewhere_is_followed() -> None:
    limb = outside(rod(0.55, straight(3.0)))
    scan = np.concatenate([tailed(), limb * [-1.0, 1.0, 1.0]])  # that is wide enough for members
    at = RADIUS * np.array([np.cos(2.0), np.sin(2.0), 0.0])
    grid = st.grid_from_points(scan, st.Settings(length=LENGTH, effort="quick", plain_at=[tuple(at)]))
    found = grid.certificate
    assert found is not None and found.passed and found.handles == 0
    assert {part.kind for part in found.left_out} == {"limbs"}
    assert grid.nodes[:, 0].min() < -RADIUS - 2.5
    assert np.linalg.norm(grid.nodes[grid.nodes[:, 0] > -2.0, :2], axis=1).max() < RADIUS + 0.5


def test_places_of_plain_limbs_are_those_of_the_scan_wherever_its_origin_lies() -> None:
    limb = outside(rod(0.25, straight(3.0)))
    scan, far = np.concatenate([ball(), limb, limb * [-1.0, -1.0, 1.0]]), np.array([5e5, -3e6, 120.0])
    settings = st.Settings(length=LENGTH, limb_girth=0.0, plain_at=[tuple(far + [RADIUS + 2.0, 0.0, 0.0])])
    samples = sample_surface(st.PointCloud.from_array(scan + far), settings)
    assert (samples.judged[scan[:, 0] > RADIUS + 0.8] == LIMB).all()
    assert (samples.judged[scan[:, 0] < RADIUS - 1.0] == KEPT).all()
