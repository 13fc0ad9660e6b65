"""PTX files: scans by columns and rows, each in the frame of its scanner with the matrix of its place."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from ...errors import FormatError
from .content import Content
from .kinds import is_text, kind_of, read_head, wrong_kind
from .own_colors import COLOR_ATTRIBUTES

WIDTH_WITH_COLORS = 7  #: numbers of a point with intensity and colour
HEAD_LINES = (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)  #: numbers in the lines of a head: columns, rows, scanner, its axes, matrix


def read_ptx(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of all scans of a PTX file, in metres and placed; directions without a return are left out."""
    head = read_head(path)
    if kind_of(head) or not is_text(head):
        raise wrong_kind(path, head, "a PTX file")
    parts, colors, missing = list[np.ndarray](), list[np.ndarray](), 0
    wants_colors = set(COLOR_ATTRIBUTES) <= set(wanted)
    with path.open(encoding="latin-1") as file:
        while lines := list(
            islice((line for line in file if not line.isspace()), len(HEAD_LINES))
        ):  # each turn reads lines
            numbers = _numbers(path, lines, len(parts) + 1)
            count = int(numbers[0][0]) * int(numbers[1][0])
            rows = list(islice(file, count))
            if len(rows) < count:
                raise FormatError(
                    f"{path} ends early: scan {len(parts) + 1} has {len(rows):,} of {count:,} points; copy it again"
                )
            try:
                points = np.loadtxt(rows, usecols=(0, 1, 2), ndmin=2) if rows else np.empty((0, 3))
            except ValueError:
                points = np.empty((0, 0))
            if len(points) != count:
                raise FormatError(f"{path}: a point of scan {len(parts) + 1} has no three numbers; the file is damaged")
            returned = points.any(axis=1)
            missing += count - int(returned.sum())
            matrix = np.array(numbers[6:])
            parts.append(points[returned] @ matrix[:3, :3] + matrix[3, :3])
            if wants_colors and rows and len(rows[0].split()) == WIDTH_WITH_COLORS:
                colors.append(np.loadtxt(rows, usecols=(4, 5, 6), ndmin=2)[returned])
    if not parts:
        raise FormatError(f"{path} holds no scan; a PTX file begins with its columns and rows")
    left_out = {"without a return": missing} if missing else {}
    attributes: dict[str, np.ndarray] = {}
    if len(colors) == len(parts):
        attributes = dict(zip(COLOR_ATTRIBUTES, np.concatenate(colors).T, strict=True))
    return Content(np.concatenate(parts), attributes, metres=1.0, left_out=left_out)


def _numbers(path: Path, lines: list[str], scan: int) -> list[list[float]]:
    """Return the numbers of the head of a scan."""
    try:
        numbers = [[float(word) for word in line.split()] for line in lines]
    except ValueError:
        numbers = []
    sizes = tuple(map(len, numbers))
    if (
        sizes != HEAD_LINES
        or not all(n[0].is_integer() and 0 <= n[0] < 1e9 for n in numbers[:2])
        or not np.isfinite(numbers[6:]).all()
    ):
        raise FormatError(
            f"{path}: scan {scan} does not begin with the ten lines of a PTX file: columns, rows, scanner, matrix"
        )
    return numbers
