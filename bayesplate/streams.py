"""Every random stream by its name, from one seed: no two names share numbers, and none uses numpy's global state."""

from __future__ import annotations

from zlib import crc32

import numpy as np


def random_stream(seed: int, *names: str | int) -> np.random.Generator:
    """The random stream of a name, which says what the numbers are for, as "walkers", 2."""
    key = tuple(crc32(name.encode()) if isinstance(name, str) else name for name in names)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
