"""Bolts from the forces, and the ball in which they do not meet.

One bolt on the axis of each member end carries its tension. Stress areas by ISO 898-1, coarse pitches by ISO 261, resistance by
EN 1993-1-8 table 3.4. Threads, sleeves, cones and bending are not checked.
"""

from __future__ import annotations

import math

import numpy as np

PITCHES = {
    12: 1.75, 14: 2.0, 16: 2.0, 18: 2.5, 20: 2.5, 22: 2.5, 24: 3.0, 27: 3.0, 30: 3.5, 33: 3.5, 36: 4.0, 39: 4.0, 42: 4.5, 45: 4.5,
    48: 5.0, 52: 5.0, 56: 5.5, 60: 5.5, 64: 6.0,
}  # fmt: skip
GRADES = {
    "4.6": 400.0,
    "5.6": 500.0,
    "6.8": 600.0,
    "8.8": 800.0,
    "10.9": 1000.0,
}  #: f,ub of EN 1993-1-8 table 3.1 [MPa]
GAMMA_M2 = 1.25  #: partial factor of bolts, EN 1993-1-8 table 2.1, recommended value
NO_BOLTS = "none"


def stress_area(diameter: int) -> float:
    """Return the stress area of a metric coarse thread, ISO 898-1 [mm2]: pi / 4 (d - 0.9382 P)^2."""
    return math.pi / 4 * (diameter - 0.9382 * PITCHES[diameter]) ** 2


def tension_resistance(diameter: int, grade: str) -> float:
    """Return F,t,Rd of a bolt by EN 1993-1-8 table 3.4: 0.9 f,ub A,s / gamma,M2 [N]."""
    return 0.9 * GRADES[grade] * stress_area(diameter) / GAMMA_M2


def choose_bolts(tension: np.ndarray, grade: str) -> np.ndarray:
    """Return the smallest bolts that carry tensions (M,) [N] as their diameters [mm]; 0 where none does."""
    sizes = np.array([*PITCHES, 0])
    resistance = np.array([tension_resistance(size, grade) for size in PITCHES])
    return sizes[np.searchsorted(resistance, tension)]


def bolted_radii(angle: np.ndarray, bolt: np.ndarray, thread: float, sleeve: float) -> np.ndarray:
    """Return for pairs of member ends the radius of the ball in which their bolts, and on which their sleeves, do not meet.

    A sleeve of diameter `sleeve` d sits on a flat at sqrt(R^2 - (sleeve d / 2)^2) from the node, and its bolt enters by `thread` d.
    Cylinders of diameters d and e at an angle a part at (e / sin a + d / tan a) / 2 from the node, measured along the axis of d
    (see `schedules.joints.clear_radii`); the ends of both bolts, and of both sleeves, lie no nearer. For unequal bolts that of one
    would do; the larger ball is taken, on the safe side. Beyond 90 degrees that of 90 suffices.

    Parameters
    ----------
    angle : (K,) between the axes [degree]
    bolt : (K, 2) diameters [mm]
    thread, sleeve : depth of the thread, and diameter around the sleeve, over the diameter of the bolt

    Returns
    -------
    np.ndarray
        (K,) [mm]
    """
    turn = np.radians(np.minimum(angle, 90.0))[:, None]
    own, other = bolt.astype(float), bolt[:, ::-1].astype(float)
    apart = (other / np.sin(turn) + own / np.tan(turn)) / 2
    flat = np.maximum(apart + thread * own, sleeve * apart)
    radii: np.ndarray = np.hypot(flat, sleeve * own / 2).max(axis=1)
    return radii


def bolt_mark(diameter: int) -> str | None:
    """Return "M20"; None where no bolt is large enough."""
    return f"M{diameter}" if diameter else None
