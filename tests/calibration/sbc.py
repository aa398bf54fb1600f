"""Simulation-based calibration of the whole inference: constants from a prior, readings from them, ranks among draws.

If the truth is drawn from the prior and the draws are from its posterior, the rank of the truth among independent
draws is uniform, for every function of parameters and data. The log likelihood is among them, because a posterior that
ignores the data would pass all others.

References
----------
S. Talts et al., arXiv:1804.06788. M. Modrák et al., Simulation-based calibration checking with test quantities,
Bayesian Analysis (2023), doi:10.1214/23-BA1404.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import ritz
from calibration.layouts import EDGES, HELD_OUT, LABELS, LENGTHS
from calibration.mutants import BELIEFS, NARROWER, counted_twice, narrowed
from made_boards import models_at, setup_of, with_noise
from numpy.typing import NDArray

from bayesplate.cards import PriorCard, load_prior
from bayesplate.effects import declare
from bayesplate.errors import BayesplateError
from bayesplate.estimates.least_squares import log_measured, reading_scales
from bayesplate.estimates.refit import design as sensitivities
from bayesplate.estimates.refit import refit
from bayesplate.plate.board import Board, made_board
from bayesplate.plate.material import MODULI, RIGIDITIES, moduli, rigidities
from bayesplate.plate.setup import DEFAULT_NOISE
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.inference import PosedProblem, infer, pose
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.posterior.target import Posterior
from bayesplate.quantities import Quantity

N_DRAWS = 99
MOST_STEPS, MOST_ATTEMPTS = 5_000, 4
Ranks = dict[str, int]
Edges = Literal["free", "cantilever"]
Generator = Literal["package", "ritz"]
Law = Literal["exact", "auto", "fixed-linear"]


@dataclass(frozen=True)
class Design:
    """What is simulated and how it is sampled.

    Attributes
    ----------
    edges : "free" or "cantilever"
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
    n_walkers: int = 24
    n_ensembles: int = 2
    gate_taus: float = 25.0

    @property
    def inputs(self) -> dict[str, Quantity]:
        """Inputs of the board; density and sides are exact."""
        length_x, length_y = LENGTHS[self.edges]
        poisson = load_prior(self.prior).poisson_xy
        assert poisson is not None
        return {
            "length_x": Quantity.exact(length_x),
            "length_y": Quantity.exact(length_y),
            "thickness": Quantity.from_mean(3e-3, 3e-3 * self.thickness_sd),
            "density": Quantity.exact(430.0),
            "poisson_xy": poisson,
        }

    def board(self, hertz: Mapping[tuple[int, int], float], noise: Quantity = DEFAULT_NOISE) -> Board:
        """The board with readings by label."""
        setup = setup_of(EDGES[self.edges], hertz, name=self.edges, resolution=self.resolution, noise=noise)
        return declare(made_board("simulated", self.inputs, [setup], prior=self.prior, effects=self._effects))

    @property
    def _effects(self) -> tuple[str, ...]:
        return (self.effect,) if self.effect else ()


@lru_cache(maxsize=8)
def amplitudes(design: Design) -> dict[str, Quantity]:
    """Priors of the parameters of the declared effect."""
    board = design.board(dict.fromkeys(LABELS[design.edges], 1.0))
    return {one.name: one.prior for one in board.parameters if one.is_of_effect}


@dataclass(frozen=True)
class Truth:
    """One draw from the prior, and the readings it gives."""

    values: Mapping[str, float]
    noise: float
    hertz: Mapping[tuple[int, int], float]
    ranks_in_class: tuple[int, ...]

    def theta(self, problem: PosedProblem) -> NDArray[np.float64]:
        """Columns of the truth: (1, n_dim) array."""
        values = {name: np.asarray(value) for name, value in self.values.items()}
        return problem.parameters.theta(values, np.array([self.noise]))[None, :]


def prior_values(design: Design, prior: PriorCard, rng: np.random.Generator) -> dict[str, float]:
    """Constants and inputs drawn from their joint prior, which is cut off where no material exists."""
    while True:
        values = {name: float(quantity.value(rng.standard_normal())) for name, quantity in design.inputs.items()}
        values |= {name: float(quantity.sample(rng, 1)[0]) for name, quantity in amplitudes(design).items()}
        constants = [float(prior.constants[name].sample(rng, 1)[0]) for name in MODULI]
        found = rigidities(*constants, values["thickness"], values["poisson_xy"])
        if np.isfinite(found.D_x):
            return values | {name: float(value) for name, value in zip(RIGIDITIES, found, strict=True)}


def draw_truth(design: Design, rng: np.random.Generator) -> Truth:
    """Draw constants, inputs and noise from the prior, and readings from them."""
    values = prior_values(design, load_prior(design.prior), rng)
    noise = float(DEFAULT_NOISE.value(rng.standard_normal()))
    hertz, ranks = _frequencies(design, values)
    return Truth(values, noise, with_noise(hertz, noise, rng, design.resolution), ranks)


