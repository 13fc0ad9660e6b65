"""3-vectors as tuples agree with numpy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typed import xyz

from scantruss.kernels.geometry.vectors import (
    across,
    along,
    cross,
    dot,
    norm,
    row,
    smallest_eigenvector,
    subtract,
    unit,
)
from scantruss.scan.vectors import pairs_within

pytestmark = pytest.mark.kernels

number = st.floats(-1e3, 1e3).map(lambda x: x if abs(x) > 1e-9 else 0.0)
vector = st.tuples(number, number, number)


@given(vector, vector, number)
def test_arithmetic_is_that_of_numpy(a: tuple[float, float, float], b: tuple[float, float, float], t: float) -> None:
    u, v = np.array(a), np.array(b)
    assert np.allclose(subtract(a, b), u - v)
    assert np.allclose(along(a, t, b), u + t * v)
    assert np.isclose(dot(a, b), u @ v)
    assert np.allclose(cross(a, b), np.cross(u, v))
    assert np.isclose(norm(a), np.linalg.norm(u))
    assert row(np.stack([v, u]), 1) == a


@given(vector)
def test_unit_has_length_one_and_keeps_the_direction(a: tuple[float, float, float]) -> None:
    length = np.linalg.norm(a)
    if length > 1e-100:
        assert np.allclose(np.array(unit(a)) * length, a)
        assert np.isclose(np.linalg.norm(unit(a)), 1)


def test_the_zero_vector_stays_zero() -> None:
    assert unit((0.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
    assert norm((0.0, 0.0, 0.0)) == 0.0


@given(vector)
def test_across_is_a_unit_vector_at_right_angles(a: tuple[float, float, float]) -> None:
    if np.linalg.norm(a) > 1e-6:
        n = unit(a)
        u = across(n)
        assert np.isclose(np.linalg.norm(u), 1)
        assert abs(dot(u, n)) < 1e-12
        assert across(n) == u


@pytest.mark.parametrize("axis", range(3))
def test_across_works_along_every_axis(axis: int) -> None:
    n = xyz(axis == k for k in range(3))
    assert np.isclose(norm(across(n)), 1) and dot(across(n), n) == 0


def assert_smallest(matrix: np.ndarray) -> None:
    """The vector is a unit vector, and its Rayleigh quotient is the smallest eigenvalue of numpy."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = matrix.tolist()
    v = np.array(smallest_eigenvector(xx, xy, xz, yy, yz, zz))
    values = np.linalg.eigvalsh(matrix)
    assert np.isclose(np.linalg.norm(v), 1)
    assert v @ matrix @ v <= values[0] + 1e-7 * max(np.abs(values).max(), 1e-300)


@given(st.lists(vector, min_size=1, max_size=12))
def test_smallest_eigenvector_agrees_with_numpy(rows: list[tuple[float, float, float]]) -> None:
    points = np.array(rows)
    points -= points.mean(axis=0)
    assert_smallest(points.T @ points)


@given(st.tuples(number, number, number), st.integers(0, 50))
def test_smallest_eigenvector_of_a_turned_diagonal_matrix(values: tuple[float, float, float], seed: int) -> None:
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    matrix = turn @ np.diag(values) @ turn.T
    assert_smallest((matrix + matrix.T) / 2)


def test_smallest_eigenvector_where_eigenvalues_coincide() -> None:
    assert_smallest(np.diag([2.0, 2.0, 2.0]))
    assert_smallest(np.diag([2.0, 2.0, 1.0]))
    assert_smallest(np.diag([1.0, 1.0, 2.0]))  # points on a line: any normal of it
    assert smallest_eigenvector(0.0, 0.0, 0.0, 0.0, 0.0, 0.0) == (0.0, 0.0, 1.0)


@pytest.mark.parametrize("line", [(1, 0, 0), (0, 1, -1), (1, -1, 0), (1, 1, -2), (1, 1, 1), (-3, 2, 1)])
@pytest.mark.parametrize("length", [1.0, 1 / 3, 0.7, 123.4])
def test_smallest_eigenvector_of_points_on_a_line_is_across_it(line: tuple[float, float, float], length: float) -> None:
    points = np.array([[-1.0], [0.0], [1.0]]) * np.array(line) * length
    assert_smallest(points.T @ points)


@pytest.mark.parametrize("scale", [1e-190, 1e-90, 1e-12, 1.0, 1e12, 1e90, 1e190])
def test_smallest_eigenvector_does_not_depend_on_the_scale(scale: float) -> None:
    rng = np.random.default_rng(1)
    points = rng.normal(size=(20, 3)) * [1.0, 0.7, 0.1]
    matrix = points.T @ points
    expected = np.linalg.eigh(matrix)[1][:, 0]
    m = matrix * scale
    found = np.array(smallest_eigenvector(m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2]))
    assert abs(found @ expected) > 1 - 1e-12


@pytest.mark.parametrize("count", [0, 1, 2, 60])
@pytest.mark.parametrize("reach", [0.0, 0.2, 3.0])
def test_pairs_within_a_distance_are_those_of_all_pairs(count: int, reach: float) -> None:
    places = np.random.default_rng(count).random((count, 3))
    places[: count // 3, 0] = 0.5  # many with one coordinate
    places[count // 2 :] = places[: count - count // 2]  # and some that coincide
    near = [
        (i, j) for i in range(count) for j in range(i + 1, count) if ((places[j] - places[i]) ** 2).sum() <= reach**2
    ]
    assert list(zip(*(found.tolist() for found in pairs_within(places, reach)), strict=True)) == near
