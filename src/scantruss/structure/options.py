"""What `scantruss structure` is asked for: one record, from options and from a readable file (TOML or JSON)."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from ..errors import FormatError, InputError, did_you_mean
from ..layouts.double_layer import BEND_WAYS, DEPTH_WAYS
from ..layouts.layer_parts import SECOND_LAYERS
from .checks import MemberChecks
from .groups import WAYS_TO_GROUP
from .imperfections import check_imperfection
from .nonlinear import PATH_STEPS
from .quantities import split_loads
from .truss import HELD_LAYERS, Combination

MOST_PATH_STEPS = 1000  #: of a nonlinear path
MOST_MODES = 50  #: of buckling or vibration
WHOLE_NUMBERS = ("size", "buckling", "frequencies", "path_steps")
NUMBERS = (
    "scale",
    "node_allowance",
    "size",
    "buckling",
    "frequencies",
    "path_steps",
    "path_factor",
)  #: settings that are numbers


@dataclass(frozen=True)
class StructureSettings:
    """Everything that turns a grid into a solved structure; a file has the same names."""

    scale: float = 1.0
    unit: str = ""
    section: str = "CHS114.3x5"
    material: str = "S355"
    supports: str = ""
    support_type: str = "pinned"
    joints: str = ""  #: "" is rigid, of a double layer pinned
    loads: tuple[Any, ...] = ("self",)
    node_allowance: float = 0.0
    double_layer: str = ""  #: depth of a double layer [m], or with a unit, of more with commas; "" for a single one
    second_layer: str = SECOND_LAYERS[0]  #: of `SECOND_LAYERS`
    depth_along: str = DEPTH_WAYS[0]  #: of `DEPTH_WAYS`
    held_layer: str = HELD_LAYERS[0]  #: of `HELD_LAYERS`, on which the supports are
    layer_edges: str = ""  #: tapered or closed; "" is tapered of the dual, else closed
    sharp_bends: str = BEND_WAYS[0]  #: of `BEND_WAYS`, where the grid bends too sharply for the depth
    size: int = 0  #: different sections that are chosen at most; 0 keeps `section`
    size_by: str = WAYS_TO_GROUP[0]  #: what has a section of its own in sizing, of `WAYS_TO_GROUP`
    buckling: int = 0  #: buckling factors that are asked for
    frequencies: int = 0  #: natural frequencies that are asked for
    path: str = ""  #: load case or combination of the nonlinear path, or worst; "" for none
    path_steps: int = PATH_STEPS  #: of it at most
    path_factor: float = 0.0  #: load factor at which it ends; 0: a multiple of the linear buckling factor
    imperfection: str = "mode"  #: of it: mode, mode:30mm, scan, scan:30mm or none
    combinations: tuple[Combination, ...] | None = None  #: of a file; else those of EN 1990
    checks: MemberChecks = field(default_factory=MemberChecks)  #: of a file

    def __post_init__(self) -> None:
        """Refuse numbers of modes that are none."""
        if self.size < 0:
            raise InputError(f"size is a number of different sections, 0 or more, got {self.size}")
        if self.size_by not in WAYS_TO_GROUP:
            raise InputError(f"size_by must be one of {' '.join(WAYS_TO_GROUP)}, got {self.size_by!r}")
        if not (1 <= self.path_steps <= MOST_PATH_STEPS and 0 <= self.path_factor < math.inf):
            raise InputError(
                f"a path has 1 to {MOST_PATH_STEPS:,} steps and a positive factor, got {self.path_steps} and {self.path_factor}"
            )
        check_imperfection(self.imperfection)
        if not (0 <= self.buckling <= MOST_MODES and 0 <= self.frequencies <= MOST_MODES):
            raise InputError(
                f"buckling and frequencies are numbers of modes, 0 to {MOST_MODES}, got {self.buckling} and {self.frequencies}"
            )

    def replace(self, **changes: Any) -> StructureSettings:
        """Return a copy with some fields changed."""
        return replace(self, **changes)


def read_structure_settings(path: str | Path) -> StructureSettings:
    """Return the settings in a TOML or JSON file.

    Raises
    ------
    FormatError
        The file cannot be read.
    InputError
        It holds a name or a value that cannot be used.
    """
    values = _read_table(path)
    known = {spec.name for spec in fields(StructureSettings)} - {"combinations", "checks"}
    given: dict[str, Any] = {}
    checks: dict[str, Any] = {}
    check_names = {spec.name for spec in fields(MemberChecks)}
    for name, value in values.items():
        if name in check_names:
            checks[name] = value
        elif name == "combinations":
            given[name] = tuple(_combination_of(path, each) for each in value)
        elif name == "loads":
            given[name] = loads_of_words(value) if isinstance(value, str) else tuple(value)
        elif name in ("scale", "node_allowance", "path_factor") and isinstance(value, int | float):
            given[name] = float(value)
        elif name in WHOLE_NUMBERS and isinstance(value, int):
            given[name] = value
        elif name in known and isinstance(value, str | int | float) and name not in NUMBERS:
            given[name] = str(value)
        else:
            names = sorted(known | check_names | {"combinations"})
            if name in names:
                whole = name in WHOLE_NUMBERS
                needed = f"a {'whole ' * whole}number, without quotes" if name in NUMBERS else "one word or number"
                raise InputError(f"{path} has {name!r} = {value!r}; {name} needs {needed}")
            guess = did_you_mean(name, names)
            raise InputError(f"{path} has {name!r} = {value!r}{guess}; known are {' '.join(names)}")
    return StructureSettings(**given, checks=MemberChecks(**checks))


def units_taken(loads: str | Sequence[Any]) -> list[str]:
    """Return warnings of loads in tables that are numbers without a unit; people who write files think in kN."""
    notes = []
    for table in loads:
        for kind, unit in (("force", "N"), ("line", "N/m"), ("settlement", "m"), ("lengthening", "m")):
            given = table.get(kind) if isinstance(table, Mapping) else None
            numbers = [
                value
                for value in (given if isinstance(given, list | tuple) else [given])
                if isinstance(value, int | float)
            ]
            if any(numbers):
                notes.append(
                    f'{kind} = {given!r} has no unit and is taken in {unit}; write it as "{max(numbers, key=abs):g}{unit}"'
                )
    return notes


def settings_text(settings: StructureSettings) -> str:
    """Return the TOML text that `read_structure_settings` turns into these settings."""
    lines = []
    for spec in fields(settings):
        value = getattr(settings, spec.name)
        if spec.name not in ("combinations", "checks") and value is not None:
            lines.append(f"{spec.name} = {_toml(value)}")
    lines += [f"{name} = {_toml(value)}" for name, value in vars(settings.checks).items()]
    for each in settings.combinations or ():
        lines += ["", "[[combinations]]", f"name = {_toml(each.name)}", f"state = {_toml(each.state)}"]
        lines.append(f"factors = {_toml(dict(each.factors))}")
    return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    """Return a value as TOML; strings as JSON writes them, which TOML reads."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(name))} = {_toml(each)}" for name, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def loads_of_words(words: str) -> tuple[Any, ...]:
    """Return loads of the command line: words with commas between them, files among them with all that they hold."""
    found: list[Any] = []
    for word in split_loads(words):
        if Path(word).suffix.lower() in (".toml", ".json"):
            values = _read_table(word)
            if not isinstance(values.get("loads"), list) or not values["loads"]:
                raise FormatError(f"{word} holds no list of loads; it needs [[loads]] tables")
            found += values["loads"]
        else:
            found.append(word)
    return tuple(found)


