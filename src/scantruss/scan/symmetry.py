"""Mirror planes of a scan: found by reflecting it onto itself, or checked where the user gives them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

SYMMETRY_TOLERANCE = 0.1  #: by how far 95 % of a scan may lie off its mirror image [member lengths]
CELLS_ACROSS = 45  #: of the cells in each of which one place stands for the scan, along its longest side
FEWEST_OF_SYMMETRY = 50  #: fewest places among which a symmetry is looked for
PLACES_TRIED = 300  #: places with which a plane is tried first
TURN_STEP = 2.0  #: between the directions tried about each principal axis [degree]
PLANES_REFINED = 8  #: planes that are refined
PLANES_APART = 5.0  #: of two planes [degree]
DRAWN_TURN = 20.0  #: of a plane drawn by hand to the mirror plane that it means [degree]
PLANE_STEPS = 10  #: Gauss-Newton steps of a plane
NEAR_CELLS = 2.5  #: cells beyond which a reflected place has no counterpart
IMAGE_QUANTILE = 0.95  #: of the places, which the misfit holds for
MORE_PLANES = 0.25  #: of the tolerance, which planes besides the best must keep
#: mirror planes through one axis that are looked for: at 60 degrees rows of members run along all of them
MOST_FOLD = 3
LEAST_ACROSS_AXES = 0.3  #: sine of the angle of an axis to the normal of a plane through it, beyond which it is tried
WORTH_REFINING = 20.0  #: tolerances within which a plane is worth refining
CONFORMING_ANGLE = 2.0  #: by how far planes through one axis may be off equal angles [degree]


@dataclass(frozen=True)
class MirrorPlane:
    """A plane in which a scan is its own mirror image."""

    point: tuple[float, float, float]  #: on the plane, in the frame of the scan [scan unit]
    normal: tuple[float, float, float]  #: unit; its largest component is positive
    misfit: float  #: distance within which 95 % of the scan lie from its mirror image [scan unit]

    @property
    def row(self) -> tuple[float, ...]:
        """Point and normal, as settings hold it."""
        return (*self.point, *self.normal)


@dataclass(frozen=True, eq=False)
class PlacesOfScan:
    """Places that stand for a scan, evenly, with normals."""

    at: np.ndarray  #: (Q, 3) relative to their middle
    normals: np.ndarray  #: (Q, 3)
    tree: cKDTree
    cell: float
    origin: np.ndarray  #: (3,)

    def misfits(self, normal: np.ndarray, offset: float, tried: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return by how far some places, reflected, are off the surface, and the nearest place to each."""
        image = self.at[tried] - 2.0 * np.outer(self.at[tried] @ normal - offset, normal)
        apart, nearest = self.tree.query(image)
        off = np.abs(((image - self.at[nearest]) * self.normals[nearest]).sum(axis=1))
        return np.where(apart > NEAR_CELLS * self.cell, apart, off), nearest


def find_mirror_planes(points: np.ndarray, tolerance: float) -> tuple[MirrorPlane, ...]:
    """Return the mirror planes of a scan: one, or several through one axis at equal angles, exactly so.

    Parameters
    ----------
    points : (N, 3) float64 [scan unit]
    tolerance : float
        Within which 95 % of the scan must lie from its mirror image [scan unit].

    Raises
    ------
    InputError
        The scan has no mirror plane within the tolerance.
    """
    places = places_of(points)
    planes = _candidates(places)
    found = sorted((_refined(places, normal, offset) for normal, offset in planes), key=lambda each: each[2])
    good: list[tuple[np.ndarray, float, float]] = []
    for each in found:
        alone = all(abs(float(each[0] @ other[0])) < math.cos(math.radians(PLANES_APART)) for other in good)
        if each[2] <= tolerance and alone:
            good.append(each)
    if not good:
        raise InputError(
            f"the scan has no mirror plane within {tolerance:.4g}, a tenth of a member: the best leaves 95 % of it within"
            f" {found[0][2]:.4g} of its image; leave --symmetry out"
        )
    return _through_one_axis(places, good, MORE_PLANES * tolerance)


def check_mirror_planes(
    points: np.ndarray, rows: Sequence[Sequence[float]], tolerance: float
) -> tuple[MirrorPlane, ...]:
    """Return planes that the user gives, if the scan is symmetric in each of them; see `find_mirror_planes`."""
    places = places_of(points)
    planes = []
    for number, row in enumerate(rows, 1):
        point, normal = np.array(row[:3], float), np.array(row[3:], float)
        normal = oriented(normal / np.linalg.norm(normal))
        (misfit,) = _misfits_of(places, [MirrorPlane(three_of(point), three_of(normal), 0.0)])
        if misfit > tolerance:
            raise InputError(
                f"the scan is not symmetric in mirror plane {number}: 95 % of it lie within {misfit:.4g} of its image, and"
                f" {tolerance:.4g}, a tenth of a member, is needed"
            )
        planes.append(MirrorPlane(three_of(point), three_of(normal), misfit))
    normals = np.array([plane.normal for plane in planes])
    for k in range(1, len(planes)):
        if np.abs(normals[:k] @ normals[k]).max() > math.cos(math.radians(PLANES_APART)):
            raise InputError(f"mirror plane {k + 1} is nearly one of those before; give each once")
    if len(planes) > 1 and _axis_of(normals) is None:
        raise InputError("several mirror planes must meet in one line at equal angles, such as two that are square")
    return tuple(planes)


