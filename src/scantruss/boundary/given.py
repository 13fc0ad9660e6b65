"""The boundary that the user gives: which part of the scan it encloses, and that part alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import InputError, LengthError, words_of_number, words_of_place
from ..kernels.geometry.boxes import SearchBoxes, new_boxes
from ..kernels.geometry.components import component_labels
from ..kernels.scan.nearby import nearest_places
from ..kernels.surface.samples import put_all
from ..surface.chosen_samples import KEPT
from ..surface.near_scan import check_on_scan
from ..surface.owners import owners_of
from ..surface.samples import narrow_surface, samples_with
from .corners import CURVE_STEP
from .curves import length_around
from .holes import fill_holes
from .polylines import POINTS_UNDER_LINE, corners_of_polyline, divide_polyline, feet_on_scan

if TYPE_CHECKING:
    from ..kernels.surface.local_surface import Surface
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

OUTSIDE_BOUNDARY = "outside of the boundary that was given"
BRIDGED_DISTANCE = 0.5  # distance up to which the boundary may leave the scan; the grid bridges it [member lengths]
FAR_BOUNDARY = 1.0  # distance from which on no usual length bridges it [member lengths]
SHORTEST_BOUNDARY = 3.0  # shortest boundary [member lengths]
CORNERS_APART = 0.5  # of two corners nearer along the boundary the sharper one is a node [member lengths]
# a boundary of the scan that comes no farther than this from that given is the same [member lengths]
SAME_BOUNDARY_WITHIN = 1.0
LEAST_SCANNED_SHARE = 0.05  # share of the samples beside a boundary below which there is no scan on that side
INSIDE_SHARE = 0.9  # share of a boundary of the scan that must lie inside for it to be a hole there


class GivenRing(NamedTuple):
    """A closed curve that bounds the grid."""

    points: np.ndarray  #: (M, 3) the surface to its left, relative to the cloud's origin
    corner_at: np.ndarray  #: (C,) int64
    external: bool
    piece: int


class Rings(NamedTuple):
    """All given curves as one, to be asked for sides."""

    points: np.ndarray  #: (M, 3)
    ring: np.ndarray  #: (M,) int64 number of the curve
    before: np.ndarray  #: (M,) int64 the point before each
    after: np.ndarray  #: (M,) int64
    boxes: SearchBoxes


@dataclass(frozen=True, eq=False)
class Inside:
    """The part of a scan that given curves enclose."""

    surface: Surface
    rings: Rings
    sample: np.ndarray  #: (S,) bool, samples inside
    turned: np.ndarray  #: (R,) bool, curves whose surface lies to their right
    external: np.ndarray  #: (R,) bool
    reach: float  #: distance from a curve within which each point counts by its own side [scan unit]

    def holds(self, points: np.ndarray, owner: np.ndarray) -> np.ndarray:
        """Return which points (N, 3) of samples (N,) lie inside: near a curve by their own side, else by that of their sample."""
        neighbors = self.surface.neighbors
        beside = self.sample | (self.sample[neighbors] & (neighbors >= 0)).any(axis=1)
        known = owner >= 0
        found: np.ndarray = known & self.sample[owner]
        close = np.flatnonzero(known & beside[owner])
        foot, right = _sides(points[close], self.surface.normals[owner[close]], self.rings, self.reach)
        near = foot >= 0
        found[close[near]] = right[near] == self.turned[self.rings.ring[foot[near]]]
        return found


def cut_along(
    samples: SurfaceSamples, scanned: Sequence[tuple[np.ndarray, int]], settings: Settings
) -> tuple[SurfaceSamples, list[GivenRing]]:
    """Return the samples inside the boundary that the settings give, and that boundary.

    Parameters
    ----------
    samples : SurfaceSamples
    scanned : sequence of ((M, 3), int)
        The boundary loops of the scan and their pieces, the longest of each piece first. Those inside that are not given are closed.
    settings : `boundary`, `length`, `corner_angle`

    Raises
    ------
    InputError
        The boundary leaves the scan, is too short, or divides it into no two sides; names the place.
    """
    curves = [_curve(ring, number, samples, settings) for number, ring in enumerate(settings.boundary, 1)]
    rings = _joined([points for points, _ in curves], settings.length)
    inside = _inside_of(samples, scanned, [points for points, _ in curves], rings, settings.length)
    holes = [points for points, _ in scanned if _is_hole(points, samples, inside, settings.length)]
    cut = _samples_inside(samples, fill_holes(samples, holes), inside, settings)
    found = []
    for number, (points, corner_at) in enumerate(curves):
        if inside.turned[number]:
            points, corner_at = points[::-1], np.sort(len(points) - 1 - corner_at)
        nearest = int(((cut.surface.mean - points[0]) ** 2).sum(axis=1).argmin())
        external = bool(inside.external[number])
        found.append(GivenRing(np.ascontiguousarray(points), corner_at, external, int(cut.piece[nearest])))
    return cut, found


def _samples_inside(samples: SurfaceSamples, added: np.ndarray, inside: Inside, settings: Settings) -> SurfaceSamples:
    """Return the samples of the points inside and of those made up over holes (F, 3); the other points count as not read."""
    owner = np.repeat(np.arange(len(samples.surface.mean)), np.diff(samples.surface.start))
    cut = samples_with(samples, added, settings, inside.holds(samples.surface.points, owner))
    kept = inside.holds(samples.scan, owners_of(samples, samples.scan)) | (samples.judged != KEPT)
    whole = samples.whole
    if whole is not None:
        whole = np.ascontiguousarray(whole[inside.holds(whole, owners_of(samples, whole))])
    beyond = ((OUTSIDE_BOUNDARY, int((~kept).sum())),) if not kept.all() else ()
    return replace(
        cut,
        scan=np.ascontiguousarray(samples.scan[kept]),
        judged=samples.judged[kept],
        lone=samples.lone[kept] if len(samples.lone) else samples.lone,
        unread=(*samples.unread, *beyond),
        whole=whole,
    )


def _curve(
    ring: Sequence[Sequence[float]], number: int, samples: SurfaceSamples, settings: Settings
) -> tuple[np.ndarray, np.ndarray]:
    """Return a given polyline in small steps (M, 3), and which of its points are corners (C,).

    Raises
    ------
    InputError
        It is too short for the member, or leaves the scan by more than half of one; `LengthError` where another length may do.
    """
    length, unit = settings.length, f" {samples.unit}" if samples.unit else ""
    given = np.array(ring, float) - samples.origin
    if (around := length_around(given)) < SHORTEST_BOUNDARY * length:
        raise LengthError(
            f"boundary {number} is {words_of_number(around, 4)}{unit} long; three members,"
            f" {words_of_number(SHORTEST_BOUNDARY * length, 4)}{unit}, are needed"
        )
    check_on_scan(f"boundary {number}", ring, samples, length, FAR_BOUNDARY)
    points, vertices = divide_polyline(np.concatenate([given, given[:1]]), True, CURVE_STEP * length)
    _, gaps = feet_on_scan(points, narrow_surface(samples, POINTS_UNDER_LINE))
    if (worst := float(gaps.max())) > BRIDGED_DISTANCE * length:
        at = int(gaps.argmax())
        place = words_of_place(points[at] + samples.origin)
        way = ", where a straight line closes it," if at > vertices[-1] else ""
        refused = LengthError if worst <= FAR_BOUNDARY * length else InputError  # longer members may bridge it
        raise refused(
            f"boundary {number} leaves the scan{way} by up to {words_of_number(worst, 4)}{unit}, near ({place});"
            f" it must stay within half a member, {words_of_number(BRIDGED_DISTANCE * length, 4)}{unit}: move it, or add points"
        )
    return points, _apart(points, corners_of_polyline(points, vertices, True, settings), CORNERS_APART * length)


def _apart(points: np.ndarray, corners: Sequence[int], distance: float) -> np.ndarray:
    """Return the corners of a closed curve (M, 3), the sharpest first, that keep a distance along it from sharper ones, in order."""
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    around = length_around(points)
    kept: list[int] = []
    for corner in corners:
        gaps = np.abs(arc[kept] - arc[corner]) if kept else np.full(1, np.inf)
        if np.minimum(gaps, around - gaps if kept else np.inf).min() >= distance:
            kept.append(corner)
    return np.sort(np.array(kept, np.int64))


def _joined(curves: Sequence[np.ndarray], length: float) -> Rings:
    """Return the given curves as one."""
    points = np.ascontiguousarray(np.concatenate(curves))
    ring = np.repeat(np.arange(len(curves)), [len(curve) for curve in curves])
    parts = np.split(np.arange(len(points)), np.cumsum([len(curve) for curve in curves])[:-1])
    before, after = (np.concatenate([np.roll(part, way) for part in parts]) for way in (1, -1))
    boxes = new_boxes(points.min(axis=0), points.max(axis=0), length, len(points), len(points))
    put_all(boxes, points, np.arange(len(points)))
    return Rings(points, ring, before, after, boxes)


def _nearest(places: np.ndarray, rings: Rings, reach: float) -> np.ndarray:
    """Return the point of the curves nearest to each place (K,), -1 where none is within reach."""
    found = np.empty(len(places), np.int64)
    nearest_places(np.ascontiguousarray(places), rings.boxes, rings.points, reach, found, 0, len(places))
    return found


def _sides(places: np.ndarray, normals: np.ndarray, rings: Rings, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the point of the curves nearest to each place (K,), -1 where none is near, and whether the place is to the right of them."""
    foot = _nearest(places, rings, reach)
    near, right = np.flatnonzero(foot >= 0), np.zeros(len(places), np.bool_)
    at, normal = foot[near], normals[near]
    away, out = places[near] - rings.points[at], np.zeros((len(near), 3))
    best, offset = np.full(len(near), np.inf), away.copy()
    for begin, end in ((rings.before[at], at), (at, rings.after[at])):
        ahead = rings.points[end] - rings.points[begin]
        size = np.maximum(np.linalg.norm(ahead, axis=1), 1e-300)[:, None]
        beside = np.cross(ahead / size, normal)
        beside /= np.maximum(np.linalg.norm(beside, axis=1), 1e-300)[:, None]
        arm = places[near] - rings.points[begin]
        share = np.clip((arm * ahead).sum(axis=1) / size[:, 0] ** 2, 0.0, 1.0)
        to = arm - share[:, None] * ahead
        square = (to**2).sum(axis=1)
        closer, same = square < best * (1 - 1e-12), np.abs(square - best) <= best * 1e-12
        out = np.where(closer[:, None], beside, np.where(same[:, None], out + beside, out))
        offset = np.where(closer[:, None], to, offset)
        best = np.minimum(best, square)
    right[near] = (offset * out).sum(axis=1) > 0.0
    return foot, right


