"""Rods: columns, poles, scaffold and cables that are too thin for a grid, and may connect a shell with its floor."""

from __future__ import annotations

import math

import numpy as np

from ..kernels.geometry.boxes import SearchBoxes
from ..kernels.geometry.components import component_labels
from ..kernels.surface.rods import spreads_around
from ..runtime.parallel import run_in_parts
from .linked_samples import Linked

COARSE_REACH = 1.0  # radius of the neighbourhood that shows whether a sample is of a rod [member lengths]
FINE_REACH = 0.6  # radius of that neighbourhood once rods are found, for the joints of scaffold [member lengths]
SPREADS_PER_THREAD = 400  # fewest samples worth a thread of their own
SAMPLES_OF_SHEET = 6  # fewest samples in a neighbourhood, rods excluded, that make a sheet
THIN_VARIANCE = 0.15  # largest variance across a rod, in that along it; half a disc, as at a boundary, has 0.28
END_REACH = 1.3  # distance from a rod up to which samples may be its ends [member lengths]
END_OFFSET = 0.1  # distance from the sheet above which a sample near a rod is an end of it [member lengths]
MOST_RODS = 0.4  # share of the samples above which they are not rods but the scan itself
END_ROUNDS = 3  # most rounds in which ends of rods are looked for
FEWEST_SAMPLES_AROUND = 24  # samples in a usual neighbourhood that distinguish a rod from a sheet
FINE_LENGTH = 24.0  # shortest length at which rods of long members are looked for too [spacings of the points]
LENGTH_STEP = 1.6  # step from one such length to the next
NEAR_RODS = 3.0  # distance between samples that are beside each other there [sample radii]
AREA_OF_REST = 1.0  # area of a part beside rods below which it is a piece of them [square of the member length]
BEHIND_WIDTH = 1.25  # distance from its axis within which a rod goes on behind a sheet [half its width]
TILT_OF_AXIS = 0.06  # by which that axis may be wrong, as it is taken from a part of a rod [rad]
FEWEST_OF_STRAIGHT = 12  # fewest samples of a rod whose axis is known
WIDEST_ROD = 0.4  # half the width of what goes on, at most [member lengths]
LEAST_STUB = 0.4  # distance from the sheet that a rod behind it reaches at least [member lengths]
JUNCTIONS_LOOKED_AT = 8  # places of a group of rods at which it may go on as a sheet, at most
FLAT_ACROSS = 0.1  # largest variance across a strip, in that over its width; half a tube has 0.19
PLACES_OF_STRIP = 16  # places of a strip at which it is looked at, at most
FILLED_ACROSS = 0.3  # least variance across the points around a place of a strip, in that along it; of half a disc 0.28
# least share of the samples of a sheet in the plane of a patch that lie on each side of its middle
LEAST_BESIDE = 0.15
PARTS_OF_FOOT = 4  # parts of its length at which it is looked at how wide a foot is
# width of a foot at its sheet, in that at its tip, at least; its last step from part to part, in all that it widens, at most
WIDER_AT_SHEET, EVENLY_WIDER = 1.6, 0.8
BESIDE_STRIP = (
    1.5  # distance from the axis within which the sheet may take part in a foot [distance of its farthest point]
)
AS_WIDE = 1.25  # by how much the part before the last may be wider [width of the last]
LEVEL_WITH_SHEET = 0.87  # cosine of the angle between the normals of a strip and of the sheet that it continues
# share of the samples of a rod that lie along a line on their own, not as ends of others, at least, where most are single points:
# scaffolds and columns 0.5 to 1, a sparse sheet less than 0.1
LEAST_ALONG_LINES = 0.3
SPARSE_WIDTH = 3.0  # width of a part of a sheet that is kept for that, least [member lengths]
ROD_DISTANCE = 0.8  # distance from all sheets at which a rod stands at one place at least [member lengths]


def lengths_of_rods(length: float, spacing: float) -> list[float]:
    """Return the lengths at which rods are looked for, the shortest first and the desired member length last [scan unit]."""
    if not spacing > 0.0:
        return [length]
    steps = max(math.ceil(math.log(length / (FINE_LENGTH * spacing)) / math.log(LENGTH_STEP)), 0)
    return [*(FINE_LENGTH * spacing * LENGTH_STEP**step for step in range(steps)), length]


