"""Parts alike: joints or panels drawn towards few kinds by assignment and relaxation in turn, nodes on the surface of the grid."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from ..errors import InputError
from ..grid.alike import Alike
from ..grid.grid import Grid
from ..improve.images import Images
from ..runtime.progress import Progress
from .charts import Charts, shortened
from .moved import moved_grid
from .part_vectors import UNLIKE_MISFIT, PartVectors, is_mirrored, is_reversed

REGULAR_ROUNDS = (12, 24)  #: in which all parts that may be alike are drawn to one kind, before each further descent
ALIKE_ROUNDS = 400  #: of assignment and relaxation after that, and of the grid as it was
ROUNDS_OF_WAY = 25  #: after which another way is tried to come to fewer kinds
MOST_ALIKE = 6000  #: any two of which are compared
NEARLY_ALIKE = 0.1  #: of the tolerance, within which a part is taken to be its representative
STIFFNESS_OF_NODE = 0.02  #: weight of staying where one is
STIFFNESS_OF_PARTS = 0.004  #: weight of staying where one is, over all that pulls at a node
STEP_OF_NODE = 0.05  #: farthest move of a node in one round, over the mean member
WEIGHT_WITHIN = 0.3  #: weight of a part within the tolerance
LEAST_MISFIT, MOST_MISFIT = 1e-4, 0.2  #: of parts that are alike


class _Way(NamedTuple):
    """How fewer kinds are come to."""

    share: float  #: kinds that are tried, over those there are
    heavier: float  #: weight of a part beyond the tolerance, over that of the round before
    most: float  #: weight of such a part


WAYS_TO_FEWER = tuple(
    _Way(share, *weights) for share in (0.93, 0.85, 0.99, 0.75) for weights in ((1.3, 500.0), (1.15, 50.0))
)  #: tried in turn, the first again after each that has come to fewer kinds


class Stage(NamedTuple):
    """A grid and the kinds of its parts."""

    nodes: np.ndarray  #: (V, 3) [unit of the grid]
    kinds: np.ndarray  #: (K,) parts that stand for them
    misfit: float  #: the largest of a part to the nearest of them


@dataclass(frozen=True, eq=False)
class PartKinds:
    """Joints or panels by kind: the grid after the relaxation, and the kinds of its parts."""

    grid: Grid
    representative: np.ndarray  #: (K,) part that stands for each kind, that which the most are of first
    of: np.ndarray  #: (N,) kind of each part, -1 of a node without members
    mirrored: np.ndarray  #: (N,) bool, whether it is the mirror image of its kind
    misfit: np.ndarray  #: (N,) root mean square of what is between its vectors and those of its kind
    moved: np.ndarray  #: (V,) how far each node has moved [unit of the grid]
    parts: PartVectors
    mirror_images_alike: bool
    stages: tuple[
        Stage, ...
    ]  #: the grid as it was, and those with which larger counts end, each of fewer kinds, to this one

    @property
    def before(self) -> int:
        """Kinds of the grid as it was."""
        return len(self.stages[0].kinds)

    @property
    def counts(self) -> np.ndarray:
        """(K,) parts of each kind."""
        return np.bincount(self.of[self.of >= 0], minlength=len(self.representative))


def check_alike(grid: Grid, tolerance: float, count: int, parts: str, number: int) -> None:
    """Refuse a grid or a value that parts cannot be made alike with; parts: what they are called, number: how many there are."""
    if not LEAST_MISFIT <= tolerance <= MOST_MISFIT:
        raise InputError(f"the tolerance of {parts} is 0.01% to 20%, got {tolerance!r}")
    if count < 1:
        raise InputError(f"the number of kinds must be 1 or more, got {count}")
    if len(grid.edges) == 0 or not grid.topology.manifold:
        raise InputError(f"few {parts} need a manifold grid with members")
    if number > MOST_ALIKE:
        raise InputError(f"few kinds are made of at most {MOST_ALIKE:,} {parts}, got {number:,}")


def few_kinds(grid: Grid, parts: PartVectors, asked: Alike, progress: Progress | None = None) -> PartKinds:
    """Return the grid with its nodes moved along its surface so that its parts are of few kinds.

    Each round gives every part the nearest of some of the kinds that hold the most, and moves the nodes by a damped Gauss-Newton step that
    brings its vectors to the mean of the kind; parts beyond the tolerance weigh more from round to round. It goes on from the fewest kinds
    so far, in one way after the other until none comes to fewer; once from the grid as it is, and twice after some rounds that draw all
    parts that may be alike, of as many vectors, to one kind.

    Parameters
    ----------
    grid : Grid
    parts : PartVectors
        Of the grid.
    asked : Alike
        Its tolerance is the largest root mean square of what is between the vectors of two parts of one kind.
    progress : callable, optional
        Called with what the parts are and the share of the work that is done at least; it may raise to cancel.
    """
    rounds, done = (1 + len(REGULAR_ROUNDS)) * ALIKE_ROUNDS, 0

    def heard() -> None:
        if progress:
            progress(asked.parts, min(done / rounds, 1.0))

    def turned() -> None:
        nonlocal done
        heard()
        done += 1

    descent = _Descent(
        parts, Charts.of_grid(grid), Images.of_grid(grid), asked.tolerance, asked.mirrored, turned, heard
    )
    start = descent.at(grid.nodes).stage()
    found, first = [_fewest(descent, start, asked.count)], grid.nodes
    for rounds_of_start in REGULAR_ROUNDS:
        if len(found[-1][-1].kinds) <= asked.count:
            break
        first = descent.regular(first, rounds_of_start)
        found.append(_fewest(descent, descent.at(first).stage(), asked.count))
    return _found(grid, descent, asked, [start, *_ends(found, len(start.kinds))])


def _ends(found: list[list[Stage]], before: int) -> list[Stage]:
    """Return the stages with which counts below that of the grid as it was end: of the first start that comes so far."""
    ends: list[Stage] = []
    least = min(len(each[-1].kinds) for each in found)
    count = before - 1
    while count >= least:  # ends: each turn takes a stage of at most so many kinds, and goes on below
        stage = next(stage for each in found for stage in each if len(stage.kinds) <= count)
        ends.append(stage)
        count = len(stage.kinds) - 1
    return ends


def _fewest(descent: _Descent, start: Stage, count: int) -> list[Stage]:
    """Return the start, and the stage after each way that has come to fewer kinds."""
    stages = [start]
    rounds = failed = 0
    while (
        len(stages[-1].kinds) > count and failed < len(WAYS_TO_FEWER) and rounds < ALIKE_ROUNDS
    ):  # ends: each turn is a round at least
        before = best = stages[-1]
        for state in descent.along(before.nodes, WAYS_TO_FEWER[failed]):
            rounds += 1
            if len(state.kinds) < len(best.kinds):
                best = state.stage()
        failed = failed + 1 if best is before else 0
        stages += [] if best is before else [best]
    return stages


class _State(NamedTuple):
    """Nodes, and how alike their parts are."""

    nodes: np.ndarray  #: (V, 3) [unit of the grid]
    vectors: np.ndarray  #: (N, W, 3)
    misfit: np.ndarray  #: (N, N)
    shift: np.ndarray  #: (N, N)
    kinds: np.ndarray  #: (K,) parts that stand for all, that which the most are near to first

    def stage(self) -> Stage:
        """Return what of it is kept."""
        least = self.misfit[:, self.kinds].min(axis=1)
        return Stage(self.nodes, self.kinds, float(least[least < UNLIKE_MISFIT].max(initial=0.0)))


class _Descent(NamedTuple):
    """What moves nodes, and when parts are alike."""

    parts: PartVectors
    charts: Charts
    images: Images
    tolerance: float
    mirrored: bool
    turned: Callable[[], None]  #: called before each round
    heard: Callable[[], None]  #: called within a round

    def at(self, nodes: np.ndarray) -> _State:
        """Return how alike the parts are of some nodes."""
        vectors = self.parts.vectors(nodes)
        misfit, shift = self.parts.misfits(vectors, np.arange(len(vectors)), mirrored=self.mirrored, heard=self.heard)
        return _State(nodes, vectors, misfit, shift, fewest_kinds(misfit <= self.tolerance, self.parts.count > 0))

    def regular(self, nodes: np.ndarray, rounds: int) -> np.ndarray:
        """Return where nodes (V, 3) are after parts of as many vectors have been drawn to one kind."""
        state = self.at(nodes)
        used = self.parts.count > 0
        for _ in range(rounds):
            kinds = state.kinds
            what = np.stack([self.parts.count[kinds], self.parts.is_open[kinds]], axis=1)
            wanted = kinds[np.sort(np.unique(what, axis=0, return_index=True)[1])]
            state = self._drawn(state, wanted, used, np.ones(len(used)), 0.0)
        return state.nodes

    def along(self, nodes: np.ndarray, way: _Way) -> Iterator[_State]:
        """Yield the state after each round that is to come to fewer kinds."""
        state = self.at(nodes)
        aim = max(min(len(state.kinds) - 1, int(way.share * len(state.kinds))), 1)
        weight = np.full(len(state.vectors), WEIGHT_WITHIN)
        for _ in range(ROUNDS_OF_WAY):
            wanted = state.kinds[:aim]
            within = state.misfit[:, wanted].min(axis=1) <= self.tolerance
            heavier = np.minimum(np.maximum(weight, 1) * way.heavier, way.most)
            weight = np.where(within, np.maximum(weight / way.heavier, WEIGHT_WITHIN), heavier)
            state = self._drawn(state, wanted, within, weight, NEARLY_ALIKE * self.tolerance)
            yield state
            if len(state.kinds) <= aim:
                return

    def _drawn(
        self, state: _State, wanted: np.ndarray, within: np.ndarray, weight: np.ndarray, enough: float
    ) -> _State:
        """Return the state after all parts have been drawn to the nearest of some kinds, the mean of those within."""
        self.turned()
        near = state.misfit[:, wanted].argmin(axis=1)
        shift = state.shift[np.arange(len(near)), wanted[near]]
        pull = _aims(self.parts, state.vectors, near, shift, within, len(wanted)) - state.vectors
        size = np.sqrt((pull**2).sum(axis=(1, 2)) / np.maximum(self.parts.count, 1))
        pull *= np.maximum(1 - enough / np.maximum(size, 1e-300), 0)[:, None, None]
        place = self.charts.place_of(state.nodes)
        place = self.charts.within(place + _step(self.parts, self.charts, place, pull, weight))
        return self.at(self.images.alike(self.charts.moved(place)))


def kinds_report(before: Grid, found: PartKinds, tolerance: float) -> dict[str, Any]:
    """Return the figures as plain values, moves over the mean member of the grid before."""
    mean = float(before.lengths.mean())
    sizes, mirrored = found.parts.count, np.bincount(found.of[found.mirrored], minlength=len(found.counts))
    return {
        "tolerance": tolerance,
        "mirror_images_alike": found.mirror_images_alike,
        "kinds_before": found.before,
        "misfit_max": float(found.misfit.max(initial=0.0)),
        "moved_mean": float(found.moved.mean()) / mean,
        "moved_max": float(found.moved.max()) / mean,
        "length_cv_before": before.quality.length_cv,
        "length_cv": found.grid.quality.length_cv,
        "kinds": [
            {found.parts.called: part, found.parts.size_is: int(sizes[part]), f"{found.parts.called}s": count}
            | ({"mirrored": turned} if found.mirror_images_alike else {})
            for part, count, turned in zip(
                found.representative.tolist(), found.counts.tolist(), mirrored.tolist(), strict=True
            )
        ],
        "kind_of": found.of.tolist(),
    }


def fewest_kinds(near: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Return parts that stand for all that are used, each time that which the most others are near to (N, N)."""
    near = near | np.eye(len(used), dtype=bool)  # whatever the rounding
    held = (near & used).sum(axis=1) * used  # how many of the parts left each is near to
    left, found = used.copy(), []
    while left.any():  # ends: each part left is near to itself, so that each turn takes one at least
        best = int(held.argmax())
        found.append(best)
        gone = left & near[best]
        left &= ~gone
        held = held - near[:, gone].sum(axis=1) * used
    return np.array(found, np.int64)


