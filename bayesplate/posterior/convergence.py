"""The convergence gate: whether the draws of several ensembles may be turned into results.

Walkers of one ensemble depend on each other, so they are not chains. Here one chain is one ensemble, its walkers
pooled in time order, and the ensembles, started apart with their own random numbers, are what R-hat compares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Bools, Floats
from bayesplate.posterior.statistics import effective_sizes, rhat, thinning_step, walker_major

_TARGET_TAUS = 100  # suggested length: twice the least, so that the next run does not end just short


@dataclass(frozen=True)
class Gate:
    """Limits that the draws must meet before any constant is printed.

    Acceptance has no upper limit: good independent proposals are all accepted, and steps that are too short fail by
    their autocorrelation time.
    """

    rhat_max: float = 1.01  # split R-hat of the ensembles
    tau_count_min: float = 50.0  # length of each ensemble in its own autocorrelation times
    ess_min: float = 400.0  # of every parameter; 400 serves intervals, 2500 a comparison with an exact answer
    acceptance_min: float = 0.15  # mean of every ensemble
    walker_acceptance_min: float = 0.01  # of every walker


@dataclass(frozen=True)
class Convergence:
    """The verdict of the gate and the numbers behind it."""

    passed: bool
    reasons: tuple[str, ...]  # a sentence per failed rule, with its remedy
    tau: Floats  # (n_dim,), steps: integrated autocorrelation time, the largest of the ensembles
    rhat: Floats  # (n_dim,), rank-normalised split R-hat of the ensembles, by ArviZ
    ess: Floats  # (n_dim,), effective sample size, the smaller of that of the bulk and of the tails
    tau_max: float
    rhat_max: float
    ess_min: float
    acceptance: float  # mean fraction
    n_kept_steps: int  # after burn-in
    suggested_steps: int  # kept steps that should be enough (100 autocorrelation times), never fewer than now

    @property
    def n_taus(self) -> float:
        """Length of each ensemble in autocorrelation times of the slowest parameter."""
        return self.n_kept_steps / self.tau_max


def burn_in_steps(n_steps: int) -> int:
    """Number of `n_steps` to discard: a sixth, and at least 50 (or half of a very short run).

    A sixth is long enough whenever the gate passes: if the other five sixths hold 50 autocorrelation times, the
    discarded sixth holds 10, twice the recommended length.
    """
    return min(max(50, -(-n_steps // 6)), n_steps // 2)


def autocorrelation_times(draws: Floats) -> Floats:
    """Integrated autocorrelation time, steps, in (n_steps, n_walkers, n_dim) draws of an ensemble: (n_dim,) array.

    At least 1, for less would claim more than independent draws; infinite where a walker never moves.
    """
    from emcee.autocorr import integrated_time

    with np.errstate(invalid="ignore"):
        times = np.asarray(integrated_time(draws, tol=0, quiet=True))
    return np.where(np.isnan(times), np.inf, np.maximum(times, 1.0))


def length_in_taus(draws: Floats) -> float:
    """Length of (n_ensembles, n_steps, n_walkers, n_dim) draws in autocorrelation times of the slowest parameter.

    By every fourth walker, for a quick check.
    """
    return float(draws.shape[1] / max(autocorrelation_times(ensemble[:, ::4]).max() for ensemble in draws))


def acceptance_by_walker(draws: Floats) -> Floats:
    """Share of the steps at which each walker moved, from the kept draws: (n_ensembles, n_walkers) array."""
    fraction: Floats = np.any(draws[:, 1:] != draws[:, :-1], axis=-1).mean(axis=1)
    return fraction


def judge_convergence(draws: Floats, gate: Gate | None = None, *, names: Sequence[str] = ()) -> Convergence:
    """Judge (n_ensembles, n_steps, n_walkers, n_dim) draws after burn-in by the gate; `names` for the reasons."""
    gate = Gate() if gate is None else gate
    _, n_steps, _, n_dim = draws.shape
    tau = np.array([autocorrelation_times(ensemble) for ensemble in draws]).max(axis=0)
    thinned = draws[:, :: thinning_step(float(tau.max()))]
    rhats = rhat(thinned.reshape(len(draws), -1, n_dim))
    never_moves = np.any(np.ptp(draws, axis=(1, 2)) == 0.0, axis=0)
    ess = np.where(never_moves, 0.0, effective_sizes(walker_major(thinned)))
    acceptance = acceptance_by_walker(draws)
    needed = int(np.ceil(_TARGET_TAUS * tau.max())) if np.isfinite(tau.max()) else 2 * n_steps
    unjudged = Convergence(
        passed=False,
        reasons=(),
        tau=tau,
        rhat=rhats,
        ess=ess,
        tau_max=float(tau.max()),
        rhat_max=float(rhats.max()),
        ess_min=float(ess.min()),
        acceptance=float(acceptance.mean()),
        n_kept_steps=n_steps,
        suggested_steps=max(n_steps, needed),
    )
    names = tuple(names) or tuple(f"parameter {dim + 1}" for dim in range(n_dim))
    reasons = (*_faults_of_parameters(unjudged, gate, names, never_moves), *_faults_of_walkers(acceptance, gate))
    return replace(unjudged, passed=not reasons, reasons=reasons)


def _faults_of_parameters(
    convergence: Convergence, gate: Gate, names: tuple[str, ...], never_moves: Bools
) -> list[str]:
    """Sentences on the failed rules about parameters; comparisons are written so that nan fails."""
    reasons = []
    if never_moves.any():
        frozen = ", ".join(name for name, is_frozen in zip(names, never_moves, strict=True) if is_frozen)
        reasons.append(f"{frozen} never moves in an ensemble: check its prior and its bounds.")
    if not convergence.n_taus >= gate.tau_count_min:
        reasons.append(
            f"The ensembles hold {convergence.n_taus:.1f} autocorrelation times of "
            f"{names[int(np.argmax(convergence.tau))]}, {gate.tau_count_min:.0f} are wanted: "
            f"{convergence.suggested_steps} steps after burn-in would do."
        )
    if not convergence.rhat_max <= gate.rhat_max:
        reasons.append(
            f"The ensembles disagree about {names[int(np.argmax(convergence.rhat))]} "
            f"(R-hat {convergence.rhat_max:.3f}, at most {gate.rhat_max:g} is wanted): the posterior may have several "
            "peaks; look at labels, sizes and prior."
        )
    if not convergence.ess_min >= gate.ess_min:
        reasons.append(
            f"The effective sample size of {names[int(np.argmin(convergence.ess))]} is {convergence.ess_min:.0f}, "
            f"{gate.ess_min:.0f} is wanted: more steps would do."
        )
    return reasons


def _faults_of_walkers(acceptance: Floats, gate: Gate) -> list[str]:
    reasons = [
        f"Ensemble {number} accepts {100 * fraction:.0f} % of its proposals, at least "
        f"{100 * gate.acceptance_min:.0f} % is wanted: the posterior has a sharp edge or a long thin tail; "
        "tighten the priors or check the data."
        for number, fraction in enumerate(acceptance.mean(axis=1), start=1)
        if not fraction >= gate.acceptance_min
    ]
    n_stuck = int(np.sum(acceptance < gate.walker_acceptance_min))
    if n_stuck:
        reasons.append(
            f"{n_stuck} of {acceptance.size} walkers hardly ever move: they sit far from the others; change the seed, "
            "and check the data if it stays."
        )
    return reasons
