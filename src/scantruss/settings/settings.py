"""All settings of a run as one record, saved as JSON and read again."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from ..errors import InputError, did_you_mean
from ..selection import Selection
from .records import (
    SMALLEST_HOLE,
    BoundarySettings,
    CheckSettings,
    CleaningSettings,
    ConstraintSettings,
    FrontSettings,
    MemberSettings,
    ReadingSettings,
    SmoothingSettings,
    SurfaceSettings,
)
from .values import (
    CURVATURE,
    check_arrow,
    check_length_field,
    check_line,
    check_names,
    check_piece,
    check_places,
    check_positions,
    check_ring,
    check_symmetry,
    shortest_and_longest,
)

RENAMED = {"stray_distance": "outlier_distance", "drop_repeated": "drop_duplicates"}  # names in settings files of 0.1.0


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
    """All settings of a run; `length` is required, everything else has a default. Impossible values raise `InputError`."""

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
            field = (
                f"; give {CURVATURE}MIN:MAX or rows of lengths as length_field"
                if isinstance(self.length, str | Sequence)
                else ""
            )
            raise InputError(f"length must be a positive number in the scan's unit, got {self.length}{field}")
        super().__post_init__()
        if self.cells != "quad" and self.rows != "boundary":
            raise InputError(f"rows {self.rows} needs cells quad, got {self.cells}")
        object.__setattr__(self, "rows_along", check_arrow(self.rows_along))
        if self.rows_along and (self.cells != "triangle" or self.method != "default" or self.length_field):
            raise InputError("rows_along needs cells triangle, method default and one length everywhere")
        if self.planar and self.cells == "triangle":
            raise InputError("planar needs cells quad or hexagon; triangles always are")
        object.__setattr__(self, "fixed", check_positions(self.fixed))
        for name in ("plain_at", "fill_at", "no_ridge_at"):
            object.__setattr__(self, name, check_places(name, getattr(self, name)))
        object.__setattr__(self, "fixed_lines", tuple(check_line(line) for line in self.fixed_lines))
        object.__setattr__(self, "symmetry", check_symmetry(self.symmetry))
        object.__setattr__(self, "boundary", tuple(check_ring(ring) for ring in self.boundary))
        object.__setattr__(self, "line_names", check_names(self.line_names, len(self.fixed_lines)))

    @classmethod
    def check(cls, given: Any) -> Settings:
        """Return settings that a function was given; a number, or what else is none, is refused."""
        if isinstance(given, cls):
            return given
        raise InputError(
            f"settings must be Settings, as in Settings(length=1.5), got {type(given).__name__} {given!r:.40}"
        )

    @property
    def chosen(self) -> dict[str, Any]:
        """The settings that are not the default."""
        own = {spec.name: getattr(self, spec.name) for spec in fields(self)}
        return {spec.name: own[spec.name] for spec in fields(self) if own[spec.name] != spec.default}

    def __repr__(self) -> str:
        """Name the settings that are not the default."""
        return f"Settings({', '.join(f'{name}={value!r}' for name, value in self.chosen.items())})"

    @property
    def selection(self) -> Selection:
        """Which points of the scan are taken."""
        names = [spec.name for spec in fields(Selection)]
        return Selection(**{name: getattr(self, name) for name in names})

    def check_for_array(self) -> None:
        """Refuse settings that choose what is read of a scan file: an array is taken whole."""
        for name in (*(spec.name for spec in fields(Selection)), "thin_spacing"):
            if name in self.chosen:
                raise InputError(
                    f"{name} acts while a scan file is read, and an array is taken whole; cut the array or use grid_from_scan"
                )

    @property
    def is_plain(self) -> bool:
        """Whether thin limbs are taken off the body that the scan encloses, everywhere or near some places."""
        return self.plain_body or len(self.plain_at) > 0

    @property
    def closed_boundary_length(self) -> float:
        """Holes with a shorter boundary than this are closed [scan unit]."""
        return SMALLEST_HOLE * self.length if self.fill_holes is None else self.fill_holes

    @property
    def bridged_boundary_length(self) -> float:
        """Of these, the front runs over those with a shorter boundary than this; the others are filled [scan unit]."""
        return min(SMALLEST_HOLE * self.length, self.closed_boundary_length)

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
            raise InputError(
                f"unknown setting {unknown[0]!r}{did_you_mean(unknown[0], names)}; known are {' '.join(sorted(names))}"
            )
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
        except (ValueError, RecursionError):
            raise InputError(f"{path} is not a settings file (JSON)") from None
        values = values.get("settings", values) if isinstance(values, dict) else None
        if not isinstance(values, dict):
            raise InputError(f"{path} is not a settings file (a JSON object is needed)")
        return cls.from_dict(values)
