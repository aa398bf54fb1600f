"""Ranks of the truth among draws where most modes are peaks without a label, and some have left none.

Three modes that tell the constants and the highest one have labels that are sure. Of the other modes each leaves a peak
with the probability that the fit is told, unless noise lifts it above the highest reading, where nobody looked. One
linear law is both the truth and the fit, so that nothing but the sum over assignments and the sampler can be wrong.
A wrong posterior has to be found out: one that believes in half of the noise.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import lru_cache

import numpy as np
from made_boards import NARROW, peaks_of
from numpy.typing import NDArray
from validation.calibration.records import Record
from validation.calibration.sbc import posterior_draws, random_lines, ranked, ranks_among
from validation.calibration.truths import Design, Truth, noises_of, prior_values, reference, under_the_fixed_law

from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.errors import BayesplateError
from bayesplate.frequencies.model import SetupModel, with_other_modes
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.target import Posterior

DESIGN = Design(law="fixed-linear", resolution=0.0)
SURE = ((1, 1), (2, 0), (0, 2), (4, 1))
UNREAD = (3, 3)
"""A mode above the highest reading."""
NOISE = Quantity.from_median(0.01, float(np.exp(0.5)))
"""Of one in a hundred: some neighbours are in doubt."""
MISSED = 0.3
HALF_NOISE = "noise fixed at half"
"""A wrong posterior that is to be found out."""
_NO_SPURIOUS = 1e-9
_FAR_UP = 2.0
"""Times the highest reading of the other calibrations: the modes up to there are found."""


@lru_cache(maxsize=1)
def every_mode() -> SetupModel:
    """The linear law of all modes up to somewhat above the highest that is read, at the medians of the prior."""
    problem = reference(DESIGN)
    values = {name: np.ravel(one)[0] for name, one in problem.parameters.values(problem.centre[None]).items()}
    (model,) = problem.posterior.models
    far_up = peaks_of(_FAR_UP * max(model.setup.measured))
    system = replace(model.system, setup=replace(model.setup, peaks=far_up))
    return with_other_modes(replace(model, system=system), values)


def unread(values: Mapping[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """ln f of the mode that is not read, from values by name: (n_draws,) array."""
    model = every_mode()
    return model.mode_log_frequencies(values, "linear")[:, model.mode_beams.index(UNREAD)]


def draw(rng: np.random.Generator) -> tuple[Truth, PosedProblem]:
    """A truth from the prior, and the fit of its labelled readings and bare peaks."""
    values = prior_values(DESIGN, DESIGN.prior_card, rng)
    noise = noises_of(DESIGN, rng, NOISE)
    model = every_mode()
    read = model.mode_log_frequencies({name: np.asarray(value) for name, value in values.items()}, "linear")[0]
    read = np.exp(read + noise[0] * rng.standard_normal(read.size))
    sure = [model.mode_beams.index(beams) for beams in SURE]
    hertz = dict(zip(SURE, read[sure].tolist(), strict=True))
    others = np.delete(read, sure)
    seen = others[(rng.random(others.size) >= MISSED) & (others < max(hertz.values()))]
    (setup,) = DESIGN.board({"free": hertz}, NOISE).setups
    setup = replace(setup, peaks=peaks_of(*sorted(seen)), missed=MISSED, spurious=_NO_SPURIOUS)
    return Truth(values, noise, {"free": hertz}, ()), problem_of(setup)


def problem_of(setup: Setup) -> PosedProblem:
    """The fit of a board in a setup under the one linear law."""
    first = reference(DESIGN)
    board = replace(first.board, setups=(setup,))
    return under_the_fixed_law(first, Posterior(board, first.prior, (every_mode().labelled_as(setup),), "linear"))


def simulate_one(index: int) -> Record:
    """One simulation: its ranks and those of the mutant, and how many peaks have no label."""
    started = time.perf_counter()
    for_truth, for_draws, for_mutants = random_lines(DESIGN.base_seed, 12, index)
    record: Record = {"simulation": index}
    try:
        truth, problem = draw(for_truth)
        draws, attempts = posterior_draws(problem, DESIGN, for_draws)
        ranks = {"production": ranks_among(problem, truth, draws, unread)}
        (setup,) = problem.board.setups
        wrong = problem_of(replace(setup, noise=Quantity.from_median(0.5 * NOISE.median, NARROW)))
        ranks[HALF_NOISE] = ranks_among(wrong, truth, posterior_draws(wrong, DESIGN, for_mutants)[0], unread)
    except BayesplateError as error:
        return record | {"error": f"{type(error).__name__}: {error}"}
    return record | ranked(ranks, started, attempts=attempts) | {"peaks": len(setup.peaks)}


def identity() -> Record:
    """What a file of ranks must agree in before more are added to it."""
    stated = {"sure": [list(one) for one in SURE], "noise": [NOISE.median, NOISE.log_sd], "missed": MISSED}
    return {"format": 1, "design": asdict(DESIGN), **stated}
