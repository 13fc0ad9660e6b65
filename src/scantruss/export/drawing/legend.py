"""What is written into a picture: figures, a scale bar, what colours mean, and marks at the places to look at."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from textwrap import wrap
from typing import NamedTuple

import numpy as np

from ...errors import Place, words_of_number
from ...grid.grid import Grid
from .camera import Camera
from .strokes import INK_COLOUR

FAULT_COLOUR, WARNING_SIGN_COLOUR = np.array([0.78, 0.05, 0.10]), np.array([0.80, 0.45, 0.00])  # colours of marks
MOST_MARKS = 5  # marks of a kind in a picture
# of a legend: from line to line, of a sign, of a letter on average at most [em]
LEGEND_LINE, LEGEND_SIGN, LEGEND_LETTER = 1.6, 1.4, 0.62
LONGEST_COLUMN = 10  # lines of a column of a legend; a longer legend may have up to three
# share of the width and height of a picture that is left to the grid however long the legend is
LEAST_LEFT_BY_LEGEND = 0.2
BAR_SHARE = 0.18  # largest share of the width that a scale bar takes
UNPLACED_SIGN = "!"  # before the words of a fault or warning that is marked at no place
RING_SIZE, SMALL_RING_SIZE = 1.6, 0.8  # diameters of a ring at the worst place of a kind, and at further ones [em]
NUMBER_TURNS = (0.65, -0.65, 2.5, -2.5, 1.57, -1.57, 0.0, 3.14)  # directions in which a number may stand beside a ring
NEAR_NUMBER = 1.6  # distance of a small ring from its number beside another ring, that stands for both [em]
LEAST_APART = 0.9  # between two numbers, and between a number and a ring of another place [em]


class Text(NamedTuple):
    """Words in a picture."""

    x: float  #: [pixel]
    y: float  #: [pixel]
    words: str
    size: float  #: [pixel]
    align: str = "center"
    colour: np.ndarray = INK_COLOUR  #: (3,)
    over: bool = False  #: it is written over what is shown, and has an edge of paper


class Row(NamedTuple):
    """A line of a legend."""

    words: str
    sign: str = ""  #: before them; without it the line is a heading or a remark
    colour: np.ndarray = INK_COLOUR  #: (3,) of the sign, or of a line without one
    goes_on: bool = False  #: with the words of the line above


@dataclass(frozen=True, eq=False)
class Legend:
    """What colours and numbers mean, from the upper left corner of a picture downwards."""

    rows: list[Row]
    corner: tuple[float, float]  #: (x, y) of the first line [pixel]
    em: float  #: height of the letters [pixel]
    number: int = 1  #: of columns
    apart: float = 0.0  #: from column to column [pixel]

    @property
    def columns(self) -> list[list[Row]]:
        """The lines of each column."""
        made: list[list[Row]] = [[]]
        for row in self.rows:
            if len(made[-1]) >= len(self.rows) / self.number and not row.goes_on:
                made.append([])
            made[-1].append(row)
        return made

    @property
    def texts(self) -> list[Text]:
        """The legend as words in the picture."""
        em, texts = self.em, []
        for column, rows in enumerate(self.columns):
            x = self.corner[0] + column * self.apart
            for line, row in enumerate(rows):
                at = self.corner[1] - line * LEGEND_LINE * em
                words = Text(x + signs_wide(self.rows) * em, at, row.words, em, "left")
                texts += [Text(x, at, row.sign, em, "left", row.colour), words] if row.sign else []
                texts += [] if row.sign else [Text(x, at, row.words, em, "left", row.colour)]
        return texts

    def boxes_beside(
        self, box: tuple[float, float, float, float], *, alone: bool
    ) -> list[tuple[float, float, float, float]]:
        """Return the parts of a box (left, bottom, right, top) [pixel] below the legend, and beside one column if that view is `alone`."""
        if not self.rows:
            return [box]
        left, bottom, right, top = box
        wide = signs_wide(self.rows) + LEGEND_LETTER * max(len(row.words) for row in self.rows)
        end = self.corner[1] - (max(map(len, self.columns)) * LEGEND_LINE + 0.4) * self.em
        below = (left, bottom, right, max(min(top, end), bottom + LEAST_LEFT_BY_LEGEND * (top - bottom)))
        beside = (self.corner[0] + (wide + 2.0) * self.em, bottom, right, top)
        fits = alone and self.number == 1 and right - beside[0] > LEAST_LEFT_BY_LEGEND * (right - left)
        return [below, beside] if fits else [below]


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
    kind: str = ""  #: of the fault or warning


def signs_wide(rows: Iterable[Row]) -> float:
    """Return from how far on the words of a legend stand, beside its longest sign [em]."""
    return LEGEND_SIGN + LEGEND_LETTER * max((len(row.sign) - 1 for row in rows if row.sign), default=0)


def wrapped_rows(rows: Iterable[Row], wide: float, em: float) -> list[Row]:
    """Return the rows of a legend in lines no wider than a picture [pixel]; further lines of a row stand below its words."""
    given, lines = list(rows), []
    most = max(int((wide / em - signs_wide(given)) / LEGEND_LETTER), 20)
    for row in given:
        first, *more = wrap(row.words, most) or [""]
        below = row.sign and " "
        lines += [row._replace(words=first), *(Row(words, below, row.colour, True) for words in more)]
    return lines


def legends(rows: Iterable[Row], wide: float, corner: tuple[float, float], em: float) -> list[Legend]:
    """Return a legend in one column, and a long one also in two and three, as the grid may then have more room."""
    given, made = list(rows), []
    for number in (1, 2, 3):
        apart = wide / number
        lines = wrapped_rows(given, apart - (2 * em if number > 1 else 0), em)
        made.append(Legend(lines, corner, em, number, apart))
        if len(lines) <= number * LONGEST_COLUMN:
            break
    return made


def places_marked(grid: Grid) -> list[Mark]:
    """Return the places of faults and warnings; where there are none, the worst members and the worst angle."""
    found = grid.certificate
    if found is None:
        return []
    marks = []
    for kind, colour in ((found.faults, FAULT_COLOUR), (found.warnings, WARNING_SIGN_COLOUR)):
        placed = [
            Mark(fault.words, fault.where, colour, fault.also, fault.kind) for fault in kind if fault.where is not None
        ]
        marks += placed[:MOST_MARKS]
    warned = {mark.where for mark in marks}
    unit = f" {grid.unit}" if grid.unit else ""
    marks += [
        Mark(f"{part.words}, {words_of_number(part.size or 0.0, 3)}{unit} across", part.where, INK_COLOUR)
        for part in found.left_out
        if part.kind in ("hole", "gap") and part.where is not None and part.where not in warned
    ]
    worst = (
        ("shortest member", found.shortest_member, unit),
        ("longest member", found.longest_member, unit),
        ("smallest angle", found.smallest_angle, " degrees"),
    )
    return marks or [
        Mark(f"{name}, {words_of_number(figure.value, 3)}{words}", figure.where, INK_COLOUR)
        for name, figure, words in worst
        if figure
    ]


def rows_of_marks(grid: Grid) -> list[Row]:
    """Return what the numbers in a picture mean, then the faults and warnings that no number stands for: nothing is left out."""
    marks, found = places_marked(grid), grid.certificate
    rows = [Row(mark.words, str(number), mark.colour) for number, mark in enumerate(marks, 1)]
    marked = {(mark.words, mark.where) for mark in marks}
    for kind, colour in () if found is None else ((found.faults, FAULT_COLOUR), (found.warnings, WARNING_SIGN_COLOUR)):
        rows += [Row(each.words, UNPLACED_SIGN, colour) for each in kind if (each.words, each.where) not in marked]
    return rows


def rings_and_numbers(
    grid: Grid, camera: Camera, em: float, explained: Collection[str]
) -> tuple[list[Ring], list[Text]]:
    """Return a ring at each place of which the number is explained, small at further places of a kind, and its number beside each.

    Small rings that lie together share a number.
    """
    rings: list[Ring] = []
    words: list[str] = []
    for number, mark in enumerate(places_marked(grid), 1):
        if str(number) not in explained:
            continue
        flat, _ = camera.project(np.array([mark.where, *mark.also]) - grid.origin)
        sizes = [RING_SIZE * em, *[SMALL_RING_SIZE * em] * len(mark.also)]
        rings += [Ring(x, y, size, mark.colour) for (x, y), size in zip(flat.tolist(), sizes, strict=True)]
        words += [str(number)] * len(flat)
    texts: list[Text] = []
    for ring, word in zip(rings, words, strict=True):
        small = ring.size < RING_SIZE * em
        near = [text for text in texts if math.hypot(text.x - ring.x, text.y - ring.y) < NEAR_NUMBER * em]
        if small and any(text.words == word for text in near):
            continue
        x, y = _beside(ring, rings, texts, em)
        texts.append(Text(x, y, word, (0.8 if small else 1.0) * em, colour=ring.colour, over=True))
    return rings, texts


def _beside(ring: Ring, rings: list[Ring], texts: list[Text], em: float) -> tuple[float, float]:
    """Return where the number of a ring stands: the first place beside it that is free, else the freest."""
    taken = np.array([(text.x, text.y, 0.0) for text in texts] + [(r.x, r.y, 0.5 * r.size) for r in rings])
    best, most = (ring.x, ring.y), -math.inf
    for turn in NUMBER_TURNS:
        away = 0.5 * ring.size + 0.75 * em
        x, y = ring.x + away * math.cos(turn), ring.y + away * math.sin(turn)
        free = float((np.hypot(taken[:, 0] - x, taken[:, 1] - y) - taken[:, 2]).min())
        if free >= LEAST_APART * em:
            return x, y
        if free > most:
            best, most = (x, y), free
    return best


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
