"""The structure of a studio: what the page may say of it, and its solution."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ..errors import InputError
from ..runtime.progress import Progress
from ..structure.doubts import doubts_of_settings
from ..structure.modes import vibration_modes, worst_buckling
from ..structure.report import report_structure
from ..structure.sizing import SizingRound, size_members, weight_curve
from ..structure.statics import factor_stiffness, solve
from ..structure.truss import Truss
from ..structure.variants import truss_arguments
from .state import StudioState
from .support_places import check_none_is_lost


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


def _silent(stage: str, share: float) -> None:
    """Say nothing."""


def solved_state(state: StudioState, progress: Progress = _silent) -> StudioState:
    """Return a state with the structure of its grid, solved.

    Raises
    ------
    InputError
        There is no grid, a word cannot be used, or the structure is a mechanism.
    """
    if state.grid is None:
        raise InputError("there is no grid yet; press Generate")
    check_none_is_lost(state)
    asked = state.structure_settings
    if not (state.grid.unit or asked.unit):
        raise InputError(
            "the unit of the scan is not known, and a structure needs lengths in metres; choose it on the tab Scan"
        )
    truss = Truss.from_grid(state.grid, **truss_arguments(asked))
    rounds: list[SizingRound] = []
    weights = None
    if asked.size:
        progress("sizing", 0.2)
        plain, truss = truss, size_members(truss, asked.size, asked.checks, rounds, by=asked.size_by)
        progress("weight curve", 0.4)
        weights = weight_curve(plain, truss, asked.size, asked.checks, asked.size_by)
    progress("structure", 0.6)
    factored = factor_stiffness(truss)
    solution = solve(truss, factored)
    progress("modes", 0.8)
    count = asked.buckling or int(asked.size > 0)  # a sized structure is one that does not buckle
    buckling = worst_buckling(factored, solution, count) if count else None
    vibration = vibration_modes(factored, asked.frequencies) if asked.frequencies else None
    report = report_structure(
        solution,
        asked.checks,
        doubts_of_settings(asked, state.grid),
        buckling=buckling,
        vibration=vibration,
        rounds=rounds,
        weights=weights,
    )
    return replace(state, solution=solution, report=report, solved_with=asked)


def solved_again(state: StudioState) -> StudioState:
    """Return the state of a project with its structure solved as it was, whatever has been asked for since."""
    asked = state.structure_settings
    return replace(
        solved_state(replace(state, structure_settings=state.solved_with or asked)), structure_settings=asked
    )
