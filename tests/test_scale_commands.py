"""scantruss thin and sweep, and grids of scans that are larger than the memory they may take."""

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from steps import boundary_of
from typed import known

import scantruss as st
from scantruss.cli.main import main
from scantruss.cli.options import size_of_memory
from scantruss.runtime.memory import available_memory
from scantruss.scan.stream import fit
from scantruss.scan.stream.thinning import thin_points

FEW = 15_000  # points of a plate where their number shows nothing
HOLE = (22.0, 14.0, 6.0)  # of the plate: centre and radius


def plate(count: int = 60_000, seed: int = 3, noise: float = 0.02) -> np.ndarray:
    """Points on an arched plate of 40 x 30 with a round hole."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 40, count), rng.uniform(0, 30, count)
    keep = np.hypot(x - HOLE[0], y - HOLE[1]) > HOLE[2]
    x, y = x[keep], y[keep]
    return np.stack([x, y, 0.01 * x * (40 - x) + rng.normal(0, noise, len(x))], axis=1)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder with a scan in it, which is where the command runs."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SCANTRUSS_TRACEBACK", "1")
    np.save("scan.npy", plate())
    return tmp_path


def refused(capsys: pytest.CaptureFixture[str], *words: Any) -> str:
    """Run a command that must be refused; return the one line that it says."""
    names = sorted(entry.name for entry in os.scandir("."))
    assert main(words) == 2
    said = capsys.readouterr()
    assert said.err.startswith("scantruss: ") and said.err.count("\n") == 1
    assert sorted(entry.name for entry in os.scandir(".")) == names, "something was written"
    return said.err


# ---- thin ----------------------------------------------------------------------------------------------------------


def test_thin_writes_one_point_a_box(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.save("more.npy", plate(seed=4) + (100, 0, 0))
    both = np.concatenate([plate(), plate(seed=4) + (100, 0, 0)])
    assert main(["thin", "scan.npy", "more.npy", "-o", "thin.npy", "--spacing", "0.5"]) == 0
    wanted = thin_points(both, 0.5)
    assert np.array_equal(np.load("thin.npy"), wanted)
    said = capsys.readouterr().out
    assert f"{len(both):,} points thinned to {len(wanted):,}; wrote thin.npy" in said
    assert main(["thin", "*.npy", "-o", "near.ply", "--spacing", "2", "--keep", "nearest", "--boundary"]) == 0
    assert "of them along the boundary" in capsys.readouterr().out
    near = st.read_points("near.ply")
    assert len(near.points) > len(thin_points(np.concatenate([both, wanted]), 2.0))
    assert set(map(tuple, np.round(near.points + near.origin, 9).tolist())) <= set(
        map(tuple, np.round(np.concatenate([both, wanted]), 9).tolist())
    )


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("scan.npy", "-o", "thin.ply", "--spacing", "0"), "spacing must be a positive number"),
        (("scan.npy", "-o", "thin.ply"), "missing --spacing"),
        (("scan.npy", "-o", "thin.docx", "--spacing", "1"), "no format for a cloud"),
        (("scan.npy", "-o", "scan.npy", "--spacing", "1"), "would overwrite the scan"),
        (("scan.npy", "-o", "thin.ply", "--spacing", "1", "--keep", "middle"), "keep must be one of mean nearest"),
        (("scan.npy", "-o", "thin.ply", "--spacing", "1", "--workers", "0"), "workers must be 1 or more"),
        (("other.npy", "-o", "thin.ply", "--spacing", "1"), "does not exist"),
        (("other-*.npy", "-o", "thin.ply", "--spacing", "1"), "no file fits the pattern"),
        (("scan.npy", "-o", "thin.ply", "--spacing", "1e-16"), "too small for points so far from zero"),
    ],
)
def test_thin_refuses_in_one_line_and_writes_nothing(
    words: tuple[str, ...], line: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert line in refused(capsys, "thin", *words)


CODE = """
import resource, sys
import numpy as np
from scantruss.scan.stream.thin_scan import thin_scan
peaks = []
for name in sys.argv[1:]:
    found = thin_scan([name], 1.0, boundary=True)
    peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
print(found.read, *peaks)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="memory is told in other units elsewhere")
def test_memory_follows_the_result_and_not_the_scan(tmp_path: Path) -> None:
    for name, millions in (("small.npy", 2), ("large.npy", 8)):
        rows = np.tile(np.random.default_rng(1).uniform(0, 30, (500_000, 3)).astype("f4"), (2 * millions, 1))
        np.save(tmp_path / name, rows)
    names = [str(tmp_path / "small.npy"), str(tmp_path / "large.npy")]
    done = subprocess.run([sys.executable, "-c", CODE, *names], capture_output=True, text=True, check=True)
    read, small, large = map(int, done.stdout.split())
    assert read == 8_000_000
    assert (large - small) * 1024 < 6_000_000 * 24 / 6  # less than a sixth of what the points more would take


