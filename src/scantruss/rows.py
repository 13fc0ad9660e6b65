"""Rows for the front to advance in: nodes of a lattice that follows a smooth direction field of the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from .boundary import Boundary, Loop, boundary_nodes
from .kernels import rows as kernels
from .kernels.offers import RowNodes
from .kernels.rows import Posts
from .kernels.surface import Surface
from .kernels.vectors import Vector
from .machine import alongside, two_at_once
from .scan.cloud import PointCloud
from .scan.sites import Sites, prepare_sites
from .settings import Settings
from .vectors import dots

APART = 0.55  # distance of the posts, in member lengths
COARSER = 2.0  # how much farther apart the posts of the next level are
FEWEST = 12  # posts of the coarsest level
LINKS = 12  # links of a post
PASSES = 3  # of smoothing, on each level,
MANY = 5000  # whose posts are divided where there are so many
WITHIN = 0.7  # nodes farther from their post are left out, in member lengths
CLOSED = 1.02  # on a surface without boundary the search adds nodes where rows end and takes away none
DISTANCE = 0.6  # nodes offered are at least so far apart, in member lengths


@dataclass(frozen=True)
class Rows:
    """How rows are laid."""

    turn: float = 0.0  #: angle of the rows to the longest side of the boundary, where they start [degree]
    scale: float = 1.0  #: length of their members, in desired lengths


STRAIGHT = Rows()
Levels = tuple[list[Posts], list[np.ndarray], list[tuple[np.ndarray, ...]]]


def lay_rows(boundary: Boundary, length: float, rows: Rows) -> RowNodes:
    """Return the nodes of rows of a length [scan unit], for a front to come to."""
    length *= rows.scale * (1.0 if boundary.loops else CLOSED)
    levels, owners, shares = posts_of(boundary.sites, length)
    start, direction, node = first_row(boundary, length, rows.turn)
    for owner in owners:
        start = int(owner[start])
    kernels.lay_first(levels[-1], start, direction, node, length, np.empty(len(levels[-1].mean), np.int64))
    for smooth in (_smooth_directions, kernels.smooth_lattice):
        for k in range(len(levels) - 1, -1, -1):
            if k < len(levels) - 1:
                kernels.hand_down(levels[k + 1], owners[k + 1], levels[k], length)
            for _ in range(PASSES):
                two_at_once(partial(smooth, levels[k], length), shares[k])
    return _chosen(levels[0], owners[0], length)


def _smooth_directions(posts: Posts, _: float, some: np.ndarray) -> None:
    kernels.smooth_directions(posts, some)


def _chosen(posts: Posts, owner: np.ndarray, length: float) -> RowNodes:
    """Nodes of the finest posts, each once: those nearest to their posts first."""
    away = ((posts.node - posts.mean) ** 2).sum(axis=1)
    order = np.argsort(away, kind="stable")
    order = order[away[order] < (WITHIN * length) ** 2]
    chosen, scratch = np.empty(len(away), np.int64), np.full((3, len(away)), -1, np.int64)
    scratch[0] = 0
    chosen = chosen[: kernels.list_nodes(posts, order, length, DISTANCE * length, chosen, scratch)]
    first = np.empty(len(away), np.int64)
    first[owner[::-1]] = np.arange(len(owner) - 1, -1, -1)
    return RowNodes(posts.node[chosen], posts.normals[chosen], first[chosen], length)


def begin_rows(cloud: PointCloud, settings: Settings) -> None:
    """Begin to make the posts for the rows of a scan, if it gets any, beside the search for its boundary."""
    if settings.method == "default" and not (sites := prepare_sites(cloud, settings)).graded:
        _begin_posts(sites, settings.length)


def _begin_posts(sites: Sites, length: float) -> Callable[[], Levels]:
    surface = sites.surface
    if length not in sites.posts:
        sites.posts[length] = alongside(lambda: make_levels(surface, length))
    return sites.posts[length]


def posts_of(sites: Sites, length: float) -> Levels:
    """Return `make_levels`, made once for all rows of a length [scan unit], with directions and lattices of one's own."""
    levels, owners, shares = _begin_posts(sites, length)()
    own = [p._replace(direction=p.direction.copy(), node=p.node.copy(), mark=p.mark.copy()) for p in levels]
    return own, owners, shares


