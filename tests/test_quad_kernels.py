"""The energy of quads and how they settle: slopes against differences, sums against a slow twin, and squares as the lowest of all."""

from itertools import pairwise

import numpy as np
import pytest
from rough import curve_of, no_boundary

from scantruss.kernels.boundary.curves import Curves
from scantruss.kernels.cells.collapse import collapse_edges
from scantruss.kernels.cells.quads import (
    FREE_NODE,
    RESTING_NODE,
    SAG_REACH,
    SLIDING_NODE,
    STRAIGHT_COST,
    QuadNet,
    corner_energy,
    energy_of_quads,
    node_energy,
    sag_around,
    sag_of,
    settle_quads,
    side_energy,
    way_on_curve,
)
from scantruss.kernels.cells.trial import TRIAL_SWEEPS, shares_of, try_quads
from scantruss.kernels.surface.local_surface import SURFACE_PATCH

pytestmark = pytest.mark.kernels
SIZE = 4  # squares along a side
LENGTHS, ANGLES = 3.0, 0.5


class Lattice:
    """Squares of side 1 in a plane, whose boundary rests, with inner nodes that are moved in the plane."""

    def __init__(self, seed: int, amount: float) -> None:
        rng, row = np.random.default_rng(seed), SIZE + 1
        at = np.arange(row * row)
        self.squares = np.column_stack([at % row, at // row, 0 * at]).astype(float)
        rim = (at % row % SIZE == 0) | (at // row % SIZE == 0)
        self.at_boundary, self.held = rim, np.where(rim, RESTING_NODE, FREE_NODE)
        corner = np.array([x + row * y for y in range(SIZE) for x in range(SIZE)])
        self.quads = np.column_stack([corner, corner + 1, corner + row + 1, corner + row])
        self.nodes = self.squares.copy()
        self.nodes[~rim, :2] += rng.uniform(-amount, amount, (int((~rim).sum()), 2))
        self.patches = np.zeros(len(at), SURFACE_PATCH)
        self.patches["centre"] = self.squares
        self.patches["normal"][:, 2] = self.patches["tangent"][:, 0] = 1.0
        self.desired = np.ones(len(at))
        self.curves, self.curve, self.arc = no_boundary(), np.zeros(len(at), np.int64), np.zeros(len(at))
        self.share = np.empty((len(self.quads), 4))
        shares_of(self.quads, rim, self.share)
        order = np.argsort(self.quads.ravel(), kind="stable")
        self.of, self.degree = order // 4, np.bincount(self.quads.ravel())
        self.start = np.concatenate([[0], np.cumsum(self.degree)])

    @property
    def net(self) -> QuadNet:
        """What the kernels take."""
        at = np.full((len(self.nodes), 4), -1)
        for v, (begin, end) in enumerate(pairwise(self.start.tolist())):
            at[v, : end - begin] = self.of[begin:end]
        return QuadNet(
            self.nodes, self.quads, at, self.degree, self.held, self.curve, self.arc, self.patches, self.curves,
            self.desired, np.zeros(len(self.nodes) + len(self.quads), np.int64), np.zeros(1, np.int64),
        )  # fmt: skip

    def energy(self) -> float:
        out = np.empty(len(self.quads))
        total = energy_of_quads(self.net, self.quads, self.share, LENGTHS, ANGLES, out)
        assert total == pytest.approx(out.sum())
        return float(total)

    def settle(self, sweeps: int) -> int:
        made = settle_quads(
            self.net, self.quads, self.share, self.of, self.start, np.arange(len(self.nodes)), LENGTHS, ANGLES, sweeps, 1.5, 1e-12
        )  # fmt: skip
        return int(made)

    def try_change(
        self, quad: int, corners: np.ndarray, allowed: float = np.inf, join: tuple[int, int] = (-1, -1)
    ) -> float:
        """Give a quad other corners, with all nodes around; return by how much the energy grows."""
        room = 4 * len(self.quads)
        growth, around = try_quads(
            self.net, np.arange(len(self.nodes)), np.array([quad]), corners[None], self.at_boundary, LENGTHS, ANGLES, 1.5, 1e-12,
            *join, allowed, np.empty(room, np.int64), np.empty((room, 4)),
        )  # fmt: skip
        assert around == len(self.nodes)
        return float(growth)


def slow_energy(lattice: Lattice) -> float:
    """The energy by the words of the module: every member once, and every corner."""
    total, members = 0.0, set()
    for corners in lattice.quads.tolist():
        for k in range(4):
            before, here, after = (lattice.nodes[corners[(k + j) % 4]] for j in (-1, 0, 1))
            members.add(tuple(sorted((corners[k], corners[(k + 1) % 4]))))
            e, f = after - here, before - here
            c = e @ f / np.linalg.norm(e) / np.linalg.norm(f)
            value = c**2 + STRAIGHT_COST * c**8
            total += ANGLES * (value if np.cross(e, f)[2] > 0 else 2 * (1 + STRAIGHT_COST) - value)
    lengths = np.array([np.linalg.norm(lattice.nodes[a] - lattice.nodes[b]) for a, b in members])
    return float(total + LENGTHS * ((lengths - 1) ** 2).sum())


@pytest.mark.parametrize("amount", [0.2, 1.5])  # of which the second turns corners over
def test_every_member_counts_once_and_every_corner_does(amount: float) -> None:
    for seed in range(3):
        lattice = Lattice(seed, amount)
        assert lattice.energy() == pytest.approx(slow_energy(lattice))


@pytest.mark.parametrize("amount", [0.2, 1.5])
def test_the_slope_at_a_node_is_that_of_the_whole_energy(amount: float) -> None:
    lattice, step = Lattice(7, amount), 1e-6
    for v in np.flatnonzero(lattice.held == FREE_NODE).tolist():
        place = lattice.nodes[v].copy()
        begin, end = int(lattice.start[v]), int(lattice.start[v + 1])
        found = node_energy(
            lattice.net, lattice.quads, lattice.share, lattice.of[begin:end], v, tuple(place.tolist()), LENGTHS, ANGLES,
        )  # fmt: skip
        for axis in range(2):
            sides = []
            for sign in (1, -1):
                lattice.nodes[v] = place
                lattice.nodes[v, axis] += sign * step
                sides.append(slow_energy(lattice))
            lattice.nodes[v] = place
            assert found[1 + axis] == pytest.approx((sides[0] - sides[1]) / (2 * step), rel=1e-5, abs=1e-5)


def test_sides_and_corners_by_hand() -> None:
    assert side_energy((3.0, 0.0, 0.0), (0.0, 0.0, 0.0), 2.0) == pytest.approx((0.25, 0.5, 0.0, 0.0))
    east, north, up = (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 1.0)
    assert corner_energy(east, north, up)[0] == 0.0
    assert corner_energy(north, east, up)[0] == 2 * (1 + STRAIGHT_COST)  # turned over
    assert corner_energy(east, (0.0, 0.0, 0.0), up)[0] == 1 + STRAIGHT_COST  # no corner at all
    assert corner_energy(east, (1.0, 1.0, 0.0), up)[0] == pytest.approx(0.5 + STRAIGHT_COST / 16)


@pytest.mark.parametrize("seed", range(3))
def test_nodes_settle_to_squares_and_what_rests_stays(seed: int) -> None:
    lattice = Lattice(seed, 0.25)
    resting, before = lattice.nodes[lattice.held == RESTING_NODE].tobytes(), lattice.energy()
    assert lattice.settle(200) < 200
    assert lattice.energy() < 1e-6 * before
    assert lattice.nodes == pytest.approx(lattice.squares, abs=1e-3)
    assert lattice.nodes[lattice.held == RESTING_NODE].tobytes() == resting


def test_nodes_of_the_boundary_slide_along_it() -> None:
    lattice = Lattice(1, 0.2)
    corners = np.array([0, SIZE, (SIZE + 1) ** 2 - 1, SIZE * (SIZE + 1)])
    arc = np.arange(4.0) * SIZE
    lattice.curves = Curves(lattice.squares[corners], arc, np.array([0, 4]), np.array([4.0 * SIZE]))
    lattice.held[1:SIZE] = SLIDING_NODE
    lattice.arc[1:SIZE] = np.arange(1, SIZE) + [0.2, -0.15, 0.25]
    lattice.nodes[1:SIZE, 0] = lattice.arc[1:SIZE]
    assert lattice.settle(200) < 200
    assert lattice.nodes == pytest.approx(lattice.squares, abs=1e-3)
    assert lattice.arc[1:SIZE] == pytest.approx(lattice.nodes[1:SIZE, 0])
    assert (lattice.nodes[1:SIZE, 1] == 0.0).all()


def circle(points: int = 3600) -> tuple[Curves, np.ndarray]:
    """A circle of radius 1, and its points."""
    turn = 2 * np.pi * np.arange(points) / points
    places = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    return curve_of(places), places


def sliding(
    nodes: np.ndarray, held: np.ndarray, curve: np.ndarray, arc: np.ndarray, curves: Curves, desired: float = 1.0
) -> QuadNet:
    """Nodes on curves, whose quads do not matter."""
    count = len(nodes)
    return QuadNet(
        nodes, np.zeros((0, 4), np.int64), np.full((count, 4), -1), np.zeros(count, np.int64), held, curve, arc,
        np.zeros(count, SURFACE_PATCH), curves, np.full(count, desired), np.zeros(count, np.int64), np.zeros(1, np.int64),
    )  # fmt: skip


@pytest.mark.parametrize("degrees", [5, 40, 90])
def test_the_sag_of_a_member_is_that_of_an_arc_over_its_chord(degrees: int) -> None:
    curves, places = circle()
    a, b = places[100], places[100 + 10 * degrees]
    way = 10 * degrees * float(curves.total[0]) / len(places)
    found = sag_of(curves, 0, float(curves.arc[100]), way, tuple(a.tolist()), tuple(b.tolist()), 0.5)
    assert found == pytest.approx((1 - np.cos(np.radians(degrees / 2))) / 0.5, rel=1e-3)


def test_the_way_to_a_node_is_the_shorter_one_and_none_where_it_is_not_near_on_the_curve() -> None:
    curves, places = circle()
    total, step = float(curves.total[0]), 20
    nodes = places[[0, step, len(places) - step, step, step, len(places) // 2]]
    arc = curves.arc[[0, step, len(places) - step, 0, step, len(places) // 2]].copy()
    held, curve = (
        np.array([SLIDING_NODE, SLIDING_NODE, SLIDING_NODE, RESTING_NODE, SLIDING_NODE, SLIDING_NODE]),
        np.array([0, 0, 0, 0, 1, 0]),
    )

    def way(u: int, target: float = 0.1) -> float:
        return float(way_on_curve(sliding(nodes, held, curve, arc, curves), 0, 0.0, u, target))

    on = step * total / len(places)
    assert [way(1), way(2)] == pytest.approx([on, -on])
    assert way(3) == pytest.approx(on)  # a corner is looked for on the curve
    assert way(4) == 0.0  # on another curve
    assert way(5) == 0.0 and way(1, 0.99 * on / SAG_REACH) == 0.0  # too far
    nodes[3] *= 1.02
    assert way(3) == 0.0  # off the curve


def test_a_node_that_slides_by_less_than_it_may_costs_no_more_for_its_sag() -> None:
    curves, places = circle()
    quads, share = np.array([[0, 1, 2, 3]]), np.array([[1.0, 1.0, 1.0, 1.0]])
    at = np.array([0, 150, 0, len(places) - 150])
    nodes, arc = places[at].copy(), curves.arc[at].copy()
    nodes[2] = 0.0
    held, curve = np.array([SLIDING_NODE, SLIDING_NODE, FREE_NODE, SLIDING_NODE]), np.zeros(4, np.int64)

    def around(place: int) -> tuple[float, float]:
        found: tuple[float, float] = sag_around(
            sliding(nodes, held, curve, arc, curves, 0.4), quads, share, np.zeros(1, np.int64), 0,
            tuple(places[place].tolist()), float(curves.arc[place]),
        )  # fmt: skip
        return found

    cost, spare = around(0)
    assert cost == 0.0 and spare > 0.0
    for place in range(0, 3600, 3):
        if np.linalg.norm(places[place] - places[0]) < 0.4 * spare:
            assert around(place)[0] == 0.0
    assert around(90)[0] > 0.0


def test_a_trial_tells_how_the_energy_changes() -> None:
    """Of the same quads: by what settling gains. A node joined with another starts between the two and settles all the same."""
    lattice, other, joined = (Lattice(2, 0.2) for _ in range(3))
    before = lattice.energy()
    grown = lattice.try_change(0, lattice.quads[0])
    assert grown < 0 and lattice.energy() == pytest.approx(before + grown)
    other.settle(TRIAL_SWEEPS)
    assert other.energy() == pytest.approx(lattice.energy(), abs=1e-3 * before)
    middle = (SIZE + 1) * 2 + 2
    assert joined.try_change(0, joined.quads[0], join=(middle, middle + 1)) == pytest.approx(grown, abs=1e-2 * before)
    assert joined.nodes == pytest.approx(joined.squares, abs=0.1)


def test_a_trial_that_does_not_pay_leaves_no_trace() -> None:
    """A quad that is turned over has the energy of four corners more."""
    lattice = Lattice(0, 0.1)
    before = lattice.nodes.tobytes()
    assert lattice.try_change(5, lattice.quads[5][::-1].copy(), allowed=0.0) > 0.0
    assert lattice.nodes.tobytes() == before


@pytest.mark.parametrize("seed", range(4))
def test_a_sheet_stays_a_sheet_while_edges_collapse(seed: int) -> None:
    """Whatever edges are given: every edge has one triangle on the boundary and two inside, and corners stay."""
    rng, row = np.random.default_rng(seed), 7
    at = np.arange(row * row).reshape(row, row)
    low, right, up, far = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]))
    triangles = np.concatenate([np.column_stack([low, right, far]), np.column_stack([low, far, up])])
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, uses = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    ends = edges[uses == 1].ravel()
    held = np.zeros(row * row, np.int64)
    held[ends] = 1
    held[at[[0, 0, -1, -1], [0, -1, 0, -1]]] = 2
    into = np.arange(row * row)
    chosen = rng.permutation(edges)[: 20 + 15 * seed]
    collapse_edges(chosen, held, triangles, ends, into)
    left = triangles[triangles[:, 0] >= 0]
    sides = np.sort(np.concatenate([left[:, [0, 1]], left[:, [1, 2]], left[:, [2, 0]]]), axis=1)
    found, uses = np.unique(sides, axis=0, return_counts=True)
    assert (sides[:, 0] < sides[:, 1]).all() and set(uses.tolist()) <= {1, 2}
    assert len(np.unique(left)) - len(found) + len(left) == 1 and len(left) < len(triangles)
    chain = np.sort(ends[ends >= 0].reshape(-1, 2), axis=1)
    assert sorted(map(tuple, chain.tolist())) == sorted(map(tuple, found[uses == 1].tolist()))
    assert (into[held == 2] == np.flatnonzero(held == 2)).all()
    assert set(np.unique(left).tolist()) == set(np.flatnonzero(into == np.arange(len(into))).tolist())
