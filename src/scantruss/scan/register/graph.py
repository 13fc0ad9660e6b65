"""The pose graph: scans joined pair by pair, the surest pairs first; a pair that contradicts earlier ones is rejected.

Joined scans are a group. A pair between two groups puts every scan of one over every scan of the other, and all of them must
agree: that distinguishes a wrong pair, which may look right on its own, from a right one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...kernels.scan.overlap import MOTION_NUMBERS
from .fine import Fit, add_pairs, judge_pair, solve_step
from .pairs import DISAGREEING_DISTANCE, Pair, judge_views, nearness
from .poses import invert, move, small_motion
from .scans import Scan
from .views import View

SURE_AGREEMENT = 0.88  # agreement of two groups at which they belong together
AGREEING_SHARE = 0.08  # share of the smaller group's places that must agree
CONTRADICTING_AGREEMENT = 0.6  # agreement of two overlapping scans below which they contradict a pair of groups
CONTRADICTED_SHARE = 0.08  # least share of the places of the smaller one for that to count
CLEAR_LEAD = 0.03  # difference in agreement by which one way is clearly better than another
MOST_WAYS = 12  # pairs that are tried between two groups
LINKING_OVERLAP = 0.02  # least overlap by which two scans are connected
PLACES_PER_STEP = 2000  # places of a scan used in a step of all scans


@dataclass
class Group:
    """Scans in one frame."""

    members: list[int]
    poses: dict[int, np.ndarray]  #: (4, 4) into the frame of the group
    turns: dict[int, float]  #: 1, or -1 for those whose normals face the other side


def assemble_poses(
    scans: list[Scan], pairs: list[Pair], progress: Callable[[str, float], None]
) -> tuple[list[Group], set[int]]:
    """Return the groups formed by the pairs, the largest first, and the scans that fit in more ways than one.

    Two groups that fit in several ways, as parts of a symmetric shape do, wait until others decide.
    """
    group_of = {i: Group([i], {i: np.eye(4)}, {i: 1.0}) for i in range(len(scans))}
    waiting = sorted(pairs, key=lambda pair: (-pair.fit.score, pair.first, pair.second))
    # pairs of groups that could not be joined, and whether because of too many ways
    tried: dict[tuple[int, ...], bool] = {}
    at = 0
    while at < len(waiting):
        progress("assemble", 1.0 - len({id(group) for group in group_of.values()}) / len(scans))
        one, other = (group_of[k] for k in (waiting[at].first, waiting[at].second))
        key = (*one.members, -1, *other.members)
        at += 1
        if one is other or key in tried:
            continue
        ways = _ways(scans, one, other, [pair for pair in waiting if _links(pair, one, other)])
        if len(ways) == 1:
            group_of |= dict.fromkeys(ways[0].members, ways[0])
            at = 0  # what two scans could not decide, groups may
        else:
            tried[key] = tried[(*other.members, -1, *one.members)] = len(ways) > 1
    groups = sorted(
        {id(group): group for group in group_of.values()}.values(), key=lambda g: (-len(g.members), min(g.members))
    )
    doubtful = set()
    for key, several in tried.items():
        members = [tuple(group.members) for group in groups]
        middle = key.index(-1)
        if several and key[:middle] in members and key[middle + 1 :] in members:
            doubtful |= set(key) - {-1}
    return groups, doubtful


def _links(pair: Pair, one: Group, other: Group) -> bool:
    """Whether a pair is between two groups."""
    return (pair.first in one.members and pair.second in other.members) or (
        pair.second in one.members and pair.first in other.members
    )


def _ways(scans: list[Scan], one: Group, other: Group, pairs: list[Pair]) -> list[Group]:
    """Return the different ways to join two groups that are about equally good, the best first."""
    found: list[tuple[Fit, Group]] = []
    for pair in pairs[:MOST_WAYS]:
        if any(agree_on_pose(pair, whole, scans) for _, whole in found):
            continue
        joined = _join(scans, one, other, pair) if pair.first in one.members else _join(scans, other, one, pair)
        if joined is not None and not any(_is_same(joined[1], whole, one, other, scans) for _, whole in found):
            found.append(joined)
    found.sort(key=lambda way: -way[0].score)
    return [whole for fit, whole in found if _rivals(fit, found[0][0])]


def _rivals(fit: Fit, best: Fit) -> bool:
    """Whether a way agrees about as well as the best, however large its overlap."""
    return (
        fit.agreement > best.agreement - CLEAR_LEAD
        and fit.residual < (1.0 + 8.0 * CLEAR_LEAD) * best.residual
        and fit.agreeing > 0.4 * best.agreeing
    )


def agree_on_pose(pair: Pair, whole: Group, scans: list[Scan]) -> bool:
    """Whether two scans of a group lie as a pair has them."""
    lies = invert(whole.poses[pair.second]) @ whole.poses[pair.first]
    return apart(lies, pair.pose, scans[pair.first].coarse) < 1.5 * scans[pair.first].coarse.spacing


def _is_same(whole: Group, before: Group, one: Group, other: Group, scans: list[Scan]) -> bool:
    """Whether two joined groups have the same relative pose."""
    i, j = one.members[0], other.members[0]
    lies, lay = (invert(group.poses[j]) @ group.poses[i] for group in (whole, before))
    return apart(lies, lay, scans[i].coarse) < 1.5 * scans[i].coarse.spacing


def apart(one: np.ndarray, other: np.ndarray, view: View) -> float:
    """Return the root mean square distance between the places of a view under two poses [scan unit]."""
    points = view.points[:: max(len(view.points) // 100, 1)]
    return float(np.sqrt(((move(one, points) - move(other, points)) ** 2).sum(axis=1).mean()))


def _join(scans: list[Scan], one: Group, other: Group, pair: Pair) -> tuple[Fit, Group] | None:
    """Return both groups joined by the pair in the frame of the second, and how they agree; None if they do not."""
    into = other.poses[pair.second] @ pair.pose @ invert(one.poses[pair.first])
    turn = other.turns[pair.second] * pair.turn * one.turns[pair.first]
    poses = {i: into @ one.poses[i] for i in one.members} | other.poses
    turns = {i: turn * one.turns[i] for i in one.members} | other.turns
    whole = Group(sorted(one.members + other.members), poses, turns)
    if _fit_between(scans, whole, one, other, loose=True) is None:
        return None
    settle_poses(scans, whole, [scan.middle for scan in scans], (2.0, 1.0), steps=4)
    fit = _fit_between(scans, whole, one, other, loose=False)
    return None if fit is None else (fit, whole)


def _fit_between(scans: list[Scan], whole: Group, one: Group, other: Group, *, loose: bool) -> Fit | None:
    """Return how the scans of two joined groups agree, None if they do not.

    loose : before they are aligned with each other
    """
    fits = []
    for i in one.members:
        for j in other.members:
            fit = fit_of(scans, whole, i, j)
            over = (fit.agreeing + fit.against) / (2.0 * min(len(scans[k].middle.points) for k in (i, j)))
            if over > CONTRADICTED_SHARE and fit.agreement < (0.5 if loose else 1.0) * CONTRADICTING_AGREEMENT:
                return None
            fits.append(fit)
    agreeing, against = sum(fit.agreeing for fit in fits), sum(fit.against for fit in fits)
    squares = sum(fit.residual**2 * fit.agreeing for fit in fits)
    near = max(fit.near for fit in fits)
    all_of_them = Fit(agreeing, against, 0.0, math.sqrt(squares / max(agreeing, 1)), near, 0.0)
    smaller = min(
        sum(len(scans[i].middle.points) for i in group.members) / len(group.members) for group in (one, other)
    )
    if agreeing <= 2.0 * AGREEING_SHARE * smaller or all_of_them.agreement < (0.6 if loose else SURE_AGREEMENT):
        return None
    return all_of_them


def fit_of(scans: list[Scan], group: Group, first: int, second: int) -> Fit:
    """Return how two scans of a group agree."""
    pose = invert(group.poses[second]) @ group.poses[first]
    return judge_views(scans[first].middle, scans[second].middle, pose, group.turns[first] * group.turns[second])


def fine_fit_of(scans: list[Scan], group: Group, first: int, second: int) -> Fit:
    """Return how the fine views of two scans of a group agree, within the distance used for the middle views."""
    one, other = scans[first], scans[second]
    pose = invert(group.poses[second]) @ group.poses[first]
    near, reach = nearness(one.middle, other.middle), DISAGREEING_DISTANCE * one.middle.spacing
    return judge_pair(one.fine, other.fine, pose, group.turns[first] * group.turns[second], near, reach)


def links_of(scans: list[Scan], group: Group, *, against: bool = False) -> dict[tuple[int, int], Fit]:
    """Return how overlapping scans of a group agree, pair by pair; with `against` also overlaps without agreement."""
    pairs = pairs_as_they_lie(scans, group)
    return {(p.first, p.second): p.fit for p in pairs if (p.fit.over if against else p.fit.share) >= LINKING_OVERLAP}


def pairs_as_they_lie(scans: list[Scan], group: Group) -> list[Pair]:
    """Return every two scans of a group as a pair."""
    found = []
    for place, j in enumerate(group.members):
        for i in group.members[:place]:
            turn = group.turns[i] * group.turns[j]
            pose = invert(group.poses[j]) @ group.poses[i]
            found.append(Pair(i, j, pose, turn, fit_of(scans, group, i, j)))
    return found


def settle_poses(
    scans: list[Scan],
    group: Group,
    views: list[View],
    reaches: tuple[float, ...],
    *,
    steps: int,
    few: int = PLACES_PER_STEP,
    progress: Callable[[float], None] = lambda share: None,
) -> None:
    """Move all scans of a group at once so that overlapping ones agree best (generalized ICP of all pairs); the first stays.

    Pairs are weighted by the square of their overlap: scans with little overlap see what they share at a flat angle, where
    scanners are least exact.

    reaches : distances within which places are paired, one after the other, in spacings of the views
    """
    links = links_of(scans, group)
    if not links:
        return
    place = {i: k for k, i in enumerate(group.members)}
    centres = {i: group.poses[i][:3, :3] @ views[i].points.mean(axis=0) + group.poses[i][:3, 3] for i in group.members}
    centre = np.mean(list(centres.values()), axis=0)[None]
    size = max(float(np.linalg.norm(np.ptp(views[i].points, axis=0))) for i in group.members)
    for turn, reach in enumerate(reaches):
        for step in range(steps):
            progress((turn * steps + step) / (len(reaches) * steps))
            moves = _step(group, views, links, place, reach, centre, size, few)
            for i, k in place.items():
                if k > 0:
                    group.poses[i] = small_motion(moves[k, :3], moves[k, 3:], centre[0]) @ group.poses[i]
            spacing = views[group.members[0]].spacing
            if (
                np.linalg.norm(moves[:, :3], axis=1) * size + np.linalg.norm(moves[:, 3:], axis=1)
            ).max() < 2e-3 * spacing:
                break


def _step(
    group: Group,
    views: list[View],
    links: dict[tuple[int, int], Fit],
    place: dict[int, int],
    reach: float,
    centre: np.ndarray,
    size: float,
    few: int,
) -> np.ndarray:
    """Return rotation and translation (M, 6) of each scan of a group in one step; those of the first are 0."""
    count = len(group.members)
    stiffness, load = np.zeros((6 * count, 6 * count)), np.zeros(6 * count)
    for (i, j), fit in links.items():
        sums = np.zeros((7, 7))
        a, b = views[i], views[j]
        turn = group.turns[i] * group.turns[j]
        every = max(min(len(a.points), len(b.points)) // few, 1)
        add_pairs(sums, a, b, group.poses[i], group.poses[j], turn, reach * a.spacing, centre, every)
        sums *= fit.share**2
        p, q = (slice(6 * place[k], 6 * place[k] + 6) for k in (i, j))
        stiffness[p, p] += sums[:MOTION_NUMBERS, :MOTION_NUMBERS]
        stiffness[q, q] += sums[:MOTION_NUMBERS, :MOTION_NUMBERS]
        stiffness[p, q] -= sums[:MOTION_NUMBERS, :MOTION_NUMBERS]
        stiffness[q, p] -= sums[:MOTION_NUMBERS, :MOTION_NUMBERS]
        load[p] += sums[:MOTION_NUMBERS, MOTION_NUMBERS]
        load[q] -= sums[:MOTION_NUMBERS, MOTION_NUMBERS]
    moves = np.zeros((count, 6))
    if count > 1:
        moves[1:] = solve_step(stiffness[6:, 6:], load[6:], 0.5 * size).reshape(-1, 6)
    return moves
