"""Packages that go the whole way from points to a remeshed surface by themselves."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from .surfaces import Mesh, Scan

LONGEST = 4.0  #: edges with which CGAL's front spans holes and bays are longer than this [cells]


def _cgal_mesh(places: np.ndarray, triangles: np.ndarray) -> Any:
    """Return a polyhedron of CGAL of positions (V, 3) and triangles (T, 3)."""
    from CGAL import CGAL_Polygon_mesh_processing as processing
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3

    points, polygons, mesh = processing.Point_3_Vector(), processing.Polygon_Vector(), Polyhedron_3()
    for x, y, z in places.tolist():
        points.append(Point_3(x, y, z))
    for triangle in triangles.tolist():
        corners = processing.Int_Vector()
        for corner in triangle:
            corners.append(corner)
        polygons.append(corners)
    processing.orient_polygon_soup(points, polygons)
    processing.polygon_soup_to_polygon_mesh(points, polygons, mesh)
    processing.remove_isolated_vertices(mesh)
    return mesh


def _read_off(path: Path) -> Mesh:
    """Return the mesh of a file of CGAL."""
    lines = path.read_text(encoding="ascii").splitlines()
    words = " ".join(line for line in lines[1:] if not line.startswith("#")).split()
    nodes, rows = int(words[0]), words[3:]
    triangles = np.array(rows[3 * nodes :], np.int64).reshape(-1, 4)[:, 1:]
    return Mesh(np.array(rows[: 3 * nodes], np.float64).reshape(-1, 3), triangles)


def cgal(scan: Scan) -> Mesh:
    """CGAL: one point a cell, advancing front, what it spans cut off, isotropic remeshing."""
    from CGAL import CGAL_Advancing_front_surface_reconstruction, CGAL_Point_set_processing_3
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Point_set_3 import Point_set_3
    from CGAL.CGAL_Polygon_mesh_processing import isotropic_remeshing

    cloud, found = Point_set_3(), []  # type: ignore[var-annotated]
    for x, y, z in scan.points.tolist():
        cloud.insert(Point_3(x, y, z))
    CGAL_Point_set_processing_3.grid_simplify_point_set(cloud, scan.cell)
    cloud.collect_garbage()
    CGAL_Advancing_front_surface_reconstruction.advancing_front_surface_reconstruction(cloud, found)
    places, triangles = np.array([[p.x(), p.y(), p.z()] for p in cloud.points()]), np.array(found).reshape(-1, 3)
    edges = np.linalg.norm(places[triangles] - places[np.roll(triangles, 1, axis=1)], axis=2)
    mesh = _cgal_mesh(places, triangles[edges.max(axis=1) < LONGEST * scan.cell])
    isotropic_remeshing(list(mesh.facets()), scan.length, mesh, 10)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "grid.off"
        mesh.write_to_file(str(path), 17)
        return _read_off(path)


def meshlib(scan: Scan) -> Mesh:
    """MeshLib: points on a grid of cells, its own triangulation, its own remeshing."""
    from meshlib import mrmeshnumpy, mrmeshpy

    cloud = mrmeshnumpy.pointCloudFromPoints(scan.points)
    cloud.validPoints = mrmeshpy.pointGridSampling(cloud, scan.cell)
    cloud.invalidateCaches()
    mesh = mrmeshpy.triangulatePointCloud(cloud, mrmeshpy.TriangulationParameters())
    mesh.pack()
    settings = mrmeshpy.RemeshSettings()
    settings.targetEdgeLen, settings.maxEdgeSplits, settings.projectOnOriginalMesh = scan.length, 10_000_000, True
    settings.finalRelaxIters, settings.finalRelaxNoShrinkage = 5, True
    settings.maxBdShift = scan.length / 20
    mrmeshpy.remesh(mesh, settings)
    mesh.pack()
    return Mesh(mrmeshnumpy.getNumpyVerts(mesh), mrmeshnumpy.getNumpyFaces(mesh.topology))
