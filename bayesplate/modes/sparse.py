"""Several sparse matrices on one pattern, so that weighted sums of them are sums of stored values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def on_one_pattern(
    matrices: list[Any],
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """Lower triangles of several symmetric sparse matrices on the union of their patterns.

    Returns
    -------
    stored : (n_matrices, n_stored) array
        Values; a sum of matrices is the sum of them.
    indices, indptr : arrays
        The pattern, in compressed columns.
    """
    from scipy.sparse import csc_array, tril

    entries = [csc_array(tril(matrix)) for matrix in matrices]
    shape = csc_array(entries[0].shape)
    for entry in entries:
        entry.sum_duplicates()
        shape = shape + csc_array((np.ones(entry.nnz), entry.indices, entry.indptr), shape=shape.shape)
    shape.sort_indices()
    pattern = _keys(shape)
    stored = np.zeros((len(matrices), pattern.size))
    for row, entry in zip(stored, entries, strict=True):
        row[np.searchsorted(pattern, _keys(entry))] = entry.data
    return stored, shape.indices, shape.indptr


def mirrored(indices: NDArray[np.int32], indptr: NDArray[np.int32]) -> tuple[NDArray[np.intp], Any, Any]:
    """Whole matrices from their lower triangles.

    Parameters
    ----------
    indices, indptr : arrays
        The triangle's pattern, in compressed columns.

    Returns
    -------
    places : (n_whole,) array of int
        Where each value of the whole stands among those of the triangle.
    indices, indptr : arrays
        The pattern of the whole.
    """
    from scipy.sparse import coo_array, csc_array, tril

    n = indptr.size - 1
    numbers = np.arange(1, indices.size + 1, dtype=np.float64)
    lower = csc_array((numbers, indices, indptr), shape=(n, n))
    whole = csc_array(coo_array(lower) + tril(lower, -1).T)
    whole.sort_indices()
    return whole.data.astype(np.intp) - 1, whole.indices, whole.indptr


def sum_of_krons(pairs: Sequence[tuple[Any, Any]], onto_x: tuple[Any, Any], onto_y: tuple[Any, Any]) -> Any:
    """The sum of the Kronecker products of pairs of matrices along x and along y, each on other functions.

    Parameters
    ----------
    pairs : sequence of (array, array)
        Sparse or not; all first ones and all second ones of one shape.
    onto_x, onto_y : (sparse array, sparse array)
        Functions of the rows and of the columns, as columns: of a pair (A, B) it takes left' A right and the same of B.

    Returns
    -------
    sparse array
        By coordinates, none of them twice.
    """
    from scipy.sparse import coo_array

    # Small matrices: with all of one side on one pattern the sum is one product of their stored values.
    first, rows_x, columns_x = _stored_together([pair[0] for pair in pairs], *onto_x)
    second, rows_y, columns_y = _stored_together([pair[1] for pair in pairs], *onto_y)
    n_rows, n_columns = (matrix.shape[1] for matrix in onto_y)
    rows = (rows_x[:, None] * n_rows + rows_y).ravel()
    columns = (columns_x[:, None] * n_columns + columns_y).ravel()
    shape = tuple(a.shape[1] * b.shape[1] for a, b in zip(onto_x, onto_y, strict=True))
    return coo_array(((first.T @ second).ravel(), (rows, columns)), shape=shape)


def _stored_together(
    matrices: Sequence[Any], left: Any, right: Any
) -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
    """Values that are not zero in all of left' M right, (n_matrices, n_stored), with the row and column of each."""
    whole = [matrix if isinstance(matrix, np.ndarray) else matrix.toarray() for matrix in matrices]
    dense = left.T.toarray() @ np.stack(whole) @ right.toarray()
    rows, columns = np.nonzero(dense.any(axis=0))
    return dense[:, rows, columns], rows, columns


def _keys(matrix: Any) -> NDArray[np.int64]:
    """One number for each place that is stored in compressed columns, increasing."""
    n = matrix.shape[0]
    columns = np.repeat(np.arange(n, dtype=np.int64), np.diff(matrix.indptr))
    return columns * n + matrix.indices
