"""Units and reference systems: what files say, what the user says, and several files as one scan."""

from __future__ import annotations

import struct
from pathlib import Path

import laspy
import numpy as np
import pytest
from scan_files import e57, las, plate, text, written

from scantruss.cli.main import main
from scantruss.errors import FormatError, InputError
from scantruss.scan.formats.heights import look_like_feet
from scantruss.scan.formats.paths import files_of
from scantruss.scan.formats.reading import read_points
from scantruss.scan.formats.systems import from_wkt
from scantruss.scan.formats.writing import write_points
from scantruss.scan.stream.fit import read_thinned
from scantruss.scan.stream.thin_scan import thin_scan
from scantruss.scan.units import check_unit
from scantruss.selection import Selection
from scantruss.settings import Settings

P = plate()
DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
DEGREE = 'UNIT["degree",0.0174532925199433]'
GEOGRAPHIC = (
    f'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],{DEGREE}]'
)


def plane(unit: str, code: str = "32632") -> str:
    authority = f',AUTHORITY["EPSG","{code}"]' if code else ""
    return f'PROJCS["A (""plane"")",{GEOGRAPHIC},PROJECTION["Transverse_Mercator"],PARAMETER["false_easting",500000],{unit}{authority}]'


METRE, FOOT, SURVEY = 'UNIT["metre",1]', 'UNIT["foot",0.3048]', 'UNIT["US survey foot",0.3048006096012192]'
HEIGHT = 'VERT_CS["NAVD88",VERT_DATUM["a",2005],{},AXIS["Up",UP]]'
WKT2 = (
    'PROJCRS["B",BASEGEOGCRS["c",DATUM["d",ELLIPSOID["e",6378137,298.25,LENGTHUNIT["metre",1]]]],CONVERSION["f",METHOD["g"],'
    'PARAMETER["h",0,ANGLEUNIT["degree",0.0174532925199433]]],CS[Cartesian,{}],AXIS["(E)",east,ORDER[1]{}],AXIS["(N)",north,'
    'ORDER[2]{}]{}{},ID["EPSG",2264]]'
)
UP = ',AXIS["(H)",up,ORDER[3],LENGTHUNIT["metre",1]]'
US = ',LENGTHUNIT["US survey foot",0.304800609601219]'
TEXTS = {
    plane(METRE): (1.0, None, False, "EPSG:32632"),
    plane(SURVEY, ""): (0.3048006096, None, False, 'A ("plane")'),
    f'COMPD_CS["both",{plane(METRE)},{HEIGHT.format(FOOT)}]': (1.0, 0.3048, False, "EPSG:32632"),
    GEOGRAPHIC: (None, None, True, "WGS 84"),
    f'COMPD_CS["both",{GEOGRAPHIC},{HEIGHT.format(METRE)}]': (None, 1.0, True, "WGS 84"),
    WKT2.format(2, "", "", "", US): (0.3048006096, None, False, "EPSG:2264"),
    WKT2.format(3, US, US, UP, ""): (0.3048006096, 1.0, False, "EPSG:2264"),
    f'COMPOUNDCRS["i",{WKT2.format(2, US, US, "", "")},VERTCRS["j",VDATUM["k"],CS[vertical,1],AXIS["H",up],'
    'LENGTHUNIT["metre",1]]]': (0.3048006096, 1.0, False, "EPSG:2264"),
    'GEODCRS["l",DATUM["m"],CS[Cartesian,3],AXIS["X",geocentricX],LENGTHUNIT["metre",1]]': (1.0, None, False, "l"),
    'LOCAL_CS["n",UNIT["inch",0.0254]]': (0.0254, None, False, "n"),
    "": (None, None, False, ""),
    "PROJCS[": (None, None, False, ""),
    "no system at all": (None, None, False, ""),
    "A[" * 5000: (None, None, False, ""),
}


@pytest.mark.parametrize("wkt", TEXTS, ids=range(len(TEXTS)))
def test_units_of_a_wkt_text(wkt: str) -> None:
    metres, z_metres, degrees, name = TEXTS[wkt]
    found = from_wkt(wkt)
    assert found.degrees == degrees and found.name == name
    if not degrees:
        assert found.metres == (pytest.approx(metres) if metres else None)
    assert found.z_metres == (pytest.approx(z_metres) if z_metres else None)


