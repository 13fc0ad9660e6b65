"""Grids of hexagons: the dual of triangles, three members at a node, and the boundary closed."""

import numpy as np
import pytest
from small_grids import dome, icosahedron
from test_quads import bowl

import scantruss as st
from scantruss.cells.hexagons import dual_of
from scantruss.grid.panels import sizes_of


def test_the_dual_of_an_icosahedron_is_a_dodecahedron() -> None:
    solid = icosahedron()
    dual = dual_of(solid, np.zeros((0, 3)), 1e-6)
    assert len(dual.nodes) == 20 and len(dual.panels) == 12 and (sizes_of(dual.panels) == 5).all()


def test_the_dual_keeps_pieces_loops_and_direction() -> None:
    grid = dome(6)
    corners = grid.nodes[grid.boundary_loops[0][:1]]
    dual = dual_of(grid, corners, 1e-6)
    from scantruss.grid.panels import triangles_of

    made = grid.replace(
        nodes=dual.nodes,
        triangles=triangles_of(dual.nodes, dual.panels),
        panels=dual.panels,
        fixed=np.zeros(len(dual.nodes), bool),
    )
    assert made.topology == grid.topology and (np.linalg.norm(dual.nodes - corners[0], axis=1) < 1e-9).sum() == 1
    members = np.bincount(made.edges.ravel(), minlength=len(made.nodes))
    rim = np.zeros(len(made.nodes), bool)
    rim[made.edges[made.edge_uses == 1].ravel()] = True
    assert (members[~rim] == 3).all()
    upward = np.cross(
        made.nodes[made.triangles[:, 1]] - made.nodes[made.triangles[:, 0]],
        made.nodes[made.triangles[:, 2]] - made.nodes[made.triangles[:, 0]],
    )[:, 2]
    assert (upward > 0).all()


def test_hexagons_of_a_scan() -> None:
    grid = st.grid_from_points(bowl(False), st.Settings(length=0.9, cells="hexagon", unit="m"))
    assert grid.certificate is not None and grid.certificate.passed
    assert grid.cells == "hexagon" and grid.quality.regular == 1.0
    rim = np.unique(grid.edges[grid.edge_uses == 1])
    inside = ~np.isin(grid.panel_table, rim).any(axis=1)
    assert (sizes_of(grid.panel_table)[inside] == 6).mean() > 0.75
    inner = grid.lengths[grid.edge_uses == 2]
    assert inner.std() < 0.12 * inner.mean() and inner.mean() == pytest.approx(0.9, rel=0.1)
