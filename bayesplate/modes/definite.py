"""Equations and eigenvalues with positive definite matrices, many at once, in half the operations of any others.

`scipy.linalg.solve` of many at once takes as long as `numpy.linalg.solve`, which does not use that they are definite,
`scipy.linalg.eigh` takes pencils one by one, and `scipy.linalg.lapack` keeps Python's lock while it computes, so that
threads would wait for one another. The addresses of LAPACK's functions, which SciPy hands out to compiled code, are
called through ctypes, which gives the lock away.
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
    r, n = loads.shape[1:]
    factors = np.array(matrices, order="C")  # LAPACK writes over them
    solutions = np.array(np.swapaxes(loads, 1, 2), order="C")  # and over these, column by column
    size, n_loads = (ctypes.byref(ctypes.c_int(number)) for number in (r, n))
    fault, solve = ctypes.c_int(), lapack("dposv")
    for i, (factor, solution) in enumerate(zip(_addresses(factors), _addresses(solutions), strict=True)):
        solve(b"L", size, n_loads, factor, size, solution, size, ctypes.byref(fault))
        if fault.value:
            solutions[i] = np.nan
    return np.swapaxes(solutions, 1, 2)


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
    size, kind = (ctypes.byref(ctypes.c_int(number)) for number in (factors.shape[1], 1))
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


_ARGUMENTS = {
    "dpbtrf": "sppppp",
    "dpbtrs": "spppppppp",
    "dposv": "sppppppp",
    "dpotrf": "spppp",
    "dsygst": "pspppppp",
}
"""Strings and pointers of the functions of LAPACK, in their order: everything is given by reference.

dposv(uplo, n, nrhs, a, lda, b, ldb, info), dpotrf(uplo, n, a, lda, info), dsygst(itype, uplo, n, a, lda, b, ldb, info);
dpbtrf(uplo, n, kd, ab, ldab, info), dpbtrs(uplo, n, kd, nrhs, ab, ldab, b, ldb, info).
"""


@lru_cache(maxsize=len(_ARGUMENTS))
def lapack(name: str) -> Callable[..., None]:
    """A function of LAPACK that gives Python's lock away while it computes."""
    from scipy.linalg import cython_lapack

    name_of = ctypes.PYFUNCTYPE(ctypes.c_char_p, ctypes.py_object)(("PyCapsule_GetName", ctypes.pythonapi))
    of_capsule = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)
    pointer_of = of_capsule(("PyCapsule_GetPointer", ctypes.pythonapi))
    capsule = cython_lapack.__pyx_capi__[name]
    kinds = {"s": ctypes.c_char_p, "p": ctypes.c_void_p}
    function = ctypes.CFUNCTYPE(None, *[kinds[one] for one in _ARGUMENTS[name]])
    return function(pointer_of(capsule, name_of(capsule)))
