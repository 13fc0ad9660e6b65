"""Points of a PLY file: ascii or binary of either byte order; of the element `vertex` x, y, z and wanted attributes count.

This reader uses numpy only: the licence of the usual library, plyfile, is the GPL.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from io import TextIOWrapper
from pathlib import Path

import numpy as np

from ...errors import FormatError
from ...runtime.ours import CLOUD_MARK
from ..units import metres_of
from .columns import NORMAL_COLUMNS, find_attributes
from .content import Cloud, Content
from .faces import normals_from_faces
from .kinds import read_head, wrong_kind
from .ply_header import PLY, Element, PlyHeader, ends_early, read_header

LONGEST_LIST = 1 << 26  # entries
LISTS_OF_CORNERS = ("vertex_indices", "vertex_index")  # properties of a face
EDGE_ENDS = ("vertex1", "vertex2")  # properties of an edge
RUNS_OF_LISTS = 20_000  # changes of list length walked through behind the points


def read_ply(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of a PLY file and the wanted attributes."""
    head = read_head(path)
    if not PLY.match(head):
        raise wrong_kind(path, head, "a PLY file")
    header = read_header(path)
    names = [element.name for element in header.elements]
    if "vertex" not in names:
        raise FormatError(f"{path} has no element vertex, so no points")
    vertex = header.elements[names.index("vertex")]
    own = [p.name for p in vertex.properties if not p.count_type]
    lower = [name.lower() for name in own]
    if missing := [axis for axis in "xyz" if axis not in lower]:
        raise FormatError(f"{path}: the element vertex has no property {missing[0]}")
    found = find_attributes(own, wanted)
    columns = [own[place] for place in (*map(lower.index, "xyz"), *found.values())]
    if vertex.count == 0:
        table = np.empty((0, len(columns)))
    elif not header.order:
        table = _read_ascii(path, header, vertex, columns)
    else:
        table = _read_binary(path, header, vertex, columns)
    attributes = {name: table[:, 3 + i] for i, name in enumerate(found)}
    points, normals = np.ascontiguousarray(table[:, :3]), None
    if not all(name in attributes for name in NORMAL_COLUMNS):
        normals = normals_from_faces(points, ply_faces(path, header))
    return Content(points, attributes, metres=metres_of(header.unit), normals=normals)


def ply_faces(path: Path, header: PlyHeader) -> list[np.ndarray]:
    """Return the faces of a PLY file, those of as many corners together; none where they are damaged or there are none."""
    element = next((each for each in header.elements if each.name == "face"), None)
    names = [] if element is None else [p.name for p in element.properties if p.count_type]
    if element is None or not element.count or not set(names) & set(LISTS_OF_CORNERS):
        return []
    try:
        return _binary_faces(path, header, element) if header.order else _ascii_faces(path, header, element)
    except (FormatError, ValueError):
        return []


def ply_edges(path: Path, header: PlyHeader) -> np.ndarray:
    """Return the (E, 2) edges of a PLY file by their vertices, as programs write lines; FormatError where they are damaged."""
    element = next((each for each in header.elements if each.name == "edge"), None)
    own = [] if element is None else [p.name for p in element.properties if not p.count_type]
    if element is None or not element.count or not set(EDGE_ENDS) <= set(own):
        return np.empty((0, 2), np.int64)
    read = _read_binary if header.order else _read_ascii
    return read(path, header, element, EDGE_ENDS).astype(np.int64)


def _binary_faces(path: Path, header: PlyHeader, face: Element) -> list[np.ndarray]:
    data, offset = np.memmap(path, dtype=np.uint8, mode="r"), header.start
    for element in header.elements[: header.elements.index(face)]:
        offset = _skip(path, data, offset, header.order, element, None)
    number = next(i for i, p in enumerate(face.properties) if p.name in LISTS_OF_CORNERS)
    runs, found = _runs(path, data, offset, header.order, face), list[np.ndarray]()
    for rows, _ in itertools.islice(runs, RUNS_OF_LISTS):
        found.append(np.array(rows[f"list {number}"]))
    whole = sum(map(len, found)) == face.count
    return found if whole else []


def _ascii_faces(path: Path, header: PlyHeader, face: Element) -> list[np.ndarray]:
    place = header.elements.index(face)
    if face.properties[0].name not in LISTS_OF_CORNERS:
        return []
    with _open_data(path, header) as file:
        lines = (line for line in file if not line.isspace())
        _pass(lines, sum(element.count for element in header.elements[:place] if element.properties))
        by_corners = dict[str, list[str]]()
        for line in itertools.islice(lines, face.count):
            by_corners.setdefault(line.split(None, 1)[0], []).append(line)
    return [
        np.loadtxt(rows, np.int64, usecols=range(1, int(corners) + 1), ndmin=2)
        for corners, rows in by_corners.items()
        if int(corners) > 2
    ]


def _read_binary(path: Path, header: PlyHeader, vertex: Element, columns: Sequence[str]) -> np.ndarray:
    data = np.memmap(path, dtype=np.uint8, mode="r")
    offset = header.start
    table = np.empty((0, len(columns)))
    behind = False
    for element in header.elements:
        if element is vertex:
            table, offset = _read_rows(path, data, offset, header.order, element, columns)
            behind = True
        else:
            offset = _skip(path, data, offset, header.order, element, RUNS_OF_LISTS if behind else None)
    return table


