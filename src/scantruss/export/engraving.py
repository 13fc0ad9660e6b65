"""Marks engraved on the balls and members of a printed model."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

MARK_WIDTH = 1.1  # width of a mark over the radius of its ball
LETTER_HEIGHT = 0.6  # height of letters over the radius of the ball
ENGRAVING_DEPTH = 0.08  # of the engraving where it is least deep, over the radius of the ball
TALL_ON_MEMBER = 0.9  # greatest height of letters over the radius of the member
ROOM_TAKEN = 0.8  # greatest share of the clear length that a mark takes
DEPTH_ON_MEMBER = 0.15  # of the engraving where it is least deep, over the radius of the member


@cache
def _letters(text: str) -> tuple[np.ndarray, ...]:
    """Return the outlines of a text in letters of height 1, its middle at 0."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    path = TextPath((0, 0), text, size=1.0, prop=FontProperties(family="DejaVu Sans", weight="bold"))
    polygons = [np.asarray(each)[:-1] for each in path.to_polygons()]
    outlines = [each for each in polygons if len(each) > 2]
    points = np.concatenate(outlines)
    low, high = points.min(axis=0), points.max(axis=0)
    return tuple((each - (low + high) / 2) / (high - low)[1] for each in outlines)


def engraved(ball: Any, radius: float, text: str, normal: np.ndarray) -> Any:
    """Return a ball around 0 with a text engraved where a normal (3,) leaves it, read from outside; up is as near to y or z as can be."""
    from manifold3d import CrossSection, FillRule, Manifold

    outlines = _letters(text)
    wide = 2 * max(float(np.abs(each[:, 0]).max()) for each in outlines)
    height = radius * min(MARK_WIDTH / wide, LETTER_HEIGHT)
    reach = height * max(float(np.linalg.norm(each, axis=1).max()) for each in outlines)
    floor = float(np.sqrt(radius**2 - reach**2)) - ENGRAVING_DEPTH * radius
    flat = CrossSection([(each * height).tolist() for each in outlines], FillRule.EvenOdd)
    letters = Manifold.extrude(flat, 2 * radius - floor).translate((0.0, 0.0, floor))
    up = np.array([0.0, 1.0, 0.0] if abs(normal[2]) > 0.5 else [0.0, 0.0, 1.0])
    x = np.cross(up, normal)
    x /= np.linalg.norm(x)
    turn = np.stack([x, np.cross(normal, x), normal, np.zeros(3)], axis=1)
    return ball - letters.transform(turn)


def engraved_member(
    bar: Any, radius: float, sides: int, text: str, place: np.ndarray, way: np.ndarray, normal: np.ndarray, room: float
) -> Any:
    """Return a member with a text engraved along it.

    Parameters
    ----------
    bar : the member, a prism of `sides` sides whose corners lie at `radius`
    place, way, normal : (3,) place on its axis, unit vector along it, and the side that the text is on
    room : clear length there; the text takes `ROOM_TAKEN` of it at most
    """
    from manifold3d import CrossSection, FillRule, Manifold

    outlines = _letters(text)
    wide = 2 * max(float(np.abs(each[:, 0]).max()) for each in outlines)
    height = min(TALL_ON_MEMBER * radius, ROOM_TAKEN * room / wide)
    if height <= 0:
        return bar
    out = normal - (normal @ way) * way
    if np.linalg.norm(out) < 1e-6:
        out = np.cross(way, np.eye(3)[np.abs(way).argmin()])
    out = out / np.linalg.norm(out)
    floor = float(np.sqrt((radius * np.cos(np.pi / sides)) ** 2 - (height / 2) ** 2)) - DEPTH_ON_MEMBER * radius
    flat = CrossSection([(each * height).tolist() for each in outlines], FillRule.EvenOdd)
    letters = Manifold.extrude(flat, 2 * radius - floor).translate((0.0, 0.0, floor))
    return bar - letters.transform(np.stack([way, np.cross(out, way), out, place], axis=1))


def letter_height(text: str, radius: float) -> float:
    """Return how high the letters of a text on a ball are."""
    wide = 2 * max(float(np.abs(each[:, 0]).max()) for each in _letters(text))
    return radius * min(MARK_WIDTH / wide, LETTER_HEIGHT)
