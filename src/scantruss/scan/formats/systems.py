"""The reference system of a LAS file: WKT (both editions) or GeoTIFF keys. Only units and the name are used."""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

#: EPSG codes of units -> metres
METRES_OF_CODE = {
    9001: 1.0, 9002: 0.3048, 9003: 1200 / 3937, 9005: 0.3047972654, 9036: 1000.0, 9096: 0.9144,
    1025: 0.001, 1033: 0.01, 9070: 0.3048, 9095: 0.3048007491, 9080: 0.3047995102,
}  # fmt: skip
DEGREES = 2  # GTModelTypeGeoKey of longitude and latitude
USER_DEFINED = 32767  # "user defined"
DEEPEST_BRACKET = 60  # brackets in brackets
_TOKEN = re.compile(r'"(?:[^"]|"")*"|[A-Za-z_][\w.]*|[-+.\d][\w.+-]*|[\[\](),]')

Node = tuple[str, list[Any]]  # a keyword of WKT and what its brackets hold: texts, numbers as texts, nodes


@dataclass(frozen=True)
class System:
    """A reference system, as far as units go."""

    name: str = ""
    metres: float | None = None  #: metres per unit of x and y
    z_metres: float | None = None  #: ... of z
    degrees: bool = False


def system_of(records: Sequence[Any]) -> System:
    """Return the system given by the variable length records of a LAS file; an empty one if they give none."""
    bodies = {r.record_id: bytes(r.record_data_bytes()) for r in records if r.user_id.strip("\0 ") == "LASF_Projection"}
    if 2112 in bodies:
        found = from_wkt(bodies[2112].decode("utf-8", errors="replace").rstrip("\0 \n"))
        if found.degrees or found.metres:
            return found
    if 34735 in bodies:
        return _from_keys(bodies[34735], bodies.get(34736, b""), bodies.get(34737, b""))
    return System()


def from_wkt(text: str) -> System:
    """Return the system of a WKT text; an empty one if it cannot be parsed."""
    root = _root(text)
    if root is None:
        return System()
    while root[0] in ("BOUNDCRS", "SOURCECRS"):
        root = next((child for child in _children(root) if child[0] != "ID"), ("", []))
    name = _epsg(root) or _name(root)
    if root[0] not in ("COMPD_CS", "COMPOUNDCRS"):
        return System(name, *_units(root), _is_geographic(root))
    parts = [child for child in _children(root) if child[0].endswith(("CRS", "_CS", "GCS", "JCS"))]
    flat = next((part for part in parts if not part[0].startswith("VERT")), ("", []))
    height = next((part for part in parts if part[0].startswith("VERT")), ("", []))
    metres, z_metres = _units(flat)
    return System(_epsg(flat) or _name(flat) or name, metres, _units(height)[0] or z_metres, _is_geographic(flat))


def _root(text: str) -> Node | None:
    """Return the outermost keyword of a WKT text with what its brackets hold; None if there is none."""
    stack: list[Node] = [("", [])]
    for token in _TOKEN.findall(text):
        held = stack[-1][1]
        if token in "[(":
            word = held.pop() if held and isinstance(held[-1], str) else ""
            if len(stack) > DEEPEST_BRACKET:
                return None
            stack.append((word.upper(), []))
            held.append(stack[-1])
        elif token in "])":
            stack = stack[: max(1, len(stack) - 1)]
        elif token != ",":
            held.append(token[1:-1].replace('""', '"') if token[0] == '"' else token)
    return next((node for node in stack[0][1] if isinstance(node, tuple)), None)


def _children(node: Node) -> list[Node]:
    return [child for child in node[1] if isinstance(child, tuple)]


def _name(node: Node) -> str:
    return node[1][0].strip() if node[1] and isinstance(node[1][0], str) else ""


def _epsg(node: Node) -> str:
    for child in _children(node):
        if child[0] in ("AUTHORITY", "ID") and len(child[1]) > 1 and str(child[1][0]).upper() == "EPSG":
            return f"EPSG:{child[1][1]}"
    return ""


def _is_geographic(node: Node) -> bool:
    flat = any(child[0] == "CS" and str(child[1][:1]).lower() == "['cartesian']" for child in _children(node))
    return node[0] in ("GEOGCS", "GEOGCRS", "GEODCRS", "GEODETICCRS", "GEOGRAPHICCRS") and not flat


def _units(node: Node) -> tuple[float | None, float | None]:
    """Return the metres per unit of the plane axes and of the axis that points up, where it has its own."""
    own = [m for child in _children(node) if child[0] in ("UNIT", "LENGTHUNIT") and (m := _metres(child))]
    axes = []
    for axis in (child for child in _children(node) if child[0] == "AXIS"):
        unit = next(
            (m for child in _children(axis) if child[0] in ("UNIT", "LENGTHUNIT") and (m := _metres(child))), None
        )
        axes.append(("up" in [str(word).lower() for word in axis[1]], unit))
    flat = next((unit for is_up, unit in axes if unit and not is_up), None)
    up = next((unit for is_up, unit in axes if unit and is_up), None)
    plane = own[0] if own else flat
    return plane or (up if not flat else None), up


def _metres(unit: Node) -> float | None:
    try:
        value = float(unit[1][1])
    except (IndexError, ValueError, TypeError):
        return None
    return value if 1e-9 < value < 1e9 else None


def _from_keys(directory: bytes, doubles: bytes, texts: bytes) -> System:
    """Return the system of GeoTIFF keys."""
    words = struct.unpack(f"<{len(directory) // 2}H", directory[: len(directory) // 2 * 2])
    keys = {words[i]: words[i + 1 : i + 4] for i in range(4, len(words) - 3, 4)}

    def value(key: int) -> int:
        place, _, what = keys.get(key, (1, 0, 0))
        return what if place == 0 else 0

    def double(key: int) -> float | None:
        place, _, what = keys.get(key, (0, 0, 0))
        inside = place == 34736 and 8 * what + 8 <= len(doubles)
        number = struct.unpack_from("<d", doubles, 8 * what)[0] if inside else 0.0
        return number if 1e-9 < number < 1e9 else None

    code = value(3072)
    metres = METRES_OF_CODE.get(value(3076)) or double(3077)
    if metres is None and any(low < code <= low + 60 for low in (32600, 32700, 26900, 25800)):  # zones of UTM
        metres = 1.0
    place, length, start = keys.get(1026, (0, 0, 0))
    name = texts[start : start + length].split(b"|")[0].decode("latin-1").strip("\0 ") if place == 34737 else ""
    name = f"EPSG:{code}" if 0 < code < USER_DEFINED else name
    return System(name, metres, METRES_OF_CODE.get(value(4099)), value(1024) == DEGREES)