def make_levels(surface: Surface, length: float) -> Levels:
    """Return posts from fine to coarse, for each level the post of each place of the level below (sites at first), and its shares."""
    mean, normals, neighbors = surface.mean, surface.normals, surface.neighbors
    levels: list[Posts] = []
    owners: list[np.ndarray] = []
    radius = APART * length
    while True:
        owner, chosen = np.full(len(mean), -1, np.int64), np.empty(len(mean), np.int64)
        count = kernels.choose_posts(mean, neighbors, radius, owner, chosen, np.full((2, len(mean)), -1, np.int64))
        if levels and (count < FEWEST or count > 0.8 * len(mean)):
            return levels, owners, [_shares(posts) for posts in levels]
        posts = Posts(
            np.zeros((count, 3)), np.zeros((count, 3)), np.full((count, LINKS), -1, np.int64),
            np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count, np.int64),
        )  # fmt: skip
        kernels.link_posts(mean, normals, neighbors, owner, posts)
        levels.append(posts)
        owners.append(owner)
        mean, normals, neighbors = posts.mean, posts.normals, posts.neighbors
        radius *= COARSER


def _shares(posts: Posts) -> tuple[np.ndarray, ...]:
    """Posts that two threads may smooth at once, and those between, which depend on both; few posts are not divided."""
    count = len(posts.mean)
    if count < MANY:
        return (np.arange(count),)
    away, queue = np.empty((2, count), np.int64), np.empty(count, np.int64)
    end = kernels.links_away(posts.neighbors, 0, away[0], queue)  # of the links, not of where the scan lies
    kernels.links_away(posts.neighbors, kernels.links_away(posts.neighbors, end, away[0], queue), away[1], queue)
    ahead = away[0] - away[1]
    late = ahead > np.median(ahead)
    across = (posts.neighbors >= 0) & (late[posts.neighbors] != late[:, None])
    between = across.any(axis=1)
    between[posts.neighbors[across]] = True
    return np.flatnonzero(~late & ~between), np.flatnonzero(late & ~between), np.flatnonzero(between)


def first_row(boundary: Boundary, length: float, turn: float) -> tuple[int, Vector, Vector]:
    """Return the site, the direction and the node where the rows start: in the middle of the longest side of the boundary.

    On a closed surface they start anywhere.
    """
    surface = boundary.sites.surface
    if not boundary.loops:
        site = int(np.flatnonzero(boundary.sites.piece == boundary.sites.pieces[0])[0])
        ahead, place = surface.mean[max(surface.neighbors[site, 0], 0)] - surface.mean[site], surface.mean[site]
    else:
        loop, at = longest_side(boundary.loops)
        count = len(loop.points)
        nodes, _ = boundary_nodes(loop, length)
        middle = loop.points[at]
        place = nodes[((nodes - middle) ** 2).sum(axis=1).argmin()]
        half = min(round(length / np.linalg.norm(loop.points[(at + 1) % count] - middle)), count // 4)
        ahead = loop.points[(at + half) % count] - loop.points[at - half]
        arm = surface.mean - place
        site = int(dots(arm, arm).argmin())
    normal = surface.normals[site]
    ahead = ahead - normal * (ahead @ normal)
    angle = np.radians(turn)
    ahead = np.cos(angle) * ahead + np.sin(angle) * np.cross(normal, ahead)
    return site, (*ahead.tolist(),), (*place.tolist(),)


def longest_side(loops: tuple[Loop, ...]) -> tuple[Loop, int]:
    """Return the loop that has the longest side between two corners, and the point in the middle of that side."""
    best, found = -1.0, (loops[0], 0)
    for loop in loops:
        ends = loop.corner_at if len(loop.corner_at) else np.zeros(1, np.int64)
        sides = np.diff(ends, append=ends[:1] + len(loop.points))
        longest = int(sides.argmax())
        share = loop.length * sides[longest] / len(loop.points)
        if share > best:
            best, found = share, (loop, int(ends[longest] + sides[longest] // 2) % len(loop.points))
    return found


def nodes_at(positions: np.ndarray, surface: Surface, length: float) -> RowNodes:
    """Return nodes at appointed positions (K, 3) [scan unit] for a front to come to; those far from the scan are left out."""
    sites = np.array([((surface.mean - place) ** 2).sum(axis=1).argmin() for place in positions], np.int64)
    near = np.linalg.norm(surface.mean[sites] - positions, axis=1) < length
    return RowNodes(np.ascontiguousarray(positions[near]), surface.normals[sites[near]], sites[near], length)
