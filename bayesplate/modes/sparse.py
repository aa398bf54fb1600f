"""Several symmetric sparse matrices on one pattern, so that weighted sums of them are sums of stored values.

Each is a sum of Kronecker products of small matrices along x with small ones along y.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Entries(NamedTuple):
    """Several matrices of one shape, of which only some places hold anything: the same ones in all.

    Attributes
    ----------
    values : (n_matrices, n_places) array
    rows, columns : (n_places,) array of int
        None of the places twice.
    shape : tuple of int
        Of each matrix.
    """

    values: NDArray[np.float64]
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    shape: tuple[int, int]

    @classmethod
    def of(cls, matrices: Sequence[Any]) -> Entries:
        """Those of matrices, sparse or not, at places that are not zero in all of them."""
        whole = np.stack([matrix if isinstance(matrix, np.ndarray) else matrix.toarray() for matrix in matrices])
        rows, columns = np.nonzero(whole.any(axis=0))
        return cls(whole[:, rows, columns], rows, columns, whole.shape[1:])

    def some(self, which: slice) -> Entries:
        """Some of the matrices, at places that are not zero in all of these."""
        values = self.values[which]
        held = values.any(axis=0)
        return Entries(values[:, held], self.rows[held], self.columns[held], self.shape)

    def between(self, left: Any, right: Any) -> Entries:
        """The matrices left' A right of all A, for sparse (n_rows, n_left) and (n_columns, n_right)."""
        from scipy.sparse import csr_array, kron

        onto = csr_array(kron(left, right, format="csr"))[self.rows * self.shape[1] + self.columns]
        places = np.flatnonzero(np.bincount(onto.indices, minlength=1))
        rows, columns = np.divmod(places, right.shape[1])
        values = self.values @ onto[:, places]
        return Entries(values, rows, columns, (left.shape[1], right.shape[1])).some(slice(None))


class Kron(NamedTuple):
    """A part of a matrix: the sum of the Kronecker products of each matrix along x with its own along y.

    Attributes
    ----------
    along_x, along_y : Entries
        As many matrices.
    start : tuple of int
        The row and the column of the whole where the part begins.
    """

    along_x: Entries
    along_y: Entries
    start: tuple[int, int] = (0, 0)

    @property
    def pattern(self) -> tuple[Any, ...]:
        """What tells its places from those of other parts."""
        sides = (self.along_x, self.along_y)
        return self.start, *((side.shape, side.rows.tobytes(), side.columns.tobytes()) for side in sides)

    @property
    def places(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Row and column of each product: (n_along_x, n_along_y) arrays."""
        x, y = self.along_x, self.along_y
        rows = self.start[0] + x.rows[:, None] * y.shape[0] + y.rows
        columns = self.start[1] + x.columns[:, None] * y.shape[1] + y.columns
        return rows, columns


def lower_triangles(
    matrices: Sequence[Sequence[Kron]], nodes: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int32]]:
    """Lower triangles of several symmetric matrices, each the sum of its parts, on one pattern of whole nodes.

    Where two nodes have anything in common in any matrix, each of their unknowns has a place with each, so that the
    rows of a node hold the same columns. A few of these values are zero.

    Parameters
    ----------
    matrices : sequence of sequences of Kron
        What parts have above the diagonal is left out, so that a part wholly above it need not be given.
    nodes : (size,) array of int
        Node of the mesh that each unknown, which is a row and a column of each matrix, belongs to.

    Returns
    -------
    stored : (n_matrices, n_stored) array
        Values; a sum of matrices is the sum of them.
    indices, indptr : arrays
        The pattern, in compressed columns.
    """
    size = nodes.size
    # Most parts have their places in common with those of other matrices, and these are worked out once.
    by_pattern = [_by_pattern(matrix) for matrix in matrices]
    reached, lower, keys = {}, {}, {}
    for pattern, (part, *_) in {pattern: parts for each in by_pattern for pattern, parts in each.items()}.items():
        rows, columns = part.places
        is_lower = rows >= columns
        reached[pattern] = np.flatnonzero(is_lower.any(axis=1))
        lower[pattern] = np.flatnonzero(is_lower[reached[pattern]])
        keys[pattern] = columns[is_lower] * size + rows[is_lower]
    union = _of_whole_nodes(_united(list(keys.values())), nodes)
    places = {pattern: np.searchsorted(union, each) for pattern, each in keys.items()}
    stored = np.zeros((len(matrices), union.size))
    for row, each in zip(stored, by_pattern, strict=True):
        for pattern, parts in each.items():
            along_x = np.concatenate([part.along_x.values[:, reached[pattern]] for part in parts])
            along_y = np.concatenate([part.along_y.values for part in parts])
            row[places[pattern]] += (along_x.T @ along_y).ravel()[lower[pattern]]
    columns, rows = np.divmod(union, size)
    starts = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=size))])
    return stored, rows.astype(np.int32), starts.astype(np.int32)


def _by_pattern(parts: Sequence[Kron]) -> dict[tuple[Any, ...], list[Kron]]:
    """Parts that have all their places in common."""
    found: dict[tuple[Any, ...], list[Kron]] = {}
    for part in parts:
        found.setdefault(part.pattern, []).append(part)
    return found


def _united(sets: Sequence[NDArray[np.intp]]) -> NDArray[np.intp]:
    """All numbers of some sets, increasing; `numpy.unique` takes many times as long as sorting."""
    every = np.sort(np.concatenate(sets))
    return every[np.append(True, every[1:] != every[:-1])]


def _of_whole_nodes(places: NDArray[np.intp], nodes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Places below the diagonal, column by column, of all unknowns of all pairs of nodes that have one of some."""
    from scipy.sparse import csc_array, tril

    size = nodes.size
    columns, rows = np.divmod(places, size)
    of_nodes = csc_array((np.ones(size), (np.arange(size), nodes)))
    pairs = csc_array((np.ones(places.size), (nodes[rows], nodes[columns])), shape=(of_nodes.shape[1],) * 2)
    every = csc_array(tril(of_nodes @ (pairs + pairs.T) @ of_nodes.T))
    every.sort_indices()
    return np.repeat(np.arange(size), np.diff(every.indptr)) * size + every.indices


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