def _frequencies(design: Design, values: Mapping[str, float]) -> tuple[dict[tuple[int, int], float], tuple[int, ...]]:
    labels = LABELS[design.edges]
    arrays = {name: np.asarray(value) for name, value in values.items()}
    if design.generator == "ritz":
        plate = ritz.Plate(
            *(values[name] for name in RIGIDITIES),
            nu_xy=values["poisson_xy"],
            rho=values["density"],
            h=values["thickness"],
            L_x=values["length_x"],
            L_y=values["length_y"],
            edges=EDGES[design.edges],
        )
        return ritz.simulate(plate, labels), ()
    if design.law == "fixed-linear":
        model = reference(design).posterior.models[0]
    else:
        (model,) = models_at(design.board(dict.fromkeys(labels, 1.0)), [values[n] for n in RIGIDITIES], **values)
    hertz = np.exp(model.log_frequencies(arrays, "linear")[0])
    return dict(zip(labels, hertz.tolist(), strict=True)), tuple(place.rank for place in model.places)


@lru_cache(maxsize=2)
def reference(design: Design) -> PosedProblem:
    """The board at the medians of the prior: where the fixed linear law is made."""
    prior = load_prior(design.prior)
    inputs = {name: float(quantity.median) for name, quantity in {**design.inputs, **amplitudes(design)}.items()}
    found = rigidities(*(prior.constants[n].median for n in MODULI), inputs["thickness"], inputs["poisson_xy"])
    values = inputs | {name: float(value) for name, value in zip(RIGIDITIES, found, strict=True)}
    hertz, _ = _frequencies(replace(design, law="exact", generator="package"), values)
    return pose(replace(design, resolution=0.0).board(hertz), prior, law="linear")


def make_problem(design: Design, truth: Truth, belief: Callable[[Board], Board] | None = None) -> PosedProblem:
    """The inference of simulated readings, of the board that the analysis believes in."""
    board = design.board(truth.hertz)
    board = board if belief is None else belief(board)
    prior = load_prior(design.prior)
    if design.law != "fixed-linear":
        return pose(board, prior, law=None if design.law == "auto" else "exact")
    return _under_the_fixed_law(reference(design), board, prior)


def _under_the_fixed_law(reference: PosedProblem, board: Board, prior: PriorCard) -> PosedProblem:
    posterior = Posterior(board, prior, reference.posterior.models, "linear")
    parameters = posterior.parameters
    columns = parameters.fitted_columns
    centre = reference.centre.copy()
    centre[parameters.n_dim - len(parameters.inputs) - 1] = np.log(board.setups[0].noise.median)
    predict = predictor(board, posterior.models, "linear", centre)
    scales = reading_scales(board)
    centre[columns] = refit(predict, log_measured(board), scales, centre[columns], parameters.fitted_bounds)
    weighted = sensitivities(predict, scales, centre[columns])
    covariance = reference.covariance.copy()
    covariance[np.ix_(columns, columns)] = np.linalg.inv(weighted.T @ weighted)
    return replace(reference, board=board, posterior=posterior, centre=centre, covariance=covariance)


HeldOut = Callable[[Mapping[str, NDArray[np.float64]]], NDArray[np.float64]]


def held_out(design: Design, problem: PosedProblem) -> HeldOut:
    """ln f of the mode that is not read, from values by name: by the linear law at the estimate, which data fix."""
    if design.law == "fixed-linear":
        return _reference_held_out(design)
    return _held_out_at(design, problem)


def _held_out_at(design: Design, problem: PosedProblem) -> HeldOut:
    values = {name: float(np.ravel(one)[0]) for name, one in problem.parameters.values(problem.centre[None]).items()}
    (model,) = models_at(design.board({HELD_OUT[design.edges]: 1.0}), [values[n] for n in RIGIDITIES], **values)
    return lambda drawn: np.asarray(model.log_frequencies(drawn, "linear")[:, 0])


@lru_cache(maxsize=2)
def _reference_held_out(design: Design) -> HeldOut:
    return _held_out_at(design, reference(design))


def quantities(problem: PosedProblem, theta: NDArray[np.float64], unread: HeldOut) -> dict[str, NDArray[np.float64]]:
    """What is ranked, for many draws: (n_draws,) arrays; the inputs hold the sizes of effects too."""
    values = problem.parameters.values(theta)
    constants = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    with np.errstate(invalid="ignore"):
        log_likelihood = problem.posterior.log_likelihood(theta).sum(axis=1)
    found = {
        **{name: values[name] for name in RIGIDITIES},
        **constants._asdict(),
        **{name: values[name] for name in problem.parameters.inputs},
        "noise": problem.parameters.log_noise(theta)[:, 0],
        "held_out": unread(values),
        "log_likelihood": log_likelihood,
    }
    return {name: np.broadcast_to(value, len(theta)) for name, value in found.items()}


