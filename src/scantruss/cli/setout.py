"""The command ``scantruss setout``: what is set out on site, and in which order members are put up."""

from __future__ import annotations

import argparse
from argparse import SUPPRESS, Namespace
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from .grids import add_grid, read_grid_or_structure
from .outputs import claim, outs_of, wrote_line
from .styles import add_decimal_comma

if TYPE_CHECKING:
    from ..setout.make import SettingOut
    from ..setout.settings import Cut
    from .options import Parser

PROPS_NAMED = 8  # of a step


def setout_parser() -> Parser:
    """Options of ``scantruss setout``."""
    from ..settings import UNITS
    from .options import Parser, add_outs, number, scale
    from .positions import position

    parser = Parser(
        "setout",
        "GRID|STRUCTURE OUT.dxf|OUT.pdf|OUT.csv|OUT.xlsx [OUT ...] [--supports WHERE, of a GRID only] [options]",
        "Set out a grid or a structure: supports, heights along sections, unrolled boundaries, a plan with marks, and the\n"
        "assembly by rings from the supports: each step is stable, or the nodes that need props are named.\n"
        "Give supports, joints, scale and unit for a grid only: a structure has its own.\n"
        "Lengths are in millimetres, as built, unless they are those of the scan.",
    )
    add_grid(parser, "grid or structure saved as .json by scantruss grid or structure")
    add_outs(parser, "drawing .dxf or .pdf; tables .xlsx or .csv: the supports, with the other tables beside it", "*")
    units = "|".join(unit for unit in UNITS if unit)
    for name, metavar, kind, about in (
        ("supports", "WHERE", str, "for a grid: corners, boundary, lowest:H, fixed, ends, line:NAME, loop:N, N001, or several joined by +"),
        ("joints", "TYPE", str, "for a grid: rigid (default) or pinned, during assembly"),
        ("scale", "S", scale, "for a grid: size of the structure over that of the grid (default 1)"),
        ("unit", units, str, "unit of a grid that has none"),
        ("origin", "X,Y,Z", position, "origin of the building frame in the scan (default: lowest corner)"),
        ("rotation", "DEG", number, "angle from the scan's x axis to the building's, about z"),
        ("spacing", "MM", number, "distance between sections across x and y of the building frame"),
        ("paper", "A4|A3|A2|A1|A0", str, "size of the pages of a .pdf (default A3)"),
    ):  # fmt: skip
        parser.add_argument(f"--{name}", metavar=metavar, type=kind, default=SUPPRESS, help=about)
    parser.add_argument(
        "--section",
        metavar="AXIS=MM",
        type=plane,
        action="append",
        dest="sections",
        default=SUPPRESS,
        help="section of the building frame, such as x=2500; repeatable (default: the middle of x and of y)",
    )
    add_decimal_comma(parser)
    parser.add_argument("--keep-failed", action="store_true", help="also accept a grid that failed its certificate")
    return parser


def plane(text: str) -> Cut:
    """Return the axis and the place of "x=2500"."""
    axis, _, place = text.partition("=")
    try:
        return axis.strip().lower(), float(place)
    except ValueError:
        raise argparse.ArgumentTypeError(f"needs an axis and a place in mm such as x=2500, got {text!r}") from None


def make_setting_out(values: Namespace) -> None:
    """Write the setting out of a saved grid or structure."""
    from ..report.terminal import Bars, print_lines
    from ..runtime.files import SaveTogether
    from ..setout.files import check_setout_place, setout_paths, write_setting_out
    from ..setout.make import set_out
    from ..setout.settings import SetoutSettings
    from ..structure.truss import Truss

    outs = [check_setout_place(out) for out in outs_of(values)]
    given = {spec.name: vars(values)[spec.name] for spec in fields(SetoutSettings) if spec.name in vars(values)}
    if "sections" in given:
        given["sections"] = tuple(given["sections"])
    settings = SetoutSettings(**given)
    if not Path(values.grid).exists():
        raise InputError(
            f"there is no file {values.grid}; setout needs a grid or structure saved as .json by scantruss"
        )
    taken = {Path(values.grid).resolve(): "grid"}
    for out in outs:
        for place in setout_paths(out):
            claim(check_setout_place(place), "setting out", taken, force=values.force)
    with Bars() as bars, SaveTogether("" if values.force else "result") as save:
        bars("read", 0.0)
        what, _ = read_grid_or_structure(values.grid, values.merge, values.keep_failed, bars)
        if isinstance(what, Truss) and (own := given.keys() & {"supports", "joints", "scale", "unit"}):
            raise InputError(f"a structure has {min(own)} of its own; leave --{min(own)} out")
        made = set_out(what, settings, keep_failed=values.keep_failed, progress=bars)
        files: dict[Path, int] = {}
        for number, out in enumerate(outs):
            bars("write", number / len(outs))
            files[out] = len(write_setting_out(made, save.beside(out), decimal_comma=values.decimal_comma))
    print_lines([*setout_lines(made), wrote_line(files)])


def setout_lines(made: SettingOut) -> list[str]:
    """Say what is set out, and which steps need props."""
    count = int(made.held.any(axis=1).sum())
    heights = sum(len(line.points) for line in made.section_lines)
    lines = [
        f"{count:,} supports, {heights:,} heights along {len(made.section_lines):,} sections,"
        f" {len(made.boundaries):,} {'boundary' if len(made.boundaries) == 1 else 'boundaries'} unrolled"
    ]
    loose = [(number, step.props) for number, step in enumerate(made.steps) if len(step.props)]
    lines.append(f"{len(made.steps):,} steps of assembly, {len(made.steps) - len(loose):,} of them stable on their own")
    before: list[int] = []
    for number, props in loose:
        if (now := props.tolist()) != before:
            named = " ".join(made.node_marks[k] for k in now[:PROPS_NAMED])
            more = f" and {len(now) - PROPS_NAMED:,} more" if len(now) > PROPS_NAMED else ""
            lines.append(f"from step {number} on {len(now):,} {'prop' if len(now) == 1 else 'props'}: {named}{more}")
        before = now
    if len(made.steps[-1].props):
        lines.append("warning: the whole does not stand on its own; use more supports or rigid joints")
    return lines
