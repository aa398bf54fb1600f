"""Where the posterior of bare peaks may lie: the whole prior, searched with less and less noise.

Peaks without labels may be many different modes, and each way to take them is a peak of the likelihood of its own. All
of the prior is searched for these: a population of draws is weighted by the summed likelihood of the peaks
(`bayesplate.frequencies.peaks`) under a large noise, walks, and is weighted anew under a smaller one. The frequencies
come from a table over D_x / D_s and D_y / D_s: but for a common factor those of a bare plate depend on nothing else.

References
----------
Neal, Annealed importance sampling, Statistics and Computing, 2001.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import PriorCard
from bayesplate.frequencies.laws import log_frequency
from bayesplate.frequencies.model import OtherMode, SetupModel, setup_model
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.prior_bands import prior_draws
from bayesplate.frequencies.system import system_of
from bayesplate.modes.naming import Place
from bayesplate.modes.plate import Parity, Weights
from bayesplate.modes.reduced import reduced_order_model
from bayesplate.plate.board import Board, Values
from bayesplate.plate.material import RIGIDITIES, moduli
from bayesplate.plate.measured import Peak
from bayesplate.plate.setup import Setup

Floats = NDArray[np.float64]

NOISES = (0.08, 0.04, 0.02, 0.01)
"""Relative, one after the other; the last is what the tables err by, with a usual noise."""
LOUD = 0.02
"""Noise from which on guesses are taken: a plate that lacks an effect misses its peaks by more than the last one."""
MOST_FOUND = 4
"""Ways to take the peaks that are looked at under one noise."""
_N_DRAWS, _N_STEPS, _N_LOOKED_AT = 3000, 3, 1000
_N_NODES, _N_TRAINED = 11, 3
_RANGE = 0.005
"""Of the prior draws, on either side, that the tables leave out."""
_SPARE = 8
_MODES_PER_PEAK = 2.2
_JUMP, _JITTER = 0.7, 1e-3


@dataclass(frozen=True, eq=False)
class Guess:
    """A region of the constants in which one way to take the peaks is likely.

    Attributes
    ----------
    values : dict of float
        Rigidities at its middle (N m), and the nominal inputs.
    log_rigidities : (n_draws, 3) array
        ln D of draws from it.
    noise : float
        Relative, at which the peaks may be taken for modes there.
    """

    values: Values
    log_rigidities: Floats
    noise: float

    @property
    def rigidities(self) -> Floats:
        """Those at its middle, N m: (3,) array."""
        return np.array([self.values[name] for name in RIGIDITIES])


def search_widely(board: Board, prior: PriorCard, rng: np.random.Generator) -> list[Guess]:
    """Regions of the prior in which the peaks of a board are likely, the likeliest first.

    Parameters
    ----------
    board : Board
        Labels tell the symmetry class of their peak here, and nothing else.
    prior : PriorCard
    rng : numpy.random.Generator

    Returns
    -------
    list of Guess
        Those under a smaller noise first; empty where no draw has a frequency for every mode.
    """
    nominal = board.nominal()
    log_prior = _density(prior, nominal)
    drawn = prior_draws(board, prior, rng, _N_DRAWS)
    population = np.log(np.stack([drawn[name] for name in RIGIDITIES], axis=1))
    population = population[np.isfinite(population).all(axis=1)]
    setups = [_Spectrum.of(board, setup, population) for setup in board.setups if setup.readings or setup.peaks]

    def log_likelihood(x: Floats, noise: float) -> Floats:
        return np.sum([one.log_likelihood(x, noise) for one in setups], axis=0)

    weighted = np.zeros(len(population))
    guesses: list[Guess] = []
    for noise in NOISES:
        found = log_likelihood(population, noise)
        log_weights = found - weighted
        if not np.isfinite(log_weights).any():
            break
        shares = np.exp(log_weights - np.nanmax(log_weights))
        chosen = rng.choice(len(population), size=_N_DRAWS, p=shares / shares.sum())
        population, weighted = population[chosen], found[chosen]
        for _ in range(_N_STEPS):
            population, weighted = _walked(population, weighted, log_prior, log_likelihood, noise, rng)
        if noise <= LOUD:
            guesses = [*_guesses(nominal, population, setups, noise), *guesses]
    return guesses


def _guesses(nominal: Values, population: Floats, setups: Sequence[_Spectrum], noise: float) -> list[Guess]:
    """Members that take the peaks alike, the most frequent ways first."""
    some = population[:: max(1, len(population) // _N_LOOKED_AT)]
    ways = np.concatenate([one.assignments(some, noise) for one in setups], axis=1)
    order = Counter(map(tuple, ways.tolist())).most_common(MOST_FOUND)
    members = (some[(ways == np.array(way)).all(axis=1)] for way, _ in order)
    return [_guess(nominal, each, noise) for each in members]


def _density(prior: PriorCard, nominal: Values) -> Callable[[Floats], Floats]:
    """ln of the prior density of ln D at the nominal inputs."""

    def log_prior(x: Floats) -> Floats:
        D_x, D_y, D_s = np.exp(x).T
        constants = {"D_x": D_x, "D_y": D_y, "D_s": D_s}
        elastic = moduli(D_x, D_y, D_s, nominal["thickness"], nominal["poisson_xy"])
        by_name = constants | elastic._asdict()
        with np.errstate(invalid="ignore", divide="ignore"):
            parts = [one.log_density_of_log(np.log(by_name[name])) for name, one in prior.constants.items()]
        return np.nan_to_num(np.sum(parts, axis=0), nan=-np.inf)

    return log_prior


def _walked(
    population: Floats,
    log_likelihood_there: Floats,
    log_prior: Callable[[Floats], Floats],
    log_likelihood: Callable[[Floats, float], Floats],
    noise: float,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """One step of differential evolution of every member, under one noise."""
    n, n_dim = population.shape
    first, second = rng.integers(n, size=(2, n))
    jump = _JUMP * rng.random((n, 1)) * (population[first] - population[second])
    proposed = population + jump + _JITTER * rng.standard_normal((n, n_dim))
    there = log_likelihood(proposed, noise)
    gain = there - log_likelihood_there + log_prior(proposed) - log_prior(population)
    taken = np.log(rng.random(n)) < np.nan_to_num(gain, nan=-np.inf)
    return np.where(taken[:, None], proposed, population), np.where(taken, there, log_likelihood_there)


def _guess(nominal: Values, members: Floats, noise: float) -> Guess:
    middle = np.exp(np.median(members, axis=0))
    return Guess({**nominal, **dict(zip(RIGIDITIES, middle, strict=True))}, members[:64], noise)


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """The modes of a setup over the whole prior, and the peaks among which its readings are.

    Attributes
    ----------
    peaks : PeakLikelihood
    axes : tuple of array
        Nodes in ln D_x / D_s and ln D_y / D_s.
    table : (n, n, n_modes) array
        ln f (Hz) there at D_s = 1.
    """

    peaks: PeakLikelihood
    axes: tuple[Floats, Floats]
    table: Floats

    @classmethod
    def of(cls, board: Board, setup: Setup, population: Floats) -> _Spectrum:
        ratios = population[:, :2] - population[:, 2:]
        low, high = np.quantile(ratios, [_RANGE, 1.0 - _RANGE], axis=0)
        axes = np.linspace(low[0], high[0], _N_NODES), np.linspace(low[1], high[1], _N_NODES)
        bare = replace(setup, readings=(), peaks=_as_peaks(setup), hammer=None)
        scale = float(np.median(population[:, 2]))
        nominal = board.nominal()

        def weights(ratios: Floats) -> Weights:
            constants = np.exp(np.concatenate([ratios + scale, np.full((len(ratios), 1), scale)], axis=1))
            return system.weights({**nominal, **dict(zip(RIGIDITIES, constants.T, strict=True))})

        system = system_of(replace(board, setups=(bare,)), bare)
        middle = 0.5 * (low + high)[None]
        values = {**nominal, **dict(zip(RIGIDITIES, np.exp(np.r_[middle[0] + scale, scale]), strict=True))}
        model = setup_model(system, values)
        places = _places(model, len(bare.peaks))
        trained = np.array(list(product(*(np.linspace(*ends, _N_TRAINED) for ends in zip(low, high, strict=True)))))
        every = weights(trained)
        reduced = reduced_order_model(
            model.plate, places, weights(middle).at(0), [every.at(i) for i in range(len(trained))], [every.at(0)]
        )
        nodes = np.array(list(product(*axes)))
        table = log_frequency(reduced.eigenvalues(weights(nodes))) - 0.5 * scale
        others = tuple(OtherMode(place, None) for place in places)
        peaks = PeakLikelihood.of(replace(model, others=others))
        assert peaks is not None
        return cls(_by_class(peaks, setup, model, places), axes, table.reshape(_N_NODES, _N_NODES, -1))

    def log_likelihood(self, x: Floats, noise: float) -> Floats:
        """Of the peaks at (n, 3) ln D: (n,) array."""
        return self.peaks.log_likelihood(self._log_frequency(x), np.full(len(x), noise))

    def assignments(self, x: Floats, noise: float) -> NDArray[np.intp]:
        """The likeliest mode of each peak at each member, -1 for none: (n, n_peaks) array."""
        result = np.empty((len(x), self.peaks.log_alone.size), dtype=np.intp)
        every = self._log_frequency(x)
        for i in range(len(x)):
            shares = self.peaks.probabilities(every[i : i + 1], np.array([noise]))
            result[i] = np.where(shares.max(axis=1) > 1.0 - shares.sum(axis=1), shares.argmax(axis=1), -1)
        return result

    def _log_frequency(self, x: Floats) -> Floats:
        from scipy.interpolate import RegularGridInterpolator

        at = np.stack([np.clip(x[:, i] - x[:, 2], axis[0], axis[-1]) for i, axis in enumerate(self.axes)], axis=1)
        return np.asarray(RegularGridInterpolator(self.axes, self.table)(at) + 0.5 * x[:, 2:])


def _as_peaks(setup: Setup) -> tuple[Peak, ...]:
    return (*(Peak(reading.frequency) for reading in setup.readings), *(Peak(peak.frequency) for peak in setup.peaks))


def _places(model: SetupModel, n_peaks: int) -> tuple[Place, ...]:
    """So many modes of each symmetry class that the peaks are among them."""
    n_each = -(-int(_MODES_PER_PEAK * n_peaks + _SPARE) // len(model.plate.blocks))
    return tuple(Place(block.parity, rank, 1.0) for block in model.plate.blocks for rank in range(n_each))


def _by_class(peaks: PeakLikelihood, setup: Setup, model: SetupModel, places: Sequence[Place]) -> PeakLikelihood:
    """The peaks of sure labels are modes of the labels' classes."""
    log_prior = peaks.log_prior.copy()
    of_peak: dict[int, Parity] = {
        i: model.plate.parity(reading.beams) for i, reading in enumerate(setup.readings) if reading.is_sure
    }
    for row, bare in enumerate(peaks.bare):
        if int(bare) in of_peak:
            log_prior[row, [place.parity != of_peak[int(bare)] for place in places]] = -np.inf
    return replace(peaks, log_prior=log_prior)
