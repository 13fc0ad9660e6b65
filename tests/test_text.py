"""Text files of points: any separator, decimal sign, header and further columns give the same points."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from scantruss.errors import FormatError
from scantruss.scan.formats.columns import find_columns
from scantruss.scan.formats.reading import read_points
from scantruss.scan.formats.text_fields import count_numbers, holds_three

SHIFT = np.array([500_000.0, 4_500_000.0, 100.0])
POINTS = np.round(np.random.default_rng(3).random((40, 3)) * [90, 70, 20] - 10 + SHIFT, 3)
SEPARATORS = {
    "blank": " ",
    "blanks": "   ",
    "tab": "\t",
    "comma": ",",
    "comma blank": ", ",
    "semicolon": ";",
    "bar": "|",
}


def read(text: str | bytes, suffix: str = ".txt") -> np.ndarray:
    """Return the points of a text, in the scan's own frame."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{suffix}"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        cloud = read_points(path)
    back: np.ndarray = cloud.points + cloud.origin
    return back


def rows(separator: str, before: int = 0, after: int = 0, form: str = "%.3f") -> list[str]:
    """Return the points as lines, with columns of other numbers around."""
    lines = []
    for number, point in enumerate(POINTS):
        others = [form % (0.25 * (number % 7) + column) for column in range(before + after)]
        lines.append(separator.join([*others[:before], *(form % c for c in point), *others[before:]]))
    return lines


@pytest.mark.parametrize("separator", [";", "\t", " "])
def test_two_numbers_with_decimal_commas_are_no_point(tmp_path: Path, separator: str) -> None:
    """They were read as x, y and z of 6, 1973 and 1."""
    rows = [f"{x / 7:.4f}{separator}{x / 3:.4f}".replace(".", ",") for x in range(-30, 30)]
    (tmp_path / "plan.csv").write_text("\n".join([f"x{separator}y", *rows]) + "\n")
    with pytest.raises(FormatError, match=r"two numbers in a line .*; points need x, y and z"):
        read_points(tmp_path / "plan.csv")


@pytest.mark.parametrize(
    "line", ["{0:,.3f};{1:,.3f};{2:,.3f}", '"{0:,.3f}","{1:,.3f}","{2:,.3f}"', "{0:,.3f}  {1:,.3f}  {2:,.3f}"]
)
@pytest.mark.parametrize("german", [False, True])
def test_a_sign_between_thousands_does_not_make_other_points(line: str, german: bool) -> None:
    lines = [
        line.format(*point).translate(str.maketrans(".,", ",.")) if german else line.format(*point) for point in POINTS
    ]
    if german:
        lines = [row.replace('"."', '","') for row in lines]
    with pytest.raises(FormatError, match="a sign between thousands"):
        read("\n".join(lines))


@pytest.mark.parametrize("number", [False, True])
@pytest.mark.parametrize("header", ["", "X,Y,Z\n"])
def test_commas_as_decimal_signs_and_as_separators_are_refused(number: bool, header: str) -> None:
    """Read as whole numbers 9,147,5,774,7,044 would be the point 9, 147, 5."""
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (300, 3))
    rows = [",".join(f"{value:.3f}".replace(".", ",") for value in point) for point in points]
    rows = [f"{i + 1},{row}" for i, row in enumerate(rows)] if number else rows
    with pytest.raises(FormatError, match="commas are decimal signs and separate the numbers too"):
        read(header + "\n".join(rows))


def test_whole_numbers_between_commas_are_read() -> None:
    """Millimetres with colours of which one channel is written with zeros before it."""
    points = np.random.default_rng(0).integers(-20_000, 20_000, (300, 3))
    rows = "\n".join(f"{x},{y},{z},{abs(x) % 256},{abs(y) % 256},{abs(z) % 256:03}" for x, y, z in points)
    assert np.array_equal(read(rows), points)


