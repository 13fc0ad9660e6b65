"""The nonlinear path: closed forms and published figures, laws of every path, and slow obvious twins of the elements."""

import math
from dataclasses import replace
from typing import Any

import beams_of_arrays
import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.optimize import brentq, fsolve, minimize_scalar
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc
from small_grids import dome
from small_trusses import EA, EI, HELD, HINGED, STEEL, TUBE, forces, make_truss, stiff_along

import scantruss as st
from scantruss.structure.corotational import FARTHEST_TURN, Members, answer, respond
from scantruss.structure.imperfections import fair_deviation
from scantruss.structure.mixture import Mixture
from scantruss.structure.nonlinear import solve_path
from scantruss.structure.path import Path
from scantruss.structure.truss import LoadCase, Truss

FLAT = (np.inf, np.inf, np.inf, np.inf, 0.0, np.inf)  # held in place, turning about y


def chain(length: float, count: int, axis: ArrayLike = (1.0, 0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
    """Even nodes along a line and the members between them."""
    nodes = np.linspace(0, length, count + 1)[:, None] * np.asarray(axis, float)
    return nodes, np.stack([np.arange(count), np.arange(1, count + 1)], axis=1)


def perfect(truss: Truss, load: str = "load", **others: Any) -> Path:
    """The path without imperfection, far."""
    given: dict[str, Any] = {"imperfection": "none", "steps": 100, "beyond": 100}
    return solve_path(truss, load, **(given | others))


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
    assert path.limit_factor is not None
    assert path.factors.min() < -0.9 * path.limit_factor and path.factors[-1] == pytest.approx(
        40.0
    )  # it has gone through
    assert path.ended == "the load factor 40 is reached"


WILLIAMS = (12.943, 0.386, 1.885e6, 9.27e3)  # half span and rise [in], E A [lb], E I [lb in2] of Williams' frame, 1964


def williams_load(sunk: float) -> float:
    """By hand: two beam-columns, held at their feet and guided at the top, shallow; the load for a displacement of the top [in, lb]."""
    half, high, axial, bending = WILLIAMS
    along = np.linspace(0.0, half, 2001)

    def shortening(pressed: float) -> float:
        k = math.sqrt(pressed / bending)
        own, turn = math.cos(k * half) - 1.0, math.sin(k * half)
        bent = own * (1 - np.cos(k * along)) + turn * (k * along - np.sin(k * along))
        slopes = sunk / bent[-1] * k * (own * np.sin(k * along) + turn * (1 - np.cos(k * along)))
        return float(high * sunk / half - np.trapezoid(slopes**2, along) / 2 - pressed * half / axial)

    euler = math.pi**2 * bending / half**2
    pressed = brentq(shortening, 1e-9 * euler, 3.9 * euler)
    k = math.sqrt(pressed / bending)
    return float(2 * (pressed * sunk / (2 / k * math.tan(k * half / 2) - half) + pressed * high / half))


def williams() -> Truss:
    """The frame, loaded by its published limit of 34 lb at the top."""
    half, high, axial, bending = WILLIAMS
    count = 8
    shares = np.linspace(0.0, 1.0, count + 1)[:, None]
    left = (1 - shares) * [-half, 0.0, 0.0] + shares * [0.0, 0.0, high]
    nodes = np.concatenate([left, left[-2::-1] * [-1.0, 1.0, 1.0]])
    members = np.stack([np.arange(2 * count), np.arange(1, 2 * count + 1)], axis=1)
    values: dict[str, Any] = {"inertia_y": bending, "inertia_z": bending, "torsion": bending, "area": axial}
    section = replace(TUBE, **{name: value / STEEL.young for name, value in values.items()})
    plane = (0.0, np.inf, 0.0, np.inf, 0.0, np.inf)
    held = dict.fromkeys(range(1, 2 * count), plane) | {0: HELD, 2 * count: HELD}
    held[count] = (np.inf, np.inf, 0.0, np.inf, np.inf, np.inf)
    load = forces(2 * count + 1, {count: (0, 0, -34.0)})
    return make_truss(nodes, members, held, load, sections=(section,))


def test_williams_toggle_snaps_as_two_beam_columns_do() -> None:
    """Its limit of 34 lb is published: Williams 1964, and many since."""
    truss = williams()
    top = len(truss.nodes) // 2
    path = perfect(truss, stop_factor=1.2)
    assert path.limit_factor is not None and 34 * path.limit_factor == pytest.approx(34.0, rel=0.005)
    peak = minimize_scalar(lambda sunk: -williams_load(sunk), bounds=(0.05, 0.4), method="bounded")
    assert 34 * path.limit_factor == pytest.approx(-peak.fun, rel=2e-3)
    sunk = -path.displacements[1:, top, 2]
    assert sunk.max() > 0.5 and (np.diff(path.factors) < 0.0).any()  # through the limit, and stiff again
    assert 34 * path.factors[1:] == pytest.approx([williams_load(each) for each in sunk], rel=5e-3)


def test_a_cantilever_under_an_end_moment_rolls_up_into_a_circle() -> None:
    """The turn is M L / E I in every state, and the tip lies on the circle, in any direction in space."""
    length, count = 10.0, 20
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    nodes, members = chain(length, count)
    moment = 0.5 * 2 * math.pi * EI / length
    load = forces(count + 1, {count: (0, 0, 0, *(turn @ [0, -moment, 0]))})
    path = perfect(make_truss(nodes @ turn.T, members, {0: HELD}, load), stop_factor=1.0, steps=20)
    assert path.factors.max() > 0.5  # a quarter of a circle and more
    for factor, moved in zip(path.factors[1:], path.displacements[1:, count], strict=True):
        radius = EI / moment / factor
        tip = radius * np.array([math.sin(length / radius), 0, 1 - math.cos(length / radius)])
        assert moved[:3] + turn @ [length, 0, 0] == pytest.approx(turn @ tip, abs=2e-3 * length)
        assert Rotation.from_rotvec(turn.T @ moved[3:]).as_rotvec()[1] == pytest.approx(-length / radius, rel=1e-4)


def elastica(slope: float) -> tuple[float, float, float]:
    """Load [E I / L2], and how far down and out the tip of a cantilever lies [L], by its slope: Bisshopp and Drucker 1945."""
    modulus = (1 + math.sin(slope)) / 2
    start = math.asin(math.sqrt(1 / (2 * modulus)))
    load = float(ellipk(modulus) - ellipkinc(start, modulus)) ** 2
    down = 1 - 2 * float(ellipe(modulus) - ellipeinc(start, modulus)) / math.sqrt(load)
    return load, down, math.sqrt(2 * math.sin(slope) / load)


@pytest.mark.parametrize("slope", [0.5, 1.0, 1.3])
def test_a_cantilever_under_an_end_force_is_the_elastica(slope: float) -> None:
    load, down, away = elastica(slope)
    length, count = 5.0, 16
    nodes, members = chain(length, count)
    tip = forces(count + 1, {count: (0, 0, -load * EI / length**2)})
    path = perfect(make_truss(nodes, members, {0: HELD}, tip, sections=(stiff_along(factor=1e3),)), stop_factor=1.0)
    assert path.factors[-1] == pytest.approx(1.0)
    assert path.displacements[-1, count, 2] == pytest.approx(-down * length, rel=1e-3)
    assert length + path.displacements[-1, count, 0] == pytest.approx(away * length, rel=1e-3)
    assert path.displacements[-1, count, 4] == pytest.approx(slope, rel=1e-3)


def star_dome() -> Truss:
    """24 pinned members: apex, a ring of 6 at 25 m, 6 supports at 43.3 m (the shape of Hangai and Kawamata 1973, in m)."""
    inner, outer = np.radians(60 * np.arange(6)), np.radians(60 * np.arange(6) + 30)
    ring = np.stack([25 * np.cos(inner), 25 * np.sin(inner), np.full(6, 6.216)], axis=1)
    feet = np.stack([43.3 * np.cos(outer), 43.3 * np.sin(outer), np.zeros(6)], axis=1)
    pairs = [
        pair
        for k in range(6)
        for pair in ((0, k + 1), (k + 1, (k + 1) % 6 + 1), (k + 1, k + 7), (k + 1, (k - 1) % 6 + 7))
    ]
    load = forces(13, {0: (0, 0, -1000.0)})
    return make_truss([(0, 0, 8.216), *ring, *feet], pairs, dict.fromkeys(range(7, 13), HINGED), load, pinned=True)


def test_the_star_dome_snaps_through_as_a_slow_solution_says() -> None:
    """Bars by hand: the apex is pushed down, the ring follows by two equations of equilibrium, radial and upright."""
    truss = star_dome()
    path = perfect(truss, stop_factor=1e6, steps=12, beyond=4)
    top, ring, feet = truss.nodes[0], truss.nodes[1], truss.nodes[[7, 12]]

    def pull(here: np.ndarray, there: np.ndarray, length: float) -> np.ndarray:
        now = np.linalg.norm(there - here)
        return EA * (now - length) / length * (there - here) / now

    def left(moved: np.ndarray, sunk: float) -> np.ndarray:
        node, apex = np.array([moved[0], 0, moved[1]]), top - [0, 0, sunk]
        force = pull(node, apex, math.dist(ring, top)) + sum(pull(node, f, math.dist(ring, f)) for f in feet)
        for side in (1, -1):
            turn = Rotation.from_rotvec([0, 0, side * math.pi / 3])
            force = force + pull(node, turn.apply(node), 25.0)
        return force[[0, 2]] / EA

    start = ring[[0, 2]]
    for factor, sunk in zip(path.factors[1:], -path.displacements[1:, 0, 2], strict=True):
        for part in np.linspace(0, sunk, 20):
            start = fsolve(left, start, (part,), xtol=1e-13)
        if path.negative_pivots[list(path.factors).index(factor)] > 1:
            break  # it has left the symmetric way
        load = 6 * pull(np.array([start[0], 0, start[1]]), top - [0, 0, sunk], math.dist(ring, top))[2]
        assert factor * 1000 == pytest.approx(-load, rel=1e-6)
        start = ring[[0, 2]]
    assert path.limit_factor is not None and path.limit_factor == pytest.approx(path.factors.max(), rel=1e-4)


def column(count: int = 12, length: float = 6.0) -> Truss:
    """A column on two hinges in the plane of x and z, under the load of Euler."""
    nodes, members = chain(length, count, (0, 0, 1))
    held = {k: (0.0, np.inf, 0.0, np.inf, 0.0, np.inf) for k in range(1, count)}
    held |= {0: FLAT, count: (np.inf, np.inf, 0.0, np.inf, 0.0, np.inf)}
    return make_truss(nodes, members, held, forces(count + 1, {count: (0, 0, -(math.pi**2) * EI / length**2)}))


def test_a_straight_column_bifurcates_at_the_load_of_euler() -> None:
    path = perfect(column(), beyond=1)
    assert path.kind == "bifurcation" and path.limit_factor == pytest.approx(1.0, abs=2e-3)


def test_a_bent_column_bends_on_as_the_textbook_says() -> None:
    """Timoshenko and Gere 1.12: an initial sine of amplitude a grows to a / (1 - P / P Euler); and nears the load of Euler."""
    path = solve_path(column(), "load", imperfection="mode:6mm", steps=25)
    small = (path.moves < 0.09) & (path.factors < 0.95) & (path.factors > 0)
    assert small.sum() >= 3 and path.imperfection.largest == pytest.approx(0.006)
    middle = np.abs(path.displacements[:, 6, 0])
    assert middle[small] == pytest.approx(0.006 * (1 / (1 - path.factors[small]) - 1), rel=0.02)
    assert 0.95 < path.factors.max() < 1.02


def test_a_heated_arch_rises_without_force() -> None:
    """By hand: two bars that lengthen by alpha T rise to the third side of their triangle."""
    heat = LoadCase("load", temperature=np.full(2, 500.0))
    truss = toggle(0.5, 10.0, pinned=True).replace(cases=(heat,))
    path = perfect(truss, stop_factor=1.0)
    length = math.hypot(0.5, 10.0) * (1 + STEEL.alpha * 500)
    assert path.displacements[-1, 2, 2] == pytest.approx(math.sqrt(length**2 - 100) - 0.5, rel=1e-9)
    assert path.axial[-1] == pytest.approx([0, 0], abs=1e-3)


def test_a_settlement_grows_with_the_load_factor() -> None:
    """Pinned bars follow a foot that moves out: the apex sinks as the triangle says."""
    moved = np.full((3, 3), np.nan)
    moved[0, 0] = -0.01
    truss = toggle(1.5, 10.0, pinned=True).replace(cases=(LoadCase("load", settlement=moved),))
    path = perfect(truss, stop_factor=1.0)
    place = truss.nodes[2] + path.displacements[-1, 2, :3]
    out = -10 - 0.01 * path.factors[-1]
    assert path.factors[-1] > 0.5
    assert [math.dist(place, (out, 0, 0)), math.dist(place, (10, 0, 0))] == pytest.approx([truss.lengths[0]] * 2)


def test_tangents_are_the_derivatives_of_forces_and_turn_with_the_structure() -> None:
    """Symmetric second derivatives of the energy against finite differences; a rigid motion changes no force within."""
    rng = np.random.default_rng(0)
    nodes = rng.normal(size=(3, 3)) * 2
    springs = np.array([[[1e6, 3e5], [np.inf, 2e5]]] * 2)
    truss = make_truss(nodes, [(0, 1), (1, 2)], {0: HELD}, end_stiffness=springs)
    members, strain = Members.of(truss), np.array([1e-3, -2e-3])
    moves, turns = rng.normal(size=(3, 3)) * 0.05, Rotation.from_rotvec(rng.normal(size=(3, 3)) * 0.25).as_matrix()
    rows = (truss.members[:, :, None] * 6 + np.arange(6)).reshape(2, 12)

    def forces_at(step: np.ndarray) -> np.ndarray:
        each = step.reshape(3, 6)
        turned = Rotation.from_rotvec(each[:, 3:]).as_matrix() @ turns
        made = respond(members, moves + each[:, :3], turned, strain, 1.0)
        return np.bincount(rows.ravel(), made.forces.ravel(), 18)

    step = 1e-6
    slope = np.stack([(forces_at(step * e) - forces_at(-step * e)) / (2 * step) for e in np.eye(18)], axis=1)
    found = respond(members, moves, turns, strain, 1.0, tangents=True)
    assert found.tangents is not None
    tangent = np.zeros((18, 18))
    for row, part in zip(rows, found.tangents, strict=True):
        tangent[np.ix_(row, row)] += part
    assert tangent == pytest.approx((slope + slope.T) / 2, abs=1e-9 * np.abs(tangent).max())
    turn = Rotation.from_rotvec([1.0, 2.0, -0.5]).as_matrix()
    turned = respond(members, (nodes + moves) @ turn.T - nodes, turn @ turns, strain, 1.0)
    assert turned.natural == pytest.approx(found.natural, abs=1e-9 * np.abs(found.natural).max())


@pytest.mark.kernels
def test_forces_and_their_derivatives_are_those_of_arrays() -> None:
    """The kernels against their twin of arrays, small turns and large ones, hinges and springs at the ends."""
    rng = np.random.default_rng(1)
    nodes = rng.normal(size=(8, 3)) * 3
    springs = np.where(rng.random((12, 2, 2)) < 0.5, np.inf, 3e5)
    pairs = [(a, b) for a in range(8) for b in range(a)][::2][:12]
    members = Members.of(make_truss(nodes, pairs, {0: HELD}, end_stiffness=springs))
    strain = rng.normal(size=12) * 1e-3
    for size in (0.0, 1e-6, 0.2, 2.0):
        moves = rng.normal(size=(8, 3)) * 0.1 * size
        turns = Rotation.from_rotvec(rng.normal(size=(8, 3)) * 0.3 * size).as_matrix()
        given = members, moves, turns, strain, 0.7
        foreseen = rng.normal(size=(12, 6)) * 1e3
        fast, slow = answer(*given), beams_of_arrays.respond(*given)
        assert fast.too_far == slow.too_far == (size > 1) and FARTHEST_TURN == 0.5
        if slow.too_far:
            continue
        for name in ("natural", "forces"):
            same(getattr(fast, name), getattr(slow, name))
        for others in ({}, {"tangents": True}, {"tangents": True, "foreseen": foreseen}):
            made, twin = respond(*given, **others), beams_of_arrays.respond(*given, **others)
            assert not made.too_far and (made.tangents is None) == ("tangents" not in others)
            for name in ("natural", "forces", "strained", "stiffness", "slope", *list(others)[:1]):
                same(getattr(made, name), getattr(twin, name))


def same(found: np.ndarray, expected: np.ndarray) -> None:
    assert found == pytest.approx(expected, abs=1e-12 * max(float(np.abs(expected).max()), 1e-30))


def test_mixed_iterations_solve_what_plain_ones_do_not() -> None:
    """A linear system by a poor inverse: plain iterations grow, mixed ones end when they have seen each of its five eigenvalues."""
    values = np.repeat([0.4, 0.8, 1.3, 1.9, 2.2], 4)  # of the poor inverse times the matrix
    goal = np.random.default_rng(0).normal(size=20)
    plain, mixed, mixture = np.zeros(20), np.zeros(20), Mixture(np.ones(20))
    for _ in range(7):
        plain = plain + values * (goal - plain)
        mixed = mixed + mixture.improved(values * (goal - mixed), 0.0)[0]
    assert np.abs(plain - goal).max() > 1 and mixed == pytest.approx(goal, abs=1e-6)


def test_of_both_signs_of_a_mode_the_lower_limit_counts() -> None:
    """A path of both signs is that of one of them, the one that loses its stability first."""
    truss = st.Truss.from_grid(dome(6, 40.0), scale=50, supports="boundary", loads="cladding:1kN/m2")
    both = solve_path(truss, "cladding", imperfection="mode:30mm")
    signs = [solve_path(truss, "cladding", imperfection=sign * both.imperfection.moves) for sign in (1.0, -1.0)]
    limits = [path.limit_factor or math.inf for path in signs]
    chosen = signs[int(np.argmin(limits))]
    assert (
        both.limit_factor == pytest.approx(min(limits), rel=1e-12) and both.ended == chosen.ended
    )  # the dome is nearly symmetric
    assert both.factors == pytest.approx(chosen.factors, rel=1e-9)


@pytest.mark.parametrize("joints", ["rigid", "pinned", "50000"])
def test_every_state_of_a_shell_is_in_equilibrium(joints: str) -> None:
    """Loads and reactions balance, forces and moments about the displaced nodes; springs at ends and supports included."""
    truss = st.Truss.from_grid(
        dome(6, 40.0),
        scale=50,
        supports="boundary",
        support_type="springs:50MN/m",
        loads="cladding:1kN/m2",
        joints=joints,
    )
    path = solve_path(truss, "cladding", imperfection="mode:10mm", steps=8)
    assert path.equilibrium_errors.max() < 1e-9
    nodal = truss.cases[0].nodal
    assert nodal is not None
    for factor, moved, reaction in zip(path.factors, path.displacements, path.reactions, strict=True):
        force = factor * nodal[:, :3] + reaction[:, :3]
        about = np.cross(path.truss.nodes + moved[:, :3], force).sum(axis=0) + reaction[:, 3:].sum(axis=0)
        size = max(factor, 1e-9) * np.abs(nodal).sum()
        assert np.abs(force.sum(axis=0)).max() < 1e-7 * size and np.abs(about).max() < 1e-5 * size
    grid = dome(6, 40.0)
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    metres = grid.replace(nodes=grid.nodes @ turn.T / 1000, unit="m")
    other = st.Truss.from_grid(
        metres, scale=50, supports="boundary", support_type="springs:50MN/m", loads="cladding:1kN/m2", joints=joints
    )
    turned = solve_path(other, "cladding", imperfection=path.imperfection.moves @ turn.T, steps=8)
    assert turned.factors[:4] == pytest.approx(path.factors[:4], rel=1e-5)


def test_the_fair_surface_shows_a_node_that_is_off() -> None:
    truss = st.Truss.from_grid(dome(12, 40.0), scale=50, supports="boundary")
    node = 12 * 6 + 6
    smooth = np.linalg.norm(fair_deviation(truss), axis=1).max()
    pushed = truss.nodes.copy()
    pushed[node] += 0.1 * truss.node_normals[node]
    found = fair_deviation(truss.replace(nodes=pushed))
    assert smooth < 0.02 and found[node] @ truss.node_normals[node] == pytest.approx(0.1, rel=0.25)
    assert np.linalg.norm(found, axis=1).argmax() == node
    lines = {**truss.node_sets, "line:ridge": np.array([node])}
    assert not fair_deviation(truss.replace(nodes=pushed, node_sets=lines))[node].any()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"imperfection": "bump"}, "an imperfection is mode"),
        ({"imperfection": "mode:3"}, "unit is missing"),
        ({"imperfection": np.zeros((2, 2))}, "displacements of nodes"),
        ({"steps": 0}, "1 step or more"),
        ({"load": "snow"}, "no load case or combination 'snow'"),
    ],
)
def test_what_makes_no_path_is_refused(options: dict[str, Any], said: str) -> None:
    with pytest.raises(st.InputError, match=said):
        given: dict[str, Any] = {"load": "load"}
        solve_path(toggle(0.5, 10.0), **(given | options))