def rod_points(found: Linked, points: int, length: float, supports: np.ndarray | None = None) -> np.ndarray:
    """Return which points (N,) bool belong to rods: to samples along a line, or to the ends of a rod where it meets a sheet.

    Parameters
    ----------
    found : the samples of the points
    points : how many points there are
    length : desired member length [scan unit]
    supports : (S,) bool, optional
        Samples that are known for supports, though they are no thinner than a member.
    """
    known = np.zeros(len(found.mean), np.bool_) if supports is None else supports
    spreads, _, count = _spreads(found, np.ones(len(found.mean), np.bool_), COARSE_REACH * length)
    tells = np.median(count) >= FEWEST_SAMPLES_AROUND  # of fewer samples around each a sheet may look thin too
    rod = known | (line_like(spreads) & tells)
    along_line = rod.copy()
    if rod.any():  # then joints of a scaffold too, which are rods to all sides
        rod |= line_like(_spreads(found, ~rod, FINE_REACH * length)[0])
    for _ in range(END_ROUNDS if rod.any() else 0):
        near = ~rod & (moments_around(found.mean, found.boxes, rod, END_REACH * length)[2] > 0)
        spreads, off, count = _spreads(found, ~rod, COARSE_REACH * length)
        alone = (count < SAMPLES_OF_SHEET) | line_like(spreads)
        ends = near & (alone | (off > np.maximum(END_OFFSET * length, 2.0 * np.sqrt(spreads[:, 0]))))
        if not ends.any():
            break
        rod |= ends
    rod &= _long_groups(found, rod, known, length) & ~_of_sparse_sheets(found, rod, along_line, length)
    rod &= ~_arms(found, rod, length)
    rod &= ~_patches(found, rod, length) | known
    rod &= ~_feet(found, rod) | known
    rod |= _behind_sheets(found, rod, length)
    if rod.mean() > MOST_RODS:
        rod[:] = False
    marked: np.ndarray = np.where(found.owner >= 0, rod[found.owner], False)
    return marked if len(marked) == points else np.zeros(points, np.bool_)


def pieces_of_rods(found: Linked, rods: np.ndarray, radius: float, length: float) -> np.ndarray:
    """Return which points (N,) bool are what is left between rods: small parts with nothing else near them.

    Parameters
    ----------
    found : the samples of the points at the shortest length, and their radius [scan unit]
    rods : (N,) bool, points of rods
    length : desired member length [scan unit]
    """
    samples = len(found.mean)
    rod = 2 * np.bincount(found.owner, rods, samples) > np.bincount(found.owner, minlength=samples)
    one, place = np.nonzero(found.neighbors >= 0)
    other = found.neighbors[one, place]
    near = np.linalg.norm(found.mean[one] - found.mean[other], axis=1) < NEAR_RODS * radius
    one, other = one[near], other[near]
    alike = rod[one] == rod[other]
    label = component_labels(samples, one[alike], other[alike])
    touching = np.zeros(samples, np.bool_)
    touching[label[one[~alike]]] = True
    small = np.bincount(label, minlength=samples) * radius**2 < AREA_OF_REST * length**2
    marked: np.ndarray = (rod | (touching & small)[label])[found.owner]
    return marked


def _long_groups(found: Linked, rod: np.ndarray, known: np.ndarray, length: float) -> np.ndarray:
    """Return which samples belong to a group of rods, (S,) bool: known, or a member long and standing off all sheets.

    Others are corners of a sheet, or where it has few points.
    """
    label = _groups_of(found, rod)
    long = _sizes(found, label).max(axis=1) >= length
    off = np.zeros(len(rod), np.bool_)
    off[label[rod & (moments_around(found.mean, found.boxes, ~rod, ROD_DISTANCE * length)[2] == 0)]] = True
    long &= off
    long[label[known]] = True
    marked: np.ndarray = long[label]
    return marked


