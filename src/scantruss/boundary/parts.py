"""Parts of a piece that only links across a gap hold together, while its boundary runs around each of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.components import component_labels
from ..kernels.geometry.kd_tree import nearest_of_places
from ..scan.clean.nearby import build_kd_tree
from ..surface.pieces import large_pieces, number_pieces, sample_areas

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..kernels.surface.local_surface import Surface
    from ..surface.samples import SurfaceSamples

# a link crosses a gap if it joins two loops, both ends so near to one, and is so long, in members and in steps from sample to sample
AT_LOOP, ACROSS_GAP, STEPS_ACROSS = 0.4, 0.5, 2.0


def parted(samples: SurfaceSamples, loops: Sequence[np.ndarray]) -> SurfaceSamples:
    """Return samples without the links across gaps where these alone hold a piece together; the same where there are none.

    loops : closed curves (M, 3) along which the boundary runs
    """
    if len(loops) < 2:
        return samples
    surface = samples.surface
    across = _across_gaps(surface, loops)
    if not across.any():
        return samples
    start, column = np.nonzero((surface.neighbors >= 0) & ~across)
    lowest = component_labels(len(across), start, surface.neighbors[start, column])
    part = np.unique(lowest, return_inverse=True)[1]
    across &= part[surface.neighbors] != part[:, None]
    if not across.any():
        return samples
    neighbors = np.where(across, -1, surface.neighbors)
    neighbors = np.take_along_axis(neighbors, np.argsort(neighbors < 0, axis=1, kind="stable"), axis=1)
    surface, part = surface._replace(neighbors=neighbors), number_pieces(part)
    area = sample_areas(surface)
    was = np.empty(part.max() + 1, np.int64)  # the piece of which each was a part
    was[part] = samples.piece
    large = large_pieces(part, area, area / surface.field**2, surface.length)
    floor = samples.floor
    return replace(
        samples,
        surface=surface,
        piece=part,
        pieces=tuple(k for k in large if was[k] in samples.pieces),
        not_chosen=tuple(k for k in large if was[k] in samples.not_chosen),
        floor=floor if floor is None else int(np.flatnonzero(was == floor)[0]),
    )


def _across_gaps(surface: Surface, loops: Sequence[np.ndarray]) -> np.ndarray:
    """Return which links (S, K) bool join the samples at one loop with those at another across a gap."""
    squares, nearest = np.empty(len(surface.mean)), np.empty(len(surface.mean), np.int64)
    nearest_of_places(build_kd_tree(np.concatenate(loops)), surface.mean, 1, squares, nearest)
    local = surface.length * surface.field
    at = np.repeat(np.arange(len(loops)), [len(loop) for loop in loops])[nearest]
    at[squares > (AT_LOOP * local) ** 2] = -1
    start, column = np.nonzero((surface.neighbors >= 0) & (at >= 0)[:, None])
    end = surface.neighbors[start, column]
    far = np.linalg.norm(surface.mean[start] - surface.mean[end], axis=1)
    joins = (at[end] >= 0) & (at[start] != at[end])
    joins &= far > np.maximum(ACROSS_GAP * local[start], STEPS_ACROSS * surface.step)
    across = np.zeros(surface.neighbors.shape, np.bool_)
    across[start[joins], column[joins]] = True
    return across
