"""Charts of a report: mass from round to round of sizing and by the number of sections, and the nonlinear path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...export.drawing.strokes import INK_COLOUR
from ...structure.path import Path
from ...structure.path_report import draw_path, moves_label
from ...structure.sizing import SizingRound
from .parts import Frame

SECOND_COLOUR = "#c1662b"  #: colour of the second axis


def draw_rounds(figure: Any, place: Frame, rounds: Sequence[SizingRound]) -> None:
    """Draw mass and greatest utilization over the rounds of sizing."""
    axes = chart_axes(figure, place, "round", "mass [t]")
    numbers = range(1, len(rounds) + 1)
    axes.plot(numbers, [each.mass / 1e3 for each in rounds], "o-", color=tuple(INK_COLOUR), markersize=4, linewidth=1.4)
    axes.set_ylim(bottom=0)
    other = axes.twinx()
    other.plot(
        numbers, [each.utilization for each in rounds], "s--", color=SECOND_COLOUR, markersize=3.5, linewidth=1.0
    )
    other.axhline(1.0, color=SECOND_COLOUR, linewidth=0.5)
    other.set_ylabel("greatest utilization", color=SECOND_COLOUR, fontsize=9)
    other.tick_params(labelsize=8, colors=SECOND_COLOUR)
    other.set_ylim(0, 2)  # a first guess may be far off
    other.spines[["top"]].set_visible(False)


def draw_weights(figure: Any, place: Frame, weights: dict[int, float]) -> None:
    """Draw mass over the number of different sections."""
    axes = chart_axes(figure, place, "different sections at most", "mass [t]")
    axes.bar(list(weights), [mass / 1e3 for mass in weights.values()], width=0.5, color=(0.345, 0.525, 0.620))
    for count, mass in weights.items():
        axes.annotate(
            f"{mass / 1e3:.3g}", (count, mass / 1e3), (0, 3), textcoords="offset points", ha="center", fontsize=8
        )
    axes.margins(y=0.12)
    axes.spines[["right"]].set_visible(False)


def draw_nonlinear_path(figure: Any, place: Frame, path: Path) -> None:
    """Draw load factors over the displacement of the node that moves most."""
    axes = chart_axes(figure, place, moves_label(path), "load factor", whole=False)
    draw_path(axes, path)
    axes.spines[["right"]].set_visible(False)


def chart_axes(figure: Any, place: Frame, across: str, up: str, whole: bool = True) -> Any:
    """Return axes, with whole numbers across where asked for."""
    from matplotlib.ticker import MaxNLocator

    left, bottom, width, height = place
    axes = figure.add_axes((left + 0.09 * width, bottom + 0.16 * height, 0.80 * width, 0.78 * height))
    axes.set_xlabel(across, fontsize=9, color=tuple(INK_COLOUR))
    axes.set_ylabel(up, fontsize=9, color=tuple(INK_COLOUR))
    axes.tick_params(labelsize=8, colors=tuple(INK_COLOUR))
    if whole:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.spines[["top"]].set_visible(False)
    axes.grid(axis="y", linewidth=0.4, alpha=0.5)
    return axes
