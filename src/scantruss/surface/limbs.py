"""Limbs, handles and necks too thin for a tube of three members: where they are cut off, each at a clean ring."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

import numpy as np

from ..kernels.geometry.boxes import SearchBoxes
from ..kernels.geometry.components import component_labels
from ..kernels.scan.nearby import nearest_places
from ..kernels.surface.girths import mark_opposite
from ..kernels.surface.local_surface import Surface, flood
from ..runtime.parallel import run_in_parts
from .given_normals import GivenNormals
from .pieces import LEAST_TRIANGLES, TRIANGLE_AREA, sample_areas
from .rods import line_like, moments_around
from .tubes import (
    FINE_SAMPLES,
    HALF_SECTION,
    FineSamples,
    alike_parts,
    faces_inwards,
    follow_limbs,
    girths,
    most_beside,
)

# share of the tubes that face inwards that do so by samples half as wide too, if these are taken
LEAST_TURNED_BACK = 0.5
# distance from a sample within which one faces the opposite way on a limb too thin [desired lengths]
SUSPECT_WITHIN = 1.1
FEWEST_ALONG_LINE = 5  # fewest samples that show that others lie along a line
FEWEST_OF_LIMB = 12  # fewest samples of a part that is cut off
BLUNT_END = 2.0  # least area of an end that is wider than a member [desired lengths^2]
SURE_GIRTH = 0.95  # girth at the thinnest twentieth of a limb above which it is not cut off [girth below which limbs are cut off]
BLUNT_GIRTH = 0.5  # the same of what is the end of a limb that stays
BLUNT_NORMAL = 0.4  # mean normal above which it is such an end; half a ball has 0.5, a tube 0
BLUNT_HEIGHT = 1.0  # height up to which such an end is a peak of the body and stays [desired lengths]
CLEAN_RING_SHARE = 0.8  # least share of the samples on each side of a ring that are on the right side
NECK_GIRTH = 0.8  # girth down to which a neck before such an end stays [girth below which limbs are cut off]
LOOKED_AROUND_RING = 0.4  # how far a ring is looked around for, beside its own radius [desired lengths]
NEAR_PLANE = 0.3  # distance from the plane of a ring up to which points show its shape [desired lengths]
AROUND_RING = 1.5  # how far from the middle of a ring they may be [distance of the farthest sample at its edge]
RING_WAVES = 3  # of a ring: its radius is a Fourier series of so many terms
WIDEST_GAP = 100.0  # largest angle without points, seen from the middle of a ring [degree]
# girth of a ring below which it is no boundary but a hole that the front runs over [desired lengths]
SMALLEST_RING = 2.5
POINTS_OF_RING = 72  # points of the polygon that stands for a ring
MOST_OF_SCAN_THIN = 0.4  # share of the scan above which what is thin is the scan itself
LIMBS_PER_THREAD = 400  # fewest places worth a thread of their own


@dataclass(frozen=True, eq=False)
class LimbRing:
    """Where a limb was cut off."""

    points: np.ndarray  #: (M, 3) closed curve, the surface that is left to its left; relative to the cloud's origin
    girth: float  #: [scan unit]
    bounds: bool  #: whether it becomes a boundary; else it is as small as a hole that the front runs over


def cut_limbs(
    points: np.ndarray,
    spacing: float,
    girth: float,
    surface: Surface,
    boxes: SearchBoxes,
    given: GivenNormals | None = None,
    smooth: bool = False,
) -> tuple[np.ndarray, tuple[LimbRing, ...]]:
    """Return which points (N, 3) lie on limbs thinner than a girth, (N,) bool, and the rings at which these are cut off.

    Parameters
    ----------
    girth : float
        Below which limbs are cut off [desired lengths].
    surface, boxes : Surface, SearchBoxes
        The samples of the points.
    given : GivenNormals, optional
        Normals that came with the scan.
    smooth : bool
        Whether the scan bends evenly everywhere, so that the normals of its samples can be trusted.
    """
    none: tuple[np.ndarray, tuple[LimbRing, ...]] = np.zeros(len(points), np.bool_), ()
    suspect = _suspects(surface, boxes, girth, smooth)
    if suspect.sum() < FEWEST_OF_LIMB:
        return none
    owner = np.empty(len(points), np.int64)
    reach = 2.0 * max(surface.radius, spacing)
    nearest_places(points, boxes, surface.mean, reach, owner, 0, len(points))
    which = np.flatnonzero((owner >= 0) & suspect[owner])
    parts = _Parts.of(points[which], owner[which], spacing, girth, surface, _bodies_beside(suspect, surface), given)
    if parts is None:
        return none
    gone, rings = parts.cut()
    if not gone.any() or gone.sum() > MOST_OF_SCAN_THIN * len(points):
        return none
    none[0][which[gone]] = True
    return none[0], rings


def _suspects(surface: Surface, boxes: SearchBoxes, girth: float, smooth: bool) -> np.ndarray:
    """Return which samples may lie on a limb too thin (S,) bool, and those around them."""
    marks = np.zeros(len(surface.mean), np.bool_)
    run_in_parts(len(marks), LIMBS_PER_THREAD, mark_opposite, surface, boxes, SUSPECT_WITHIN * girth / 3.0, marks)
    if not smooth:
        others = np.flatnonzero(~marks)
        marks[others] = _along_lines(surface, boxes, girth, others)
    if marks.sum() < FEWEST_OF_LIMB:
        return marks
    beside = surface.neighbors
    for _ in range(int(np.ceil(1.5 * surface.length / (2.0 * surface.radius)))):
        marks = marks | (marks[beside] & (beside >= 0)).any(axis=1)
    return marks


def _along_lines(surface: Surface, boxes: SearchBoxes, girth: float, which: np.ndarray) -> np.ndarray:
    """Return which of some samples (K,) lie along a line, (K,) bool: on a limb hardly wider than they are, whose normals tell nothing."""
    every, reach = np.ones(len(surface.mean), np.bool_), surface.length * girth / 3.0
    moments, _, count = moments_around(surface.mean, boxes, every, reach, which)
    return line_like(np.linalg.eigvalsh(moments)) & (count >= FEWEST_ALONG_LINE)


def _bodies_beside(suspect: np.ndarray, surface: Surface) -> np.ndarray:
    """Return at each suspect sample (S,) the number of the rest of the scan that it is linked to, -1 where it is linked to none."""
    linked = (surface.neighbors >= 0) & ~suspect[surface.neighbors] & suspect[:, None]
    body, at = alike_parts(suspect, surface.neighbors), np.flatnonzero(linked.any(axis=1))
    beside = np.full(len(suspect), -1)
    beside[at] = body[surface.neighbors[at, linked[at].argmax(axis=1)]]
    return beside


@dataclass(frozen=True, eq=False)
class _Parts:
    """Fine samples of the parts of a scan where limbs may be, and what they are."""

    points: np.ndarray  #: (N, 3)
    owner: np.ndarray  #: (N,) fine sample of each
    surface: Surface
    axis: np.ndarray  #: (S, 3) of the limb at each sample
    girth: np.ndarray  #: (S,) [desired lengths]
    limit: float  #: girth below which limbs are cut off [desired lengths]
    label: np.ndarray  #: (S,) number of the part of each sample
    thin: np.ndarray  #: (S,) bool
    #: (S,) step in which each was found to be thin, by following a limb to the body; else 0, or less
    reached: np.ndarray
    solid: np.ndarray  #: (S,) bool, of a part that is no end of a limb
    body: np.ndarray  #: (S,) number of the rest of the scan that is linked to each, -1 where it is linked to none

    @classmethod
    def of(
        cls,
        points: np.ndarray,
        coarse: np.ndarray,
        spacing: float,
        limit: float,
        scan: Surface,
        bodies: np.ndarray,
        given: GivenNormals | None,
    ) -> _Parts | None:
        """Return the parts of points (N, 3) of samples of the scan (N,), beside its other parts (T,); None where none is thin."""
        length = scan.length
        radius, finest = FINE_SAMPLES * length, 0.25 * spacing
        fine = FineSamples.of(points, coarse, max(radius, finest), spacing, scan, given)
        girth, axis = girths(fine.surface, limit)
        inwards = faces_inwards(girth, limit)
        if inwards.sum() >= FEWEST_OF_LIMB:  # holes, or limbs turned inside out at an acute angle with the body
            finer = FineSamples.of(points, coarse, max(0.5 * radius, finest), spacing, scan, given)
            there = np.flatnonzero(inwards[fine.owner[finer.chosen]])
            again = faces_inwards(girths(finer.surface, limit, there)[0][there], limit)
            if again.mean() < LEAST_TURNED_BACK:
                fine = finer
                girth, axis = girths(fine.surface, limit)
        girth[girth < 0.0] = np.inf
        surface, owner, of_scan = fine.surface, fine.owner, coarse[fine.chosen]
        thin = most_beside(girth < limit, surface.neighbors)
        reached, axis = follow_limbs(surface, thin, girth, axis, limit)
        thin = reached >= 0
        if thin.sum() < FEWEST_OF_LIMB:
            return None
        area = sample_areas(surface) / (length * surface.field) ** 2
        label = alike_parts(thin, surface.neighbors)
        total = np.bincount(label, area, len(label))
        body = bodies[of_scan]
        at_boundary = np.bincount(label, body >= 0, len(label)) > 0
        small = ~thin & ~at_boundary[label] & (total[label] < BLUNT_END)
        thin = thin | small
        label = alike_parts(thin, surface.neighbors)
        few = thin & (np.bincount(label, minlength=len(label))[label] < FEWEST_OF_LIMB)
        if few.any():
            thin = thin & ~few
            label = alike_parts(thin, surface.neighbors)
        total = np.bincount(label, area, len(label))
        at_boundary = np.bincount(label, body >= 0, len(label)) > 0
        solid = ~thin & (at_boundary | (total >= LEAST_TRIANGLES * TRIANGLE_AREA))[label]
        return cls(points, owner, surface, axis, girth, limit, label, thin, reached, solid, body)

    def cut(self) -> tuple[np.ndarray, tuple[LimbRing, ...]]:
        """Return which points (N,) bool are cut off, and the rings where limbs leave the body."""
        label = self.label
        one, other = self._links(self.thin, ~self.thin)
        kept_necks = self._kept_necks(label[one], label[other])
        joined = np.isin(label[one], kept_necks)
        whole = component_labels(len(label), label[one[joined]], label[other[joined]])[label]
        stays = np.isin(whole, np.unique(whole[self.solid]))
        removed = np.zeros(len(self.owner), np.bool_)
        rings: list[LimbRing] = []
        for limb in np.unique(whole[~stays]):
            gone = whole == limb
            ahead = self.surface.normals[gone].mean(axis=0)
            blunt = np.linalg.norm(ahead) > BLUNT_NORMAL
            if blunt and self._height(gone, ahead) < BLUNT_HEIGHT:
                continue
            if self._thinnest(gone & self.thin) > (BLUNT_GIRTH if blunt else SURE_GIRTH) * self.limit:
                continue
            off = gone[self.owner]
            found = [self._rings_at(end, gone, off) for end in self._ends(gone)]
            if found and all(found):  # what has no clean end stays
                rings += chain.from_iterable(found)
                removed |= off
        return removed, tuple(rings)

    def _ends(self, gone: np.ndarray) -> list[np.ndarray]:
        """Return the samples (S,) bool at each end of what is cut off (S,) bool: at its edge, and those as far as it was followed there."""
        followed = alike_parts(gone & (self.reached > 0), self.surface.neighbors)
        ends: list[np.ndarray] = []
        for edge in self._groups(*self._links(gone & self.thin, ~gone & ~self.thin)):
            end = np.isin(followed, followed[edge[self.reached[edge] > 0]])
            end[edge] = True
            if not any(end[edge].all() for end in ends):
                ends.append(end)
        return ends

    def _rings_at(self, end: np.ndarray, gone: np.ndarray, removed: np.ndarray) -> list[LimbRing]:
        """Return the rings at an end (S,) bool of what is cut off, as near to the body as all are clean, and mark what lies beyond."""
        for step in range(int(self.reached[end].max()), -1, -1):
            stays = end & (self.reached > step)
            left = gone & ~stays
            one, other = self._links(left & self.thin, ~left & (end | ~self.thin))
            here = end[one] | stays[other]
            before = left[self.owner]
            off = before.copy()
            rings = [self._ring(edge, left, off) for edge in self._groups(one[here], other[here])]
            found = [ring for ring in rings if ring is not None]
            if found and len(found) == len(rings):
                removed[stays[self.owner]] = False
                removed[off != before] = off[off != before]
                return found
        return []

    def _links(self, one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the links (L,), (L,) from some samples (S,) bool to others (S,) bool."""
        beside = self.surface.neighbors
        at, k = np.nonzero((beside >= 0) & one[:, None] & other[beside])
        return at, beside[at, k]

    def _kept_necks(self, thin: np.ndarray, fat: np.ndarray) -> np.ndarray:
        """Return the labels of thin parts that stay, of all links thin-fat (L,).

        They are not much too thin, and lie before a blunt end or join what would fall apart without them.
        """
        kept = []
        solid = np.unique(self.label[self.solid])
        for part in np.unique(thin):
            ends = np.unique(fat[thin == part])
            blunt = ~np.isin(ends, solid)
            if len(ends) < 2 or self._thinnest(self.label == part) < NECK_GIRTH * self.limit:
                continue
            if blunt.all() or (not blunt.any() and not self._joins(part, ends, thin, fat)):
                continue
            kept.append(part)
        return np.array(kept, np.int64)

    def _joins(self, part: int, ends: np.ndarray, thin: np.ndarray, fat: np.ndarray) -> bool:
        """Whether the ends (K,) of a thin part hang together by that part alone, of all links thin-fat (L,)."""
        others, to_body = thin != part, self.body >= 0
        one = np.concatenate([thin[others], self.label[to_body]])
        other = np.concatenate([fat[others], len(self.label) + self.body[to_body]])
        apart = component_labels(len(self.label) + int(self.body.max()) + 1, one, other)
        return len(np.unique(apart[ends])) > 1

    def _thinnest(self, which: np.ndarray) -> float:
        """Return the girth at the thinnest twentieth of some samples (S,) bool [desired lengths]."""
        known = self.girth[which & np.isfinite(self.girth)]
        return float(np.quantile(known, 0.05)) if len(known) else 0.0

    def _height(self, which: np.ndarray, ahead: np.ndarray) -> float:
        """Return how far some samples (S,) bool reach along a direction (3,) [desired lengths]."""
        along = self.surface.mean[which] @ ahead / np.linalg.norm(ahead)
        return float(np.ptp(along)) / (self.surface.length * float(self.surface.field[which].mean()))

    def _groups(self, thin: np.ndarray, fat: np.ndarray) -> list[np.ndarray]:
        """Return the thin samples at each place where a part that is cut off joins one that stays; of the links (L,) between these."""
        at = np.unique(np.concatenate([thin, fat]))
        position = np.full(len(self.label) + 1, -1)
        position[at] = np.arange(len(at))
        beside = position[self.surface.neighbors[at]]
        one, k = np.nonzero(beside >= 0)
        group = component_labels(len(at), one, beside[one, k])
        edge = np.isin(at, thin)
        return [at[edge & (group == each)] for each in np.unique(group[edge])]

    def _ring(self, edge: np.ndarray, gone: np.ndarray, removed: np.ndarray) -> LimbRing | None:
        """Return the ring at some samples (K,) where a limb begins, and mark the points beyond it as removed, those before it as not."""
        surface = self.surface
        length = surface.length * float(surface.field[edge].mean())
        middle = surface.mean[edge].mean(axis=0)
        radius = float(np.linalg.norm(surface.mean[edge] - middle, axis=1).max())
        count = flood(surface, int(edge[0]), tuple(middle), radius + LOOKED_AROUND_RING * length)
        near = surface.queue[:count].copy()
        followed = bool((self.reached[edge] > 0).any())
        if followed:
            axis = np.linalg.eigh(self.axis[edge].T @ self.axis[edge])[1][:, 2]
        else:
            normals = surface.normals[near[np.linalg.norm(surface.mean[near] - middle, axis=1) < radius + 0.2 * length]]
            axis = np.linalg.eigh(normals.T @ normals)[1][:, 0]
        if gone[near].all() or not gone[near].any():  # a one-sided surface: no side is cut off there
            return None
        side = surface.mean[near[gone[near]]].mean(axis=0) - surface.mean[near[~gone[near]]].mean(axis=0)
        axis = axis * np.sign(side @ axis)
        frame = np.stack([*_frame(axis), axis])
        mine = np.flatnonzero(np.isin(self.owner, near))
        at_edge = (surface.mean[edge] - middle) @ frame.T
        wide = AROUND_RING * float(np.hypot(at_edge[:, 0], at_edge[:, 1]).max()) if followed else np.inf
        for _ in range(2):
            flat = (self.points[mine] - middle) @ frame.T
            close = (np.abs(flat[:, 2]) < NEAR_PLANE * length) & (np.hypot(flat[:, 0], flat[:, 1]) < wide)
            middle = middle + frame[:2].T @ _middle(flat[close, :2])
        flat = (self.points[mine] - middle) @ frame.T
        close = (np.abs(flat[:, 2]) < NEAR_PLANE * length) & (np.hypot(flat[:, 0], flat[:, 1]) < wide)
        fitted = _fit_ring(flat[close])
        if fitted is None:
            return None
        turn = -2.0 * np.pi * np.arange(POINTS_OF_RING) / POINTS_OF_RING
        out = fitted(turn)
        ring = middle + out[:, None] * (np.cos(turn)[:, None] * frame[0] + np.sin(turn)[:, None] * frame[1])
        girth = float(np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1).sum())
        height = (surface.mean[near] - middle) @ frame.T
        within = np.hypot(height[:, 0], height[:, 1]) < 1.3 * out.max()
        for way in (1.0, -1.0):
            clear = within & (way * height[:, 2] > HALF_SECTION * length)
            if (gone[near[clear]] == (way > 0.0)).sum() < CLEAN_RING_SHARE * clear.sum():
                return None
        bounds = girth > SMALLEST_RING * length
        away = np.hypot(flat[:, 0], flat[:, 1]) / out.max()
        inside = away < 1.3
        end = 0.0 if bounds else -HALF_SECTION * length
        body = ~inside & (away < 2.0) & (flat[:, 2] < 0.0)
        if followed and not bounds and body.any():  # where the body begins beside the limb
            end = max(min(float(np.quantile(flat[body, 2], 0.98)), end), -LOOKED_AROUND_RING * length)
        removed[mine[inside]] = flat[inside, 2] > end
        return LimbRing(ring, girth, bounds)


