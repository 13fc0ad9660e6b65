"""What a report is made of, whatever file it goes to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Frame = tuple[float, float, float, float]  # left, bottom, width, height of a part of a figure


@dataclass(frozen=True)
class Headline:
    """What the report is about, in one line, and a line below it."""

    words: str
    below: str


@dataclass(frozen=True)
class SectionHead:
    """The head of a section."""

    words: str


@dataclass(frozen=True)
class Sentence:
    """A sentence or some."""

    words: str
    warns: bool = False


@dataclass(frozen=True)
class PointList:
    """A list of points."""

    words: tuple[str, ...]


@dataclass(frozen=True)
class Listing:
    """Text as it stands, such as a file."""

    text: str


@dataclass(frozen=True)
class DataTable:
    """A table; the first column is words, those in `words` too, the others are numbers."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: tuple[int, ...] = (0,)
    note: str = ""


@dataclass(frozen=True)
class Illustration:
    """A picture: what draws it into a place of a figure, and the height over the width."""

    caption: str
    draw: Callable[[Any, Frame], None]
    tall: float = 0.62


ReportPart = Headline | SectionHead | Sentence | PointList | Listing | DataTable | Illustration
