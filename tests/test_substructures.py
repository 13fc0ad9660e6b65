"""Laws of the factorization by substructures: it solves, counts negative eigenvalues and does not depend on how a matrix is divided."""

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.sparse import csc_matrix, identity
from scipy.sparse import random as random_sparse
from scipy.sparse.linalg import spsolve
from small_grids import dome

from scantruss.runtime.blas import _libraries, one_blas_thread
from scantruss.structure import substructures
from scantruss.structure.statics import factor_stiffness
from scantruss.structure.substructures import SingularError, Substructures, factor_by_parts
from scantruss.structure.truss import Truss

SEEDS = some.integers(0, 10**6)


def symmetric(rng: np.random.Generator, count: int, *, definite: bool = True, dense_row: bool = False) -> csc_matrix:
    """Return a sparse symmetric matrix whose diagonal outweighs the rest: positive, or with signs at random."""
    half = random_sparse(count, count, min(1.0, 2 / count), random_state=rng, data_rvs=rng.standard_normal).toarray()
    if dense_row:
        half[rng.integers(count)] = rng.standard_normal(count)
    made = half + half.T
    np.fill_diagonal(made, 0.0)
    signs = np.ones(count) if definite else rng.choice([-1.0, 1.0], count)
    return csc_matrix(made + np.diag(signs * (np.abs(made).sum(axis=1) + rng.uniform(0.1, 1.0, count))))


def random_cuts(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return the first displacement of parts of any sizes, and their end."""
    return np.unique(np.r_[0, rng.integers(0, count + 1, rng.integers(0, 2 + count // 3)), count])


@pytest.mark.kernels
@settings(max_examples=60, deadline=None)
@given(SEEDS, some.integers(1, 60), some.booleans(), some.booleans())
def test_it_solves_and_counts_negative_eigenvalues(seed: int, count: int, definite: bool, dense_row: bool) -> None:
    """Against scipy and the eigenvalues, however the matrix is divided; also of several pieces, and with a row that meets all others."""
    rng = np.random.default_rng(seed)
    matrix = symmetric(rng, count, definite=definite, dense_row=dense_row)
    loads = rng.standard_normal((count, 3))
    factor = factor_by_parts(matrix, random_cuts(rng, count))
    found = factor.solve(loads)
    assert found == pytest.approx(spsolve(matrix, loads).reshape(found.shape), abs=1e-9)
    assert np.abs(matrix @ found - loads).max() < 1e-11 * np.abs(loads).max()
    assert np.array_equal(factor.solve(loads[:, 1]), found[:, 1])
    assert factor.negative == (np.linalg.eigvalsh(matrix.toarray()) < 0).sum()
    assert np.array_equal(np.sign(factor.pivots), factor.signs)
    assert np.log(np.abs(factor.pivots)).sum() == pytest.approx(np.linalg.slogdet(matrix.toarray())[1])


@pytest.mark.kernels
@pytest.mark.parametrize("count", [1, 5, 90, 200])
def test_a_block_that_is_not_positive_is_halved_until_it_can_be_factored(count: int) -> None:
    """One part, larger than what is factored with signs at once."""
    rng = np.random.default_rng(count)
    matrix = symmetric(rng, count, definite=False)
    factor = factor_by_parts(matrix, np.array([0, count]))
    own = np.tril(factor.values.reshape(count, count).T)
    assert own @ np.diag(factor.signs) @ own.T == pytest.approx(matrix.toarray(), abs=1e-10)
    assert factor.negative == (np.linalg.eigvalsh(matrix.toarray()) < 0).sum()


@pytest.mark.parametrize("joints", ["rigid", "pinned"])
@pytest.mark.parametrize("pieces", [1, 2])
def test_structures_are_solved_as_by_scipy(joints: str, pieces: int) -> None:
    """Grids in their nested dissection, whole ones and two that stand apart; the second time to the byte."""
    grid = dome(9, 40.0)
    truss = Truss.from_grid(grid, scale=50, supports="boundary", loads="self", joints=joints)
    if pieces == 2:
        apart = truss.nodes + [3 * np.ptp(truss.nodes[:, 0]), 0, 0]
        truss = truss.replace(
            nodes=np.concatenate([truss.nodes, apart]),
            members=np.concatenate([truss.members, truss.members + len(truss.nodes)]),
            supports=np.tile(truss.supports, (2, 1)),
            **{
                name: np.concatenate([getattr(truss, name)] * 2)
                for name in ("section_of", "end_stiffness", "member_normals")
            },
        )
    factored, again = factor_stiffness(truss), factor_stiffness(truss)
    matrix = csc_matrix(factored.stiffness[factored.free][:, factored.free])
    loads = np.random.default_rng(3).standard_normal((len(factored.free), 2))
    found = factored.solve(loads)
    assert found == pytest.approx(spsolve(matrix, loads), rel=1e-7, abs=1e-9 * np.abs(found).max())
    assert found.tobytes() == again.solve(loads).tobytes()
    assert factored.first[0] == 0 and factored.first[-1] == len(factored.free)


@pytest.mark.parametrize("many", [False, True])
def test_a_nil_pivot_is_refused(many: bool) -> None:
    """Alone, and where nothing is left of a later part once the others are condensed on it."""
    matrix = np.kron(np.eye(30 if many else 1), np.array([[1.0, -1.0], [-1.0, 1.0]]))
    with pytest.raises(SingularError):
        factor_by_parts(csc_matrix(matrix), np.arange(len(matrix) + 1))


def test_a_matrix_of_another_pattern_is_refused() -> None:
    parts = Substructures.of(csc_matrix(identity(4)), np.array([0, 2, 4]))
    with pytest.raises(ValueError, match="pattern"):
        parts.factor(csc_matrix(np.ones((4, 4)) + 4 * np.eye(4)))
    assert parts.factor(csc_matrix(2 * identity(4))).solve(np.ones(4)) == pytest.approx(np.full(4, 0.5))


def test_blas_has_one_thread_while_it_is_asked_for() -> None:
    """In any thread, also where several ask at once; as many as before in the end."""

    def threads() -> list[int]:
        return [library["num_threads"] for library in _libraries().info() if library["user_api"] == "blas"]

    before, seen = threads(), []

    def ask(_: int) -> None:
        with one_blas_thread(), one_blas_thread():
            seen.append(threads())
            time.sleep(0.01)  # so that the others come meanwhile
            seen.append(threads())

    for asked in (map, ThreadPoolExecutor(4).map):
        list(asked(ask, range(4)))
        assert threads() == before
    assert seen == [[1] * len(before)] * 16


def test_a_larger_block_is_halved_than_is_factored_at_once() -> None:
    """So that the tests above take both ways."""
    assert 5 < substructures.SMALL_BLOCK < 90
