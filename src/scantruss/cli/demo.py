"""The command ``scantruss demo``: the main job on the bundled scan."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from .grid import grid_with_notes, show_grid
from .outputs import claim, result_folder
from .shared import read_scan

if TYPE_CHECKING:
    from .options import Parser


def demo_parser() -> Parser:
    """Options of ``scantruss demo``."""
    from .options import Parser, add_force

    parser = Parser(
        "demo",
        "[FOLDER]",
        "Make the grid, report, picture and printable model of the bundled scan, the bust of Nefertiti.",
    )
    parser.add_argument("outs", metavar="FOLDER", nargs="?", help="default ./scantruss-demo")
    parser.add_argument("-o", "--out", dest="out", metavar="FOLDER", help="FOLDER as an option")
    add_force(parser)
    return parser


def demo(values: Namespace) -> None:
    """Do the main job on the bundled scan."""
    from ..report.terminal import Bars
    from .demo_files import RESULTS, SCAN, demo_settings, save_demo

    folder = result_folder(values.out or values.outs or "scantruss-demo")
    for name in RESULTS:
        claim(folder / name, "result", {}, force=values.force)
    with Bars() as bars:
        cloud = read_scan(str(SCAN), demo_settings(), bars)
        result = grid_with_notes(cloud, demo_settings(), bars)
        bars("picture, solid", 0.0)
        written = save_demo(folder, result, cloud, force=values.force)
    show_grid(result, len(cloud.points), written)
