"""``scantruss sweep --structure``: which length, supports and rise give the lightest structure."""

import csv
from pathlib import Path

import numpy as np
import pytest
from small_grids import dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.report.choosing import rows_of_designs as table_rows
from scantruss.structure.options import StructureSettings
from scantruss.structure.variants import VariantFigures, Variants, lightest, solve_variants
from scantruss.sweep import FIGURES, Outcome, Trial

SETTINGS = """
unit = "m"
size = 1
supports = "boundary"
loads = ["self", "snow:1kN/m2"]
"""
RUN = "sweep scan.npy --effort quick --workers 1 -o out --structure roof.toml"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the scan of a roof of 24 x 18 m and the settings of its structure."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0, 24, 20_000), rng.uniform(0, 18, 20_000)
    height = 4 - 4 * ((x / 12 - 1) ** 2 + (y / 9 - 1) ** 2) / 2
    np.save("scan.npy", np.stack([x, y, height + rng.normal(0, 0.01, len(x))], axis=1))
    Path("roof.toml").write_text(SETTINGS)
    return tmp_path


def rows_of_designs(path: str) -> list[dict[str, str]]:
    with Path(path).open() as file:
        return list(csv.DictReader(file))


def test_every_length_support_and_rise_is_a_row_and_the_lightest_is_named(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = f"{RUN} --length 3,4 --supports corners,boundary,line:none --rise 0.7,1"
    assert main(words.split()) == 0
    said, rows = capsys.readouterr().out, rows_of_designs("out/structures.csv")
    assert [(row["length"], row["supports"], row["rise"]) for row in rows] == [
        (length, where, rise) for length in ("3", "4") for where in ("corners", "boundary", "line:none") for rise in ("0.7", "1")
    ]  # fmt: skip
    for row in rows:
        assert ("has no line:none" in row["structure"] and not row["mass [kg]"]) == (row["supports"] == "line:none")
    passed = [row for row in rows if row["structure"] == "passed"]
    best = min(passed, key=lambda row: float(row["mass [kg]"]))
    assert f"lightest: length {best['length']}, supports {best['supports']}, rise {best['rise']}:" in said
    assert all(float(row["utilization"]) <= 1 and float(row["buckling factor"]) >= 10 for row in passed)
    page = Path("out/index.html").read_text()
    assert page.count("<table>") == 2 and page.count("<tr>") == 3 + 13
    assert main(words.split()) == 0  # over its own results
    assert main(f"{RUN.partition(' --structure')[0]} --length 3,4".split()) == 0
    assert not Path("out/structures.csv").exists()


def test_a_grid_that_passed_with_warnings_is_said_to() -> None:
    figures = ("",) * len(FIGURES)
    outcomes = [Outcome(figures=figures, warnings=count) for count in (0, 1, 3)] + [Outcome(fault="no grid")]
    rows = table_rows([Trial("a", "a", ("1",), st.Settings(length=1.0))] * 4, outcomes)
    assert [row[-1] for row in rows] == ["passed", "passed with 1 warning", "passed with 3 warnings", "no grid"]


def test_a_row_is_what_the_command_structure_finds(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(f"{RUN} --length 4 --rise 1".split()) == 0
    (row,) = rows_of_designs("out/structures.csv")
    assert main("structure out/grid.json a.json --settings roof.toml --buckling 1".split()) == 0
    assert f"{st.read_structure('a.json').mass:.0f}" == row["mass [kg]"]
    said = capsys.readouterr().out.partition("buckling factors of ULS 1.35 self + 1.5 snow: ")[2].split()[0]
    assert f"{float(said):.3g}" == row["buckling factor"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--structure no.toml", "cannot read no.toml"),
        ("--rise 2", "--supports and --rise need --structure FILE"),
        ("--structure roof.toml --rise a", "--rise needs a number"),
        ("--structure roof.toml --rise 0", "--rise needs numbers above 0"),
        ("--structure bad.toml", "no supports: name some in bad.toml"),
        ("--structure nounit.toml", "the unit of the grid is not known"),
    ],
)
def test_what_cannot_be_swept_is_one_line(
    words: str, said: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.toml").write_text("unit = 'm'")
    Path("nounit.toml").write_text("supports = 'boundary'")
    assert main(f"sweep scan.npy --length 4 --workers 1 -o out {words}".split()) == 2
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1 and not Path("out").exists()


def test_a_rise_is_a_scale_in_z() -> None:
    grid = dome(6, 40.0)
    settings = StructureSettings(scale=50, supports="boundary", loads=("self", "snow:1kN/m2"))
    made = solve_variants(grid, Variants(settings, ("boundary",), (1.0, 1.5)))
    steep = solve_variants(grid.replace(nodes=grid.nodes * [1, 1, 1.5]), Variants(settings, ("boundary",), (1.0,)))
    assert made[1].mass == steep[0].mass > made[0].mass and made[1].displacement == steep[0].displacement


def test_the_lightest_is_one_that_passed() -> None:
    figures = [
        VariantFigures("a", 1.0, mass=1.0, warnings=("slender",)),
        VariantFigures("b", 1.0, mass=3.0),
        VariantFigures("c", 1.0, mass=2.0),
        VariantFigures("d", 1.0, fault="a mechanism"),
    ]
    assert lightest(figures) is figures[2] and lightest(figures[:1]) is None
