"""Solids for printing, the large ones made in a process of their own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from ...grid.grid import Grid
    from ...runtime.cluster import Work
    from ..solid_files import Solid
    from .write import PrintedParts

Made = TypeVar("Made")

MOST_HERE = 500  #: members and nodes that are united in this process


def print_apart(grid: Grid, path: Path, **options: Any) -> Solid:
    """Write the solid of a grid (see `print_model`), a large one in a process of its own, which can be ended at any moment.

    The library that unites the parts lets nobody else work meanwhile, and nobody hear of a signal.
    """
    return _made_apart(_print, grid, path, options)


def print_parts_apart(grid: Grid, path: Path, **options: Any) -> PrintedParts:
    """Write the parts of a grid (see `print_parts`) in the same way."""
    return _made_apart(_print_parts_of, grid, path, options)


def _made_apart(work: Work[tuple[Grid, Path], Made], grid: Grid, path: Path, options: dict[str, Any]) -> Made:
    from ...runtime.cluster import Processes, Workers

    with Processes(1) if len(grid.nodes) + len(grid.edges) > MOST_HERE else Workers() as worker:
        return next(worker.run(work, [(grid, path)], options))[1]


def _print(job: tuple[Grid, Path], options: dict[str, Any]) -> Solid:
    from ..solid import print_model

    grid, path = job
    return print_model(grid, path, **options)


def _print_parts_of(job: tuple[Grid, Path], options: dict[str, Any]) -> PrintedParts:
    from .write import print_parts

    grid, path = job
    return print_parts(grid, path, **options)