def _aims(
    parts: PartVectors, vectors: np.ndarray, near: np.ndarray, shift: np.ndarray, within: np.ndarray, number: int
) -> np.ndarray:
    """Return where the vectors (N, W, 3) of each part would be in the mean part of its kind, turned to it."""
    width = vectors.shape[1]
    at, count = np.arange(width), np.maximum(parts.count, 1)[:, None]
    sign = np.where(is_mirrored(shift, parts.count), -1.0, 1.0)  # an image by the point, which a turn makes any other
    back = is_reversed(shift, parts.count)[:, None]
    there = np.where(back, shift[:, None] - at, shift[:, None] + at) % count
    there = np.where(at < count, there, at)  # of the part, for each vector of the kind
    rolled = sign[:, None, None] * np.take_along_axis(vectors, there[..., None], axis=1)
    mean = np.zeros((number, width, 3))
    first = np.full(number, -1)
    order = np.flatnonzero(within)
    first[near[order][::-1]] = order[::-1]
    mean[first >= 0] = rolled[first[first >= 0]]
    held = np.maximum(np.bincount(near[within], minlength=number), 1)[:, None, None]
    for _ in range(2):
        turns = _turns(mean[near], rolled)  # from the kind to the part
        total = np.zeros_like(mean)
        np.add.at(total, near[within], np.einsum("vij,vwi->vwj", turns, rolled)[within])
        mean = parts.shaped(total / held)
    aim = np.einsum("vij,vwj->vwi", _turns(mean[near], rolled), mean[near])
    here = np.where(back, shift[:, None] - at, at - shift[:, None]) % count
    here = np.where(at < count, here, at)
    found = sign[:, None, None] * np.take_along_axis(aim, here[..., None], axis=1)
    none = first[near] < 0
    found[none] = vectors[none]
    return np.asarray(found)


