"""What the certificate warns of: bridged gaps, holes that may be none, boundaries that run zigzag, and what is nearly missed."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial import Delaunay
from small_clouds import sheet
from small_grids import make_grid
from typed import known

import scantruss as st
from scantruss.boundary.find import Boundary, Loop
from scantruss.check.boundaries import boundary_beyond, boundary_left, places_aside, stops_short
from scantruss.check.certify import certify
from scantruss.check.distances import distances_to_grid, measure_distances
from scantruss.check.doubtful import doubtful_places, zigzags
from scantruss.check.gaps import bridged_gaps, is_empty_within
from scantruss.check.limits import places_to_look_at
from scantruss.check.openings import boundary_overrun
from scantruss.check.refusal import passed_grid
from scantruss.cli.shared import follows_both_layers
from scantruss.errors import CertificateError
from scantruss.grid.certificate import Certificate, Fault, LeftOut
from scantruss.report.figures import left_out_lines
from scantruss.scan.cloud import by_x
from scantruss.surface.chosen_samples import KEPT, LIMB, OUTLIER
from scantruss.surface.samples import sample_surface

SETTINGS = st.Settings(length=1.0)
NOTHING = Boundary(())


def lattice(columns: int = 8, rows: int = 8) -> st.Grid:
    """A rhombus of equilateral triangles of length 1 around the origin."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(columns + 1), np.arange(rows + 1), indexing="ij"))
    nodes = np.column_stack([i + j / 2 - columns / 2 - rows / 4, (j - rows / 2) * 0.75**0.5, 0 * i])
    number = np.arange(len(i)).reshape(columns + 1, rows + 1)
    corners = [
        (number[a, b], number[a + 1, b], number[a, b + 1], number[a + 1, b + 1]) for a, b in np.ndindex(columns, rows)
    ]
    return make_grid(nodes, [triangle for a, b, c, d in corners for triangle in ((a, b, c), (b, d, c))])


def scanned(points: np.ndarray, grid: st.Grid) -> tuple[st.SurfaceSamples, st.Grid]:
    """Return the samples of some points, and the grid in their frame."""
    cloud = st.PointCloud.from_array(points)
    return sample_surface(cloud, SETTINGS), grid.replace(nodes=grid.nodes - cloud.origin, origin=cloud.origin)


def gaps_at(points: np.ndarray) -> tuple[list[LeftOut], list[Fault]]:
    """Return the gaps that a plate bridges in a scan."""
    samples, grid = scanned(points, lattice())
    return bridged_gaps(grid, samples, NOTHING, 1.0)


def test_a_slit_that_joins_two_parts_is_listed_and_a_warning_with_its_width_and_place() -> None:
    """Two patches that a long member reaches over: points to grid cannot see it, no point is far."""
    listed, warnings = gaps_at(sheet(13, 8, 0.08, keep=lambda x, _: abs(x) > 0.3))
    (gap,) = listed
    assert gap.kind == "gap" and known(gap.size) > 5.0 and abs(known(gap.where)[0]) < 0.3
    (warning,) = warnings
    assert warning.where == gap.where
    assert float(warning.words.split(" gap ")[1].split()[0]) == pytest.approx(0.6, abs=0.15)


@pytest.mark.parametrize(("half", "kind"), [(0.25, "gap"), (0.45, "gap"), (0.75, "bridged")])
def test_a_bay_much_wider_than_a_member_that_a_grid_bridges_is_a_fault(half: float, kind: str) -> None:
    points = sheet(13, 8, 0.06, keep=lambda x, y: (abs(x) > half) | (y > 0.0))
    listed, (found,) = gaps_at(points)
    assert found.kind == kind and found.where == listed[0].where
    samples, grid = scanned(points, lattice())
    certificate = certify(grid, samples, NOTHING, SETTINGS)
    assert kind in {each.kind for each in (certificate.faults if kind == "bridged" else certificate.warnings)}


def test_a_hole_a_little_wider_than_the_least_is_one_gap_wherever_it_lies() -> None:
    points = sheet(13, 8, 0.04)
    for x, y in np.random.default_rng(2).uniform(-1.0, 1.0, (12, 2)):
        listed, warnings = gaps_at(points[np.hypot(points[:, 0] - x, points[:, 1] - y) > 0.3])
        (gap,) = listed
        assert not warnings
        assert np.hypot(known(gap.where)[0] - x, known(gap.where)[1] - y) < 0.1
        assert 0.45 < known(gap.size) < 0.7


def test_holes_under_triangles_with_a_common_node_are_as_many_gaps() -> None:
    holes = np.array([[-0.5, 0.3], [0.5, 0.3], [0.0, -0.6]])
    listed, _ = gaps_at(
        sheet(
            13,
            8,
            0.04,
            keep=lambda a, b: (np.hypot(a[..., None] - holes[:, 0], b[..., None] - holes[:, 1]) > 0.3).all(-1),
        )
    )
    assert len(listed) == 3


