"""Who computes the boards of a batch: a pool of processes, or a Dask cluster that is there; few wait at a time."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from itertools import chain
from types import ModuleType
from typing import Any, TypeAlias, TypeVar

from bayesplate.errors import Fault, InputError

_AHEAD = 2
"""Boards that wait for each worker."""
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_STARTING = 0.2
"""s; for which each new worker is busy, so that the next call starts another."""
_PATIENCE = "20s"
_PRELOADED = ("bayesplate.commands.fit_board", "scipy.stats", "scipy.sparse.linalg", "emcee", "skfem")
"""What every fit imports, loaded once for all workers."""

Key = TypeVar("Key")
Left = TypeVar("Left")
Answers: TypeAlias = Generator[tuple[Key, Future[Any]], None, Left]


@dataclass(frozen=True)
class Call:
    """A function and its arguments, to be computed anywhere."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]


@dataclass(frozen=True)
class Workers:
    """Those who compute.

    Attributes
    ----------
    open : callable
        Gives the executor, as a context; again where the last one broke.
    n : int
        How many compute at once.
    """

    open: Callable[[], AbstractContextManager[Executor]]
    n: int


class WorkerDied(Exception):
    """A worker ended without an answer: it was killed, or ran out of memory."""


def processes(n: int) -> Workers:
    """Processes of this machine, each with one thread, which end with this one however it ends."""

    @contextmanager
    def opened() -> Iterator[Executor]:
        before = {name: os.environ.get(name) for name in _ONE_THREAD}
        known = set(multiprocessing.active_children())
        os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
        try:
            with ProcessPoolExecutor(n, mp_context=_context(), initializer=_begin) as executor:
                try:
                    # All start before any computes: a worker that dies while another starts leaves the pool waiting.
                    with _without_script():
                        wait([executor.submit(time.sleep, _STARTING) for _ in range(n)])
                    yield executor
                except BaseException:
                    executor.shutdown(wait=False, cancel_futures=True)
                    for process in set(multiprocessing.active_children()) - known:
                        process.terminate()
                    raise
        finally:
            for name, value in before.items():
                if value is None:
                    os.environ.pop(name, None)
                else:
                    os.environ[name] = value

    return Workers(opened, n)


@contextmanager
def _without_script() -> Iterator[None]:
    """Workers that start here do not run the user's script, which would begin the batch again in each of them."""
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


def _context() -> Any:
    """Processes that begin clean: a fork would copy threads and locks in whatever state they are."""
    methods = multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
    if "forkserver" in methods:
        context.set_forkserver_preload(list(_PRELOADED))
    return context


def _begin() -> None:
    """A worker leaves interruptions to its parent, and does not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:

        def follow() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=follow, daemon=True).start()


def dask_cluster(address: str) -> Workers:
    """A cluster of Dask that is at work already.

    Parameters
    ----------
    address : str
        Of its scheduler: "tcp://127.0.0.1:8786".

    Raises
    ------
    InputError
        If the library is not there, or no scheduler answers, or it has no workers.
    """
    place = f"--dask {address}"
    try:
        from distributed import Client
    except ImportError:
        remedy = 'pip install "bayesplate[dask]", here and on the cluster'
        raise InputError(Fault(place, "Dask", "no such library", remedy)) from None
    try:
        client = Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(Fault(place, "the address of a scheduler that answers", str(error) or "no answer")) from None
    n = sum(client.nthreads().values())
    if not n:
        client.close()
        raise InputError(Fault(place, "a cluster with workers", "none", "start them: dask worker ADDRESS"))

    @contextmanager
    def opened() -> Iterator[Executor]:
        try:
            yield client.get_executor(pure=False)
        finally:
            client.close()

    return Workers(opened, n)


def computed(workers: Workers, calls: Iterable[tuple[Key, Call]]) -> Answers[Key, None]:
    """Compute calls, and give each as it is done; few wait at a time, so that their number costs no memory.

    Where a worker dies nobody knows of which call: all that were under way are computed once more, one at a time, and
    the one at which a worker dies again is answered by `WorkerDied`.

    Parameters
    ----------
    calls : iterable of (key, Call)

    Yields
    ------
    key, Future
        In the order in which they are done.
    """
    every = iter(calls)
    first = next(every, None)
    if first is None:
        return  # no worker starts for nothing
    left = chain([first], every)
    while True:
        broken = yield from _until_broken(workers, left, _AHEAD * workers.n)
        if broken is None:
            return
        for suspect in broken:
            again = yield from _until_broken(workers, iter([suspect]), 1)
            if again is not None:
                died: Future[Any] = Future()
                died.set_exception(WorkerDied("the worker ended without an answer: killed, or out of memory"))
                yield suspect[0], died


def _until_broken(
    workers: Workers, left: Iterator[tuple[Key, Call]], n_ahead: int
) -> Answers[Key, list[tuple[Key, Call]] | None]:
    """Compute what is left; returns None, or the calls that were under way when a worker died."""
    under_way: dict[Future[Any], tuple[Key, Call]] = {}
    lost: list[tuple[Key, Call]] = []
    with workers.open() as executor:
        is_more = True
        while True:
            while is_more and not lost and len(under_way) < n_ahead:
                one = next(left, None)
                is_more = one is not None
                if one is not None:
                    try:
                        under_way[executor.submit(one[1].function, *one[1].arguments)] = one
                    except BrokenExecutor:
                        lost.append(one)
            if not under_way:
                return lost or None
            done, _ = wait(under_way, return_when=FIRST_COMPLETED)
            for future in done:
                key, call = under_way.pop(future)
                if isinstance(future.exception(), BrokenExecutor):
                    lost.append((key, call))
                else:
                    yield key, future