# ---- larger than memory --------------------------------------------------------------------------------------------


def curves_of(grid: st.Grid) -> float:
    """Mean distance of the boundary nodes outside (positive) of the true boundary of the plate."""
    nodes = (grid.nodes + grid.origin)[np.concatenate(grid.boundary_loops)]
    x, y = nodes[:, 0], nodes[:, 1]
    inside = np.minimum.reduce([np.hypot(x - HOLE[0], y - HOLE[1]) - HOLE[2], x, y, 40 - x, 30 - y])
    return -float(inside.mean())


def test_a_scan_larger_than_memory_gives_the_same_grid_within_the_noise(tmp_path: Path) -> None:
    """The cloud is so dense that a box holds 14 points; means alone would lose 0.04 of boundary."""
    points = plate(600_000)
    np.save(tmp_path / "scan.npy", points)
    settings = st.Settings(length=4.0, effort="quick")
    cloud, thinned = fit.read_to_fit([tmp_path / "scan.npy"], settings, memory=1e6)
    assert thinned.thin_spacing == 0.2 and len(cloud.points) < len(points) / 10
    whole, found = st.grid_from_points(points, settings), st.grid_from_points(cloud, thinned)
    assert found.topology == whole.topology
    for grid in (found, whole):
        for loop, true in zip(grid.boundary_loops, (140 / 4, 2 * np.pi * HOLE[2] / 4), strict=True):
            assert abs(len(loop) - true) <= 1.5
    rims = [boundary_of(*each).loops for each in ((cloud, thinned), (st.PointCloud.from_array(points), settings))]
    for one, other in zip(*rims, strict=True):
        assert one.length == pytest.approx(other.length, rel=0.002) and len(one.corners) == len(other.corners)
    assert abs(curves_of(whole)) < 0.003  # of the true boundary
    assert abs(curves_of(found)) < 0.0075
    nodes = found.nodes + found.origin
    assert np.abs(nodes[:, 2] - 0.01 * nodes[:, 0] * (40 - nodes[:, 0])).mean() < 0.01
    assert abs(found.quality.shape_mean - whole.quality.shape_mean) < 0.005


def test_the_grid_command_thins_what_is_too_large_and_says_so(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit, "NEVER_TOO_MANY_POINTS", 1000)
    words = ["grid", "scan.npy", "grid.obj", "--length", "4", "--effort", "quick"]
    assert main([*words, "--memory", "1MB"]) == 0
    assert "thinned while it was read, from 5" in capsys.readouterr().err
    first = (place / "grid.obj").read_bytes()
    assert json.loads((place / "grid.settings.json").read_text())["thin_spacing"] == 0.2
    assert main(["grid", "scan.npy", "again.obj", "--settings", "grid.settings.json"]) == 0  # on a larger machine
    assert "thinned" in capsys.readouterr().err
    assert (place / "again.obj").read_bytes() == first
    assert main([*words, "--memory", "1MB", "--thin-spacing", "0"]) == 0
    assert "thinned" not in capsys.readouterr().out


