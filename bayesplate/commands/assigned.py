"""Peaks assigned to the modes of a board whose constants are mostly known, by the likelihood of its spectrum."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.effects.attached_items import fractions_of
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.estimates.wide_search import Guess
from bayesplate.frequencies.model import SetupModel, setup_model, with_other_modes
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.system import system_of
from bayesplate.plate.solve import Modes, solve_up_to
from bayesplate.posterior.first_labels import Labelling, guess_of

if TYPE_CHECKING:
    from bayesplate.recordings.signals import Place


_FREQUENCY_MARGIN = 1.16
"""Modes are solved up to the highest peak times this, somewhat more than a setup's model takes."""
_GRID = np.linspace(0.0, 1.0, 41)


@dataclass(frozen=True, eq=False)
class PeakAssignment:
    """The modes of a board with one setup of unlabelled peaks, at the constants that one labelling of them gives."""

    board: Board
    model: SetupModel
    guess: Guess

    @classmethod
    def of(cls, labelling: Labelling, board: Board) -> PeakAssignment:
        """The modes at the constants of a labelling of some peaks of `board`."""
        estimate = weighted_least_squares(labelling.board)
        model = with_other_modes(setup_model(system_of(board, board.setups[0]), estimate.values), estimate.values)
        return cls(board, model, guess_of(board, estimate))

    def with_peaks(self, board: Board) -> PeakAssignment:
        """The same with other peaks of the setup: signs joined to the same frequencies."""
        system = replace(self.model.system, setup=board.setups[0])
        return replace(self, board=board, model=replace(self.model, system=system))

    @property
    def names(self) -> tuple[str, ...]:
        """Labels of the modes."""
        return tuple("cannot tell" if label is None else str(label) for label in self._likelihood.labels)

    def probabilities(self, evidence: Floats | None) -> Floats:
        """Probability of each peak to be each mode, with further `evidence` in ln: (n_peaks, n_modes) array."""
        result = np.empty(self._likelihood.log_prior.shape)
        result[self._likelihood.unlabelled] = self._likelihood_with(evidence).probabilities(*self._draws)
        return result

    def gain(self, evidence: Floats) -> float:
        """ln of the factor by which further evidence raises the likelihood of all peaks."""
        from scipy.special import logsumexp

        after, before = (self._likelihood_with(term).log_likelihood(*self._draws) for term in (evidence, None))
        return float(logsumexp(after) - logsumexp(before))

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
        return np.asarray(np.max(np.abs(self.shapes(_GRID)), axis=(1, 2)) ** 2)

    def deflections(self, place: Place) -> Floats:
        """Deflection of each mode at a place, m from the corner of the whole board: (n_modes,) array."""
        x, y = fractions_of(self.model.setup, place, self.guess.values)
        return np.asarray(self._modes.displacement(np.array([x]), np.array([y]))[self._columns, 0, 0])

    @cached_property
    def _likelihood(self) -> PeakLikelihood:
        likelihood = PeakLikelihood.of(self.model)
        assert likelihood is not None
        return likelihood

    def _likelihood_with(self, evidence: Floats | None) -> PeakLikelihood:
        if evidence is None:
            return self._likelihood
        return replace(self._likelihood, log_prior=self._likelihood.log_prior + evidence[self._likelihood.unlabelled])

    @cached_property
    def _draws(self) -> tuple[Floats, Floats]:
        """ln f of all modes at every draw, and the noise there."""
        free, values = np.exp(self.guess.log_rigidities).T, self.guess.values
        drawn_values = {**values, **self.board.symmetry.rigidities(free, values["poisson_xy"])}
        log_frequencies = self.model.mode_log_frequencies(drawn_values, "linear")
        usable = np.isfinite(log_frequencies).all(axis=1)
        return log_frequencies[usable], np.full(int(usable.sum()), self.guess.noise)

    @cached_property
    def _modes(self) -> Modes:
        highest = 2.0 * np.pi * _FREQUENCY_MARGIN * max(self.model.setup.unlabelled)
        return solve_up_to(self.model.plate, self.model.system.weights(self.guess.values).at(0), highest**2)

    @cached_property
    def _columns(self) -> NDArray[np.intp]:
        """Index of each mode of the model among the solved modes: (n_modes,) array."""
        modes = self._modes
        indices = {
            (parity, int(rank)): i for i, (parity, rank) in enumerate(zip(modes.parities, modes.ranks, strict=True))
        }
        return np.array([indices[mode.place.parity, mode.place.rank] for mode in self.model.other_modes], dtype=np.intp)
