"""Which points of a scan are taken: by class, return, confidence and place; and the unit of its heights.

Plain values only, so that saved settings repeat a run without the files that the values came from.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .errors import FormatError, InputError

RETURNS = ("all", "first", "last")
FORMS = "box:X0,Y0,Z0,X1,Y1,Z1, box:X0,Y0,X1,Y1, sphere:X,Y,Z,RADIUS or a file of a polygon"
LARGEST_FILE = 1 << 26  # bytes of a polygon

PolygonRing = list[tuple[float, float]]
_WKT_BETWEEN = re.compile(r"POLYGON|(?<=\))\s*\)\s*,\s*\(\s*(?=\()", re.IGNORECASE)  # what stands between two polygons


@dataclass(frozen=True, kw_only=True)
class Selection:
    """What is read of a scan; the default is all of it."""

    classes: tuple[int, ...] = ()  #: classes of LAS; () for all
    returns: str = "all"  #: all, first, last, or a number
    confidence: float | None = None  #: least confidence
    crop: tuple[str, ...] = ()  #: parts of space; a point must lie in all of them
    z_unit: str = ""  #: unit of the heights where it is another than that of x and y

    def __post_init__(self) -> None:
        """Bring every value to its plainest writing, or refuse it."""
        object.__setattr__(self, "classes", check_classes(self.classes))
        object.__setattr__(self, "returns", check_returns(self.returns))
        object.__setattr__(self, "crop", check_crop(self.crop))
        if self.confidence is not None and not (_is_number(self.confidence) and math.isfinite(self.confidence)):
            raise InputError(f"confidence must be a number, got {self.confidence!r}")

    @property
    def needs(self) -> tuple[str, ...]:
        """Names of the attributes that a file must hold for this."""
        by_return = {"all": (), "last": ("return_number", "return_count")}.get(self.returns, ("return_number",))
        return (*(("class",) if self.classes else ()), *by_return, *(("confidence",) * (self.confidence is not None)))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def check_classes(given: Any) -> tuple[int, ...]:
    """Return classes in order, each once: from numbers, or from words such as "2,6"."""
    words = [given] if isinstance(given, str | int) else list(given or ())
    parts = [
        part for word in words for part in (re.split(r"[,;\s]+", word.strip()) if isinstance(word, str) else [word])
    ]
    try:
        classes = sorted({int(part) for part in parts})
    except (TypeError, ValueError):
        raise InputError(f"classes must be whole numbers such as 2,6, got {given!r}") from None
    if classes and not 0 <= classes[0] <= classes[-1] <= 255:
        raise InputError(f"classes must lie between 0 and 255, got {', '.join(map(str, classes))}")
    return tuple(classes)


def check_returns(given: Any) -> str:
    """Return "all", "first", "last" or a number of a return as a word."""
    word = str(given).strip().lower()
    if word not in RETURNS and not re.fullmatch("[1-9]|1[0-5]", word):
        raise InputError(f"returns must be {', '.join(RETURNS)} or a number from 1 to 15, got {given!r}")
    return "first" if word == "1" else word


def check_crop(given: Any) -> tuple[str, ...]:
    """Return parts of space in their plainest writing; files of polygons are not read here."""
    return tuple(_check_part(str(part)) for part in ([given] if isinstance(given, str) else given or ()))


def _check_part(text: str) -> str:
    kind, _, rest = text.partition(":")
    polygons = [[_numbers(ring, text) for ring in polygon.split(";")] for polygon in rest.split("|")]
    rings = [ring for polygon in polygons for ring in polygon]
    numbers = rings[0]
    if kind == "box" and len(rings) == 1 and len(numbers) in (4, 6):
        half = len(numbers) // 2
        if any(low > high for low, high in zip(numbers[:half], numbers[half:], strict=True)):
            raise InputError(f"crop {text}: the first corner must be the lower one")
    elif kind == "sphere" and len(rings) == 1 and len(numbers) == 4:
        if numbers[3] <= 0:
            raise InputError(f"crop {text}: the radius must be positive")
    elif kind == "polygon":
        if any(len(ring) < 6 or len(ring) % 2 for ring in rings):
            raise InputError("crop: a polygon needs rings of at least three corners x,y")
    else:
        raise InputError(f"crop must be {FORMS}, got {text[:80]!r}")
    return f"{kind}:{'|'.join(';'.join(','.join(map(repr, ring)) for ring in polygon) for polygon in polygons)}"


def _numbers(text: str, whole: str) -> list[float]:
    try:
        numbers = [float(word) for word in re.split(r"[,\s]+", text.strip())]
    except ValueError:
        raise InputError(f"crop must be {FORMS}, got {whole[:80]!r}") from None
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"crop needs finite numbers, got {whole[:80]!r}")
    return numbers


def parts_of(crop: str) -> tuple[str, list[list[list[float]]]]:
    """Return the kind of a part of space and its numbers, one list a ring, in a list for each polygon."""
    kind, _, rest = crop.partition(":")
    polygons = [polygon.split(";") for polygon in rest.split("|")]
    return kind, [[[float(word) for word in ring.split(",")] for ring in rings] for rings in polygons]


def read_crop(text: str) -> str:
    """Return the value of ``--crop``: a part of space as it stands, or the polygon of a file."""
    if re.match(r"(box|sphere|polygon):", text):
        return _check_part(text)
    path = Path(text)
    if not path.is_file():
        raise InputError(f"crop must be {FORMS}, got {text[:80]!r}, which is not a file")
    return polygon_text(*read_polygons(path))


def polygon_text(*polygons: Iterable[PolygonRing]) -> str:
    """Return polygons as one crop; a point is inside where, of any of them, an odd number of rings hold it."""
    return _check_part("polygon:" + "|".join(";".join(map(_ring_text, rings)) for rings in polygons))


def _ring_text(ring: PolygonRing) -> str:
    corners = ring[:-1] if len(ring) > 1 and ring[0] == ring[-1] else ring
    return ",".join(f"{x!r},{y!r}" for x, y in corners)


def read_polygons(path: Path) -> list[list[PolygonRing]]:
    """Return the rings of each polygon in plan: of a GeoJSON or WKT file, or a text file with x, y a line, which is one polygon.

    Raises
    ------
    FormatError
        The file cannot be read, or holds no polygon.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise FormatError(f"{path} is too large for a polygon; a ring of corners x, y is needed")
        text = path.read_text(encoding="utf-8-sig").strip()
    except OSError as error:
        raise FormatError(f"cannot read the polygon {path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise FormatError(f"{path} is not a text file; a polygon is GeoJSON, WKT or x, y per line") from None
    if text.startswith("{"):
        polygons = _geojson_polygons(path, text)
    elif re.match(r"(SRID=\d+;\s*)?(MULTI)?POLYGON\b", text, re.IGNORECASE):
        parts = [part for words in _WKT_BETWEEN.split(text) if (part := re.findall(r"\(([^()]+)\)", words))]
        polygons = [[_ring(path, re.split(r"\s*,\s*", ring)) for ring in part] for part in parts]
    else:
        blocks = re.split(r"\n\s*\n", "\n".join(_without_header(text.splitlines())))
        polygons = [[_ring(path, block.strip().splitlines()) for block in blocks if block.strip()]]
    if not any(polygons) or any(len(set(ring)) < 3 for rings in polygons for ring in rings):
        raise FormatError(f"{path} holds no polygon; a ring of at least three corners x, y is needed")
    return polygons


def _without_header(lines: list[str]) -> list[str]:
    kept = [line for line in lines if not line.lstrip().startswith("#")]
    first = next((i for i, line in enumerate(kept) if line.strip()), 0)
    return kept[first + 1 :] if kept and re.match(r"\s*\"?[A-Za-z]", kept[first]) else kept


def _ring(path: Path, lines: Iterable[str]) -> PolygonRing:
    ring = []
    for line in lines:
        words = [word for word in re.split(r"[,;\s]+", line.strip().strip('"')) if word]
        try:
            x, y = float(words[0]), float(words[1])
        except (ValueError, IndexError):
            raise FormatError(f"{path}: a corner of a polygon needs x and y, got {line.strip()[:40]!r}") from None
        ring.append((x, y))
    return ring


def _geojson_polygons(path: Path, text: str) -> list[list[PolygonRing]]:
    """Return the rings of each polygon in a GeoJSON file; a feature may have no place."""
    found: list[list[PolygonRing]] = []
    try:
        stack = [json.loads(text)]
        while stack:
            value = stack.pop()
            kind = value.get("type")
            if kind == "FeatureCollection":
                stack.extend(reversed(value["features"]))
            elif kind == "Feature":
                stack.extend([value["geometry"]] if value["geometry"] is not None else [])
            elif kind == "GeometryCollection":
                stack.extend(reversed(value["geometries"]))
            elif kind in ("Polygon", "MultiPolygon"):
                polygons = [value["coordinates"]] if kind == "Polygon" else value["coordinates"]
                found += [[[(float(c[0]), float(c[1])) for c in ring] for ring in rings] for rings in polygons if rings]
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError):
        raise FormatError(f"{path} is not GeoJSON with a polygon") from None
    return found
