"""Runs of one sampler: how long they must be, and what they take."""

from __future__ import annotations

import os
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from validation.benchmarks.peers import measures, package
from validation.benchmarks.peers.environments import Unavailable
from validation.benchmarks.peers.registry import Peer

from bayesplate.posterior.posing import PosedProblem

TESTS = Path(__file__).resolve().parents[3]
LONGEST = 1500.0
"""Seconds that one process may take."""
MARGIN = 1.15
"""Of the length that a trial run asks for: another seed should not fall short."""
TOO_MUCH = 1.5
"""Times the wanted draws: a run that gives more is measured again with fewer, in the peer's favour."""
N_TRIALS = 6
USUAL = 4000.0
"""Effective draws for which the sizes of the first trials are meant."""
FEWEST = 200


@dataclass(frozen=True)
class Result:
    """What was measured of one sampler; lists have one number a seed.

    Attributes
    ----------
    name : str
    fingerprint : str
        Of the problem and the options: a result that has another is measured anew.
    missing : str
        Why there is none; empty if there is.
    cold, processor : tuple of float
        Seconds of whole processes, files written: by the clock, and of the processor.
    sampling : tuple of float
        Seconds after start-up, warm-up and compilation counted.
    warm : tuple of float
        The same once everything is compiled; empty where nothing is.
    ess : tuple of float
        Effective draws of the parameter that has fewest.
    size : int
        What the sampler was asked for.
    difference : dict of float
        Of all seeds together from quadrature (`measures.Difference`).
    versions : str
    """

    name: str
    fingerprint: str
    missing: str = ""
    cold: tuple[float, ...] = ()
    processor: tuple[float, ...] = ()
    sampling: tuple[float, ...] = ()
    warm: tuple[float, ...] = ()
    ess: tuple[float, ...] = ()
    size: int = 0
    difference: Mapping[str, float] = field(default_factory=dict)
    versions: str = ""

    @property
    def cold_time(self) -> float:
        """Median seconds of a whole process."""
        return median(self.cold)

    @property
    def rate(self) -> float:
        """Median effective draws per second after start-up, compilation left out where there is one."""
        return median(n / s for n, s in zip(self.ess, self.warm or self.sampling, strict=True))

    @property
    def compilation(self) -> float:
        """Seconds by which a first run is slower than a second; 0 where nothing is compiled."""
        return max(median(self.sampling) - median(self.warm), 0.0) if self.warm else 0.0


@dataclass(frozen=True, eq=False)
class Run:
    """One process of a peer: draws, weights or None, seconds by part, and of the whole process."""

    draws: np.ndarray
    weights: np.ndarray | None
    seconds: Mapping[str, float]
    cold: float
    processor: float

    @property
    def ess(self) -> float:
        """Effective draws of the parameter that has fewest."""
        return float(measures.effective_draws(self.draws, self.weights).min())


def process(command: Sequence[str], environment: Mapping[str, str]) -> tuple[float, float]:
    """Run a command to its end: seconds by the clock and of the processor.

    Raises
    ------
    Unavailable
        If it fails or takes too long.
    """
    before, started = os.times(), time.perf_counter()
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=LONGEST)
    except subprocess.TimeoutExpired as error:
        raise Unavailable(f"not done within {LONGEST:.0f} s") from error
    seconds, after = time.perf_counter() - started, os.times()
    if done.returncode:
        raise Unavailable(f"run: {(done.stderr.strip().splitlines() or ['failed'])[-1]}")
    spent = after.children_user + after.children_system - before.children_user - before.children_system
    return seconds, spent


def run_peer(peer: Peer, python: Path, problem: Path, size: int, seed: int, *, again: bool = False) -> Run:
    """One peer in a process of its own, from the JSON file to a file of draws."""
    environment = {**os.environ, "PYTHONPATH": str(TESTS), "PYTHONWARNINGS": "ignore"}
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "draws.npz"
        command = [str(python), "-m", f"validation.benchmarks.peers.{peer.module}", str(problem), str(out)]
        command += ["--size", str(size), "--seed", str(seed), "--variant", peer.variant, *(["--again"] * again)]
        cold, processor = process(command, environment)
        with np.load(out) as found:
            draws, weights = found["draws"], found["weights"]
            seconds = {name: float(found[name]) for name in ("start_up", "sampling", "again") if name in found}
    return Run(draws, weights if weights.size == len(draws) > 1 else None, seconds, cold, processor)


