"""Simulated boards whose truth is drawn from the prior of their fit: designs, truths, readings, problems."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
import ritz
from made_boards import models_at, setup_of, with_noise
from numpy.typing import NDArray
from validation.calibration.layouts import EDGES, LABELS, LENGTHS, SETUPS

from bayesplate.board.board import Board, make_board
from bayesplate.board.material import MODULI, RIGIDITIES, rigidities
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import with_discrepancies
from bayesplate.board.setup import DEFAULT_NOISE
from bayesplate.effects import declare
from bayesplate.estimates.least_squares import log_measured, reading_scales
from bayesplate.estimates.refit import design_matrix as sensitivities
from bayesplate.estimates.refit import refit
from bayesplate.frequencies.model import SetupModel, log_frequencies_of_board
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.target import Posterior

Edges = Literal["free", "cantilever", "both", "days"]
Generator = Literal["package", "ritz"]
Law = Literal["exact", "auto", "fixed-linear"]
Hertz = Mapping[str, Mapping[tuple[int, int], float]]
"""Frequencies by the name of a setup and by label."""


@dataclass(frozen=True)
class Design:
    """What is simulated and how it is sampled.

    Attributes
    ----------
    edges : "free", "cantilever", "both" or "days"
        Both: one board in two setups, fitted together. Days: in two sessions of one setup.
    generator : "package" or "ritz"
        Whose frequencies are the truth: a full solve of the package, or the independent solver.
    law : "exact", "auto" or "fixed-linear"
        Of the fit. "auto": as `pose` chooses. "fixed-linear": one linear law, made at the prior's medians, is both the
        truth and the fit, so that no eigenvalue problem is solved again.
    resolution : float, Hz
        Readings are rounded to this; 0 if not.
    thickness_sd : float
        Relative; 0 takes the thickness as exact.
    prior : str
        Prior card; its Poisson ratio is marginalised.
    effect : str
        A declared effect, its parameters drawn from their priors and ranked too; "" for none.
    base_seed : int
    n_walkers, n_ensembles : int
    gate_taus : float
        Length of each ensemble in autocorrelation times. Half of what a user's fit needs is enough for 99 draws: the
        burn-in still holds five, and the effective size is asked to be ten times the number of draws.
    """

    edges: Edges = "free"
    generator: Generator = "package"
    law: Law = "exact"
    resolution: float = 1.0
    thickness_sd: float = 0.003
    prior: str = "spruce"
    effect: str = ""
    base_seed: int = 1
    n_walkers: int = 16
    n_ensembles: int = 2
    gate_taus: float = 25.0

    @cached_property
    def prior_card(self) -> PriorCard:
        """The prior card, read once."""
        return load_prior(self.prior)

    @cached_property
    def inputs(self) -> dict[str, Quantity]:
        """Inputs of the board; density and sides are exact."""
        length_x, length_y = LENGTHS[self.edges]
        poisson = self.prior_card.poisson_xy
        assert poisson is not None
        return {
            "length_x": Quantity.exact(length_x),
            "length_y": Quantity.exact(length_y),
            "thickness": Quantity.from_mean(3e-3, 3e-3 * self.thickness_sd),
            "density": Quantity.exact(430.0),
            "poisson_xy": poisson,
        }

    def board(self, hertz: Hertz, noise: Quantity = DEFAULT_NOISE) -> Board:
        """The board in those setups of which there are readings."""
        setups = [
            setup_of(EDGES[name], hertz[name], name=name, resolution=self.resolution, noise=noise)
            for name in self.setups
            if name in hertz
        ]
        board = make_board("simulated", self.inputs, setups, prior=self.prior, effects=self._effects)
        return with_discrepancies(declare(board))

    @property
    def setups(self) -> tuple[str, ...]:
        """Names of the setups."""
        return SETUPS[self.edges]

    @property
    def placeholders(self) -> Hertz:
        """Every mode that is read, at a frequency that says nothing."""
        return {name: dict.fromkeys(LABELS[name], 1.0) for name in self.setups}

    @property
    def _effects(self) -> tuple[str, ...]:
        return (self.effect,) if self.effect else ()


@lru_cache(maxsize=8)
def amplitudes(design: Design) -> dict[str, Quantity]:
    """Priors of the parameters of the declared effect, and of the discrepancies that sessions share."""
    every = design.board(design.placeholders).parameters
    return {one.name: one.prior for one in every if one.is_of_effect or one.owner.kind == "group"}


@dataclass(frozen=True)
class Truth:
    """One draw from the prior, with a noise for each setup, and the readings it gives."""

    values: Mapping[str, float]
    noise: tuple[float, ...]
    hertz: Hertz
    ranks_in_class: tuple[int, ...]

    def theta(self, problem: PosedProblem) -> NDArray[np.float64]:
        """Columns of the truth: (1, n_dim) array."""
        values = {name: np.asarray(value) for name, value in self.values.items()}
        return problem.parameters.theta(values, np.array(self.noise))[None, :]


def prior_values(design: Design, prior: PriorCard, rng: np.random.Generator) -> dict[str, float]:
    """Constants and inputs drawn from their joint prior, which is cut off where no material exists."""
    while True:
        values = {name: float(quantity.value(rng.standard_normal())) for name, quantity in design.inputs.items()}
        values |= {name: float(quantity.sample(rng, 1)[0]) for name, quantity in amplitudes(design).items()}
        constants = [float(prior.constants[name].sample(rng, 1)[0]) for name in MODULI]
        found = rigidities(*constants, values["thickness"], values["poisson_xy"])
        if np.isfinite(found.D_x):
            return values | {name: float(value) for name, value in zip(RIGIDITIES, found, strict=True)}


def draw_truth(design: Design, rng: np.random.Generator, given: Mapping[str, float] | None = None) -> Truth:
    """Draw constants, inputs and noise from the prior but for those that are given, and readings from them."""
    values = prior_values(design, design.prior_card, rng) | dict(given or {})
    noises = noises_of(design, rng)
    hertz, ranks = _frequencies(design, values)
    read = {
        name: with_noise(hertz[name], noise, rng, design.resolution)
        for name, noise in zip(design.setups, noises, strict=True)
    }
    return Truth(values, noises, read, ranks)


def noises_of(design: Design, rng: np.random.Generator, noise: Quantity = DEFAULT_NOISE) -> tuple[float, ...]:
    """One draw of the noise of each setup."""
    return tuple(float(noise.value(rng.standard_normal())) for _ in design.setups)


def _frequencies(design: Design, values: Mapping[str, float]) -> tuple[Hertz, tuple[int, ...]]:
    """The frequencies of the modes that are read, and their places in their classes where those are known."""
    arrays = {name: np.asarray(value) for name, value in values.items()}
    if design.generator == "ritz":
        (name,) = design.setups
        plate = ritz.Plate(
            *(values[name] for name in RIGIDITIES),
            nu_xy=values["poisson_xy"],
            rho=values["density"],
            h=values["thickness"],
            L_x=values["length_x"],
            L_y=values["length_y"],
            edges=EDGES[name],
        )
        return {name: ritz.simulate(plate, LABELS[name])}, ()
    if design.law == "fixed-linear":
        models = reference(design).posterior.models
    else:
        models = models_at(design.board(design.placeholders), [values[n] for n in RIGIDITIES], **values)
    every = {
        name: dict(zip(LABELS[name], np.exp(of_board(model, arrays)).tolist(), strict=True))
        for name, model in zip(design.setups, models, strict=True)
    }
    return every, ranks_in_class(models)


def of_board(model: SetupModel, values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """ln f of the modes that are read, by the linear law: (n_modes,) array."""
    return log_frequencies_of_board([model], values, "linear")[0][0, : len(model.places)]


def ranks_in_class(models: Sequence[SetupModel]) -> tuple[int, ...]:
    return tuple(place.rank for model in models for place in model.places)


@lru_cache(maxsize=2)
def reference(design: Design) -> PosedProblem:
    """The board at the medians of the prior: where the fixed linear law is made."""
    prior = design.prior_card
    inputs = {name: float(quantity.median) for name, quantity in {**design.inputs, **amplitudes(design)}.items()}
    found = rigidities(*(prior.constants[n].median for n in MODULI), inputs["thickness"], inputs["poisson_xy"])
    values = inputs | {name: float(value) for name, value in zip(RIGIDITIES, found, strict=True)}
    hertz, _ = _frequencies(replace(design, law="exact", generator="package"), values)
    return pose(replace(design, resolution=0.0).board(hertz), prior, law="linear")


def make_problem(design: Design, truth: Truth, belief: Callable[[Board], Board] | None = None) -> PosedProblem:
    """The inference of simulated readings, of the board that the analysis believes in."""
    board = design.board(truth.hertz)
    board = board if belief is None else belief(board)
    prior = design.prior_card
    if design.law != "fixed-linear":
        return pose(board, prior, law=None if design.law == "auto" else "exact")
    first = reference(design)
    return under_the_fixed_law(first, Posterior(board, prior, first.posterior.models, "linear"))


def under_the_fixed_law(first: PosedProblem, posterior: Posterior) -> PosedProblem:
    """Another board's posterior, under the linear law of a problem that was posed."""
    board, parameters = posterior.board, posterior.parameters
    columns = parameters.fitted_columns
    centre = first.centre.copy()
    centre[parameters.n_dim - len(parameters.inputs) - 1] = np.log(board.setups[0].noise.median)
    predict = predictor(board, posterior.models, "linear", centre)
    scales = reading_scales(board)
    centre[columns] = refit(predict, log_measured(board), scales, centre[columns], parameters.fitted_bounds)
    weighted = sensitivities(predict, scales, centre[columns])
    covariance = first.covariance.copy()
    covariance[np.ix_(columns, columns)] = np.linalg.inv(weighted.T @ weighted)
    return replace(first, board=board, posterior=posterior, centre=centre, covariance=covariance)
