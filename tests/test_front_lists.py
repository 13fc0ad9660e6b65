"""The lists of the front hold together from the start to the last gap, so that it ends; also where ridges leave a scan askew."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as strategies
from marks import compiled_only
from small_clouds import HandFront, sheet

import scantruss as st
from scantruss import front as driver
from scantruss import slits
from scantruss.kernels import advance, gaps
from scantruss.kernels import front as lists


def assert_lists_hold(front):
    """`next` is one to one, `previous` its inverse, each segment begins where the one before it ends, the lists of nodes are whole."""
    count = int(front.count[lists.SEGMENTS])
    alive = np.flatnonzero(front.state[:count] != lists.GONE)
    following = front.next[alive]
    assert sorted(following.tolist()) == alive.tolist()
    assert (front.previous[following] == alive).all() and (front.tail[following] == front.head[alive]).all()
    listed = []
    for node in range(int(front.count[lists.NODES])):
        s = int(front.out[node])
        while s >= 0 and len(listed) <= len(alive):
            assert front.tail[s] == node
            listed.append(s)
            s = int(front.out_next[s])
    assert sorted(listed) == alive.tolist()


def number_alive(front):
    return int((front.state[: front.count[lists.SEGMENTS]] != lists.GONE).sum())


def roof(name, count=15_000, noise=0.02, seed=0):
    """Points of a roof 72 wide with edges: a groin vault steep at its corners, a sawtooth roof, a folded plate."""
    rng = np.random.default_rng([seed, len(name)])
    x, y = rng.uniform(-36, 36, (2, count))
    share = (x / 24) % 1
    z = {
        "groin": lambda: np.maximum(np.sqrt(36.5**2 - x * x), np.sqrt(36.5**2 - y * y)),
        "sawtooth": lambda: 12 * np.where(share < 0.75, share / 0.75, (1 - share) / 0.25),
        "folded": lambda: 12 * np.abs((x / 12) % 2 - 1),
    }[name]()
    return np.column_stack([x, y, z]) + noise * rng.normal(size=(count, 3))


ASKEW = [  # with these a line leaves the rim across it
    ("groin", 6.0, 0.02, 0),
    ("groin", 6.0, 0.02, 1),
    ("groin", 5.0, 0.02, 0),
    ("sawtooth", 4.0, 0.02, 0),
    ("sawtooth", 5.0, 0.1, 1),
    ("folded", 5.0, 0.24, 1),
    ("folded", 4.0, 0.24, 0),
]


@compiled_only
@pytest.mark.parametrize(("name", "length", "noise", "seed"), ASKEW)
def test_the_lists_hold_from_the_start_to_the_last_gap(name, length, noise, seed, monkeypatch):
    """Looked at after the start, after each slice of the front, and at each gap, where the number of segments falls."""
    cloud = st.PointCloud.from_array(roof(name, noise=noise, seed=seed))
    own = st.Settings(length=length)
    boundary = st.find_boundary(cloud, own)
    start, step, find = driver.start_front, advance.advance, gaps.gap_loop
    left = []

    def started(*given):
        front = start(*given)
        assert_lists_hold(front)
        return front

    def stepped(surface, front, numbers, budget):
        status = step(surface, front, numbers, budget)
        assert_lists_hold(front)
        return status

    def found(front, s, loop):
        assert_lists_hold(front)
        left.append(number_alive(front))
        return find(front, s, loop)

    monkeypatch.setattr(driver, "start_front", started)
    monkeypatch.setattr(driver, "BUDGET", 100)
    monkeypatch.setattr(advance, "advance", stepped)
    monkeypatch.setattr(gaps, "gap_loop", found)
    try:
        st.advance_front(cloud, boundary, own)
    except st.FrontError as error:
        assert "a line could not be kept" in str(error)
    assert all(after < before for before, after in zip(left, left[1:], strict=False))


@compiled_only
@pytest.mark.parametrize("effort", ["quick", "normal"])
@pytest.mark.parametrize(("name", "length", "noise", "seed"), ASKEW[::2])
def test_a_roof_with_edges_has_a_right_grid(name, length, noise, seed, effort):
    grid = st.grid_from_points(roof(name, noise=noise, seed=seed), st.Settings(length=length, effort=effort))
    assert grid.certificate.passed
    assert (grid.topology.components, grid.topology.boundary_loops, grid.topology.euler) == (1, 1, 1)


@given(strategies.lists(strategies.integers(0, 23), min_size=1, max_size=6), strategies.booleans())
def test_lines_in_any_directions_leave_a_front_that_holds(turns, on_rim):
    """Lines from one node in any directions, several in the same and some across the rim."""
    rim = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0)]
    hand = HandFront(rim, points=PLATE)
    front = hand.front
    node = 0 if on_rim else hand.add_node(1.5, 1.5)
    place = front.nodes[node]
    for i, turn in enumerate(turns):
        angle = turn * np.pi / 12
        far = hand.add_node(place[0] + (0.5 + 0.1 * i) * np.cos(angle), place[1] + (0.5 + 0.1 * i) * np.sin(angle))
        slits.add_half_edges(front, [node, far])
        slits.link_around(front, far)
    slits.link_around(front, node)
    assert_lists_hold(front)
    loop = np.empty(64, np.int64)
    assert 0 < gaps.gap_loop(front, int(front.out[node]), loop) <= number_alive(front)


@given(strategies.permutations(range(1, 12)))
def test_lines_inside_the_rim_are_followed_in_the_order_in_which_they_stand(turns):
    """From the rim the front goes out and back along each line, the one that stands farthest around first."""
    hand = HandFront([(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (-3.0, 0.0)], points=PLATE)
    front = hand.front
    ends = {}
    for turn in turns[:5]:
        angle = turn * np.pi / 12
        ends[turn] = hand.add_node(np.cos(angle), np.sin(angle))
        slits.add_half_edges(front, [0, ends[turn]])
        slits.link_around(front, ends[turn])
    slits.link_around(front, 0)
    s = next(s for s in hand.segments[0] if front.head[s] == 0)
    met = []
    for _ in ends:
        s = int(front.next[s])
        met.append(int(front.head[s]))
        s = int(front.next[s])
    assert met == [ends[turn] for turn in sorted(ends, reverse=True)]
    assert front.next[s] == hand.segments[0][0]


PLATE = sheet(8.0, 8.0, 0.25)
