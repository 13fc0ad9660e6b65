"""Tiles of a file hold its points, wherever they are cut; damaged files are refused in words."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from copc_file import copc

import scantruss as st
from scantruss.errors import FormatError
from scantruss.scan.formats.table import READERS
from scantruss.scan.stream import chunks
from scantruss.scan.stream.chunks import read_ahead, read_chunks
from scantruss.scan.stream.thin_scan import thin_scan
from scantruss.scan.stream.tiles import find_source, tiles_of

COUNT = 700


def cloud(count: int = COUNT, seed: int = 2) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.round(rng.uniform((400, 500, -3), (420, 517, 6), (count, 3)), 3)


def write_las(path: Path, points: np.ndarray, point_format: int = 3) -> None:
    laspy = pytest.importorskip("laspy")
    header = laspy.LasHeader(point_format=point_format, version="1.4")
    header.scales, header.offsets = [0.001] * 3, [400, 500, 0]
    las = laspy.LasData(header)
    las.x, las.y, las.z = points.T
    las.write(path)


def write_ply(
    path: Path, points: np.ndarray, order: str = "<", kind: str = "<f8", more: str = "", axes: str = "xyz"
) -> None:
    word = {"<": "little", ">": "big"}[order]
    names = [("x", order + kind[1:]), ("y", order + kind[1:]), ("quality", "u1"), ("z", order + kind[1:])]
    rows = np.zeros(len(points), names)
    rows["x"], rows["y"], rows["z"] = points.T
    typed = {"f4": "float", "f8": "double"}[kind[1:]]
    named = [(typed, axes[0]), (typed, axes[1]), ("uchar", axes[3:] or "quality"), (typed, axes[2])]
    head = f"ply\nformat binary_{word}_endian 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property {kind} {name}\n" for kind, name in named)
    path.write_bytes(f"{head}{more}end_header\n".encode() + rows.tobytes())


def write_structured(path: Path, points: np.ndarray) -> None:
    rows = np.zeros(len(points), [("class", "u1"), ("x", "f8"), ("y", "f8"), ("z", "f8")])
    rows["x"], rows["y"], rows["z"] = points.T
    np.save(path, rows)


def write_ascii_ply(path: Path, points: np.ndarray) -> None:
    lines = "\n".join(" ".join(map(repr, row)) for row in points.tolist())
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
    path.write_text(f"{head}end_header\n{lines}\n")


def write_text(
    path: Path,
    points: np.ndarray,
    head: str = "",
    sign: str = " ",
    form: str = "%.3f",
    numbered: bool = False,
    end: str = "\n",
) -> None:
    rows = np.column_stack([np.arange(1, len(points) + 1), points, points[:, 2]]) if numbered else points
    text = [sign.join((form % value).replace(".", "," if sign == ";" else ".") for value in row) for row in rows]
    if numbered:
        text = [f"{int(row[0])}{sign}" + sign.join(form % value for value in row[1:4]) for row in rows]
    path.write_bytes((head + end.join(text) + end).encode())


def write_copc(path: Path, points: np.ndarray) -> None:
    path.write_bytes(copc(points)[0])


WAYS: dict[str, tuple[str, Callable[[Path, np.ndarray], None]]] = {
    "las": ("scan.las", write_las),
    "laz": ("scan.laz", write_las),
    "copc": ("scan.copc.laz", write_copc),
    "laz 6": ("scan.laz", lambda path, points: write_las(path, points, 6)),
    "ply": ("scan.ply", write_ply),
    "ply big": ("scan.ply", lambda path, points: write_ply(path, points, ">", ">f4")),
    "ply large letters": ("scan.ply", lambda path, points: write_ply(path, points, axes="XYZ")),
    "ply both letters": ("scan.ply", lambda path, points: write_ply(path, points, axes="XYZy")),
    "ply ascii": ("scan.ply", write_ascii_ply),
    "npy": ("scan.npy", np.save),
    "npy float32, wide": ("scan.npy", lambda path, points: np.save(path, np.column_stack([points] * 2).astype("f4"))),
    "npy by columns": ("scan.npy", lambda path, points: np.save(path, np.asfortranarray(points))),
    "npy named": ("scan.npy", write_structured),
    "npz": ("scan.npz", lambda path, points: np.savez(path, points=points)),
    "xyz": ("scan.xyz", write_text),
    "xyz of lines of 24 bytes": ("scan.xyz", lambda path, points: write_text(path, points, form="%7.3f")),
    "xyz windows": ("scan.xyz", lambda path, points: write_text(path, points, end="\r\n")),
    "xyz old mac": ("scan.xyz", lambda path, points: write_text(path, points, end="\r")),
    "csv": ("scan.csv", lambda path, points: write_text(path, points, "X;Y;Z\n", ";")),
    "csv comma": ("scan.csv", lambda path, points: write_text(path, points, "x,y,z\n", ",")),
    "pts": ("scan.pts", lambda path, points: write_text(path, points, f"{len(points)}\n")),
    "numbered": ("scan.txt", lambda path, points: write_text(path, points, numbered=True)),
    "missing": ("scan.csv", lambda path, points: write_text(path, points, "x,y,z\n,,\n1.5,nan,2\n", ",")),
}


@pytest.mark.parametrize("way", WAYS)
def test_tiles_and_chunks_of_any_size_hold_the_points_of_the_file(
    way: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, write = WAYS[way]
    path = tmp_path / name
    write(path, cloud())
    wanted = np.asarray(READERS[path.suffix](path, ()).points, float)
    for tile, chunk, alone in ((10**9, 10**9, True), (97, 50, False), (250, 64, True), (10, 3, False)):
        monkeypatch.setattr(chunks, "CHUNK_BYTES", 24 * chunk)
        tiles = list(tiles_of([find_source(path)], tile))
        found = [one.points for part in tiles for one in read_ahead(read_chunks(part, None, chunk, alone=alone))]
        both = np.concatenate(found)
        assert all(points.dtype == np.float64 and points.flags.c_contiguous for points in found)
        assert np.array_equal(both, wanted, equal_nan=True)


@pytest.mark.parametrize("axes", ["xyz", "XYZ", "xYZy"])
def test_binary_ply_is_entered_anywhere_whatever_its_letters(axes: str, tmp_path: Path) -> None:
    write_ply(tmp_path / "scan.ply", cloud(), axes=axes)
    assert len(list(tiles_of([find_source(tmp_path / "scan.ply")], 100))) == COUNT / 100


def test_the_order_of_files_and_their_cuts_do_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = cloud()
    np.save(tmp_path / "all.npy", points)
    np.save(tmp_path / "tile-2.npy", points[:300])
    write_ply(tmp_path / "tile-10.ply", points[300:])
    whole = thin_scan([tmp_path / "all.npy"], 2.0, boundary=True)
    for names in (["tile-2.npy", "tile-10.ply"], ["tile-10.ply", "tile-2.npy"]):
        for keep in ("mean", "nearest"):
            wanted = thin_scan([tmp_path / "all.npy"], 2.0, keep=keep)
            found = thin_scan([tmp_path / name for name in names], 2.0, keep=keep)
            assert found.points.tobytes() == wanted.points.tobytes() and found.read == wanted.read == COUNT
    assert whole.boundary and len(whole.points) - whole.boundary == len(thin_scan([tmp_path / "all.npy"], 2.0).points)


def damaged_las(path: Path) -> None:
    write_las(path, cloud())
    path.write_bytes(path.read_bytes()[:-3000])


def boastful_las(path: Path) -> None:
    """A header that claims 10^12 points."""
    write_las(path, cloud())
    data = bytearray(path.read_bytes())
    data[247:255] = (10**12).to_bytes(8, "little")
    path.write_bytes(data)


def damaged_ply(path: Path) -> None:
    write_ply(path, cloud())
    path.write_bytes(path.read_bytes()[:-1])


def damaged_npy(path: Path) -> None:
    np.save(path, cloud())
    path.write_bytes(path.read_bytes()[:-1])


BROKEN = {
    "cut off": ("scan.las", damaged_las),
    "boastful": ("scan.las", boastful_las),
    "boastful laz": ("scan.laz", boastful_las),
    "ply": ("scan.ply", damaged_ply),
    "npy": ("scan.npy", damaged_npy),
    "no scan": ("scan.laz", lambda path: path.write_bytes(b"%PDF-1.4 and so on")),
    "nothing": ("scan.xyz", lambda path: path.write_bytes(b"")),
    "words": ("scan.xyz", lambda path: write_text(path, cloud(), end=" \n1.0 and words\n")),
    "fewer than promised": ("scan.pts", lambda path: write_text(path, cloud(), "5000\n")),
    "no points": ("scan.npy", lambda path: np.save(path, np.empty((0, 3)))),
    "no numbers": ("scan.npy", lambda path: np.save(path, np.full((9, 3), np.nan))),
    "other suffix": ("scan.docx", lambda path: path.write_bytes(b"words")),
    "missing": ("scan.laz", lambda path: None),
}


@pytest.mark.parametrize("way", BROKEN)
def test_a_damaged_file_is_refused_in_words(way: str, tmp_path: Path) -> None:
    name, write = BROKEN[way]
    write(tmp_path / name)
    with pytest.raises(FormatError, match="scan"):
        thin_scan([tmp_path / name], 1.0)


def test_thinned_points_are_those_of_the_scan_in_memory(tmp_path: Path) -> None:
    """By way of a file as by way of an array."""
    from scantruss.scan.stream.thinning import thin_points

    points = cloud()
    write_las(tmp_path / "scan.laz", points)
    held = st.read_points(tmp_path / "scan.laz")
    assert np.array_equal(thin_scan([tmp_path / "scan.laz"], 1.5).points, thin_points(held.points + held.origin, 1.5))
