"""The record from which all tables of a schedule are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .clusters import Clusters
from .joints import Joints

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from .settings import ScheduleSettings


@dataclass(frozen=True, eq=False)
class Parts:
    """All that the tables are made of; lengths of what is built [mm]."""

    grid: Grid
    settings: ScheduleSettings
    unit: str  #: of the scan
    size: float  #: what a unit of the grid is in the structure [mm]
    joints: Joints
    clear: np.ndarray  #: (K,) where the tubes of each pair of ends part, from the node
    needed: np.ndarray  #: (V,) radius of the smallest ball that clears its members; 0 without members
    radius: np.ndarray  #: (V,) radius of the balls; 0 without members
    length: np.ndarray  #: (E,)
    cut: np.ndarray  #: (E,) length without the balls
    sides: np.ndarray  #: (T, 3) from node k to node k + 1
    fold: np.ndarray  #: (E,) angle between the panels on their inner side; 180 level, NaN at the boundary [degree]
    node_types: Clusters
    panel_types: Clusters
    length_types: Clusters
    node_marks: list[str]
    member_marks: list[str]
    panel_marks: list[str]
