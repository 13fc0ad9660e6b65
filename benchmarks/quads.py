"""How even grids of quads and hexagons are: python -m benchmarks.quads FILE:LENGTH ... [--cells quad] [--planar] [--effort normal]."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

import scantruss as st
from scantruss.boundary.find import find_boundary
from scantruss.cells.make import settings_of_triangles
from scantruss.grid.grid import Grid
from scantruss.grid.panels import planarity_of
from scantruss.pipeline import grid_from_cloud
from scantruss.scan.cloud import PointCloud
from scantruss.surface.samples import sample_surface

RIGHT = (70.0, 110.0)  # corner angles that count as right [degree]
SIXTH = (100.0, 140.0)  # those of hexagons


@dataclass(frozen=True)
class Evenness:
    """What is measured of one grid."""

    panels: int
    cv: float
    angles: float  #: share of the corner angles that are right
    regular: float  #: share of inner nodes with four members, or three
    boundary: float  #: farthest that the boundary of the scan is from that of the grid [members]
    corners: (
        float  #: farthest that a corner is from a node, along the surface: the curves are smooth across it [members]
    )
    planarity: float
    from_scan: float  #: farthest node from the scan [members]
    seconds: float  #: of the processor, triangles included
    triangle_seconds: float  #: the same of the triangles alone

    def __str__(self) -> str:
        """Return a row of a table."""
        return (
            f"{self.panels} | {self.cv:.3f} | {self.angles:.1%} | {self.regular:.1%} | {self.boundary:.3f} | {self.corners:.3f} |"
            f" {self.planarity:.2%} | {self.from_scan:.3f} | {self.seconds:.1f} | {self.triangle_seconds:.1f}"
        )


def distance_to_chains(points: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the distance of points (N, 3) from the nearest of some straight lines (N,), by trying each."""
    way = ends - starts
    square = np.maximum((way**2).sum(axis=1), 1e-300)
    share = np.clip(((points[:, None] - starts) * way).sum(axis=2) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - (starts + share[..., None] * way), axis=2).min(axis=1))


def distance_to_node(place: np.ndarray, grid: Grid) -> float:
    """Return the distance of a place (3,) from the nearest node, but for what is along the normal of the grid there."""
    v = int(np.linalg.norm(grid.nodes - place, axis=1).argmin())
    a, b, c = (grid.nodes[corner] for corner in grid.triangles[(grid.triangles == v).any(axis=1)].T)
    normal = np.cross(b - a, c - a).sum(axis=0)
    normal /= np.linalg.norm(normal)
    away = place - grid.nodes[v]
    return float(np.linalg.norm(away - (away @ normal) * normal))


def evenness(grid: Grid, cloud: PointCloud, settings: st.Settings, seconds: float, alone: float) -> Evenness:
    """Measure a grid against the boundary curves of its scan."""
    plain = settings_of_triangles(settings).replace(cells="triangle", planar=False, rows="boundary")
    _, boundary = find_boundary(sample_surface(cloud, plain), plain)
    rim = grid.edges[grid.edge_uses == 1]
    starts, ends = grid.nodes[rim[:, 0]], grid.nodes[rim[:, 1]]
    off = [distance_to_chains(loop.points, starts, ends).max() for loop in boundary.loops]
    corners = [distance_to_node(place, grid) for place in boundary.corners]
    low, high = RIGHT if grid.cells == "quad" else SIXTH
    angles = grid.corner_angles[np.isfinite(grid.corner_angles)]
    found = grid.quality
    return Evenness(
        panels=len(grid.panel_table),
        cv=found.length_cv,
        angles=float(((angles >= low) & (angles <= high)).mean()),
        regular=found.regular or 0.0,
        boundary=max(off, default=0.0) / settings.length,
        corners=max(corners, default=0.0) / settings.length,
        planarity=float(planarity_of(grid.nodes, grid.panel_table).max()),
        from_scan=float(grid.measured_deviation.max()) / settings.length,
        seconds=seconds,
        triangle_seconds=alone,
    )


def main() -> None:
    """Print a row for each scan."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scans", nargs="+", metavar="FILE:LENGTH")
    parser.add_argument("--cells", default="quad")
    parser.add_argument("--effort", default="normal")
    parser.add_argument("--rows", default="boundary")
    parser.add_argument("--planar", action="store_true")
    values = parser.parse_args()
    print(
        f"{'scan':24s} | panels | CV | angles | regular | boundary | corners | planarity | off scan | s | s of triangles"
    )
    for word in values.scans:
        path, _, length = word.rpartition(":")
        settings = st.Settings(
            length=float(length), cells=values.cells, effort=values.effort, rows=values.rows, planar=values.planar
        )
        spent = []
        for each in (settings.replace(cells="triangle", rows="boundary", planar=False), settings):
            cloud = PointCloud.from_array(st.read_points(path).points)
            begin = process_time()
            grid = grid_from_cloud(cloud, each)
            spent.append(process_time() - begin)
        print(f"{Path(path).stem:24s} | {evenness(grid, cloud, settings, spent[1], spent[0])}", flush=True)


if __name__ == "__main__":
    main()
