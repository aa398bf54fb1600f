"""Parts in threads: their order, parts within parts, and worker processes."""

from __future__ import annotations

import multiprocessing
import threading
from importlib import import_module

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

from bayesplate.modes import threads
from bayesplate.modes.threads import in_threads


@pytest.fixture(autouse=True)
def two_cores(monkeypatch):
    monkeypatch.setattr(threads, "_n_cores", lambda: 2)
    threads._pool.cache_clear()
    yield
    threads._pool.cache_clear()


def name_of(_):
    return threading.current_thread().name


def names_within(_):
    return in_threads(name_of, range(3))


def in_a_worker(answers):
    answers.put(in_threads(name_of, range(3)))


def test_parts_come_back_in_their_order_from_other_threads():
    assert in_threads(lambda i: i**2, range(20)) == [i**2 for i in range(20)]
    assert [row.sum() for row in in_threads(lambda row: row, np.eye(3))] == [1.0, 1.0, 1.0]
    assert threading.current_thread().name not in in_threads(name_of, range(4))
    assert in_threads(name_of, range(1)) == [threading.current_thread().name]


@pytest.mark.parametrize("n_parts", [1, 4])
def test_the_calling_thread_is_told_what_is_done(n_parts):
    told = []
    in_threads(name_of, range(n_parts), lambda share: told.append((share, threading.current_thread().name)))
    assert told == [((i + 1) / n_parts, threading.current_thread().name) for i in range(n_parts)]


def test_parts_of_a_part_stay_in_its_thread():
    """Otherwise all threads would wait for parts that no thread is left for."""
    for names in in_threads(names_within, range(8)):
        assert len(set(names)) == 1


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_a_worker_process_has_one_thread(method):
    in_threads(name_of, range(4))
    context = multiprocessing.get_context(method)
    answers = context.SimpleQueue()
    worker = context.Process(target=in_a_worker, args=(answers,))
    worker.start()
    worker.join(60)
    assert worker.exitcode == 0
    assert answers.get() == ["MainThread"] * 3


def blas_threads():
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


@pytest.mark.parametrize("name", ["fit", "diagnose", "check", "compare", "plan", "modes", "repeat"])
def test_no_call_leaves_linear_algebra_to_several_threads(name, monkeypatch):
    """As many threads as cores in each of the threads that take the cores already made a diagnosis twice as slow."""
    assert scipy.linalg
    seen = []

    def looked(**_):
        seen.append(blas_threads())
        raise KeyError

    module = import_module(f"bayesplate.workflow.{name}")
    monkeypatch.setattr(module, "require_arguments", looked)
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        with pytest.raises(KeyError):
            getattr(module, name)("paper-cantilever-fe")
        assert blas_threads() == before != {1}
    assert seen == [{1}]
