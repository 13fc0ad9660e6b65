"""The local surface of linked samples: their normals on one side of each piece, outwards."""

from __future__ import annotations

import numpy as np

from ..kernels.surface import normals as normal_kernels
from ..kernels.surface.local_surface import Surface
from ..scan.normals import STEEP_SINE, cut_steep_links, face_as_given, face_one_side, face_outside, mean_normals
from .linked_samples import ROUGH_SAMPLE, Linked
from .sharp_edges import on_sharp_edges, unsure_samples

PATCH_POINTS_ON_THE_WAY = 8.0  # most points per sample to which a patch is fitted while nodes move


def faced_surface(
    found: Linked, radius: float, length: float, spacing: float, sharp_edges: bool = False, z_is_up: bool = False
) -> tuple[Surface, np.ndarray, np.ndarray]:
    """Return the local surface of linked samples, its normals facing outwards; the piece of each (S,), and whether it lies on an edge.

    sharp_edges : whether samples on sharp edges of bodies face away from them
    z_is_up : whether what faces up or down on the whole faces up
    """
    mean, normals, neighbors = found.mean, found.normals, found.neighbors
    normal_kernels.trust_thin_samples(mean, normals, neighbors, found.thickness, ROUGH_SAMPLE * length, STEEP_SINE)
    on_edge = on_sharp_edges(found, normals, length) if sharp_edges else np.zeros(len(mean), np.bool_)
    cut_steep_links(mean, normals, neighbors)
    piece = face_one_side(mean, normals, neighbors, unsure_samples(found, on_edge, length) if on_edge.any() else None)
    if len(found.facing):
        face_as_given(normals, found.facing, neighbors)
    normals = mean_normals(normals, neighbors, 0.7)
    face_outside(mean, normals, piece, neighbors, z_is_up=z_is_up)
    surface = Surface(
        points=found.grouped,
        start=found.start,
        mean=mean,
        normals=normals,
        neighbors=neighbors,
        length=float(length),
        radius=float(radius),
        patch_radius=float(max(0.65 * length, 2.6 * spacing)),
        patch_points=PATCH_POINTS_ON_THE_WAY,
        step=float(max(radius, 1.3 * spacing)),
        stamp=np.zeros(len(mean), np.int64),
        queue=np.zeros(len(mean), np.int64),
        counter=np.zeros(1, np.int64),
        field=np.ones(len(mean)),
    )
    return surface, piece, on_edge
