"""A structure says what the certificate of its grid warns of, and that the weight of its members is not among its loads."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from small_grids import dome

import scantruss as st
from scantruss.cli.main import main
from scantruss.grid.certificate import Certificate, Fault
from scantruss.structure.report import report_structure

WARNINGS = (
    Fault("gap", "bridges a gap 0.48 m wide", (1.0, 2.0, 3.0)),
    Fault("aside", "leaves out 27.6% of the points that were read"),
)


def saved(folder: Path, warnings: tuple[Fault, ...]) -> str:
    """A saved grid whose certificate has some warnings."""
    found = Certificate("m", 1.0, True, True, 1, 1, 1, 1, 1, 0, warnings=warnings)
    st.write(dome(5, unit="m", certificate=found), folder / "grid.json")
    return str(folder / "grid.json")


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_structure_repeats_the_warnings_of_its_grid(
    count: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    grid = saved(tmp_path, WARNINGS[:count])
    html, figures = tmp_path / "roof.html", tmp_path / "roof-report.json"
    assert main(["structure", grid, str(html), "--supports", "boundary", "--report", str(figures)]) == 0
    said, page = capsys.readouterr().out, html.read_text(encoding="utf-8")
    assert ("bridges a gap" in said) == (count > 0) and said.count("the grid bridges") <= 1
    assert [warning.words in page for warning in WARNINGS] == [k < count for k in range(2)]
    listed = json.loads(figures.read_text())["warnings_of_grid"]
    assert len(listed) == count and (count == 0 or listed[0].endswith("(near 1, 2, 3)"))


def test_the_faults_of_a_grid_that_failed_are_repeated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = Certificate("m", 1.0, True, True, 1, 1, 1, 1, 1, 0, faults=(replace(WARNINGS[0], words="is torn"),))
    st.write(dome(5, unit="m", certificate=found), tmp_path / "grid.json")
    outs = [str(tmp_path / "roof.html"), "--supports", "boundary", "--keep-failed"]
    assert main(["structure", str(tmp_path / "grid.json"), *outs]) == 0
    assert "FAILED its certificate: it is torn" in capsys.readouterr().out
    assert "is torn" in (tmp_path / "roof.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("loads", "warned"), [("self", False), ("self,snow:1kN/m2", False), ("snow:1kN/m2", True)])
def test_loads_without_the_weight_of_the_members_are_warned_of(loads: str, warned: bool) -> None:
    truss = st.Truss.from_grid(dome(5, unit="m"), supports="boundary", loads=loads)
    warnings = report_structure(st.solve(truss)).warnings
    assert any("weight of the members is not among the loads" in words for words in warnings) == warned
