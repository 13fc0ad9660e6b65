"""The tables of a schedule: columns with names, units and values."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

Value = str | int | float | None  # what a cell of a schedule holds; None: nothing


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a schedule."""

    name: str
    unit: str  #: mm, m, m2, kg, degree, the unit of the scan, or "" for what has none
    values: tuple[Value, ...]
    summed: bool = False  #: whether its sum means something

    @property
    def head(self) -> str:
        """The name with its unit, as files hold it."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def sum(self) -> Value:
        """Sum of the values; None where it means nothing or nothing is known."""
        known = [value for value in self.values if isinstance(value, int | float)]
        if not self.summed or not known:
            return None
        return sum(known) if all(isinstance(value, int) for value in known) else float(np.sum(known))


def column(name: str, unit: str, values: Iterable[Value] | np.ndarray, *, summed: bool = False) -> Column:
    """Return a column of plain values; NaN becomes None."""
    plain = values.tolist() if isinstance(values, np.ndarray) else list(values)
    return Column(name, unit, tuple(None if value != value else value for value in plain), summed)


@dataclass(frozen=True, eq=False)
class Schedule:
    """One table: a row for each node, member, panel, type, quantity or warning."""

    title: str
    columns: tuple[Column, ...]

    def __len__(self) -> int:
        """Count the rows."""
        return len(self.columns[0].values)

    def __getitem__(self, name: str) -> tuple[Value, ...]:
        """Return the values of a column by its name, without the unit."""
        for each in self.columns:
            if each.name == name:
                return each.values
        raise KeyError(name)

    def __repr__(self) -> str:
        """Say what it is made of, not every number."""
        return f"Schedule({self.title!r}, {len(self):,} rows: {', '.join(each.head for each in self.columns)})"

    @property
    def heads(self) -> list[str]:
        """The names of the columns with their units."""
        return [each.head for each in self.columns]

    @property
    def rows(self) -> list[tuple[Value, ...]]:
        """All rows."""
        return list(zip(*(each.values for each in self.columns), strict=True))


class Workbook(Protocol):
    """What has tables for the sheets of a workbook."""

    @property
    def tables(self) -> list[Schedule]:
        """All tables in the order of the sheets."""


@dataclass(frozen=True, eq=False)
class Schedules:
    """All schedules of a grid; lengths are as built, that is, scaled."""

    nodes: Schedule
    drilling: Schedule  #: the holes of each ball
    members: Schedule
    panels: Schedule
    node_types: Schedule
    panel_types: Schedule
    lengths: Schedule  #: types of members by their cut length
    quantities: Schedule
    warnings: Schedule
    inner_panels: Schedule | None = None  #: of the layers under the grid, where there are any

    @property
    def named(self) -> dict[str, Schedule]:
        """All tables by name."""
        found = {spec.name: getattr(self, spec.name) for spec in fields(self)}
        return {name: table for name, table in found.items() if table is not None}

    @property
    def tables(self) -> list[Schedule]:
        """All tables in the order of the sheets of a workbook."""
        return list(self.named.values())
