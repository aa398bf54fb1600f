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
from dataclasses import asdict
from functools import lru_cache
from typing import Any

import numpy as np
from made_boards import models_at
from numpy.typing import NDArray
from validation.calibration.layouts import HELD_OUT
from validation.calibration.mutants import BELIEFS, NARROWER, counted_twice, narrowed
from validation.calibration.truths import (
    Design,
    Truth,
    draw_truth,
    make_problem,
    noises_of,
    prior_values,
    ranks_in_class,
    reference,
)

from bayesplate.board.material import RIGIDITIES, moduli
from bayesplate.errors import BayesplateError
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.sampling import SamplerSettings

N_DRAWS = 99
MOST_STEPS, MOST_ATTEMPTS = SamplerSettings.max_steps, 4
"""Steps of a run, as many as a user's takes by default, and runs."""
Ranks = dict[str, int]
HeldOut = Callable[[Mapping[str, NDArray[np.float64]]], NDArray[np.float64]]


def held_out(design: Design, problem: PosedProblem) -> HeldOut:
    """ln f of the mode that is not read, from values by name: by the linear law at the estimate, which data fix."""
    if design.law == "fixed-linear":
        return _reference_held_out(design)
    return _held_out_at(design, problem)


def _held_out_at(design: Design, problem: PosedProblem) -> HeldOut:
    values = {name: float(np.ravel(one)[0]) for name, one in problem.parameters.values(problem.centre[None]).items()}
    first = design.setups[0]
    (model,) = models_at(design.board({first: {HELD_OUT[first]: 1.0}}), [values[n] for n in RIGIDITIES], **values)
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
    log_noise = problem.parameters.log_noise(theta)
    noises = ["noise"] if len(problem.posterior.models) == 1 else [f"noise[{s.name}]" for s in problem.board.setups]
    found = {
        **{name: values[name] for name in RIGIDITIES},
        **constants._asdict(),
        **{name: values[name] for name in problem.parameters.inputs},
        **dict(zip(noises, log_noise.T, strict=True)),
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
            max_steps=MOST_STEPS,
            gate=Gate(tau_count_min=design.gate_taus, ess_min=10 * N_DRAWS),
        )
        inference = infer(problem, settings)
        if inference.convergence.passed:
            return ranked_draws(inference.theta.reshape(-1, inference.theta.shape[-1]), rng), attempt
    raise BayesplateError("; ".join(inference.convergence.reasons))


def random_lines(*seed: int) -> list[np.random.Generator]:
    """Random numbers of one simulation: for its truth, its draws, and its mutants."""
    return [np.random.default_rng(one) for one in np.random.SeedSequence(seed).spawn(3)]


def ranked_draws(draws: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """`N_DRAWS` of many draws, at random: (N_DRAWS, n_dim) array."""
    return draws[rng.choice(len(draws), N_DRAWS, replace=False)]


def prior_draws(problem: PosedProblem, design: Design, rng: np.random.Generator) -> NDArray[np.float64]:
    """What a sampler would give if the likelihood were forgotten."""
    rows = []
    for _ in range(N_DRAWS):
        values = {n: np.asarray(v) for n, v in prior_values(design, problem.prior, rng).items()}
        rows.append(problem.parameters.theta(values, np.array(noises_of(design, rng))))
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
    for_truth, for_draws, for_mutants = random_lines(design.base_seed, index)
    record: dict[str, Any] = {"simulation": index}
    try:
        truth = draw_truth(design, for_truth)
        problem = make_problem(design, truth)
        places = ranks_in_class(problem.posterior.models)
        draws, attempts = posterior_draws(problem, design, for_draws)
        unread = held_out(design, problem)
        ranks = {"production": ranks_among(problem, truth, draws, unread)}
        ranks["likelihood omitted"] = ranks_among(problem, truth, prior_draws(problem, design, for_mutants), unread)
        for name, factor in NARROWER.items():
            ranks[name] = ranks_among(problem, truth, narrowed(draws, factor), unread)
    except BayesplateError as error:
        return record | {"error": f"{type(error).__name__}: {error}"}
    refused = add_mutants(mutants, design, truth, problem, for_mutants, ranks)
    relabelled = bool(truth.ranks_in_class) and truth.ranks_in_class != places
    told = ranked(ranks, started, problem.posterior.law, attempts, relabelled=relabelled)
    return record | told | ({"refused": refused} if mutants else {})


def ranked(
    ranks: dict[str, Ranks], started: float, law: str = "linear", attempts: int = 1, *, relabelled: bool = False
) -> dict[str, Any]:
    """What a record says of a simulation whose ranks were found."""
    return {
        "ranks": ranks,
        "seconds": round(time.perf_counter() - started, 2),
        "law": law,
        "attempts": attempts,
        "relabelled": relabelled,
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
