"""Our own format of a structure: JSON that holds it without loss, and its results for other programs.

The structure is read back to the last bit; the results follow from it and are not read back. A stiffness that is infinite is
"rigid", what is not given is null. No dates are written: the same structure gives the same bytes.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..errors import FormatError
from ..grid.alike import Alike
from ..grid.panels import loops_of, table_of
from ..layouts.double_layer import Layers
from ..runtime.ours import MADE_BY
from .catalogue import Material, Section
from .report import StructureReport
from .results import Solution
from .truss import Combination, LoadCase, Truss

STRUCTURE_FORMAT = "scantruss-structure"
STRUCTURE_VERSION = 1  # of the files of structures; others are refused
ROW_A_LINE = (",\n", ": ")  #: separators of JSON that put each value of a plain list on a line of its own
UNITS_WRITTEN = {"length": "m", "force": "N", "mass": "kg"}
_ARRAYS = {  # of the record: columns and type
    "nodes": (3, float), "members": (2, int), "triangles": (3, int), "node_normals": (3, float), "member_normals": (3, float),
    "section_of": (1, int), "supports": (6, float),
}  # fmt: skip
_OF_CASE = {"nodal": 6, "line": 3, "temperature": 1, "strain": 1, "settlement": 3}  # columns


def encode_structure(truss: Truss, solution: Solution | None = None, report: StructureReport | None = None) -> bytes:
    """Return the text of the JSON file, one line per node, member and triangle."""
    values: dict[str, Any] = {
        "format": STRUCTURE_FORMAT,
        "format_version": STRUCTURE_VERSION,
        "made_by": MADE_BY,
        "units": UNITS_WRITTEN,
        "scale": truss.scale,
        "pinned": truss.pinned,
        "origin": truss.origin,
        **({"system": truss.system} if truss.system else {}),
        "material": asdict(truss.material),
        "sections": [asdict(section) for section in truss.sections],
        "node_marks": list(truss.node_marks),
        "member_marks": list(truss.member_marks),
        "node_sets": truss.node_sets,
        **({} if truss.panels is None else {"panels": loops_of(truss.panels)}),
        **({"member_sets": truss.member_sets} if truss.member_sets else {}),
        **({"layers": vars(truss.layers)} if truss.layers else {}),
        **({} if truss.alike is None else {"alike": truss.alike.to_dict()}),
        **{name: getattr(truss, name) for name in _ARRAYS},
        "end_stiffness": truss.end_stiffness.reshape(-1, 4),
        "cases": [vars(case) for case in truss.cases],
        "combinations": [{**vars(each), "factors": dict(each.factors)} for each in truss.combinations],
    }
    if solution is not None:
        values["results"] = [
            {
                "name": case.name,
                "displacements": Results(case.displacements),
                "reactions": {
                    truss.node_marks[n]: case.reactions[n] for n in np.flatnonzero(case.reactions.any(axis=1))
                },
                "axial": Results(case.axial),
            }
            for case in solution.cases
        ]
    if report is not None:
        values["report"] = report.to_dict()
        values["utilization"] = report.utilization
        values["governing"] = list(report.governing)
        for name, modes in (("buckling_modes", report.buckling), ("vibration_modes", report.vibration)):
            if modes is not None:
                values[name] = modes.shapes
    parts = [f"{json.dumps(name)}: {_text(value)}" for name, value in values.items()]
    return ("{\n" + ",\n".join(parts) + "\n}\n").encode("utf-8")


def _text(value: Any) -> str:
    """Return JSON of a value, arrays and lists with a row a line."""
    if isinstance(value, np.ndarray) and len(value) > 6 and value.dtype.kind in "if":
        rows = ",\n".join(map(str, value.tolist()))  # numbers of Python read as JSON, four times as quick
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            rows = rows.replace("-inf", "inf").replace("inf", '"rigid"').replace("nan", "null")
        return f"[\n{rows}\n]"
    if isinstance(value, list) and len(value) > 6:
        if all(type(row) is str for row in value):  # at once: as quick as one row alone
            return f"[\n{json.dumps(value, ensure_ascii=False, separators=ROW_A_LINE)[1:-1]}\n]"
        return "[\n" + ",\n".join(map(_inline, value)) + "\n]"
    return _inline(value)


class Results(NamedTuple):
    """A (K, C) table of numbers that is not read back, so that the sign of a 0 may be lost."""

    values: np.ndarray

    def __str__(self) -> str:
        """Return JSON in one line, by pyarrow, which turns numbers into text four times as fast as Python."""
        import pyarrow as pa

        words = pa.array(self.values.ravel()).cast(pa.string()).to_pylist()
        row = f"[{', '.join(['%s'] * self.values.shape[1])}]"
        return f"[{', '.join([row] * len(self.values))}]" % tuple(words)


def _inline(value: Any) -> str:
    """Return JSON of a value in one line."""
    if isinstance(value, Results):
        return str(value)
    if isinstance(value, np.ndarray) and value.dtype.kind in "if" and np.isfinite(value).all():
        return str(value.tolist())
    if isinstance(value, dict):
        return (
            "{"
            + ", ".join(f"{json.dumps(key, ensure_ascii=False)}: {_inline(each)}" for key, each in value.items())
            + "}"
        )
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(_plain(value), allow_nan=False, ensure_ascii=False)


def _plain(value: Any) -> Any:
    """Return plain values: lists of arrays, "rigid" for infinity, null for NaN."""
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            return _plain(value.tolist())
        return value.tolist()
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else "rigid"
    return value


def read_structure(path: str | Path) -> Truss:
    """Read a structure from our own JSON format, without loss.

    Parameters
    ----------
    path : str or Path
        File written by the command `scantruss structure`.

    Raises
    ------
    FormatError
        The file cannot be read, or it is not one of our structures.
    """
    return read_checked(path)[0]


def read_checked(path: str | Path) -> tuple[Truss, tuple[np.ndarray, tuple[str, ...]] | None]:
    """Read a structure, and the (M,) utilizations that it was saved with, their clauses and loads; None where it was not checked.

    Raises
    ------
    FormatError
        The file cannot be read, or it is not one of our structures.
    """
    try:
        values = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise FormatError(f"cannot read {path}: {error.strerror or error}") from None
    except (ValueError, RecursionError):
        raise FormatError(f"{path} is not JSON; a structure saved by scantruss structure is needed") from None
    if not isinstance(values, dict) or values.get("format") != STRUCTURE_FORMAT:
        raise FormatError(
            f'{path} has no "format": "{STRUCTURE_FORMAT}"; a structure saved by scantruss structure is needed'
        )
    if values.get("format_version") != STRUCTURE_VERSION:
        raise FormatError(f"{path} has format_version {values.get('format_version')!r}, known is {STRUCTURE_VERSION}")
    try:
        return _truss_of(values), _checked_of(values)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        words = f"{error.args[0]} is missing" if isinstance(error, KeyError) else error
        raise FormatError(f"{path} is a damaged structure: {words}; write it again with scantruss structure") from None


def _truss_of(values: dict[str, Any]) -> Truss:
    """Return the structure that plain values describe; ValueError, TypeError or KeyError where they do not."""
    arrays = {name: _array(values[name], columns, kind) for name, (columns, kind) in _ARRAYS.items()}
    count, members = len(arrays["nodes"]), len(arrays["members"])
    marks = tuple(map(str, values["node_marks"])), tuple(map(str, values["member_marks"]))
    sections = tuple(Section(**each) for each in values["sections"])
    for name, limit in (("members", count), ("triangles", count), ("section_of", len(sections))):
        if arrays[name].size and not 0 <= arrays[name].min() <= arrays[name].max() < limit:
            raise ValueError(f"{name} must be ids, 0 to {limit - 1}")
    sizes = (("node_normals", count), ("supports", count), ("member_normals", members), ("section_of", members))
    if any(len(arrays[name]) != size for name, size in sizes) or (len(marks[0]), len(marks[1])) != (count, members):
        raise ValueError("its lists have different lengths")
    cases = []
    for each in values["cases"]:
        loads = {name: None if each[name] is None else _array(each[name], width) for name, width in _OF_CASE.items()}
        for name, load in loads.items():
            if load is not None and len(load) != (count if name in ("nodal", "settlement") else members):
                raise ValueError(f"the load case {each['name']} has {len(load)} rows of {name}")
        cases.append(LoadCase(str(each["name"]), str(each["action"]), float(each["self_weight"]), **loads))
    loops = values.get("panels")
    return Truss(
        **arrays,
        panels=None if loops is None else table_of([_ids(np.array(loop), count).tolist() for loop in loops]),
        sections=sections,
        material=Material(**values["material"]),
        end_stiffness=_array(values["end_stiffness"], 4).reshape(members, 2, 2),
        pinned=bool(values["pinned"]),
        cases=tuple(cases),
        combinations=tuple(
            Combination(each["name"], each["state"], tuple(each["factors"].items())) for each in values["combinations"]
        ),
        node_sets={name: np.array(nodes, np.int64) for name, nodes in values["node_sets"].items()},
        member_sets={name: _ids(ids, members) for name, ids in values.get("member_sets", {}).items()},
        origin=_array(values["origin"], 1),
        system=str(values.get("system", "")),
        node_marks=marks[0],
        member_marks=marks[1],
        scale=float(values["scale"]),
        layers=_layers(values["layers"], count) if values.get("layers") else None,
        alike=Alike(**values["alike"]) if values.get("alike") else None,
    )


def _layers(values: dict[str, Any], count: int) -> Layers:
    """Return the layers that plain values describe; ValueError, TypeError or KeyError where they do not."""
    of_nodes, share = np.array(values["of_nodes"], np.int64), _array(values["share"], 1)
    panels = tuple(np.array(each, np.int64) for each in values["panels"])
    names = tuple(map(str, values["names"]))
    if of_nodes.shape != (count,) or share.shape != (count,) or not 0 <= of_nodes.min() <= of_nodes.max() < len(names):
        raise ValueError("layers need the layer of each node and its share of the depth")
    if any(len(each) < 3 or not 0 <= each.min() <= each.max() < count for each in panels):
        raise ValueError(f"panels of layers must be ids of three nodes or more, 0 to {count - 1}")
    return Layers(names, tuple(map(float, values["depths"])), of_nodes, share, panels)


def _ids(values: Any, limit: int) -> np.ndarray:
    """Return ids of members; ValueError where they are none."""
    ids = np.array(values, np.int64)
    if ids.ndim != 1 or (len(ids) and not 0 <= ids.min() <= ids.max() < limit):
        raise ValueError(f"member_sets must hold ids, 0 to {limit - 1}")
    return ids


def _checked_of(values: dict[str, Any]) -> tuple[np.ndarray, tuple[str, ...]] | None:
    """Return what the results say of the checks; ValueError, TypeError or KeyError where it does not suit the members."""
    if values.get("utilization") is None:
        return None
    used, governing = _array(values["utilization"], 1), tuple(map(str, values["governing"]))
    if len(used) != len(values["members"]) or len(governing) != len(used):
        raise ValueError("utilization and governing need a value for each member")
    return used, governing


def _array(rows: Any, columns: int, kind: type = float) -> np.ndarray:
    """Return rows of numbers as an array: "rigid" is infinite, null NaN."""
    made = np.array(_numbers(rows), np.int64 if kind is int else np.float64)
    return made.reshape(-1, columns) if columns > 1 else made.ravel()


def _numbers(value: Any) -> Any:
    """Return numbers for what stands for them."""
    if isinstance(value, list):
        return [_numbers(each) for each in value]
    return math.inf if value == "rigid" else math.nan if value is None else value
