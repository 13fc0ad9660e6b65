"""A crop of a COPC file: the points and words of the whole file cropped, though only what lies near is read."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import laspy
import lazrs
import numpy as np
import pytest
from copc_file import ENTRY, copc
from laspy.copc import Bounds

from scantruss.errors import FormatError, InputError
from scantruss.scan.formats.copc import find_boxes
from scantruss.scan.formats.reading import read_points
from scantruss.scan.stream.chunks import Reading, read_chunks
from scantruss.scan.stream.fit import spacing_to_fit
from scantruss.scan.stream.thin_scan import thin_scan
from scantruss.scan.stream.tiles import find_source, tiles_of
from scantruss.selection import Selection
from scantruss.settings import Settings

RNG = np.random.default_rng(8)
P = np.round(RNG.uniform((4000, 5000, -3), (4090, 5100, 9), (4000, 3)), 3)
CLASS = RNG.choice([2, 6], len(P))
RETURN = RNG.choice([1, 2], len(P))
WITHHELD = RNG.random(len(P)) < 0.1
FOOT = 0.3048
SMALL = "box:4010,5010,4020,5025"
CROPS = {
    "box": ("box:4010,5010,-1,4025,5030,4",),
    "box in plan": (SMALL,),
    "box far beyond": ("box:-1e12,-1e12,4020,5025",),
    "all": ("box:0,0,9000,9000",),
    "sphere": ("sphere:4060,5050,2,9",),
    "polygon": ("polygon:4010,5010,4040,5020,4020,5040;4020,5020,4025,5022,4022,5026",),
    "two": ("sphere:4040,5040,2,20", "box:4030,5000,4060,5040"),
}


def inside_small(points: np.ndarray) -> np.ndarray:
    return points[np.all((points[:, :2] >= (4010, 5010)) & (points[:, :2] <= (4020, 5025)), axis=1)]


DATA, ORDER = copc(P, levels=4)


@pytest.fixture(scope="module", params=[False, True], ids=["one page", "pages"])
def both(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A COPC file with points that are withheld, and the same without its table, which is read whole."""
    tmp_path = tmp_path_factory.mktemp("both")
    data, _ = copc(P, levels=4, pages=request.param, classification=CLASS, withheld=WITHHELD, return_number=RETURN)
    (tmp_path / "a.copc.laz").write_bytes(data)
    (tmp_path / "b.laz").write_bytes(BROKEN["nothing"](data))
    return tmp_path / "a.copc.laz", tmp_path / "b.laz"


@pytest.mark.parametrize("name", CROPS)
@pytest.mark.parametrize("more", [{}, {"classes": (6,)}, {"returns": "first"}], ids=str)
def test_points_and_their_order_are_those_of_the_whole_file(
    both: tuple[Path, Path], name: str, more: dict[str, Any]
) -> None:
    selection = Selection(crop=CROPS[name], **more)
    found, wanted = (read_points(path, selection=selection) for path in both)
    assert len(found.points) > 10 and np.array_equal(found.points + found.origin, wanted.points + wanted.origin)
    assert sum(numbers(found.notes)) == sum(numbers(wanted.notes))
    if name != "two":
        assert words(found.notes) == words(wanted.notes)
    source = find_source(both[0])
    for size in (10**6, 300):
        chunks = [chunk for tile in tiles_of([source]) for chunk in read_chunks(tile, Reading("", selection, ""), size)]
        assert np.array_equal(np.concatenate([chunk.points for chunk in chunks]), wanted.points + wanted.origin)
        assert sum(chunk.read for chunk in chunks) == len(P)


def numbers(notes: tuple[str, ...]) -> list[int]:
    return [int(note.split()[0].replace(",", "")) for note in notes]


def words(notes: tuple[str, ...]) -> list[str]:
    return [note.partition(" ")[2] for note in notes]


def test_points_in_a_box_are_those_that_another_reader_finds(tmp_path: Path) -> None:
    path = tmp_path / "a.copc.laz"
    path.write_bytes(DATA)
    with laspy.CopcReader.open(path) as theirs:
        record = theirs.query(Bounds(np.array([4010.0, 5010.0]), np.array([4020.0, 5025.0])))
    cloud = read_points(path, selection=Selection(crop=(SMALL,)))
    assert np.allclose(cloud.points + cloud.origin, np.column_stack([record.x, record.y, record.z]), rtol=0, atol=1e-9)


