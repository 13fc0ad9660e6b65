"""From a cloud to a fine triangle mesh, by the reconstructions a user finds first; normals are counted.

Clouds far denser than the members are thinned first, as everyone does who has waited once: to a quarter of a member,
but never below twice the spacing. Unthinned, ball pivoting left 10,000 holes in the scallop of 100,000 points, Poisson
took five times as long and CGAL's advancing front more than a minute.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

NEIGHBOURS = 24  #: of a normal
RADII = (1.5, 2.5, 4.0)  #: of the balls, in mean distances of neighbours
SMALL_HOLE = 30  #: boundaries with at most so many edges are closed
TRIM = 1.5  #: nodes of the Poisson surface farther from the thinned cloud than this are cut off [cells]


@dataclass(frozen=True, eq=False)
class Scan:
    """What a way is given: the points, the member wanted, and what a user knows of the scan."""

    points: np.ndarray  #: (N, 3)
    length: float
    nodes: int  #: about so many are wanted
    spacing: float  #: median distance to the nearest neighbour

    @property
    def cell(self) -> float:
        """What the cloud is thinned to."""
        return max(self.length / 4, 2 * self.spacing)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Nodes (V, 3) and triangles (T, 3)."""

    nodes: np.ndarray
    triangles: np.ndarray


def thinned(scan: Scan) -> Any:
    """Return the cloud of Open3D, one mean point a cell, with oriented normals."""
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(scan.points)).voxel_down_sample(scan.cell)
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    cloud.orient_normals_consistent_tangent_plane(NEIGHBOURS)
    return cloud


def _taken(mesh: Any) -> Mesh:
    return Mesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles))


def ball_pivoting(scan: Scan) -> Mesh:
    """Return the mesh of Open3D's ball pivoting."""
    import open3d

    cloud = thinned(scan)
    mean = float(np.mean(cloud.compute_nearest_neighbor_distance()))
    radii = open3d.utility.DoubleVector([mean * factor for factor in RADII])
    return _taken(open3d.geometry.TriangleMesh.create_from_point_cloud_ball_pivoting(cloud, radii))


def poisson(scan: Scan) -> Mesh:
    """Return the mesh of Open3D's screened Poisson, cut where the cloud is far; its cells are about those of the thinning."""
    import open3d

    cloud = thinned(scan)
    extent = float(np.ptp(scan.points, axis=0).max())
    depth = int(np.clip(round(np.log2(1.1 * extent / scan.cell)), 5, 11))
    mesh, _ = open3d.geometry.TriangleMesh.create_from_point_cloud_poisson(cloud, depth=depth)
    far = np.asarray(open3d.geometry.PointCloud(mesh.vertices).compute_point_cloud_distance(cloud))
    mesh.remove_vertices_by_mask((far > TRIM * scan.cell).tolist())
    return _taken(mesh)


def repair(meshes: Any) -> None:
    """Mend the current mesh of MeshLab before it is remeshed: debris, non-manifold parts, small holes."""
    meshes.meshing_remove_duplicate_faces()
    meshes.meshing_repair_non_manifold_edges()
    meshes.meshing_remove_connected_component_by_face_number(mincomponentsize=25)
    meshes.meshing_repair_non_manifold_vertices()
    meshes.meshing_close_holes(maxholesize=SMALL_HOLE)
    meshes.meshing_re_orient_faces_coherently()
    meshes.meshing_remove_unreferenced_vertices()


def meshlab(scan: Scan) -> Mesh:
    """Return the mesh of MeshLab's ball pivoting on a Poisson-disk part of the cloud, mended."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(scan.points))
    meshes.generate_simplified_point_cloud(radius=pymeshlab.PureValue(scan.cell))
    meshes.compute_normal_for_point_clouds(k=16)
    meshes.generate_surface_reconstruction_ball_pivoting()
    repair(meshes)
    found = meshes.current_mesh()
    return Mesh(found.vertex_matrix(), found.face_matrix())
