"""Linear algebra in one thread: thousands of small matrices would only wait for one another."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def one_thread_each() -> Iterator[None]:
    """One thread per call of linear algebra, whatever the process has set; to be put above a command."""
    import scipy.linalg  # noqa: F401  (what is not loaded is not limited)
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1, user_api="blas"):
        yield