def test_only_what_lies_near_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, selection, unpacked = tmp_path / "a.copc.laz", Selection(crop=(SMALL,), z_unit="m"), []
    path.write_bytes(DATA)
    real = lazrs.decompress_points_with_chunk_table

    def spy(packed: Any, described: Any, out: Any, chunks: Any, *more: Any) -> Any:
        unpacked.append((sum(points for points, _ in chunks), len(packed)))
        return real(packed, described, out, chunks, *more)

    monkeypatch.setattr(lazrs, "decompress_points_with_chunk_table", spy)
    monkeypatch.setattr(laspy.LasReader, "read_points", None)
    cloud = read_points(path, "m", selection)
    assert len(cloud.points) == thin_scan(path, 1e-3, unit="m", selection=selection).read == len(inside_small(P))
    for points, size in unpacked:
        assert len(cloud.points) < points < 0.3 * len(P) and size < 0.3 * len(DATA)


def units(*codes: tuple[int, int]) -> tuple[bytes, int, bytes]:
    """Return GeoTIFF keys as a record."""
    keys = b"".join(struct.pack("<4H", key, 0, 1, value) for key, value in codes)
    return b"LASF_Projection", 34735, struct.pack("<4H", 1, 1, 0, len(codes)) + keys


METRES, HEIGHTS_IN_FEET, FEET = units((3076, 9001)), units((3076, 9001), (4099, 9002)), units((3076, 9002))


@pytest.mark.parametrize(
    ("record", "unit", "z_unit", "scale"),
    [
        (METRES, "", "", (1, 1, 1)),
        (HEIGHTS_IN_FEET, "", "", (1, 1, FOOT)),
        (METRES, "", "foot", (1, 1, FOOT)),
        (FEET, "", "", (1, 1, 1)),
        (FEET, "m", "", (1, 1, 1)),
        (METRES, "foot", "", (1, 1, 1)),
    ],
)
def test_a_crop_is_in_the_unit_of_the_scan(
    tmp_path: Path, record: tuple[bytes, int, bytes], unit: str, z_unit: str, scale: tuple[float, float, float]
) -> None:
    path = tmp_path / "a.copc.laz"
    data, order = copc(P, levels=4, records=(record,))
    path.write_bytes(data)
    points = P[order] * scale
    lower, upper = np.array([4010, 5010, -1 * scale[2]]), np.array([4040, 5050, 4 * scale[2]])
    crop = f"box:{','.join(map(str, [*lower, *upper]))}"
    cloud = read_points(path, unit, Selection(crop=(crop,), z_unit=z_unit))
    wanted = points[np.all((points >= lower) & (points <= upper), axis=1)]
    assert np.allclose(cloud.points + cloud.origin, wanted, rtol=0, atol=1e-9)


def test_a_crop_is_in_the_unit_of_the_first_file(tmp_path: Path) -> None:
    data, order = copc(P / FOOT, levels=4, records=(FEET,))
    (tmp_path / "b.copc.laz").write_bytes(data)
    (tmp_path / "a.csv").write_text("x [m],y [m],z [m]\n4015,5015,1\n4016,5016,1\n4015,5016,1\n")
    names = [tmp_path / "a.csv", tmp_path / "b.copc.laz"]
    selection = Selection(crop=(SMALL,))
    cloud = read_points(names, selection=selection)
    inside = inside_small(P[order])
    assert cloud.unit == "m" and np.allclose(cloud.points[3:] + cloud.origin, inside, rtol=0, atol=1e-3)
    assert thin_scan(names, 1e-3, selection=selection).read == len(cloud.points)


