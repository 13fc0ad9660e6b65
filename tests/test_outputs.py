"""No command writes over what it reads, and none reads where it could not write: both are refused at the start."""

import os
from pathlib import Path

import numpy as np
import pytest
from shapes import make
from small_grids import fan

from scantruss.cli.main import main
from scantruss.export.formats import write
from scantruss.scan.formats import reading  # here, so that none of them is loaded while another is barred
from scantruss.scan.stream import fit, opened
from scantruss.settings import Settings

RING = "-99,-99\n99,-99\n99,99\n-99,99\n"
LENGTHS = "x,y,z,length\n0,0,0,5\n9,9,9,6\n"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two scans and all other things that commands read; results may go to the folder out."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SCANTRUSS_TRACEBACK", "1")
    Path("out").mkdir()
    for name in ("a.xyz", "b.xyz", "out/table.csv"):
        np.savetxt(name, make("scallop", 500).points, delimiter="," if "csv" in name else " ")
    Path("out/table.md").write_text(RING)
    Path("out/index.html").write_text(LENGTHS)
    Path("poses.txt").write_text("{}")
    write(fan(settings=Settings(length=1.0)), "out/grid.json")
    Path("grid.stl").write_bytes(Path("out/grid.json").read_bytes())
    return tmp_path


def refused(capsys: pytest.CaptureFixture[str], words: list[str]) -> str:
    """Run a command that must be refused without a byte written or read of a scan; return what it says."""
    held = {path: path.is_file() and path.read_bytes() for path in Path().rglob("*")}
    assert main(words) == 2
    assert {path: path.is_file() and path.read_bytes() for path in Path().rglob("*")} == held
    said = capsys.readouterr()
    assert not said.out and said.err.count("\n") == 1
    return said.err


@pytest.fixture
def unread(place: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same, where no scan may be read."""
    for module, name in ((reading, "read_points"), (opened, "open_scan"), (fit, "spacing_to_fit")):
        monkeypatch.setattr(module, name, lambda *_, **__: pytest.fail("a scan was read"))
    return place


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("sweep out/table.csv --length 1 -o out", "out/table.csv would overwrite the scan"),
        ("sweep out/*.csv --length 1,2 -o ./out/../out", "table.csv would overwrite the scan"),
        ("sweep a.xyz --length 1 --fixed-file out/table.csv -o out", "would overwrite the list of fixed nodes"),
        ("sweep a.xyz --length 1 --fixed-line out/table.csv -o out", "would overwrite the fixed line"),
        ("sweep a.xyz --length 1 --crop out/table.md -o out", "out/table.md would overwrite the polygon"),
        ("sweep a.xyz --length 9,out/index.html -o out", "out/index.html would overwrite the file of lengths"),
        ("sweep a.xyz --settings out/grid.json -o out", "out/grid.json would overwrite the settings"),
        ("thin a.xyz b.xyz -o b.xyz --spacing 1", "the thinned scan b.xyz would overwrite the scan"),
        ("clean *.xyz a.xyz", "the clean cloud a.xyz would overwrite the scan"),
        ("splice a.xyz b.xyz -o ./b.xyz", "the merged cloud b.xyz would overwrite the scan"),
        ("splice a.xyz b.xyz -o poses.txt --poses poses.txt", "the merged cloud poses.txt would overwrite the poses"),
        ("grid a.xyz out/grid.json --settings out/grid.json", "the grid out/grid.json would overwrite the settings"),
        ("grid a.xyz out/table.csv --length 1 --fixed-file out/table.csv", "would overwrite the list of fixed nodes"),
        (
            "print grid.stl ./grid.stl --member-diameter 1 --node-diameter 2",
            "the model grid.stl would overwrite the grid",
        ),
    ],
)
def test_nothing_that_is_read_is_written_over(
    unread: Path, capsys: pytest.CaptureFixture[str], words: str, line: str
) -> None:
    assert line in refused(capsys, words.split())


@pytest.mark.parametrize(
    "words",
    [
        "sweep a.xyz --length 1 -o out",
        "sweep a.xyz --length 1 -o new/folder",
        "thin a.xyz -o out/thin.xyz --spacing 1",
        "clean a.xyz out/clean.xyz",
        "splice a.xyz b.xyz -o out/whole.xyz",
        "grid a.xyz out/a.obj --length 1",
        "demo out",
    ],
)
def test_a_folder_that_cannot_be_written_to_is_refused_at_the_start(
    unread: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert "no permission to write in the folder" in refused(capsys, words.split())


@pytest.mark.parametrize("words", ["sweep a.xyz --length 1 -o b.xyz/deep", "demo b.xyz/deep", "demo b.xyz"])
def test_a_folder_in_a_file_is_refused_at_the_start(
    unread: Path, capsys: pytest.CaptureFixture[str], words: str
) -> None:
    assert "b.xyz is a file; name a folder" in refused(capsys, words.split())


def test_each_stage_of_a_run_is_told_to_who_looks_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also writing pictures and solids, which take long."""
    from scantruss.report.terminal import Bars

    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(1)
    told: list[str] = []
    monkeypatch.setattr(Bars, "__call__", lambda _, stage, share: told.append(stage))
    np.save("scan.npy", np.column_stack([rng.uniform(0, 12, (4000, 2)), np.zeros(4000)]))
    assert main(["grid", "scan.npy", "a.json", "a.png", "--length", "1.5", "--effort", "quick"]) == 0
    assert list(dict.fromkeys(told)) == ["read", "boundary", "front", "optimize", "write"]
    told.clear()
    assert main(["print", "a.json", "a.3mf", "--member-diameter", "0.1", "--node-diameter", "0.2"]) == 0
    assert told == ["solid"]