def wkt(textual: str) -> laspy.VLR:
    return laspy.VLR("LASF_Projection", 2112, "", textual.encode() + b"\0")


def keys(*entries: tuple[int, int]) -> laspy.VLR:
    words = [1, 1, 0, len(entries), *(word for key, value in entries for word in (key, 0, 1, value))]
    return laspy.VLR("LASF_Projection", 34735, "", struct.pack(f"<{len(words)}H", *words))


def scan(tmp_path: Path, *records: laspy.VLR, name: str = "a.las") -> Path:
    (tmp_path / name).write_bytes(las(P, records=records))
    return tmp_path / name


@pytest.mark.parametrize(
    ("record", "unit", "ratio"),
    [
        (wkt(plane(METRE)), "m", 1.0),
        (wkt(plane(SURVEY)), "foot", 1.0),
        (wkt(f'COMPD_CS["both",{plane(METRE)},{HEIGHT.format(FOOT)}]'), "m", 0.3048),
        (wkt(f'COMPD_CS["both",{plane(SURVEY)},{HEIGHT.format(FOOT)}]'), "foot", 1.0),
        (wkt(f'COMPD_CS["both",{plane(SURVEY)},{HEIGHT.format(METRE)}]'), "foot", 3937 / 1200),
        (keys((1024, 1), (3072, 26917), (3076, 9001), (4099, 9002)), "m", 0.3048),
        (keys((1024, 1), (3072, 32642)), "m", 1.0),
        (keys((1024, 1), (3072, 2264)), "", 1.0),
        (keys((1024, 1), (3076, 9003), (4099, 9003)), "foot", 1.0),
    ],
)
def test_heights_come_in_the_unit_of_the_plane(tmp_path: Path, record: laspy.VLR, unit: str, ratio: float) -> None:
    cloud = read_points(scan(tmp_path, record))
    assert cloud.unit == unit
    assert np.allclose(cloud.points + cloud.origin, P * [1, 1, ratio], rtol=1e-5, atol=1e-9)
    assert bool(cloud.notes) == (ratio != 1.0) and all("heights of a.las are in" in note for note in cloud.notes)


def test_the_user_goes_before_the_file(tmp_path: Path) -> None:
    path = scan(tmp_path, wkt(f'COMPD_CS["both",{plane(METRE)},{HEIGHT.format(FOOT)}]'))
    cloud = read_points(path, unit="foot")
    assert cloud.unit == "foot" and np.allclose(cloud.points + cloud.origin, P, atol=1e-9)
    assert cloud.notes == ("a.las says that its unit is m; --unit foot overrides it",)
    cloud = read_points(path, selection=Selection(z_unit="m"))
    assert np.allclose(cloud.points + cloud.origin, P, atol=1e-9) and not cloud.notes
    (tmp_path / "a.xyz").write_bytes(text(P))
    cloud = read_points(tmp_path / "a.xyz", unit="m", selection=Selection(z_unit="foot"))
    assert np.allclose(cloud.points + cloud.origin, P * [1, 1, 0.3048], atol=1e-9)
    with pytest.raises(InputError, match="does not state the unit of x and y"):
        read_points(tmp_path / "a.xyz", selection=Selection(z_unit="foot"))


def test_a_unit_without_a_name_is_brought_to_metres(tmp_path: Path) -> None:
    cloud = read_points(scan(tmp_path, wkt(plane('UNIT["yard",0.9144]'))))
    assert cloud.unit == "m" and np.allclose(cloud.points + cloud.origin, 0.9144 * P, atol=1e-9)
    assert "converted to m" in cloud.notes[0]


@pytest.mark.parametrize("record", [wkt(GEOGRAPHIC), keys((1024, 2), (2048, 4326))])
def test_degrees_are_refused_with_advice(tmp_path: Path, record: laspy.VLR) -> None:
    path = scan(tmp_path, record)
    with pytest.raises(InputError, match=r"longitude and latitude in degrees.*project it"):
        read_points(path)
    assert read_points(path, unit="m").unit == "m"


