"""Lines in a grid: chains of members whose nodes slide on a curve of their own."""

from __future__ import annotations

from ...runtime.jit import kernel
from ..boundary.curves import Curves, is_open
from .grid import Net

SAME_DISTANCE = 1e-6  # difference of two squared distances below which they are the same [square of the line]


@kernel
def arc_on_line(net: Net, curves: Curves, v: int, a: int, b: int) -> float:
    """Arc length of node a on the line of node v; a node of several lines is at an end of it, the one away from node b."""
    curve = net.curve[v]
    if net.curve[a] == curve:
        return net.arc[a]
    first, last = curves.start[curve], curves.start[curve + 1] - 1
    before = after = 0.0
    for c in range(3):
        before += (net.nodes[a, c] - curves.points[first, c]) ** 2
        after += (net.nodes[a, c] - curves.points[last, c]) ** 2
    total = curves.total[curve]
    if abs(before - after) > SAME_DISTANCE * total * total:
        return 0.0 if before < after else total
    return 0.0 if net.arc[b] < 0.5 * total else total  # a line that ends where it starts


@kernel
def halfway(curves: Curves, curve: int, a: float, b: float) -> float:
    """Arc length half-way between two on a line; on a closed one, the shorter way round."""
    ahead = b - a
    if not is_open(curves, curve):
        total = curves.total[curve]
        ahead = ahead % total
        if ahead > 0.5 * total:
            ahead -= total
    return a + 0.5 * ahead
