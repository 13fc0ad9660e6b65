"""The body that a scan encloses, without limbs thinner than a member and without slits: morphological opening and closing.

Serra, Image Analysis and Mathematical Morphology, 1982. What is opened away ends where a ball as wide as the thinnest limb just fits.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.geometry.components import component_labels
from .given_normals import GivenNormals
from .linked_samples import Linked, link_samples
from .voxels import (
    VoxelLattice,
    Voxels,
    beyond_ball,
    crossings_of,
    distance_from,
    enclosed_by,
    euler_of_voxels,
    mark_triangles,
)

VOXEL_SIZE = 1.0 / 6.0  # size of a voxel [member lengths]
COARSEST_VOXEL = 0.25  # size of a voxel of a large scan [member lengths]
MOST_VOXELS = 8_000_000  # voxels above which they are made larger
SURELY_BEYOND = 8  # distance as far as the depth in a body has to be known, where it is smoothed and compared [voxels]
# of the ball that does not fit into a limb: three members round are a limb of radius 0.48 [member lengths]
LIMB_RADIUS = 0.45
SLIT_RADIUS = 0.3  # of the ball that does not fit into a slit [member lengths]
# how far a limb stands out, or a slit goes in, beyond what every edge and corner loses [member lengths]
DEPTH_OF_LIMBS = 0.2
# distance from the surface of the body from which on a point belongs to what was taken off or filled [voxels]
OFF_BODY = 1.3
WALL_SAMPLES = 0.12  # distance of the samples that wall off the inside [member lengths]
NEIGHBORS_AT_BOUNDARY = 12  # samples around one that show whether it lies at a boundary
WIDEST_LINK = 0.8  # largest distance of linked samples between which there is a wall [member lengths]
SPARSE_LINK = 2.0  # largest distance of such samples where points are sparse, in distances of the sixth neighbour
DISC_RADIUS, DISC_CORNERS = 1.25, 12  # radius of a disc, in distances of the sixth neighbour, and its corners
MOST_ENCLOSED = 0.5  # share of the samples beside what is enclosed from which on the walls do not leak
WIDER_GAPS = 2  # half the width of gaps that are closed where they do [voxels]
OPEN_GAP = 170.0  # angle between linked samples from which on there is no wall between them [degree]
BOUNDARY_GAP = 130.0  # angle around a sample without others from which on it lies at a boundary [degree]
NEAR_GAP = 0.7  # distance of samples of one boundary [member lengths]
MOST_OPEN = 0.12  # area within the boundaries of a scan that still encloses a body [area of the scan]
FEWEST_OF_BOUNDARY = 8  # samples of a boundary that is walled off
MOST_TAKEN_OFF = 0.4  # share of the points that may be taken off; of more, the scan encloses no body
NEAR_PLACES = 3.0  # distance from a place up to which a limb or slit is near it [member lengths]
BODIES_KEPT = 4  # bodies opened last that are kept, as several looks at a scan ask for the same; two bytes a point


@dataclass(frozen=True, eq=False)
class OpenedBody:
    """What a scan becomes if limbs are taken off its body, and slits in it are filled."""

    limb: NDArray[np.bool_]  #: (N,) whether each point lies on what was taken off
    slit: NDArray[np.bool_]  #: (N,) whether it lies in what was filled
    added: np.ndarray  #: (M, 3) points on the surface where there are none: over limbs and slits


PlainPlaces = tuple[tuple[float, ...], ...]

# by the digest of the points, their length and spacing and the places; the one asked for last is the last
_OPENED: dict[tuple[bytes, float, float, PlainPlaces], OpenedBody | None] = {}


def opened_body(
    points: np.ndarray, length: float, spacing: float, given: GivenNormals | None = None, places: PlainPlaces = ()
) -> OpenedBody | None:
    """Return the body that points (N, 3) enclose, opened and closed; None where they enclose none, or there is nothing to take off or fill.

    Parameters
    ----------
    length : float
        Desired member length [scan unit].
    spacing : float
        Typical distance between neighbouring points [scan unit].
    given : GivenNormals, optional
        Normals that came with the scan.
    places : tuple of (x, y, z), optional
        Where limbs are taken off and slits filled, in the frame of the points; all are where there is none.
    """
    if given is not None:
        return _opened(points, length, spacing, given, places)
    asked = (sha256(points.tobytes()).digest(), length, spacing, places)
    opened = _OPENED.pop(asked) if asked in _OPENED else _opened(points, length, spacing, None, places)
    _OPENED[asked] = opened
    for oldest in list(_OPENED)[:-BODIES_KEPT]:
        del _OPENED[oldest]
    return opened


def _opened(
    points: np.ndarray, length: float, spacing: float, given: GivenNormals | None, places: PlainPlaces
) -> OpenedBody | None:
    """Return the body that points (N, 3) enclose, opened and closed, as `opened_body`."""
    found = link_samples(points, max(WALL_SAMPLES * length, 0.25 * spacing), length, spacing, given)
    if len(found.mean) <= NEIGHBORS_AT_BOUNDARY:
        return None
    lattice = _lattice(points, length)
    if lattice is None:
        return None
    wall, at_gaps = np.zeros(lattice.shape, np.bool_), _at_gaps(found)
    mark_triangles(wall, chain(_fans(found, length), _discs(found, at_gaps, length)), lattice)
    where = NearPlaces(np.reshape(places, (-1, 3)), NEAR_PLACES * length)
    body = enclosed_by(wall)
    if not _bounds_body(found, body, lattice, length):  # random points leave a gap anywhere
        body = enclosed_by(wall, WIDER_GAPS)
    opened = _open_and_close(points, body, lattice, length, where)
    if opened is None and (caps := _caps(found, at_gaps, length, float(wall.sum()) * lattice.size**2)):
        mark_triangles(wall, caps, lattice)
        opened = _open_and_close(points, enclosed_by(wall), lattice, length, where)
    return opened


def _lattice(points: np.ndarray, length: float) -> VoxelLattice | None:
    """Return voxels around points (N, 3); None where they would be too many."""
    margin = (LIMB_RADIUS + WIDEST_LINK + 1.0) * length
    low, extent = points.min(axis=0) - margin, np.ptp(points, axis=0) + 2.0 * margin
    size = max(VOXEL_SIZE * length, float(np.cbrt(extent.prod() / MOST_VOXELS)))
    if size > COARSEST_VOXEL * length:
        return None
    x, y, z = (np.ceil(extent / size).astype(int) + 1).tolist()
    return VoxelLattice(low, size, (x, y, z))


def _fans(found: Linked, length: float) -> Iterator[np.ndarray]:
    """Yield triangles (K, 3, 3) between each sample and two of those linked to it that follow one another around it."""
    from scipy.spatial import cKDTree

    beside, own = found.neighbors, np.arange(len(found.mean))
    turn, beside = _around(found, np.where(beside >= 0, beside, own[:, None]))
    last = beside.shape[1] - 1
    sixth = cKDTree(found.mean).query(found.mean, k=7)[0][:, 6]
    widest = np.maximum(WIDEST_LINK * length, SPARSE_LINK * sixth)
    for k in range(last + 1):
        gap = turn[:, k + 1] - turn[:, k] if k < last else turn[:, 0] + 2.0 * np.pi - turn[:, -1]
        one, other = beside[:, k], beside[:, (k + 1) % (last + 1)]
        closed = (gap < np.radians(OPEN_GAP)) & (one != own) & (other != own) & (one != other)
        corners = found.mean[np.stack([own, one, other], axis=1)[closed]]
        wide = np.linalg.norm(corners[:, 1:] - corners[:, :1], axis=2).max(axis=1)
        yield corners[wide < widest[closed]]


def _bounds_body(found: Linked, enclosed: Voxels, lattice: VoxelLattice, length: float) -> bool:
    """Whether the inside of most samples is enclosed, on one side or the other."""
    deep = LIMB_RADIUS * length * found.normals
    inside = [enclosed[tuple(np.rint(lattice.of(found.mean + side)).astype(int).T)] for side in (deep, -deep)]
    return bool((inside[0] | inside[1]).mean() > MOST_ENCLOSED)


def _tangents(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors (S, 3) at right angles to each normal and to each other."""
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1)[:, None]
    return first, np.cross(normals, first)


