"""Where the posterior of bare peaks may lie: the whole prior, searched with less and less noise.

Peaks without labels may be many different modes, and each way to take them is a peak of the likelihood of its own. All
of the prior is searched for these: a population of draws is weighted by the summed likelihood of the peaks
(`bayesplate.frequencies.peaks`) under a large noise, walks, and is weighted anew under a smaller one. The frequencies
come from a table over D_x / D_s and D_y / D_s: but for a common factor those of a bare plate depend on nothing else.
Its modes are combinations of those at some members of the population, found again when that has become much narrower.

References
----------
Neal, Annealed importance sampling, Statistics and Computing, 2001.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board, Values
from bayesplate.board.material import RIGIDITIES, moduli
from bayesplate.board.prior import PriorCard
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import DEFAULT_NOISE, Setup
from bayesplate.frequencies.laws import log_frequency
from bayesplate.frequencies.model import OtherMode, SetupModel, setup_model
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.prior_bands import prior_draws
from bayesplate.frequencies.system import System, system_of
from bayesplate.plate.naming import Place
from bayesplate.plate.reduced import ReducedOrderModel
from bayesplate.plate.reduction import reduced_order_model
from bayesplate.plate.terms import Parity

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator


NOISES = (0.08, 0.04, 0.02, 0.01)
"""Relative, one after the other; the last is what the tables err by, with a usual noise."""
LOUD, LOUDEST = 0.02, 0.04
"""Noise from which on the most frequent ways are looked at, and regions: a plate that lacks an effect misses its peaks
by more than the last one."""
MOST_FOUND, MOST_REGIONS = 4, 6
"""Ways to take the peaks that are looked at under one noise, and regions of the constants of which one way is."""
FAR = 0.5
"""Of ln D: walks lead from one answer to another that is nearer, and do not find one that is farther off."""
_N_FIRST, _N_DRAWS, _N_STEPS, _N_LOOKED_AT = 30_000, 3000, 3, 1000
_N_NODES = (21, 15, 11, 11)
"""Of the tables under each noise, per axis: between them frequencies are off by less than the noise."""
_N_TRAINED = 10
_NARROWER = 0.5
"""Range of the population, beside that for which modes were found, from which on they are found again."""
_RANGE = 0.005
"""Of the prior draws, on either side, that the tables leave out."""
_TOLERANCE = 3.0
"""Error of the law, cents: far below the distance at which peaks are told apart."""
_SPARE = 8
_MODES_PER_PEAK = 2.2
_JUMP, _JITTER = 0.7, 1e-3


@dataclass(frozen=True, eq=False)
class Guess:
    """A region of the constants in which one way to take the peaks is likely."""

    values: Values  # at its middle
    log_rigidities: Floats  # (n_draws, n_constants): ln of the free rigidities of draws from it
    noise: float  # relative, at which the peaks may be taken for modes there

    @property
    def rigidities(self) -> Floats:
        """D_x, D_y, D_s at its middle, N m: (3,) array."""
        return np.array([self.values[name] for name in RIGIDITIES])


def are_far_apart(first: Floats, second: Floats) -> bool:
    """Whether two sets of ln D are other constants altogether."""
    return bool(np.abs(first - second).max() > FAR)


def search_widely(board: Board, prior: PriorCard, rng: np.random.Generator) -> list[Guess]:
    """Regions of the prior in which the peaks of a board are likely: of smaller noise, then likelier ones first.

    Labels tell the symmetry class of their peak here, and nothing else. Empty where no draw has a frequency for each
    mode.
    """
    nominal = board.nominal()
    log_prior = _density(prior, nominal)
    drawn = prior_draws(board, prior, rng, _N_FIRST)
    population = np.log(np.stack([drawn[name] for name in RIGIDITIES], axis=1))
    population = population[np.isfinite(log_prior(population))]
    if not len(population):
        return []
    used = [setup for setup in board.setups if setup.readings or setup.peaks]
    every: list[_Modes] = []
    weighted, trained = np.zeros(len(population)), np.full(2, np.inf)
    by_noise: list[list[Guess]] = []
    for noise, n_nodes in zip(NOISES, _N_NODES, strict=True):
        extent = np.ptp(_range(population), axis=0)
        if (extent < _NARROWER * trained).any():
            every, trained = [_Modes.of(board, setups, population) for setups in _alike(used)], extent
        tabled = _Tabled(tuple((modes.table(population, n_nodes), modes.peaks) for modes in every))
        there = tabled.log_likelihood(population, noise)
        log_weights = there - weighted
        if not np.isfinite(log_weights).any():
            break
        shares = np.exp(log_weights - np.nanmax(log_weights))
        chosen = rng.choice(len(population), size=_N_DRAWS, p=shares / shares.sum())
        population, weighted = population[chosen], there[chosen]
        for _ in range(_N_STEPS):
            population, weighted = _walked(population, weighted, log_prior, tabled, noise, rng)
        if noise <= LOUDEST:
            by_noise.insert(0, _ways(nominal, population, tabled, noise))
    return _guesses(by_noise)


def _ways(nominal: Values, population: Floats, tabled: _Tabled, noise: float) -> list[Guess]:
    """Members that take the peaks alike, the most frequent ways first."""
    some = population[:: max(1, len(population) // _N_LOOKED_AT)]
    ways, own = np.unique(tabled.assignments(some, noise), axis=0, return_inverse=True)
    order = np.argsort(-np.bincount(own.ravel(), minlength=len(ways)), kind="stable")
    return [_guess(nominal, some[own.ravel() == way], noise) for way in order]


def _guesses(by_noise: Sequence[Sequence[Guess]]) -> list[Guess]:
    """The most frequent ways under each small noise, and the most frequent one of each region that none of them is in.

    A board that lacks what a real one has fits its peaks worse than another may by chance: the right plate is then
    among the members while the noise is large, but not among the most frequent ways.
    """
    guesses: list[Guess] = []
    for ways in by_noise:
        n_regions = 0
        for at, way in enumerate(ways):
            is_elsewhere = n_regions < MOST_REGIONS and all(
                are_far_apart(np.log(way.rigidities), np.log(other.rigidities)) for other in guesses
            )
            n_regions += is_elsewhere
            if is_elsewhere or (at < MOST_FOUND and way.noise <= LOUD):
                guesses.append(way)
    return guesses


def _density(prior: PriorCard, nominal: Values) -> Callable[[Floats], Floats]:
    """ln of the prior density of ln D at the nominal inputs."""

    def log_prior(x: Floats) -> Floats:
        D_x, D_y, D_s = np.exp(x).T
        constants = {"D_x": D_x, "D_y": D_y, "D_s": D_s}
        elastic = moduli(D_x, D_y, D_s, nominal["thickness"], nominal["poisson_xy"])
        by_name = constants | elastic._asdict()
        with np.errstate(invalid="ignore", divide="ignore"):
            parts = [one.log_density_of_log(np.log(by_name[name])) for name, one in prior.constants.items()]
        return np.nan_to_num(np.sum(parts, axis=0), nan=-np.inf, neginf=-np.inf)

    return log_prior


def _walked(
    population: Floats,
    log_likelihood_there: Floats,
    log_prior: Callable[[Floats], Floats],
    tabled: _Tabled,
    noise: float,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """One step of differential evolution of every member, under one noise."""
    n, n_dim = population.shape
    first, second = rng.integers(n, size=(2, n))
    jump = _JUMP * rng.random((n, 1)) * (population[first] - population[second])
    proposed = population + jump + _JITTER * rng.standard_normal((n, n_dim))
    there = tabled.log_likelihood(proposed, noise)
    gain = there - log_likelihood_there + log_prior(proposed) - log_prior(population)
    taken = np.log(rng.random(n)) < np.nan_to_num(gain, nan=-np.inf)
    return np.where(taken[:, None], proposed, population), np.where(taken, there, log_likelihood_there)


def _guess(nominal: Values, members: Floats, noise: float) -> Guess:
    middle = np.exp(np.median(members, axis=0))
    return Guess({**nominal, **dict(zip(RIGIDITIES, middle, strict=True))}, members[:64], noise)


@dataclass(frozen=True, eq=False)
class _Modes:
    """The modes of a plate in one setup, and the peaks of the setups that are like it."""

    system: System
    nominal: Values
    reduced: ReducedOrderModel  # of the modes at some members of a population
    scale: float  # ln D_s at which it is evaluated
    peaks: tuple[PeakLikelihood, ...]

    @classmethod
    def of(cls, board: Board, setups: Sequence[Setup], population: Floats) -> _Modes:
        bare = [replace(setup, readings=(), peaks=_as_peaks(setup), hammer=None) for setup in setups]
        system = _symmetric(system_of(replace(board, setups=(bare[0],)), bare[0]))
        nominal, scale = board.nominal(), float(np.median(population[:, 2]))
        middle, *trained = _spread(population)
        every = system.weights(_values(nominal, np.array(trained), scale))
        centre = system.weights(_values(nominal, middle[None], scale)).at(0)
        constants = dict(zip(RIGIDITIES, np.exp(np.r_[middle + scale, scale]), strict=True))
        model = setup_model(system, {**nominal, **constants})
        places = _places(model, max(len(one.peaks) for one in bare))
        around = [every.at(i) for i in range(len(trained))]
        reduced = reduced_order_model(model.plate, places, centre, [], around, _TOLERANCE)
        others = tuple(OtherMode(place, None) for place in places)
        peaks = []
        for setup, one in zip(setups, bare, strict=True):
            found = PeakLikelihood.of(replace(model, system=replace(system, setup=one), others=others))
            assert found is not None
            peaks.append(_by_class(found, setup, model, places))
        return cls(system, nominal, reduced, scale, tuple(peaks))

    def table(self, population: Floats, n_nodes: int) -> RegularGridInterpolator:
        """ln f (Hz) of each mode at D_s = 1 over ln D_x / D_s and ln D_y / D_s, where a population is.

        There are as many nodes between any two ranks of the members.
        """
        from scipy.interpolate import RegularGridInterpolator

        ranks = np.linspace(_RANGE, 1.0 - _RANGE, n_nodes)
        axes = tuple(np.unique(np.quantile(one, ranks)) for one in _ratios(population).T)
        weights = self.system.weights(_values(self.nominal, np.array(list(product(*axes))), self.scale))
        log_hertz = log_frequency(self.reduced.eigenvalues(weights)) - 0.5 * self.scale
        return RegularGridInterpolator(axes, log_hertz.reshape(*(axis.size for axis in axes), -1))


@dataclass(frozen=True, eq=False)
class _Tabled:
    """The likelihood of the peaks of all setups where a population is."""

    # frequencies of setups that are alike, and the peaks of each
    every: tuple[tuple[RegularGridInterpolator, tuple[PeakLikelihood, ...]], ...]

    def log_likelihood(self, x: Floats, noise: float) -> Floats:
        """ln of the likelihood of all peaks at (n, 3) ln D: (n,), minus infinity where the table has no plate."""
        noises = np.full(len(x), noise)
        each = [one.log_likelihood(there, noises) for there, peaks in self._there(x) for one in peaks]
        return np.nan_to_num(np.sum(each, axis=0), nan=-np.inf, neginf=-np.inf)

    def assignments(self, x: Floats, noise: float) -> Indices:
        """The likeliest mode of each peak at each member, -1 for none: (n, n_peaks) array, setup by setup."""
        ways = []
        for there, peaks in self._there(x):
            for one in peaks:
                is_mode = one.probabilities_of_each(there, np.full(len(there), noise))
                is_none = 1.0 - is_mode.sum(axis=1)
                ways.append(np.where(is_mode.max(axis=1) > is_none, is_mode.argmax(axis=1), -1))
        return np.concatenate(ways).T

    def _there(self, x: Floats) -> Iterator[tuple[Floats, tuple[PeakLikelihood, ...]]]:
        for table, peaks in self.every:
            ends = np.array([[axis[0], axis[-1]] for axis in table.grid]).T
            at = np.clip(_ratios(x), *ends)
            yield np.asarray(table(at) + 0.5 * x[:, 2:]), peaks


def _range(population: Floats) -> Floats:
    """Ends of the range of ln D_x / D_s and ln D_y / D_s that tables cover: (2, 2) array."""
    return np.quantile(_ratios(population), [_RANGE, 1.0 - _RANGE], axis=0)


def _spread(population: Floats) -> Floats:
    """Ratios of the middle member and of others, each as far as can be from those before: (n_spread, 2) array."""
    ratios, (low, high) = _ratios(population), _range(population)
    inside = ratios[((ratios >= low) & (ratios <= high)).all(axis=1)]
    at = (inside - np.median(inside, axis=0)) / np.maximum(high - low, 1e-12)
    chosen = [int(np.argmin((at**2).sum(axis=1)))]
    nearest = np.full(len(at), np.inf)
    for _ in range(_N_TRAINED):
        nearest = np.minimum(nearest, ((at - at[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(np.argmax(nearest)))
    return np.asarray(inside[chosen])


def _ratios(x: Floats) -> Floats:
    """ln D_x / D_s and ln D_y / D_s: (n, 2) array."""
    return x[:, :2] - x[:, 2:]


def _values(nominal: Values, ratios: Floats, scale: float) -> Values:
    """Values at (n, 2) ratios, with ln D_s at a scale."""
    constants = np.exp(np.concatenate([ratios + scale, np.full((len(ratios), 1), scale)], axis=1))
    return {**nominal, **dict(zip(RIGIDITIES, constants.T, strict=True))}


def _symmetric(system: System) -> System:
    """The system without effects that break its symmetry: they cost much, and move its frequencies by little."""
    return replace(system, effects=tuple(effect for effect in system.effects if all(effect.keeps_symmetry())))


def _alike(setups: Iterable[Setup]) -> list[list[Setup]]:
    found: list[tuple[Setup, list[Setup]]] = []
    for setup in setups:
        held = replace(setup, name="", readings=(), peaks=(), noise=DEFAULT_NOISE, hammer=None)
        same = [members for one, members in found if one == held]
        if same:
            same[0].append(setup)
        else:
            found.append((held, [setup]))
    return [members for _, members in found]


def _as_peaks(setup: Setup) -> tuple[Peak, ...]:
    every: tuple[Reading | Peak, ...] = (*setup.readings, *setup.peaks)
    return tuple(Peak(one.frequency, spurious=one.spurious) for one in every)


def _places(model: SetupModel, n_peaks: int) -> tuple[Place, ...]:
    """The lowest modes of each symmetry class, enough to hold the peaks."""
    n_each = -(-int(_MODES_PER_PEAK * n_peaks + _SPARE) // len(model.plate.classes))
    return tuple(Place(one.parity, rank, 1.0) for one in model.plate.classes for rank in range(n_each))


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
