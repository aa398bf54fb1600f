"""Geweke's joint test: constants and readings drawn in turn must keep the distribution in which they start.

A chain starts with constants from the prior and readings from them. Each step moves the constants by the sampler's own
steps under the posterior of the present readings, then draws readings anew from the constants. Prior, likelihood,
simulation of readings and steps agree only if the joint distribution stays what it was; its moments are compared with
those of independent draws. The error of a moment is taken between chains, so that it needs no autocorrelation time.

References
----------
J. Geweke, Getting it right: joint distribution tests of posterior simulators, Journal of the American Statistical
Association 99 (2004), doi:10.1198/016214504000001132.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from validation.calibration.records import Record
from validation.calibration.truths import Design, reference

from bayesplate.board.quantity import Quantity
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.posterior.mixture import Mixture
from bayesplate.posterior.moves import IndependentMove
from bayesplate.posterior.target import Posterior

N_CHAINS, N_STEPS = 20, 2000
N_INDEPENDENT = 100_000
N_UPDATES = 16
"""Of each chain between two drawings of its readings: emcee's own moves look at other walkers, with other readings."""
NOISE = Quantity.from_median(0.15, 1.5)
"""So large that a step of the constants is no small part of their prior's width, and 2000 of them cross it often."""
DESIGN = Design(law="fixed-linear", resolution=1.0)
MUTANTS = ("every reading counted twice", "errors drawn half as large")
MOST_BEYOND_THREE, FARTHEST = 1, 4.0

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class ByRow(Posterior):
    """The posterior of as many sets of readings as there are chains: row i of any points is of chain i mod n_chains.

    Attributes
    ----------
    hertz : (n_chains, n_modes) array
    is_counted_twice : bool
        Whether every reading is taken for two, where the density is to be wrong.
    """

    hertz: Floats = field(default_factory=lambda: np.empty((0, 0)))
    is_counted_twice: bool = False

    def log_likelihood_of(self, mode_log_frequencies: Sequence[Floats], theta: Floats) -> Floats:
        rows = np.arange(len(theta)) % len(self.hertz)
        (predicted,) = self.labelled(mode_log_frequencies)
        (errors,) = self.readings
        told = replace(errors, frequency=self.hertz[rows])
        found = told.log_likelihood(predicted, np.exp(self.parameters.log_noise(theta))[:, 0])
        return 2.0 * found if self.is_counted_twice else found


def density(posterior: ByRow, theta: Floats) -> Floats:
    """Log density of every row under its own readings; rows outside the support stay in their places."""
    log_prior = posterior.log_prior(theta)
    inside = np.isfinite(log_prior)
    safe = np.where(inside[:, None], theta, _a_point())
    return np.where(inside, log_prior + posterior.log_likelihood(safe).sum(axis=1), -np.inf)


@lru_cache(maxsize=1)
def reference_posterior() -> Posterior:
    """The board of the design under one linear law, with the large noise; its readings are replaced."""
    problem = reference(DESIGN)
    board = DESIGN.board(DESIGN.placeholders, NOISE)
    return Posterior(board, problem.prior, problem.posterior.models, "linear")


@lru_cache(maxsize=1)
def _a_point() -> Floats:
    return prior_draws(1, np.random.default_rng(0))[0]


def prior_draws(n: int, rng: np.random.Generator) -> Floats:
    """Constants, noise and inputs from the prior: (n, n_dim) array."""
    posterior, found = reference_posterior(), np.empty((0, reference_posterior().parameters.n_dim))
    while len(found) < n:
        drawn = posterior.prior_transform(rng.random((n, found.shape[1])))
        found = np.concatenate([found, drawn[np.isfinite(posterior.log_prior(drawn))]])  # where a material exists
    return found[:n]


def readings(theta: Floats, rng: np.random.Generator, error: float = 1.0) -> Floats:
    """Readings of every row, Hz, rounded: (n, n_modes) array; errors are so many times as large as the noise says."""
    posterior = reference_posterior()
    (predicted,) = posterior.log_frequencies(theta)
    errors: ReadingErrors = posterior.readings[0]
    return errors.simulate(predicted, error * np.exp(posterior.parameters.log_noise(theta))[:, 0], rng)


def moments(theta: Floats, hertz: Floats) -> Floats:
    """The twelve that are compared: (n, 12) array; first and second moments of six columns."""
    parameters = reference_posterior().parameters
    poisson = theta[:, parameters.first_input + parameters.inputs.index("poisson_xy")]
    first = np.column_stack([theta[:, :4], poisson, np.log(hertz[:, 0])])
    centred = first - _centre()
    return np.concatenate([centred, centred**2], axis=1)


NAMES = tuple(
    f"{one}{power}" for power in ("", " squared") for one in ("ln D_x", "ln D_y", "ln D_s", "ln noise", "nu", "ln f")
)


