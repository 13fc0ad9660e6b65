"""The commands: what each one takes, does and says.

Outputs and settings are checked before anything is read; everything heavy is imported inside the functions.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from typing import TYPE_CHECKING

from .clean import clean, clean_parser
from .completion import completion_parser, print_completion
from .convert import convert, convert_parser
from .demo import demo_parser, make_demo
from .families import families, families_parser
from .grid import grid, grid_parser
from .info import info, info_parser
from .print import print_parser, print_solid
from .schedule import make_schedule, schedule_parser
from .setout import make_setting_out, setout_parser
from .splice import splice, splice_parser
from .structure import structure, structure_parser
from .studio import studio, studio_parser
from .sweep import sweep, sweep_parser
from .thin import thin, thin_parser

if TYPE_CHECKING:
    from .options import Parser


def completion(values: Namespace) -> None:
    """Print the script with which a shell completes all commands."""
    print_completion(values, {name: make() for name, (make, _) in COMMANDS.items()})


COMMANDS: dict[str, tuple[Callable[[], Parser], Callable[[Namespace], None]]] = {
    "info": (info_parser, info),
    "clean": (clean_parser, clean),
    "grid": (grid_parser, grid),
    "thin": (thin_parser, thin),
    "sweep": (sweep_parser, sweep),
    "print": (print_parser, print_solid),
    "families": (families_parser, families),
    "schedule": (schedule_parser, make_schedule),
    "setout": (setout_parser, make_setting_out),
    "structure": (structure_parser, structure),
    "convert": (convert_parser, convert),
    "studio": (studio_parser, studio),
    "splice": (splice_parser, splice),
    "demo": (demo_parser, make_demo),
    "completion": (completion_parser, completion),
}
