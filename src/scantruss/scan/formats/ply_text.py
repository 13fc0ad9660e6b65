"""The rows of an ascii PLY file."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from io import TextIOWrapper
from pathlib import Path

import numpy as np

from ...errors import FormatError
from .ply_header import Element, Header, ends_early


def read_ascii(path: Path, header: Header, vertex: Element, names: Sequence[str]) -> np.ndarray:
    """Return the named properties of all points of an ascii PLY file, (N, len(names)) float64.

    The usual layout, a row a line, is read by numpy; any other word by word, which takes longer.
    """
    place = header.elements.index(vertex)
    before = sum(element.count for element in header.elements[:place] if element.properties)
    behind = sum(element.count for element in header.elements[place + 1 :] if element.properties)
    with _open_data(path, header) as file:
        lines = (line for line in file if not line.isspace())
        _pass(lines, before)
        points = _load_rows(lines, vertex, names)
        if points is not None and _pass(lines, behind) == behind:
            return points
    with _open_data(path, header) as file:
        words = file.read().split()
    return _read_words(path, header, vertex, names, words)


def _open_data(path: Path, header: Header) -> TextIOWrapper:
    file = path.open("rb")
    file.seek(header.start)
    return TextIOWrapper(file, encoding="latin-1")


def _pass(lines: Iterable[str], count: int) -> int:
    """Pass over so many lines and return how many there were."""
    return sum(1 for _ in itertools.islice(lines, count))


def _load_rows(lines: Iterator[str], vertex: Element, names: Sequence[str]) -> np.ndarray | None:
    """Return the points where each row is a line; None where the rows are laid out in another way."""
    first = next(lines, "")
    if vertex.has_lists or len(first.split()) != len(vertex.properties):
        return None
    rows = itertools.chain([first], itertools.islice(lines, vertex.count - 1))
    try:
        table = np.loadtxt(rows, comments=None, ndmin=2)  # all columns, so that a row of another width shows
    except ValueError:
        return None
    return table[:, _columns(vertex, names)] if len(table) == vertex.count else None


def _columns(vertex: Element, wanted: Sequence[str]) -> list[int]:
    names = [p.name if not p.count_type else "" for p in vertex.properties]
    return [names.index(name) for name in wanted]


def _read_words(path: Path, header: Header, vertex: Element, wanted: Sequence[str], words: list[str]) -> np.ndarray:
    """Return the wanted properties of a file whose rows do not keep to lines."""
    place, chosen = 0, np.empty((0, len(wanted)), dtype=np.int64)
    for element in header.elements:
        starts, place = _walk(path, element, words, place)
        if element is vertex:
            chosen = starts[:, _columns(vertex, wanted)]
    try:
        return np.array([[float(words[i]) for i in row] for row in chosen.tolist()])
    except ValueError as error:
        raise FormatError(f"{path}: a coordinate is no number ({error}); the file is damaged") from None


def _walk(path: Path, element: Element, words: list[str], place: int) -> tuple[np.ndarray, int]:
    """Return the word at which each property of each row starts, and the word behind the element."""
    width = len(element.properties)
    behind = place + element.count * width
    if behind > len(words):  # a list takes one word at least
        raise ends_early(path, element)
    if not element.has_lists:
        return np.arange(place, behind, dtype=np.int64).reshape(element.count, width), behind
    starts = np.zeros((element.count, width), dtype=np.int64)
    try:
        for row in range(element.count):
            for number, p in enumerate(element.properties):
                starts[row, number] = place
                place += 1 + (int(words[place]) if p.count_type else 0)
    except (IndexError, ValueError):
        raise ends_early(path, element) from None
    if place > len(words):
        raise ends_early(path, element)
    return starts, place
