"""Loads: from words such as `snow:1kN/m2` or tables of a settings file to forces on nodes and members.

A load on an area is shared by the nodes around it (see `areas`). Loads of one name are one load case.

On the command line:

- `self`: weight of the members, more by the allowance for the nodes
- `cladding:0.5kN/m2`: weight on the surface
- `snow:1kN/m2`: on the plan area of what faces up
- `half-snow:1kN/m2`: the same beyond the middle of the area towards +x, +y, -x and -y, four cases; `@30` towards 30 degrees from x,
  `@all` every 30 degrees
- `wind:0.8kN/m2:-0.7`: pressure times coefficient against the outer normal; `wind:0.8kN/m2:0.8/-0.5@90` with one coefficient
  for what faces a wind that blows towards 90 degrees from x, another for the rest
- `temperature:30K`: of all members

`_of_table` says what a settings file can hold.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, did_you_mean
from .areas import LoadedAreas, loaded_areas
from .quantities import FORCE, FORCE_PER_LENGTH, LENGTH, PRESSURE, TEMPERATURE, quantity, split_loads
from .supports import support_nodes
from .truss import Combination, LoadCase

if TYPE_CHECKING:
    from .truss import Truss

PERMANENT_FACTORS = (1.35, 1.0)  #: of permanent actions, unfavourable and favourable: EN 1990 table A1.2(B), 6.10
VARIABLE_FACTOR = 1.5  #: of variable actions: EN 1990 table A1.2(B)
#: psi 0 of EN 1990 table A1.1: imposed loads of category A, snow up to 1000 m above the sea, wind, temperature
COMPANION_FACTORS = {"variable": 0.7, "snow": 0.5, "wind": 0.6, "temperature": 0.6}
ACTIONS = ("permanent", *COMPANION_FACTORS)
ON_AREAS = ("cladding", "snow", "half-snow", "wind")
MOST_ALLOWANCE = 2  #: weight of the nodes over that of the members; more is a share that was meant in percent
LOAD_NAMES = ("self", "cladding", "snow", "half-snow", "wind", "temperature")
LOAD_WORDS = "self, cladding:P, snow:P, half-snow:P, wind:P:C, temperature:T"
LOADS_GIVEN_ONCE = ("self", "snow", "temperature")  #: loads of which a second one is a slip
#: directions of half the snow, unless others are given [degree from x]
HALF_SNOW_DIRECTIONS = (0.0, 90.0, 180.0, 270.0)
ALL_DIRECTIONS = tuple(30.0 * k for k in range(12))  #: those of `@all`
MOST_COMBINATIONS = 200  #: made without being asked for one by one


def cases_of(truss: Truss, loads: str | Sequence[Any], node_allowance: float = 0.0) -> tuple[LoadCase, ...]:
    """Return the load cases that words and tables describe.

    Raises
    ------
    InputError
        A load cannot be understood, has no unit or acts on an area where there is none.
    """
    if not 0 <= node_allowance <= MOST_ALLOWANCE:
        raise InputError(
            f"node_allowance is a share of the members' weight, 0 to {MOST_ALLOWANCE}, got {node_allowance!r}"
        )
    given = split_loads(loads) if isinstance(loads, str) else list(loads)
    words = [str(load).strip().partition(":")[0] for load in given if not isinstance(load, LoadCase | Mapping)]
    for name in LOADS_GIVEN_ONCE:
        if words.count(name) > 1:
            raise InputError(
                f"the load {name} is given {words.count(name)} times; give it once, or cases of other names in a file"
            )
    found: dict[str, LoadCase] = {}
    half_snow: set[str] = set()
    for load in given:
        if isinstance(load, LoadCase):
            made = [load]
        elif isinstance(load, Mapping):
            made = [_of_table(truss, load, node_allowance)]
        else:
            made = _of_words(truss, str(load).strip(), node_allowance)
            if twice := next((case.name for case in made if case.name in half_snow), ""):
                raise InputError(f"the load {twice} is given 2 times; give each direction once")
            half_snow |= {case.name for case in made if case.name.startswith("half-snow")}
        for case in made:
            found[case.name] = _added(found[case.name], case) if case.name in found else case
    if not found:
        raise InputError(f"no loads; name some of {LOAD_WORDS}")
    return tuple(found.values())


def usual_combinations(cases: Sequence[LoadCase]) -> tuple[Combination, ...]:
    """Return the combinations of EN 1990: 6.10 with tables A1.1 and A1.2(B) for ULS, 6.14b for SLS.

    Cases of one variable action exclude each other, such as snow on one half or another. Each leads once alone and once with every
    choice of one case of each other action. Wind also acts with permanent loads that hold against it.
    """
    permanent = [case.name for case in cases if case.action == "permanent"]
    groups: dict[str, list[str]] = {}
    for case in cases:
        if case.action != "permanent":
            groups.setdefault(case.action, []).append(case.name)
    against, for_it = PERMANENT_FACTORS
    ways: list[list[tuple[str, float]]] = [[]]
    for action, names in groups.items():
        others = [
            [None, *((other, COMPANION_FACTORS[kind]) for other in members)]
            for kind, members in groups.items()
            if kind != action
        ]
        ways += [
            [(name, 1.0), *(pair for pair in chosen if pair)] for name in names for chosen in product(*others)
        ]  # fmt: skip
    if len(ways) > MOST_COMBINATIONS:
        raise InputError(f"{len(ways):,} combinations of these loads; name those that matter in a settings file")
    made = []
    for way in ways:
        variable = [(name, VARIABLE_FACTOR * share) for name, share in way]
        made.append(_combination("ULS", [(name, against) for name in permanent] + variable))
        if permanent and way and way[0][0] in groups.get("wind", []):
            made.append(_combination("ULS", [(name, for_it) for name in permanent] + variable))
    made += [_combination("SLS", [(name, 1.0) for name in permanent] + way) for way in ways]
    return tuple(each for each in made if each.factors)


def _combination(state: str, factors: list[tuple[str, float]]) -> Combination:
    words = " + ".join(f"{round(factor, 4):g} {name}" for name, factor in factors)
    return Combination(f"{state} {words}", state, tuple((name, round(factor, 12)) for name, factor in factors))


def _added(one: LoadCase, other: LoadCase) -> LoadCase:
    """Return two loads of one name as one case."""
    if one.action != other.action:
        raise InputError(f"the load case {one.name!r} is both {one.action} and {other.action}; give them two names")
    sums: dict[str, Any] = {}
    for name in ("nodal", "line", "temperature", "strain", "settlement"):
        a, b = getattr(one, name), getattr(other, name)
        if a is not None and b is not None:
            sums[name] = np.where(np.isnan(a), b, np.where(np.isnan(b), a, a + b))
        else:
            sums[name] = b if a is None else a
    return replace(one, self_weight=one.self_weight + other.self_weight, **sums)


def _of_words(truss: Truss, words: str, node_allowance: float) -> list[LoadCase]:
    """Return the load cases of one load on the command line."""
    name, _, rest = words.partition(":")
    if name == "self" and not rest:
        return [LoadCase("self", "permanent", self_weight=1.0 + node_allowance)]
    if name == "temperature" and rest:
        change = quantity(rest, TEMPERATURE, "a change of temperature")
        return [LoadCase("temperature", "temperature", temperature=np.full(len(truss.members), change))]
    if name not in ON_AREAS:
        raise InputError(
            f"no load {words!r}{did_you_mean(name, LOAD_NAMES)}; use {LOAD_WORDS} with units, as in snow:1kN/m2, or a file"
        )
    rest, at, direction = rest.partition("@")
    pressure, _, coefficient = rest.partition(":")
    if at and name not in ("half-snow", "wind"):
        raise InputError(f"{name} has no direction, got {words!r}")
    every = name == "half-snow" and direction == "all"
    angle = float(direction) if re.fullmatch(r"[-+]?\d+\.?\d*", direction) else None
    if at and angle is None and not every:
        raise InputError(f"a direction is degrees from x in plan, as in {name}:1kN/m2@90, got {words!r}")
    value = quantity(pressure, PRESSURE, f"{name}, a load on an area,")
    if len(truss.triangles) == 0:
        raise InputError(f"the load {name} acts on an area, and the grid has no triangles")
    areas = loaded_areas(truss.nodes, truss.panel_table)
    if value < 0 and name != "wind":
        raise InputError(
            f"{name} weighs down and must be positive, got {pressure}; loads that lift are wind, or forces in a file"
        )
    if name == "wind":
        return [_wind(areas, value, coefficient, angle)]
    if coefficient:
        raise InputError(f"{name} takes one pressure, got {words!r}")
    if name != "half-snow":
        action = "permanent" if name == "cladding" else "snow"
        return [LoadCase(name, action, nodal=(_cladding if name == "cladding" else _snow)(areas, value))]
    if not areas.plan.any():
        raise InputError("no part of the grid faces up, so there is no half of snow")
    ways = ALL_DIRECTIONS if every else HALF_SNOW_DIRECTIONS if angle is None else (angle,)
    return [LoadCase(f"half-snow {way:g}", "snow", nodal=_on_half(areas, value, way)) for way in ways]


def _cladding(areas: LoadedAreas, pressure: float) -> np.ndarray:
    """Return weight on the surface."""
    return areas.on_nodes(-pressure * areas.surface[:, None] * [0.0, 0.0, 1.0])


def _snow(areas: LoadedAreas, pressure: float) -> np.ndarray:
    """Return a load on the plan area of what faces up."""
    return areas.on_nodes(-pressure * areas.plan[:, None] * [0.0, 0.0, 1.0])


def _on_half(areas: LoadedAreas, pressure: float, angle: float) -> np.ndarray:
    """Return snow on what lies beyond the middle of the plan area, in a direction [degree from x]."""
    middle = areas.middles[:, :2]
    away = (middle - np.average(middle, axis=0, weights=areas.plan)) @ _direction(angle)[:2]
    beyond = areas.plan * (away > 1e-9 * np.abs(away).max())
    return areas.on_nodes(-pressure * beyond[:, None] * [0.0, 0.0, 1.0])


def _wind(areas: LoadedAreas, pressure: float, coefficient: str, angle: float | None) -> LoadCase:
    """Return wind: pressure times coefficient against the outer normal."""
    words = (coefficient or "1").split("/")
    try:
        windward, leeward = float(words[0]), float(words[-1])
        if not (math.isfinite(windward) and math.isfinite(leeward)):
            raise ValueError(coefficient)
    except ValueError:
        raise InputError(
            f"coefficients of wind are numbers, as in wind:0.8kN/m2:0.8/-0.5@90, got {coefficient!r}"
        ) from None
    if (len(words) == 2) != (angle is not None) or len(words) > 2:
        raise InputError("wind takes one coefficient, or two with a direction: wind:0.8kN/m2:0.8/-0.5@90")
    if angle is None:
        factor: Any = windward
    else:
        faces = areas.signs * (areas.vectors @ _direction(angle)) < 0
        factor = np.where(faces, windward, leeward)[:, None]
    name = "wind" if angle is None else f"wind {angle:g}"
    return LoadCase(name, "wind", nodal=areas.on_nodes(-pressure * factor * areas.vectors))


def _direction(angle: float) -> np.ndarray:
    """Return the unit vector in plan at an angle from x [degree]."""
    turn = np.radians(angle)
    return np.array([np.cos(turn), np.sin(turn), 0.0])


def _of_table(truss: Truss, table: Mapping[str, Any], node_allowance: float) -> LoadCase:
    """Return the load of a table of a settings file.

    `case` names it, `action` is one of `ACTIONS`. It has one of: `load` (words as on the command line), `force` [N, three numbers]
    at `nodes`; `line` [N/m, three numbers] on `members`; `temperature` [K], `lengthening` [m] or `strain` on `members`;
    `settlement` [m, three numbers] at `nodes`. `nodes` and `members` are lists of marks, `nodes` also what a support can be.
    """
    known = {
        "case",
        "action",
        "load",
        "force",
        "line",
        "temperature",
        "lengthening",
        "strain",
        "settlement",
        "nodes",
        "members",
    }
    if unknown := sorted(table.keys() - known):
        raise InputError(f"a load has no {unknown[0]!r}; known are {' '.join(sorted(known))}")
    kinds = sorted(table.keys() & (known - {"case", "action", "nodes", "members"}))
    if len(kinds) != 1:
        raise InputError(
            f"a load needs one of load, force, line, temperature, lengthening, strain, settlement, got {kinds}"
        )
    kind, name = kinds[0], str(table.get("case", "point" if kinds[0] == "force" else kinds[0]))
    action = str(table.get("action", {"settlement": "permanent", "temperature": "temperature"}.get(kind, "variable")))
    if action not in ACTIONS:
        raise InputError(f"the action of the load {name!r} must be one of {' '.join(ACTIONS)}, got {action!r}")
    if kind == "load":
        made = _of_words(truss, str(table["load"]), node_allowance)
        if len(made) > 1 and "case" in table:
            raise InputError(f"{table['load']!r} is {len(made)} load cases; name one with a direction, as in @0")
        return replace(
            made[0], name=str(table.get("case", made[0].name)), action=str(table.get("action", made[0].action))
        )
    if kind in ("force", "settlement"):
        nodes = _nodes(truss, table.get("nodes"), name)
        vector = _vector(table[kind], FORCE if kind == "force" else LENGTH, name)
        if kind == "force":
            nodal = np.zeros((len(truss.nodes), 6))
            nodal[nodes, :3] = vector
            return LoadCase(name, action, nodal=nodal)
        settlement = np.full((len(truss.nodes), 3), np.nan)
        settlement[nodes] = vector
        return LoadCase(name, action, settlement=settlement)
    members = _members(truss, table.get("members"), name)
    if kind == "line":
        line = np.zeros((len(truss.members), 3))
        line[members] = _vector(table[kind], FORCE_PER_LENGTH, name)
        return LoadCase(name, action, line=line)
    values = np.zeros(len(truss.members))
    units = {"temperature": TEMPERATURE, "lengthening": LENGTH, "strain": {"": 1.0}}[kind]
    values[members] = quantity(table[kind], units, f"the {kind} of the load {name!r}", plain=True)
    if kind == "temperature":
        return LoadCase(name, action, temperature=values)
    return LoadCase(name, action, strain=values / truss.lengths if kind == "lengthening" else values)


def _vector(given: Any, units: dict[str, float], name: str) -> np.ndarray:
    """Return three numbers, each alone in SI units or with a unit."""
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 3:
        raise InputError(f"the load {name!r} needs three numbers [x, y, z], got {given!r}")
    return np.array([quantity(value, units, f"the load {name!r}", plain=True) for value in given])


def _nodes(truss: Truss, given: Any, name: str) -> np.ndarray:
    """Return ids of nodes of marks, or of what a support can be."""
    words = [given] if isinstance(given, str) else given
    if not words:
        raise InputError(f'the load {name!r} needs nodes, as in nodes = ["N001"]')
    try:
        return support_nodes(truss, "+".join(map(str, words)))
    except InputError as error:
        found = str(error).partition(";")[0].removeprefix("no supports").removeprefix(":").strip()
        raise InputError(f"the load {name!r} names nodes that are not there: {found}") from None


def _members(truss: Truss, given: Any, name: str) -> np.ndarray:
    """Return ids of members of marks, "all", or the name of a set of nodes: the members within it."""
    if given in (None, "all"):
        return np.arange(len(truss.members))
    if isinstance(given, str) and given not in truss.member_marks:
        inside = np.isin(truss.members, support_nodes(truss, given)).all(axis=1)
        if not inside.any():
            raise InputError(f"the load {name!r}: no member lies within {given!r}")
        return np.flatnonzero(inside)
    ids = {mark: number for number, mark in enumerate(truss.member_marks)}
    try:
        return np.array([ids[mark] for mark in ([given] if isinstance(given, str) else given)])
    except (KeyError, TypeError):
        raise InputError(f"the load {name!r} names members that are not there: {given!r}") from None
