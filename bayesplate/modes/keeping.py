"""What a function found is kept for the next call with the same arguments, up to a number of bytes."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Found = TypeVar("Found")


def kept(most_bytes: int, size: Callable[[Found], int]) -> Callable[[Callable[Given, Found]], Callable[Given, Found]]:
    """Keep what a function returns; what was asked for longest ago goes first.

    A cache that counts results knows nothing of their size: sixteen fine meshes with many terms were gigabytes.

    Parameters
    ----------
    most_bytes : int
        Of all that is kept; the last result stays whatever its size.
    size : callable
        Bytes of a result.

    Returns
    -------
    callable
        To be put above a function of hashable arguments whose results are shared and must not be changed.
    """

    def decorate(find: Callable[Given, Found]) -> Callable[Given, Found]:
        results: OrderedDict[Hashable, tuple[Found, int]] = OrderedDict()
        sought: dict[Hashable, threading.Lock] = {}
        lock = threading.Lock()

        @wraps(find)
        def found(*args: Given.args, **kwargs: Given.kwargs) -> Found:
            key = (args, tuple(sorted(kwargs.items())))
            with lock:
                this_one = sought.setdefault(key, threading.Lock())
            try:
                with this_one:  # what another thread is finding is waited for
                    with lock:
                        if key in results:
                            results.move_to_end(key)
                            return results[key][0]
                    result = find(*args, **kwargs)
                    with lock:
                        results[key] = (result, size(result))
                        while len(results) > 1 and sum(one for _, one in results.values()) > most_bytes:
                            results.popitem(last=False)
                    return result
            finally:
                with lock:
                    sought.pop(key, None)

        return found

    return decorate
