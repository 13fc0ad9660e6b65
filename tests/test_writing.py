"""Clouds that are written: read back the same, by us and by others, and the same bytes again."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
from scan_files import plate

from scantruss.errors import FormatError, InputError
from scantruss.scan.cloud import measure_spacing
from scantruss.scan.formats.content import Cloud
from scantruss.scan.formats.las import las_scale
from scantruss.scan.formats.reading import read_points
from scantruss.scan.formats.table import WRITERS
from scantruss.scan.formats.writing import check_cloud_output, write_points

UTM = np.array([500_000.0, 4_500_000.0, 100.0])
POINTS = plate(500) + UTM + np.random.default_rng(3).random((500, 3)) * 1e-4  # more digits than a millimetre
NORMALS = np.random.default_rng(4).normal(size=(500, 3))
WITHOUT_MARK = (".csv", ".npy")  # formats that cannot say what wrote them


@pytest.mark.parametrize("unit", ["", "m", "mm", "foot"])
@pytest.mark.parametrize("suffix", sorted(WRITERS))
def test_points_come_back_with_their_unit(tmp_path: Path, suffix: str, unit: str) -> None:
    path = tmp_path / f"a{suffix}"
    for normals in (None, NORMALS):
        write_points(path, POINTS, normals=normals, unit=unit, force=suffix in WITHOUT_MARK)
        cloud = read_points(path)
        loss = 0.5e-3 * measure_spacing(POINTS) if suffix in (".las", ".laz") else 0.0
        assert np.abs(cloud.points + cloud.origin - POINTS).max() <= 1.01 * loss
        assert cloud.unit == (unit if suffix != ".npy" else "") and cloud.dropped == 0 and cloud.notes == ()
        before = path.read_bytes()
        write_points(path, POINTS, normals=normals, unit=unit, force=suffix in WITHOUT_MARK)
        assert path.read_bytes() == before


@pytest.mark.parametrize("suffix", sorted(WRITERS))
def test_a_file_that_is_not_known_as_ours_is_replaced_by_force_only(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"1,2,3\n")
    with pytest.raises(FormatError, match="force=True"):
        write_points(path, POINTS)
    assert path.read_bytes() == b"1,2,3\n" and list(tmp_path.iterdir()) == [path]
    write_points(path, POINTS, force=True)
    if suffix in WITHOUT_MARK:
        with pytest.raises(FormatError, match="force=True"):
            write_points(path, POINTS[:9])
    else:
        write_points(path, POINTS[:9])


def test_other_readers_find_the_same(tmp_path: Path) -> None:
    for suffix in (".pcd", ".laz"):
        write_points(tmp_path / f"a{suffix}", POINTS, normals=NORMALS, unit="m")
    cloud = pytest.importorskip("pypcd4").PointCloud.from_path(tmp_path / "a.pcd")
    assert np.array_equal(
        cloud.numpy(("x", "y", "z", "normal_x", "normal_y", "normal_z")), np.hstack([POINTS, NORMALS])
    )
    las = laspy.read(tmp_path / "a.laz")
    assert np.abs(las.xyz - POINTS).max() < 1e-3 * measure_spacing(POINTS)
    assert np.allclose(np.column_stack([las[f"Normal{axis}"] for axis in "XYZ"]), NORMALS)


def test_the_unit_of_a_text_does_not_keep_others_from_its_numbers(tmp_path: Path) -> None:
    own: dict[str, dict[str, Any]] = {".xyz": {}, ".txt": {}, ".csv": {"delimiter": ",", "skiprows": 1}}
    for suffix, options in own.items():
        write_points(tmp_path / f"a{suffix}", POINTS, normals=NORMALS, unit="mm")
        assert np.array_equal(np.loadtxt(tmp_path / f"a{suffix}", **options), np.hstack([POINTS, NORMALS]))
    assert (tmp_path / "a.csv").read_text().startswith("x [mm],y [mm],z [mm],nx,ny,nz\n")


CUT = """
import resource, signal, sys
import numpy as np
from scantruss.errors import FormatError
from scantruss.scan.formats.table import WRITERS
from scantruss.scan.formats.writing import write_points
points = np.random.default_rng(0).random((60_000, 3))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
for suffix in sorted(WRITERS):
    try:
        write_points("a" + suffix, points)
    except FormatError as error:
        print(suffix, error)
"""


def test_a_disk_that_is_full_is_told_in_one_line(tmp_path: Path) -> None:
    pytest.importorskip("resource")
    done = subprocess.run([sys.executable, "-c", CUT], cwd=tmp_path, capture_output=True, text=True)
    assert not done.stderr
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines] == sorted(WRITERS)
    assert all(" cannot write a." in line and ("disk may be full" in line or "too large" in line) for line in lines)


def test_what_las_cannot_hold_is_refused_or_given_a_coarser_step() -> None:
    assert las_scale(POINTS) <= 1e-3 * measure_spacing(POINTS)
    pair = np.array([[0, 0, 0], [1e-7, 0, 0], [0, 1e-7, 0]])
    with pytest.raises(InputError, match="LAS cannot hold points"):
        las_scale(np.concatenate([pair + [x, y, 0] for x in (0, 3e5, 6e5) for y in (0, 3e5)]))


@pytest.mark.parametrize("suffix", sorted(WRITERS))
def test_a_cloud_that_cannot_be_written_whole_leaves_the_one_before(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"before")
    whole = WRITERS[suffix]

    def on_a_full_disk(path: Path, cloud: Cloud) -> None:
        whole(path, cloud)
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(WRITERS, suffix, on_a_full_disk)
    with pytest.raises(FormatError, match=r"cannot write .*: No space left on device"):
        write_points(path, POINTS, force=True)
    assert list(tmp_path.iterdir()) == [path] and path.read_bytes() == b"before"


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "folder.ply").mkdir()
    (tmp_path / "file").touch()
    for name, words in {
        "a.docx": r'no format for a cloud ".docx" \(a.docx\); use one of .csv .las',
        "folder.ply": "it is a folder",
        "none/a.ply": "does not exist",
        "file/a.ply": "is a file, not a folder",
    }.items():
        with pytest.raises(FormatError, match=words):
            check_cloud_output(tmp_path / name)
    with pytest.raises(FormatError, match="cannot write"):
        write_points(tmp_path / "none" / "a.ply", POINTS)
    for points in (POINTS[:0], POINTS[:, :2], POINTS * np.nan):
        with pytest.raises(InputError):
            write_points(tmp_path / "a.ply", points)
    with pytest.raises(InputError, match="as many normals"):
        write_points(tmp_path / "a.ply", POINTS, normals=NORMALS[:9])
