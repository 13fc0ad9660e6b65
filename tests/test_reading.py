"""Every point of every format, from files by other writers and from hand-written bytes; and what is refused."""

from __future__ import annotations

import gzip
import re
import struct
import zipfile
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
import trimesh
from copc_file import copc
from scan_files import plate, text
from typed import known

from scantruss.errors import FormatError, InputError
from scantruss.scan.formats.reading import read_points
from scantruss.scan.formats.table import READERS
from scantruss.scan.formats.writing import write_points
from scantruss.scan.stream.tiles import find_source

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
UTM = np.array([500_000.0, 4_500_000.0, 100.0])


def roof(count: int = 60) -> np.ndarray:
    """Return points with three decimals on a national grid, (count, 3)."""
    return np.round(np.random.default_rng(5).random((count, 3)) * [40, 30, 8], 3) + UTM


def coordinates(path: Path) -> np.ndarray:
    """Return what was read, in the scan's own frame."""
    cloud = read_points(path)
    assert cloud.name == path.name
    assert cloud.points.dtype == np.float64
    back: np.ndarray = cloud.points + cloud.origin
    return back


def ply(points: np.ndarray, form: str, kind: str = "double", end: bytes = b"\n") -> bytes:
    """Return a PLY file whose points stand between lists, with properties before and after x, y, z."""
    lines = (
        f"ply|format {form} 1.0|comment element vertex 7|obj_info num_cols 512|element camera 1|property float f"
        "|property list uchar short ids|element material 0|property int m"
        f"|element vertex {len(points)}|property uchar red|property {kind} x|property {kind} y|property {kind} z"
        "|property float confidence|element face 3|property list uint8 int32 vertex_indices|property uchar flag"
        "|element tristrips 1|property list int int vertex_indices|end_header|"
    )
    head = lines.encode().replace(b"|", end)
    faces = [[0, 1, 2], [0, 1, 2, 3], [2, 3, 4]]
    if form == "ascii":
        rows = ["2.5 2 7 8", *(f"9 {x!r} {y!r} {z!r} 0.5" for x, y, z in points.tolist())]
        rows += [f"{len(f)} {' '.join(map(str, f))} 1" for f in faces] + ["5 0 1 2 -1 3"]
        return head + end.join(row.encode() for row in rows) + end
    order = "<" if "little" in form else ">"
    letter = {"double": "d", "float": "f", "int": "i"}[kind]
    body = struct.pack(order + "fBhh", 2.5, 2, 7, 8)
    for x, y, z in points.tolist():
        body += struct.pack(f"{order}B3{letter}f", 9, x, y, z, 0.5)
    for face in faces:
        body += struct.pack(f"{order}B{len(face)}iB", len(face), *face, 1)
    return head + body + struct.pack(order + "6i", 5, 0, 1, 2, -1, 3)


FORMS = ("ascii", "binary_little_endian", "binary_big_endian")


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"], ids=["LF", "CRLF", "CR"])
@pytest.mark.parametrize("form", FORMS)
def test_ply_of_every_order_and_line_end(tmp_path: Path, form: str, end: bytes) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(ply(roof(), form, end=end))
    assert np.array_equal(coordinates(path), roof())


@pytest.mark.parametrize("form", FORMS[1:])
def test_ply_whose_data_starts_with_the_sign_of_a_line_end(tmp_path: Path, form: str) -> None:
    points = np.array([[10, 0, 0], [0, 13, 0], [9, 9, 9]])
    head = (
        f"ply\rformat {form} 1.0\relement vertex 3\rproperty uchar x\rproperty uchar y\rproperty uchar z\rend_header\r"
    )
    path = tmp_path / "a.ply"
    path.write_bytes(head.encode() + points.astype("u1").tobytes())
    assert np.array_equal(coordinates(path), points)


@pytest.mark.parametrize("kind", ["float", "int"])
@pytest.mark.parametrize("form", FORMS)
def test_ply_with_coordinates_of_other_types(tmp_path: Path, form: str, kind: str) -> None:
    points = np.round(roof() - UTM).astype("f4" if kind == "float" else "i4")
    path = tmp_path / "a.PLY"
    path.write_bytes(ply(points, form, kind))
    assert np.array_equal(coordinates(path), points)


