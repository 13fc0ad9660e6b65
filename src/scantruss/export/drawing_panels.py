"""Which panels lines that others drew enclose, and which sides of faces are no members."""

from __future__ import annotations

import numpy as np

from ..errors import FormatError
from ..grid.panels import loops_of, sides_of, table_of
from ..kernels.geometry.components import component_labels

MOST_WEDGES = 50_000_000  #: pairs of lines at a node that are looked at


class TooManyCyclesError(FormatError):
    """Lines that may enclose other panels just as well, so that none are taken."""


def place_in_drawing(point: np.ndarray) -> str:
    """Return a place in words."""
    return ", ".join(f"{value:.6g}" for value in point)


def _keys(pairs: np.ndarray) -> np.ndarray:
    """Return a number for each pair of nodes (K, 2), the same either way round."""
    low, high = np.sort(pairs, axis=1).astype(np.int64).T
    keys: np.ndarray = (low << 32) + high
    return keys


def lines_on_no_panel(lines: np.ndarray, panels: np.ndarray) -> np.ndarray:
    """Return which lines (L, 2) are no side of a panel."""
    return np.flatnonzero(~np.isin(_keys(lines), _keys(sides_of(panels))))


def sides_on_no_line(panels: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Return the sides of panels, each once, that are no lines, as pairs of nodes (S, 2)."""
    sides = np.unique(np.sort(sides_of(panels), axis=1), axis=0)
    return sides[~np.isin(_keys(sides), _keys(lines))]


def without_diagonals(faces: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Return the panels that lines leave of faces: those between which no line is drawn are one.

    Parameters
    ----------
    faces : (F, K) int64, nodes, filled up with -1
    lines : (L, 2) int64

    Returns
    -------
    (P, K) int64
        The faces as they are where the lines are not all members: a panel would have a node or a hole inside, or a side would belong
        to one face only.
    """
    diagonals = _keys(sides_on_no_line(faces, lines))
    sides, owner = sides_of(faces), np.repeat(np.arange(len(faces)), (faces >= 0).sum(axis=1))
    keys = _keys(sides)
    open_sides = np.isin(keys, diagonals)
    order = np.argsort(keys[open_sides], kind="stable")
    _, uses = np.unique(keys[open_sides], return_counts=True)
    if not len(uses) or (uses != 2).any():
        return faces
    one, other = owner[open_sides][order].reshape(-1, 2).T
    label = component_labels(len(faces), np.ascontiguousarray(one), np.ascontiguousarray(other))
    joined = np.flatnonzero(np.bincount(label, minlength=len(faces)) > 1)
    around: dict[int, list[list[int]]] = {number: [] for number in joined.tolist()}
    for number, side in zip(label[owner[~open_sides]].tolist(), sides[~open_sides].tolist(), strict=True):
        if number in around:
            around[number].append(side)
    nodes = {number: set[int]() for number in around}
    for number, side in zip(label[owner].tolist(), sides.tolist(), strict=True):
        if number in nodes:
            nodes[number].update(side)
    panels = []
    for number, loop in zip(label.tolist(), loops_of(faces), strict=True):
        if number not in around:
            panels.append(loop)
        elif around[number]:  # the first face of those that are joined
            whole = _loop_of(around[number])
            if whole is None or len(whole) != len(nodes[number]):
                return faces
            panels.append(whole)
            around[number] = []
    return table_of(panels)


def _loop_of(sides: list[list[int]]) -> list[int] | None:
    """Return the nodes of sides in turn, where these are one loop that meets itself nowhere."""
    after: dict[int, set[int]] = {}
    for one, other in sides:
        after.setdefault(one, set()).add(other)
        after.setdefault(other, set()).add(one)
    if any(len(others) != 2 for others in after.values()):
        return None
    loop = list(sides[0])
    while len(loop) <= len(after):  # each turn adds a node, and there are no more
        ahead = next(node for node in after[loop[-1]] if node != loop[-2])
        if ahead == loop[0]:
            break
        loop.append(ahead)
    return loop if len(loop) == len(after) else None


def panels_among_lines(lines: np.ndarray, points: np.ndarray, name: str) -> np.ndarray:
    """Return the panels (P, 3 or 4) of lines: cycles of three, and of four, filled up with -1, where these take in all lines or half.

    A cycle that separates panels on both sides of all its lines is none. Where few lines are on no cycle of three, and some on none
    of four either, these are props and ties, and the cycles of four that they make are no panels.

    Raises
    ------
    TooManyCyclesError
        A line is left with more than two.
    """
    triangles = _cycles_of_three(lines, name)
    panels = _between_none(triangles, lines, points, name)
    loose = len(lines_on_no_panel(lines, panels))
    if not loose or not len(quads := _cycles_of_four(lines, name)):
        return panels
    both = np.concatenate([np.pad(panels, ((0, 0), (0, 1)), constant_values=-1), quads])
    if 2 * loose < len(lines) and len(lines_on_no_panel(lines, both)):
        return panels
    return _between_none(both, lines, points, name)


def _between_none(panels: np.ndarray, lines: np.ndarray, points: np.ndarray, name: str) -> np.ndarray:
    """Return panels without those that have panels on both sides of all their sides."""
    size = (panels >= 0).sum(axis=1)
    owner = np.repeat(np.arange(len(panels)), size)
    sides = np.searchsorted(_keys(lines), _keys(sides_of(panels)))  # the lines are sorted
    uses = np.bincount(sides, minlength=len(lines))
    between = np.bincount(owner, uses[sides] > 2, len(panels)) == size
    left = np.bincount(sides[~between[owner]], minlength=len(lines))
    taken_twice = sides[between[owner]]
    wrong = np.concatenate([np.flatnonzero(left > 2), taken_twice[left[taken_twice] < 2]])
    if wrong.size:
        where = place_in_drawing(points[lines[wrong[0]]].mean(axis=0))
        raise TooManyCyclesError(
            f"{name} has lines with more than two cycles of three or four lines, one at {where}; export its panels as faces"
        )
    return panels[~between]


def _pairs_of_equals(values: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return all pairs of places in a sorted array that hold the same value, the earlier ones and the later ones."""
    later = np.searchsorted(values, values, side="right") - np.arange(len(values)) - 1
    if later.sum() > MOST_WEDGES:
        raise TooManyCyclesError(f"{name} has nodes with too many lines to be a grid")
    first = np.repeat(np.arange(len(values)), later)
    return first, first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(later) - later, later)


def _cycles_of_three(lines: np.ndarray, name: str) -> np.ndarray:
    """Return all cycles of three lines (T, 3)."""
    low, high = lines.T
    first, second = _pairs_of_equals(low, name)
    closed = np.isin(_keys(np.stack([high[first], high[second]], axis=1)), _keys(lines))
    return np.stack([low[first], high[first], high[second]], axis=1)[closed]


def _cycles_of_four(lines: np.ndarray, name: str) -> np.ndarray:
    """Return the cycles of four lines (Q, 4) that no line crosses: two pairs of lines that meet at a node and have the same other ends."""
    keys = _keys(lines)
    middle, tip = np.concatenate([lines, lines[:, ::-1]]).T
    order = np.lexsort((tip, middle))
    middle, tip = middle[order], tip[order]
    first, second = _pairs_of_equals(middle, name)
    ends, middle = np.stack([tip[first], tip[second]], axis=1), middle[first]
    is_open = ~np.isin(_keys(ends), keys)
    ends, middle = ends[is_open], middle[is_open]
    order = np.lexsort((middle, _keys(ends)))
    ends, middle = ends[order], middle[order]
    first, second = _pairs_of_equals(_keys(ends), name)
    across = np.stack([middle[first], middle[second]], axis=1)
    found = ~np.isin(_keys(across), keys) & (_keys(across) > _keys(ends)[first])  # each by one of its diagonals
    a, c = ends[first[found]].T
    b, d = across[found].T
    return np.stack([a, b, c, d], axis=1)
