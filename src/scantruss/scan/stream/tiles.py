"""Tiles: files, or ranges of files, that any worker can read by itself.

A file that cannot be entered in its middle (faces before points, lists, compressed text, E57, PCD) is one tile that is read whole;
a COPC file is one tile too, but read a million points at a time, and only near what is cropped.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError
from ..formats.columns import COLUMN_NAMES, find_attributes
from ..formats.dxf_points import metres_of_dxf
from ..formats.geotiff import terrain_head
from ..formats.kinds import kind_of, read_head, reading_as, wrong_kind
from ..formats.las_header import LASZIP_RECORD, check_header
from ..formats.numpy_ import is_turned, metres_of_npz, read_array_header
from ..formats.packed import unpacked
from ..formats.parquet import metres_of_parquet
from ..formats.pcd import read_pcd_header
from ..formats.ply import row_type
from ..formats.ply_header import PLY, read_header
from ..formats.systems import system_of
from ..formats.table import PACKED, READERS
from ..formats.text import first_column_note, is_number_of_point, read_lines
from ..formats.text_fields import ANY_SEPARATOR
from ..formats.text_layout import Layout, find_layout
from ..formats.threemf import metres_of_3mf
from ..units import metres_of
from .source import Source, Tile

POINTS_PER_TILE = 8_000_000  # points of a tile
TEXT_POINT = 24  # bytes of a line of a text file, about, or more
MOST_COLUMNS = 1000  # of an array; it is read whole where it has more
BYTES_SAMPLED = 1 << 14  # bytes looked at, at the start, in the middle and at the end
LEAST_LINE = 6  # bytes: "1 2 3" and its end
TEXT_SUFFIXES = tuple(suffix for suffix, reader in READERS.items() if reader is READERS[".xyz"])


def find_source(path: str | Path, wanted: Sequence[str] = ()) -> Source:
    """Return what the header of a file says of its points and of wanted attributes, without reading them.

    Raises
    ------
    FormatError
        The file is missing, empty, damaged, or of another kind than its suffix says.
    """
    path = Path(path)
    head = read_head(path)
    suffix = path.suffix.lower()
    try:
        if suffix in (".las", ".laz"):
            return _las(path, head)
        if suffix in (".tif", ".tiff"):
            return _terrain(path)
        if suffix == ".ply" and (source := _ply(path)) is not None:
            return source
        if suffix == ".npy" and (source := _npy(path)) is not None:
            return source
        if suffix in TEXT_SUFFIXES and (source := _text(path, head, wanted)) is not None:
            return source
        if suffix == PACKED and Path(path.stem).suffix.lower() in READERS:
            with unpacked(path) as inner:
                return replace(find_source(inner, wanted), path=path, kind="whole")
        metres, z_metres = _metres(path)
        points = max(path.stat().st_size // TEXT_POINT, 1)
        return Source(path, "whole", points, metres=metres, z_metres=z_metres)
    except OSError as error:
        raise FormatError(f"{path} cannot be read: {error.strerror or error}") from None


def _metres(path: Path) -> tuple[float | None, float | None]:
    """Return the metres per unit of x and y, and of z, of a file that is read whole."""
    suffix, head = path.suffix.lower(), read_head(path)
    if suffix == ".ply" and PLY.match(head):
        return metres_of(read_header(path).unit), None
    if suffix == ".pcd" and kind_of(head) == "a PCD file":
        return read_pcd_header(path).metres, None
    if suffix == ".npz" and head.startswith(b"PK"):
        return metres_of_npz(path), None
    if suffix == ".parquet":
        return metres_of_parquet(path)
    if suffix in TEXT_SUFFIXES:
        layout = find_layout(path)
        return layout.metres, layout.z_metres
    if suffix == ".3mf":
        return metres_of_3mf(path), None
    if suffix == ".dxf":
        return metres_of_dxf(path), None
    if suffix == ".ptx":
        return 1.0, None
    return (1.0, 1.0) if suffix in (".e57", ".glb", ".gltf") else (None, None)


def tiles_of(sources: Sequence[Source], points: int = POINTS_PER_TILE) -> Iterator[Tile]:
    """Yield the tiles of some files, of about `points` points each."""
    for source in sources:
        if source.whole or source.in_one:
            yield Tile(source, 0, source.points)
            continue
        first, last, step = 0, source.points, points
        if source.kind == "text":
            first, last = source.begin, source.end
            step = max(points * (last - first) // max(source.points, 1), 1)
        for begin in range(first, last, step):
            yield Tile(source, begin, min(begin + step, last))


def _las(path: Path, head: bytes) -> Source:
    if not head.startswith(b"LASF"):
        raise wrong_kind(path, head, "a LAS or LAZ file")
    import laspy

    with reading_as(path, "LAS or LAZ"):
        notes = check_header(path)
        with laspy.open(path) as file:
            header = file.header
            system = system_of([*header.vlrs, *(header.evlrs or [])])
            return Source(
                path,
                "las",
                int(header.point_count),
                metres=system.metres,
                z_metres=system.z_metres,
                system=system.name,
                degrees=system.degrees,
                in_one=_has_uneven_chunks(header),
                notes=notes,
            )


def _terrain(path: Path) -> Source:
    head = terrain_head(path)
    return Source(
        path,
        "terrain",
        head.cells,
        metres=head.system.metres,
        z_metres=head.z_metres,
        system=head.system.name,
        degrees=head.system.degrees,
        in_one=True,
    )


def _has_uneven_chunks(header: Any) -> bool:
    """Whether points are packed in chunks of different sizes, as in COPC: lazrs then finds wrong points when it seeks."""
    import lazrs

    packed = [vlr.record_data_bytes() for vlr in header.vlrs if vlr.record_id == LASZIP_RECORD]
    return any(lazrs.LazVlr(described).uses_variable_size_chunks() for described in packed)


def _ply(path: Path) -> Source | None:
    """Return a binary PLY file whose first element is vertex, without lists."""
    if not PLY.match(read_head(path)):
        return None
    header = read_header(path)
    vertex = header.elements[0] if header.elements else None
    if not header.order or vertex is None or vertex.name != "vertex" or vertex.has_lists:
        return None
    rows = row_type(vertex, header.order, [0] * len(vertex.properties))
    own = [p.name for p in vertex.properties]
    lower = [name.lower() for name in own]
    if not {"x", "y", "z"} <= set(lower):
        return None
    first = {lower.index(axis): axis for axis in "xyz"}  # X and x may both exist; the first is read, as by `read_ply`
    rows.names = tuple(first.get(i, f"other {i}" if name in "xyz" else name) for i, name in enumerate(rows.names or ()))
    return replace(_rows(path, vertex.count, header.start, rows), metres=metres_of(header.unit))


def _npy(path: Path) -> Source | None:
    """Return an NPY file of rows; None for one by columns, of objects, or another shape."""
    try:
        with path.open("rb") as file:
            shape, by_columns, kind = read_array_header(file)
            start = file.tell()
    except Exception:  # a damaged header raises many kinds of errors; reading the file reports which
        return None
    if kind.names and len(shape) == 1 and {"x", "y", "z"} <= set(kind.names):
        needed = [*"xyz", *(kind.names[place] for place in find_attributes(kind.names, list(COLUMN_NAMES)).values())]
        if all(kind[name].kind in "fiu" and not kind[name].shape for name in needed):
            return _rows(path, shape[0], start, kind)
        return None
    if len(shape) != 2 or not 3 <= shape[1] <= MOST_COLUMNS or is_turned(shape) or by_columns or kind.kind not in "fiu":
        return None
    names = ["x", "y", "z", *(f"other {c}" for c in range(3, shape[1]))]
    return _rows(path, shape[0], start, np.dtype([(name, kind) for name in names]))


def _rows(path: Path, count: int, start: int, rows: np.dtype[np.void]) -> Source:
    held = max(path.stat().st_size - start, 0) // rows.itemsize
    if held < count:
        raise FormatError(f"{path} ends early: its header promises {count:,} points, got {held:,}; copy it again")
    return Source(path, "rows", count, start, rows=rows)


def _text(path: Path, head: bytes, wanted: Sequence[str]) -> Source | None:
    """Return a text file that can be entered at any line."""
    layout = find_layout(path, wanted)
    if layout.encoding == "utf-16" or layout.separator == ANY_SEPARATOR or b"\r" in head.replace(b"\r\n", b""):
        return None
    size = path.stat().st_size
    with path.open("rb") as file:
        for _ in range(layout.skip):
            file.readline()
        start = file.tell()
        sample = file.read(1 << 16)
    lines = max(sample.count(b"\n"), 1)
    points = layout.promised or max(round((size - start) * lines / max(len(sample), 1)), 1)
    points = min(points, (size - start) // LEAST_LINE + 1)
    columns = layout.columns
    notes: tuple[str, ...] = ()
    if layout.has_unnamed_first:
        first = _first_column(path, layout, start, size)
        notes = first_column_note(path.name, layout, *first)
        if len(columns) == 4 and not is_number_of_point(np.concatenate(first)):
            columns = columns[:3]
    return Source(
        path,
        "text",
        points,
        start,
        size,
        columns=columns,
        layout=layout,
        metres=layout.metres,
        z_metres=layout.z_metres,
        notes=notes,
    )


def _first_column(path: Path, layout: Layout, start: int, size: int) -> list[np.ndarray]:
    """Return the first of the columns at the start, in the middle and at the end of a text."""
    parts, end = [], start
    for place in (start, size // 2, size - BYTES_SAMPLED):
        with path.open("rb") as file:
            file.seek(max(place, end))
            if place > end:
                file.readline()
            begin = file.tell()
            lines = file.read(BYTES_SAMPLED) + file.readline()
            end = file.tell()
        if lines.strip():
            parts.append(read_lines(path, lines, layout, layout.columns, begin).rows[:, 0])
    return parts
