"""DXF drawings: their POINT entities."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FormatError
from .content import Content
from .extras import need_library
from .kinds import kind_of, read_head, reading_as, wrong_kind

BINARY_DXF = b"AutoCAD Binary DXF"  # how such a file begins
LINES_WITH_UNIT = 20_000  # lines of a drawing in which its unit stands
METRES_OF_INSUNITS = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 7: 1e3, 10: 0.9144, 14: 0.1, 21: 1200 / 3937}
MOST_BLOCKS_IN_BLOCKS = 16  # depth that is read
MOST_KINDS_NAMED = 4  # kinds of entities that a refusal names


def read_dxf_points(path: Path, wanted: Sequence[str] = ()) -> Content:
    """Return the points of the model space of a DXF drawing, those within its blocks too, as of surveys."""
    head = read_head(path)
    if not head.startswith(BINARY_DXF) and (b"\0" in head or kind_of(head) or b"SECTION" not in head):
        raise wrong_kind(path, head, "a DXF file")
    need_library("DXF", "ezdxf", "cad")
    import ezdxf

    with reading_as(path, "a DXF file"):
        drawing = ezdxf.readfile(path)  # type: ignore[attr-defined, unused-ignore]
        space = drawing.modelspace()
        kinds = Counter(entity.dxftype() for entity in space)
        found = [list(_points_of([entity])) for entity in space]
    points = [place for places in found for place in places]
    if not points:
        held = ", ".join(f"{count:,} {kind}" for kind, count in kinds.most_common(MOST_KINDS_NAMED)) or "nothing"
        raise FormatError(f"{path} has no POINT in its model space but {held}; export the scan as points")
    others = sum(not places for places in found)
    notes = (f"{others:,} other entities of {path.name} are not read",) if others else ()
    return Content(np.array(points, float).reshape(-1, 3), metres=metres_of_dxf(path), notes=notes)


def _points_of(entities: Iterable[Any], depth: int = 0) -> Iterator[tuple[float, ...]]:
    """Yield the places of the points among entities and within copies of blocks."""
    for entity in entities:
        if entity.dxftype() == "POINT":
            yield tuple(entity.dxf.location)
        elif entity.dxftype() == "INSERT" and depth < MOST_BLOCKS_IN_BLOCKS:
            for copy in entity.multi_insert() if entity.mcount > 1 else (entity,):
                yield from _points_of(copy.virtual_entities(), depth + 1)


def metres_of_dxf(path: Path) -> float | None:
    """Return the metres of the unit of a DXF drawing, None where it says none or is binary."""
    with path.open(encoding="latin-1") as file:
        lines = [line.strip() for line in islice(file, LINES_WITH_UNIT)]
    place = lines.index("$INSUNITS") if "$INSUNITS" in lines else len(lines)
    code = lines[place + 2] if place + 2 < len(lines) else ""
    return METRES_OF_INSUNITS.get(int(code)) if code.isdigit() else None
