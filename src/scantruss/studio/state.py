"""What a studio works on, as one record that never changes, and the steps that led to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..grid.grid import Grid
from ..layouts.trade import Traded
from ..scan.cloud import PointCloud
from ..settings import Settings
from ..structure.options import StructureSettings
from ..structure.report import StructureReport
from ..structure.results import Solution
from .scan_parts import Cleaning, WholeScan, taken_of_scan

MOST_UNDONE = 200  #: that can be taken back
NO_LENGTH = Settings(length=1.0)  #: of a studio without a scan
Placed = tuple[tuple[str, tuple[float, float, float]], ...]
"""Marks of nodes and their places in the frame of the scan [scan unit]."""
DEFAULT_STRUCTURE = StructureSettings(supports="boundary", loads=("self", "snow:1kN/m2"), frequencies=3)


@dataclass(frozen=True, eq=False)
class Design:
    """A grid that is kept for comparison."""

    name: str
    grid: Grid
    figures: tuple[tuple[str, str], ...] = ()  #: of its structure, in words
    cloud: PointCloud | None = None  #: of which it was made; None where that is not known any more
    asked: Settings | None = None  #: with which it was asked for
    unpainted: float = 1.0  #: see `StudioState`
    is_live: bool = False  #: whether it is a quick one
    solved_with: StructureSettings | None = None  #: with which a structure was made of it, which is drawn
    solution: Solution | None = None  #: of that; None where it has to be solved again, as of a project that was opened
    report: StructureReport | None = None


@dataclass(frozen=True, eq=False)
class Trade:
    """What the numbers of lengths or kinds of a grid cost."""

    before: Grid
    parts: str  #: of `scantruss.grid.alike`
    traded: tuple[Traded, ...]  #: the most lengths or kinds first
    off_scan: float  #: farthest node of the grid before off the scan, over its mean member

    def with_at_most(self, number: int) -> Traded:
        """Return the most lengths or kinds that are no more than a number; the fewest where all are more."""
        return next((each for each in self.traded if each.number <= number), self.traded[-1])


@dataclass(frozen=True, eq=False)
class StudioState:
    """What a studio works on."""

    cloud: PointCloud | None = None
    opened: int = 0  #: how many scans and projects were opened before it and with it; each has a project file
    settings: Settings = NO_LENGTH
    unpainted: float = 1.0  #: length of members where no other is painted, over the shortest that is painted
    grid: Grid | None = None
    asked: Settings | None = None  #: with which the grid was asked for; its own say what was done to get it
    trade: Trade | None = None  #: of the grid, or of the one that it was made of
    is_live: bool = False  #: whether the grid is a quick one, made while the length was chosen
    structure_settings: StructureSettings = DEFAULT_STRUCTURE
    support_places: Placed = ()  #: of the nodes that its supports name
    solution: Solution | None = None
    solved_with: StructureSettings | None = None  #: with which it was solved
    report: StructureReport | None = None
    designs: tuple[Design, ...] = ()
    whole: WholeScan | None = None  #: as it was opened; `cloud` is what is taken of it
    cleaning: Cleaning | None = None  #: what was cleaned last
    removed: np.ndarray | None = None  #: (N,) bool, points of the whole scan that were removed by hand
    tape: tuple[
        tuple[float, ...], ...
    ] = ()  #: both ends of what was measured last, in the frame of the scan [scan unit]

    @property
    def is_of_file(self) -> bool:
        """Whether options make of its file what is taken of the scan: none removes points by hand, or turns it."""
        return self.removed is None and (self.whole is None or self.whole.up == "z")

    def taken(self) -> np.ndarray:
        """Return which points of the whole scan are taken (N,)."""
        assert self.whole is not None
        return taken_of_scan(self.whole, self.settings, self.cleaning, self.removed)

    def cropped_off(self) -> np.ndarray:
        """Return which points of the whole scan nothing but the crop leaves out (N,)."""
        assert self.whole is not None
        all_of_it = self.settings.replace(crop=())
        return taken_of_scan(self.whole, all_of_it, self.cleaning, self.removed) & ~self.taken()

    @property
    def main_length(self) -> float:
        """Return the length of members where no other is painted [scan unit]."""
        return self.settings.length * (self.unpainted if self.settings.length_field else 1.0)

    def with_main_length(self, length: float) -> Settings:
        """Return the settings with another length of members where none is painted; painted ones change with it."""
        return self.settings.replace(length=length * self.settings.length / self.main_length)

    @property
    def shown_structure(self) -> StructureSettings:
        """Return the settings of the structure that is shown, of the next one where none is."""
        return self.structure_settings if self.solution is None or self.solved_with is None else self.solved_with

    @property
    def is_structure_stale(self) -> bool:
        """Whether settings have changed since the structure was solved."""
        return self.solution is not None and self.shown_structure != self.structure_settings

    @property
    def is_stale(self) -> bool:
        """Whether settings have changed since the grid was made."""
        return self.grid is not None and self.asked is not None and self.asked != self.settings


NO_GRID: dict[str, Any] = {
    "grid": None, "trade": None, "asked": None, "is_live": False, "solution": None, "report": None
}  # fmt: skip
"""Changes of a state without its grid, as of a scan that is another now."""


class History:
    """The states before the present one, and those that were taken back."""

    def __init__(self) -> None:
        self._past: list[tuple[str, StudioState]] = []
        self._future: list[tuple[str, StudioState]] = []

    def note(self, words: str, state: StudioState, *, goes_on: bool = False) -> None:
        """Keep the state before a step; one that goes on with the same step needs none."""
        if not (goes_on and self._past and self._past[-1][0] == words and not self._future):
            self._past = [*self._past[-MOST_UNDONE + 1 :], (words, state)]
        self._future = []

    def undo(self, now: StudioState) -> StudioState | None:
        """Return the state before the last step; None where there is none."""
        if not self._past:
            return None
        words, before = self._past.pop()
        self._future.append((words, now))
        return before

    def redo(self, now: StudioState) -> StudioState | None:
        """Return the state after the step that was taken back last; None where there is none."""
        if not self._future:
            return None
        words, after = self._future.pop()
        self._past.append((words, now))
        return after

    @property
    def words(self) -> tuple[str, str]:
        """The steps that undo and redo would take; "" where there is none."""
        return (self._past[-1][0] if self._past else "", self._future[-1][0] if self._future else "")