def _arms(found: Linked, rod: np.ndarray, length: float) -> np.ndarray:
    """Return which samples (S,) bool are of arms of a sheet: narrow strips that are flat and level with it where they begin.

    A column may look flat where a scanner sees one side of it, but it stands across its roof.
    """
    arm = np.zeros(len(rod), np.bool_)
    if not rod.any():
        return arm
    label, beside = _groups_of(found, rod), found.neighbors
    begins = np.flatnonzero(rod & ((beside >= 0) & ~rod[beside]).any(axis=1))
    normals = _sheet_normals(found, rod, length)
    for group in np.unique(label[begins]):
        own = np.flatnonzero(rod & (label == group))
        points = np.concatenate([found.grouped[found.start[one] : found.start[one + 1]] for one in own])
        at = begins[label[begins] == group]
        at = at[:: -(-len(at) // JUNCTIONS_LOOKED_AT)]
        level = [_is_level(points, found.mean[one], COARSE_REACH * length, normals[one]) for one in at]
        arm[own] = 2 * sum(level) > len(level)
    return arm


def _patches(found: Linked, rod: np.ndarray, length: float) -> np.ndarray:
    """Return which samples (S,) bool are of patches amid a sheet not joined to it, as beyond a shadow: flat, filled, in its plane."""
    patch = np.zeros(len(rod), np.bool_)
    if not rod.any():
        return patch
    label = _groups_of(found, rod)
    normals = _sheet_normals(found, rod, length)
    for group in np.unique(label[rod]):
        own = rod & (label == group)
        points = _points_of(found, own)
        if len(points) < SAMPLES_OF_SHEET:
            continue
        middle = points.mean(axis=0)
        variances, axes = np.linalg.eigh(np.cov(points - middle, rowvar=False))
        if variances[0] > FLAT_ACROSS * variances[1]:
            continue
        places = found.mean[own][:: -(-int(own.sum()) // JUNCTIONS_LOOKED_AT)]
        filled = [_is_level(points, place, COARSE_REACH * length, axes[:, 0]) for place in places]
        if 2 * sum(filled) <= len(filled):  # struts side by side
            continue
        low, high = points.min(axis=0) - END_REACH * length, points.max(axis=0) + END_REACH * length
        in_plane = ~rod & (np.abs((found.mean - middle) @ axes[:, 0]) < END_OFFSET * length)
        in_plane &= ((found.mean > low) & (found.mean < high)).all(axis=1)
        level = np.abs(normals[in_plane] @ axes[:, 0]) > LEVEL_WITH_SHEET
        if level.sum() >= max(SAMPLES_OF_SHEET, 0.5 * len(level)):
            beyond = ((found.mean[in_plane][level] - middle) @ axes[:, 1:] > 0.0).mean(axis=0)
            patch |= own & bool((np.abs(beyond - 0.5) < 0.5 - LEAST_BESIDE).all())
    return patch


def _sheet_normals(found: Linked, rod: np.ndarray, length: float) -> np.ndarray:
    """Return the normals (S, 3) of the sheet around each sample, without rods."""
    normals: np.ndarray = np.linalg.eigh(moments_around(found.mean, found.boxes, ~rod, COARSE_REACH * length)[0])[1][
        :, :, 0
    ]
    return normals


def _feet(found: Linked, rod: np.ndarray) -> np.ndarray:
    """Return which samples (S,) bool are of feet of a sheet, where it comes down to a tip: straight, and the wider the nearer to it.

    A column or a pole is of one girth from end to end, but for its base and its capital.
    """
    foot = np.zeros(len(rod), np.bool_)
    if not rod.any():
        return foot
    label, beside = _groups_of(found, rod), found.neighbors
    begins = rod & ((beside >= 0) & ~rod[beside]).any(axis=1)
    for group in np.unique(label[begins]):
        own = rod & (label == group)
        points = _points_of(found, own)
        reach = 0.5 * np.ptp(points, axis=0).max()
        ends = found.mean[own & begins]
        near = ~rod & (((found.mean - ends.mean(axis=0)) ** 2).sum(axis=1) < reach**2)
        foot |= own & _widens(points, ends, _points_of(found, near))
    return foot


def _points_of(found: Linked, which: np.ndarray) -> np.ndarray:
    """Return the points (N, 3) of some samples (S,) bool."""
    return found.grouped[np.repeat(which, np.diff(found.start))]


def _widens(points: np.ndarray, ends: np.ndarray, beyond: np.ndarray) -> bool:
    """Whether points (N, 3) form a straight strip that widens evenly up to the end where it meets a sheet, or beyond it.

    ends : (K, 3) places where it meets the sheet, perhaps with an outlier or two
    beyond : (M, 3) points of the sheet around them
    """
    middle = points.mean(axis=0)
    if len(points) < PARTS_OF_FOOT * SAMPLES_OF_SHEET:
        return False
    variances, axes = np.linalg.eigh(np.cov(points - middle, rowvar=False))
    if not line_like(variances[None])[0]:
        return False
    all_points = np.concatenate([points, beyond]) - middle
    across = all_points @ axes[:, :2]
    away = np.linalg.norm(across, axis=1)
    aside = away > BESIDE_STRIP * away[: len(points)].max()
    for along in (axes[:, 2], -axes[:, 2]):
        at = all_points @ along
        low, high = at[: len(points)].min(), at[: len(points)].max()
        part = np.floor(PARTS_OF_FOOT * (at - low) / (high - low)).astype(np.int64)
        part[: len(points)] = np.minimum(part[: len(points)], PARTS_OF_FOOT - 1)
        part[aside & (part < PARTS_OF_FOOT)] = -1
        width = [_width_of(across[part == each]) for each in range(PARTS_OF_FOOT + 1)]
        tapers = _is_even_taper(*width[:PARTS_OF_FOOT]) or _is_even_taper(*width[1:])
        if tapers and ((ends - middle) @ along).max() > 0.0:
            return True
    return False


def _width_of(across: np.ndarray) -> float:
    """Return the standard deviation of places (K, 2) along their wider axis; NaN of few."""
    few = len(across) < SAMPLES_OF_SHEET
    return math.nan if few else math.sqrt(np.linalg.eigvalsh(np.cov(across, rowvar=False))[1])


def _is_even_taper(first: float, second: float, third: float, last: float) -> bool:
    """Whether the widths of four parts beside each other grow, and not at one step as at a capital; not if one is unknown.

    The last may be hardly as wide as the one before, as the sheet begins there.
    """
    narrow = 0.5 * (first + second)
    grows = max(first, second) < third < AS_WIDE * last and last >= WIDER_AT_SHEET * narrow
    return grows and last - third <= EVENLY_WIDER * (last - narrow)


def _is_level(points: np.ndarray, place: np.ndarray, reach: float, normal: np.ndarray) -> bool:
    """Whether points around a place form a flat strip of nearly this normal, filled between its edges as no frame of rods is."""
    near = points[((points - place) ** 2).sum(axis=1) < reach**2]
    if len(near) < SAMPLES_OF_SHEET:
        return False
    variances, axes = np.linalg.eigh(np.cov(near, rowvar=False))
    if variances[0] > FLAT_ACROSS * variances[1] or abs(axes[:, 0] @ normal) < LEVEL_WITH_SHEET:
        return False
    some = near[:: -(-len(near) // PLACES_OF_STRIP)]
    inside = ((points[None] - some[:, None]) ** 2).sum(axis=2) < 3.0 * variances[1]  # half of its width around each
    around = [
        np.linalg.eigvalsh(np.cov(points[each], rowvar=False)) for each in inside if each.sum() >= SAMPLES_OF_SHEET
    ]
    return 2 * sum(bool(each[1] > FILLED_ACROSS * each[2]) for each in around) > len(some)


def _of_sparse_sheets(found: Linked, rod: np.ndarray, along_line: np.ndarray, length: float) -> np.ndarray:
    """Return which samples of rods (S,) bool are of a part of a sheet with so few points that it looks like many short lines.

    Such a part is some members wide: little is lost of a smaller one.

    along_line : (S,) bool, samples that lie along a line on their own
    """
    label = _groups_of(found, rod)
    size = np.maximum(np.bincount(label[rod], minlength=len(rod)), 1)
    single = np.bincount(found.owner[found.owner >= 0], minlength=len(rod)) <= 1
    share_single = np.bincount(label[rod], single[rod], len(rod)) / size
    share_along = np.bincount(label[rod], along_line[rod], len(rod)) / size
    is_chance = (share_along < LEAST_ALONG_LINES) | (size < FEWEST_OF_STRAIGHT)
    wide = np.sort(_sizes(found, label), axis=1)[:, 1] >= SPARSE_WIDTH * length
    marked: np.ndarray = ((share_single > 0.5) & is_chance & wide)[label]
    return marked


def _sizes(found: Linked, label: np.ndarray) -> np.ndarray:
    """Return the sides (S, 3) of the box around each group, zero where a sample's number is none of a group."""
    order = np.argsort(label, kind="stable")
    first = np.flatnonzero(np.diff(label[order], prepend=-1))
    sizes = np.zeros((len(label), 3))
    sizes[label[order[first]]] = np.maximum.reduceat(found.mean[order], first) - np.minimum.reduceat(
        found.mean[order], first
    )
    return sizes


def _groups_of(found: Linked, rod: np.ndarray) -> np.ndarray:
    """Return the number of each sample's group (S,): samples of rods that are linked are in one."""
    beside = found.neighbors
    one, other = np.nonzero((beside >= 0) & rod[:, None] & rod[beside])
    return component_labels(len(rod), one, beside[one, other])


def _behind_sheets(found: Linked, rod: np.ndarray, length: float) -> np.ndarray:
    """Return which samples (S,) bool continue a straight rod along its axis: a column that goes on above its roof."""
    label = _groups_of(found, rod)
    goes_on = np.zeros(len(rod), np.bool_)
    along_axes: list[np.ndarray] = []
    for group in np.unique(label[rod]):
        own = rod & (label == group)
        if own.sum() < FEWEST_OF_STRAIGHT:
            continue
        middle = found.mean[own].mean(axis=0)
        variances, axes = np.linalg.eigh(np.cov(found.mean[own] - middle, rowvar=False))
        at = (found.mean - middle) @ axes[:, 2]
        away = np.linalg.norm(found.mean - middle - at[:, None] * axes[:, 2], axis=1)
        width = float(np.median(away[own]))  # of most of it, without what was taken of a sheet where it ends
        if not line_like(variances[None])[0] or width > WIDEST_ROD * length:  # several, as the frames of a scaffold
            continue
        near = away <= BEHIND_WIDTH * width + TILT_OF_AXIS * np.abs(at)
        along_axes.append(~rod & near & (np.abs(at) < np.abs(at[own]).max() + 2.0 * float(np.ptp(at[own]))))
    if along_axes:
        alive = ~rod & ~np.logical_or.reduce(along_axes)
        spreads, off, count = _spreads(found, alive, COARSE_REACH * length)
        stands_off = (off > np.maximum(END_OFFSET * length, 2.0 * np.sqrt(spreads[:, 0]))) | (count < SAMPLES_OF_SHEET)
        for part in along_axes:
            is_stub = off[part & (count >= SAMPLES_OF_SHEET)] > LEAST_STUB * length
            if is_stub.any():  # else it is the sheet where the rod ends
                goes_on |= part & stands_off
    return goes_on


def line_like(spreads: np.ndarray) -> np.ndarray:
    """Return where samples lie along a line, (S,) bool."""
    thin: np.ndarray = spreads[:, 1] < THIN_VARIANCE * spreads[:, 2]
    return thin


def _spreads(found: Linked, alive: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return, for each sample, the principal variances of the `alive` ones around it, its distance from their plane, and their number."""
    moments, middle, count = moments_around(found.mean, found.boxes, alive, reach)
    spreads, axes = np.linalg.eigh(moments)
    return np.maximum(spreads, 0.0), np.abs(np.einsum("si,si->s", found.mean - middle, axes[:, :, 0])), count


def moments_around(
    mean: np.ndarray, boxes: SearchBoxes, alive: np.ndarray, reach: float, which: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the covariance (K, 3, 3), mean (K, 3) and number (K,) of the samples marked `alive` within reach of all samples or some."""
    at = np.arange(len(mean)) if which is None else which
    moments, middle, count = np.empty((len(at), 3, 3)), np.empty((len(at), 3)), np.empty(len(at), np.int64)
    run_in_parts(len(at), SPREADS_PER_THREAD, spreads_around, mean, boxes, alive, reach, at, moments, middle, count)
    return moments, middle, count
