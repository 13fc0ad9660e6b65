"""Broken files of every format: one line, exit status 2, in bounded time and memory, and nothing written beside it."""

from __future__ import annotations

import base64
import gzip
import io
import re
import struct
import subprocess
import sys
import warnings
import zipfile
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import rasterio
from e57_file import to_pages
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scan_files import axes, e57, geotiff, npy, pcd, plate, text, whole_files

from scantruss.cli.main import main
from scantruss.errors import FormatError, InputError, ScanTrussError
from scantruss.scan.cloud import PointCloud
from scantruss.scan.formats.e57_header import DATA_BYTES
from scantruss.scan.formats.reading import read_points
from scantruss.scan.formats.table import READERS
from scantruss.scan.stream.thin_scan import thin_scan

FILES = whole_files()
HUGE = 10**12
MEMORY = 3 << 30  # bytes of address space, of which libraries take most
PDF = b"%PDF-1.7\n1 0 obj\n<</Type/Catalog>>\nendobj\n" * 20


def pages(file: bytes) -> bytearray:
    """Return the data of an E57 file without its checksums."""
    return bytearray(np.frombuffer(file, np.uint8).reshape(-1, 1024)[:, :DATA_BYTES].tobytes())


def in_e57(old: bytes, new: bytes, file: bytes = FILES["a.e57"]) -> bytes:
    """Return an E57 file with another text in its XML, and right checksums."""
    data = pages(file).replace(old, new)
    start = data.index(b"<?xml")
    (length,) = struct.unpack_from("<Q", data, 32)
    data = data[: start + length + (len(new) - len(old)) * pages(file).count(old)]
    struct.pack_into(
        "<QQQ",
        data,
        16,
        -(-len(data) // DATA_BYTES) * 1024,
        start // DATA_BYTES * 1024 + start % DATA_BYTES,
        len(data) - start,
    )
    return to_pages(bytes(data)).tobytes()


def las_with(place: int, form: str, *values: float, file: str = "a.las") -> bytes:
    data = bytearray(FILES[file])
    struct.pack_into(form, data, place, *values)
    return bytes(data)


def archive(**members: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zipped:
        for name, data in members.items():
            zipped.writestr(f"{name}.npy", data)
    return file.getvalue()


def npy_claiming(shape: str, kind: str = "<f8") -> bytes:
    head = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"
    head = head.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode() + bytes(240)


def ply_claiming(count: int, form: str = "binary_little_endian", kind: str = "double") -> bytes:
    properties = "".join(f"property {kind} {axis}\n" for axis in "xyz")
    return f"ply\nformat {form} 1.0\nelement vertex {count}\n{properties}end_header\n".encode()


BODY = plate().astype("<f8").tobytes()
THREE = list(zip("xyz", ["f8"] * 3, plate().T, strict=True))
COMPRESSED = FILES["c.pcd"]
START = COMPRESSED.index(b"DATA binary_compressed\n") + 23


def packed_model(model: bytes) -> bytes:
    """A 3MF package."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as zipped:
        zipped.writestr("3D/3dmodel.model", model)
    return file.getvalue()


def packed_numbers(packed: bytes) -> tuple[bytes, bytes]:
    """The numbers of the points in d.vtp, and others that unpack to far more than they say."""
    found = re.search(rb'Name="Points"[^>]*>([^<]*)<', FILES["d.vtp"])
    assert found
    return found[1], base64.b64encode(struct.pack("<4Q", 1, 1024, 0, len(packed))) + base64.b64encode(packed)


def dxf_of_lines() -> bytes:
    """A drawing without points."""
    drawing, stream = ezdxf.new(), io.StringIO()
    drawing.modelspace().add_line((0, 0), (1, 1))
    drawing.write(stream)
    return stream.getvalue().encode()


#: broken files by the name they get
BROKEN: dict[str, bytes] = {
    # huge claims
    "huge.ply": ply_claiming(HUGE) + BODY,
    "huge-ascii.ply": ply_claiming(HUGE, "ascii") + text(plate()),
    "huge-list.ply": b"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int i\nelement vertex 3\n"
    b"property float x\nproperty float y\nproperty float z\nend_header\n" + struct.pack("<I", 4_000_000_000) + BODY,
    "huge.pts": text(plate(), f"{HUGE}\n"),
    "huge.off": text(plate(), f"OFF\n{HUGE} 0 0\n"),
    "huge.stl": bytes(80) + struct.pack("<I", 4_000_000_000) + bytes(500),
    "huge.npy": npy_claiming(f"({HUGE}, 3)"),
    "huge-product.npy": npy_claiming(f"({HUGE}, {HUGE})"),
    "huge.npz": archive(points=npy_claiming(f"({HUGE}, 3)")),
    "huge.las": las_with(247, "<Q", HUGE),
    "huge.laz": las_with(247, "<Q", HUGE, file="a.laz"),
    "huge-records.las": las_with(100, "<I", 4_000_000_000),
    "huge-evlr.las": las_with(235, "<QI", 375, 4_000_000_000),
    "huge.pcd": re.sub(rb"(WIDTH|POINTS) 120", b"\\1 1000000000000", FILES["b.pcd"]),
    "huge-ascii.pcd": re.sub(rb"(WIDTH|POINTS) 120", b"\\1 1000000000000", FILES["a.pcd"]),
    "huge-packed.pcd": COMPRESSED[: START + 4] + struct.pack("<I", 4_000_000_000) + COMPRESSED[START + 8 :],
    "huge-both.pcd": re.sub(rb"(WIDTH|POINTS) 120", b"\\1 100000000", COMPRESSED),
    "huge-count.pcd": FILES["b.pcd"].replace(b"COUNT 1 1 1", b"COUNT 1 1 1000000000"),
    "huge.e57": in_e57(b'recordCount="120"', b'recordCount="1000000000000"'),
    "huge-no-bits.e57": in_e57(
        b'recordCount="120"',
        b'recordCount="1000000000000"',
        e57((axes(np.full((120, 3), 7.0), "integer", low=7, high=7), "")),
    ),
    # wrong counts, types and flags of the header
    "negative.ply": ply_claiming(-5) + BODY,
    "endian.ply": FILES["own.ply"].replace(b"binary_little_endian", b"binary_big_endian"),
    "type.ply": ply_claiming(120, kind="quadruple") + BODY,
    "scale.las": las_with(131, "<3d", np.nan, np.nan, np.nan),
    "scale-huge.las": las_with(131, "<3d", 1e300, 1e300, 1e300),
    "format.las": las_with(104, "<B", 77),
    "short-records.las": las_with(105, "<H", 3),
    "offset.las": las_with(96, "<I", 4_000_000_000),
    "version.las": las_with(24, "<BB", 9, 9),
    "flag.las": las_with(104, "<B", 6 | 128),  # says that it is compressed
    "flag.laz": las_with(104, "<B", 6, file="own.laz")[:300],
    "area.pcd": FILES["b.pcd"].replace(b"WIDTH 120", b"WIDTH 119"),
    "size.pcd": FILES["b.pcd"].replace(b"SIZE 4 8 4", b"SIZE 4 3 4"),
    "types.pcd": FILES["b.pcd"].replace(b"TYPE F F F", b"TYPE F F"),
    "data.pcd": FILES["b.pcd"].replace(b"DATA binary", b"DATA squeezed"),
    "no-z.pcd": FILES["b.pcd"].replace(b"FIELDS x y z", b"FIELDS x y w"),
    "packed-as-ascii.pcd": COMPRESSED.replace(b"DATA binary_compressed", b"DATA ascii"),
    "plain-as-packed.pcd": FILES["b.pcd"].replace(b"DATA binary", b"DATA binary_compressed"),
    "negative.pcd": FILES["b.pcd"].replace(b"POINTS 120", b"POINTS -120").replace(b"WIDTH 120", b"WIDTH -120"),
    "page.e57": FILES["a.e57"][:40] + struct.pack("<Q", 512) + FILES["a.e57"][48:],
    "flipped.e57": FILES["a.e57"][:700] + bytes([FILES["a.e57"][700] ^ 1]) + FILES["a.e57"][701:],
    "offset.e57": in_e57(b'fileOffset="48"', b'fileOffset="99999999"'),
    "limits.e57": in_e57(b'maximum="60000"', b'maximum="-9999"'),
    "type.e57": in_e57(b'type="ScaledInteger"', b'type="Complex"'),
    "no-axes.e57": in_e57(b"cartesianY", b"cartesianQ"),
    "rotation.e57": in_e57(b'<w type="Float">0.6</w>', b'<w type="Float">nan</w>'),
    "entities.e57": in_e57(b"<e57Root", b'<!DOCTYPE a [<!ENTITY b "c">]><e57Root'),
    "open.e57": in_e57(b"</data3D>", b""),
    "no-scan.e57": in_e57(b"vectorChild", b"nothingHere"),
    "kind.npy": npy(np.array(["a", "b"])),
    "objects.npy": npy_claiming("(10,)", "|O"),
    "code.npy": b"\x93NUMPY\x01\x00v\x00{'descr': __import__('os').getcwd(), 'fortran_order': False, 'shape': (3, 3)}" + bytes(99),
    "objects.npz": archive(a=npy_claiming("(10,)", "|O")),
    # archives in archives
    "nested.xyz.gz": gzip.compress(gzip.compress(text(plate()))),
    "nested.gz.gz": gzip.compress(gzip.compress(text(plate()))),
    "cut.xyz.gz": FILES["a.xyz.gz"][:-9],
    "damaged.xyz.gz": FILES["a.xyz.gz"][:60] + bytes(9) + FILES["a.xyz.gz"][69:],
    "plain.xyz.gz": text(plate()),
    "bomb.tif": geotiff(plate(), width=30_000, height=30_000, sparse_ok=True, compress="deflate"),
    # scenes, models and rasters that hold no scan
    "huge.glb": FILES["a.glb"].replace(b'"count":120', b'"count":999'),
    "huge.gltf": re.sub(rb'"count": 120', b'"count": 1000000000000', FILES["a.gltf"]),
    "beside.gltf": re.sub(rb'"uri": "[^"]*"', b'"uri": "missing.bin"', FILES["a.gltf"]),
    "draco.gltf": FILES["a.gltf"].replace(b'"asset"', b'"extensionsUsed": ["KHR_draco_mesh_compression"], "asset"'),
    "ring.gltf": b'{"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"children": [0]}]}',
    "ring.3mf": packed_model(b'<model><resources><object id="1"><components><component objectid="1"/></components></object></resources>'
                             b'<build><item objectid="1"/></build></model>'),
    "entities.3mf": packed_model(b'<!DOCTYPE a [<!ENTITY b "c">]><model/>'),
    "entities.vtp": FILES["a.vtp"].replace(b"<VTKFile", b'<!DOCTYPE a [<!ENTITY b "c">]><VTKFile', 1),
    "image.vtp": FILES["a.vtp"].replace(b"PolyData", b"ImageData"),
    "less.vtp": FILES["a.vtp"].replace(b'NumberOfPoints="120"', b'NumberOfPoints="121"'),
    "picture.tif": geotiff(plate() * 5, count=3, dtype="uint8"),
    "complex.tif": geotiff(plate(), dtype="complex64"),
    "no-place.tif": geotiff(plate(), transform=rasterio.Affine.identity()),
    "no-heights.tif": geotiff(np.full((120, 3), -9999.0), nodata=-9999.0),
    "degrees.tif": geotiff(plate(), crs="EPSG:4326", transform=rasterio.Affine(1e-4, 0, 13.0, 0, -1e-4, 52.0)),
    "lines.dxf": dxf_of_lines(),
    # points that are none
    "nan.xyz": b"nan nan nan\n" * 50,
    "nan.pcd": pcd([(a, "f4", np.full(50, np.nan)) for a in "xyz"], "binary"),
    "nan.e57": e57((axes(np.full((50, 3), np.nan)), "")),
    "infinite.npy": npy(np.full((50, 3), np.inf)),
    "none.pcd": pcd([(a, "f4", np.empty(0)) for a in "xyz"], "binary"),
    "none.npy": npy(np.empty((0, 3))),
    "degrees.csv": text(plate(), "lon,lat,height\n", ","),
    "deep.csv": b"[" * 100_000,
    "long-line.xyz": b"1 " * 1_000_000,
    "quotes.csv": b'"' * 100_000 + b"\n",
}  # fmt: skip
BROKEN |= {f"document{suffix}": PDF for suffix in READERS}
BROKEN |= {f"noise{suffix}": np.random.default_rng(4).bytes(5000) for suffix in READERS}
BROKEN |= {
    f"noise-behind-{name}": data[:64] + np.random.default_rng(5).bytes(len(data))
    for name, data in FILES.items()
    if Path(name).suffix
    in (".ply", ".laz", ".las", ".pcd", ".e57", ".npy", ".npz", ".parquet", ".gz", ".glb", ".3mf", ".vtp", ".tif")
}

#: archives that unpack to far more than they are, which take long to make
BOMBS: dict[str, Callable[[], bytes]] = {
    "bomb.xyz.gz": lambda: gzip.compress(bytes(80 << 20), 1),
    "bomb-text.xyz.gz": lambda: gzip.compress(b"1 2 3\n" * (13 << 20), 1),
    "bomb.npz": lambda: archive(points=npy_claiming("(30000000, 3)", "|u1")[:128] + bytes(90_000_000)),
    "bomb.3mf": lambda: packed_model(b"<model>" + b" " * (80 << 20) + b"</model>"),
    "bomb.vtp": lambda: FILES["d.vtp"].replace(*packed_numbers(zlib.compress(bytes(80 << 20)))),
}
NAMES = sorted([*BROKEN, *BOMBS])


@cache
def broken(name: str) -> bytes:
    """Return the bytes of a broken file."""
    return BOMBS[name]() if name in BOMBS else BROKEN[name]


@pytest.mark.parametrize("name", NAMES)
def test_a_broken_file_is_refused_in_one_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / name
    path.write_bytes(broken(name))
    out = tmp_path / "grid.obj"
    with pytest.raises(ScanTrussError):  # the file itself will not do, whatever is asked of it
        read_points(path)
    assert main(["grid", str(path), str(out), "--length", "5"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("scantruss: ") and said.err.count("\n") == 1
    assert name in said.err or "points" in said.err
    assert [entry.name for entry in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", sorted(FILES))
def test_a_whole_file_is_read_and_a_part_of_it_is_not(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    whole = FILES[name]
    path.write_bytes(whole)
    assert len(read_points(path).points) >= 119
    counted = not re.search(r"\.(xyz|txt|asc|csv|obj)$", name)  # these do not say how long they should be
    for share in (0.0, 0.02, 0.2, 0.5, 0.8, 0.97):
        path.write_bytes(whole[: int(share * len(whole))])
        if counted:
            with pytest.raises(ScanTrussError) as caught:
                read_points(path)
            assert "\n" not in str(caught.value)
        else:
            read_or_refuse(path)


@pytest.mark.parametrize("name", ["a.las", "a.e57"])
def test_a_header_that_promises_less_than_there_is_is_told_once(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(FILES[name])
    whole = read_points(path)
    assert whole.notes == ()
    words = re.search(rb'recordCount="(\d+)"', pages(FILES["a.e57"]))
    assert words
    count = len(whole.points) if name == "a.las" else int(words[1])
    less = in_e57(words[0], b'recordCount="%0*d"' % (len(words[1]), count - 20))
    path.write_bytes(las_with(247, "<Q", count - 20) if name == "a.las" else less)
    cloud = read_points(path)
    scans = len(whole.points) // count
    assert len(cloud.points) == len(whole.points) - 20 * scans
    said = f"the header of {name} promises {count - 20:,} points.*, the file has {count:,}; the others are left out"
    for notes in (cloud.notes, thin_scan(path, 1e-3).notes):
        assert len(notes) == scans and all(re.fullmatch(said, note) for note in notes)


@pytest.mark.parametrize("name", ["huge.npy", "huge-product.npy", "huge.npz"])
def test_the_claim_of_an_array_is_held_against_the_file_and_not_the_memory(name: str, tmp_path: Path) -> None:
    """Where memory is promised and not looked for, as systems do, a claim of some gigabytes would be followed."""
    path = tmp_path / name
    path.write_bytes(broken(name))
    with pytest.raises(FormatError, match=r"ends early: its header promises an array .* of [\d,]+ bytes, got 240"):
        read_points(path)


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, ({memory}, {memory}))
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
resource.setrlimit(resource.RLIMIT_FSIZE, (300 << 20, 300 << 20))
from scantruss.cli.main import main
for name in sys.argv[1:]:
    status = main(["grid", name, name + ".grid.obj", "--length", "5"])
    assert status == 2, (name, status)
"""


def test_huge_claims_take_neither_memory_nor_time(tmp_path: Path) -> None:
    pytest.importorskip("resource")
    names = [name for name in NAMES if name.startswith(("huge", "bomb", "nested", "long"))]
    for name in names:
        (tmp_path / name).write_bytes(broken(name))
    code = LIMITED.format(memory=MEMORY)
    paths = [str(tmp_path / name) for name in names]
    done = subprocess.run([sys.executable, "-c", code, *paths], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == len(names) and all(line.startswith("scantruss: ") for line in lines), done.stderr
    assert not list(tmp_path.glob("*.grid.obj"))


def read_or_refuse(path: Path) -> PointCloud | None:
    """Read a file that may be broken: finite points, or a refusal in one line; never another error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        try:
            cloud = read_points(path)
        except (FormatError, InputError) as error:
            assert "\n" not in str(error) and len(str(error)) < 500 + len(str(path))
            return None
    assert np.isfinite(cloud.points).all() and len(cloud.points) >= 3
    return cloud


edit = st.tuples(
    st.sampled_from(["set", "flip", "cut", "insert", "double", "zero", "word"]),
    st.floats(0, 1, exclude_max=True),
    st.integers(0, 255),
    st.integers(1, 40),
)
WORDS = (b"999999999999", b"-1", b"nan", b"1e999", b"\xff\xff\xff\xff", b"\x00\x00\x00\x80", b"</", b"\n", b'"', b"0")


def damaged(data: bytes, edits: list[tuple[str, float, int, int]]) -> bytes:
    """Return a file after some edits; half of the places are in the header."""
    new = bytearray(data)
    for kind, where, value, size in edits:
        reach = len(new) if where < 0.5 else min(len(new), 400)
        place = int((2 * where % 1) * reach)
        if kind == "set":
            new[place : place + 1] = bytes([value])
        elif kind == "flip" and new:
            new[min(place, len(new) - 1)] ^= 1 << value % 8
        elif kind == "cut":
            del new[place : place + size]
        elif kind == "insert":
            new[place:place] = bytes([value]) * size
        elif kind == "double":
            new[place:place] = new[place : place + size]
        elif kind == "zero":
            new[place : place + size] = bytes(len(new[place : place + size]))
        else:
            word = WORDS[value % len(WORDS)]
            new[place : place + len(word)] = word
    return bytes(new)


@pytest.mark.parametrize("name", sorted(FILES))
@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=st.lists(edit, min_size=1, max_size=4))
def test_a_damaged_file_is_read_or_refused(name: str, edits: list[Any], tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(damaged(FILES[name], edits))
    read_or_refuse(path)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=st.lists(edit, min_size=1, max_size=4), name=st.sampled_from(["a.e57", "b.e57"]))
def test_an_e57_file_damaged_under_its_checksums_is_read_or_refused(
    edits: list[Any], name: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(to_pages(damaged(bytes(pages(FILES[name])), edits)).tobytes())
    read_or_refuse(path)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    data=st.binary(min_size=1, max_size=300),
    suffix=st.sampled_from(sorted(READERS)),
    start=st.sampled_from(sorted(FILES)),
)
def test_any_bytes_are_read_or_refused(data: bytes, suffix: str, start: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(FILES[start][:40] + data)
    read_or_refuse(path)