def test_info_looks_at_what_is_too_large_through_boxes(
    place: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    np.save("scan.npy", plate(24_000))
    monkeypatch.setattr(fit, "NEVER_TOO_MANY_POINTS", 1000)
    assert main(["info", "scan.npy"]) == 0
    whole = "".join(capsys.readouterr())
    assert main(["info", "scan.npy", "--memory", "400kB"]) == 0
    said = "".join(capsys.readouterr())
    assert "thinned while it was read, from 2" in said and "thinned" not in whole
    wished, sizes = ([text.split(word)[1].split("\n")[0] for text in (whole, said)] for word in ("try ", "extent   "))
    assert wished[0] == wished[1]
    one, other = ([float(side) for side in size.split(",")[0].split(" x ")] for size in sizes)
    assert np.allclose(one, other, rtol=0.01)
    assert said.split("boundary  length")[1].count("external") == 1 and said.count("internal") == 1
    assert main(["info", "scan.npy", "--memory", "400kB", "--length", "4"]) == 0
    assert "in boxes of 0.2;" in capsys.readouterr().err
    for words in (["--thin-spacing", "0"], ["--length", "4", "--thin-spacing", "0"]):
        assert main(["info", "scan.npy", "--memory", "400kB", *words]) == 0
        assert "thinned" not in "".join(capsys.readouterr())
    np.save("none.npy", np.full((2000, 3), np.nan))
    assert "no points but NaN" in refused(capsys, "info", "none.npy", "--memory", "1kB")


@pytest.mark.parametrize("place_of_all", [(0, 0, 0), (5e5, 5.4e6, 200)])
def test_a_first_look_does_not_heed_points_that_stand_for_none(
    place: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    place_of_all: tuple[float, float, float],
) -> None:
    """One point in a hundred at (0, 0, 0), with others at a far place: no echo."""
    monkeypatch.setattr(fit, "NEVER_TOO_MANY_POINTS", 1000)
    monkeypatch.setattr(fit, "POINTS_OF_BULK", 3000)
    points = plate() + place_of_all
    np.save("clean.npy", points)
    points[::100] = -9999.0
    np.save("holes.npy", points)
    settings, shares = st.Settings(length=4.0), []
    looks = [
        fit.spacing_to_look(name, settings, lambda *told: shares.append(told)) for name in ("clean.npy", "holes.npy")
    ]
    assert looks[0] == pytest.approx(np.linalg.norm(np.ptp(plate(), axis=0)) / fit.BOXES_OF_FIRST_LOOK, rel=0.02)
    assert looks[1] == pytest.approx(looks[0], rel=0.02)
    assert shares[-1] == ("look", 1.0)
    assert main(["info", "holes.npy", "--memory", "1MB"]) == 0
    assert "thinned while it was read" in capsys.readouterr().err


def test_a_first_look_sees_thin_far_ends(place: Path) -> None:
    """A few points of a scan reach as far again as all others: a scanner sees far in few directions."""
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform(-1, 1, (20_000, 3)), rng.uniform(-3, 3, (100, 3))])
    np.save("far.npy", points)
    found = fit.spacing_to_look("far.npy", st.Settings(length=1.0))
    assert found == pytest.approx(np.linalg.norm(np.ptp(points, axis=0)) / fit.BOXES_OF_FIRST_LOOK, rel=0.01)


def test_what_fits_into_memory_is_taken_as_it_is(place: Path) -> None:
    settings = st.Settings(length=4.0)
    assert fit.spacing_to_fit(["scan.npy"], settings) == 0.0
    assert fit.spacing_to_fit(["scan.npy"], settings, memory=1.0) == 0.0  # so few are never too many
    cloud, same = fit.read_to_fit(["scan.npy"], settings)
    assert same is settings and np.array_equal(cloud.points, st.read_points("scan.npy").points)


def test_the_machine_tells_its_memory() -> None:
    assert 1e7 < available_memory() < 1e15


@pytest.mark.parametrize(
    ("text", "size"), [("4GB", 4e9), ("500 MB", 5e8), ("1.5g", 1.5e9), ("123456", 123456.0), ("2KiB", 2000.0)]
)
def test_sizes_of_memory_are_understood(text: str, size: float) -> None:
    assert size_of_memory(text) == size


