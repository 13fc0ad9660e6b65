"""Length fields from the command line, from files and in settings: what is read, what is kept, what is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_clouds import cap, sheet
from typed import known

import scantruss as st
from scantruss.cli.main import main
from scantruss.errors import FormatError, InputError
from scantruss.scan.formats.lengths import read_lengths
from scantruss.settings import Settings

ROWS = ((1.0, 2.0, -3.0, 1.5), (4.0, 5.0, 6.5, 2.0))


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scan of a plate of 12 x 8 with points 0.25 apart, and a file of lengths on it."""
    folder = tmp_path_factory.mktemp("plate")
    np.savetxt(folder / "plate.xyz", sheet(12.0, 8.0, 0.25))
    (folder / "lengths.csv").write_text("x,y,z,length\n-5,0,0,0.9\n0,1,0,1.2\n5,0,0,2\n")
    return folder


def run(*words: Any) -> int:
    """Run a command; return its exit status."""
    return main([str(word) for word in words])


@pytest.mark.parametrize(
    "text",
    [
        "1,2,-3,1.5\n4,5,6.5,2\n",
        "x,y,z,length\n1,2,-3,1.5\n4,5,6.5,2",
        "1;2;-3;1,5\r\n4;5;6,5;2,0\r\n",
        "1\t2\t-3\t1.5\n4\t5\t6.5\t2",
        "# desired lengths\n1 2 -3 1.5\n\n 4  5  6.5  2 \n",
        "name,x,y,z,nz,Member length [mm]\na,1,2,-3,0,1.5\nb,4,5,6.5,1,2\n",
        "length x y z\n1.5 1 2 -3\n2 4 5 6.5\n",
        "\ufeffx;y;z;l\n1;2;-3;1.5\n4;5;6.5;2\n",
    ],
)
def test_lengths_are_read_from_any_text(tmp_path: Path, text: str) -> None:
    (tmp_path / "lengths.csv").write_text(text, encoding="utf-8")
    assert read_lengths(tmp_path / "lengths.csv") == list(ROWS)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,2,-3\n4,5,6.5\n", "line 1: needs four numbers"),
        ("x,y,z,length\n1,2,-3,1.5\n4,5,6.5\n", "line 3: needs four numbers"),
        ("1 2 3 long\n", "needs four numbers"),
        ("", "empty"),
        ("no numbers here\n", "no line with three numbers"),
    ],
)
def test_a_file_without_lengths_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "lengths.csv").write_text(text)
    with pytest.raises(FormatError, match=words):
        read_lengths(tmp_path / "lengths.csv")


@pytest.mark.parametrize(
    ("field", "words"),
    [
        ("curvature:9:3", "write curvature:3:9"),
        ("curvature:0:3", "must be positive"),
        ("curvature:3", "curvature:MIN:MAX"),
        ("curvature:a:b", "curvature:MIN:MAX"),
        ("curvature:1:nan", "curvature:MIN:MAX"),
        ("bends:1:2", "curvature:MIN:MAX"),
        ([], "no rows"),
        ([(1, 2, 3)], "four numbers"),
        (7, "four numbers"),
        ([(1, 2, 3, 0.0)], "positive lengths"),
        ([(1, 2, 3, -1.0)], "positive lengths"),
        ([(1, 2, np.nan, 1.0)], "finite"),
    ],
)
def test_a_field_that_is_none_is_refused(field: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Settings(length_field=field)


def test_the_shortest_length_stands_for_the_field() -> None:
    rows: Any = np.array(ROWS)
    assert Settings(length_field=rows).length == 1.5
    assert Settings(length_field="curvature:2:5").length == 2.0
    assert Settings(length=4.7).length_field == ""


@pytest.mark.parametrize("field", [ROWS, "curvature:0.1:7"])
def test_settings_with_a_field_are_kept_exactly(tmp_path: Path, field: Any) -> None:
    settings = Settings(length_field=field, method="paper")
    (tmp_path / "kept.json").write_text(json.dumps(settings.to_dict()))
    assert Settings.read(tmp_path / "kept.json") == settings
    assert Settings.from_dict({"length_field": field, "method": "paper"}) == settings


def test_a_run_with_a_file_of_lengths_is_repeated_by_its_settings(
    plate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        run("grid", plate / "plate.xyz", tmp_path / "a.json", tmp_path / "a.csv", "--length", plate / "lengths.csv")
        == 0
    )
    assert "length / desired, mean" in capsys.readouterr().out
    assert run("grid", plate / "plate.xyz", tmp_path / "b.json", "--settings", tmp_path / "a.settings.json") == 0
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    grid = st.read_grid(tmp_path / "a.json")
    assert known(grid.desired).min() < 1.0 and known(grid.desired).max() > 1.7
    assert grid.quality.stretch_cv == json.loads((tmp_path / "a.json").read_text())["quality"]["stretch_cv"] < 0.1
    assert "desired_length" in (tmp_path / "a_nodes.csv").read_text().splitlines()[0]
    assert (
        run("grid", plate / "plate.xyz", tmp_path / "c.json", "--settings", tmp_path / "a.settings.json", "--length", 1)
        == 0
    )
    plain = json.loads((tmp_path / "c.json").read_text())
    assert "desired" not in plain and "stretch_cv" not in plain["quality"] and plain["settings"]["length_field"] == ""


def test_info_takes_a_field(plate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("info", plate / "plate.xyz", "--length", "curvature:1:2") == 0
    assert "boundaries for members of 1 to 2:" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("length", "words"),
    [
        ("curvature:2:1", "curvature:2:1: the shortest length is above the longest; write curvature:1:2"),
        ("curvature:0.5:1", "the shortest length of the length field, 0.5 is too small for points that are"),
        (
            "curvature:1:20",
            "the longest length of the length field, 20 is too large for a scan whose longest side is 12",
        ),
        ("5 0 9 1.2", "1 of 2 given lengths lie off the scan, as that at (5, 0, 9)"),
        ("5 0 1.6 1.2", "1 of 2 given lengths lie off the scan, as that at (5, 0, 1.6)"),
        (
            "missing.csv",
            "--length: needs a number, a file of lengths or curvature:MIN:MAX; there is no file missing.csv",
        ),
    ],
)
def test_a_field_that_the_scan_cannot_carry_is_refused(
    plate: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    length: str,
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    if " " in length:
        (tmp_path / "far.xyz").write_text(f"-5 0 0 1\n{length}\n")
        length = "far.xyz"
    assert run("grid", plate / "plate.xyz", "out.obj", "--length", length) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1 and not (tmp_path / "out.obj").exists()


def test_a_grid_does_not_overwrite_its_lengths(plate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lengths = tmp_path / "lengths.csv"
    lengths.write_bytes((plate / "lengths.csv").read_bytes())
    assert run("grid", plate / "plate.xyz", lengths, "--length", lengths) == 2
    assert "would overwrite the file of lengths" in capsys.readouterr().err


def test_national_coordinates_and_a_python_call() -> None:
    offset = np.array([5e5, 4e6, 100.0])
    points = cap(6.0, 1.0, 0.25)
    field: Any = np.column_stack([points[::400], 1.0 + 0.5 * (points[::400, 0] > 0)])
    here = st.grid_from_points(points, Settings(length_field=field))
    there = st.grid_from_points(points + offset, Settings(length_field=field + [*offset, 0.0]))
    assert np.array_equal(here.triangles, there.triangles)
    assert np.allclose(here.nodes + here.origin + offset, there.nodes + there.origin, atol=1e-6)
    assert np.allclose(known(here.desired), known(there.desired), rtol=1e-6)