@pytest.mark.parametrize("form", FORMS)
def test_ply_with_lists_in_the_rows_of_the_points(tmp_path: Path, form: str) -> None:
    points = roof(300)
    head = (
        f"ply\nformat {form} 1.0\nelement vertex {len(points)}\nproperty double z\nproperty list uchar int seen\n"
        "property double x\nproperty list uchar double x\nproperty double y\nend_header\n"
    )
    order = "<" if "little" in form else ">"
    path = tmp_path / "a.ply"
    if form == "ascii":
        rows = [f"{z!r} {i % 3} {'4 ' * (i % 3)}{x!r} 1 5 {y!r}\n" for i, (x, y, z) in enumerate(points.tolist())]
        path.write_text(head + "".join(rows))
    else:
        body = b"".join(
            struct.pack(f"{order}dB{i % 3}idBdd", z, i % 3, *[4] * (i % 3), x, 1, 5.0, y)
            for i, (x, y, z) in enumerate(points.tolist())
        )
        path.write_bytes(head.encode() + body)
    assert np.array_equal(coordinates(path), points)


def test_ascii_ply_need_not_keep_to_lines(tmp_path: Path) -> None:
    axes = "".join(f"property double {axis}\n" for axis in "xyz")
    head = f"ply\nformat ascii 1.0\nelement vertex 60\n{axes}end_header\n"
    words = " ".join(map(repr, roof().ravel().tolist()))
    lines = "\n".join(" ".join(map(repr, row)) for row in roof().tolist())
    halfway = lines[:900] + lines[900:].replace("\n", " ")
    for number, body in enumerate([words, words.replace(" ", "\n"), "\n\n" + words.replace(" ", "\n  "), halfway]):
        path = tmp_path / f"{number}.ply"
        path.write_text(head + body)
        assert np.array_equal(coordinates(path), roof())


@pytest.mark.parametrize("form", FORMS)
def test_a_ply_that_ends_early_is_refused_wherever_it_ends(tmp_path: Path, form: str) -> None:
    whole = ply(roof(), form)
    path = tmp_path / "a.ply"
    ends = range(4, len(whole) - 1, 37) if form != "ascii" else range(4, len(whole) - 12, 37)
    for end in ends:
        path.write_bytes(whole[:end])
        with pytest.raises(FormatError):
            read_points(path)


@pytest.mark.parametrize("version", ["1.2", "1.4"])
@pytest.mark.parametrize("suffix", ["las", "laz"])
def test_las_and_laz_with_scale_and_offset(tmp_path: Path, suffix: str, version: str) -> None:
    header = laspy.LasHeader(point_format=3 if version == "1.2" else 6, version=version)
    header.scales, header.offsets = [0.001, 0.001, 0.001], UTM
    record = laspy.LasData(header)
    record.x, record.y, record.z = roof().T
    path = tmp_path / f"a.{suffix}"
    record.write(path)
    assert np.abs(coordinates(path) - roof()).max() < 1e-8
    whole = path.read_bytes()
    for part in (0.3, 0.6, 0.9, 0.99):
        path.write_bytes(whole[: int(part * len(whole))])
        with pytest.raises(FormatError):
            read_points(path)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("a.ply", {}),
        ("a.ply", {"encoding": "ascii"}),
        ("a.obj", {}),
        ("a.off", {}),
        ("a.stl", {}),
        ("a.stl", {"file_type": "stl_ascii"}),
    ],
)
def test_vertices_of_files_by_another_writer(tmp_path: Path, name: str, options: dict[str, str]) -> None:
    solid = trimesh.creation.icosphere(2, radius=7.0)
    path = tmp_path / name
    solid.export(path, **options)
    points = coordinates(path)
    assert len(points) == len(solid.vertices)
    order, expected = np.lexsort(points.round(3).T), np.lexsort(solid.vertices.round(3).T)
    assert np.allclose(points[order], solid.vertices[expected], atol=1e-5)


