"""Equations in a band: against a dense solver, in any order of the unknowns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, tril

from bayesplate.modes.banded import Band, BandFactor

N_DOF = 30


def banded(seed):
    """A positive definite matrix of five diagonals, its unknowns shuffled, and the order that undoes it."""
    rng = np.random.default_rng(seed)
    whole = sum(np.diag(rng.uniform(-1.0, 1.0, N_DOF - k), -k) for k in range(1, 3))
    whole = whole + whole.T + 6.0 * np.eye(N_DOF)
    shuffled = rng.permutation(N_DOF)
    return whole[np.ix_(shuffled, shuffled)], np.argsort(shuffled)


def factor_of(matrix, order):
    lower = csc_array(tril(csc_array(matrix)))
    lower.sort_indices()
    return BandFactor(Band.of(lower.indices, lower.indptr, order), lower.data)


@pytest.mark.parametrize("seed", range(3))
def test_solutions_are_those_of_a_dense_solver(seed):
    matrix, order = banded(seed)
    loads = np.random.default_rng(9).standard_normal((N_DOF, 4))
    expected = np.linalg.solve(matrix, loads)
    ordered, as_it_is = factor_of(matrix, order), factor_of(matrix, np.arange(N_DOF))
    for factor in (ordered, as_it_is):
        np.testing.assert_allclose(factor.solve(loads), expected, rtol=1e-11, atol=1e-13)
    assert ordered.band.width == 2 < as_it_is.band.width


@pytest.mark.parametrize("off", [-7.0, np.nan])
def test_what_is_not_positive_definite_is_refused(off):
    matrix, order = banded(0)
    matrix[3, 3] = off
    with pytest.raises(np.linalg.LinAlgError, match="positive definite"):
        factor_of(matrix, order)
