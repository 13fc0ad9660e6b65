"""What a scan shows that decides which attempts at its grid are made."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..check.distances import measure_distances
from ..check.sheets import broken_limb, webbed_limb
from ..constraints.ridges import find_ridges
from ..front.orientation_field import usual_starts
from ..surface.chosen_samples import KEPT, LIMB, ROD
from ..surface.samples import sample_surface
from ..surface.shape import wall_of_surface
from ..surface.sharp_edges import EDGE_SHARE, FEWEST_NEEDED
from ..surface.supports import are_columns, column_stays, free_columns, lies_under_itself

if TYPE_CHECKING:
    from ..errors import Place
    from ..grid.grid import Grid
    from ..scan.cloud import PointCloud
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

# shares of thick samples from which on a scan is rough, and so rough that its mean surface comes first
ROUGH_SCAN, VERY_ROUGH_SCAN = 0.02, 0.25
MANY_OUTLIERS = 0.002  # share of the points that must be outliers for a grid to be tried without them
# kinds of warnings of a grid that runs along rods, misses them or spans from one to another, and distance from a rod within which their
# place is beside it [member lengths]: the middle of a gap between two rods is farther off
SAID_BESIDE_RODS = {"aside": 0.5, "far": 0.5, "peak": 0.5, "gap": 1.0, "closed": 1.0}
THIN_WALL, SOME_WALLS = 0.8, 0.05  # thickness of a thin wall [member lengths], and share of the places that have one
ROUGH_AS_WALLS = 0.5  # share of its roughness that is left at most where the sides of walls are distinguished
# kinds of warnings of a grid that jumps between walls
MISSED_LAYER = ("unfollowed", "peak", "rounded", "offset", "far", "missed")
NOISE_AS_WALLS = 0.025  # noise from which on it looks like walls: at walls it is 0.01 at most [member lengths]
LEAST_IN_COLUMNS = 0.005  # least share of a scan in the columns that it stands on where z may not be up

# what a scan shows of outliers, edges and slits it shows before limbs are cut off, which takes most of the time of its samples
NO_LIMBS: dict[str, Any] = {"limb_girth": 0.0}


class AskedScan:
    """A scan and the settings that were asked for it, with what they show; each is looked up when a row first asks.

    Parameters
    ----------
    cloud : PointCloud
    asked : Settings
    """

    def __init__(self, cloud: PointCloud, asked: Settings) -> None:
        self.cloud, self.asked = cloud, asked

    @property
    def by_default(self) -> bool:
        """Whether the method is not the paper's, which takes the scan as it is."""
        return self.asked.method == "default"

    @cached_property
    def stands_on_rods(self) -> bool:
        """Whether it is a hall: no other front would get around its columns."""
        return self.asked.keep_rods and self.by_default and _stands_on_rods(self.cloud, self.asked)

    @cached_property
    def has_sharp_edges(self) -> bool:
        """Whether sharp edges are worth a look that was not asked for."""
        return self.by_default and not self.asked.sharp_edges and _has_sharp_edges(self.cloud, self.asked)

    @cached_property
    def has_thin_walls(self) -> bool:
        """Whether the scan has both sides of a wall thinner than a member, which its samples do not tell apart."""
        samples = self._with_sides
        if samples is None:
            return False
        looks_rough_by_noise = self.rough >= ROUGH_SCAN and samples.rough > ROUGH_AS_WALLS * self.rough
        if looks_rough_by_noise:
            return False
        return wall_of_surface(samples, THIN_WALL * self.asked.length)[1] > SOME_WALLS

    @cached_property
    def has_narrow_gaps(self) -> bool:
        """Whether samples are thick at gaps between parts of the scan, as between legs, unless the sides of walls are distinguished."""
        samples = self._with_sides
        if samples is None or self.rough <= ROUGH_SCAN or self.has_thin_walls:
            return False
        return samples.rough <= ROUGH_AS_WALLS * self.rough

    @property
    def _with_sides(self) -> SurfaceSamples | None:
        """The samples with the sides of walls distinguished; None where that is asked for already, or normals came with the scan."""
        if not self.by_default or self.asked.thin_walls or self.cloud.normals is not None:
            return None
        return sample_surface(self.cloud, self.asked.replace(thin_walls=True))

    @cached_property
    def has_plain_body(self) -> bool:
        """Whether the scan is a body with thin limbs and slits, and one without them was not asked for."""
        if not self.by_default or self.asked.plain_body or self.asked.sharp_edges:
            return False
        samples = sample_surface(self.cloud, self.asked.replace(plain_body=True, **NO_LIMBS))
        return samples.measured < len(samples.surface.mean)

    @cached_property
    def has_limbs_cut_off(self) -> bool:
        """Whether limbs are cut off."""
        return len(sample_surface(self.cloud, self.asked).rings) > 0

    @cached_property
    def rough(self) -> float:
        """Share of the samples that are thick; of a hall without its columns, as a mean surface of a shell and its scaffold is neither."""
        seen = self.asked.replace(keep_rods=False) if self.stands_on_rods else self.asked
        return float(sample_surface(self.cloud, seen).rough)

    def can_be_smoothed(self, settings: Settings, scales: tuple[float, ...]) -> bool:
        """Whether the settings leave open what is smoothed away, and over none of some scales two sheets would become one."""
        return (
            settings.method == "default"
            and settings.smooth_scale is None
            and not any(
                sample_surface(self.cloud, settings.replace(smooth_scale=scale, ridge_angle=0.0)).layers[1] > 0.0
                for scale in scales
            )
        )

    def has_rods(self, settings: Settings) -> bool:
        """Whether a part of the scan is too thin for a grid, as columns and scaffold are, but the scan does not stand on it."""
        return settings.keep_rods and self.by_default and not self.stands_on_rods and _has_rods(self.cloud, settings)

    def has_ridges(self, settings: Settings) -> bool:
        """Whether the scan has ridges, and the settings follow them."""
        if settings.ridge_angle <= 0.0 or not self.by_default:
            return False
        samples = sample_surface(self.cloud, settings)
        return not samples.smooth and bool(find_ridges(samples, settings))

    def has_more_outliers(self, settings: Settings) -> bool:
        """Whether the scan has outliers that the settings leave in it."""
        return settings.judge_outliers == "auto" and self.by_default and _has_more_outliers(self.cloud, settings)

    def is_smooth(self, settings: Settings) -> bool:
        """Whether the scan is so smooth that its samples lie farther apart than on others."""
        return self.by_default and bool(sample_surface(self.cloud, settings).smooth)


