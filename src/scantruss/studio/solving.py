"""The structure of a studio: what the page may say of it, and its solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ..errors import InputError
from ..structure.modes import vibration_modes
from ..structure.report import report_structure
from ..structure.statics import factor_stiffness, solve
from ..structure.truss import Truss
from ..structure.variants import truss_arguments
from .state import StudioState


def check_words(words: Mapping[str, str]) -> None:
    """Refuse words that name a file, which the page may not read.

    Raises
    ------
    InputError
        The message says which.
    """
    for name, text in words.items():
        for part in (text, *text.split(","), text.partition(".csv")[0]):
            named = part.strip()
            is_file = named.lower().endswith((".csv", ".toml", ".json", ".txt")) or ".csv:" in named
            if is_file or Path(named).is_file():
                raise InputError(f"{name} names a file, {named}; files are read by the command line only")


def solved_state(state: StudioState) -> StudioState:
    """Return a state with the structure of its grid, solved.

    Raises
    ------
    InputError
        There is no grid, a word cannot be used, or the structure is a mechanism.
    """
    if state.grid is None:
        raise InputError("there is no grid yet; press Generate")
    asked = state.structure_settings
    truss = Truss.from_grid(state.grid, **truss_arguments(asked))
    factored = factor_stiffness(truss)
    solution = solve(truss, factored)
    modes = vibration_modes(factored, asked.frequencies) if asked.frequencies else None
    return replace(state, solution=solution, report=report_structure(solution, asked.checks, vibration=modes))