@pytest.mark.parametrize("text", ["much", "-4GB", "0", "4 parsecs", ""])
def test_other_sizes_are_refused(text: str, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "such as 4GB" in refused(capsys, "grid", "scan.npy", "grid.obj", "--length", "4", f"--memory={text}")


# ---- sweep ---------------------------------------------------------------------------------------------------------


def test_a_sweep_tells_of_every_combination(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.save("scan.npy", plate(FEW))
    words = ["sweep", "scan.npy", "--length", "5,7,0.1", "--effort", "quick", "--prefer", "balance,shapes"]
    assert main([*words, "-o", "out", "--workers", "1"]) == 0
    said = capsys.readouterr().out
    with (place / "out" / "table.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["length"], row["prefer"]) for row in rows] == [
        (length, prefer) for length in ("5", "7", "0.1") for prefer in ("balance", "shapes")
    ]
    assert [row["certificate"] for row in rows[:4]] == ["passed"] * 4
    assert all("too small for points" in row["certificate"] and not row["nodes"] for row in rows[4:])
    names = {entry.name for entry in os.scandir("out")}
    grids = {f"length-{length}_prefer-{prefer}" for length in (5, 7) for prefer in ("balance", "shapes")}
    assert names == {f"{name}.{end}" for name in grids for end in ("json", "png")} | {
        "table.csv", "table.md", "index.html", "overview.png",
    }  # fmt: skip
    grid = st.read_grid("out/length-7_prefer-shapes.json")
    assert (known(grid.settings).length, known(grid.settings).prefer, known(grid.settings).effort) == (
        7.0,
        "shapes",
        "quick",
    )
    assert rows[3]["nodes"] == str(len(grid.nodes)) and rows[3]["length std/mean"] == f"{grid.quality.length_cv:.4f}"
    page = (place / "out" / "index.html").read_text()
    assert page.count("<img") == 4 and page.count("<tr>") == 7
    assert (place / "out" / "table.md").read_text().count("\n") == 8
    assert "wrote 4 grids" in said and "passed" in said


def test_a_sweep_is_the_same_to_the_byte_on_a_cluster(place: Path, tmp_path: Path) -> None:
    import warnings

    distributed = pytest.importorskip("distributed")
    np.save("scan.npy", plate(FEW))
    words = ["sweep", "scan.npy", "--length", "6,8", "--effort", "quick"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cluster = distributed.LocalCluster(2, processes=False, threads_per_worker=1, dashboard_address=":0")
    try:
        assert main([*words, "-o", "there", "--scheduler", cluster.scheduler_address]) == 0
    finally:
        cluster.close()
    assert main([*words, "-o", "here", "--workers", "1"]) == 0
    names = sorted(entry.name for entry in os.scandir("here"))
    assert names == sorted(entry.name for entry in os.scandir("there"))
    for name in names:
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes(), name


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--length", "5,x"), "needs a number"),
        (("--length", ","), "several, separated by commas"),
        (("--length", "5,5"), "named twice"),
        (("--length", "5", "--effort", "quick,hard"), "effort must be one of"),
        (("--length", "0.1,0.2"), "no grid came out of 2 trials; the first: length 0.1 is too small"),
    ],
)
def test_a_sweep_refuses_in_one_line_and_writes_nothing(
    words: tuple[str, ...], line: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert line in refused(capsys, "sweep", "scan.npy", *words, "-o", "out", "--workers", "1")


def test_a_sweep_without_a_length_takes_the_one_that_info_suggests(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        main(["sweep", "scan.npy", "--effort", "quick", "--prefer", "balance,shapes", "-o", "out", "--workers", "1"])
        == 0
    )
    said = capsys.readouterr()
    (length,) = re.findall(r"no --length is given; using ([\d.]+)", said.err)
    for name in ("balance", "shapes"):
        assert known(st.read_grid(f"out/prefer-{name}.json").settings).length == float(length)


def test_a_sweep_into_a_file_is_refused(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "is a file" in refused(capsys, "sweep", "scan.npy", "--length", "5", "-o", "scan.npy")


def test_several_workers_are_announced_and_change_no_byte(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["thin", "scan.npy", "--spacing", "2", "--keep", "nearest", "--boundary"]
    assert main([*words, "-o", "alone.npy", "--workers", "1"]) == 0
    assert "processes" not in capsys.readouterr().err
    assert main([*words, "-o", "shared.npy", "--workers", "2"]) == 0
    assert "on 2 processes of this machine" in capsys.readouterr().err
    assert (place / "shared.npy").read_bytes() == (place / "alone.npy").read_bytes()


def test_a_sweep_leaves_no_grids_beside_a_table_that_does_not_know_them(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save("scan.npy", plate(FEW))
    words = ["sweep", "scan.npy", "--effort", "quick", "-o", "out", "--workers", "1"]
    assert main([*words, "--length", "9,11"]) == 0
    assert main([*words, "--length", "9,11"]) == 0  # the same once more
    capsys.readouterr()
    assert "holds grids of another sweep, length-11; name another folder" in refused(capsys, *words, "--length", "9,10")
    for path in (place / "out").glob("length-11.*"):
        path.unlink()
    (place / "out" / "length-0.1.json").write_text("{}")
    assert "length-0.1.json exists already" in refused(capsys, *words, "--length", "9,0.1")
    (place / "out" / "length-0.1.json").write_text('{"made_by": "ScanTruss 0.1.0"}')
    assert main([*words, "--length", "9,0.1"]) == 0
    assert sorted(entry.name for entry in os.scandir("out") if entry.name.startswith("length")) == [
        "length-9.json",
        "length-9.png",
    ]


@pytest.mark.parametrize(
    "words", ["thin scan.npy -o thin.npy --spacing", "grid scan.npy a.obj --length 1 --thin-spacing"]
)
def test_a_spacing_that_leaves_hardly_a_point_asks_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("scan.npy", np.random.default_rng(0).uniform(0, 9, (500, 3)))
    for spacing in ("1e9", "8"):
        assert main([*words.split(), spacing]) == 2
        said = capsys.readouterr().err.splitlines()[-1]
        assert f"spacing {float(spacing):g} leaves" in said and "of 500 points" in said
    assert not (tmp_path / "thin.npy").exists()
