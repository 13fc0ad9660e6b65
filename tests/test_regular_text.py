"""Large text files: every number as Python rounds it, every layout as numpy reads it, anything odd left to the slower way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scantruss.kernels.scan.decimals import BAD, GOOD, number
from scantruss.scan.formats import text
from scantruss.scan.formats.layout import Layout
from scantruss.scan.formats.reading import read_points
from scantruss.scan.formats.regular_text import read_regular

pytestmark = pytest.mark.kernels

FORMS = ("%r", "%.18e", "%.3f", "%.17g", "%.25f", "%+.15e", "%.0f", "%.16E")
digits = st.from_regex(r"[+-]?([0-9]{1,25}(\.[0-9]{0,25})?|\.[0-9]{1,25})([eE][+-]?[0-9]{1,3})?", fullmatch=True)


def rows(lines: str, columns: tuple[int, ...] = (0, 1, 2), block: int = 1 << 24, **layout: object) -> np.ndarray | None:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.xyz"
        path.write_text(lines, newline="")
        described = {"encoding": "latin-1", "separator": None, "comma": False, "skip": 0, "promised": None} | layout
        return read_regular(path, Layout(columns=columns, **described), columns, block)  # type: ignore[arg-type]


@given(
    st.lists(
        st.one_of(digits, st.tuples(st.sampled_from(FORMS), st.floats(-1e9, 1e9)).map(lambda t: t[0] % t[1])),
        min_size=3,
    )
)
def test_every_number_is_rounded_as_python_does(words: list[str]) -> None:
    words = words[: len(words) // 3 * 3]
    lines = "".join(" ".join(words[i : i + 3]) + "\n" for i in range(0, len(words), 3))
    found = rows(lines)
    assert found is not None
    expected = np.array([float(word) for word in words]).reshape(-1, 3)
    assert np.array_equal(found, expected) and np.array_equal(np.signbit(found), np.signbit(expected))


@pytest.mark.parametrize(
    "word", ["9007199254740993", "9007199254740992.5", "0.1", "1.7976931348623157e308", "5e-324", "-0", "1e23"]
)
def test_ties_and_ends_of_the_range(word: str) -> None:
    found = rows(f"{word} 1 2\n")
    assert found is not None and found[0, 0] == float(word)


@pytest.mark.parametrize("word", ["", "-", ".", "e5", "1e", "x", "#"])
def test_what_is_no_number_is_none(word: str) -> None:
    data = np.frombuffer(bytearray(word.encode() + b" "), np.uint8)
    assert number(data, 0, len(data), False)[2] == BAD
    assert number(np.frombuffer(bytearray(b"NaN"), np.uint8), 0, 3, False)[1:] == (3, GOOD)


@given(
    sign=st.sampled_from([" ", "\t", ",", ";", "  ", " , "]),
    end=st.sampled_from(["\n", "\r\n", "\n\n", " \n"]),
    order=st.permutations([0, 1, 2, 3]),
    block=st.sampled_from([7, 60, 1000]),
    last=st.booleans(),
)
def test_any_regular_layout_in_blocks_of_any_size(
    sign: str, end: str, order: list[int], block: int, last: bool
) -> None:
    table = np.round(np.random.default_rng(2).random((40, 4)) * 100, 3)
    lines = end.join(sign.join(f"{value}" for value in row) for row in table) + (end if last else "")
    columns = tuple(order[:3])
    found = rows("a header\n" + lines, columns, block, separator=sign.strip() or None, skip=1)
    if sign == "\t":
        found = rows("a header\n" + lines, columns, block, separator="\t", skip=1)
    assert found is not None and np.array_equal(found, table[:, columns])


def test_decimal_commas() -> None:
    assert np.array_equal(rows("1,5;2;-3,25\n4;5;6\n", separator=";", comma=True), [[1.5, 2, -3.25], [4, 5, 6]])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "line", ["1 2\n", "1 2 x\n", "1 2 3x\n", "1 2 3 # c\n", "1 2 3\r4 5 6\n", "1 2 3d5\n", "1 2 \x003\n", "a\n"]
)
def test_odd_lines_are_left_to_the_slower_way(line: str) -> None:
    assert rows("1 2 3\n" + line) is None


def test_the_fast_way_is_taken_for_large_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = np.random.default_rng(1).random((500, 3)) * 1e6
    np.savetxt(tmp_path / "a.csv", points, "%.17g", ",", header="x,y,z", comments="")
    slow = read_points(tmp_path / "a.csv")
    monkeypatch.setattr(text, "LARGE", 0)
    monkeypatch.setattr(np, "loadtxt", lambda *_, **__: pytest.fail("numpy was asked"))
    fast = read_points(tmp_path / "a.csv")
    assert np.array_equal(slow.points, fast.points) and np.array_equal(fast.points + fast.origin, points)
