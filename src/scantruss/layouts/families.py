"""Few lengths: members drawn towards few values by assignment and relaxation in turn, nodes on the surface of the grid."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from ..errors import InputError
from ..grid.alike import LENGTHS, Alike
from ..grid.grid import Grid
from ..improve.images import Images
from ..runtime.progress import Progress
from .charts import Charts, shortened
from .moved import moved_grid

FAMILY_ROUNDS = 300  #: of assignment and relaxation, each way but the last, which takes three times as many
INNER_SHARE = 0.9  #: of the tolerance, within which a length is taken to be that of its family
BISECTIONS_OF_MISFIT = 60  #: of the least misfit
STIFFNESS_OF_PLACE = 0.02  #: weight of staying where one is, over that of a length
STIFFNESS_OF_MEMBERS = 0.004  #: weight of staying where one is, over all that pulls at a node
FARTHEST_STEP = 0.05  #: of a node in one round, over the mean member
LEAST_WEIGHT, MOST_WEIGHT = 0.3, 1000.0  #: of a member in a family, and of one in none
USUAL_SHARE = 0.95  #: of the members, which the large families shall hold
LARGE_FAMILIES = 0.58  #: of the families: 7 of 12, 12 of 20
OUT_OF_REACH = 0.1  #: of the members in no family, beyond which one way is enough
STEPS_OF_TOLERANCE = 4  #: in a tolerance, at which lengths of small families are tried


@dataclass(frozen=True, eq=False)
class Families:
    """Members by length: the grid after the relaxation, and how many lengths there are before and after."""

    grid: Grid
    lengths: np.ndarray  #: (K,) the length of each family, rising [unit of the grid]
    of: np.ndarray  #: (E,) the family of each member
    misfit: np.ndarray  #: (E,) length of each member minus that of its family [unit of the grid]
    moved: np.ndarray  #: (V,) how far each node has moved [unit of the grid]

    @property
    def counts(self) -> np.ndarray:
        """(K,) members of each family."""
        return np.bincount(self.of, minlength=len(self.lengths))


def lengths_needed(lengths: np.ndarray, tolerance: float, share: float = 1.0) -> np.ndarray:
    """Return the fewest lengths, rising, of which so great a share of the members differ by at most the tolerance.

    Parameters
    ----------
    lengths : (E,) float64
    tolerance : float
        Largest misfit of a member, in the unit of the lengths.
    share : float
        Of the members that must be held, above 0 to 1.
    """
    return _middles(lengths, tolerance, len(lengths), math.ceil(share * len(lengths) - 1e-9))


def _middles(lengths: np.ndarray, tolerance: float, count: int, enough: int) -> np.ndarray:
    """Return at most `count` lengths, rising, that hold the most members within the tolerance, no more lengths than hold `enough` members.

    Dynamic programming over windows of the sorted lengths, each as wide as both tolerances.
    """
    ordered = np.sort(lengths)
    total = len(ordered)
    end = np.searchsorted(ordered, ordered + 2 * tolerance * (1 + 1e-12), "right")
    most = np.zeros(total + 1, np.int64)  # members held by the windows so far that begin at each length or later
    choices: list[np.ndarray] = []
    while len(choices) < count and most[0] < enough:  # ends at `count`
        taken = end - np.arange(total) + most[end]
        choices.append(taken)
        most = np.append(np.maximum.accumulate(taken[::-1])[::-1], 0)
    middles, begin = [], 0
    for taken in reversed(choices):
        if begin >= total:
            break
        begin += int(np.argmax(taken[begin:]))
        middles.append((ordered[begin] + ordered[end[begin] - 1]) / 2)
        begin = int(end[begin])
    return np.array(middles)


def few_lengths(grid: Grid, tolerance: float, count: int, progress: Progress | None = None) -> Families:
    """Return the grid with its nodes moved along its surface so that more members are of `count` lengths.

    The surface is a quadric at each node, of least squares through its neighbours and theirs; nodes of the boundary and of lines move along
    a parabola through the two beside them; the symmetry of the grid is kept. Corners, fixed nodes, and ends and crossings of lines stay.

    Each round assigns every member to a family and moves the nodes by a damped Gauss-Newton step towards them; members that are in none
    weigh more from round to round. Large families, seven of twelve, are the lengths that hold the most members; they shall hold 95 %. The
    small ones are where the rest is nearest to, on the mean of squares. The number of families falls by one each time that the
    members have come to them; where that ends above `count`, there are `count` from the start, and other weights are tried. The best round
    stands.

    Parameters
    ----------
    grid : Grid
    tolerance : float
        Largest misfit, over the mean member, 0.0001 to 0.2.
    count : int
        Lengths, 1 or more.
    progress : callable, optional
        Called before each round with the stage "lengths" and the share of the work that is done at least; it may raise to cancel.

    Raises
    ------
    InputError
        A value cannot be used, or the grid has no members.
    """
    if not 1e-4 <= tolerance <= 0.2:
        raise InputError(f"the tolerance of families is a share of the mean member, 0.01% to 20%, got {tolerance!r}")
    if count < 1:
        raise InputError(f"the number of families must be 1 or more, got {count}")
    if len(grid.edges) == 0 or not grid.topology.manifold:
        raise InputError("families of members need a manifold grid with members")
    charts, images, aim = Charts.of_grid(grid), Images.of_grid(grid), _Number(math.ceil(LARGE_FAMILIES * count), count)
    start = place = np.zeros((len(grid.nodes), 2))
    off = math.inf
    rounds, done = sum(way.total for way in WAYS_TRIED), 0

    def turned() -> None:
        nonlocal done
        if progress:
            progress(LENGTHS, done / rounds)
        done += 1

    for way in WAYS_TRIED:
        tried, missed = _relaxed(grid, charts, images, tolerance, aim, place if way.onwards else start, way, turned)
        if missed < off:
            place, off = tried, missed
        if not 0 < off < OUT_OF_REACH:
            break
    nodes = images.alike(charts.moved(place)) if place.any() else grid.nodes
    made = moved_grid(grid, nodes, Alike(LENGTHS, tolerance, count, charts.mean))
    middles, of = families_of(made.lengths, tolerance * charts.mean, count)
    return Families(made, middles, of, made.lengths - middles[of], np.linalg.norm(nodes - grid.nodes, axis=1))


def families_of(lengths: np.ndarray, tolerance: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the lengths of families (K,), `count` at most, and the family of each member (E,).

    Parameters
    ----------
    lengths : (E,) float64
    tolerance : float
        In their unit.
    """
    middles = _middles(lengths, tolerance, count, len(lengths))
    return middles, np.abs(lengths[:, None] - middles).argmin(axis=1)


