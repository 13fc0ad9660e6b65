"""The kinds of parts of a grid whose lengths, joints or panels were made alike, as they follow from its nodes."""

from __future__ import annotations

import numpy as np

from ..grid.alike import JOINTS, LENGTHS, PANELS
from ..grid.grid import Grid
from .alike import Kinds, kinds_of_parts
from .families import families_of
from .joints_alike import stars_of
from .panels_alike import corners_of
from .part_vectors import PartVectors


def parts_alike(grid: Grid) -> PartVectors:
    """Return the joints or panels of a grid that were made alike."""
    assert grid.alike is not None and grid.alike.parts in (JOINTS, PANELS)
    return stars_of(grid) if grid.alike.parts == JOINTS else corners_of(grid, grid.alike.member)


def kinds_of_grid(grid: Grid, parts: str) -> Kinds | None:
    """Return the kinds of joints or panels of a grid, the same as when they were made; None where those were not made alike."""
    alike = grid.alike
    if alike is None or alike.parts != parts or parts == LENGTHS:
        return None
    return kinds_of_parts(parts_alike(grid), grid.nodes, alike.tolerance, mirrored=alike.mirrored)


def families_of_grid(grid: Grid) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the lengths (K,) and the family of each member (E,) of a grid; None where its lengths were not made few."""
    alike = grid.alike
    if alike is None or alike.parts != LENGTHS:
        return None
    return families_of(grid.lengths, alike.tolerance * alike.member, alike.count)