def _turns(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return rotations (N, 3, 3) that bring vectors (N, W, 3) nearest to others (Kabsch 1976)."""
    left, _, right = np.linalg.svd(np.einsum("vwi,vwj->vij", other, one))
    left[:, :, 2] *= np.sign(np.linalg.det(left) * np.linalg.det(right))[:, None]
    return np.asarray(left @ right)


def _step(parts: PartVectors, charts: Charts, place: np.ndarray, pull: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return moves (V, 2) on the charts by a damped Gauss-Newton step that adds `pull` (N, W, 3) to the vectors, as they turn."""
    ways, nodes = charts.ways(place), charts.moved(place)
    number = len(weight)
    rows = charts.mean * parts.slopes(nodes, ways).reshape(number, pull.shape[1] * 3, -1)
    rows = _without_turns(rows, parts.vectors(nodes))
    excess, further = parts.held(nodes, ways)
    rows = np.concatenate(
        [rows * np.sqrt(weight)[:, None, None], further.reshape(*excess.shape, rows.shape[2])], axis=1
    )
    aim = np.concatenate([charts.mean * np.sqrt(weight)[:, None] * pull.reshape(number, -1), excess], axis=1)
    columns = np.maximum(2 * parts.nodes_of[..., None] + np.arange(2), 0).reshape(
        number, -1
    )  # whatever of none: its rows are nil
    blocks = np.swapaxes(rows, 1, 2) @ rows
    down, across = (np.broadcast_to(each, blocks.shape).ravel() for each in (columns[:, :, None], columns[:, None]))
    stiff = coo_matrix((blocks.ravel(), (down, across)), (place.size, place.size)).tocsr()
    right = np.bincount(columns.ravel(), np.einsum("nrc,nr->nc", rows, aim).ravel(), place.size)
    damping = STIFFNESS_OF_NODE + STIFFNESS_OF_PARTS * stiff.diagonal()
    stiff = stiff + diags(np.where(charts.free.ravel(), damping, 1.0))
    found = spsolve(stiff.tocsc(), right).reshape(place.shape) * charts.free
    return shortened(found, STEP_OF_NODE * charts.mean)


def _without_turns(rows: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return changes (N, 3 W, C) of vectors (N, W, 3) without that by which they turn all together."""
    axes = np.eye(3)
    turned = np.cross(axes[:, None, None], vectors[None])  # (3, N, W, 3), for a turn about each axis
    basis = np.moveaxis(turned, 0, -1).reshape(len(vectors), -1, 3)
    transposed = np.swapaxes(basis, 1, 2)
    return np.asarray(rows - basis @ (np.linalg.pinv(transposed @ basis, hermitian=True) @ (transposed @ rows)))


class Kinds(NamedTuple):
    """Parts of a grid by kind."""

    representative: np.ndarray  #: (K,) part that stands for each kind, that which the most are of first
    of: np.ndarray  #: (N,) kind of each part, -1 of a node without members
    mirrored: np.ndarray  #: (N,) bool, whether it is the mirror image of its kind
    misfit: np.ndarray  #: (N,) to the representative of its kind


def kinds_of_parts(parts: PartVectors, nodes: np.ndarray, tolerance: float, *, mirrored: bool) -> Kinds:
    """Return the kinds of the parts of a grid with nodes (V, 3): each time that which the most others are within the tolerance of."""
    vectors = parts.vectors(nodes)
    misfit, _ = parts.misfits(vectors, np.arange(len(vectors)), mirrored=mirrored)
    return _sorted(parts, nodes, fewest_kinds(misfit <= tolerance, parts.count > 0), mirrored=mirrored)


def _sorted(parts: PartVectors, nodes: np.ndarray, kinds: np.ndarray, *, mirrored: bool) -> Kinds:
    """Return all parts by the nearest of some kinds."""
    misfit, shift = parts.misfits(parts.vectors(nodes), kinds, mirrored=mirrored)
    near, used = misfit.argmin(axis=1), parts.count > 0
    return Kinds(
        representative=kinds,
        of=np.where(used, near, -1),
        mirrored=used & is_mirrored(shift[np.arange(len(near)), near], parts.count),
        misfit=np.where(used, misfit.min(axis=1), 0.0),
    )


def _found(grid: Grid, descent: _Descent, asked: Alike, stages: list[Stage]) -> PartKinds:
    """Return the record of the grid of the last stage."""
    nodes, kinds, _ = stages[-1]
    parts = descent.parts
    return PartKinds(
        **_sorted(parts, nodes, kinds, mirrored=descent.mirrored)._asdict(),
        grid=moved_grid(grid, nodes, asked),
        moved=np.linalg.norm(nodes - grid.nodes, axis=1),
        parts=parts,
        mirror_images_alike=descent.mirrored,
        stages=tuple(stages),
    )