def least_misfit(lengths: np.ndarray, count: int) -> float:
    """Return the least tolerance at which so many lengths hold all members: bisection between nil and half the range."""
    low, high = 0.0, float(np.ptp(lengths)) / 2
    ordered = np.sort(lengths)
    for _ in range(BISECTIONS_OF_MISFIT):
        middle = (low + high) / 2
        begin = 0
        for _ in range(count):
            if begin < len(ordered):
                begin = int(np.searchsorted(ordered, ordered[begin] + 2 * middle, "right"))
        low, high = (low, middle) if begin >= len(ordered) else (middle, high)
    return high


def family_report(before: Grid, found: Families, tolerance: float) -> dict[str, Any]:
    """Return the figures as plain values: tolerances and misfits over the mean member of the grid before, else in its unit."""
    mean = float(before.lengths.mean())
    needed = {
        f"{100 * share:g} % within {100 * each:g} %": {
            "before": len(lengths_needed(before.lengths, each * mean, share)),
            "after": len(lengths_needed(found.grid.lengths, each * mean, share)),
        }
        for each in (tolerance, tolerance / 2)
        for share in (USUAL_SHARE, 1.0)
    }
    off = np.abs(found.misfit)
    return {
        "unit": before.unit,
        "tolerance": tolerance,
        "lengths_needed": needed,
        "families": [
            {"length": length, "members": count}
            for length, count in zip(found.lengths.tolist(), found.counts.tolist(), strict=True)
        ],
        "members_within": float((off <= tolerance * mean * (1 + 1e-9)).mean()),
        "misfit_max": float(off.max()) / mean,
        "moved_mean": float(found.moved.mean()) / mean,
        "moved_max": float(found.moved.max()) / mean,
        "length_cv_before": before.quality.length_cv,
        "length_cv": found.grid.quality.length_cv,
    }


class _Way(NamedTuple):
    """How families are come to."""

    heavier: float  #: weight of a member that lies in no family, over that of the round before
    rounds: int  #: after which weights begin anew
    one_by_one: bool  #: whether the number of families falls by one at a time
    onwards: bool = False  #: whether it begins at the best places so far
    inner: float = INNER_SHARE  #: of the tolerance, within which a length is taken to be that of its family
    total: int = FAMILY_ROUNDS  #: rounds


WAYS_TRIED = (
    _Way(1.1, 30, True),
    _Way(1.1, 30, False),
    _Way(1.2, 30, True, True),
    _Way(1.05, 60, True),
    _Way(1.1, 30, False, inner=0.6, total=3 * FAMILY_ROUNDS),
)  #: tried in turn


class _Number(NamedTuple):
    """Of families."""

    large: int  #: that shall hold 95 % of the members
    all: int  #: that shall hold all


