"""Normals turned to one side of a sheet, and to the outside."""

from __future__ import annotations

import numpy as np

from ..errors import OneSidedError
from ..kernels.geometry.boxes import SearchBoxes
from ..kernels.surface import normals as kernels
from ..kernels.surface.local_surface import Surface
from ..runtime.parallel import in_parts, run_in_parts
from .vectors import dots

NEAR_GIVEN = 0.5  # cosine to the normal given below which that of a plane fit is not used
HEAD_ON = 40  # links between opposite normals; a smooth two-sided surface has fewer
NORMALS_PER_THREAD = 1500  # fewest samples that are worth a thread
LEAST_CERTAIN = 254  # weight of the least certain links
FACING_OF_BODY = 0.45  # length of the mean normal up to which a piece encloses something; half a sphere has 0.5
FEWEST_AT_EDGE = 12  # samples that an edge has at least
EDGE_ON_ONE_SIDE = 0.45  # length of the mean direction to the neighbours there; half a disc has 0.64
MOST_ASKED = 3_000  # samples of a piece that are asked at most whether they lie at an edge
STEEP_SINE = 0.75  # sine of the angle above the plane of a sample beyond which a neighbour is on another sheet


def cut_steep_links(mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray) -> None:
    """Drop links (S, K) to samples that lie above a sample rather than beside it."""
    in_parts(
        len(mean),
        NORMALS_PER_THREAD,
        lambda _, i, j: kernels.cut_steep_links_of(mean, normals, neighbors, STEEP_SINE, i, j),
    )


def face_off_edges(mean: np.ndarray, normals: np.ndarray, boxes: SearchBoxes, thick: np.ndarray, reach: float) -> None:
    """Let those of the thick samples (P,) that lie on a sharp edge of a body face away from it."""
    run_in_parts(len(thick), NORMALS_PER_THREAD, kernels.face_off_edges_of, mean, normals, boxes, thick, reach)


def face_one_side(
    mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, doubtful: np.ndarray | None = None
) -> np.ndarray:
    """Turn the normals (S, 3) of each connected piece to the same side, along its most certain links; returns the piece of each (S,).

    doubtful : (S,) bool, samples whose links count last
    """
    weights = np.empty(neighbors.shape, np.uint8)  # few values are sorted faster
    in_parts(
        len(mean), NORMALS_PER_THREAD, lambda _, i, j: kernels.link_weights(mean, normals, neighbors, weights, i, j)
    )
    if doubtful is not None and doubtful.any():
        weights[(doubtful[:, None] | doubtful[neighbors]) & (neighbors >= 0)] = LEAST_CERTAIN
    order = np.argsort(weights, axis=None, kind="stable")[: int((neighbors >= 0).sum())]
    piece = np.empty(len(mean), np.int64)
    kernels.orient_normals(mean, normals, neighbors, order, piece)
    return _counted_off(piece)


def _counted_off(piece: np.ndarray) -> np.ndarray:
    """Return the numbers of pieces (S,) without gaps, where each is the first sample of its piece."""
    first = piece == np.arange(len(piece))
    number: np.ndarray = (np.cumsum(first) - 1)[piece]
    return number


def face_as_given(normals: np.ndarray, facing: np.ndarray, neighbors: np.ndarray) -> None:
    """Turn normals (S, 3) on one side of each sheet to those given with the scan (S, 3), zero where unknown: there as their neighbours.

    One that is more than 60 degrees off is replaced by that given.
    """
    cosine = dots(normals, facing)
    known = dots(facing, facing) > 0.0
    turn = np.where(known, np.where(cosine < 0.0, -1, 1), 0)
    waiting = np.flatnonzero(~known)
    while len(waiting):  # ends: each round but the last turns one
        beside = neighbors[waiting]
        votes = np.where(beside >= 0, turn[beside], 0).sum(axis=1)
        if not votes.any():
            break
        turn[waiting] = np.sign(votes)
        waiting = waiting[votes == 0]
    normals[turn < 0] *= -1.0
    off = known & (np.abs(cosine) < NEAR_GIVEN)
    normals[off] = facing[off]


