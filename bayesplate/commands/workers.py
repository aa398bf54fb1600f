"""Executors for the boards of a batch: processes of this machine, or a Dask cluster; few boards wait at a time."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from types import FrameType, ModuleType
from typing import Any, TypeVar

from bayesplate.errors import Fault, InputError

_DASK_TIMEOUT = "20s"
_PRELOADED_MODULES = ("bayesplate.commands.fit_board", "scipy.stats", "scipy.sparse.linalg", "emcee", "skfem")
"""What every fit imports, loaded once for all workers."""

CallKey = TypeVar("CallKey")
Call = tuple[Callable[..., Any], tuple[Any, ...]]
"""A function and its arguments, to be computed anywhere."""


class WorkerDied(Exception):
    """A worker ended without an answer: it was killed, or ran out of memory."""


def compute_calls(free: list[Executor], calls: Iterable[tuple[CallKey, Call]]) -> Iterator[tuple[CallKey, Future[Any]]]:
    """Compute calls, one at a time in each executor; yields each when done, by its key. A worker's death costs one."""
    pending: dict[Future[Any], tuple[CallKey, Executor]] = {}

    def finished_calls() -> Iterator[tuple[CallKey, Future[Any]]]:
        done, _ = wait(pending, return_when=FIRST_COMPLETED)
        for future in done:
            key, executor = pending.pop(future)
            if isinstance(future.exception(), BrokenExecutor):
                executor, future = _new_process(), Future()
                future.set_exception(WorkerDied("the worker ended without an answer: killed, or out of memory"))
            free.append(executor)
            yield key, future

    for key, (function, arguments) in calls:
        while not free:
            yield from finished_calls()
        executor = free.pop()
        with _hide_script(), _hold_interruptions():
            try:
                future = executor.submit(function, *arguments)
            except BrokenExecutor:  # it died since its last call
                executor = _new_process()
                future = executor.submit(function, *arguments)
        pending[future] = key, executor
    while pending:
        yield from finished_calls()


@contextmanager
def worker_processes(n: int) -> Iterator[list[Executor]]:
    """Processes of this machine, which start with their first call and end with the `with` block."""
    earlier_processes = set(multiprocessing.active_children())
    try:
        yield [_new_process() for _ in range(n)]
    finally:
        for process in set(multiprocessing.active_children()) - earlier_processes:
            process.terminate()


def _new_process() -> Executor:
    """One process that begins clean: a fork would copy threads and locks in whatever state they are."""
    methods = multiprocessing.get_all_start_methods()
    context: Any = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
    if "forkserver" in methods:
        context.set_forkserver_preload(list(_PRELOADED_MODULES))
    return ProcessPoolExecutor(1, mp_context=context, initializer=_start_worker)


def _start_worker() -> None:
    """Start a worker: it leaves interruptions to its parent, and does not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:

        def exit_with_parent() -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=exit_with_parent, daemon=True).start()


@contextmanager
def _hide_script() -> Iterator[None]:
    """Keep workers that start here from running the user's script, which would begin the batch again in each."""
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


@contextmanager
def _hold_interruptions() -> Iterator[None]:
    """Let a process start whole and never be interrupted: it inherits the mask, and what comes meanwhile comes after.

    Other threads do not have the mask, so that the handler waits too.
    """
    handler = signal.getsignal(signal.SIGINT)
    if not (
        hasattr(signal, "pthread_sigmask")
        and callable(handler)
        and threading.current_thread() is threading.main_thread()
    ):
        yield
        return
    held: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda number, frame: held.append((number, frame)))
    earlier_mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, earlier_mask)
        signal.signal(signal.SIGINT, handler)
    if held:
        handler(*held[0])


@contextmanager
def dask_cluster(address: str) -> Iterator[list[Executor]]:
    """A cluster of Dask that is at work, by the address of its scheduler; raises InputError where none answers."""
    place = f"--dask {address}"
    try:
        from distributed import Client
    except ImportError:
        remedy = 'pip install "bayesplate[dask]", here and on the cluster'
        raise InputError(Fault(place, "Dask", "no such library", remedy)) from None
    try:
        client = Client(address, timeout=_DASK_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(Fault(place, "the address of a scheduler that answers", str(error) or "no answer")) from None
    try:
        n_threads = sum(client.nthreads().values())
        if not n_threads:
            raise InputError(Fault(place, "a cluster with workers", "none", "start them: dask worker ADDRESS"))
        yield [client.get_executor(pure=False)] * (2 * n_threads)  # none waits for the network
    finally:
        client.close()
