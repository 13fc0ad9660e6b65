"""The points of a scan that a selection takes, and how many each of its parts leaves out."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...selection import Selection, parts_of
from .copc import WantedBox

PLURALS = {"class": "classes", "return_number": "returns", "return_count": "returns", "confidence": "confidence"}
POINTS_PER_TEST = 1 << 17  # points tested against a polygon in one go
NO_VALUES = np.empty(0)


def check_attributes(path: Path, attributes: Mapping[str, np.ndarray], selection: Selection) -> None:
    """Refuse a file that does not hold what a selection asks for."""
    if missing := [name for name in selection.needs if name not in attributes]:
        option = {"class": "--class", "confidence": "--confidence"}.get(missing[0], "--returns")
        raise InputError(
            f"{path} has no {PLURALS[missing[0]]}, which {option} needs; LAS files have classes and returns, other files"
            " where a property or column is named classification, return_number, number_of_returns or confidence"
        )


def describe_points(points: np.ndarray, attributes: Mapping[str, np.ndarray]) -> str:
    """Return what could be selected from a file, in words; "" if all its points are NaN or infinite."""
    real = np.isfinite(points).all(axis=1)
    if not real.any():
        return ""
    held = {name: values[real & np.isfinite(values)] for name, values in attributes.items()}
    contents = []
    for name, words in (("class", "classes"), ("return_number", "returns")):
        if len(values := held.get(name, NO_VALUES)):
            contents.append(f" {words} {' '.join(f'{value:g}' for value in np.unique(values)[:20])}")
    if len(values := held.get("confidence", NO_VALUES)):
        contents.append(f" confidence up to {values.max():.4g}")
    corners = (points[real].min(axis=0), points[real].max(axis=0))
    contents.append(" x, y, z from " + " to ".join(", ".join(f"{c:.8g}" for c in corner) for corner in corners))
    return ",".join(contents)


def choose(
    points: np.ndarray, attributes: Mapping[str, np.ndarray], selection: Selection
) -> tuple[np.ndarray, dict[str, int]]:
    """Return which points are taken, (N,) bool, and how many each part of the selection left out, by its words.

    Parameters
    ----------
    points : (N, 3) array
        In the scan's own frame.
    attributes : (N,) arrays, all that `Selection.needs` names
    selection : what to take
    """
    kept = np.ones(len(points), dtype=bool)
    left_out: dict[str, int] = {}
    for words, test in _tests(points, attributes, selection):
        rows = np.flatnonzero(kept)
        passed = test(rows)
        left_out[words] = left_out.get(words, 0) + len(rows) - int(passed.sum())
        kept[rows[~passed]] = False
    return kept, left_out


def cropped_boxes(points: np.ndarray, kept: np.ndarray, selection: Selection) -> dict[str, np.ndarray]:
    """Return the lower and the upper corner (2, 3) of the box around the points that the crop leaves out, by its words.

    Parameters
    ----------
    points : (N, 3) array
        In the scan's own frame.
    kept : (N,) bool, which of them are taken
    selection : what to take
    """
    left, boxes = np.flatnonzero(~kept), dict[str, np.ndarray]()
    left = left[np.isfinite(points[left]).all(axis=1)]
    for crop in selection.crop:
        out = points[left[~_crop_test(points, crop)(left)]]
        if len(out):
            words, box = _outside(crop.partition(":")[0]), np.stack([out.min(axis=0), out.max(axis=0)])
            boxes[words] = box_around_boxes([box, boxes[words]] if words in boxes else [box])
    return boxes


def box_around_boxes(boxes: Sequence[np.ndarray]) -> np.ndarray:
    """Return the box (2, 3) around some boxes."""
    return np.stack([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])


def places_in(crops: Sequence[str], scale: np.ndarray) -> list[WantedBox]:
    """Return the boxes around parts of space in the unit of a file, whose axes are `scale` (3,) units of the scan long."""
    places = []
    for crop in crops:
        kind, polygons = parts_of(crop)
        numbers = polygons[0][0]
        lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
        if kind == "box":
            half = len(numbers) // 2
            lower[:half], upper[:half] = numbers[:half], numbers[half:]
        elif kind == "sphere":
            lower, upper = np.array(numbers[:3]) - numbers[3], np.array(numbers[:3]) + numbers[3]
        else:
            corners = np.concatenate([np.array(ring).reshape(-1, 2) for rings in polygons for ring in rings])
            lower[:2], upper[:2] = corners.min(axis=0), corners.max(axis=0)
        places.append(WantedBox(_outside(kind), lower / scale, upper / scale))
    return places


def _outside(kind: str) -> str:
    return f"outside the {kind}"


Test = Callable[[np.ndarray], np.ndarray]  # numbers of points -> which of them are taken


def _tests(
    points: np.ndarray, attributes: Mapping[str, np.ndarray], selection: Selection
) -> Iterator[tuple[str, Test]]:
    if selection.classes:
        classes = attributes["class"]
        yield "of other classes", lambda rows: np.isin(classes[rows], selection.classes)
    if selection.returns != "all":
        numbers, counts = attributes["return_number"], attributes.get("return_count")
        if selection.returns == "last" and counts is not None:
            yield "of other returns", lambda rows: numbers[rows] >= counts[rows]
        else:
            wanted = 1 if selection.returns == "first" else int(selection.returns)
            yield "of other returns", lambda rows: numbers[rows] == wanted
    if selection.confidence is not None:
        least, values = selection.confidence, attributes["confidence"]
        yield "of less confidence", lambda rows: values[rows] >= least
    for crop in selection.crop:
        yield _outside(crop.partition(":")[0]), _crop_test(points, crop)


def _crop_test(points: np.ndarray, crop: str) -> Test:
    kind, polygons = parts_of(crop)
    numbers = polygons[0][0]
    if kind == "box":
        half = len(numbers) // 2
        lower, upper = np.array(numbers[:half]), np.array(numbers[half:])
        return lambda rows: np.all((points[rows, :half] >= lower) & (points[rows, :half] <= upper), axis=1)
    if kind == "sphere":
        center, radius = np.array(numbers[:3]), numbers[3]
        return lambda rows: ((points[rows] - center) ** 2).sum(axis=1) <= radius * radius
    corners = [[np.array(ring).reshape(-1, 2) for ring in rings] for rings in polygons]
    return lambda rows: np.any([in_polygon(points[rows, :2], rings) for rings in corners], axis=0)


def in_polygon(places: np.ndarray, rings: list[np.ndarray]) -> np.ndarray:
    """Return which places, (N, 2), an odd number of rings hold, (N,) bool."""
    inside = np.zeros(len(places), dtype=bool)
    corners = np.concatenate(rings)
    near = np.flatnonzero(np.all((places >= corners.min(axis=0)) & (places <= corners.max(axis=0)), axis=1))
    for begin in range(0, len(near), POINTS_PER_TEST):
        rows = near[begin : begin + POINTS_PER_TEST]
        x, y = places[rows].T
        odd = np.zeros(len(rows), dtype=bool)
        for ring in rings:
            for (x0, y0), (x1, y1) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
                if y0 != y1:
                    odd ^= ((y >= y0) != (y >= y1)) & (x < x0 + (y - y0) * ((x1 - x0) / (y1 - y0)))
        inside[rows] = odd
    return inside
