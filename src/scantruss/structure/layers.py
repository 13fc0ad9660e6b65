"""Checks of a double layer: members that come too close, and members at small angles to the webs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..layouts.clearance import angles_at_nodes, close_pairs
from ..layouts.double_layer import PLACES_NAMED, WEB_MEMBERS
from .truss import Truss

LEAST_WEB_ANGLE = 30.0  #: between a web and another member at a node [degree]


@dataclass(frozen=True, eq=False)
class LayerChecks:
    """Pairs of members that are hard or impossible to build."""

    clashes: np.ndarray  #: (P, 2) int64 members without a common node, closer than their diameters
    clearances: np.ndarray  #: (P,) distance of their axes [m]
    sharp: np.ndarray  #: (A, 2) int64 members at a node, one of them a web, at less than LEAST_WEB_ANGLE
    angles: np.ndarray  #: (A,) [degree]
    shallow: np.ndarray  #: (S,) int64 nodes of the grid under which the depth is reduced, since it bends sharply

    def to_dict(self, truss: Truss) -> dict[str, Any]:
        """Return plain values, ready for JSON."""
        marks = truss.member_marks
        return {
            "clashes": [
                {"members": [marks[a], marks[b]], "distance": apart, "where": _between(truss, a, b)}
                for (a, b), apart in zip(self.clashes.tolist(), self.clearances.tolist(), strict=True)
            ],
            "small_angles": [
                {"members": [marks[a], marks[b]], "angle": angle}
                for (a, b), angle in zip(self.sharp.tolist(), self.angles.tolist(), strict=True)
            ],
            "reduced_depth": [truss.node_marks[node] for node in self.shallow.tolist()],
        }

    def warnings(self, truss: Truss) -> list[str]:
        """Say how many there are, and the worst."""
        found = []
        if len(self.clashes):
            a, b = self.clashes[int(self.clearances.argmin())].tolist()
            where = ", ".join(f"{c:.5g}" for c in _between(truss, a, b))
            found.append(
                f"{len(self.clashes):,} pairs of members come closer than their diameters, the most {truss.member_marks[a]} and"
                f" {truss.member_marks[b]}, {1e3 * self.clearances.min():.3g} mm apart at ({where})"
            )
        if len(self.sharp):
            a, b = self.sharp[int(self.angles.argmin())].tolist()
            steep = np.isin(self.sharp, _webs(truss)).all(axis=1).mean() > 0.5  # webs against webs, not against chords
            found.append(
                f"{len(self.sharp):,} angles of webs to other members are below {LEAST_WEB_ANGLE:g} degrees, the least"
                f" {self.angles.min():.3g} between {truss.member_marks[a]} and {truss.member_marks[b]};"
                f" a {'smaller' if steep else 'larger'} depth opens them"
            )
        if len(self.shallow) and truss.layers is not None:
            named = "; ".join(
                f"{truss.node_marks[node]} ({', '.join(f'{c:.5g}' for c in truss.nodes[node] + truss.origin)})"
                for node in self.shallow[:PLACES_NAMED].tolist()
            )
            more = f" and {len(self.shallow) - PLACES_NAMED:,} more" if len(self.shallow) > PLACES_NAMED else ""
            found.append(
                f"the depth is reduced where the grid bends sharply, to {truss.layers.share.min():.2g} of it at the least, at"
                f" {named}{more}"
            )
        return found


def _webs(truss: Truss) -> np.ndarray:
    """Return the ids of the webs."""
    return np.concatenate(
        [np.zeros(0, np.int64), *(ids for name, ids in truss.member_sets.items() if name.startswith(WEB_MEMBERS))]
    )


def check_layers(truss: Truss) -> LayerChecks:
    """Return what is hard or impossible to build of a double layer."""
    around = [s.width if s.shape == "CHS" else float(np.hypot(s.width, s.depth)) for s in truss.sections]
    clashes, clearances = close_pairs(truss.nodes, truss.members, np.array(around)[truss.section_of] / 2)
    pairs, angles = angles_at_nodes(truss.nodes, truss.members)
    sharp = (angles < LEAST_WEB_ANGLE) & np.isin(pairs, _webs(truss)).any(axis=1)
    return LayerChecks(clashes, clearances, pairs[sharp], angles[sharp], _shallow(truss))


def _shallow(truss: Truss) -> np.ndarray:
    """Return the nodes of the grid at which the depth is reduced: those over a node of the second layer that is less deep."""
    if truss.layers is None:
        return np.zeros(0, np.int64)
    less = truss.layers.share < 1.0
    one, two = truss.members.T
    over = np.concatenate([one[less[two]], two[less[one]]])
    return np.unique(over[truss.layers.of_nodes[over] == 0])


def _between(truss: Truss, one: int, two: int) -> list[float]:
    """Return the middle of two members in the frame of the scan, times the scale [m]."""
    middle = truss.nodes[truss.members[[one, two]]].mean(axis=(0, 1)) + truss.origin
    return [float(c) for c in middle]
