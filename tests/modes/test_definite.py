"""Equations with positive definite matrices: as numpy solves them, no numbers for others, and the lock given away."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest
from scipy.linalg import eigh, lapack

from bayesplate.modes.definite import definite_pencil_values, factorise, order, packed, solutions

N_DRAWS, R, N = 5, 30, 7


def definite(size: int, n: int, seed: int = 0) -> np.ndarray:
    made = np.random.default_rng(seed).standard_normal((n, size, size))
    return made @ np.swapaxes(made, 1, 2) + size * np.eye(size)


def solved(matrices: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """Solutions of A x = b for loads in columns, as numpy has them."""
    factors = packed(matrices)
    factorise(factors)
    return np.swapaxes(solutions(factors, np.swapaxes(loads, 1, 2)), 1, 2)


@pytest.mark.parametrize("r", [1, 2, R, R + 1])
def test_solutions_are_those_of_numpy_and_what_was_given_stays(r):
    matrices = definite(r, N_DRAWS)
    loads = np.random.default_rng(1).standard_normal((N_DRAWS, r, N))
    given = matrices.copy(), loads.copy()
    found = solved(matrices, loads)

    np.testing.assert_allclose(found, np.linalg.solve(matrices, loads), rtol=1e-11, atol=1e-13)
    np.testing.assert_array_equal(matrices, given[0])
    np.testing.assert_array_equal(loads, given[1])


def test_parts_of_larger_arrays_are_solved_too():
    whole = definite(R + 4, N_DRAWS)
    matrices, loads = whole[:, 4:, 4:], whole[:, 4:, :4]

    np.testing.assert_allclose(solved(matrices, loads), np.linalg.solve(matrices, loads), rtol=1e-10)


@pytest.mark.parametrize("r", [1, 2, R, R + 1])
def test_a_packed_matrix_has_each_number_once_in_one_place(r):
    matrices = definite(r, N_DRAWS)
    triangles = packed(matrices)

    assert order(triangles) == r
    for matrix, triangle in zip(matrices, triangles, strict=True):
        np.testing.assert_array_equal(np.sort(triangle), np.sort(matrix[np.tril_indices(r)]))
    np.testing.assert_array_equal(packed(2.0 * matrices[:1] + matrices[1:2]), 2.0 * triangles[:1] + triangles[1:2])


def test_what_is_not_definite_gives_no_numbers_and_the_others_stay():
    matrices, loads = definite(R, N_DRAWS), np.ones((N_DRAWS, R, N))
    expected = solved(matrices, loads)
    matrices[1] *= -1.0
    matrices[2, 0, 0] = np.nan
    found = solved(matrices, loads)

    assert np.isnan(found[[1, 2]]).all()
    np.testing.assert_array_equal(found[[0, 3, 4]], expected[[0, 3, 4]])


@pytest.mark.parametrize("is_kept", [False, True])
def test_other_threads_run_while_it_computes(is_kept):
    """How long another thread waits at most beside the time that it takes; SciPy's own, which keeps the lock, is the
    control.
    """
    matrices = definite(2000, 1)
    triangles = packed(matrices)
    factorise(np.ones((1, 1)))  # what is loaded once

    def solve() -> None:
        if is_kept:
            lapack.dposv(matrices[0].T, np.ones((2000, 1)), overwrite_a=True)  # numpy copies without the lock
        else:
            factorise(triangles)

    taken = []

    def run() -> None:
        started = time.perf_counter()
        solve()
        taken.append(time.perf_counter() - started)

    thread = threading.Thread(target=run)
    longest, last = 0.0, time.perf_counter()
    thread.start()
    while thread.is_alive():
        now = time.perf_counter()
        longest, last = max(longest, now - last), now
    longest = max(longest, time.perf_counter() - last)

    assert (longest > 0.5 * taken[0]) == is_kept


def test_eigenvalues_of_pencils_are_those_of_scipy_and_what_is_not_definite_gives_no_numbers():
    forms, matrices = definite(R, N_DRAWS, 2) - 40.0 * np.eye(R), definite(R, N_DRAWS)
    given = forms.copy(), matrices.copy()
    expected = np.stack([eigh(form, matrix, eigvals_only=True) for form, matrix in zip(forms, matrices, strict=True)])
    found = definite_pencil_values(forms, matrices)

    assert expected.min() < 0.0  # the forms need not be definite
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)
    np.testing.assert_array_equal(forms, given[0])
    np.testing.assert_array_equal(matrices, given[1])
    matrices[1] *= -1.0
    matrices[2, 0, 0] = np.nan
    found = definite_pencil_values(forms, matrices)
    assert np.isnan(found[[1, 2]]).all()
    np.testing.assert_allclose(found[[0, 3, 4]], expected[[0, 3, 4]], rtol=1e-10, atol=1e-12)
