"""The scan prepared for one member length: sites with oriented normals, linked on each sheet."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..clean.duplicates import find_repeated, has_repeats
from ..clean.strays import find_strays, has_strays
from ..errors import InputError
from ..kernels import normals as facing
from ..kernels import sites as kernels
from ..kernels.boxes import SearchBoxes, new_boxes
from ..kernels.nearby import nearest_places
from ..kernels.surface import Surface
from ..machine import in_parts
from ..settings import Settings
from .cloud import PointCloud, bounds_of
from .field import Wish, length_field, wish_of
from .streamline import is_dense, points_near, streamlined

NEIGHBORS = 12  # links of a site
CLOSE = 1.5  # size of the search boxes while sites are chosen, in their radii
MANY = 250_000  # points from which on they no longer fit into the cache, and are sorted
LARGE = 8.0  # size of the sites that they are sorted by, in radii of a site
PART = 20_000  # fewest points for a thread of their own
FINE = 0.3  # distance of points, in radii of a site, that serves the patches as well as any smaller one
SOME, ALL = 8.0, 24.0  # most points of a site that a patch is fitted to, on the way and in the end
HEAD_ON = 40  # links of which a smooth two-sided surface has fewer that meet head-on
STEEP = 0.75  # sine of the angle over the plane of a site at which a neighbour lies on another sheet
ROUGH = 0.04  # sites thicker than this many member lengths are settled to a sheet first
SOME_ROUGH = 0.002  # share of such sites from which on that is done
SHEETS = 0.12  # sites thicker than this may be several sheets
FINER = 2  # times that sites are made twice as fine, to see whether a thick layer is several sheets
FINEST = 1.0  # spacings between the finest sites


@dataclass(frozen=True, eq=False)
class Sites:
    """What all later steps look up in the scan."""

    surface: Surface
    boxes: SearchBoxes  #: the sites by box
    piece: np.ndarray  #: (S,) int64 number of the connected piece of each site, the largest piece is 0
    thickness: np.ndarray  #: (S,) rms distance of each site and its neighbours from their plane [scan unit]
    spacing: float  #: typical distance between neighbouring points [scan unit]
    area: float  #: rough area of the scanned surface [scan unit^2]
    graded_area: float  #: the same with each part in units of its own desired length, times that of `Settings.length` [scan unit^2]
    pieces: tuple[int, ...]  #: numbers of the pieces that are large enough for a grid
    strays: int = 0  #: stray points that were left out
    repeated: int = 0  #: points that were left out because they repeat another one
    measured: int = 0  #: sites with measured points; those from this number on have made-up ones only
    whole: np.ndarray | None = None  #: (N, 3) the points, where `surface` has only some of them

    @property
    def graded(self) -> bool:
        """Whether the desired member length differs from place to place."""
        return is_graded(self.surface)


_KEPT: weakref.WeakKeyDictionary[PointCloud, dict[tuple[float, float, float, bool, Wish | None], Sites]] = (
    weakref.WeakKeyDictionary()
)


def prepare_sites(cloud: PointCloud, settings: Settings) -> Sites:
    """Return the sites of a cloud for a member length; kept as long as the cloud lives.

    Parameters
    ----------
    cloud : PointCloud
    settings : Settings
        `length` and `box_size` decide how far apart sites are, `clean`, `stray_distance` and `drop_repeated` which points are left
        out, `length_field` where members are to be longer.
    """
    strays = settings.stray_distance if settings.clean else 0.0
    repeated = settings.clean and settings.drop_repeated
    key = (settings.length, settings.box_size, strays, repeated, wish_of(settings, cloud.origin))
    kept = _KEPT.setdefault(cloud, {})
    if key not in kept:
        kept.clear()
        kept[key] = _prepare(cloud.points, cloud.spacing, *key)
    return kept[key]


def is_graded(surface: Surface) -> bool:
    """Whether the desired member length differs from place to place."""
    return bool(np.any(surface.field != 1.0))


def local_field(surface: Surface, place: np.ndarray) -> float:
    """Desired length at a place, in lengths: that of the nearest site."""
    return float(surface.field[((surface.mean - place) ** 2).sum(axis=1).argmin()])


def sites_with(sites: Sites, added: np.ndarray, cloud: PointCloud, settings: Settings) -> Sites:
    """Return the sites of the same points of a cloud and of made-up ones (F, 3) [scan unit]."""
    points = sites.surface.points
    both = np.concatenate([points, added])
    wish = wish_of(settings, cloud.origin)
    prepared = _prepare(both, sites.spacing, settings.length, settings.box_size, 0.0, False, wish, len(points))
    return replace(prepared, strays=sites.strays, repeated=sites.repeated, whole=sites.whole)


def narrow_surface(sites: Sites, points: float) -> Surface:
    """Return the local surface with patches of about so many points: the fewer, the closer it follows the scan.

    More points of each site count than while nodes are still on their way.
    """
    surface = sites.surface
    radius = np.sqrt(points * sites.area / (np.pi * len(surface.points)))
    scale = surface.scale.copy()
    scale[2] = np.clip(radius, 0.1 * scale[0], scale[2])
    scale[3] = ALL
    if np.isfinite(points):  # so many points, whatever the length of the members
        surface = surface._replace(field=np.ones_like(surface.field))
    return surface._replace(scale=scale)


def with_whole_rim(sites: Sites, rim: np.ndarray, surface: Surface) -> Surface:
    """Return the surface with all points near some sites (R,), where it has only some of them: those of the rim tell where it is."""
    if sites.whole is None or len(rim) == 0:
        return surface
    near = sites.whole[points_near(sites.whole, surface.mean[rim], 2.0 * surface.scale[1])]
    owner, means, reach = np.empty(len(near), np.int64), surface.mean, 2.0 * surface.scale[1]
    in_parts(len(near), PART, lambda _, begin, end: nearest_places(near, sites.boxes, means, reach, owner, begin, end))
    owned = np.repeat(np.arange(len(surface.mean)), np.diff(surface.start))
    points = np.concatenate([surface.points, near[owner >= 0]])
    grouped, start, _ = _group(points, np.concatenate([owned, owner[owner >= 0]]), len(surface.mean))
    return surface._replace(points=grouped, start=start)


def distance_from_scan(surface: Surface, place: np.ndarray) -> float:
    """Distance of a place from the nearest point of the scan."""
    squares = ((surface.mean - place) ** 2).sum(axis=1)
    reach = np.sqrt(squares.min()) + 2.0 * surface.scale[1]
    best = np.inf
    for site in np.flatnonzero(squares <= reach * reach):
        points = surface.points[surface.start[site] : surface.start[site + 1]]
        best = min(best, float(((points - place) ** 2).sum(axis=1).min()))
    return float(np.sqrt(best))


def with_own_scratch(surface: Surface) -> Surface:
    """Return the same surface with room of its own for look-ups, so that threads do not meet."""
    return surface._replace(
        stamp=np.zeros_like(surface.stamp), queue=surface.queue.copy(), counter=np.zeros_like(surface.counter)
    )


def broad_normals(surface: Surface, passes: int = 4) -> np.ndarray:
    """Return normals at the scale of a member (S, 3): of the sheet as a whole where the scan is rough or overgrown."""
    normals = surface.normals
    for _ in range(passes):
        smoothed = np.empty_like(normals)
        facing.smooth_normals(normals, surface.neighbors, 0.0, smoothed)
        normals = smoothed
    return normals


def surface_of(cloud: PointCloud, settings: Settings) -> Surface:
    """Return the local surface of the scan for the kernels."""
    return prepare_sites(cloud, settings).surface


def _prepare(
    points: np.ndarray,
    spacing: float,
    length: float,
    box_size: float,
    stray_distance: float,
    drop_repeated: bool,
    wish: Wish | None,
    measured: int | None = None,
) -> Sites:
    radius = max(box_size * length, 0.25 * spacing)
    repeated = 0
    if drop_repeated and has_repeats(points):
        kept = ~find_repeated(points)
        repeated = int(len(points) - kept.sum())
        points = np.ascontiguousarray(points[kept])
    whole, size = points, FINE * radius if measured is None else 0.0
    points = _fewer(whole, size, spacing)
    if measured is None:  # made-up points come last
        points = _sorted(points, radius)
    found = _linked(points, radius, length, spacing)
    strays = 0
    if stray_distance and has_strays(found.neighbors):
        stray = find_strays(whole, stray_distance, length)
        strays = int(stray.sum())
        if strays:
            whole = np.ascontiguousarray(whole[~stray])
            points = _sorted(_fewer(whole, size, spacing), radius)
            found = _linked(points, radius, length, spacing)
    rough = ROUGH * length
    if _is_rough(found, SHEETS * length):
        fine = _linked_finer(whole, radius, length, spacing)
        if fine is not None:
            points, (found, radius) = whole, fine
    measured = len(found.chosen) if measured is None else int((found.chosen < measured).sum())
    owner, _, grouped, start, boxes, mean, neighbors, normals, thickness = found
    if _is_rough(found, rough):
        settled = np.empty_like(mean)
        kernels.settle_sites(mean, neighbors, thickness, rough, 0.6 * length, settled)
        joined, chosen, mean, boxes, neighbors = _settled(settled, radius, length, spacing)
        grouped, start, _ = _group(points, joined[owner], len(chosen))
        measured = int((chosen < measured).sum())
        normals, thickness = _normals(mean, neighbors)
    facing.trust_thin_sites(mean, normals, neighbors, thickness, rough, STEEP)
    facing.cut_steep_links(mean, normals, neighbors, STEEP)
    weights = np.empty(neighbors.shape, np.uint8)  # few values are sorted faster
    facing.link_weights(mean, normals, neighbors, weights)
    order = np.argsort(weights, axis=None, kind="stable")[: int((neighbors >= 0).sum())]
    piece = np.empty(len(mean), np.int64)
    facing.orient_normals(mean, normals, neighbors, order, piece)
    smoothed = np.empty_like(normals)
    facing.smooth_normals(normals, neighbors, 0.7, smoothed)
    face_outside(mean, smoothed, piece)
    scale = np.array([length, radius, max(0.65 * length, 2.6 * spacing), SOME, max(radius, 1.3 * spacing)])
    scratch = np.zeros(len(mean), np.int64)
    surface = Surface(
        grouped,
        start,
        mean,
        smoothed,
        neighbors,
        scale,
        scratch,
        scratch.copy(),
        np.zeros(1, np.int64),
        np.ones(len(mean)),
    )
    surface = surface._replace(field=length_field(surface, wish))
    piece = _number(piece)
    area = _site_areas(surface)
    graded = area / surface.field**2
    large = _large_pieces(piece, area, graded, length)
    total, scaled = float(area.sum()), float(graded.sum())
    dense = whole if len(points) < len(whole) else None
    return Sites(surface, boxes, piece, thickness, spacing, total, scaled, large, strays, repeated, measured, dense)


def _fewer(points: np.ndarray, size: float, spacing: float) -> np.ndarray:
    """Return one point of each box of a size where they lie much denser, else all."""
    return points[streamlined(points, size)] if is_dense(spacing, size) else points


def _sorted(points: np.ndarray, radius: float) -> np.ndarray:
    """Return many points sorted by much larger sites: what lies together in space then does so in memory, in all that follows.

    By sites, not by boxes: a scan that is turned or moved stays sorted as it was.
    """
    if len(points) < MANY:
        return points
    owner, _, places, _, _ = _settled(points, LARGE * radius, 0.0, 0.0)
    return _group(points, owner, len(places))[0]


def _settled(
    points: np.ndarray, radius: float, length: float, spacing: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, SearchBoxes, np.ndarray]:
    """Return the nearest site of each point, the point of each site and where it is, the sites by box and their neighbours."""
    owner, chosen, places, boxes = sites_of_points(points, radius)
    neighbors = _neighbors(places, boxes, length, radius, spacing)
    in_parts(
        len(points), PART, lambda _, begin, end: kernels.settle_points(points, places, neighbors, owner, begin, end)
    )
    return owner, chosen, places, boxes, neighbors


class _Linked(NamedTuple):
    """Sites of one thinning radius, linked; their normals of either sign."""

    owner: np.ndarray  #: (N,) int64 site of each point
    chosen: np.ndarray  #: (S,) int64 point of each site
    grouped: np.ndarray  #: (N, 3) the points sorted by site
    start: np.ndarray  #: (S + 1,) int64 where each site's points start
    boxes: SearchBoxes
    mean: np.ndarray  #: (S, 3)
    neighbors: np.ndarray  #: (S, NEIGHBORS) int64
    normals: np.ndarray  #: (S, 3)
    thickness: np.ndarray  #: (S,)


def _linked(points: np.ndarray, radius: float, length: float, spacing: float) -> _Linked:
    """Return the sites of points for one thinning radius."""
    owner, chosen, _, boxes, neighbors = _settled(points, radius, length, spacing)
    grouped, start, mean = _group(points, owner, len(chosen))
    return _Linked(owner, chosen, grouped, start, boxes, mean, neighbors, *_normals(mean, neighbors))


def _linked_finer(points: np.ndarray, radius: float, length: float, spacing: float) -> tuple[_Linked, float] | None:
    """Return finer sites, and their radius, where these form smooth sheets; None where they do not.

    Sheets that lie side by side, a few sites apart, look like one rough layer. They come apart as soon as the sites are finer.
    """
    for _ in range(FINER):
        radius *= 0.5
        if radius < FINEST * spacing:
            return None
        found = _linked(points, radius, length, spacing)
        if not _is_rough(found, ROUGH * length):
            return found, radius
    return None


def _is_rough(found: _Linked, rough: float) -> bool:
    """Whether the sites form a thick layer, no sheet."""
    return bool((found.thickness > rough).mean() > SOME_ROUGH)


def _group(points: np.ndarray, owner: np.ndarray, sites: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points sorted by site, where each site's points start, and their means."""
    start, mean = np.zeros(sites + 1, np.int64), np.zeros((sites, 3))
    grouped, index = np.empty_like(points), np.empty(len(points), np.int64)
    kernels.group_points(points, owner, start, grouped, index, mean)
    return grouped, start, mean


