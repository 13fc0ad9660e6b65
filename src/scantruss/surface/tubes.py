"""The girths of limbs, measured on fine samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels.geometry.components import component_labels
from ..kernels.surface.girths import follow_girths, measure_girths
from ..kernels.surface.local_surface import Surface
from ..runtime.parallel import in_parts
from .faced_surface import faced_surface
from .given_normals import GivenNormals
from .linked_samples import link_samples
from .scratch import with_own_scratch

FINE_SAMPLES = 0.1  # radius of the samples by which girths are measured [member lengths]
HALF_SECTION = 0.15  # half the thickness of a section [desired lengths]
LARGEST_GIRTH = 1.2  # largest girth that is measured [girth below which limbs are cut off]
PASSES_OF_MAJORITY = 3  # passes in which a sample becomes what most of those linked to it are
# usual girth of a limb that is followed to the body, at most [girth below which limbs are cut off]
FOLLOWED_GIRTH = 0.8
WIDER_BESIDE = 1.25  # largest girth of a limb that is followed, in that of the limb beside it
GIRTHS_PER_THREAD = 400  # fewest samples worth a thread of their own


class FineSamples(NamedTuple):
    """Fine samples of some points."""

    surface: Surface
    owner: np.ndarray  #: (N,) fine sample of each point
    chosen: np.ndarray  #: (S,) point of each

    @classmethod
    def of(
        cls,
        points: np.ndarray,
        coarse: np.ndarray,
        radius: float,
        spacing: float,
        scan: Surface,
        given: GivenNormals | None,
    ) -> FineSamples:
        """Return those of a radius of points of samples of the scan (N,)."""
        found = link_samples(points, radius, scan.length, spacing, given)
        surface, piece, _ = faced_surface(found, radius, scan.length, spacing)
        of_scan = coarse[found.chosen]
        surface = surface._replace(field=np.ascontiguousarray(scan.field[of_scan]))
        agree = np.bincount(piece, np.einsum("si,si->s", surface.normals, scan.normals[of_scan]))
        surface.normals[agree[piece] < 0.0] *= -1.0
        return cls(surface, found.owner, found.chosen)


def girths(surface: Surface, limit: float, which: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return the girth (S,) and the axis (S, 3) of the limb at all samples or some (K,), up to somewhat beyond a limit [desired lengths].

    A girth is less than 0 where the limb faces inwards.
    """
    girth, axis = np.full(len(surface.mean), np.inf), np.zeros((len(surface.mean), 3))
    some = np.arange(len(girth)) if which is None else which

    def measure(part: int, begin: int, end: int) -> None:
        own = surface if part == 0 else with_own_scratch(surface)
        measure_girths(own, some, LARGEST_GIRTH * limit, HALF_SECTION, girth, axis, begin, end)

    in_parts(len(some), GIRTHS_PER_THREAD, measure)
    return girth / (surface.length * surface.field), axis


def faces_inwards(girth: np.ndarray, limit: float) -> np.ndarray:
    """Return which samples lie on a tube so thin that faces inwards (S,) bool: a hole, or a limb turned inside out."""
    return np.asarray((girth < 0.0) & (girth > -limit))


def most_beside(marks: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Return marks (S,) bool as most of the samples linked to each have them."""
    linked = beside >= 0
    for _ in range(PASSES_OF_MAJORITY):
        marks = (marks[beside] & linked).sum(axis=1) + marks > 0.5 * (linked.sum(axis=1) + 1)
    return marks


def alike_parts(marks: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Return a number for each sample (S,): the same where samples with the same mark hang together."""
    one, k = np.nonzero((beside >= 0) & (marks[beside] == marks[:, None]))
    label: np.ndarray = component_labels(len(marks), one, beside[one, k])
    return label


def follow_limbs(
    surface: Surface, thin: np.ndarray, girth: np.ndarray, axis: np.ndarray, limit: float
) -> tuple[np.ndarray, np.ndarray]:
    """Follow limbs from their thin samples (S,) bool towards the body, which hides their axis; return in which step each is reached (S,).

    0 is what was thin before, -1 what is no limb. The axes (S, 3) are returned too, and turned where a bend made them wrong.
    """
    beside, unit = surface.neighbors, surface.length * surface.field
    reached, last = np.where(thin, 0, -1), _to_follow(surface, thin, girth, axis, FOLLOWED_GIRTH * limit)
    girth, axis = girth.copy(), axis.copy()

    def follow(which: np.ndarray, most: np.ndarray) -> np.ndarray:
        found = np.empty_like(girth)
        follow_girths(surface, which, np.minimum(WIDER_BESIDE * most, limit), HALF_SECTION, found, axis)
        which = which[np.isfinite(found[which])]
        girth[which] = found[which] / unit[which]
        return which

    known = np.flatnonzero(last & np.isfinite(girth))
    follow(known, girth[known])
    for step in range(1, len(thin)):
        near = (beside >= 0) & last[beside]
        which = np.flatnonzero(near.any(axis=1) & (reached < 0) & ~((girth >= limit) & np.isfinite(girth)))
        of_limb = (beside[which] >= 0) & (reached[beside[which]] >= 0) & np.isfinite(girth[beside[which]])
        which, of_limb = which[of_limb.any(axis=1)], of_limb[of_limb.any(axis=1)]
        axes = axis[beside[which]]
        first = axes[np.arange(len(which)), of_limb.argmax(axis=1)]
        along = np.sign(np.einsum("kni,ki->kn", axes, first)) * of_limb
        mean = np.einsum("kn,kni->ki", along, axes)
        axis[which] = mean / np.linalg.norm(mean, axis=1)[:, None]
        around = np.where(of_limb, girth[beside[which]], 0.0)
        joined = follow(which, around.sum(axis=1) / of_limb.sum(axis=1))
        last = np.zeros_like(thin)
        last[joined] = True
        reached[joined] = step
        if not len(joined):
            break
    return reached, axis


def _to_follow(surface: Surface, thin: np.ndarray, girth: np.ndarray, axis: np.ndarray, most: float) -> np.ndarray:
    """Return which thin samples (S,) bool are of parts that are followed: half below a girth and longer than wide, so no blunt ends."""
    label, marks = alike_parts(thin, surface.neighbors), np.zeros_like(thin)
    for part in np.unique(label[thin]):
        own = np.flatnonzero(label == part)
        known = own[np.isfinite(girth[own])]
        if not len(known) or (usual := float(np.median(girth[known]))) > most:
            continue
        along = np.linalg.eigh(axis[known].T @ axis[known])[1][:, 2]
        marks[own] = np.pi * np.ptp(surface.mean[own] @ along) > usual * surface.length * surface.field[own].mean()
    return marks