def _relaxed(
    grid: Grid,
    charts: Charts,
    images: Images,
    tolerance: float,
    aim: _Number,
    place: np.ndarray,
    way: _Way,
    turned: Callable[[], None],
) -> tuple[np.ndarray, float]:
    """Return the places (V, 2) on the charts of the best round, and the share of members by which it misses the aim."""
    width = tolerance * charts.mean
    lengths = _lengths(charts.moved(place), grid.edges)
    best, least, since = place, math.inf, 0
    weight = np.full(len(lengths), LEAST_WEIGHT)
    now = _fewer(lengths, width, aim) if way.one_by_one else aim
    for _ in range(way.total):
        turned()
        if (missed := _missed(lengths, width, aim)) < least:
            best, least = place, missed
        if missed == 0:
            break
        if reached := way.one_by_one and _missed(lengths, width, now) == 0:
            now = _fewer(lengths, width, aim)
        since += 1
        if reached or since > way.rounds:
            weight, since = np.full(len(lengths), LEAST_WEIGHT), 0
        off = lengths - _families_aimed_at(lengths, width, now)
        outside = np.abs(off) > width * (1 + 1e-9)
        weight = np.where(
            outside,
            np.minimum(np.maximum(weight, 1) * way.heavier, MOST_WEIGHT),
            np.maximum(weight / way.heavier, LEAST_WEIGHT),
        )
        pull = np.sign(off) * np.maximum(np.abs(off) - way.inner * width, 0)
        nodes = images.alike(charts.moved(_step(grid, charts, place, pull, weight)))
        place = charts.place_of(nodes)
        lengths = _lengths(nodes, grid.edges)
    return best, least


def _fewer(lengths: np.ndarray, width: float, aim: _Number) -> _Number:
    """Return one family less than the members need as they are, of the large ones too, but no less than the aim."""
    large, every = (len(lengths_needed(lengths, width, share)) for share in (USUAL_SHARE, 1.0))
    return _Number(max(large - 1, aim.large), max(every - 1, aim.all))


def _missed(lengths: np.ndarray, width: float, aim: _Number) -> float:
    """Return the share of members that are in no family, and by how much the large ones hold less than 95 %."""
    held_by_all, held_by_large = (_held(lengths, width, number) for number in (aim.all, aim.large))
    enough = math.ceil(USUAL_SHARE * len(lengths) - 1e-9)
    return (len(lengths) - held_by_all + max(enough - held_by_large, 0)) / len(lengths)


def _held(lengths: np.ndarray, width: float, count: int) -> int:
    """Return how many members the best `count` lengths hold."""
    middles = _middles(lengths, width, count, len(lengths))
    return int((np.abs(lengths[:, None] - middles).min(axis=1) <= width * (1 + 1e-9)).sum())


def _families_aimed_at(lengths: np.ndarray, width: float, number: _Number) -> np.ndarray:
    """Return the length that each member (E,) is drawn to: of the nearest large family, or for one in twenty at most of a small one."""
    large = _middles(lengths, width, number.large, len(lengths))
    target, off = _nearest(lengths, large)
    beyond = np.maximum(off / width - 1, 0)
    out = np.flatnonzero(beyond > 1e-9)
    if len(out) == 0 or number.all <= number.large:
        return target
    small = _small_families(lengths[out], width, beyond[out], number.all - number.large)
    aim, off = _nearest(lengths[out], small)
    gain = beyond[out] - np.maximum(off / width - 1, 0)
    few = np.argsort(-gain, kind="stable")[: int((1 - USUAL_SHARE) * len(lengths))]
    few = few[gain[few] > 0]
    target[out[few]] = aim[few]
    return target


def _small_families(lengths: np.ndarray, width: float, beyond: np.ndarray, count: int) -> np.ndarray:
    """Return lengths, one after the other where members then are least beyond the nearest; `beyond` the large ones [tolerances]."""
    tried = np.unique(np.round(lengths / width * STEPS_OF_TOLERANCE)) * (width / STEPS_OF_TOLERANCE)
    costs = np.maximum(np.abs(tried[:, None] - lengths) / width - 1, 0) ** 2
    cost, found = beyond**2, []
    for _ in range(count):
        best = int(np.minimum(cost, costs).sum(axis=1).argmin())
        found.append(tried[best])
        cost = np.minimum(cost, costs[best])
    return np.array(found)


def _nearest(lengths: np.ndarray, middles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest of some lengths to each member, and by how far it is off."""
    off = np.abs(lengths[:, None] - middles)
    return middles[off.argmin(axis=1)], off.min(axis=1)


def _lengths(nodes: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the lengths of the members."""
    return np.asarray(np.linalg.norm(nodes[edges[:, 1]] - nodes[edges[:, 0]], axis=1))


def _step(grid: Grid, charts: Charts, place: np.ndarray, pull: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the charts' coordinates after a damped Gauss-Newton step that takes `pull` off the lengths."""
    ways, nodes = charts.ways(place), charts.moved(place)
    a, b = grid.edges.T
    along = nodes[b] - nodes[a]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(along)), 4)
    columns = np.stack([2 * a, 2 * a + 1, 2 * b, 2 * b + 1], axis=1).ravel()
    at_a, at_b = (np.einsum("ekc,ec->ek", ways[end], along) for end in (a, b))
    values = np.concatenate([-at_a, at_b], axis=1).ravel()
    table = coo_matrix((values, (rows, columns)), (len(along), place.size)).tocsr()
    stiff = table.T @ diags(weight) @ table
    damping = STIFFNESS_OF_PLACE + STIFFNESS_OF_MEMBERS * stiff.diagonal()
    stiff = stiff + diags(np.where(charts.free.ravel(), damping, 1.0))
    found = spsolve(stiff.tocsc(), -(table.T @ (weight * pull))).reshape(place.shape)
    return charts.within(place + shortened(found * charts.free, FARTHEST_STEP * charts.mean))
