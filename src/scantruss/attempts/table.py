"""All attempts at a grid as one table: what is tried in which order, when, and what it changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..boundary.find import find_boundary
from ..cells.make import settings_of_triangles
from ..check.refusal import MOST_ACCEPTED, option_accepting
from ..constraints.find import ridges_away_from, ridges_given_up, wide_folds
from ..constraints.ridges import FAULT_REACH
from ..errors import CertificateError, FrontError, words_of_place
from ..front.orientation_field import FieldStart
from ..settings import SAMPLE_SPACING
from ..surface.samples import sample_surface
from .limit import FAR_MISSING, only_leaves_out, only_sparse
from .looks import ROUGH_SCAN, VERY_ROUGH_SCAN, AskedScan, has_one_lattice

if TYPE_CHECKING:
    from ..errors import Place, ScanTrussError
    from ..grid.certificate import Certificate
    from ..scan.cloud import PointCloud
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples

# names of rows, and of what is put in before one
PLAIN_NEAR_FAULTS = "plain body near the faults"
AS_ASKED, WITHOUT_ROWS, ROWS_TURNED, PLAIN_BODY = "as asked", "front without rows", "rows turned", "plain body"
# lengths of the fronts without rows, in desired lengths, tried in turn where no other passes
FRONT_LENGTHS = (1.0, 0.97, 1.04)
TURNED_ROWS = (40.0, 10.0, 50.0)  # angles of the lattice that are tried instead of the usual one [degree]
COARSER_SAMPLES = (1.1, 1.2, 1.3)  # distances of the surface samples that are tried instead, in those of the settings
COARSEST_SAMPLES = 0.5  # largest of them, in desired lengths
# distance of the samples that is tried at sharp edges, where two sides are near each other, in that of the settings
FINER_SAMPLES = 0.6
SMOOTHING_SCALES = (
    0.5,
    1.0,
)  # scales over which a rough scan is smoothed where no grid passes without [member lengths]
THINNER_GIRTHS = (0.8, 0.0)  # girths below which limbs are cut off that are tried instead, in that of the settings
TIMES_OF_PLAINER = 6  # times that thin limbs and slits near further faults are left aside
FAULTS_WITHOUT_RIDGES = 6  # places at which ridges are given up, before they all are

Starts = tuple[FieldStart, ...] | None  # how fronts are laid out; None: as the effort of the settings allows
# which of the layouts of its fronts that a method has a row tries
FIRST_LAYOUT, SECOND_LAYOUT, LATER_LAYOUTS = slice(0, 1), slice(1, 2), slice(2, None)
FIRST_TWO_LAYOUTS, ALL_BUT_FIRST_LAYOUT, ALL_LAYOUTS = slice(0, 2), slice(1, None), slice(None)


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
    row: str = AS_ASKED  #: name of its row in the table

    def after(self, fault: FrontError, cloud: PointCloud) -> Attempt | None:
        """The same attempt with the ridges given up where it failed; None where that is not known or no ridge is near."""
        follows = self.settings.ridge_angle > 0.0 and self.settings.method == "default" and self.starts is None
        if not follows or len(self.faults) >= FAULTS_WITHOUT_RIDGES or not (followed := self.ridge_points(cloud)):
            return None
        new = tuple(dict.fromkeys(place for place in places_of_fault(fault) if place not in self.faults))
        later = replace(self, faults=self.faults + new)
        return later if new and later.ridge_points(cloud) < followed else None

    def plainer(self, fault: FrontError, cloud: PointCloud) -> Attempt | None:
        """The same attempt without the limbs and slits near which it failed too.

        Where none is near it is laid out otherwise, once; None where it fails then, or none was ever near.
        """
        known = tuple(self.settings.plain_at)
        new = tuple(dict.fromkeys(place for place in places_of_fault(fault) if place not in known))
        later = replace(self, settings=self.settings.replace(plain_at=known + new), row=PLAIN_NEAR_FAULTS)
        before, after = (sample_surface(cloud, each.settings).judged for each in (self, later))
        if not np.array_equal(before, after):
            return later
        if self.row != PLAIN_NEAR_FAULTS or self.starts is not None:
            return None
        return replace(self, starts=layouts_of(self.settings)[SECOND_LAYOUT][0])

    def after_poor(self, places: Sequence[Place], cloud: PointCloud) -> Attempt | None:
        """The same attempt without the wide fold beside each of some poor places [scan unit]; None where it can be no better.

        Where none is beside any of them, they are chance: its front is laid out otherwise, once.
        """
        samples, settings = self._samples(cloud)
        own, at = list(self.wide), np.reshape(places, (-1, 1, 3)) - samples.origin
        folds = wide_folds(samples, settings)
        # distance of each fold from each place
        away = np.array([np.linalg.norm(at - folds[number], axis=2).min(axis=1) for number in own])
        beside = {own[fold] for fold in away.argmin(axis=0)[away.min(axis=0) < FAULT_REACH * settings.length]}
        if not beside:
            can_turn = len(places) > 0 and self.starts is None
            return replace(self, starts=layouts_of(self.settings)[SECOND_LAYOUT][0]) if can_turn else None
        kept = tuple(number for number in own if number not in beside)
        return replace(self, wide=kept) if kept else None

    def ridge_points(self, cloud: PointCloud) -> int:
        """Return by how many points the ridges go that this attempt follows."""
        samples, settings = self._samples(cloud)
        return sum(len(ridge.places) for ridge in ridges_away_from(self.faults, samples, settings, self.wide))

    def ridges_given_up(self, cloud: PointCloud) -> list[np.ndarray]:
        """Return the parts of ridges that this attempt does not follow, the longest first, each (K, 3) [scan unit]."""
        if not self.faults:
            return []
        samples, settings = self._samples(cloud)
        return ridges_given_up(self.faults, samples, settings, self.wide)

    def _samples(self, cloud: PointCloud) -> tuple[SurfaceSamples, Settings]:
        """Return the surface samples that this attempt takes of a scan, and the settings of its triangles."""
        settings = settings_of_triangles(self.settings)
        return find_boundary(sample_surface(cloud, settings), settings)[0], settings

    def has_one_front(self, cloud: PointCloud) -> bool:
        """Whether it has one front, the same with any effort."""
        return self.starts is not None or has_one_lattice(cloud, self.settings)

    def advice(self, fault: ScanTrussError) -> str:
        """Say what accepts a grid that only leaves out too much: sparse parts, or all but the mean surface, or thin limbs; else nothing."""
        if only_sparse(fault):
            return (
                f"one made otherwise only {fault.whole.grid.certificate.faults[0].words}: --allow-missing accepts that"
            )
        if not only_leaves_out(fault):
            return ""
        found = fault.whole.grid.certificate
        allowing = option_accepting(found)
        if self.settings.smooth_scale and found.missing <= MOST_ACCEPTED:
            smooth = f"--smooth-scale {self.settings.smooth_scale:g} --ridge-angle 0"
            return f"with {smooth} {allowing} a grid of its mean surface passes, {_dropping(found)}"
        if self.settings.plain_body and found.missing <= FAR_MISSING * self.settings.allow_missing:
            return f"with --plain-body {allowing} a grid without its thin limbs passes, {_dropping(found)}"
        return ""


def places_of_fault(fault: FrontError) -> list[tuple[float, float, float]]:
    """Return the places at which a grid fails [scan unit]."""
    whole = fault.whole if isinstance(fault, CertificateError) else fault
    found = whole.grid.certificate if whole.grid is not None else None
    places = [each.where for each in found.faults if each.where] if found is not None else []
    return places + ([whole.where] if whole.where else [])


def _dropping(found: Certificate) -> str:
    """Say how much of the scan a grid leaves out that only leaves out too much, and where most of that is."""
    own = [part for part in found.left_out if part.points and part.where is not None and not part.asked]
    most = max(own, key=lambda part: part.points, default=None)
    at = "" if most is None or most.where is None else f", most of it near ({words_of_place(most.where)})"
    return f"but {found.missing:.0%} of the scan is not in it{at}"


@dataclass(frozen=True)
class AttemptRow:
    """A row of the table: attempts that look at the scan in one way, each only where none before it passes."""

    name: str
    fronts: (
        slice | tuple[float, ...]
    )  #: which of the layouts of `layouts_of`, or by how much their rows are turned [degree]
    when: Callable[[AskedScan, Settings], bool] = lambda scan, now: True  #: whether it is made, by the settings so far
    changes: Mapping[str, Any] = field(default_factory=dict)  #: settings, and what they become
    shares: Mapping[str, float] = field(default_factory=dict)  #: settings, and what they are multiplied by
    stays: bool = False  #: whether the rows after it keep what it changes

    def layouts(self, tried: Settings) -> list[Starts]:
        """Return how the fronts of its attempts are laid out."""
        if isinstance(self.fronts, slice):
            return layouts_of(tried)[self.fronts]
        return [(FieldStart(turn),) for turn in self.fronts]

    def changed(self, now: Settings) -> Settings:
        """Return the settings of its attempts by the settings so far."""
        scaled = {name: share * _size_of(now, name) for name, share in self.shares.items()}
        return now.replace(**self.changes, **scaled) if self.changes or scaled else now


def _size_of(settings: Settings, name: str) -> float:
    """Return the size that a setting stands for."""
    value: float | None = getattr(settings, name)
    return value or SAMPLE_SPACING if name == "box_size" else float(value or 0.0)


def _smoothed_rows(kind: str, when: Callable[[AskedScan], bool]) -> list[AttemptRow]:
    """Return the rows that try the mean surface over each scale, where smaller ones join no two sheets either."""
    return [
        AttemptRow(
            f"mean surface of a {kind} scan over {scale:g}",
            FIRST_TWO_LAYOUTS,
            lambda scan, now, scales=SMOOTHING_SCALES[: number + 1]: when(scan) and scan.can_be_smoothed(now, scales),  # type: ignore[misc]
            {"smooth_scale": scale, "ridge_angle": 0.0},
        )
        for number, scale in enumerate(SMOOTHING_SCALES)
    ]


def _samples_fit(share: float) -> Callable[[AskedScan, Settings], bool]:
    """Return whether samples so much farther apart are still fine enough for the members."""
    return lambda scan, now: scan.by_default and share * _size_of(now, "box_size") <= COARSEST_SAMPLES


ROWS_TRIED: tuple[AttemptRow, ...] = (
    AttemptRow(AS_ASKED, FIRST_LAYOUT),
    AttemptRow("hall without its columns", ALL_LAYOUTS, lambda scan, now: scan.stands_on_rods, {"keep_rods": False}),
    AttemptRow("thin walls", FIRST_TWO_LAYOUTS, lambda scan, now: scan.has_thin_walls, {"thin_walls": True}),
    AttemptRow(  # where the points of one side are sparse
        "thin walls, samples as usual",
        FIRST_TWO_LAYOUTS,
        lambda scan, now: not now.box_size and (now.thin_walls or scan.has_thin_walls),
        {"thin_walls": True, "box_size": SAMPLE_SPACING},
    ),
    AttemptRow(WITHOUT_ROWS, SECOND_LAYOUT),
    AttemptRow(ROWS_TURNED, TURNED_ROWS, lambda scan, now: has_one_lattice(scan.cloud, now)),
    # where edges, limbs or slits are in the way, other fronts seldom help
    AttemptRow("sharp edges", FIRST_LAYOUT, lambda scan, now: scan.has_sharp_edges, {"sharp_edges": True}),
    AttemptRow(
        "sharp edges, finer samples", FIRST_LAYOUT,
        lambda scan, now: scan.has_sharp_edges, {"sharp_edges": True}, {"box_size": FINER_SAMPLES},
    ),
    AttemptRow("narrow gaps", FIRST_LAYOUT, lambda scan, now: scan.has_narrow_gaps, {"thin_walls": True}),
    AttemptRow(PLAIN_BODY, FIRST_LAYOUT, lambda scan, now: scan.has_plain_body, {"plain_body": True}),
    AttemptRow("fronts of other lengths", LATER_LAYOUTS),
    *(  # fewer limbs cut off, then none
        AttemptRow(f"limbs at {share:g} girth", FIRST_LAYOUT, lambda scan, now: scan.has_limbs_cut_off, shares={"limb_girth": share})
        for share in THINNER_GIRTHS
    ),
    *_smoothed_rows("very rough", lambda scan: scan.rough > VERY_ROUGH_SCAN),  # so rough that hardly another passes
    AttemptRow("sharp edges again", ALL_BUT_FIRST_LAYOUT, lambda scan, now: scan.has_sharp_edges, {"sharp_edges": True}, stays=True),
    AttemptRow(
        "plain body again", ALL_BUT_FIRST_LAYOUT, lambda scan, now: scan.has_plain_body, {"plain_body": True, "sharp_edges": False}
    ),
    AttemptRow("without rods", ALL_LAYOUTS, lambda scan, now: scan.has_rods(now), {"keep_rods": False}, stays=True),
    AttemptRow("without ridges", ALL_LAYOUTS, lambda scan, now: scan.has_ridges(now), {"ridge_angle": 0.0}, stays=True),
    AttemptRow("all outliers", ALL_LAYOUTS, lambda scan, now: scan.has_more_outliers(now), {"judge_outliers": "always"}, stays=True),
    *_smoothed_rows("rough", lambda scan: ROUGH_SCAN < scan.rough <= VERY_ROUGH_SCAN),
    # a scan so rough that hardly a grid passes is another one to samples that lie a little farther apart
    AttemptRow("samples of a rough scan", ALL_LAYOUTS, lambda scan, now: scan.is_smooth(now), {"box_size": SAMPLE_SPACING}),
    *(
        AttemptRow(f"samples {share:g} times as far apart", ALL_LAYOUTS, _samples_fit(share), shares={"box_size": share})
        for share in COARSER_SAMPLES
    ),
    AttemptRow("the paper's method", ALL_LAYOUTS, lambda scan, now: scan.by_default and not now.rows_along, {"method": "paper"}),
)  # fmt: skip


def _rows_of_trials() -> tuple[AttemptRow, ...]:
    """Return the rows for a few grids that show whether a length passes.

    Of a body with thin limbs it is the plain body that does, if any, and seldom one of another front; with so little as the other trials
    are given it fails where a grid of usual effort passes.
    """
    moved = [row for row in ROWS_TRIED if row.name in (WITHOUT_ROWS, ROWS_TURNED)]
    rows = []
    for row in ROWS_TRIED:
        if row.name == PLAIN_BODY:
            rows += [replace(row, changes={**row.changes, "effort": "normal"}), *moved]
        elif row not in moved:
            rows.append(row)
    return tuple(rows)


ROWS_OF_TRIALS = _rows_of_trials()


def attempts(cloud: PointCloud, settings: Settings, rows: Sequence[AttemptRow] = ROWS_TRIED) -> Iterator[Attempt]:
    """Yield all attempts at a grid, the first as it was asked for; each of the others only where none before it passes.

    Rather a grid without ridges than none, or one of the mean surface of a rough scan, or of another look at it. What follows the
    outcome of an attempt is `AttemptCourse`'s.
    """
    scan, now = AskedScan(cloud, settings), settings
    made: list[tuple[Settings, Starts]] = []
    for row in rows:
        if not _applies(row, scan, now):
            continue
        tried = row.changed(now)
        for starts in row.layouts(tried):
            if (tried, starts) not in made:
                made.append((tried, starts))
                yield Attempt(tried, starts, row=row.name)
        now = tried if row.stays else now


def judging_outliers(tried: Iterable[Attempt]) -> Iterator[Attempt]:
    """Yield attempts with the outliers of the scan always judged, each once."""
    made: list[tuple[Settings, Starts]] = []
    for attempt in tried:
        settings = attempt.settings.replace(judge_outliers="always")
        if (settings, attempt.starts) not in made:
            made.append((settings, attempt.starts))
            yield replace(attempt, settings=settings)


def _applies(row: AttemptRow, scan: AskedScan, now: Settings) -> bool:
    """Whether a row is made; not where the look that tells fails as the attempts did, as at a boundary that cannot be followed."""
    try:
        return row.when(scan, now)
    except FrontError:
        return False


def layouts_of(settings: Settings) -> list[Starts]:
    """Return how the fronts of a method are laid out: by rows, then by fronts that make all of their nodes themselves."""
    alone: list[Starts] = [(FieldStart(scale=share, laid=False),) for share in FRONT_LENGTHS]
    return [None, *alone] if settings.method == "default" else alone
