"""Functions of LAPACK that give Python's lock away while they compute, so that threads need not wait for one another.

Those of `scipy.linalg.lapack` keep it. Their addresses, which SciPy hands out to compiled code, are called through
ctypes, which does not.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import lru_cache
from typing import Any

_ARGUMENTS = {
    "dpbtrf": "sppppp",
    "dpbtrs": "spppppppp",
    "dpftrf": "ssppp",
    "dpftrs": "sspppppp",
    "dpotrf": "spppp",
    "dsygst": "pspppppp",
    "dtrttf": "sspppp",
}
"""Strings and pointers of each, in their order: everything is given by reference.

dpbtrf(uplo, n, kd, ab, ldab, info), dpbtrs(uplo, n, kd, nrhs, ab, ldab, b, ldb, info), dpftrf(transr, uplo, n, a,
info), dpftrs(transr, uplo, n, nrhs, a, b, ldb, info), dpotrf(uplo, n, a, lda, info), dsygst(itype, uplo, n, a, lda, b,
ldb, info), dtrttf(transr, uplo, n, a, lda, arf, info).
"""


@lru_cache(maxsize=len(_ARGUMENTS))
def lapack(name: str) -> Callable[..., None]:
    """One of the functions of `_ARGUMENTS`."""
    from scipy.linalg import cython_lapack

    name_of = ctypes.PYFUNCTYPE(ctypes.c_char_p, ctypes.py_object)(("PyCapsule_GetName", ctypes.pythonapi))
    of_capsule = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)
    pointer_of = of_capsule(("PyCapsule_GetPointer", ctypes.pythonapi))
    capsule = cython_lapack.__pyx_capi__[name]
    kinds = {"s": ctypes.c_char_p, "p": ctypes.c_void_p}
    function = ctypes.CFUNCTYPE(None, *[kinds[one] for one in _ARGUMENTS[name]])
    return function(pointer_of(capsule, name_of(capsule)))


def integers(*numbers: int) -> list[Any]:
    """Numbers as these functions take them, by reference."""
    return [ctypes.byref(ctypes.c_int(number)) for number in numbers]
