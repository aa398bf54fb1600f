"""Draws from a posterior: four emcee ensembles side by side, in chunks, until the convergence gate passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault, InputError
from bayesplate.posterior.checkpoint import Checkpoint, Chunk
from bayesplate.posterior.convergence import (
    Convergence,
    Gate,
    Length,
    acceptance_by_walker,
    assess,
    burn_in_steps,
)
from bayesplate.posterior.ensembles import Learnt, advance, correcting, crossed, stepping
from bayesplate.posterior.moves import CorrectedSteps, Steps
from bayesplate.posterior.starting import Evaluate, GuardedPosterior, LogPosterior, random_numbers, start_ensembles
from bayesplate.posterior.warm_up import WarmUp

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SamplerSettings:
    """How to sample.

    Attributes
    ----------
    seed : int
        Everything random follows from it.
    n_ensembles : int
        Independent ensembles, at least two.
    n_walkers : int, optional
        Walkers of each, even and at least twice the number of parameters; by default at least 32.
    n_corrected : int
        Walkers of each that go on where a surrogate is corrected. There a step costs an evaluation of the density and
        forgets nearly everything, so that few of them are worth as many draws; the warm-up, which teaches what is
        proposed, costs next to nothing and keeps them all. Twelve make 2400 effective draws at least, six times what
        the gate asks for; fewer would do for that, but may not find a part of the posterior that a surrogate lacks.
    chunk_steps : int
        Steps between two checkpoints.
    max_steps : int
        Where to stop without convergence; rounded up to whole chunks. Sooner where twice as many would not suffice.
    gate : Gate
        When to stop with it.
    """

    seed: int
    n_ensembles: int = 4
    n_walkers: int | None = None
    n_corrected: int = 12
    chunk_steps: int = 25
    max_steps: int = 20_000
    gate: Gate = field(default_factory=Gate)

    def walkers(self, n_dim: int) -> int:
        """Return the number of walkers for `n_dim` parameters.

        Raises
        ------
        InputError
            If the settings cannot be used.
        """
        n_walkers = max(32, 2 * n_dim + 2) if self.n_walkers is None else self.n_walkers
        faults = []
        if n_walkers < 2 * n_dim or n_walkers % 2:
            faults.append(Fault("sampler n_walkers", f"an even number of at least {2 * n_dim}", f"{n_walkers}"))
        if self.n_corrected < 1:
            faults.append(Fault("sampler n_corrected", "at least 1", f"{self.n_corrected}"))
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
    """Every draw of a run, burn-in included, of the walkers that went on to its end.

    Attributes
    ----------
    draws : (n_ensembles, n_steps, n_walkers, n_dim) array
    log_prob : (n_ensembles, n_steps, n_walkers) array
    burn_in : int
        Steps to discard.
    blobs : (n_ensembles, n_kept_steps, n_walkers, n_blobs) array or None
        What the density found at the draws that are kept; None where only a part of it was kept, or nothing.
    """

    draws: FloatArray
    log_prob: FloatArray
    burn_in: int
    blobs: FloatArray | None = None

    @property
    def kept(self) -> FloatArray:
        """Draws after burn-in, (n_ensembles, n_kept_steps, n_walkers, n_dim)."""
        return self.draws[:, self.burn_in :]

    @property
    def pooled(self) -> FloatArray:
        """Draws after burn-in of all ensembles together, (n_draws, n_dim)."""
        return self.kept.reshape(-1, self.draws.shape[-1])

    @property
    def accepted(self) -> FloatArray:
        """Accepted fraction of every walker's kept steps, (n_ensembles, n_walkers)."""
        return acceptance_by_walker(self.kept)


@dataclass(frozen=True)
class Progress:
    """Where a run stands, told after every chunk.

    Attributes
    ----------
    n_steps, max_steps : int
        Steps done and allowed.
    n_taus : float or None
        Length of the ensembles in autocorrelation times when it was last looked at, by the first parameter that was
        found too slow; None before.
    stage : str
        What of a longer run is being done; empty if it is nothing but this sampling.
    done : float or None
        Share of that run, 0 to 1; None where nobody knows.
    """

    n_steps: int
    max_steps: int
    n_taus: float | None = None
    stage: str = ""
    done: float | None = None

    @property
    def sampled(self) -> float:
        """Share of this sampling, by its autocorrelation times: 0 to 1."""
        return min((self.n_taus or 0.0) / Gate().tau_count_min, 1.0)


