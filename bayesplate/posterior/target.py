"""The posterior density: priors on constants, noise and inputs, and a likelihood summed over setups."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES, isotropic_moduli, moduli, rigidities
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.frequencies.laws import LawName, cents
from bayesplate.frequencies.model import SetupModel, log_frequencies_of_board
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.posterior.parameters import Parameters

LINEAR_SHARE = 0.25
"""The linear law serves while its error over the posterior stays below this share of the noise."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Log posterior density of a board under one law, vectorised over draws.

    Attributes
    ----------
    prior : PriorCard
        Densities of E_x, E_y, G_xy or of D_x, D_y, D_s; of an isotropic board that of E_x, which is its E.
    models : sequence of SetupModel
        One per setup.
    """

    board: Board
    prior: PriorCard
    models: Sequence[SetupModel]
    law: LawName
    robust: bool = False
    parameters: Parameters = field(init=False)
    readings: tuple[ReadingErrors, ...] = field(init=False)
    peaks: tuple[PeakLikelihood | None, ...] = field(init=False)
    sure: tuple[tuple[NDArray[np.bool_], ReadingErrors], ...] = field(init=False)
    priors: Mapping[str, Quantity] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", Parameters(self.board))
        object.__setattr__(self, "priors", self.prior.constants)
        object.__setattr__(self, "readings", tuple(ReadingErrors.of(s, self.robust) for s in self.board.setups))
        masks = (np.array([one.is_sure for one in s.readings], dtype=bool) for s in self.board.setups)
        sure = tuple((mask, errors.at(mask)) for mask, errors in zip(masks, self.readings, strict=True))
        object.__setattr__(self, "sure", sure)
        object.__setattr__(self, "peaks", tuple(PeakLikelihood.of(model, self.robust) for model in self.models))

    def __call__(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log density: (n_draws,) array from (n_draws, n_dim); -inf outside the support."""
        return self.evaluate(theta)[0]

    def evaluate(self, theta: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Log density, and ln f of all modes, setup after setup: (n_draws,) and (n_draws, n_every) arrays.

        Not a number where the prior excludes the draw.
        """
        values = self.parameters.values(theta)
        total = self.log_prior(theta, values)
        inside = np.isfinite(total)
        log_frequency = np.full((len(theta), sum(self.n_every)), np.nan)
        if inside.any():
            by_setup = self.every_log_frequency(theta[inside], values if inside.all() else None)
            total[inside] += self.log_likelihood_of(by_setup, theta[inside]).sum(axis=1)
            log_frequency[inside] = np.concatenate(by_setup, axis=1)
        return total, log_frequency

    def by_setup(self, log_frequency: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Columns of each setup among those of `evaluate`: one (..., n_every) array per setup."""
        return np.split(log_frequency, np.cumsum(self.n_every)[:-1], axis=-1)

    def log_prior(self, theta: NDArray[np.float64], values: Values | None = None) -> NDArray[np.float64]:
        """Log prior density: (n_draws,) array; `values` as of `log_prior_constants`."""
        factors = self.log_prior_factors(theta, values)
        total = np.sum([factors[name] for name in ("inputs", "noise", "constants") if name in factors], axis=0)
        return np.where(np.isnan(total), -np.inf, total)

    def log_prior_factors(
        self, theta: NDArray[np.float64], values: Values | None = None
    ) -> dict[str, NDArray[np.float64]]:
        """What the prior is a product of: log densities of the constants, the noise, and the inputs if any; (n_draws,).

        The inputs are the uncertain parameters of the board, those of declared effects included.
        """
        factors = {
            "constants": self.log_prior_constants(theta, values),
            "noise": self.parameters.log_prior_noise(theta),
        }
        return factors | ({"inputs": self.parameters.log_prior_inputs(theta)} if self.parameters.inputs else {})

    def log_prior_constants(self, theta: NDArray[np.float64], values: Values | None = None) -> NDArray[np.float64]:
        """Log prior density of the logarithms of the free rigidities given the inputs: (n_draws,) array.

        A density of the moduli is one of the rigidities: the Jacobian of their logarithms is 1 (`moduli`), and so is
        that of ln E by ln D of an isotropic board. Outside
        nu_xy nu_yx < 1 no material exists and the density is zero. The draws' `values` are given where they are known.
        """
        values = self.parameters.values(theta) if values is None else values
        constants = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
        by_name = {**values, **constants._asdict()}
        densities = [prior.log_density_of_log(np.log(by_name[name])) for name, prior in self.priors.items()]
        return np.where(np.isnan(constants.E_x), -np.inf, np.sum(densities, axis=0))

    def prior_transform(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Map the unit cube to the columns under the prior: uniform u become draws from the prior.

        Inputs come first, because moduli become rigidities with the drawn thickness and nu_xy.

        Parameters
        ----------
        u : (n_draws, n_dim) array, 0 to 1
            One number per column, in their order; the first ones are those of the constants that the prior states.

        Returns
        -------
        (n_draws, n_dim) array
            Where the drawn moduli are no material's, rigidities that are no material's either.
        """
        u = np.asarray(u, dtype=np.float64)
        parameters = self.parameters
        theta = np.zeros_like(u)
        for i, one in enumerate(parameters.uncertain, start=parameters.first_input):
            theta[:, i] = one.prior.standard_quantile(u[:, i])
        for i, noise in enumerate(parameters.noises, start=parameters.n_constants):
            theta[:, i] = np.log(noise.prior.quantile(u[:, i]))
        drawn = {name: prior.quantile(u[:, i]) for i, (name, prior) in enumerate(self.priors.items())}
        if set(drawn) == set(MODULI):
            values = parameters.values(theta)
            E_x, E_y, G_xy = (drawn[name] for name in MODULI)
            stiffness = rigidities(E_x, E_y, G_xy, values["thickness"], values["poisson_xy"])
            # At another Poisson ratio D_y / D_x is E_y / E_x still, so that nu_xy nu_yx is what it was.
            without = rigidities(E_x, E_y, G_xy, values["thickness"], 0.0)
            pairs = zip(stiffness, without, strict=True)
            constants = [np.where(np.isnan(stiffness.D_x), other, one) for one, other in pairs]
        elif self.board.isotropic:
            values = parameters.values(theta)
            nu = values["poisson_xy"]
            constants = [rigidities(*isotropic_moduli(drawn["E_x"], nu), values["thickness"], nu).D_x]
        else:
            constants = [drawn[name] for name in RIGIDITIES]
        theta[:, : parameters.n_constants] = np.log(np.stack(constants, axis=1))
        return theta

    @property
    def n_every(self) -> tuple[int, ...]:
        """How many modes of each setup the likelihood looks at: the labelled ones, and those that peaks may be."""
        return tuple(len(model.every_place) for model in self.models)

    @property
    def factors(self) -> tuple[str, ...]:
        """What the likelihood is a product of: readings whose label is sure, and all the other peaks of a setup."""
        names = []
        for setup, peaks in zip(self.board.setups, self.peaks, strict=True):
            names += [f"{setup.name} {reading.label}" for reading in setup.readings if reading.is_sure]
            names += [] if peaks is None else [f"{setup.name} peaks"]
        return tuple(names)

    def every_log_frequency(
        self, theta: NDArray[np.float64], values: Values | None = None
    ) -> list[NDArray[np.float64]]:
        """ln f of the labelled modes, then of those that peaks may be: one (n_draws, n_every) array per setup."""
        values = self.parameters.values(theta) if values is None else values
        return log_frequencies_of_board(self.models, values, self.law)

    def log_frequencies(self, theta: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """ln f of the labelled modes: one (n_draws, n_modes) array per setup."""
        return self.labelled(self.every_log_frequency(theta))

    def labelled(self, every_log_frequency: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
        """Columns of the labelled modes among those of `every_log_frequency`."""
        pairs = zip(every_log_frequency, self.board.setups, strict=True)
        return [every[:, : len(setup.readings)] for every, setup in pairs]

    def log_likelihood(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log probability of every one of `factors`: (n_draws, n_factors) array."""
        return self.log_likelihood_of(self.every_log_frequency(theta), theta)

    def log_likelihood_of(
        self, every_log_frequency: Sequence[NDArray[np.float64]], theta: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """The same from frequencies that are known already, as `every_log_frequency` gives them."""
        noise = np.exp(self.parameters.log_noise(theta))
        parts = []
        labelled = self.labelled(every_log_frequency)
        for i, ((sure, errors), peaks) in enumerate(zip(self.sure, self.peaks, strict=True)):
            parts.append(errors.log_likelihood(labelled[i][:, sure], noise[:, i]))
            if peaks is not None:
                parts.append(peaks.log_likelihood(every_log_frequency[i], noise[:, i])[:, None])
        return np.concatenate(parts, axis=1)


def linear_suffices(n_every: Sequence[int], errors: NDArray[np.float64], noise: Sequence[float]) -> bool:
    """Whether linearisation errors stay below a quarter of the noise for every mode, rms over draws.

    Parameters
    ----------
    n_every : sequence of int
        Modes of each setup.
    errors : (n_draws, n_modes) array, cents
        Of all of them.
    noise : sequence of float
        Relative, one per setup.
    """
    limit = LINEAR_SHARE * cents(np.repeat(noise, n_every))
    finite = np.isfinite(errors).all(axis=1)
    if finite.mean() < 0.5:
        return False
    rms = np.sqrt(np.mean(errors[finite] ** 2, axis=0))
    return bool(np.all(rms < limit))
