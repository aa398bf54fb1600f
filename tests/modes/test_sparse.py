"""Symmetric matrices on one pattern, and sums of Kronecker products."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, csr_array

from bayesplate.modes.sparse import mirrored, on_one_pattern, sum_of_krons


@pytest.mark.parametrize("held_as", [csr_array, np.asarray])
@pytest.mark.parametrize("n_pairs", [1, 2, 5])
def test_a_sum_of_kronecker_products_of_rectangular_matrices(n_pairs, held_as):
    """Each matrix has a pattern of its own, and each side other functions of the rows than of the columns."""
    rng = np.random.default_rng(n_pairs)

    def thin(*shape):
        return rng.standard_normal(shape) * (rng.uniform(size=shape) < 0.3)

    pairs = [(thin(6, 6), thin(5, 5)) for _ in range(n_pairs)]
    onto = (thin(6, 4), thin(6, 3)), (thin(5, 2), thin(5, 5))
    expected = sum(
        np.kron(onto[0][0].T @ along_x @ onto[0][1], onto[1][0].T @ along_y @ onto[1][1]) for along_x, along_y in pairs
    )
    held = [tuple(held_as(one) for one in pair) for pair in pairs]
    found = sum_of_krons(held, *(tuple(csr_array(one) for one in pair) for pair in onto))
    assert found.shape == (8, 15)
    assert found.toarray() == pytest.approx(expected, abs=1e-13)
    assert np.abs(expected).max() > 0.1


def test_lower_triangles_are_whole_matrices_again():
    rng = np.random.default_rng(5)
    whole = [one + one.T for one in (rng.standard_normal((2, 9, 9)) * (rng.uniform(size=(2, 9, 9)) < 0.2))]
    stored, indices, indptr = on_one_pattern([csr_array(one) for one in whole])
    places, rows, starts = mirrored(indices, indptr)

    assert stored.shape[1] < len(places)
    for values, one in zip(stored, whole, strict=True):
        np.testing.assert_array_equal(csc_array((values[places], rows, starts), shape=(9, 9)).toarray(), one)