def sample(
    log_posterior: LogPosterior,
    centre: FloatArray,
    covariance: FloatArray,
    settings: SamplerSettings,
    *,
    surrogate: LogPosterior | None = None,
    evaluate: Evaluate | None = None,
    names: Sequence[str] = (),
    checkpoint: Checkpoint | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> tuple[Chains, Convergence]:
    """Sample until the gate passes, `settings.max_steps` are made, or more than twice as many would be needed.

    The draws depend on the seed alone: a run that was killed and continued from its checkpoint gives the same bytes.

    Parameters
    ----------
    log_posterior : callable, (n_points, n_dim) -> (n_points,) array
        Vectorised; minus infinity outside the support, otherwise finite.
    centre : (n_dim,) array
        The estimate.
    covariance : (n_dim, n_dim) array
        Its covariance; the walkers start three times as wide.
    settings : SamplerSettings
    surrogate : callable, optional
        A cheap density near the posterior, on which the walkers then walk between two evaluations of the posterior; it
        serves alone during the warm-up. The draws that are kept follow the posterior itself (`CorrectedSteps`).
    evaluate : callable, (n_points, n_dim) -> (n_points,) and (n_points, n_blobs) arrays, optional
        The log posterior once more, with what it finds on the way: behind a surrogate that is kept beside the draws.
        At least one number for each point; by default the log posterior itself.
    names : sequence of str, optional
        Parameter names for messages.
    checkpoint : Checkpoint, optional
        Where every chunk is saved, and where an unfinished run is continued from.
    progress : callable, optional
        Told after every chunk.

    Returns
    -------
    chains : Chains
    convergence : Convergence
        `passed` is False if the steps did not suffice, or never would: then nothing may be printed from the chains.

    Raises
    ------
    BayesplateError
        If the log posterior is not a number or plus infinity somewhere: a fault of the program, never accepted.
    NotConvergedError
        If no start with a finite log posterior is found.
    NotIdentifiableError
        If the covariance is not positive definite.
    CheckpointError
        If the checkpoint belongs to another run or cannot be used.
    """
    centre = np.asarray(centre, dtype=np.float64)
    n_dim = centre.size
    n_walkers = settings.walkers(n_dim)
    n_corrected = min(settings.n_corrected, n_walkers)
    names = tuple(names) or tuple(f"parameter {dim + 1}" for dim in range(n_dim))
    guarded = GuardedPosterior(log_posterior, names)
    cheap = None if surrogate is None else GuardedPosterior(surrogate, names)

    def evaluated(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        if evaluate is None:
            values = guarded(points)
            return values, values[:, None]
        found, blobs = evaluate(points)
        return guarded.checked(found, points), blobs

    session = (
        nullcontext(())
        if checkpoint is None
        else checkpoint.session(
            seed=settings.seed,
            n_ensembles=settings.n_ensembles,
            n_walkers=n_walkers,
            n_corrected=n_corrected,
            n_dim=n_dim,
            chunk_steps=settings.chunk_steps,
        )
    )
    with session as saved:
        chunks = list(saved)
        if not chunks:
            coords, log_prob = start_ensembles(
                guarded if cheap is None else cheap,
                centre,
                covariance,
                n_ensembles=settings.n_ensembles,
                n_walkers=n_walkers,
                seed=settings.seed,
            )
        learnt = None
        convergence = n_taus = None
        warm_up, length = WarmUp(), Length()
        while True:
            n_steps = len(chunks) * settings.chunk_steps
            is_taught = warm_up.follow(chunks)
            is_over = warm_up.first is not None
            at_end = n_steps >= settings.max_steps
            n_warm = min(warm_up.end, len(chunks) - 1) * settings.chunk_steps
            if at_end or (is_over and _gate_is_due(n_steps, n_warm, settings.chunk_steps)):
                burn_in = _burn_in(n_steps, n_warm, is_corrected=cheap is not None)
                kept = _after(burn_in, [chunk.draws for chunk in chunks])
                n_taus = length.in_taus(kept, settings.gate.tau_count_min)
                at_end |= is_hopeless(n_taus, n_steps - burn_in, settings)
                if at_end or n_taus >= settings.gate.tau_count_min:  # the rule that takes longest: the others can wait
                    chains = _joined(chunks, burn_in)
                    convergence = assess(chains.kept, settings.gate, names=names)
            if progress is not None and chunks:
                progress(Progress(n_steps, settings.max_steps, n_taus))
            if convergence is not None and (at_end or convergence.passed):
                return chains, convergence
            if chunks:
                coords, log_prob = chunks[-1].draws[:, -1], chunks[-1].log_prob[:, -1]
            rngs = [random_numbers(settings.seed, i, len(chunks)) for i in range(settings.n_ensembles)]
            if learnt is None or is_taught or not is_over:
                lesson = warm_up.lesson(chunks) if is_over else chunks[-1:]
                learnt = Learnt.of(lesson, centre, covariance, rngs, is_over)
            move: Steps | CorrectedSteps
            blobs = None
            if cheap is None or not is_over:
                move = stepping(guarded if cheap is None else cheap, learnt, settings.chunk_steps, n_walkers, rngs)
            else:
                move = correcting(cheap, evaluated, learnt, settings.chunk_steps, n_corrected, rngs)
                blobs = chunks[-1].blobs[:, -1]
                if len(chunks) == warm_up.first:
                    coords, log_prob, blobs = crossed(evaluated, coords[:, :n_corrected])
            chunk = advance(move, coords, log_prob, settings.chunk_steps, blobs)
            if checkpoint is not None:
                checkpoint.append(chunk)
            chunks.append(chunk)


def is_hopeless(n_taus: float, n_kept: int, settings: SamplerSettings) -> bool:
    """Whether not even twice the steps allowed would hold the autocorrelation times that are wanted.

    Draws of fewer steps than an autocorrelation time show less of it, never more, so that it is not said too early.

    Parameters
    ----------
    n_taus : float
        Length of the draws that are kept, in autocorrelation times of a slow parameter.
    n_kept : int
        The same in steps.
    settings : SamplerSettings
    """
    return settings.gate.tau_count_min * n_kept > 2 * settings.max_steps * n_taus


def _gate_is_due(n_steps: int, warm_up: int, chunk_steps: int) -> bool:
    """Return True at steps that grow by 10 %: judging costs, and depends on the count only, so resuming repeats it."""
    due = warm_up + 2 * chunk_steps
    while due < n_steps:
        due = -(-int(1.1 * due) // chunk_steps) * chunk_steps
    return due == n_steps


def _burn_in(n_steps: int, warm_up: int, *, is_corrected: bool) -> int:
    """Steps to discard: the warm-up at least, and behind that of a surrogate a sixth of the corrected steps too."""
    return warm_up + -(-(n_steps - warm_up) // 6) if is_corrected else max(warm_up, burn_in_steps(n_steps))


def _after(burn_in: int, parts: Sequence[FloatArray]) -> list[FloatArray]:
    """What stands behind the burn-in of parts of a run, (n_ensembles, n_steps, ...) arrays of equal length."""
    n_whole, n_steps = divmod(burn_in, parts[0].shape[1])
    return [parts[n_whole][:, n_steps:], *parts[n_whole + 1 :]]


def _joined(chunks: Sequence[Chunk], burn_in: int) -> Chains:
    """All chunks of a run in one: of the walkers that are in the last."""
    n_walkers = chunks[-1].draws.shape[2]
    draws = np.concatenate([chunk.draws[:, :, :n_walkers] for chunk in chunks], axis=1)
    log_prob = np.concatenate([chunk.log_prob[:, :, :n_walkers] for chunk in chunks], axis=1)
    found = _after(burn_in, [chunk.blobs for chunk in chunks])
    return Chains(draws, log_prob, burn_in, np.concatenate(found, axis=1) if all(b.shape[-1] for b in found) else None)
