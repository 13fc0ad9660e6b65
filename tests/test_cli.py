"""The command line: what it writes, what it says, and that every refusal is one line with nothing written."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import fields, replace
from pathlib import Path
from textwrap import indent, wrap
from typing import Any, Never

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import cKDTree
from typed import known, xyz

import scantruss as st
from scantruss.cli import demo, grid
from scantruss.cli import main as cli
from scantruss.cli.demo_files import DEMOS
from scantruss.cli.main import main
from scantruss.cli.options import option_of
from scantruss.errors import CertificateError, FrontError, words_of_place
from scantruss.export.drawing.legend import FAULT_COLOUR
from scantruss.export.formats import write
from scantruss.grid.grid import Grid
from scantruss.scan import member_length
from scantruss.scan.cloud import PointCloud, measure_gap, measure_spacing

LENGTH = "4"


def plate(count: int = 8000, seed: int = 3) -> np.ndarray:
    """Points on a slightly arched plate of 40 x 30."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 40, count), rng.uniform(0, 30, count)
    return np.stack([x, y, 0.02 * x * (40 - x)], axis=1)


def moebius(count: int = 12000, seed: int = 3) -> np.ndarray:
    """Points on a one-sided strip, radius 40, width 24."""
    rng = np.random.default_rng(seed)
    turn, across = rng.uniform(0, 2 * np.pi, count), rng.uniform(-12, 12, count)
    radius = 40 + across * np.cos(turn / 2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), across * np.sin(turn / 2)], axis=1)


def hexagon() -> Grid:
    """A grid of six triangles around one node."""
    turn = np.arange(6) * np.pi / 3
    nodes = np.vstack([np.zeros(3), np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)])
    triangles = np.array([(0, i + 1, (i + 1) % 6 + 1) for i in range(6)])
    return Grid(nodes, triangles, np.zeros(7, bool), np.zeros(3), settings=st.Settings(length=1.0))


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with a scan in it, which is where the command runs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SCANTRUSS_TRACEBACK", "1")
    np.savetxt("scan.xyz", plate(), fmt="%.6f")
    return tmp_path


