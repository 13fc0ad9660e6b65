"""PCD and E57 files as scanners and programs write them: any field order and type, poses, spherical, invalid points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from e57_file import Column, to_pages
from hypothesis import given
from hypothesis import strategies as st
from scan_files import MOVED, TURN, TURNED, axes, e57, pcd, plate

from scantruss.errors import FormatError, InputError
from scantruss.scan.formats.e57 import e57_scans, read_e57
from scantruss.scan.formats.e57_header import checksums
from scantruss.scan.formats.pcd import read_pcd
from scantruss.scan.formats.reading import read_points
from scantruss.selection import Selection

P = plate()
STATE = np.where(np.arange(len(P)) % 10 == 0, 2, 0).astype(float)


def content(tmp_path: Path, name: str, data: bytes) -> np.ndarray:
    path = tmp_path / name
    path.write_bytes(data)
    cloud = read_points(path)
    back: np.ndarray = cloud.points + cloud.origin
    return back


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_pcd_with_fields_in_any_order_of_any_type(tmp_path: Path, data: str) -> None:
    zeros = np.zeros(len(P))
    fields = [
        ("rgb", "f4", zeros), ("z", "f8", P[:, 2]), ("_", "u1", np.zeros((len(P), 3))), ("x", "i4", np.round(P[:, 0])),
        ("fpfh", "f4", np.zeros((len(P), 33))), ("_", "i2", zeros), ("y", "f4", P[:, 1]), ("confidence", "u2", np.arange(len(P))),
    ]  # fmt: skip
    path = tmp_path / "a.pcd"
    path.write_bytes(pcd(fields, data, "VIEWPOINT 1 2 3 1 0 0 0"))
    read = read_pcd(path, ("confidence",))
    assert np.array_equal(read.points, np.column_stack([np.round(P[:, 0]), P[:, 1].astype("f4"), P[:, 2]]))
    assert np.array_equal(read.attributes["confidence"], np.arange(len(P)))
    assert "viewpoint" in read.notes[0]


@pytest.mark.parametrize("data", ["ascii", "binary", "binary_compressed"])
def test_pcd_points_without_a_place_are_dropped_and_counted(tmp_path: Path, data: str) -> None:
    holes = P.copy()
    holes[::7, 1] = np.nan
    path = tmp_path / "a.pcd"
    path.write_bytes(pcd(list(zip("xyz", ["f8"] * 3, holes.T, strict=True)), data))
    cloud = read_points(path)
    assert cloud.dropped == len(P[::7]) and len(cloud.points) == len(P) - cloud.dropped


def test_pcd_with_comments_and_empty_lines_first(tmp_path: Path) -> None:
    data = pcd(list(zip("xyz", ["f8"] * 3, P.T, strict=True)), "binary")
    assert np.array_equal(content(tmp_path, "a.pcd", b"# made by hand\n\n# twice\n" + data.split(b"\n", 1)[1]), P)


def test_pcd_with_old_header_and_unit(tmp_path: Path) -> None:
    rows = "\n".join(" ".join(map(repr, row)) for row in P.tolist())
    head = f"# unit: mm\nCOLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 10\nHEIGHT {len(P) // 10}\nDATA ascii\n"
    path = tmp_path / "a.pcd"
    path.write_text("VERSION .5\n" + head + rows)
    cloud = read_points(path)
    assert cloud.unit == "mm" and np.array_equal(cloud.points + cloud.origin, P)


def test_another_writer_of_pcd(tmp_path: Path) -> None:
    other = pytest.importorskip("pypcd4")
    cloud = other.PointCloud.from_points(P.astype("f4"), ("x", "y", "z"), (np.float32,) * 3)
    for encoding in other.Encoding:
        cloud.save(tmp_path / "a.pcd", encoding=encoding)
        assert np.allclose(read_pcd(tmp_path / "a.pcd").points, P.astype("f4"), rtol=0, atol=1e-5)  # ascii is rounded


def test_e57_scans_stand_where_their_poses_say(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    path.write_bytes(e57((axes(P), TURN), (axes(P, "single"), ""), (axes(P[:50]), TURN.split("<trans")[0] + "</pose>")))
    expected = np.concatenate([P @ TURNED.T + MOVED, P.astype("f4"), P[:50] @ TURNED.T])
    assert np.allclose(read_e57(path).points, expected, rtol=0, atol=1e-12)
    scans = list(e57_scans(path))
    assert np.array_equal(scans[0].points, P) and np.allclose(scans[0].rotation, TURNED)
    assert np.array_equal(scans[0].translation, MOVED) and len(scans) == 3
    theirs = pytest.importorskip("e57").read_points(str(path)).points
    assert np.allclose(theirs, expected, rtol=0, atol=1e-12)
    assert read_points(path).unit == "m"


def test_e57_leaves_invalid_points_out_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    state = Column("cartesianInvalidState", STATE, "integer", low=0, high=2)
    path.write_bytes(e57(([*axes(P), state], "")))
    assert np.array_equal(read_e57(path).points, P[STATE == 0])
    assert read_points(path).notes == ("12 points that the scanner marked as invalid are left out",)


def test_e57_returns_and_classes_of_an_extension_select(tmp_path: Path) -> None:
    """The format counts the returns of a pulse from 0."""
    path = tmp_path / "a.e57"
    index, kind = np.arange(len(P)) % 3, np.arange(len(P)) % 5
    count = np.maximum(index + 1, 2)
    fields = [
        Column("returnIndex", index, "integer", low=0, high=7), Column("returnCount", count, "integer", low=0, high=7),
        Column("maker:classification", kind, "integer", low=0, high=31),
        Column("cartesianInvalidState", STATE, "integer", low=0, high=2),
    ]  # fmt: skip
    path.write_bytes(e57(([*axes(P), *fields], TURN), ([*fields, *axes(P)], "")))
    for selection, chosen in (
        (Selection(returns="first"), index == 0),
        (Selection(returns="3"), index == 2),
        (Selection(returns="last"), index + 1 == count),
        (Selection(classes=(4,)), kind == 4),
    ):
        taken = P[chosen & (STATE == 0)]
        cloud = read_points(path, selection=selection)
        assert np.allclose(cloud.points + cloud.origin, [*(taken @ TURNED.T + MOVED), *taken], rtol=0, atol=1e-9)
        assert cloud.notes[0] == "24 points that the scanner marked as invalid are left out"
    path.write_bytes(e57(([*axes(P), *fields], ""), (axes(P), "")))
    with pytest.raises(InputError, match="has no returns"):
        read_points(path, selection=Selection(returns="last"))


def test_e57_with_invalid_points_alone_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    path.write_bytes(e57(([*axes(P), Column("cartesianInvalidState", P[:, 0] * 0 + 1, "integer", low=0, high=2)], "")))
    with pytest.raises(InputError, match="of 120 points 120 that the scanner marked as invalid"):
        read_points(path)


def test_e57_spherical_constant_and_unknown_fields(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    distance = np.linalg.norm(P, axis=1)
    places = [distance, np.arctan2(P[:, 1], P[:, 0]), np.arcsin(P[:, 2] / distance)]
    names = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
    foreign = Column("maker:echo", np.arange(len(P)), "integer", low=0, high=200)  # its namespace is not declared
    path.write_bytes(e57(([Column(n, v) for n, v in zip(names, places, strict=True)] + [foreign], TURN)))
    assert np.allclose(read_e57(path).points, P @ TURNED.T + MOVED, rtol=0, atol=1e-12)
    flat = [*axes(P)[:2], Column("cartesianZ", np.full(len(P), 7), "integer", low=7, high=7), foreign]
    path.write_bytes(e57((flat, "")))
    assert np.array_equal(read_e57(path).points, np.column_stack([P[:, :2], np.full(len(P), 7)]))
    path.write_bytes(e57((axes(P)[:2], "")))
    with pytest.raises(FormatError, match="neither cartesian nor spherical"):
        read_points(path)


@given(
    bits=st.integers(1, 63),
    count=st.integers(1, 400),
    low=st.sampled_from([0, -5, 10**6, -(2**40)]),
    scale=st.sampled_from([1.0, 0.001, 2.0**-20]),
    seed=st.integers(0, 99),
)
def test_e57_integers_of_any_number_of_bits(
    tmp_path_factory: pytest.TempPathFactory, bits: int, count: int, low: int, scale: float, seed: int
) -> None:
    whole = np.random.default_rng(seed).integers(0, min(2**bits, 2**50), count)
    values = whole + low
    column = Column("cartesianX", values * scale, "scaled", low=low, high=low + 2**bits - 1, scale=scale)
    others = [Column(f"cartesian{axis}", np.arange(count)) for axis in "YZ"]
    path = tmp_path_factory.mktemp("bits") / "a.e57"
    path.write_bytes(e57(([column, *others], "")))
    assert np.array_equal(read_e57(path).points[:, 0], values.astype(float) * scale)


def test_e57_over_many_packets(tmp_path: Path) -> None:
    many = plate(30_000)
    path = tmp_path / "a.e57"
    path.write_bytes(e57((axes(many, "scaled", low=-100, high=50_000, scale=0.001), "")))
    assert np.allclose(read_e57(path).points, many, rtol=0, atol=1e-9)


@given(st.binary(min_size=1, max_size=3000))
def test_checksums_are_those_of_a_bit_by_bit_twin(data: bytes) -> None:
    pages = to_pages(data)
    assert pages[:, :1020].tobytes().startswith(data)
    for page, found in zip(pages, checksums(pages).tolist(), strict=True):
        state = 0xFFFFFFFF
        for byte in page[:1020].tolist():
            state ^= byte
            for _ in range(8):
                state = state >> 1 ^ (0x82F63B78 if state & 1 else 0)
        assert found == state ^ 0xFFFFFFFF and page[1020:].tobytes() == found.to_bytes(4, "big")
