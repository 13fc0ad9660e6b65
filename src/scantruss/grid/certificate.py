"""The certificate of a grid: what was checked, what was found, and where it is worst; `check.certify.certify` makes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

from ..errors import CertificateError, Place, words_of_number, words_of_place
from ..scan.cloud import WITHOUT_COORDINATES

if TYPE_CHECKING:
    from .grid import Grid


@dataclass(frozen=True)
class Worst:
    """The worst value of a figure and where it is, in the scan's own frame."""

    value: float
    where: Place


@dataclass(frozen=True)
class Fault:
    """What is wrong with a grid; "the grid " and `words` make a sentence."""

    #: empty manifold orientable pieces loops crossing folded uneven cover sheets torn astray fixed beyond bridged spike strut tunnel; angle
    #: short long offset unfollowed rounded as fault or warning; of a warning aside, far, left out, gap, joined, closed, hole, zigzag,
    #: cut, missed, peak, apart, ridge, lost, crushed, stops, fixed
    kind: str
    words: str
    where: Place | None = None  #: a place in the scan's own frame [scan unit], the worst
    also: tuple[Place, ...] = ()  #: more such places

    def is_said_by(self, parts: Sequence[LeftOut]) -> bool:
        """Whether each of its places is one of those of some parts."""
        return {self.where, *self.also} <= {part.where for part in parts}


@dataclass(frozen=True)
class Spread:
    """Distances: the median, what 95 and 99 % are below, and the largest with its place [scan unit]."""

    p50: float
    p95: float
    p99: float
    largest: Worst


@dataclass(frozen=True)
class LeftOut:
    """Points of the scan that the grid does not follow, or a hole that it closes."""

    kind: str  #: duplicates outliers sparse rods limbs floor pieces far hole gap, or why points were not read
    points: int
    share: float  #: of all points that were read
    where: Place | None = None  #: middle, in the scan's own frame
    size: float | None = None  #: longest side of the box around it [scan unit]
    farthest: float | None = None  #: largest distance from the grid [scan unit]
    asked: bool = False  #: a setting asked for it; else it was ScanTruss's own judgement
    number: int = 1  #: holes or gaps, where it is several
    #: of scattered points, how many the most beside each other are; then `where` and `size` are theirs
    together: int | None = None

    @property
    def words(self) -> str:
        """Say what it is."""
        if self.number > 1:
            return f"{self.number:,} more holes closed" if self.kind == "hole" else f"{self.number:,} more gaps bridged"
        return KINDS_LEFT_OUT.get(self.kind, self.kind)


#: words for the kinds of `LeftOut` that a grid knows of itself
KINDS_LEFT_OUT = {
    "duplicates": "duplicates",
    "outliers": "set aside as outliers",
    "rods": "columns, scaffold or cables, too thin for the members",
    "limbs": "on a limb, handle or neck too thin for the members, cut off at a ring",
    "slits": "in a slit too narrow for the members, filled",
    "floor": "in a floor under the others",
    "sparse": "too far apart for this length",
    "not chosen": "in pieces that were not asked for",
    "pieces": "in pieces too small for this length",
    "far": "farther than a member from the grid",
    "hole": "hole closed",
    "gap": "gap bridged",
}


