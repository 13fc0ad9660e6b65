"""Points of OBJ, STL and OFF files: all their vertices, with or without a face, and their normals by the faces.

These readers are our own: libraries for such files drop vertices without a face, or reorder and repeat them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import FormatError
from .content import Content
from .faces import normals_from_faces
from .kinds import is_text, kind_of, read_head, wrong_kind

STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
STL_START = 84  # bytes: a comment of 80 and the number of facets


def read_obj(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of the `v` lines of an OBJ file, with normals where it has faces."""
    head = read_head(path)
    if b"\0" in head or kind_of(head) not in ("", "an OBJ file"):
        raise wrong_kind(path, head, "an OBJ file")
    lines, faces = list[str](), list[str]()
    with path.open(encoding="latin-1") as file:
        for line in file:
            if (start := line.lstrip()[:2]) in ("v ", "v\t"):
                lines.append(line)
            elif start in ("f ", "f\t"):
                faces.append(line)
    if not lines:
        raise FormatError(f"{path} has no line `v x y z`, so no points")
    try:
        points = np.loadtxt(lines, usecols=(1, 2, 3), ndmin=2)
    except ValueError:
        raise FormatError(f"{path} has a line `v` without three numbers; the file is damaged") from None
    return Content(points, normals=normals_from_faces(points, _obj_faces(faces, len(points))))


def _obj_faces(lines: list[str], points: int) -> list[np.ndarray]:
    """Return the faces of `f` lines, those of as many corners together; none where one is damaged."""
    by_corners = dict[int, list[str]]()
    for line in re.sub(r"/\S*", "", "".join(lines)).splitlines():  # the numbers of textures and normals
        by_corners.setdefault(len(line.split()) - 1, []).append(line.lstrip()[1:])
    try:
        faces = [np.loadtxt(rows, np.int64, ndmin=2) for corners, rows in by_corners.items() if corners > 2]
    except ValueError:
        return []
    return [np.where(face < 0, face + points, face - 1) for face in faces]


def read_off(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the vertices of an OFF file (also COFF, NOFF, STOFF)."""
    head = read_head(path)
    if kind_of(head) != "an OFF file":
        raise wrong_kind(path, head, "an OFF file")
    text = re.sub(r"#[^\n]*", "", path.read_text(encoding="latin-1"))
    header = re.match(r"\s*((?:ST)?C?N?)(4?)(n?)OFF\b[ \t]*(BINARY)?\s*(\d+)[ \t]+(\d+)(?:[ \t]+\d+)?\s*\n", text)
    if not header:
        raise FormatError(f"{path}: the OFF header has no number of vertices and faces in plain text")
    if header[2] or header[3]:
        raise FormatError(f"{path} has vertices of other than three dimensions; export plain OFF")
    count, faces = int(header[5]), int(header[6])
    rows = [row for row in text[header.end() :].split("\n") if row.strip()]
    if len(rows) < count + faces:
        raise FormatError(f"{path} ends early: its header promises {count:,} points and {faces:,} faces; copy it again")
    if not count:
        return Content(np.empty((0, 3)))
    try:
        points = np.loadtxt(rows[:count], usecols=(0, 1, 2), ndmin=2)
    except ValueError:
        raise FormatError(f"{path} has a vertex without three numbers; the file is damaged") from None
    return Content(points, normals=normals_from_faces(points, _off_faces(rows[count : count + faces])))


def _off_faces(rows: list[str]) -> list[np.ndarray]:
    """Return the faces of an OFF file, those of as many corners together; none where one is damaged."""
    by_corners = dict[str, list[str]]()
    for row in rows:
        by_corners.setdefault(row.split(None, 1)[0], []).append(row)
    try:
        return [
            np.loadtxt(own, np.int64, usecols=range(1, int(corners) + 1), ndmin=2)
            for corners, own in by_corners.items()
            if int(corners) > 2
        ]
    except ValueError:
        return []


def read_stl(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the corners of an STL file, each once, with normals by its facets."""
    head = read_head(path)
    size = path.stat().st_size
    facets = int(np.frombuffer(head, "<u4", 1, 80)[0]) if size >= STL_START else -1
    if facets >= 0 and size == STL_START + facets * STL_FACET.itemsize:
        return _each_once(_read_stl_binary(path, facets))
    if re.match(rb"\s*solid\b", head) and b"\0" not in head:
        return _each_once(_read_stl_text(path))
    if facets < 0 or kind_of(head) or is_text(head):
        raise wrong_kind(path, head, "an STL file")
    if size < STL_START + facets * STL_FACET.itemsize:
        raise FormatError(f"{path} ends early: its header promises {facets:,} triangles; copy it again")
    return _each_once(_read_stl_binary(path, facets))


def _read_stl_binary(path: Path, facets: int) -> np.ndarray:
    rows = np.fromfile(path, STL_FACET, facets, offset=STL_START)
    corners: np.ndarray = rows["corners"].reshape(-1, 3)
    return corners


def _read_stl_text(path: Path) -> np.ndarray:
    with path.open(encoding="latin-1") as file:
        lines = [line for line in file if line.lstrip()[:6].lower() in ("vertex", "endsol")]
    corners = [line for line in lines if line.lstrip()[0] in "vV"]
    if len(corners) == len(lines) or len(corners) % 3:
        raise FormatError(f"{path} ends before its line endsolid; copy it again")
    try:
        return np.loadtxt(corners, usecols=(1, 2, 3), ndmin=2) if corners else np.empty((0, 3))
    except ValueError:
        raise FormatError(f"{path} has a line `vertex` without three numbers; the file is damaged") from None


def _each_once(corners: np.ndarray) -> Content:
    """Return every place once, in the order of first appearance, with normals by the facets of which these are the corners (3 F, 3)."""
    order = np.lexsort(corners.T)
    ordered = corners[order]
    fresh = np.ones(len(order), dtype=bool)
    fresh[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    first = np.sort(order[fresh])
    points = corners[first].astype(np.float64)
    of_corner = np.empty(len(corners), np.int64)
    of_corner[order] = np.searchsorted(first, order[fresh])[np.cumsum(fresh) - 1]
    return Content(points, normals=normals_from_faces(points, [of_corner.reshape(-1, 3)]))