def _around(found: Linked, beside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the angles (S, K) at which the samples `beside` each one (S, K) lie around it, in order, and which sample each is."""
    first, second = _tangents(found.normals)
    away = found.mean[beside] - found.mean[:, None]
    turn = np.arctan2(np.einsum("ski,si->sk", away, second), np.einsum("ski,si->sk", away, first))
    order = turn.argsort(axis=1, kind="stable")
    return np.take_along_axis(turn, order, axis=1), np.take_along_axis(beside, order, axis=1)


def _at_gaps(found: Linked) -> NDArray[np.bool_]:
    """Return which samples (S,) lie at a boundary, or at a place where others happen to be missing."""
    from scipy.spatial import cKDTree

    turn, _ = _around(found, cKDTree(found.mean).query(found.mean, k=NEIGHBORS_AT_BOUNDARY + 1)[1][:, 1:])
    gap = np.maximum(np.diff(turn, axis=1).max(axis=1), turn[:, 0] + 2.0 * np.pi - turn[:, -1])
    at_gaps: NDArray[np.bool_] = gap > np.radians(BOUNDARY_GAP)
    return at_gaps


def _discs(found: Linked, some: NDArray[np.bool_], length: float) -> Iterator[np.ndarray]:
    """Yield triangles (K, 3, 3) of a disc around each of some samples (S,), so wide that those of neighbours overlap."""
    from scipy.spatial import cKDTree

    middle, (first, second) = found.mean[some], _tangents(found.normals[some])
    if not len(middle):
        return
    sixth = cKDTree(found.mean).query(middle, k=7)[0][:, 6]
    radius = np.minimum(DISC_RADIUS * sixth, WIDEST_LINK * length)[:, None]
    turn = np.arange(DISC_CORNERS + 1) * (2.0 * np.pi / DISC_CORNERS)
    circle = [middle + radius * (np.cos(each) * first + np.sin(each) * second) for each in turn]
    for one, other in pairwise(circle):
        yield np.stack([middle, one, other], axis=1)


def _caps(found: Linked, at_gaps: NDArray[np.bool_], length: float, area: float) -> list[np.ndarray]:
    """Return triangles (K, 3, 3) over each boundary of the scan, from neighbours along it to its middle; none if much of its area lacks."""
    from scipy.spatial import cKDTree

    at, caps, missing = found.mean[at_gaps], [], 0.0
    if len(at) < FEWEST_OF_BOUNDARY:
        return []
    pairs = cKDTree(at).query_pairs(NEAR_GAP * length, output_type="ndarray").astype(np.int64)
    label = component_labels(len(at), *np.ascontiguousarray(pairs.T))
    for each in np.unique(label):
        boundary = np.flatnonzero(label == each)
        middle = at[boundary].mean(axis=0)
        wide = float(np.linalg.norm(at[boundary] - middle, axis=1).max())
        if len(boundary) >= FEWEST_OF_BOUNDARY and wide > LIMB_RADIUS * length:
            sides = at[pairs[label[pairs[:, 0]] == each]]
            caps.append(np.concatenate([sides, np.broadcast_to(middle, (len(sides), 1, 3))], axis=1))
            missing += np.pi * wide**2
    return caps if missing < MOST_OPEN * area else []


class NearPlaces(NamedTuple):
    """Where limbs are taken off and slits filled."""

    places: np.ndarray  #: (K, 3) [scan unit]; everywhere where there is none
    reach: float  #: [scan unit]

    def of(self, voxels: Voxels, lattice: VoxelLattice) -> Voxels:
        """Return the parts of some voxels (X, Y, Z) that come near a place."""
        from scipy import ndimage
        from scipy.spatial import cKDTree

        if not len(self.places) or not voxels.any():
            return voxels
        part, count = ndimage.label(voxels, np.ones((3, 3, 3), np.bool_))
        at = np.argwhere(voxels)
        away = cKDTree(lattice.of(self.places)).query(at, distance_upper_bound=self.reach / lattice.size)[0]
        kept = np.zeros(count + 1, np.bool_)
        kept[part[tuple(at[np.isfinite(away)].T)]] = True
        return np.asarray(kept[part])


def _without_walls(limbs: Voxels, body: Voxels) -> Voxels:
    """Return which parts of limbs (X, Y, Z) are none that wall off a hollow or close a hole: without those a body would have a tunnel."""
    from scipy import ndimage

    part, count = ndimage.label(limbs, np.ones((3, 3, 3), np.bool_))
    kept = np.ones(count + 1, np.bool_)
    for number, box in enumerate(ndimage.find_objects(part), start=1):
        around = tuple(slice(max(side.start - 1, 0), side.stop + 1) for side in box)
        own = body[around]
        kept[number] = euler_of_voxels(own & (part[around] != number)) >= euler_of_voxels(own)
    kept[0] = False
    return np.asarray(kept[part])


def _islands(body: Voxels, before: Voxels) -> Voxels:
    """Return the parts of a body (X, Y, Z) that hung on what was taken off it: of each part before, all but the largest that is left."""
    from scipy import ndimage

    part, count = ndimage.label(body)
    of = ndimage.label(before)[0]
    sizes = np.bincount(part.ravel(), minlength=count + 1)
    whole = ndimage.maximum(of, part, np.arange(count + 1)).astype(int).tolist()  # of which each is
    largest: dict[int, int] = {}
    for each in (np.argsort(-sizes[1:], kind="stable") + 1).tolist():
        largest.setdefault(whole[each], each)
    islands: Voxels = body & ~np.isin(part, list(largest.values()))
    return islands


def _open_and_close(
    points: np.ndarray, body: Voxels, lattice: VoxelLattice, length: float, where: NearPlaces
) -> OpenedBody | None:
    """Return what becomes of points (N, 3) around a body; None where it is all thinner than a limb, loses too much or nothing changes."""
    from scipy import ndimage
    from scipy.spatial import cKDTree

    if not (
        distance_from(~body, lattice, LIMB_RADIUS * length) >= LIMB_RADIUS * length
    ).any():  # pockets of an open sheet
        return None
    thin = where.of(beyond_ball(body, LIMB_RADIUS * length, DEPTH_OF_LIMBS * length, lattice), lattice)
    limbs = _without_walls(thin, body)
    body = body & ~limbs
    slits = where.of(beyond_ball(~body, SLIT_RADIUS * length, DEPTH_OF_LIMBS * length, lattice), lattice)
    islands = _islands(body | slits, body | limbs)
    limbs |= islands
    body = (body | slits) & ~islands
    reach = SURELY_BEYOND * lattice.size
    depth = distance_from(~body, lattice, reach) - distance_from(body, lattice, reach)  # positive inside
    depth -= 0.5 * lattice.size * np.sign(depth)
    at = lattice.of(points).T
    own = ndimage.map_coordinates(depth, at, order=1)
    inside, voxel = own > OFF_BODY * lattice.size, tuple(np.rint(at).astype(int))
    slits[tuple(axis[inside] for axis in voxel)] = True  # those so narrow that the walls filled them
    slits = where.of(slits, lattice)
    slit = inside & slits[voxel]
    changed = distance_from(limbs | slits, lattice, max(length, reach))
    near = ndimage.map_coordinates(np.minimum(changed, length), at, order=1) < 2.0 * lattice.size
    limb = near & (own < -OFF_BODY * lattice.size)
    left = ~limb & ~slit
    if left.all() or left.mean() < 1.0 - MOST_TAKEN_OFF:
        return None
    surface = crossings_of(ndimage.gaussian_filter(depth, 1.0), changed < 2.5 * lattice.size, lattice)
    bare = cKDTree(points[left]).query(surface)[0] > 0.8 * lattice.size if len(surface) else np.zeros(0, np.bool_)
    return OpenedBody(limb, slit, surface[bare])