def test_obj_keeps_every_vertex_in_order(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    rows = [f"  v\t{x!r} {y!r}   {z!r} 0.5 0.5 0.5 # {i}\nvn 0 0 1\n" for i, (x, y, z) in enumerate(roof().tolist())]
    path.write_text("# exported\r\nmtllib a.mtl\n" + "".join(rows) + "vt 0 0\nvp 1 2\nf 1 2 3\n")
    assert np.array_equal(coordinates(path), roof())
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1\n")
    with pytest.raises(FormatError, match="without three numbers"):
        read_points(path)


@pytest.mark.parametrize(
    "head", ["OFF\n60 1 0\n", "OFF 60 1 0\n", "# c\nCOFF # d\n# e\n60 1\n\n", "STCNOFF\n60 1 99 \n"]
)
def test_off_with_any_header(tmp_path: Path, head: str) -> None:
    path = tmp_path / "a.off"
    rows = [f"{x!r} {y!r} {z!r} 255 0 0 # c" for x, y, z in roof().tolist()]
    path.write_text(head + "\n".join(rows) + "\n3 0 1 2\n")
    assert np.array_equal(coordinates(path), roof())
    path.write_text(head + "\n".join(rows[:-1]))
    with pytest.raises(FormatError, match="ends early"):
        read_points(path)


def test_a_binary_stl_that_starts_like_a_text(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    trimesh.creation.box().export(path)
    whole = path.read_bytes()
    path.write_bytes(b"solid".ljust(80) + whole[80:])
    assert len(coordinates(path)) == 8
    path.write_bytes(whole[:-30])
    with pytest.raises(FormatError, match="ends early: its header promises 12 triangles"):
        read_points(path)


def test_npy_and_npz(tmp_path: Path) -> None:
    wide = np.column_stack([roof(), np.ones(60)])
    fields = np.zeros(60, [("i", "i4"), ("y", "f8"), ("x", "f8"), ("z", "f8")])
    fields["x"], fields["y"], fields["z"] = roof().T
    for array in (roof(), wide, np.asfortranarray(wide), fields, roof().astype(">f8")):
        np.save(tmp_path / "a.npy", array)
        assert np.array_equal(coordinates(tmp_path / "a.npy"), roof())
    odd = np.array([{"a": 1}], dtype=object)
    np.savez(tmp_path / "a.npz", odd=odd, names=np.array(["a"]), flat=np.ones(9), scan=wide, other=np.ones((5, 3)))
    assert np.array_equal(coordinates(tmp_path / "a.npz"), roof())
    np.savez_compressed(tmp_path / "b.npz", flat=np.ones(9))
    with pytest.raises(FormatError, match=r"an array of shape \(N, 3\) or wider that may be points, got flat \(9,\)"):
        read_points(tmp_path / "b.npz")
    np.save(tmp_path / "a.npy", roof().T)
    with pytest.raises(FormatError, match=r"points in columns, shape \(3, 60\); transpose it to \(N, 3\)"):
        read_points(tmp_path / "a.npy")
    assert find_source(tmp_path / "a.npy").whole  # who thins it says the same
    np.save(tmp_path / "a.npy", np.ones((60, 2)))
    with pytest.raises(FormatError, match=r"got float64 \(60, 2\)"):
        read_points(tmp_path / "a.npy")


@pytest.mark.parametrize("kind", ["i1", "u2", "<i4", "i8", "f2"])
def test_arrays_of_any_numbers(tmp_path: Path, kind: str) -> None:
    whole = np.round(np.random.default_rng(5).random((60, 3)) * 90).astype(kind)
    np.save(tmp_path / "a.npy", whole)
    assert np.array_equal(coordinates(tmp_path / "a.npy"), whole)


def test_what_no_scan_has_is_told_with_the_other_notes(tmp_path: Path) -> None:
    invalid = roof(1000)
    invalid[5, 2] = -3.4e38
    np.savez(tmp_path / "a.npz", invalid, roof(1000))
    first, second = read_points(tmp_path / "a.npz").notes
    assert "arr_0" in first and second.startswith("1 points with coordinates up to 3.4e+38")


@pytest.mark.parametrize("name", ["points", "xyz", "Positions", "vertices", "coords", "pts", "arr_0", "anything"])
def test_the_points_of_an_archive_are_found_by_name_wherever_they_stand(tmp_path: Path, name: str) -> None:
    others: dict[str, Any] = {"normals": np.ones((60, 3)), "K": np.eye(3), "pose": np.eye(4)}
    np.savez(tmp_path / "a.npz", **(others | {name: roof(), "rgb": np.ones((60, 3))}))
    assert np.array_equal(coordinates(tmp_path / "a.npz"), roof())


def test_an_archive_that_may_mean_several_arrays_is_refused_or_says_which(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", before=roof(), after=roof(), K=np.eye(3))
    with pytest.raises(FormatError, match="several arrays that may be the points, before, after; name the one"):
        read_points(tmp_path / "a.npz")
    np.savez(tmp_path / "a.npz", roof(), roof())
    assert read_points(tmp_path / "a.npz").notes == ("the points of a.npz are taken from arr_0, and not arr_1",)
    np.savez(tmp_path / "a.npz", normals=roof())
    with pytest.raises(FormatError, match="may be points, got normals"):
        read_points(tmp_path / "a.npz")


def test_points_that_are_not_finite_are_counted(tmp_path: Path) -> None:
    points = roof()
    points[7, 1] = np.nan
    np.save(tmp_path / "a.npy", points)
    cloud = read_points(str(tmp_path / "a.npy"), unit="m")
    assert (cloud.dropped, len(cloud.points), cloud.unit) == (1, 59, "m")


JPEG = b"\xff\xd8\xff\xe0\x00\x10JFIF\x00" + bytes(range(256)) * 8
HTML = b"<!DOCTYPE html>\n<html><body><p>1 2 3</p></body></html>\n"
PROSE = b"Dear reader,\nthis is a letter and no scan.\n"


@pytest.mark.parametrize("suffix", sorted(READERS))
@pytest.mark.parametrize("content", [JPEG, HTML, PROSE, bytes(500), b"\n", b"\x00\x01"], ids=list("jhpzlb"))
def test_a_file_of_another_kind_is_refused(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    with pytest.raises(FormatError) as caught:
        read_points(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_wrong_suffix_is_named_with_what_the_file_is(tmp_path: Path) -> None:
    solid = trimesh.creation.icosphere(1)
    for kind in ("ply", "stl", "off", "obj"):
        solid.export(tmp_path / f"a.{kind}", **({"file_type": "stl_ascii"} if kind == "stl" else {}))
    np.save(tmp_path / "a.npy", roof())
    np.savez(tmp_path / "a.npz", roof())
    laspy.LasData(laspy.LasHeader()).write(tmp_path / "a.las")
    (tmp_path / "a.jpg").write_bytes(JPEG)
    (tmp_path / "a.html").write_bytes(HTML)
    words = {
        "ply": "a PLY file", "stl": "an STL file", "off": "an OFF file", "obj": "an OBJ file", "npy": "an NPY file",
        "npz": "a zip archive", "las": "a LAS or LAZ file", "jpg": "a JPEG picture", "html": "a web page",
    }  # fmt: skip
    for kind, said in words.items():
        for suffix in sorted(READERS):
            if {suffix, f".{kind}"} <= {".las", ".laz"} or suffix == f".{kind}":
                continue
            wrong = tmp_path / f"wrong{suffix}"
            wrong.write_bytes((tmp_path / f"a.{kind}").read_bytes())
            with pytest.raises(FormatError, match=f"but {said};"):
                read_points(wrong)


def test_only_what_may_be_json_is_called_that(tmp_path: Path) -> None:
    path = tmp_path / "a.pts"
    path.write_text('{"type": "Point", "coordinates": [1, 2, 3]}\n')
    with pytest.raises(FormatError, match="but a JSON file;"):
        read_points(path)
    path.write_bytes(b"[Expe/PointSet/Binary/0.1]\nproperty position 12\n" + np.ones(300, np.float32).tobytes())
    with pytest.raises(FormatError, match="but other binary data;"):
        read_points(path)


def test_missing_empty_folder_and_unknown_suffix(tmp_path: Path) -> None:
    (tmp_path / "empty.ply").touch()
    (tmp_path / "folder.ply").mkdir()
    (tmp_path / "a.xzy").write_text("1 2 3\n")
    for name, words in {
        "none.ply": "does not exist",
        "empty.ply": "is empty",
        "folder.ply": "is a folder",
        "a.xzy": r'no reader for "\.xzy" .*use one of \.3mf .*\.ply .*\.xyz',
    }.items():
        with pytest.raises(FormatError, match=words):
            read_points(tmp_path / name)
    with pytest.raises(InputError, match="unit must be one of"):
        read_points(tmp_path / "a.xzy", unit="mile")


@pytest.mark.parametrize("form", FORMS)
def test_no_points_and_no_coordinates(tmp_path: Path, form: str) -> None:
    path = tmp_path / "a.ply"
    start = f"ply\nformat {form} 1.0\n"
    axes = "property float x\nproperty float y\n"
    for header, words in {
        start + "element vertex 0\n" + axes + "property float z\nend_header\n": "holds no points",
        start + "element vertex 3\n" + axes + "end_header\n": "no property z",
        start + "element face 0\nend_header\n": "no element vertex",
        start + "element vertex many\nend_header\n": "cannot understand 'element vertex many'",
        start + "element vertex 9999999999999\n" + axes + "property float z\nend_header\n1 2 3\n": "ends early",
        start + "element vertex 3\n" + axes: "ends before its PLY header does",
    }.items():
        path.write_text(header)
        with pytest.raises(FormatError, match=words):
            read_points(path)


def test_a_damaged_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("points.npy", b"\x93NUMPY\x01\x00no array")
    with pytest.raises(FormatError, match="cannot be read as NPZ"):
        read_points(path)


def test_copc_is_read_as_another_reader_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "a.copc.laz"
    points = plate(3000)
    data, order = copc(points)
    path.write_bytes(data)
    with laspy.CopcReader.open(path) as theirs:
        assert len(theirs.query(level=0)) < 300  # it is an octree, and not only called so
        record = theirs.query()
        expected = np.column_stack([record.x, record.y, record.z])
    assert np.allclose(np.sort(coordinates(path), axis=0), np.sort(expected, axis=0), rtol=0, atol=1e-9)
    assert np.allclose(coordinates(path), points[order], rtol=0, atol=1e-9)


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian"])
def test_ply_axes_may_be_written_large(tmp_path: Path, form: str) -> None:
    path = tmp_path / "a.ply"
    points = plate()
    names = "".join(f"property double {name}\n" for name in ("Z", "nx", "X", "Y"))
    table = points[:, [2, 0, 0, 1]] * [1, -1, 1, 1]
    head = f"ply\nformat {form} 1.0\nelement vertex {len(points)}\n{names}end_header\n"
    path.write_bytes(head.encode() + (text(table) if form == "ascii" else table.astype("<f8").tobytes()))
    assert np.array_equal(coordinates(path), points)


def table() -> dict[str, int]:
    """Return the file names and the numbers of points in the README of the shared data."""
    if not (DATA / "README.md").exists():
        return {}
    rows = re.findall(r"^\| `([\w/.-]+\.\w+)` \|.*?\| ([\d,]+) \|", (DATA / "README.md").read_text(), re.MULTILINE)
    return {name: int(count.replace(",", "")) for name, count in rows}


@pytest.mark.skipif(not DATA.exists(), reason="the shared scans are not here")
@pytest.mark.parametrize("name", sorted(table()))
def test_shared_scans_hold_the_points_their_table_says(name: str) -> None:
    cloud = read_points(DATA / name)
    assert len(cloud.points) == table()[name]
    assert cloud.dropped == 0


def with_normals() -> tuple[np.ndarray, np.ndarray]:
    """Points of half a ball and their normals."""
    rng = np.random.default_rng(5)
    arms = rng.normal(size=(400, 3))
    arms[:, 2] = np.abs(arms[:, 2])
    unit = arms / np.linalg.norm(arms, axis=1)[:, None]
    return np.round(7.0 * unit, 4) + [100.0, 200.0, 3.0], np.round(unit, 5)


@pytest.mark.parametrize("suffix", [".xyz", ".txt", ".csv", ".asc", ".pts", ".xyz.gz"])
@pytest.mark.parametrize("case", ["bare", "behind colours", "numbered", "named", "commas"])
def test_normals_in_columns_of_text_are_read_with_or_without_names(tmp_path: Path, suffix: str, case: str) -> None:
    points, normals = with_normals()
    columns = [points, normals]
    if case == "behind colours":
        columns.insert(1, np.full((len(points), 3), 127))
    if case == "numbered":
        columns.insert(0, np.arange(1, len(points) + 1)[:, None])
    lines = [" ".join(f"{value:.10g}" for value in row) for row in np.column_stack(columns)]
    if case == "named":
        lines = [" ".join([line, "0.5"]) for line in lines]
        lines.insert(0, "x y z NormalX NormalY NormalZ curvature")
    text = "\n".join(lines) + "\n"
    text = text.replace(".", ",") if case == "commas" else text
    path = tmp_path / f"a{suffix}"
    path.write_bytes(gzip.compress(text.encode()) if suffix.endswith(".gz") else text.encode())
    cloud = read_points(path)
    assert np.allclose(cloud.points + cloud.origin, points) and np.allclose(known(cloud.normals), normals)


@pytest.mark.parametrize("case", ["whole numbers", "too long", "lines without them"])
def test_other_columns_are_no_normals(tmp_path: Path, case: str) -> None:
    points, normals = with_normals()
    if case == "whole numbers":
        normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    if case == "too long":
        normals = 1.1 * normals
    lines = [" ".join(f"{value:.10g}" for value in row) for row in np.column_stack([points, normals])]
    if case == "lines without them":
        lines[300:310] = [" ".join(line.split()[:3]) for line in lines[300:310]]
    path = tmp_path / "a.xyz"
    path.write_text("\n".join(lines) + "\n")
    cloud = read_points(path)
    assert cloud.normals is None and np.allclose(cloud.points + cloud.origin, points)


@pytest.mark.parametrize("suffix", [".xyz", ".txt", ".csv"])
def test_normals_come_back_from_text(tmp_path: Path, suffix: str) -> None:
    points, normals = with_normals()
    write_points(tmp_path / f"a{suffix}", points, normals=normals)
    assert np.allclose(known(read_points(tmp_path / f"a{suffix}").normals), normals)
