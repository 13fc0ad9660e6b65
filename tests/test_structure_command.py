"""``scantruss structure``: files, the report, and what is refused."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_grids import dome, make_grid

import scantruss as st
from scantruss.cli.main import main
from scantruss.grid.line_sets import FIXED_LINE, LineSet
from scantruss.structure.json import encode_structure
from scantruss.structure.statics import solve

LOADS = "self,cladding:0.5kN/m2,snow:1kN/m2"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the grid of a dome, 1:50 in mm, and one whose unit is not known."""
    monkeypatch.chdir(tmp_path)
    grid = dome(7, 40.0)
    st.write(grid.replace(line_sets=(LineSet("rim", FIXED_LINE, np.arange(7)),)), "grid.json")
    st.write(grid.replace(unit=""), "nounit.json")
    Path("roof.json").write_text('{"format": "scantruss-structure"}')
    return tmp_path


def run(words: str) -> int:
    """Run a command, on the boundary where it names no supports."""
    given = words.split()
    usual = [] if "--supports" in words or "--settings" in words else ["--supports", "boundary"]
    return main([*given, *usual])


def test_the_report_holds_what_it_promises(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(f"structure grid.json out.json --scale 50 --loads {LOADS} --supports corners --report report.json") == 0
    report = json.loads(Path("report.json").read_text())
    names = {"mass", "cases", "displacement_max", "force_min", "force_max", "utilization_max", "sections", "warnings"}
    assert names <= report.keys()
    assert {"self", "cladding", "snow"} <= report["cases"].keys()
    for case in report["cases"].values():
        assert np.add(case["applied"], case["reactions"]) == pytest.approx(np.zeros(3), abs=1e-6)
        assert case["force_min"] <= case["force_max"] and case["equilibrium_error"] < 1e-9
    assert report["cases"]["self"]["applied"][2] == pytest.approx(-9.80665 * report["mass"])
    assert sum(report["sections"].values()) == len(dome(7).edges)
    said = capsys.readouterr().out
    assert "wrote out.json report.json" in said and "snow" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--loads self,snow:1kN/m2", "the weight of the nodes, as of balls, is not counted"),
        ("--loads self --node-allowance 15%", "15 % of "),
        ("--loads snow:1kN/m2", ""),
    ],
)
def test_it_is_said_whether_nodes_weigh_anything(
    words: str, said: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(f"structure grid.json out.html --scale 50 {words}") == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("the weight of the nodes")]
    assert len(lines) == bool(said) and all(said in line for line in lines)
    assert said in Path("out.html").read_text()


