"""The certificate: right grids pass, every fault is found and named with its place, every figure is what plain loops give."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import naive_grid as naive
import numpy as np
import pytest
from rough import strip_of
from shapes import make
from small_clouds import ring
from small_grids import dome, fan, icosahedron
from steps import steps_of
from typed import known

import scantruss as st
from scantruss import pipeline
from scantruss.check.certify import certify
from scantruss.check.folds import fold_angles
from scantruss.check.irregular import count_irregular
from scantruss.errors import CertificateError
from scantruss.grid.certificate import Certificate
from scantruss.studio.compare import grid_figures
from scantruss.surface.samples import SurfaceSamples

SETTINGS = st.Settings(length=1.0)
SHIFT = np.array([500_000.0, 4_500_000.0, 100.0])


def bent(points: np.ndarray) -> np.ndarray:
    """A plate bent to a barrel."""
    x, y, _ = points.T
    return np.stack([8 * np.sin(x / 8), y, 8 * np.cos(x / 8)], axis=1)


@pytest.fixture(scope="module")
def made() -> tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]]:
    """A ring on a barrel far from the origin, its boundary, and its grid: two loops."""
    cloud = st.PointCloud.from_array(bent(ring(2.0, 5.0, 0.15)) + SHIFT)
    grid = pipeline.grid_from_cloud(cloud, SETTINGS)
    steps = steps_of(cloud, SETTINGS)
    return grid, (steps.samples, steps.boundary)


def kinds(made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]], **changes: Any) -> set[str]:
    """Kinds of the faults of the grid after some changes."""
    grid, scan = made
    return {fault.kind for fault in certify(grid.replace(**changes), *scan, SETTINGS).faults}


def inner_node(grid: st.Grid, loops: int = 2) -> int:
    """A node all of whose neighbours are inside."""
    around, rim = naive.neighbors(grid), set(np.concatenate(grid.boundary_loops).tolist())
    return next(v for v in around if v not in rim and not around[v] & rim)


def test_a_right_grid_passes_and_carries_its_certificate(
    made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]],
) -> None:
    grid, scan = made
    found = known(grid.certificate)
    assert found == certify(grid, *scan, SETTINGS) and found.passed
    assert (found.pieces, found.boundary_loops, found.euler, found.handles, found.crossings) == (1, 2, 0, 0, 0)
    assert (found.scan_pieces, found.scan_loops, found.scan_within_reach, found.grid_within_reach) == (1, 2, 1.0, 1.0)
    assert str(found).startswith("passed, oriented manifold")


def test_worst_places_are_those_of_plain_loops(made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]]) -> None:
    grid, _ = made
    found = known(grid.certificate)
    lengths = {edge: np.linalg.norm(grid.nodes[edge[0]] - grid.nodes[edge[1]]) for edge in naive.wings(grid)}
    for worst, edge in (
        (found.shortest_member, min(lengths, key=lengths.__getitem__)),
        (found.longest_member, max(lengths, key=lengths.__getitem__)),
    ):
        assert known(worst).value == pytest.approx(lengths[edge])
        assert known(worst).where == pytest.approx(grid.nodes[list(edge)].mean(axis=0) + grid.origin)
    angles = {
        (a, t): angle
        for t in map(tuple, grid.triangles.tolist())
        for a, angle in zip(t, naive.angles(*grid.nodes[list(t)]), strict=True)
    }
    for worst, (node, _) in (
        (found.smallest_angle, min(angles, key=angles.__getitem__)),
        (found.largest_angle, max(angles, key=angles.__getitem__)),
    ):
        assert known(worst).where == pytest.approx(grid.nodes[node] + grid.origin)
    assert known(found.smallest_angle).value == pytest.approx(min(angles.values()))
    assert known(found.largest_angle).value == pytest.approx(max(angles.values()))


def test_places_are_in_the_scans_own_frame(made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]]) -> None:
    grid, (samples, _) = made
    far, found = samples.surface.mean + grid.origin, known(grid.certificate)
    for spread in (found.scan_distance, found.triangle_distance, found.node_distance):
        assert np.linalg.norm(far - known(spread).largest.where, axis=1).min() < 0.5


def test_an_edge_of_three_triangles_and_a_pinch_are_found(
    made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]],
) -> None:
    grid, _ = made
    a, b = grid.edges[np.flatnonzero(grid.edge_uses == 2)[0]]
    apex = np.vstack([grid.nodes, grid.nodes[[a, b]].mean(axis=0) + [0, 0, 0.3]])
    third = np.vstack([grid.triangles, (a, b, len(grid.nodes))])
    found = kinds(made, nodes=apex, triangles=third, fixed=np.zeros(len(apex), bool), deviation=None)
    assert "manifold" in found and "orientable" not in found  # one fault, one word
    v = inner_node(grid)
    fan_of_v = np.flatnonzero((grid.triangles == v).any(axis=1))
    pinched = np.delete(
        grid.triangles,
        [fan_of_v[0], next(t for t in fan_of_v if len(set(grid.triangles[t]) & set(grid.triangles[fan_of_v[0]])) == 1)],
        axis=0,
    )
    assert "manifold" in kinds(made, triangles=pinched)


def test_one_sided_grids_are_found(made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]]) -> None:
    _, scan = made
    assert "orientable" in {fault.kind for fault in certify(strip_of(13, 1), *scan, SETTINGS).faults}


def test_a_hole_and_a_loose_piece_and_a_lost_loop_are_found(
    made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]],
) -> None:
    grid, scan = made
    v = inner_node(grid)
    holed = grid.triangles[~(grid.triangles == v).any(axis=1)]
    assert kinds(made, triangles=holed) == {"loops", "torn"}
    certificate = certify(grid.replace(triangles=holed), *scan, SETTINGS)
    assert np.linalg.norm(np.subtract(known(certificate.faults[0].where), grid.nodes[v] + grid.origin)) < 1.6
    loose = np.vstack([grid.triangles, fan().triangles + len(grid.nodes)])
    more = np.vstack([grid.nodes, fan(1.0).nodes + grid.nodes[v] + [0, 0, 0.3]])
    assert {"pieces", "loops"} <= kinds(
        made, nodes=more, triangles=loose, fixed=np.zeros(len(more), bool), deviation=None
    )
    wider = {"nodes": more, "triangles": loose, "fixed": np.zeros(len(more), bool), "deviation": None}
    found = certify(grid.replace(**wider), *scan, SETTINGS)
    place = next(fault.where for fault in found.faults if fault.kind == "pieces")
    assert np.linalg.norm(more[-7:] + grid.origin - place, axis=1).min() < 1e-6
    lost = min(grid.boundary_loops, key=len)
    cap = np.column_stack([np.full(len(lost), len(grid.nodes)), np.roll(lost, -1), lost])
    nodes = np.vstack([grid.nodes, grid.nodes[lost].mean(axis=0)])
    closed = {"nodes": nodes, "triangles": np.vstack([grid.triangles, cap]), "deviation": None}
    assert {"loops", "astray"} <= kinds(made, fixed=np.zeros(len(nodes), bool), **closed)


def test_a_part_of_the_scan_left_out_and_triangles_off_it_are_found(
    made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]],
) -> None:
    grid, scan = made
    part = grid.nodes[grid.triangles].mean(axis=1)[:, 0] < 2.0
    found = certify(grid.replace(triangles=grid.triangles[part]), *scan, SETTINGS)
    assert "cover" in {fault.kind for fault in found.faults} and 0.5 < found.scan_within_reach < 0.8
    assert (
        known(found.scan_distance).largest.value > 2.0 and known(found.scan_distance).largest.where[0] - SHIFT[0] > 4.0
    )
    assert "astray" in kinds(made, nodes=grid.nodes + [0, 0, 2.0])
    assert kinds(made, nodes=grid.nodes + [0, 0, 0.01]) == set()


def test_cuts_and_folds_are_found_with_their_place(made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]]) -> None:
    grid, scan = made
    v = inner_node(grid)
    nodes = grid.nodes.copy()
    nodes[v] += 2.2 * (nodes[min(naive.neighbors(grid)[v])] - nodes[v])
    found = certify(grid.replace(nodes=nodes), *scan, SETTINGS)
    (cut,) = (fault for fault in found.faults if fault.kind == "crossing")
    assert np.linalg.norm(np.subtract(known(cut.where), grid.nodes[v] + grid.origin)) < 3.0
    assert found.crossings > 0
    assert known(found.sharpest_fold).value < 60


def test_fold_angles_are_those_between_triangles() -> None:
    for angle in (2.0, 60.0, 179.0):
        turn = np.radians(angle)
        grid = fan().replace(
            nodes=np.array([(0, 0, 0), (1, 0, 0), (0.5, 1, 0), (0.5, np.cos(turn), np.sin(turn))]),
            triangles=np.array([(0, 1, 2), (1, 0, 3)]),
        )
        known = fold_angles(grid)[grid.edge_uses == 2]
        assert known == pytest.approx([angle])
        assert np.isnan(fold_angles(grid)[grid.edge_uses == 1]).all()


def test_a_fold_onto_itself_is_a_fault(made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]]) -> None:
    grid, scan = made
    edge = np.flatnonzero(grid.edge_uses == 2)[40]
    t, u = grid.edge_triangles[edge]
    a, b = grid.edges[edge]
    c, d = (next(v for v in grid.triangles[k].tolist() if v not in (a, b)) for k in (t, u))
    nodes = grid.nodes.copy()
    nodes[c] = nodes[d] + [0, 0, 0.02]
    found = certify(grid.replace(nodes=nodes), *scan, SETTINGS)
    assert known(found.sharpest_fold).value < 15.0 and "folded" in {fault.kind for fault in found.faults}


def test_uneven_members_no_triangles_and_lost_fixed_nodes_are_found(
    made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]],
) -> None:
    grid, scan = made
    nodes = grid.nodes * [1.0, 8.0, 1.0]
    assert "uneven" in kinds(made, nodes=nodes)
    nothing = certify(grid.replace(triangles=np.zeros((0, 3), np.int64)), *scan, SETTINGS)
    assert [fault.kind for fault in nothing.faults] == ["empty"]
    assert [fault.kind for fault in certify(grid.replace(nodes=grid.nodes * np.nan), *scan, SETTINGS).faults] == [
        "empty"
    ]
    v = inner_node(grid)
    wanted = SETTINGS.replace(fixed=[grid.nodes[v] + grid.origin + [1e-3, 0, 0]])
    missed = certify(grid, *scan, wanted)
    assert [fault.kind for fault in missed.faults] == ["fixed"] and known(missed.fixed_error).value == pytest.approx(
        1e-3
    )
    hit = certify(grid, *scan, SETTINGS.replace(fixed=[grid.nodes[v] + grid.origin]))
    assert hit.passed and known(hit.fixed_error).value < 1e-8


def plain_charges(grid: st.Grid) -> dict[int, int]:
    """Members too few at each node, one by one."""
    around, wings = naive.neighbors(grid), naive.wings(grid)
    rim = {v for edge, third in wings.items() if len(third) == 1 for v in edge}
    angle = dict.fromkeys(around, 0.0)
    for triangle in grid.triangles.tolist():
        for v, at in zip(triangle, naive.angles(*grid.nodes[triangle]), strict=True):
            angle[v] += at
    return {
        v: (max(1, int(np.floor(angle[v] / 60 + 0.5))) + 1 if v in rim else 6) - len(around[v])
        for v in around
        if around[v]
    }


@pytest.mark.parametrize(
    ("grid", "expected"), [(icosahedron(), (12, 12)), (fan(), (0, 0)), (dome(9), None), (strip_of(9), None)]
)
def test_irregular_nodes_are_counted_as_stated(grid: st.Grid, expected: tuple[int, int] | None) -> None:
    charges = plain_charges(grid)
    present, forced = count_irregular(grid)
    assert present == sum(map(abs, charges.values())) and forced == abs(sum(charges.values()))
    assert expected is None or (present, forced) == expected


@pytest.mark.parametrize("name", ["sphere", "two_holes"])
def test_what_is_forced_follows_from_euler_number_and_rim(name: str) -> None:
    """6 * Euler number - sum over the boundary (3 - k), whatever the grid inside; a sphere has twelve."""
    shape = make(name, 12_000)
    grid = st.grid_from_points(shape.points, st.Settings(length=2 * shape.length))
    present, forced = known(grid.certificate).irregular, known(grid.certificate).irregular_forced
    rim = [v for loop in grid.boundary_loops for v in loop.tolist()]
    angle = np.zeros(len(grid.nodes))
    for triangle in grid.triangles.tolist():
        angle[triangle] += naive.angles(*grid.nodes[triangle])
    room = [max(1, int(np.floor(angle[v] / 60 + 0.5))) for v in rim]
    assert forced == abs(6 * shape.euler - sum(3 - k for k in room))
    assert present >= forced and (present - forced) % 2 == 0


def test_a_grid_that_is_changed_loses_its_certificate(made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]]) -> None:
    grid, _ = made
    assert grid.replace(nodes=grid.nodes + 1.0).certificate is None
    assert grid.replace(seconds={"total": 1.0}).quality is grid.quality
    assert grid.replace(nodes=2.0 * grid.nodes).quality.length_mean == pytest.approx(2.0 * grid.quality.length_mean)
    assert grid.replace(settings=SETTINGS).certificate is grid.certificate


def test_a_certificate_is_written_and_read_back_whole(
    made: tuple[st.Grid, tuple[SurfaceSamples, st.Boundary]], tmp_path: Path
) -> None:
    grid, scan = made
    failed = certify(grid.replace(nodes=grid.nodes + [0, 0, 2.0]), *scan, SETTINGS)
    for certificate in (grid.certificate, failed):
        values = json.loads(json.dumps(known(certificate).to_dict(), allow_nan=False))
        assert Certificate.from_dict(values) == certificate
        assert values["passed"] == certificate.passed and bool(values["faults"]) != certificate.passed
    st.write(grid, tmp_path / "grid.json")
    assert st.read_grid(tmp_path / "grid.json").certificate == grid.certificate


# ---- in the chain --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def plate() -> np.ndarray:
    rng = np.random.default_rng(3)
    return np.column_stack([rng.uniform(0, 20, 6000), rng.uniform(0, 15, 6000), np.zeros(6000)])


@pytest.mark.parametrize("effort", ["quick", "best"])
def test_a_failed_grid_is_kept_where_that_is_asked_for(
    plate: np.ndarray, monkeypatch: pytest.MonkeyPatch, effort: str
) -> None:
    monkeypatch.setattr("scantruss.check.defects.UNEVEN_LENGTHS", -1.0)  # no grid can pass
    monkeypatch.setattr("scantruss.attempts.limit.MOST_RUNS", 2)
    settings = st.Settings(length=1.5, effort=effort)
    with pytest.raises(CertificateError) as refused:
        st.grid_from_points(plate, settings)
    grid = st.grid_from_points(plate, settings, keep_failed=True)
    assert [fault.kind for fault in known(grid.certificate).faults] == ["uneven"]
    assert grid.settings == settings and grid.before is not None and grid.seconds["total"] > 0
    assert grid.nodes.tobytes() == refused.value.grid.nodes.tobytes()


@pytest.mark.parametrize("share", [0.03, 0.08, 0.15])
def test_a_lost_limb_is_a_fault_from_a_twentieth_of_the_scan_on(plate: np.ndarray, share: float) -> None:
    settings = st.Settings(length=1.0, effort="quick")
    reached = 20.0 * (1.0 - share) - 0.5
    grid = st.grid_from_points(plate[plate[:, 0] < reached], settings)
    scan = steps_of(st.PointCloud(plate, np.zeros(3)), settings)[:2]
    grid = grid.replace(nodes=grid.nodes + grid.origin - scan[0].origin, origin=scan[0].origin)
    found = certify(grid, *scan, settings)
    assert found.missing == pytest.approx((plate[:, 0] > reached + 0.5).mean(), abs=0.005)
    assert [fault.kind for fault in found.faults] == (["cover"] if share > 0.05 else [])
    accepted = certify(grid, *scan, settings.replace(allow_missing=0.2))
    assert accepted.passed and accepted.widened == ("allow missing 0.2 instead of 0.05",)


@pytest.mark.parametrize("method", ["default", "paper"])
def test_the_distances_of_the_nodes_of_a_grid_are_those_of_its_certificate(method: str) -> None:
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(-6, 6, 40), np.linspace(-5, 5, 34)))
    points = np.stack([x, y, 4 - 0.5 * np.abs(x)], axis=1)
    grid = st.grid_from_points(points, st.Settings(length=1.5, method=method, effort="quick"))
    assert grid.certificate is not None and grid.certificate.node_distance is not None and grid.deviation is not None
    assert grid.quality.node_deviation_max == np.nanmax(grid.deviation)
    assert grid.certificate.node_distance.largest.value == np.nanmax(grid.deviation)
    assert dict(grid_figures(grid))["node farthest from the scan"] == f"{np.nanmax(grid.deviation):.3g}"
