"""Designs side by side: their figures, and how far one lies from another."""

from __future__ import annotations

import contextlib
import weakref
from html import escape
from typing import Any

import numpy as np

from ..check.distances import distances_to_grid
from ..errors import InputError, words_of_number
from ..export.formats import model_of
from ..export.page_tables import tables_of
from ..grid.grid import Grid
from ..structure.build import scale_of
from ..structure.checks import use_words
from .colouring import DrawnDesign
from .layers_tool import figures_of_layers
from .solving import solved_state
from .state import NO_GRID, Design, StudioState
from .support_places import supports_on

NO_DISTANCE = 1e-9  #: distance that is none [mean member length]
LONGEST_NAME = 40  #: of a design [letters]


def kept_design(state: StudioState, name: str) -> Design:
    """Return the grid of a state as a design.

    Raises
    ------
    InputError
        There is no grid, or no name.
    """
    name = " ".join(name.split())
    if state.grid is None:
        raise InputError("there is no grid yet; press Generate")
    if not 0 < len(name) <= LONGEST_NAME:
        raise InputError(f"a design needs a name of 1 to {LONGEST_NAME} letters")
    return Design(
        name,
        state.grid,
        tuple(structure_figures(state)),
        state.cloud,
        state.asked,
        state.unpainted,
        state.is_live,
        None if state.solution is None else state.shown_structure,
        state.solution,
        state.report,
    )


def drawn_design(design: Design) -> DrawnDesign:
    """Return what is drawn of a design: its structure, solved again where it came with a project, else its grid."""
    if design not in _DRAWN:
        grid, asked, solution, report = design.grid, design.solved_with, design.solution, design.report
        if asked is not None and solution is None:
            again = StudioState(grid=grid, structure_settings=asked.replace(buckling=0, frequencies=0))
            with contextlib.suppress(InputError):
                solved = solved_state(again)
                solution, report = solved.solution, solved.report
        if solution is None or asked is None:
            model, unit_of_scan = model_of(grid), 1.0
        else:
            model, unit_of_scan = model_of(solution, report=report), scale_of(grid.unit or asked.unit, asked.scale)
        _DRAWN[design] = DrawnDesign(model, tables_of(model, grid), unit_of_scan, grid.unit)
    return _DRAWN[design]


_DRAWN: weakref.WeakKeyDictionary[Design, DrawnDesign] = weakref.WeakKeyDictionary()


def taken_design(state: StudioState, name: str) -> dict[str, Any]:
    """Return the changes of a state by which a kept design is the present one.

    Raises
    ------
    InputError
        There is none of that name, or it is of another scan.
    """
    design = next((each for each in state.designs if each.name == name), None)
    if design is None:
        raise InputError('no design is chosen; choose one in "beside"')
    if design.cloud is None or design.cloud is not state.cloud or design.asked is None:
        raise InputError(
            f"{name} was made of another scan or of another part of it; it can be compared, but not be taken"
        )
    made = {"grid": design.grid, "asked": design.asked, "settings": design.asked, "unpainted": design.unpainted}
    return NO_GRID | made | {"is_live": design.is_live} | supports_on(state, design.grid)


def structure_figures(state: StudioState) -> list[tuple[str, str]]:
    """Return the greatest figures of the structure of a state, in words; none where there is none."""
    report = state.report
    if report is None:
        return []
    values = report.to_dict()
    service = [case for case in report.cases if case.state == "SLS"] or report.cases
    moves = max(service, key=lambda case: case.displacement_max)
    used, asked = values["utilization_max"], state.shown_structure
    rows = [
        ("supports", f"{asked.supports}, {asked.support_type}"),
        ("section", f"{asked.section} {asked.material}"),
        ("loads", ", ".join(map(str, asked.loads))),
        ("utilization", use_words(used)),
        ("displacement", f"{words_of_number(1e3 * moves.displacement_max, 3)} mm under {moves.name}"),
        ("axial forces", f"{values['force_min'] / 1e3:.4g} to {values['force_max'] / 1e3:.4g} kN"),
        ("mass without nodes", f"{report.truss.mass:,.0f} kg"),
    ]
    rows += figures_of_layers(report.truss)
    if report.rounds:
        rows.append(("sections", " ".join(values["sections"])))
    if report.buckling is not None and len(report.buckling.values):
        rows.append(("lowest buckling factor", f"{report.buckling.values[0]:.3g}, {report.buckling.of}"))
    elif report.buckling is None:
        rows.append(("lowest buckling factor", "not looked at; set buckling modes to 1"))
    if report.vibration is not None and len(report.vibration.values):
        rows.append(("lowest frequency", f"{report.vibration.values[0]:.3g} Hz"))
    return rows


def grid_figures(grid: Grid) -> list[tuple[str, str]]:
    """Return the figures of a grid, in words."""
    quality, unit = grid.quality, f" {grid.unit}" if grid.unit else ""
    certificate = grid.certificate
    away = None if certificate is None else certificate.node_distance
    return [
        ("nodes", f"{len(grid.nodes):,}"),
        ("members", f"{len(grid.edges):,}"),
        ("panels", f"{len(grid.panel_table):,} {grid.panels_are}"),
        ("member length, mean", f"{quality.length_mean:.4g}{unit}"),
        ("member length, std/mean", f"{quality.length_cv:.4f}"),
        ("shape quality, 1 is regular", f"{quality.shape_mean:.4f}"),
        *(() if quality.planarity_max is None else (("farthest off its plane", f"{quality.planarity_max:.2%}"),)),
        ("members in all", f"{grid.lengths.sum():,.5g}{unit}"),
        ("node farthest from the scan", "-" if away is None else f"{away.largest.value:.3g}{unit}"),
    ]


def comparison(designs: list[Design]) -> str:
    """Return the figures of designs as an HTML table, one design a column."""
    found = [dict([*grid_figures(each.grid), *each.figures]) for each in designs]
    names = list(dict.fromkeys(name for figures in found for name in figures))
    head = "".join(f"<th style='text-align:left'>{escape(each.name)}</th>" for each in designs)
    rows = "".join(
        f"<tr><td>{escape(name)}</td>{''.join(f'<td>{escape(figures.get(name, chr(45)))}</td>' for figures in found)}</tr>"
        for name in names
    )
    return f'<table style="font-size:.8em;width:100%;padding:0 .6em"><tr><th></th>{head}</tr>{rows}</table>'


def deviation(grid: Grid, other: Grid) -> np.ndarray:
    """Return how far the nodes of a grid lie from the triangles of another (V,) [scan unit]."""
    places = np.ascontiguousarray(grid.nodes + grid.origin - other.origin)
    length = float(other.lengths.mean())
    distance, _ = distances_to_grid(places, other, length)
    return np.where(distance < NO_DISTANCE * length, 0.0, distance)
