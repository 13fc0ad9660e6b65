"""Laplacian optimization after Taubin, with the three stops of Sec. 4.1."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels.mesh import smoothing as kernels
from ..settings import Settings
from .working_mesh import NEAR_IN_THE_END, WorkingMesh


class State(NamedTuple):
    """The figures by which smoothing stops."""

    shape: float  #: mean shape quality of the triangles
    spread: float  #: standard deviation of the member lengths [scan unit]
    moved: float  #: mean distance of the nodes from where the smoothing began [scan unit]


class Smoothing(NamedTuple):
    """How a smoothing went."""

    passes: int  #: number of passes that were kept
    stop: str  #: "a", "b" or "c" as in Sec. 4.1; "" if `smooth_passes` were made


def shape_no_longer_improves(before: State, after: State) -> bool:
    """Stop (a): the shape quality factor of the grid is no longer improved."""
    return after.shape <= before.shape


def lengths_no_longer_even_out(before: State, after: State) -> bool:
    """Stop (b): the standard deviation of the member lengths is no longer reduced."""
    return after.spread >= before.spread


def moved_too_far(after: State, max_deviation: float) -> bool:
    """Stop (c): the average deviation of the nodal coordinates is larger than the given criterion."""
    return after.moved > max_deviation


def deviation_allowed(settings: Settings, local: float = 1.0) -> float:
    """Return the criterion of stop (c): as set, else a share of the desired length, `local` times that of the settings on average."""
    return local * settings.length / 4 if settings.max_deviation is None else settings.max_deviation


def smooth(mesh: WorkingMesh, settings: Settings) -> Smoothing:
    """Smooth a grid by passes of Taubin's two steps and a return to the scan, until one of the stops applies.

    The pass after which a stop applies is undone. Corners and fixed nodes stay in place; boundary nodes slide along their curve.
    """
    net = mesh.net
    start, before, spare = net.nodes.copy(), net.nodes.copy(), np.empty_like(net.nodes)
    arc = net.arc.copy()
    allowed = deviation_allowed(settings, float(net.desired[: net.used][net.degree[: net.used] > 0].mean()))
    state = State(*kernels.state_of(net, start))
    for done in range(settings.smooth_passes):
        before[:], arc[:] = net.nodes, net.arc
        kernels.move_to_middle(net, settings.smooth_forward, spare)
        kernels.move_to_middle(net, settings.smooth_backward, spare)
        mesh.return_to_scan(NEAR_IN_THE_END)
        after = State(*kernels.state_of(net, start))
        stop = ""
        if moved_too_far(after, allowed):
            stop = "c"
        elif shape_no_longer_improves(state, after):
            stop = "a"
        elif lengths_no_longer_even_out(state, after):
            stop = "b"
        if stop:
            net.nodes[:], net.arc[:] = before, arc
            return Smoothing(done, stop)
        state = after
    return Smoothing(settings.smooth_passes, "")