def test_a_hole_inside_is_listed_without_a_warning_and_a_narrow_one_is_nothing() -> None:
    listed, warnings = gaps_at(sheet(13, 8, 0.08, keep=lambda x, y: np.hypot(x - 0.4, y) > 0.4))
    assert [gap.kind for gap in listed] == ["gap"] and not warnings
    assert np.hypot(known(listed[0].where)[0] - 0.4, known(listed[0].where)[1]) < 0.2
    assert gaps_at(sheet(13, 8, 0.08, keep=lambda x, y: np.hypot(x - 0.4, y) > 0.15)) == ([], [])


@pytest.mark.parametrize("seed", range(4))
def test_points_at_random_on_lines_or_ever_sparser_have_no_gaps(seed: int) -> None:
    """A grid of members as short as the points allow: their discs are empty by accident."""
    rng = np.random.default_rng(seed)
    places = rng.uniform([-6.5, -4], [6.5, 4], (3300, 2))
    lines = np.column_stack([rng.uniform(-6.5, 6.5, 9000), 0.45 * rng.integers(-9, 10, 9000)])
    sparser = places[rng.random(len(places)) < np.exp(0.25 * places[:, 0] - 1.7)]
    for flat in (places, lines, sparser):
        assert gaps_at(np.column_stack([flat, 0.01 * rng.normal(size=len(flat))])) == ([], []), seed


def test_a_triangle_off_a_sharp_fold_is_over_no_gap() -> None:
    points = sheet(13, 8, 0.08)
    points[:, 2] = 0.9 - 0.9 * abs(points[:, 0])
    samples, grid = scanned(points, lattice())
    nodes = grid.nodes.copy()
    nodes[:, 2] = np.where(abs(nodes[:, 0] + grid.origin[0]) < 0.7, 0.3, 0.9 - 0.9 * abs(nodes[:, 0] + grid.origin[0]))
    assert bridged_gaps(grid.replace(nodes=nodes), samples, NOTHING, 1.0) == ([], [])


def test_many_gaps_are_five_lines_and_one_for_the_others() -> None:
    middles = [(x, y) for y in (-1.7, 1.7) for x in np.array([-3.0, -1.0, 1.0, 3.0]) + y / 3**0.5]
    points = sheet(13, 8, 0.07)
    away = np.linalg.norm(points[:, None, :2] - middles, axis=2).min(axis=1)
    points = points[away > 0.42]
    samples, grid = scanned(points, lattice())
    found = certify(grid, samples, NOTHING, SETTINGS)
    lines = [line for line in left_out_lines(found) if "gap" in line]
    assert (
        len(lines) == 6
        and lines[0].startswith("gap bridged, near (")
        and lines[-1].startswith("3 more gaps bridged, up to ")
    )


def without_node(grid: st.Grid, node: int) -> st.Grid:
    """Return a grid with a hole at a node."""
    return grid.replace(triangles=grid.triangles[~(grid.triangles == node).any(axis=1)])


def test_a_hole_of_the_scan_is_none_to_doubt_but_one_between_sparse_points_or_left_out_ones_is() -> None:
    whole = lattice()
    node = int(np.linalg.norm(whole.nodes, axis=1).argmin())
    middle = whole.nodes[node, :2]
    holed = without_node(whole, node)
    true = sheet(13, 8, 0.08, keep=lambda x, y: np.hypot(x - middle[0], y - middle[1]) > 0.8)
    sparse = sheet(13, 8, 0.4, keep=lambda x, y: np.hypot(x - middle[0], y - middle[1]) > 0.5)
    samples, grid = scanned(true, holed)
    assert doubtful_places(grid, samples, 1.0) == []
    samples, grid = scanned(sparse, holed)
    (warning,) = doubtful_places(grid, samples, 1.0)
    assert warning.kind == "hole" and "may be none" in warning.words
    assert np.linalg.norm(np.array(known(warning.where))[:2] - middle) < 0.05
    inside = sheet(1.2, 1.2, 0.12, keep=lambda x, y: np.hypot(x, y) < 0.55) + [*middle, 0.05]
    turn, height = np.random.default_rng(5).uniform([[0.0], [-2.0]], [[2.0 * np.pi], [2.0]], (2, 900))
    mast = np.column_stack([0.08 * np.cos(turn), 0.08 * np.sin(turn), height]) + [*middle, 0.0]
    for more, doubted in (
        (inside, True),
        (inside[::12], False),
        (mast, False),
    ):  # a few strays, or a mast, do not fill it
        samples, grid = scanned(np.concatenate([true, more]), holed)
        near = np.linalg.norm(samples.scan[:, :2] + samples.origin[:2] - middle, axis=1) < 0.6
        judged = np.where(near, OUTLIER, samples.judged).astype(np.uint8)
        found = doubtful_places(grid, replace(samples, judged=judged), 1.0)
        assert [warning.words for warning in found] == ["has a hole where points were left out"] * doubted


