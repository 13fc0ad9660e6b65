"""Poor places are mended, what is not poor stays as it is; nodes off the scan are put on it; lines keep a node where they need one."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from marks import compiled_only
from rough import Rough, rough_disc, rough_sphere

import scantruss as st
from scantruss.check.distances import boxes_of, distances_to_planes, points_of_planes
from scantruss.check.limits import NOISES_OFF
from scantruss.improve.equalize import equalize
from scantruss.improve.mend import mend_poor_places, poor_places
from scantruss.improve.off_scan import MOST_OFF, put_on_scan
from scantruss.improve.working_mesh import Kept, WorkingMesh
from scantruss.kernels.mesh.grid import list_triangles, split
from scantruss.kernels.mesh.poor_places import faults_of_triangles
from scantruss.surface.samples import SurfaceSamples, sample_surface


@cache
def _settled(seed: int) -> tuple[Rough, WorkingMesh, Kept, SurfaceSamples]:
    rough = rough_sphere(count=120, seed=seed, points=3000)
    mesh = rough.mesh()
    equalize(mesh)
    return rough, mesh, mesh.copied(), sample_surface(rough.cloud, rough.settings)


def settled(seed: int = 0) -> tuple[Rough, WorkingMesh, SurfaceSamples]:
    """A grid of even members on a sphere, as it was made."""
    rough, mesh, kept, samples = _settled(seed)
    mesh.restore(kept)
    return rough, mesh, samples


def naive_faults(mesh: WorkingMesh, settings: st.Settings) -> tuple[float, float, float]:
    """The smallest angle, the shortest and the longest member of a mesh [degree, length]."""
    grid = mesh.to_grid(st.Grid(np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros(0, np.bool_), np.zeros(3)))
    angles, lengths = [], []
    for triangle in grid.triangles:
        for k in range(3):
            a, b, c = (grid.nodes[triangle[(k + j) % 3]] for j in range(3))
            cosine = (b - a) @ (c - a) / np.linalg.norm(b - a) / np.linalg.norm(c - a)
            angles.append(float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))))
            lengths.append(float(np.linalg.norm(b - a)) / settings.length)
    return min(angles), min(lengths), max(lengths)


@compiled_only
@pytest.mark.parametrize("seed", range(3))
def test_a_node_too_many_is_taken_out(seed: int) -> None:
    """An edge is split close to one of its ends: two members are too short then, and angles too small."""
    rough, mesh, _ = settled(seed)
    assert not mend_poor_places(mesh, rough.settings)  # nothing is poor
    a = int(np.flatnonzero(mesh.net.degree > 0)[seed])
    b = int(mesh.net.ring[a, 0])
    added = split(mesh.net, a, b)
    mesh.net.nodes[added] = 0.95 * mesh.net.nodes[a] + 0.05 * mesh.net.nodes[b]
    mesh.patches[added], mesh.net.ideal[added] = mesh.patches[a], 6
    poor = poor_places(mesh, rough.settings)
    assert any(added in triangle for triangle in poor.worst.tolist())
    angle, short, _ = naive_faults(mesh, rough.settings)
    assert angle < rough.settings.min_angle
    assert short < rough.settings.min_length
    assert mend_poor_places(mesh, rough.settings)
    angle, short, longest = naive_faults(mesh, rough.settings)
    assert angle > rough.settings.min_angle
    assert rough.settings.min_length < short < longest < rough.settings.max_length


@compiled_only
def test_a_grid_without_poor_places_keeps_its_bytes() -> None:
    rough, mesh, _ = settled()
    before = mesh.copied()
    assert poor_places(mesh, rough.settings).faults == 0.0
    assert not mend_poor_places(mesh, rough.settings)
    assert all((one == other).all() for one, other in zip(before.net, mesh.net, strict=True))


def angle(one: np.ndarray, other: np.ndarray) -> float:
    """The angle between two vectors [degree]."""
    return float(np.degrees(np.arccos(np.clip(one @ other / np.linalg.norm(one) / np.linalg.norm(other), -1.0, 1.0))))


def faults_beyond(mesh: WorkingMesh, limits: tuple[float, float, float, float]) -> dict[tuple[int, ...], float]:
    """How far each triangle of a mesh is beyond the limits of `faults_of_triangles`."""
    net = mesh.net
    room = np.empty((len(net.nodes) * 3, 3), np.int64)
    triangles, nodes = room[: list_triangles(net, room)].tolist(), net.nodes
    shortest, longest, narrowest, flattest = limits
    normals = [np.cross(nodes[b] - nodes[a], nodes[c] - nodes[a]) for a, b, c in triangles]
    found = {}
    for t, triangle in enumerate(triangles):
        fault, held = 0.0, mesh.fixed[triangle].all()
        for k in range(3):
            a, b, c = (triangle[(k + j) % 3] for j in range(3))
            size = np.linalg.norm(nodes[b] - nodes[a]) / (0.5 * mesh.length * (net.desired[a] + net.desired[b]))
            if not mesh.fixed[[a, b]].all():
                fault += max(1.0 - size / shortest, size / longest - 1.0, 0.0)
            if not held:
                fault += max(1.0 - angle(nodes[b] - nodes[a], nodes[c] - nodes[a]) / narrowest, 0.0)
            beyond = [u for u, other in enumerate(triangles) if u != t and {a, b} <= set(other)]
            fault += sum(max(1.0 - (180.0 - angle(normals[t], normals[u])) / flattest, 0.0) for u in beyond)
        found[tuple(triangle)] = fault
    return found


@pytest.mark.kernels
@given(some.integers(0, 1000))
def test_faults_of_triangles_are_those_of_their_sides_corners_and_folds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rough = rough_disc(length=0.45, points=400, seed=seed)
    mesh = rough.mesh()
    net = mesh.net
    net.nodes[:] += 0.15 * rng.normal(size=net.nodes.shape)
    net.desired[:] = rng.uniform(0.7, 1.4, len(net.desired))
    mesh.fixed[:] = rng.random(len(mesh.fixed)) < 0.3
    limits, room = (0.8, 1.2, 40.0, 150.0), 3 * len(net.nodes)
    triangles, faults = np.empty((room, 3), np.int64), np.empty(room)
    count = faults_of_triangles(net, mesh.fixed, mesh.length, *limits, triangles, faults)
    expected = faults_beyond(mesh, limits)
    assert count == len(expected)
    found = dict(zip(map(tuple, triangles[:count].tolist()), faults[:count].tolist(), strict=True))
    assert found == pytest.approx(expected, abs=1e-6)


@compiled_only
def test_triangles_folded_onto_each_other_are_mended() -> None:
    rough, mesh, _ = settled()
    net = mesh.net
    v = int(np.flatnonzero(net.degree == 6)[0])
    ring = net.ring[v, :6]
    across = net.nodes[ring[0]] - net.nodes[ring[3]]
    net.nodes[v] = net.nodes[ring].mean(axis=0) + 0.75 * across  # beyond its neighbours
    triangles = poor_places(mesh, rough.settings).worst
    assert any(v in triangle for triangle in triangles.tolist())
    assert mend_poor_places(mesh, rough.settings)
    assert not any(faults_beyond(mesh, (0.01, 9.0, 0.01, 90.0)).values())


@compiled_only
@given(some.integers(0, 1000), some.floats(0.15, 0.5))
def test_nodes_off_the_scan_are_put_on_it(seed: int, off: float) -> None:
    rough, mesh, samples = settled()
    net, length = mesh.net, rough.settings.length
    mesh.projection_distance[:] = 0.0
    rng = np.random.default_rng(seed)
    live = np.flatnonzero(net.degree > 0)
    moved = rng.choice(live, 8, replace=False)
    held = int(moved[0])
    mesh.fixed[held] = True
    away = net.nodes[moved] / np.linalg.norm(net.nodes[moved], axis=1)[:, None]
    net.nodes[moved] += off * length * rng.choice((-1.0, 1.0), (len(moved), 1)) * away
    before = net.nodes.copy()
    put_on_scan(mesh, samples, rough.settings)
    boxes = boxes_of(points_of_planes(samples), length)
    distance, noise = distances_to_planes(np.ascontiguousarray(net.nodes[live]), samples, boxes)
    too_far = live[distance - NOISES_OFF * noise > rough.settings.max_offset * length]
    assert set(too_far.tolist()) <= {held}
    assert (net.nodes[held] == before[held]).all()
    still = np.setdiff1d(live, moved)
    assert (net.nodes[still] == before[still]).all()


@compiled_only
def test_many_nodes_off_the_scan_are_no_exception() -> None:
    rough, mesh, samples = settled()
    mesh.projection_distance[:] = 0.0
    mesh.net.nodes[:] *= 1.0 + 0.3 * rough.settings.length
    before = mesh.net.nodes.copy()
    assert (mesh.net.degree > 0).sum() > MOST_OFF
    put_on_scan(mesh, samples, rough.settings)
    assert (mesh.net.nodes == before).all()


@compiled_only
def test_a_given_boundary_stays_where_it_is() -> None:
    rough = rough_disc(length=0.3, points=3000)
    mesh, samples = rough.mesh(), sample_surface(rough.cloud, rough.settings)
    mesh.projection_distance[:] = 0.0
    at_boundary = np.flatnonzero((mesh.net.is_open == 1) & (mesh.net.degree > 0))
    mesh.net.nodes[at_boundary[:5], 2] += 0.3 * rough.settings.length
    before = mesh.net.nodes.copy()
    given_line = rough.settings.replace(boundary=[[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    put_on_scan(mesh, samples, given_line)
    assert (mesh.net.nodes[at_boundary] == before[at_boundary]).all()
    put_on_scan(mesh, samples, rough.settings)
    assert (mesh.net.nodes[at_boundary[:5]] != before[at_boundary[:5]]).any()