def _read_rows(
    path: Path, data: np.ndarray, offset: int, order: str, vertex: Element, columns: Sequence[str]
) -> tuple[np.ndarray, int]:
    """Return the wanted columns of all rows and the byte behind them."""
    if len(data) - offset < vertex.count * row_type(vertex, order, [0] * len(vertex.properties)).itemsize:
        raise ends_early(path, vertex)
    table = np.empty((vertex.count, len(columns)))
    begin = 0
    for rows, behind in _runs(path, data, offset, order, vertex):
        for column, name in enumerate(columns):
            table[begin : begin + len(rows), column] = rows[name]
        begin, offset = begin + len(rows), behind
    return table, offset


def _skip(path: Path, data: np.ndarray, offset: int, order: str, element: Element, most: int | None) -> int:
    """Return the byte behind an element; gives up (end of file) after `most` changes of list length."""
    if not element.properties:
        return offset
    for runs, (_, behind) in enumerate(_runs(path, data, offset, order, element)):
        offset = behind
        if most is not None and runs >= most:
            return len(data)
    return offset


def _runs(path: Path, data: np.ndarray, offset: int, order: str, element: Element) -> Iterator[tuple[np.ndarray, int]]:
    """Yield rows as a structured array and the byte behind them; the lists of one yield all have one length."""
    begin, window = 0, element.count if not element.has_lists else 64
    while begin < element.count:
        lengths = _list_lengths(path, data, offset, order, element)
        row = row_type(element, order, lengths)
        room = min(window, element.count - begin, (len(data) - offset) // row.itemsize)
        if room < 1 or (not element.has_lists and room < element.count):
            raise ends_early(path, element)
        rows = np.ndarray((room,), row, buffer=data, offset=offset)
        same = np.ones(room, dtype=bool)
        for number, length in enumerate(lengths):
            if element.properties[number].count_type:
                same &= rows[f"count {number}"] == length
        stop = room if same.all() else int(np.argmin(same))
        window = window * 4 if stop == room else 64
        offset += stop * row.itemsize
        yield rows[:stop], offset
        begin += stop


def _list_lengths(path: Path, data: np.ndarray, offset: int, order: str, element: Element) -> list[int]:
    """Return the length of each list in the row at a byte, 0 for the other properties."""
    lengths = []
    for p in element.properties:
        length = 0
        if p.count_type:
            count = np.dtype(order + p.count_type)
            if offset + count.itemsize > len(data):
                raise ends_early(path, element)
            length = int(np.frombuffer(data, count, 1, offset)[0])
            if not 0 <= length <= min(len(data), LONGEST_LIST):
                raise FormatError(f"{path}: a list of {element.name} has {length} entries; the file is damaged")
            offset += count.itemsize + length * np.dtype(p.type).itemsize
        else:
            offset += np.dtype(p.type).itemsize
        lengths.append(length)
    return lengths


def row_type(element: Element, order: str, lengths: list[int]) -> np.dtype[np.void]:
    """Return the layout of a row whose lists have the given lengths."""
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    taken = set()
    for number, (p, length) in enumerate(zip(element.properties, lengths, strict=True)):
        if p.count_type:
            fields.append((f"count {number}", order + p.count_type))
            fields.append((f"list {number}", order + p.type, (length,)))
        else:
            fields.append((f"other {number}" if p.name in taken else p.name, order + p.type))
            taken.add(p.name)
    return np.dtype(fields)


def _read_ascii(path: Path, header: PlyHeader, vertex: Element, names: Sequence[str]) -> np.ndarray:
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


def _open_data(path: Path, header: PlyHeader) -> TextIOWrapper:
    file = path.open("rb")
    file.seek(header.start)
    return TextIOWrapper(file, encoding="latin-1")


def _pass(lines: Iterable[str], count: int) -> int:
    """Skip a number of lines and return how many there were."""
    return sum(1 for _ in itertools.islice(lines, count))


def _load_rows(lines: Iterator[str], vertex: Element, names: Sequence[str]) -> np.ndarray | None:
    """Return the points if each row is a line; None if rows are laid out in another way."""
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


def _read_words(path: Path, header: PlyHeader, vertex: Element, wanted: Sequence[str], words: list[str]) -> np.ndarray:
    """Return the wanted properties of a file whose rows do not keep to lines."""
    place, chosen = 0, np.empty((0, len(wanted)), dtype=np.int64)
    for element in header.elements:
        starts, place = _walk(path, element, words, place)
        if element is vertex:
            chosen = starts[:, _columns(vertex, wanted)]
    try:
        return np.array([[float(words[i]) for i in row] for row in chosen.tolist()])
    except ValueError as error:
        raise FormatError(f"{path}: a coordinate is not a number ({error}); the file is damaged") from None


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


def write_ply(path: Path, cloud: Cloud) -> None:
    """Write a binary PLY file of doubles."""
    names = cloud.names("nx", "ny", "nz")
    unit = f"comment unit {cloud.unit}\n" if cloud.unit else ""
    properties = "".join(f"property double {name}\n" for name in names)
    head = f"ply\nformat binary_little_endian 1.0\ncomment {CLOUD_MARK}\n{unit}element vertex {len(cloud.points)}\n{properties}end_header\n"
    with path.open("wb") as file:
        file.write(head.encode())
        file.write(np.ascontiguousarray(cloud.columns, dtype="<f8").data)
