"""All attempts at a grid as one flat list, and how many of them are worth making."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeGuard

import numpy as np

from .boundary.find import find_boundary
from .cells.make import settings_of_triangles
from .check.certify import MOST_ACCEPTED
from .check.crossings import MOST_CROSSINGS
from .constraints.find import ridges_away_from
from .constraints.ridges import find_ridges
from .errors import CertificateError, FrontError, OneSidedError, ScanTrussError
from .front.orientation_field import FieldStart
from .settings import SAMPLE_SPACING
from .surface.chosen_samples import ROD
from .surface.samples import sample_surface
from .surface.sharp_edges import EDGE_SHARE, FEWEST_NEEDED
from .surface.supports import are_columns

if TYPE_CHECKING:
    from .grid.certificate import Certificate
    from .grid.grid import Grid
    from .scan.cloud import PointCloud
    from .settings import Settings

# lengths of the fronts without rows, in desired lengths, tried in turn where no other passes
FRONT_LENGTHS = (1.0, 0.97, 1.04)
COARSER_SAMPLES = (1.1, 1.2, 1.3)  # distances of the surface samples that are tried instead, in those of the settings
SMOOTHED = (0.5, 1.0)  # scales over which a rough scan is smoothed where no grid passes without [member lengths]
# shares of thick samples from which on a scan is rough, and so rough that its mean surface comes first
ROUGH_SCAN, VERY_ROUGH_SCAN = 0.02, 0.25
THINNER = (0.8, 0.0)  # girths below which limbs are cut off that are tried instead, in that of the settings
MANY_OUTLIERS = 0.002  # share of the points that must be outliers for a grid to be tried without them
FAULTS_WITHOUT_RIDGES = 6  # places at which ridges are given up, before they all are
COARSEST_SAMPLES = 0.5  # largest of them, in desired lengths
FAR_FROM_PASSING = 12  # cuts and missing boundary loops above which other fronts with the same samples do not help
# share of the scan that a grid misses above which other fronts do not help either, in shares that may be missing; of thin limbs 1
FAR_MISSING = 2.0
BESIDE_RODS = 0.5  # distance from a rod within which the place of a warning is beside it [member lengths]
# by how much nearer a hundredth of the points must lie, in members, where members are unevener by 1 (std of their lengths / mean)
NEARER_FOR_UNEVENER = 2.0
POOR_MEMBERS = {"angle", "short", "long", "folded"}  # kinds of warnings
MOST_RUNS = 24  # grids that are made at most, before a scan is refused
MOST_RUNS_OF_CELLS = 3  # grids of quads or hexagons that are made at most; they are made of triangles that pass
MOST_FAR, MOST_GIVEN_UP = 2, 3  # attempts in a row of the same settings that are so far from passing, and such settings
# such attempts in a row for a body without thin limbs, which is so smooth that other fronts come no nearer
MOST_FAR_OF_BODY = 1


@dataclass(frozen=True)
class Attempt:
    """One attempt at a grid."""

    settings: Settings
    starts: tuple[FieldStart, ...] | None = (
        None  #: how its fronts are laid out; None: as the effort of the settings allows
    )
    faults: tuple[tuple[float, float, float], ...] = ()  #: places at which ridges are given up [scan unit]
    wide: tuple[int, ...] = ()  #: numbers of the wide folds that are ridges too, see `constraints.ridges.find_ridges`
    is_trial: bool = False  #: whether all that counts is that a grid passes

    def after(self, fault: FrontError, cloud: PointCloud) -> Attempt | None:
        """The same attempt with the ridges given up where it failed; None where that is not known or no ridge is near."""
        found = fault.grid.certificate if fault.grid is not None else None
        places = [each.where for each in found.faults if each.where] if found is not None else []
        places += [fault.where] if fault.where else []
        new = tuple(dict.fromkeys(place for place in places if place not in self.faults))
        follows = self.settings.ridge_angle > 0.0 and self.settings.method == "default" and self.starts is None
        if not new or not follows or len(self.faults) >= FAULTS_WITHOUT_RIDGES:
            return None
        later = replace(self, faults=self.faults + new)
        return later if later.ridge_points(cloud) < self.ridge_points(cloud) else None

    def ridge_points(self, cloud: PointCloud) -> int:
        """Return by how many points the ridges go that this attempt follows."""
        settings = settings_of_triangles(self.settings)
        samples, _ = find_boundary(sample_surface(cloud, settings), settings)
        return sum(len(ridge.places) for ridge in ridges_away_from(self.faults, samples, settings, self.wide))

    def advice(self, fault: ScanTrussError) -> str:
        """Say with which settings a grid passes that only leaves out too much: of the mean surface, or without thin limbs; else nothing."""
        if not only_leaves_out(fault):
            return ""
        found = fault.grid.certificate
        allowing = f"--allow-missing {math.ceil(100.0 * found.missing) / 100.0:g}"
        if self.settings.smooth_scale and found.missing <= MOST_ACCEPTED:
            smooth = f"--smooth-scale {self.settings.smooth_scale:g} --ridge-angle 0"
            return f"with {smooth} {allowing} a grid of its mean surface passes"
        if self.settings.plain_body and found.missing <= FAR_MISSING * self.settings.allow_missing:
            return f"with --plain-body {allowing} a grid without its thin limbs passes"
        return ""


def attempts(cloud: PointCloud, settings: Settings) -> Iterator[Attempt]:
    """Yield all attempts at a grid, the first as it was asked for; each of the others only where none before it passes.

    Rather a grid without ridges than none, or one of the mean surface of a rough scan, or of another look at it: a scan so rough
    that hardly a grid passes is another one to samples that lie a little farther apart. Method "paper" comes last.
    """
    first, again, *others = _same_scan(settings)
    yield first
    hall = settings.keep_rods and settings.method == "default" and _stands_on_rods(cloud, settings)
    if hall:  # no other front would get around its columns
        yield from _same_scan(settings.replace(keep_rods=False))
    yield again
    looks = list(_other_looks(cloud, settings)) if settings.method == "default" else []
    yield from map(Attempt, looks)  # where edges, limbs or slits are in the way, other fronts seldom help
    yield from others
    samples = sample_surface(cloud, settings)
    cut = len(samples.rings) > 0
    # a mean surface of a shell and its scaffold is neither
    rough = (sample_surface(cloud, settings.replace(keep_rods=False)) if hall else samples).rough
    if cut:  # fewer limbs cut off, then none
        for share in THINNER:
            yield Attempt(settings.replace(limb_girth=share * settings.limb_girth))
    if rough > VERY_ROUGH_SCAN:
        yield from _smoothed(cloud, settings)
    for look in looks:
        yield from list(_same_scan(look))[1:]
        settings = look if look.sharp_edges else settings
    if settings.keep_rods and settings.method == "default" and not hall and _has_rods(cloud, settings):
        settings = settings.replace(keep_rods=False)
        yield from _same_scan(settings)
    samples = sample_surface(cloud, settings)
    if (
        settings.ridge_angle > 0.0
        and settings.method == "default"
        and not samples.smooth
        and find_ridges(samples, settings)
    ):
        settings = settings.replace(ridge_angle=0.0)
        yield from _same_scan(settings)
    if settings.judge_outliers == "auto" and settings.method == "default" and _has_more_outliers(cloud, settings):
        settings = settings.replace(judge_outliers="always")
        yield from _same_scan(settings)
    if ROUGH_SCAN < rough <= VERY_ROUGH_SCAN:
        yield from _smoothed(cloud, settings)
    samples = sample_surface(cloud, settings)
    if settings.method == "default":
        if samples.smooth:
            yield from _same_scan(settings.replace(box_size=SAMPLE_SPACING))
        for size in (share * (settings.box_size or SAMPLE_SPACING) for share in COARSER_SAMPLES):
            if size <= COARSEST_SAMPLES:
                yield from _same_scan(settings.replace(box_size=size))
        yield from _same_scan(settings.replace(method="paper"))


def runs_along_rods(grid: Grid, cloud: PointCloud, settings: Settings) -> bool:
    """Whether a grid that passes leaves the boundary of its scan beside rods, as where its edge runs down a column."""
    found = grid.certificate
    if not settings.keep_rods or settings.method != "default" or found is None:
        return False
    places = [
        place
        for warning in found.warnings
        if warning.kind == "aside"
        for place in (warning.where, *warning.also)
        if place is not None
    ]
    if not places:
        return False
    samples = sample_surface(cloud, settings.replace(keep_rods=False))
    rods = samples.scan[samples.judged == ROD] + samples.origin
    return bool(len(rods)) and any(
        bool((np.linalg.norm(rods - place, axis=1) < BESIDE_RODS * settings.length).any()) for place in places
    )


def follows_better(grid: Grid, other: Grid) -> bool:
    """Whether a grid is nearer to the scan than another one, by more than it is unevener, and no poorer; both have certificates."""
    found, known = grid.certificate, other.certificate
    if found is None or known is None or found.scan_distance is None or known.scan_distance is None:
        return False
    if _poor_members(found) > _poor_members(known):
        return False
    nearer = (known.scan_distance.p99 - found.scan_distance.p99) / found.reach / 2.0
    return nearer > NEARER_FOR_UNEVENER * max(_variation(grid) - _variation(other), 0.0)


def _poor_members(certificate: Certificate) -> int:
    """Return of how many kinds the warnings are that say of members or triangles that they are poor."""
    return len({warning.kind for warning in certificate.warnings} & POOR_MEMBERS)


def _variation(grid: Grid) -> float:
    """Return the standard deviation of the member lengths over their mean, or over the lengths desired there."""
    quality = grid.quality
    return quality.length_cv if quality.stretch_cv is None else quality.stretch_cv


def only_leaves_out(fault: ScanTrussError) -> TypeGuard[CertificateError]:
    """Whether a grid only leaves out too much of the scan."""
    found = fault.grid.certificate if isinstance(fault, CertificateError) else None
    return found is not None and {each.kind for each in found.faults} == {"cover"}


def joins_sheets(fault: ScanTrussError | None) -> bool:
    """Whether a grid cuts itself everywhere since it joins sheets of the scan that lie too near each other: no other look parts them.

    It has fewer pieces than the scan, or falls into more where the sheets are one piece of the scan, and is no manifold.
    """
    found = fault.grid.certificate if isinstance(fault, CertificateError) else None
    if found is None or found.crossings < MOST_CROSSINGS:
        return False
    return found.pieces < found.scan_pieces or (found.pieces > found.scan_pieces and not found.manifold)


def _has_more_outliers(cloud: PointCloud, settings: Settings) -> bool:
    """Whether there are outliers that do not show where samples stand alone, as they are many or the members long."""
    always = sample_surface(cloud, settings.replace(judge_outliers="always")).outliers
    return always > MANY_OUTLIERS * len(cloud.points) and always > sample_surface(cloud, settings).outliers


def _has_sharp_edges(cloud: PointCloud, settings: Settings) -> bool:
    """Whether so many samples lie on sharp edges that these are to be looked at."""
    on_edge = sample_surface(cloud, settings.replace(sharp_edges=True)).on_edge
    return bool(on_edge.sum() >= max(FEWEST_NEEDED, EDGE_SHARE * len(on_edge)))


def _other_looks(cloud: PointCloud, settings: Settings) -> Iterator[Settings]:
    """Yield the settings that look at sharp edges, or at a body without thin limbs and slits, where the scan has such."""
    if not settings.sharp_edges and _has_sharp_edges(cloud, settings):
        yield settings.replace(sharp_edges=True)
    plain = settings.replace(plain_body=True)
    samples = sample_surface(cloud, plain)
    if not settings.plain_body and not settings.sharp_edges and samples.measured < len(samples.surface.mean):
        yield plain


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
    parts = [len(each.pieces) + len(each.not_chosen) for each in (cut, without)]
    if parts[1] > parts[0] or (cut.rough > VERY_ROUGH_SCAN and without.rough <= ROUGH_SCAN):
        return True
    return cloud.z_is_up and are_columns(without.scan[without.judged == ROD], without.surface.mean, settings.length)


def _smoothed(cloud: PointCloud, settings: Settings) -> Iterator[Attempt]:
    """Yield the attempts at a grid of the mean surface, where the settings leave open what is smoothed away."""
    if settings.method == "default" and settings.smooth_scale is None:
        for scale in SMOOTHED:
            smoothed = settings.replace(smooth_scale=scale, ridge_angle=0.0)
            if sample_surface(cloud, smoothed).layers[1] > 0.0:  # two sheets would become one
                return
            yield Attempt(smoothed)
            yield Attempt(smoothed, (FieldStart(scale=FRONT_LENGTHS[0], laid=False),))


def _same_scan(settings: Settings) -> Iterator[Attempt]:
    """Yield the attempts with one look at the scan: by rows, then by fronts that make all of their nodes themselves."""
    if settings.method == "default":
        yield Attempt(settings)
    for share in FRONT_LENGTHS:
        yield Attempt(settings, (FieldStart(scale=share, laid=False),))


class AttemptLimit:
    """Which attempts are still worth making.

    After two in a row that come nowhere near a grid that passes, others of the same settings would come no nearer; after three
    such settings none would. A scan that looks one-sided may only be rough: then its mean surface is not. How much is tried is
    counted in grids that are made, not in seconds: the same scan gets the same result.
    """

    def __init__(self) -> None:
        self._allowed = MOST_RUNS
        self._far: list[tuple[Settings, int]] = []  # settings, and how many attempts in a row were far from passing
        self._given_up = self._of_cells = 0
        self.runs, self._looks_one_sided = 0, False  #: grids that were made

    def allow(self, more: int) -> None:
        """Pause after some more grids."""
        self._allowed = min(MOST_RUNS, self.runs + more)

    def any_left(self) -> bool:
        """Whether any attempt is worth making, and allowed."""
        return self._is_hopeful() and self.runs < self._allowed

    def is_paused(self) -> bool:
        """Whether attempts would be worth making that are not allowed."""
        return self._is_hopeful() and self._allowed <= self.runs < MOST_RUNS

    def _is_hopeful(self) -> bool:
        """Whether any attempt is worth making."""
        return self._given_up < MOST_GIVEN_UP and self._of_cells < MOST_RUNS_OF_CELLS

    def begin(self) -> None:
        """Note that a grid is made."""
        self.runs += 1

    def end(self, fault: FrontError) -> None:
        """Note why a grid that was made does not pass."""
        self._of_cells += fault.grid is not None and fault.grid.cells != "triangle"

    def allows(self, attempt: Attempt) -> bool:
        """Whether an attempt is worth making."""
        if self._looks_one_sided and not attempt.settings.smooth_scale:
            return False
        return self._far_in_a_row(attempt.settings) < (MOST_FAR_OF_BODY if attempt.settings.plain_body else MOST_FAR)

    def _far_in_a_row(self, settings: Settings) -> int:
        """Return how many attempts of some settings, one after the other, were far from passing."""
        return next((count for known, count in self._far if known == settings), 0)

    def note(self, attempt: Attempt, fault: ScanTrussError) -> None:
        """Note what has come of an attempt."""
        self._looks_one_sided |= isinstance(fault, OneSidedError)
        far = self._far_in_a_row(attempt.settings) + 1 if _is_far_from_passing(attempt, fault) else 0
        self._far = [pair for pair in self._far if pair[0] != attempt.settings] + [(attempt.settings, far)]
        self._given_up += far == MOST_FAR and not attempt.settings.smooth_scale  # of those there are four
        if far == MOST_FAR and joins_sheets(fault):
            self._given_up = MOST_GIVEN_UP


def _is_far_from_passing(attempt: Attempt, fault: ScanTrussError) -> bool:
    """Whether a grid misses many loops or much of the scan, or limbs as every front will, or many of its triangles cut each other."""
    if isinstance(fault, OneSidedError):
        return True
    if not isinstance(fault, CertificateError) or fault.grid.certificate is None:
        return False
    found = fault.grid.certificate
    limbs = sum(part.share for part in found.left_out if part.kind == "limbs")
    if found.missing > FAR_MISSING * attempt.settings.allow_missing or limbs > attempt.settings.allow_missing:
        return True
    return found.crossings + abs(found.boundary_loops - found.scan_loops) > FAR_FROM_PASSING