def _combination_of(path: str | Path, each: Any) -> Combination:
    """Return the combination of a table: name, state and factors."""
    try:
        factors = tuple((str(name), float(factor)) for name, factor in each["factors"].items())
        state = str(each.get("state", "ULS"))
        if state not in ("ULS", "SLS"):
            raise ValueError(f"state must be ULS or SLS, got {state!r}")
        if not factors or not all(math.isfinite(factor) for _, factor in factors):
            raise ValueError(f"factors must be one finite number or more, got {each['factors']}")
        return Combination(str(each["name"]), state, factors)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        words = f"no {error.args[0]}" if isinstance(error, KeyError) else error
        raise InputError(
            f"{path} has a combination that cannot be used: {words}; it needs name, state, factors"
        ) from None


def _read_table(path: str | Path) -> Mapping[str, Any]:
    """Return the names and values of a TOML or JSON file."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
        values = tomllib.loads(text) if Path(path).suffix.lower() == ".toml" else json.loads(text)
    except OSError as error:
        raise FormatError(f"cannot read {path}: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        kind = "TOML" if Path(path).suffix.lower() == ".toml" else "JSON"
        raise FormatError(f"{path} is not {kind}: {error}") from None
    if not isinstance(values, dict):
        raise FormatError(f"{path} holds no table of names and values")
    return values