def nearest_mirror_plane(points: np.ndarray, row: Sequence[float], tolerance: float) -> MirrorPlane | None:
    """Return the mirror plane of a scan that a plane drawn by hand means: turned by no more than `DRAWN_TURN`; None where there is none.

    Parameters
    ----------
    points : (N, 3) float64 [scan unit]
    row : six numbers
        A point of the drawn plane and its normal.
    tolerance : float
        Within which 95 % of the scan must lie from its mirror image [scan unit].
    """
    places = places_of(points)
    normal = oriented(np.array(row[3:], float) / np.linalg.norm(row[3:]))
    drawn = float((np.array(row[:3], float) - places.origin) @ normal)
    for offset in (drawn, 0.0):  # mirror planes pass through the middle, where the points lie evenly
        turned, at, misfit = _refined(places, normal, offset)
        if misfit <= tolerance and abs(float(turned @ normal)) >= math.cos(math.radians(DRAWN_TURN)):
            return _plane(places, turned, at, misfit)
    return None


def places_of(points: np.ndarray) -> PlacesOfScan:
    """Return the means of the points in even cells, with normals from their neighbours."""
    low, size = points.min(axis=0), float(np.ptp(points, axis=0).max())
    cell = size / CELLS_ACROSS
    keys = np.floor((points - low) / max(cell, 1e-300)).astype(np.int64)
    _, inverse = np.unique(keys @ [1, 1 << 20, 1 << 40], return_inverse=True)
    counts = np.bincount(inverse.ravel())
    at = np.stack([np.bincount(inverse.ravel(), points[:, k] - low[k]) / counts for k in range(3)], axis=1)
    if len(at) < FEWEST_OF_SYMMETRY:
        raise InputError(f"the scan has too few points to find its symmetry: {len(points):,}")
    middle = at.mean(axis=0)
    at -= middle
    from scipy.spatial import cKDTree  # not needed by a grid without symmetry

    tree = cKDTree(at)
    _, near = tree.query(at, k=9)
    around = at[near] - at[near].mean(axis=1, keepdims=True)
    normals = np.linalg.eigh(np.einsum("qki,qkj->qij", around, around))[1][:, :, 0]
    return PlacesOfScan(at, normals, tree, cell, low + middle)


def _candidates(places: PlacesOfScan) -> list[tuple[np.ndarray, float]]:
    """Return planes through the middle that leave the scan nearest to itself: among those square to or along a principal axis."""
    _, axes = np.linalg.eigh(places.at.T @ places.at)
    turns = np.radians(np.arange(0.0, 180.0, TURN_STEP))
    normals = np.concatenate(
        [
            np.outer(np.cos(turns), axes[:, (k + 1) % 3]) + np.outer(np.sin(turns), axes[:, (k + 2) % 3])
            for k in range(3)
        ]
    )
    tried = np.unique(np.linspace(0, len(places.at) - 1, PLACES_TRIED).astype(np.int64))
    score = np.array([np.minimum(places.misfits(n, 0.0, tried)[0], 3 * places.cell).mean() for n in normals])
    chosen: list[int] = []
    for k in np.argsort(score, kind="stable").tolist():
        if all(abs(float(normals[k] @ normals[j])) < math.cos(math.radians(2 * PLANES_APART)) for j in chosen):
            chosen.append(k)
    return [(normals[k], 0.0) for k in chosen[:PLANES_REFINED]]


def _refined(places: PlacesOfScan, normal: np.ndarray, offset: float) -> tuple[np.ndarray, float, float]:
    """Return a plane moved to where the scan is nearest to its image, and its misfit: iterated closest points to planes."""
    everything = np.arange(len(places.at))
    for _ in range(PLANE_STEPS):
        off, nearest = places.misfits(normal, offset, everything)
        use = off < NEAR_CELLS * places.cell
        if use.sum() < FEWEST_OF_SYMMETRY:
            break
        at, target, across = places.at[use], places.at[nearest[use]], places.normals[nearest[use]]
        height = at @ normal - offset
        residual = ((at - 2.0 * np.outer(height, normal) - target) * across).sum(axis=1)
        axes = np.linalg.svd(normal[None])[2][1:]  # two directions across the normal
        along = across @ normal
        slopes = [-2.0 * ((at @ axis) * along + height * (across @ axis)) for axis in axes]
        table = np.stack([*slopes, 2.0 * along], axis=1)
        step = np.linalg.lstsq(table, -residual, rcond=None)[0]
        turned = normal + step[0] * axes[0] + step[1] * axes[1]
        offset += float(step[2])
        normal = turned / np.linalg.norm(turned)
    off, _ = places.misfits(normal, offset, everything)
    sign = 1.0 if np.array_equal(oriented(normal), normal) else -1.0
    return sign * normal, sign * offset, float(np.quantile(off, IMAGE_QUANTILE))


