"""Fit: at last nodes leave the crests of folds, and the scan a little, where members are more even and the scan is nearer for it.

With all nodes on a scan that bends within a member, all of the scan lies to one side of the triangles; and with nodes on the very crests
of rounded folds, members between two of them are uneven. A ridge from which the scan would be farther for it is sharp: there they stay.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..check.distances import (
    POINT_BOX,
    POINTS_OF_PLANE,
    distances_to_grid,
    kept_boxes_of,
    normals_of,
    points_of_planes,
)
from ..check.limits import NOISES_OFF, WARN_OFFSET
from ..errors import CertificateError
from ..kernels.mesh.fit import Planes, Pull, put_feet_of_samples, put_planes, settle_to_fit
from ..kernels.mesh.grid import AT_REST, INTERIOR, ON_CURVE, is_line
from ..surface.chosen_samples import KEPT
from .candidate import Candidate, judged
from .equalize import LAST_LENGTH_WEIGHT
from .optimize import closed_grid
from .perturbation import Spared

if TYPE_CHECKING:
    from ..boundary.find import Boundary
    from ..check.certify import Judged
    from ..constraints.find import Constraints
    from ..grid.grid import Grid
    from ..settings import Settings
    from ..surface.samples import SurfaceSamples
    from .working_mesh import Closed, WorkingMesh

MORE_OF_LENGTHS = 1.5  # times the weight of the lengths of members in the last sweeps before, as distances count, too
ROUNDS_OF_FIT, SWEEPS_OF_FIT = 4, 6  # times that samples are assigned to triangles anew, and sweeps after each
FITTED_FROM = (
    0.15  # distance of the scan from a grid at 99 %, its noise aside, from which on it is fitted [member lengths]
)
# what it is worth that nodes leave the scan: by how much the lengths must vary less, or the scan be nearer at 99 % [member lengths]
WORTH_EVENER, WORTH_NEARER = 0.005, 0.03
FARTHEST_DRAWING = 0.6  # distance of a sample from its triangle beyond which it draws no node [member lengths]
# how many times its weight a sample counts on its triangle and at most, and how far off it counts once more [member lengths]
NEAR_SAMPLES_DRAW, FAR_SAMPLES_DRAW, DRAW_ONE_MORE = 0.3, 4.0, 0.12
FACES_ITS_TRIANGLE = -0.2  # cosine between the normals of a sample and its triangle below which that is another side
SHARE_OF_POOR = 0.97  # share of the distance from the scan that is poor, or the largest allowed, to which nodes go
# a ridge is sharp from which the samples beside it lie no farther, as rms, or from which they lie farther by so much once it was fitted
NEAR_SHARP, FARTHER_AT_SHARP = 0.03, 0.01  # [member lengths]
HELD_AT_FAULT = 2.0  # distance from a fault within which nodes stay [member lengths]
TIMES_HELD = 3  # times that the fit is made at most, as nodes at faults and on sharp ridges stay
AREA_OF_NODE = 0.866  # of a regular grid [member length^2]
MORE_UNEVEN = 0.0015  # by how much more the lengths of members of a nearer grid may vary
LESS_REGULAR = 0.0008  # by how much the mean shape quality of its triangles may fall
FARTHER_IF_EVENER = 0.005  # by how much farther at 95 and 99 % the scan may be from a more even grid [member lengths]


class Weights(NamedTuple):
    """What distances cost in a fit: the energy of a grid all of whose samples, or nodes, are a member off, for each node.

    That of samples counts as it is a tenth of a member off, see `drawing`.
    """

    samples: float
    nodes: float


WEIGHTS_TRIED = (Weights(8.0, 3.0), Weights(5.0, 4.0))  # the first that is better is taken


@dataclass(frozen=True, eq=False)
class ScanFit:
    """How a grid is fitted."""

    weights: Weights
    sharp: frozenset[int] = frozenset()  #: curves whose nodes stay on them, beside those to which the scan is near
    held: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))  #: places near which nodes stay


def take_fit(
    candidate: Candidate, samples: SurfaceSamples, boundary: Boundary, constraints: Constraints, settings: Settings
) -> None:
    """Fit the grid of a candidate that passes to the scan, and take that with its whole certificate if it is better and passes too."""
    before, whole = candidate.judged, candidate.grid
    assert before is not None
    if not _is_far(before):
        return
    for weights in WEIGHTS_TRIED:
        fit, now = best_fit(candidate, weights, samples, boundary, constraints, settings)
        if not now.certificate.passed:  # what goes wrong does so with other weights too
            return
        if not is_better(now, before):
            continue
        try:
            candidate.take(now)
            candidate.end()
            candidate.fit = fit
        except CertificateError:  # nothing but the whole certificate tells
            candidate.judged, candidate.grid = before, whole
        return


def _is_far(before: Judged) -> bool:
    """Whether the scan bends so much within members that some of it is far from a grid; outliers and noise do not count."""
    found, samples = before.found, before.samples
    if found is None:
        return False
    away = float(np.quantile(found.scan[samples.judged == KEPT], 0.99)) - NOISES_OFF * float(np.nanmedian(found.noise))
    return away >= FITTED_FROM * before.settings.length


def best_fit(
    candidate: Candidate,
    weights: Weights,
    samples: SurfaceSamples,
    boundary: Boundary,
    constraints: Constraints,
    settings: Settings,
) -> tuple[ScanFit, Judged]:
    """Return the fit of the grid of a candidate with some weights, with what has to stay, and its grid, judged."""
    following = ScanFit(weights)
    for _ in range(TIMES_HELD):
        fit = following
        grid, farther = fitted(candidate.mesh, candidate.front, samples, constraints, candidate.settings, fit)
        now = judged(grid, samples, boundary, settings)
        faults = [place for each in now.certificate.faults for place in (each.where, *each.also) if place]
        if not faults and not farther:
            break
        held = np.array(faults, float).reshape(-1, 3) - samples.origin
        following = ScanFit(weights, fit.sharp | farther, np.concatenate([fit.held, held]))
    return fit, now


def is_better(now: Judged, before: Judged) -> bool:
    """Whether a fitted grid is so much more even, or nearer to the scan, that it is worth it, hardly worse in anything and no poorer."""
    one, other = now.certificate.scan_distance, before.certificate.scan_distance
    if len(now.certificate.warnings) > len(before.certificate.warnings) or one is None or other is None:
        return False
    had, has, length = before.grid.quality, now.grid.quality, now.settings.length
    is_near = max(one.p95 - other.p95, one.p99 - other.p99) <= FARTHER_IF_EVENER * length
    is_even = has.length_cv <= had.length_cv + MORE_UNEVEN and has.shape_mean >= had.shape_mean - LESS_REGULAR
    is_worth_it = had.length_cv - has.length_cv >= WORTH_EVENER or other.p99 - one.p99 >= WORTH_NEARER * length
    return is_near and is_even and is_worth_it


def fitted(
    mesh: WorkingMesh,
    front: Grid,
    samples: SurfaceSamples,
    constraints: Constraints,
    settings: Settings,
    fit: ScanFit,
) -> tuple[Grid, frozenset[int]]:
    """Return the grid of a mesh at rest, fitted to the scan, and the curves of its ridges from which the scan is farther for it.

    The mesh stays as it is.
    """
    net = mesh.net
    nodes, arc = net.nodes.copy(), net.arc.copy()
    try:
        fitting = _Fitting(mesh, mesh.close(front), samples, settings, fit)
        before = fitting.off, fitting.nearest
        for _ in range(ROUNDS_OF_FIT):
            fitting.settle()
        fitting.draw_back()
        grid = closed_grid(mesh, front, constraints, settings, fitting.closed)
        return grid, fitting.curves_farther_than(*before)
    finally:
        net.nodes[:], net.arc[:] = nodes, arc


def drawing(off: np.ndarray) -> np.ndarray:
    """Return how many times their weight samples count that are so far off their triangles [member lengths], (S,): far ones are seen."""
    times: np.ndarray = np.minimum(NEAR_SAMPLES_DRAW + (off / DRAW_ONE_MORE) ** 2, FAR_SAMPLES_DRAW)
    return times


class _Fitting:
    """A mesh while its nodes move to where it fits the scan."""

    def __init__(
        self, mesh: WorkingMesh, closed: Closed, samples: SurfaceSamples, settings: Settings, fit: ScanFit
    ) -> None:
        self.mesh, self.closed, self.fit = mesh, closed, fit
        self.length_weight = MORE_OF_LENGTHS * LAST_LENGTH_WEIGHT[settings.prefer]
        surface, own = samples.surface, samples.kept.copy()
        own[samples.measured :] = False
        # one point of each: their means lie within sharp edges
        self.places, self.normals = surface.points[surface.start[:-1][own]], surface.normals[own]
        self.local = mesh.length * surface.field[own]
        self.corners = closed[1][closed[0].triangles]
        self.points, self.near = points_of_planes(samples), 2.0 * samples.spacing
        self.boxes = kept_boxes_of(self.points, max(POINT_BOX * mesh.length, self.near), samples)
        self.farthest = SHARE_OF_POOR * min(WARN_OFFSET, settings.max_offset)
        self.off, self.nearest = self._distances()
        self.soft = self._soft_curves(fit.sharp)
        near = {curve for curve, off in self._off_curves(self.off, self.nearest) if off < NEAR_SHARP}
        self.soft = self._soft_curves(fit.sharp | near)
        self.is_free = ((mesh.net.kind == INTERIOR) | (self.soft >= 0)).astype(np.int64)
        moves = (mesh.net.degree > 0) & ~mesh.fixed & np.isfinite(mesh.projection_distance)
        moves &= (self.is_free == 1) | (mesh.net.kind == ON_CURVE)
        if len(fit.held):
            moves &= Spared(fit.held, HELD_AT_FAULT * mesh.length).away(mesh.net.nodes)
        self.moving = np.flatnonzero(moves)

    def _soft_curves(self, sharp: frozenset[int]) -> np.ndarray:
        """Return the curve of a ridge that each node may leave, (C,) int64, -1 for none.

        Where all ridges that meet in a corner are such, the corner may move too; it has the curve of one of them.
        """
        mesh, net = self.mesh, self.mesh.net
        curve, is_soft = np.full(len(net.degree), -1), mesh.sharp.copy()
        is_soft[list(sharp)] = False
        inside = (net.degree > 0) & (net.line != 0) & (net.is_open == 0) & ~mesh.fixed
        sliding = inside & (net.kind == ON_CURVE)
        curve[sliding] = np.where(is_soft[net.curve[sliding]], net.curve[sliding], -1)
        for v in np.flatnonzero(inside & (net.kind == AT_REST)).tolist():
            beside = [curve[u] for u in net.ring[v, : net.degree[v]].tolist() if is_line(net, v, u)]
            if min(beside) >= 0:
                curve[v] = beside[0]
        return curve

    def _distances(self) -> tuple[np.ndarray, np.ndarray]:
        """Return how far the samples are from the grid (S,), and their triangles (S,) int64, -1 for those on another side or far off."""
        grid, kept = self.closed
        grid = grid.replace(nodes=self.mesh.net.nodes[kept])
        off, nearest = distances_to_grid(self.places, grid, self.mesh.length)
        facing = (normals_of(grid)[nearest] * self.normals).sum(axis=1)
        return off / self.local, np.where(
            (off < FARTHEST_DRAWING * self.local) & (facing > FACES_ITS_TRIANGLE), nearest, -1
        )

    def settle(self) -> None:
        """Let the nodes settle, and look for the triangles of the samples anew."""
        mesh = self.mesh
        settle_to_fit(
            mesh.net,
            mesh.patches,
            mesh.curves,
            self.moving,
            self.is_free,
            self._pull(),
            self._planes(),
            mesh.length,
            self.length_weight,
            self.fit.weights.nodes,
            self.farthest,
            SWEEPS_OF_FIT,
        )
        self.off, self.nearest = self._distances()

    def draw_back(self) -> None:
        """Put nodes that are farther off the scan than they may be, as other points are nearest by now, back as far as that."""
        net, planes = self.mesh.net, self._planes()
        over = ((net.nodes - planes.middle) * planes.normal).sum(axis=1)
        most = self.farthest * self.mesh.length * net.desired + NOISES_OFF * planes.noise
        far = self.moving[(self.is_free[self.moving] == 1) & (np.abs(over[self.moving]) > most[self.moving])]
        back = over[far] - np.copysign(most[far], over[far])
        net.nodes[far] -= back[:, None] * planes.normal[far]

    def _planes(self) -> Planes:
        """Return the planes of the points around the nodes that move."""
        net = self.mesh.net
        planes = Planes(np.zeros_like(net.nodes), np.zeros_like(net.nodes), np.zeros_like(net.arc))
        put_planes(self.moving, net.nodes, self.points, self.boxes, POINTS_OF_PLANE, self.near, planes)
        return planes

    def _pull(self) -> Pull:
        """Return how the samples draw the nodes."""
        nodes, corners, count = self.mesh.net.nodes, self.corners, len(self.places)
        shares, off, direction = np.zeros((count, 3)), np.zeros(count), np.zeros((count, 3))
        put_feet_of_samples(self.places, nodes, corners, self.nearest, shares, off, direction)
        a, b, c = (nodes[corners[:, k]] for k in range(3))
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / count
        weight = self.fit.weights.samples * drawing(off / self.local) * area / (AREA_OF_NODE * self.local**4)
        node, entry = corners[self.nearest].ravel(), np.flatnonzero(shares.ravel() > 0.0)
        entry = entry[np.argsort(node[entry], kind="stable")]
        start = np.searchsorted(node[entry], np.arange(len(self.soft) + 1))
        return Pull(start, entry // 3, shares.ravel()[entry], off, direction, weight)

    def curves_farther_than(self, before: np.ndarray, nearest: np.ndarray) -> frozenset[int]:
        """Return the curves that nodes may leave from which the samples beside them are farther than before.

        before, nearest : (S,) distances of the samples and their triangles before
        """
        known, now = self._off_curves(before, nearest), self._off_curves(self.off, nearest)
        return frozenset(
            curve for (curve, was), (_, off) in zip(known, now, strict=True) if off > was + FARTHER_AT_SHARP
        )

    def _off_curves(self, off: np.ndarray, nearest: np.ndarray) -> list[tuple[int, float]]:
        """Return the curves that nodes may leave, and how far off the samples of the triangles along each are, as rms."""
        beside = np.where(nearest[:, None] >= 0, self.soft[self.corners[nearest]], -1)
        found = []
        for curve in np.unique(self.soft[self.soft >= 0]).tolist():
            own = (beside == curve).any(axis=1)
            found.append((curve, float(np.sqrt((off[own] ** 2).mean())) if own.any() else 0.0))
        return found
