"""The command ``scantruss schedule``: what a workshop needs to make a saved grid."""

from __future__ import annotations

import argparse
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError, words_of_number
from ..grid.alike import JOINTS, PANELS
from .grids import add_grid, read_grid_or_structure
from .outputs import claim, outs_of, wrote_line

if TYPE_CHECKING:
    from ..grid.alike import Alike
    from ..schedules.records import Schedule, Schedules
    from ..schedules.settings import ScheduleSettings
    from .options import Parser


def schedule_parser() -> Parser:
    """Options of ``scantruss schedule``."""
    from ..settings import UNITS
    from .options import Parser, add_outs, number, scale
    from .positions import position

    parser = Parser(
        "schedule",
        "GRID|STRUCTURE OUT.xlsx|OUT.csv [OUT ...] [--tube DxT] [options]",
        "List the nodes, members and panels of a grid or a structure as a workshop needs them, with types, quantities and\n"
        "warnings; for a structure also forces, checks and bolts.\n"
        "Tubes, balls, clearance and tolerance are in millimetres, as built.",
    )
    add_grid(parser, "grid or structure saved as .json by scantruss grid or structure")
    add_outs(parser, "workbook .xlsx; or .csv: the members, with the other tables beside it", "*")
    parser.add_argument(
        "--tube",
        metavar="DxT",
        type=tube,
        help="for a grid: outer diameter and wall of the members, e.g. 114.3x5 [mm]",
    )
    parser.add_argument(
        "--ball",
        metavar="D|auto",
        type=ball,
        help="diameter of all balls [mm]; auto (default): the smallest for each type of node",
    )
    parser.add_argument(
        "--clearance",
        metavar="C",
        type=number,
        help="distance along a member from where tubes meet to the ball [mm] (default D/10)",
    )
    parser.add_argument(
        "--tolerance", metavar="MM", type=number, help="largest misfit of equal members and panels (default 1)"
    )
    parser.add_argument(
        "--angle-tolerance", metavar="DEG", type=number, help="largest misfit of equal nodes (default 0.5)"
    )
    parser.add_argument(
        "--scale", metavar="S", type=scale, help="size of the structure over that of the grid (default 1)"
    )
    units = "|".join(unit for unit in UNITS if unit)
    parser.add_argument("--unit", metavar=units, help="unit of a grid that has none")
    parser.add_argument(
        "--density",
        metavar="KG/M3",
        type=number,
        help="density of members and balls, for masses, e.g. 7850; for a structure that of the balls",
    )
    parser.add_argument("--bolts", metavar="GRADE", help="for a structure: 4.6, 5.6, 6.8, 8.8, 10.9 (default) or none")
    parser.add_argument(
        "--thread", metavar="X", type=number, help="depth of a thread over the diameter of its bolt (default 1.1)"
    )
    parser.add_argument(
        "--sleeve", metavar="X", type=number, help="outer diameter of a sleeve over that of its bolt (default 1.8)"
    )
    parser.add_argument(
        "--origin",
        metavar="X,Y,Z",
        type=position,
        help="origin of the building frame in the scan (default: lowest corner)",
    )
    parser.add_argument(
        "--rotation", metavar="DEG", type=number, help="angle from the scan's x axis to the building's, about z"
    )
    parser.add_argument(
        "--least-angle", metavar="DEG", type=number, help="warn of smaller angles between members (default 30)"
    )
    parser.add_argument(
        "--least-fold", metavar="DEG", type=number, help="warn of sharper folds; 180 is level (default 150)"
    )
    parser.add_argument(
        "--slenderness", metavar="X", type=number, help="for a structure: warn of more slender members (default 200)"
    )
    parser.add_argument("--keep-failed", action="store_true", help="also accept a grid that failed its certificate")
    return parser


def tube(text: str) -> tuple[float, float | None]:
    """Return diameter and wall of "114.3x5" or "CHS114.3x5"; no wall for "114.3"."""
    diameter, times, wall = text.lower().removeprefix("chs").partition("x")
    try:
        return float(diameter), float(wall) if times else None
    except ValueError:
        raise argparse.ArgumentTypeError(f"needs a diameter and a wall in mm such as 114.3x5, got {text!r}") from None


def ball(text: str) -> float | None:
    """Return the diameter of a ball; None for "auto"."""
    try:
        return None if text == "auto" else float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"needs a diameter in mm, or auto, got {text!r}") from None