def test_a_hole_in_which_the_scan_goes_on_is_said_but_a_true_one_and_one_over_another_sheet_are_not() -> None:
    """As where the front tears a leg hardly wider than its members open; a second sheet lies under a hole, and the grid follows it."""
    whole = lattice()
    node = int(np.linalg.norm(whole.nodes, axis=1).argmin())
    middle, holed = whole.nodes[node], without_node(whole, node)
    for points, grid, count in (
        (sheet(13, 8, 0.08), holed, 1),
        (sheet(13, 8, 0.08), whole, 0),
        (sheet(13, 8, 0.08, keep=lambda x, y: np.hypot(x - middle[0], y - middle[1]) > 0.8), holed, 0),
    ):
        samples, grid = scanned(points, grid)
        off = distances_to_grid(samples.scan, grid, 1.0)[0]
        found = doubtful_places(grid, samples, 1.0, off_grid=off)
        assert [warning.words for warning in found] == [
            "has a hole where the scan has none; shorter members close it"
        ] * count
        for warning in found:
            assert np.linalg.norm(np.array(known(warning.where))[:2] - middle[:2]) < 0.05
    below = sheet(13, 8, 0.08) - [0.0, 0.0, 0.4]
    true = sheet(13, 8, 0.08, keep=lambda x, y: np.hypot(x - middle[0], y - middle[1]) > 0.8)
    samples, grid = scanned(np.concatenate([true, below]), holed)
    away = np.abs(samples.scan[:, 2] + samples.origin[2])
    followed = np.minimum(away, np.abs(away - 0.4))
    found = doubtful_places(grid, samples, 1.0, off_grid=followed)
    assert not any("where the scan has none" in warning.words for warning in found)


@pytest.mark.parametrize(("sheets", "both"), [([0.0], False), ([0.2], False), ([0.0, 0.4], True)])
def test_two_layers_are_said_but_of_a_grid_that_follows_both(sheets: list[float], both: bool) -> None:
    """A grid on one of two sheets .4 members apart, one between them, and one of both, as of a mug's wall."""
    points = np.concatenate([sheet(3.5, 5, 0.08), sheet(3.5, 5, 0.08) + [0.0, 0.0, 0.4]])
    samples, grid = scanned(points, lattice())
    nodes = np.concatenate([grid.nodes * [1, 1, 0] + [0.0, 0.0, z - samples.origin[2]] for z in sheets])
    triangles = np.concatenate([grid.triangles + k * len(grid.nodes) for k in range(len(sheets))])
    made = grid.replace(nodes=nodes, triangles=triangles, fixed=np.zeros(len(nodes), np.bool_))
    assert follows_both_layers(certify(made, samples, NOTHING, SETTINGS), 0.4, 0.9) == both


def test_teeth_are_a_zigzag_and_straight_sides_corners_and_a_step_are_none() -> None:
    grid = lattice()
    assert not len(zigzags(grid))
    number = np.arange(len(grid.triangles))
    x, y, _ = grid.nodes[grid.triangles].mean(axis=1).T
    step = grid.replace(triangles=grid.triangles[(x + y / 3**0.5 < 0.1) | (y < 1.8)])
    assert not len(zigzags(step))
    teeth = grid.replace(triangles=grid.triangles[(number % 2 == 0) | (y < y.max() - 0.7)])
    found = zigzags(teeth)
    assert 1 <= len(found) <= 4 and (teeth.nodes[found, 1] > 2.5).all()
    gables = teeth.nodes[teeth.boundary_loops[0]]  # where the scan has corners there, they are its gables
    assert not len(zigzags(teeth, gables, 1.0))
    assert len(zigzags(teeth, gables - [0.0, 0.3, 0.0], 1.0)) == len(found)
    highest = teeth.nodes[:, 1] > y.max() + 0.1
    spiked = teeth.replace(nodes=teeth.nodes + highest[:, None] * [0.0, 0.6, 0.0])  # no gable is as sharp
    assert len(zigzags(spiked, spiked.nodes[spiked.boundary_loops[0]], 1.0))