@lru_cache(maxsize=1)
def _centre() -> Floats:
    """Near the means, so that the squares are variances."""
    theta = prior_draws(500, np.random.default_rng(1))
    parameters = reference_posterior().parameters
    poisson = theta[:, parameters.first_input + parameters.inputs.index("poisson_xy")]
    hertz = readings(theta, np.random.default_rng(2))
    return np.column_stack([theta[:, :4], poisson, np.log(hertz[:, 0])]).mean(axis=0)


def run_chains(n_chains: int, n_steps: int, seed: int, mutant: str = "") -> Floats:
    """Means of the moments over each chain: (n_chains, 12) array.

    Parameters
    ----------
    n_chains, n_steps : int
    seed : int
    mutant : str
        One of `MUTANTS`, a disagreement that has to be found; "" for none.
    """
    rng = np.random.default_rng(seed)
    spread = prior_draws(1000, rng)
    mixture, random = Mixture.fitted(spread), np.random.RandomState(rng.integers(2**32, size=8))
    theta = prior_draws(n_chains, rng)
    base = reference_posterior()
    error = 0.5 if mutant == MUTANTS[1] else 1.0
    total = np.zeros((n_chains, len(NAMES)))
    for _ in range(n_steps):
        hertz = readings(theta, rng, error)
        posterior = ByRow(base.board, base.prior, base.models, "linear", hertz=hertz,
                          is_counted_twice=mutant == MUTANTS[0])  # fmt: skip
        move = IndependentMove(mixture)
        model: Any = SimpleNamespace(log_prob_fn=lambda points, one=posterior: density(one, points), random=random)
        state: Any = SimpleNamespace(coords=theta, log_prob=density(posterior, theta))
        for _ in range(N_UPDATES):
            state, _ = move.propose(model, state)
        theta = state.coords
        total += moments(theta, hertz)
    return total / n_steps


def check_one(n_chains: int, n_steps: int, seed: int, mutant: str) -> Record:
    """One run of all chains, and its twelve standardised differences from independent draws."""
    z = standardised(run_chains(n_chains, n_steps, seed, mutant), independent(N_INDEPENDENT))
    return {"chains": n_chains, "steps": n_steps, "seed": seed, "mutant": mutant, "z": dict(zip(NAMES, z, strict=True))}


def independent(n: int) -> tuple[Floats, Floats]:
    """Means of the moments over n independent draws of constants and readings, and their standard errors."""
    rng = np.random.default_rng(3)
    theta = prior_draws(n, rng)
    found = moments(theta, readings(theta, rng))
    return found.mean(axis=0), found.std(axis=0) / np.sqrt(n)


def standardised(means: Floats, alone: tuple[Floats, Floats]) -> list[float]:
    """Differences over their errors, as normal deviates: between few chains they are Student's."""
    n = len(means)
    between = means.std(axis=0, ddof=1) / np.sqrt(n)
    t = (means.mean(axis=0) - alone[0]) / np.hypot(between, alone[1])
    tail = stats.t.logsf(np.abs(t), n - 1)
    return (np.sign(t) * stats.norm.isf(np.exp(np.maximum(tail, -700.0)))).tolist()


def agrees(z: Sequence[float]) -> bool:
    """Whether all are within four and at most one beyond three."""
    size = np.abs(np.asarray(z))
    return bool(size.max() <= FARTHEST and np.sum(size > 3.0) <= MOST_BEYOND_THREE)


def identity() -> dict[str, Any]:
    """What a file of these records must agree in."""
    return {"format": 1, "part": "joint", "noise": repr(NOISE), "design": repr(DESIGN), "updates": N_UPDATES}


def judge(records: Sequence[Record]) -> tuple[list[str], bool]:
    """Lines to print, and whether all is well."""
    lines, well = [], True
    for mutant in ("", *MUTANTS):
        found = next((record for record in records if record["mutant"] == mutant), None)
        title = mutant or "production"
        if found is None:
            lines.append(f"{title}: not run")
            well = False
            continue
        if found["chains"] < N_CHAINS or found["steps"] < N_STEPS:
            lines.append(
                f"{title}: {found['chains']} chains of {found['steps']}, {N_CHAINS} of {N_STEPS} are needed to judge"
            )
            well = False
            continue
        z = found["z"]
        is_right = agrees(list(z.values()))
        worst = max(z, key=lambda name: abs(z[name]))
        verdict = ("agree" if is_right else "DO NOT AGREE") if not mutant else ("NOT CAUGHT" if is_right else "caught")
        lines.append(
            f"{title}, {found['chains']} chains of {found['steps']}: the farthest of {len(z)} moments is {worst} by "
            f"{z[worst]:+.1f} standard errors: {verdict}"
        )
        well &= is_right is not bool(mutant)
    return lines, well
