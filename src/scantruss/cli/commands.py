"""The commands: what each one takes, does and says.

Outputs and settings are checked before anything is read. The module of a command is imported when the command is asked for, and
everything heavy inside its functions.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .options import Parser


def completion(values: Namespace) -> None:
    """Print the script with which a shell completes all commands."""
    from .completion import print_completion

    print_completion(values, {name: make() for name, (make, _) in COMMANDS.items()})


def lazily(name: str) -> Callable[..., Any]:
    """Return a function of a command, such as "grid.grid_parser", that imports its module when it is called."""
    module, called = name.split(".")

    def call(*arguments: Any) -> Any:
        return getattr(import_module(f".{module}", __package__), called)(*arguments)

    return call


COMMANDS: dict[str, tuple[Callable[[], Parser], Callable[[Namespace], None]]] = {
    "info": (lazily("info.info_parser"), lazily("info.info")),
    "clean": (lazily("clean.clean_parser"), lazily("clean.clean")),
    "grid": (lazily("grid.grid_parser"), lazily("grid.grid")),
    "thin": (lazily("thin.thin_parser"), lazily("thin.thin")),
    "sweep": (lazily("sweep.sweep_parser"), lazily("sweep.sweep")),
    "print": (lazily("print.print_parser"), lazily("print.print_solid")),
    "families": (lazily("families.families_parser"), lazily("families.families")),
    "schedule": (lazily("schedule.schedule_parser"), lazily("schedule.make_schedule")),
    "setout": (lazily("setout.setout_parser"), lazily("setout.make_setting_out")),
    "structure": (lazily("structure.structure_parser"), lazily("structure.structure")),
    "convert": (lazily("convert.convert_parser"), lazily("convert.convert")),
    "studio": (lazily("studio.studio_parser"), lazily("studio.studio")),
    "splice": (lazily("splice.splice_parser"), lazily("splice.splice")),
    "demo": (lazily("demo.demo_parser"), lazily("demo.make_demo")),
    "completion": (lazily("completion.completion_parser"), completion),
}
