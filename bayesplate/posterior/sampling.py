"""Draws from a posterior: four emcee ensembles, in chunks, until the convergence gate passes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import CheckpointError, Fault, InputError
from bayesplate.posterior.checkpoint import Checkpoint, Chunk
from bayesplate.posterior.convergence import Convergence, Gate, acceptance_by_walker, assess, burn_in_steps
from bayesplate.posterior.moves import Proposal, moves
from bayesplate.posterior.starting import EnsembleState, GuardedPosterior, LogPosterior, start_ensembles

FloatArray = NDArray[np.float64]

WARM_UP_CHUNKS = 3


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
        Walkers of each, even and at least twice the number of parameters; by default four times, and at least 32.
    chunk_steps : int
        Steps between two checkpoints.
    max_steps : int
        Where to stop without convergence; rounded up to whole chunks.
    gate : Gate
        When to stop with it.
    """

    seed: int
    n_ensembles: int = 4
    n_walkers: int | None = None
    chunk_steps: int = 100
    max_steps: int = 20_000
    gate: Gate = field(default_factory=Gate)

    def walkers(self, n_dim: int) -> int:
        """Return the number of walkers for `n_dim` parameters.

        Raises
        ------
        InputError
            If the settings cannot be used.
        """
        n_walkers = max(32, 4 * n_dim) if self.n_walkers is None else self.n_walkers
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
    """Every draw of a run, burn-in included.

    Attributes
    ----------
    draws : (n_ensembles, n_steps, n_walkers, n_dim) array
    log_prob : (n_ensembles, n_steps, n_walkers) array
    burn_in : int
        Steps to discard.
    """

    draws: FloatArray
    log_prob: FloatArray
    burn_in: int

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
    convergence : Convergence or None
        The last judgement; None before the first.
    """

    n_steps: int
    max_steps: int
    convergence: Convergence | None


def sample(
    log_posterior: LogPosterior,
    centre: FloatArray,
    covariance: FloatArray,
    settings: SamplerSettings,
    *,
    names: Sequence[str] = (),
    checkpoint: Checkpoint | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> tuple[Chains, Convergence]:
    """Sample until the gate passes or `settings.max_steps` are made.

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
        `passed` is False if the steps did not suffice: then nothing may be printed from the chains.

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
    guarded = GuardedPosterior(log_posterior, tuple(names) or tuple(f"parameter {dim + 1}" for dim in range(n_dim)))
    session = (
        nullcontext(())
        if checkpoint is None
        else checkpoint.session(
            seed=settings.seed,
            n_ensembles=settings.n_ensembles,
            n_walkers=n_walkers,
            n_dim=n_dim,
            chunk_steps=settings.chunk_steps,
        )
    )
    with session as saved:
        chunks = list(saved)
        if chunks:
            states = _states_after(chunks[-1])
        else:
            states = start_ensembles(
                guarded,
                centre,
                covariance,
                n_ensembles=settings.n_ensembles,
                n_walkers=n_walkers,
                seed=settings.seed,
            )
        convergence = None
        while True:
            n_steps = len(chunks) * settings.chunk_steps
            at_end = n_steps >= settings.max_steps
            if at_end or _gate_is_due(n_steps, settings.chunk_steps):
                chains = _joined(chunks)
                convergence = assess(chains.kept, settings.gate, names=names)
            if progress is not None and chunks:
                progress(Progress(n_steps, settings.max_steps, convergence))
            if convergence is not None and (at_end or convergence.passed):
                return chains, convergence
            chunk = _advance(guarded, states, settings.chunk_steps, _proposal(centre, covariance, chunks))
            if checkpoint is not None:
                checkpoint.append(chunk)
            chunks.append(chunk)
            states = _states_after(chunk)


def _proposal(centre: FloatArray, covariance: FloatArray, chunks: Sequence[Chunk]) -> Proposal:
    """What the next chunk proposes from: the estimate, each warm-up chunk in turn, and the last of them ever after."""
    if not chunks:
        return Proposal.with_covariance(centre, covariance)
    return Proposal.fitted(chunks[min(len(chunks), WARM_UP_CHUNKS) - 1].draws)


def _advance(guarded: GuardedPosterior, states: list[EnsembleState], n_steps: int, proposal: Proposal) -> Chunk:
    """Advance every ensemble by one chunk."""
    import emcee

    n_walkers, n_dim = states[0].coords.shape
    draws, log_prob, words, cached = [], [], [], []
    for state in states:
        sampler = emcee.EnsembleSampler(n_walkers, n_dim, guarded, moves=moves(proposal), vectorize=True)
        sampler.log_prob_fn = guarded  # emcee's own wrapper prints every exception to the terminal
        random_state = _to_emcee(state)
        sampler.random_state = random_state
        # emcee ignores a state it cannot use and would then go on from the global one, so read it back.
        if not _same_random_state(sampler.random_state, random_state):
            raise CheckpointError("random state: wanted the saved one, got another; the checkpoint cannot be resumed")
        start = emcee.State(state.coords, log_prob=state.log_prob, random_state=random_state)
        # The start was made positive definite on purpose; emcee's own check depends on the units of the parameters.
        sampler.run_mcmc(start, n_steps, skip_initial_state_check=True)
        _, key, position, kept_back, deviate = sampler.random_state
        draws.append(sampler.get_chain())
        log_prob.append(sampler.get_log_prob())
        words.append(np.concatenate([key, [position, kept_back]]).astype(np.uint32))
        cached.append(deviate)
    return Chunk(np.array(draws), np.array(log_prob), np.array(words), np.array(cached, dtype=np.float64))


def _to_emcee(state: EnsembleState) -> tuple[str, NDArray[np.uint32], int, int, float]:
    words = state.random_words
    return ("MT19937", words[:624], int(words[624]), int(words[625]), state.random_cached)


def _same_random_state(one: tuple[object, ...], other: tuple[object, ...]) -> bool:
    return np.array_equal(np.asarray(one[1]), np.asarray(other[1])) and (one[0], *one[2:]) == (other[0], *other[2:])


def _states_after(chunk: Chunk) -> list[EnsembleState]:
    """What the ensembles continue from; taken from the arrays that are saved, so resuming is the same path."""
    rows = zip(chunk.draws[:, -1], chunk.log_prob[:, -1], chunk.random_words, chunk.random_cached, strict=True)
    return [EnsembleState(coords, log_prob, words, float(cached)) for coords, log_prob, words, cached in rows]


def _gate_is_due(n_steps: int, chunk_steps: int) -> bool:
    """Return True at steps that grow by 10 %: judging costs, and depends on the count only, so resuming repeats it."""
    due = (WARM_UP_CHUNKS + 2) * chunk_steps
    while due < n_steps:
        due = -(-int(1.1 * due) // chunk_steps) * chunk_steps
    return due == n_steps


def _joined(chunks: list[Chunk]) -> Chains:
    draws = np.concatenate([chunk.draws for chunk in chunks], axis=1)
    log_prob = np.concatenate([chunk.log_prob for chunk in chunks], axis=1)
    warm_up = min(WARM_UP_CHUNKS, len(chunks) - 1) * chunks[0].draws.shape[1]
    return Chains(draws, log_prob, max(warm_up, burn_in_steps(draws.shape[1])))
