"""A front on its way to a grid, and what its grid costs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ..check.certify import Judged, judge
from ..check.refusal import passed_grid, refusal_of
from ..errors import FrontError
from .equalize import energy_of_node
from .rings import finish_rings

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..grid.grid import Grid
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples
    from .fit import ScanFit
    from .working_mesh import WorkingMesh

# energy a node of the share of the scan that is missed, of its distance at 95 %, and at 99 % where tips count [members]
MISSING_ENERGY, DISTANCE_ENERGY, TIPS_ENERGY = 4.0, 0.1, 0.3
POOR_SHAPE = 0.4  # shape quality of its worst triangle below which a grid is poor: more finalists are tried


@dataclass(eq=False)
class Candidate:
    """A front on its way to a grid."""

    front: Grid
    settings: Settings  #: how it is improved
    mesh: WorkingMesh
    judged: Judged | None = None  #: its grid, improved to the end, with what is wrong with it
    grid: Grid | None = None  #: that grid with its certificate
    fault: FrontError | None = None  #: why it is not to be used
    fit: ScanFit | None = None  #: how its grid was fitted to the scan, if it was

    @property
    def energy(self) -> float:
        """The energy that falls, for a node: grids of other numbers of nodes can be compared."""
        return energy_of_node(self.mesh)

    @property
    def cost(self) -> float:
        """The energy for a node, and what the grid misses of the scan."""
        return self._cost("p95", DISTANCE_ENERGY)

    @property
    def cost_of_tips(self) -> float:
        """The same where tips count, which are no more than a few hundredths of a scan."""
        return self._cost("p99", TIPS_ENERGY)

    def _cost(self, quantile: str, distance_energy: float) -> float:
        found = self.grid.certificate if self.grid is not None else None
        if found is None or found.scan_distance is None:
            return self.energy
        distance = getattr(found.scan_distance, quantile) / self.settings.length
        return self.energy + MISSING_ENERGY * found.missing + distance_energy * float(distance)

    def copy(self) -> Candidate:
        """Return the same candidate with a mesh of its own."""
        return replace(self, mesh=self.mesh.copy())

    def take(self, judged: Judged) -> None:
        """Take a grid that was judged."""
        self.judged, self.grid = judged, judged.checked_grid

    def end(self) -> None:
        """Make the whole certificate of the grid taken, and refuse it if it does not pass; at once where its faults are known."""
        judged = self.judged
        assert judged is not None
        if not judged.certificate.passed:
            raise refusal_of(judged.checked_grid, lambda: refusal_of(judged.certified_grid()))
        self.grid = passed_grid(judged.certified_grid())

    @property
    def passes(self) -> bool:
        """Whether nothing is found to be wrong with its grid."""
        found = self.grid.certificate if self.grid is not None else None
        return found is not None and found.passed

    @property
    def is_poor(self) -> bool:
        """Whether its worst triangle is a poor one."""
        return self.grid is not None and self.grid.quality.shape_min < POOR_SHAPE


def judged(grid: Grid, samples: SurfaceSamples, boundary: Boundary, settings: Settings) -> Judged:
    """Return a grid that was put down, with its rings finished, and what is wrong with it."""
    return judge(finish_rings(grid, boundary).replace(settings=settings), samples, boundary, settings)


def misses_at_most(grid: Grid, share: float) -> bool:
    """Whether nothing is wrong with a grid but that it misses some share of the scan at most."""
    found = grid.certificate
    return (
        found is not None
        and found.missing <= share
        and all(fault.kind in ("cover", "sheets") for fault in found.faults)
    )


def grid_of(candidate: Candidate) -> Grid:
    """Return the grid of a candidate that passes."""
    assert candidate.grid is not None
    return candidate.grid
