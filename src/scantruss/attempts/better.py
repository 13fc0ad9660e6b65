"""Which of two grids of a scan is taken, and where one without ridges may be the better."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..check.folds import fold_angles
from ..grid.line_sets import RIDGE, sets_of

if TYPE_CHECKING:
    from ..errors import Place
    from ..grid.certificate import Certificate, Spread
    from ..grid.grid import Grid
    from ..settings import Settings

# share of the distance within which a twentieth of the points is not, down to which a grid follows a scan plainly better than another
PLAINLY_NEARER = 0.75
MISSING_ALIKE = 0.005  # share of the scan by which a grid may miss more than another and still follow it as far
# by how much nearer a hundredth of the points must lie, in members, where members are unevener by 1 (std of their lengths / mean)
NEARER_FOR_UNEVENER = 2.0
# by how much the members of a grid that follows more ridges may be unevener than those of another, and how many times as far from the
# scan the farther one of the two may be
UNEVENER_BESIDE_RIDGES, FARTHER_BESIDE_RIDGES = 0.03, 1.1
POOR_MEMBERS = {"angle", "short", "long", "folded"}  # kinds of warnings
UNEVEN = 0.075  # std of the lengths of members over their mean from which on ridges may be none, or too many for members so long
BLUNT = 120.0  # angle between the triangles at half of the members along ridges from which on a grid without may be as near [degree]


def gaps_spanned(found: Certificate) -> int:
    """Return how many gaps and openings of its scan a grid spans."""
    return sum(part.number for part in found.left_out if part.kind in ("gap", "hole"))


def follows_more(grid: Grid, other: Grid) -> bool:
    """Whether a grid is plainly nearer to its scan than another one without more warnings, or as near with fewer; both are certified."""
    found, known = grid.certificate, other.certificate
    if found is None or known is None or found.scan_distance is None or known.scan_distance is None:
        return False
    if found.missing > known.missing + MISSING_ALIKE or len(found.warnings) > len(known.warnings):
        return False
    if found.scan_distance.p95 < PLAINLY_NEARER * known.scan_distance.p95:
        return True
    return found.scan_distance.p95 <= known.scan_distance.p95 and len(found.warnings) < len(known.warnings)


def follows_better(grid: Grid, other: Grid) -> bool:
    """Whether a grid is nearer to the scan than another one, by more than it is unevener, and no poorer; both have certificates."""
    found, known = grid.certificate, other.certificate
    if found is None or known is None or found.scan_distance is None or known.scan_distance is None:
        return False
    if _poor_members(found) > _poor_members(known):
        return False
    nearer = (known.scan_distance.p99 - found.scan_distance.p99) / found.reach / 2.0
    return nearer > NEARER_FOR_UNEVENER * max(_variation(grid) - _variation(other), 0.0)


def follows_ridges_as_well(grid: Grid, other: Grid) -> bool:
    """Whether a grid that follows more ridges than another one is nearer to the scan or hardly off it more, and no poorer."""
    found, known = grid.certificate, other.certificate
    if follows_better(grid, other):
        return True
    if found is None or known is None or found.scan_distance is None or known.scan_distance is None:
        return False
    is_even = _variation(grid) <= _variation(other) + UNEVENER_BESIDE_RIDGES
    is_near = found.scan_distance.p99 <= FARTHER_BESIDE_RIDGES * known.scan_distance.p99
    return is_even and is_near and _poor_members(found) <= _poor_members(known)


def follows_more_edges(grid: Grid, other: Grid) -> bool:
    """Whether a grid follows ridges for longer than another one, hardly farther from the scan or unevener, and is no poorer."""
    found, known = grid.certificate, other.certificate
    if found is None or known is None or found.scan_distance is None or known.scan_distance is None:
        return False
    lengths = [sum(each["length"] for each in sets_of(one, RIDGE)) for one in (grid, other)]
    return (
        lengths[0] > lengths[1]
        and _is_near(found.scan_distance, known.scan_distance)
        and _variation(grid) <= _variation(other) + UNEVENER_BESIDE_RIDGES
        and _poor_members(found) <= _poor_members(known)
        and found.missing <= known.missing + MISSING_ALIKE
    )


def doubts_ridges(grid: Grid, asked: Settings) -> bool:
    """Whether ridges of a grid may be none: it gives some up or breaks them off and has poor members, or they are blunt and members uneven.

    Nobody doubts for uneven members alone what a ridge angle was chosen for.
    """
    kinds = {warning.kind for warning in grid.certificate.warnings} if grid.certificate is not None else set()
    if "ridge" in kinds and kinds & POOR_MEMBERS:
        return True
    if asked.ridge_angle != type(asked).ridge_angle or _variation(grid) <= UNEVEN or not sets_of(grid, RIDGE):
        return False
    angles = fold_angles(grid)[grid.edge_on_line & (grid.edge_uses == 2)]
    return bool(len(angles) and np.median(angles) > BLUNT)


def is_better_without_ridges(grid: Grid, other: Grid) -> bool:
    """Whether a grid without ridges is far evener than one with them, as regular and hardly farther from the scan.

    It has no more kinds of poor members, and cuts across no edge where the other does not. Its triangles tell how near it is as well as
    the points, most of which may be of columns that both leave out.
    """
    found, known = grid.certificate, other.certificate
    if found is None or known is None or _variation(grid) >= _variation(other) - UNEVENER_BESIDE_RIDGES:
        return False
    spreads = ((found.scan_distance, known.scan_distance), (found.triangle_distance, known.triangle_distance))
    is_near = all(own is None or with_ridges is None or _is_near(own, with_ridges) for own, with_ridges in spreads)
    kinds = [{warning.kind for warning in each.warnings} for each in (found, known)]
    return (
        is_near
        and grid.quality.shape_mean >= other.quality.shape_mean
        and found.missing <= known.missing + MISSING_ALIKE
        and not (kinds[0] - kinds[1]) & {"lost", *POOR_MEMBERS}
    )


def _is_near(one: Spread, two: Spread) -> bool:
    """Whether distances are hardly larger than others."""
    return one.p95 <= FARTHER_BESIDE_RIDGES * two.p95 and one.p99 <= FARTHER_BESIDE_RIDGES * two.p99


def places_of_poor_members(grid: Grid) -> list[Place]:
    """Return the places of poor members and triangles of a grid with its certificate [scan unit]."""
    warnings = grid.certificate.warnings if grid.certificate is not None else ()
    return [place for each in warnings if each.kind in POOR_MEMBERS for place in (each.where, *each.also) if place]


def _poor_members(certificate: Certificate) -> int:
    """Return of how many kinds the warnings are that say of members or triangles that they are poor."""
    return len({warning.kind for warning in certificate.warnings} & POOR_MEMBERS)


def _variation(grid: Grid) -> float:
    """Return the standard deviation of the member lengths over their mean, or over the lengths desired there."""
    quality = grid.quality
    return quality.length_cv if quality.stretch_cv is None else quality.stretch_cv
