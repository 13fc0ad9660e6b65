"""From a fine triangle mesh to one with edges of the member length."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from .surfaces import Mesh, Scan, repair, thinned

SIX = {
    "rosy": 6,
    "posy": 3,
    "extrinsic": False,
    "smooth_iterations": 0,
}  #: triangles; smoothing made CV 0.13 out of 0.03


def meshlab_isotropic(mesh: Mesh, scan: Scan) -> Mesh:
    """MeshLab's isotropic explicit remeshing; with its check of the surface distance on it does not coarsen noisy meshes."""
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(mesh.nodes, mesh.triangles))
    repair(meshes)
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=10, targetlen=pymeshlab.PureValue(scan.length), checksurfdist=False, featuredeg=120
    )
    found = meshes.current_mesh()
    return Mesh(found.vertex_matrix(), found.face_matrix())


def acvd(mesh: Mesh, scan: Scan) -> Mesh:
    """Centroidal clusters of pyacvd, on a mesh of at least 40 nodes a cluster."""
    import pyacvd
    import pyvista

    data = pyvista.PolyData(mesh.nodes, np.insert(mesh.triangles, 0, 3, axis=1).ravel())
    clusters = pyacvd.Clustering(data)
    rounds = max(0, int(np.ceil(np.log(40 * scan.nodes / len(mesh.nodes)) / np.log(4))))
    if rounds:
        clusters.subdivide(rounds)
    clusters.cluster(scan.nodes)
    found = clusters.create_mesh()
    return Mesh(np.asarray(found.points), np.asarray(found.faces).reshape(-1, 4)[:, 1:])


def gmsh_frontal(mesh: Mesh, scan: Scan) -> Mesh:
    """Frontal-Delaunay of gmsh on the reparametrized mesh, its boundary cut at corners of 45 degrees."""
    import gmsh

    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        surface = gmsh.model.addDiscreteEntity(2)
        gmsh.model.mesh.addNodes(2, surface, np.arange(1, len(mesh.nodes) + 1), mesh.nodes.ravel())
        gmsh.model.mesh.addElementsByType(surface, 2, [], mesh.triangles.ravel() + 1)
        gmsh.model.mesh.classifySurfaces(np.pi, True, True, np.pi / 4)
        gmsh.model.mesh.createGeometry()
        gmsh.model.geo.synchronize()
        size = gmsh.model.mesh.field.add("MathEval")
        gmsh.model.mesh.field.setString(size, "F", repr(float(scan.length)))
        gmsh.model.mesh.field.setAsBackgroundMesh(size)
        for other in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.MeshSize{other}", 0)
        gmsh.option.setNumber("Mesh.Algorithm", 6)
        gmsh.model.mesh.generate(2)
        tags, places, _ = gmsh.model.mesh.getNodes()
        _, corners = gmsh.model.mesh.getElementsByType(2)
    finally:
        gmsh.finalize()
    order = np.argsort(tags)
    return Mesh(places.reshape(-1, 3), order[np.searchsorted(tags[order], corners)].reshape(-1, 3))


def instant_on_mesh(mesh: Mesh, scan: Scan) -> Mesh:
    """Instant Meshes, triangles, aligned to the boundary."""
    import pyinstantmeshes

    nodes, triangles = mesh.nodes.astype(np.float32), mesh.triangles.astype(np.int32)
    return Mesh(
        *pyinstantmeshes.remesh(nodes, triangles, target_edge_length=scan.length, align_to_boundaries=True, **SIX)
    )


def instant_on_points(scan: Scan) -> Mesh:
    """Instant Meshes, triangles, on the thinned points with the normals of Open3D; it reads points from files only."""
    import pyinstantmeshes

    cloud = thinned(scan)
    rows = np.concatenate([np.asarray(cloud.points), np.asarray(cloud.normals)], axis=1).astype("<f4")
    head = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        start = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{head}end_header\n"
        (folder / "scan.ply").write_bytes(start.encode() + rows.tobytes())
        (folder / "scan.aln").write_text("1\nscan.ply\n#\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0\n", encoding="ascii")
        files = str(folder / "scan.aln"), str(folder / "out.obj")
        return Mesh(*pyinstantmeshes.remesh_file(*files, target_edge_length=scan.length, knn_points=10, **SIX))
