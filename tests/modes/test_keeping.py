"""What is kept is bounded by its bytes: the last result stays, what was asked for longest ago goes."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from bayesplate.modes.keeping import kept


@pytest.fixture
def made():
    """A function of arrays of so many kilobytes, and the list of what it was asked for."""
    asked: list[int] = []

    @kept(100_000, lambda array: array.nbytes)
    def array(kilobytes: int) -> np.ndarray:
        asked.append(kilobytes)
        return np.zeros(kilobytes * 125)

    return array, asked


def test_what_was_asked_for_last_stays_within_the_bytes(made):
    array, asked = made
    first = array(40)
    array(50)
    assert array(40) is first  # asked for again: the other one is older now
    array(45)
    array(40)
    assert asked == [40, 50, 45]
    array(50)
    assert asked == [40, 50, 45, 50]


def test_one_that_is_larger_than_all_that_is_kept_is_still_kept_alone(made):
    array, asked = made
    array(10)
    large = array(500)

    assert array(500) is large
    array(10)
    assert asked == [10, 500, 10]


def test_what_another_thread_is_finding_is_waited_for():
    asked: list[int] = []
    begun = threading.Event()

    @kept(1000, lambda _: 1)
    def slow(number: int) -> list[int]:
        asked.append(number)
        begun.set()
        time.sleep(0.2)
        if len(asked) == 1:
            raise ValueError("the first time")
        return [number]

    with ThreadPoolExecutor(3) as pool:
        first = pool.submit(slow, 7)
        assert begun.wait(10)
        others = [pool.submit(slow, 7) for _ in range(2)]
        with pytest.raises(ValueError, match="the first time"):
            first.result(10)
        assert others[0].result(10) is others[1].result(10)
    assert asked == [7, 7]


def test_a_plate_is_assembled_once_for_two_boards_of_one_shape():
    """Whatever their sizes: the matrices stand on the unit square."""
    from bayesplate.frequencies.system import _plate

    ends = ("free", "free")
    one, two = (_plate(ends, ends, "thin", (), 4, 5) for _ in range(2))

    assert all(a.terms is b.terms for a, b in zip(one.blocks, two.blocks, strict=True))
