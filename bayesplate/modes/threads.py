"""Independent parts of one computation on all cores of a machine: the numbers are the same on any number of them.

The threads are the parts' own. A library of linear algebra that takes all cores for each of a thousand small matrices
as well makes all of them wait for one another, and rounds otherwise with each number of cores.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, TypeVar

from numpy.typing import NDArray

Part = TypeVar("Part")
Result = TypeVar("Result")
_local = threading.local()


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Linear algebra in one thread per call, whatever the process has set; to be put above a function, or a context."""
    import scipy.linalg  # noqa: F401  (what is not loaded is not limited)
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        yield


def in_threads(
    compute: Callable[[Part], Result],
    parts: Sequence[Part] | NDArray[Any],
    tell: Callable[[float], None] | None = None,
) -> list[Result]:
    """What comes of each part, in their order.

    Worker processes share the cores between them already, and have one thread each.

    Parameters
    ----------
    compute : callable
        Spends its time in compiled code. Where it calls this function again its parts follow one another.
    parts : sequence or (n_parts, ...) array
    tell : callable, optional
        Told, by the thread that calls this function, which share of the parts is done.

    Returns
    -------
    list
    """
    is_part = hasattr(_local, "is_part") or multiprocessing.parent_process() is not None
    is_alone = is_part or len(parts) < 2 or _n_cores() < 2
    found = []
    for result in map(compute, parts) if is_alone else _pool().map(compute, parts):
        found.append(result)
        if tell is not None:
            tell(len(found) / len(parts))
    return found


def _n_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@lru_cache(maxsize=1)
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_n_cores(), initializer=setattr, initargs=(_local, "is_part", True))


if hasattr(os, "register_at_fork"):  # threads do not survive a fork
    os.register_at_fork(after_in_child=_pool.cache_clear)
