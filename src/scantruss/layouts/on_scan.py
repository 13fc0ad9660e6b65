"""The scan of a finished grid, against which what was moved is checked again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..boundary.find import Boundary, find_boundary
from ..cells.make import judging_settings, settings_of_triangles
from ..check.certify import checked
from ..check.distances import distances_to_points
from ..grid.certificate import check_passed
from ..grid.grid import Grid
from ..scan.cloud import PointCloud
from ..settings import Settings
from ..surface.samples import SurfaceSamples, sample_surface


class ScanOfGrid(NamedTuple):
    """The scan that a grid was made of."""

    samples: SurfaceSamples
    boundary: Boundary
    settings: Settings

    @classmethod
    def of(cls, cloud: PointCloud, settings: Settings) -> ScanOfGrid:
        """Look at a scan with the settings of a grid."""
        plain = settings_of_triangles(settings)
        return cls(*find_boundary(sample_surface(cloud, plain), plain), settings)

    def _at_scan(self, grid: Grid) -> Grid:
        """Return a grid with the origin of the scan."""
        origin = self.samples.origin
        return grid.replace(nodes=grid.nodes + (grid.origin - origin), origin=origin, alike=grid.alike)

    def certified(self, grid: Grid, *, keep_failed: bool = False) -> Grid:
        """Return a grid with the distances of its nodes from the scan and a certificate.

        Raises
        ------
        CertificateError
            It fails, and is not to be kept all the same.
        """
        moved = checked(self._at_scan(grid), self.samples, self.boundary, judging_settings(self.settings))
        check_passed(moved, keep_failed)
        return moved

    def distances(self, grid: Grid) -> np.ndarray:
        """Return the distance of each node of a grid from the scan (V,), NaN over closed holes [unit of the grid]."""
        _, nodes, _ = distances_to_points(self._at_scan(grid), self.samples, self.settings.length)
        return nodes

    def farthest_node(self, grid: Grid) -> float:
        """Return the largest of these distances [unit of the grid]."""
        return float(np.nanmax(self.distances(grid)))
