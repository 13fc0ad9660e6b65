"""Parts on the bed of a printer: laid flat, packed in shelves, a file for each full bed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import InputError, unit_words
from ..solid import as_solid
from ..solid_files import Solid

Bed = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class PrintedPart:
    """One printed part."""

    name: str
    body: Any  #: Manifold, where it belongs in the model
    flat: np.ndarray  #: (3, 3) rows: the axes that lie along x, y and z of the bed
    genus: int  #: openings that it has to have
    nodes: np.ndarray  #: ids of its nodes

    def lying(self, turned: bool = False) -> Any:
        """Return it on the bed, its lowest corner at 0; `turned` by a right angle about z."""
        turn = np.array([(0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]) if turned else np.eye(3)
        body = self.body.transform(np.column_stack([turn @ self.flat, np.zeros(3)]))
        return body.translate(tuple(-c for c in body.bounding_box()[:3]))


@dataclass(frozen=True)
class PlateSpot:
    """Where a part lies on a plate."""

    part: int
    x: float
    y: float
    turned: bool


def pack(sizes: np.ndarray, bed: Bed, gap: float, unit: str = "") -> list[list[PlateSpot]]:
    """Return plates of parts in shelves: the deepest first, each in the first shelf with room.

    Parameters
    ----------
    sizes : (K, 3) of the parts as they lie
    bed : width, depth and height
    gap : between parts

    Raises
    ------
    InputError
        A part does not fit on the bed.
    """
    plates: list[list[PlateSpot]] = []
    shelves: list[list[float]] = []  # plate, y, depth, used width
    depth_used: list[float] = []
    turned = (sizes[:, 0] > bed[0]) | (sizes[:, 1] > bed[1])
    wide, deep = (np.where(turned, sizes[:, 1 - k], sizes[:, k]) for k in (0, 1))
    if (off := np.flatnonzero((wide > bed[0]) | (deep > bed[1]) | (sizes[:, 2] > bed[2]))).size:
        words = " x ".join(f"{side:.4g}" for side in sizes[off[0]])
        raise InputError(
            f"a part of {words}{unit_words(unit)} does not fit on the bed; give a larger --bed or a smaller --scale"
        )
    for part in np.lexsort((np.arange(len(sizes)), -deep)).tolist():
        w, d = float(wide[part]), float(deep[part])
        shelf = next((s for s in shelves if s[2] >= d and s[3] + gap + w <= bed[0]), None)
        if shelf is None:
            plate = next((k for k, used in enumerate(depth_used) if used + gap + d <= bed[1]), len(plates))
            if plate == len(plates):
                plates.append([])
                depth_used.append(-gap)
            shelf = [plate, depth_used[plate] + gap, d, -gap]
            depth_used[plate] += gap + d
            shelves.append(shelf)
        plates[int(shelf[0])].append(PlateSpot(part, shelf[3] + gap, shelf[1], bool(turned[part])))
        shelf[3] += gap + w
    return plates


def lay_out(parts: list[PrintedPart], bed: Bed, gap: float, unit: str) -> list[list[tuple[str, Solid]]]:
    """Return for each plate the names of its parts and their solids, where they lie on the bed."""
    lying = [part.lying() for part in parts]
    sizes = np.array([np.subtract(body.bounding_box()[3:], body.bounding_box()[:3]) for body in lying])
    plates = []
    for places in pack(sizes, bed, gap, unit):
        solids = []
        for place in sorted(places, key=lambda each: each.part):
            part = parts[place.part]
            body = part.lying(place.turned).translate((place.x, place.y, 0.0))
            solids.append((part.name, as_solid(body, unit, 1, part.genus)))
        plates.append(solids)
    return plates


def together(solids: list[Solid]) -> Solid:
    """Return several solids as one, of bodies that do not touch."""
    first = np.cumsum([0, *(len(each.vertices) for each in solids)])
    return replace(
        solids[0],
        vertices=np.concatenate([each.vertices for each in solids]),
        triangles=np.concatenate([each.triangles + k for each, k in zip(solids, first.tolist(), strict=False)]),
        volume=sum(each.volume for each in solids),
        components=sum(each.components for each in solids),
        genus=sum(each.genus for each in solids),
        expected_components=sum(each.expected_components for each in solids),
        expected_genus=sum(each.expected_genus for each in solids),
    )
