"""Corners in which ridges meet keep a node of their own beside another ridge; where one is moved, that is said with the place."""

from itertools import pairwise

import numpy as np
import pytest

import scantruss as st
from scantruss.attempts.moved_corners import moved_corners
from scantruss.boundary.find import find_boundary
from scantruss.constraints.find import find_constraints
from scantruss.constraints.ridge_ends import Ridge
from scantruss.grid.line_sets import RIDGE, LineSet
from scantruss.surface.samples import sample_surface

SLOPE = 0.75  # of a hip roof
TOP = 2.4  # height of a flat dormer in front of it, whose rear corner lies beside the hip


def roof_with_dormer(beside: float, seed: int = 5) -> np.ndarray:
    """The front of a hip roof with its right hip, and a dormer from x = 5 to `beside` that hip at its rear corner."""
    random, rear = np.random.default_rng(seed), TOP / SLOPE
    left, right = 12.8 - np.sqrt(2.0) * beside - 3.0, 12.8 - np.sqrt(2.0) * beside
    x, y = random.uniform(6.0, 16.0, 60_000), random.uniform(0.0, 8.0, 60_000)
    z = SLOPE * np.minimum.reduce([16.0 - x, y, 8.0 - y])
    points = np.column_stack([x, y, z])
    points = points[~((x > left) & (x < right) & (y > 1.2) & (z < TOP) & (y < 4.0))]
    across = random.uniform(left, right, 7_000)
    flat = np.column_stack([across, random.uniform(1.2, rear, 7_000), np.full(7_000, TOP)])
    front = np.column_stack([across, np.full(7_000, 1.2), random.uniform(1.2 * SLOPE, TOP, 7_000)])
    deep, high = random.uniform(1.2, rear, 7_000), random.uniform(1.2 * SLOPE, TOP, 7_000)
    over = high > SLOPE * deep
    sides = [np.column_stack([np.full(over.sum(), side), deep[over], high[over]]) for side in (left, right)]
    points = np.concatenate([points, flat[:3500], front[:2600], *(side[:900] for side in sides)])
    points = points[np.unique(np.floor(points / 0.07), axis=0, return_index=True)[1]]
    return points + random.normal(0.0, 0.004, points.shape)


@pytest.mark.parametrize("length", [0.714, 0.8])
def test_a_corner_beside_a_ridge_is_a_node_of_its_own(length: float) -> None:
    """It lies .4 members from the hip, onto which it was drawn with the three edges that end in it."""
    cloud, settings = st.PointCloud.from_array(roof_with_dormer(0.28)), st.Settings(length=length)
    samples, boundary = find_boundary(sample_surface(cloud, settings), settings)
    stops = find_constraints(samples, boundary, settings)[1].lines.stops + samples.origin
    right = 12.8 - np.sqrt(2.0) * 0.28
    assert np.linalg.norm(stops - [right, TOP / SLOPE, TOP], axis=1).min() < 0.1 * length


def row(a: tuple[float, float], b: tuple[float, float]) -> Ridge:
    places = np.linspace(a, b, 21)
    return Ridge(np.column_stack([places, np.zeros(21)]), sharp=True)


@pytest.mark.parametrize("moved", [0.0, 0.2, 0.4])
def test_a_corner_that_is_moved_is_said(moved: float) -> None:
    """Two ridges meet `moved` members beside the node in which the chains along them meet."""
    count = 9
    nodes = np.array([(x, y, 0.0) for x in range(count) for y in range(count)], float)
    number = np.arange(count * count).reshape(count, count)
    low, high = number[:-1, :-1], number[1:, 1:]
    triangles = np.concatenate(
        [
            np.stack([low, number[1:, :-1], high], axis=-1).reshape(-1, 3),
            np.stack([low, high, number[:-1, 1:]], axis=-1).reshape(-1, 3),
        ]
    )
    chains = [number[1:5, 4], number[4, 4:8]]
    sets = tuple(LineSet(f"ridge {k}", RIDGE, chain) for k, chain in enumerate(chains, 1))
    lines = np.array([pair for chain in chains for pair in pairwise(chain.tolist())])
    grid = st.Grid(
        nodes, triangles, fixed=np.zeros(len(nodes), np.bool_), origin=np.zeros(3), lines=lines, line_sets=sets
    )
    place = (4.0 + moved, 4.0 - moved / 8.0)
    found = moved_corners(grid, [row((1.0, 4.0), place), row(place, (4.0, 7.0))], 1.0)
    assert len(found) == (moved > 0.25)
    for away, where in found:
        assert away == pytest.approx(moved, rel=0.02) and np.allclose(where[:2], place)
    assert not moved_corners(grid, [row((1.0, 4.0), place)], 1.0)  # one ridge makes no corner
    aside = row(place, (7.0, 1.0))  # which the grid does not follow
    assert not moved_corners(grid, [row((1.0, 4.0), place), aside], 1.0)
