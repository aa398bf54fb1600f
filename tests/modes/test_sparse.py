"""Symmetric matrices on one pattern, each a sum of Kronecker products."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest
from scipy.sparse import csc_array, csr_array

from bayesplate.modes.sparse import Entries, Kron, lower_triangles, mirrored


def thin(rng, *shape):
    return rng.standard_normal(shape) * (rng.uniform(size=shape) < 0.3)


@pytest.mark.parametrize("held_as", [csr_array, np.asarray])
@pytest.mark.parametrize("n_matrices", [1, 2, 5])
def test_matrices_between_other_functions(n_matrices, held_as):
    """Each matrix has a pattern of its own, and the rows have other functions than the columns."""
    rng = np.random.default_rng(n_matrices)
    matrices, left, right = thin(rng, n_matrices, 6, 7), thin(rng, 6, 4), thin(rng, 7, 3)
    found = Entries.of([held_as(one) for one in matrices]).between(csr_array(left), csr_array(right))

    whole = np.zeros((n_matrices, *found.shape))
    whole[:, found.rows, found.columns] = found.values
    assert whole == pytest.approx(left.T @ matrices @ right, abs=1e-14)
    assert np.abs(whole).max() > 0.1
    assert found.values.any(axis=0).all()


@pytest.mark.parametrize("per_node", [1, 2])
def test_triangles_of_sums_of_kronecker_products_are_whole_matrices_again(per_node):
    """Of one, two and three parts, some in the same place, one wholly above the diagonal's block of its columns."""
    rng = np.random.default_rng(5)
    shapes = (3, 4), (2, 5)
    n = 3 * 4 + 2 * 5

    def symmetric(n_pairs, first):
        sides = [[one + one.T for one in thin(rng, n_pairs, size, size)] for size in shapes[first]]
        start = 12 * first
        return Kron(*map(Entries.of, sides), (start, start)), sum(map(np.kron, *sides))

    def coupling(n_pairs):
        sides = [list(thin(rng, n_pairs, rows, columns)) for columns, rows in zip(*shapes, strict=True)]
        return Kron(*map(Entries.of, sides), (12, 0)), sum(map(np.kron, *sides))

    matrices, expected = [], []
    for kinds in ("a", "ab", "aac", "cc", "bcb"):
        parts, whole = [], np.zeros((n, n))
        for kind in kinds:
            part, block = coupling(3) if kind == "c" else symmetric(2, "ab".index(kind))
            parts.append(part)
            rows, columns = (slice(start, start + size) for start, size in zip(part.start, block.shape, strict=True))
            whole[rows, columns] += block
            if kind == "c":
                whole[columns, rows] += block.T
        matrices.append(parts)
        expected.append(whole)
    nodes = np.arange(n) // per_node
    stored, indices, indptr = lower_triangles(matrices, nodes)
    places, rows, starts = mirrored(indices, indptr)

    assert stored.shape[1] < len(places)
    columns = [rows[start:end].tolist() for start, end in pairwise(starts)]
    assert all(columns[i] == columns[j] for i, j in combinations(range(n), 2) if nodes[i] == nodes[j])
    assert per_node > 1 or len(places) < n * n
    for values, whole in zip(stored, expected, strict=True):
        found = csc_array((values[places], rows, starts), shape=(n, n))
        assert found.has_canonical_format
        assert found.toarray() == pytest.approx(whole, abs=1e-14)
