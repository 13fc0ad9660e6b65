"""What quads and hexagons keep, as triangles do: fixed nodes, fixed lines, ridges and length fields; and panels that are no panels."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from marks import compiled_only
from test_quads import bowl

import scantruss as st
from scantruss.cells.collapse import LatticeMesh
from scantruss.cells.hexagons import dual_of
from scantruss.cells.lead import Panels
from scantruss.cells.quad_moves import Moves
from scantruss.cells.row_lengths import row_lengths
from scantruss.constraints.network import curves_of
from scantruss.grid.grid import Grid
from scantruss.grid.panels import inner_angles_of, planarity_of, table_of, triangles_of
from scantruss.improve.working_mesh import WorkingMesh
from scantruss.kernels.cells.quads import FREE_NODE, RESTING_NODE, SLIDING_NODE
from scantruss.scan.cloud import PointCloud
from scantruss.surface.samples import sample_surface

LENGTHS = {"quad": 1.5, "hexagon": 1.1}


def height(x: float, y: float) -> float:
    return 2.0 - 0.02 * (x * x + y * y)


def made(cells: str, points: np.ndarray | None = None, **others: Any) -> Grid:
    points = bowl(False) if points is None else points
    if "length_field" not in others:
        others["length"] = LENGTHS[cells]
    return st.grid_from_points(points, st.Settings(cells=cells, effort="quick", unit="m", **others))


@compiled_only
@pytest.mark.parametrize("cells", ["quad", "hexagon"])
def test_a_node_is_at_each_fixed_position(cells: str) -> None:
    places = [[x, y, height(x, y)] for x, y in ((1.3, 0.4), (-3.0, 2.2), (8.0, 1.0))]  # the last is on the boundary
    grid = made(cells, fixed=places)
    away = np.linalg.norm(grid.scan_nodes[None] - np.array(places)[:, None], axis=2)
    assert away.min(axis=1).max() < 1e-9 and grid.fixed.sum() == 3
    on_boundary = np.unique(grid.edges[grid.edge_uses == 1])
    assert away[2].argmin() in on_boundary and away[0].argmin() not in on_boundary


@compiled_only
@pytest.mark.parametrize("cells", ["quad", "hexagon"])
def test_a_fixed_line_becomes_a_chain_of_members(cells: str) -> None:
    line = [[x, 0.3 * x + 0.5, height(x, 0.3 * x + 0.5)] for x in np.linspace(-4.5, 5.0, 40)]
    grid = made(cells, fixed_lines=[line])
    nodes = grid.scan_nodes[grid.lines]
    assert np.abs(nodes[:, :, 1] - 0.3 * nodes[:, :, 0] - 0.5).max() < 0.05 * LENGTHS[cells]
    along = np.linalg.norm(nodes[:, 0] - nodes[:, 1], axis=1).sum()
    assert along == pytest.approx(float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum()), rel=0.01)
    (found,) = grid.line_sets
    assert len(found.nodes) == len(grid.lines) + 1 and grid.topology.euler == 1


@compiled_only
@pytest.mark.parametrize("cells", ["quad", "hexagon"])
def test_a_ridge_is_a_chain_of_members(cells: str) -> None:
    plan = np.random.default_rng(2).uniform((-6.0, -5.0), (6.0, 5.0), (16_000, 2))
    grid = made(cells, np.column_stack([plan, 6.0 - np.abs(plan[:, 0])]))
    nodes = grid.scan_nodes[np.unique(grid.lines)]
    assert np.abs(nodes[:, 0]).max() < 0.05 and np.ptp(nodes[:, 1]) > 9.8
    across = (grid.scan_nodes[grid.edges][:, :, 0].prod(axis=1) < -0.1).sum()
    assert across == 0  # no member goes through the ridge


@compiled_only
def test_quads_follow_a_length_field() -> None:
    field = [[-8.0, 0.0, height(-8, 0), 1.0], [8.0, 0.0, height(8, 0), 2.0]]
    grid = made("quad", length_field=field)
    middle = grid.scan_nodes[grid.edges][:, :, 0].mean(axis=1)
    short, long = grid.lengths[middle < -5.0].mean(), grid.lengths[middle > 5.0].mean()
    assert long > 1.3 * short and grid.desired is not None
    assert (grid.lengths / grid.desired[grid.edges].mean(axis=1)).std() < 0.16


def test_the_dual_is_cut_along_a_line_and_goes_on_around_its_end() -> None:
    size = 4
    at = np.array([(x + 0.5 * y, y * 3**0.5 / 2, 0.0) for y in range(-size, size + 1) for x in range(-size, size + 1)])
    wide = 2 * size + 1
    cell = np.array([x + wide * y for y in range(wide - 1) for x in range(wide - 1)])
    triangles = np.concatenate(
        [np.stack([cell, cell + 1, cell + wide], axis=1), np.stack([cell + 1, cell + wide + 1, cell + wide], axis=1)]
    )
    row = size * wide
    line = np.array([(row + x, row + x + 1) for x in range(2, 6)])  # ends inside
    plain = Grid(nodes=at, triangles=triangles, fixed=np.zeros(len(at), bool), origin=np.zeros(3))
    dual = dual_of(plain.replace(lines=line), np.zeros((0, 3)), 1e-6)
    assert np.abs(dual.nodes[dual.lines][:, :, 1]).max() == 0.0
    assert np.ptp(dual.nodes[dual.lines][:, :, 0]) == pytest.approx(4.0) and len(dual.lines) == 5
    surface = plain.replace(
        nodes=dual.nodes, triangles=triangles_of(dual.nodes, dual.panels), panels=dual.panels,
        fixed=np.zeros(len(dual.nodes), bool),
    )  # fmt: skip
    assert surface.topology == plain.topology
    members = np.bincount(surface.edges.ravel(), minlength=len(dual.nodes))
    ends = np.flatnonzero(np.bincount(dual.lines.ravel(), minlength=len(dual.nodes)) == 1)
    assert (members[ends] == 3).all()


def test_a_hollow_panel_has_an_angle_above_180() -> None:
    nodes = np.array([(0, 0, 0), (2, 0, 0), (0.5, 0.5, 0), (0, 2, 0.0)], float)
    angles = inner_angles_of(nodes, table_of([[0, 1, 2, 3]]))
    assert angles.sum() == pytest.approx(360.0) and angles[0, 2] > 180.0 > angles[0, [0, 1, 3]].max()


def plate_with_a_panel_too_many() -> tuple[Any, int]:
    """Two rows of four squares; a node of the boundary is three, with a panel of their own between them and the node above."""
    places = [(x, y) for y in (0.0, 1.0, 2.0) for x in (0.0, 1.0, 2.0, 3.0, 4.0)] + [(2.2, 0.0), (2.4, 0.0)]
    quads = [[5 * j + i, 5 * j + i + 1, 5 * j + i + 6, 5 * j + i + 5] for j in (0, 1) for i in range(4)]
    quads[2][0] = 16
    quads.append([2, 15, 16, 7])
    around = [0, 1, 2, 15, 16, 3, 4, 9, 14, 13, 12, 11, 10, 5]
    held = np.full(17, FREE_NODE)
    held[around], held[[0, 4, 10, 14]] = SLIDING_NODE, RESTING_NODE
    mesh = SimpleNamespace(
        nodes=np.array([(x, y, 0.0) for x, y in places]),
        quads=quads,
        at=[{q for q, ring in enumerate(quads) if v in ring} for v in range(17)],
        held=held,
        chains={(min(a, b), max(a, b)) for a, b in zip(around, [*around[1:], 0], strict=True)},
        free=[],
        live=lambda: np.array(quads),
    )  # fmt: skip
    return mesh, len(quads) - 1


def test_a_panel_with_a_node_of_the_boundary_to_itself_goes_with_that_node() -> None:
    mesh, last = plate_with_a_panel_too_many()
    move = Moves(mesh).collapse(last, 0)
    assert move is not None and move.pair == (2, 16) and move.growth == -1
    rings = {**dict(enumerate(mesh.quads)), **move.quads}
    assert [ring for ring in rings.values() if ring] == [
        [5 * j + i, 5 * j + i + 1, 5 * j + i + 6, 5 * j + i + 5] for j in (0, 1) for i in range(4)
    ]
    around = [0, 1, 2, 3, 4, 9, 14, 13, 12, 11, 10, 5]
    chain = {(min(a, b), max(a, b)) for a, b in zip(around, [*around[1:], 0], strict=True)}
    assert (mesh.chains - move.cut) | move.tied == chain


def test_a_corner_between_two_nodes_of_the_boundary_stays() -> None:
    mesh, last = plate_with_a_panel_too_many()
    mesh.held[15] = RESTING_NODE
    assert Moves(mesh).collapse(last, 0) is None
    mesh.held[15], mesh.held[[2, 16]] = SLIDING_NODE, RESTING_NODE
    assert Moves(mesh).collapse(last, 0) is None
    mesh.held[[2, 16]] = SLIDING_NODE
    assert Moves(mesh).collapse(last, 0) is not None
    mesh.nodes[15, 1] = -0.3  # a tip of the boundary
    assert Moves(mesh).collapse(last, 0) is None


def test_a_node_between_a_triangle_and_a_quad_goes() -> None:
    nodes = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.6, 0.6, 0)], float)
    mesh = LatticeMesh(nodes, np.zeros((0, 3), int), np.zeros(5, int), np.zeros((0, 2), int), np.arange(5))
    panels = Panels(mesh, np.array([[1, 2, 3, 4]]), np.array([[1, 4, 3], [2, 1, 0]]))
    panels.lead_all()
    _, found, _, _ = panels.result()
    assert found.shape == (1, 4) and set(found[0].tolist()) == {0, 1, 2, 3}


def test_rows_lie_closer_together_only_where_the_boundary_bends() -> None:
    def lengths(radius: float) -> np.ndarray:
        turn = np.linspace(0, 2 * np.pi, 80, endpoint=False)
        ring = radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
        center = np.zeros((1, 3))
        fan = np.array([(80, k, (k + 1) % 80) for k in range(80)])
        grid = Grid(nodes=np.concatenate([ring, center]), triangles=fan, fixed=np.zeros(81, bool), origin=np.zeros(3))
        curves = curves_of([ring], [True])
        surface = sample_surface(PointCloud.from_array(np.concatenate([ring, center])), st.Settings(length=1.0)).surface
        mesh = WorkingMesh.from_grid(grid, surface, curves, np.zeros((0, 3)), 1.0)
        return row_lengths(mesh, np.array([(radius, 0, 0), (radius + 1.25, 0, 0), (radius + 5.0, 0, 0)]))

    assert lengths(8.0) == pytest.approx(1.0)
    close, between, far = lengths(1.6)
    assert close == pytest.approx((0.055 / (1.6 - (1.6**2 - 0.25) ** 0.5)) ** 0.5, abs=0.02)
    assert close < between < far == 1.0


@compiled_only
def test_quads_of_a_vault_become_planar_near_the_scan_with_even_members() -> None:
    rng = np.random.default_rng(4)
    turn, y = rng.uniform(0.0, np.pi, 24_000), rng.uniform(-8.0, 8.0, 24_000)
    points = np.column_stack([6.0 * np.cos(turn), y, 6.0 * np.sin(turn)])
    points = points[np.hypot(points[:, 0] - 1.0, points[:, 1]) > 2.0]
    bent, flat = made("quad", points), made("quad", points, planar=True)
    assert planarity_of(bent.nodes, bent.panel_table).max() > 0.003
    assert planarity_of(flat.nodes, flat.panel_table).max() <= 0.003
    assert np.abs(np.hypot(*flat.scan_nodes[:, [0, 2]].T) - 6.0).max() < 0.1 * LENGTHS["quad"]
    assert flat.quality.length_cv < 1.2 * bent.quality.length_cv
    assert np.array_equal(flat.panel_table.shape, bent.panel_table.shape)


@compiled_only
@pytest.mark.parametrize("cells", ["quad", "hexagon"])
def test_planar_panels_keep_the_corners(cells: str) -> None:
    """A wavy rectangle with noise, so that its corners, too, are projected onto the scan before panels become planar."""
    rng = np.random.default_rng(6)
    x, y = rng.uniform((-9.0, -7.0), (9.0, 7.0), (30_000, 2)).T
    grid = made(
        cells, np.column_stack([x, y, np.sin(x / 3) * np.cos(y / 3) + rng.normal(0, 0.003, len(x))]), planar=True
    )
    away = np.linalg.norm(grid.scan_nodes[:, None, :2] - [(a, b) for a in (-9, 9) for b in (-7, 7)], axis=2).min(axis=0)
    assert away.max() < 0.05 * LENGTHS[cells]


@compiled_only
def test_planar_hexagons_stay_hexagons_where_the_surface_is_a_saddle() -> None:
    points = bowl(False)
    points[:, 2] = 0.03 * (points[:, 0] ** 2 - points[:, 1] ** 2)
    bent, flat = made("hexagon", points), made("hexagon", points, planar=True)
    off = [planarity_of(each.nodes, each.panel_table) for each in (bent, flat)]
    assert off[1].mean() < off[0].mean() and off[1].max() <= off[0].max() + 1e-9
    assert inner_angles_of(flat.nodes, flat.panel_table)[flat.panel_table >= 0].max() < 180.0
    assert flat.quality.length_cv <= 1.2 * bent.quality.length_cv
    assert flat.certificate is not None and any(w.kind == "plane" for w in flat.certificate.warnings)
