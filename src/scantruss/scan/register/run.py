"""From scans in frames of their own to one cloud in one frame."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...runtime.progress import Progress
from ..cloud import PointCloud
from .doubt import leave_out_doubtful
from .features import find_features
from .fine import Fit, align
from .graph import (
    CONTRADICTING_AGREEMENT,
    Group,
    agree_on_pose,
    assemble_poses,
    fine_fit_of,
    fit_of,
    links_of,
    pairs_as_they_lie,
    settle_poses,
)
from .merge import merge_scans
from .pairs import Pair, closer, find_pairs, rejudge, with_strictness
from .poses import invert, make_pose
from .scans import Scan, prepare_scans


@dataclass(frozen=True, eq=False)
class PairFit:
    """How two scans agree in the end."""

    first: str
    second: str
    overlap: float  #: share of the places of one scan that lie on the other, the larger of the two
    agreement: float  #: share of the places over the other scan that lie on it
    residual: float | None  #: root of the mean squared distance of what agrees [scan unit]; None if nothing does


@dataclass(frozen=True, eq=False)
class Splice:
    """Scans in one frame: that of the first scan that fits."""

    cloud: PointCloud  #: all of them merged
    poses: dict[str, np.ndarray]  #: (4, 4) from each scan's own frame to the common one
    pairs: tuple[PairFit, ...]  #: of all scans that overlap
    left_out: tuple[str, ...]  #: scans that fit nowhere
    doubtful: tuple[str, ...]  #: those of them that fit in more ways than one
    kept: dict[str, int]  #: points that each scan contributes
    spacing: float  #: typical spacing of the scans [scan unit]
    unit: str

    @property
    def contradicting(self) -> tuple[PairFit, ...]:
        """Pairs that overlap without agreeing; only with poses used as given."""
        return tuple(pair for pair in self.pairs if pair.agreement < CONTRADICTING_AGREEMENT)

    @property
    def alone(self) -> tuple[str, ...]:
        """Scans that agree with no other; only with poses used as given."""
        agreeing = {
            name
            for pair in self.pairs
            if pair.agreement >= CONTRADICTING_AGREEMENT
            for name in (pair.first, pair.second)
        }
        return tuple(name for name in self.poses if name not in agreeing)

    @property
    def frame(self) -> str:
        """Name of the scan whose frame is the common one; "" if it is that of poses used as given."""
        return next((name for name, pose in self.poses.items() if np.array_equal(pose, np.eye(4))), "")


def splice_scans(
    clouds: Sequence[PointCloud],
    names: Sequence[str] = (),
    *,
    poses: Mapping[str, np.ndarray] | None = None,
    use_poses: bool = False,
    progress: Progress = lambda stage, share: None,
) -> Splice:
    """Put overlapping scans into one frame and merge them.

    Parameters
    ----------
    clouds : scans in frames of their own, in one unit, in any order
    names : their names, all different; by default those of the clouds; optional
    poses : mapping of str to (4, 4) array, optional
        Poses by name to start from, for all scans or some.
    use_poses : take these poses as they are; all scans need one then
    progress : called with the stage and its share done, 0 to 1

    Returns
    -------
    Splice
        The same for the same scans in any order, but for the frame: that of the first scan that fits.

    Raises
    ------
    InputError
        Fewer than two scans, or most of them fit nowhere.
    """
    names = _checked_names(clouds, names)
    poses = poses or {}
    given = [poses.get(name, poses.get(Path(name).name)) for name in names]  # a pose is found by the last part too
    if use_poses and any(pose is None for pose in given):
        missing = ", ".join(name for name, pose in zip(names, given, strict=True) if pose is None)
        raise InputError(f"no pose is given for {missing}; a pose for every scan is needed to use them as they are")
    order = sorted(range(len(clouds)), key=lambda k: _digest(clouds[k]))
    scans = prepare_scans([clouds[k] for k in order], [names[k] for k in order], progress)
    own = [
        pose if pose is None else pose @ make_pose(np.eye(3), c.origin) for pose, c in zip(given, clouds, strict=True)
    ]
    local = [own[k] for k in order]  # for points that count from the origin of their cloud
    doubtful: tuple[str, ...] = ()
    if use_poses:
        group = _as_given(scans, [pose for pose in local if pose is not None])
    else:
        scans, group, doubtful = _put_together(scans, names, local, progress)
    first = min(group.members, key=lambda i: order[i])
    return _result(scans, group, first, progress, names, doubtful, as_given=use_poses)


def _checked_names(clouds: Sequence[PointCloud], names: Sequence[str]) -> list[str]:
    """Return a name for each scan; refuse what cannot be spliced."""
    named = list(names) or [cloud.name or f"scan {place + 1}" for place, cloud in enumerate(clouds)]
    if len(clouds) < 2:
        raise InputError(f"splicing needs at least 2 scans, got {len(clouds)}")
    if len(set(named)) < len(clouds) or len(named) != len(clouds):
        named = [f"scan {place + 1}" for place in range(len(clouds))]
    units = {cloud.unit: name for cloud, name in zip(clouds, named, strict=True) if cloud.unit}
    if len(units) > 1:
        words = ", ".join(f"{name} is in {unit}" for unit, name in units.items())
        raise InputError(f"the scans must be in one unit: {words}; convert them, or give the unit of all with --unit")
    return named


def _digest(cloud: PointCloud) -> bytes:
    """Return the key by which scans are sorted, so that the order in which they are given does not matter."""
    return hashlib.sha256(cloud.points.tobytes() + cloud.origin.tobytes()).digest()


def _put_together(
    scans: list[Scan], names: list[str], given: list[np.ndarray | None], progress: Progress
) -> tuple[list[Scan], Group, tuple[str, ...]]:
    """Return all scans with their strictness, the group that fits together, and the scans that fit in several ways."""
    telling = [i for i, scan in enumerate(scans) if scan.tells]
    both = [(i, j) for j in telling for i in telling if i < j]
    started = [pair for i, j in both for pair in _start(scans, given, i, j)]
    done = {(pair.first, pair.second) for pair in started}
    wanted = [pair for pair in both if pair not in done]
    pairs = list(started)
    if wanted:
        progress("features", 0.0)
        pairs += find_pairs(scans, find_features([scan.coarse for scan in scans]), wanted, progress)
    scans = with_strictness(scans, pairs)
    groups, doubtful = assemble_poses(scans, rejudge(pairs, scans), progress)
    group = groups[0]
    group, elsewhere = leave_out_doubtful(scans, group, _sure(scans, group, started), progress)
    doubtful |= elsewhere
    if 2 * len(group.members) <= len(scans):
        raise InputError(_why_not(scans, names, groups, doubtful))
    settle_poses(scans, group, [scan.middle for scan in scans], (1.5, 1.0), steps=12)
    settle_poses(
        scans, group, [scan.fine for scan in scans], (2.0, 1.0, 1.0), steps=8, few=6000,
        progress=lambda share: progress("align", share),
    )  # fmt: skip
    return scans, group, tuple(scans[i].name for i in doubtful if i not in group.members)


def _why_not(scans: list[Scan], names: list[str], groups: list[Group], doubtful: set[int]) -> str:
    """Return the message for scans that mostly do not fit together."""

    def listed(members: Iterable[int]) -> list[str]:
        return sorted((scans[i].name for i in members), key=names.index)

    mute = listed(i for i, scan in enumerate(scans) if not scan.tells)
    parts = "; ".join(" and ".join(listed(group.members)) for group in groups if len(group.members) > 1)
    words = f"only {parts} do" if parts else "no overlap tells how they lie"
    if mute:
        words += f", and {', '.join(mute)} have too few points for the size of the others, or are in another unit"
    if doubtful:
        words = f"{', '.join(listed(doubtful))} fit in more ways than one, as parts of a symmetric shape do"
    return (
        f"the scans {', '.join(names)} do not fit together: {words}; give scans that overlap more, or poses to start from"
        " (--poses)"
    )


def _start(scans: list[Scan], given: list[np.ndarray | None], first: int, second: int) -> list[Pair]:
    """Return the pair of two scans by their given poses, after alignment; nothing if they do not agree."""
    one, other = given[first], given[second]
    if one is None or other is None:
        return []
    found: list[Pair] = []
    for turn in (1.0, -1.0):
        spacing = scans[first].coarse.spacing
        pose = invert(other) @ one
        pose = align(scans[first].coarse, scans[second].coarse, pose, turn, (3.0 * spacing, spacing), 800)
        found += closer(scans[first], scans[second], first, second, pose, turn)
    return sorted(found, key=lambda pair: -pair.fit.score)[:1]


def _sure(scans: list[Scan], group: Group, started: list[Pair]) -> set[int]:
    """Return the scans of a group that lie as their given poses say; a scan placed by its features does not count."""
    members = set(group.members)
    held = [p for p in started if {p.first, p.second} <= members and agree_on_pose(p, group, scans)]
    return {i for pair in held for i in (pair.first, pair.second)}


def _as_given(scans: list[Scan], poses: list[np.ndarray]) -> Group:
    """Return all scans in the poses given."""
    group = Group(list(range(len(scans))), dict(enumerate(poses)), {})
    for i in group.members:
        votes = {}
        for turn in (1.0, -1.0):
            group.turns[i] = turn
            votes[turn] = sum(fit_of(scans, group, j, i).agreeing for j in range(i))
        group.turns[i] = max(votes, key=lambda turn: votes[turn])
    return group


def _result(
    scans: list[Scan],
    group: Group,
    first: int,
    progress: Progress,
    names: list[str],
    doubtful: tuple[str, ...],
    *,
    as_given: bool,
) -> Splice:
    """Return the splice in the frame of scan `first`, or in that of the poses where they are taken as given."""
    home = invert(group.poses[first]) if not as_given else np.eye(4)
    origin = scans[first].cloud.origin if not as_given else np.zeros(3)
    poses = {}
    for i in group.members:
        group.poses[i] = home @ group.poses[i]
        local = make_pose(np.eye(3), -scans[i].cloud.origin)
        poses[scans[i].name] = make_pose(np.eye(3), origin) @ group.poses[i] @ local
    if not as_given:
        poses[scans[first].name] = np.eye(4)
    scans = with_strictness(scans, [])  # from how the group agrees now: the same for poses found and given
    scans = with_strictness(scans, pairs_as_they_lie(scans, group))
    links = {pair: fine_fit_of(scans, group, *pair) for pair in links_of(scans, group, against=as_given)}
    points, kept = merge_scans(scans, group, progress)
    whole = PointCloud.from_array(points, unit=scans[first].cloud.unit)
    whole = replace(whole, origin=whole.origin + origin)
    placed = sorted(links, key=lambda pair: sorted(names.index(scans[i].name) for i in pair))
    return Splice(
        cloud=whole,
        poses={name: poses[name] for name in names if name in poses},
        pairs=tuple(_pair_fit(scans, names, pair, links[pair]) for pair in placed),
        left_out=tuple(name for name in names if name not in poses),
        doubtful=tuple(name for name in names if name in doubtful),
        kept={scans[i].name: count for i, count in zip(group.members, kept, strict=True)},
        spacing=float(np.median([scan.cloud.spacing for scan in scans])),
        unit=scans[first].cloud.unit,
    )


def _pair_fit(scans: list[Scan], names: list[str], pair: tuple[int, int], fit: Fit) -> PairFit:
    """Return how two scans agree, in the order they were given."""
    first, second = sorted((scans[i].name for i in pair), key=names.index)
    return PairFit(first, second, fit.share, fit.agreement, fit.residual if fit.agreeing else None)
