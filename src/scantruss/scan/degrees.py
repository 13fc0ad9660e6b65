"""Whether coordinates look like longitude and latitude, where no file says what they are."""

from __future__ import annotations

from .cloud import PointCloud
from .extent import bulk_of

POINTS_LOOKED_AT = 10_000  # points that tell it
WIDEST = 1.0  # degrees that a scan spans at most
STEEP = 50.0  # heights to the longer side in plan: a degree is 111 km, so metres of height are many times the degrees


def degrees_note(cloud: PointCloud) -> tuple[str, ...]:
    """Return what should be said of a cloud whose x and y look like degrees; nothing where its unit is known."""
    if cloud.unit:
        return ()
    some = cloud.points[:: max(len(cloud.points) // POINTS_LOOKED_AT, 1)]
    lower, upper = bulk_of(some) + cloud.origin
    x, y, z = upper - lower
    on_earth = max(-lower[0], upper[0]) <= 180.0 and max(-lower[1], upper[1]) <= 90.0
    if not (on_earth and min(x, y) > 0.0 and max(x, y) < WIDEST and z >= STEEP * max(x, y)):
        return ()
    return (
        f"x and y look like longitude and latitude in degrees, {x:.2g} by {y:.2g} beside heights of {z:.2g}: a grid needs lengths,"
        " so project such a scan to a plane system first (QGIS, PDAL filters.reprojection); where they are lengths, --unit says the unit",
    )
