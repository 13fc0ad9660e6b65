"""Scans that are thinned while they are read: units and selections mean what they mean for a scan in memory."""

from __future__ import annotations

import gzip
import json
import pickle
import warnings
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scan_files import axes, e57, las, pcd, plate, text, written
from test_bad_input import FILES as WHOLE
from test_bad_input import NAMES, broken
from test_scan_units import FOOT, GEOGRAPHIC, HEIGHT, METRE, SURVEY, plane, wkt, woods
from test_selection import CASES, CLASS, COUNT, FILES, HOLE, NUMBER, RING

from scantruss import PointCloud
from scantruss.cli.main import main
from scantruss.cli.sweep import sweep_parser, trials_of_words
from scantruss.errors import FormatError, InputError, ScanTrussError
from scantruss.runtime.cluster import Workers
from scantruss.scan.formats import text as text_format
from scantruss.scan.formats.reading import read_points
from scantruss.scan.formats.text import read_lines
from scantruss.scan.formats.text_layout import find_layout
from scantruss.scan.stream import fit
from scantruss.scan.stream import thin_scan as streaming
from scantruss.scan.stream.fit import read_thinned
from scantruss.scan.stream.thin_scan import thin_scan
from scantruss.scan.stream.thinning import thin_points
from scantruss.selection import Selection, polygon_text
from scantruss.settings import Settings

P = plate(600)
S = 1.7320508  # spacing; no coordinate with three decimals lies on a side of such boxes
BOTH = f'COMPD_CS["both",{plane(METRE)},{HEIGHT.format(FOOT)}]'


class Others(Workers):
    """Workers elsewhere, to whom all things go as bytes."""

    alone = False
    count = 3

    def run(self, work: Any, jobs: Iterable[Any], shared: Any = None) -> Iterator[tuple[int, Any]]:
        for number, job in reversed(list(enumerate(jobs))):
            yield number, pickle.loads(pickle.dumps(work(*pickle.loads(pickle.dumps((job, shared))))))


