"""Turns in which nodes are put on the tips of a scan, as long as nothing else goes wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..check.hanging import any_stands_off
from ..errors import CertificateError
from .candidate import Candidate, grid_of, judged, misses_at_most
from .optimize import put_down, searched_again
from .perturbation import Spared
from .rings import finish_rings
from .tips import find_tips, is_suspect, put_on_tips, suspects_apart
from .working_mesh import at_rest

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..check.certify import Judged
    from ..constraints.find import Constraints
    from ..grid.grid import Grid
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples
    from .working_mesh import Kept

TURNS_OF_TIPS = 5  # times that nodes are put on tips
# distance from a tip within which alone the grid settles where it failed far from it [member lengths]
SETTLES_AROUND_TIP = 4.0
MOST_MISSED = 0.2  # largest share of the scan that a grid may miss where nodes are put on tips


def end_with_tips(
    candidate: Candidate, samples: SurfaceSamples, boundary: Boundary, constraints: Constraints, settings: Settings
) -> None:
    """Put nodes on the tips of the scan that a grid misses, and make its whole certificate.

    The search for tips asks for no more than what is found soon. Where the whole certificate then finds more, as a tunnel, the grid of the
    last turn is taken that passes. A grid that begins with a handle that the scan does not have keeps it, with whatever tips.

    Raises
    ------
    CertificateError
        None of them passes; the fault of the last turn.
    """
    first, fault = candidate.judged, None
    assert first is not None
    before = [] if first.false_handles else reach_tips_of(candidate, samples, boundary, constraints, settings)
    while True:  # ends: each turn takes one from those before
        try:
            return candidate.end()
        except CertificateError as error:
            fault = fault or error
        if not before or not before[-1][0].certificate.passed:
            raise fault
        judged_before, kept = before.pop()
        candidate.mesh.restore(kept)
        candidate.take(judged_before)


def reach_tips_of(
    candidate: Candidate, samples: SurfaceSamples, boundary: Boundary, constraints: Constraints, settings: Settings
) -> list[tuple[Judged, Kept]]:
    """Put nodes on the tips of the scan that a grid misses, as long as it is better for it and nothing else goes wrong.

    Each turn finds those that the grid misses by then. In the end the grid is searched again. Returns the grid and the mesh before each
    turn that was taken.
    """
    search = TipSearch(candidate, samples, boundary, constraints, settings)
    mesh = candidate.mesh
    for _ in range(TURNS_OF_TIPS if settings.method == "default" else 0):
        kept, cost = mesh.copied(), candidate.cost_of_tips
        now = search.reach(find_tips(mesh, candidate.front, samples, search.given_up))
        if now is None or not search.is_taken(now, kept, cost):
            mesh.restore(kept)
            break
    if search.before and settings.effort != "quick":
        kept, cost = mesh.copied(), candidate.cost_of_tips
        if not search.is_taken(search.judged(searched_again(mesh, *search.of_scan)), kept, cost):
            mesh.restore(kept)
    return search.before


@dataclass(eq=False)
class TipSearch:
    """Nodes on their way to the tips of a scan."""

    candidate: Candidate
    samples: SurfaceSamples
    boundary: Boundary
    constraints: Constraints
    settings: Settings
    given_up: list[np.ndarray] = field(default_factory=list)  #: tips (3,) that no node can be put on
    before: list[tuple[Judged, Kept]] = field(default_factory=list)  #: grid and mesh before each turn that was taken

    @property
    def of_scan(self) -> tuple[Grid, SurfaceSamples, Constraints, Settings]:
        """What a mesh needs to be put down."""
        return self.candidate.front, self.samples, self.constraints, self.candidate.settings

    def judged(self, grid: Grid) -> Judged:
        """Return a grid that was put down, judged."""
        return judged(grid, self.samples, self.boundary, self.settings)

    def stands_off(self, grid: Grid) -> bool:
        """Whether a grid that was put down fails as a node stands off the scan, which is known long before all else."""
        return any_stands_off(finish_rings(grid, self.boundary), self.samples, self.settings.length)

    def reach(self, tips: Sequence[np.ndarray]) -> Judged | None:
        """Put nodes on the tips (3,) where nothing goes wrong, and give up the others; the grid then, None where it is as before.

        Tips near a fault are tried one by one; where one of these then fails far from it, once more with what is far from it at rest.
        Ends: each call has fewer tips than the one that made it.
        """
        mesh = self.candidate.mesh
        kept = mesh.copied()
        if not put_on_tips(mesh, tips):
            self.given_up.extend(tips)
            return None
        now = self.settled(tips)
        if now is not None and len(tips) == 1 and not _has_nothing_wrong(now) and self.fails_far_from(tips[0], now):
            mesh.restore(kept)
            put_on_tips(mesh, tips)
            with at_rest(mesh.net, Spared(np.array(tips), SETTLES_AROUND_TIP * mesh.length).away(mesh.net.nodes)):
                now = self.settled(tips)
        if now is not None and _has_nothing_wrong(now):
            return now
        mesh.restore(kept)
        if now is None or len(tips) == 1:
            self.given_up.extend(tips)
            return None
        harmless, suspects = suspects_apart(tips, self.places_of_faults(now), mesh.length)
        found = self.reach(harmless)
        for tip in suspects:
            found = self.reach([tip]) or found
        return found

    def settled(self, tips: Sequence[np.ndarray]) -> Judged | None:
        """Put the mesh down and judge its grid; None where a node stands off for a tip alone, as nobody asks what else is wrong."""
        grid = put_down(self.candidate.mesh, *self.of_scan)
        return None if len(tips) == 1 and self.stands_off(grid) else self.judged(grid)

    def places_of_faults(self, now: Judged) -> list[np.ndarray]:
        """Return where a grid fails (3,), from the local origin."""
        return [np.array(each.where) - self.samples.origin for each in now.certificate.faults if each.where]

    def fails_far_from(self, tip: np.ndarray, now: Judged) -> bool:
        """Whether all faults of a grid whose places are known are far from a tip (3,), which has not caused them."""
        faults = self.places_of_faults(now)
        return bool(faults) and not is_suspect(tip, faults, self.candidate.mesh.length)

    def is_taken(self, now: Judged, kept: Kept, cost: float) -> bool:
        """Take the grid that the mesh has become where it passes as far and is better than that before, of a mesh kept and some cost."""
        candidate, before = self.candidate, self.candidate.judged
        assert before is not None
        candidate.take(now)
        if misses_at_most(grid_of(candidate), MOST_MISSED) and candidate.cost_of_tips < cost:
            self.before.append((before, kept))
            return True
        candidate.take(before)
        return False


def _has_nothing_wrong(now: Judged) -> bool:
    """Whether nothing is wrong with a grid but that it misses some of the scan, as long as nodes are put on tips."""
    return misses_at_most(now.checked_grid, MOST_MISSED)