@pytest.mark.parametrize("header", ["lon,lat,height\n", "Longitude;Latitude;z\n", "id lat lon alt\n"])
def test_named_degrees_are_refused_in_text(tmp_path: Path, header: str) -> None:
    sign = next((s for s in ",;" if s in header), " ")
    path = tmp_path / "a.csv"
    path.write_bytes(text(P if header.count(sign) == 2 else np.column_stack([np.arange(len(P)), P]), header, sign))
    with pytest.raises(InputError, match="degrees"):
        read_points(path)
    path.write_bytes(text(np.column_stack([P, P]), "lon,lat,height,x,y,z\n", ","))
    assert len(read_points(path).points) == len(P)


@pytest.mark.parametrize(
    "comment",
    [
        "comment unit: mm",
        "comment units mm",
        "obj_info unit = millimeters",
        "comment VCGLIB unit mm",
        "comment unit in mm",
    ],
)
def test_ply_says_its_unit_in_a_comment(tmp_path: Path, comment: str) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(written(".ply", P).replace(b"comment unit m", comment.encode()))
    assert read_points(path).unit == "mm"
    path.write_bytes(written(".ply", P).replace(b"comment unit m", b"comment a unit mess"))
    assert read_points(path).unit == ""


@pytest.mark.parametrize(
    ("header", "unit", "ratio"),
    [
        ("X [mm],Y [mm],Z [mm]", "mm", 1), ("z_m,x_m,y_m", "m", 1), ("E (ft),N (ft),H (ft)", "foot", 1),
        ('"x[inch]","y[inch]","z"', "inch", 1), ("x (m),y (m),z (ft)", "m", 0.3048), ("x [cm],y [cm],z [m]", "cm", 100),
        ("# unit: mm\nx,y,z", "mm", 1), ("// Units: cm\nx,y,z", "cm", 1), ("# units of time: s\nx,y,z", "", 1),
        ("# Coordinates unit in m\nx,y,z", "m", 1), ("# units in mm\nx,y,z", "mm", 1), ("# unit in: mm\nx,y,z", "mm", 1),
        ("# the unit in this file is mm\nx,y,z", "", 1), ("# unit in which x is given: mm\nx,y,z", "", 1),
        ("# unit: in\nx,y,z", "inch", 1), ("# units (in)\nx,y,z", "inch", 1), ("# units: in, degrees\nx,y,z", "inch", 1),
        ("# unit in\n# m is for metres\nx,y,z", "inch", 1), ("# unit in-house\nx,y,z", "", 1),
        ("x,y,z", "", 1), ("x_in,y_in,z_in", "", 1), ("x,y,z [mm]", "", 1),
    ],
)  # fmt: skip
def test_text_says_its_unit_in_its_header(tmp_path: Path, header: str, unit: str, ratio: float) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(text(P, f"{header}\n", ","))
    cloud = read_points(path)
    order = [1, 2, 0] if header.startswith("z") else [0, 1, 2]
    expected = P[:, order] * [1, 1, ratio]
    assert cloud.unit == unit and np.allclose(cloud.points + cloud.origin, expected, rtol=0, atol=1e-9)
    assert bool(cloud.notes) == (ratio != 1)
    thinned = thin_scan(path, 1e-5)
    assert (thinned.unit, thinned.notes, len(thinned.points)) == (unit, cloud.notes, len(P))
    assert read_points(path, unit="foot").unit == "foot"
    path.write_bytes(text(P, f"{header}\n", ",").decode().encode("utf-16"))
    assert same_words(path) == (unit, cloud.notes)


def same_words(path: Path) -> tuple[str, tuple[str, ...]]:
    """Return the unit and the notes of a scan, in memory as when it is thinned while it is read."""
    cloud, thinned = read_points(path), thin_scan(path, 1e-5)
    assert (cloud.unit, cloud.notes) == (thinned.unit, thinned.notes)
    return cloud.unit, cloud.notes