def make_schedule(values: Namespace) -> None:
    """Write the schedules of a saved grid."""
    from dataclasses import fields

    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether
    from ..runtime.places import check_place
    from ..schedules.files import SCHEDULE_SUFFIXES, schedule_paths, write_schedules
    from ..schedules.settings import ScheduleSettings

    outs = [check_place(out, SCHEDULE_SUFFIXES) for out in outs_of(values)]
    names = {spec.name for spec in fields(ScheduleSettings)} - {"tube", "wall"}
    given = {name: value for name, value in vars(values).items() if name in names and value is not None}
    diameter, wall = values.tube or (None, None)
    settings = ScheduleSettings(tube=diameter, wall=wall, **given)
    if not Path(values.grid).exists():
        raise InputError(f"there is no file {values.grid}; schedule needs a grid saved as .json by scantruss grid")
    taken = {Path(values.grid).resolve(): "grid"}
    for out in outs:
        for place in schedule_paths(out).values() if out.suffix.lower() == ".csv" else (out,):
            check_place(place, SCHEDULE_SUFFIXES)
            claim(place, "schedule", taken, force=values.force)
    from ..schedules.make import schedule

    with Bars() as bars, SaveTogether("" if values.force else "result") as save:
        bars("read", 0.0)
        what, checked = read_grid_or_structure(values.grid, values.merge, bars)
        bars("schedules", 0.0)
        made = schedule(what, settings, keep_failed=values.keep_failed, checked=checked)
        files: dict[Path, int] = {}
        for number, out in enumerate(outs):
            bars("write", number / len(outs))
            files[out] = len(write_schedules(made, save.beside(out)))
    print_lines([*schedule_lines(made, settings, what.alike), wrote_line(files)])


def schedule_lines(made: Schedules, settings: ScheduleSettings, alike: Alike | None = None) -> list[str]:
    """Say how much there is of what, and what is warned of; `alike` says which parts were made so."""
    within = {JOINTS: f"{settings.angle_tolerance:g} degrees", PANELS: f"{settings.tolerance:g} mm"}
    if alike is not None and alike.parts in within:
        within[alike.parts] = f"{100 * alike.tolerance:g} %, as they were made alike"
    cut = sum(value for value in made.lengths["total"] if isinstance(value, float))
    lines = [
        f"{len(made.nodes):,} nodes of {len(made.node_types):,} types within {within[JOINTS]}"
        + mirrored_words(made.node_types),
        f"{len(made.members):,} members of {len(made.lengths):,} lengths within {settings.tolerance:g} mm, cut {words_of_number(cut, 4)} m",
        f"{len(made.panels):,} panels of {len(made.panel_types):,} types within {within[PANELS]}"
        + mirrored_words(made.panel_types),
    ]
    return [*lines, *warning_lines(made.warnings)]


def mirrored_words(types: Schedule) -> str:
    """Say how many types there are if mirror images count once; nothing where there are as many."""
    if all(each.name != "mirror image" for each in types.columns):
        return ""
    first = types.columns[0].values
    seen = {
        frozenset((own, image)) for own, image in zip(first, types["mirror image"], strict=True) if image is not None
    }
    alone = sum(image is None for image in types["mirror image"])
    once = len(seen) + alone
    return f", {once:,} if mirror images count once" if once < len(first) else ""


def warning_lines(warnings: Schedule) -> list[str]:
    """Say of each kind of warning how many there are, and the worst."""
    from ..schedules.clashes import HEAVY_BALLS
    from ..structure.loads import MOST_ALLOWANCE

    lines = []
    for words in dict.fromkeys(warnings["warning"]):
        rows = [row for row in warnings.rows if row[0] == words]
        _, at, _, worst, given, measure, *_ = max(rows, key=lambda row: abs(float(row[3] or 0) - float(row[4] or 0)))
        value, limit = float(worst or 0), None if given is None else float(given)
        most = f"{words_of_number(value, 4)} {measure}".rstrip() + ("" if at is None else f" at {at}")
        if words == HEAVY_BALLS and limit is not None:
            way = (
                f"structure --node-allowance {value / 100:.2f} takes that into account"
                if value <= 100 * MOST_ALLOWANCE
                else f"structure takes {MOST_ALLOWANCE:.0%} at most: thinner tubes or longer members make balls lighter beside them"
            )
            lines.append(
                f"warning: the balls weigh {value:.0f} % of the members, and the structure was solved with {limit:.0f} % for its nodes;"
                f" {way}"
            )
        elif limit is None:  # what is never carried at all
            lines.append(f"warning: {words}; the greatest is {most}")
        elif len(rows) == 1:
            lines.append(f"warning: {words}: {most}, limit {words_of_number(limit, 4)}")
        else:
            lines.append(f"warning: {words}: {len(rows):,}, the worst {most}, limit {words_of_number(limit, 4)}")
    return lines
