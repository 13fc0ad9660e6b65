"""Sheets side by side, a fraction of a member apart, are told apart by links, boundaries and cover."""

from dataclasses import replace

import numpy as np
import pytest
from hard_scans import hard
from hypothesis import given, strategies
from marks import compiled_only
from small_clouds import sheet
from steps import steps_of
from typed import known

import scantruss as st
from scantruss.check import sheets
from scantruss.check.certify import certify
from scantruss.check.sheets import faults_on_sheets, nodes_of_samples
from scantruss.grid.certificate import Fault
from scantruss.kernels.boundary import room as kernels
from scantruss.kernels.mesh import sheets as mesh_kernels
from scantruss.kernels.surface import normals as facing
from scantruss.pipeline import grid_from_cloud
from scantruss.surface.samples import sample_surface


@pytest.mark.parametrize("seed", range(4))
def test_a_roll_has_one_rim_and_no_link_to_its_next_turn(seed: int) -> None:
    """Turns .5 to .9 members apart."""
    shape = hard("rolled", seed)
    cloud = st.PointCloud.from_array(shape.points)
    samples, boundary, _ = steps_of(cloud, st.Settings(length=shape.length))
    surface = samples.surface
    sample, place = np.nonzero(surface.neighbors >= 0)
    middle = 0.5 * (surface.mean[sample] + surface.mean[surface.neighbors[sample, place]]) + cloud.origin
    assert shape.distance(middle[::7]).max() < 0.1 * shape.length
    (loop,), (true,) = boundary.loops, shape.loops
    assert len(loop.corners) == 4
    around = np.linalg.norm(np.roll(true, -1, axis=0) - true, axis=1).sum()
    assert loop.length == pytest.approx(around, rel=0.01)


@compiled_only
@pytest.mark.parametrize(("method", "share"), [("default", 1.0), ("paper", 1.0), ("default", 1.6)])
def test_a_roll_is_covered_by_one_grid(method: str, share: float) -> None:
    shape = hard("rolled", 1)
    grid = st.grid_from_points(shape.points, st.Settings(length=share * shape.length, method=method, effort="quick"))
    assert (grid.topology.boundary_loops, grid.topology.euler) == (1, 1)
    corners = grid.nodes[grid.triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert area == pytest.approx(shape.area, rel=0.04)


def test_a_grid_of_one_sheet_does_not_cover_the_next() -> None:
    """Two plates half a member apart; the nodes of the one are near the other, but not on it."""
    plate = sheet(8, 8, 0.1, seed=1, noise=0.01)
    cloud = st.PointCloud.from_array(np.concatenate([plate, plate + [0, 0, 0.5]]))
    settings = st.Settings(length=1.0, effort="quick")
    both = grid_from_cloud(cloud, settings)
    assert both.topology.components == 2
    samples = sample_surface(cloud, settings)
    assert faults_on_sheets(both, samples, nodes_of_samples(both, samples, 1.0), 1.0) == []
    lower = both.triangles[both.nodes[both.triangles[:, 0], 2] < both.nodes[:, 2].mean()]
    used, numbered = np.unique(lower, return_inverse=True)
    half = both.replace(nodes=both.nodes[used], triangles=numbered.reshape(-1, 3))
    (fault,) = faults_on_sheets(half, samples, nodes_of_samples(half, samples, 1.0), 1.0)
    assert fault.kind == "sheets" and fault.words.startswith("leaves out 50%") and fault.where is not None


def test_thick_samples_give_up_thin_ones_that_stand_over_them() -> None:
    """Site 0 is linked to its own plate and to one sample of a plate above: that link goes, and its normal is upright again."""
    flat = np.stack(np.meshgrid(np.arange(4.0), np.arange(4.0)), axis=-1).reshape(-1, 2)
    low, high = np.column_stack([flat, np.zeros(16)]), np.column_stack([flat, np.full(16, 1.2)])
    mean = np.concatenate([low, high])
    neighbors = np.full((32, 4), -1)
    neighbors[0] = (1, 4, 5, 16)
    normals, thickness = np.tile([0.0, 0.0, 1.0], (32, 1)), np.zeros(32)
    normals[0], thickness[0] = (0.6, 0.0, 0.8), 0.5
    facing.trust_thin_samples(mean, normals, neighbors, thickness, 0.1, 0.75)
    assert neighbors[0].tolist() == [1, 4, 5, -1]
    assert abs(normals[0]) == pytest.approx([0, 0, 1]) and thickness[0] == pytest.approx(0)
    thickness[:] = 0.5  # none of them is thin
    neighbors[0] = (1, 4, 5, 16)
    facing.trust_thin_samples(mean, normals, neighbors, thickness, 0.1, 0.75)
    assert neighbors[0].tolist() == [1, 4, 5, 16]


@pytest.mark.parametrize(("rise", "normal", "found"), [(0.0, 1.0, True), (0.5, 1.0, False), (0.0, -1.0, False)])
def test_a_spike_of_a_rim_is_on_one_sheet(rise: float, normal: float, found: bool) -> None:
    """A long tongue .4 wide is a spike; where its sides lie one over the other, or face opposite sides, it is two sheets."""
    x = np.arange(0, 6, 0.1)
    out, back = np.column_stack([x, 0 * x, 0 * x]), np.column_stack([x, 0 * x + 0.4 * (rise == 0), 0 * x + rise])[::-1]
    curve = np.concatenate([out, back])
    normals = np.tile([0.0, 0.0, 1.0], (len(curve), 1))
    normals[len(x) :] *= normal
    _, gap = kernels.widest_spike(curve, normals, 0.6, 15, 60)
    assert (gap > 0) == found


@given(strategies.integers(0, 10_000), strategies.integers(20, 90), strategies.floats(0.2, 1.2))
def test_the_widest_spike_is_that_of_a_look_at_all_pairs(seed: int, count: int, width: float) -> None:
    """A random closed curve of uneven steps in a plane; of two alike the first counts."""
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.normal(size=(count, 2)), axis=0) * 0.1
    walk -= np.linspace(0, 1, count)[:, None] * (walk[-1] - walk[0])
    curve, normals = np.column_stack([walk, np.zeros(count)]), np.tile([0.0, 0.0, 1.0], (count, 1))
    low, high = 4, count // 2
    at, gap = 0, 0
    for i in range(count):
        for k in range(high, max(low, gap), -1):
            if np.linalg.norm(curve[(i + k) % count] - curve[i]) < width:
                at, gap = i, k
                break
    assert kernels.widest_spike(curve, normals, width, low, high) == (at, gap)


