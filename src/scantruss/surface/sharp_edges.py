"""Sharp edges of bodies, where two sides meet at less than a right angle, as the samples show them.

A sample there holds points of both sides, and a plane through those around it lies between them and faces neither. With finer samples
that face away from the edge the sheet goes on around it, as it does around an edge that is rounded.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kernels.geometry.boxes import new_boxes
from ..kernels.scan.nearby import nearest_places
from ..kernels.surface.samples import put_all
from ..runtime.parallel import in_parts
from ..scan.cloud import bounds_of
from ..scan.normals import NORMALS_PER_THREAD, face_off_edges

if TYPE_CHECKING:
    from .linked_samples import Linked

THICK_AT_EDGE = 0.03  # thickness above which a sample may lie on a sharp edge [member lengths]
EDGE_REACH = 0.7  # distance within which other samples decide whether it does [member lengths]
FEWEST_EDGE_SAMPLES = 8  # fewest samples of an edge
# distance from an edge within which samples stay in their places, and are finer where thick [member lengths]
BESIDE_EDGE = 1.2
# distance from an edge within which other thick samples hardly show which way a side faces [member lengths]
UNSURE_EDGE = 0.6
# share of the samples that lie on sharp edges where these are worth an attempt, and their number
EDGE_SHARE, FEWEST_NEEDED = 0.02, 40


def on_sharp_edges(found: Linked, normals: np.ndarray, length: float) -> np.ndarray:
    """Let the samples on sharp edges face away from them; returns which those are (S,) bool, none where they are few."""
    thick = np.flatnonzero(found.thickness > THICK_AT_EDGE * length)
    turned = normals.copy()
    face_off_edges(found.mean, turned, found.boxes, thick, EDGE_REACH * length)
    there: np.ndarray = (turned != normals).any(axis=1)
    if there.sum() < FEWEST_EDGE_SAMPLES:
        there[:] = False
    normals[there] = turned[there]
    return there


def beside_edges(found: Linked, on_edge: np.ndarray, reach: float) -> np.ndarray:
    """Which samples (S,) lie within reach of those on sharp edges."""
    near = np.full(len(found.mean), -1, np.int64)
    if on_edge.any():
        edge = np.ascontiguousarray(found.mean[on_edge])
        boxes = new_boxes(*bounds_of(edge), reach, len(edge), len(edge))
        put_all(boxes, edge, np.arange(len(edge)))
        in_parts(
            len(near), NORMALS_PER_THREAD, lambda _, i, j: nearest_places(found.mean, boxes, edge, reach, near, i, j)
        )
    return near >= 0


def coarse_samples(found: Linked, length: float) -> np.ndarray:
    """Which samples (S,) are too large, as sharp edges are near: the thick ones there, and those linked to them."""
    on_edge = on_sharp_edges(found, found.normals.copy(), length)
    coarse = found.thickness > THICK_AT_EDGE * length
    around = found.neighbors[coarse]
    coarse[around[around >= 0]] = True
    return coarse & beside_edges(found, on_edge, BESIDE_EDGE * length)


def unsure_samples(found: Linked, on_edge: np.ndarray, length: float) -> np.ndarray:
    """Which samples (S,) near sharp edges are thick and yet do not face away from them."""
    return (found.thickness > THICK_AT_EDGE * length) & ~on_edge & beside_edges(found, on_edge, UNSURE_EDGE * length)
