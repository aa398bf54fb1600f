"""The posterior density: priors on constants, noise and inputs, and a likelihood summed over setups."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesplate.arrays import Bools, Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES, isotropic_moduli, moduli_of, rigidities
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.frequencies.laws import LawName, cents
from bayesplate.frequencies.model import SetupModel, log_frequencies_of_board
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.posterior.parameters import Parameters

LINEAR_SHARE = 0.25
"""The linear law suffices while its error over the posterior stays below this share of the noise."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Log posterior density of a board under one law, vectorised over draws."""

    board: Board
    prior: PriorCard  # of E_x, E_y, G_xy or of D_x, D_y, D_s; of an isotropic board of E_x, which is its E
    models: Sequence[SetupModel]  # one per setup
    law: LawName
    robust: bool = False

    @cached_property
    def parameters(self) -> Parameters:
        """The columns of theta."""
        return Parameters(self.board)

    @cached_property
    def priors(self) -> Mapping[str, Quantity]:
        """Prior of each constant, SI."""
        return self.prior.constants

    @cached_property
    def readings(self) -> tuple[ReadingErrors, ...]:
        """Errors of the readings of each setup."""
        return tuple(ReadingErrors.of(setup, self.robust) for setup in self.board.setups)

    @cached_property
    def _sure_readings(self) -> tuple[tuple[Bools, ReadingErrors], ...]:
        """For each setup, the mask of readings with a sure label, and their errors."""
        masks = (np.array([reading.is_sure for reading in setup.readings], dtype=bool) for setup in self.board.setups)
        return tuple((mask, errors.select(mask)) for mask, errors in zip(masks, self.readings, strict=True))

    @cached_property
    def peaks(self) -> tuple[PeakLikelihood | None, ...]:
        """Likelihood of all other peaks of each setup; None where all labels are sure."""
        return tuple(PeakLikelihood.of(model, self.robust) for model in self.models)

    def __call__(self, theta: Floats) -> Floats:
        """Log density: (n_draws,) array from (n_draws, n_dim); -inf outside the support."""
        return self.evaluate(theta)[0]

    def evaluate(self, theta: Floats) -> tuple[Floats, Floats]:
        """Log density (n_draws,), and ln f of all modes (n_draws, n_modes), nan where the prior excludes the draw."""
        values = self.parameters.values(theta)
        total = self.log_prior(theta, values)
        inside = np.isfinite(total)
        log_frequency = np.full((len(theta), sum(self.n_modes)), np.nan)
        if inside.any():
            by_setup = self.mode_log_frequencies(theta[inside], values if inside.all() else None)
            total[inside] += self.log_likelihood_of(by_setup, theta[inside]).sum(axis=1)
            log_frequency[inside] = np.concatenate(by_setup, axis=1)
        return total, log_frequency

    def by_setup(self, log_frequency: Floats) -> list[Floats]:
        """Columns of each setup among those of `evaluate`: one (..., n_modes) array per setup."""
        return np.split(log_frequency, np.cumsum(self.n_modes)[:-1], axis=-1)

    def log_prior(self, theta: Floats, values: Values | None = None) -> Floats:
        """Log prior density: (n_draws,) array; `values` as of `log_prior_constants`."""
        factors = self.log_prior_factors(theta, values)
        total = np.sum([factors[name] for name in ("inputs", "noise", "constants") if name in factors], axis=0)
        return np.where(np.isnan(total), -np.inf, total)

    def log_prior_factors(self, theta: Floats, values: Values | None = None) -> dict[str, Floats]:
        """Log densities of the constants, the noise, and the inputs (declared effects included) if any; (n_draws,)."""
        factors = {
            "constants": self.log_prior_constants(theta, values),
            "noise": self.parameters.log_prior_noise(theta),
        }
        return factors | ({"inputs": self.parameters.log_prior_inputs(theta)} if self.parameters.inputs else {})

    def log_prior_constants(self, theta: Floats, values: Values | None = None) -> Floats:
        """Log prior density of the logarithms of the free rigidities given the inputs: (n_draws,) array.

        A density of the moduli is one of the rigidities: the Jacobian of their logarithms is 1 (`moduli`), and so is
        that of ln E by ln D of an isotropic board. Outside nu_xy nu_yx < 1 no material exists: the density is zero.
        """
        values = self.parameters.values(theta) if values is None else values
        constants = moduli_of(values)
        by_name = {**values, **constants._asdict()}
        densities = [prior.log_density_of_log(np.log(by_name[name])) for name, prior in self.priors.items()]
        return np.where(np.isnan(constants.E_x), -np.inf, np.sum(densities, axis=0))

    def prior_transform(self, u: Floats) -> Floats:
        """Columns under the prior from the unit cube: uniform (n_draws, n_dim) u become draws from the prior.

        Moduli become rigidities with the drawn thickness and nu_xy; moduli of no possible material become rigidities of
        no possible material.
        """
        u = np.asarray(u, dtype=np.float64)
        parameters = self.parameters
        theta = np.zeros_like(u)
        for i, parameter in enumerate(parameters.uncertain, start=parameters.first_input):
            theta[:, i] = parameter.prior.standard_quantile(u[:, i])
        for i, noise in enumerate(parameters.noises, start=parameters.n_constants):
            theta[:, i] = np.log(noise.prior.quantile(u[:, i]))
        constant_draws = {name: prior.quantile(u[:, i]) for i, (name, prior) in enumerate(self.priors.items())}
        if set(constant_draws) == set(MODULI):
            values = parameters.values(theta)
            E_x, E_y, G_xy = (constant_draws[name] for name in MODULI)
            stiffness = rigidities(E_x, E_y, G_xy, values["thickness"], values["poisson_xy"])
            # Rigidities at nu_xy = 0 keep D_y / D_x = E_y / E_x, so that nu_xy nu_yx is still that of no material.
            without_poisson = rigidities(E_x, E_y, G_xy, values["thickness"], 0.0)
            pairs = zip(stiffness, without_poisson, strict=True)
            constants = [np.where(np.isnan(stiffness.D_x), fallback, rigidity) for rigidity, fallback in pairs]
        elif self.board.isotropic:
            values = parameters.values(theta)
            nu = values["poisson_xy"]
            constants = [rigidities(*isotropic_moduli(constant_draws["E_x"], nu), values["thickness"], nu).D_x]
        else:
            constants = [constant_draws[name] for name in RIGIDITIES]
        theta[:, : parameters.n_constants] = np.log(np.stack(constants, axis=1))
        return theta

    @property
    def n_modes(self) -> tuple[int, ...]:
        """Number of modes in the likelihood of each setup: labelled modes, and modes that peaks may be."""
        return tuple(len(model.mode_places) for model in self.models)

    @property
    def factors(self) -> tuple[str, ...]:
        """Names of the factors of the likelihood: each reading with a sure label, and all other peaks of a setup."""
        names = []
        for setup, peaks in zip(self.board.setups, self.peaks, strict=True):
            names += [f"{setup.name} {reading.label}" for reading in setup.readings if reading.is_sure]
            names += [] if peaks is None else [f"{setup.name} peaks"]
        return tuple(names)

    def mode_log_frequencies(self, theta: Floats, values: Values | None = None) -> list[Floats]:
        """ln f of the labelled modes, then of those that peaks may be: one (n_draws, n_modes) array per setup."""
        values = self.parameters.values(theta) if values is None else values
        return log_frequencies_of_board(self.models, values, self.law)

    def log_frequencies(self, theta: Floats) -> list[Floats]:
        """ln f of the labelled modes: one (n_draws, n_modes) array per setup."""
        return self.labelled(self.mode_log_frequencies(theta))

    def labelled(self, mode_log_frequencies: Sequence[Floats]) -> list[Floats]:
        """Columns of the labelled modes among those of `mode_log_frequencies`."""
        pairs = zip(mode_log_frequencies, self.board.setups, strict=True)
        return [log_frequency[:, : len(setup.readings)] for log_frequency, setup in pairs]

    def log_likelihood(self, theta: Floats) -> Floats:
        """Log probability of each of `factors`: (n_draws, n_factors) array."""
        return self.log_likelihood_of(self.mode_log_frequencies(theta), theta)

    def log_likelihood_of(self, mode_log_frequencies: Sequence[Floats], theta: Floats) -> Floats:
        """`log_likelihood` from the frequencies of `mode_log_frequencies`."""
        noise = np.exp(self.parameters.log_noise(theta))
        factors = []
        labelled = self.labelled(mode_log_frequencies)
        for i, ((is_sure, errors), peaks) in enumerate(zip(self._sure_readings, self.peaks, strict=True)):
            factors.append(errors.log_likelihood(labelled[i][:, is_sure], noise[:, i]))
            if peaks is not None:
                factors.append(peaks.log_likelihood(mode_log_frequencies[i], noise[:, i])[:, None])
        return np.concatenate(factors, axis=1)


def linear_suffices(n_modes: Sequence[int], errors: Floats, noise: Sequence[float] | Floats) -> bool:
    """Whether (n_draws, n_modes) linearisation errors, cents, stay below a quarter of the noise, rms over draws.

    `n_modes` is the number of modes of each setup, `noise` its relative noise.
    """
    limit = LINEAR_SHARE * cents(np.repeat(noise, n_modes))
    finite = np.isfinite(errors).all(axis=1)
    if finite.mean() < 0.5:
        return False
    rms = np.sqrt(np.mean(errors[finite] ** 2, axis=0))
    return bool(np.all(rms < limit))