def test_more_than_one_percent_missed_by_half_a_member_is_a_warning_with_its_place() -> None:
    points = sheet(13, 7, 0.08, keep=lambda x, y: abs(x - y / 3**0.5) < 4.2)
    points[:, 2] = 0.8 * np.exp(-((points[:, 0] / 1.2) ** 2 + (points[:, 1] / 1.2) ** 2))
    samples, grid = scanned(points, lattice())
    found = certify(grid, samples, NOTHING, SETTINGS)
    (warning,) = (warning for warning in found.warnings if warning.kind == "missed")
    assert (
        warning.words == f"misses {found.missing:.1%} of the points by more than half a member" and found.missing > 0.01
    )
    assert np.hypot(*known(warning.where)[:2]) < 0.9
    small = replace(found, missing=0.009)
    assert "missed" not in {warning.kind for warning in places_to_look_at(small, (0.0, 0.0, 0.0))}


def test_what_is_rounded_off_by_a_quarter_of_a_member_is_a_warning() -> None:
    points = sheet(13, 7, 0.08, keep=lambda x, y: abs(x - y / 3**0.5) < 4.2)
    points[:, 2] = 0.4 * np.exp(-((points[:, 0] / 1.2) ** 2 + (points[:, 1] / 1.2) ** 2))
    samples, grid = scanned(points, lattice())
    share = (np.abs(points[:, 2]) > 0.25).mean()  # all of the bump is nearer than half a member
    found = certify(grid, samples, NOTHING, SETTINGS)
    (warning,) = (warning for warning in found.warnings if warning.kind == "rounded")
    assert warning.words.startswith(f"rounds off {share:.0%} of the points by more than a quarter")
    assert np.hypot(*known(warning.where)[:2]) < 0.5
    points[:, 2] *= 0.6
    samples, grid = scanned(points, lattice())
    assert "rounded" not in {warning.kind for warning in certify(grid, samples, NOTHING, SETTINGS).warnings}


def test_what_a_grid_of_the_mean_surface_rounds_off_is_said_as_far_as_it_is_no_roughness() -> None:
    points = sheet(13, 8, 0.08)
    points[:, 2] += 0.4 * np.exp(-(points[:, 0] ** 2 + points[:, 1] ** 2) / 2.0)
    samples, grid = scanned(points, lattice())
    bump = replace(samples, moved=1.0)
    assert "rounded" in {warning.kind for warning in certify(grid, bump, NOTHING, SETTINGS).warnings}
    rough = sheet(13, 8, 0.08)
    rough[:, 2] += np.random.default_rng(4).choice([-0.28, 0.28], len(rough))
    samples, grid = scanned(rough, lattice())
    assert "rounded" in {fault.kind for fault in certify(grid, samples, NOTHING, SETTINGS).faults}  # all points
    smooth = certify(grid, replace(samples, moved=1.0), NOTHING, SETTINGS)
    assert "rounded" not in {each.kind for each in (*smooth.faults, *smooth.warnings)}


def test_what_a_grid_of_the_mean_surface_cuts_off_is_said_in_full_where_most_of_the_scan_is_bent() -> None:
    """Waves that are smoothed away scatter the points around the nodes, but they are no roughness."""
    points = sheet(13, 8, 0.08)
    points[:, 2] += 0.45 * np.sin(3.0 * points[:, 0]) * np.sin(3.0 * points[:, 1])
    samples, grid = scanned(points, lattice())
    found = certify(grid, replace(samples, moved=1.0), NOTHING, SETTINGS)
    (warning,) = (warning for warning in found.warnings if warning.kind == "rounded")
    said, share = int(re.findall(r"rounds off (\d+)%", warning.words)[0]), 100 * (np.abs(points[:, 2]) > 0.25).mean()
    assert 0.8 * share < said < 1.2 * share
    assert known(found.node_scatter) > 0.05  # by which nearly all of that was taken for scatter


def test_the_stub_of_a_limb_that_was_cut_off_is_rounded_off() -> None:
    """It lies so near to the grid that it is not left out, and was in no figure at all."""
    points = sheet(13, 8, 0.08)
    samples, grid = scanned(points, lattice())
    scan, stub = samples.scan.copy(), np.linalg.norm(samples.scan[:, :2], axis=1) < 1.5
    scan[stub, 2] += 0.4
    cut = replace(samples, scan=scan, judged=np.where(stub, LIMB, KEPT).astype(np.uint8))
    said = [
        int(re.findall(r"rounds off (\d+)%", each.words)[0])
        for one in (samples, cut)
        for each in certify(grid, one, NOTHING, SETTINGS).warnings
        if each.kind == "rounded"
    ]
    assert said[1] - said[0] == pytest.approx(100.0 * stub.mean(), abs=1.0)


