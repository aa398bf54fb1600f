"""One sampler in a process of its own: from the JSON file to draws in a file, with what each part took.

python -m benchmarks.peers.with_emcee PROBLEM OUT --size N --seed N [--again] [--variant NAME]
"""

from __future__ import annotations

import time

BEGUN = time.perf_counter()  # before anything heavy is imported

import argparse  # noqa: E402
from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402
from validation.benchmarks.peers.density import Density  # noqa: E402

Draws = tuple[np.ndarray, np.ndarray | None]
"""Columns of the package, (n_steps, n_chains, n_dim) of chains or (n, n_dim) of others; and weights of the latter."""


def run(prepared: Callable[[Density, str], Callable[[int, int], Draws]]) -> None:
    """Sample as the command line says, and write draws, means and seconds.

    Parameters
    ----------
    prepared : callable
        Imports the sampler, sets up the density, and returns what samples: given a size and a seed.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problem", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--size", type=int, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--variant", default="")
    parser.add_argument("--again", action="store_true", help="sample once more, with what was compiled")
    arguments = parser.parse_args()

    sample = prepared(Density.read(arguments.problem), arguments.variant)
    ready = time.perf_counter()
    draws, weights = sample(arguments.size, arguments.seed)
    done = time.perf_counter()
    seconds = {"start_up": ready - BEGUN, "sampling": done - ready}
    if arguments.again:
        draws, weights = sample(arguments.size, arguments.seed + 1)
        seconds["again"] = time.perf_counter() - done
    weights = np.ones(1) if weights is None else weights
    np.savez(arguments.out, draws=draws, weights=weights, **seconds)
