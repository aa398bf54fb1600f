"""Draws from a posterior: four ensembles of emcee with random streams of their own, until the convergence gate passes.

A pilot walks first, from three standard errors around the estimate to the posterior. The distribution of independent
proposals is fitted to its draws, and the ensembles begin at its last points; its draws are not part of the result.
Where the posterior has a second peak that few walkers of the pilot reached, these proposals miss it. A walk that does
not pass the gate therefore serves as the pilot of the next one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.convergence import (
    Convergence,
    Gate,
    burn_in_steps,
    judge_convergence,
    length_in_taus,
)
from bayesplate.posterior.ensembles import Ensembles
from bayesplate.posterior.starts import LogDensity, cholesky_factor, guard_log_density

_FIRST_WALKS = 2000, 4000
"""Most steps of the first walks; the last one has what is left of all."""
_FIRST_CHECK, _CHECK_RATIO = 200, 1.15
_LONG_RUN = 4.0
"""Length of a run, over that which the gate wants, at which a small acceptance fails for good."""


@dataclass(frozen=True)
class SamplerSettings:
    """Settings of the sampler; the seed determines all random numbers."""

    seed: int
    n_ensembles: int = 4  # at least two
    n_walkers: int | None = None  # of each: even, at least twice the number of parameters; by default at least 32
    chunk_steps: int = 50  # between two reports of progress
    max_steps: int = 20_000  # steps after which to stop without convergence, rounded up to whole chunks
    gate: Gate = field(default_factory=Gate)

    def walkers(self, n_dim: int) -> int:
        """Number of walkers for `n_dim` parameters; InputError if the settings cannot be used."""
        n_walkers = max(32, 2 * n_dim + 2) if self.n_walkers is None else self.n_walkers
        faults = []
        if n_walkers < 2 * n_dim or n_walkers % 2:
            faults.append(Fault("sampler n_walkers", f"an even number of at least {2 * n_dim}", f"{n_walkers}"))
        if self.n_ensembles < 2:
            faults.append(Fault("sampler n_ensembles", "at least 2", f"{self.n_ensembles}"))
        if self.seed < 0:
            faults.append(Fault("sampler seed", "a number that is not negative", f"{self.seed}"))
        if self.chunk_steps < 10 or self.max_steps < 1:
            got = f"{self.chunk_steps} and {self.max_steps}"
            faults.append(Fault("sampler chunk_steps, max_steps", "at least 10 and 1", got))
        if faults:
            raise InputError(faults)
        return n_walkers


@dataclass(frozen=True)
class Chains:
    """Every draw of a run, burn-in included."""

    draws: Floats  # (n_ensembles, n_steps, n_walkers, n_dim)
    log_prob: Floats  # (n_ensembles, n_steps, n_walkers)
    burn_in: int  # steps to discard

    @property
    def after_burn_in(self) -> Floats:
        """Draws after burn-in, (n_ensembles, n_kept_steps, n_walkers, n_dim)."""
        return self.draws[:, self.burn_in :]

    @property
    def pooled(self) -> Floats:
        """Draws after burn-in of all ensembles together, (n_draws, n_dim)."""
        return self.after_burn_in.reshape(-1, self.draws.shape[-1])


@dataclass(frozen=True)
class Progress:
    """Progress of a run, reported after every chunk."""

    n_steps: int
    max_steps: int
    n_taus: float | None = None  # autocorrelation times in the shortest ensemble at the last check; None before
    stage: str = ""  # of a longer run; empty if this sampling is all of it
    done: float | None = None  # share of that run, 0 to 1; None where it is not known

    @property
    def sampled(self) -> float:
        """Share of this sampling, by its autocorrelation times: 0 to 1."""
        return min((self.n_taus or 0.0) / Gate().tau_count_min, 1.0)


def sample(
    log_density: LogDensity,
    centre: Floats,
    covariance: Floats,
    settings: SamplerSettings,
    *,
    names: Sequence[str] = (),
    initial_draws: Floats | None = None,
    checkpoint: Checkpoint | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> tuple[Chains, Convergence]:
    """Sample until the gate passes or `settings.max_steps` are made; draws and verdict of the last walk.

    Up to two walks that do not pass are each followed by one that begins anew at their draws.

    The draws depend on the seed alone: a run that was killed and continued from its checkpoint gives the same bytes.

    The walkers start around the (n_dim,) estimate, three times as wide as its covariance, or at some of the
    `initial_draws`, (n_draws, n_dim) of nearly the same density. Unless `passed`, nothing may be printed from the
    chains.
    """
    shape = settings.n_ensembles, settings.walkers(n_dim := len(centre))
    names = tuple(names) or tuple(f"parameter {dim + 1}" for dim in range(n_dim))
    starts = np.asarray(centre), cholesky_factor(covariance)
    log_density = guard_log_density(log_density, names)
    n_before = 0
    for number, longest in enumerate((*_FIRST_WALKS, settings.max_steps)):
        n_left = settings.max_steps - n_before
        chains, convergence = _walk(
            Ensembles(log_density, *starts, settings.seed, shape, initial_draws, number),
            replace(settings, max_steps=min(longest, n_left)),
            names,
            checkpoint.part(f"walk-{number + 1}") if checkpoint and number else checkpoint,
            _told_from(n_before, settings.max_steps, progress),
        )
        n_before += chains.draws.shape[1]
        if convergence.passed or longest >= n_left:
            break
        initial_draws = chains.pooled
    return chains, convergence


def _told_from(
    n_before: int, max_steps: int, progress: Callable[[Progress], None] | None
) -> Callable[[Progress], None]:
    """Progress of a walk as that of the whole run, of which `n_before` steps are made."""

    def tell(walk: Progress) -> None:
        if progress is not None:
            progress(replace(walk, n_steps=n_before + walk.n_steps, max_steps=max_steps))

    return tell


def _walk(
    ensembles: Ensembles,
    settings: SamplerSettings,
    names: Sequence[str],
    checkpoint: Checkpoint | None,
    progress: Callable[[Progress], None],
) -> tuple[Chains, Convergence]:
    """Advance the ensembles until the gate passes or further steps are of no use.

    They stop without convergence after `settings.max_steps`, where more than twice as many would be needed, and where
    the chains are four times as long as the gate wants and accept too few proposals. Any other rule may pass later:
    effective draws add up, and a walker in a narrow region leaves it.
    """
    n_walkers, n_dim = ensembles.shape[1], len(ensembles.centre)
    identity = {"seed": settings.seed, "n_ensembles": settings.n_ensembles, "n_walkers": n_walkers, "n_dim": n_dim}
    context = nullcontext() if checkpoint is None else checkpoint.session(**identity, chunk_steps=settings.chunk_steps)
    with context as session:
        ensembles.begin(None if session is None else session.load())
        n_taus = None
        while True:
            n_steps, burn_in = ensembles.n_steps, burn_in_steps(ensembles.n_steps)
            is_last = n_steps >= settings.max_steps
            if n_steps and (is_last or _is_check_due(n_steps, settings.chunk_steps)):
                n_taus = length_in_taus(ensembles.chain[:, burn_in:])
                is_last |= is_hopeless(n_taus, n_steps - burn_in, settings)
                if is_last or n_taus >= settings.gate.tau_count_min:
                    chains = Chains(ensembles.chain, ensembles.log_prob, burn_in)
                    convergence = judge_convergence(chains.after_burn_in, settings.gate, names=names)
                    is_long = n_taus >= _LONG_RUN * settings.gate.tau_count_min
                    is_last |= is_long and convergence.acceptance < settings.gate.acceptance_min
                    if is_last or convergence.passed:
                        if session is not None:
                            session.save()
                        return chains, convergence
            if n_steps:
                progress(Progress(n_steps, settings.max_steps, n_taus))
            ensembles.advance(settings.chunk_steps)
            if session is not None:
                session.reached(ensembles.snapshot)


def is_hopeless(n_taus: float, n_kept: int, settings: SamplerSettings) -> bool:
    """Whether twice the allowed steps would hold too few autocorrelation times, from those in `n_kept` steps.

    Draws of fewer steps than an autocorrelation time underestimate it, so this is never true too early; while a walker
    has not moved yet, `n_taus` is 0.
    """
    return 0.0 < n_taus * 2 * settings.max_steps < settings.gate.tau_count_min * n_kept


def _is_check_due(n_steps: int, chunk_steps: int) -> bool:
    """Whether a convergence check is due, at steps that grow by 15 %; a resumed run has the same checks."""
    next_check = -(-_FIRST_CHECK // chunk_steps) * chunk_steps
    while next_check < n_steps:
        next_check = -(-int(_CHECK_RATIO * next_check) // chunk_steps) * chunk_steps
    return next_check == n_steps