@given(
    separator=st.sampled_from(sorted(SEPARATORS)),
    comma=st.booleans(),
    header=st.sampled_from(["none", "names", "comment", "slashes", "count", "prose", "quoted", "prose and names"]),
    before=st.integers(0, 4),
    after=st.integers(0, 4),
    order=st.permutations([0, 1, 2]),
    form=st.sampled_from(["%.3f", "%+.3f", "%.12e", "%12.3f"]),
    end=st.sampled_from(["\n", "\r\n", "\r", "\n\n"]),
    mark=st.sampled_from([b"", b"\xef\xbb\xbf", b"utf-16"]),
    suffix=st.sampled_from([".xyz", ".txt", ".csv", ".pts", ".asc"]),
)
def test_every_way_of_writing_gives_the_same_points(
    separator: str, comma: bool, header: str, before: int, after: int, order: list[int], form: str, end: str,
    mark: bytes, suffix: str,
) -> None:  # fmt: skip
    sign = SEPARATORS[separator]
    named = header in ("names", "comment", "slashes", "quoted", "prose and names")
    assume(not (comma and "," in sign))
    assume(named or (before == 0 and order == [0, 1, 2]))
    points = POINTS[:, order] if named else POINTS
    names = [*(f"n{i}" for i in range(before)), *("xyz"[i] for i in order), *(f"c{i}" for i in range(after))]
    lines = []
    for number, point in enumerate(points):
        others = [0.25 * (number % 7) + column for column in range(before + after)]
        lines.append(sign.join(form % value for value in [*others[:before], *point, *others[before:]]))
    if comma:
        lines = [line.replace(".", ",") for line in lines]
    head = {
        "none": [],
        "names": [sign.join(names).upper()],
        "comment": ["# scanned in spring", "# " + sign.join(names)],
        "slashes": ["//" + sign.join(names)],
        "count": [str(len(points))],
        "prose": ["Scan of the roof", "made on 2026 11 21 by us"],
        "quoted": [sign.join(f'"{name}"' for name in names)],
        "prose and names": ["Scan 1 2 3 4", sign.join(f"{name} [m]" if " " not in sign else name for name in names)],
    }[header]
    text = end.join([*head, *lines]) + end
    got = read(text.encode("utf-16") if mark == b"utf-16" else mark + text.encode(), suffix)
    assert got.shape == POINTS.shape
    assert np.abs(got - POINTS).max() < 1e-5 if "e" in form else np.array_equal(got, POINTS)


@pytest.mark.parametrize(
    ("head", "before", "after"),
    [
        (["id,x,y,z"], 1, 0),
        (["nx ny nz x y z".replace(" ", ",")], 3, 0),
        (["Easting [m],Northing [m],Height [m],R,G"], 0, 2),
        (["Punkt,Rechtswert,Hochwert,Höhe"], 1, 0),
        (["Points:0,Points:1,Points:2,Normals:0"], 0, 1),
        (["r,g,b,X_m,Y_m,Z_m"], 3, 0),
        (["i,pos_x,pos_y,pos_z"], 1, 0),
        (["# columns: x y z intensity"], 0, 1),
        (["# the points have x y z coordinates, and two more"], 0, 2),
        (["sep=,", "X,Y,Z"], 0, 0),
        (["0,1,2"], 0, 0),
        (["x,y"], 0, 1),
    ],
)
def test_names_of_columns_are_respected(head: list[str], before: int, after: int) -> None:
    assert np.array_equal(read("\n".join(head + rows(",", before, after)), ".csv"), POINTS)


@pytest.mark.parametrize(
    ("names", "columns"),
    [
        (["x", "y", "z"], (0, 1, 2)),
        (["z", "Y", "X"], (2, 1, 0)),
        (["nx", "ny", "nz", "x", "y", "z"], (3, 4, 5)),
        (["e", "n", "x", "y", "z"], (2, 3, 4)),
        (["E", "N", "H"], (0, 1, 2)),
        (["name", "x (mm)", "y (mm)", "elevation (mm)"], (1, 2, 3)),
        (["x", "y", "intensity"], None),
        (["a", "b", "c"], None),
    ],
)
def test_columns_are_found_by_name(names: list[str], columns: tuple[int, int, int] | None) -> None:
    assert find_columns(names) == columns


def numbered(separator: str, first: int, form: str = "%d") -> list[str]:
    """Return the points as lines that start with a running number."""
    return [separator.join([form % (first + i), line]) for i, line in enumerate(rows(separator))]


