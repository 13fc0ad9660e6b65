"""Normals that a scan comes with: they distinguish the two sides of something thin where the points alone do not."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from ..kernels.geometry.kd_tree import KDTree, nearest_of_places
from ..runtime.parallel import in_parts
from ..scan.clean.nearby import SEARCHES_PER_THREAD, build_kd_tree
from ..scan.cloud import PointCloud

NO_NORMALS = np.empty((0, 3))  # where none are given
POINTS_TO_JUDGE = 20_000  # points by which it is judged whether normals can be trusted
BESIDE_SINE = 0.3  # sine of the angle to its plane below which the nearest point lies beside a point, not behind it
MOST_OPPOSITE = 0.1  # share of them that may face opposite to one beside them; of normals of either sign half do
# nearest points that decide whether a normal is turned, how many of them must face opposite to it, how far most of them may lie behind its
# point, as the other side of a thin wall does [their distance]; rounds, as those that are turned decide on others
NEAREST, MOST_OF_NEAREST, LEAST_BEHIND_POINT, TURNING_ROUNDS = 12, 10, 0.05, 8
AT_A_POINT = 1e-6  # distance from a point within which a place has its normal [extent of the scan]

_NORMALS_OF_CLOUDS: weakref.WeakKeyDictionary[PointCloud, GivenNormals | None] = weakref.WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class GivenNormals:
    """Normals by place."""

    tree: KDTree
    normals: np.ndarray  #: (N, 3) unit normals in the order of the points
    same: float  #: distance from a point within which a place has its normal [scan unit]

    @classmethod
    def of(cls, points: np.ndarray, normals: np.ndarray) -> GivenNormals | None:
        """Return the normals (N, 3) of points (N, 3), None where they face both ways, as those of a plane fit may do.

        A few that face opposite to the points around them are turned.
        """
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        known = (lengths[:, 0] > 0.0) & np.isfinite(lengths[:, 0])
        unit = np.where(known[:, None], normals / np.where(known[:, None], lengths, 1.0), 0.0)
        given = cls(build_kd_tree(points), unit, AT_A_POINT * float(np.ptp(points, axis=0).max()))
        some = np.linspace(0, len(points) - 1, min(len(points), POINTS_TO_JUDGE)).astype(np.int64)
        other = given._nearest(points[some], 2)[0]
        beside = np.abs(_sines(points, unit, other, some)) < BESIDE_SINE
        opposite = ((unit[some] * unit[other]).sum(axis=1) < 0.0) & beside
        if opposite.mean() > MOST_OPPOSITE:
            return None
        if opposite.any():
            given._turn_to_others(points)
        return given

    def _turn_to_others(self, points: np.ndarray) -> None:
        """Turn those normals of points (N, 3) that face opposite to nearly all around them."""
        unit, next_one = self.normals, self._nearest(points, 2)[0]
        for _ in range(TURNING_ROUNDS):
            is_doubtful = ((unit * unit[next_one]).sum(axis=1) < 0.0) & (_sines(points, unit, next_one) > -BESIDE_SINE)
            doubtful = np.flatnonzero(is_doubtful)
            others = np.stack([self._nearest(points[doubtful], rank)[0] for rank in range(2, NEAREST + 2)])
            opposite = ((unit[doubtful] * unit[others]).sum(axis=2) < 0.0).sum(axis=0)
            behind = -np.median([_sines(points, unit, other, doubtful) for other in others], axis=0)
            turned = doubtful[(opposite >= MOST_OF_NEAREST) & (behind < LEAST_BEHIND_POINT)]
            if not len(turned):
                break
            unit[turned] *= -1.0

    def at(self, places: np.ndarray) -> np.ndarray:
        """Return the normals at places (P, 3), those of the points there; zero where there is none, (P, 3)."""
        which, squares = self._nearest(places, 1)
        return np.where(squares[:, None] <= self.same * self.same, self.normals[which], 0.0)

    def _nearest(self, places: np.ndarray, rank: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the point nearest to each place (P,) for rank 1, the second nearest for rank 2, and its squared distance (P,)."""
        squares, which = np.empty(len(places)), np.empty(len(places), np.int64)

        def look_up(_: int, begin: int, end: int) -> None:
            nearest_of_places(self.tree, places[begin:end], rank, squares[begin:end], which[begin:end])

        in_parts(len(places), SEARCHES_PER_THREAD, look_up)
        return which, squares


def _sines(points: np.ndarray, unit: np.ndarray, other: np.ndarray, which: np.ndarray | slice = np.s_[:]) -> np.ndarray:
    """Return the sine of the angle at which other points (K,) lie above the planes of some points (K,), or of all."""
    apart = points[other] - points[which]
    sines: np.ndarray = (apart * unit[which]).sum(axis=1) / np.maximum(np.linalg.norm(apart, axis=1), 1e-300)
    return sines


def given_normals(cloud: PointCloud) -> GivenNormals | None:
    """Return the normals that came with a cloud, None where there are none or they face both ways; kept as long as the cloud lives."""
    if cloud.normals is None:
        return None
    if cloud not in _NORMALS_OF_CLOUDS:
        _NORMALS_OF_CLOUDS[cloud] = GivenNormals.of(cloud.points, cloud.normals)
    return _NORMALS_OF_CLOUDS[cloud]
