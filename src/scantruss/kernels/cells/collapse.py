"""Edges of a mesh are collapsed one by one, while it stays a manifold with its boundary and lines."""

from __future__ import annotations

import numpy as np

from ...runtime.jit import kernel


@kernel
def found(into: np.ndarray, v: int) -> int:
    """Node that a node has become; shortens the way there."""
    while into[v] != v:  # ends: each was collapsed into one that was there later
        into[v] = into[into[v]]
        v = into[v]
    return v


@kernel
def stamp_around(
    head: np.ndarray, after: np.ndarray, triangles: np.ndarray, v: int, stamp: np.ndarray, clock: int
) -> int:
    """Stamp the neighbours of a node; returns how many they are."""
    count, c = 0, head[v]
    while c >= 0:  # ends: the list of corners at a node has no rings
        t = c // 3
        if triangles[t, 0] >= 0:
            for k in range(3):
                u = triangles[t, k]
                if u != v and stamp[u] != clock:
                    stamp[u] = clock
                    count += 1
        c = after[c]
    return count


@kernel
def shares_chain(
    head: np.ndarray, after: np.ndarray, ends: np.ndarray, a: int, b: int, both: np.ndarray
) -> tuple[bool, int]:
    """Whether two nodes are neighbours on a chain, and how many others of it are neighbours of both; `both` is scratch (F,)."""
    joined, common = False, 0
    e = head[a]
    while e >= 0:  # ends: the list of chain ends at a node has no rings
        if ends[e] >= 0:
            both[ends[e ^ 1]] = a
            joined = joined or ends[e ^ 1] == b
        e = after[e]
    e = head[b]
    while e >= 0:  # ends: likewise
        if ends[e] >= 0 and both[ends[e ^ 1]] == a:
            common += 1
        e = after[e]
    e = head[a]
    while e >= 0:  # ends: likewise
        if ends[e] >= 0:
            both[ends[e ^ 1]] = -1
        e = after[e]
    return joined, common


@kernel
def fill_lists(values: np.ndarray, head: np.ndarray, tail: np.ndarray, after: np.ndarray, count: np.ndarray) -> None:
    """Link the places of each node among some values in lists."""
    for c in range(len(values)):
        v = values[c]
        if head[v] < 0:
            head[v] = c
        else:
            after[tail[v]] = c
        tail[v] = c
        count[v] += 1


@kernel
def collapse_edges(
    edges: np.ndarray, held: np.ndarray, triangles: np.ndarray, ends: np.ndarray, into: np.ndarray
) -> None:
    """Collapse edges in turn, again and again until none of those left can be.

    Parameters
    ----------
    edges : (E, 2) those to collapse, in this order
    held : (F,) 0 free, 1 slides on a chain, 2 stays
    triangles : (T, 3) become those that are left, -1 those that are gone
    ends : (2 C,) both ends of each edge of the boundary and lines, side by side; become those left, -1 those gone
    into : (F,) becomes the node that each has become
    """
    nodes = len(held)
    head, tail, count = np.full(nodes, -1), np.full(nodes, -1), np.zeros(nodes, np.int64)
    after = np.full(triangles.size, -1)
    fill_lists(triangles.copy().reshape(triangles.size), head, tail, after, count)
    first, last, links = np.full(nodes, -1), np.full(nodes, -1), np.zeros(nodes, np.int64)
    then = np.full(len(ends), -1)
    fill_lists(ends.copy(), first, last, then, links)
    around_a, around_b, scratch = np.full(nodes, -1), np.full(nodes, -1), np.full(nodes, -1)
    waiting, clock = edges.copy(), 0
    left, before = len(edges), len(edges) + 1
    while left < before:  # ends: each turn leaves fewer edges, or is the last
        before, left = left, 0
        for i in range(before):
            a, b = found(into, waiting[i, 0]), found(into, waiting[i, 1])
            if a == b:
                continue
            if held[b] > held[a] or (held[b] == held[a] and b < a):
                a, b = b, a  # b goes
            clock += 1
            refused = held[b] == 2
            alone, sides, c = True, 0, head[b]
            while c >= 0 and not refused:  # ends: the list of corners at a node has no rings
                t = c // 3
                if triangles[t, 0] >= 0 and (triangles[t, 0] == a or triangles[t, 1] == a or triangles[t, 2] == a):
                    sides += 1
                    for k in range(3):
                        v = triangles[t, k]
                        if v != a and v != b and (count[v] <= 1 or (links[v] == 0 and count[v] <= 3)):
                            alone = False  # a triangle at a corner stays; two triangles would lie on each other
                c = after[c]
            refused = refused or sides == 0 or not alone
            if not refused:
                on_chain, common = shares_chain(first, then, ends, a, b, scratch)
                refused = (held[b] != 0 and not on_chain) or (on_chain and common > 0)
            if not refused:
                of_a = stamp_around(head, after, triangles, a, around_a, clock)
                of_b = stamp_around(head, after, triangles, b, around_b, clock)
                both, c = 0, head[b]
                while c >= 0:  # ends: likewise
                    t = c // 3
                    if triangles[t, 0] >= 0:
                        for k in range(3):
                            v = triangles[t, k]
                            if around_a[v] == clock and around_b[v] == clock:
                                both += 1
                                around_b[v] = -1
                    c = after[c]
                refused = both != sides or of_a + of_b - both < 3 + sides
            if refused:
                waiting[left, 0], waiting[left, 1] = waiting[i, 0], waiting[i, 1]
                left += 1
                continue
            c = head[b]
            while c >= 0:  # ends: likewise
                t = c // 3
                if triangles[t, 0] >= 0:
                    if triangles[t, 0] == a or triangles[t, 1] == a or triangles[t, 2] == a:
                        for k in range(3):
                            count[triangles[t, k]] -= 1
                        triangles[t, 0] = -1
                    else:
                        triangles[t, c % 3] = a
                        count[a] += 1
                c = after[c]
            after[tail[a]] = head[b]
            tail[a], head[b] = tail[b], -1
            e = first[b]
            while e >= 0:  # ends: the list of chain ends at a node has no rings
                if ends[e] >= 0:
                    if ends[e ^ 1] == a:
                        ends[e] = ends[e ^ 1] = -1
                        links[a] -= 1
                    else:
                        ends[e] = a
                        links[a] += 1
                e = then[e]
            if first[b] >= 0:
                if first[a] < 0:
                    first[a] = first[b]
                else:
                    then[last[a]] = first[b]
                last[a], first[b] = last[b], -1
            into[b] = a
