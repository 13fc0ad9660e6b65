"""Rotations of a scan: found by turning it onto itself, or checked where the user gives one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from .symmetry import (
    FEWEST_OF_SYMMETRY,
    IMAGE_QUANTILE,
    NEAR_CELLS,
    WORTH_REFINING,
    PlacesOfScan,
    oriented,
    places_of,
    three_of,
)

MOST_TURNS = 6  #: parts that a turn makes, at most: rows of members run along the edges of all six
ROTATION_STEPS = 10  #: Gauss-Newton steps of an axis
HALF_TURN_STEP = 2.0  #: between the axes of half turns that are tried [degree]
LEAST_OF_LINE = 0.5  #: of the axis of a half turn that has points of the scan beside it
LAST_DIGITS = 1e-9  #: rounding of axes and points that were found before, over their size
MOST_OBLIQUE = 0.01  #: cosine of the angle between the axes of a rotation and a half turn, at most


@dataclass(frozen=True)
class Rotation:
    """An axis about which a scan, turned by a whole part of 360 degrees, is itself."""

    point: tuple[float, float, float]  #: on the axis, in the frame of the scan [scan unit]
    axis: tuple[float, float, float]  #: unit; its largest component is positive
    order: int  #: parts in a turn, 2 or more
    misfit: float  #: distance within which 95 % of the scan lie from the turned scan [scan unit]

    @property
    def row(self) -> tuple[float, ...]:
        """Point, axis and order, as settings hold it."""
        return (*self.point, *self.axis, float(self.order))

    @classmethod
    def of_row(cls, row: Sequence[float]) -> Rotation:
        """Return the rotation that a row of settings holds, its misfit not known."""
        axis = np.array(row[3:6], float)
        size = float(np.linalg.norm(axis))
        axis = axis if abs(size - 1.0) < LAST_DIGITS else axis / size  # that of saved settings stays to the last digit
        return cls(three_of(np.array(row[:3], float)), three_of(oriented(axis)), round(row[6]), 0.0)

    def matrix(self, times: int = 1) -> np.ndarray:
        """Return the (3, 3) that turns by so many parts."""
        return turn_about(np.array(self.axis), 2.0 * math.pi * times / self.order)


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the (3, 3) that turns about a unit axis (Rodrigues)."""
    x, y, z = axis.tolist()
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def find_rotation(points: np.ndarray, tolerance: float) -> Rotation:
    """Return the rotation of a scan about a principal axis that makes the most equal parts, six at most.

    Parameters
    ----------
    points : (N, 3) float64 [scan unit]
    tolerance : float
        Within which 95 % of the scan must lie from the turned scan [scan unit].

    Raises
    ------
    InputError
        The scan has no rotation within the tolerance.
    """
    places = places_of(points)
    _, axes = np.linalg.eigh(places.at.T @ places.at)
    best: Rotation | None = None
    nearest = math.inf
    for axis in axes.T:
        for order in range(MOST_TURNS, 1, -1):
            rough = Rotation(three_of(places.origin), three_of(oriented(axis)), order, 0.0)
            if _misfit(places, rough) > WORTH_REFINING * tolerance:
                continue
            found = _refined(places, rough)
            nearest = min(nearest, found.misfit)
            if found.misfit <= tolerance and (best is None or found.order > best.order):
                best = found
    if best is None:
        raise InputError(
            f"the scan has no rotation within {tolerance:.4g}, a tenth of a member"
            + (f": the best leaves 95 % of it within {nearest:.4g} of its image" if math.isfinite(nearest) else "")
            + "; leave --symmetry out"
        )
    return best


def check_rotation(points: np.ndarray, row: Sequence[float], tolerance: float) -> Rotation:
    """Return the rotation that the user gives, if the scan has it; see `find_rotation`."""
    given = Rotation.of_row(row)
    places = places_of(points)
    misfit = _misfit(places, given)
    if misfit > tolerance:
        raise InputError(
            f"the scan is not the same when it is turned by 360/{given.order} degrees about the axis: 95 % of it lie within"
            f" {misfit:.4g} of its image, and {tolerance:.4g}, a tenth of a member, is needed"
        )
    return replace(given, misfit=misfit)


def find_half_turn(points: np.ndarray, rotation: Rotation, tolerance: float) -> Rotation | None:
    """Return the half turn about a straight line of the surface that meets the axis of a rotation squarely; None where there is none.

    Parameters
    ----------
    points : (N, 3) float64 [scan unit]
    rotation : Rotation
        Of the scan.
    tolerance : float
        Within which 95 % of the scan must lie from the turned scan, and 95 % of the line from the surface [scan unit].
    """
    places = places_of(points)
    axis = np.array(rotation.axis)
    first = np.linalg.svd(axis[None])[2][1]
    tried = []
    for angle in np.arange(0.0, math.pi / rotation.order, math.radians(HALF_TURN_STEP)).tolist():
        rough = Rotation(three_of(places.origin), three_of(oriented(turn_about(axis, angle) @ first)), 2, 0.0)
        tried.append((_misfit(places, rough), angle, rough))
    misfit, _, rough = min(tried, key=lambda each: each[:2])
    if misfit > WORTH_REFINING * tolerance:
        return None
    exact = _squared(rotation, _refined(places, rough))
    found = replace(exact, misfit=_misfit(places, exact))
    return found if found.misfit <= tolerance and _lies_in_surface(places, found, tolerance) else None


