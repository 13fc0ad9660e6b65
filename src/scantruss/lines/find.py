"""All lines of a scan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .network import NO_LINES, Lines, Network
from .polylines import add_polylines
from .ridges import add_ridges, find_ridges

if TYPE_CHECKING:
    from ..scan.cloud import PointCloud
    from ..scan.sites import Sites
    from ..settings import Settings


def find_lines(
    cloud: PointCloud, loops: Sequence[tuple[np.ndarray, np.ndarray]], sites: Sites, settings: Settings
) -> Lines:
    """Return the lines that become chains of members.

    Parameters
    ----------
    cloud : PointCloud
    loops : boundary loops, each its points (M, 3) and which of them are corners (C,)
    sites : Sites
    settings : Settings
        `fixed_lines`, `ridge_angle`, `length`, `corner_angle`.

    Raises
    ------
    InputError
        One of the fixed lines cannot be used.
    """
    wanted = settings.ridge_angle > 0.0 and settings.method == "default" and not sites.smooth
    ridges = find_ridges(sites, settings) if wanted else []
    if not settings.fixed_lines and not ridges:
        return NO_LINES
    network = Network(loops, settings.length)
    add_polylines(network, cloud, sites, settings)
    add_ridges(network, ridges)
    return network.lines()