def bounded(grid: st.Grid) -> Boundary:
    """The boundary of a rhombus, with a point every twentieth of a member and a corner at each of its own."""
    (ring,) = grid.boundary_loops
    shares = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None, None]
    nodes = grid.nodes[ring]
    points = ((1.0 - shares) * nodes + shares * np.roll(nodes, -1, axis=0)).transpose(1, 0, 2).reshape(-1, 3)
    before, after = nodes - np.roll(nodes, 1, axis=0), np.roll(nodes, -1, axis=0) - nodes
    corner_at = 20 * np.flatnonzero((before * after).sum(axis=1) < 0.9)
    assert len(corner_at) == 4
    return Boundary((Loop(points, corner_at, external=True, length=float(len(ring)), piece=0),))


def test_a_boundary_that_leaves_the_scans_is_a_warning_with_its_places() -> None:
    grid = lattice()
    boundary = bounded(grid)
    assert not places_aside(grid, boundary, 1.0)
    (ring,) = grid.boundary_loops
    corner_nodes = [int(v) for v in ring if (np.linalg.norm(boundary.corners - grid.nodes[v], axis=1) < 1e-9).any()]
    v = next(int(v) for v in ring if np.linalg.norm(grid.nodes[corner_nodes] - grid.nodes[v], axis=1).min() > 2.0)
    inward = -grid.nodes[v] / np.linalg.norm(grid.nodes[v])
    for way in (0.4 * inward, -0.4 * inward, [0.0, 0.0, 0.4]):
        nodes = grid.nodes.copy()
        nodes[v] += way
        (warning,) = places_aside(grid.replace(nodes=nodes), boundary, 1.0)
        off = float(warning.words.removeprefix("leaves the boundary of the scan by ").split()[0])
        assert warning.kind == "aside" and 0.3 <= off <= 0.4 and not warning.also
        assert np.linalg.norm(np.array(warning.where) - grid.nodes[v]) < 0.5


def test_the_ring_of_a_limb_that_a_cap_closes_is_no_boundary_that_a_grid_leaves() -> None:
    grid = lattice()
    (outer,) = bounded(grid).loops
    turn = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    ring = np.column_stack([0.4 * np.cos(turn), 0.4 * np.sin(turn), 0.0 * turn])
    for cut, said in (("close", False), ("open", True), ("", True)):
        limb = Loop(ring, np.zeros(0, np.int64), external=False, length=2.5, piece=0, cut=cut)
        assert bool(places_aside(grid, Boundary((outer, limb)), 1.0)) == said


def test_a_grid_that_runs_beyond_the_scan_fails_and_one_that_stops_short_of_it_does_not() -> None:
    """Over a bay from its edge, and out to a point beyond it; with fewer points, the rest is missed."""
    for spoil, fails in (("nothing", False), ("bay", True), ("spike", True), ("short", False)):
        grid = lattice()
        boundary = bounded(grid)
        (loop,), points = boundary.loops, sheet(13, 8, 0.08)
        if spoil == "bay":
            x, y, _ = loop.points.T
            points = points[np.hypot(points[:, 0], points[:, 1] + 4.0 * 0.75**0.5) > 1.5]
            inside = np.hypot(x, y + 4.0 * 0.75**0.5) < 1.5
            turn = np.linspace(np.pi, 0.0, int(inside.sum()))
            bay = loop.points.copy()
            bay[inside] = np.column_stack([1.5 * np.cos(turn), 1.5 * np.sin(turn) - 4.0 * 0.75**0.5, 0.0 * turn])
            boundary = Boundary((replace(loop, points=bay),))
        if spoil == "spike":
            (ring,) = grid.boundary_loops
            v = next(int(v) for v in ring if abs(grid.nodes[v, 0]) < 0.6 and grid.nodes[v, 1] < -3.0)
            grid = grid.replace(nodes=grid.nodes - np.outer(np.arange(len(grid.nodes)) == v, [0.0, 3.0, 0.0]))
            boundary = bounded(lattice())
        if spoil == "short":
            sharp = next(int(v) for v in grid.boundary_loops[0] if (grid.triangles == v).sum() == 1)
            grid = grid.replace(triangles=grid.triangles[~(grid.triangles == sharp).any(axis=1)])
        samples, moved = scanned(points, grid)
        shifted = Boundary(tuple(replace(each, points=each.points - moved.origin) for each in boundary.loops))
        found = boundary_beyond(moved, samples, shifted, 1.0)
        assert bool(found) == fails, spoil
        if fails:
            assert abs(known(found[0].where)[0]) < 2.0 and known(found[0].where)[1] < -1.5
            assert found[0].words.startswith("runs beyond the boundary of the scan by ")