def _neighbors(places: np.ndarray, boxes: SearchBoxes, length: float, radius: float, spacing: float) -> np.ndarray:
    """Return the neighbours of each site (S, 3) among the others."""
    neighbors = np.full((len(places), NEIGHBORS), -1, np.int64)
    far = max(0.7 * length, 3.0 * spacing)
    near = max(2.9 * radius, 1.5 * spacing)
    in_parts(
        len(places), 3000, lambda _, begin, end: kernels.nearest_sites(places, boxes, near, far, neighbors, begin, end)
    )
    kernels.link_back(places, neighbors)
    return neighbors


def _normals(mean: np.ndarray, neighbors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the normal of each site (either sign) and the thickness of the points there."""
    normals, thickness = np.empty_like(mean), np.empty(len(mean))
    in_parts(
        len(mean), 3000, lambda _, begin, end: facing.site_normals(mean, neighbors, normals, thickness, begin, end)
    )
    return normals, thickness


def sites_of_points(points: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, SearchBoxes]:
    """Return a site within the radius of each point, the point of each site and where it is (S, 3), and the sites by box.

    Sites are points that keep the radius: each that has no earlier site nearer.
    """
    owner = np.full(len(points), -1, np.int64)
    lower, upper = bounds_of(points)
    capacity, begin, count = 1 << 14, 0, 0
    chosen, places = np.empty(capacity, np.int64), np.empty((capacity, 3))
    while True:
        boxes = new_boxes(lower, upper, CLOSE * radius, capacity, capacity)
        kernels.put_all(boxes, points, chosen[:count])
        begin, count = kernels.choose_sites(points, radius, boxes, owner, chosen, places, begin, count)
        if begin == len(points):
            break
        chosen = np.concatenate([chosen[:count], np.empty(3 * capacity, np.int64)])
        places = np.concatenate([places[:count], np.empty((3 * capacity, 3))])
        capacity = len(chosen)
    places, chosen = places[:count].copy(), chosen[:count].copy()
    boxes = new_boxes(lower, upper, 4.0 * radius, count, count)
    kernels.put_all(boxes, places, np.arange(count))
    return owner, chosen, places, boxes


def _number(piece: np.ndarray) -> np.ndarray:
    """Number the pieces by size, largest first."""
    _, inverse, counts = np.unique(piece, return_inverse=True, return_counts=True)
    rank = np.empty(len(counts), np.int64)
    rank[np.argsort(-counts, kind="stable")] = np.arange(len(counts))
    return rank[inverse.ravel()]


def _site_areas(surface: Surface) -> np.ndarray:
    """Rough area around each site (S,): that of a disc through its neighbours over their number [scan unit^2]."""
    linked = surface.neighbors >= 0
    count = linked.sum(axis=1)
    last = surface.neighbors[np.arange(len(count)), np.maximum(count - 1, 0)]
    reach = ((surface.mean[last] - surface.mean) ** 2).sum(axis=1)
    return np.where(count > 0, np.pi * reach / (count + 1), 0.0)


def _large_pieces(piece: np.ndarray, area: np.ndarray, graded: np.ndarray, length: float) -> tuple[int, ...]:
    """Pieces that are not debris: room for some twenty triangles, and a hundredth of the largest."""
    count = np.bincount(piece)
    total = np.bincount(piece, area)
    large = (np.bincount(piece, graded) >= 20.0 * 0.433 * length**2) & (total >= 0.01 * total.max()) & (count >= 12)
    large[0] = True
    return tuple(int(i) for i in np.flatnonzero(large))


def face_outside(mean: np.ndarray, normals: np.ndarray, piece: np.ndarray) -> None:
    """Turn the normals of each piece away from its centre; upwards where that does not tell (a plate)."""
    _, inverse = np.unique(piece, return_inverse=True)
    inverse = inverse.ravel()
    count = np.bincount(inverse)
    centre = np.stack([np.bincount(inverse, mean[:, c]) / count for c in range(3)], axis=1)
    arm = mean - centre[inverse]
    size = np.sqrt(np.bincount(inverse, (arm**2).sum(axis=1)) / count)
    bulge = np.bincount(inverse, (arm * normals).sum(axis=1)) / count
    up = np.stack([np.bincount(inverse, normals[:, c]) / count for c in range(3)], axis=1)
    for i in range(len(count)):
        side = bulge[i]
        if abs(side) < 0.01 * max(size[i], 1e-300):
            side = next((up[i, c] for c in (2, 1, 0) if abs(up[i, c]) > 1e-6), 1.0)
        if side < 0:
            normals[inverse == i] *= -1.0


def check_two_sided(sites: Sites) -> None:
    """Refuse a one-sided surface (Moebius strip): whatever side the normals are turned to, they meet head-on somewhere.

    Counted are links in which neighbours of a smooth part lie side by side and yet face opposite sides: where the scan is rough
    or overgrown that happens by chance.
    """
    surface = sites.surface
    smooth = 0.15 * surface.scale[4]
    if facing.head_on_links(surface.mean, surface.normals, surface.neighbors, sites.thickness, smooth) >= HEAD_ON:
        raise InputError(
            "the scanned surface is one-sided (like a Moebius strip), a grid needs two sides; cut the scan into pieces"
        )
