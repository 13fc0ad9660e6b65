"""Text files that change part way: no line is lost without a word, and every way of reading says the same."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scan_files import pcd

from scantruss.errors import FormatError, InputError
from scantruss.scan.formats import text
from scantruss.scan.formats.reading import add_counts, read_points
from scantruss.scan.stream.chunks import read_chunks
from scantruss.scan.stream.thin_scan import thin_scan
from scantruss.scan.stream.tiles import find_source, tiles_of
from scantruss.selection import Selection

P = np.round(np.random.default_rng(5).random((60, 3)) * [90, 70, 20] - 10, 3)


def lines(sign: str = ",", first: int = 0, stop: int = 60) -> list[str]:
    return [sign.join(f"{c:.3f}" for c in p) for p in P[first:stop]]


def in_memory(path: Path) -> tuple[np.ndarray, tuple[str, ...]]:
    cloud = read_points(path)
    return cloud.points + cloud.origin, tuple(note for note in cloud.notes if "left out" in note)


def in_tiles(path: Path) -> tuple[np.ndarray, tuple[str, ...]]:
    """Read as `thin` does: in four tiles."""
    source = find_source(path)
    got = [chunk for tile in tiles_of([source], max(source.points // 4, 1)) for chunk in read_chunks(tile)]
    left_out = add_counts([chunk.left_out for chunk in got])
    return np.concatenate([chunk.points for chunk in got]), tuple(
        f"{n:,} points {w} are left out" for w, n in left_out.items() if n
    )


def every_way(path: Path, rows: list[str]) -> list[Any]:
    """Return points and what was left out, or the refusal, by each way of reading."""
    path.write_text("\n".join(rows) + "\n")
    told: list[Any] = []
    for large in (1 << 23, 0):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(text, "BYTES_FOR_PYARROW", large)
            for read in (in_memory, in_tiles):
                try:
                    told.append(read(path))
                except FormatError as error:
                    told.append(str(error))
    return told


@pytest.mark.kernels
@pytest.mark.parametrize(
    ("rows", "number"),
    [
        (["x,y,z", *lines(",", 0, 30), *lines(";", 30)], 2),
        (["x,y,z", *lines(",", 0, 40), *lines(";", 40)], 42),
        ([*lines(",", 0, 30), *lines(" ", 30)], 31),
        ([*lines(" ", 0, 50), *lines(",", 50)], 51),
        ([*lines(",", 0, 40), "1;2;3", *lines(",", 40)], 41),
        ([*lines(",", 0, 40), "1|2|3", *lines(",", 40)], 41),
        ([*lines("\t", 0, 40), "1 2;3", *lines("\t", 40)], 41),
        ([*lines(" ", 0, 40), "1,5 2,5 3,5", *lines(" ", 40), "1,,2"], 62),
        ([*lines(";", 0, 40), "1,5 2,5 3,5", *lines(";", 40)], 41),
        ([*lines(" ", 0, 59), "1.0 and words", *lines(" ", 59)], 60),
    ],
)
def test_a_line_of_numbers_that_is_no_point_is_refused_by_its_number(
    rows: list[str], number: int, tmp_path: Path
) -> None:
    told = every_way(tmp_path / "a.txt", rows)
    assert all(isinstance(said, str) and f"line {number} (" in said for said in told) and len(set(told)) == 1


@pytest.mark.kernels
@pytest.mark.parametrize(
    ("odd", "left"),
    [
        ([",,", ",,,", ","], ("3 points without coordinates are left out",)),
        (["Page B of the roof", "x,y,z", "# 1;2;3"], ()),
    ],
)
def test_lines_without_numbers_are_counted_where_they_are_points(
    odd: list[str], left: tuple[str, ...], tmp_path: Path
) -> None:
    for points, said in every_way(tmp_path / "a.csv", ["x,y,z", *lines(stop=40), *odd, *lines(first=40)]):
        assert np.array_equal(points, P) and said == left


def test_stars_for_numbers_too_long_are_missing_values(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("\n".join([*lines(stop=40), "***,***,***", "1.0,****,2.0", *lines(first=40)]))
    cloud = read_points(path)
    assert (len(cloud.points), cloud.dropped) == (60, 2)


def test_a_count_line_is_held_against_empty_lines_too(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("\n".join(["62", *lines(), ",,"]))
    with pytest.raises(FormatError, match="promises 62 points, got 61"):
        read_points(tmp_path / "a.csv")


@pytest.mark.kernels
@pytest.mark.parametrize(
    ("head", "again", "number"),
    [
        ("x,y,z", "y,x,z", 32),
        ("x,y,z", "id,x,y,z", 32),
        ("x,y,z", "# y,x,z", 32),
        ("x,y,z", "//Z,Y,X", 32),
        ("x,y,z", "Easting,Northing,Height,x,y,z", 32),
        ("x [mm],y [mm],z [mm]", "x [m],y [m],z [m]", 32),
        ("# a scan", "z,y,x", 32),
    ],
)
def test_a_second_header_of_other_columns_is_refused(head: str, again: str, number: int, tmp_path: Path) -> None:
    width = len(again.split(","))
    rows = [head, *lines(stop=30), again, *(",".join([*["7"] * (width - 3), row]) for row in lines(first=30))]
    told = every_way(tmp_path / "a.csv", rows)
    assert all(isinstance(said, str) and f"line {number} (" in said for said in told) and len(set(told)) == 1


@pytest.mark.kernels
@pytest.mark.parametrize(
    ("head", "again"),
    [
        ("x,y,z", "x,y,z"),
        ("x,y,z", "X, Y, Z"),
        ("# x y z", "# x y z"),
        ("x,y,z", "# part 2: x y z"),
        ("x,y,z", "# of max, and such"),
        ("# a scan", "x,y,z"),
        ("y,x,z", "y,x,z"),
    ],
)
def test_a_second_header_that_says_the_same_is_harmless(head: str, again: str, tmp_path: Path) -> None:
    order = [1, 0, 2] if head[0] == "y" else [0, 1, 2]
    for points, left in every_way(tmp_path / "a.csv", [head, *lines(stop=30), again, *lines(first=30)]):
        assert np.array_equal(points, P[:, order]) and left == ()


def test_a_second_header_with_the_classes_elsewhere_is_refused(tmp_path: Path) -> None:
    rows = [
        "x,y,z,class,i",
        *(f"{row},2,6" for row in lines(stop=30)),
        "x,y,z,i,class",
        *(f"{row},6,2" for row in lines(first=30)),
    ]
    (tmp_path / "a.csv").write_text("\n".join(rows))
    with pytest.raises(FormatError, match=r"line 32 .* names the columns again"):
        read_points(tmp_path / "a.csv", selection=Selection(classes=(2,)))


@pytest.mark.kernels
@pytest.mark.parametrize("head", [[], ["x,y,z"], ['"x","y","z"']])
@pytest.mark.parametrize("odd", [[], ["# a comment", '"","",""']])
def test_quoted_decimal_commas_between_commas(head: list[str], odd: list[str], tmp_path: Path) -> None:
    rows = [",".join(f'"{c:.3f}"'.replace(".", ",") for c in p) for p in P]
    for points, _ in every_way(tmp_path / "a.csv", [*head, *rows[:40], *odd, *rows[40:]]):
        assert np.array_equal(points, P)


def test_whole_numbers_beside_quoted_decimal_commas(tmp_path: Path) -> None:
    points = np.round(P * 2) / 2
    rows = [",".join(f'"{c:g}"'.replace(".", ",") if c % 1 else f"{c:g}" for c in p) + ",7,8,9" for p in points]
    for got, _ in every_way(tmp_path / "a.csv", rows):
        assert np.array_equal(got, points)


def test_quoted_commas_that_may_stand_between_thousands_are_refused(tmp_path: Path) -> None:
    for odd in ("789", "789.25"):
        told = every_way(tmp_path / "a.csv", [f'"1,234","23,456",{odd}', '"2,234","3,456","9,789"'] * 9)
        assert all("decimal sign or stand between thousands" in said for said in told) and len(set(told)) == 1


@pytest.mark.kernels
@pytest.mark.parametrize("sign", [";", " ", "\t", "|"])
def test_colours_do_not_hide_decimal_commas(sign: str, tmp_path: Path) -> None:
    rows = [line.replace(".", ",") + sign + sign.join("234") for line in lines(sign)]
    for points, _ in every_way(tmp_path / "a.csv", rows):
        assert np.array_equal(points, P)


def test_x_and_y_in_different_units_are_refused_and_heights_are_brought_to_theirs(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for names in ("X (mm),Y (m),Z (mm)", "x_ft,y_m,z_m"):
        path.write_text("\n".join([names, *lines()]))
        for read in (in_memory, in_tiles):
            with pytest.raises(InputError, match=r"has x in (mm|foot) and y in m by the names"):
                read(path)
    path.write_text("\n".join(["X (m),Y (m),Z (mm)", *lines()]))
    assert np.allclose(in_memory(path)[0], P / [1, 1, 1000])


def test_parquet_with_x_and_y_in_different_units_is_refused(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(
        pyarrow.table(dict(zip(["x [mm]", "y [m]", "z [m]"], P.T, strict=True))), tmp_path / "a.parquet"
    )
    with pytest.raises(InputError, match="has x in mm and y in m"):
        read_points(tmp_path / "a.parquet")


def test_more_points_than_a_count_line_promises_are_said(tmp_path: Path) -> None:
    path = tmp_path / "a.pts"
    for rows, promised in (
        (["50", *lines(" ")], 50),
        (["30", *lines(" ", stop=40), "15", *lines(" ", first=40)], 45),
    ):
        path.write_text("\n".join(rows))
        note = f"a.pts promises {promised} points and holds 60; all of them are read"
        cloud = read_points(path)
        assert len(cloud.points) == 60 and note in cloud.notes and note in thin_scan(path, 5.0).notes
    path.write_text("\n".join(["60", *lines(" ")]))
    assert read_points(path).notes == thin_scan(path, 5.0).notes == ()


@pytest.mark.parametrize("data", ["ascii", "binary"])
def test_a_pcd_file_that_holds_more_than_it_promises_is_said(data: str, tmp_path: Path) -> None:
    whole = pcd(list(zip("xyz", ["f8"] * 3, P.T, strict=True)), data)
    (tmp_path / "a.pcd").write_bytes(whole.replace(b"60", b"55", 2))
    cloud = read_points(tmp_path / "a.pcd")
    assert len(cloud.points) == (60 if data == "ascii" else 55) and len(cloud.notes) == 1
    assert ("promises 55 points and holds 60" if data == "ascii" else "goes on for 120 bytes after") in cloud.notes[0]
    (tmp_path / "a.pcd").write_bytes(whole)
    assert read_points(tmp_path / "a.pcd").notes == ()


def numbered(numbers: Iterable[object]) -> list[str]:
    return [f"{number} {line}" for number, line in zip(numbers, lines(" "), strict=True)]


@pytest.mark.kernels
@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        (range(60), None),
        ([*range(7, 30), *range(31, 68)], "is taken as the number of a point"),
        (range(1_600_000_000, 1_600_000_600, 10), "is taken as the number of a point"),
    ],
)
def test_a_first_column_of_whole_numbers_that_only_rise_is_no_coordinate(
    numbers: Iterable[int], words: str | None, tmp_path: Path
) -> None:
    for points, _ in every_way(tmp_path / "a.txt", numbered(numbers)):
        assert np.array_equal(points, P)
    for notes in (read_points(tmp_path / "a.txt").notes, thin_scan(tmp_path / "a.txt", 5.0).notes):
        assert any(words in note for note in notes) if words else not notes


def test_a_first_column_that_only_rises_otherwise_is_said(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("\n".join(numbered(1_600_000_000 + np.arange(60) / 4)))
    for notes in (read_points(path).notes, thin_scan(path, 5.0).notes):
        assert any("only rises, as times do" in note for note in notes)


def test_three_columns_sorted_by_x_are_as_they_were(tmp_path: Path) -> None:
    points = np.column_stack([np.arange(60.0) * 2, P[:, 1:]])
    for head in ([], ["x y z i"]):
        more = " 5" if head else ""
        rows = [*head, *(" ".join(f"{c:g}" for c in p) + more for p in points)]
        for got, _ in every_way(tmp_path / "a.txt", rows):
            assert np.allclose(got, points)
        assert not read_points(tmp_path / "a.txt").notes and not thin_scan(tmp_path / "a.txt", 5.0).notes


def test_plain_numbers_of_a_long_file_need_no_word(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("\n".join(f"{n} {P[n % 60][0]} {P[n % 60][1]} {P[n % 60][2]}" for n in range(40_000)))
    assert read_points(path).notes == thin_scan(path, 5.0).notes == ()


def test_numbers_that_start_again_are_said_or_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    many = [*range(40_000), *range(40_000)]
    path.write_text("\n".join(f"{n} {P[n % 60][0]} {P[n % 60][1]} {P[n % 60][2]}" for n in many))
    assert any("counts up at the start, but not all through" in note for note in read_points(path).notes)
    try:
        notes = thin_scan(path, 5.0).notes
    except FormatError as error:
        notes = (str(error),)
    assert any("counts up at the start, but not all through" in note for note in notes)


def test_the_header_itself_leaves_a_file_to_the_fast_ways(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.txt").write_text("\n".join(["# x y z", *lines(" "), "# x y z", "# the end"]))
    monkeypatch.setattr(text, "read_ragged", lambda *_: pytest.fail("line by line"))
    assert np.array_equal(in_memory(tmp_path / "a.txt")[0], P)