def test_points_beyond_the_boundary_are_a_warning_however_few_but_strays_are_none() -> None:
    """The boundary that is found goes by them too, as through a bay where points are sparse at random."""
    grid, shape = lattice(), np.array([0.5, 0.75**0.5])
    points = sheet(13, 8, 0.06, keep=lambda x, y: (abs(x - y / 3**0.5) < 4.0) & (abs(y) < 4.0 * 0.75**0.5))
    beyond = np.array([[0.0, 0.0], [0.08, 0.05], [0.02, 0.1]]) + shape * [0.0, 4.0] + [0.3, 0.22]
    for more, said in (
        (beyond, True),
        (beyond[:2], False),
        (beyond * [1.0, 1.3] + [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], False),
    ):
        samples, moved = scanned(np.concatenate([points, np.column_stack([more, 0.0 * more[:, 0]])]), grid)
        found = measure_distances(moved, samples, 1.0)
        chosen, members = np.ones(len(samples.scan), np.bool_), np.ones(len(samples.scan))
        warnings = stops_short(moved, samples, found, chosen, members, [])
        assert bool(warnings) == said
        if said:
            assert warnings[0].words == "stops short of the scan at its boundary by 0.32 members"
            assert known(warnings[0].where)[:2] == pytest.approx(tuple(more[2]))
            aside = [Fault("aside", "", warnings[0].where)]
            assert not stops_short(moved, samples, found, chosen, members, aside)


def test_an_opening_that_is_mostly_bridged_is_a_fault_and_one_that_members_cut_across_is_none() -> None:
    grid = lattice()
    (outer,) = bounded(grid).loops
    node = int(np.linalg.norm(grid.nodes, axis=1).argmin())
    turn = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    ring = grid.nodes[node] + 0.95 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    boundary = Boundary((outer, Loop(ring, np.zeros(0, np.int64), external=False, length=6.0, piece=0)))
    around = np.flatnonzero((grid.triangles == node).any(axis=1))
    shared = [(a, b) for a in around for b in around if a < b and len({*grid.triangles[a]} & {*grid.triangles[b]}) == 2]
    assert boundary_overrun(without_node(grid, node), boundary, 1.0) == []
    partly = grid.replace(triangles=np.delete(grid.triangles, shared[0], axis=0))
    (fault,) = boundary_overrun(partly, boundary, 1.0)
    assert fault.words == "bridges 70% of an opening 1.9 mm across"
    assert np.linalg.norm(np.array(known(fault.where)) - grid.nodes[node]) == pytest.approx(0.95)
    samples, same = scanned(sheet(13, 8, 0.08), partly)
    moved = Boundary(tuple(replace(loop, points=loop.points - same.origin) for loop in boundary.loops))
    assert "beyond" in {fault.kind for fault in certify(same, samples, moved, SETTINGS).faults}


@pytest.mark.parametrize(("wide", "fails"), [(0.8, False), (1.6, True)])
def test_a_grid_that_runs_beyond_more_than_a_member_of_the_boundary_fails(wide: float, fails: bool) -> None:
    grid = lattice()
    (loop,) = bounded(grid).loops
    points = loop.points.copy()
    x, y, _ = points.T
    way = np.where((y > 3.4) & (abs(x - 2.0) < 0.5 * wide), 0.85, 0.0)
    points[:, 1] -= way
    found = boundary_overrun(grid, Boundary((replace(loop, points=points),)), 1.0)
    assert [fault.words.split(",")[0] for fault in found] == [
        "runs beyond the boundary of the scan by 0.85 members"
    ] * fails
    points[:, 1] += 2.0 * way  # where it stops short, the share that it misses decides
    assert boundary_overrun(grid, Boundary((replace(loop, points=points),)), 1.0) == []


def test_what_is_listed_as_left_out_is_not_warned_of_twice() -> None:
    base = Certificate("", 0.5, True, True, 1, 1, 1, 1, 1, 0, missing=0.029)
    assert [each.kind for each in places_to_look_at(base, (0.0, 0.0, 0.0))] == ["missed"]
    limb = replace(base, left_out=(LeftOut("limbs", 290, 0.029, (0.0, 0.0, 0.0), 8.0, 8.0),))
    assert [each.kind for each in places_to_look_at(limb, (0.0, 0.0, 0.0))] == ["left out"]
    more = replace(limb, missing=0.041)
    missed = places_to_look_at(more, (0.0, 0.0, 0.0))[0]
    assert missed.words == "misses 1.2% of the points by more than half a member"


def test_a_grid_that_leaves_the_boundary_all_along_is_a_fault() -> None:
    """As where its edge runs to and fro over a rounded lip; a few places are a warning."""
    grid = lattice()
    boundary = bounded(grid)
    assert not boundary_left(grid, boundary, 1.0)
    (around,) = grid.boundary_loops
    for count in (len(around), 8):
        nodes = grid.nodes.copy()
        nodes[around[:count:2], 2] += 0.4
        found = boundary_left(grid.replace(nodes=nodes), boundary, 1.0)
        assert bool(places_aside(grid.replace(nodes=nodes), boundary, 1.0))
        assert [fault.kind for fault in found] == (["beyond"] if count == len(around) else [])
        assert all(f"of its {len(around)} members, by up to 0.4" in fault.words for fault in found)


