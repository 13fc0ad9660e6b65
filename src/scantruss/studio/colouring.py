"""By what designs are coloured: one scale, one legend, for all that are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..export.page_tables import PageColumn, Tables, colorings_of
from ..settings import UNITS
from .colours import colors_of, legend_of, legend_of_names, marked, rgb_of, values_of

if TYPE_CHECKING:
    from ..export.model import Model
    from .legend import ColourLegend

PLAIN_GRID, BY_LENGTH, BY_SECTION = "plain", "member length", "section"


@dataclass(frozen=True, eq=False)
class DrawnDesign:
    """A grid or a structure that is drawn."""

    model: Model
    tables: Tables
    unit_of_scan: float  #: one scan unit in that of the model
    scan_unit: str

    def column(self, choice: dict[str, Any]) -> PageColumn:
        """Return the column of a colouring that it has."""
        return next(one for one in self.tables[choice["kind"]] if one.name == choice["name"])

    def values(self, choice: dict[str, Any]) -> np.ndarray:
        """Return the values of a colouring that it has (N,), numbers from 1 of what has names."""
        column, names = self.column(choice), choice.get("names")
        return values_of(column) if names is None else 1.0 + np.array([names.index(each) for each in column.values])

    def unit_in(self, choice: dict[str, Any], first: DrawnDesign) -> float | None:
        """Return the unit of a colouring in that of another design, None if there is no ratio between them; lengths as drawn."""
        if choice["words"] == BY_LENGTH:  # a structure has its own unit and scale
            ratio = _ratio(self.scan_unit, first.scan_unit)
            return None if ratio is None else ratio * first.unit_of_scan / self.unit_of_scan
        return _ratio(self.column(choice).unit, first.column(choice).unit)


@dataclass(frozen=True, eq=False)
class SharedScale:
    """The colours of one colouring of some designs, the first of which says in which unit."""

    choice: dict[str, Any]
    unit: str
    of_designs: tuple[np.ndarray, ...]  #: values (N,) of each design

    @classmethod
    def of(cls, choice: dict[str, Any], designs: Sequence[DrawnDesign]) -> SharedScale:
        """Return the scale of designs that all have a colouring, in the unit of the first."""
        first = designs[0]
        values = [each.values(choice) * (each.unit_in(choice, first) or 1.0) for each in designs]
        return cls(choice, first.column(choice).unit, tuple(values))

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the greatest value, of a scale to both sides as far from its middle."""
        _, low, high = colors_of(np.concatenate(self.of_designs), self.choice.get("middle"))
        return low, high

    @property
    def shown_ends(self) -> tuple[float, float]:
        """What the ends of the colours stand for: what is too much has a colour of its own."""
        (low, high), (most, _) = self.ends, self._most
        return (min(low, most), most) if high > most else (low, high)

    @property
    def _most(self) -> tuple[float, str]:
        most, color = self.choice.get("most", (np.inf, ""))
        return float(most), str(color)

    def colors(self, values: np.ndarray) -> np.ndarray:
        """Return the colours (N, 3) uint8 of values (N,)."""
        own, _, _ = colors_of(values, self.choice.get("middle"), self.shown_ends)
        return marked(own, values, *self._most)

    def legend(self, words: str = "") -> ColourLegend:
        """Return the legend; `words` say of what it is, where it is not of all that is drawn."""
        title, (most, color) = f"{words}{self.choice['words']}", self._most
        if "names" in self.choice:
            return legend_of_names(title, self.choice["names"], *self.of_designs)
        legend = legend_of(title, self.unit, *self.shown_ends, "middle" in self.choice)
        return legend.with_mark(rgb_of(color), f"more than {most:g}") if self.ends[1] > most else legend


def choices_of(designs: Sequence[DrawnDesign]) -> dict[str, dict[str, Any]]:
    """Return the colourings that all designs have, in units that can be compared, by their words."""
    found = [{one["words"]: one for one in colorings_of(each.tables)} for each in designs]
    choices = {
        words: one
        for words, one in (found[0].items() if found else ())
        if all(words in each for each in found) and all(each.unit_in(one, designs[0]) is not None for each in designs)
    }
    trusses = [each.model.truss for each in designs if each.model.truss is not None]
    if trusses and len(trusses) == len(designs):
        sections = sorted((one for truss in trusses for one in truss.sections), key=lambda one: one.area)
        names = tuple(dict.fromkeys(one.name for one in sections))
        choices[BY_SECTION] = {"kind": "members", "name": "section", "words": BY_SECTION, "names": names}
    return choices


def _ratio(unit: str, other: str) -> float | None:
    """Return a unit in another one; None if either is none of length and they are not the same."""
    if unit == other:
        return 1.0
    metres, of_other = UNITS.get(unit), UNITS.get(other)
    return metres / of_other if metres and of_other else None
