"""Rows lie closer together where the boundary bends within a member, so that its members need not leave it."""

from __future__ import annotations

import math

import numpy as np

from ..improve.working_mesh import WorkingMesh
from ..kernels.boundary.curves import at_arc
from ..kernels.mesh.grid import ON_CURVE

SAG_WANTED = 0.055  # distance of the curve from a member that rows allow for [members]
CLOSEST_ROWS = 0.8  # least distance of rows at the boundary [desired lengths]
ROWS_BEND_OVER = 2.5  # way from the boundary over which the distance of rows becomes that inside [members]
SAG_PLACES = 9  # places on a curve at which it is measured


def row_lengths(mesh: WorkingMesh, nodes: np.ndarray) -> np.ndarray:
    """Return the distance of rows at some nodes (F, 3), in desired lengths (F,).

    mesh : the grid of triangles, opened
    """
    net = mesh.net
    on_curve = np.flatnonzero(net.kind[: net.used] == ON_CURVE)
    found = np.ones(len(nodes))
    for v in on_curve.tolist():
        own = mesh.length * float(net.desired[v])
        share = max(math.sqrt(SAG_WANTED / max(_sag(mesh, v, own), 1e-9)), CLOSEST_ROWS)
        if share < 1.0:
            away = np.linalg.norm(nodes - net.nodes[v], axis=1) / (ROWS_BEND_OVER * own)
            found = np.minimum(found, 1.0 - (1.0 - share) * np.maximum(1.0 - away, 0.0))
    return found


def _sag(mesh: WorkingMesh, v: int, length: float) -> float:
    """Return how far the curve leaves the chord of a member around a node [members]."""
    curve, arc = mesh.net.curve[v], mesh.net.arc[v]
    steps = np.linspace(-0.5, 0.5, SAG_PLACES) * length
    places = np.array([at_arc(mesh.curves, curve, arc + step)[1:] for step in steps.tolist()])
    chord = places[-1] - places[0]
    way = places - places[0]
    off = way - np.outer(way @ chord / max(float(chord @ chord), 1e-300), chord)
    return float(np.linalg.norm(off, axis=1).max()) / length