def check_half_turn(points: np.ndarray, rotation: Rotation, row: Sequence[float], tolerance: float) -> Rotation:
    """Return the half turn that the user gives beside a rotation, if the scan has it; see `find_half_turn`."""
    given = Rotation.of_row(row)
    refusal = "the axis of the half turn must meet that of the rotation squarely"
    if abs(float(np.dot(given.axis, rotation.axis))) > MOST_OBLIQUE:
        raise InputError(refusal)
    exact = _squared(rotation, given)
    off = np.abs(np.subtract((*exact.point, *exact.axis), (*given.point, *given.axis)))
    exact = given if off.max() < LAST_DIGITS * (1.0 + np.abs(given.point).max()) else exact
    if np.linalg.norm(np.cross(np.subtract(exact.point, given.point), given.axis)) > tolerance:
        raise InputError(refusal)
    places = places_of(points)
    misfit = _misfit(places, exact)
    if misfit > tolerance or not _lies_in_surface(places, exact, tolerance):
        raise InputError(
            f"the scan is not the same when it is turned over about the axis of the half turn: 95 % of it lie within {misfit:.4g} of its"
            f" image, and {tolerance:.4g}, a tenth of a member, is needed, or the axis is no line of the surface"
        )
    return replace(exact, misfit=misfit)


def _squared(rotation: Rotation, near: Rotation) -> Rotation:
    """Return the half turn nearest to another whose axis meets that of a rotation squarely."""
    axis, way = np.array(rotation.axis), np.array(near.axis)
    way -= (way @ axis) * axis
    way /= np.linalg.norm(way)
    height = float(np.subtract(near.point, rotation.point) @ axis)
    return Rotation(three_of(np.array(rotation.point) + height * axis), three_of(oriented(way)), 2, 0.0)


def _lies_in_surface(places: PlacesOfScan, half_turn: Rotation, tolerance: float) -> bool:
    """Return whether the axis of a half turn is a line of the surface, but for holes of less than half of it."""
    centre, way = np.array(half_turn.point) - places.origin, np.array(half_turn.axis)
    along = (places.at - centre) @ way
    beside = np.linalg.norm(places.at - centre - np.outer(along, way), axis=1) < NEAR_CELLS * places.cell
    if not beside.any():
        return False
    steps = np.arange(along[beside].min(), along[beside].max(), places.cell)
    on = centre + np.outer(steps, way)
    apart, nearest = places.tree.query(on)
    near = apart < NEAR_CELLS * places.cell
    if near.mean() < LEAST_OF_LINE:
        return False
    off = np.abs(((on - places.at[nearest]) * places.normals[nearest]).sum(axis=1))[near]
    return bool(np.quantile(off, IMAGE_QUANTILE) <= tolerance)


def _turned(places: PlacesOfScan, rotation: Rotation) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the places turned, by how far each is off the surface, and the nearest place to it."""
    centre = np.array(rotation.point) - places.origin
    image = (places.at - centre) @ rotation.matrix().T + centre
    apart, nearest = places.tree.query(image)
    off = np.abs(((image - places.at[nearest]) * places.normals[nearest]).sum(axis=1))
    return image, np.where(apart > NEAR_CELLS * places.cell, apart, off), nearest


def _misfit(places: PlacesOfScan, rotation: Rotation) -> float:
    return float(np.quantile(_turned(places, rotation)[1], IMAGE_QUANTILE))


def _refined(places: PlacesOfScan, rotation: Rotation) -> Rotation:
    """Return a rotation with its axis moved to where the turned scan is nearest to the scan: iterated closest points to planes."""
    for _ in range(ROTATION_STEPS):
        image, off, nearest = _turned(places, rotation)
        use = off < NEAR_CELLS * places.cell
        if use.sum() < FEWEST_OF_SYMMETRY:
            break
        axis, centre = np.array(rotation.axis), np.array(rotation.point)
        across = places.normals[nearest[use]]
        residual = ((image[use] - places.at[nearest[use]]) * across).sum(axis=1)
        aside = np.linalg.svd(axis[None])[2][1:]  # two directions across the axis
        slopes = []
        step = 1e-6
        for way in aside:  # what tilting the axis, then moving it, does
            turned = axis + step * way
            tilted = turn_about(turned / np.linalg.norm(turned), 2.0 * math.pi / rotation.order) - rotation.matrix()
            slopes.append((((places.at[use] - (centre - places.origin)) @ tilted.T / step) * across).sum(axis=1))
        slopes += [across @ ((np.eye(3) - rotation.matrix()) @ way) for way in aside]
        found = np.linalg.lstsq(np.stack(slopes, axis=1), -residual, rcond=None)[0]
        axis = axis + found[:2] @ aside
        centre = centre + found[2:] @ aside
        rotation = replace(rotation, axis=three_of(oriented(axis / np.linalg.norm(axis))), point=three_of(centre))
    return replace(rotation, misfit=_misfit(places, rotation))
