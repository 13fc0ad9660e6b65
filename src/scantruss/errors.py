"""The tree of errors.

ScanTrussError
    InputError     data or a setting cannot be used (also a ValueError)
    FrontError     the front stopped early; has .grid, what was reached, and .where
      CertificateError   a whole grid that does not pass; .grid has its certificate
    FormatError    a file cannot be read or written

A message says what was got, what is needed and what to do, in one line.
"""

from __future__ import annotations

from typing import Any


class ScanTrussError(Exception):
    """Anything that ScanTruss refuses, in words."""


class InputError(ScanTrussError, ValueError):
    """Data or a setting cannot be used."""


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


class CertificateError(FrontError):
    """A grid has come out that fails its certificate."""


class FormatError(ScanTrussError):
    """A file cannot be read or written."""