def table(change: Callable[[bytearray, int, int], None]) -> Callable[[bytes], bytes]:
    """Return a change of a file by where its table is and how many entries it has."""

    def changed(data: bytes) -> bytes:
        copy = bytearray(data)
        place, size = struct.unpack_from("<2Q", data, 429 + 40)
        change(copy, place, size // ENTRY.size)
        return bytes(copy)

    return changed


def put(form: str, at: int, *values: float, entry: int | None = None) -> Callable[[bytes], bytes]:
    """Return a change of a file, or of an entry of its table."""

    def change(data: bytearray, place: int, entries: int) -> None:
        struct.pack_into(form, data, at if entry is None else place + ENTRY.size * entry + at, *values)

    return table(change)


def swap(data: bytearray, place: int, entries: int) -> None:
    """Swap the keys of the last two boxes."""
    one, two = (place + ENTRY.size * (entries - back) for back in (1, 2))
    data[one : one + 16], data[two : two + 16] = data[two : two + 16], data[one : one + 16]


def refer_to_itself(data: bytearray, place: int, entries: int) -> None:
    struct.pack_into("<Q2i", data, place + 16, place, ENTRY.size * entries, -1)


BROKEN = {
    "no such place": put("<Q", 429 + 40, 1 << 63),
    "before the file": put("<Q", 429 + 40, 0),
    "too long": put("<Q", 429 + 48, 1 << 40),
    "too short": put("<Q", 429 + 48, 5 * ENTRY.size),
    "nothing": put("<Q", 429 + 48, 0),
    "not finite": put("<d", 429, np.nan),
    "another cube": put("<d", 429, 5000.0),
    "a small cube": put("<d", 429 + 24, 10.0),
    "no cube": put("<d", 429 + 24, -50.0),
    "a level too deep": put("<i", 0, 99, entry=3),
    "a level below": put("<i", 0, -7, entry=3),
    "a key beyond": put("<i", 4, 9, entry=3),
    "a key twice": put("<4i", 0, 2, 0, 0, 0, entry=20),
    "no points": put("<i", 28, 0, entry=3),
    "more points": put("<i", 28, 4000, entry=3),
    "another place": put("<Q", 16, 9999, entry=3),
    "keys of each other": table(swap),
    "a page that is no page": put("<i", 28, -1, entry=3),
    "a page without end": table(refer_to_itself),
}


@pytest.mark.parametrize("name", BROKEN)
def test_with_a_broken_table_all_is_read(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.copc.laz"
    path.write_bytes(BROKEN[name](DATA))
    with laspy.open(path) as file:
        assert find_boxes(path, file.header) is None
    inside = inside_small(P[ORDER])
    cloud = read_points(path, selection=Selection(crop=(SMALL,)))
    assert np.allclose(cloud.points + cloud.origin, inside, rtol=0, atol=1e-9)
    assert thin_scan(path, 1e-3, selection=Selection(crop=(SMALL,))).read == len(inside)


def deepen(data: bytearray, place: int, entries: int) -> None:
    """Give the first box of level 1 the key of a small box around its first point."""
    x, y, z, half = struct.unpack_from("<4d", data, 429)
    at = next(at for at in range(place, place + 9 * ENTRY.size, ENTRY.size) if data[at] == 1)
    begin = struct.unpack_from("<Q", data, at + 16)[0]
    first = np.array(struct.unpack_from("<3i", data, begin)) * 0.001 + np.floor(P.min(axis=0))
    keys = np.floor((first - np.array([x, y, z]) + half) / (2 * half) * 2**9).astype(int)
    struct.pack_into("<4i", data, at, 9, *keys.tolist())


def test_boxes_without_their_points_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.copc.laz"
    path.write_bytes(table(deepen)(DATA))
    crop = Selection(crop=("box:4000,5000,9000,9000",))
    with pytest.raises(FormatError, match=r"a\.copc\.laz has points outside the boxes that its COPC table gives them"):
        read_points(path, selection=crop)
    with pytest.raises(FormatError, match="outside the boxes"):
        thin_scan(path, 1.0, selection=crop)
    assert len(read_points(path).points) == len(P)


def test_where_nothing_is_left_the_scan_is_described(tmp_path: Path) -> None:
    path = tmp_path / "a.copc.laz"
    path.write_bytes(DATA)
    crop = Selection(crop=("box:0,0,1,1",))
    with pytest.raises(InputError, match=r"of 4,000 points 4,000 outside the box; the scan has x, y, z from 40\d\d"):
        read_points(path, selection=crop)
    with pytest.raises(
        InputError, match=r"of 4,000 points 4,000 outside the box; some of them have x, y, z from 40\d\d"
    ):
        thin_scan(path, 1.0, selection=crop)


def test_the_thinned_scan_is_that_of_the_whole_file(both: tuple[Path, Path]) -> None:
    selection = Selection(crop=CROPS["polygon"])
    found, wanted = (thin_scan(path, 2.0, boundary=True, selection=selection) for path in both)
    assert found.points.tobytes() == wanted.points.tobytes() and found.read == wanted.read


def test_points_that_are_not_read_take_no_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scantruss.scan.stream.fit.NEVER_TOO_MANY_POINTS", 100)
    path = tmp_path / "a.copc.laz"
    path.write_bytes(DATA)
    assert spacing_to_fit(path, Settings(length=2.0), 2e5) == 0.1
    assert spacing_to_fit(path, Settings(length=2.0, crop=(SMALL,)), 2e5) == 0.0
    assert spacing_to_fit(path, Settings(length=2.0, crop=(SMALL,)), 100.0) == 0.1
