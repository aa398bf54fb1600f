"""Several sparse matrices on one pattern, so that weighted sums of them are sums of stored values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def on_one_pattern(
    matrices: list[Any],
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """Stored values of several sparse matrices on the union of their patterns, so that sums are sums of values."""
    from scipy.sparse import csc_array

    entries = [csc_array(matrix) for matrix in matrices]
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


def _keys(matrix: Any) -> NDArray[np.int64]:
    """One number for each place that is stored in compressed columns, increasing."""
    n = matrix.shape[0]
    columns = np.repeat(np.arange(n, dtype=np.int64), np.diff(matrix.indptr))
    return columns * n + matrix.indices
