"""The command ``scantruss demo``: the main job on a bundled scan."""

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
    from .demo_files import DEMOS
    from .options import Parser, add_force

    parser = Parser(
        "demo",
        "[FOLDER] [--scan shell|bust]",
        "Make the grid, report, picture and printable model of a bundled scan: a concrete shell, or the bust of Nefertiti.",
    )
    parser.add_argument("outs", metavar="FOLDER", nargs="?", help="default scantruss-demo/shell or scantruss-demo/bust")
    parser.add_argument(
        "--scan", dest="demo", metavar="|".join(DEMOS), choices=DEMOS, default="shell", help="default shell"
    )
    parser.add_argument("-o", "--out", dest="out", metavar="FOLDER", help="FOLDER as an option")
    add_force(parser)
    return parser


def make_demo(values: Namespace) -> None:
    """Do the main job on a bundled scan."""
    from ..report.terminal import Bars
    from .demo_files import DEMO_RESULTS, DEMOS, save_demo

    demo = DEMOS[values.demo]
    folder = result_folder(values.out or values.outs or f"scantruss-demo/{values.demo}")
    for name in DEMO_RESULTS:
        claim(folder / name, "result", {}, force=values.force)
    with Bars() as bars:
        cloud = read_scan(str(demo.scan), demo.settings, bars)
        result = grid_with_notes(cloud, demo.settings, bars)
        bars("picture, solid", 0.0)
        written = save_demo(demo, folder, result, cloud, force=values.force)
    show_grid(result, len(cloud.points), written)
