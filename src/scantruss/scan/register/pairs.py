"""Pairs of scans: the few poses in which two of them agree well enough to be considered."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

import numpy as np

from ...runtime.parallel import threaded_map
from .fine import Fit, align, judge_pair
from .matching import find_candidates
from .scans import Scan
from .views import View

POSES_JUDGED = 40  # poses from the features that are judged without alignment
POSES_ALIGNED = 10  # poses that are aligned, the best of those
POSES_REFINED = 4  # poses that are aligned closely, the best of these
LEAST_SCORE_SHARE = 0.2  # least score of a pose that is aligned closely, as a share of the best
PLACES_FOR_ALIGNMENT = 800  # places of a scan that suffice to align it
POSES_KEPT = 3  # poses of a pair that are handed on
GOOD_AGREEMENT = 0.9  # agreement above which the other side of the normals is not tried
SURE_SIDE = 0.6  # certainty that normals face outwards above which the other side is not tried
LEAST_OVERLAP = 0.03  # overlap below which a pair is not considered
LEAST_AGREEMENT = 0.6  # agreement below which a pair is not considered
NOISES_WITHIN = 3.0  # distance within which two scans agree, in the noise of both together
# least distance within which two scans agree, in spacings of the view; scanners distort slightly
LEAST_AGREEING_DISTANCE = 0.15
LARGEST_AGREEING_DISTANCE = 0.5  # largest distance within which two scans agree, in spacings of the view
RESIDUALS_WITHIN = 3.0  # distance within which two scans agree, in residuals of pairs taken as right
LEAST_DISTANCE_SHARE = 0.35  # least share of their usual distance to which the residuals reduce it
DISAGREEING_DISTANCE = 3.0  # distance up to which they disagree, in spacings; beyond, they may be two sides of a body


@dataclass(frozen=True, eq=False)
class Pair:
    """Two scans and a pose in which they agree."""

    first: int
    second: int
    pose: np.ndarray  #: (4, 4) from the frame of the first scan to that of the second
    turn: float  #: 1, or -1 if the normals of the two face opposite sides
    fit: Fit


def nearness(first: View, second: View) -> float:
    """Return the distance across the surface within which two scans agree [scan unit]."""
    noise = NOISES_WITHIN * math.hypot(first.noise, second.noise)
    return min(max(noise, LEAST_AGREEING_DISTANCE * first.spacing), LARGEST_AGREEING_DISTANCE * first.spacing) * min(
        first.strict, second.strict
    )


def judge_views(first: View, second: View, pose: np.ndarray, turn: float) -> Fit:
    """Return how two views agree under a pose (4, 4)."""
    return judge_pair(first, second, pose, turn, nearness(first, second), DISAGREEING_DISTANCE * first.spacing)


def find_pairs(
    scans: list[Scan],
    features: list[np.ndarray],
    wanted: Iterable[tuple[int, int]],
    progress: Callable[[str, float], None],
) -> list[Pair]:
    """Return the plausible pairs, up to `POSES_KEPT` for two scans; `wanted` selects the two."""

    def plausible(two: tuple[int, int]) -> list[Pair]:
        return find_pair(scans, features, *two)

    return list(chain.from_iterable(threaded_map(plausible, list(wanted), partial(progress, "match"))))


def find_pair(
    scans: list[Scan], features: list[np.ndarray], first: int, second: int, *, thorough: bool = False
) -> list[Pair]:
    """Return the plausible poses of two scans, the best first.

    thorough : try more poses, and both sides of the normals even if one is known or does well
    """
    one, other = scans[first], scans[second]
    found: list[Pair] = []
    # then the normals of both face outside
    sure = not thorough and min(one.coarse.bulge, other.coarse.bulge) > SURE_SIDE
    for turn in (1.0,) if sure else (1.0, -1.0):
        candidates = find_candidates(one.coarse, other.coarse, features[first], features[second], turn, POSES_JUDGED)
        poses = _best(one, other, [candidate.pose for candidate in candidates], turn, 0.8)[:POSES_ALIGNED]
        poses = [_roughly(one, other, pose, turn) for pose in poses]
        for pose in _best(one, other, poses, turn, 0.35)[: None if thorough else POSES_REFINED]:
            found += closer(one, other, first, second, pose, turn)
        if not thorough and any(
            pair.fit.agreement > GOOD_AGREEMENT and pair.fit.share > 3.0 * LEAST_OVERLAP for pair in found
        ):
            break
    found.sort(key=lambda pair: -pair.fit.score)
    return _different(found, one.coarse)[: None if thorough else POSES_KEPT]


def _roughly(one: Scan, other: Scan, pose: np.ndarray, turn: float) -> np.ndarray:
    """Return the pose after alignment of the coarse views."""
    reach = one.coarse.spacing
    return align(one.coarse, other.coarse, pose, turn, (2.0 * reach, reach), PLACES_FOR_ALIGNMENT, 6)


def settled_from(one: Scan, other: Scan, pose: np.ndarray, turn: float) -> list[Pair]:
    """Return the pair of two scans after alignment from a pose; nothing if they do not agree then."""
    return closer(one, other, 0, 1, _roughly(one, other, pose, turn), turn)


def _best(one: Scan, other: Scan, poses: list[np.ndarray], turn: float, near: float) -> list[np.ndarray]:
    """Return the better poses, best first, by the agreement of the coarse views within `near` spacings."""
    spacing = one.coarse.spacing
    scores = [
        judge_pair(one.coarse, other.coarse, pose, turn, near * spacing, DISAGREEING_DISTANCE * spacing).score
        for pose in poses
    ]
    order = sorted(range(len(poses)), key=lambda k: -scores[k])
    return [poses[k] for k in order if scores[k] > LEAST_SCORE_SHARE * scores[order[0]]]


def with_strictness(scans: list[Scan], pairs: list[Pair]) -> list[Scan]:
    """Return the scans with the strictness that the best pairs allow: right pairs may agree far better than the default.

    Among the best pairs of each scan, those with the smaller residuals are taken as right.
    """
    best: dict[int, tuple[float, float]] = {}
    for pair in pairs:
        if pair.fit.share > 3.0 * LEAST_OVERLAP:
            for k in (pair.first, pair.second):
                best[k] = max(best.get(k, (0.0, 0.0)), (pair.fit.score, pair.fit.residual / pair.fit.near))
    ratios = sorted(ratio for _, ratio in best.values())
    strict = min(max(RESIDUALS_WITHIN * ratios[(len(ratios) - 1) // 3], LEAST_DISTANCE_SHARE), 1.0) if ratios else 1.0
    return [replace(scan, middle=replace(scan.middle, strict=strict)) for scan in scans]


def rejudge(pairs: list[Pair], scans: list[Scan]) -> list[Pair]:
    """Return the pairs that still agree with the present views."""
    found = []
    for pair in pairs:
        fit = judge_views(scans[pair.first].middle, scans[pair.second].middle, pair.pose, pair.turn)
        if fit.share >= LEAST_OVERLAP and fit.agreement >= LEAST_AGREEMENT:
            found.append(replace(pair, fit=fit))
    return found


def closer(one: Scan, other: Scan, first: int, second: int, pose: np.ndarray, turn: float) -> list[Pair]:
    """Return the pair after close alignment from a pose nearby; nothing if they do not agree."""
    reach = one.middle.spacing
    pose = align(one.middle, other.middle, pose, turn, (2.0 * reach, reach), 2 * PLACES_FOR_ALIGNMENT)
    fit = judge_views(one.middle, other.middle, pose, turn)
    if fit.share < LEAST_OVERLAP or fit.agreement < LEAST_AGREEMENT:
        return []
    return [Pair(first, second, pose, turn, fit)]


def _different(found: list[Pair], view: View) -> list[Pair]:
    """Return the pairs that put the first scan into different places."""
    kept: list[Pair] = []
    arm = float(np.linalg.norm(np.ptp(view.points, axis=0)))
    centre = np.append(view.points.mean(axis=0), 1.0)
    for pair in found:
        for other in kept:
            moved = np.linalg.norm((pair.pose - other.pose) @ centre)
            turned = np.linalg.norm(pair.pose[:3, :3] - other.pose[:3, :3]) * arm
            if moved + turned < 2.0 * view.spacing:
                break
        else:
            kept.append(pair)
    return kept