@pytest.fixture(autouse=True)
def small_tiles(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Tiles so small that a file has several."""
    monkeypatch.setattr(streaming, "FEWEST_POINTS_OF_TILE", 70)
    monkeypatch.setenv("SCANTRUSS_TRACEBACK", "1")
    monkeypatch.chdir(tmp_path)


def check(
    names: str | list[str], unit: str = "", selection: Selection | None = None, keep: str = "mean"
) -> tuple[Any, PointCloud]:
    """Thin a scan, here and by others, and hold it against the scan in memory; return both."""
    held = read_points(names, unit, selection)
    found = thin_scan(names, S, keep=keep, unit=unit, selection=selection)
    wanted = thin_points(held.points + held.origin, S, keep=keep)
    assert found.points.shape == wanted.shape and len(wanted) <= len(held.points)
    assert len(wanted) < len(held.points) or str(names).endswith(
        ".tif"
    )  # a raster whose cells are larger than the boxes
    assert np.allclose(found.points, wanted, rtol=1e-12, atol=1e-9)
    assert found.unit == held.unit and found.read == len(held.points) + held.dropped
    assert sorted(found.notes) == sorted(held.notes)
    there = thin_scan(names, S, keep=keep, unit=unit, selection=selection, workers=Others())
    assert there.points.tobytes() == found.points.tobytes() and sorted(there.notes) == sorted(found.notes)
    return found, held


@pytest.mark.parametrize("name", [*sorted(FILES), "a.csv.gz"])
@pytest.mark.parametrize("case", CASES)
def test_a_thinned_selection_is_the_thinning_of_the_selected_points(name: str, case: str) -> None:
    selection = CASES[case][0]
    Path(name).write_bytes(gzip.compress(FILES["a.csv"]) if name.endswith(".gz") else FILES[name])
    if name == "a.las" and case == "confidence":
        with pytest.raises(InputError, match="has no confidence, which --confidence needs"):
            thin_scan(name, S, selection=selection)
        return
    check(name, selection=selection, keep="nearest" if case in ("classes", "box") else "mean")


def test_packed_las_is_selected_too() -> None:
    Path("a.laz").write_bytes(las(P, ".laz", classification=CLASS, return_number=NUMBER, number_of_returns=COUNT))
    ring = polygon_text([RING, HOLE])
    found, held = check("a.laz", selection=Selection(classes=(6,), returns="last", crop=(ring, "box:0,0,99,20")))
    assert len(found.notes) == 4 and 10 < len(held.points) < 200


def test_two_crops_of_one_kind_are_counted_together() -> None:
    np.save("a.npy", P)
    _, held = check("a.npy", selection=Selection(crop=("box:0,0,30,30", "box:10,0,40,30")))
    assert held.notes == (f"{600 - len(held.points)} points outside the box are left out",)


def test_nothing_left_and_nothing_to_select_by() -> None:
    Path("a.las").write_bytes(FILES["a.las"])
    Path("a.xyz").write_bytes(text(P))
    with pytest.raises(
        InputError, match=r"no point of a.las is left: of 600 points 600 of other classes; some .* classes 2 5 6"
    ):
        thin_scan("a.las", S, selection=Selection(classes=(9,)))
    for crew in (None, Others()):
        with pytest.raises(InputError, match="has no classes, which --class needs"):
            thin_scan("a.xyz", S, selection=Selection(classes=(6,)), workers=crew)


@pytest.mark.parametrize(
    ("system", "unit", "z_unit"),
    [
        (BOTH, "", ""),
        (BOTH, "foot", ""),
        (BOTH, "", "m"),
        (plane(SURVEY), "", "m"),
        (plane('UNIT["yard",0.9144]'), "", ""),
        ("", "m", "foot"),
        ("", "", ""),
    ],
)
def test_heights_and_units_are_brought_together_as_in_memory(system: Any, unit: str, z_unit: str) -> None:
    Path("a.las").write_bytes(las(P, records=(wkt(system),) if system else ()))
    box = ("box:0,0,0,30,30,2.5",)  # in the unit of the result
    found, _ = check("a.las", unit, Selection(z_unit=z_unit, crop=box))
    assert found.points[:, 2].max() <= 2.5 and found.unit == (
        unit or ("foot" if SURVEY in system else "m" if system else "")
    )


def test_what_has_no_lengths_or_no_common_system_is_refused_before_it_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(streaming, "read_chunks", None)
    for name, system in (("a", plane(METRE)), ("b", plane(METRE, "32633")), ("c", GEOGRAPHIC)):
        Path(f"{name}.las").write_bytes(las(P, records=(wkt(system),)))
    with pytest.raises(InputError, match="longitude and latitude in degrees"):
        thin_scan("c.las", S)
    with pytest.raises(InputError, match=r"b.las is in EPSG:32633 and a.las in EPSG:32632"):
        thin_scan(["a.las", "b.las"], S)
    with pytest.raises(InputError, match="unit must be one of"):
        thin_scan("a.las", S, unit="ell")
    Path("a.xyz").write_bytes(text(P))
    with pytest.raises(InputError, match="does not state the unit of x and y"):
        thin_scan("a.xyz", S, selection=Selection(z_unit="foot"))


def test_files_of_different_units_come_together_in_any_order() -> None:
    Path("a.ply").write_bytes(written(".ply", P))
    Path("b.ply").write_bytes(written(".ply", 1000 * P).replace(b"comment unit m\n", b"comment unit mm\n"))
    Path("c.xyz").write_bytes(text(P))
    Path("d.e57").write_bytes(e57((axes(P), "")))
    np.savez("e.npz", points=100 * P, unit=np.array("cm"))
    Path("f.pcd").write_bytes(
        pcd([(axis, "f8", P[:, i] / 0.3048) for i, axis in enumerate("xyz")], "binary", "# unit: ft")
    )
    Path("g.ply.gz").write_bytes(gzip.compress(Path("b.ply").read_bytes()))
    for names in ("abcdefg", "cdagfeb"):
        files = [str(next(Path().glob(f"{name}.*"))) for name in names]
        found, held = check(files, selection=Selection(crop=("box:0,0,20,30",)))
        assert found.unit == "m" and any("converted to m, the unit of the first file" in note for note in held.notes)
        assert len(held.points) == 7 * (P[:, 0] <= 20).sum()


def test_heights_that_look_like_feet_are_noticed() -> None:
    points, returns = woods(0.3048)
    Path("a.las").write_bytes(las(points, number_of_returns=np.minimum(returns, 7)))
    for unit in ("", "m"):
        assert "look like feet" in thin_scan("a.las", 5.0, unit=unit).notes[0]
    assert not thin_scan("a.las", 5.0, unit="foot").notes
    assert len(thin_scan("a.las", 5.0, unit="m", selection=Selection(z_unit="foot")).notes) == 1


def test_blocks_of_text_are_read_the_same_by_the_compiled_loop(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(FILES["a.csv"])
    layout = find_layout(path, ("class",))
    columns = (*layout.columns, layout.attributes[0][1])
    block = FILES["a.csv"].split(b"\n", 1)[1]
    wanted = read_lines(path, block, layout, columns, 0).rows
    monkeypatch.setattr(text_format, "BYTES_FOR_PYARROW", 100)
    monkeypatch.setattr(np, "loadtxt", None)
    found = read_lines(path, block, layout, columns, 0).rows
    assert found.tobytes() == wanted.tobytes() and np.array_equal(found[:, 3], CLASS)


FEW = ("long-line.xyz",)  # has points, but too few for a grid


def test_count_lines_of_several_scans_in_a_text_are_kept() -> None:
    lines = text(P).splitlines(keepends=True)
    Path("a.pts").write_bytes(b"".join([b"200\n", *lines[:200], b"400\n", *lines[200:]]))
    check("a.pts")
    Path("a.pts").write_bytes(b"".join([b"200\n", *lines[:200], b"400\n", *lines[200:-1]]))
    for crew in (None, Others()):
        with pytest.raises(FormatError, match="promise 600 points, got 599"):
            thin_scan("a.pts", S, workers=crew)


@pytest.mark.parametrize("name", sorted(set(NAMES).difference(FEW)))
def test_a_broken_file_is_refused_in_one_line(name: str) -> None:
    Path(name).write_bytes(broken(name))
    with pytest.raises(ScanTrussError) as caught:
        thin_scan(name, S)
    assert "\n" not in str(caught.value) and (name in str(caught.value) or "points" in str(caught.value))


@pytest.mark.parametrize("name", sorted(WHOLE))
def test_whole_files_are_thinned_and_parts_of_them_are_not(name: str) -> None:
    whole = WHOLE[name]
    Path(name).write_bytes(whole)
    check(name)
    for share in (0.0, 0.02, 0.2, 0.5, 0.8, 0.97):
        Path(name).write_bytes(whole[: int(share * len(whole))])
        try:
            cloud = read_points(name)
        except FormatError:
            with pytest.raises(FormatError):
                thin_scan(name, S)
        except InputError:  # too few points for a grid
            continue
        else:
            thinned = thin_scan(name, S)  # a line that is cut short may have an empty field, and is dropped
            assert (thinned.read, thinned.dropped) == (len(cloud.points) + cloud.dropped, cloud.dropped)


# ---- the commands --------------------------------------------------------------------------------------------------


def test_thin_takes_the_options_of_reading_and_carries_the_unit(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.las").write_bytes(las(P, records=(wkt(BOTH),), classification=CLASS))
    Path("ring.txt").write_text("\n".join(f"{x} {y}" for x, y in RING))
    words = ["--spacing", "1.7", "--class", "2,6", "--crop", "ring.txt"]
    assert main(["thin", "a.las", "-o", "thin.ply", *words]) == 0
    said = "".join(capsys.readouterr())
    assert "of other classes are left out" in said and "the heights are converted to m" in said
    taken = Selection(classes=(2, 6), crop=(polygon_text([RING]),))
    thin = read_points("thin.ply")
    assert thin.unit == "m"
    assert np.array_equal(thin.points + thin.origin, thin_scan("a.las", 1.7, selection=taken).points)
    assert main(["thin", "a.las", "-o", "other.npz", "--unit", "foot", *words]) == 0
    assert read_points("other.npz").unit == "foot"
    names = sorted(Path().iterdir())
    for refused, line in (
        (["-o", "ring.txt", *words], "would overwrite the polygon"),
        (["-o", "none.ply", "--spacing", "1", "--class", "9"], "no point of a.las is left"),
        (["-o", "none.ply", "--spacing", "1", "--confidence", "1"], "has no confidence"),
    ):
        assert main(["thin", "a.las", *refused]) == 2
        assert line in capsys.readouterr().err and sorted(Path().iterdir()) == names


def test_grid_thins_what_is_selected_and_repeats_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fit, "NEVER_TOO_MANY_POINTS", 100)
    points = plate(20_000)
    Path("a.las").write_bytes(las(points, records=(wkt(BOTH),), classification=np.arange(len(points)) % 3))
    words = ["--length", "4", "--effort", "quick", "--class", "0,1", "--crop", "box:0,0,40,25"]
    assert main(["grid", "a.las", "a.obj", *words, "--memory", "100kB"]) == 0
    said = "".join(capsys.readouterr())
    assert "of other classes are left out" in said and "thinned while it was read, from 1" in said and "0.2 m" in said
    kept = json.loads(Path("a.settings.json").read_text())
    assert kept["thin_spacing"] == 0.2 and kept["classes"] == [0, 1]
    cloud, read = read_thinned("a.las", Settings.read("a.settings.json"))
    held = read_points("a.las", selection=Selection(classes=(0, 1), crop=("box:0,0,40,25",)))
    assert read == len(held.points) and cloud.unit == "m" and cloud.name == "a.las"
    wanted = thin_points(held.points + held.origin, 0.2, boundary=True)
    assert np.allclose(cloud.points + cloud.origin, wanted, rtol=0, atol=1e-9)
    assert main(["grid", "a.las", "again.obj", "--settings", "a.settings.json"]) == 0
    assert Path("again.obj").read_bytes() == Path("a.obj").read_bytes()


def test_a_sweep_selects_once_for_all_trials() -> None:
    words = ["a.las", "-o", "out", "--length", "4,5", "--class", "2,6", "--returns", "last", "--z-unit", "foot"]
    trials, varied = trials_of_words(sweep_parser().read([*words, "--unit", "m", "--confidence", "0.5"]))
    assert varied == ("length",)
    for trial in trials:
        assert trial.settings.selection == Selection(classes=(2, 6), returns="last", confidence=0.5, z_unit="foot")
        assert trial.settings.unit == "m"


def test_files_that_do_not_lie_together_are_named() -> None:
    for number, aside in enumerate((0.0, 25.0, 50.0, 900.0)):  # 20 long: three in a row, and one elsewhere
        np.save(f"{number}.npy", P / np.ptp(P[:, 0]) * 20.0 + (aside, 0, 0))
    np.save("4.npy", P + np.nan)
    row, all_files = ["0.npy", "1.npy", "2.npy"], [f"{number}.npy" for number in range(4)]
    for workers in (None, Others()):
        assert thin_scan(row, S, workers=workers).notes == read_points(row).notes == ()
        (said,) = thin_scan(all_files, S, workers=workers).notes
        assert said.startswith("3.npy lies about 8.3e+02 or more from the others") and "splice" in said
        assert read_points(all_files).notes == (said,)
        assert said in thin_scan([*all_files, "4.npy"], S, workers=workers).notes
    (said,) = thin_scan(["3.npy", *row], S).notes
    assert said.startswith("0.npy and 2 more files lie about 8.3e+02")


def test_a_wrong_byte_order_is_told_in_one_line(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.random.default_rng(0).random((2000, 3)).astype(">f4").view("<f4"))
    with warnings.catch_warnings(), pytest.raises(InputError, match="its byte order wrong"):
        warnings.simplefilter("error")
        thin_scan(tmp_path / "a.npy", 1.0)