def test_a_grid_that_is_cut_where_the_scan_is_whole_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """The members across a line are gone; nodes on both sides are near in space, far in the grid."""
    settings = st.Settings(length=1.0, effort="quick")
    cloud = st.PointCloud.from_array(sheet(10, 10, 0.12, seed=2))
    grid, samples = grid_from_cloud(cloud, settings), sample_surface(cloud, settings)
    assert faults_on_sheets(grid, samples, nodes_of_samples(grid, samples, 1.0), 1.0) == []
    x, y = (grid.nodes[grid.triangles][:, :, axis].mean(axis=1) for axis in (0, 1))
    slit = (abs(x) < 0.6) & (y < 1.5)
    disconnected = grid.replace(triangles=grid.triangles[~slit])
    nearest = nodes_of_samples(disconnected, samples, 1.0)
    (fault,) = faults_on_sheets(disconnected, samples, nearest, 1.0)
    x, y, _ = known(fault.where)
    assert fault.kind == "torn" and abs(x) < 1.5 and y < 2.5
    points = samples.surface.points.copy()
    points[(abs(points[:, 0]) < 1.7) & (points[:, 1] < 3.0), 2] += 50.0
    open_scan = replace(samples, surface=samples.surface._replace(points=points))
    assert faults_on_sheets(disconnected, open_scan, nearest, 1.0) == [fault]  # a gap that a grid bridges
    monkeypatch.setattr(sheets, "FACES_ALIKE", 1.1)  # its sides face different ways, as an arm and the knee beside it
    assert faults_on_sheets(disconnected, open_scan, nearest, 1.0) == []


def test_a_grid_that_ends_on_both_sides_of_a_part_of_its_scan_is_torn() -> None:
    """As at a handle of three members whose middle was missed by two: the certificate passed with what it misses said as so many points."""
    settings = st.Settings(length=1.0, effort="quick", allow_missing=1.0)
    cloud = st.PointCloud.from_array(sheet(4, 14, 0.12, seed=2))
    grid, (samples, boundary, _) = grid_from_cloud(cloud, settings), steps_of(cloud, settings)
    y = grid.nodes[grid.triangles][:, :, 1].mean(axis=1)

    def torn(left: np.ndarray) -> list[Fault]:
        nodes, triangles = np.unique(grid.triangles[left], return_inverse=True)
        kept = {name: getattr(grid, name)[nodes] for name in ("nodes", "fixed", "deviation")}
        part = grid.replace(triangles=triangles.reshape(-1, 3), alike=None, line_sets=(), **kept)
        return [fault for fault in certify(part, samples, boundary, settings).faults if fault.kind == "torn"]

    assert torn(np.ones(len(y), bool)) == [] == torn(y < 4.0)
    (fault,) = torn(abs(y - y.mean()) > 2.5)
    assert abs(known(fault.where)[1] - y.mean()) < 1.5


def test_certificates_of_one_scan_can_be_made_side_by_side() -> None:
    """They leave alone what look-ups write to: two threads in one queue had led to nowhere."""
    settings = st.Settings(length=1.0, effort="quick")
    cloud = st.PointCloud.from_array(sheet(6, 6, 0.15, seed=3))
    grid, (samples, boundary, _) = grid_from_cloud(cloud, settings), steps_of(cloud, settings)
    surface = samples.surface
    before = [array.copy() for array in (surface.stamp, surface.queue, surface.counter)]
    assert certify(grid, samples, boundary, settings).passed
    for array, kept in zip((surface.stamp, surface.queue, surface.counter), before, strict=True):
        assert (array == kept).all()


@pytest.mark.kernels
def test_linked_samples_are_noted_whose_nodes_are_far_apart() -> None:
    """Three samples in a row, linked to each other, with the nodes of a chain of six: the first and the last are four members apart."""
    links = np.array([[1, 2], [0, 2], [0, 1]])
    normals, nearest = np.tile([0.0, 0.0, 1.0], (3, 1)), np.array([0, 2, 4])
    first, ends = np.array([0, 1, 3, 5, 7, 9, 10]), np.array([1, 0, 2, 1, 3, 2, 4, 3, 5, 4])
    torn = np.full((4, 2), -1)
    assert mesh_kernels.note_disconnected(links, normals, nearest, first, ends, 3, torn) == 1
    assert torn.tolist() == [[0, 2], [-1, -1], [-1, -1], [-1, -1]]
    assert mesh_kernels.note_disconnected(links, normals, nearest, first, ends, 1, torn) == 3
    assert mesh_kernels.note_disconnected(links, normals, nearest, first, ends, 1, torn[:2]) == 2
    normals[2] *= -1
    assert mesh_kernels.note_disconnected(links, normals, nearest, first, ends, 3, torn) == 0
