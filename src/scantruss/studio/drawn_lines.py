"""Lines drawn on the scan by a few points: between these they follow the surface."""

from __future__ import annotations

import itertools
import re
import weakref
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from ..errors import InputError
from ..scan.cloud import PointCloud
from ..settings import Settings
from ..surface.samples import sample_surface
from .picking import nearest_point

if TYPE_CHECKING:
    from .session import Session
    from .view import StudioView

AROUND_LINE = 16  #: points of the scan to whose plane a place on a line is brought
STEP_OF_LINE = 0.5  #: largest distance of the points of a line [member length]
MOST_HALVINGS_OF_LINE = 10  #: of a stretch between two points


class ScannedPoints:
    """The points of a scan that are no outliers, in its own frame, with their k-d tree."""

    def __init__(self, cloud: PointCloud, settings: Settings) -> None:
        self.places = sample_surface(cloud, settings).measured_points + cloud.origin  #: (N, 3) [scan unit]
        self.tree = cKDTree(self.places)

    @classmethod
    def of(cls, cloud: PointCloud, settings: Settings) -> ScannedPoints:
        """Return the points of a scan, looked up once."""
        if cloud not in _SCANNED:
            _SCANNED[cloud] = cls(cloud, settings)
        return _SCANNED[cloud]

    def nearest(self, place: np.ndarray) -> np.ndarray:
        """Return the point (3,) of the scan nearest to a place."""
        return np.asarray(self.places[self.tree.query(place)[1]])

    def onto(self, place: np.ndarray) -> np.ndarray:
        """Return a place (3,) brought to the plane of the points around it."""
        around = self.places[self.tree.query(place, min(AROUND_LINE, len(self.places)))[1]]
        middle = around.mean(axis=0)
        _, _, axes = np.linalg.svd(around - middle, full_matrices=False)
        return np.asarray(place - axes[-1] * (axes[-1] @ (place - middle)))

    def along(self, points: np.ndarray, length: float) -> np.ndarray:
        """Return the line (M, 3) over the scan through some points (K, 3), in steps of half a member at most."""
        line = [points[0]]
        for begin, end in itertools.pairwise(points):
            stretch = np.stack([begin, end])
            for _ in range(MOST_HALVINGS_OF_LINE):
                if np.linalg.norm(np.diff(stretch, axis=0), axis=1).max() <= STEP_OF_LINE * length:
                    break
                middles = [self.onto(middle) for middle in 0.5 * (stretch[:-1] + stretch[1:])]
                stretch = np.insert(stretch, range(1, len(stretch)), middles, axis=0)
            line.extend(stretch[1:])
        return np.array(line)


_SCANNED: weakref.WeakKeyDictionary[PointCloud, ScannedPoints] = weakref.WeakKeyDictionary()


def scanned_points(session: Session) -> ScannedPoints:
    """Return the points of the scan of a session.

    Raises
    ------
    InputError
        There is none.
    """
    if session.cloud is None:
        raise InputError("there is no scan yet; open one")
    return ScannedPoints.of(session.cloud, session.settings)


def clicked_point(view: StudioView, origin: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Return the point (3,) of the scan under a ray of the scene from `origin` (3,) in direction `ahead` (3,) [scan unit].

    Raises
    ------
    InputError
        There is none.
    """
    places = scanned_points(view.session).places
    found = nearest_point(view.frame.to_scene(places), origin, ahead, view.near)
    if found is None:
        raise InputError("no point of the scan is there; click on the scan")
    return np.asarray(places[found], float)


def numbers_of(text: str, needed: int, what: str) -> tuple[float, ...]:
    """Return so many numbers that a person typed, with commas or blanks between them.

    Raises
    ------
    InputError
        They are others; `what` begins the message.
    """
    words = [word for word in re.split(r"[,;\s]+", text.strip()) if word]
    try:
        found = tuple(map(float, words))
    except ValueError:
        found = ()
    if len(found) != needed:
        raise InputError(f"{what}, got {text!r}")
    return found


def points_of(text: str) -> list[tuple[float, ...]]:
    """Return the points of a line that is typed as "x, y, z; x, y, z".

    Raises
    ------
    InputError
        They are none.
    """
    needs = "a line needs points x, y, z with semicolons between them"
    return [numbers_of(part, 3, needs) for part in text.split(";") if part.strip()]
