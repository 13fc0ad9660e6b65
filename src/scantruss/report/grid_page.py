"""The report of a grid as one page: 3D view, certificate, tables, plots, settings."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import words_of_number
from ..export.formats import model_of
from ..export.page import encode_page
from ..export.page_tables import OFF_PLANE, PageColumn, Tables, tables_of
from ..export.style import FileStyle
from ..grid.grid import Grid
from ..scan.cloud import PointCloud
from .figures import certificate_rows, first_line, grid_lines, quality_rows, warning_lines
from .structural.charts import chart_axes
from .structural.html import encode_html
from .structural.parts import (
    DataTable,
    Frame,
    Headline,
    Illustration,
    Listing,
    PointList,
    ReportPart,
    SectionHead,
    Sentence,
)

LISTED_WORST = 10  #: members or panels of a table of the worst
HISTOGRAM_BARS = 30  #: of a plot
HISTOGRAM_TALL = 0.3  #: height of a plot over its width
PLOTTED = (  # kind, column, words; those that are not known are left out
    ("members", "length", "member length"),
    ("members", "length / desired", "length over the desired length"),
    ("panels", "quality", "quality of panels, 1 regular"),
    ("panels", OFF_PLANE, "panels off their plane, over the mean diagonal"),
    ("members", "fold", "angle between the panels, 180 where level"),
    ("nodes", "distance from scan", "distance of nodes from the scan"),
)


def encode_grid_report(grid: Grid, cloud: PointCloud, command: str) -> bytes:
    """Return the report of a grid as HTML.

    Parameters
    ----------
    command : str
        The command line that made it.
    """
    model = model_of(grid, cloud=cloud)
    return encode_html(list(_parts(grid, cloud, tables_of(model), command)), encode_page(model, FileStyle()))


def _parts(grid: Grid, cloud: PointCloud, tables: Tables, command: str) -> Iterator[ReportPart]:
    unit = f" {grid.unit}" if grid.unit else ""
    yield Headline(
        f"Grid of {Path(cloud.name).name or 'a scan'}",
        f"{len(grid.nodes):,} nodes, {len(grid.edges):,} members, {grid.lengths.sum():,.5g}{unit} of them in all",
    )
    if (certificate := grid.certificate) is not None:
        yield SectionHead("Certificate")
        yield Sentence(str(certificate), warns=not certificate.passed)
        for words in first_line(certificate):
            yield Sentence(words)
        for words in warning_lines(certificate):
            yield Sentence(words, warns=True)
        yield DataTable(("worst", "", "at"), tuple(certificate_rows(certificate)), words=(0, 2))
    yield SectionHead("Figures")
    yield DataTable(("", "before", "after optimization"), tuple(quality_rows(grid)))
    lines = grid_lines(grid, len(cloud.points))
    yield PointList(tuple(words for words in lines if not words.startswith(("certificate:", "warning:"))))
    yield SectionHead("Plots")
    for kind, name, words in PLOTTED:
        column = _column(tables, kind, name)
        if column is not None and any(value is not None for value in column.values):
            across = f"{words} [{column.unit}]" if column.unit else words
            values = np.array([value for value in column.values if value is not None], float)
            draw = partial(_draw_histogram, values=values, across=across, up=kind)
            yield Illustration(f"{len(values):,} {kind} by {words}", draw, HISTOGRAM_TALL)
    yield from _worst(tables, "members", "length")
    yield from _worst(tables, "panels", "quality")
    yield SectionHead("To make it again")
    yield Listing(command)
    if grid.settings is not None:
        yield Listing(json.dumps(grid.settings.to_dict(), indent=1, ensure_ascii=False))


def _column(tables: Tables, kind: str, name: str) -> PageColumn | None:
    return next((each for each in tables[kind] if each.name == name), None)


def _worst(tables: Tables, kind: str, name: str) -> Iterator[ReportPart]:
    """Yield the schedule rows of the members or panels with the least and, of lengths, the greatest values."""
    column = _column(tables, kind, name)
    if column is None or not column.values:
        return
    order = np.argsort(np.array(column.values, float), kind="stable")
    least = order[:LISTED_WORST]
    chosen = least if name == "quality" else np.concatenate([least, order[len(least) :][-LISTED_WORST:]])
    shown = tables[kind]
    head = tuple(f"{each.name} [{each.unit}]" if each.unit else each.name for each in shown)
    rows = tuple(tuple(_cell(each.values[k]) for each in shown) for k in chosen.tolist())
    texts = tuple(k for k, each in enumerate(shown) if each.values and isinstance(each.values[0], str))
    words = f"{kind.capitalize()} of the least {name}" + ("" if name == "quality" else f" and the greatest {name}")
    yield SectionHead(words)
    yield DataTable(head, rows, words=texts)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return words_of_number(value, 5) if isinstance(value, float) else str(value)


def _draw_histogram(figure: Any, place: Frame, *, values: np.ndarray, across: str, up: str) -> None:
    axes = chart_axes(figure, place, across, up, whole=False)
    axes.hist(values, HISTOGRAM_BARS, color=(0.345, 0.525, 0.620))
    axes.spines[["right"]].set_visible(False)