@pytest.fixture
def ready(place: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same, with a finished grid in place of the long work."""
    for command in (grid, demo):
        monkeypatch.setattr(command, "read_scan", lambda *_: PointCloud.from_array(plate()))
        monkeypatch.setattr(command, "grid_with_notes", lambda *_, **__: hexagon())
    return place


def refused(capsys: pytest.CaptureFixture[str], *words: Any, status: int = 2) -> str:
    """Run a command that must be refused; return the one line that it says."""
    names = sorted(entry.name for entry in os.scandir("."))
    assert main(words) == status
    said = capsys.readouterr()
    *_, last = said.err.splitlines()  # notes may come before
    assert last.startswith("scantruss: ") and said.err.count("scantruss: ") == 1 and said.err.endswith("\n")
    assert sorted(entry.name for entry in os.scandir(".")) == names, "something was written"
    return said.err


# ---- refused: words ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("cut a b", "no command 'cut'"),
        ("gird a b", "no command 'gird' (did you mean grid?)"),
        ("thin scan.xyz out.ply --spacing 1", "missing OUT, the file of the result; write it as -o OUT"),
        ("splice a.xyz b.xyz c.xyz", "missing OUT, the file of the result; write it as -o OUT"),
        ("grid", "missing SCAN"),
        ("grid scan.xyz", "missing OUT"),
        ("grid scan.xyz a.obj --length", "--length: expected one argument"),
        (
            "grid scan.xyz a.obj --length abc",
            "--length: needs a number, a file of lengths or curvature:MIN:MAX, got 'abc'",
        ),
        (
            "grid scan.xyz a.obj --length 4,7",
            "--length: needs a number, a file of lengths or curvature:MIN:MAX; write 4.7 with a point, not 4,7",
        ),
        ("grid scan.xyz a.obj --length ,7", "write .7 with a point, not ,7"),
        ("grid scan.xyz a.obj --length 1500mm", "in the unit of the scan, without mm"),
        ("grid scan.xyz a.obj --length 1,5m", "in the unit of the scan, without m"),
        (
            "grid scan.xyz a.obj --length 1/2",
            "--length: needs a number, a file of lengths or curvature:MIN:MAX, got '1/2'",
        ),
        ("grid scan.xyz a.obj --length lengths.csv", "there is no file lengths.csv"),
        (
            "grid scan.xyz a.obj --length 4 --ridge-angle 40,5",
            "--ridge-angle: needs a number; write 40.5 with a point, not 40,5",
        ),
        (
            "grid scan.xyz a.obj --length 4 --allow-missing 5%",
            "--allow-missing: needs a number without %, got 5%; one percent is 0.01",
        ),
        (
            "clean scan.xyz a.xyz --spacing 20mm",
            "--spacing: needs a number without mm, got 20mm; --help names its unit",
        ),
        ("grid scan.xyz a.obj --length 4 --boundary no.csv", "cannot read boundaries no.csv"),
        ("grid scan.xyz a.obj --lenght 4", "unknown option --lenght (did you mean --length?)"),
        ("grid scan.xyz --output a.obj --length 4", "unknown option --output (did you mean --out?)"),
        ("grid scan.xyz a.obj -l 4", "unknown option -l (did you mean --length?)"),
        ("clean scan.xyz a.ply --overwrite", "unknown option --overwrite (did you mean --force?)"),
        ("grid scan.xyz a.obj --scale 2", "unknown option --scale;"),
        ("grid scan.xyz a.obj --length 4 --merge-angle wide", "--merge-angle: needs a number"),
        ("grid scan.xyz a.obj --length 4 --smooth-passes 1.5", "--smooth-passes: needs a whole number"),
        ("grid scan.xyz a.obj --length 4 --fixed 1,2", "--fixed: needs three numbers X,Y,Z, got '1,2'"),
        ("grid scan.xyz a.obj --length 4 --fixed -1,-2", "--fixed: needs three numbers X,Y,Z, got '-1,-2'"),
        ("grid scan.xyz a.obj --length 4 --fixed 1,2,nan", "three finite coordinates"),
        ("grid scan.xyz a.obj --length 4 --fixed-file no.csv", "no.csv"),
        ("grid scan.xyz a.obj --settings no.json", "no.json"),
        ("grid scan.xyz a.obj --settings scan.xyz", "scan.xyz is not a settings file"),
        ("grid scan.xyz a.obj --length 4 --method best", "method must be one of default paper"),
        ("grid scan.xyz a.obj --length 4 --unit furlong", "unit must be one of mm cm m inch foot"),
        ("grid scan.xyz a.obj --length 4 --advance-from inside", "advance_from must be one of external all"),
        ("grid scan.xyz a.obj --length 4 --max-deviation -1", "max_deviation must be greater than 0"),
        ("info", "missing SCAN"),
        ("info scan.xyz other.xyz", "too many arguments: other.xyz"),
        ("print grid.json", "missing "),
        ("print grid.json --scale 1:0", "--scale: needs a scale such as 0.01 or 1:100, got '1:0'"),
        ("demo a b", "too many arguments: b"),
    ],
)
def test_words_that_cannot_be_understood_are_refused(
    place: Path, capsys: pytest.CaptureFixture[str], words: str, line: str
) -> None:
    assert line in refused(capsys, *words.split())


@pytest.mark.parametrize("length", ["0", "-3", "-.5", "-1e3", "nan", "inf", "-inf"])
@pytest.mark.parametrize("command", ["grid scan.xyz a.obj", "info scan.xyz"])
def test_a_length_that_is_no_positive_number_is_refused(
    place: Path, capsys: pytest.CaptureFixture[str], command: str, length: str
) -> None:
    assert "length must be a positive number" in refused(capsys, *command.split(), "--length", length)


# ---- refused: files ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("out", "line"),
    [
        ("a.xyzzy", "no format for"),
        ("a", "no format for"),
        ("a.stl", "scantruss print"),
        ("missing/a.obj", "missing does not exist"),
        ("scan.xyz/a.obj", "is a file, not a folder"),
        ("folder.obj", "it is a folder"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_before_the_scan_is_read(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, out: str, line: str
) -> None:
    (place / "folder.obj").mkdir()
    monkeypatch.setattr(grid, "read_scan", lambda *_: pytest.fail("the scan was read"))
    assert line in refused(capsys, "grid", "scan.xyz", "good.obj", out, "--length", LENGTH)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ("a.obj a.obj", "would overwrite the grid"),
        ("a.obj --report missing/a.json", "missing does not exist"),
        ("a.obj --report a.txt", "no format for"),
        ("a.json --report a.json", "would overwrite the grid"),
        ("a.obj --report a.settings.json", "is where the settings of this run are saved"),
        ("a.obj a.settings.json", "is where the settings of this run are saved"),
    ],
)
def test_outputs_in_each_others_way_are_refused(
    ready: Path, capsys: pytest.CaptureFixture[str], words: str, line: str
) -> None:
    assert line in refused(capsys, "grid", "scan.xyz", *words.split(), "--length", LENGTH)


def test_the_scan_is_never_overwritten(ready: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (ready / "scan.ply").write_bytes(b"the scan")
    assert "would overwrite the scan" in refused(capsys, "grid", "scan.ply", "scan.ply", "--length", LENGTH)


WRONG = {
    "empty": b"",
    "picture": b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 4,
    "prose": b"It was a dark and stormy night;\nthe rain fell in torrents.\n",
    "half a ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 1000\nproperty float x\n",
}


@pytest.mark.parametrize(
    "suffix", [".ply", ".xyz", ".csv", ".pts", ".las", ".laz", ".obj", ".stl", ".off", ".npy", ".npz"]
)
@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("command", ["grid {} a.obj --length 4", "info {}"])
def test_a_scan_that_is_not_what_its_suffix_says_is_refused(
    place: Path, capsys: pytest.CaptureFixture[str], suffix: str, kind: str, command: str
) -> None:
    (place / f"bad{suffix}").write_bytes(WRONG[kind])
    assert f"bad{suffix}" in refused(capsys, *command.format(f"bad{suffix}").split())


@pytest.mark.parametrize("command", ["grid {} a.obj --length 4", "info {}"])
@pytest.mark.parametrize("name", ["missing.ply", "scan.docx", "folder.ply"])
def test_a_scan_that_is_not_there_is_refused(
    place: Path, capsys: pytest.CaptureFixture[str], command: str, name: str
) -> None:
    (place / "folder.ply").mkdir()
    (place / "scan.docx").write_bytes(b"PK")
    assert name.partition(".")[2] in refused(capsys, *command.format(name).split())


@pytest.mark.parametrize(
    ("points", "line"),
    [
        (np.array([[0.0, 0, 0], [1, 0, 0]]), "point"),
        (np.outer(np.linspace(0, 9, 50), [1, 2, 3.0]), "line"),
        (np.zeros((50, 3)), ""),
        (np.full((50, 3), np.nan), ""),
        (np.full((50, 3), np.inf), ""),
    ],
    ids=["two points", "a line", "one place", "nan", "infinite"],
)
@pytest.mark.parametrize("command", ["grid bad.xyz a.obj --length 4", "info bad.xyz"])
def test_points_that_span_no_surface_are_refused(
    place: Path, capsys: pytest.CaptureFixture[str], points: np.ndarray, line: str, command: str
) -> None:
    np.savetxt("bad.xyz", points)
    assert line in refused(capsys, *command.split())


# ---- refused: lengths that the scan cannot carry -------------------------------------------------------------------


@pytest.mark.parametrize("command", ["grid scan.xyz a.obj", "info scan.xyz"])
def test_a_length_larger_than_the_scan_is_refused(
    place: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    line = refused(capsys, *command.split(), "--length", "41")
    assert "length 41 is too large for a scan whose longest side is 40; use at most " in line
    largest = float(line.split("at most")[1].split(";")[0])
    cloud = PointCloud.from_array(plate())
    assert largest == member_length.length_range(cloud)[1]
    member_length.check_length(cloud, st.Settings(length=largest))


def test_a_length_too_small_for_the_spacing_is_refused_with_one_that_does(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refused(capsys, "grid", "scan.xyz", "a.obj", "--length", "0.01")
    smallest = float(line.split("at least")[1].split(";")[0])
    cloud = PointCloud.from_array(plate())
    assert smallest == member_length.length_range(cloud)[0]
    member_length.check_length(cloud, st.Settings(length=smallest))
    least = max(3.0 * measure_spacing(cloud.points), 1.75 * measure_gap(cloud.points))
    member_length.check_length(cloud, st.Settings(length=1.001 * least))
    with pytest.raises(st.InputError, match="too small"):
        member_length.check_length(cloud, st.Settings(length=0.999 * least))


def test_a_quick_look_at_many_points_takes_no_length_that_all_of_them_refuse() -> None:
    rng = np.random.default_rng(4)
    cloud = PointCloud.from_array(np.column_stack([rng.uniform(0, 30, (50_000, 2)), np.zeros(50_000)]))
    low, high = member_length.exact_range(cloud)
    for share in np.geomspace(0.3, 0.999, 8):
        with pytest.raises(st.InputError, match="too small"):
            member_length.check_length(cloud, st.Settings(length=share * low))
        with pytest.raises(st.InputError, match="too large"):
            member_length.check_length(cloud, st.Settings(length=high / share))
    for length in np.geomspace(1.001 * low, 0.999 * high, 8):
        member_length.check_length(cloud, st.Settings(length=length))


def test_the_gap_is_that_of_a_known_pattern() -> None:
    x, y = np.meshgrid(np.arange(40.0), np.arange(40.0))
    triangular = np.stack([(x + 0.5 * (y % 2)).ravel(), (y * np.sqrt(0.75)).ravel(), 0 * x.ravel()], axis=1)
    assert measure_gap(7 * triangular) == pytest.approx(7)
    assert 2 < measure_gap(plate()) / measure_spacing(plate()) < 3.5


@pytest.mark.parametrize("value", [1e-7, 0.0123, 0.99, 1.0, 9.99, 12345.6, 8e9])
def test_rounding_keeps_two_digits_and_its_direction(value: float) -> None:
    assert member_length.round_length(value, "down") <= value * (1 + 1e-9)
    assert member_length.round_length(value, "up") >= value * (1 - 1e-9)
    assert member_length.round_length(value, "nearest") == pytest.approx(value, rel=0.05)


def test_a_one_sided_surface_is_refused(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.savetxt("moebius.xyz", moebius(), fmt="%.6f")
    assert "one-sided" in refused(capsys, "grid", "moebius.xyz", "a.obj", "--length", "5")


# ---- refused: runs that end early ----------------------------------------------------------------------------------


def test_a_full_disk_leaves_nothing_behind(ready: Path, capsys: pytest.CaptureFixture[str]) -> None:
    resource = pytest.importorskip("resource")
    kept = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (300, kept[1]))
        line = refused(capsys, "grid", "scan.xyz", "a.csv", "a.json", "--length", LENGTH)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, kept)
    assert "cannot write a.csv" in line


@pytest.mark.parametrize(("stop", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_stopped_run_leaves_nothing_behind(
    ready: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, stop: signal.Signals, status: int
) -> None:
    monkeypatch.setattr("scantruss.runtime.files.SaveTogether.json", lambda *_: os.kill(os.getpid(), stop))
    refused(capsys, "grid", "scan.xyz", "a.obj", "--length", LENGTH, status=status)


def test_a_failing_run_keeps_the_files_of_the_run_before(
    ready: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (ready / "a.obj").write_text(before := "# ScanTruss 0.1.0, of the run before")
    error = FrontError("the front stopped", where=(1.0, 2.0, 3.0))
    monkeypatch.setattr("scantruss.runtime.files.SaveTogether.json", lambda *_: (_ for _ in ()).throw(error))
    assert "near 1, 2, 3" in refused(capsys, "grid", "scan.xyz", "a.obj", "--length", LENGTH)
    assert (ready / "a.obj").read_text() == before


# ---- what is said and written --------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", [["--version"], ["grid", "no-such-file.ply", "grid.obj", "--length", "1"]])
def test_a_command_leaves_the_signals_as_they_were(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    kept = signal.getsignal(signal.SIGTERM)
    main(words)
    assert signal.getsignal(signal.SIGTERM) == kept


def test_help_and_version_import_nothing_heavy() -> None:
    heavy = "numpy numba rich scipy trimesh laspy matplotlib"
    code = (
        "import sys, scantruss.cli.main as cli\n"
        "for words in '--help', 'grid --help', 'clean --help', 'info -h', 'print --help', 'structure -h', 'demo -h', '--version', '':\n"
        "    assert cli.main(words.split()) == 0\n"
        f"assert not set('{heavy}'.split()) & set(sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    said = done.stdout.replace(",", " ")  # --clean, --no-clean
    assert all(f"{option_of(spec.name)} " in said for spec in fields(st.Settings))
    assert f"scantruss {st.__version__}\n" in done.stdout


def test_a_grid_is_made_without_what_other_commands_and_formats_load(ready: Path) -> None:
    others = "scipy matplotlib openpyxl ezdxf rhino3dm viser dask threadpoolctl scantruss.cli.sweep"
    others += " scantruss.structure.truss scantruss.layouts.double_layer scantruss.cells.hexagons"
    code = (
        "import sys, scantruss.cli.main as cli\n"
        f"assert cli.main('grid scan.xyz light.json --length {LENGTH} --effort quick -q'.split()) == 0\n"
        f"print(sorted(set('{others}'.split()) & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ready)
    assert done.stdout.splitlines()[-1] == "[]"


def test_grid_writes_all_it_was_asked_for_and_its_settings(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fixed = "20,15,8"
    words = [
        "grid",
        "scan.xyz",
        "a.obj",
        "--length",
        LENGTH,
        "b.json",
        "--unit",
        "mm",
        "--fixed",
        fixed,
        "--report",
        "r.json",
    ]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "shape quality, mean" in said and "boundary loop" in said and "seconds" in said
    assert "certificate: passed, " in said and "triangle farthest from the scan" in said
    assert sorted(entry.name for entry in place.iterdir()) == [
        "a.obj",
        "a.settings.json",
        "b.json",
        "r.json",
        "scan.xyz",
    ]
    assert st.Settings.read("a.settings.json") == st.Settings(length=4.0, unit="mm", fixed=((20, 15, 8),))


@pytest.fixture
def failing(place: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """No grid can pass, and not many are made."""
    monkeypatch.setattr("scantruss.check.defects.UNEVEN_LENGTHS", 0.0)
    monkeypatch.setattr("scantruss.attempts.limit.MOST_RUNS", 2)
    return place


def test_a_grid_that_fails_its_certificate_is_not_written(failing: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = refused(capsys, "grid", "scan.xyz", "a.json", "--length", LENGTH, status=3)
    assert "members whose lengths are" in line and "(near " in line


@pytest.mark.parametrize("keep", [(), ("--keep-failed",)])
def test_the_picture_of_a_grid_that_fails_is_written_and_shows_its_places_in_red(
    failing: Path, capsys: pytest.CaptureFixture[str], keep: tuple[str, ...]
) -> None:
    words = ["grid", "scan.xyz", "a.png", "a.json", "--length", LENGTH, "--report", "r.json", *keep]
    assert main(words) == 3
    assert "wrote a.png, which shows the places in red; nothing else is written" in capsys.readouterr().err or keep
    written = {file.name for file in failing.iterdir()} - {"scan.xyz"}
    assert written == ({"a.png", "a.json", "a.settings.json", "r.json"} if keep else {"a.png"})
    picture = np.asarray(Image.open("a.png").convert("RGB")).astype(float)
    assert (np.abs(picture - 255 * FAULT_COLOUR).max(axis=2) < 2).sum() > 60


def test_where_no_grid_came_out_the_picture_shows_the_place_on_the_scan(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    where = xyz(np.loadtxt("scan.xyz")[70])

    def fails(*_: Any, **__: Any) -> Never:
        raise st.FrontError("the front runs over itself", where=where)

    monkeypatch.setattr("scantruss.pipeline.make_grid", fails)
    for name, size in (("a.png", "800x600"), ("b.png", "400x700")):
        assert main(["grid", "scan.xyz", name, "--length", LENGTH, "--size", size, "--no-clean"]) == 2
        said = capsys.readouterr().err
        assert f"wrote {name}" in said
        picture = np.asarray(Image.open(name).convert("RGB")).astype(float)
        high, wide, _ = picture.shape
        lines = len(wrap(said.splitlines()[-1].removeprefix("scantruss: ").rpartition(" (near ")[0], 110))
        top = high - round(
            high - (2 + 1.6 * lines) * 22.0 * min(wide / 1600, high / 1200)
        )  # of the scan, below the words
        red = np.argwhere(np.abs(picture - 255 * FAULT_COLOUR).max(axis=2) < 60)
        low = red[red[:, 0] > 120]  # below the words
        at = (low.min(axis=0) + low.max(axis=0)) / 2
        seen = _seen(np.loadtxt("scan.xyz"), where, (high - top, wide, 3)) + [0, top]
        assert np.linalg.norm(at[::-1] - seen) < 3


def _seen(points: np.ndarray, where: tuple[float, float, float], shape: tuple[int, ...]) -> np.ndarray:
    """Where a place is in a picture from obliquely above that the points fill to nine tenths [pixel], from the top left."""
    turn, tilt = np.radians(-35.0), np.radians(35.0)
    right = np.array([np.cos(turn), -np.sin(turn), 0.0])
    up = np.array([np.sin(tilt) * np.sin(turn), np.sin(tilt) * np.cos(turn), np.cos(tilt)])
    flat, place = points @ np.array([right, up]).T, np.array([right, up]) @ where
    low, high = flat.min(axis=0), flat.max(axis=0)
    tall, wide = shape[:2]
    at = (place - (low + high) / 2) * 0.9 * min(wide / (high - low)[0], tall / (high - low)[1])
    return np.array([wide / 2 + at[0], tall / 2 - at[1]])


def test_a_failed_grid_is_written_where_that_is_asked_for_and_says_so(
    failing: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["grid", "scan.xyz", "a.json", "a.obj", "--length", LENGTH, "--report", "r.json", "--keep-failed"]
    assert main(words) == 3
    said = capsys.readouterr()
    assert "certificate: FAILED: the grid has members whose lengths are" in said.out and "wrote a.json" in said.out
    assert said.err.startswith("scantruss: ") and said.err.count("\n") == 1
    assert (failing / "a.obj").exists()
    for name in ("a.json", "r.json"):
        certificate = json.loads((failing / name).read_text())["certificate"]
        assert certificate["passed"] is False and certificate["faults"][0]["kind"] == "uneven"
    assert known(st.read_grid("a.json").certificate).faults[0].kind == "uneven"


@pytest.mark.parametrize("name", ["a.obj", "a.ply"])
def test_a_drawing_of_a_failed_grid_is_not_used_unless_told(
    failing: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    assert main(["grid", "scan.xyz", name, "--length", LENGTH, "--keep-failed"]) == 3
    capsys.readouterr()
    for words in (
        f"print {name} b.stl --member-diameter 1 --node-diameter 2",
        f"structure {name} b.json --scale 50",
        f"schedule {name} b.xlsx",
        f"setout {name} b.csv",
        f"convert {name} b.dxf",
    ):
        line = refused(capsys, *words.split(), status=3)
        assert f"{name} is of a grid that failed its certificate: it has members whose lengths are" in line
        assert "--keep-failed uses it anyway" in line
    assert main(["convert", name, "b.dxf", "--keep-failed"]) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--search-range 2", "--search-range: for --method paper"),
        ("--method paper --ridge-angle 20", "--ridge-angle: for the default method; --method paper does without"),
        ("--no-ridge-at 1,2,3", "no ridge passes 1, 2, 3, so --no-ridge-at changes nothing there"),
        ("--plain-at 1,2,3", "no thin limb or slit is near 1, 2, 3, so --plain-at changes nothing there"),
        ("--method paper --search-range 2", ""),
    ],
)
def test_an_option_that_changes_nothing_is_said(
    place: Path, capsys: pytest.CaptureFixture[str], words: str, said: str
) -> None:
    assert main(["grid", "scan.xyz", "a.obj", "--length", LENGTH, *words.split()]) == 0
    notes = capsys.readouterr().err
    assert said in notes if said else "for --method" not in notes and "for the default" not in notes


def test_the_report_holds_every_figure(place: Path) -> None:
    assert main(["grid", "scan.xyz", "a.obj", "--length", LENGTH, "--report", "r.json"]) == 0
    report = json.loads((place / "r.json").read_text())
    figures = (
        "shape_mean shape_std shape_min length_mean length_std length_cv angle_min angle_max valence6"
        " node_deviation_mean node_deviation_max"
    )
    names = (
        "points nodes members triangles line_members fixed_lines ridges quality before topology certificate seconds settings"
        " version made_by"
    )
    assert set(report) == set(names.split())
    assert set(report["quality"]) == set(report["before"]) == set(figures.split())
    assert set(report["topology"]) == set("components boundary_loops euler manifold orientable".split())
    assert set(report["seconds"]) == {"read", "boundary", "front", "optimize", "total"}
    assert report["seconds"]["total"] == pytest.approx(sum(report["seconds"].values()) / 2)
    assert report["settings"] | {"made_by": report["made_by"]} == json.loads((place / "a.settings.json").read_text())
    assert report["points"] == 8000
    assert report["topology"] == {
        "components": 1,
        "boundary_loops": 1,
        "euler": 1,
        "manifold": True,
        "orientable": True,
    }
    assert report["nodes"] - report["members"] + report["triangles"] == 1
    assert report["certificate"]["passed"] and report["certificate"]["faults"] == []


def test_saved_settings_repeat_a_run_to_the_byte(place: Path) -> None:
    words = "--length 4 --merge-angle 85 --case3 quadrangle --fixed 20,15,8".split()
    assert main(["grid", "scan.xyz", "a.obj", "a.json", *words]) == 0
    assert main(["grid", "scan.xyz", "b.obj", "b.json", "--settings", "a.settings.json"]) == 0
    for suffix in ("obj", "json", "settings.json"):
        assert (place / f"a.{suffix}").read_bytes() == (place / f"b.{suffix}").read_bytes()
    assert main(["grid", "scan.xyz", "c.obj", "--settings", "b.json", "--length", "5"]) == 0
    assert st.Settings.read("c.settings.json") == st.Settings.read("a.settings.json").replace(length=5.0)


def test_a_few_bad_points_are_left_out_and_counted(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    points = plate()
    points[[5, 50]] = np.nan
    np.savetxt("scan.xyz", points)
    assert main(["grid", "scan.xyz", "a.obj", "--length", LENGTH, "--report", "r.json"]) == 0
    assert "2 points with NaN or infinite coordinates are left out" in capsys.readouterr().err
    assert json.loads((place / "r.json").read_text())["points"] == 7998


def test_pieces_that_are_too_small_are_counted(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    patch = 0.1 * plate() + np.array([200.0, 0.0, 0.0])
    np.savetxt("scan.xyz", np.concatenate([plate(), patch]))
    assert main(["grid", "scan.xyz", "a.obj", "--length", LENGTH]) == 0
    said = capsys.readouterr().out
    assert said.startswith("50.0% of the scan, 8,000 of 16,000 points, is not in the grid: in pieces too small")
    assert "left out: 8,000 points (50.00%) in pieces too small for this length, near (20" in said


def test_info_says_what_a_length_can_be(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["info", "scan.xyz", "--unit", "mm"]) == 0
    said = capsys.readouterr().out
    for word in ("points   8000", "extent   ", "spacing  ", "unit     mm", "length   ", "external", "4"):
        assert word in said
    low, high = (float(word) for word in said.split("length   ")[1].split(" mm")[0].split(" to "))
    wished = float(said.split("try --length ")[1].split()[0])
    assert low <= wished <= high
    assert main(["info", "scan.xyz", "--length", "3"]) == 0
    assert "members of 3:" in capsys.readouterr().out


def test_info_tells_the_surface_from_what_outliers_make_of_the_extent(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", "scan.xyz", "--length", "3"]) == 0
    assert "without outliers" not in capsys.readouterr().out
    points = np.loadtxt("scan.xyz")[:, :3]
    far = points[::200] + np.array([0.0, 0.0, 0.4 * np.ptp(points, axis=0).max()]) * np.arange(1, 41)[:, None] / 20
    np.savetxt("dirty.xyz", np.concatenate([points, far]))
    assert main(["info", "dirty.xyz", "--length", "3"]) == 0
    said = capsys.readouterr().out.split("surface ")[1].split(", without outliers")[0]
    assert [float(side) for side in said.split(" x ")][:2] == pytest.approx(np.ptp(points, axis=0)[:2], rel=0.02)


def test_print_makes_a_watertight_solid_of_a_saved_grid(ready: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import trimesh

    assert main(["grid", "scan.xyz", "a.json", "--length", LENGTH]) == 0
    sizes = ["--member-diameter", "0.1", "--node-diameter", "0.2"]
    for name in ("a.stl", "a.3mf"):
        assert main(["print", "a.json", name, *sizes, "--scale", "2"]) == 0
        solid = trimesh.load(name, force="mesh")
        assert solid.is_watertight
    capsys.readouterr()
    assert "no.json" in refused(capsys, "print", "no.json", "b.stl", *sizes)
    assert "a.json" in refused(capsys, "print", "scan.xyz", "b.stl", *sizes).replace("scan.xyz", "a.json")
    assert "no format" in refused(capsys, "print", "a.json", "b.obj", *sizes)
    for word in ("0", "-1", "nan"):
        assert "diameter" in refused(
            capsys, "print", "a.json", "b.stl", "--member-diameter", word, "--node-diameter", "1"
        )
        assert "scale" in refused(capsys, "print", "a.json", "b.stl", *sizes, "--scale", word)


@pytest.mark.parametrize(
    ("unit", "name", "words"),
    [
        ("", "a.3mf", "the unit of the grid is not known, so the model says mm"),
        ("", "a.stl", "STL holds no unit and printers assume mm; its numbers are of a unit that is not known"),
        ("m", "a.stl", "STL holds no unit and printers assume mm; its numbers are m"),
        ("m", "a.3mf", ""),
        ("mm", "a.stl", ""),
    ],
)
def test_print_says_which_unit_a_printer_will_assume(
    place: Path, capsys: pytest.CaptureFixture[str], unit: str, name: str, words: str
) -> None:
    write(replace(hexagon(), unit=unit), "a.json")
    assert main(["print", "a.json", name, "--member-diameter", "0.1", "--node-diameter", "0.2"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert len(said) == (2 if words else 1) and said[0].startswith(words)


def test_places_of_national_grids_are_told_to_a_thousandth() -> None:
    assert words_of_place((500052.25, 5400012.3456, 299.0621)) == "500052.25, 5400012.346, 299.062"
    assert words_of_place((0.00012345678, -12.5, -1000.0)) == "0.000123457, -12.5, -1000"


@pytest.mark.parametrize(("scan", "loops"), [("shell", 3), ("bust", 0)])
def test_the_demo_makes_all_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str], scan: str, loops: int) -> None:
    assert main(["demo", str(tmp_path / "deep" / "demo"), "--scan", scan]) == 0
    names = ["grid.json", "grid.obj", "grid.png", "grid.settings.json", "model.3mf", "report.json"]
    assert sorted(entry.name for entry in (tmp_path / "deep" / "demo").iterdir()) == names
    report = json.loads((tmp_path / "deep" / "demo" / "report.json").read_text())
    assert report["topology"]["manifold"] and report["topology"]["orientable"]
    assert report["topology"]["boundary_loops"] == loops
    found = st.read_grid(tmp_path / "deep" / "demo" / "grid.json").certificate
    assert found is not None and found.passed and found.missing < 0.005
    assert {part.kind for part in found.left_out} <= {"outliers", "gap"}
    points = st.read_points(DEMOS[scan].scan)
    for part in found.left_out:
        if part.kind == "gap":  # narrower than a member: no disc of that width is free of points there
            assert part.where and 2.0 * cKDTree(points.points).query(part.where - points.origin)[0] < 24.0


def test_a_demo_that_fails_takes_its_folder_away(
    ready: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "scantruss.export.solid.print_model", lambda *_, **__: (_ for _ in ()).throw(OSError(28, "No space"))
    )
    assert "No space" in refused(capsys, "demo", "deep/demo")


def test_a_fault_of_ours_is_one_line_too(
    ready: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SCANTRUSS_TRACEBACK")
    monkeypatch.setattr(grid, "grid_with_notes", lambda *_, **__: 1 // 0)
    assert "ZeroDivisionError" in refused(capsys, "grid", "scan.xyz", "a.obj", "--length", LENGTH, status=1)


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (None, 0),
        (ZeroDivisionError(), 1),
        (st.InputError("no"), 2),
        (FrontError("stuck"), 2),
        (OSError(28, "No space"), 2),
        (MemoryError(), 2),
        (CertificateError("fails"), 3),
        (KeyboardInterrupt(), 130),
        (BrokenPipeError(), 141),
        (signal.SIGTERM, 143),
    ],
)
def test_every_exit_status_is_listed_in_the_help_and_in_the_readme(
    error: BaseException | signal.Signals | None,
    status: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def run(_: Any) -> None:
        if isinstance(error, signal.Signals):
            signal.raise_signal(error)
        elif error is not None:
            raise error

    monkeypatch.delenv("SCANTRUSS_TRACEBACK", raising=False)
    monkeypatch.setattr(cli, "run", run)
    monkeypatch.setattr(os, "dup2", lambda *_: None)
    assert main([]) == status
    assert capsys.readouterr().err.count("\n") == (status not in (0, 141))
    listed = cli.HELP.partition("Exit status")[2].partition("\n")[2]
    assert status in [int(line.split()[0]) for line in listed.splitlines()]
    readme = Path(__file__).resolve().parents[1] / "README.md"
    assert indent(listed, "  ") in readme.read_text(encoding="utf-8")


def test_the_command_itself_refuses_with_status_two(place: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "scantruss", "grid", "no.ply", "a.obj", "--length", "-3"], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert done.stderr.startswith("scantruss: length must be a positive number") and done.stderr.count("\n") == 1
    assert done.stdout == ""


def test_the_second_file_of_a_table_overwrites_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """grid.csv comes with grid_nodes.csv: that is neither the scan nor another output."""
    monkeypatch.chdir(tmp_path)
    scan = tmp_path / "shell_nodes.csv"
    np.savetxt(scan, plate(), delimiter=",")
    before = scan.read_bytes()
    assert main(["grid", "shell_nodes.csv", "shell.csv", "--length", "1"]) == 2
    assert "would overwrite the scan" in capsys.readouterr().err
    assert scan.read_bytes() == before and sorted(p.name for p in tmp_path.iterdir()) == ["shell_nodes.csv"]
    assert main(["grid", "shell_nodes.csv", "a.csv", "a_nodes.csv", "--length", "1"]) == 2
    assert "would overwrite the table of nodes" in capsys.readouterr().err


def test_points_for_no_echo_have_no_say_in_the_lengths_that_are_advised() -> None:
    points = plate() + [450_000.0, 5_400_000.0, 300.0]
    odd = points.copy()
    odd[np.random.default_rng(0).random(len(odd)) < 0.01] = 0.0
    as_it_is, with_zeros = PointCloud.from_array(points), PointCloud.from_array(odd)
    assert member_length.suggest_length(with_zeros) == pytest.approx(member_length.suggest_length(as_it_is), rel=0.05)
    assert member_length.length_range(with_zeros)[1] == pytest.approx(member_length.length_range(as_it_is)[1], rel=0.05)


def test_a_stop_that_another_error_hides_is_still_a_stop(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A compiler that is interrupted ends with an error of its own."""

    def interrupted(words: Any) -> None:
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(10)
        except BaseException:
            raise RuntimeError("no compiled object yet") from None

    monkeypatch.setattr(sys.modules[main.__module__], "run", interrupted)
    assert main(["info", "scan.ply"]) == 143
    assert capsys.readouterr().err == "scantruss: stopped; nothing was written\n"


@pytest.mark.parametrize(
    "words",
    [
        "structure a.json b.json --loads self --loads snow:1kN/m2",  # the weight of the members went without a word
        "grid a.ply b.json --length 1 --length=2",
        "grid a.ply b.json --length 1 --unit m --unit mm",
        "families a.json b.json --tolerance 1% --tolerance 2%",
        "schedule a.json b.xlsx --tube 60x3 --tube 60x4",
    ],
)
def test_an_option_that_keeps_one_value_is_refused_if_it_is_given_twice(
    words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words.split()) == 2
    assert "is given twice; give it once" in capsys.readouterr().err
