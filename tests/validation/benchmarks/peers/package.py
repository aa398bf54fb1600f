"""The package itself, measured as its peers are: the whole command cold, and the sampler after start-up."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from validation.benchmarks.peers.statement import BOARD

from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.sampling import SamplerSettings

COMMANDS = {"bayesplate fit": (), "bayesplate fit --no-report": ("--no-report",)}
"""Rows of the page and the options of each: with the page of figures, and files of numbers alone."""


@dataclass(frozen=True, eq=False)
class Sampled:
    """Draws after burn-in, (n_steps, n_chains, n_dim), and the seconds that sampling took, convergence judged."""

    draws: np.ndarray
    seconds: float


def command(python: str, options: tuple[str, ...], seed: int, out: Path) -> list[str]:
    """The command that fits the board, with its files written to `out`."""
    fit = [python, "-m", "bayesplate", "fit", BOARD, "--force", "--quiet", "--seed", str(seed)]
    return [*fit, *options, "--out", str(out)]


def sampled(problem: PosedProblem, seed: int) -> Sampled:
    """The draws that the command makes with that seed: they depend on nothing else."""
    started = time.perf_counter()
    inference = infer(problem, SamplerSettings(seed=seed))
    seconds = time.perf_counter() - started
    kept = inference.chains.after_burn_in  # (ensemble, step, walker, column)
    return Sampled(np.swapaxes(kept, 0, 1).reshape(kept.shape[1], -1, kept.shape[-1]), seconds)
