"""`scantruss convert`, and what holds for all formats of the table."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from small_grids import dome, rich
from small_trusses import make_truss

import scantruss as st
from scantruss.cli.main import main
from scantruss.export.formats import FORMATS, FileFormat, check_output, read_model, suffixes_of
from scantruss.runtime.ours import kind_of_ours

UTM = np.array([389_999.25, 5_819_999.5, 34.125])


def roof(count: int = 6, **others: object) -> st.Truss:
    """A structure far from the origin of its grid, supported, loaded and not yet solved."""
    grid = dome(count, origin=UTM, unit="m")
    values: dict[str, object] = {"supports": "boundary", "loads": "self,snow:1kN/m2,wind:0.8kN/m2:-0.7,temperature:30K"}
    return st.Truss.from_grid(grid, **(values | others))  # type: ignore[arg-type]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a grid and a structure."""
    monkeypatch.chdir(tmp_path)
    st.write(dome(5, origin=UTM, unit="m"), "net.json")
    st.write(st.solve(roof()), "roof.json")
    return tmp_path


def test_a_grid_and_a_structure_are_read_back_without_loss(place: Path) -> None:
    for name in ("net.json", "roof.json"):
        st.write(read_model(name), "again.json", report=None)
        assert Path("again.json").read_bytes() == Path(name).read_bytes()


