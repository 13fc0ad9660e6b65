"""Settings: every number that steers the method, with its symbol, unit, bounds, default and source.

The options of the command line, the table in the docs and the JSON saved beside every result are made from the fields. Each stage
has a small record of its own; `Settings` is all of them together.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from .errors import InputError
from .selection import FORMS, RETURNS, Selection

SAMPLE_SPACING, SMOOTH_SAMPLE_SPACING = (
    0.2,
    0.3,
)  # spacing of the surface samples of any scan, and of a dense and smooth one [member lengths]
HOLE = 4.0  # boundary length of the smallest hole worth keeping; the front runs over smaller ones [member lengths]
METHODS = ("default", "paper")
EFFORTS = ("normal", "quick", "best")
PREFER = ("balance", "lengths", "shapes")
ADVANCE_FROM = ("external", "all")
CASE3 = ("merge", "quadrangle")
CURVATURE = "curvature:"  # a length field that follows the curvature starts with this
UNITS = {"": None, "mm": 0.001, "cm": 0.01, "m": 1.0, "inch": 0.0254, "foot": 0.3048}  # [metre]
RENAMED = {"stray_distance": "outlier_distance", "drop_repeated": "drop_duplicates"}  # names in settings files of 0.1.0


class Lengths(tuple[tuple[float, float, float, float], ...]):
    """Rows of a length field that have been checked: x, y, z and the desired length there [scan unit]."""


def _setting(
    default: Any,
    help: str,
    *,
    symbol: str = "",
    unit: str = "",
    source: str = "",
    choices: tuple[str, ...] = (),
    low: float | None = None,
    high: float = math.inf,
    above: float | None = None,
) -> Any:
    """A field of a record with all that the docs and the command line say of it, and its bounds.

    A number must lie between `low` and `high`, or be greater than `above`; without both it has no bounds.
    """
    about = {"help": help, "symbol": symbol, "unit": unit, "source": source, "choices": choices}
    return field(default=default, metadata={**about, "low": low, "high": high, "above": above})


class _Checked:
    """A record whose values are checked against its fields."""

    def __post_init__(self) -> None:
        """Check every value, with a message that says what is needed."""
        for spec in fields(self):  # type: ignore[arg-type]
            about, name, value = spec.metadata, spec.name, getattr(self, spec.name)
            choices, low, high, above = (about[key] for key in ("choices", "low", "high", "above"))
            if choices and value not in (*choices, spec.default):
                raise InputError(f"{name} must be one of {' '.join(choices)}, got {value!r}")
            if spec.type == "bool" and not isinstance(value, bool):
                raise InputError(f"{name} must be true or false, got {value!r}")
            if isinstance(value, int) and not isinstance(value, bool) and "float" in str(spec.type):
                value = float(value)  # the kernels are compiled for it
                object.__setattr__(self, name, value)
            if isinstance(value, float) and not math.isfinite(value):
                raise InputError(f"{name} must be a finite number, got {value}")
            if (low is None and above is None) or (value is None and spec.default is None):
                continue
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InputError(f"{name} must be a number, got {value!r}")
            if above is not None and not value > above:
                raise InputError(f"{name} must be greater than {above:g}, got {value}")
            if name == "outlier_distance" and 0 < value < 1:
                raise InputError(f"{name} {value:g} would leave out most of the scan; it must be 0, or 1 or more")
            if low is not None and not low <= value <= high:
                needed = f"between {low:g} and {high:g}" if math.isfinite(high) else f"{low:g} or more"
                raise InputError(f"{name} must be {needed}, got {value}")


@dataclass(frozen=True, kw_only=True)
class MemberSettings(_Checked):
    """What the grid should be."""

    length: float = _setting(
        0.0,
        "desired member length; with a length field its shortest, and the whole field is scaled to it",
        symbol="l_e",
        unit="scan unit",
        source="Eq. 10",
    )
    length_field: str | Sequence[Sequence[float]] = _setting(
        "",
        "member lengths that vary over the scan: curvature:MIN:MAX, or lengths given at places (x, y, z, length)",
        unit="scan unit",
    )
    method: str = _setting("default", "the paper to the letter, or the improved method", choices=METHODS)
    effort: str = _setting(
        "normal",
        "how much time to spend on regularity (default method only); best tries 24 fronts and anneals two",
        choices=EFFORTS,
    )
    prefer: str = _setting(
        "balance", "what matters more where both cannot be had: equal members or regular triangles", choices=PREFER
    )


@dataclass(frozen=True, kw_only=True)
class ReadingSettings(_Checked):
    """Reading the scan."""

    unit: str = _setting(
        "", "unit of the coordinates; overrides what the file says", choices=tuple(u for u in UNITS if u)
    )
    z_unit: str = _setting(
        "",
        "unit of the heights where it differs from that of x and y; they are converted",
        choices=tuple(u for u in UNITS if u),
    )
    classes: tuple[int, ...] = _setting((), "keep only these point classes, e.g. 6 or 2,6 (LAS, or a column named so)")
    returns: str = _setting("all", f"keep only these laser returns: {', '.join(RETURNS)} or a number from 1 to 15")
    confidence: float | None = _setting(None, "keep only points with at least this confidence (a property or column)")
    crop: tuple[str, ...] = _setting(
        (), f"keep only points inside {FORMS} in plan (GeoJSON, WKT, or x, y per line)", unit="scan unit"
    )
    thin_spacing: float | None = _setting(
        None,
        "thin the file to this spacing while it is read; 0: never; none: length / 20 if it does not fit into memory",
        unit="scan unit",
        source="Sec. 2",
        low=0.0,
    )


@dataclass(frozen=True, kw_only=True)
class CleaningSettings(_Checked):
    """Cleaning the scan."""

    clean: bool = _setting(
        True, "leave out duplicates and outliers as set below; --no-clean keeps every point", source="Sec. 2"
    )
    drop_duplicates: bool = _setting(
        True, "leave out duplicate points if they are a hundredth of the points or more", source="Sec. 2"
    )
    judge_outliers: str = _setting(
        "auto", "when to look for outliers: auto, where samples stand alone or no grid passes; or always",
        choices=("auto", "always"),
    )  # fmt: skip
    keep_rods: bool = _setting(
        True,
        "keep columns, scaffold and cables, thinner than a member; they are left out where no grid passes with them",
    )
    piece: str = _setting(
        "auto",
        "pieces of the scan to make a grid of: auto (all but a floor under the others), all, largest, or numbers such as 1 or 1,3",
    )
    outlier_distance: float = _setting(
        3.0,
        "leave out points this many times farther from others than their neighbours are; 0 keeps all",
        source="Sec. 2",
        low=0.0,
    )


@dataclass(frozen=True, kw_only=True)
class SurfaceSettings(_Checked):
    """Sampling the surface."""

    box_size: float | None = _setting(
        None,
        "spacing of the surface samples, in member lengths; none:"
        f" {SAMPLE_SPACING:g}, or {SMOOTH_SAMPLE_SPACING:g} for a dense, smooth scan",
        source="Eq. 1",
        low=0.05,
        high=0.5,
    )


@dataclass(frozen=True, kw_only=True)
class BoundarySettings(_Checked):
    """Finding the boundary."""

    boundary_radius: float = _setting(
        0.4, "radius of the disc rolled along the boundary, in member lengths", source="Sec. 3.3", low=0.1, high=1.0
    )
    corner_angle: float = _setting(
        40.0, "the boundary has a corner where it turns by more than this", unit="degree", source="Sec. 3.3",
        low=10.0, high=180.0,
    )  # fmt: skip
    boundary: Sequence[Sequence[Sequence[float]]] = _setting(
        (),
        "the true boundary, closed polylines that take the place of that of the scan; those inside others are holes",
        unit="scan unit",
    )
    fill_holes: float | None = _setting(
        None,
        f"close holes with a shorter boundary than this; 0 keeps all; none: {HOLE:g} member lengths",
        unit="scan unit",
        source="Sec. 3.6",
        low=0.0,
    )


@dataclass(frozen=True, kw_only=True)
class ConstraintSettings(_Checked):
    """Fixed nodes, fixed lines and ridges."""

    fixed: Sequence[Sequence[float]] = _setting(
        (), "positions that must become nodes, in the frame of the scan", unit="scan unit", source="Sec. 4.2"
    )
    fixed_lines: Sequence[Sequence[Sequence[float]]] = _setting(
        (),
        "polylines that must become chains of members, in the frame of the scan; closed if the last point is the first",
        unit="scan unit",
    )
    line_names: Sequence[str] = _setting(
        (), "names of the fixed lines in their order, and so of the sets of their nodes; none: line 1, line 2, ..."
    )
    ridge_angle: float = _setting(
        40.0,
        "a fold sharper than this is a ridge and becomes a chain of members; 0: no ridges (default method only)",
        unit="degree",
        low=0.0,
        high=180.0,
    )
    fold_weight: float = _setting(
        0.0, "draws nodes to the crests of folds that are no ridges, also rounded ones, at the cost of even members; 1 is usual,"
        " 0: not at all (default method only)", low=0.0, high=10.0,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class FrontSettings(_Checked):
    """Advancing the front."""

    advance_from: str = _setting(
        "external", "boundaries from which the front starts", source="Sec. 3.6", choices=ADVANCE_FROM
    )
    shape_weight: float = _setting(
        1.0, "weight of the shape quality of a triangle", symbol="alpha_1", source="Eq. 5", low=0.0
    )
    size_weight: float = _setting(
        1.0, "weight of the size quality of a triangle", symbol="alpha_2", source="Eq. 5", low=0.0
    )
    length_weight: float = _setting(
        0.88, "weight of the desired length in the search radius", symbol="w_1", source="Eq. 10", low=0.0, high=1.0
    )
    search_range: float = _setting(
        0.5,
        "half the width of the search region, in point spacings; doubled once if it contains no point",
        symbol="b, h",
        source="Sec. 3.4 (1)",
        low=0.1,
        high=20.0,
    )
    nearness: float = _setting(
        0.5, "least distance of a new node from the front, in member lengths", source="Sec. 3.4 (2)", low=0.1, high=1.0
    )
    merge_angle: float = _setting(
        90.0, "limit of the angles alpha and beta in the six cases", unit="degree", source="Table 1",
        low=60.0, high=120.0,
    )  # fmt: skip
    case3: str = _setting(
        "merge", "case 3: merge the free nodes, or Foucault's quadrangle", source="Table 1, [30]", choices=CASE3
    )


@dataclass(frozen=True, kw_only=True)
class SmoothingSettings(_Checked):
    """Smoothing (method paper)."""

    max_deviation: float | None = _setting(
        None,
        "stop smoothing when the nodes have moved by more than this on average; none: length / 4",
        unit="scan unit",
        source="Sec. 4.1 (c)",
        above=0.0,
    )
    smooth_forward: float = _setting(0.6, "forward factor", symbol="lambda", source="Sec. 4.1, [34]", low=0.0, high=1.0)
    smooth_backward: float = _setting(-0.1, "backward factor", symbol="mu", source="Sec. 4.1, [34]", low=-1.0, high=0.0)
    smooth_passes: int = _setting(500, "most passes", source="Sec. 4.1", low=0, high=10_000)


@dataclass(frozen=True, kw_only=True)
class CheckSettings(_Checked):
    """Limits of a grid that can be built; the certificate says where they were widened."""

    min_angle: float = _setting(15.0, "least angle of a triangle", unit="degree", source="", low=0.0, high=60.0)
    min_length: float = _setting(0.5, "shortest member, in desired lengths", low=0.0, high=1.0)
    max_length: float = _setting(1.8, "longest member, in desired lengths", low=1.0)
    min_fold: float = _setting(
        15.0, "least angle between neighbouring triangles; 180 is level", unit="degree", low=0.0, high=180.0
    )
    max_offset: float = _setting(
        0.1, "largest distance of a node from the scan beyond its noise, in member lengths", low=0.0
    )
    allow_missing: float = _setting(
        0.05, "largest share of the scan farther than half a member from the grid; pieces left out do not count",
        low=0.0, high=1.0,
    )  # fmt: skip


#: the records in the order of the stages, from reading to checking
RECORDS = (
    MemberSettings, ReadingSettings, CleaningSettings, SurfaceSettings, BoundarySettings, ConstraintSettings, FrontSettings,
    SmoothingSettings, CheckSettings,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Settings(
    CheckSettings,
    SmoothingSettings,
    FrontSettings,
    ConstraintSettings,
    BoundarySettings,
    SurfaceSettings,
    CleaningSettings,
    ReadingSettings,
    MemberSettings,
):
    """All settings of a run; `length` is needed, all else has a default. Impossible values raise `InputError`."""

    def __post_init__(self) -> None:
        """Check every value and bring positions, lines and lengths into their plainest form."""
        object.__setattr__(self, "length_field", check_length_field(self.length_field))
        object.__setattr__(self, "piece", check_piece(self.piece))
        taken = self.selection
        for name in ("classes", "returns", "crop"):
            object.__setattr__(self, name, getattr(taken, name))
        if self.length_field and self.length == 0:
            object.__setattr__(self, "length", shortest_and_longest(self.length_field)[0])
        if not (isinstance(self.length, int | float) and math.isfinite(self.length) and self.length > 0):
            raise InputError(f"length must be a positive number in the scan's unit, got {self.length}")
        super().__post_init__()
        object.__setattr__(self, "fixed", _positions(self.fixed))
        object.__setattr__(self, "fixed_lines", tuple(_line(line) for line in self.fixed_lines))
        object.__setattr__(self, "boundary", tuple(_ring(ring) for ring in self.boundary))
        object.__setattr__(self, "line_names", _names(self.line_names, len(self.fixed_lines)))

    def __repr__(self) -> str:
        """Name the settings that are not the default."""
        own = [spec.name for spec in fields(self) if getattr(self, spec.name) != spec.default]
        return f"Settings({', '.join(f'{name}={getattr(self, name)!r}' for name in own)})"

    @property
    def selection(self) -> Selection:
        """Which points of the scan are taken."""
        names = [spec.name for spec in fields(Selection)]
        return Selection(**{name: getattr(self, name) for name in names})

    @property
    def closed_boundary_length(self) -> float:
        """Holes with a shorter boundary than this are closed [scan unit]."""
        return HOLE * self.length if self.fill_holes is None else self.fill_holes

    @property
    def bridged_boundary_length(self) -> float:
        """Of these, the front runs over those with a shorter boundary than this; the others are filled [scan unit]."""
        return min(HOLE * self.length, self.closed_boundary_length)

    def replace(self, **changes: Any) -> Settings:
        """Return a copy with some values changed."""
        return replace(self, **changes)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Settings:
        """Return settings from plain values; unknown names are refused."""
        values = {RENAMED.get(name, name): value for name, value in values.items() if name != "made_by"}
        names = {spec.name for spec in fields(cls)}
        if unknown := sorted(set(values) - names):
            raise InputError(f"unknown setting {unknown[0]!r}; known are {' '.join(sorted(names))}")
        if "length" not in values and not values.get("length_field"):
            raise InputError("settings need a length (the desired member length in the scan's unit)")
        try:
            return cls(**values)
        except TypeError as error:
            raise InputError(f"settings cannot be read: {error}") from None

    @classmethod
    def read(cls, path: str | Path) -> Settings:
        """Return the settings saved beside a result (JSON)."""
        try:
            values = json.loads(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(f"cannot read settings {path}: {error.strerror}") from None
        except ValueError:
            raise InputError(f"{path} is not a settings file (JSON)") from None
        values = values.get("settings", values) if isinstance(values, dict) else None
        if not isinstance(values, dict):
            raise InputError(f"{path} is not a settings file (a JSON object is needed)")
        return cls.from_dict(values)


def check_piece(given: Any) -> str:
    """Return which pieces are chosen, "auto", "all", "largest" or numbers from 1 with commas between them, or refuse it."""
    text = str(given).replace(" ", "").lower()
    if text in ("auto", "all", "largest") or all(word.isdecimal() and int(word) > 0 for word in text.split(",")):
        return text
    raise InputError(f"piece must be auto, all, largest or numbers from 1 such as 1 or 1,3, got {given!r}")


def _positions(given: Any) -> tuple[tuple[float, ...], ...]:
    """Return fixed positions as tuples of numbers."""
    try:
        found = tuple(tuple(float(c) for c in position) for position in given)
    except (TypeError, ValueError):
        raise InputError(f"fixed must be positions of three numbers, got {given!r}") from None
    for position in found:
        if len(position) != 3 or not all(map(math.isfinite, position)):
            raise InputError(f"a fixed node needs three finite coordinates, got {position}")
    return found


def _line(line: Any, name: str = "fixed_lines", what: str = "a fixed line") -> tuple[tuple[float, ...], ...]:
    """Return a polyline as tuples of numbers."""
    try:
        points = tuple(tuple(float(c) for c in position) for position in line)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be polylines of positions of three numbers, got {line!r}") from None
    for position in points:
        if len(position) != 3 or not all(map(math.isfinite, position)):
            raise InputError(f"{what} needs points of three finite coordinates, got {position}")
    points = tuple(p for i, p in enumerate(points) if i == 0 or p != points[i - 1])
    if len(points) < 2:
        raise InputError(f"{what} needs at least two different points, got {len(points)}")
    return points


def _ring(ring: Any) -> tuple[tuple[float, ...], ...]:
    """Return a closed polyline as tuples of numbers, its first point not repeated."""
    points = _line(ring, "boundary", "a boundary")
    points = points[:-1] if points[0] == points[-1] else points
    if len(set(points)) < 3:
        raise InputError(f"a boundary needs at least three different points, got {len(set(points))}")
    return points


def _names(given: Any, count: int) -> tuple[str, ...]:
    """Return the names of so many fixed lines, or none at all."""
    if isinstance(given, str) or not all(isinstance(name, str) and name.strip() for name in given):
        raise InputError(f"line_names must be words, one for each fixed line, got {given!r}")
    if len(given) not in (0, count):
        raise InputError(f"line_names has {len(given)} names for {count} fixed lines")
    return tuple(given)


def check_length_field(given: Any) -> str | Lengths:
    """Return a length field as the settings hold it: "" for none, "curvature:MIN:MAX", or rows of x, y, z, length.

    Raises
    ------
    InputError
        It is none of these, a length is not positive, or MIN is larger than MAX.
    """
    if given is None or (isinstance(given, str) and not given):
        return ""
    if isinstance(given, str):
        return _check_curvature(given)
    if isinstance(given, Lengths):
        return given
    try:
        rows = Lengths((float(x), float(y), float(z), float(length)) for x, y, z, length in given)
    except (TypeError, ValueError):
        raise InputError("length_field must be rows of four numbers, x y z length, or curvature:MIN:MAX") from None
    if not rows:
        raise InputError("length_field has no rows; it needs x, y, z, length at one place at least")
    for row in rows:
        if not all(map(math.isfinite, row)):
            raise InputError(f"length_field must be finite numbers, got {row}")
        if row[3] <= 0:
            raise InputError(f"length_field must have positive lengths, got {row[3]:g} at {row[:3]}")
    return rows


def _check_curvature(text: str) -> str:
    """Return "curvature:MIN:MAX" in its plainest writing, or refuse it."""
    try:
        low, high = (float(part) for part in text.removeprefix(CURVATURE).split(":"))
    except ValueError:
        low = high = math.nan
    if not (text.startswith(CURVATURE) and math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"a length field must be curvature:MIN:MAX with two lengths, got {text!r}")
    if low <= 0:
        raise InputError(f"{text}: the shortest length must be positive, got {low:g}")
    if low > high:
        raise InputError(f"{text}: the shortest length is above the longest; write {CURVATURE}{high:g}:{low:g}")
    return f"{CURVATURE}{low!r}:{high!r}"


def shortest_and_longest(field: str | Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the bounds of a length field as it is given [scan unit]."""
    if isinstance(field, str):
        low, high = (float(part) for part in field.removeprefix(CURVATURE).split(":"))
        return low, high
    lengths = [row[3] for row in field]
    return min(lengths), max(lengths)
