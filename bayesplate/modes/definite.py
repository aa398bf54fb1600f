"""Solutions of equations with positive definite matrices, many at once, in half the operations of any others.

`scipy.linalg.solve` of many at once takes as long as `numpy.linalg.solve`, which does not use that they are definite,
and `scipy.linalg.lapack` keeps Python's lock while it computes, so that threads would wait for one another. The address
of LAPACK's function, which SciPy hands out to compiled code, is called through ctypes, which gives the lock away.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def definite_solutions(matrices: Floats, loads: Floats) -> Floats:
    """Solve A x = b for each matrix by its Cholesky factors.

    Parameters
    ----------
    matrices : (n_draws, r, r) array
        Symmetric.
    loads : (n_draws, r, n) array

    Returns
    -------
    (n_draws, r, n) array
        Not a number where a matrix is not positive definite.
    """
    n_draws, r, n = loads.shape
    factors = np.array(matrices, order="C")  # LAPACK writes over them
    solutions = np.array(np.swapaxes(loads, 1, 2), order="C")  # and over these, column by column
    sizes = [ctypes.byref(ctypes.c_int(size)) for size in (r, n)]
    fault = ctypes.c_int()
    solve, first_factor, first_solution = _dposv(), factors.ctypes.data, solutions.ctypes.data
    for i in range(n_draws):
        factor, solution = first_factor + i * factors.strides[0], first_solution + i * solutions.strides[0]
        solve(b"L", sizes[0], sizes[1], factor, sizes[0], solution, sizes[0], ctypes.byref(fault))
        if fault.value:
            solutions[i] = np.nan
    return np.swapaxes(solutions, 1, 2)


@lru_cache(maxsize=1)
def _dposv() -> Callable[..., None]:
    """LAPACK's dposv(uplo, n, nrhs, a, lda, b, ldb, info), all by reference."""
    from scipy.linalg import cython_lapack

    name_of = ctypes.PYFUNCTYPE(ctypes.c_char_p, ctypes.py_object)(("PyCapsule_GetName", ctypes.pythonapi))
    of_capsule = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)
    pointer_of = of_capsule(("PyCapsule_GetPointer", ctypes.pythonapi))
    capsule = cython_lapack.__pyx_capi__["dposv"]
    function = ctypes.CFUNCTYPE(None, ctypes.c_char_p, *[ctypes.c_void_p] * 7)
    return function(pointer_of(capsule, name_of(capsule)))
