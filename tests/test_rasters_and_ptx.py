"""ESRI ASCII grids and PTX files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scantruss as st
from scantruss.scan.formats.ptx import read_ptx
from scantruss.scan.formats.raster import read_asc

HEIGHTS = np.array([[1.5, 2, 3, 4], [5, -9999, 7, 8], [9, 10, 11, 12.25]])


def raster(path: Path, head: str, heights: np.ndarray = HEIGHTS, end: str = "\n") -> Path:
    rows = end.join(" ".join(map(repr, row)) for row in heights.tolist())
    path.write_text(head.replace("\n", end) + rows + end, encoding="ascii", newline="")
    return path


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("middle", [False, True])
def test_cells_of_a_raster_are_points_at_their_centres(middle: bool, end: str, tmp_path: Path) -> None:
    x, y, word = (380_001.0, 5_810_001.0, "center") if middle else (380_000.0, 5_810_000.0, "corner")
    head = f"NCOLS 4\nNROWS 3\nXLL{word.upper()} {x}\nyll{word} {y}\nCELLSIZE 2\nNODATA_value -9999\n"
    found = read_asc(raster(tmp_path / "a.asc", head, end=end))
    slow = [
        (380_001.0 + 2 * j, 5_810_001.0 + 2 * (2 - i), HEIGHTS[i, j]) for i in range(3) for j in range(4) if HEIGHTS[i, j] != -9999
    ]  # fmt: skip
    np.testing.assert_array_equal(found.points, slow)
    assert found.left_out == {"in cells without data": 1}
    cloud = st.read_points(tmp_path / "a.asc")
    assert len(cloud.points) == 11 and ("in cells without data", 1) in cloud.left_out


def test_a_raster_with_two_sizes_of_cell_and_without_no_data(tmp_path: Path) -> None:
    found = read_asc(raster(tmp_path / "a.asc", "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ndx 1\ndy 10\n"))
    assert len(found.points) == 12 and found.points[:, 1].max() == 25.0 and found.points[:, 0].max() == 3.5


def test_columns_of_text_are_still_read(tmp_path: Path) -> None:
    points = np.random.default_rng(0).normal(size=(50, 3))
    np.savetxt(tmp_path / "a.asc", points)
    np.testing.assert_allclose(st.read_points(tmp_path / "a.asc").points, points, atol=1e-6)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("ncols 4\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 1\n", "12 heights where its head promises 16"),
        ("ncols 4\nnrows 3\nxllcorner 0\ncellsize 1\n", "no yllcorner"),
        ("ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\n", "no usable"),
        ("ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize x\n", "no number"),
        ("ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize -1\n", "no usable"),
    ],
)
def test_damaged_rasters_are_refused(head: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(st.FormatError, match=said):
        st.read_points(raster(tmp_path / "a.asc", head))


def ptx(places: list[tuple[np.ndarray, np.ndarray]]) -> str:
    """Scans, each of (N, 3) points in the frame of its scanner and a 4 x 4 matrix for rows of coordinates."""
    text = ""
    for points, matrix in places:
        text += f"{len(points)}\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
        text += "".join(" ".join(map(repr, row)) + "\n" for row in matrix.tolist())
        text += "".join(" ".join(map(repr, row)) + " 0.5 10 20 30\n" for row in points.tolist())
    return text


def test_scans_of_a_ptx_file_are_placed_and_empty_directions_left_out(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    turn = np.eye(4)
    turn[:3, :3] = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]  # x goes to y
    turn[3, :3] = [1.5, 2, 3]
    one, other = rng.normal(size=(2, 40, 3))
    other[::5] = 0
    (tmp_path / "a.ptx").write_text(ptx([(one, np.eye(4)), (other, turn)]), encoding="ascii")
    found = read_ptx(tmp_path / "a.ptx")
    kept = other[other.any(axis=1)]
    moved = np.stack([1.5 - kept[:, 1], 2 + kept[:, 0], 3 + kept[:, 2]], axis=1)
    np.testing.assert_allclose(found.points, np.concatenate([one, moved]), rtol=0, atol=1e-13)
    assert found.left_out == {"without a return": 8}
    cloud = st.read_points(tmp_path / "a.ptx")
    assert cloud.unit == "m" and len(cloud.points) == 72


@pytest.mark.parametrize("change", ["short", "word", "head", "ragged"])
def test_damaged_ptx_files_are_refused(change: str, tmp_path: Path) -> None:
    text = ptx([(np.random.default_rng(1).normal(size=(20, 3)), np.eye(4))])
    lines = text.splitlines()
    if change == "short":
        lines = lines[:-3]
    elif change == "word":
        lines[15] = "a b c"
    elif change == "head":
        lines[7] = "1 2"
    else:
        lines[15] = "1 2"
    (tmp_path / "a.ptx").write_text("\n".join(lines) + "\n", encoding="ascii")
    with pytest.raises(st.FormatError, match=r"a\.ptx"):
        st.read_points(tmp_path / "a.ptx")
