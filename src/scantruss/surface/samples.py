"""The scan prepared for one member length: surface samples with oriented normals, linked on each sheet."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..kernels.geometry.boxes import SearchBoxes
from ..kernels.scan.nearby import nearest_places
from ..kernels.surface.local_surface import Surface
from ..runtime.parallel import in_parts
from ..scan.clean.duplicates import find_repeated, has_repeats
from ..scan.clean.streamline import points_near
from ..scan.cloud import WITHOUT_COORDINATES, Bounds, PointCloud, bounds_of, by_x
from ..scan.normals import mean_normals
from ..settings import SAMPLE_SPACING, SMOOTH_SAMPLE_SPACING, Settings
from .body import opened_body
from .chosen_samples import (
    DUPLICATE,
    KEPT,
    LIMB,
    OUTLIER,
    ROD,
    SLIT,
    Asked,
    ChosenSamples,
    choose_samples_of,
    usual_samples,
)
from .faced_surface import faced_surface
from .floor import find_floor
from .given_normals import GivenNormals, given_normals
from .limbs import LimbRing, cut_limbs
from .linked_samples import LINKED_POINTS_PER_THREAD, PATCH_SPACING, group
from .of_cloud import cloud_has_outliers, lone_of_cloud
from .owners import owners_of
from .pieces import by_size, chosen_pieces, large_pieces, number_pieces, places_to_count, sample_areas
from .rods_at_lengths import points_of_rods
from .scratch import KeptSamples
from .shape import check_is_surface, layers_of_surface
from .size_field import length_field
from .thin_walls import normals_of_walls

BESIDE_SAMPLES = 1.5  # distance from points of the boundary within which all points are used [`sample_spacing`]
UNCLEANED_DISTANCE = 3.0  # as `Settings.outlier_distance`, where a scan is not cleaned
BROAD_PASSES = 4  # times that normals are averaged with those beside them for the sheet as a whole
# points of a cloud with which samples of several settings are kept, that often, as the looks at a scan ask for a dozen and more and each
# effort for all of them again; of larger clouds the last ones; they take about 100 bytes a point
POINTS_OF_KEPT_SAMPLES = 1_500_000
PATCH_POINTS_TO_PROJECT = 24.0  # most points per sample to which a patch is fitted when nodes are projected


@dataclass(frozen=True, eq=False)
class SurfaceSamples:
    """The scan as all later steps see it."""

    surface: Surface
    boxes: SearchBoxes  #: the samples by box
    piece: np.ndarray  #: (S,) int64 number of the connected piece of each sample, the largest piece is 0
    thickness: np.ndarray  #: (S,) rms distance of each sample and its neighbours from their plane [scan unit]
    spacing: float  #: typical distance between neighbouring points [scan unit]
    area: float  #: rough area of the scanned surface [scan unit^2]
    graded_area: float  #: the same as if the desired length were `Settings.length` everywhere, for as many triangles [scan unit^2]
    pieces: tuple[int, ...]  #: numbers of the pieces that are large enough for a grid
    scan: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  #: (N, 3) all points that were read [scan unit]
    judged: np.ndarray = field(
        default_factory=lambda: np.zeros(0, np.uint8)
    )  #: (N,) KEPT, DUPLICATE, OUTLIER and so on
    not_chosen: tuple[int, ...] = ()  #: numbers of the pieces that are large enough but left out by the settings
    floor: int | None = None  #: number of the piece that was taken for a floor and left out
    unread: tuple[tuple[str, int], ...] = ()  #: reasons why points of the file were not read, and how many
    measured: int = 0  #: number of samples with measured points; those after them fill holes, or close a body
    whole: np.ndarray | None = None  #: (N, 3) all points if `surface` has only some of them
    sample_spacing: float = 0.0  #: spacing of the points of `surface` then [scan unit]
    smooth: bool = False  #: whether the scan bends evenly everywhere, without ridges
    rough: float = 0.0  #: share of the samples thicker than `ROUGH_THICKNESS` before they were moved
    moved: float = 0.0  #: `Settings.smooth_scale` where the points of `surface` were moved to the mean surface, else 0
    #: (S,) whether each sample lies on a sharp edge of a body, if these are looked for
    on_edge: np.ndarray = field(default_factory=lambda: np.zeros(0, np.bool_))
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))  #: (3,) of the cloud [scan unit]
    unit: str = ""  #: unit of the scan
    system: str = ""  #: reference system of the scan
    given: GivenNormals | None = None  #: normals that came with the scan
    rings: tuple[LimbRing, ...] = ()  #: where limbs too thin for a grid were cut off
    #: (2, 3) the box around the points that were not read since a crop left them out, by its words, in the scan's own frame
    cropped: tuple[tuple[str, np.ndarray], ...] = ()
    #: (N,) points with nothing else near them, whether they are left out or not; none where that is not known
    lone: np.ndarray = field(default_factory=lambda: np.zeros(0, np.bool_))

    def __repr__(self) -> str:
        """Say how many samples and pieces there are."""
        found = f"{len(self.surface.mean):,} samples of {len(self.scan):,} points"
        return f"SurfaceSamples({found}, pieces {len(self.pieces)}, area {self.area:.4g} {self.unit or 'unit'}^2)"

    @property
    def outliers(self) -> int:
        """Number of outliers that were left out."""
        return int((self.judged == OUTLIER).sum())

    @property
    def repeated(self) -> int:
        """Number of points that were left out because they repeat another one."""
        return int((self.judged == DUPLICATE).sum())

    @cached_property
    def measured_points(self) -> np.ndarray:
        """The points that were read and kept, without outliers and duplicates (M, 3) [scan unit]."""
        kept = self.judged == KEPT
        return self.scan if kept.all() else np.ascontiguousarray(self.scan[kept])

    @cached_property
    def points_by_x(self) -> np.ndarray:
        """The measured points (M, 3) by ascending x, among which those near a place are found at once [scan unit]."""
        return by_x(self.measured_points)

    @cached_property
    def points_of_surface(self) -> np.ndarray:
        """The measured points (M, 3) without lone ones, which may have been kept but are no surface [scan unit]."""
        alone = (self.judged == KEPT) & self.lone if len(self.lone) else np.zeros(1, np.bool_)
        return self.scan[(self.judged == KEPT) & ~self.lone] if alone.any() else self.measured_points

    @cached_property
    def kept(self) -> np.ndarray:
        """Which samples are of pieces that get a grid (S,) bool."""
        return np.isin(self.piece, self.pieces)

    @cached_property
    def named_pieces(self) -> dict[int, int]:
        """The pieces large enough for a grid by the numbers that users give them: by area, and no member length changes them."""
        owner = owners_of(self, places_to_count(self.scan, self.spacing))
        large = {*self.pieces, *self.not_chosen}
        ordered = enumerate(by_size(owner, self.surface.mean, self.piece), 1)
        return {number: piece for number, piece in ordered if piece in large}

    @cached_property
    def elsewhere(self) -> np.ndarray:
        """Which points lie on pieces that are large enough but were not chosen (N,) bool."""
        there = np.zeros(len(self.scan), np.bool_)
        if self.not_chosen:
            kept = np.flatnonzero(self.judged == KEPT)
            owner = owners_of(self, self.scan[kept])
            there[kept] = (owner >= 0) & np.isin(self.piece[owner], self.not_chosen)
        return there

    @property
    def left_out(self) -> tuple[int, float]:
        """Number of pieces too small for a grid, and their share of the samples, which is about that of the area."""
        samples = np.bincount(self.piece)
        small = np.delete(samples, [*self.pieces, *self.not_chosen])
        return len(small), float(small.sum() / samples.sum())

    @cached_property
    def layers(self) -> tuple[float, float]:
        """Distance between two layers closer than half a member, and the share of the scan that has them; 0, 0 for one layer."""
        return layers_of_surface(self)

    @property
    def density(self) -> float:
        """Points per area [1 / scan unit^2]."""
        return len(self.surface.points if self.whole is None else self.whole) / self.area

    @property
    def graded(self) -> bool:
        """Whether the desired member length differs from place to place."""
        return is_graded(self.surface)


_KEPT = KeptSamples()


def sample_surface(cloud: PointCloud, settings: Settings) -> SurfaceSamples:
    """Return the samples of a cloud for a member length, in search boxes (Eq. 1); each thread keeps the last while the cloud lives.

    Parameters
    ----------
    cloud : PointCloud
    settings : Settings
        `length` and `box_size` determine the spacing of the samples; `clean`, `outlier_distance` and `drop_duplicates` which points
        are left out; `length_field` where members are longer; `sharp_edges` whether edges of bodies are looked at.
    """
    asked = Asked.of(settings, cloud.origin, cloud.z_is_up)
    if asked.outlier_distance and not asked.judge_always:
        asked = asked._replace(judge_always=cloud_has_outliers(cloud))
    kept = _KEPT.of_clouds.setdefault(cloud, {})
    found = kept.pop(asked, None) or _samples_of(cloud, asked, kept)
    kept[asked] = found  # the one used last is the last to go
    return found


def _samples_of(cloud: PointCloud, asked: Asked, kept: dict[Asked, SurfaceSamples]) -> SurfaceSamples:
    """Return the samples that are asked for, by those that are kept, of which the oldest go to make room."""
    for own, found in () if asked.limb_girth else kept.items():
        if not found.rings and own._replace(limb_girth=0.0) == asked:  # limbs were looked for, but none was cut off
            return found
    most = max(1, POINTS_OF_KEPT_SAMPLES // max(len(cloud.points), 1))
    for oldest in list(kept)[: max(0, len(kept) + 1 - most)]:
        del kept[oldest]
    with_rods = kept.get(asked._replace(keep_rods=True))
    if not asked.keep_rods and with_rods is not None and _has_no_rods(with_rods, cloud.spacing, asked):
        return with_rods
    lone = lone_of_cloud(cloud, asked.outlier_distance or UNCLEANED_DISTANCE)
    given = given_normals(cloud)
    if given is None and asked.thin_walls:
        given = normals_of_walls(cloud.points, cloud.spacing, asked.length)
    made = _prepare(cloud.points, cloud.bounds, cloud.spacing, asked, given, lone=lone)
    check_is_surface(made)
    unread = (*cloud.left_out, *((WITHOUT_COORDINATES, cloud.dropped) for _ in range(cloud.dropped > 0)))
    return replace(
        made, origin=cloud.origin, unit=cloud.unit, system=cloud.system, unread=unread, cropped=cloud.cropped, lone=lone
    )


def _has_no_rods(samples: SurfaceSamples, spacing: float, asked: Asked) -> bool:
    """Whether samples are the same without the rods of their scan, as it has none: those of a smooth scan are others without them."""
    if samples.smooth:
        return False
    left = np.ascontiguousarray(samples.scan[np.isin(samples.judged, (KEPT, LIMB, SLIT))])
    return not points_of_rods(left, spacing, asked).any()


def is_graded(surface: Surface) -> bool:
    """Whether the desired member length differs from place to place."""
    return bool(np.any(surface.field != 1.0))


def samples_with(
    samples: SurfaceSamples, added: np.ndarray, settings: Settings, kept: np.ndarray | None = None
) -> SurfaceSamples:
    """Return the samples of the same points, or of those of `surface.points` that are kept (P,) bool, and of added ones (F, 3)."""
    points, measured = samples.surface.points, int(samples.surface.start[samples.measured])
    if kept is not None:
        points, measured = points[kept], int(kept[:measured].sum())
    both = np.concatenate([points, added])
    asked = Asked.of(settings, samples.origin, samples.floor is not None)._replace(
        outlier_distance=0.0, drop_duplicates=False, smooth_scale=0.0
    )
    if kept is not None:  # which parts are wanted is said by what is kept
        asked = asked._replace(piece="all")
    if not samples.smooth:  # then it is not with more points either
        asked = asked._replace(box_size=asked.box_size or SAMPLE_SPACING)
    prepared = _prepare(both, bounds_of(both), samples.spacing, asked, samples.given, measured)
    return replace(
        prepared,
        scan=samples.scan,
        judged=samples.judged,
        unread=samples.unread,
        cropped=samples.cropped,
        lone=samples.lone,
        whole=samples.whole,
        sample_spacing=samples.sample_spacing,
        rough=samples.rough,
        moved=samples.moved,
        origin=samples.origin,
        unit=samples.unit,
        system=samples.system,
        rings=samples.rings,
    )


def narrow_surface(samples: SurfaceSamples, points: float) -> Surface:
    """Return the local surface with patches of about so many points: the fewer, the closer it follows the scan.

    Patches take more points of each sample than while nodes are still moving.
    """
    surface = samples.surface
    radius = np.sqrt(points * samples.area / (np.pi * len(surface.points)))
    surface = surface._replace(
        patch_radius=float(np.clip(radius, 0.1 * surface.length, surface.patch_radius)),
        patch_points=PATCH_POINTS_TO_PROJECT * (SMOOTH_SAMPLE_SPACING / SAMPLE_SPACING) ** 2
        if samples.smooth
        else PATCH_POINTS_TO_PROJECT,  # as many for an area
    )
    if np.isfinite(points):  # the number of points does not depend on the length of the members
        surface = surface._replace(field=np.ones_like(surface.field))
    return surface


def with_whole_boundary(samples: SurfaceSamples, surface: Surface, boundary_points: np.ndarray) -> Surface:
    """Return the surface with all points of the scan near points of the boundary (R, 3), which locate it, if it has only some of them."""
    if samples.whole is None:
        return surface
    reach, given = BESIDE_SAMPLES * samples.sample_spacing, np.ones(len(surface.points), np.bool_)
    near = samples.whole.take(points_near(samples.whole, boundary_points, reach), axis=0)
    given[points_near(surface.points, boundary_points, reach)] = False
    owner, means, far = np.empty(len(near), np.int64), surface.mean, 2.0 * surface.radius
    in_parts(
        len(near),
        LINKED_POINTS_PER_THREAD,
        lambda _, begin, end: nearest_places(near, samples.boxes, means, far, owner, begin, end),
    )
    owned = np.repeat(np.arange(len(surface.mean)), np.diff(surface.start))
    points = np.concatenate([surface.points[given], near[owner >= 0]])
    grouped, start, _ = group(points, np.concatenate([owned[given], owner[owner >= 0]]), len(surface.mean))
    return surface._replace(points=grouped, start=start)


def broad_normals(surface: Surface) -> np.ndarray:
    """Return normals averaged over about a member (S, 3): those of the sheet as a whole if the scan is rough or overgrown."""
    normals = surface.normals
    for _ in range(BROAD_PASSES):
        normals = mean_normals(normals, surface.neighbors, 0.0)
    return normals


def _prepare(
    points: np.ndarray,
    bounds: Bounds,
    spacing: float,
    asked: Asked,
    given: GivenNormals | None,
    measured: int | None = None,
    lone: np.ndarray | None = None,
) -> SurfaceSamples:
    """Return the samples of points; those after the first `measured` were added to fill holes, and none is left out then.

    lone : (N,) bool, points that are left out if outliers are
    """
    length, scan, judged = asked.length, points, np.zeros(len(points), np.uint8)
    if asked.drop_duplicates and has_repeats(points):
        judged[find_repeated(points)] = DUPLICATE
    if asked.outlier_distance and lone is not None:
        judged[lone] = OUTLIER
    if judged.any():
        points = np.ascontiguousarray(points[judged == KEPT])
        bounds = bounds_of(points)
    thinned = measured is None
    chosen = choose_samples_of(points, bounds, spacing, asked, given, thinned)
    if chosen.judged is not None:
        judged[judged == KEPT] = chosen.judged
    if not asked.keep_rods and thinned:
        rod = points_of_rods(scan[judged == KEPT], spacing, asked)
        judged[np.flatnonzero(judged == KEPT)[rod]] = ROD
        left = np.ascontiguousarray(scan[judged == KEPT])
        chosen = usual_samples(left, bounds_of(left), spacing, asked._replace(outlier_distance=0.0), given, thinned)
    added, again = np.zeros((0, 3)), asked._replace(outlier_distance=0.0)
    if asked.plain is not None and thinned:
        kept = np.flatnonzero(judged == KEPT)
        opened = opened_body(scan[kept], length, spacing, given, asked.plain)
        if opened is not None:
            judged[kept[opened.limb]], judged[kept[opened.slit]], added = LIMB, SLIT, opened.added
            left = np.concatenate([scan[judged == KEPT], added])
            chosen = usual_samples(left, bounds_of(left), spacing, again, given, thinned=not len(added))
    surface, piece, on_edge = _faced(chosen, spacing, asked)
    rings: tuple[LimbRing, ...] = ()
    if asked.limb_girth and thinned:
        kept = np.flatnonzero(judged == KEPT)
        left = np.concatenate([scan[kept], added]) if len(added) else scan[kept]
        limb, rings = cut_limbs(left, spacing, asked.limb_girth, surface, chosen.found.boxes, given, chosen.smooth)
        if rings:
            judged[kept[limb[: len(kept)]]], added = LIMB, added[~limb[len(kept) :]]
            left = np.ascontiguousarray(left[~limb])
            chosen = choose_samples_of(left, bounds_of(left), spacing, again, given, thinned=not len(added))
            surface, piece, on_edge = _faced(chosen, spacing, asked)
    if len(added):
        measured = int((judged == KEPT).sum())
    found = chosen.found
    piece = number_pieces(piece)
    area = sample_areas(surface)
    graded = area / surface.field**2
    large = large_pieces(piece, area, graded, length)
    floor = find_floor(surface.mean, piece, large, length) if asked.piece == "auto" and asked.z_is_up else None
    pieces = tuple(number for number in large if number != floor)
    samples = SurfaceSamples(
        surface,
        found.boxes,
        piece,
        found.thickness,
        spacing,
        float(area.sum()),
        float(graded.sum()),
        pieces,
        scan,
        judged,
        tuple(sorted(set(large) - set(pieces))),
        floor,
        (),
        len(found.chosen) if measured is None else int((found.chosen < measured).sum()),
        chosen.whole if len(chosen.points) < len(chosen.whole) else None,
        PATCH_SPACING * chosen.radius,
        chosen.smooth,
        chosen.rough,
        asked.smooth_scale,
        on_edge,
        given=given,
        rings=rings,
    )
    if asked.piece in ("auto", "all"):
        return samples
    pieces = chosen_pieces(samples.named_pieces, asked.piece)
    return replace(samples, pieces=pieces, not_chosen=tuple(sorted(set(large) - set(pieces))))


def _faced(chosen: ChosenSamples, spacing: float, asked: Asked) -> tuple[Surface, np.ndarray, np.ndarray]:
    """Return the surface of the samples with its length field; each one's piece, and whether it lies on a sharp edge."""
    surface, piece, on_edge = faced_surface(
        chosen.found, chosen.radius, asked.length, spacing, asked.sharp_edges, asked.z_is_up
    )
    return surface._replace(field=length_field(surface, asked.wish)), piece, on_edge