def next_size(size: int, ess: float, goal: float) -> int:
    """The size at which a sampler should give the wanted draws: in proportion, at most four times as much."""
    return int(size * min(max(MARGIN * goal / float(np.nanmax([ess, 1.0])), 0.05), 4.0))


def measured(peer: Peer, python: Path, problem: Path, truth: measures.Truth, goal: float, seeds: Sequence[int],
             fingerprint: str) -> Result:  # fmt: skip
    """Find how long a peer must run by trials that do not count, then measure it with every seed."""
    size = max(int(peer.size * goal / USUAL), FEWEST)
    for trial in range(N_TRIALS):
        ess = run_peer(peer, python, problem, size, 100 + trial).ess
        if ess >= goal and (trial or ess <= TOO_MUCH * goal):  # shortened once at most: some have a least length
            break
        if size >= peer.largest:
            worth = "walkers that never join the others" if np.isnan(ess) else f"{ess:.0f} effective draws"
            return Result(peer.name, fingerprint, f"{worth} at a size of {size}, the largest tried")
        size = min(next_size(size, ess, goal), peer.largest)
    runs = [run_peer(peer, python, problem, size, seed) for seed in seeds]
    short = min(run.ess for run in runs)
    if short < goal and size < peer.largest:  # once more: a seed fell short
        size = min(next_size(size, short, goal), peer.largest)
        runs = [run_peer(peer, python, problem, size, seed) for seed in seeds]
    warm: tuple[float, ...] = ()
    if peer.is_compiled:
        again = [run_peer(peer, python, problem, size, seed, again=True) for seed in seeds]
        warm = tuple(run.seconds["again"] for run in again)
    return Result(
        peer.name,
        fingerprint,
        cold=tuple(run.cold for run in runs),
        processor=tuple(run.processor for run in runs),
        sampling=tuple(run.seconds["sampling"] for run in runs),
        warm=warm,
        ess=tuple(run.ess for run in runs),
        size=size,
        difference=pooled_difference([(run.draws, run.weights) for run in runs], truth),
        versions=", ".join(one.replace("==", " ") for one in peer.requirements),
    )


def pooled_difference(runs: Sequence[tuple[np.ndarray, np.ndarray | None]], truth: measures.Truth) -> dict[str, float]:
    """Difference of several runs taken together from the truth."""
    if runs[0][0].ndim == 3:
        n_steps = min(len(draws) for draws, _ in runs)
        draws = np.concatenate([draws[-n_steps:] for draws, _ in runs], axis=1)
        return asdict(measures.difference(draws, None, truth))
    weights = [np.ones(len(draws)) if each is None else each for draws, each in runs]
    together = np.concatenate([each / each.sum() for each in weights])
    return asdict(measures.difference(np.concatenate([draws for draws, _ in runs]), together, truth))


def our_own(problem: PosedProblem, python: str, truth: measures.Truth, seeds: Sequence[int], fingerprint: str,
            versions: str) -> list[Result]:  # fmt: skip
    """The package's rows: the sampler is one, the commands differ in the files they write."""
    samples = [package.sampled(problem, seed) for seed in seeds]
    shared: dict[str, Any] = {
        "sampling": tuple(one.seconds for one in samples),
        "ess": tuple(float(measures.effective_draws(one.draws, None).min()) for one in samples),
        "difference": pooled_difference([(one.draws, None) for one in samples], truth),
        "versions": versions,
    }
    found = []
    for name, options in package.COMMANDS.items():
        with tempfile.TemporaryDirectory() as folder:
            times = [
                process(package.command(python, options, seed, Path(folder) / str(seed)), os.environ) for seed in seeds
            ]
        cold, processor = zip(*times, strict=True)
        found.append(Result(name, fingerprint, cold=cold, processor=processor, **shared))
    return found
