"""The settings of each stage: everything that can be set, with its symbol, unit, bounds, default and source.

The options of the command line, the table in the docs and the JSON saved with each result are made from these fields.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from ..errors import InputError
from ..selection import FORMS, RETURNS

SAMPLE_SPACING = 0.2  # spacing of the surface samples of a scan [member lengths]
SMOOTH_SAMPLE_SPACING = 0.3  # spacing of the surface samples of a dense, smooth scan [member lengths]
# boundary length of the smallest hole worth keeping; the front runs over smaller ones [member lengths]
SMALLEST_HOLE = 4.0
CELLS = ("triangle", "quad", "hexagon")
ROW_GUIDES = ("boundary", "curvature")
JUDGE_OUTLIERS = ("auto", "always")
METHODS = ("default", "paper")
EFFORTS = ("normal", "quick", "best")
PREFER = ("balance", "lengths", "shapes")
ADVANCE_FROM = ("external", "all")
CASE3 = ("merge", "quadrangle")
CUT_THIN = ("close", "open")
UNITS = {"": None, "mm": 0.001, "cm": 0.01, "m": 1.0, "inch": 0.0254, "foot": 0.3048}  # [metre]


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
        "desired member length; with a length field, its shortest length, to which the field is scaled",
        symbol="l_e",
        unit="scan unit",
        source="Eq. 10",
    )
    length_field: str | Sequence[Sequence[float]] = _setting(
        "",
        "member lengths that vary over the scan: curvature:MIN:MAX, or lengths given at places (x, y, z, length)",
        unit="scan unit",
    )
    cells: str = _setting("triangle", "what the panels are: triangles, quads or hexagons", choices=CELLS)
    rows: str = _setting(
        "boundary",
        "what the rows of quads follow inside: the boundary, or the directions of least and greatest curvature",
        choices=ROW_GUIDES,
    )
    rows_along: Sequence[float] = _setting(
        (),
        "direction of the rows of members, as six numbers: a place on the scan and an arrow, x y z dx dy dz; one"
        " lattice is laid out instead of several (default method, triangles, one length)",
        unit="scan unit",
    )
    planar: bool = _setting(
        False, "make quads or hexagons planar, as far as nodes can stay within a tenth of a member of the scan"
    )
    method: str = _setting("default", "default: the improved method; paper: the paper to the letter", choices=METHODS)
    effort: str = _setting(
        "normal",
        "how much time to spend on regularity (default method only); best tries 24 fronts and anneals three",
        choices=EFFORTS,
    )
    prefer: str = _setting(
        "balance", "which matters more, if there is a choice: equal members or regular triangles", choices=PREFER
    )


@dataclass(frozen=True, kw_only=True)
class ReadingSettings(_Checked):
    """Reading the scan."""

    unit: str = _setting(
        "", "unit of the coordinates; overrides what the file says", choices=tuple(u for u in UNITS if u)
    )
    z_unit: str = _setting(
        "",
        "unit of the heights, if it differs from that of x and y; they are converted",
        choices=tuple(u for u in UNITS if u),
    )
    classes: tuple[int, ...] = _setting(
        (), "keep only these point classes, e.g. 6 or 2,6 (LAS, or a column of that name)"
    )
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
        "auto", "when to look for outliers: auto, if samples are isolated or no grid passes; or always",
        choices=JUDGE_OUTLIERS,
    )  # fmt: skip
    keep_rods: bool = _setting(
        True,
        "keep columns, scaffold and cables, which are too thin for the members; they are left out if no grid passes with them",
    )
    limb_girth: float = _setting(
        3.0,
        "cut off limbs, tails, handles and necks with a smaller girth than this, in member lengths; 0: never",
        low=0.0,
        high=6.0,
    )
    cut_thin: str = _setting(
        "close", "what happens where a thin limb is cut off: the ring is closed by a cap, or left open as a boundary",
        choices=CUT_THIN,
    )  # fmt: skip
    piece: str = _setting(
        "auto",
        "which pieces of the scan get a grid: auto (all but a floor under the others), all, largest, or numbers such as 1 or 1,3",
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
        "spacing of the surface samples, in member lengths; the search boxes that hold them are four times as wide; none:"
        f" {SAMPLE_SPACING:g}, or {SMOOTH_SAMPLE_SPACING:g} for a dense, smooth scan",
        source="Eq. 1",
        low=0.05,
        high=0.5,
    )
    smooth_scale: float | None = _setting(
        None,
        "smooth away roughness and overhangs up to this size, in member lengths: nodes lie on the mean surface; 0: nothing;"
        " none: 0.5, then 1, if no grid passes without smoothing",
        low=0.0,
        high=2.0,
    )
    sharp_edges: bool = _setting(
        False,
        "look for edges at which two sides of a body meet at less than about 60 degrees; tried automatically if no grid passes,"
        " or one that cuts across edges (default method only)",
    )
    thin_walls: bool = _setting(
        False,
        "tell the two sides of a thin wall apart, as of a vase, before samples are chosen; tried automatically if no grid passes"
        " (only for a scan without normals)",
    )
    plain_body: bool = _setting(
        False,
        "take limbs thinner than 0.9 members off the body that the scan encloses, and fill slits narrower than 0.6 members;"
        " tried automatically if no grid passes",
    )
    plain_at: Sequence[Sequence[float]] = _setting(
        (),
        "take thin limbs off and fill narrow slits within three members of each of these places; tried automatically where a grid fails",
        unit="scan unit",
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
        "the true boundary: closed polylines that replace the boundary found in the scan; those inside others are holes",
        unit="scan unit",
    )
    fill_holes: float | None = _setting(
        None,
        f"close holes with a shorter boundary than this; 0 keeps all; none: {SMALLEST_HOLE:g} member lengths",
        unit="scan unit",
        source="Sec. 3.6",
        low=0.0,
    )
    fill_at: Sequence[Sequence[float]] = _setting(
        (), "close the hole whose boundary passes each of these places, however long the boundary is", unit="scan unit"
    )


@dataclass(frozen=True, kw_only=True)
class ConstraintSettings(_Checked):
    """Fixed nodes, fixed lines and ridges."""

    fixed: Sequence[Sequence[float]] = _setting(
        (), "positions that must become nodes, in the frame of the scan", unit="scan unit", source="Sec. 4.2"
    )
    fixed_lines: Sequence[Sequence[Sequence[float]]] = _setting(
        (),
        "polylines that must become chains of members, in the frame of the scan; closed if the last point equals the first",
        unit="scan unit",
    )
    line_names: Sequence[str] = _setting(
        (), "names of the fixed lines, in their order, and of the sets of their nodes; none: line 1, line 2, ..."
    )
    symmetry: str | Sequence[Sequence[float]] = _setting(
        "",
        "mirror planes or the rotation that the grid keeps exactly: auto finds planes in the scan, else a rotation; rotation finds that"
        " only; or rows of a point and a normal, x y z nx ny nz, several in one line at equal angles; or one row of a point, an axis"
        " and the parts of a turn, x y z ax ay az n, and perhaps a second one of a half turn about a straight line of the surface",
        unit="scan unit",
    )
    ridge_angle: float = _setting(
        40.0,
        "a fold by more than this, sharp or rounded over up to half a member, becomes a chain of members; 0: no ridges"
        " (default method only)",
        unit="degree",
        low=0.0,
        high=180.0,
    )
    no_ridge_at: Sequence[Sequence[float]] = _setting(
        (), "do not follow the ridge that passes each of these places", unit="scan unit"
    )
    fold_weight: float = _setting(
        0.0, "pull nodes onto the crests of folds that are not ridges, even rounded ones, at the cost of even members; 1 is usual,"
        " 0: off (default method only)", low=0.0, high=10.0,
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
    smooth_forward: float = _setting(
        0.6, "factor of the forward step", symbol="lambda", source="Sec. 4.1, [34]", low=0.0, high=1.0
    )
    smooth_backward: float = _setting(
        -0.1, "factor of the backward step", symbol="mu", source="Sec. 4.1, [34]", low=-1.0, high=0.0
    )
    smooth_passes: int = _setting(500, "most passes of smoothing", source="Sec. 4.1", low=0, high=10_000)


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
