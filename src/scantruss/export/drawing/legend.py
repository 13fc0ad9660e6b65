"""What is written into a picture: figures, a scale bar, what colours mean, and marks at the places to look at."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...errors import Place
from ...grid.grid import Grid
from .camera import Camera
from .strokes import INK

FAULT, WARNING = np.array([0.78, 0.05, 0.10]), np.array([0.80, 0.45, 0.00])  # colours of marks
MOST_MARKS = 5  # marks of a kind in a picture
BAR_SHARE = 0.18  # largest share of the width that a scale bar takes


class Text(NamedTuple):
    """Words in a picture."""

    x: float  #: [pixel]
    y: float  #: [pixel]
    words: str
    size: float  #: [pixel]
    align: str = "center"
    colour: np.ndarray = INK  #: (3,)


@dataclass(frozen=True, eq=False)
class Ring:
    """A ring around a place to look at."""

    x: float  #: [pixel]
    y: float  #: [pixel]
    size: float  #: diameter [pixel]
    colour: np.ndarray  #: (3,)


@dataclass(frozen=True, eq=False)
class Mark:
    """A place to look at, and why."""

    words: str
    where: Place  #: in the scan's own frame
    colour: np.ndarray  #: (3,)
    also: tuple[Place, ...] = ()  #: more such places


def marks_of(grid: Grid) -> list[Mark]:
    """Return the places of faults and warnings; where there are none, the worst members and the worst angle."""
    found = grid.certificate
    if found is None:
        return []
    marks = []
    for kind, colour in ((found.faults, FAULT), (found.warnings, WARNING)):
        placed = [Mark(fault.words, fault.where, colour, fault.also) for fault in kind if fault.where is not None]
        marks += placed[:MOST_MARKS]
    unit = f" {grid.unit}" if grid.unit else ""
    marks += [
        Mark(f"{part.words}, {part.size:.3g}{unit} across", part.where, INK)
        for part in found.left_out
        if part.kind == "hole" and part.where is not None
    ]
    worst = (
        ("shortest member", found.shortest_member, unit),
        ("longest member", found.longest_member, unit),
        ("smallest angle", found.smallest_angle, " degrees"),
    )
    return marks or [
        Mark(f"{name}, {figure.value:.3g}{words}", figure.where, INK) for name, figure, words in worst if figure
    ]


def round_bar(longest: float) -> float:
    """Return the longest of 1, 2 and 5 times a power of ten that is no longer than this."""
    if not longest > 0.0:
        return 0.0
    power = 10.0 ** math.floor(math.log10(longest))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= longest * (1 + 1e-9))


def scale_bar(camera: Camera, right: float, y: float, wide: float, unit: str, em: float) -> tuple[np.ndarray, Text]:
    """Return the corners (4, 2) of a scale bar's line and its words; it ends at `right` in a picture so `wide` [pixel].

    It holds at the middle of what is shown; what is nearer looks larger.
    """
    length = round_bar(BAR_SHARE * wide / camera.zoom)
    left, tick = right - length * camera.zoom, 0.35 * em
    line = np.array([[left, y + tick], [left, y], [right, y], [right, y + tick]])
    return line, Text((left + right) / 2, y + 0.8 * em, f"{length:g} {unit}".rstrip(), 0.9 * em)