def test_a_corner_that_is_cut_off_is_a_warning_with_its_place() -> None:
    grid = lattice()
    boundary = bounded(grid)
    (ring,) = grid.boundary_loops
    sharp = next(int(v) for v in ring if (grid.triangles == v).sum() == 1)
    cut = grid.replace(triangles=grid.triangles[~(grid.triangles == sharp).any(axis=1)])
    found = {warning.kind: warning for warning in places_aside(cut, boundary, 1.0)}
    assert found.keys() == {"aside", "cut"}
    for warning in found.values():
        assert warning.where == pytest.approx(tuple(grid.nodes[sharp]))
    assert found["cut"].words == "cuts off a corner of the boundary by 1.00 members"
    assert found["aside"].words == f"leaves the boundary of the scan by {0.75**0.5:.2f} members"
    samples, same = scanned(sheet(13, 8, 0.08), grid)
    moved = Boundary(tuple(replace(loop, points=loop.points - same.origin) for loop in boundary.loops))
    kinds = [
        warning.kind
        for warning in certify(cut.replace(nodes=same.nodes, origin=same.origin), samples, moved, SETTINGS).warnings
    ]
    assert {"aside", "cut"} <= set(kinds)


def test_a_refusal_names_the_setting_that_accepts_it_only_where_that_is_enough() -> None:
    grid = lattice()
    base = Certificate("", 0.5, True, True, 1, 1, 1, 1, 1, 0)
    cover, angle, short = (
        Fault("cover", "leaves out 12.1% of the scan"),
        Fault("angle", "has an angle"),
        Fault("short", "is short"),
    )
    for faults, missing, said in (
        ((cover,), 0.121, "the grid leaves out 12.1% of the scan; --allow-missing 0.13 accepts that"),
        (
            (cover,),
            0.6,
            "the grid leaves out 12.1% of the scan; choose the part that is wanted with --crop or --piece; --keep-failed",
        ),
        (
            (angle, short, cover),
            0.121,
            "the grid has an angle, is short and leaves out 12.1% of the scan; --keep-failed gives it",
        ),
        (
            (angle, short, cover, angle),
            0.121,
            "the grid has an angle, is short, leaves out 12.1% of the scan and has an angle;",
        ),
        (
            (angle, short, cover, angle, angle),
            0.121,
            "the grid has an angle, is short and leaves out 12.1% of the scan, and has 2 other faults;",
        ),
    ):
        found = replace(base, faults=faults, missing=missing)
        with pytest.raises(CertificateError) as refused:
            passed_grid(grid.replace(certificate=found))
        assert str(refused.value).startswith(said)


def test_points_that_are_listed_as_far_or_as_limbs_are_not_said_to_be_missed_again() -> None:
    found = Certificate("mm", 1.0, True, True, 1, 1, 1, 1, 1, 0, points=10_000)
    far = LeftOut("far", 1940, 0.194, (1.0, 2.0, 3.0), 5.0, 1720.0)
    for missing, said in ((0.2, []), (0.23, ["misses 3.6% of the points by half a member to a member"])):
        warnings = places_to_look_at(replace(found, missing=missing, left_out=(far,)), (0.0, 0.0, 0.0))
        assert [warning.words for warning in warnings if warning.kind == "missed"] == said
        assert warnings[0].words == "misses 1,940 points (19.40%) by up to 1,720 mm"
    limbs = replace(far, kind="limbs")
    (only,) = places_to_look_at(replace(found, missing=0.2, left_out=(limbs,)), (0.0, 0.0, 0.0))
    assert only.kind == "left out"


def test_the_verdict_says_how_much_was_left_out_as_asked_for() -> None:
    crop = LeftOut("outside the box", 13_856, 0.2716, (1.0, 2.0, 3.0), 1460.0, asked=True)
    found = Certificate("mm", 1.0, True, True, 1, 1, 1, 1, 1, 0, points=37_161, left_out=(crop,))
    assert "27.16% of the scan left out as asked for" in str(found)
    assert left_out_lines(found) == [
        "left out: 13,856 points (27.16%) outside the box, near (1, 2, 3), 1,460 mm across, as asked for"
    ]
    assert "asked" not in str(replace(found, left_out=()))
    nowhere = LeftOut("with NaN or infinite coordinates", 120, 0.01, asked=True)  # which nobody asked for
    only = replace(found, left_out=(nowhere,))
    assert "asked" not in str(only) + left_out_lines(only)[0]


