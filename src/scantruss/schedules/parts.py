"""The record from which all tables of a schedule are made."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .clusters import Clusters, PanelSizes
from .joints import Joints

if TYPE_CHECKING:
    from ..grid.grid import Grid
    from .forces import Forces
    from .records import Column
    from .settings import ScheduleSettings


@dataclass(frozen=True, eq=False)
class Stock:
    """What the members are cut from, tubes of the settings or sections of a structure; all by member."""

    width: np.ndarray  #: (E,) diameter around it [mm]
    mass: np.ndarray | None  #: (E,) mass of a length [kg/mm]
    columns: tuple[Column, ...]  #: what it is called
    ball_density: float | None  #: [kg/m3]


@dataclass(frozen=True, eq=False)
class Parts:
    """All that the tables are made of; lengths of what is built [mm]."""

    grid: Grid
    settings: ScheduleSettings
    unit: str  #: of the scan
    size: float  #: what a unit of the grid is in the structure [mm]
    joints: Joints
    stock: Stock
    forces: Forces | None  #: of a structure
    bolt: np.ndarray | None  #: (E,) diameters, 0 where none is large enough; None without bolts
    clear: np.ndarray  #: (K,) where the members of each pair of ends part, from the node
    needed: np.ndarray  #: (V,) radius of the smallest ball that clears its members; 0 without members
    radius: np.ndarray  #: (V,) radius of the balls; 0 without members
    length: np.ndarray  #: (E,)
    cut: np.ndarray  #: (E,) length without the balls
    cut_of_family: np.ndarray  #: (E,) the same for a member as long as its family; `cut` where there are no families
    panel_sizes: PanelSizes
    fold: np.ndarray  #: (E,) angle between the panels on their inner side; 180 level, NaN at the boundary [degree]
    node_types: Clusters
    node_images: np.ndarray  #: (K,) the type of nodes that is the mirror image of each, or NO_IMAGE
    panel_types: Clusters
    panel_images: np.ndarray  #: (K,) the same of panels
    length_types: Clusters
    node_marks: list[str]
    member_marks: list[str]
    panel_marks: list[str]

    @property
    def sides(self) -> np.ndarray:
        """(P, K) from node k to the next, NaN where a panel has no such side."""
        return self.panel_sizes.sides

    @property
    def ball_masses(self) -> np.ndarray | None:
        """(V,) mass of each ball, solid, holes not taken off [kg]; None without a density."""
        if (density := self.stock.ball_density) is None:
            return None
        return math.pi / 6.0 * (2.0 * self.radius / 1000.0) ** 3 * density
