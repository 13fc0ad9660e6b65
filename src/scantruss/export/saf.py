"""SAF, the Structural Analysis Format: a workbook that programs for structural analysis read (saf.guide, version 2.2.0).

A sheet for each kind of object, named as the guide names it, with the guide's columns in its order; units are those of its table.
Loads on areas are on nodes and members already. The guide has no sheets of displacements and reactions; of forces in members it
says directions in words ("shear force in Z axis direction", "moment around Y axis", the right-hand rule everywhere) and the face of the
cut in a picture alone, so the sheet of the project says it too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FormatError
from ..runtime.ours import MADE_BY
from .model import STATIONS_WRITTEN, Model, line_loads, temperatures
from .style import FileStyle
from .workbook import ROWS_OF_SHEET, encode_workbook

if TYPE_CHECKING:
    from ..structure.catalogue import Material, Section
    from ..structure.results import CaseResult
    from ..structure.truss import LoadCase, Truss

SAF_VERSION = "2.2.0"
WAYS = ("ux", "uy", "uz", "fix", "fiy", "fiz")
STIFFNESSES = (
    "Stiffness X [MN/m]", "Stiffness Y [MN/m]", "Stiffness Z [MN/m]",
    "Stiffness Fix [MNm/rad]", "Stiffness Fiy [MNm/rad]", "Stiffness Fiz [MNm/rad]",
)  # fmt: skip
SAF_SHEETS: dict[str, tuple[str, ...]] = {  # sheet -> columns
    "StructuralMaterial": (
        "Name", "Type", "Subtype", "Quality", "Unit mass [kg/m3]", "E modulus [MPa]", "G modulus [MPa]", "Poisson Coefficient",
        "Thermal expansion [1/K]", "Design properties", "Id",
    ),
    "StructuralCrossSection": (
        "Name", "Material", "Cross-section type", "Shape", "Parameters [mm]", "Profile", "Form code", "Description ID of the profile",
        "A [m2]", "Iy [m4]", "Iz [m4]", "It [m4]", "Iw[m6]", "Wply [m3]", "Wplz [m3]", "Id",
    ),
    "StructuralPointConnection": ("Name", "Coordinate X [m]", "Coordinate Y [m]", "Coordinate Z [m]", "Id"),
    "StructuralCurveMember": (
        "Name", "Type", "Cross section", "Arbitrary definition", "Nodes", "Segments", "Internal nodes", "Length [m]",
        "Geometrical shape", "LCS", "LCS Rotation [deg]", "Coordinate X [m]", "Coordinate Y [m]", "Coordinate Z [m]", "System line",
        "Structural Y Eccentricity of Beg Node [mm]", "Structural Z Eccentricity of Beg Node [mm]",
        "Structural Y Eccentricity of End Node [mm]", "Structural Z Eccentricity of End Node [mm]",
        "Analysis Y Eccentricity of Beg Node [mm]", "Analysis Z Eccentricity of Beg Node [mm]",
        "Analysis Y Eccentricity of End Node [mm]", "Analysis Z Eccentricity of End Node [mm]",
        "Layer", "Behaviour in analysis", "Color", "Parent ID", "Id",
    ),
    "StructuralPointSupport": (
        "Name", "Type", "Boundary condition", "Node", "Member", "Coordinate system", "Origin", "Coordinate definition",
        "Position x [m]", *WAYS, *STIFFNESSES, "Id",
    ),
    "RelConnectsStructuralMember": ("Name", "Member", "Position", *WAYS, *STIFFNESSES, "Parent ID", "Id"),
    "StructuralLoadGroup": ("Name", "Load group type", "Relation", "Load type", "Id"),
    "StructuralLoadCase": ("Name", "Description", "Action type", "Load group", "Load type", "Duration", "Id"),
    "StructuralLoadCombination": ("Name", "Description", "Category", "National standard", "Type"),
    "StructuralPointAction": (
        "Name", "Type", "Direction", "Force action", "Reference node", "Reference member", "Value [kN]", "Vector (X;Y;Z) [kN]",
        "Load case", "Coordinate system", "Origin", "Coordinate definition", "Position x [m]", "Repeat (n)", "Delta x [m]", "Id",
    ),
    "StructuralPointMoment": (
        "Name", "Type", "Direction", "Force action", "Reference node", "Reference member", "Value [kNm]", "Load case",
        "Coordinate system", "Origin", "Coordinate definition", "Position x [m]", "Repeat (n)", "Delta x [m]", "Id",
    ),
    "StructuralCurveAction": (
        "Name", "Type", "Force action", "Distribution", "Direction", "Value 1 [kN/m]", "Value 2 [kN/m]", "Vector 1(X;Y;Z) [kN/m]",
        "Vector 2(X;Y;Z) [kN/m]", "Member", "Load case", "Coordinate system", "Location", "Coordinate definition", "Origin", "Extent",
        "Start point [m]", "End point [m]", "Eccentricity ey [mm]", "Eccentricity ez [mm]", "Parent ID", "Id",
    ),
    "StructuralCurveActionThermal": (
        "Name", "Force action", "Variation", "deltaT [°C]", "TempL [°C]", "TempR [°C]", "TempT [°C]", "TempB [°C]", "Member",
        "Member Rib", "Load case", "Coordinate definition", "Origin", "Start point [m]", "End point [m]", "Parent ID", "Id",
    ),
    "StructuralPointSupportDef": (
        "Name", "Point support", "Direction", "Translation value [mm]", "Rotation value [mrad]", "Load case", "Id",
    ),
}  # fmt: skip
SAF_RESULTS = "ResultInternalForce1D"
SAF_RESULT_COLUMNS = (
    "Result on", "Member", "Member Rib", "Result for", "Load case", "Load combination", "Combination key", "Section at [m]", "Index",
    "N [kN]", "Vy [kN]", "Vz [kN]", "Mx [kNm]", "My [kNm]", "Mz [kNm]",
)  # fmt: skip
SAF_SIGNS = (
    "Internal forces act on the face of a cut that looks from the start to the end of the member: N in tension, Vy and Vz along the "
    "local axes, Mx, My and Mz about them by the right-hand rule are positive."
)
SAF_LOAD_TYPES = {"snow": "Snow", "wind": "Wind", "temperature": "Temperature"}  #: load types of variable actions
SAF_MATERIALS = {"steel": "Steel", "aluminium": "Aluminium", "timber": "Timber"}
I_SECTION = 1  #: form code of profiles that are symmetric about both axes, typically I sections
SAF_CATEGORIES = {"ULS": "ULS (Ultimate Limit State)", "SLS": "SLS (Serviceability Limit State)"}

SafRow = dict[str, Any]  # column -> value


def encode_saf(model: Model, style: FileStyle) -> bytes:
    """Return the workbook of a structure."""
    truss = model.truss
    if truss is None:
        raise FormatError("SAF holds structures; make one of the grid with scantruss structure")
    rows: dict[str, list[SafRow]] = {
        "StructuralMaterial": [_material(truss.material)],
        "StructuralCrossSection": [_section(section, truss.material.name) for section in truss.sections],
        "StructuralPointConnection": [
            {"Name": mark, "Coordinate X [m]": x, "Coordinate Y [m]": y, "Coordinate Z [m]": z}
            for mark, (x, y, z) in zip(model.node_marks, model.nodes.tolist(), strict=True)
        ],
        "StructuralCurveMember": list(_members(model, truss)),
        "StructuralPointSupport": list(_supports(truss)),
        "RelConnectsStructuralMember": list(_hinges(truss)),
        "StructuralLoadGroup": [
            {"Name": f"LG {action}", "Load group type": "Permanent", "Relation": "Standard"}
            if action == "permanent"
            else {"Name": f"LG {action}", "Load group type": "Variable", "Relation": "Standard",
                  "Load type": SAF_LOAD_TYPES.get(action, "Domestic")}
            for action in dict.fromkeys(case.action for case in truss.cases)
        ],
        "StructuralLoadCase": [_case(case) for case in truss.cases],
        "StructuralLoadCombination": [
            {"Name": each.name, "Category": SAF_CATEGORIES[each.state], "Type": "Linear"}
            | {
                f"{word} {number}": value
                for number, (case, factor) in enumerate(each.factors, 1)
                for word, value in (("Load factor", factor), ("Multiplier", 1.0), ("Load case name", case))
            }
            for each in truss.combinations
        ],
    }  # fmt: skip
    for name in list(SAF_SHEETS)[len(rows) :]:
        rows[name] = []
    for case in truss.cases:
        for name, row in _loads(truss, case):
            row["Name"] = f"{case.name} {row['Name']}"
            rows[name].append(row | {"Load case": case.name})
    widest = max((len(each.factors) for each in truss.combinations), default=0)
    more = [f"{word} {k + 1}" for k in range(widest) for word in ("Load factor", "Multiplier", "Load case name")]
    solved = () if model.solution is None else model.solution.cases
    project = [("Name", "ScanTruss"), *([("Description", SAF_SIGNS)] if solved else [])]
    sheets: dict[str, Any] = {"Project": project, "Model": _model(model)}
    for name, columns in SAF_SHEETS.items():
        if rows[name]:
            heads = (*columns, *more, "Id") if name == "StructuralLoadCombination" else columns
            for row in rows[name]:
                row["Id"] = str(model.guid(name, row["Name"]))
            sheets[name] = [heads, *(map(row.get, heads) for row in rows[name])]
    if solved:
        sheets[SAF_RESULTS] = [SAF_RESULT_COLUMNS, *_forces(truss, solved)]
    return encode_workbook(sheets)


def _model(model: Model) -> list[tuple[str, str]]:
    """Return the sheet of the model, whose rows are what columns are elsewhere."""
    return [
        ("Discipline", "Load-bearing structure"),
        ("Source type", "Structural analysis model"),
        ("Source application", MADE_BY),
        ("SAF Version", SAF_VERSION),
        ("Global coordinate system", "Z vertical"),
        ("LCS of cross-section", "ZYX"),
        ("System of units", "Metric"),
        ("National code", "EC-Standard-EN"),
        ("Id", str(model.guid("Model"))),
    ]


def _material(material: Material) -> SafRow:
    isotropic = material.kind != "timber"
    return {
        "Name": material.name,
        "Type": SAF_MATERIALS.get(material.kind, "Other"),
        "Quality": material.name,
        "Unit mass [kg/m3]": material.density,
        "E modulus [MPa]": material.young / 1e6,
        "G modulus [MPa]": material.shear / 1e6,
        "Poisson Coefficient": material.young / (2 * material.shear) - 1 if isotropic else None,
        "Thermal expansion [1/K]": material.alpha,
        "Design properties": f"1|{material.yield_strength / 1e6:.10g}; 2|{material.ultimate / 1e6:.10g}" if isotropic
        else f"17|{material.yield_strength / 1e6:.10g}",
    }  # fmt: skip


def _section(section: Section, material: str) -> SafRow:
    """Return a section by its shape and dimensions, height along z first; a rolled one by its name."""
    width, depth, wall = (1e3 * value for value in (section.width, section.depth, section.thickness))
    known: SafRow = {"Cross-section type": "Manufactured", "Profile": section.name, "Form code": I_SECTION}
    if section.shape != "I":
        shape, parameters = {
            "CHS": ("Pipe", (width, wall)),
            "SHS": ("Tube", (depth, width, wall, 1.5 * wall, wall)),
            "R": ("Rectangle", (depth, width)),
        }[section.shape]
        words = "; ".join(f"{value:.10g}" for value in parameters)
        known = {"Cross-section type": "Parametric", "Shape": shape, "Parameters [mm]": words}
    return {
        "Name": section.name,
        "Material": material,
        **known,
        "A [m2]": section.area,
        "Iy [m4]": section.inertia_y,
        "Iz [m4]": section.inertia_z,
        "It [m4]": section.torsion,
        "Wply [m3]": section.plastic_y,
        "Wplz [m3]": section.plastic_z,
    }


def _members(model: Model, truss: Truss) -> Iterator[SafRow]:
    behaviour = "Axial force only" if truss.pinned else "Standard"
    analysis = {name: 0.0 for name in SAF_SHEETS["StructuralCurveMember"] if name.startswith("Analysis ")}
    names, marks = [section.name for section in truss.sections], truss.node_marks
    table = zip(
        truss.member_marks, truss.members.tolist(), truss.lengths.tolist(), truss.axes[:, 2].tolist(),
        truss.section_of.tolist(), model.group_of.tolist(), strict=True,
    )  # fmt: skip
    for mark, (start, end), length, (x, y, z), section, group in table:
        yield {
            "Name": mark,
            "Type": "General",
            "Cross section": names[section],
            "Nodes": f"{marks[start]}; {marks[end]}",
            "Segments": "Line",
            "Length [m]": length,
            "Geometrical shape": "Line",
            "LCS": "z by vector",
            "LCS Rotation [deg]": 0.0,
            "Coordinate X [m]": x,
            "Coordinate Y [m]": y,
            "Coordinate Z [m]": z,
            "System line": "Centre",
            **analysis,
            "Layer": model.groups[group],
            "Behaviour in analysis": behaviour,
        }


def _stiffness(values: list[float]) -> SafRow:
    """Return how translations and turns are held: free, rigid, or flexible with a stiffness [N/m, Nm/rad]."""
    row: SafRow = {}
    for way, column, value in zip(WAYS, STIFFNESSES, values, strict=True):
        row[way] = "Rigid" if math.isinf(value) else "Flexible" if value else "Free"
        if row[way] == "Flexible":
            row[column] = value / 1e6
    return row


def _supports(truss: Truss) -> Iterator[SafRow]:
    kinds = {(math.inf,) * 6: "Fixed", (math.inf,) * 3 + (0.0,) * 3: "Hinged"}
    for node in np.flatnonzero(truss.supports.any(axis=1)).tolist():
        values = truss.supports[node].tolist()
        kind = kinds.get(tuple(values), "Custom")
        mark = truss.node_marks[node]
        yield {
            "Name": f"S {mark}",
            "Type": kind,
            "Boundary condition": "In node",
            "Node": mark,
            **_stiffness(values),
        }


def _hinges(truss: Truss) -> Iterator[SafRow]:
    if truss.pinned:  # said by the behaviour of the members
        return
    for member in np.flatnonzero(np.isfinite(truss.end_stiffness).any(axis=(1, 2))).tolist():
        mark, (start, end) = truss.member_marks[member], truss.end_stiffness[member].tolist()
        ends = [("Both", start)] if start == end else [("Begin", start), ("End", end)]
        for position, springs in ends:
            if not all(map(math.isinf, springs)):
                row = {"Name": f"H {mark} {position}", "Member": mark, "Position": position}
                yield row | _stiffness([math.inf] * 4 + springs)


def _is_weight(case: LoadCase) -> bool:
    """Whether a case is the weight of the members alone, which programs generate themselves."""
    loads = (case.nodal, case.line, case.temperature, case.strain, case.settlement)
    return case.self_weight == 1.0 and all(load is None for load in loads)


def _case(case: LoadCase) -> SafRow:
    row: SafRow = {"Name": case.name, "Load group": f"LG {case.action}"}
    if case.self_weight and not _is_weight(case):
        row["Description"] = "Self weight load impulses"
    if case.action == "permanent":
        return row | {"Action type": "Permanent", "Load type": "Self weight" if _is_weight(case) else "Standard"}
    return row | {
        "Action type": "Variable",
        "Load type": SAF_LOAD_TYPES.get(case.action, "Standard"),
        "Duration": "Short",
    }


def _loads(truss: Truss, case: LoadCase) -> Iterator[tuple[str, SafRow]]:
    """Yield the sheet and the row of each load of a case."""
    if case.nodal is not None:
        in_node = {"Type": "Standard", "Force action": "In node", "Coordinate system": "Global"}
        for node in np.flatnonzero(case.nodal[:, :3].any(axis=1)).tolist():
            mark = truss.node_marks[node]
            load = _directed(case.nodal[node, :3], "Value [kN]", "Vector (X;Y;Z) [kN]")
            yield "StructuralPointAction", {"Name": mark, **in_node, "Reference node": mark, **load}
        for node, axis in np.argwhere(case.nodal[:, 3:]).tolist():
            mark, way = truss.node_marks[node], "xyz"[axis]
            turning = {"Direction": f"M{way}", "Value [kNm]": float(case.nodal[node, 3 + axis]) / 1e3}
            yield "StructuralPointMoment", {"Name": f"{mark} M{way}", **in_node, "Reference node": mark, **turning}
    on_beam = {
        "Force action": "On beam", "Coordinate definition": "Relative", "Origin": "From start", "Start point [m]": 0.0,
        "End point [m]": 1.0,
    }  # fmt: skip
    uniform = on_beam | {
        "Type": "Standard", "Distribution": "Uniform", "Coordinate system": "Global", "Location": "Length", "Extent": "Full",
        "Eccentricity ey [mm]": 0.0, "Eccentricity ez [mm]": 0.0,
    }  # fmt: skip
    line = line_loads(truss, case, weight=not _is_weight(case))
    for member in np.flatnonzero(line.any(axis=1)).tolist():
        mark = truss.member_marks[member]
        load = _directed(line[member], "Value 1 [kN/m]", "Vector 1(X;Y;Z) [kN/m]")
        yield "StructuralCurveAction", {"Name": mark, **uniform, "Member": mark, **load}
    for member, change in enumerate(temperatures(truss, case, "SAF").tolist()):
        if change:
            mark = truss.member_marks[member]
            warmth = {"Variation": "Constant", "deltaT [°C]": change, "Member": mark}
            yield "StructuralCurveActionThermal", {"Name": f"{mark} T", **on_beam, **warmth}
    if case.settlement is not None:
        for node, axis in np.argwhere(np.nan_to_num(case.settlement)).tolist():
            mark = truss.node_marks[node]
            moved = {"Direction": "XYZ"[axis], "Translation value [mm]": float(case.settlement[node, axis]) * 1e3}
            yield "StructuralPointSupportDef", {"Name": f"{mark} {'XYZ'[axis]}", "Point support": f"S {mark}", **moved}


def _forces(truss: Truss, cases: tuple[CaseResult, ...]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of the forces in the members, of as many load cases as a sheet holds."""
    places = np.multiply.outer(truss.lengths, [0.0, 0.5, 1.0]).tolist()
    for case in cases[: (ROWS_OF_SHEET - 1) // (len(STATIONS_WRITTEN) * len(places))]:
        forces = (case.along[:, STATIONS_WRITTEN] / 1e3).tolist()
        for mark, places_of_member, values in zip(truss.member_marks, places, forces, strict=True):
            for index, (place, of_section) in enumerate(zip(places_of_member, values, strict=True), 1):
                yield ("On beam", mark, None, "Load case", case.name, None, None, place, index, *of_section)


def _directed(force: np.ndarray, value: str, vector: str) -> SafRow:
    """Return a force as a number along an axis, or as a vector [kN]."""
    force = force / 1e3
    axes = np.flatnonzero(force)
    if len(axes) == 1:
        return {"Direction": "XYZ"[axes[0]], value: float(force[axes[0]])}
    return {"Direction": "Vector", vector: f"({';'.join(map(repr, force.tolist()))})"}