def ranks_among(problem: PosedProblem, truth: Truth, draws: NDArray[np.float64], unread: HeldOut) -> Ranks:
    """Rank of the truth among the draws, 0 to `N_DRAWS`, for every quantity."""
    true, drawn = quantities(problem, truth.theta(problem), unread), quantities(problem, draws, unread)
    return {name: int(np.sum(drawn[name] < true[name][0])) for name in true}


def posterior_draws(problem: PosedProblem, design: Design, rng: np.random.Generator) -> tuple[NDArray[np.float64], int]:
    """`N_DRAWS` of thousands of draws at random, and how many runs it took.

    Dependence among so few of so many is lost in their own scatter. A run that fails the gate is started anew with
    other random numbers, as a user would do: to leave the simulation out would favour the easy ones.
    """
    for attempt in range(1, MOST_ATTEMPTS + 1):
        settings = SamplerSettings(
            seed=int(rng.integers(2**31)),
            n_ensembles=design.n_ensembles,
            n_walkers=design.n_walkers,
            chunk_steps=50,
            max_steps=MOST_STEPS,
            gate=Gate(tau_count_min=design.gate_taus, ess_min=10 * N_DRAWS),
        )
        inference = infer(problem, settings)
        if inference.convergence.passed:
            pooled = inference.chains.pooled
            return pooled[rng.choice(len(pooled), N_DRAWS, replace=False)], attempt
    raise BayesplateError("; ".join(inference.convergence.reasons))


def prior_draws(problem: PosedProblem, design: Design, rng: np.random.Generator) -> NDArray[np.float64]:
    """What a sampler would give if the likelihood were forgotten."""
    rows = []
    for _ in range(N_DRAWS):
        values = {n: np.asarray(v) for n, v in prior_values(design, problem.prior, rng).items()}
        noise = np.array([float(DEFAULT_NOISE.value(rng.standard_normal()))])
        rows.append(problem.parameters.theta(values, noise))
    return np.stack(rows)


def simulate_one(design: Design, index: int, mutants: Sequence[str] = ()) -> dict[str, Any]:
    """One simulation: its ranks, and those of the mutants.

    Parameters
    ----------
    design : Design
    index : int
        Seeds everything random, together with the design's seed.
    mutants : sequence of str
        Those of `FITTED` that are to be fitted too; the others take no fit.

    Returns
    -------
    dict
        simulation, ranks by "production" and mutant, seconds, law, attempts, relabelled; or simulation and error.
    """
    started = time.perf_counter()
    for_truth, for_draws, for_mutants = (
        np.random.default_rng(s) for s in np.random.SeedSequence([design.base_seed, index]).spawn(3)
    )
    record: dict[str, Any] = {"simulation": index}
    try:
        truth = draw_truth(design, for_truth)
        problem = make_problem(design, truth)
        places = tuple(place.rank for place in problem.posterior.models[0].places)
        draws, attempts = posterior_draws(problem, design, for_draws)
        unread = held_out(design, problem)
        ranks = {"production": ranks_among(problem, truth, draws, unread)}
        ranks["likelihood omitted"] = ranks_among(problem, truth, prior_draws(problem, design, for_mutants), unread)
        for name, factor in NARROWER.items():
            ranks[name] = ranks_among(problem, truth, narrowed(draws, factor), unread)
    except BayesplateError as error:
        return record | {"error": f"{type(error).__name__}: {error}"}
    refused = add_mutants(mutants, design, truth, problem, for_mutants, ranks)
    return record | {
        "ranks": ranks,
        **({"refused": refused} if mutants else {}),
        "seconds": round(time.perf_counter() - started, 2),
        "law": problem.posterior.law,
        "attempts": attempts,
        "relabelled": bool(truth.ranks_in_class) and truth.ranks_in_class != places,
    }


def add_mutants(
    names: Sequence[str],
    design: Design,
    truth: Truth,
    problem: PosedProblem,
    rng: np.random.Generator,
    ranks: dict[str, Ranks],
) -> list[str]:
    """Fit mutants and add their ranks; the names of those that the package would not fit."""
    refused = []
    for name in names:
        try:
            belief = BELIEFS.get(name)
            one = counted_twice(problem, design.edges) if belief is None else make_problem(design, truth, belief)
            draws, _ = posterior_draws(one, design, rng)
            ranks[name] = ranks_among(one, truth, draws, held_out(design, one))
        except BayesplateError:
            refused.append(name)
    return refused


def identity(design: Design) -> dict[str, Any]:
    """What a file of ranks must agree in before more are added to it."""
    return {"format": 3, "n_draws": N_DRAWS, "design": asdict(design)}