def mean_normals(normals: np.ndarray, neighbors: np.ndarray, facing: float) -> np.ndarray:
    """Return mean normals (S, 3) of samples and those linked to them whose normals have a cosine over `facing` with their own."""
    means = np.empty_like(normals)
    in_parts(
        len(normals),
        NORMALS_PER_THREAD,
        lambda _, i, j: kernels.smooth_normals(normals, neighbors, facing, means, i, j),
    )
    return means


def face_outside(
    mean: np.ndarray, normals: np.ndarray, piece: np.ndarray, neighbors: np.ndarray, *, z_is_up: bool = False
) -> None:
    """Turn the normals of each piece, numbered from 0 (S,), away from its centre; upwards if that does not decide (a plate).

    Where z is up a piece that faces up or down on the whole faces up: a quarry too, whose centre lies above it.

    The centre of a body that is open somewhere, as a figure without the underside of its base, is that of its edge: seen from there what
    is missing faces neither way, and the sum of all others is three times its volume.
    """
    count = np.bincount(piece)
    centre = np.stack([np.bincount(piece, mean[:, c]) / count for c in range(3)], axis=1)
    up = np.stack([np.bincount(piece, normals[:, c]) / count for c in range(3)], axis=1)
    for body in np.flatnonzero(np.linalg.norm(up, axis=1) < FACING_OF_BODY):
        edge = _at_edge(mean, normals, neighbors, np.flatnonzero(piece == body))
        centre[body] = mean[edge].mean(axis=0) if len(edge) >= FEWEST_AT_EDGE else centre[body]
    arm = mean - centre[piece]
    size = np.sqrt(np.bincount(piece, dots(arm, arm)) / count)
    bulge = np.bincount(piece, dots(arm, normals)) / count
    for i in range(len(count)):
        side = bulge[i]
        if z_is_up and abs(up[i, 2]) >= FACING_OF_BODY:
            side = up[i, 2]
        elif abs(side) < 0.01 * max(size[i], 1e-300):
            side = next((up[i, c] for c in (2, 1, 0) if abs(up[i, c]) > 1e-6), 1.0)
        if side < 0:
            normals[piece == i] *= -1.0


def _at_edge(mean: np.ndarray, normals: np.ndarray, neighbors: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return which of some samples (K,) have neighbours on one side only."""
    own = own[:: len(own) // MOST_ASKED + 1]
    beside = neighbors[own]
    known = (beside >= 0)[:, :, None]
    arm = mean[beside] - mean[own][:, None]
    arm -= np.einsum("kni,ki->kn", arm, normals[own])[:, :, None] * normals[own][:, None]
    away = np.linalg.norm(arm, axis=2, keepdims=True)
    way = np.divide(arm, away, out=np.zeros_like(arm), where=known & (away > 0.0)).sum(axis=1)
    return own[np.linalg.norm(way, axis=1) > EDGE_ON_ONE_SIDE * np.maximum(known[:, :, 0].sum(axis=1), 1)]


def check_two_sided(surface: Surface, thickness: np.ndarray, *, with_normals: bool = False) -> None:
    """Refuse a one-sided surface (Moebius strip): however its normals are oriented, opposite ones meet somewhere.

    So may those that came with a scan, if they face both ways.

    Only links within smooth parts count, between neighbours that lie side by side and yet face opposite sides: on rough or
    overgrown scans that happens at random.

    Raises
    ------
    OneSidedError
    """
    smooth = 0.15 * surface.step
    if kernels.head_on_links(surface.mean, surface.normals, surface.neighbors, thickness, smooth) >= HEAD_ON:
        raise OneSidedError(
            "the scanned surface is one-sided (like a Moebius strip); a grid needs two sides; cut the scan into pieces"
            + (", or leave out its normals if they are wrong" if with_normals else "")
        )
