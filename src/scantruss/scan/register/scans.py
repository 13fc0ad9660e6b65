"""The scans of a splice, each with views at three spacings: for features, for judging, and for the last alignment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import bulk_of
from ..cloud import PointCloud
from .views import View, make_view

COARSE_SPACINGS = 75.0  # coarse spacings along the diagonal of a typical scan
MIDDLE_SPACINGS = 2.5  # middle spacings in a coarse one
MOST_FINE_SPACINGS = 400.0  # most fine spacings along the diagonal of a typical scan
FINE_SPACING = 1.2  # fine spacing, in distances between points
LEAST_COARSE_SPACING = 1.2  # least coarse spacing, in distances between points
# distance of the sixth neighbour in points as even as those of a range grid, in distances between points
EVEN_GAP = 1.4
FEWEST_PLACES = 60  # coarse places below which a scan is too small for features


@dataclass(frozen=True, eq=False)
class Scan:
    """One scan and its views."""

    name: str
    cloud: PointCloud
    coarse: View
    middle: View
    fine: View

    @property
    def tells(self) -> bool:
        """Whether it is large enough, compared with the others, to be matched by its shape."""
        return len(self.coarse.points) >= FEWEST_PLACES


def typical_diagonal(clouds: Sequence[PointCloud]) -> float:
    """Return the median over the scans of the diagonal of the box that holds all but a few outliers [scan unit]."""
    sizes = []
    for cloud in clouds:
        lower, upper = bulk_of(cloud.points)
        sizes.append(float(np.linalg.norm(upper - lower)))
    return float(np.median(sizes))


def prepare_scans(
    clouds: Sequence[PointCloud], names: Sequence[str], progress: Callable[[str, float], None]
) -> list[Scan]:
    """Return the scans with their views, all at the same three spacings."""
    diagonal = typical_diagonal(clouds)
    apart = float(np.median([max(cloud.spacing, cloud.gap / EVEN_GAP) for cloud in clouds]))
    coarse = max(diagonal / COARSE_SPACINGS, LEAST_COARSE_SPACING * apart)
    middle = max(coarse / MIDDLE_SPACINGS, FINE_SPACING * apart)
    fine = min(max(FINE_SPACING * apart, diagonal / MOST_FINE_SPACINGS), middle)
    scans = []
    for place, (cloud, name) in enumerate(zip(clouds, names, strict=True)):
        progress("prepare", place / len(clouds))
        wide = make_view(cloud.points, coarse)
        if len(wide.points) < FEWEST_PLACES:  # in another unit, or too sparse compared with the others
            scans.append(Scan(name, cloud, wide, wide, wide))
            continue
        middle_view = make_view(cloud.points, middle, wide)
        fine_view = make_view(cloud.points, fine, wide) if fine < middle else middle_view
        scans.append(Scan(name, cloud, wide, middle_view, fine_view))
    return scans