def _inside_of(
    samples: SurfaceSamples,
    scanned: Sequence[tuple[np.ndarray, int]],
    curves: Sequence[np.ndarray],
    rings: Rings,
    length: float,
) -> Inside:
    """Return which part of a scan given curves enclose."""
    surface = samples.surface
    links = np.linalg.norm(surface.mean[surface.neighbors] - surface.mean[:, None], axis=2)
    reach = 1.05 * float(links[surface.neighbors >= 0].max())
    sides = [_sides(surface.mean, surface.normals, _joined([curve], length), reach) for curve in curves]
    label = _regions(samples, sides)
    turned, kept, external = _enclosed(samples, scanned, rings, sides, label, length)
    return Inside(surface, rings, np.isin(label, kept), turned, external, reach)


def _regions(samples: SurfaceSamples, sides: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Return the number of the region of each sample (S,): what hangs together without crossing a curve."""
    one, k = np.nonzero(samples.surface.neighbors >= 0)
    other = samples.surface.neighbors[one, k]
    crossing = np.zeros(len(one), np.bool_)
    for foot, right in sides:
        crossing |= (foot[one] >= 0) & (foot[other] >= 0) & (right[one] != right[other])
    label: np.ndarray = component_labels(len(samples.surface.mean), one[~crossing], other[~crossing])
    return label


def _enclosed(
    samples: SurfaceSamples,
    scanned: Sequence[tuple[np.ndarray, int]],
    rings: Rings,
    beside: Sequence[tuple[np.ndarray, np.ndarray]],
    label: np.ndarray,
    length: float,
) -> tuple[np.ndarray, list[int], np.ndarray]:
    """Return which curves are to be turned so that the surface lies to their left, the regions enclosed, and which curves are external.

    Of the curves that are left the longest is external, and those that its region touches are its holes, until none is left.
    """
    count = len(beside)
    sides = [
        [np.bincount(label[(foot >= 0) & (right == side)], minlength=len(label)) for side in (False, True)]
        for foot, right in beside
    ]
    at_boundary = np.bincount(label[_boundary_samples(samples, scanned, rings, length)], minlength=len(label))
    areas = np.bincount(label, minlength=len(label))
    spans = np.bincount(rings.ring, np.linalg.norm(rings.points[rings.after] - rings.points, axis=1))
    turned, external, kept = np.zeros(count, np.bool_), np.zeros(count, np.bool_), []
    left = [int(n) for n in np.argsort(-spans, kind="stable")]
    while left:
        outer = left.pop(0)
        external[outer] = True
        turned[outer] = _inside_is_right(sides[outer], at_boundary, areas, samples, rings, outer)
        region = int(sides[outer][int(turned[outer])].argmax())
        kept.append(region)
        beyond = [sides[outer][int(not turned[outer])]]
        for hole in list(left):
            votes = [side[region] / max(float(side.sum()), 1.0) for side in sides[hole]]
            if max(votes) > 0.5:
                turned[hole] = votes[1] > votes[0]
                beyond.append(sides[hole][int(not turned[hole])])
                left.remove(hole)
        at_boundary[[int(side.argmax()) for side in beyond if side.any()]] += len(
            label
        )  # outside of one is outside of all
    return turned, kept, external


def _inside_is_right(
    sides: Sequence[np.ndarray],
    at_boundary: np.ndarray,
    areas: np.ndarray,
    samples: SurfaceSamples,
    rings: Rings,
    number: int,
) -> bool:
    """Whether an external curve encloses what lies to its right.

    Where the scan lies on one side alone, that is inside; else outside is where the boundary of the scan is; else where less of it is.

    Raises
    ------
    InputError
        Both sides are the same region.
    """
    totals = [int(side.sum()) for side in sides]
    if min(totals) <= LEAST_SCANNED_SHARE * max(totals):
        return totals[1] > totals[0]
    regions = [int(side.argmax()) for side in sides]
    if regions[0] == regions[1]:
        place = words_of_place(rings.points[rings.ring == number][0] + samples.origin)
        raise InputError(
            f"boundary {number + 1} does not divide the scan into inside and outside (near {place}); close it around a part"
        )
    first, second = (int(at_boundary[region]) for region in regions)
    if first != second:
        return first > second
    return bool(areas[regions[1]] > areas[regions[0]])


def _boundary_samples(
    samples: SurfaceSamples, scanned: Sequence[tuple[np.ndarray, int]], rings: Rings, length: float
) -> np.ndarray:
    """Return the samples (K,) at the longest boundary of each piece of the scan, as far as it is none of those given."""
    seen: set[int] = set()
    places = [np.zeros((0, 3))]
    for points, piece in scanned:
        if piece not in seen:
            places.append(points[_nearest(points, rings, SAME_BOUNDARY_WITHIN * length) < 0])
        seen.add(piece)
    owner = owners_of(samples, np.concatenate(places))
    return owner[owner >= 0]


def _is_hole(points: np.ndarray, samples: SurfaceSamples, inside: Inside, length: float) -> bool:
    """Whether a boundary loop of the scan (M, 3) lies inside and is none of those given."""
    owner = owners_of(samples, points)
    owner = owner[owner >= 0]
    away = bool((_nearest(points, inside.rings, SAME_BOUNDARY_WITHIN * length) < 0).any())
    return away and len(owner) > 0 and bool(inside.sample[owner].mean() > INSIDE_SHARE)
