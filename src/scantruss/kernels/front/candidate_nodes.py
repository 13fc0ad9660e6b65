"""Nodes that exist before the front starts: those of the initial front, and candidate nodes that it may attach."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...runtime.jit import kernel
from ..geometry.boxes import search
from ..geometry.triangles import distance_to_segment
from ..geometry.vectors import dot, norm, row, subtract
from ..mesh.point_location import nearest_sample
from ..surface.local_surface import SURFACE_PATCH, Surface, fit_patch, patch_normal, walk
from .front import MOST_NEAR_NODES, Front, add_node, propose_node

# distance of a node from its sample above which the nearest is looked for [steps between samples]
FAR_FROM_SAMPLE = 2.0


class CandidateNodes(NamedTuple):
    """Nodes of the position field that a front may attach."""

    places: np.ndarray  #: (K, 3)
    normals: np.ndarray  #: (K, 3) outer normals of the surface there
    samples: np.ndarray  #: (K,) int64 a sample near each
    length: float


@kernel
def add_still_nodes(front: Front, surface: Surface, nodes: np.ndarray) -> int:
    """Add nodes (K, 3) of the boundary or of lines, each near the one before; returns the number of the first."""
    patch = np.zeros(1, SURFACE_PATCH)
    first, sample = front.counts.nodes, -1
    for i in range(len(nodes)):
        place = row(nodes, i)
        if sample >= 0:
            sample = walk(surface, sample, place)
        if sample < 0 or norm(subtract(row(surface.mean, sample), place)) > FAR_FROM_SAMPLE * surface.step:
            sample = nearest_sample(surface, place[0], place[1], place[2])
        fit_patch(surface, patch[0], sample, place)
        propose_node(front, place, patch_normal(patch[0], place), patch[0].sample, True)
        add_node(front)
    return first


@kernel
def add_candidate_nodes(front: Front, surface: Surface, candidates: CandidateNodes, clear: float) -> None:
    """Add the candidate nodes that are farther than `clear` from the front segments on their sheet."""
    found = np.empty(MOST_NEAR_NODES, np.int64)
    begun = front.counts.nodes
    for i in range(len(candidates.places)):
        place, normal = row(candidates.places, i), row(candidates.normals, i)
        near = search(front.boxes, front.nodes, place[0], place[1], place[2], 2.0 * clear + candidates.length, found)
        room = True
        for k in range(near):
            q = found[k]
            if q < begun and dot(normal, row(front.normals, q)) > 0.0:
                room = room and norm(subtract(place, row(front.nodes, q))) > clear
                s = front.out[q]
                while s >= 0:
                    away = distance_to_segment(place, row(front.nodes, q), row(front.nodes, front.head[s]))
                    room = room and away > clear
                    s = front.out_next[s]
        if room:
            propose_node(front, place, normal, walk(surface, candidates.samples[i], place), False)
            add_node(front)
