"""The certificate of a grid: what was checked, what was found, and where it is worst; `check.certify.certify` makes it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from ..errors import words_of_place

Place = tuple[float, float, float]


@dataclass(frozen=True)
class Worst:
    """The worst value of a figure and where it is, in the scan's own frame."""

    value: float
    where: Place


@dataclass(frozen=True)
class Fault:
    """What is wrong with a grid; "the grid " and `words` make a sentence."""

    kind: str  #: empty manifold orientable pieces loops crossing folded uneven cover torn astray fixed
    words: str
    where: Place | None = None  #: a place in the scan's own frame [scan unit]


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
    crossings: int = 0  #: pairs of triangles that cut, touch or cover each other; exact, and at most 100 are counted
    scan_within_reach: float = 0.0  #: share of the scan that lies within `reach` of a triangle
    grid_within_reach: float = 0.0  #: share of the triangles whose middle lies within `reach` of the scan
    farthest_scan: Worst | None = None  #: distance of a part of the scan from the nearest triangle
    farthest_triangle: Worst | None = None  #: distance of the middle of a triangle from the nearest part of the scan
    node_deviation: Worst | None = (
        None  #: distance of a node from the scanned surface, or from a part of it if that is less
    )
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

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON; `passed` first."""
        return {"passed": self.passed, **asdict(self), "faults": [asdict(fault) for fault in self.faults]}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Certificate:
        """Return a certificate from plain values."""
        plain = {name: value for name, value in values.items() if name != "passed"}
        for name, value in plain.items():
            if isinstance(value, dict):
                plain[name] = Worst(float(value["value"]), place_of(value["where"]))
        faults = [
            Fault(fault["kind"], fault["words"], None if fault["where"] is None else place_of(fault["where"]))
            for fault in plain["faults"]
        ]
        return cls(**{**plain, "faults": tuple(faults)})

    def __str__(self) -> str:
        """Return all in one line."""
        if self.faults:
            return "FAILED: the grid " + "; ".join(f"{fault.words}{near(fault.where)}" for fault in self.faults)
        said = [
            "passed",
            "oriented manifold",
            f"{self.handles} handles" if self.handles else "",
            "no triangles cut each other",
            f"{self.scan_within_reach:.2%} of the scan and {self.grid_within_reach:.2%} of the triangles within"
            f" {self.reach:.3g} {self.unit}".rstrip(),
            f"irregular {self.irregular}, forced {self.irregular_forced}",
        ]
        return ", ".join(word for word in said if word)


def near(where: Place | None) -> str:
    """Return a place in words, to be put behind others; nothing where there is none."""
    return "" if where is None else f" (near {words_of_place(where)})"


def place_of(place: Any) -> Place:
    """Return a place as a tuple."""
    x, y, z = (float(c) for c in place)
    return x, y, z
