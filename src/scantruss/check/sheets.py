"""Whether a grid hangs together as its scan does: a handle that was cut off or a sheet that was joined to another shows here."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..grid.certificate import Fault, place_of
from ..kernels.geometry.components import component_labels
from ..kernels.mesh.sheets import nearest_nodes, note_disconnected
from ..surface.chosen_samples import KEPT, LIMB
from ..surface.near_scan import distance_from_scan
from ..surface.scratch import with_own_scratch
from .left_out import LIMBS_APART, points_together
from .limits import COVER_REACH

if TYPE_CHECKING:
    from ..errors import Place
    from ..grid.grid import Grid
    from ..surface.samples import SurfaceSamples
    from .distances import Distances

# distance from the nearest node on its sheet at which a part of the scan is left out [member lengths]
FARTHEST_COVERED = 1.2
LEFT_OUT = 0.2  # share of the sheets that a grid may leave out
TORN = "is torn where the scan is whole, as at a handle thinner than its members"
MEMBERS_APART_TORN = 4  # members between two nodes from which on neighbouring parts of the scan are torn apart
FEWEST_LINKS = 3  # fewest links between such parts that are no accident
MOST_LINKS = 1000  # most that are looked at
# farthest that the middle of a link lies from the scan, at least, and least cosine between the normals at its ends: else it spans a slit
# between parts that only face each other [member lengths, spacings of the points]
MIDDLE_OFF, SPACINGS_OFF, FACES_ALIKE = 0.25, 2.0, 0.5
# gap between points of one side of a break, and distance from it of those beside it [member lengths]
BESIDE_BREAK = 0.25
SPACINGS_BESIDE_BREAK = 1.5  # ... and in spacings of the points
BETWEEN_SIDES = 0.9  # least distance between its sides: some of what is missed is a member off both [member lengths]
FEWEST_BESIDE_BREAK = 6  # fewest points of a side of a break, and of a stub
# least share of the points beside a part of a scan that each side of it has where a grid ends on both: at a bush nearly all are on one
SHARE_OF_SIDE = 0.2
# how far off the body a stub of a handle reaches at least, and how near its points are to the grid [member lengths]
LENGTH_OF_STUB, FOLLOWED_BY_STUB = 0.75, 0.25


def nodes_of_samples(grid: Grid, samples: SurfaceSamples, length: float) -> np.ndarray:
    """Return the node nearest to each sample on its sheet, (S,), -1 where all are too far; desired member length given [scan unit]."""
    surface = with_own_scratch(samples.surface)  # grids are certified side by side
    nearest = np.empty(len(samples.piece), np.int64)
    nearest_nodes(surface, samples.boxes, grid.nodes, FARTHEST_COVERED * length, nearest)
    return nearest


def torn_apart(samples: SurfaceSamples, distance: np.ndarray, length: float) -> list[Fault]:
    """Return a fault where a grid ends on both sides of a part of its scan, as at a handle; distance as of `broken_limb`."""
    followed = (samples.judged == KEPT) & ~samples.elsewhere
    broken = broken_limb(samples, followed, distance, length, SHARE_OF_SIDE)
    return [] if broken is None else [Fault("torn", TORN, broken)]


def faults_on_sheets(grid: Grid, samples: SurfaceSamples, nearest: np.ndarray, length: float) -> list[Fault]:
    """Return what is wrong with how a grid covers each sheet of the scan; nearest (S,) and length as `nodes_of_samples`."""
    wanted = ~np.isin(samples.piece, samples.not_chosen)
    left = np.flatnonzero(((nearest < 0) | ~samples.kept) & wanted)
    share = len(left) / max(int(wanted.sum()), 1)
    faults = []
    if share > LEFT_OUT:
        where = place_of(samples.surface.mean[left[0]] + grid.origin)
        faults.append(Fault("sheets", f"leaves out {share:.0%} of the sheets of the scan", where))
    disconnected = disconnected_place(grid, samples, nearest, length)
    if disconnected is not None:
        faults.append(Fault("torn", TORN, place_of(disconnected + grid.origin)))
    return faults


def cut_apart(grid: Grid, samples: SurfaceSamples, found: Distances, length: float) -> list[Fault]:
    """Return a warning where a limb that was cut off lies between pieces of the grid, one in the scan: where the smallest was joined."""
    node_piece = component_labels(len(grid.nodes), grid.edges[:, 0], grid.edges[:, 1])
    piece, cut = node_piece[grid.triangles[:, 0]], np.flatnonzero(samples.judged == LIMB)
    if not len(cut) or (piece == piece[0]).all():
        return []
    limb = points_together(samples.scan[cut], np.full(len(cut), LIMBS_APART * length))
    near = cut[found.scan[cut] < length]
    limb, beside = limb[found.scan[cut] < length], piece[found.triangle[near]]
    touched = np.unique(np.column_stack([limb, beside]), axis=0)
    _, number, pieces = np.unique(touched[:, 0], return_inverse=True, return_counts=True)
    joining, joined = (np.unique(each) for each in touched[pieces[number] > 1].T)
    if not len(joined):
        return []
    sizes = np.bincount(piece)
    smallest = joined[sizes[joined].argmin()]
    ends = near[(beside == smallest) & np.isin(limb, joining)]
    words = f"is in {len(joined)} pieces: what joins them is too thin for the members and was cut off"
    return [Fault("apart", words, place_of(samples.scan[ends[found.scan[ends].argmin()]] + grid.origin))]


def broken_limb(
    samples: SurfaceSamples, limb: np.ndarray, distance: np.ndarray, length: float, share: float = 0.0
) -> Place | None:
    """Return a place where a grid follows a limb on both sides of a part that it misses by more than a member; None where there is none.

    Parameters
    ----------
    limb : (N,) bool, the points of limbs that the grid is to follow
    distance : (N,) of each point from the grid [scan unit]
    share : least share of the points beside the part that each side has
    """
    gone = np.flatnonzero(limb & (distance > 0.5 * length))
    if not (distance[gone] > length).any():
        return None
    from scipy.spatial import cKDTree  # which grids that miss nothing do not load

    apart = max(BESIDE_BREAK * length, SPACINGS_BESIDE_BREAK * samples.spacing)
    places = samples.scan[(samples.judged == KEPT) & (distance <= 0.5 * length)]
    group = points_together(samples.scan[gone], np.full(len(gone), apart))
    for each in np.unique(group[distance[gone] > length]):
        part = samples.scan[gone[group == each]]
        low, high = part.min(axis=0) - 2.0 * apart, part.max(axis=0) + 2.0 * apart
        near = places[((places >= low) & (places <= high)).all(axis=1)]
        away, _ = cKDTree(part).query(near, distance_upper_bound=2.0 * apart)
        beside = near[np.isfinite(away)]
        if not len(beside):
            continue
        sides = np.bincount(points_together(beside, np.full(len(beside), max(apart, BETWEEN_SIDES * length))))
        if (sides >= max(FEWEST_BESIDE_BREAK, share * len(beside))).sum() > 1:
            return _place_amid(part, samples)
    return None


def webbed_limb(
    samples: SurfaceSamples, cut: SurfaceSamples, distance: np.ndarray, length: float, shortest: float
) -> Place | None:
    """Return a place where a grid follows a limb that no tube of members goes around, or only a stub of a handle; None where there is none.

    Parameters
    ----------
    samples : of the grid
    cut : of the same scan, with all limbs cut off that are too thin for the members: a handle at two rings or more
    distance : (N,) of each point from the grid [scan unit]
    shortest : length of the shortest member, of which three go around a tube at least [scan unit]
    """
    from scipy.spatial import cKDTree

    limb = np.flatnonzero(cut.judged == LIMB)
    group = points_together(cut.scan[limb], np.full(len(limb), LIMBS_APART * length))
    _, nearest = cKDTree(cut.scan[limb]).query(np.array([ring.points[0] for ring in cut.rings]))
    off_body, _ = cKDTree(cut.scan[cut.judged == KEPT]).query(cut.scan[limb])
    followed = (samples.judged[limb] == KEPT) & (distance[limb] < FOLLOWED_BY_STUB * length)
    stub = followed & (off_body > LENGTH_OF_STUB * length)
    for each in np.unique(group[nearest]):
        rings = [ring for ring, at in zip(cut.rings, group[nearest], strict=True) if at == each]
        own = group == each
        is_thin = min(ring.girth for ring in rings) < 3.0 * shortest
        missed = own & (distance[limb] > COVER_REACH * length)
        wrong = limb[stub & own] if is_thin else limb[missed] if len(rings) > 1 else limb[:0]
        if min(len(wrong), (stub & own).sum()) >= FEWEST_BESIDE_BREAK:
            return _place_amid(samples.scan[wrong], samples)
    return None


def _place_amid(places: np.ndarray, samples: SurfaceSamples) -> Place | None:
    """Return the one of some places (K, 3) that is nearest to their middle [scan unit]."""
    return place_of(places[((places - places.mean(axis=0)) ** 2).sum(axis=1).argmin()] + samples.origin)


def disconnected_place(grid: Grid, samples: SurfaceSamples, nearest: np.ndarray, length: float) -> np.ndarray | None:
    """Return a place (3,) where the grid is torn though the scan is whole; None where there is none.

    Each node has a part of the scan, the samples nearest to it. Where two parts meet, their nodes must be near each other in the grid:
    joined by fewer than `MEMBERS_APART_TORN` members one after the other. Parts on both sides of a slit that
    face different ways may be linked, and do not meet.

    Parameters
    ----------
    nearest : (S,) int64
        Node of each sample, as `nodes_of_samples`.
    length : float
        Desired member length [scan unit].
    """
    pairs = np.concatenate([grid.edges, grid.edges[:, ::-1]])
    first = np.concatenate([[0], np.cumsum(np.bincount(pairs[:, 0], minlength=len(grid.nodes)))])
    ends = pairs[np.argsort(pairs[:, 0], kind="stable"), 1]
    surface, torn = samples.surface, np.empty((MOST_LINKS, 2), np.int64)
    near = max(MEMBERS_APART_TORN - 1, grid.panel_table.shape[1] // 2 + 1)  # a member more than nodes of one panel
    found = note_disconnected(surface.neighbors, surface.normals, nearest, first, ends, near, torn)
    off, apart = max(MIDDLE_OFF * length, SPACINGS_OFF * samples.spacing), list[int]()
    for one, two in torn[:found].tolist():
        alike = surface.normals[one] @ surface.normals[two] > FACES_ALIKE
        if alike or distance_from_scan(surface, 0.5 * (surface.mean[one] + surface.mean[two])) <= off:
            apart.append(one)
        if len(apart) == FEWEST_LINKS:
            return np.asarray(surface.mean[apart[0]])
    return None
