"""Points by class, return, confidence and place: the same as an obvious filter; counted; repeatable from saved settings."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from marks import compiled_only
from scan_files import las, parquet_file, pcd, plate, text, written
from typed import known

from scantruss.cli.main import main
from scantruss.cli.options import Parser, add_reading, selection_of
from scantruss.errors import FormatError, InputError
from scantruss.pipeline import grid_from_cloud
from scantruss.report.figures import left_out_lines
from scantruss.scan.formats.choose import in_polygon
from scantruss.scan.formats.reading import read_points
from scantruss.scan.stream import chunks
from scantruss.scan.stream.thin_scan import thin_scan
from scantruss.selection import Selection, polygon_text, read_crop
from scantruss.settings import Settings

P = plate(600)
RNG = np.random.default_rng(6)
CLASS = RNG.choice([2, 5, 6], len(P))
COUNT = RNG.integers(1, 4, len(P))
NUMBER = np.minimum(RNG.integers(1, 4, len(P)), COUNT)
CONFIDENCE = np.round(RNG.random(len(P)), 2)
NAMES = ("x", "y", "z", "Classification", "Return_Number", "Number_Of_Returns", "Scalar_Confidence")
TABLE = np.column_stack([P, CLASS, NUMBER, COUNT, CONFIDENCE])


def files() -> dict[str, bytes]:
    """The same points with their attributes in all formats that can hold them."""
    header = (
        "ply\nformat {}\nelement vertex 600\n" + "".join(f"property double {name}\n" for name in NAMES) + "end_header\n"
    )
    rows = b"\n".join(b" ".join(repr(v).encode() for v in row) for row in TABLE.tolist()) + b"\n"
    fields = np.zeros(600, [(name, "f8") for name in NAMES])
    for column, name in enumerate(NAMES):
        fields[name] = TABLE[:, column]
    import io

    array = io.BytesIO()
    np.save(array, fields)
    return {
        "a.las": las(P, classification=CLASS, return_number=NUMBER, number_of_returns=COUNT),
        "a.ply": header.format("binary_little_endian 1.0").encode() + TABLE.astype("<f8").tobytes(),
        "b.ply": header.format("ascii 1.0").encode() + rows,
        "a.csv": ",".join(NAMES).encode() + b"\n" + rows.replace(b" ", b","),
        "a.pcd": pcd([(name, "f8", TABLE[:, i]) for i, name in enumerate(NAMES)], "binary"),
        "a.npy": array.getvalue(),
    }


FILES = files()
RING = [(5.0, 5.0), (30.0, 2.0), (20.0, 28.0), (12.0, 10.0)]
HOLE = [(14.0, 7.0), (18.0, 7.0), (18.0, 11.0)]
CASES = {
    "classes": (Selection(classes=(6, 2)), np.isin(CLASS, (2, 6)), "of other classes"),
    "first": (Selection(returns="first"), NUMBER == 1, "of other returns"),
    "last": (Selection(returns="last"), NUMBER == COUNT, "of other returns"),
    "second": (Selection(returns="2"), NUMBER == 2, "of other returns"),
    "confidence": (Selection(confidence=0.4), CONFIDENCE >= 0.4, "of less confidence"),
    "box": (Selection(crop=("box:5,5,0,20,25,6",)), np.all((P >= [5, 5, 0]) & (P <= [20, 25, 6]), axis=1), "outside the box"),
    "plan": (Selection(crop=("box:5,5,20,25",)), np.all((P[:, :2] >= 5) & (P[:, :2] <= [20, 25]), axis=1), "outside the box"),
    "sphere": (Selection(crop=("sphere:20,15,5,9",)), ((P - [20, 15, 5]) ** 2).sum(axis=1) <= 81, "outside the sphere"),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(FILES))
@pytest.mark.parametrize("case", CASES)
def test_only_what_is_selected_is_read_and_the_rest_counted(tmp_path: Path, name: str, case: str) -> None:
    selection, expected, words = CASES[case]
    path = tmp_path / name
    path.write_bytes(FILES[name])
    if name == "a.las" and case == "confidence":
        with pytest.raises(InputError, match="has no confidence, which --confidence needs"):
            read_points(path, selection=selection)
        return
    cloud = read_points(path, selection=selection)
    assert np.allclose(cloud.points + cloud.origin, P[expected], rtol=0, atol=1e-9)
    assert f"{(~expected).sum()} points {words} are left out" in cloud.notes


def test_all_at_once_and_nothing_left(tmp_path: Path) -> None:
    path = tmp_path / "a.las"
    path.write_bytes(FILES["a.las"])
    both = Selection(classes=(6,), returns="last", crop=("box:0,0,30,30", "sphere:20,15,5,12"))
    inside = ((P - [20, 15, 5]) ** 2).sum(axis=1) <= 144
    expected = (CLASS == 6) & (NUMBER == COUNT) & (P[:, 0] <= 30) & inside
    cloud = read_points(path, selection=both)
    assert np.allclose(cloud.points + cloud.origin, P[expected], rtol=0, atol=1e-9) and len(cloud.notes) == 4
    with pytest.raises(
        InputError, match=r"no point of a.las is left: of 600 points 600 of other classes; the scan has classes 2 5 6"
    ):
        read_points(path, selection=Selection(classes=(9,)))
    (tmp_path / "a.xyz").write_bytes(text(P))
    for selection, words in (
        (Selection(classes=(6,)), "has no classes"),
        (Selection(returns="last"), "has no returns"),
    ):
        with pytest.raises(InputError, match=words):
            read_points(tmp_path / "a.xyz", selection=selection)


@pytest.mark.parametrize("version", ["1.2", "1.4"])
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_what_a_las_file_calls_deleted_is_left_out(tmp_path: Path, version: str, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    withheld = RNG.random(len(P)) < 0.2
    path.write_bytes(las(P, suffix, version=version, classification=CLASS, withheld=withheld.astype("u1")))
    for classes in ((), (6,)):
        expected = P[~withheld & np.isin(CLASS, classes or CLASS)]
        cloud = read_points(path, selection=Selection(classes=classes))
        assert np.allclose(cloud.points + cloud.origin, expected, rtol=0, atol=1e-9)
        assert cloud.notes[0] == f"{withheld.sum()} points marked as withheld are left out"
        thinned = thin_scan(path, 1e-5, selection=Selection(classes=classes))
        assert len(thinned.points) == len(expected) and thinned.notes == cloud.notes
    path.write_bytes(las(P, suffix, version=version, withheld=np.ones(len(P), "u1")))
    readers: tuple[Callable[[Any], object], ...] = (read_points, lambda path: thin_scan(path, 1.0))
    for read in readers:
        with pytest.raises(InputError, match=r"no point of a.la. is left: of 600 points 600 marked as withheld$"):
            read(path)
    chosen = Selection(classes=(9,))
    other = tmp_path / f"b{suffix}"
    other.write_bytes(las(P, suffix, version=version, classification=CLASS))
    readers = (
        lambda names: read_points(names, selection=chosen),
        lambda names: thin_scan(names, 1.0, selection=chosen),
    )
    for read in readers:
        with pytest.raises(InputError, match=r"of 600 points 600 marked as withheld$"):
            read(path)
        with pytest.raises(InputError, match=r"of 1,200 points .*; some of them have classes 2 5 6, x, y, z from"):
            read([path, other])


def inside(x: float, y: float, ring: list[tuple[float, float]]) -> bool:
    """An obvious twin: the turn that the ring makes around the place."""
    turn = 0.0
    for (x0, y0), (x1, y1) in zip(ring, ring[1:] + ring[:1], strict=True):
        turn += np.angle(complex(x1 - x, y1 - y) / complex(x0 - x, y0 - y))
    return abs(turn) > 1


@given(st.integers(0, 1000), st.integers(3, 9))
def test_inside_a_polygon_is_what_turns_around(seed: int, corners: int) -> None:
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.random(corners) * 2 * np.pi)
    ring = (rng.uniform(2, 9, (corners, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])).tolist()
    places = rng.uniform(-10, 10, (60, 2))
    found = in_polygon(places, [np.array(ring)])
    assert found.tolist() == [inside(x, y, [tuple(c) for c in ring]) for x, y in places.tolist()]


def polygons() -> dict[str, str]:
    rings = [[*RING, RING[0]], [*HOLE, HOLE[0]]]
    lines = [", ".join(f"{x} {y}" for x, y in ring) for ring in rings]
    geometry = {"type": "Polygon", "coordinates": rings}
    feature = {"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": geometry}]}
    return {
        "a.wkt": f"POLYGON (({lines[0]}), ({lines[1]}))",
        "b.wkt": f"SRID=25832;MULTIPOLYGON ((({lines[0]}), ({lines[1]})))",
        "a.geojson": json.dumps(geometry),
        "b.json": json.dumps(feature),
        "a.csv": "x,y\n" + "\n\n".join("\n".join(f"{x},{y}" for x, y in ring) for ring in rings),
        "a.txt": "# corners\n" + "\n\n".join("\n".join(f"{x} {y} 0" for x, y in ring) for ring in (RING, HOLE)),
    }


@pytest.mark.parametrize("name", sorted(polygons()))
def test_a_polygon_of_any_file_with_its_hole(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(polygons()[name])
    crop = read_crop(str(tmp_path / name))
    assert crop == polygon_text([RING, HOLE])
    expected = np.array([inside(x, y, RING) and not inside(x, y, HOLE) for x, y in P[:, :2].tolist()])
    (tmp_path / "a.las").write_bytes(FILES["a.las"])
    cloud = read_points(tmp_path / "a.las", selection=Selection(crop=(crop,)))
    assert np.allclose(cloud.points + cloud.origin, P[expected], rtol=0, atol=1e-9)


BESIDE = [(10.0, 4.0), (40.0, 1.0), (38.0, 27.0)]


def several() -> dict[str, str]:
    """Files of a polygon with a hole and another one that overlaps both."""
    polygons = [[[*RING, RING[0]], [*HOLE, HOLE[0]]], [[*BESIDE, BESIDE[0]]]]
    words = [f"(({'), ('.join(', '.join(f'{x} {y}' for x, y in ring) for ring in rings)}))" for rings in polygons]
    geometries = [None, *({"type": "Polygon", "coordinates": rings} for rings in polygons)]
    features = [{"type": "Feature", "properties": {}, "geometry": geometry} for geometry in geometries]
    return {
        "a.geojson": json.dumps({"type": "FeatureCollection", "features": features}),
        "b.geojson": json.dumps({"type": "MultiPolygon", "coordinates": polygons}),
        "c.geojson": json.dumps({"type": "GeometryCollection", "geometries": geometries[1:]}),
        "a.wkt": f"MULTIPOLYGON ({words[0]} , {words[1]})",
        "b.wkt": f"POLYGON {words[0]}\npolygon {words[1]}\n",
    }


@pytest.mark.parametrize("name", sorted(several()))
def test_a_place_in_any_of_several_polygons_is_inside(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(several()[name])
    crop = read_crop(str(tmp_path / name))
    assert crop == polygon_text([RING, HOLE], [BESIDE]) == read_crop(crop)
    expected = np.array(
        [inside(x, y, BESIDE) or (inside(x, y, RING) and not inside(x, y, HOLE)) for x, y in P[:, :2].tolist()]
    )
    (tmp_path / "a.las").write_bytes(FILES["a.las"])
    cloud = read_points(tmp_path / "a.las", selection=Selection(crop=(crop,)))
    assert np.allclose(cloud.points + cloud.origin, P[expected], rtol=0, atol=1e-9)


@pytest.mark.parametrize("content", ["", "1,2\n3,4\n", "{", '{"type": "Point"}', "POLYGON ((1 2))", "a b\nc d\n", "\0"])
def test_what_is_no_polygon_is_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "a.txt").write_text(content)
    with pytest.raises(FormatError, match="polygon"):
        read_crop(str(tmp_path / "a.txt"))


@pytest.mark.parametrize(
    "values",
    [
        {"classes": "six"}, {"classes": 300}, {"classes": (-1,)}, {"returns": "0"}, {"returns": "middle"}, {"confidence": "high"},
        {"confidence": float("nan")}, {"crop": "box:1,2,3"}, {"crop": "box:9,9,0,0"}, {"crop": "sphere:0,0,0,0"},
        {"crop": "sphere:0,0,0,nan"}, {"crop": "cube:1,2,3,4"}, {"crop": "box:1,2,3,4|1,2,3,4"},
        {"crop": "polygon:1,2,3,4"}, {"crop": "box:a,b,c,d"},
    ],
)  # fmt: skip
def test_values_that_select_nothing_sensible_are_refused(values: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        Selection(**values)
    with pytest.raises(InputError):
        Settings(length=1.0, **values)


def test_options_reach_the_selection_and_the_settings(tmp_path: Path) -> None:
    parser = Parser("thin", "", "")
    add_reading(parser)
    (tmp_path / "a.wkt").write_text(polygons()["a.wkt"])
    crops = ["--crop", "box:0,0,9,9", "--crop", str(tmp_path / "a.wkt")]
    words = ["--class", "2,6", "--class", "5", "--returns", "last", "--confidence", "0.5", *crops, "--z-unit", "foot"]
    taken = selection_of(parser.read(words))
    assert taken.classes == (2, 5, 6) and taken.returns == "last" and taken.confidence == 0.5 and taken.z_unit == "foot"
    assert taken.crop == ("box:0.0,0.0,9.0,9.0", polygon_text([RING, HOLE]))
    assert selection_of(parser.read([])) == Selection()
    as_written: dict[str, Any] = {"classes": "6,2", "returns": 2}
    settings = Settings(length=2.0, crop=taken.crop, **as_written)
    again = Settings.from_dict(json.loads(json.dumps(settings.to_dict())))
    assert again == settings and again.selection == Selection(classes=(2, 6), crop=taken.crop, returns="2")


def test_saved_settings_select_the_same_without_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.las").write_bytes(las(plate(8000), classification=np.arange(8000) % 10 // 9))
    Path("ring.csv").write_text("2,2\n38,2\n38,28\n2,28\n")
    assert main(["grid", "a.las", "a.obj", "--length", "4", "--class", "0", "--crop", "ring.csv"]) == 0
    said = "".join(capsys.readouterr())
    assert "800 points of other classes are left out" in said and "points outside the polygon are left out" in said
    Path("ring.csv").unlink()
    assert main(["grid", "a.las", "b.obj", "--settings", "a.settings.json"]) == 0
    assert Path("a.obj").read_bytes() == Path("b.obj").read_bytes()


def test_parquet_columns_by_name(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    path = tmp_path / "a.parquet"
    path.write_bytes(parquet_file(P) or b"")
    cloud = read_points(path)
    assert np.array_equal(cloud.points + cloud.origin, P)
    from pyarrow import parquet, table

    parquet.write_table(table({"X": P[:, 0], "Y": P[:, 1], "Z": P[:, 2], "classification": CLASS}), path)
    assert len(read_points(path, selection=Selection(classes=(6,))).points) == (CLASS == 6).sum()
    parquet.write_table(table({"lon": P[:, 0], "lat": P[:, 1], "z": P[:, 2]}), path)
    with pytest.raises(InputError, match="degrees"):
        read_points(path)
    parquet.write_table(table({"x": ["a"] * 9, "y": P[:9, 1], "z": P[:9, 2]}), path)
    with pytest.raises(FormatError, match="column x must hold numbers"):
        read_points(path)


def test_packed_text_and_several_files_select_too(tmp_path: Path) -> None:
    import gzip

    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(FILES["a.csv"]))
    (tmp_path / "b.ply").write_bytes(FILES["b.ply"])
    cloud = read_points([tmp_path / "a.csv.gz", tmp_path / "b.ply"], selection=Selection(classes=(5,)))
    expected = P[CLASS == 5]
    assert np.allclose(cloud.points + cloud.origin, np.concatenate([expected, expected]), rtol=0, atol=1e-9)
    assert f"{2 * (CLASS != 5).sum()} points of other classes are left out" in " ".join(cloud.notes).replace(",", "")
    assert written(".csv", P[:5]).startswith(b"x [m],y [m],z [m]\n")


def test_what_is_held_is_told_without_points_that_are_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of points that are NaN nothing is told, and nobody is warned of them."""
    monkeypatch.setattr(chunks, "POINTS_DESCRIBED", 100)
    rows = np.zeros(600, [("x", "f8"), ("y", "f8"), ("z", "f8"), ("class", "f4"), ("confidence", "f8")])
    rows["x"], rows["y"], rows["z"] = P.T
    rows["class"], rows["confidence"] = CLASS, np.nan
    rows["x"][:300], rows["class"][:300] = np.nan, 7
    np.save(tmp_path / "a.npy", rows)
    np.save(tmp_path / "b.npy", np.full((600, 3), np.nan))
    for read in (
        lambda name, chosen: read_points(tmp_path / name, selection=chosen),
        lambda name, chosen: thin_scan(tmp_path / name, 1.0, selection=chosen),
    ):
        with pytest.raises(InputError, match=r"no point of a.npy is left: .* classes 2 5 6, x, y, z from [0-9]"):
            read("a.npy", Selection(classes=(9,), confidence=0.5))
        with pytest.raises(InputError, match=r"no point of b.npy is left: of 600 points 600 outside the box$"):
            read("b.npy", Selection(crop=("box:0,0,1,1",)))


@compiled_only
def test_a_grid_says_where_the_points_lie_that_a_crop_left_out(tmp_path: Path) -> None:
    x, y = np.meshgrid(np.arange(0.0, 12.0, 0.2), np.arange(0.0, 8.0, 0.2))
    np.save(tmp_path / "a.npy", np.column_stack([x.ravel(), y.ravel(), 0.05 * x.ravel()]) + [500.0, 100.0, 3.0])
    cloud = read_points(tmp_path / "a.npy", selection=Selection(crop=("box:500,100,507,108",)))
    grid = grid_from_cloud(cloud, Settings(length=1.0, effort="quick"))
    (part,) = [part for part in known(grid.certificate).left_out if part.words == "outside the box"]
    assert part.asked and part.points == 24 * 40
    assert part.where == pytest.approx((509.5, 103.9, 3.475)) and part.size == pytest.approx(7.8)
    assert any(
        "outside the box, near (509.5, 103.9, 3.475), 7.8 across" in line
        for line in left_out_lines(known(grid.certificate))
    )
