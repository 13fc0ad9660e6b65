"""Where ridges end: those that face each other are joined, and those that make for one corner or another ridge are led there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..boundary.curves import length_along
from ..scan.vectors import pairs_within

LONGEST_BRIDGE = 4.0  # longest gap over which the ends of two ridges are joined [member lengths]
COSINE_TO_OTHER_END = 0.94  # least cosine of the angle between such an end and the way to the other
# least cosine of the angle between the ends of one ridge and the way between them that makes it a ring
RING_COSINE = 0.8
TOUCHING_GAP = 0.6  # gap below which only one of the ends must point to the other [member lengths]
BLURRED_PLACES = 1  # places at an end that are left out, because the third side disturbs them
AIM_PLACES, FAR_AIM_PLACES = 5, 10  # places from which the direction of an end is taken, and those of a straight ridge
STRAIGHT_WITHIN = 0.01  # median distance of the places of a straight line from it, at most [distance of its ends]
STRAIGHT_FITS = 4  # of a straight line, those after the first with places off it weighing less
WAY_TO_CORNER = 1.5  # longest way from an end to a corner or another ridge [member lengths]
REACH_BACK = 0.5  # longest way back to a corner or another ridge, where an end has gone too far [member lengths]
LARGEST_MISS = 0.35  # largest distance of an end's continuation from the corner that it makes for [member lengths]
LEAST_FREE_RIDGE = 2.5  # least length of a ridge of which an end is free [member lengths]
LEAST_ACUTE_RIDGE = 1.4  # ... where it is acute: no grid follows the scan there without it [member lengths]
LEAST_RIDGE = 0.6  # least length of any other [member lengths]


@dataclass(frozen=True, eq=False)
class Ridge:
    """A line along which the scan is folded."""

    places: np.ndarray  #: (K, 3) along it; the first of a ring is not repeated
    sharp: bool  #: folded by the full angle; False: by less, it counts only beside others
    ring: bool = False
    acute: bool = False  #: folded by about a right angle or more
    lip: bool = False  #: the edge of a thin body, at which the surface turns back

    def moved(self, places: np.ndarray) -> Ridge:
        """The same ridge in other places (K, 3)."""
        return replace(self, places=places)

    def distance(self, place: np.ndarray) -> float:
        """Distance of a place from the places along the ridge."""
        return float(np.linalg.norm(self.places - place, axis=1).min())

    def is_near(self, places: np.ndarray, reach: float) -> bool:
        """Whether an end lies within some distance of one of the places (M, 3)."""
        ends = self.places[[0, -1]]
        return bool((np.linalg.norm(places[:, None] - ends, axis=2).min(axis=0) < reach).any())


@dataclass(frozen=True, eq=False)
class End:
    """An end of a ridge."""

    line: int
    at: int  #: 0 the first place of the line, -1 the last
    place: np.ndarray  #: (3,)
    ahead: np.ndarray  #: (3,) unit vector in which the ridge would go on


def join_ends(traced: list[Ridge], length: float) -> list[Ridge]:
    """Return ridges with their ends led together, as they were traced before; those too short to be ridges by themselves are left out.

    Parameters
    ----------
    traced : ridges; the last place of a ring is its first
    length : desired member length
    """
    ridges = _bridged([ridge for ridge in traced if not _is_ring(ridge.places)], length)
    rings = [ridge.moved(ridge.places[:-1]) for ridge in traced if _is_ring(ridge.places)]
    rings = [replace(ridge, ring=True) for ridge in rings + [each for each in ridges if _closes(each.places, length)]]
    ridges = [ridge for ridge in ridges if not _closes(ridge.places, length)]
    lines = [
        line[BLURRED_PLACES:-BLURRED_PLACES] if len(line) > 2 * BLURRED_PLACES + 2 else line
        for line in (r.places for r in ridges)
    ]
    ends = [end_of(line, i, at) for i, line in enumerate(lines) for at in (0, -1)]
    led = _corners(ends, length)
    for end in ends:
        if (end.line, end.at) not in led:
            others = [line for k, line in enumerate(lines) if k != end.line] + [ring.places for ring in rings]
            foot = _foot(end, others, list(led.values()), length)
            if foot is not None:
                led[end.line, end.at] = foot
    found = rings
    for i, ridge in enumerate(ridges):
        first, last = led.get((i, 0)), led.get((i, -1))
        line = lines[i] if first is not None or last is not None else ridge.places
        line = _led(_led(line, last)[::-1], first)[::-1]
        free = LEAST_ACUTE_RIDGE if ridge.acute else LEAST_FREE_RIDGE
        least = LEAST_RIDGE if first is not None and last is not None else free
        if length_along(line) >= least * length:
            found.append(ridge.moved(line))
    return found


def _is_ring(line: np.ndarray) -> bool:
    """Whether a line (K, 3) ends where it begins."""
    return len(line) > 8 and bool((line[0] == line[-1]).all())


def _closes(line: np.ndarray, length: float) -> bool:
    """Whether the ends of a line face each other over a gap: a ring that was not seen whole."""
    one, two = end_of(line, 0, -1), end_of(line, 0, 0)
    gap = two.place - one.place
    size = float(np.linalg.norm(gap))
    whole = length_along(line)
    return (
        whole > 4.0 * size
        and size < LONGEST_BRIDGE * length
        and min(gap @ one.ahead, -(gap @ two.ahead)) > RING_COSINE * size
    )


def end_of(line: np.ndarray, number: int, at: int) -> End:
    """Return an end (0 or -1) of a line (K, 3); where the line is straight, on the straight line through its last places.

    The very last ones lie aside, as the third side of a corner disturbs them.
    """
    towards = line if at == -1 else line[::-1]
    some = towards[-FAR_AIM_PLACES:]
    middle, ahead = _straight(some)
    off = np.linalg.norm(np.cross(some - middle, ahead), axis=1)
    if len(some) > AIM_PLACES and np.median(off) < STRAIGHT_WITHIN * np.linalg.norm(some[-1] - some[0]):
        return End(number, at, middle + ((towards[-1] - middle) @ ahead) * ahead, ahead)
    return End(number, at, towards[-1], _direction(towards, AIM_PLACES))


def _straight(line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a place (3,) on the straight line through most places of a line (K, 3), and its direction (3,), a unit vector."""
    weight = np.ones(len(line))
    for _ in range(STRAIGHT_FITS):
        middle = weight @ line / weight.sum()
        ahead = np.linalg.svd((line - middle) * np.sqrt(weight)[:, None])[2][0]
        off = np.linalg.norm(np.cross(line - middle, ahead), axis=1)
        weight = 1.0 / (1.0 + (off / max(2.0 * float(np.median(off)), 1e-300)) ** 2) ** 2
    return middle, ahead if (line[-1] - line[0]) @ ahead >= 0.0 else -ahead


