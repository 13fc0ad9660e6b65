"""Supports at single nodes: a mark names a node of one grid, so their places are kept and the nodes found again on the next."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import InputError, ScanTrussError, words_of_place
from ..grid.grid import Grid
from ..grid.marks import node_marks
from ..structure.options import StructureSettings
from ..structure.truss import Truss
from .page_words import in_words_of_page
from .state import DEFAULT_STRUCTURE, Placed, StudioState

NODE_MARK = re.compile(r"N\d+\??")
LOST_SUPPORT = "?"  # after the mark of a support where the grid has no node


def words_of_supports(supports: str) -> list[str]:
    """Return what is joined by "+"."""
    return [word.strip() for word in supports.split("+") if word.strip()]


def marks_of_supports(supports: str) -> list[str]:
    """Return the marks of nodes among supports, those that are lost too."""
    return [word for word in words_of_supports(supports) if NODE_MARK.fullmatch(word)]


def marks_of_grid(state: StudioState) -> list[str]:
    """Return the mark of each node of the grid; a structure with more layers may count its nodes with more digits."""
    return [] if state.grid is None else node_marks(state.grid)


def is_untouched(state: StudioState) -> bool:
    """Whether the supports are the usual ones, of which nobody has made a structure."""
    return state.structure_settings.supports == DEFAULT_STRUCTURE.supports and state.solved_with is None


def asked_supports(state: StudioState) -> tuple[np.ndarray, str]:
    """Return the nodes (K,) of the grid that the supports of the next structure name, and why there are none; "" where there are."""
    none, asked = np.zeros(0, np.int64), state.structure_settings
    if state.grid is None:
        return none, ""
    if words := words_of_lost(state):
        return none, words
    unit = state.grid.unit or asked.unit or "m"  # which heights above the lowest node need alone
    try:
        truss = Truss.from_grid(state.grid, unit=unit, scale=asked.scale, supports=asked.supports)
    except ScanTrussError as error:
        return none, in_words_of_page(" ".join(str(error).split()))
    return np.flatnonzero((truss.supports != 0).any(axis=1)), ""


def switched(supports: str, mark: str) -> str:
    """Return supports with a node besides, or without it where it is one of them."""
    words = words_of_supports(supports)
    return "+".join([word for word in words if word != mark] if mark in words else [*words, mark])


def placed_supports(supports: str, known: Placed, grid: Grid | None) -> Placed:
    """Return the place of each node that supports name: the known one, or that of the grid [scan unit]."""
    marks = set(marks_of_supports(supports))
    kept = tuple((mark, place) for mark, place in known if mark in marks)
    new = marks - {mark for mark, _ in kept}
    if grid is None or not new:
        return kept
    named = zip(node_marks(grid), grid.scan_nodes.tolist(), strict=True)
    return (*kept, *((mark, (x, y, z)) for mark, (x, y, z) in named if mark in new))


def supports_on(state: StudioState, grid: Grid) -> dict[str, Any]:
    """Return the changes of a state by which its supports at nodes lie on another grid, where they did before.

    Each is the nearest node, no farther than the longest member; where there is none, the mark is followed by "?".
    """
    asked, known = state.structure_settings, state.support_places
    if not known:
        return {}
    marks, nodes, reach = node_marks(grid), grid.scan_nodes, float(grid.lengths.max())
    named: dict[str, list[str]] = {}
    moved = []
    for mark, place in known:
        away = np.linalg.norm(nodes - place, axis=1)
        there = marks[int(away.argmin())] if away.min() <= reach else mark.rstrip(LOST_SUPPORT) + LOST_SUPPORT
        named.setdefault(mark, []).append(there)
        moved.append((there, place))
    words = [each for word in words_of_supports(asked.supports) for each in named.get(word, [word])]
    supports = "+".join(dict.fromkeys(words))
    if supports == asked.supports:
        return {}
    return {"structure_settings": asked.replace(supports=supports), "support_places": tuple(moved)}


def words_of_lost(state: StudioState) -> str:
    """Return what is said of supports where the grid has no node; "" where each has one."""
    places = dict(state.support_places)
    lost = [mark for mark in marks_of_supports(state.structure_settings.supports) if mark.endswith(LOST_SUPPORT)]
    if not lost:
        return ""
    said = [f"{mark} stood at {words_of_place(places[mark])}" if mark in places else mark for mark in lost]
    return f"the grid has no node where {', '.join(said)}; take that out of supports, and click on a node in its place"


def check_none_is_lost(state: StudioState) -> None:
    """Refuse supports of which one has no node on the grid.

    Raises
    ------
    InputError
        The message says which, and where it stood.
    """
    if words := words_of_lost(state):
        raise InputError(words)


def for_new_scan(before: StructureSettings) -> StructureSettings:
    """Return settings of a structure without what belongs to the scan before: supports, loads by place, scale, depth of layers, sizing."""
    usual = DEFAULT_STRUCTURE
    loads = tuple(load for load in before.loads if not isinstance(load, Mapping)) or usual.loads
    return before.replace(
        supports=usual.supports,
        support_type=usual.support_type,
        loads=loads,
        scale=usual.scale,
        double_layer=usual.double_layer,
        size=usual.size,
        size_by=usual.size_by,
    )
