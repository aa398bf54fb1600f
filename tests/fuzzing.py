"""Tests with made-up inputs: a short one, the same every time, and a long one, marked slow, with new examples."""

from __future__ import annotations

import signal
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis.strategies import SearchStrategy

from bayesplate.errors import Fault, InputError

LONGER = 20
"""Times as many examples in the long one."""
HANGS, WAITS = 30.0, 20.0
"""s of processor time for one example, and times as long by the clock: far above what any takes on a busy machine."""
Test = Callable[..., None]


def fuzzed(body: Test, n_examples: int, **made: SearchStrategy[Any]) -> tuple[Test, Test]:
    """The short and the long test of a function; `made` are its arguments."""
    calm = {"deadline": None, "suppress_health_check": list(HealthCheck), "database": None}

    def short(**arguments: Any) -> None:
        body(**arguments)

    def long(**arguments: Any) -> None:
        body(**arguments)

    short.__doc__ = long.__doc__ = body.__doc__
    fixed = settings(max_examples=n_examples, derandomize=True, **calm)
    new = settings(max_examples=LONGER * n_examples, print_blob=True, **calm)
    return fixed(given(**made)(short)), pytest.mark.slow(new(given(**made)(long)))


def accepted_or_refused(read: Callable[[], Any], folder: Path | None = None) -> Any:
    """What a reader returns, or its faults; anything else that it raises, writes or waits for is a failure."""
    before = None if folder is None else contents(folder)
    with stopped_if_it_hangs():
        try:
            found = read()
        except InputError as error:
            check_faults(error)
            found = error
    assert folder is None or contents(folder) == before
    return found


def check_faults(error: InputError) -> None:
    """A refusal lists faults that say something, in characters that cannot steer a terminal."""
    assert error.faults
    for fault in error.faults:
        assert isinstance(fault, Fault)
        assert fault.place
        assert fault.wanted
        assert fault.got
    assert all(line.isprintable() for line in str(error).split("\n"))
    assert str(error).count("\n") == len(error.faults) - 1


def contents(folder: Path) -> dict[Path, int]:
    """What lies below a folder, and how large it is."""
    return {path: path.lstat().st_size for path in folder.rglob("*")}


@contextmanager
def stopped_if_it_hangs(seconds: float = HANGS) -> Iterator[None]:
    """Fail where the processor is kept busy without an end, or is waited for what never comes."""

    def give_up(signum: int, frame: object) -> None:
        raise AssertionError(f"{seconds:g} s and no end")

    before = signal.signal(signal.SIGPROF, give_up), signal.signal(signal.SIGALRM, give_up)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.setitimer(signal.ITIMER_REAL, WAITS * seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGPROF, before[0])
        signal.signal(signal.SIGALRM, before[1])


@contextmanager
def memory_below(n_bytes: float) -> Iterator[None]:
    """Fail where more than so many bytes were asked for at a time: arrays count with what they claim, used or not."""
    tracemalloc.start()
    try:
        yield
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < n_bytes, f"{most / 1e6:.0f} MB"
