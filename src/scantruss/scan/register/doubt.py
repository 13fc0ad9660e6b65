"""Scans that would fit elsewhere as well: each is tested against all the others together, in every plausible place.

On a shape that looks the same when rotated, or slides on itself, scans agree in a wrong place as well as in the right one, and
nothing in them shows which is which.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from ...runtime.parallel import threaded_map
from .features import find_features
from .graph import Group, apart, links_of
from .pairs import Pair, find_pair, judge_views, settled_from
from .poses import move, small_motion, turn_by
from .scans import Scan
from .views import boxes_around, make_view

AS_GOOD = 0.03  # difference in agreement up to which another place is as good
AS_CLOSE = 1.25  # largest residual there, over the present one
AS_MUCH = 0.2  # least share of the places that agree now which must agree there
LEAST_OF_ALL = 0.08  # least share of all places of the scan which must agree there
OTHER_PLACE_DISTANCE = 1.5  # distance beyond which a place is another one [coarse spacings]
FEWEST_SCANS = 3  # fewest scans that can decide between several ways
SHIFT_OF_DOUBT = 4.0  # distance by which a scan is shifted to see whether it returns [coarse spacings]


def leave_out_doubtful(
    scans: list[Scan], group: Group, sure: set[int], progress: Callable[[str, float], None]
) -> tuple[Group, set[int]]:
    """Split off the scans of a group that fit elsewhere as well; return the rest of the group, and those.

    Scans that only they connected are left out too. With fewer scans others may become ambiguous, so this is repeated; if only
    two of several remain, they cannot decide which way is right.

    Parameters
    ----------
    sure : scans that are not doubted, because their poses were given
    """
    left_out: set[int] = set()
    while len(group.members) > 1:
        asked = [i for i in group.members if i not in sure]
        doubtful = threaded_map(partial(_fits_elsewhere, scans, group), asked, partial(progress, "doubt"))
        found = {i for i, doubt in zip(asked, doubtful, strict=True) if doubt}
        if not found:
            break
        kept = _largest_linked(scans, group, found)
        if len(kept) < FEWEST_SCANS and not sure.issuperset(kept):
            kept = []
        left_out |= set(group.members) - set(kept)
        group = Group(kept, {i: group.poses[i] for i in kept}, {i: group.turns[i] for i in kept})
    return group, left_out


def _largest_linked(scans: list[Scan], group: Group, without: set[int]) -> list[int]:
    """Return the largest set of scans of a group that are linked by overlaps, some scans left out."""
    part = {i: {i} for i in group.members if i not in without}
    for i, j in links_of(scans, group):
        if i in part and j in part and part[i] is not part[j]:
            joined = part[i] | part[j]
            part |= dict.fromkeys(joined, joined)
    largest: set[int] = max(part.values(), key=lambda members: (len(members), -min(members)), default=set())
    return sorted(largest)


def _fits_elsewhere(scans: list[Scan], group: Group, i: int) -> bool:
    """Whether a scan fits the others, taken together, about as well in another place."""
    scan, others = scans[i], _all_but(scans, group, i)
    pose, turn = group.poses[i], group.turns[i]
    now = judge_views(scan.middle, others.middle, pose, turn)

    def is_rival(pair: Pair) -> bool:
        fit = pair.fit
        return (
            apart(pair.pose, pose, scan.coarse) > OTHER_PLACE_DISTANCE * scan.coarse.spacing
            and fit.agreement > now.agreement - AS_GOOD
            and fit.residual < AS_CLOSE * now.residual
            and fit.agreeing > max(AS_MUCH * now.agreeing, 2.0 * LEAST_OF_ALL * len(scan.middle.points))
        )

    for pushed in _pushed(scan, pose):
        if any(map(is_rival, settled_from(scan, others, pushed, turn))):
            return True
    both, features = [scan, others], find_features([scan.coarse, others.coarse])
    return any(map(is_rival, find_pair(both, features, 0, 1, thorough=True)))


def _all_but(scans: list[Scan], group: Group, i: int) -> Scan:
    """Return all scans of a group but one as a single scan in its frame."""
    members = [j for j in group.members if j != i]
    coarse = np.concatenate([move(group.poses[j], scans[j].coarse.points) for j in members])
    normals = np.concatenate([group.turns[j] * turn_by(group.poses[j], scans[j].coarse.normals) for j in members])
    spacing = scans[i].coarse.spacing
    facing = replace(scans[i].coarse, points=coarse, normals=normals, boxes=boxes_around(coarse, 1.5 * spacing))
    points = np.concatenate([move(group.poses[j], scans[j].fine.points) for j in members])
    wide = make_view(points, spacing, facing)
    middle = replace(make_view(points, scans[i].middle.spacing, facing), strict=scans[i].middle.strict)
    return Scan("", scans[i].cloud, wide, middle, middle)


def _pushed(scan: Scan, pose: np.ndarray) -> list[np.ndarray]:
    """Return poses that shift a scan, and rotate it about its centre, both ways along and around three axes."""
    points = move(pose, scan.coarse.points)
    centre = points.mean(axis=0)
    axes = np.linalg.eigh(np.cov((points - centre).T))[1].T
    far = SHIFT_OF_DOUBT * scan.coarse.spacing
    arm = float(np.sqrt(((points - centre) ** 2).sum(axis=1).mean()))
    none = np.zeros(3)
    found = []
    for axis in axes:
        for way in (far, -far):
            found.append(small_motion(none, way * axis, centre) @ pose)
            found.append(small_motion(way / arm * axis, none, centre) @ pose)
    return found