@pytest.mark.parametrize("source", ["net.json", "roof.json"])
def test_every_format_is_written_by_convert_with_a_mark_and_the_same_bytes(
    source: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    suffixes = suffixes_of("grid" if source == "net.json" else "structure")
    outs = [f"Träger 中{suffix}" for suffix in suffixes]
    assert main(["convert", source, *outs]) == 0
    said = capsys.readouterr()
    assert "Traceback" not in said.err and all(out in said.out for out in outs)
    first = {out: Path(out).read_bytes() for out in outs}
    assert {out: kind_of_ours(Path(out)) for out in outs} == dict.fromkeys(outs, "result")
    assert main(["convert", source, *outs]) == 0  # ours are replaced
    for out in outs:
        assert Path(out).read_bytes() == first[out], out
        if FORMATS[Path(out).name.removeprefix("Träger 中")].loses_of_structure and source == "roof.json":
            assert f"{FORMATS[Path(out).name.removeprefix('Träger 中')].name} holds no " in said.err


def test_structure_writes_what_convert_writes(place: Path) -> None:
    assert main("structure net.json --supports boundary one.json one.ply --loads self".split()) == 0
    assert main("convert one.json two.ply".split()) == 0
    assert Path("one.ply").read_bytes() == Path("two.ply").read_bytes()


def test_the_utilization_of_a_structure_goes_along(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main("structure net.json --supports boundary one.json --loads self,snow:1kN/m2".split()) == 0
    values = json.loads(Path("one.json").read_text(encoding="utf-8"))
    model = read_model("one.json")
    assert model.utilization is not None and model.utilization.tolist() == values["utilization"]
    values["utilization"].pop()
    Path("one.json").write_text(json.dumps(values), encoding="utf-8")
    capsys.readouterr()
    assert main("convert one.json a.vtu".split()) == 2
    assert "utilization and governing need a value for each member" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("convert net.json a.jsn", "the nearest is .json"),
        ("convert net.json a.iffc", "the nearest is .ifc"),
        ("convert roof.json a.saf.xls", "the nearest is .saf.xlsx"),
        ("convert net.json a.dwg", "the nearest is .dxf"),
        ("convert plan.dwg a.obj", "the nearest is .dxf"),
        ("convert net.json a.saf.xlsx", "SAF holds structures"),
        ("convert roof.json a.png", "no format"),
        ("convert none.json a.ply", "there is no file none.json"),
        ("convert net.dwg a.ply", "no reader"),
        ("convert net.json net.json", "would overwrite"),
        ("convert net.json theirs.ply", "--force"),
        ("convert theirs.json a.ply", 'has no "format"'),
        ("convert net.json none/a.ply", "does not exist"),
        ("convert net.json a.ply --unit mm", "leave --unit out"),
        ("convert net.json a.ply --unit ell", "unit must be one of"),
        ("convert net.json", "missing OUT"),
    ],
)
def test_what_cannot_be_converted_is_one_line_and_harms_nothing(
    words: str, said: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("theirs.ply").write_text("ply\n")
    Path("theirs.json").write_text('{"a": 1}\n')
    before = {path: path.read_bytes() for path in place.iterdir()}
    assert main(words.split()) == 2
    line = capsys.readouterr().err
    assert said in line and line.count("\n") == 1
    assert {path: path.read_bytes() for path in place.iterdir()} == before


def test_a_missing_extra_is_one_line_with_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(
        FORMATS, ".odd", FileFormat("ODD", FORMATS[".ply"].encode, library="no_such_module", extra="cad")
    )
    with pytest.raises(st.FormatError, match=r"no_such_module.*uv sync --extra cad"):
        check_output(tmp_path / "a.odd")
    assert list(tmp_path.iterdir()) == []


def test_members_without_triangles_are_written_as_lines(tmp_path: Path) -> None:
    bar = make_truss([(0, 0, 0), (1, 0, 0)], [(0, 1)], {0: (np.inf,) * 6})
    for suffix in (".ply", ".obj"):
        st.write(bar, tmp_path / f"a{suffix}")
        assert read_model(tmp_path / f"a{suffix}").members.tolist() == [[0, 1]]
    with pytest.raises(st.FormatError, match="on no panel"):
        st.write(read_model(tmp_path / "a.ply"), tmp_path / "a.json")
    assert not (tmp_path / "a.json").exists()


def test_a_rich_grid_goes_through_every_format(tmp_path: Path) -> None:
    for suffix in suffixes_of("grid"):
        assert all(path.stat().st_size for path in st.write(rich(), tmp_path / f"a{suffix}"))


def test_the_page_on_formats_has_a_row_for_each_with_what_it_does_not_hold() -> None:
    page = (Path(__file__).resolve().parents[1] / "docs" / "formats-output.md").read_text(encoding="utf-8")
    rows = page[page.index("### Other programs") : page.index("**DXF.**")].splitlines()
    for suffix, row in FORMATS.items():
        (line,) = (line for line in rows if line.startswith("| `.") and f"`{suffix}`" in line.split("|")[1])
        *_, lost, of_structure, _ = (cell.strip() for cell in line.split("|"))
        assert (lost, of_structure) == (row.loses, row.loses_of_structure)


def test_a_grid_without_a_unit_is_refused_once_the_scan_is_read(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = np.stack(np.meshgrid(np.arange(30.0), np.arange(30.0), [0.0]), axis=-1).reshape(-1, 3)
    np.savetxt("scan.xyz", points)
    for out in ("a.ifc", "a.step"):
        assert main(["grid", "scan.xyz", "a.dxf", out, "--length", "6"]) == 2
        assert "needs a unit, and that of the grid is not known" in capsys.readouterr().err
    st.write(dome(3, unit=""), "odd.json")
    assert main(["convert", "odd.json", "a.ifc"]) == 2
    assert main(["convert", "odd.json", "a.ifc", "--unit", "mm"]) == 0
    assert "IfcProject".upper() in Path("a.ifc").read_text()
    assert not Path("a.dxf").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--tube 60", "such as 60x3"),
        ("--tube 60x31", "such as 60x3"),
        ("--tube thick", "needs a diameter and a wall"),
        ("--tube 60,3x3", "write 60.3x3 with a point"),
        ("--ball -3", "diameter of the balls"),
        ("--ifc parts", "an IFC file holds"),
        ("--tube 60x3 --ball 100000", "shorter than its balls"),
    ],
)
def test_bodies_that_cannot_be_built_are_refused(
    words: str, said: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["convert", "net.json", "a.ifc", *words.split()]) == 2
    line = capsys.readouterr().err
    assert said in line and line.count("\n") == 1 and not Path("a.ifc").exists()
