"""The convergence gate: whether the draws of several ensembles may be turned into results.

Walkers of one ensemble depend on each other, so they are not chains.  Here one chain is one ensemble, its walkers
pooled in time order, and the ensembles, started apart with their own random numbers, are what R-hat compares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft

FloatArray = NDArray[np.float64]

_WINDOW = 5.0  # autocorrelation times summed over, Sokal's rule
_TARGET_TAUS = 100  # what a suggestion aims at: twice the least, so that the next run does not end just short


@dataclass(frozen=True)
class Gate:
    """What the draws must satisfy before any constant is printed.

    Attributes
    ----------
    rhat_max : float
        Largest split R-hat of the ensembles.
    tau_count_min : float
        Least length of each ensemble in its own autocorrelation times.
    ess_min : float
        Least effective sample size of every parameter; 400 serves intervals, 2500 a comparison with an exact answer.
    acceptance_min : float
        Least mean acceptance fraction of every ensemble. There is no upper bound: good independent proposals are all
        accepted, and steps that are too short fail by their autocorrelation time.
    walker_acceptance_min : float
        Least acceptance fraction of any single walker.
    """

    rhat_max: float = 1.01
    tau_count_min: float = 50.0
    ess_min: float = 400.0
    acceptance_min: float = 0.15
    walker_acceptance_min: float = 0.01


@dataclass(frozen=True)
class Convergence:
    """The verdict of the gate and the numbers behind it.

    Attributes
    ----------
    passed : bool
        True if there is no reason against the draws.
    reasons : tuple of str
        One sentence a failed rule, with its remedy.
    tau : (n_dim,) array, steps
        Integrated autocorrelation time, the largest of the ensembles.
    rhat : (n_dim,) array
        Split R-hat of the ensembles.
    ess : (n_dim,) array
        Effective sample size, summed over the ensembles.
    tau_max, rhat_max, ess_min : float
        The worst of each.
    acceptance : float
        Mean acceptance fraction.
    n_kept_steps : int
        Steps judged, after burn-in.
    suggested_steps : int
        Kept steps that should be enough (100 autocorrelation times), never fewer than now.
    """

    passed: bool
    reasons: tuple[str, ...]
    tau: FloatArray
    rhat: FloatArray
    ess: FloatArray
    tau_max: float
    rhat_max: float
    ess_min: float
    acceptance: float
    n_kept_steps: int
    suggested_steps: int

    @property
    def n_taus(self) -> float:
        """Length of each ensemble in autocorrelation times of the slowest parameter."""
        return self.n_kept_steps / self.tau_max


def burn_in_steps(n_steps: int) -> int:
    """Return how many of `n_steps` are discarded: a sixth, and at least 100 (or half of a very short run).

    A sixth depends on the count alone, yet it is long enough whenever the gate passes: if the other five sixths hold
    50 autocorrelation times, the discarded one holds 10, twice what is asked for, and the start three times too wide
    is forgotten.
    """
    return min(max(100, -(-n_steps // 6)), n_steps // 2)


def autocorrelation_time(draws: FloatArray) -> FloatArray:
    """Return the integrated autocorrelation time of one ensemble.

    The autocovariance is averaged over the walkers, about the mean of the whole ensemble (not each walker's own, so
    that a walker which stays apart lengthens the time), and summed up to five autocorrelation times.

    Parameters
    ----------
    draws : (n_steps, n_walkers, n_dim) array
        One ensemble after burn-in.

    Returns
    -------
    (n_dim,) array, steps
        Infinite where a parameter never moves.

    References
    ----------
    A. Sokal, Monte Carlo Methods in Statistical Mechanics (1996); J. Goodman and J. Weare, Ensemble samplers with
    affine invariance (2010).
    """
    return np.array([_time_of(draws[:, :, dim]) for dim in range(draws.shape[2])])


def _time_of(series: FloatArray) -> float:
    """Integrated autocorrelation time of one parameter in one ensemble, from its (n_steps, n_walkers) draws."""
    n_steps = len(series)
    series = np.ascontiguousarray(series.T)
    if np.ptp(series) == 0.0:
        return float(np.inf)
    length = next_fast_len(2 * n_steps, real=True)  # padded, or the far end would wrap round
    spectrum = rfft(series - series.mean(), n=length, axis=-1)
    autocovariance = irfft((spectrum.real**2 + spectrum.imag**2).sum(axis=0), n=length)[:n_steps]
    sums = 2.0 * np.cumsum(autocovariance / autocovariance[0]) - 1.0
    outside = np.flatnonzero(np.arange(n_steps) >= _WINDOW * sums)
    return float(max(sums[outside[0] if outside.size else -1], 1.0))  # below 1 would claim more than independent draws


@dataclass
class Length:
    """How long growing ensembles are in autocorrelation times, looked at as far as it takes to say: not long enough.

    The parameter that was too slow last time is looked at first, for mostly it is still.

    Attributes
    ----------
    slow : (int, int)
        Ensemble and parameter of the last one that was too slow.
    """

    slow: tuple[int, int] = (0, 0)

    def in_taus(self, parts: Sequence[FloatArray], wanted: float) -> float:
        """Return the length in autocorrelation times of a parameter that is too slow; of the slowest if none is.

        Parameters
        ----------
        parts : sequence of (n_ensembles, n_steps, n_walkers, n_dim) arrays
            Draws after burn-in, one part behind the other.
        wanted : float
            Autocorrelation times that are long enough.
        """
        n_ensembles, _, _, n_dim = parts[0].shape
        shortest = np.inf
        for ensemble, dim in (self.slow, *product(range(n_ensembles), range(n_dim))):
            series = np.concatenate([part[ensemble, :, :, dim] for part in parts])
            shortest = min(shortest, len(series) / _time_of(series))
            if shortest < wanted:
                self.slow = ensemble, dim
                break
        return float(shortest)


def split_rhat(draws: FloatArray) -> FloatArray:
    """Return the split R-hat with one chain an ensemble, the larger of that of the draws and of their spread.

    Each ensemble is cut in two halves of time and each half, all its walkers together, is one chain.  The spread is
    the distance from the common median: it tells ensembles that agree in the mean but not in the width.

    Parameters
    ----------
    draws : (n_ensembles, n_steps, n_walkers, n_dim) array
        After burn-in.

    Returns
    -------
    (n_dim,) array
        1 for perfect agreement; infinite where a parameter never moves within the ensembles.

    References
    ----------
    A. Gelman et al., Bayesian Data Analysis (2013), 11.4; A. Vehtari et al., Rank-normalization, folding, and
    localization (2021), doi:10.1214/20-BA1221.
    """
    n_ensembles, n_steps, n_walkers, n_dim = draws.shape
    half = n_steps // 2
    chains = draws[:, : 2 * half].reshape(2 * n_ensembles, half * n_walkers, n_dim)
    folded = np.abs(chains - np.median(chains, axis=(0, 1)))
    return np.maximum(_rhat(chains), _rhat(folded))


def _rhat(chains: FloatArray) -> FloatArray:
    """R-hat of (n_chains, n_draws, n_dim) chains."""
    n_draws = chains.shape[1]
    within = chains.var(axis=1, ddof=1).mean(axis=0)
    between = chains.mean(axis=1).var(axis=0, ddof=1)
    moving = within > 0.0
    ratio = np.divide(between, within, out=np.full_like(within, np.inf), where=moving)
    rhat: FloatArray = np.sqrt((n_draws - 1) / n_draws + ratio)
    return rhat


def acceptance_by_walker(draws: FloatArray) -> FloatArray:
    """Return the fraction of steps at which each walker moved.

    Read off the draws, so that it counts the kept steps only; an accepted proposal equal to the old point has
    probability zero.

    Parameters
    ----------
    draws : (n_ensembles, n_steps, n_walkers, n_dim) array

    Returns
    -------
    (n_ensembles, n_walkers) array
    """
    fraction: FloatArray = np.any(draws[:, 1:] != draws[:, :-1], axis=-1).mean(axis=1)
    return fraction


def assess(draws: FloatArray, gate: Gate | None = None, *, names: Sequence[str] = ()) -> Convergence:
    """Judge the draws by the gate.

    Parameters
    ----------
    draws : (n_ensembles, n_steps, n_walkers, n_dim) array
        After burn-in.
    gate : Gate, optional
        The rules; the default ones if absent.
    names : sequence of str, optional
        Parameter names for the reasons.

    Returns
    -------
    Convergence
    """
    gate = Gate() if gate is None else gate
    _, n_steps, n_walkers, n_dim = draws.shape
    taus = np.array([autocorrelation_time(ensemble) for ensemble in draws])
    tau = taus.max(axis=0)
    rhat = split_rhat(draws)
    ess = (n_steps * n_walkers / taus).sum(axis=0)
    by_walker = acceptance_by_walker(draws)
    needed = int(np.ceil(_TARGET_TAUS * tau.max())) if np.isfinite(tau.max()) else 2 * n_steps
    unjudged = Convergence(
        passed=False,
        reasons=(),
        tau=tau,
        rhat=rhat,
        ess=ess,
        tau_max=float(tau.max()),
        rhat_max=float(rhat.max()),
        ess_min=float(ess.min()),
        acceptance=float(by_walker.mean()),
        n_kept_steps=n_steps,
        suggested_steps=max(n_steps, needed),
    )
    names = tuple(names) or tuple(f"parameter {dim + 1}" for dim in range(n_dim))
    never_moves = np.any(np.ptp(draws, axis=(1, 2)) == 0.0, axis=0)
    reasons = (*_faults_of_parameters(unjudged, gate, names, never_moves), *_faults_of_walkers(by_walker, gate))
    return replace(unjudged, passed=not reasons, reasons=reasons)


def _faults_of_parameters(
    found: Convergence, gate: Gate, names: tuple[str, ...], never_moves: NDArray[np.bool_]
) -> list[str]:
    """Sentences about the rules that hold for each parameter, written so that a number that is none fails them."""
    reasons = []
    if never_moves.any():
        frozen = ", ".join(name for name, still in zip(names, never_moves, strict=True) if still)
        reasons.append(f"{frozen} never moves in an ensemble: check its prior and its bounds.")
    if not found.n_taus >= gate.tau_count_min:
        reasons.append(
            f"The ensembles hold {found.n_taus:.1f} autocorrelation times of "
            f"{names[int(np.argmax(found.tau))]}, {gate.tau_count_min:.0f} are wanted: "
            f"{found.suggested_steps} steps after burn-in would do."
        )
    if not found.rhat_max <= gate.rhat_max:
        reasons.append(
            f"The ensembles disagree about {names[int(np.argmax(found.rhat))]} (R-hat {found.rhat_max:.3f}, at most "
            f"{gate.rhat_max:g} is wanted): the posterior may have several peaks; look at labels, sizes and prior."
        )
    if not found.ess_min >= gate.ess_min:
        reasons.append(
            f"The effective sample size of {names[int(np.argmin(found.ess))]} is {found.ess_min:.0f}, "
            f"{gate.ess_min:.0f} is wanted: more steps would do."
        )
    return reasons


def _faults_of_walkers(by_walker: FloatArray, gate: Gate) -> list[str]:
    """Sentences about acceptance."""
    reasons = [
        f"Ensemble {number} accepts {100 * fraction:.0f} % of its proposals, at least "
        f"{100 * gate.acceptance_min:.0f} % is wanted: the posterior has a sharp edge or a long thin tail; "
        "tighten the priors or check the data."
        for number, fraction in enumerate(by_walker.mean(axis=1), start=1)
        if not fraction >= gate.acceptance_min
    ]
    n_stuck = int(np.sum(by_walker < gate.walker_acceptance_min))
    if n_stuck:
        reasons.append(
            f"{n_stuck} of {by_walker.size} walkers hardly ever move: they sit far from the others; change the seed, "
            "and check the data if it stays."
        )
    return reasons
