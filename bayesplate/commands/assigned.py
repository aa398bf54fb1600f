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
from bayesplate.frequencies.model import SetupModel, setup_model, with_others
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.system import system_of
from bayesplate.plate.solve import Modes, solve_up_to
from bayesplate.posterior.first_labels import Way, guess_of

if TYPE_CHECKING:
    from bayesplate.recordings.signals import Place


_ABOVE = 1.16
"""Up to above the highest peak, somewhat more than the modes that a setup's model takes."""
_GRID = np.linspace(0.0, 1.0, 41)


@dataclass(frozen=True, eq=False)
class MostlyKnown:
    """The modes of a board with one setup of bare peaks, about the constants that one way to label them gives."""

    board: Board
    model: SetupModel
    guess: Guess

    @classmethod
    def of(cls, way: Way, bare: Board) -> MostlyKnown:
        """The modes about the constants of a way to label some peaks of `bare`."""
        estimate = weighted_least_squares(way.board)
        model = with_others(setup_model(system_of(bare, bare.setups[0]), estimate.values), estimate.values)
        return cls(bare, model, guess_of(bare, estimate))

    def with_peaks(self, board: Board) -> MostlyKnown:
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
        result[self._likelihood.bare] = self._with(evidence).probabilities(*self._draws)
        return result

    def gain(self, evidence: Floats) -> float:
        """ln of how much likelier all peaks are together with further evidence."""
        from scipy.special import logsumexp

        after, before = (self._with(one).log_likelihood(*self._draws) for one in (evidence, None))
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
        found = PeakLikelihood.of(self.model)
        assert found is not None
        return found

    def _with(self, evidence: Floats | None) -> PeakLikelihood:
        if evidence is None:
            return self._likelihood
        return replace(self._likelihood, log_prior=self._likelihood.log_prior + evidence[self._likelihood.bare])

    @cached_property
    def _draws(self) -> tuple[Floats, Floats]:
        """ln f of all modes at every draw, and the noise there."""
        free, values = np.exp(self.guess.log_rigidities).T, self.guess.values
        drawn = {**values, **self.board.symmetry.rigidities(free, values["poisson_xy"])}
        every = self.model.every_log_frequency(drawn, "linear")
        usable = np.isfinite(every).all(axis=1)
        return every[usable], np.full(int(usable.sum()), self.guess.noise)

    @cached_property
    def _modes(self) -> Modes:
        highest = 2.0 * np.pi * _ABOVE * max(self.model.setup.unlabelled)
        return solve_up_to(self.model.plate, self.model.system.weights(self.guess.values).at(0), highest**2)

    @cached_property
    def _columns(self) -> NDArray[np.intp]:
        """Which of the solved modes each mode of the model is."""
        modes = self._modes
        at = {(parity, int(rank)): i for i, (parity, rank) in enumerate(zip(modes.parities, modes.ranks, strict=True))}
        return np.array([at[other.place.parity, other.place.rank] for other in self.model.others], dtype=np.intp)
