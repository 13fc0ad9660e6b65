"""Every number that steers the method: symbol, unit, default, source.

The command line options, the table in the docs and the JSON saved beside every result all come from the fields of `Settings`.
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
)  # distance of the sites of any scan, and of a dense and smooth one, in lengths
HOLE = 4.0  # members around the smallest hole worth framing; the front runs over smaller ones
METHODS = ("default", "paper")
EFFORTS = ("normal", "quick", "best")
PREFER = ("balance", "lengths", "shapes")
ADVANCE_FROM = ("external", "all")
CASE3 = ("merge", "quadrangle")
CURVATURE = "curvature:"  # a length field that follows the curvature begins so
UNITS = {"": None, "mm": 0.001, "cm": 0.01, "m": 1.0, "inch": 0.0254, "foot": 0.3048}  # metres


class Lengths(tuple[tuple[float, float, float, float], ...]):
    """Rows of a length field that have been checked: x, y, z and the desired length there [scan unit]."""


def _setting(
    default: Any, help: str, *, symbol: str = "", unit: str = "", source: str = "", choices: tuple[str, ...] = ()
) -> Any:
    """A field of the record with all that the docs and the command line say of it."""
    return field(
        default=default, metadata={"help": help, "symbol": symbol, "unit": unit, "source": source, "choices": choices}
    )


def _line(line: Any) -> tuple[tuple[float, ...], ...]:
    """Return a fixed line as tuples of numbers."""
    try:
        points = tuple(tuple(float(c) for c in position) for position in line)
    except (TypeError, ValueError):
        raise InputError(f"fixed_lines must be polylines of positions of three numbers, got {line!r}") from None
    for position in points:
        if len(position) != 3 or not all(map(math.isfinite, position)):
            raise InputError(f"a fixed line needs points of three finite coordinates, got {position}")
    points = tuple(p for i, p in enumerate(points) if i == 0 or p != points[i - 1])
    if len(points) < 2:
        raise InputError(f"a fixed line needs at least two different points, got {len(points)}")
    return points


@dataclass(frozen=True, kw_only=True)
class Settings:
    """One record of all settings; unknown or impossible values raise InputError."""

    length: float = _setting(
        0.0,
        "desired length of the members; of a length field the shortest, and all of it is scaled to this",
        symbol="l_e",
        unit="scan unit",
        source="Eq. 10",
    )
    length_field: str | Sequence[Sequence[float]] = _setting(
        "",
        "desired lengths that differ over the scan: curvature:MIN:MAX, or lengths given at places (x, y, z, length)",
        unit="scan unit",
    )
    method: str = _setting("default", "the paper to the letter, or what we found better", choices=METHODS)
    effort: str = _setting(
        "normal", "time for regularity, in the default method; best tries 24 fronts and anneals two", choices=EFFORTS
    )
    prefer: str = _setting(
        "balance", "members of one length, or regular triangles, where not both can be had", choices=PREFER
    )
    unit: str = _setting(
        "", "unit of the scan's coordinates, before what the file says", choices=tuple(u for u in UNITS if u)
    )
    z_unit: str = _setting(
        "",
        "unit of the heights, where x and y have another; they are brought to that",
        choices=tuple(u for u in UNITS if u),
    )
    classes: tuple[int, ...] = _setting(
        (), "only points of these classes, as 6 or 2,6; of LAS or a column classification"
    )
    returns: str = _setting(
        "all", f"only these returns of the laser pulses: {', '.join(RETURNS)} or a number from 1 to 15"
    )
    confidence: float | None = _setting(
        None, "only points of at least this confidence, a property or column of the scan"
    )
    crop: tuple[str, ...] = _setting(
        (), f"only points inside {FORMS}, in plan (GeoJSON, WKT, or x, y a line)", unit="scan unit"
    )
    advance_from: str = _setting(
        "external", "which boundaries the front starts from", source="Sec. 3.6", choices=ADVANCE_FROM
    )
    fixed: Sequence[Sequence[float]] = _setting(
        (), "positions that must become nodes, in the scan's own frame", unit="scan unit", source="Sec. 4.2"
    )
    fixed_lines: Sequence[Sequence[Sequence[float]]] = _setting(
        (),
        "polylines that become chains of members, in the scan's own frame; closed where the last point is the first",
        unit="scan unit",
    )
    ridge_angle: float = _setting(
        40.0,
        "where the scan bends by more than this at once it has a ridge, a chain of members; 0: none; default method only",
        unit="degree",
    )
    max_deviation: float | None = _setting(
        None,
        "smoothing stops when the nodes have moved by more than this on average; none: length / 4",
        unit="scan unit",
        source="Sec. 4.1 (c)",
    )
    shape_weight: float = _setting(1.0, "weight of the shape quality of a triangle", symbol="alpha_1", source="Eq. 5")
    size_weight: float = _setting(1.0, "weight of the size quality of a triangle", symbol="alpha_2", source="Eq. 5")
    length_weight: float = _setting(
        0.88, "weight of the desired length in the search radius", symbol="w_1", source="Eq. 10"
    )
    search_range: float = _setting(
        0.5,
        "half width of the search region in point spacings; doubled once if it holds no point",
        symbol="b, h",
        source="Sec. 3.4 (1)",
    )
    nearness: float = _setting(0.5, "a new node keeps this distance to the front, in lengths", source="Sec. 3.4 (2)")
    merge_angle: float = _setting(
        90.0, "limit of the angles alpha and beta in the six cases", unit="degree", source="Table 1"
    )
    case3: str = _setting(
        "merge", "case 3: merge the free nodes, or Foucault's quadrangle", source="Table 1, [30]", choices=CASE3
    )
    box_size: float | None = _setting(
        None,
        f"distance of the sites to which the scan is thinned, in lengths; none: {SAMPLE_SPACING:g}, where it is dense and smooth"
        f" {SMOOTH_SAMPLE_SPACING:g}; search boxes are larger",
        source="Eq. 1",
    )
    thin_spacing: float | None = _setting(
        None,
        "a scan file is thinned to this by search boxes while it is read; 0: never; none: to length / 20, where it is larger than memory",
        unit="scan unit",
        source="Sec. 2",
    )
    clean: bool = _setting(
        True, "leave out what does not belong to the scan, by the steps below; --no-clean keeps all", source="Sec. 2"
    )
    drop_repeated: bool = _setting(
        True, "points that repeat another one are left out, where a hundredth of the points or more do", source="Sec. 2"
    )
    outlier_distance: float = _setting(
        3.0, "points so many times farther from others than their neighbours are left out; 0 keeps all", source="Sec. 2"
    )
    boundary_radius: float = _setting(
        0.4, "radius of the disc rolled along the boundary, in lengths", source="Sec. 3.3"
    )
    fill_holes: float | None = _setting(
        None,
        f"holes with a rim shorter than this are closed, 0 keeps all; none: {HOLE:g} lengths",
        unit="scan unit",
        source="Sec. 3.6",
    )
    corner_angle: float = _setting(
        40.0, "a boundary that turns by more than this has a corner", unit="degree", source="Sec. 3.3"
    )
    smooth_forward: float = _setting(0.6, "forward factor of the smoothing", symbol="lambda", source="Sec. 4.1, [34]")
    smooth_backward: float = _setting(-0.1, "backward factor of the smoothing", symbol="mu", source="Sec. 4.1, [34]")
    smooth_passes: int = _setting(500, "most passes of the smoothing", source="Sec. 4.1")

    def __post_init__(self) -> None:
        """Check every value, with a message that says what is needed."""
        object.__setattr__(self, "length_field", check_length_field(self.length_field))
        taken = self.selection
        for name in ("classes", "returns", "crop"):
            object.__setattr__(self, name, getattr(taken, name))
        if self.length_field and self.length == 0:
            object.__setattr__(self, "length", shortest_and_longest(self.length_field)[0])
        if not (isinstance(self.length, int | float) and math.isfinite(self.length) and self.length > 0):
            raise InputError(f"length must be a positive number in the scan's unit, got {self.length}")
        for spec in fields(self):
            value = getattr(self, spec.name)
            choices = spec.metadata["choices"]
            if choices and value not in (*choices, spec.default):
                raise InputError(f"{spec.name} must be one of {' '.join(choices)}, got {value!r}")
            if spec.type == "bool" and not isinstance(value, bool):
                raise InputError(f"{spec.name} must be true or false, got {value!r}")
            if isinstance(value, float) and not math.isfinite(value):
                raise InputError(f"{spec.name} must be a finite number, got {value}")
        for name, low, high in (
            ("shape_weight", 0, math.inf), ("size_weight", 0, math.inf), ("length_weight", 0, 1),
            ("search_range", 0.1, 20), ("nearness", 0.1, 1), ("merge_angle", 60, 120), ("box_size", 0.05, 0.5),
            ("outlier_distance", 0, math.inf),
            ("boundary_radius", 0.1, 1), ("corner_angle", 10, 180), ("ridge_angle", 0, 180),
            ("smooth_forward", 0, 1), ("smooth_backward", -1, 0), ("smooth_passes", 0, 10_000),
        ):  # fmt: skip
            value = getattr(self, name)
            if value is None and type(self).__dataclass_fields__[name].default is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise InputError(f"{name} must be a number, got {value!r}")
            if not low <= value <= high:
                raise InputError(f"{name} must lie between {low} and {high}, got {value}")
        if self.max_deviation is not None and not (
            isinstance(self.max_deviation, int | float) and self.max_deviation > 0
        ):
            raise InputError(f"max_deviation must be positive, got {self.max_deviation}")
        object.__setattr__(self, "fixed_lines", tuple(map(_line, self.fixed_lines)))
        if self.fill_holes is not None and not (isinstance(self.fill_holes, int | float) and self.fill_holes >= 0):
            raise InputError(f"fill_holes must be a length of 0 or more, got {self.fill_holes}")
        if self.thin_spacing is not None and not (
            isinstance(self.thin_spacing, int | float) and self.thin_spacing >= 0
        ):
            raise InputError(f"thin_spacing must be a length of 0 or more, got {self.thin_spacing}")
        try:
            fixed = tuple(tuple(float(c) for c in position) for position in self.fixed)
        except (TypeError, ValueError):
            raise InputError(f"fixed must be positions of three numbers, got {self.fixed!r}") from None
        for position in fixed:
            if len(position) != 3 or not all(map(math.isfinite, position)):
                raise InputError(f"a fixed node needs three finite coordinates, got {position}")
        object.__setattr__(self, "fixed", fixed)

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
        """Holes with a rim shorter than this are closed [scan unit]."""
        return HOLE * self.length if self.fill_holes is None else self.fill_holes

    @property
    def bridged_boundary_length(self) -> float:
        """Of these, the front just runs over those with a rim shorter than this; the others are filled [scan unit]."""
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
