"""Positions and polylines that the command line names: as words, and in text files of three numbers a line."""

from __future__ import annotations

import argparse
import math
import re
from pathlib import Path

from ..errors import FormatError
from ..settings.values import ROTATION_NUMBERS

Position = tuple[float, float, float]
NamedPart = tuple[str, list[Position]]  # name of a part of a file, "" for none, and its positions


def position(text: str) -> Position:
    """Return the three coordinates of "X,Y,Z" (comma, semicolon or space between them)."""
    try:
        x, y, z = (float(word) for word in re.split(r"[,;\s]+", text.strip()))
    except ValueError:
        raise argparse.ArgumentTypeError(f"needs three numbers X,Y,Z, got {text!r}") from None
    return x, y, z


def read_positions(path: str | Path) -> list[Position]:
    """Return the positions in a text file: three numbers a line, any separator, header or not.

    Columns named x, y and z are taken where a header names them, else the first three.

    Raises
    ------
    FormatError
        The file cannot be read, or a line holds no position.
    """
    return [place for _, part in _read_parts(path, "fixed nodes") for place in part]


def read_planes(path: str | Path) -> tuple[tuple[float, ...], ...]:
    """Return the symmetry in a text file, any separator, `#` before comments.

    Mirror planes are a point and a normal, six numbers a line; a rotation is one line of a point, an axis and the parts of a turn,
    and perhaps a second one of a half turn.

    Raises
    ------
    FormatError
        The file cannot be read, or a line holds no plane.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        words = getattr(error, "strerror", None) or "it is no text"
        raise FormatError(
            f"cannot read mirror planes {path}: {words}; --symmetry needs auto, rotation or a file of planes"
        ) from None
    rows = []
    for number, line in enumerate(lines, 1):
        if not (words := line.partition("#")[0].replace(",", " ").replace(";", " ").split()):
            continue
        try:
            row = tuple(map(float, words))
        except ValueError:
            row = ()
        if len(row) not in (6, ROTATION_NUMBERS):
            raise FormatError(
                f"{path}, line {number}: a mirror plane needs six numbers, x y z nx ny nz, got {line.strip()!r}"
            )
        rows.append(row)
    if not rows:
        raise FormatError(f"{path} holds no mirror plane; it needs lines of six numbers, x y z nx ny nz")
    return tuple(rows)


def read_polylines(path: str | Path, what: str = "fixed line") -> list[NamedPart]:
    """Return the polylines in a text file with their names: points as `read_positions` takes them, an empty line between two of them.

    The name is that of a column `name`, a new one beginning a new polyline; without such a column that of the file, with a number
    behind it where the file holds several.

    Raises
    ------
    FormatError
        The file cannot be read, a line holds no position, or a polyline has fewer than two points.
    """
    found = _read_parts(path, what.replace("boundary", "boundarie") + "s")
    stem = Path(path).stem
    for number, (_, part) in enumerate(found, 1):
        if len(set(part)) < 2:
            which = f"polyline {number} of {path}" if len(found) > 1 else path
            raise FormatError(f"{which} has {len(set(part))} point; a {what} needs at least two different ones")
    return [
        (name or (f"{stem}-{number}" if len(found) > 1 else stem), part) for number, (name, part) in enumerate(found, 1)
    ]


def _read_parts(path: str | Path, what: str) -> list[NamedPart]:
    """Return the positions in a text file, in parts that empty lines divide, or that a column of names does."""
    try:
        lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise FormatError(f"cannot read {what} {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise FormatError(f"{path} is not a text file; {what} need a CSV file with three numbers per line") from None
    found: list[NamedPart] = []
    columns, named = [0, 1, 2], -1
    header = False
    begins = True
    for count, line in enumerate(lines, 1):
        words = _words(line, spaced=named >= 0)
        if not words:
            begins = begins or not line.strip()
            continue
        try:
            x, y, z = (float(words[column]) for column in columns)
        except (ValueError, IndexError):
            names = [word.lower() for word in words]
            if found or header:
                raise FormatError(f"{path}, line {count}: needs three numbers X,Y,Z, got {line.strip()!r}") from None
            header = True
            columns = [names.index(axis) for axis in "xyz"] if {"x", "y", "z"} <= set(names) else columns
            named = names.index("name") if {"name", "x", "y", "z"} <= set(names) else named
            continue
        if not all(map(math.isfinite, (x, y, z))):
            raise FormatError(f"{path}, line {count}: needs three finite numbers X,Y,Z, got {line.strip()!r}")
        name = words[named] if 0 <= named < len(words) else ""
        if begins or name != found[-1][0]:
            found.append((name, []))
        begins = False
        found[-1][1].append((x, y, z))
    if not found:
        raise FormatError(f"{path} holds no {what}; it needs three numbers X,Y,Z per line")
    return found


def _words(line: str, *, spaced: bool) -> list[str]:
    """Split a line of a text file; with semicolons or tabs between the numbers a comma is a decimal comma.

    spaced : words have spaces in them where commas divide them
    """
    line = re.split(r"#|//", line)[0].replace('"', "").strip()
    if re.search(r"[;\t]", line):
        words = [word.strip() for word in re.split(r"[;\t]", line)]
        return [re.sub(r"^(-?\d*),(\d+)$", r"\1.\2", word) for word in words if word]
    return [word for word in re.split(r"\s*,\s*" if spaced and "," in line else r"[,\s]+", line) if word]