def test_a_corner_where_no_scan_is_cannot_be_cut_off() -> None:
    """It was guessed from the sides of a bow. At a corner that the scan has, the same is a warning."""
    grid = lattice()
    boundary = bounded(grid)
    (loop,) = boundary.loops
    points, at = loop.points.copy(), int(loop.corner_at[0])
    points[at] *= 1.0 + 0.5 / np.linalg.norm(points[at])
    guessed = Boundary((replace(loop, points=points),))
    for scan, said in ((loop.points, False), (points, True)):
        known_of_scan = {"measured_points": scan, "spacing": 0.02, "surface": SimpleNamespace(points=None)}
        samples = cast(
            Any, type("Scan", (), known_of_scan)()
        )  # unlike a namespace something that boxes can be kept for
        assert bool(places_aside(grid, guessed, 1.0, samples)) == said


def test_a_place_where_members_cut_off_an_acute_edge_is_no_gap() -> None:
    """Between two sides of a wedge at 60 degrees and its end, where their edge is cut off, a disc is free of points."""
    slope, cut = np.tan(np.radians(30.0)), 1.2
    x, z = (each.ravel() for each in np.meshgrid(np.arange(0.0, 4.0, 0.05), np.arange(-5.0, 0.6, 0.05)))
    sides = [np.column_stack([x, side * slope * x, z]) for side in (-1.0, 1.0)]
    x, y = (each.ravel() for each in np.meshgrid(np.arange(0.0, 4.0, 0.05), np.arange(-3.0, 3.0, 0.05)))
    end = np.column_stack([x, y, np.full(len(x), 0.6)])[np.abs(y) < slope * x]
    chains = [(cut + 0.9, -1.0, 0.5), (cut, -1.0, 0.0), (cut, 1.0, 0.5), (cut + 0.9, 1.0, 0.0)]
    nodes = np.array([[x, side * slope * x, z + more] for x, side, more in chains for z in range(-3, 4)])
    number = np.arange(28).reshape(4, 7)
    triangles = []
    for one, two in zip(number[:-1], number[1:], strict=True):
        first, second = (one, two) if nodes[one[0], 2] < nodes[two[0], 2] else (two, one)
        for k in range(6):
            pair = [(first[k], first[k + 1], second[k]), (first[k + 1], second[k + 1], second[k])]
            triangles += pair if first is one else [each[::-1] for each in pair]
    samples, grid = scanned(np.concatenate([*sides, end]), make_grid(nodes, triangles))
    assert bridged_gaps(grid, samples, NOTHING, 1.0)[0] == []


@pytest.mark.parametrize("seed", [2, 4, 10])
def test_the_emptiest_places_among_random_points_are_no_openings(seed: int) -> None:
    """The circles through three points with none inside, of 40,000 in a square; and one in which points were taken away."""
    rng, turn = np.random.default_rng(seed), np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    points = rng.uniform(size=(40000, 2))
    a, b, c = points[Delaunay(points).simplices].transpose(1, 0, 2)
    normals = 2.0 * np.stack([b - a, c - a], axis=1)
    middles = a + np.linalg.solve(normals, 0.25 * (normals**2).sum(axis=2)[..., None])[..., 0]
    radii = np.linalg.norm(middles - a, axis=1)
    within = (np.abs(middles - 0.5) < 0.45).all(axis=1)
    emptiest = np.argsort(np.where(within, radii, 0.0))[-3:]
    curves = middles[emptiest, None] + 1.05 * radii[emptiest, None, None] * np.column_stack(
        [np.cos(turn), np.sin(turn)]
    )
    flat = np.column_stack([points, np.zeros(len(points))])
    for curve in curves:
        around = np.column_stack([curve, np.zeros(len(curve))])
        assert not is_empty_within(around, by_x(flat))
        middle = around.mean(axis=0)
        wide = middle + 2.0 * (around - middle)
        away = np.linalg.norm(flat - middle, axis=1)
        assert is_empty_within(wide, by_x(flat[away > 0.95 * np.linalg.norm(wide - middle, axis=1).min()]))


def test_an_empty_place_in_a_sparse_part_is_no_opening() -> None:
    """A disc of radius 1 without points: all around dense ones, or on one half hardly any, or there the boundary of the scan."""
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-5.0, 5.0, (4000, 2)), np.zeros(4000)])
    points = by_x(points[np.hypot(*points[:, :2].T) > 1.0])
    sparse = points[(points[:, 0] < 0.0) | (np.arange(len(points)) % 30 == 0)]
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    curve = 1.05 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    nowhere = np.zeros((0, 3))
    assert is_empty_within(curve, points, nowhere) and is_empty_within(curve, sparse)
    assert not is_empty_within(curve, sparse, nowhere)
    assert is_empty_within(curve, sparse, np.array([[1.2, 0.0, 0.0]]))
