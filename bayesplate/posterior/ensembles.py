"""Walkers: ensembles of emcee with separate random streams, and the pilot walk that gives their starting points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.posterior.checkpoint import Snapshot
from bayesplate.posterior.mixture import Mixture
from bayesplate.posterior.moves import moves
from bayesplate.posterior.starts import LogDensity, draws_around_estimate, finite_starts
from bayesplate.streams import random_stream

_PILOT_STEPS = 40
FEWEST_ROUNDS, _MOST_ROUNDS = 3, 60
_PAIRS_A_ROUND = 8
"""Pairs of parameters for each round of a pilot whose proposals the ensembles use."""
_REFIT_RATIO = 1.2
"""Ratio of the number of rounds from one fit of the proposals to the next."""
_LEAST_RISE = 1.0
"""A pilot whose mean log density rises by this much from one round to the next has not arrived."""


class Ensembles:
    """Walkers of several emcee samplers, each with its own random state."""

    def __init__(
        self,
        log_density: LogDensity,
        centre: Floats,
        factor: Floats,  # lower Cholesky factor of the estimate's covariance
        seed: int,
        shape: tuple[int, int],  # ensembles, and walkers of each
        initial_draws: Floats | None = None,  # (n_draws, n_dim) draws of nearly the same density
        walk: int = 0,  # number of this walk among those of a run
    ) -> None:
        self.log_density, self.centre, self.factor, self.seed, self.shape = log_density, centre, factor, seed, shape
        self.initial_draws = initial_draws
        self._stream = ("walk", walk) if walk else ()
        self.n_steps = 0
        self._backends: list[Any] = []

    def begin(self, saved: Snapshot | None) -> None:
        """Continue a saved run, or begin a new one."""
        from emcee.backends import Backend

        if saved is None:
            self._backends = [Backend() for _ in range(self.shape[0])]
        else:
            self._backends, self.n_steps = list(saved.backends), saved.n_steps

    @cached_property
    def pilot(self) -> Pilot:
        """The walk from the starts to where the ensembles begin."""
        rng, n_walkers = random_stream(self.seed, *self._stream, "pilot"), self.shape[0] * self.shape[1]
        if self.initial_draws is not None:
            return pilot_from_draws(self.log_density, self.initial_draws, rng, n_walkers)
        n_rounds = len(self.centre) ** 2 // _PAIRS_A_ROUND
        return pilot(self.log_density, self.centre, self.factor, rng, n_walkers, n_rounds)

    @property
    def chain(self) -> Floats:
        """(n_ensembles, n_steps, n_walkers, n_dim) array."""
        return np.stack([backend.chain for backend in self._backends])

    @property
    def log_prob(self) -> Floats:
        """(n_ensembles, n_steps, n_walkers) array."""
        return np.stack([backend.log_prob for backend in self._backends])

    @property
    def snapshot(self) -> Snapshot:
        """State of the run."""
        states = [backend.random_state for backend in self._backends]
        return Snapshot(tuple(self._backends), states, self.n_steps)

    def advance(self, n_steps: int) -> None:
        """Advance all ensembles by `n_steps`."""
        for i, backend in enumerate(self._backends):
            start = None if self.n_steps else self._start(i)
            advance_ensemble(self.log_density, self.pilot.mixture, backend, start, n_steps)
        self.n_steps += n_steps

    def _start(self, ensemble: int) -> Any:
        """Start of an ensemble: its share of the pilot's walkers, and its own random stream."""
        import emcee

        walkers = slice(ensemble, None, self.shape[0])
        state = random_state(random_stream(self.seed, *self._stream, "ensemble", ensemble))
        return emcee.State(self.pilot.points[walkers], log_prob=self.pilot.log_prob[walkers], random_state=state)


def advance_ensemble(log_density: LogDensity, mixture: Mixture, backend: Any, start: Any, n_steps: int) -> None:
    """Advance the walkers of one ensemble by `n_steps`, from the end of its backend unless a start is given.

    emcee's check that walkers span the space depends on the units of the parameters, and is skipped.
    """
    import emcee

    n_walkers, n_dim = backend.shape if start is None else start.coords.shape
    sampler = emcee.EnsembleSampler(
        n_walkers, n_dim, log_density, moves=moves(mixture), vectorize=True, backend=backend
    )
    sampler.log_prob_fn = log_density  # emcee's own wrapper prints what it raises
    sampler.run_mcmc(start, n_steps, skip_initial_state_check=True)


def random_state(rng: np.random.Generator) -> Any:
    """A state of the generator that emcee uses, drawn from a stream."""
    return np.random.RandomState(rng.integers(2**32, size=8)).get_state()


@dataclass(frozen=True, eq=False)
class Pilot:
    """Result of a pilot walk to the posterior: starting points of the ensembles, and their proposals."""

    draws: Floats  # (n_draws, n_dim), of the last third of its rounds: near the posterior
    mixture: Mixture  # fitted to the last two thirds of its rounds
    points: Floats  # (n_walkers, n_dim), the last points of the walkers
    log_prob: Floats  # (n_walkers,)


def pilot(
    log_density: LogDensity,
    centre: Floats,
    factor: Floats,
    rng: np.random.Generator,
    n_walkers: int = 128,
    fewest_rounds: int = FEWEST_ROUNDS,
) -> Pilot:
    """Walk from three standard errors around the estimate to the posterior, in rounds that improve the proposals.

    `factor` is the lower Cholesky factor of the estimate's covariance.
    """
    import emcee

    n_walkers = max(n_walkers, 2 * len(centre) + 2)
    points, log_prob = finite_starts(log_density, draws_around_estimate(centre, factor, rng), n_walkers)
    start: Any = emcee.State(points, log_prob=log_prob, random_state=random_state(rng))
    backend, mixture, previous = emcee.backends.Backend(), Mixture.with_covariance(centre, factor @ factor.T), -np.inf
    fewest_rounds = min(max(fewest_rounds, FEWEST_ROUNDS), _MOST_ROUNDS)
    next_fit = 1
    for n_rounds in range(1, _MOST_ROUNDS + 1):
        advance_ensemble(log_density, mixture, backend, start, _PILOT_STEPS)
        start, mean = None, float(backend.log_prob[-_PILOT_STEPS:].mean())
        is_last = n_rounds == _MOST_ROUNDS or (n_rounds >= fewest_rounds and mean - previous < _LEAST_RISE)
        if n_rounds >= next_fit or is_last:
            mixture = Mixture.fitted(_last_rounds(backend, n_rounds, 2))
            next_fit = max(n_rounds + 1, int(_REFIT_RATIO * n_rounds))
        if is_last:
            break
        previous = mean
    draws = _last_rounds(backend, n_rounds, 1).reshape(-1, len(centre))
    return Pilot(draws, mixture, backend.chain[-1], backend.log_prob[-1])


def _last_rounds(backend: Any, n_rounds: int, thirds: int) -> Floats:
    """Draws of the last `thirds` of the rounds: (n_steps, n_walkers, n_dim) array."""
    return np.asarray(backend.chain[-_PILOT_STEPS * max(1, thirds * n_rounds // 3) :])


def pilot_from_draws(log_density: LogDensity, initial_draws: Floats, rng: np.random.Generator, n_walkers: int) -> Pilot:
    """A pilot without a walk, from (n_draws, n_dim) draws of nearly the same density."""
    starts = finite_starts(log_density, lambda n: initial_draws[rng.integers(len(initial_draws), size=n)], n_walkers)
    return Pilot(initial_draws, Mixture.fitted(initial_draws), *starts)
