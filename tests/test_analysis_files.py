"""Files for SAP2000, OpenSees and Abaqus: rebuilt by a reader of their text or run by a solver that is not ours, and compared."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from typing import Any

import meshio
import numpy as np
import pytest
from small_grids import dome
from test_convert import UTM, roof

import scantruss as st
from scantruss.export.style import FileStyle
from scantruss.structure.catalogue import Material, Section
from scantruss.structure.truss import GRAVITY, LoadCase

KINDS: list[dict[str, Any]] = [
    {},
    {"joints": "pinned", "support_type": "springs:5MN/m"},
    {"joints": 2e5, "support_type": "springs:5MN/m", "section": "IPE200", "material": "6082-T6"},
    {"section": "R100x200", "material": "GL24h", "node_allowance": 0.15, "support_type": "fixed"},
]


def example(others: dict[str, Any]) -> st.Truss:
    """A roof; the first with every kind of load and joint that a structure can have."""
    truss = roof(4, **others)
    if others:
        return truss
    rng = np.random.default_rng(1)
    count, held = len(truss.nodes), np.flatnonzero(truss.supports.any(axis=1))
    settled = np.full((count, 3), np.nan)
    settled[held[2], 2] = -0.005
    springs = truss.end_stiffness.copy()
    springs[3, 0], springs[5] = [0.0, 3e5], [1e5, np.inf]
    supports = truss.supports.copy()
    supports[held[1], :3] = [3e6, np.inf, 0.0]
    odd = LoadCase("Träger =1 中", nodal=1e3 * rng.normal(size=(count, 6)), line=1e3 * rng.normal(size=(len(truss.members), 3)),
                   strain=rng.normal(size=len(truss.members)) * 1e-4, settlement=settled)  # fmt: skip
    return truss.replace(cases=(*truss.cases, odd), end_stiffness=springs, supports=supports, section_of=np.arange(
        len(truss.members)) % 2, sections=(truss.sections[0], st.Truss.from_grid(dome(3, unit="m"), supports="boundary",
        section="IPE200").sections[0]))  # fmt: skip


def read_s2k(path: Path) -> dict[str, list[dict[str, str]]]:
    """Return the tables of a text file of SAP2000, each a list of rows."""
    tables: dict[str, list[dict[str, str]]] = {}
    text = path.read_bytes().decode("utf-8")
    assert text.endswith("\r\nEND TABLE DATA\r\n") and text.count("\n") == text.count("\r\n")
    for line in text.splitlines():
        if found := re.fullmatch(r'TABLE:  "(.*)"', line):
            rows = tables.setdefault(found[1], [])
            assert not rows
        elif line.startswith("   "):
            fields = re.findall(r'   (\w+)=("[^"]*"|\S+)', line)
            assert "".join(f"   {name}={value}" for name, value in fields) == line
            rows.append({name: value.strip('"') for name, value in fields})
    return tables


def axes_of_sap(start: np.ndarray, end: np.ndarray, angle: float) -> np.ndarray:
    """Return the local axes 1, 2, 3 as its manual says: 2 in the vertical plane, upwards, or along X; then turned about 1."""
    one = (end - start) / np.linalg.norm(end - start)
    up = np.array([1.0, 0, 0]) if np.linalg.norm(np.cross(one, [0, 0, 1])) < 1e-3 else np.array([0, 0, 1.0])
    three = np.cross(one, up)
    three /= np.linalg.norm(three)
    two = np.cross(three, one)
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.stack([one, cos * two + sin * three, cos * three - sin * two])


def _section(row: dict[str, str]) -> Section:
    area, major, minor, torsion = (float(row[name]) for name in ("Area", "I33", "I22", "TorsConst"))
    return Section(row["SectionName"], "CHS", 1, 1, 0.1, "", area, major, minor, torsion, 1, 1, 1, 1)


def truss_of_s2k(tables: dict[str, list[dict[str, str]]]) -> st.Truss:
    """Return the structure that a program which knows the tables alone makes of them."""
    assert tables["PROGRAM CONTROL"][0]["CurrUnits"] == "KN, m, C"
    joints = {row["Joint"]: k for k, row in enumerate(tables["JOINT COORDINATES"])}
    nodes = np.array([[float(row[name]) for name in ("XorR", "Y", "Z")] for row in tables["JOINT COORDINATES"]])
    frames = {row["Frame"]: k for k, row in enumerate(tables["CONNECTIVITY - FRAME"])}
    members = np.array([[joints[row[end]] for end in ("JointI", "JointJ")] for row in tables["CONNECTIVITY - FRAME"]])
    steel = tables["MATERIAL PROPERTIES 02 - BASIC MECHANICAL PROPERTIES"][0]
    material = Material("A", "other", 1e3 * float(steel["E1"]), 1e3 * float(steel["G12"]), 1e3 * float(steel["UnitMass"]),
                        float(steel["A1"]), 1.0, 1.0)  # fmt: skip
    assert float(steel["UnitWeight"]) == pytest.approx(float(steel["UnitMass"]) * GRAVITY)
    names = [row["SectionName"] for row in tables["FRAME SECTION PROPERTIES 01 - GENERAL"]]
    sections = tuple(_section(row) for row in tables["FRAME SECTION PROPERTIES 01 - GENERAL"])
    of = {row["Frame"]: names.index(row["AnalSect"]) for row in tables["FRAME SECTION ASSIGNMENTS"]}
    normals = np.zeros((len(members), 3))
    for row in tables["FRAME LOCAL AXES ASSIGNMENTS 1 - TYPICAL"]:
        k = frames[row["Frame"]]
        normals[k] = axes_of_sap(nodes[members[k, 0]], nodes[members[k, 1]], float(row["Angle"]))[1]
    ways = ("U1", "U2", "U3", "R1", "R2", "R3")
    supports = np.zeros((len(nodes), 6))
    for row in tables.get("JOINT SPRING ASSIGNMENTS 1 - UNCOUPLED", []):
        supports[joints[row["Joint"]]] = [1e3 * float(row.get(way, 0)) for way in ways]
    for row in tables.get("JOINT RESTRAINT ASSIGNMENTS", []):
        supports[joints[row["Joint"]], [row.get(way) == "Yes" for way in ways]] = np.inf
    springs = np.full((len(members), 2, 2), np.inf)
    for name, held in (("1 - GENERAL", False), ("2 - PARTIAL FIXITY", True)):
        for row in tables.get(f"FRAME RELEASE ASSIGNMENTS {name}", []):
            for axis, word in ((0, "M3"), (1, "M2")):
                for end, letter in enumerate("IJ"):
                    if held and f"{word}{letter}" in row:
                        assert springs[frames[row["Frame"]], end, axis] == 0
                        springs[frames[row["Frame"]], end, axis] = 1e3 * float(row[f"{word}{letter}"])
                    elif row.get(f"{word}{letter}") == "Yes":
                        springs[frames[row["Frame"]], end, axis] = 0.0
    pinned = tables["ACTIVE DEGREES OF FREEDOM"][0]["RX"] == "No"
    if pinned:
        assert not springs.any()
    size, count = len(nodes), len(members)
    loads: dict[str, dict[str, Any]] = {
        row["LoadPat"]: {
            "self_weight": float(row["SelfWtMult"]),
            "nodal": np.zeros((size, 6)),
            "line": np.zeros((count, 3)),
            "temperature": np.zeros(count),
            "settlement": np.full((size, 3), np.nan),
        }
        for row in tables["LOAD PATTERN DEFINITIONS"]
    }
    for row in tables.get("JOINT LOADS - FORCE", []):
        force = [float(row[word]) for word in ("F1", "F2", "F3", "M1", "M2", "M3")]
        loads[row["LoadPat"]]["nodal"][joints[row["Joint"]]] += 1e3 * np.array(force)
    for row in tables.get("FRAME LOADS - DISTRIBUTED", []):
        assert row["FOverLA"] == row["FOverLB"] and (row["CoordSys"], row["RelDistB"]) == ("GLOBAL", "1.0")
        loads[row["LoadPat"]]["line"][frames[row["Frame"]], "XYZ".index(row["Dir"])] += 1e3 * float(row["FOverLA"])
    for row in tables.get("FRAME LOADS - TEMPERATURE", []):
        loads[row["LoadPat"]]["temperature"][frames[row["Frame"]]] += float(row["Temp"])
    for row in tables.get("JOINT LOADS - GROUND DISPLACEMENT", []):
        where = joints[row["Joint"]]
        moved = np.array([float(row[way]) for way in ways[:3]])
        loads[row["LoadPat"]]["settlement"][where] = np.where(np.isinf(supports[where, :3]), moved, np.nan)
    cases = {name: LoadCase(name, **values) for name, values in loads.items()}
    assert [row["LoadName"] for row in tables["CASE - STATIC 1 - LOAD ASSIGNMENTS"]] == list(cases)
    return st.Truss(
        nodes=nodes - nodes[0], members=members, triangles=np.zeros((0, 3), np.int64), node_normals=np.zeros_like(nodes),
        member_normals=normals, sections=sections, section_of=np.array([of[name] for name in frames]), material=material,
        supports=supports, end_stiffness=np.full_like(springs, np.inf) if pinned else springs, pinned=pinned,
        cases=tuple(cases.values()), node_marks=tuple(joints), member_marks=tuple(frames),
    )  # fmt: skip


@pytest.mark.parametrize("others", KINDS)
def test_a_program_that_knows_the_tables_of_sap2000_finds_the_same_structure(
    others: dict[str, Any], tmp_path: Path
) -> None:
    truss = example(others)
    st.write(truss, tmp_path / "Dach 屋顶.s2k")
    tables = read_s2k(tmp_path / "Dach 屋顶.s2k")
    back = truss_of_s2k(tables)
    assert np.abs(back.nodes - (truss.nodes - truss.nodes[0])).max() < 1e-6
    x, y, z = (float(tables["JOINT COORDINATES"][0][name]) for name in ("XorR", "Y", "Z"))
    assert np.abs(np.array([x, y, z]) - truss.nodes[0] - UTM).max() < 1e-6
    assert (back.node_marks, back.member_marks) == (truss.node_marks, truss.member_marks)
    np.testing.assert_allclose(back.axes, truss.axes, atol=1e-7)
    np.testing.assert_allclose(
        back.supports[:, : 3 if truss.pinned else 6], truss.supports[:, : 3 if truss.pinned else 6]
    )
    if not truss.pinned:
        np.testing.assert_allclose(back.end_stiffness, truss.end_stiffness)
    for one, other in zip(st.solve(truss).cases, st.solve(back).cases, strict=True):
        assert one.name == other.name
        np.testing.assert_allclose(other.displacements, one.displacements, atol=1e-6 * np.abs(one.displacements).max())
    rows = tables["COMBINATION DEFINITIONS"]
    found = [(row["ComboName"], row["CaseName"], float(row["ScaleFactor"])) for row in rows]
    assert found == [(each.name, *factor) for each in truss.combinations for factor in each.factors]
    assert {row["ObjectLabel"] for row in tables["GROUPS 2 - ASSIGNMENTS"]} == set(truss.member_marks)


def test_upright_members_turn_from_x(tmp_path: Path) -> None:
    from small_trusses import make_truss

    truss = make_truss([(0, 0, 0), (0, 0, 3), (1, 2, 3)], [(0, 1), (1, 2)], {0: (np.inf,) * 6})
    truss = truss.replace(
        member_normals=np.array([[0.6, 0.8, 0], [0, 0, -1.0]]), cases=(LoadCase("a", self_weight=1.0),)
    )
    st.write(truss, tmp_path / "a.s2k")
    np.testing.assert_allclose(truss_of_s2k(read_s2k(tmp_path / "a.s2k")).axes, truss.axes, atol=1e-12)


@pytest.mark.skipif(find_spec("opensees") is None, reason="opensees, the BSD build of OpenSees, is not installed")
@pytest.mark.parametrize("suffix", [".tcl", ".py"])
@pytest.mark.parametrize("others", KINDS)
def test_opensees_finds_the_same_displacements(others: dict[str, Any], suffix: str, tmp_path: Path) -> None:
    truss = example(others)
    path = tmp_path / f"roof{suffix}"
    st.write(truss, path)
    command = [sys.executable, *(["-m", "opensees"] if suffix == ".tcl" else []), str(path)]
    said = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert said.returncode == 0, said.stderr
    found = np.array([line.split() for line in said.stdout.splitlines() if re.match(r"\d+ \d+ ", line)], float)
    found = found.reshape(len(truss.cases), len(truss.nodes), -1)
    np.testing.assert_array_equal(found[0, :, 1], np.arange(1, len(truss.nodes) + 1))
    for case, values in zip(st.solve(truss).cases, found, strict=True):
        moved = case.displacements[:, : values.shape[1] - 2]
        for part in (slice(0, 3), slice(3, 6)):
            if moved[:, part].size:
                np.testing.assert_allclose(
                    values[:, 2:][:, part], moved[:, part], atol=1e-3 * np.abs(moved[:, part]).max()
                )


def test_both_scripts_of_opensees_hold_the_same_commands(tmp_path: Path) -> None:
    truss = example({})
    st.write(truss, tmp_path / "a.tcl")
    st.write(truss, tmp_path / "a.py")
    text, script = ((tmp_path / name).read_text(encoding="utf-8") for name in ("a.tcl", "a.py"))
    tcl = re.findall(r"^ {4,8}(\w+ .*)$", text.split("proc solve")[0], re.MULTILINE)
    python = re.findall(r"^ {4}ops\.(\w+)\((.*)\)$", script.split("def solve")[0], re.MULTILINE)
    commands = [" ".join([name, *(part.strip().strip("'\"") for part in rest.split(","))]) for name, rest in python]
    assert [line.removesuffix(" {") for line in tcl] == commands
    compile(script, "a.py", "exec")
    axes = [np.array(line.split()[3:], float) for line in tcl if line.startswith("geomTransf")]
    np.testing.assert_array_equal(axes, truss.axes[:, 2])


def truss_of_inp(path: Path, material: Material) -> st.Truss:
    """Return the structure that a reader of the keywords finds; the names of sections and marks are not there."""
    blocks: list[tuple[str, dict[str, str], Any]] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("*") and not line.startswith("**"):
            name, *words = line[1:].split(", ")
            blocks.append((name, dict(option.partition("=")[::2] for option in words), []))
        elif not line.startswith("**"):
            blocks[-1][2].append(line.split(", "))
    named: dict[str, list[int]] = {}
    nodes = members = np.zeros((0, 3))
    sections: list[Section] = []
    pinned, loads, free, springs = False, dict[str, dict[str, Any]](), np.zeros((0, 2, 2)), dict[str, int]()
    for name, options, rows in blocks:
        numbers = [int(word) - 1 for row in rows for word in row] if name in ("ELSET", "NSET") else []
        if name == "NODE":
            nodes = np.array(rows, float)[:, 1:]
            supports = np.zeros((len(nodes), 6))
        elif name == "ELEMENT" and options["TYPE"] == "SPRING1":
            springs[options["ELSET"]] = int(rows[0][1]) - 1
        elif name == "ELEMENT":
            members, pinned = np.array(rows, int)[:, 1:] - 1, options["TYPE"] == "T3D2"
            normals, of = np.zeros((len(members), 3)), np.zeros(len(members), int)
            free = np.full((len(members), 2, 2), np.inf)
        elif name == "ELSET":
            named[options["ELSET"]] = numbers
        elif name == "BEAM GENERAL SECTION":
            (member,) = named[options["ELSET"]]
            area, one, _, two, torsion = map(float, rows[0])
            ends = nodes[members[member]]
            axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
            normals[member] = np.cross(axis, np.array(rows[1], float))  # its axis 2
            of[member] = len(sections)
            sections.append(Section(f"S{member}", "CHS", 1, 1, 0.1, "", area, one, two, torsion, 1, 1, 1, 1))
            assert [float(word) for word in rows[2]] == [material.young, material.shear]
        elif name == "SOLID SECTION":
            of[named[options["ELSET"]]] = len(sections)
            sections.append(Section(options["ELSET"], "CHS", 1, 1, 0.1, "", float(rows[0][0]), 1, 1, 1, 1, 1, 1, 1))
        elif name == "SPRING":
            supports[springs[options["ELSET"]], int(rows[0][0]) - 1] = float(rows[1][0])
        elif name == "RELEASE":
            for loose, end, about in rows:
                free[int(loose) - 1, int(end[1]) - 1, int(about[1]) - 1] = 0
        elif name == "STEP":
            last = loads[options["NAME"]] = {"nodal": np.zeros((len(nodes), 6)), "line": np.zeros((len(members), 3)),
                                             "settlement": np.full((len(nodes), 3), np.nan)}  # fmt: skip
            assert "PERTURBATION" not in options  # CalculiX would add the stress of the case before
        elif name == "BOUNDARY":
            for node, way, _, *value in rows:
                if value:
                    last["settlement"][int(node) - 1, int(way) - 1] = float(value[0])
                else:
                    supports[int(node) - 1, int(way) - 1] = np.inf
        elif name in ("CLOAD", "DLOAD"):
            for at, way, value in rows:
                key, column = ("nodal", int(way) - 1) if name == "CLOAD" else ("line", "XYZ".index(way[1]))
                last[key][int(at) - 1, column] += float(value)
    return st.Truss(
        nodes=nodes - nodes[0], members=members, triangles=np.zeros((0, 3), np.int64), node_normals=np.zeros_like(nodes),
        member_normals=normals, sections=tuple(sections), section_of=of, material=material, supports=supports,
        end_stiffness=free, pinned=pinned, cases=tuple(LoadCase(key.strip('"'), **values) for key, values in loads.items()),
        node_marks=tuple(f"N{k}" for k in range(len(nodes))), member_marks=tuple(f"M{k}" for k in range(len(members))),
    )  # fmt: skip


@pytest.mark.parametrize("others", [*KINDS[:2], {**KINDS[2], "joints": "rigid"}, KINDS[3]])
def test_a_reader_of_the_keywords_of_abaqus_finds_the_same_structure(others: dict[str, Any], tmp_path: Path) -> None:
    truss = example(others)
    if not others:
        truss = truss.replace(end_stiffness=np.where(np.isfinite(truss.end_stiffness), 0.0, np.inf))
    st.write(truss, tmp_path / "Dach 屋顶.inp")
    back = truss_of_inp(tmp_path / "Dach 屋顶.inp", truss.material)
    if not truss.pinned:
        np.testing.assert_allclose(back.axes, truss.axes, atol=1e-7)
    for one, other in zip(st.solve(truss).cases, st.solve(back).cases, strict=True):
        assert one.name.replace("=", " ") == other.name
        np.testing.assert_allclose(other.displacements, one.displacements, atol=1e-6 * np.abs(one.displacements).max())


@pytest.mark.skipif(which("ccx") is None, reason="CalculiX (Debian's calculix-ccx) is not installed")
@pytest.mark.parametrize("others", [{"section": "CHS76.1x4"}, {"joints": "pinned", "support_type": "springs:5MN/m"}])
def test_calculix_finds_the_same_displacements(others: dict[str, Any], tmp_path: Path) -> None:
    truss = roof(4, **others)
    rng = np.random.default_rng(1)
    count, held = len(truss.nodes), np.flatnonzero(truss.supports.any(axis=1))
    nodal, settled = 1e3 * rng.normal(size=(count, 6)), np.full((count, 3), np.nan)
    odd = LoadCase("Träger =1 中", nodal=nodal, line=1e3 * rng.normal(size=(len(truss.members), 3)),
                   strain=rng.normal(size=len(truss.members)) * 1e-4)  # fmt: skip
    if truss.pinned:
        nodal[:, 3:], settled[held[2], 2] = 0.0, -0.005
        supports = truss.supports.copy()
        supports[held[2], :3] = np.inf
        truss = truss.replace(supports=supports)
        odd = replace(odd, settlement=settled)
    else:
        truss = truss.replace(end_stiffness=np.full_like(truss.end_stiffness, np.inf))
    truss = truss.replace(cases=(odd, *truss.cases))
    path = tmp_path / "dach.inp"
    st.write(truss, path, style=FileStyle(inp="calculix"))
    run = subprocess.run(["ccx", "dach"], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True)
    assert "ERROR" not in run.stdout
    rows = [
        line.split() for line in (tmp_path / "dach.dat").read_text().splitlines() if re.match(r" +\d+ +[-\d]", line)
    ]
    found = np.array(rows, float).reshape(len(truss.cases), count, -1)[:, :, 1:]
    for case, values in zip(st.solve(truss).cases, found, strict=True):
        for part in (slice(0, 3), slice(3, 6)):
            if values[:, part].size:
                moved = case.displacements[:, part]
                np.testing.assert_allclose(values[:, part], moved, atol=1e-5 * np.abs(moved).max())


@pytest.mark.parametrize(
    ("others", "words"),
    [({"section": "IPE200"}, "IPE200"), ({"joints": 2e5}, "hinges or springs"),
     ({"section": "R100x200", "material": "GL24h"}, "isotropic"), ({"settled": True}, "settle")],
)  # fmt: skip
def test_what_beams_of_calculix_are_not_is_refused(others: dict[str, Any], words: str, tmp_path: Path) -> None:
    settled = others.pop("settled", False)
    truss = roof(4, **others)
    if settled:
        truss = truss.replace(cases=(LoadCase("moved", settlement=np.zeros((len(truss.nodes), 3))),))
    with pytest.raises(st.FormatError, match=words):
        st.write(truss, tmp_path / "a.inp", style=FileStyle(inp="calculix"))
    assert list(tmp_path.iterdir()) == []


def test_numbers_for_calculix_are_short_and_have_a_point(tmp_path: Path) -> None:
    truss = example({}).replace(end_stiffness=np.full((len(example({}).members), 2, 2), np.inf))
    st.write(truss, tmp_path / "a.inp")
    rows = (tmp_path / "a.inp").read_text(encoding="utf-8").splitlines()
    words = [word for row in rows if re.match(r"[-\d]", row) for word in row.split(", ")]
    assert len(words) > 1000 and all(len(word) <= 20 for word in words)


def test_meshio_reads_the_trusses_of_abaqus(tmp_path: Path) -> None:
    truss = roof(4, joints="pinned")
    st.write(truss, tmp_path / "a.inp")
    mesh = meshio.read(tmp_path / "a.inp")
    assert np.abs(mesh.points - truss.nodes - UTM).max() < 1e-6
    np.testing.assert_array_equal(mesh.cells_dict["line"], truss.members)


def test_springs_at_ends_are_refused_by_abaqus(tmp_path: Path) -> None:
    with pytest.raises(st.FormatError, match="no springs at the ends"):
        st.write(roof(4, joints=2e5), tmp_path / "a.inp")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("others", [KINDS[0], KINDS[1], KINDS[3]])
def test_plain_lists_for_karamba_hold_the_structure(others: dict[str, Any], tmp_path: Path) -> None:
    truss = example(others)
    rigid = truss.replace(
        end_stiffness=np.full_like(truss.end_stiffness, np.inf)
    )  # releases are left out, which is said
    st.write(rigid, tmp_path / "Dach 屋顶.karamba.json")
    held = json.loads((tmp_path / "Dach 屋顶.karamba.json").read_text(encoding="utf-8"))
    assert (held["length"], held["force"]) == ("m", "kN")
    nodes, rows = np.array(held["points"]), held["elements"]
    assert np.abs(nodes - truss.nodes - UTM).max() < 1e-6
    supports = np.where([[*each["fixed"]] for each in held["supports"]], np.inf, 0.0)
    stiffness = np.zeros((len(nodes), 6))
    for each, own in zip(held["supports"], supports, strict=True):
        ways = [1e3 * each.get("springs", {}).get(way, 0) for way in ("ux", "uy", "uz", "rx", "ry", "rz")]
        stiffness[each["node"]] = np.where(own > 0, own, ways)
    loads: dict[str, dict[str, Any]] = {
        each["case"]: {"nodal": np.zeros((len(nodes), 6)), "line": np.zeros((len(rows), 3)), "temperature": np.zeros(len(rows)),
                       "settlement": np.full((len(nodes), 3), np.nan)}
        for each in held["loads"]
    }  # fmt: skip
    for each in held["loads"]:
        case = loads[each["case"]]
        if "gravity" in each:
            case["self_weight"] = -each["gravity"][2]
        elif "force" in each:
            case["nodal"][each["node"]] = 1e3 * np.array(each["force"] + each["moment"])
        elif "settlement" in each:
            held_there = np.isinf(stiffness[each["node"], :3])
            case["settlement"][each["node"]] = np.where(held_there, each["settlement"], np.nan)
        elif "line" in each:
            case["line"][each["element"]] = 1e3 * np.array(each["line"])
        else:
            case["temperature"][each["element"]] = each["temperature"]
    names = [each["name"] for each in held["sections"]]
    back = rigid.replace(
        nodes=nodes - nodes[0], members=np.array([row["nodes"] for row in rows]), supports=stiffness,
        member_normals=np.array([row["z"] for row in rows]), section_of=np.array([names.index(row["section"]) for row in rows]),
        cases=tuple(LoadCase(name, **values) for name, values in loads.items()), combinations=(), node_sets={},
    )  # fmt: skip
    for one, other in zip(st.solve(rigid).cases, st.solve(back).cases, strict=True):
        assert one.name == other.name
        np.testing.assert_allclose(other.displacements, one.displacements, atol=1e-6 * np.abs(one.displacements).max())


@pytest.mark.parametrize("suffix", [".s2k", ".tcl", ".py", ".inp"])
def test_grids_are_refused(suffix: str, tmp_path: Path) -> None:
    with pytest.raises(st.FormatError, match="holds structures"):
        st.write(dome(4), tmp_path / f"a{suffix}")
