"""The table and pictures of a sweep: terminal, CSV, Markdown, HTML, and one sheet of all grids."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

from ..runtime.ours import MADE_BY
from ..sweep import FIGURES

if TYPE_CHECKING:
    from ..sweep import Outcome, Trial

STRUCTURE_COLUMNS = (
    "supports", "rise", "mass [kg]", "sections", "utilization", "buckling factor", "displacement [mm]", "structure",
)  # fmt: skip

STYLE = """\
body { font: 15px system-ui, sans-serif; margin: 2em; color: #222; background: #fff }
table { border-collapse: collapse; margin: 1em 0 } th, td { padding: .3em .7em; text-align: right }
th { border-bottom: 1px solid #888 } tr:hover { background: #f3f3f0 } td.words { text-align: left }
figure { display: inline-block; width: 24em; margin: .5em } img { width: 100% } figcaption { text-align: center }"""


def head_of(varied: Sequence[str], unit: str) -> tuple[str, ...]:
    """Return the names of the columns."""
    named = {"length": f"mean length [{unit}]", "deviation max": f"deviation max [{unit}]"} if unit else {}
    named.setdefault("length", "mean length")
    return (*varied, *(named.get(figure, figure) for figure in FIGURES), "certificate")


def rows_of_designs(trials: Sequence[Trial], outcomes: Sequence[Outcome]) -> list[tuple[str, ...]]:
    """Return a row for each trial; one without a grid says why."""
    none = ("",) * len(FIGURES)
    return [
        (*trial.varied, *(outcome.figures or none), outcome.fault or _passed(outcome.warnings))
        for trial, outcome in zip(trials, outcomes, strict=True)
    ]


def _passed(warnings: int) -> str:
    """Return the verdict on a grid that passed with so many warnings."""
    return f"passed with {warnings} warning{'s' * (warnings > 1)}" if warnings else "passed"


def structure_table(
    varied: Sequence[str], trials: Sequence[Trial], outcomes: Sequence[Outcome]
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return head and rows of the table of structures: every grid with each of its supports and rises."""
    rows = []
    for trial, outcome in zip(trials, outcomes, strict=True):
        for each in outcome.structures:
            figures = (
                f"{each.mass:.0f}",
                " ".join(each.sections),
                "" if each.utilization is None else f"{each.utilization:.2f}",
                "" if each.buckling is None else f"{each.buckling:.3g}",
                f"{1e3 * each.displacement:.3g}",
            )
            verdict = each.fault or "; ".join(each.warnings) or "passed"
            rows.append(
                (*trial.varied, each.supports, f"{each.rise:g}", *(("",) * 5 if each.fault else figures), verdict)
            )
    return (*varied, *STRUCTURE_COLUMNS), rows


def encode_table_csv(head: Sequence[str], rows: Sequence[Sequence[str]]) -> bytes:
    """Return the table as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([head, *rows])
    return text.getvalue().encode("utf-8")


def encode_table_markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> bytes:
    """Return the table as Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    text = "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)
    return text.encode("utf-8")


SweepTable = tuple[Sequence[str], Sequence[Sequence[str]]]  # its head and rows


def _html_table(table: SweepTable) -> str:
    cells = "".join(f"<th>{escape(name)}</th>" for name in table[0])
    lines = [f"<tr>{cells}</tr>"]
    for row in table[1]:
        figures = "".join(f"<td>{escape(cell)}</td>" for cell in row[:-1])
        lines.append(f'<tr>{figures}<td class="words">{escape(row[-1])}</td></tr>')
    return "<table>\n" + "\n".join(lines) + "\n</table>\n"


def encode_choice(
    title: str, tables: Sequence[SweepTable], trials: Sequence[Trial], outcomes: Sequence[Outcome]
) -> bytes:
    """Return a page with tables and the pictures, which lie beside it."""
    pictures = [
        f'<figure><a href="{escape(trial.name)}.png"><img src="{escape(trial.name)}.png" alt="{escape(trial.title)}"></a>'
        f'<figcaption>{escape(trial.title)} (<a href="{escape(trial.name)}.json">grid</a>)</figcaption></figure>'
        for trial, outcome in zip(trials, outcomes, strict=True)
        if outcome.picture
    ]
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta name="generator" content="{MADE_BY}"><title>{escape(title)}</title>\n'
        f"<style>\n{STYLE}\n</style></head><body>\n<h1>{escape(title)}</h1>\n"
        + "".join(map(_html_table, tables))
        + "\n".join(pictures)
        + "\n</body></html>\n"
    ).encode()


def title_of(trial: Trial, outcome: Outcome) -> str:
    """Return two lines above a picture: what is varied, and the main figures."""
    figures = dict(zip(FIGURES, outcome.figures, strict=True))
    line = f"{figures['members']} members, std/mean {figures['length std/mean']}, shape {figures['shape']}"
    return f"{trial.title}\n{line}"
