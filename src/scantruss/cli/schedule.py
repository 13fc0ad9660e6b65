"""The command ``scantruss schedule``: what a workshop needs to make a saved grid."""

from __future__ import annotations

import argparse
import re
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from .grids import add_grid, read_grid_or_structure
from .outputs import claim, outs_of, wrote_line
from .styles import add_decimal_comma

if TYPE_CHECKING:
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
    add_decimal_comma(parser)
    parser.add_argument("--keep-failed", action="store_true", help="also accept a grid that failed its certificate")
    return parser


def tube(text: str) -> tuple[float, float | None]:
    """Return diameter and wall of "114.3x5" or "CHS114.3x5"; no wall for "114.3"."""
    diameter, times, wall = text.lower().removeprefix("chs").partition("x")
    try:
        return float(diameter), float(wall) if times else None
    except ValueError:
        point = re.sub(r"(?<=\d),(?=\d)", ".", text)
        meant = f"; write {point} with a point" if point != text else ""
        raise argparse.ArgumentTypeError(
            f"needs a diameter and a wall in mm such as 114.3x5, got {text!r}{meant}"
        ) from None


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
    from ..schedules.lines import schedule_lines
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
        what, checked = read_grid_or_structure(values.grid, values.merge, values.keep_failed, bars)
        bars("schedules", 0.0)
        made = schedule(what, settings, keep_failed=values.keep_failed, checked=checked)
        files: dict[Path, int] = {}
        for number, out in enumerate(outs):
            bars("write", number / len(outs))
            files[out] = len(write_schedules(made, save.beside(out), decimal_comma=values.decimal_comma))
    print_lines([*schedule_lines(made, settings, what.alike), wrote_line(files)])
