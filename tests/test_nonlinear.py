"""The nonlinear path: closed forms and published figures, laws of every path, and slow obvious twins of the elements."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar
from scipy.spatial.transform import Rotation
from scipy.special import ellipk, ellipkinc, ellipeinc, ellipe
from small_grids import dome
from small_trusses import EA, EI, FREE, HELD, HINGED, STEEL, TUBE, forces, make_truss, stiff_along

import scantruss as st
from scantruss.structure.catalogue import Section
from scantruss.structure.corotational import Members, respond
from scantruss.structure.imperfections import fair_deviation
from scantruss.structure.nonlinear import Path, solve_path
from scantruss.structure.truss import LoadCase, Truss

FLAT = (np.inf, np.inf, np.inf, np.inf, 0.0, np.inf)  # held in place, turning about y


def chain(length: float, count: int, axis: ArrayLike = (1.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """Even nodes along a line and the members between them."""
    nodes = np.linspace(0, length, count + 1)[:, None] * np.asarray(axis, float)
    return nodes, np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)


def perfect(truss: Truss, load: str = "load", **others: Any) -> Path:
    """The path without imperfection, far."""
    return solve_path(truss, load, **({"imperfection": "none", "steps": 100, "beyond": 100} | others))


def toggle(high: float, half: float, **others: Any) -> Truss:
    """Two members that lean on each other: von Mises' truss, or Williams' toggle where they are held."""
    top = (0.0, np.inf, 0.0, np.inf, np.inf, np.inf)
    foot = others.pop("foot", HINGED)
    return make_truss(
        [(-half, 0, 0), (half, 0, 0), (0, 0, high)], [(0, 2), (1, 2)], {0: foot, 1: foot, 2: top},
        forces(3, {2: (0, 0, -1000.0)}), **others,
    )  # fmt: skip


def test_von_mises_truss_snaps_through_as_the_closed_form() -> None:
    """By hand: P = 2 E A (L - l) / L sin, l and its slope those of the moved bar; the limit where dP / dw = 0."""
    high, half = 0.5, 10.0
    path = perfect(toggle(high, half, pinned=True), stop_factor=40.0)
    length = math.hypot(half, high)

    def load(sunk: ArrayLike) -> np.ndarray:
        left = high - np.asarray(sunk)
        now = np.hypot(half, left)
        return 2 * EA * (length - now) / length * left / now / 1000

    peak = minimize_scalar(lambda w: -float(load(w)), bounds=(0, high), method="bounded", options={"xatol": 1e-12})
    assert path.factors == pytest.approx(load(path.moves), rel=1e-6, abs=1e-6)
    assert path.limit_factor == pytest.approx(-peak.fun, rel=1e-6) and path.kind == "limit point"
    assert path.factors.min() < -0.9 * path.limit_factor and path.factors[-1] == pytest.approx(40.0)  # it has gone through
    assert path.ended == "the load factor 40 is reached"


def test_a_cantilever_under_an_end_moment_rolls_up_into_a_circle() -> None:
    """theta = M L / E I: at 2 pi E I / L its tip is back at its foot, in any direction in space."""
    length, count = 10.0, 20
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    nodes, members = chain(length, count)
    for share in (0.25, 1.0):
        moment = share * 2 * math.pi * EI / length
        load = forces(count + 1, {count: (0, 0, 0, *(turn @ [0, -moment, 0]))})
        path = perfect(make_truss(nodes @ turn.T, members, {0: HELD}, load), stop_factor=1.0)
        radius = EI / moment
        angle = length / radius
        tip = turn @ [radius * math.sin(angle), 0, radius * (1 - math.cos(angle))]
        assert path.factors[-1] == 1.0
        assert path.displacements[-1, count, :3] + turn @ [length, 0, 0] == pytest.approx(tip, abs=2e-3 * length)