def _direction(line: np.ndarray, places: int) -> np.ndarray:
    """Direction (3,) of the last places of a line (K, 3)."""
    way = line[-1] - line[-min(places, len(line))]
    found: np.ndarray = way / max(float(np.linalg.norm(way)), 1e-300)
    return found


def _bridged(ridges: list[Ridge], length: float) -> list[Ridge]:
    """Join ridges whose ends face each other, over the smallest gap first; each turn leaves one ridge fewer."""
    found, ends = list(ridges), [end for ridge in ridges for end in _ends_of(ridge)]
    while (pair := _facing(ends, length)) is not None:
        (i, one), (j, two) = ((number // 2, ends[number]) for number in pair)
        before = found[i].places if one.at == -1 else found[i].places[::-1]
        after = found[j].places if two.at == 0 else found[j].places[::-1]
        joined = Ridge(
            np.concatenate([before, after]),
            found[i].sharp or found[j].sharp,
            acute=found[i].acute and found[j].acute,
            lip=found[i].lip or found[j].lip,
        )
        found = [*(ridge for k, ridge in enumerate(found) if k not in (i, j)), joined]
        ends = [*(end for k, end in enumerate(ends) if k // 2 not in (i, j)), *_ends_of(joined)]
    return found


def _ends_of(ridge: Ridge) -> tuple[End, End]:
    """Return the first and the last end of a ridge."""
    return end_of(ridge.places, 0, 0), end_of(ridge.places, 0, -1)


def _facing(ends: list[End], length: float) -> tuple[int, int] | None:
    """Return the numbers of two ends of two ridges that face each other over the smallest gap, of the two ends of each in turn."""
    places, ahead = (np.array([getattr(end, name) for end in ends]).reshape(-1, 3) for name in ("place", "ahead"))
    one, two = pairs_within(places, LONGEST_BRIDGE * length)
    of_two = one // 2 != two // 2
    one, two = one[of_two], two[of_two]
    gap = places[two] - places[one]
    size = np.linalg.norm(gap, axis=1)
    least = np.minimum((gap * ahead[one]).sum(axis=1), -(gap * ahead[two]).sum(axis=1))
    opposite = (ahead[two] * ahead[one]).sum(axis=1) < -COSINE_TO_OTHER_END
    faces = (least > COSINE_TO_OTHER_END * size) | ((size < TOUCHING_GAP * length) & opposite)
    if not faces.any():
        return None
    best = int(np.where(faces, size, np.inf).argmin())
    return int(one[best]), int(two[best])


def _corners(ends: list[End], length: float) -> dict[tuple[int, int], np.ndarray]:
    """The corner (3,) that each end makes for, by (line, end); ends that make for none are left out.

    Pairs of ends that meet soonest come first; a later pair joins a corner that is there already.
    """
    pairs = []
    for k, one in enumerate(ends):
        for two in ends[k + 1 :]:
            if one.line != two.line and np.linalg.norm(one.place - two.place) < 2.0 * WAY_TO_CORNER * length:
                cost = _cost(one, two, length)
                if cost is not None:
                    pairs.append((cost, k, ends.index(two, k + 1)))
    group: dict[int, list[int]] = {}
    for _, i, j in sorted(pairs):
        known, other = group.get(i), group.get(j)
        together = sorted({*(known or [i]), *(other or [j])})
        if (known is None or known is not other) and _meet(together, ends, length):
            for member in together:
                group[member] = together
    return {(ends[i].line, ends[i].at): meeting([ends[k] for k in together]) for i, together in group.items()}


def _cost(one: End, two: End, length: float) -> float | None:
    """How far two ends have to go to meet, None where they do not meet."""
    if abs(one.ahead @ two.ahead) >= COSINE_TO_OTHER_END:
        return None
    place = meeting([one, two])
    ways = [float((place - end.place) @ end.ahead) for end in (one, two)]
    miss = max(float(np.linalg.norm(np.cross(place - end.place, end.ahead))) for end in (one, two))
    if min(ways) < -REACH_BACK * length or max(ways) > WAY_TO_CORNER * length or miss > LARGEST_MISS * length:
        return None
    return max(abs(way) for way in ways) + miss


def _meet(numbers: list[int], ends: list[End], length: float) -> bool:
    """Whether several ends meet in one corner."""
    some = [ends[k] for k in numbers]
    if len({end.line for end in some}) < len(some):
        return False
    place = meeting(some)
    for end in some:
        way = float((place - end.place) @ end.ahead)
        miss = float(np.linalg.norm(np.cross(place - end.place, end.ahead)))
        if not -REACH_BACK * length <= way <= WAY_TO_CORNER * length or miss > LARGEST_MISS * length:
            return False
    return True


def meeting(ends: list[End]) -> np.ndarray:
    """Return the place (3,) nearest to the continuations of some ends."""
    matrix, right = np.zeros((3, 3)), np.zeros(3)
    for end in ends:
        across = np.eye(3) - np.outer(end.ahead, end.ahead)
        matrix += across
        right += across @ end.place
    found: np.ndarray = np.linalg.lstsq(matrix, right, rcond=1e-6)[0]
    return found


def _foot(end: End, others: list[np.ndarray], corners: list[np.ndarray], length: float) -> np.ndarray | None:
    """The corner, else the place of another ridge, that an end makes for; None where there is none."""
    best, foot = np.inf, None
    for places, bonus in ((np.array(corners).reshape(-1, 3), 0.5), (np.concatenate([np.zeros((0, 3)), *others]), 1.0)):
        away = places - end.place
        way = away @ end.ahead
        miss = np.linalg.norm(away - way[:, None] * end.ahead, axis=1)
        fits = (way >= -REACH_BACK * length) & (way <= WAY_TO_CORNER * length) & (miss <= LARGEST_MISS * length)
        if fits.any():
            cost = bonus * np.where(fits, np.abs(way) + 2.0 * miss, np.inf)
            if cost.min() < best:
                best, foot = float(cost.min()), places[int(cost.argmin())]
    return foot


def _led(line: np.ndarray, to: np.ndarray | None) -> np.ndarray:
    """A line whose last place is the one it is led to; places beyond that are left out."""
    if to is None:
        return line
    away = np.linalg.norm(line - to, axis=1)
    last = max(int(away.argmin()), 1)
    ahead = line[last] - line[last - 1]
    if (to - line[last]) @ ahead <= 0.0:
        last -= 1
    return np.concatenate([line[: last + 1], to[None]])
