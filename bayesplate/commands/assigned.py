"""Peaks assigned to the modes of a board whose constants are mostly known, by the likelihood of its spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values, vibrating_lengths
from bayesplate.board.material import ORTHOTROPIC, Symmetry
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak
from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.frequencies.model import setup_model, with_others
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.system import system_of
from bayesplate.plate.solve import Modes, solve_up_to
from bayesplate.recordings.contract import sign_of, spurious_share

if TYPE_CHECKING:
    from bayesplate.frequencies.model import SetupModel
    from bayesplate.posterior.first_labels import Way
    from bayesplate.recordings.picking import Picked, PickedMode

Floats = NDArray[np.float64]
Place = tuple[float, float]

_N_DRAWS = 200
_ABOVE = 1.16
"""Up to above the highest peak, somewhat more than the modes that a setup's model takes."""


def bare_board(board: Board, likely: Sequence[PickedMode], picked: Picked, flips: bool | None) -> Board:
    """A board with the peaks in place of all that was read before; signs where the polarity is known."""
    (setup,) = board.setups
    peaks = tuple(
        Peak(Quantity.from_mean(one.frequency, one.sd), sign_of(picked.spectra, one, flips)) for one in likely
    )
    spurious = spurious_share([one.spurious for one in likely])
    return replace(board, setups=(replace(setup, readings=(), peaks=peaks, spurious=spurious),))


@dataclass(frozen=True, eq=False)
class MostlyKnown:
    """The modes of a board about the constants that one way to label its peaks gives.

    Attributes
    ----------
    model : SetupModel
        Of the setup with nothing but bare peaks.
    log_rigidities : (n_draws, n_constants) array
        Of the free ones.
    noise : float
        Relative, with which the labelled peaks scatter about the plate.
    symmetry : Symmetry
        Of the board.
    """

    model: SetupModel
    values: Values
    log_rigidities: Floats
    noise: float
    symmetry: Symmetry = ORTHOTROPIC

    def with_peaks(self, board: Board) -> MostlyKnown:
        """The same with other peaks of the same setup: signs joined to the same frequencies."""
        (setup,) = board.setups
        return replace(self, model=replace(self.model, system=replace(self.model.system, setup=setup)))

    @cached_property
    def likelihood(self) -> PeakLikelihood:
        """Of the bare peaks."""
        found = PeakLikelihood.of(self.model)
        assert found is not None
        return found

    @cached_property
    def _draws(self) -> tuple[Floats, Floats]:
        """ln f of all modes at every draw, and the noise there."""
        free = np.exp(self.log_rigidities).T
        values = {**self.values, **self.symmetry.rigidities(free, self.values["poisson_xy"])}
        every = self.model.every_log_frequency(values, "linear")
        usable = np.isfinite(every).all(axis=1)
        return every[usable], np.full(int(usable.sum()), self.noise)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the modes, as labels."""
        return tuple("cannot tell" if label is None else str(label) for label in self.likelihood.labels)

    def probabilities(self, evidence: Floats | None) -> Floats:
        """Of each peak to be each mode: (n_peaks, n_modes) array, the peaks in the order of the setup.

        Parameters
        ----------
        evidence : (n_peaks, n_modes) array, optional
            ln of what else speaks for each pair.
        """
        result = np.empty(self.likelihood.log_prior.shape)
        result[self.likelihood.bare] = self._with(evidence).probabilities(*self._draws)
        return result

    def gain(self, evidence: Floats) -> float:
        """ln of how much likelier all peaks are together with further evidence."""
        from scipy.special import logsumexp

        after, before = (self._with(one).log_likelihood(*self._draws) for one in (evidence, None))
        return float(logsumexp(after) - logsumexp(before))

    def _with(self, evidence: Floats | None) -> PeakLikelihood:
        if evidence is None:
            return self.likelihood
        return replace(self.likelihood, log_prior=self.likelihood.log_prior + evidence[self.likelihood.bare])

    @cached_property
    def _modes(self) -> Modes:
        highest = 2.0 * np.pi * _ABOVE * max(self.model.setup.unlabelled)
        return solve_up_to(self.model.plate, self.model.system.weights(self.values).at(0), highest**2)

    @cached_property
    def _columns(self) -> NDArray[np.intp]:
        """Which of the solved modes each mode of the model is."""
        modes = self._modes
        at = {(parity, int(rank)): i for i, (parity, rank) in enumerate(zip(modes.parities, modes.ranks, strict=True))}
        return np.array([at[other.place.parity, other.place.rank] for other in self.model.others], dtype=np.intp)

    @property
    def hertz(self) -> Floats:
        """Frequencies of the modes: (n_modes,) array."""
        return np.asarray(np.sqrt(self._modes.eigenvalues[self._columns]) / (2.0 * np.pi))

    def shapes(self, grid: Floats) -> Floats:
        """Deflections at fractions of the vibrating sides: (n_modes, n, n) array."""
        return self._modes.displacement(grid, grid)[self._columns]

    @cached_property
    def largest(self) -> Floats:
        """The largest residue that each shape gives between any two places: (n_modes,) array."""
        return np.asarray(np.max(np.abs(self.shapes(np.linspace(0.0, 1.0, 41))), axis=(1, 2)) ** 2)

    def deflections(self, place: Place) -> Floats:
        """Of each mode at a place, m from the corner of the whole board: (n_modes,) array."""
        setup, fractions = self.model.setup, []
        for axis, position, side in zip("xy", place, vibrating_lengths(self.values, setup), strict=True):
            edge = f"{axis}0"
            covered = self.values[setup.input_name(edge)] if edge in setup.clamped else 0.0
            fractions.append(float(np.clip((position - covered) / side, 0.0, 1.0)))
        x, y = (np.array([one]) for one in fractions)
        return np.asarray(self._modes.displacement(x, y)[self._columns, 0, 0])


def mostly_known(way: Way, bare: Board) -> MostlyKnown:
    """The modes about the constants of one way to label the peaks.

    Parameters
    ----------
    bare : Board
        With all the peaks, bare.
    """
    estimate = weighted_least_squares(way.board)
    scales = estimate.scales
    symmetry = bare.symmetry
    spare = max(estimate.residuals.size - symmetry.n, 1)
    widening = max(float(np.sqrt(np.sum((estimate.residuals / scales) ** 2) / spare)), 1.0)
    covariance = widening**2 * identifiability(estimate.sensitivities, scales, symmetry).covariance
    middle = np.log(symmetry.free_of(estimate.values))
    logs = np.random.default_rng(0).multivariate_normal(middle, covariance, _N_DRAWS)
    (setup,) = bare.setups
    model = with_others(setup_model(system_of(bare, setup), estimate.values), estimate.values)
    return MostlyKnown(model, estimate.values, logs, widening * setup.noise.median, symmetry)
