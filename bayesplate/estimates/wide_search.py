"""Search of the whole prior, under less and less noise, for the posterior of peaks without labels.

Peaks without labels may be many different modes, and each assignment of them to modes is a maximum of the likelihood of
its own. All of the prior is searched for these: a population of draws is weighted by the summed likelihood of the peaks
(`bayesplate.frequencies.peaks`) under a large noise, walks, and is weighted anew under a smaller one. The frequencies
come from a table over D_x / D_s and D_y / D_s: up to a common factor those of a bare plate depend on nothing else. Its
modes are combinations of those at some members of the population, solved anew when that has become much narrower.

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
from bayesplate.board.material import RIGIDITIES, moduli_of
from bayesplate.board.prior import PriorCard
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import DEFAULT_NOISE, Setup
from bayesplate.frequencies.laws import log_frequency
from bayesplate.frequencies.model import OtherMode, SetupModel, setup_model
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.prior_bands import prior_draws
from bayesplate.frequencies.system import System, system_of
from bayesplate.plate.naming import ModePlace
from bayesplate.plate.reduced import ReducedOrderModel
from bayesplate.plate.reduction import reduced_order_model
from bayesplate.plate.terms import Parity

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator


NOISES = (0.08, 0.04, 0.02, 0.01)
"""Relative noise, one after the other; the last is the error of the tables with a usual noise."""
LOUD_NOISE, LOUDEST_NOISE = 0.02, 0.04
"""Noise from which on the most frequent assignments are tried, and noise from which on regions are: a plate that lacks
an effect misses its peaks by more than the last noise."""
MOST_ASSIGNMENTS, MOST_REGIONS = 4, 6
"""Assignments of the peaks that are tried under one noise, and regions of the constants of which one assignment is."""
FAR_APART = 0.5
"""Distance of ln D: walks lead from one solution to another that is nearer, and do not find one that is farther off."""
_N_FIRST, _N_DRAWS, _N_STEPS, _N_LOOKED_AT = 30_000, 3000, 3, 1000
_N_NODES = (21, 15, 11, 11)
"""Nodes of the tables under each noise, per axis: between them frequencies err by less than the noise."""
_N_TRAINED = 10
_NARROWER_RANGE = 0.5
"""Range of the population over that at which the modes were solved, below which they are solved anew."""
_TAIL_SHARE = 0.005
"""Share of the population, on either side, that the tables leave out."""
_TOLERANCE = 3.0
"""Error of the law, cents: far below the distance at which peaks are told apart."""
_SPARE_MODES = 8
_MODES_PER_PEAK = 2.2
_JUMP, _JITTER = 0.7, 1e-3


@dataclass(frozen=True, eq=False)
class Guess:
    """A region of the constants in which one assignment of the peaks to modes is likely."""

    values: Values  # at its middle
    log_rigidities: Floats  # (n_draws, n_constants): ln of the free rigidities of draws from it
    noise: float  # relative, at which the peaks may be taken for modes there

    @property
    def rigidities(self) -> Floats:
        """D_x, D_y, D_s at its middle, N m: (3,) array."""
        return np.array([self.values[name] for name in RIGIDITIES])


def are_far_apart(first: Floats, second: Floats) -> bool:
    """Whether two sets of ln D are too far apart for a walk."""
    return bool(np.abs(first - second).max() > FAR_APART)


def search_widely(board: Board, prior: PriorCard, rng: np.random.Generator) -> list[Guess]:
    """Regions of the prior in which the peaks of a board are likely: of smaller noise first, then likelier ones first.

    Labels give the symmetry class of their peak here, and nothing else. Empty where no draw has a frequency for each
    mode.
    """
    nominal = board.nominal()
    log_prior = _log_prior_density(prior, nominal)
    drawn = prior_draws(board, prior, rng, _N_FIRST)
    population = np.log(np.stack([drawn[name] for name in RIGIDITIES], axis=1))
    population = population[np.isfinite(log_prior(population))]
    if not len(population):
        return []
    peaked_setups = [setup for setup in board.setups if setup.readings or setup.peaks]
    setup_modes: list[_SetupModes] = []
    last_log_likelihood, trained_extent = np.zeros(len(population)), np.full(2, np.inf)
    by_noise: list[list[Guess]] = []
    for noise, n_nodes in zip(NOISES, _N_NODES, strict=True):
        extent = np.ptp(_ratio_range(population), axis=0)
        if (extent < _NARROWER_RANGE * trained_extent).any():
            setup_modes, trained_extent = (
                [_SetupModes.of(board, setups, population) for setups in _alike_setups(peaked_setups)],
                extent,
            )
        tabled = _TabledLikelihood(tuple((modes.table(population, n_nodes), modes.peaks) for modes in setup_modes))
        log_likelihood = tabled.log_likelihood(population, noise)
        log_weights = log_likelihood - last_log_likelihood
        if not np.isfinite(log_weights).any():
            break
        shares = np.exp(log_weights - np.nanmax(log_weights))
        chosen = rng.choice(len(population), size=_N_DRAWS, p=shares / shares.sum())
        population, last_log_likelihood = population[chosen], log_likelihood[chosen]
        for _ in range(_N_STEPS):
            population, last_log_likelihood = _walk(population, last_log_likelihood, log_prior, tabled, noise, rng)
        if noise <= LOUDEST_NOISE:
            by_noise.insert(0, _frequent_assignments(nominal, population, tabled, noise))
    return _select_guesses(by_noise)


def _frequent_assignments(nominal: Values, population: Floats, tabled: _TabledLikelihood, noise: float) -> list[Guess]:
    """Guesses from members with the same assignment of the peaks, the most frequent assignments first."""
    members = population[:: max(1, len(population) // _N_LOOKED_AT)]
    assignments, rows = np.unique(tabled.assignments(members, noise), axis=0, return_inverse=True)
    order = np.argsort(-np.bincount(rows.ravel(), minlength=len(assignments)), kind="stable")
    return [_guess_from(nominal, members[rows.ravel() == row], noise) for row in order]


def _select_guesses(by_noise: Sequence[Sequence[Guess]]) -> list[Guess]:
    """The most frequent assignments under each small noise, and the most frequent one of each region without any.

    A model that lacks an effect of the real board fits its peaks worse than a wrong plate may by chance: the right
    plate is then among the members while the noise is large, but not among the most frequent assignments.
    """
    selected: list[Guess] = []
    for guesses_at_noise in by_noise:
        n_regions = 0
        for rank, guess in enumerate(guesses_at_noise):
            is_elsewhere = n_regions < MOST_REGIONS and all(
                are_far_apart(np.log(guess.rigidities), np.log(chosen.rigidities)) for chosen in selected
            )
            n_regions += is_elsewhere
            if is_elsewhere or (rank < MOST_ASSIGNMENTS and guess.noise <= LOUD_NOISE):
                selected.append(guess)
    return selected


def _log_prior_density(prior: PriorCard, nominal: Values) -> Callable[[Floats], Floats]:
    """ln of the prior density of ln D at the nominal inputs."""

    def log_prior(x: Floats) -> Floats:
        constants = dict(zip(RIGIDITIES, np.exp(x).T, strict=True))
        by_name = constants | moduli_of({**nominal, **constants})._asdict()
        with np.errstate(invalid="ignore", divide="ignore"):
            log_densities = [
                constant_prior.log_density_of_log(np.log(by_name[name]))
                for name, constant_prior in prior.constants.items()
            ]
        return np.nan_to_num(np.sum(log_densities, axis=0), nan=-np.inf, neginf=-np.inf)

    return log_prior


def _walk(
    population: Floats,
    log_likelihood: Floats,
    log_prior: Callable[[Floats], Floats],
    tabled: _TabledLikelihood,
    noise: float,
    rng: np.random.Generator,
) -> tuple[Floats, Floats]:
    """One step of differential evolution of every member, under one noise."""
    n, n_dim = population.shape
    first, second = rng.integers(n, size=(2, n))
    jump = _JUMP * rng.random((n, 1)) * (population[first] - population[second])
    proposed = population + jump + _JITTER * rng.standard_normal((n, n_dim))
    proposed_log_likelihood = tabled.log_likelihood(proposed, noise)
    gain = proposed_log_likelihood - log_likelihood + log_prior(proposed) - log_prior(population)
    is_accepted = np.log(rng.random(n)) < np.nan_to_num(gain, nan=-np.inf)
    return np.where(is_accepted[:, None], proposed, population), np.where(
        is_accepted, proposed_log_likelihood, log_likelihood
    )


def _guess_from(nominal: Values, members: Floats, noise: float) -> Guess:
    middle = np.exp(np.median(members, axis=0))
    return Guess({**nominal, **dict(zip(RIGIDITIES, middle, strict=True))}, members[:64], noise)


@dataclass(frozen=True, eq=False)
class _SetupModes:
    """The modes of a plate in one setup, and the peaks of all setups that hold it alike."""

    system: System
    nominal: Values
    reduced: ReducedOrderModel  # of the modes at some members of a population
    scale: float  # ln D_s at which it is evaluated
    peaks: tuple[PeakLikelihood, ...]

    @classmethod
    def of(cls, board: Board, setups: Sequence[Setup], population: Floats) -> _SetupModes:
        bare_setups = [replace(setup, readings=(), peaks=_readings_as_peaks(setup), hammer=None) for setup in setups]
        system = _symmetric_system(system_of(replace(board, setups=(bare_setups[0],)), bare_setups[0]))
        nominal, scale = board.nominal(), float(np.median(population[:, 2]))
        middle, *ratios = _spread_members(population)
        weights = system.weights(_values_at_ratios(nominal, np.array(ratios), scale))
        centre = system.weights(_values_at_ratios(nominal, middle[None], scale)).at(0)
        constants = dict(zip(RIGIDITIES, np.exp(np.r_[middle + scale, scale]), strict=True))
        model = setup_model(system, {**nominal, **constants})
        places = _lowest_places(model, max(len(bare_setup.peaks) for bare_setup in bare_setups))
        around = [weights.at(i) for i in range(len(ratios))]
        reduced = reduced_order_model(model.plate, places, centre, [], around, _TOLERANCE)
        other_modes = tuple(OtherMode(place, None) for place in places)
        peaks = []
        for setup, bare_setup in zip(setups, bare_setups, strict=True):
            likelihood = PeakLikelihood.of(
                replace(model, system=replace(system, setup=bare_setup), other_modes=other_modes)
            )
            assert likelihood is not None
            peaks.append(_limit_to_classes(likelihood, setup, model, places))
        return cls(system, nominal, reduced, scale, tuple(peaks))

    def table(self, population: Floats, n_nodes: int) -> RegularGridInterpolator:
        """ln f (Hz) of each mode at D_s = 1 over ln D_x / D_s and ln D_y / D_s, where a population is.

        There are as many nodes between any two ranks of the members.
        """
        from scipy.interpolate import RegularGridInterpolator

        ranks = np.linspace(_TAIL_SHARE, 1.0 - _TAIL_SHARE, n_nodes)
        axes = tuple(np.unique(np.quantile(ratio, ranks)) for ratio in _ratios(population).T)
        weights = self.system.weights(_values_at_ratios(self.nominal, np.array(list(product(*axes))), self.scale))
        log_hertz = log_frequency(self.reduced.eigenvalues(weights)) - 0.5 * self.scale
        return RegularGridInterpolator(axes, log_hertz.reshape(*(axis.size for axis in axes), -1))


@dataclass(frozen=True, eq=False)
class _TabledLikelihood:
    """The likelihood of the peaks of all setups where a population is."""

    # frequencies of setups that are alike, and the peaks of each
    tables: tuple[tuple[RegularGridInterpolator, tuple[PeakLikelihood, ...]], ...]

    def log_likelihood(self, x: Floats, noise: float) -> Floats:
        """ln of the likelihood of all peaks at (n, 3) ln D: (n,), minus infinity where the table has no plate."""
        noises = np.full(len(x), noise)
        log_likelihoods = [
            likelihood.log_likelihood(log_hertz, noises)
            for log_hertz, peaks in self._tabled_frequencies(x)
            for likelihood in peaks
        ]
        return np.nan_to_num(np.sum(log_likelihoods, axis=0), nan=-np.inf, neginf=-np.inf)

    def assignments(self, x: Floats, noise: float) -> Indices:
        """The likeliest mode of each peak at each member, -1 for none: (n, n_peaks) array, setup by setup."""
        modes = []
        for log_hertz, peaks in self._tabled_frequencies(x):
            for likelihood in peaks:
                is_mode = likelihood.probabilities_of_each(log_hertz, np.full(len(log_hertz), noise))
                is_none = 1.0 - is_mode.sum(axis=1)
                modes.append(np.where(is_mode.max(axis=1) > is_none, is_mode.argmax(axis=1), -1))
        return np.concatenate(modes).T

    def _tabled_frequencies(self, x: Floats) -> Iterator[tuple[Floats, tuple[PeakLikelihood, ...]]]:
        for table, peaks in self.tables:
            ends = np.array([[axis[0], axis[-1]] for axis in table.grid]).T
            positions = np.clip(_ratios(x), *ends)
            yield np.asarray(table(positions) + 0.5 * x[:, 2:]), peaks


def _ratio_range(population: Floats) -> Floats:
    """Ends of the range of ln D_x / D_s and ln D_y / D_s that tables cover: (2, 2) array."""
    return np.quantile(_ratios(population), [_TAIL_SHARE, 1.0 - _TAIL_SHARE], axis=0)


def _spread_members(population: Floats) -> Floats:
    """Ratios of the middle member and of further ones, each as far as possible from those before: (n_spread, 2)."""
    ratios, (low, high) = _ratios(population), _ratio_range(population)
    inside = ratios[((ratios >= low) & (ratios <= high)).all(axis=1)]
    positions = (inside - np.median(inside, axis=0)) / np.maximum(high - low, 1e-12)
    chosen = [int(np.argmin((positions**2).sum(axis=1)))]
    nearest = np.full(len(positions), np.inf)
    for _ in range(_N_TRAINED):
        nearest = np.minimum(nearest, ((positions - positions[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(np.argmax(nearest)))
    return np.asarray(inside[chosen])


def _ratios(x: Floats) -> Floats:
    """ln D_x / D_s and ln D_y / D_s: (n, 2) array."""
    return x[:, :2] - x[:, 2:]


def _values_at_ratios(nominal: Values, ratios: Floats, scale: float) -> Values:
    """Values at (n, 2) ratios, with ln D_s at a scale."""
    constants = np.exp(np.concatenate([ratios + scale, np.full((len(ratios), 1), scale)], axis=1))
    return {**nominal, **dict(zip(RIGIDITIES, constants.T, strict=True))}


def _symmetric_system(system: System) -> System:
    """The system without effects that break its symmetry: they are slow to solve, and shift frequencies little."""
    return replace(system, effects=tuple(effect for effect in system.effects if all(effect.keeps_symmetry())))


def _alike_setups(setups: Iterable[Setup]) -> list[list[Setup]]:
    groups: list[tuple[Setup, list[Setup]]] = []
    for setup in setups:
        key = replace(setup, name="", readings=(), peaks=(), noise=DEFAULT_NOISE, hammer=None)
        alike = [members for group_key, members in groups if group_key == key]
        if alike:
            alike[0].append(setup)
        else:
            groups.append((key, [setup]))
    return [members for _, members in groups]


def _readings_as_peaks(setup: Setup) -> tuple[Peak, ...]:
    peaks: tuple[Reading | Peak, ...] = (*setup.readings, *setup.peaks)
    return tuple(Peak(peak.frequency, spurious=peak.spurious) for peak in peaks)


def _lowest_places(model: SetupModel, n_peaks: int) -> tuple[ModePlace, ...]:
    """The lowest modes of each symmetry class, enough to hold the peaks."""
    n_per_class = -(-int(_MODES_PER_PEAK * n_peaks + _SPARE_MODES) // len(model.plate.classes))
    return tuple(ModePlace(c.parity, rank, 1.0) for c in model.plate.classes for rank in range(n_per_class))


def _limit_to_classes(
    peaks: PeakLikelihood, setup: Setup, model: SetupModel, places: Sequence[ModePlace]
) -> PeakLikelihood:
    """The likelihood in which a peak of a sure label can only be a mode of the label's symmetry class."""
    log_prior = peaks.log_prior.copy()
    of_peak: dict[int, Parity] = {
        i: model.plate.parity(reading.beams) for i, reading in enumerate(setup.readings) if reading.is_sure
    }
    for row, bare in enumerate(peaks.unlabelled):
        if int(bare) in of_peak:
            log_prior[row, [place.parity != of_peak[int(bare)] for place in places]] = -np.inf
    return replace(peaks, log_prior=log_prior)