def _frame(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors at right angles to an axis and to each other."""
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    return first, np.cross(axis, first)


def _middle(flat: np.ndarray) -> np.ndarray:
    """Middle of points in a plane (K, 2): of the box around them, however they are spread, in two frames."""
    if not len(flat):
        return np.zeros(2)
    box = 0.5 * (flat.min(axis=0) + flat.max(axis=0))
    turned = flat @ np.array([[1.0, 1.0], [-1.0, 1.0]])
    low, high = turned.min(axis=0), turned.max(axis=0)
    other = np.array([[1.0, 1.0], [-1.0, 1.0]]) @ (0.25 * (low + high))
    middle: np.ndarray = 0.5 * (box + other)
    return middle


def _fit_ring(flat: np.ndarray) -> Callable[[np.ndarray], np.ndarray] | None:
    """Return the radius of a ring by its angle, fitted to points (K, 3): in its plane, and their height; None where it has a gap."""
    angle, out = np.arctan2(flat[:, 1], flat[:, 0]), np.hypot(flat[:, 0], flat[:, 1])
    if len(flat) < 6:
        return None
    ordered = np.sort(angle)
    gap = max(float(np.diff(ordered).max()), float(ordered[0] + 2.0 * np.pi - ordered[-1]))
    if gap > np.radians(WIDEST_GAP):
        return None
    waves = min(RING_WAVES, (len(flat) - 3) // 4)

    def series(turn: np.ndarray) -> np.ndarray:
        steps = np.arange(1, waves + 1) * turn[:, None]
        return np.column_stack([np.ones(len(turn)), np.cos(steps), np.sin(steps)])

    terms = np.column_stack([series(angle), flat[:, 2], flat[:, 2] * np.cos(angle), flat[:, 2] * np.sin(angle)])
    weights = 1e-3 * len(flat) * np.concatenate([[0.0], np.tile(np.arange(1, waves + 1), 2) ** 2, np.zeros(3)])
    found = np.linalg.solve(terms.T @ terms + np.diag(weights) + 1e-9 * np.eye(terms.shape[1]), terms.T @ out)
    return lambda turn: series(turn) @ found[: 1 + 2 * waves]
