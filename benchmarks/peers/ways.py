"""The ways from a cloud to a grid: ours and what a user would pick instead, with what each was told."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from . import alone, remeshers, surfaces
from .surfaces import Mesh, Scan


class NotForThisError(Exception):
    """The way cannot be gone on this kind of surface."""


@dataclass(frozen=True)
class Way:
    """One way from points to a triangle net."""

    name: str
    packages: tuple[str, ...]  #: distributions whose versions count
    modules: tuple[str, ...]  #: what is imported before the clock starts; a way is missing if that fails
    licence: str
    told: str  #: its parameters, in words
    run: Callable[[Scan], Mesh]
    warm: Callable[[], object] | None = None  #: done once, before the clock starts

    @property
    def ours(self) -> bool:
        return self.packages == ("scantruss",)

    def identity(self) -> str:
        """Return versions, and for our own code a digest: rows made by something else are measured anew."""
        found = []
        for package in self.packages:
            with contextlib.suppress(PackageNotFoundError):
                found.append(f"{package} {version(package)}")
        own = [Path(__file__).parent / name for name in ("surfaces.py", "remeshers.py", "alone.py", "ways.py")]
        if "scantruss" in self.packages:
            import scantruss

            own += Path(scantruss.__file__).parent.rglob("*.py")
        digest = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(own))).hexdigest()[:12]
        return " ".join([*found, digest])


def ours(scan: Scan, effort: str) -> Mesh:
    """ScanTruss on the cloud as it is."""
    import scantruss as st

    grid = st.grid_from_points(scan.points, st.Settings(length=scan.length, effort=effort))
    return Mesh(grid.nodes + grid.origin, grid.triangles)


def warm_ours(effort: str) -> None:
    """Load the kernels on a plate of 50 x 50 points, or compile them on the first run ever."""
    import scantruss as st

    x, y = np.meshgrid(np.linspace(0, 10, 50), np.linspace(0, 10, 50))
    points = np.stack([x.ravel(), y.ravel(), 0.02 * x.ravel() ** 2], axis=1)
    st.grid_from_points(points, st.Settings(length=1.5, effort=effort))


def spline(scan: Scan) -> Mesh:
    """The paper's own comparison: a bicubic B-spline surface, then our front on it; the choice of knots is not timed."""
    from .. import table3

    local = table3.frame_of(scan.points)[0]
    triangles_over = np.ptp(local[0]) * np.ptp(local[1])
    if np.ptp(local[2]) ** 2 > 0.5 * triangles_over:
        raise NotForThisError("a closed surface is no height over a plane")
    knots = int(np.clip(np.ptp(local[0]) / (1.5 * scan.length), 8, 60))
    return ours(Scan(table3.on_surface(scan.points, knots)[0], scan.length, scan.nodes, scan.spacing), "normal")


def chain(surface: Callable[[Scan], Mesh], remesher: Callable[[Mesh, Scan], Mesh], scan: Scan) -> Mesh:
    """A reconstruction and then a remesher."""
    return remesher(surface(scan), scan)


def _ours(effort: str) -> Way:
    told = f"`--effort {effort}`, the whole cloud"
    run, warm = partial(ours, effort=effort), partial(warm_ours, effort)
    return Way(f"ScanTruss {effort}", ("scantruss",), ("scantruss", "scantruss.pipeline"), "MIT", told, run, warm)


MESHLAB = "targetlen the member, 10 iterations, checksurfdist off, featuredeg 120"
MENDED = "MeshLab's ball pivoting as above"
WAYS = (
    *(_ours(effort) for effort in ("quick", "normal", "best")),
    Way(
        "Open3D ball pivoting, MeshLab", ("open3d", "pymeshlab"), ("open3d", "pymeshlab"), "MIT; GPL-3",
        f"voxels of a cell, normals of 24 neighbours oriented by tangent planes, radii 1.5, 2.5, 4 x mean neighbour; {MESHLAB}",
        partial(chain, surfaces.ball_pivoting, remeshers.meshlab_isotropic),
    ),
    Way(
        "Open3D Poisson and trim, MeshLab", ("open3d", "pymeshlab"), ("open3d", "pymeshlab"), "MIT; GPL-3",
        f"as before; depth such that its cells are those of the thinning; cut beyond 1.5 cells from the points; {MESHLAB}",
        partial(chain, surfaces.poisson, remeshers.meshlab_isotropic),
    ),
    Way(
        "PyMeshLab alone", ("pymeshlab",), ("pymeshlab",), "GPL-3",
        f"simplified cloud of a cell, normals of 16 neighbours, ball pivoting of its own radius, mended; {MESHLAB}",
        partial(chain, surfaces.meshlab, remeshers.meshlab_isotropic),
    ),
    Way(
        "CGAL advancing front, isotropic", ("cgal",), ("CGAL.CGAL_Advancing_front_surface_reconstruction",), "GPL-3 or commercial",
        "grid simplification of a cell, defaults, triangles with edges over 4 cells cut off, 10 iterations; points go in one by one",
        alone.cgal,
    ),
    Way(
        "pyacvd", ("pyacvd", "pymeshlab"), ("pyacvd", "pyvista", "pymeshlab"), "MIT; GPL-3",
        f"{MENDED}; divided to 40 nodes a cluster or more, as many clusters as nodes wanted",
        partial(chain, surfaces.meshlab, remeshers.acvd),
    ),
    Way(
        "gmsh", ("gmsh", "pymeshlab"), ("gmsh", "pymeshlab"), "GPL-2; GPL-3",
        f"{MENDED}; classifySurfaces with the boundary cut at 45 degrees, createGeometry, Frontal-Delaunay, size the member",
        partial(chain, surfaces.meshlab, remeshers.gmsh_frontal),
    ),
    Way(
        "Instant Meshes on the points", ("pyinstantmeshes", "open3d"), ("pyinstantmeshes", "open3d"), "BSD-3; MIT",
        "voxels of a cell and normals of Open3D; triangles, intrinsic, 10 neighbours, no smoothing steps",
        remeshers.instant_on_points,
    ),
    Way(
        "Instant Meshes on a mesh", ("pyinstantmeshes", "pymeshlab"), ("pyinstantmeshes", "pymeshlab"), "BSD-3; GPL-3",
        f"{MENDED}; triangles, intrinsic, aligned to the boundary, no smoothing steps",
        partial(chain, surfaces.meshlab, remeshers.instant_on_mesh),
    ),
    Way(
        "MeshLib", ("meshlib",), ("meshlib.mrmeshpy", "meshlib.mrmeshnumpy"), "its own, not for commerce",
        "grid sampling of a cell, triangulatePointCloud by default; remesh to the member, projected, 5 relaxations, boundary shift 1/20",
        alone.meshlib,
    ),
    Way(
        "B-spline surface", ("scipy", "scantruss"), ("scipy.interpolate", "scantruss.pipeline"), "BSD-3; MIT",
        "bicubic least squares, knots every 1.5 members, 8 to 60 a side; then ScanTruss normal on it, as the paper compared",
        spline, partial(warm_ours, "normal"),
    ),
)  # fmt: skip


def way(name: str) -> Way:
    return next(found for found in WAYS if found.name == name)