@pytest.mark.parametrize(
    "text",
    [
        "\n".join(numbered(",", 1)),
        "\n".join(f"{line},TREE" for line in numbered(",", 0)),
        "\n".join([",0,1,2", *numbered(",", 0)]),
        "\n".join(['"x" "y" "z"', *numbered(" ", 1, '"%d"')]),
        "\n".join(['"","x","y","z"', *numbered(",", 1, '"%d"')]),
        "\n".join(numbered(" ", 1, "P%d")),
        "\n".join(["name,x,y,z", *numbered(",", 1, '"point %d, roof"')]),
        "\n".join(["40", *rows(" ", 0, 4)]),
        "\n".join(["15", *rows(" ")[:15], "25", *rows(" ")[15:]]),
        "\n".join([*rows(" ")[:9], "# c", "// d", "", "  ", *rows(" ")[9:], "# end", ""]),
        "\n".join(f"{line} # {i}" for i, line in enumerate(rows(" "))),
        "\n".join(f"{line}// {i}" for i, line in enumerate(rows(" "))),
        "\n".join(line + " 7" * (i % 4) for i, line in enumerate(rows(" "))),
        "\n".join(line + ",7" * (i % 4) for i, line in enumerate(rows(","))),
        "\n".join(line + ";" for line in rows(";")),
        "\n".join(f"  {line}  " for line in rows(" \t ")),
        "\n".join(line.replace(",", ", ", 1).replace(",", " ; ", 1) for line in rows(",")),
        "\n".join(rows(" ", form="%.17e")).replace("e", "D"),
        "\n".join(f"2026-11-21 10:00,{line},roof" for line in rows(",")),
        "\n".join([*rows(","), ",,", ",,,"]),
        "\n".join([*rows(" ")[:20], "x y z", *rows(" ")[20:]]),
    ],
)
def test_files_of_the_field(text: str) -> None:
    assert np.array_equal(read(text), POINTS)


def test_a_running_number_that_is_a_coordinate_stays_one() -> None:
    points = np.column_stack([np.arange(40.0) % 10, np.arange(40) // 10, np.arange(40) % 3, np.ones(40)])
    assert np.array_equal(read("\n".join("{:g} {:g} {:g} {:g}".format(*p) for p in points)), points[:, :3])


def test_integers_at_the_start_do_not_hide_the_decimal_comma() -> None:
    points = np.column_stack([np.arange(30_000.0) // 150, np.arange(30_000.0) % 150, np.zeros(30_000)])
    points[15_000:] += 0.5
    text = "\n".join("{:g};{:g};{:g}".format(*p) for p in points).replace(".", ",")
    assert np.array_equal(read(text), points)


def test_coordinates_keep_every_digit() -> None:
    points = POINTS + np.random.default_rng(1).random(POINTS.shape) * 1e-6
    assert np.array_equal(read("\n".join(" ".join(map(repr, p)) for p in points.tolist())), points)


def test_a_large_file_by_numpy(tmp_path: Path) -> None:
    points = np.random.default_rng(2).random((20_000, 5)).round(6)
    np.savetxt(tmp_path / "a.csv", points, "%.6f", delimiter=",", header="x,y,z,i,j")
    assert np.array_equal(read_points(tmp_path / "a.csv").points, points[:, :3])


def test_missing_values_are_dropped_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["x,y,z", *rows(","), "1,,3", "nan,nan,nan", "1,NULL,2", "inf,1,2", "-1.#IND,1,2"]))
    cloud = read_points(path)
    assert (len(cloud.points), cloud.dropped) == (40, 5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("\n".join(["41", *rows(" ")]), "count line promises 41 points, got 40"),
        ("\n".join([*rows(" "), "1 2"]), r"line 41 \('1 2'\) has no numbers x, y, z in columns 1, 2, 3"),
        ("\n".join([*rows(",")[:5], "1,two,3", *rows(",")]), r"line 6 \('1 two 3'\) has no numbers"),
        ("1 2\n3 4\n5 6\n", "no line with three numbers"),
        ("x y z\n", "no line with three numbers"),
        ("\n \n", "no line with three numbers"),
        ("ncols 3\nnrows 2\n1 2 3\n4 5 6\n", "ESRI"),
        ("word\n" * 5 + "1 2 3\n" + "word\n" * 5, "not a text file of points but plain text"),
    ],
)
def test_refusals_say_where_and_what(text: str, words: str) -> None:
    with pytest.raises(FormatError, match=words):
        read(text)


@given(
    st.lists(st.sampled_from(["1", "-2.5", "1,5", ".5e3", "nan", "***", "", "x", "1 2 3"]), max_size=7), st.booleans()
)
def test_a_row_holds_three_numbers_where_it_has_so_many(row: list[str], comma: bool) -> None:
    assert holds_three(row, comma) == (count_numbers(row, comma) >= 3)
