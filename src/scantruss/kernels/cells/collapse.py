"""Edges of a mesh are collapsed one by one, while it stays a manifold with its boundary and lines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from .quads import FREE_NODE, RESTING_NODE


class NodeLists(NamedTuple):
    """Where each node stands among some values, in lists without rings."""

    head: np.ndarray  #: (F,) first place of a node, -1: none
    tail: np.ndarray  #: (F,) last place of it
    after: np.ndarray  #: (N,) next place of the same node, -1: none
    places: np.ndarray  #: (F,) how many they are


class CollapsingMesh(NamedTuple):
    """Triangles whose edges are collapsed, and the edges of their boundary and lines."""

    held: np.ndarray  #: (F,) FREE_NODE, SLIDING_NODE or RESTING_NODE
    triangles: np.ndarray  #: (T, 3), -1 first where one is gone
    corners: NodeLists  #: of the triangles
    ends: np.ndarray  #: (2 C,) both ends of each edge of the boundary and lines, side by side; -1 where one is gone
    links: NodeLists  #: of the ends
    around_a: np.ndarray  #: (F,) scratch, as the next two: the last collapse that has the node around its first node,
    around_b: np.ndarray  #: around its second node,
    on_chain_of: np.ndarray  #: or the node with which it is linked
    clock: np.ndarray  #: (1,) collapses tried


@kernel
def node_lists(values: np.ndarray, nodes: int) -> NodeLists:
    """List the places of each node among some values (N,)."""
    lists = NodeLists(
        np.full(nodes, -1), np.full(nodes, -1), np.full(len(values), -1), np.zeros(nodes, np.int64)
    )  # fmt: skip
    for c in range(len(values)):
        v = values[c]
        if lists.head[v] < 0:
            lists.head[v] = c
        else:
            lists.after[lists.tail[v]] = c
        lists.tail[v] = c
        lists.places[v] += 1
    return lists


@kernel
def join_lists(lists: NodeLists, a: int, b: int) -> None:
    """Give all places of node b to node a."""
    if lists.head[b] < 0:
        return
    if lists.head[a] < 0:
        lists.head[a] = lists.head[b]
    else:
        lists.after[lists.tail[a]] = lists.head[b]
    lists.tail[a], lists.head[b] = lists.tail[b], -1


@kernel
def found(into: np.ndarray, v: int) -> int:
    """Node that a node has become; shortens the way there."""
    while into[v] != v:  # ends: each was collapsed into one that was there later
        into[v] = into[into[v]]
        v = into[v]
    return v


@kernel
def has_corner(mesh: CollapsingMesh, t: int, v: int) -> bool:
    """Whether a node is a corner of a triangle."""
    return mesh.triangles[t, 0] == v or mesh.triangles[t, 1] == v or mesh.triangles[t, 2] == v


@kernel
def stamp_around(mesh: CollapsingMesh, v: int, stamp: np.ndarray) -> int:
    """Stamp the neighbours of a node with the clock; returns how many they are."""
    count, c = 0, mesh.corners.head[v]
    while c >= 0:  # ends: the list has no rings
        t = c // 3
        if mesh.triangles[t, 0] >= 0:
            for k in range(3):
                u = mesh.triangles[t, k]
                if u != v and stamp[u] != mesh.clock[0]:
                    stamp[u] = mesh.clock[0]
                    count += 1
        c = mesh.corners.after[c]
    return count


@kernel
def shares_chain(mesh: CollapsingMesh, a: int, b: int) -> tuple[bool, int]:
    """Whether two nodes are neighbours on a chain, and how many others of it are neighbours of both."""
    ends, links, of = mesh.ends, mesh.links, mesh.on_chain_of
    joined, common = False, 0
    e = links.head[a]
    while e >= 0:  # ends: the list has no rings
        if ends[e] >= 0:
            of[ends[e ^ 1]] = a
            joined = joined or ends[e ^ 1] == b
        e = links.after[e]
    e = links.head[b]
    while e >= 0:  # ends: likewise
        if ends[e] >= 0 and of[ends[e ^ 1]] == a:
            common += 1
        e = links.after[e]
    e = links.head[a]
    while e >= 0:  # ends: likewise
        if ends[e] >= 0:
            of[ends[e ^ 1]] = -1
        e = links.after[e]
    return joined, common


@kernel
def sides_of_edge(mesh: CollapsingMesh, a: int, b: int) -> int:
    """How many triangles an edge has; 0 where one of them is at a corner or two would come to lie on each other."""
    sides, c, count, links = 0, mesh.corners.head[b], mesh.corners.places, mesh.links.places
    while c >= 0:  # ends: the list has no rings
        t = c // 3
        if mesh.triangles[t, 0] >= 0 and has_corner(mesh, t, a):
            sides += 1
            for k in range(3):
                v = mesh.triangles[t, k]
                if v != a and v != b and (count[v] <= 1 or (links[v] == 0 and count[v] <= 3)):
                    return 0
        c = mesh.corners.after[c]
    return sides


@kernel
def may_collapse_edge(mesh: CollapsingMesh, a: int, b: int) -> bool:
    """Whether node b may become node a: the mesh stays a manifold, and a node of a chain goes along it."""
    if mesh.held[b] == RESTING_NODE:
        return False
    sides = sides_of_edge(mesh, a, b)
    if sides == 0:
        return False
    on_chain, common = shares_chain(mesh, a, b)
    if (mesh.held[b] != FREE_NODE and not on_chain) or (on_chain and common > 0):
        return False
    mesh.clock[0] += 1
    of_a, of_b = stamp_around(mesh, a, mesh.around_a), stamp_around(mesh, b, mesh.around_b)
    both, c = 0, mesh.corners.head[b]
    while c >= 0:  # ends: the list has no rings
        t = c // 3
        if mesh.triangles[t, 0] >= 0:
            for k in range(3):
                v = mesh.triangles[t, k]
                if mesh.around_a[v] == mesh.clock[0] and mesh.around_b[v] == mesh.clock[0]:
                    both += 1
                    mesh.around_b[v] = -1
        c = mesh.corners.after[c]
    return both == sides and of_a + of_b - both >= 3 + sides


@kernel
def collapse_edge(mesh: CollapsingMesh, a: int, b: int) -> None:
    """Let node b become node a, with all of its triangles and links but those at the edge."""
    triangles, ends, count, links = mesh.triangles, mesh.ends, mesh.corners.places, mesh.links.places
    c = mesh.corners.head[b]
    while c >= 0:  # ends: the list has no rings
        t = c // 3
        if triangles[t, 0] >= 0:
            if has_corner(mesh, t, a):
                for k in range(3):
                    count[triangles[t, k]] -= 1
                triangles[t, 0] = -1
            else:
                triangles[t, c % 3] = a
                count[a] += 1
        c = mesh.corners.after[c]
    e = mesh.links.head[b]
    while e >= 0:  # ends: likewise
        if ends[e] >= 0:
            if ends[e ^ 1] == a:
                ends[e] = ends[e ^ 1] = -1
                links[a] -= 1
            else:
                ends[e] = a
                links[a] += 1
        e = mesh.links.after[e]
    join_lists(mesh.corners, a, b)
    join_lists(mesh.links, a, b)


@kernel
def collapse_edges(
    edges: np.ndarray, held: np.ndarray, triangles: np.ndarray, ends: np.ndarray, into: np.ndarray
) -> None:
    """Collapse edges in turn, again and again until none of those left can be.

    Parameters
    ----------
    edges : (E, 2) those to collapse, in this order
    held, triangles, ends : as in `CollapsingMesh`; become what is left
    into : (F,) becomes the node that each has become
    """
    nodes = len(held)
    mesh = CollapsingMesh(
        held, triangles, node_lists(triangles.copy().reshape(triangles.size), nodes), ends, node_lists(ends, nodes),
        np.full(nodes, -1), np.full(nodes, -1), np.full(nodes, -1), np.zeros(1, np.int64),
    )  # fmt: skip
    waiting = edges.copy()
    left, before = len(edges), len(edges) + 1
    while left < before:  # ends: each turn leaves fewer edges, or is the last
        before, left = left, 0
        for i in range(before):
            a, b = found(into, waiting[i, 0]), found(into, waiting[i, 1])
            if a == b:
                continue
            if held[b] > held[a] or (held[b] == held[a] and b < a):
                a, b = b, a  # b goes
            if may_collapse_edge(mesh, a, b):
                collapse_edge(mesh, a, b)
                into[b] = a
            else:
                waiting[left, 0], waiting[left, 1] = waiting[i, 0], waiting[i, 1]
                left += 1
