"""SAP2000's text tables (.s2k): a structure with its axes, releases, supports, springs, load patterns, cases and combinations.

Local axis 2 is our z, along the normal of the surface, local axis 3 our -y. The default of SAP2000 has 2 in the vertical plane through
the member; the angle of each frame turns it to the normal. Sections are general ones without areas for shear, so that members are
those of Euler and Bernoulli, as here.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FormatError
from ..runtime.ours import MADE_BY
from .model import Model, temperatures
from .style import FileStyle

if TYPE_CHECKING:
    from ..structure.truss import LoadCase, Truss

S2K_TYPES = {"steel": "Steel", "aluminium": "Aluminum"}  #: of materials; others are "Other"
PATTERNS = {"permanent": "Dead", "snow": "Snow", "wind": "Wind", "temperature": "Temperature"}  #: others are "Live"
VERTICAL_SINE = 1e-3  #: sine of the angle to z below which SAP2000 takes a member to be vertical
S2K_FREEDOMS = ("U1", "U2", "U3", "R1", "R2", "R3")

TableRow = dict[str, Any]  # field -> value
TableColumns = dict[str, Any]  # field -> list with a value a row, or the value of all rows
S2kTable = tuple[str, list[TableRow] | TableColumns]  # name and contents


def encode_s2k(model: Model, style: FileStyle) -> bytes:
    """Return the text of a structure in kN, m and degrees Celsius, in the frame of the scan."""
    truss = model.truss
    if truss is None:
        raise FormatError("SAP2000 holds structures; make one of the grid with scantruss structure")
    lines = [f"$ {MADE_BY}"]
    last = ""
    for name, rows in _tables(model, truss):
        if rows and name != last:
            lines += ["", f'TABLE:  "{name}"']
            last = name
        lines += _lines_of_columns(rows) if isinstance(rows, dict) else _lines_of_rows(rows)
    return ("\r\n".join([*lines, "", "END TABLE DATA", ""])).encode("utf-8")


def _lines_of_rows(rows: list[TableRow]) -> Iterator[str]:
    for row in rows:
        yield "   " + "   ".join(f"{field}={_text(value)}" for field, value in row.items())


def _lines_of_columns(columns: TableColumns) -> Iterator[str]:
    """Yield the lines of a long table: lists are its columns, numbers or words that are quoted already, others stand in each row."""
    words = [f"{field}=%s" if isinstance(held, list) else f"{field}={_text(held)}" for field, held in columns.items()]
    lists = [
        map(repr, held) if held and type(held[0]) is float else held
        for held in columns.values()
        if isinstance(held, list)
    ]
    return map(("   " + "   ".join(words)).__mod__, zip(*lists, strict=True))


def _text(value: Any) -> str:
    return _quoted(value) if isinstance(value, str) else repr(value)


@lru_cache(maxsize=1 << 16)
def _quoted(word: str) -> str:
    """Return a word, in quotes where it has blanks or signs."""
    word = "".join(letter if letter.isprintable() else " " for letter in word).replace('"', "'")
    return word if word.isalnum() else f'"{word}"'


def frame_angles(axes: np.ndarray) -> np.ndarray:
    """Return the angles (M,) [degrees] by which local axis 2 turns from its default to our z, of (M, 3, 3) local axes as rows."""
    x, z = axes[:, 0], axes[:, 2]
    upright = np.hypot(x[:, 0], x[:, 1]) < VERTICAL_SINE
    reference = np.where(upright[:, None], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    second = reference - (reference * x).sum(axis=1, keepdims=True) * x
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    third = np.cross(x, second)
    angles: np.ndarray = np.degrees(np.arctan2((z * third).sum(axis=1), (z * second).sum(axis=1)))
    return angles


def _tables(model: Model, truss: Truss) -> Iterator[S2kTable]:
    """Yield all tables, those of a name one after the other."""
    marks, members = list(map(_quoted, truss.node_marks)), list(map(_quoted, truss.member_marks))
    yield from _definitions(model, truss)
    yield from _joints_and_frames(model, truss, marks, members)
    yield from _supports(truss)
    yield from _frame_assignments(model, truss, members)
    loads: dict[str, list[TableColumns]] = {}
    for case in truss.cases:
        for name, columns in _loads(truss, case, marks, members):
            loads.setdefault(name, []).append(columns)
    yield from ((name, columns) for name, own in loads.items() for columns in own)
    yield from _cases(truss)


def _definitions(model: Model, truss: Truss) -> Iterator[S2kTable]:
    """Yield what is defined before joints and frames: the material, sections, load patterns and groups."""
    from ..structure.truss import GRAVITY

    material = truss.material
    turning = "No" if truss.pinned else "Yes"
    yield "PROGRAM CONTROL", [{"ProgramName": "SAP2000", "CurrUnits": "KN, m, C"}]
    yield (
        "ACTIVE DEGREES OF FREEDOM",
        [dict.fromkeys(("UX", "UY", "UZ"), "Yes") | dict.fromkeys(("RX", "RY", "RZ"), turning)],
    )
    yield (
        "MATERIAL PROPERTIES 01 - GENERAL",
        [
            {
                "Material": material.name,
                "Type": S2K_TYPES.get(material.kind, "Other"),
                "SymType": "Isotropic",
                "TempDepend": "No",
            }
        ],
    )
    yield "MATERIAL PROPERTIES 02 - BASIC MECHANICAL PROPERTIES", [
        {
            "Material": material.name, "UnitWeight": material.density * GRAVITY / 1e3, "UnitMass": material.density / 1e3,
            "E1": material.young / 1e3, "G12": material.shear / 1e3, "U12": material.young / (2 * material.shear) - 1,
            "A1": material.alpha,
        }
    ]  # fmt: skip
    yield "FRAME SECTION PROPERTIES 01 - GENERAL", [
        {
            "SectionName": each.name, "Material": material.name, "Shape": "General", "t3": each.depth, "t2": each.width,
            "Area": each.area, "TorsConst": each.torsion, "I33": each.inertia_y, "I22": each.inertia_z, "I23": 0.0,
            "AS2": 0.0, "AS3": 0.0, "S33": each.elastic_y, "S22": each.elastic_z, "Z33": each.plastic_y, "Z22": each.plastic_z,
        }
        for each in truss.sections
    ]  # fmt: skip
    yield (
        "LOAD PATTERN DEFINITIONS",
        [
            {
                "LoadPat": case.name,
                "DesignType": PATTERNS.get(case.action, "Live"),
                "SelfWtMult": float(case.self_weight),
            }
            for case in truss.cases
        ],
    )
    yield "GROUPS 1 - DEFINITIONS", [{"GroupName": name} for name in model.groups]


def _joints_and_frames(model: Model, truss: Truss, marks: list[str], members: list[str]) -> Iterator[S2kTable]:
    """Yield the places of the joints, and the joints at the ends of the frames, by their quoted marks."""
    x, y, z = model.nodes.T.tolist()
    place = {
        "Joint": marks,
        "CoordSys": "GLOBAL",
        "CoordType": "Cartesian",
        "XorR": x,
        "Y": y,
        "Z": z,
        "SpecialJt": "No",
    }
    yield "JOINT COORDINATES", place
    start, end = ([marks[k] for k in ends] for ends in truss.members.T.tolist())
    yield "CONNECTIVITY - FRAME", {"Frame": members, "JointI": start, "JointJ": end, "IsCurved": "No"}


def _supports(truss: Truss) -> Iterator[S2kTable]:
    """Yield what holds joints: restraints and springs."""
    held = truss.supports[:, :3] if truss.pinned else truss.supports
    yield "JOINT RESTRAINT ASSIGNMENTS", [
        {"Joint": truss.node_marks[node]}
        | {way: "Yes" if np.isinf(value) else "No" for way, value in zip(S2K_FREEDOMS, held[node].tolist(), strict=False)}
        for node in np.flatnonzero(np.isinf(held).any(axis=1)).tolist()
    ]  # fmt: skip
    springs = np.where(np.isinf(held), 0.0, held) / 1e3
    yield (
        "JOINT SPRING ASSIGNMENTS 1 - UNCOUPLED",
        [
            {"Joint": truss.node_marks[node], "CoordSys": "GLOBAL"}
            | dict(zip(S2K_FREEDOMS, springs[node].tolist(), strict=False))
            for node in np.flatnonzero(springs.any(axis=1)).tolist()
        ],
    )


def _frame_assignments(model: Model, truss: Truss, members: list[str]) -> Iterator[S2kTable]:
    """Yield what each frame has, by the quoted marks: section, local axes, releases, group."""
    names = [_quoted(each.name) for each in truss.sections]
    sections = [names[k] for k in truss.section_of.tolist()]
    yield (
        "FRAME SECTION ASSIGNMENTS",
        {"Frame": members, "AutoSelect": "N.A.", "AnalSect": sections, "MatProp": "Default"},
    )
    angles = frame_angles(truss.axes).tolist()
    yield "FRAME LOCAL AXES ASSIGNMENTS 1 - TYPICAL", {"Frame": members, "Angle": angles, "AdvanceAxes": "No"}
    ends = np.zeros_like(truss.end_stiffness) if truss.pinned else truss.end_stiffness
    loose = np.flatnonzero(np.isfinite(ends).any(axis=(1, 2))).tolist()
    yield "FRAME RELEASE ASSIGNMENTS 1 - GENERAL", [_ends(truss.member_marks[k], ends[k], None) for k in loose]
    partial = np.flatnonzero((np.isfinite(ends) & (ends > 0)).any(axis=(1, 2))).tolist()
    yield "FRAME RELEASE ASSIGNMENTS 2 - PARTIAL FIXITY", [_ends(truss.member_marks[k], ends[k], 1e-3) for k in partial]
    groups = [_quoted(name) for name in model.groups]
    grouped = [groups[k] for k in model.group_of.tolist()]
    yield "GROUPS 2 - ASSIGNMENTS", {"GroupName": grouped, "ObjectType": "Frame", "ObjectLabel": members}


def _cases(truss: Truss) -> Iterator[S2kTable]:
    """Yield load cases and combinations."""
    yield (
        "LOAD CASE DEFINITIONS",
        [
            {"Case": case.name, "Type": "LinStatic", "InitialCond": "Zero", "DesTypeOpt": "Prog Det", "RunCase": "Yes"}
            for case in truss.cases
        ],
    )
    yield (
        "CASE - STATIC 1 - LOAD ASSIGNMENTS",
        [{"Case": case.name, "LoadType": "Load pattern", "LoadName": case.name, "LoadSF": 1.0} for case in truss.cases],
    )
    yield (
        "COMBINATION DEFINITIONS",
        [
            {"ComboName": each.name}
            | ({} if number else {"ComboType": "Linear Add", "AutoDesign": "No"})
            | {"CaseType": "Linear Static", "CaseName": case, "ScaleFactor": float(factor)}
            for each in truss.combinations
            for number, (case, factor) in enumerate(each.factors)
        ],
    )


def _ends(mark: str, springs: np.ndarray, kilo: float | None) -> TableRow:
    """Return the releases of a member, or with `kilo` their springs; M3 is about our y, M2 about our z."""
    row: TableRow = {"Frame": mark}
    for axis, word in ((1, "M2"), (0, "M3")):
        for end, letter in enumerate("IJ"):
            value = float(springs[end, axis])
            if kilo is None:
                row[f"{word}{letter}"] = "No" if np.isinf(value) else "Yes"
            elif np.isfinite(value) and value > 0:
                row[f"{word}{letter}"] = value * kilo
    return row


def _loads(truss: Truss, case: LoadCase, joints: list[str], frames: list[str]) -> Iterator[tuple[str, TableColumns]]:
    """Yield each table of the loads of a case, by the quoted marks; weight is a factor of the load pattern."""
    on = {"LoadPat": case.name, "CoordSys": "GLOBAL"}
    if case.nodal is not None and case.nodal.any():
        own = np.flatnonzero(case.nodal.any(axis=1))
        forces = dict(zip(("F1", "F2", "F3", "M1", "M2", "M3"), (case.nodal[own] / 1e3).T.tolist(), strict=True))
        yield "JOINT LOADS - FORCE", {"Joint": [joints[k] for k in own.tolist()], **on, **forces}
    if case.line is not None and case.line.any():
        own, axes = np.nonzero(case.line)
        load = (case.line[own, axes] / 1e3).tolist()
        yield "FRAME LOADS - DISTRIBUTED", {
            "Frame": [frames[k] for k in own.tolist()], **on, "Type": "Force", "Dir": ["XYZ"[k] for k in axes.tolist()],
            "DistType": "RelDist", "RelDistA": 0.0, "RelDistB": 1.0, "FOverLA": load, "FOverLB": load,
        }  # fmt: skip
    change = temperatures(truss, case, "SAP2000")
    if len(own := np.flatnonzero(change)):
        yield "FRAME LOADS - TEMPERATURE", {
            "Frame": [frames[k] for k in own.tolist()], "LoadPat": case.name, "Type": "Temperature", "Temp": change[own].tolist(),
            "JtPattern": "None",
        }  # fmt: skip
    if case.settlement is not None and len(own := np.flatnonzero(np.nan_to_num(case.settlement).any(axis=1))):
        moved = np.nan_to_num(case.settlement)[own].T.tolist()
        yield (
            "JOINT LOADS - GROUND DISPLACEMENT",
            {"Joint": [joints[k] for k in own.tolist()], **on} | dict(zip(S2K_FREEDOMS, moved, strict=False)),
        )
