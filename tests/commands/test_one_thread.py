"""Linear algebra in one thread while a command runs, and as it was before and after."""

from __future__ import annotations

import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

import bayesplate
from bayesplate.commands import arguments


def blas_threads():
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.mark.parametrize("name", ["fit", "diagnose", "check", "compare", "plan", "modes"])
def test_no_call_leaves_linear_algebra_to_several_threads(name, monkeypatch):
    """Several threads for thousands of small matrices only wait for one another: a diagnosis was twice as slow."""
    assert scipy.linalg
    seen = []

    def looked(*_):
        seen.append(blas_threads())
        raise KeyError

    monkeypatch.setattr(arguments, "read_arguments", looked)
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        with pytest.raises(KeyError):
            getattr(bayesplate, name)("paper-cantilever-fe")
        assert blas_threads() == before != {1}
    assert seen == [{1}]
