"""Large text files: every number is the nearest double, whatever the layout, and odd lines are left to a slower way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scantruss.scan.formats import text
from scantruss.scan.formats.reading import read_points
from scantruss.scan.formats.text_layout import Layout

FORMS = ("%r", "%.18e", "%.3f", "%.17g", "%.25f", "%+.15e", "%.0f", "%.16E")
digits = st.from_regex(r"[+-]?([0-9]{1,25}(\.[0-9]{0,25})?|\.[0-9]{1,25})([eE][+-]?[0-9]{1,3})?", fullmatch=True)
number = st.one_of(digits, st.tuples(st.sampled_from(FORMS), st.floats(-1e9, 1e9)).map(lambda t: t[0] % t[1]))


def rows(lines: str, columns: tuple[int, ...] = (0, 1, 2), **layout: object) -> np.ndarray | None:
    """Return what the fast way makes of lines; None where it leaves them to a slower one."""
    described = {"encoding": "latin-1", "separator": None, "comma": False, "skip": 0, "promised": None} | layout
    found = Layout(columns=columns, **described)  # type: ignore[arg-type]
    return text._read_by_pyarrow(lines.encode(), found, columns)


@pytest.mark.parametrize("comma", [False, True])
@given(words=st.lists(number, min_size=3))
def test_every_number_is_the_nearest_double(comma: bool, words: list[str]) -> None:
    words = words[: len(words) // 3 * 3]
    lines = "".join(";".join(words[i : i + 3]) + "\n" for i in range(0, len(words), 3))
    found = rows(lines.replace(".", ",") if comma else lines, separator=";", comma=comma)
    assert found is not None
    expected = np.array([float(word) for word in words]).reshape(-1, 3)
    assert np.array_equal(found, expected) and np.array_equal(np.signbit(found), np.signbit(expected))


@pytest.mark.parametrize(
    "word", ["9007199254740993", "9007199254740992.5", "0.1", "1.7976931348623157e308", "5e-324", "-0", "1e23", "nan"]
)
def test_ties_and_ends_of_the_range(word: str) -> None:
    found = rows(f"{word} 1 2\n")
    assert found is not None and np.array_equal(found[0], [float(word), 1, 2], equal_nan=True)


@given(
    sign=st.sampled_from([" ", "\t", ",", ";", "|", "  ", " , ", " \t "]),
    end=st.sampled_from(["\n", "\r\n", "\n\n", " \n", "\r"]),
    start=st.sampled_from(["", " ", "\n"]),
    order=st.permutations([0, 1, 2, 3]),
    last=st.booleans(),
)
def test_any_regular_layout(sign: str, end: str, start: str, order: list[int], last: bool) -> None:
    table = np.round(np.random.default_rng(2).random((40, 4)) * 100, 3)
    lines = start + end.join(sign.join(f"{value}" for value in row) for row in table) + (end if last else "")
    separator = sign if sign == "\t" else sign.strip() or None
    found = rows(lines, tuple(order[:3]), separator=separator)
    assert found is not None and np.array_equal(found, table[:, order[:3]])


@pytest.mark.parametrize(
    "line", ["1 2\n", "1 2 x\n", "1 2 3x\n", "1 2 3 # c\n", "#1 2 3\n", "1 2 3d5\n", "1 2 \x003\n", "a\n", '"1" 2 3\n']
)
def test_odd_lines_are_left_to_the_slower_way(line: str) -> None:
    assert rows("1 2 3\n" + line) is None


def test_a_column_that_is_not_there_is_left_to_the_slower_way() -> None:
    assert rows("1 2 3\n4 5 6\n", (1, 2, 3)) is None


@pytest.mark.parametrize("block", [100, 1 << 24])
@pytest.mark.parametrize("head", ["", "x y z\n", "\ufeff", "\ufeffx y z\r\n", "one\rtwo\r\nthree\n"])
def test_all_ways_of_reading_give_the_same_points(
    head: str, block: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = np.random.default_rng(1).random((500, 3)) * 1e6
    path = tmp_path / "a.txt"
    path.write_bytes((head + "".join(" ".join(map(repr, row)) + "\n" for row in points.tolist())).encode())
    slow = read_points(path)
    monkeypatch.setattr(text, "TEXT_BYTES_PER_BLOCK", block)
    monkeypatch.setattr(text, "BYTES_FOR_PYARROW", 0)
    monkeypatch.setattr(np, "loadtxt", lambda *_, **__: pytest.fail("numpy was asked"))
    fast = read_points(path)
    assert np.array_equal(slow.points, fast.points) and np.array_equal(fast.points + fast.origin, points)