@dataclass(frozen=True)
class Certificate:
    """What holds for a grid; lengths in the scan's unit, places in the scan's own frame."""

    unit: str
    reach: float  #: half a member
    manifold: bool
    orientable: bool
    pieces: int
    scan_pieces: int
    boundary_loops: int
    scan_loops: int  #: boundary loops of the scan that are kept, that is, not closed as small holes
    euler: int  #: nodes - members + triangles = 2 pieces - 2 handles - boundary loops
    handles: int | None  #: None where the grid is no oriented manifold
    faults: tuple[Fault, ...] = ()
    warnings: tuple[Fault, ...] = ()  #: what is poor and yet can be built
    widened: tuple[str, ...] = ()  #: limits that the settings make wider than the defaults
    points: int = 0  #: points that were read, all of which the distances count
    left_out: tuple[LeftOut, ...] = ()  #: what the grid does not follow, the most points first
    crossings: int = 0  #: pairs of triangles that cut, touch or cover each other; exact, and at most 100 are counted
    scan_within_reach: float = 0.0  #: share of all points that were read that lie within `reach` of a triangle
    missing: float = 0.0  #: share of all points farther than `reach` though nothing else that is left out explains them
    grid_within_reach: float = (
        0.0  #: share of the triangles, middle and corners, within `reach` of a point, closed holes aside
    )
    scan_distance: Spread | None = None  #: of every point that was read from the nearest triangle
    farthest_kept: Worst | None = None  #: of the points that were read, outliers aside, the farthest from the grid
    triangle_distance: Spread | None = (
        None  #: of each triangle, middle and corners, from the nearest point, closed holes aside
    )
    node_distance: Spread | None = (
        None  #: of each node from the plane of the 12 nearest points, or the nearest if that is less
    )
    noise: float = 0.0  #: median rms distance of the 12 points nearest to a node from their plane [scan unit]
    node_bias: float = (
        0.0  #: mean of how far outside of each node the surface of the points within a member lies [scan unit]
    )
    node_bias_p95: float = 0.0  #: what 95 % of these distances, inside or outside, are below [scan unit]
    node_scatter: float = 0.0  #: median rms distance of these points from that surface [scan unit]
    shortest_member: Worst | None = None
    longest_member: Worst | None = None
    smallest_angle: Worst | None = None  #: [degree]
    largest_angle: Worst | None = None  #: [degree]
    sharpest_fold: Worst | None = None  #: smallest angle between two triangles at a member, 180 where level [degree]
    fixed_error: Worst | None = None  #: distance of a fixed position from its node
    irregular: int = 0  #: members too few or too many at the nodes, see `irregular`
    irregular_forced: int = 0  #: ... that the Euler number and the angles of the boundary force

    @property
    def passed(self) -> bool:
        """Whether nothing is wrong."""
        return not self.faults

    @property
    def judged_out(self) -> float:
        """Share of the points that were read that ScanTruss itself left out, duplicates aside."""
        own = (part for part in self.left_out if not part.asked and part.kind != "duplicates")
        return sum(part.share for part in own)

    @property
    def asked_out(self) -> float:
        """Share of the points of the file that settings left out, as by a crop, a class or a piece."""
        return sum(part.share for part in self.left_out if part.asked and part.kind != WITHOUT_COORDINATES)

    @property
    def farthest_listed(self) -> LeftOut | None:
        """The entry of what is left out that the point farthest from the grid belongs to; None where that is of no entry."""
        largest = _largest(self.scan_distance)
        return next((part for part in self.left_out if largest is not None and part.farthest == largest.value), None)

    def worst_places(self) -> list[tuple[str, Worst, bool]]:
        """Return the worst figures that are known: name, figure with its place, whether it is an angle [degree] or a length."""
        found = (
            ("shortest member", self.shortest_member, False),
            ("longest member", self.longest_member, False),
            ("smallest angle", self.smallest_angle, True),
            ("largest angle", self.largest_angle, True),
            ("sharpest fold between triangles, 180 is level", self.sharpest_fold, True),
            ("node farthest from the scan", _largest(self.node_distance), False),
            ("triangle farthest from the scan", _largest(self.triangle_distance), False),
            self._farthest_point,
            ("fixed node farthest from its position", self.fixed_error, False),
        )
        return [(name, worst, of_angle) for name, worst, of_angle in found if worst is not None]

    @property
    def _farthest_point(self) -> tuple[str, Worst | None, bool]:
        """As a row of `worst_places`: an outlier that is listed as left out says nothing of the grid."""
        listed, name = self.farthest_listed, "point farthest from the grid"
        if listed is not None and listed.kind == "outliers" and self.farthest_kept is not None:
            return f"{name}, outliers aside", self.farthest_kept, False
        return f"{name}{', one left out' * (listed is not None)}", _largest(self.scan_distance), False

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; `passed` first."""
        values = asdict(self)
        return {"passed": self.passed, **{k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Certificate:
        """Return a certificate from plain values."""
        known = {spec.name for spec in fields(cls)}
        plain = {name: value for name, value in values.items() if name in known}
        for name, value in plain.items():
            if isinstance(value, dict):
                plain[name] = _spread_of(value) if "p50" in value else _worst_of(value)
        for name in ("faults", "warnings"):
            plain[name] = tuple(
                Fault(
                    fault["kind"],
                    fault["words"],
                    None if fault["where"] is None else place_of(fault["where"]),
                    tuple(map(place_of, fault.get("also", ()))),
                )
                for fault in plain.get(name, ())
            )
        plain["widened"] = tuple(plain.get("widened", ()))
        plain["left_out"] = tuple(
            LeftOut(**{**part, "where": None if part["where"] is None else place_of(part["where"])})
            for part in plain.get("left_out", ())
        )
        return cls(**plain)

    def __str__(self) -> str:
        """Return all in one line."""
        if self.faults:
            return "FAILED: the grid " + "; ".join(f"{fault.words}{near(fault.where)}" for fault in self.faults)
        verdict = "passed with warnings" if self.warnings else "passed"
        parts = [
            verdict + (f" (wider limits: {', '.join(self.widened)})" if self.widened else ""),
            "oriented manifold",
            f"{self.handles} handle{'s' * (self.handles > 1)}" if self.handles else "",
            "no triangles cut each other",
            f"{self.scan_within_reach:.2%} of the scan and {self.grid_within_reach:.2%} of the triangles within"
            f" {words_of_number(self.reach, 3)} {self.unit}".rstrip(),
            f"{self.asked_out:.2%} of the scan left out as asked for" if self.asked_out > 0.0 else "",
            f"irregular {self.irregular}, forced {self.irregular_forced}",
        ]
        return ", ".join(word for word in parts if word)


def _largest(spread: Spread | None) -> Worst | None:
    return None if spread is None else spread.largest


def _worst_of(value: dict[str, Any]) -> Worst:
    return Worst(float(value["value"]), place_of(value["where"]))


def _spread_of(value: dict[str, Any]) -> Spread:
    return Spread(float(value["p50"]), float(value["p95"]), float(value["p99"]), _worst_of(value["largest"]))


def check_passed(grid: Grid, keep_failed: bool) -> None:
    """Refuse a grid that failed its certificate, for whatever is to be made of it; one that has none is its owner's affair.

    Raises
    ------
    CertificateError
        The grid failed, and is not to be used all the same.
    """
    if grid.certificate is not None and not grid.certificate.passed and not keep_failed:
        words = " and ".join(fault.words for fault in grid.certificate.faults)
        raise CertificateError(f"the grid failed its certificate: it {words}; --keep-failed uses it anyway", grid)


def near(where: Place | None) -> str:
    """Return a place in words, to be put behind others; nothing where there is none."""
    return "" if where is None else f" (near {words_of_place(where)})"


def place_of(place: Any) -> Place:
    """Return a place as a tuple."""
    x, y, z = (float(c) for c in place)
    return x, y, z
