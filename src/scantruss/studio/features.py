"""What the scan has that a grid can follow or leave: holes, which can be closed, and ridges, which can be left alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..boundary.find import find_boundary
from ..boundary.which_holes import is_hole
from ..constraints.find import wanted_ridges
from ..scan.cloud import PointCloud
from ..settings import Settings
from ..surface.samples import sample_surface

HOLES, RIDGES = (
    "fill_at",
    "no_ridge_at",
)  #: settings that name the holes that are closed and the ridges that are left alone
SIGNIFICANT = 9  #: digits of a place that names a hole or a ridge


@dataclass(frozen=True, eq=False)
class Feature:
    """A hole or a ridge of a scan."""

    kind: str  #: the setting that names it when it is switched off: `HOLES` or `RIDGES`
    words: str
    points: (
        np.ndarray
    )  #: (M, 3) along it, in the frame of the scan [scan unit]; a hole is closed, the first not repeated

    @property
    def place(self) -> tuple[float, ...]:
        """A place that names it [scan unit]."""
        return tuple(float(f"{c:.{SIGNIFICANT}g}") for c in self.points[len(self.points) // 2].tolist())

    def distance(self, place: tuple[float, ...]) -> float:
        """Distance of a place from it [scan unit]."""
        return float(np.linalg.norm(self.points - np.array(place), axis=1).min())


def features_to_switch(cloud: PointCloud, settings: Settings) -> list[Feature]:
    """Return the holes and ridges of a scan, the switched off ones too.

    Raises
    ------
    ScanTrussError
        The scan has no surface at this member length.
    """
    plain = settings.replace(fill_at=(), no_ridge_at=())
    samples, boundary = find_boundary(sample_surface(cloud, plain), plain)
    unit = f" {cloud.unit}" if cloud.unit else ""
    found = [
        Feature(HOLES, f"{loop.length:.4g}{unit} around", loop.points + cloud.origin)
        for loop in boundary.loops
        if is_hole(loop, samples) and not loop.cut
    ]
    for ridge in wanted_ridges(samples, plain):
        size = np.linalg.norm(np.diff(ridge.places, axis=0), axis=1).sum()
        found.append(Feature(RIDGES, f"{size:.4g}{unit} long", ridge.places + cloud.origin))
    return found


def corners_of_feature(cloud: PointCloud, settings: Settings) -> np.ndarray:
    """Return the corners (C, 3) of the boundary of a scan, in its own frame [scan unit].

    Raises
    ------
    ScanTrussError
        The scan has no surface at this member length.
    """
    plain = settings.replace(fixed=(), fixed_lines=())
    _, boundary = find_boundary(sample_surface(cloud, plain), plain)
    return np.asarray(boundary.corners + cloud.origin)


def switched_off(features: list[Feature], settings: Settings) -> dict[int, tuple[tuple[float, ...], ...]]:
    """Return the features that are closed or left alone by their number, with the places of the settings that name them."""
    found: dict[int, tuple[tuple[float, ...], ...]] = {}
    for kind in (HOLES, RIDGES):
        for place in getattr(settings, kind):
            gaps = [(each.distance(place), k) for k, each in enumerate(features) if each.kind == kind]
            if gaps and min(gaps)[0] <= settings.length:
                found[min(gaps)[1]] = (*found.get(min(gaps)[1], ()), place)
    return found