def _through_one_axis(
    places: PlacesOfScan, good: list[tuple[np.ndarray, float, float]], tolerance: float
) -> tuple[MirrorPlane, ...]:
    """Return the largest set of planes through one axis at equal angles, the first as it is the best; else the best alone."""
    best = good[0]
    axes = [np.cross(best[0], each[0]) for each in good[1:]]
    axes += [along - (along @ best[0]) * best[0] for along in np.linalg.eigh(places.at.T @ places.at)[1].T]
    axes = [axis / np.linalg.norm(axis) for axis in axes if np.linalg.norm(axis) > LEAST_ACROSS_AXES]
    everything = np.arange(len(places.at))
    for fold in range(MOST_FOLD, 1, -1):
        for axis in axes:
            planes = [best]
            for k in range(1, fold):  # a surface of revolution has them at any angle
                turned = _turned(best[0], axis, math.pi * k / fold)
                off, _ = places.misfits(turned, best[1] * float(turned @ best[0]), everything)
                if np.quantile(off, IMAGE_QUANTILE) > WORTH_REFINING * tolerance:
                    break
                each = _refined(places, turned, best[1] * float(turned @ best[0]))
                if each[2] > tolerance or abs(float(each[0] @ turned)) < math.cos(math.radians(CONFORMING_ANGLE)):
                    break
                planes.append(each)
            if len(planes) == fold:
                exact = _exact(places, planes, axis)
                checked = _misfits_of(places, exact)
                if max(checked) <= tolerance:
                    return exact
    return (_plane(places, *best),)


def _misfits_of(places: PlacesOfScan, planes: Sequence[MirrorPlane]) -> list[float]:
    """Return the misfit of each of some planes."""
    found = []
    for plane in planes:
        normal = np.array(plane.normal)
        off, _ = places.misfits(
            normal, float((np.array(plane.point) - places.origin) @ normal), np.arange(len(places.at))
        )
        found.append(float(np.quantile(off, IMAGE_QUANTILE)))
    return found


def _exact(
    places: PlacesOfScan, planes: list[tuple[np.ndarray, float, float]], axis: np.ndarray
) -> tuple[MirrorPlane, ...]:
    """Return planes through one axis at exactly equal angles."""
    normals, offsets = np.array([each[0] for each in planes]), np.array([each[1] for each in planes])
    axis = oriented(axis)
    centre = np.linalg.lstsq(np.concatenate([normals, axis[None]]), np.append(offsets, 0.0), rcond=None)[0]
    first = normals[0] - (normals[0] @ axis) * axis
    first /= np.linalg.norm(first)
    exact = []
    for k, (normal, _, misfit) in enumerate(planes):
        turned = _turned(first, axis, math.pi * k / len(planes))
        turned = turned if turned @ normal > 0 else -turned
        exact.append(_plane(places, turned, float(turned @ centre), misfit, centre))
    return tuple(exact)


def _axis_of(normals: np.ndarray) -> np.ndarray | None:
    """Return the line in which planes meet at equal angles; None where they do not."""
    axis = np.cross(normals[0], normals[1])
    axis /= np.linalg.norm(axis)
    if np.abs(normals @ axis).max() > math.sin(math.radians(CONFORMING_ANGLE)):
        return None
    beside = np.cross(axis, normals[0])
    angle = np.sort(np.degrees(np.arctan2(normals @ beside, normals @ normals[0])) % 180.0)
    angle = np.sort(np.where(angle > 180.0 - CONFORMING_ANGLE, angle - 180.0, angle))
    even = np.arange(len(normals)) * 180.0 / len(normals)
    return axis if np.abs(angle - even).max() < CONFORMING_ANGLE else None


def _plane(
    places: PlacesOfScan, normal: np.ndarray, offset: float, misfit: float, centre: np.ndarray | None = None
) -> MirrorPlane:
    """Return the record of a plane, through `centre` where one is given."""
    point = offset * normal if centre is None else centre
    return MirrorPlane(three_of(places.origin + point), three_of(oriented(normal)), misfit)


def _turned(vector: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """Return a vector square to a unit axis turned about it."""
    return np.asarray(math.cos(angle) * vector + math.sin(angle) * np.cross(axis, vector))


def oriented(normal: np.ndarray) -> np.ndarray:
    """Return a normal of which the largest component is positive."""
    return normal if normal[np.abs(normal).argmax()] > 0 else -normal


def three_of(values: np.ndarray) -> tuple[float, float, float]:
    """Return three numbers as plain values."""
    x, y, z = values.tolist()
    return x, y, z
