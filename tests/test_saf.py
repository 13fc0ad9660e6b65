"""SAF read back by a reader written from its guide, and solved again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
from test_convert import UTM, roof

import scantruss as st
from scantruss.structure.catalogue import find_material, find_section
from scantruss.structure.truss import GRAVITY, LoadCase

#: sheet -> column -> the words that the guide allows there
ENUMERATIONS = {
    "StructuralMaterial": {"Type": "Concrete|Steel|Timber|Aluminium|Masonry|Other"},
    "StructuralCrossSection": {
        "Cross-section type": "Parametric|Manufactured|Compound|General",
        "Shape": "Circle|Rectangle|Pipe|Tube|Box|I Section",
    },
    "StructuralCurveMember": {
        "Segments": "Line|Circular Arc|Bezier|Parabolic arc|Spline",
        "Geometrical shape": "Line|Circular Arc|Parabolic Arc|Bezier|Spline|Polyline",
        "LCS": "y by vector|z by vector|y by point|z by point",
        "System line": "Centre|Top|Bottom|Left|Right|Top left|Top right|Bottom left|Bottom right",
        "Behaviour in analysis": "Standard|Axial force only|Compression only|Tension only",
    },
    "StructuralPointSupport": {"Type": "Fixed|Hinged|Sliding|Custom", "Boundary condition": "In node|On beam"}
    | dict.fromkeys("ux uy uz fix fiy fiz".split(), "Rigid|Free|Flexible"),
    "RelConnectsStructuralMember": {"Position": "Begin|End|Both"}
    | dict.fromkeys("ux uy uz fix fiy fiz".split(), "Rigid|Free|Flexible"),
    "StructuralLoadGroup": {
        "Load group type": "Permanent|Variable|Accidental|Seismic|Moving|Tensioning|Fire",
        "Relation": "Exclusive|Standard|Together",
    },
    "StructuralLoadCase": {
        "Action type": "Permanent|Variable|Accidental",
        "Load type": "Self weight|Others|Prestress|Dynamic|Static|Temperature|Wind|Snow|Maintenance|Fire|Moving|Seismic|Standard",
        "Duration": "Long|Medium|Short|Instantaneous",
    },
    "StructuralLoadCombination": {
        "Category": "ULS (Ultimate Limit State)|SLS (Serviceability Limit State)|ALS (Accidental Limit State)"
        "|According national standard|Not defined",
        "Type": "Envelope|Linear|Nonlinear",
    },
    "StructuralPointAction": {
        "Direction": "X|Y|Z|Vector",
        "Force action": "On beam|In node",
        "Coordinate system": "Global|Local",
    },
    "StructuralPointMoment": {
        "Direction": "Mx|My|Mz",
        "Force action": "On beam|In node",
        "Coordinate system": "Global|Local",
    },
    "StructuralCurveAction": {
        "Force action": "On beam|On edge|On subregion edge|On opening edge|On rib",
        "Distribution": "Uniform|Trapez",
        "Direction": "X|Y|Z|Vector",
        "Coordinate system": "Global|Local",
        "Location": "Length|Projection",
        "Coordinate definition": "Absolute|Relative",
        "Origin": "From start|From end",
        "Extent": "Full|Span",
    },
    "StructuralCurveActionThermal": {
        "Force action": "On beam|On rib",
        "Variation": "Constant|Linear",
        "Coordinate definition": "Absolute|Relative",
        "Origin": "From start|From end",
    },
    "StructuralPointSupportDef": {"Direction": "X|Y|Z|Rx|Ry|Rz"},
    "ResultInternalForce1D": {"Result on": "On beam|On rib", "Result for": "Load case|Load combination"},
}
#: sheet -> column and its word, where another column is required
CONDITIONS = {
    "StructuralCrossSection": [
        ("Cross-section type", "Manufactured", "Profile|Form code"),
        ("Cross-section type", "Parametric", "Shape|Parameters [mm]"),
    ],
    "StructuralPointSupport": [("Boundary condition", "In node", "Node")]
    + [(way, "Flexible", f"Stiffness {axis} [MN/m]") for way, axis in zip(("ux", "uy", "uz"), "XYZ", strict=True)]
    + [(f"fi{axis}", "Flexible", f"Stiffness Fi{axis} [MNm/rad]") for axis in "xyz"],
    "RelConnectsStructuralMember": [(f"fi{axis}", "Flexible", f"Stiffness Fi{axis} [MNm/rad]") for axis in "xyz"],
    "StructuralLoadGroup": [("Load group type", "Variable", "Load type")],
    "StructuralLoadCase": [("Action type", "Variable", "Duration")],
    "StructuralPointAction": [("Force action", "In node", "Reference node"), ("Direction", "Vector", "Vector (X;Y;Z) [kN]")]
    + [("Direction", axis, "Value [kN]") for axis in "XYZ"],
    "StructuralPointMoment": [("Force action", "In node", "Reference node")],
    "StructuralCurveAction": [("Force action", "On beam", "Member"), ("Direction", "Vector", "Vector 1(X;Y;Z) [kN/m]")]
    + [("Direction", axis, "Value 1 [kN/m]") for axis in "XYZ"],
    "StructuralCurveActionThermal": [("Force action", "On beam", "Member"), ("Variation", "Constant", "deltaT [°C]")],
    "StructuralPointSupportDef": [("Direction", axis, "Translation value [mm]") for axis in "XYZ"],
    "ResultInternalForce1D": [("Result on", "On beam", "Member"), ("Result for", "Load case", "Load case")],
}  # fmt: skip
#: sheet -> columns that an edition before 2.2.0 had
REMOVED = {"StructuralCurveMember": {"Begin node", "End node"}}
#: columns that the guide requires without a condition
REQUIRED = {
    "StructuralMaterial": "Name|Type|Quality",
    "StructuralCrossSection": "Name|Material|Cross-section type",
    "StructuralPointConnection": "Name|Coordinate X [m]|Coordinate Y [m]|Coordinate Z [m]",
    "StructuralCurveMember": "Name|Cross section|Nodes|Segments|LCS|LCS Rotation [deg]|Coordinate X [m]|Coordinate Y [m]"
    "|Coordinate Z [m]|System line|Analysis Y Eccentricity of Beg Node [mm]|Analysis Z Eccentricity of Beg Node [mm]"
    "|Analysis Y Eccentricity of End Node [mm]|Analysis Z Eccentricity of End Node [mm]|Behaviour in analysis",
    "StructuralPointSupport": "Name|Boundary condition|ux|uy|uz|fix|fiy|fiz",
    "RelConnectsStructuralMember": "Name|Member|Position|ux|uy|uz|fix|fiy|fiz",
    "StructuralLoadGroup": "Name|Load group type|Relation",
    "StructuralLoadCase": "Name|Action type|Load group|Load type",
    "StructuralLoadCombination": "Name|Category|Load factor 1|Multiplier 1|Load case name 1",
    "StructuralPointAction": "Name|Direction|Force action|Load case|Coordinate system",
    "StructuralPointMoment": "Name|Direction|Force action|Value [kNm]|Load case|Coordinate system",
    "StructuralCurveAction": "Name|Force action|Distribution|Direction|Load case|Coordinate system|Location|Coordinate definition"
    "|Origin|Extent|Start point [m]|End point [m]|Eccentricity ey [mm]|Eccentricity ez [mm]",
    "StructuralCurveActionThermal": "Name|Force action|Variation|Load case|Coordinate definition|Origin|Start point [m]"
    "|End point [m]",
    "StructuralPointSupportDef": "Name|Point support|Direction|Load case",
    "ResultInternalForce1D": "Result on|Result for|Section at [m]|Index|N [kN]|Vy [kN]|Vz [kN]|Mx [kNm]|My [kNm]|Mz [kNm]",
}
NAMELESS = {"ResultInternalForce1D"}  # sheets whose rows have neither name nor identifier
MODEL = {
    "Global coordinate system": "Z vertical",
    "System of units": "Metric",
    "National code": "EC-Standard-EN",
    "LCS of cross-section": "ZYX",
}
Sheets = dict[str, list[dict[str, Any]]]


def read_saf(path: Path) -> Sheets:
    """Read a workbook as the guide says, and hold it to that: names, required columns, words, numbers as numbers."""
    book = openpyxl.load_workbook(path, read_only=True)
    sheets: Sheets = {}
    for sheet in book:
        assert len(sheet.title) <= 31
        rows = list(sheet.iter_rows(values_only=True))
        if sheet.title in ("Project", "Model"):
            sheets[sheet.title] = [{str(row[0]): row[1] for row in rows}]
            continue
        heads = [str(head) for head in rows[0]]
        assert len(set(heads)) == len(heads)
        found = [dict(zip(heads, row, strict=True)) for row in rows[1:]]
        if sheet.title not in NAMELESS:
            assert len({row["Name"] for row in found}) == len({row["Id"] for row in found}) == len(found)
        assert not REMOVED.get(sheet.title, set()) & set(heads)
        for row in found:
            for column, words in ENUMERATIONS.get(sheet.title, {}).items():
                assert row[column] is None or row[column] in words.split("|"), (sheet.title, column, row[column])
            assert all(row[column] is not None for column in REQUIRED[sheet.title].split("|")), (sheet.title, row)
            for column, word, needed in CONDITIONS.get(sheet.title, []):
                assert row[column] != word or all(row[each] is not None for each in needed.split("|")), (needed, row)
            for column, value in row.items():
                if any(
                    f"[{unit}]" in column
                    for unit in ("m", "kN", "MPa", "kNm", "mm", "°C", "MN/m", "MNm/rad", "m2", "m4", "deg")
                ):
                    text = column.startswith(("Vector", "Parameters"))
                    assert value is None or isinstance(value, str if text else int | float), (column, value)
        sheets[sheet.title] = found
    assert MODEL.items() <= sheets["Model"][0].items() and sheets["Model"][0]["SAF Version"] == "2.2.0"
    return sheets


def force(row: dict[str, Any], value: str, vector: str) -> np.ndarray:
    if row["Direction"] == "Vector":
        return 1e3 * np.array([float(part) for part in row[vector].strip("()").split(";")])
    return 1e3 * row[value] * np.eye(3)["XYZ".index(row["Direction"])]


def held(row: dict[str, Any]) -> list[float]:
    ways = {"Rigid": np.inf, "Free": 0.0}
    names = [f"Stiffness {axis} [MN/m]" for axis in "XYZ"] + [f"Stiffness Fi{axis} [MNm/rad]" for axis in "xyz"]
    both = zip("ux uy uz fix fiy fiz".split(), names, strict=True)
    return [1e6 * row[name] if row[way] == "Flexible" else ways[row[way]] for way, name in both]


def truss_of_saf(sheets: Sheets) -> st.Truss:
    """Return the structure that a program which knows the guide alone makes of the sheets."""
    points = sheets["StructuralPointConnection"]
    number = {row["Name"]: k for k, row in enumerate(points)}
    nodes = np.array([[row[f"Coordinate {axis} [m]"] for axis in "XYZ"] for row in points])
    rows = sheets["StructuralCurveMember"]
    members = np.array([[number[name] for name in row["Nodes"].split("; ")] for row in rows])
    member = {row["Name"]: k for k, row in enumerate(rows)}
    sections = sheets["StructuralCrossSection"]
    names = [row["Name"] for row in sections]
    supports = np.zeros((len(nodes), 6))
    place = {}
    for row in sheets["StructuralPointSupport"]:
        supports[number[row["Node"]]] = held(row)
        place[row["Name"]] = number[row["Node"]]
    springs = np.full((len(members), 2, 2), np.inf)
    for row in sheets.get("RelConnectsStructuralMember", []):
        for end in {"Begin": [0], "End": [1], "Both": [0, 1]}[row["Position"]]:
            springs[member[row["Member"]], end] = held(row)[4:]
    loads: dict[str, dict[str, Any]] = {}
    weight = {row["Name"]: float(row["Load type"] == "Self weight") for row in sheets["StructuralLoadCase"]}
    for name in weight:
        loads[name] = {
            "nodal": np.zeros((len(nodes), 6)),
            "line": np.zeros((len(members), 3)),
            "temperature": np.zeros(len(members)),
            "settlement": np.full((len(nodes), 3), np.nan),
        }
    for row in sheets.get("StructuralPointAction", []):
        loads[row["Load case"]]["nodal"][number[row["Reference node"]], :3] += force(
            row, "Value [kN]", "Vector (X;Y;Z) [kN]"
        )
    for row in sheets.get("StructuralPointMoment", []):
        axis = ["Mx", "My", "Mz"].index(row["Direction"])
        loads[row["Load case"]]["nodal"][number[row["Reference node"]], 3 + axis] += 1e3 * row["Value [kNm]"]
    for row in sheets.get("StructuralCurveAction", []):
        loads[row["Load case"]]["line"][member[row["Member"]]] += force(row, "Value 1 [kN/m]", "Vector 1(X;Y;Z) [kN/m]")
    for row in sheets.get("StructuralCurveActionThermal", []):
        loads[row["Load case"]]["temperature"][member[row["Member"]]] += row["deltaT [°C]"]
    for row in sheets.get("StructuralPointSupportDef", []):
        where = place[row["Point support"]]
        loads[row["Load case"]]["settlement"][where, "XYZ".index(row["Direction"])] = (
            1e-3 * row["Translation value [mm]"]
        )
    groups = {row["Name"]: row for row in sheets["StructuralLoadGroup"]}
    assert all(row["Load group"] in groups for row in sheets["StructuralLoadCase"])
    assert {row["Material"] for row in sections} == {row["Name"] for row in sheets["StructuralMaterial"]}
    return st.Truss(
        nodes=nodes - nodes[0],
        members=members,
        triangles=np.zeros((0, 3), np.int64),
        node_normals=np.zeros((len(nodes), 3)),
        member_normals=np.array([[row[f"Coordinate {axis} [m]"] for axis in "XYZ"] for row in rows]),
        sections=tuple(find_section(name) for name in names),
        section_of=np.array([names.index(row["Cross section"]) for row in rows]),
        material=find_material(sheets["StructuralMaterial"][0]["Name"]),
        supports=supports,
        end_stiffness=springs,
        pinned=rows[0]["Behaviour in analysis"] == "Axial force only",
        cases=tuple(LoadCase(name, self_weight=weight[name], **loads[name]) for name in weight),
        node_marks=tuple(number),
        member_marks=tuple(member),
    )


@pytest.mark.parametrize(
    "others",
    [
        {},
        {"joints": "pinned", "support_type": "springs:5MN/m"},
        {"joints": 2e5, "support_type": "springs:5MN/m", "section": "SHS100x5", "material": "6082-T6"},
        {"section": "R100x200", "material": "GL24h", "node_allowance": 0.15, "support_type": "fixed"},
    ],
)
def test_a_program_that_knows_the_guide_alone_finds_the_same_structure(others: dict[str, Any], tmp_path: Path) -> None:
    truss = roof(**others)
    if not others:
        rng = np.random.default_rng(1)
        count, held_nodes = len(truss.nodes), np.flatnonzero(truss.supports.any(axis=1))
        settled = np.full((count, 3), np.nan)
        settled[held_nodes[2], 2] = -0.005
        springs = truss.end_stiffness.copy()
        springs[3, 0], springs[5] = [0.0, 3e5], [1e5, np.inf]
        odd = LoadCase("Träger =1 中", nodal=rng.normal(size=(count, 6)), line=rng.normal(size=(len(truss.members), 3)),
                       strain=rng.normal(size=len(truss.members)) * 1e-4, settlement=settled)  # fmt: skip
        truss = truss.replace(cases=(*truss.cases, odd), end_stiffness=springs)
    path = tmp_path / "Dach 屋顶.saf.xlsx"
    st.write(truss, path)
    sheets = read_saf(path)
    back = truss_of_saf(sheets)
    assert np.abs(back.nodes - (truss.nodes - truss.nodes[0])).max() < 1e-6
    points = sheets["StructuralPointConnection"]
    there = np.array([[row[f"Coordinate {axis} [m]"] for axis in "XYZ"] for row in points])
    assert np.abs(there - truss.nodes - UTM).max() < 1e-6
    assert (back.node_marks, back.member_marks) == (truss.node_marks, truss.member_marks)
    np.testing.assert_allclose(back.supports, truss.supports)
    np.testing.assert_allclose(back.end_stiffness, truss.end_stiffness if not truss.pinned else np.inf)
    first, second = st.solve(truss), st.solve(back)
    for one, other in zip(first.cases, second.cases, strict=True):
        assert one.name == other.name
        scale = np.abs(one.displacements).max()
        np.testing.assert_allclose(other.displacements, one.displacements, atol=1e-6 * scale)
    row = sheets["StructuralCrossSection"][0]
    assert row["A [m2]"] == pytest.approx(truss.sections[0].area, rel=1e-14)
    assert len(sheets["StructuralLoadCombination"]) == len(truss.combinations)
    for row, each in zip(sheets["StructuralLoadCombination"], truss.combinations, strict=True):
        parts = [(row[f"Load case name {k}"], row[f"Load factor {k}"]) for k in range(1, len(each.factors) + 1)]
        assert row["Name"] == each.name and tuple(parts) == each.factors


@pytest.mark.parametrize("joints", ["rigid", "pinned"])
def test_forces_in_the_sheet_hold_every_node_by_the_signs_that_the_file_names(joints: str, tmp_path: Path) -> None:
    truss = roof(joints=joints, loads="self,snow:1.5kN/m2")
    solution = st.solve(truss)
    st.write(solution, tmp_path / "a.saf.xlsx")
    sheets = read_saf(tmp_path / "a.saf.xlsx")
    assert (
        "right-hand rule" in sheets["Project"][0]["Description"]
        and "N in tension" in sheets["Project"][0]["Description"]
    )
    back = truss_of_saf(sheets)  # nodes, members, axes and loads as a program that knows the guide alone has them
    number = {mark: k for k, mark in enumerate(back.node_marks)}
    ends = {row["Name"]: [number[name] for name in row["Nodes"].split("; ")] for row in sheets["StructuralCurveMember"]}
    axes = dict(zip(back.member_marks, back.axes, strict=True))
    length = dict(zip(back.member_marks, back.lengths, strict=True))
    rows = sheets["ResultInternalForce1D"]
    assert len(rows) == 3 * len(ends) * len(truss.cases)
    supported = {row["Node"] for row in sheets["StructuralPointSupport"]}
    for case in back.cases:
        left = np.zeros((len(number), 6))  # what loads, and members by their sheet, leave at each node
        left += case.nodal if case.nodal is not None else 0.0
        for row in (row for row in rows if row["Load case"] == case.name):
            mark = row["Member"]
            assert row["Section at [m]"] == pytest.approx((row["Index"] - 1) / 2 * length[mark])
            if row["Index"] == 2:
                continue
            force = 1e3 * np.array([row["N [kN]"], row["Vy [kN]"], row["Vz [kN]"]]) @ axes[mark]
            moment = 1e3 * np.array([row["Mx [kNm]"], row["My [kNm]"], row["Mz [kNm]"]]) @ axes[mark]
            # the face that looks to the end belongs to the start: what it carries there comes from the node at the end,
            # and the node at the start is pulled by what its own first face carries
            node, sign = (ends[mark][0], 1.0) if row["Index"] == 1 else (ends[mark][1], -1.0)
            left[node, :3] += sign * force
            left[node, 3:] += sign * moment
        free = [k for mark, k in number.items() if mark not in supported]
        scale = 1e3 * max(abs(row["N [kN]"]) for row in rows if row["Load case"] == case.name)
        shown = slice(0, 3 if joints == "pinned" else 6)
        assert np.abs(left[free][:, shown]).max() < 1e-7 * scale
    assert any(abs(row["My [kNm]"]) > 1e-6 for row in rows)


def test_cases_that_no_longer_fit_a_sheet_are_left_out_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from scantruss.export import saf

    solution = st.solve(roof())
    members = len(solution.truss.members)
    monkeypatch.setattr(saf, "ROWS_OF_SHEET", 3 * members * 2)  # the header takes a row: one case fits
    st.write(solution, tmp_path / "a.saf.xlsx")
    rows = read_saf(tmp_path / "a.saf.xlsx")["ResultInternalForce1D"]
    assert len(solution.cases) > 1 and {row["Load case"] for row in rows} == {solution.cases[0].name}


@pytest.mark.parametrize("section", ["CHS114.3x5", "IPE200", "R100x200"])
def test_each_kind_of_section_has_the_columns_that_the_guide_requires(section: str, tmp_path: Path) -> None:
    material = "GL24h" if section.startswith("R") else "S355"
    st.write(roof(section=section, material=material), tmp_path / "a.saf.xlsx")
    (row,) = read_saf(tmp_path / "a.saf.xlsx")["StructuralCrossSection"]
    assert row["Form code"] == (1 if section.startswith("IPE") else None)


def test_weight_alone_is_left_to_the_program_that_reads(tmp_path: Path) -> None:
    truss = roof(loads="self", node_allowance=0.0)
    st.write(truss, tmp_path / "a.saf.xlsx")
    sheets = read_saf(tmp_path / "a.saf.xlsx")
    assert sheets["StructuralLoadCase"][0]["Load type"] == "Self weight" and "StructuralCurveAction" not in sheets
    heavy = roof(loads="self", node_allowance=0.15)
    st.write(heavy, tmp_path / "a.saf.xlsx")
    sheets = read_saf(tmp_path / "a.saf.xlsx")
    assert sheets["StructuralLoadCase"][0]["Load type"] == "Standard"
    total = sum(
        row["Value 1 [kN/m]"] * length
        for row, length in zip(sheets["StructuralCurveAction"], heavy.lengths, strict=True)
    )
    assert total == pytest.approx(-1.15e-3 * heavy.mass * GRAVITY)


def test_a_grid_has_no_sections_and_is_refused(tmp_path: Path) -> None:
    from small_grids import dome

    with pytest.raises(st.FormatError, match="SAF holds structures"):
        st.write(dome(4), tmp_path / "a.saf.xlsx")
    with pytest.raises(st.FormatError, match="the nearest is"):
        st.write(roof(), tmp_path / "a.saf.xls")