def has_one_lattice(cloud: PointCloud, settings: Settings) -> bool:
    """Whether even effort `normal` begins from one lattice only, so that another one may fit where that does not."""
    if settings.method != "default" or settings.rows_along:
        return False
    usual = settings.replace(effort="normal")
    starts = usual_starts(sample_surface(cloud, usual), usual)
    return len(starts) == 1 and starts[0].laid


def runs_along_rods(grid: Grid, cloud: PointCloud, settings: Settings, asked: Settings) -> bool:
    """Whether a grid that passes leaves the boundary of its scan beside rods, as where its edge runs down one, or misses or joins some.

    Where what was asked for cuts limbs off, rods are limbs too, and count as missing.
    """
    found = grid.certificate
    if not settings.keep_rods or settings.method != "default" or found is None:
        return False
    places = [
        (place, SAID_BESIDE_RODS[warning.kind] * settings.length)
        for warning in found.warnings
        if warning.kind in SAID_BESIDE_RODS
        for place in (warning.where, *warning.also)
        if place is not None
    ]
    if not places or sample_surface(cloud, asked).rings:
        return False
    samples = sample_surface(cloud, settings.replace(keep_rods=False))
    rods = samples.scan[samples.judged == ROD] + samples.origin
    return bool(len(rods)) and any(
        bool((np.linalg.norm(rods - place, axis=1) < reach).any()) for place, reach in places
    )


def jumps_between_walls(grid: Grid, cloud: PointCloud, asked: Settings) -> bool:
    """Whether a grid that passes, with warnings, may run from one side of thin walls to the other, or miss one."""
    found = grid.certificate
    return (
        found is not None
        and found.noise < NOISE_AS_WALLS * asked.length
        and any(warning.kind in MISSED_LAYER for warning in found.warnings)
        and AskedScan(cloud, asked).has_thin_walls
    )