def test_parquet_says_its_unit_in_its_columns(tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = tmp_path / "a.parquet"
    parquet.write_table(arrow.table({"z (ft)": P[:, 2], "x (m)": P[:, 0], "y (m)": P[:, 1]}), path)
    cloud = read_points(path)
    assert same_words(path) == ("m", cloud.notes) and "heights of a.parquet are in foot" in cloud.notes[0]
    assert np.allclose(cloud.points + cloud.origin, P * [1, 1, 0.3048], rtol=0, atol=1e-9)


def woods(foot: float) -> tuple[np.ndarray, np.ndarray]:
    """Ground and trees 20 m high in metres / foot, with how many returns their pulses had."""
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0, 300, (2, 20_000))
    wooded = (x // 60 + y // 60) % 2 == 0
    high = np.where(wooded & (rng.random(20_000) < 0.6), rng.uniform(14, 24, 20_000), 0)
    return np.column_stack([x, y, (high + 0.05 * x) / foot]), np.where(wooded, 2, 1)


def test_trees_tell_feet_from_metres() -> None:
    assert look_like_feet(*woods(1.0)) == ""
    assert "--unit m --z-unit foot" in look_like_feet(*woods(0.3048))
    points, returns = woods(0.3048)
    assert look_like_feet(points, np.ones_like(returns)) == "" and look_like_feet(points[:99], returns[:99]) == ""
    many = np.concatenate([points + [1000 * i, 0, 0] for i in range(30)])
    assert look_like_feet(many, np.tile(returns, 30))


@pytest.mark.skipif(not DATA.exists(), reason="the shared scans are not here")
def test_the_scan_with_heights_in_feet_is_noticed() -> None:
    path = DATA / "real" / "nc_lidar_south.laz"
    assert "look like feet" in read_points(path).notes[0]
    cloud = read_points(path, unit="m", selection=Selection(z_unit="foot"))
    assert 130 < np.ptp(cloud.points[:, 2]) < 135 and "are converted to m" in cloud.notes[0]


# ---- several files as one scan -------------------------------------------------------------------------------------


def test_patterns_lists_and_odd_names(tmp_path: Path) -> None:
    for name in ("b.xyz", "a.xyz", "c[1].xyz", "d.txt"):
        (tmp_path / name).write_bytes(text(P))
    (tmp_path / "folder.xyz").mkdir()
    names = [tmp_path / name for name in ("a.xyz", "b.xyz", "c[1].xyz")]
    assert files_of(f"{tmp_path}/*.xyz") == names
    assert files_of([f"{tmp_path}/[ab].xyz", names[0], names[2]]) == names
    assert files_of(tmp_path / "c[1].xyz") == [names[2]]
    assert files_of("none.xyz") == [Path("none.xyz")]
    nothing: str | list[str]
    for nothing in ([], f"{tmp_path}/*.laz"):
        with pytest.raises(FormatError, match=r"no scan file|no file fits"):
            files_of(nothing)
    cloud = read_points(f"{tmp_path}/*.xyz")
    assert len(cloud.points) == 3 * len(P) and cloud.name == "*.xyz"
    with pytest.raises(FormatError, match="is a folder; name a scan file, or a pattern"):
        read_points(tmp_path / "folder.xyz")


def test_a_pattern_makes_the_same_grid_as_one_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    points = plate(6000)
    Path("all.xyz").write_bytes(text(points))
    Path("tiles").mkdir()
    for number in range(3):
        Path(f"tiles/{number}.xyz").write_bytes(text(points[2000 * number : 2000 * number + 2000]))
    assert main(["grid", "all.xyz", "a.obj", "--length", "4"]) == 0
    assert main(["grid", "tiles/*.xyz", "b.obj", "--length", "4"]) == 0
    assert Path("a.obj").read_bytes() == Path("b.obj").read_bytes()
    assert main(["info", "tiles/?.xyz"]) == 0
    assert "points   6000" in capsys.readouterr().out
    assert main(["grid", "tiles/*.xyz", "tiles/1.xyz", "--length", "4"]) == 2
    assert main(["grid", "tiles/*.las", "c.obj", "--length", "4"]) == 2
    Path("tiles/3.xyz").write_bytes(b"")
    assert main(["grid", "tiles/*.xyz", "c.obj", "--length", "4"]) == 2
    assert "3.xyz is empty" in capsys.readouterr().err.replace("tiles/", "").replace("\\", "")


def test_files_of_different_units_are_brought_to_that_of_the_first(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(written(".ply", P))
    (tmp_path / "b.ply").write_bytes(written(".ply", 1000 * P).replace(b"comment unit m\n", b"comment unit mm\n"))
    (tmp_path / "c.xyz").write_bytes(text(P))
    (tmp_path / "d.e57").write_bytes(e57((__import__("scan_files").axes(P), "")))
    cloud = read_points(f"{tmp_path}/*.*")
    assert cloud.unit == "m" and np.allclose(cloud.points + cloud.origin, np.tile(P, (4, 1)), atol=1e-9)
    assert "b.ply is in mm and is converted to m, the unit of the first file" in cloud.notes
    part = read_points(f"{tmp_path}/*.ply", selection=Selection(crop=("box:0,0,20,30",)))
    assert len(part.points) == 2 * (P[:, 0] <= 20).sum()  # what is cropped is in the unit of the result
    assert any(note.startswith("c.xyz does not state its unit") for note in cloud.notes)


def test_files_of_different_reference_systems_are_refused(tmp_path: Path) -> None:
    scan(tmp_path, wkt(plane(METRE)))
    scan(tmp_path, name="b.las")
    assert len(read_points(f"{tmp_path}/*.las").points) == 2 * len(P)
    scan(tmp_path, wkt(plane(METRE, "32633")), name="c.las")
    with pytest.raises(InputError, match=r"c.las is in EPSG:32633 and .*a.las in EPSG:32632"):
        read_points(f"{tmp_path}/*.las")


@pytest.mark.parametrize("suffix", [".las", ".csv", ".npy", ".ply"])
def test_what_looks_like_degrees_is_said_where_nothing_tells(tmp_path: Path, suffix: str) -> None:
    plan = np.random.default_rng(2).random((400, 3))
    degrees = plan * [0.01, 0.008, 30.0] + [11.5, 48.1, 500.0]
    path = tmp_path / f"a{suffix}"
    write_points(path, degrees)
    said = "x and y look like longitude and latitude"
    assert [said in note for note in read_points(path).notes] == [True]
    assert read_points(path, unit="m").notes == ()
    thinned, _ = read_thinned(path, Settings(length=1.0, thin_spacing=1e-4))
    assert [said in note for note in thinned.notes] == [True]


@pytest.mark.parametrize("sides", [(0.9, 0.4, 3.0), (30.0, 20.0, 9.0), (0.01, 0.01, 0.01), (500.0, 400.0, 9.0)])
def test_small_scans_do_not_look_like_degrees(tmp_path: Path, sides: tuple[float, float, float]) -> None:
    np.save(tmp_path / "a.npy", np.random.default_rng(2).random((400, 3)) * sides)
    assert read_points(tmp_path / "a.npy").notes == ()


def test_coordinates_that_single_precision_has_rounded_are_told(tmp_path: Path) -> None:
    """In steps of 0.5 at 4,500,000, where points are 0.1 apart; not where they are doubles, near zero, or 50 apart."""
    plan = np.random.default_rng(2).random((4000, 3)) * [6.0, 6.0, 0.5]
    np.save(tmp_path / "a.npy", plan + [500_000.0, 4_500_000.0, 300.0])
    assert read_points(tmp_path / "a.npy").notes == ()
    np.save(tmp_path / "a.npy", plan.astype(np.float32))
    assert read_points(tmp_path / "a.npy").notes == ()
    np.save(tmp_path / "a.npy", (500.0 * plan + [500_000.0, 4_500_000.0, 300.0]).astype(np.float32))
    assert read_points(tmp_path / "a.npy").notes == ()
    np.save(tmp_path / "a.npy", (plan + [500_000.0, 4_500_000.0, 300.0]).astype(np.float32))
    (note,) = read_points(tmp_path / "a.npy", unit="m").notes
    assert note.startswith("x and y are in steps of up to 0.5 m, rounded to single precision")


@pytest.mark.parametrize(("word", "unit"), [("ft", "foot"), ("FEET", "foot"), ("in", "inch"), ("metres", "m")])
def test_other_names_of_units_are_understood_on_the_command_line(
    word: str, unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(1)
    np.savetxt(tmp_path / "a.xyz", np.column_stack([rng.uniform(0, 10, (3000, 2)), np.zeros(3000)]))
    for words in (["--unit", word], [f"--unit={word}"]):
        assert main(["clean", str(tmp_path / "a.xyz"), str(tmp_path / "out.ply"), *words, "--no-smooth"]) == 0
    assert f"comment unit {unit}".encode() in (tmp_path / "out.ply").read_bytes()[:400]
    assert main(["clean", str(tmp_path / "a.xyz"), str(tmp_path / "out.ply"), "--unit", "mile"]) == 2


def test_a_unit_of_another_name_is_named_where_it_is_refused() -> None:
    with pytest.raises(InputError, match=r"got 'ft' \(write foot\)"):
        check_unit("ft")
