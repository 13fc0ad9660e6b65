"""Points of OBJ, STL and OFF files: all their vertices, with or without a face.

These readers are our own: libraries for such files drop vertices without a face, or reorder and repeat them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import FormatError
from .content import Content
from .kinds import is_text, kind_of, read_head, wrong_kind

STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
STL_START = 84  # bytes: a comment of 80 and the number of facets


def read_obj(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the `v` lines of an OBJ file."""
    head = read_head(path)
    if b"\0" in head or kind_of(head) not in ("", "an OBJ file"):
        raise wrong_kind(path, head, "an OBJ file")
    with path.open(encoding="latin-1") as file:
        lines = [line for line in file if line.lstrip()[:2] in ("v ", "v\t")]
    if not lines:
        raise FormatError(f"{path} has no line `v x y z`, so no points")
    try:
        return Content(np.loadtxt(lines, usecols=(1, 2, 3), ndmin=2))
    except ValueError:
        raise FormatError(f"{path} has a line `v` without three numbers; the file is damaged") from None


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
        return Content(np.loadtxt(rows[:count], usecols=(0, 1, 2), ndmin=2))
    except ValueError:
        raise FormatError(f"{path} has a vertex without three numbers; the file is damaged") from None


def read_stl(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the corners of an STL file, each once."""
    head = read_head(path)
    size = path.stat().st_size
    facets = int(np.frombuffer(head, "<u4", 1, 80)[0]) if size >= STL_START else -1
    if facets >= 0 and size == STL_START + facets * STL_FACET.itemsize:
        return Content(_read_stl_binary(path, facets))
    if re.match(rb"\s*solid\b", head) and b"\0" not in head:
        return Content(_read_stl_text(path))
    if facets < 0 or kind_of(head) or is_text(head):
        raise wrong_kind(path, head, "an STL file")
    if size < STL_START + facets * STL_FACET.itemsize:
        raise FormatError(f"{path} ends early: its header promises {facets:,} triangles; copy it again")
    return Content(_read_stl_binary(path, facets))


def _read_stl_binary(path: Path, facets: int) -> np.ndarray:
    rows = np.fromfile(path, STL_FACET, facets, offset=STL_START)
    return _each_once(rows["corners"].reshape(-1, 3))


def _read_stl_text(path: Path) -> np.ndarray:
    with path.open(encoding="latin-1") as file:
        lines = [line for line in file if line.lstrip()[:6].lower() in ("vertex", "endsol")]
    corners = [line for line in lines if line.lstrip()[0] in "vV"]
    if len(corners) == len(lines) or len(corners) % 3:
        raise FormatError(f"{path} ends before its line endsolid; copy it again")
    try:
        return _each_once(np.loadtxt(corners, usecols=(1, 2, 3), ndmin=2)) if corners else np.empty((0, 3))
    except ValueError:
        raise FormatError(f"{path} has a line `vertex` without three numbers; the file is damaged") from None


def _each_once(corners: np.ndarray) -> np.ndarray:
    """Return every place once, in the order of first appearance, (N, 3) float64."""
    order = np.lexsort(corners.T)
    ordered = corners[order]
    fresh = np.ones(len(order), dtype=bool)
    fresh[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    return corners[np.sort(order[fresh])].astype(np.float64)
