"""The tree of errors.

ScanTrussError
    InputError     data or a setting cannot be used (also a ValueError)
      LengthError      the member length cannot be used with this scan
      LinesError       at this member length the points lie along lines
      OneSidedError    the surface has one side, as a Moebius strip
    FrontError     the front stopped early; has .grid, what was reached, and .where
      CertificateError   a whole grid that does not pass; .grid has its certificate
    FormatError    a file cannot be read or written

A message says what was got, what is needed and what to do, in one line.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import cached_property
from typing import Any


class ScanTrussError(Exception):
    """Anything that ScanTruss refuses, in words."""


class InputError(ScanTrussError, ValueError):
    """Data or a setting cannot be used."""


class LengthError(InputError):
    """A member length cannot be used with this scan."""


class LinesError(InputError):
    """At this member length the points lie along lines, not on a surface.

    Attributes
    ----------
    lines : int
        How many lines there are that are apart.
    """

    def __init__(self, message: str, lines: int) -> None:
        super().__init__(message)
        self.lines = lines


class OneSidedError(InputError):
    """The scanned surface is one-sided, or so rough that it looks so."""


class FrontError(ScanTrussError):
    """The front stopped early.

    Attributes
    ----------
    grid : Grid or None
        What was reached.
    where : tuple of float or None
        A place in the scan's own frame where it stopped [scan unit].
    """

    def __init__(self, message: str, grid: Any = None, where: tuple[float, float, float] | None = None) -> None:
        super().__init__(message)
        self.grid = grid
        self.where = where


MOST_WRITTEN_OUT = 1e9  # size from which a number is written with a power of ten
Place = tuple[float, float, float]  #: x, y, z in the frame of the scan [scan unit]


def words_of_place(where: Iterable[float]) -> str:
    """Return the coordinates of a place for a message: national-grid ones too to a thousandth."""
    return ", ".join(f"{c:.6g}" if abs(c) < 1000.0 else f"{c:.3f}".rstrip("0").rstrip(".") for c in where)


def words_of_number(value: float, digits: int) -> str:
    """Return a number with so many digits for a reader: 1,440, where a format alone would say 1.44e+03."""
    short = f"{value:.{digits}g}"
    rounded = float(short)
    if abs(rounded) >= MOST_WRITTEN_OUT or (abs(rounded) < 1000.0 and "e+" not in short):
        return short
    return f"{rounded:,.0f}" if rounded.is_integer() else f"{rounded:,}"


def words_of_share(share: float) -> str:
    """Return a share in percent with two digits; one that rounds to none is not said to be none."""
    return "less than 0.01%" if 0.0 < share < 0.00005 else f"{share:.2%}"


def words_of_count(count: int, name: str) -> str:
    """Return how many there are of something that is called `name`, or `name` with an s where they are not one."""
    return f"{count:,} {name}{'s' * (count != 1)}"


def decimal_comma_words(text: str) -> str:
    """Return what to write in place of a number with a decimal comma, to follow what is needed; nothing for any other text."""
    text = text.strip()
    return f"; write {text.replace(',', '.')} with a point, not {text}" if re.fullmatch(r"[-+]?\d*,\d+", text) else ""


def unit_words(unit: str, power: int = 1) -> str:
    """Return what follows a number with a unit: " m", " m³"; nothing where the unit is not known."""
    return f" {unit}{'³' if power == 3 else ''}" if unit else ""


class CertificateError(FrontError):
    """A grid has come out that fails its certificate.

    While others are tried the certificate says only what is wrong with the grid; `whole` has all that it says.
    """

    def __init__(
        self,
        message: str,
        grid: Any = None,
        where: tuple[float, float, float] | None = None,
        complete: Callable[[], CertificateError] | None = None,
    ) -> None:
        super().__init__(message, grid, where)
        self._complete = complete

    @cached_property
    def whole(self) -> CertificateError:
        """The same with the whole certificate, which is made when it is first asked for."""
        return self if self._complete is None else self._complete()


class FormatError(ScanTrussError):
    """A file cannot be read or written."""


def how_to_install(extra: str) -> str:
    """Return the command that installs an extra; it is of a clone, as the package is on no index."""
    return f"uv sync --extra {extra} (in the clone)"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return " (did you mean X?)" with the most similar of the words that are known; "" where none is similar."""
    from difflib import get_close_matches  # not needed where no name is wrong

    near = get_close_matches(word, list(known), 1, 0.7)
    return f" (did you mean {near[0]}?)" if near else ""


def words_of_error(error: ScanTrussError) -> str:
    """Return what an error says, with its place where it has one."""
    where = error.where if isinstance(error, FrontError) else None
    return str(error) if where is None else f"{error} (near {words_of_place(where)})"
