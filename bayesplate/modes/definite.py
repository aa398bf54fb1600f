"""Equations and eigenvalues with positive definite matrices, many at once, in half the operations of any others.

`scipy.linalg.solve` of many at once takes as long as `numpy.linalg.solve`, which does not use that they are definite,
and `scipy.linalg.eigh` takes pencils one by one.
"""

from __future__ import annotations

import ctypes
import math

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.lapack import integers, lapack

Floats = NDArray[np.float64]


def packed(matrices: Floats) -> Floats:
    """The lower triangles of symmetric matrices, each folded to a rectangle without gaps.

    Sums of matrices are the sums of their triangles, at half of the operations. LAPACK computes with them at full
    speed in this form (Gustavson and others, ACM Transactions on Mathematical Software 37, 2010, 18).

    Parameters
    ----------
    matrices : (n, r, r) array

    Returns
    -------
    (n, r (r + 1) / 2) array
    """
    r = matrices.shape[-1]
    whole = np.array(matrices, order="C")
    triangles = np.empty((len(whole), r * (r + 1) // 2))
    (size,), fault, pack = integers(r), ctypes.c_int(), lapack("dtrttf")
    for matrix, triangle in zip(_addresses(whole), _addresses(triangles), strict=True):
        pack(b"N", b"L", size, matrix, size, triangle, ctypes.byref(fault))
    return triangles


def order(triangles: Floats) -> int:
    """Rows of each matrix that is packed, r of r (r + 1) / 2 numbers."""
    return (math.isqrt(8 * triangles.shape[-1] + 1) - 1) // 2


def factorise(triangles: Floats) -> None:
    """Write Cholesky factors over packed matrices, and no numbers where one is not positive definite.

    Parameters
    ----------
    triangles : (n_draws, r (r + 1) / 2) array
        One behind the other in memory.
    """
    (size,), fault, factorise_one = integers(order(triangles)), ctypes.c_int(), lapack("dpftrf")
    for i, triangle in enumerate(_addresses(triangles)):
        factorise_one(b"N", b"L", size, triangle, ctypes.byref(fault))
        if fault.value:
            triangles[i] = np.nan


def solutions(factors: Floats, loads: Floats) -> Floats:
    """Solve A x = b for each matrix by its factors.

    Parameters
    ----------
    factors : (n_draws, r (r + 1) / 2) array
        What `factorise` wrote.
    loads : (n_draws, n, r) array
        Each row a right-hand side.

    Returns
    -------
    (n_draws, n, r) array
        Each row a solution; not numbers where a matrix is not positive definite.
    """
    found = np.array(loads, order="C")  # LAPACK writes over it
    size, n_loads = integers(loads.shape[2], loads.shape[1])
    fault, solve = ctypes.c_int(), lapack("dpftrs")
    for factor, solution in zip(_addresses(factors), _addresses(found), strict=True):
        solve(b"N", b"L", size, n_loads, factor, solution, size, ctypes.byref(fault))
    return found


def definite_pencil_values(forms: Floats, definite: Floats) -> Floats:
    """Eigenvalues x of each pencil A v = x B v with a positive definite B, increasing.

    Parameters
    ----------
    forms : (n_draws, r, r) array
        A; symmetric.
    definite : (n_draws, r, r) array
        B; symmetric.

    Returns
    -------
    (n_draws, r) array
        Not a number where B is not positive definite.
    """
    factors, reduced = np.array(definite, order="C"), np.array(forms, order="C")
    size, kind = integers(factors.shape[1], 1)
    fault, factorise, reduce = ctypes.c_int(), lapack("dpotrf"), lapack("dsygst")
    is_definite = np.ones(len(factors), dtype=np.bool_)
    for i, (factor, form) in enumerate(zip(_addresses(factors), _addresses(reduced), strict=True)):
        factorise(b"L", size, factor, size, ctypes.byref(fault))
        is_definite[i] = not fault.value and np.isfinite(factors[i, -1, -1])
        if is_definite[i]:
            reduce(kind, b"L", size, form, size, factor, size, ctypes.byref(fault))
        else:
            reduced[i] = np.eye(len(reduced[i]))
    values = np.linalg.eigvalsh(reduced, UPLO="U")  # lower by columns is upper by rows
    return np.where(is_definite[:, None], values, np.nan)


def _addresses(matrices: Floats) -> range:
    first, step = matrices.ctypes.data, matrices.strides[0]
    return range(first, first + len(matrices) * step, step)
