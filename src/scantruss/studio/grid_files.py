"""Grids that were saved as .json: one is taken with its settings where it is a grid of the scan that is open."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import CertificateError, InputError
from ..export.json import read_grid
from ..layouts.on_scan import ScanOfGrid
from .scan_parts import part_of_scan
from .state import NO_GRID, StudioState
from .support_places import supports_on

GRID_SUFFIX = ".json"


def is_grid_file(name: str | Path) -> bool:
    """Whether a file is opened as a grid."""
    return Path(name).suffix.lower() == GRID_SUFFIX


def refuse_grid_without_scan(name: str | Path) -> None:
    """Refuse a grid where no scan is open.

    Raises
    ------
    InputError
        The file is a grid by its name.
    """
    if is_grid_file(name):
        raise InputError(
            f"{name} is a grid or a structure, and the studio begins with a scan; open the scan first, then the grid in the tab Scan"
        )


def changes_of_grid(state: StudioState, path: Path) -> dict[str, Any]:
    """Return the changes of a state by which it has a saved grid, and the settings that the grid was made with.

    Raises
    ------
    ScanTrussError
        The file holds no grid, or one that does not pass the checks against the scan.
    """
    if state.whole is None or state.cloud is None:
        refuse_grid_without_scan(path)
        raise InputError("there is no scan yet; open one")
    grid = read_grid(path)
    settings = grid.settings
    if settings is None:
        raise InputError(f"{path} does not say with which settings it was made; press Generate for a grid of this scan")
    if grid.unit != state.cloud.unit:
        names = [unit or "no known unit" for unit in (grid.unit, state.cloud.unit)]
        raise InputError(
            f"{path} is in {names[0]}, and the scan in {names[1]}; if that is wrong, choose {names[0]} in Scan, unit"
        )
    cloud = part_of_scan(state.whole, settings, state.cleaning, state.removed)
    try:
        ScanOfGrid.of(cloud, settings).certified(grid)
    except CertificateError as error:
        raise InputError(f"{path} is no grid of the scan that is open: {error}") from None
    taken = {"cloud": cloud, "settings": settings, "unpainted": 1.0, "grid": grid, "asked": settings}
    return NO_GRID | taken | supports_on(state, grid)
