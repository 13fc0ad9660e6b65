"""Grid: the record of nodes and triangles, and where it came from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, words_of_number
from .line_sets import LineSet
from .panels import CELL_NAMES
from .quality import GridQuality, measure_quality
from .tables import GridTables
from .topology import Topology, measure_topology

if TYPE_CHECKING:
    from collections.abc import Sequence

    from PIL.Image import Image

    from ..scan.cloud import PointCloud
    from ..settings import Settings
    from .alike import Alike
    from .certificate import Certificate


PROVENANCE = {
    "system",
    "settings",
    "before",
    "certificate",
    "alike",
    "seconds",
    "fit",
    "line_sets",
}  # fields that no figure of a grid depends on
OF_TRIANGLES = {  # what follows from the triangles alone
    "_half_edges", "edge_uses", "edge_triangles", "boundary_loops", "topology",
    "_member_of_side", "half_edge_edges", "panel_loops", "edge_panels", "panel_members",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Grid(GridTables):
    """A grid truss: its nodes lie on the scan, the sides of its panels are the members."""

    nodes: np.ndarray  #: (V, 3) float64 [scan unit], relative to `origin`
    triangles: np.ndarray  #: (T, 3) int64, anticlockwise seen from outside
    fixed: np.ndarray  #: (V,) bool, nodes at positions that the user appointed
    origin: np.ndarray  #: (3,) float64 [scan unit]
    unit: str = ""  #: mm, cm, m, inch, foot, or "" where it is not known
    system: str = ""  #: reference system of the scan, such as EPSG:25833; "" where it is not known
    lines: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 2), np.int64)
    )  #: (K, 2) members along fixed lines, ridges
    line_sets: tuple[LineSet, ...] = ()  #: the nodes on each fixed line and each ridge
    deviation: np.ndarray | None = None  #: (V,) distance of each node from the scan, NaN over closed holes [scan unit]
    desired: np.ndarray | None = (
        None  #: (V,) desired member length at each node, where it is not the same for all [scan unit]
    )
    #: (P, K) int64 nodes of quads or hexagons, filled up with -1, whose triangles `triangles` are; None: the triangles are the panels
    panels: np.ndarray | None = None
    settings: Settings | None = None  #: what the grid was made with
    before: GridQuality | None = None  #: quality before the optimization (Table 2)
    certificate: Certificate | None = None  #: what was checked against the scan
    alike: Alike | None = None  #: which of its parts were made alike
    seconds: dict[str, float] = field(default_factory=dict)  #: time of each stage [s]; never written with the grid
    #: fits the nodes to the scan, which is still to be done; None for every grid that is returned
    fit: Callable[[Grid], Grid] | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        """Say what it is made of, not every number."""
        unit = f" {self.unit}" if self.unit else ""
        length = f" of {words_of_number(self.lengths.mean(), 4)}{unit}" if len(self.edges) else ""
        return f"Grid({len(self.nodes):,} nodes, {len(self.edges):,} members{length}, {len(self.panel_table):,} {self.panels_are})"

    @property
    def cells(self) -> str:
        """What the panels are: triangle, quad or hexagon."""
        return "triangle" if self.panels is None else "quad" if self.panels.shape[1] == 4 else "hexagon"

    @property
    def panels_are(self) -> str:
        """What the panels are called: triangles, quads or hexagons."""
        return CELL_NAMES[self.cells]

    def replace(self, **changes: Any) -> Grid:
        """Return a copy with some fields changed; a certificate, and what is alike, hold only for the nodes and triangles of before.

        What has been measured goes along where it is the same.
        """
        if not changes.keys().isdisjoint(("nodes", "triangles", "fixed", "origin")):
            changes = {"certificate": None, "alike": None, "fit": None, **changes}
        if "triangles" in changes:
            changes = {"panels": None, **changes}
        copy = replace(self, **changes)
        known = {name: value for name, value in vars(self).copy().items() if name not in vars(copy)}
        if changes.keys() <= PROVENANCE:
            vars(copy).update(known)
        elif changes.keys().isdisjoint(("triangles", "panels")) and len(copy.nodes) == len(self.nodes):
            vars(copy).update({name: known[name] for name in OF_TRIANGLES & known.keys()})
        return copy

    def plot(
        self,
        cloud: PointCloud | None = None,
        *,
        view: str | Sequence[str] = "auto",
        size: tuple[int, int] | None = None,
    ) -> Image:
        """Return a picture of the grid: a notebook shows it, `.show()` opens it in a window, `.save("grid.png")` keeps it.

        Parameters
        ----------
        cloud : PointCloud, optional
            The scan, drawn over the grid; what the grid leaves out is coloured.
        view : str or sequence of str
            auto, behind, top, bottom, front, back, left, right or "AZIMUTH,ELEVATION"; several side by side.
        size : tuple of int, optional
            Width and height [pixel].
        """
        _check_cloud(cloud, 'plot().save("grid.png") writes a picture')
        pictures = import_module("scantruss.export.drawing.picture")  # a layer above this one
        image: Image = pictures.plot_grid(self, cloud, (view,) if isinstance(view, str) else tuple(view), size)
        return image

    def show(self, cloud: PointCloud | None = None) -> Any:
        """Return the grid as a view for a notebook: turn it, colour it, click for the row of a member; nothing is loaded from the network.

        Parameters
        ----------
        cloud : PointCloud, optional
            The scan, drawn with it.
        """
        _check_cloud(cloud, 'scantruss.write(grid, "grid.html") writes a page')
        return import_module("scantruss.export.page").view_of_grid(self, cloud)  # a layer above this one

    @cached_property
    def quality(self) -> GridQuality:
        """The figures of Table 2 and more."""
        return measure_quality(self)

    @cached_property
    def topology(self) -> Topology:
        """Components, boundary loops, Euler number, manifold, orientable."""
        return measure_topology(self)


def _check_cloud(cloud: Any, instead: str) -> None:
    """Refuse what is no cloud, such as the name of a file.

    Raises
    ------
    InputError
        It says what writes a file instead.
    """
    if cloud is not None and not hasattr(cloud, "points"):
        raise InputError(f"cloud must be the PointCloud of the scan, got a {type(cloud).__name__}; {instead}")