def breaks_limb(grid: Grid, cloud: PointCloud, asked: Settings, settings: Settings) -> Place | None:
    """Return a place where a grid of other settings than were asked for misses a part of a limb, not all; None where there is none.

    What is asked for cuts that limb off at a clean ring, or at two.
    """
    cut = sample_surface(cloud, asked)
    if not cut.rings or settings == asked:
        return None
    samples = sample_surface(cloud, settings)
    limb = (cut.judged == LIMB) & (samples.judged == KEPT)
    if not limb.any():
        return None
    away = measure_distances(grid, samples, settings.length).scan
    shortest = settings.min_length * settings.length
    return broken_limb(samples, limb, away, settings.length) or webbed_limb(
        samples, cut, away, settings.length, shortest
    )


def stands_on_columns(cloud: PointCloud, settings: Settings) -> bool:
    """Whether a shell stands on columns so thin that a grid around them is no part of it, where these are not left out yet."""
    if not settings.keep_rods or settings.method != "default":
        return False
    samples = sample_surface(cloud, settings)
    if samples.rings:  # columns that were cut off as limbs are columns all the same
        samples = sample_surface(cloud, settings.replace(**NO_LIMBS))
    surface = samples.surface
    if free_columns(surface.mean, surface.radius, settings.length).any():
        return True
    if not lies_under_itself(surface.mean, settings.length):  # then there is nothing that columns stand on
        return False
    without = sample_surface(cloud, settings.replace(keep_rods=False))
    rods = without.scan[without.judged == ROD]
    shell = without.surface.mean[without.piece != (-1 if without.floor is None else without.floor)]
    if not len(rods) or not (cloud.z_is_up or len(rods) >= LEAST_IN_COLUMNS * len(without.scan)):
        return False
    return are_columns(rods, shell, settings.length)


def keeps_columns(cloud: PointCloud, settings: Settings) -> bool:
    """Whether the settings keep any column that a shell stands on, or its floor for them: not where all are cut off as limbs."""
    cut, without = sample_surface(cloud, settings), sample_surface(cloud, settings.replace(keep_rods=False))
    rod = without.judged == ROD
    return (cut.floor is None and without.floor is not None) or column_stays(
        without.scan[rod], cut.judged[rod] == KEPT, settings.length
    )


def _has_more_outliers(cloud: PointCloud, settings: Settings) -> bool:
    """Whether there are outliers that do not show where samples stand alone, as they are many or the members long."""
    always = sample_surface(cloud, settings.replace(judge_outliers="always", **NO_LIMBS)).outliers
    return always > MANY_OUTLIERS * len(cloud.points) and always > sample_surface(cloud, settings).outliers


def _has_sharp_edges(cloud: PointCloud, settings: Settings) -> bool:
    """Whether so many samples lie on sharp edges that these are to be looked at."""
    on_edge = sample_surface(cloud, settings.replace(sharp_edges=True, **NO_LIMBS)).on_edge
    return bool(on_edge.sum() >= max(FEWEST_NEEDED, EDGE_SHARE * len(on_edge)))


def _has_rods(cloud: PointCloud, settings: Settings) -> bool:
    """Whether a part of the scan is too thin for a grid, as columns and scaffold are.

    Where limbs can be cut off, such parts are limbs too, and count as missing.
    """
    without = sample_surface(cloud, settings.replace(keep_rods=False))
    return bool((without.judged == ROD).any()) and not sample_surface(cloud, settings).rings


def _stands_on_rods(cloud: PointCloud, settings: Settings) -> bool:
    """Whether the scan falls apart without such parts, as a hall does, or is rough for them alone, or they are columns of a shell."""
    cut, without = sample_surface(cloud, settings), sample_surface(cloud, settings.replace(keep_rods=False))
    if not (without.judged == ROD).any():
        return False
    whole = cut
    if cut.rings and without.floor is not None:  # columns that were cut off as limbs joined the floor all the same
        whole = sample_surface(cloud, settings.replace(limb_girth=0.0))
    parts = [len(each.pieces) + len(each.not_chosen) for each in (whole, without)]
    if parts[1] > parts[0] or (cut.rough > VERY_ROUGH_SCAN and without.rough <= ROUGH_SCAN):
        return True
    return stands_on_columns(cloud, settings)