def test_buckling_and_frequencies_come_where_they_are_asked_for(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = "structure grid.json out.json --scale 50 --loads self,snow:1kN/m2 --buckling 3 --frequencies 2 --report report.json"
    assert run(words) == 0
    report = json.loads(Path("report.json").read_text())
    assert (
        len(report["buckling_factors"]) == 3 and report["buckling_factors"][0] > 1 and "snow" in report["buckling_case"]
    )
    assert len(report["frequencies"]) == 2 and 0 < report["frequencies"][0] <= report["frequencies"][1]
    assert np.shape(json.loads(Path("out.json").read_text())["buckling_modes"]) == (3, 49, 3)
    said = capsys.readouterr().out
    assert "buckling factors of ULS" in said and "natural frequencies" in said


@pytest.mark.parametrize(
    ("turned", "words"),
    [([0, 1, 2], None), ([0, 2, 1], "the surface faces y and"), ([2, 0, 1], "the surface faces x and")],
)
def test_a_roof_on_its_side_is_warned_of(
    place: Path, capsys: pytest.CaptureFixture[str], turned: list[int], words: str | None
) -> None:
    """Snow on a scan with y up would load it from the side, and the figures look harmless."""
    grid = st.read_grid("grid.json")
    st.write(
        dataclasses.replace(grid, nodes=np.ascontiguousarray(grid.nodes[:, turned]), origin=grid.origin[turned]),
        "turned.json",
    )
    assert run("structure turned.json out.json --scale 50 --supports boundary --loads self,snow:1kN/m2") == 0
    assert (
        (words or "the surface faces") in capsys.readouterr().out
        if words
        else "the surface faces" not in capsys.readouterr().out
    )


def test_it_is_said_where_buckling_makes_the_sections_larger(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Else the utilization of what was sized is far below 1 for no reason that a reader sees."""
    assert (
        run(
            "structure grid.json out.json --scale 50 --supports boundary --loads self,snow:3kN/m2 --size 1 --report r.json"
        )
        == 0
    )
    rounds = json.loads(Path("r.json").read_text())["sizing_rounds"]
    passed = [each for each in rounds if each["buckling"] is not None]
    assert len(passed) > 1 and passed[0]["buckling"] < 10 <= passed[-1]["buckling"]
    said = capsys.readouterr().out
    assert f"all members pass at {passed[0]['mass']:,.0f} kg, but there the structure buckles at" in said
    (line,) = (line for line in said.splitlines() if line.startswith("all members pass"))
    assert line.endswith(f"larger sections raise that to {passed[-1]['buckling']:.3g}")


def test_a_path_is_reported_drawn_and_announced(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = "structure grid.json out.json --scale 50 --loads self,snow:1kN/m2 --path worst --path-steps 3 --imperfection mode:20mm"
    assert run(f"{words} --dry-run") == 0
    assert "a path of 3 steps takes about" in capsys.readouterr().out and not Path("out.json").exists()
    assert run(f"{words} --path-plot path.png --report report.json") == 0
    report = json.loads(Path("report.json").read_text())
    assert report["limit_factor"] is None and report["path"]["ended"] == "3 steps are done"
    assert len(report["path"]["factors"]) == len(report["path"]["displacements"]) == 4
    assert report["path"]["imperfection_max"] == pytest.approx(0.02)
    assert Path("path.png").read_bytes()[:4] == b"\x89PNG"


def test_a_structure_is_read_back_to_the_last_bit(place: Path) -> None:
    grid = dome(7, 40.0)
    table = [
        {"force": [0, 0, "-5kN"], "nodes": ["N010"]},
        {"settlement": [0, 0, -0.01], "nodes": "N001"},
        "temperature:30K",
    ]
    truss = st.Truss.from_grid(grid, supports="boundary", scale=50, loads=table, joints=5000.0)
    Path("out.json").write_bytes(encode_structure(truss))
    back = st.read_structure("out.json")
    assert encode_structure(back) == encode_structure(truss)
    assert (
        back.sections == truss.sections and back.material == truss.material and back.combinations == truss.combinations
    )
    for name, array in vars(truss).items():
        if isinstance(array, np.ndarray):
            assert np.array_equal(getattr(back, name), array) and getattr(back, name).dtype == array.dtype, name
    for one, other in zip(solve(truss).cases, solve(back).cases, strict=True):
        assert np.array_equal(one.displacements, other.displacements)


def test_the_same_command_writes_the_same_bytes(place: Path) -> None:
    for name in ("a.json", "b.json"):
        assert run(f"structure grid.json {name} --scale 50 --loads {LOADS}") == 0
    assert Path("a.json").read_bytes() == Path("b.json").read_bytes()


SETTINGS = """
scale = 50
section = "SHS100x5"
supports = "line:rim+boundary"
support_type = "fixed"
deflection = 400
effective_length = 0.9
node_allowance = 0.2

[[loads]]
load = "self"

[[loads]]
case = "crane"
force = [0, 0, "-20kN"]
nodes = ["N025"]

[[loads]]
case = "rail"
line = [0, 0, "-1kN/m"]
members = "line:rim"

[[loads]]
case = "tight"
lengthening = "2mm"
members = ["M0003"]

[[combinations]]
name = "all"
state = "ULS"
factors = { self = 1.35, crane = 1.5, rail = 1.5 }
"""


def test_everything_can_stand_in_a_settings_file(place: Path) -> None:
    Path("settings.toml").write_text(SETTINGS)
    assert run("structure grid.json out.json --settings settings.toml --report report.json") == 0
    report = json.loads(Path("report.json").read_text())
    assert list(report["cases"]) == ["self", "crane", "rail", "tight", "all"]
    assert report["cases"]["crane"]["applied"] == pytest.approx([0, 0, -20e3])
    assert report["cases"]["rail"]["applied"][2] == pytest.approx(
        -1e3 * 50 * 0.04 * 6, rel=0.1
    )  # six members of about 40 mm
    assert report["cases"]["tight"]["force_min"] < 0 and report["sections"] == {"SHS100x5": len(dome(7).edges)}
    weights = [report["cases"][name]["applied"][2] for name in ("self", "crane", "rail", "all")]
    assert weights[3] == pytest.approx(1.35 * weights[0] + 1.5 * (weights[1] + weights[2]))
    assert weights[0] == pytest.approx(-1.2 * 9.80665 * report["mass"])
    assert run("structure grid.json out.json --settings settings.toml --section CHS114.3x5 --report report.json") == 0
    assert list(json.loads(Path("report.json").read_text())["sections"]) == ["CHS114.3x5"]
    Path("settings.json").write_text(
        json.dumps({"scale": 50, "supports": "boundary", "loads": "self,snow:1kN/m2", "joints": 5000})
    )
    assert run("structure grid.json out.json --settings settings.json") == 0
    Path("more.json").write_text(json.dumps({"loads": [{"case": "lamp", "force": [0, 0, -100], "nodes": "N025"}]}))
    assert run("structure grid.json out.json --scale 50 --loads self,more.json --report report.json") == 0
    assert "lamp" in json.loads(Path("report.json").read_text())["cases"]


def test_supports_of_a_file_are_the_nearest_nodes(place: Path) -> None:
    grid = st.read_grid("grid.json")
    corners = grid.scan_nodes[[0, 6, 42, 48]]
    np.savetxt("feet.csv", corners + 1.0, delimiter=",")
    assert run("structure grid.json out.json --scale 50 --supports feet.csv") == 0
    held = st.read_structure("out.json").supports.any(axis=1)
    assert np.flatnonzero(held).tolist() == [0, 6, 42, 48]


def test_a_position_that_is_no_number_supports_nothing(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing is nearest to it, so no node is taken for it."""
    x, y, z = st.read_grid("grid.json").scan_nodes[0]
    Path("feet.csv").write_text(f"{x},{y},{z}\nnan,{y},{z}\n")
    assert run("structure grid.json out.json --supports feet.csv") == 2
    assert "feet.csv, line 2: needs three finite numbers X,Y,Z" in capsys.readouterr().err
    assert not Path("out.json").exists()


def test_a_unit_can_be_given_where_the_grid_has_none(place: Path) -> None:
    assert run("structure nounit.json out.json --scale 50 --unit mm") == 0
    assert st.read_structure("out.json").lengths.mean() == pytest.approx(2.0, rel=0.05)


def test_what_is_odd_in_what_was_given_is_said(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All nodes held, a force without a unit, own combinations that leave out displacements, a factor of buckling below 1."""
    Path("odd.toml").write_text(
        'scale = 50\n[[loads]]\ncase = "lamp"\nforce = [0, 0, -2]\nnodes = ["N025"]\n'
        '[[combinations]]\nname = "mine"\nstate = "ULS"\nfactors = { lamp = 1.5 }\n'
    )
    assert run("structure grid.json out.json --settings odd.toml --supports lowest:50") == 0
    said = capsys.readouterr().out
    assert "warning: 49 of 49 nodes are supported; heights of supports are in metres" in said
    assert 'force = [0, 0, -2] has no unit and is taken in N; write it as "-2N"' in said
    assert "have none of SLS" in said and "supports: 49 nodes, 0 to " in said
    assert "m above the lowest node, nodes up to 50 m above the lowest" in said
    assert (
        run("structure grid.json out.json --scale 50 --supports corners --loads self,cladding:90kN/m2 --buckling 1")
        == 0
    )
    said = capsys.readouterr().out
    assert (
        "it does not carry this load" in said
        and "analysis of first order" not in said
        and "nodes are supported" not in said
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("nounit.json out.json", "the unit of the grid is not known, and a structure needs lengths in metres; give --unit"),
        ("grid.json out.json --unit m", "the grid is in mm, not in m"),
        ("grid.json out.json --section HSS4.500x0.237", "American ones are not bundled; nearest in size is CHS114.3x6.3"),
        ("grid.json out.json --section hss4x4x1/0", "American ones are not bundled; nearest in size is SHS"),
        ("grid.json out.json --section CHS114x5", "no section 'CHS114x5' is known; nearest are CHS114.3x5"),
        ("grid.json out.json --material S350", "no material 'S350' is known; nearest are S355"),
        ("grid.json out.json --supports fixed", "the grid has no fixed nodes; give scantruss grid --fixed X,Y,Z, or name others"),
        ("grid.json out.json --supports N9999", "no supports 'N9999': the nodes are marked N001 to N049"),
        ("grid.json out.json --supports lowest", "write it as lowest:0.5"),
        ("grid.json out.json --supports corners+feet.csv", "there is no file feet.csv"),
        ("grid.json out.json --supports line:ring", "no supports: the grid has no line:ring; nearest are line:rim"),
        ("grid.json out.json --supports=", "no supports; name some with --supports: corners"),
        ("grid.json out.json --supports somewhere", "no supports 'somewhere'; name some with --supports: corners, boundary, lowest:H"),
        ("grid.json out.json --supports boundry", "no supports 'boundry' (did you mean boundary?)"),
        ("grid.json out.json --support-type glued", "support type must be pinned, fixed, roller or springs:K"),
        ("grid.json out.json --support-type springs", "needs a stiffness, such as springs:5MN/m"),
        ("grid.json out.json --support-type roller", "a mechanism: the supports let the whole structure move"),
        ("grid.json out.json --joints loose", "joints must be rigid, pinned or a rotational stiffness"),
        ("grid.json out.json --loads snow:1", "the unit is missing: snow, a load on an area, is '1'; write it as 1kN/m2"),
        ("grid.json out.json --loads snow:1kN", "must be a number with one of the units N/m2 kN/m2"),
        ("grid.json out.json --loads snow:nankN/m2", "must be a number"),
        ("grid.json out.json --loads snow:1,5kN/m2,self", "write snow:1.5kN/m2 with a point, not snow:1,5kN/m2"),
        ("grid.json out.json --loads slef", "no load 'slef' (did you mean self?); use self"),
        ("grid.json out.json --loads hail:1kN/m2", "no load 'hail:1kN/m2'; use self, cladding:P"),
        ("grid.json out.json --loads wind:1kN/m2:a", "coefficients of wind are numbers"),
        ("grid.json out.json --loads ,", "no loads"),
        ("grid.json out.json --loads self,self", "the load self is given 2 times"),
        ("grid.json out.json --loads snow:-1kN/m2", "snow weighs down and must be positive"),
        ("grid.json out.json --loads temperature:30", "write it as 30K"),
        ("grid.json out.json --loads self snow:1kN/m2", "snow:1kN/m2 is not a file to write"),
        ("grid.json out.json --loads no.toml", "cannot read no.toml"),
        ("grid.json out.json --scale 0", "scale must be a positive number"),
        ("grid.json out.json --buckling 99", "numbers of modes, 0 to 50"),
        ("grid.json out.json --path worst --path-steps 0", "a path has 1 to"),
        ("grid.json out.json --path other", "no load case or combination 'other'"),
        ("grid.json out.json --path worst --imperfection bump", "an imperfection is mode"),
        ("grid.json out.json --path-plot path.png", "ask for one with --path"),
        ("grid.json out.json --node-allowance -1", "node_allowance is a share"),
        ("grid.json out.json --node-allowance 300%", "node_allowance is a share of the members' weight, 0 to 2, got 3.0"),
        ("grid.json out.json --scale 1:x", "needs a scale such as 0.01 or 1:100"),
        ("grid.json out.json --settings no.toml", "cannot read no.toml"),
        ("grid.json out.abc", 'no format for ".abc"'),
        ("grid.json out.abc", " .glb .html .ifc "),
        ("grid.json grid.json", "would overwrite the grid"),
        ("grid.json", "missing OUT"),
        ("roof.json out.json", "roof.json is a structure; name the grid, saved as .json by scantruss grid"),
        ("no.json out.json", "there is no file no.json"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_one_line(
    words: str, said: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path.name for path in place.iterdir())
    assert run(f"structure {words}") == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert sorted(path.name for path in place.iterdir()) == before


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("scale = 'big'", "has 'scale' = 'big'; scale needs a number, without quotes"),
        ("size = 1.5", "size needs a whole number"),
        ("[[loads]]\nforce = [0, 0, '-1,5kN']\nnodes = 'N001'", "write it with a point, -1.5, not with a comma"),
        ("colour = 1", "has 'colour' = 1; known are"),
        ("suports = 'corners'", "has 'suports' = 'corners' (did you mean supports?)"),
        ("gamma_m0 = 0", "gamma_m0 must be a positive number"),
        ("scale =", "is not TOML"),
        ("[[combinations]]\nname = 'a'", "a combination that cannot be used: no factors"),
        ("[[combinations]]\nname = 'a'\nfactors = { none = 1.0 }", "names no load case 'none'"),
        (
            "[[combinations]]\nname = 'a'\nfactors = { self = nan }",
            "factors must be one finite number or more, got {'self': nan}",
        ),
        ("[[combinations]]\nname = 'a'\nfactors = {}", "factors must be one finite number or more, got {}"),
        ("[[loads]]\nforce = [0, 0]\nnodes = 'N001'", "needs three numbers"),
        ("[[loads]]\nforce = [0, 0, 1]", "needs nodes"),
        ("[[loads]]\nforce = [0, 0, 1]\nnodes = ['N900']", "the load 'point' names nodes that are not there: 'N900'"),
        ("[[loads]]\nforce = [0, 0, 1]\nline = [0, 0, 1]", "a load needs one of load, force"),
        ("[[loads]]\nline = [0, 0, 1]\nmembers = ['M9999']", "names members that are not there"),
        ("[[loads]]\nsettlement = [0, 0, 1]\nnodes = 'N025'", "moves N025, which no support holds"),
        (
            "[[combinations]]\nname = 'self'\nfactors = { self = 1.0 }",
            "two load cases or combinations are named 'self'",
        ),
        ("[[loads]]\npush = 3", "a load has no 'push'"),
    ],
)
def test_a_settings_file_that_cannot_be_used_is_one_line(
    text: str, said: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("settings.toml").write_text(f"supports = 'boundary'\n{text}")
    assert run("structure grid.json out.json --settings settings.toml") == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1 and not Path("out.json").exists()


@pytest.mark.parametrize(("scale", "said"), [(0.08, "3.29 mm"), (7500, "308.2 m")])
def test_members_of_an_odd_size_are_a_warning(
    scale: float, said: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(f"structure grid.json out.json --scale {scale} --report report.json") == 0
    assert f"members of {said} (median)" in " ".join(json.loads(Path("report.json").read_text())["warnings"])
    assert "warning: members of" in capsys.readouterr().out


def test_a_failed_grid_is_refused_unless_asked_for(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from scantruss.grid.certificate import Certificate, Fault

    failed = Certificate("mm", 1.0, True, True, 1, 1, 1, 1, 1, 0, faults=(Fault("uneven", "is uneven"),))
    st.write(dome(7, 40.0).replace(certificate=failed), "failed.json")
    assert run("structure failed.json out.json --scale 50") == 3
    assert "the grid failed its certificate: it is uneven" in capsys.readouterr().err
    assert run("structure failed.json out.json --scale 50 --keep-failed") == 0


def test_files_of_others_stay(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("theirs.json").write_text('{"a": 1}')
    for words in ("grid.json theirs.json", "grid.json out.json --report theirs.json"):
        assert run(f"structure {words} --scale 50") == 2
        assert "is not a result that ScanTruss wrote" in capsys.readouterr().err
    assert Path("theirs.json").read_text() == '{"a": 1}'
    assert run("structure grid.json theirs.json --scale 50 --force --quiet") == 0
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"format": "other"}, 'has no "format"'),
        ({"format_version": 9}, "format_version 9"),
        ({"members": [[0, 999]]}, "damaged structure: members must be ids"),
        ({"node_marks": []}, "different lengths"),
        ({"material": {}}, "damaged structure"),
        ({"supports": None}, "damaged structure"),
    ],
)
def test_a_damaged_structure_is_refused(change: dict[str, Any], said: str, place: Path) -> None:
    assert run("structure grid.json out.json --scale 50") == 0
    values = json.loads(Path("out.json").read_text())
    Path("bad.json").write_text(json.dumps(values | change))
    with pytest.raises(st.FormatError, match=said):
        st.read_structure("bad.json")


def test_a_grid_without_members_or_with_one_of_no_length_is_refused() -> None:
    with pytest.raises(st.InputError, match="no members"):
        st.Truss.from_grid(make_grid([(0, 0, 0)], []), supports="boundary")
    with pytest.raises(st.InputError, match="has no length"):
        st.Truss.from_grid(make_grid([(0, 0, 0), (0, 0, 0), (1, 0, 0)], [(0, 1, 2)]), supports="boundary")
