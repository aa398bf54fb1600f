"""Calibration where the paper's boards are: readings simulated from a posterior are added to those it is of.

Constants are drawn from the posterior of a board's own readings and new readings from them. Among the draws of the
posterior of both sets of readings the rank of these constants is uniform: a check of the inference at the board itself,
where that over a prior may look elsewhere.

References
----------
T. Säilynoja et al., Posterior SBC: simulation-based calibration checking conditional on data, arXiv:2502.03279.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from validation.calibration.mutants import NARROWER, narrowed
from validation.calibration.records import Record
from validation.calibration.sbc import N_DRAWS, posterior_draws
from validation.calibration.table import family_p_value, family_words, is_calibrated, rows, text
from validation.calibration.truths import Design

from bayesplate.board.material import RIGIDITIES, moduli
from bayesplate.board.quantity import Quantity
from bayesplate.commands.problem import Problem
from bayesplate.errors import BayesplateError
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.posterior.target import Posterior

BOARDS = ("finnish-spruce-cantilever", "fiemme-spruce-clamped")
N_SIMULATIONS = 500
FEWEST = 200
MUTANT = "spread 0.8 of itself"
MUTANT_LEVEL = 1e-3
_POOL = 4000

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class OfBoth(Posterior):
    """The posterior of a board's own readings and of a second set of the same modes, under the same law and noise."""

    second: Posterior

    def log_likelihood_of(self, mode_log_frequencies: Sequence[Floats], theta: Floats) -> Floats:
        first = super().log_likelihood_of(mode_log_frequencies, theta)
        return np.concatenate([first, self.second.log_likelihood_of(mode_log_frequencies, theta)], axis=1)


@lru_cache(maxsize=2)
def at_board(name: str, law: str | None = None) -> tuple[PosedProblem, Floats]:
    """A shipped board as a problem, and draws of its posterior: (n, n_dim) array."""
    problem = Problem.from_card(name, law=law).posed
    inference = infer(problem, SamplerSettings(seed=1, gate=Gate(ess_min=4000.0)))
    if not inference.convergence.passed:
        raise BayesplateError("; ".join(inference.convergence.reasons))
    pooled = inference.chains.pooled
    return problem, pooled[np.random.default_rng(1).choice(len(pooled), min(_POOL, len(pooled)), replace=False)]


def with_readings(posterior: Posterior, hertz: Sequence[Floats]) -> Posterior:
    """The posterior of other readings of the same modes, Hz, setup after setup; what they state of themselves stays."""
    setups = []
    for setup, found in zip(posterior.board.setups, hertz, strict=True):
        pairs = zip(setup.readings, found.tolist(), strict=True)
        readings = tuple(replace(one, frequency=_moved(one.frequency, f)) for one, f in pairs)
        setups.append(replace(setup, readings=readings))
    board = replace(posterior.board, setups=tuple(setups))
    return Posterior(board, posterior.prior, posterior.models, posterior.law, posterior.robust)


def _moved(reading: Quantity, hertz: float) -> Quantity:
    """The reading at another frequency, with the same relative uncertainty."""
    return reading.scaled(hertz / reading.mean)


def quantities(posterior: Posterior, theta: Floats) -> Mapping[str, Floats]:
    """What is ranked: (n_draws,) arrays."""
    values = posterior.parameters.values(theta)
    constants = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    noise = posterior.parameters.log_noise(theta)
    found = {
        **{name: values[name] for name in RIGIDITIES},
        **constants._asdict(),
        **{name: values[name] for name in posterior.parameters.inputs},
        **{f"noise {setup.name}": noise[:, i] for i, setup in enumerate(posterior.board.setups)},
        "log_likelihood": posterior.log_likelihood(theta).sum(axis=1),
    }
    return {name: np.broadcast_to(one, len(theta)) for name, one in found.items()}


def simulate_again(name: str, index: int, law: str | None = None) -> Record:
    """One simulation at a board: the ranks of the draw that made the new readings."""
    started = time.perf_counter()
    rng = np.random.default_rng([BOARDS.index(name), index])
    record: Record = {"board": name, "simulation": index}
    try:
        problem, pool = at_board(name, law)
        posterior = problem.posterior
        truth = pool[rng.integers(len(pool))][None]
        noise = np.exp(posterior.parameters.log_noise(truth))
        predicted = posterior.log_frequencies(truth)
        hertz = [
            errors.simulate(one, noise[:, i], rng)[0]
            for i, (errors, one) in enumerate(zip(posterior.readings, predicted, strict=True))
        ]
        second = with_readings(posterior, hertz)
        both = OfBoth(posterior.board, posterior.prior, posterior.models, posterior.law, second=second)
        draws, _ = posterior_draws(replace(problem, posterior=both, is_forced=True), Design(), rng)
    except BayesplateError as error:
        return record | {"error": f"{type(error).__name__}: {error}"}
    ranks = {"production": _ranks(both, truth, draws), MUTANT: _ranks(both, truth, narrowed(draws, NARROWER[MUTANT]))}
    return record | {"ranks": ranks, "law": posterior.law, "seconds": round(time.perf_counter() - started, 2)}


def _ranks(posterior: Posterior, truth: Floats, draws: Floats) -> dict[str, int]:
    true, drawn = quantities(posterior, truth), quantities(posterior, draws)
    return {name: int(np.sum(drawn[name] < true[name][0])) for name in true}


def identity() -> dict[str, Any]:
    """What a file of these records must agree in."""
    return {"format": 1, "part": "boards", "n_draws": N_DRAWS, "boards": list(BOARDS)}


def judge(records: Sequence[Record], fewest: int = FEWEST) -> tuple[list[str], bool]:
    """Lines to print, and whether all is well."""
    lines, well = [], True
    for name in BOARDS:
        of_board = [record for record in records if record["board"] == name]
        good = [record["ranks"] for record in of_board if "ranks" in record]
        failed = [record for record in of_board if "error" in record]
        if failed:
            lines.append(f"{name}: {len(failed)} simulations gave no draws; the first: {failed[0]['error']}")
            well = False
        if len(good) < fewest:
            lines.append(f"{name}: {len(good)} simulations, {fewest} are needed to judge")
            well = False
            continue
        table, wrong = (rows([one[kind] for one in good]) for kind in ("production", MUTANT))
        is_caught = family_p_value(wrong) < MUTANT_LEVEL
        told = "caught" if is_caught else "NOT CAUGHT"
        lines += text(name, table, len(good)).splitlines()
        lines.append(f"  {family_words(table)}; {MUTANT}: p {family_p_value(wrong):.1e}, {told}")
        well &= is_calibrated(table) and is_caught
    return lines, well
