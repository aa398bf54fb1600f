"""Boards with a planted effect, everything drawn from the priors that the fit is told, fitted as a user would.

The card declares one effect and gives it a prior, or leaves the effect its own. Constants, nu_xy, noise and the
parameters of the effect are drawn from just these priors; the generator, another discretisation, makes the readings.
Then intervals of 90 % hold the truth in 90 of 100 boards, whatever the effect.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from generator.card import card_text
from generator.designs import DESIGNS, MEDIANS, Design, Setup
from generator.naming import LEAST_CORRELATION, Label, frequencies
from generator.recipes import RECIPES
from validation.calibration.cases import CASES, Place, Values, effect_of

from bayesplate.board.board import Board
from bayesplate.board.material import MODULI
from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import PreparedBoard, prepare
from bayesplate.errors import BayesplateError
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.draws import Draws, named_draws
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.reweighting import linear_is_enough
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.results.contract import Spread

NOISE = "{ median = 0.3, factor = 1.65 }"
POISSON = "{ mean = 0.4, sd = 0.08 }"
MOST_ATTEMPTS, MOST_REDRAWS = 4, 100
Readings = Mapping[str, Mapping[Label, float]]


@dataclass(frozen=True)
class Settings:
    """How boards are fitted.

    Attributes
    ----------
    base_seed : int
    n_ensembles, n_walkers : int
    gate_taus, ess_min : float
        See `Gate`; the ends of an interval from 1000 draws err by a fifteenth of the posterior's sd.
    max_steps : int
    """

    base_seed: int = 1
    n_ensembles: int = 2
    n_walkers: int = 32
    gate_taus: float = 50.0
    ess_min: float = 1000.0
    max_steps: int = 10_000

    def sampler(self, seed: int) -> SamplerSettings:
        """The sampler's."""
        gate = Gate(tau_count_min=self.gate_taus, ess_min=self.ess_min)
        return SamplerSettings(seed, self.n_ensembles, self.n_walkers, max_steps=self.max_steps, gate=gate)


@dataclass(frozen=True)
class Truth:
    """One draw from the priors.

    Attributes
    ----------
    values : dict
        E_x, E_y, G_xy (Pa), and the uncertain inputs of the board by their names, SI.
    noise : dict
        Setup name -> relative noise.
    hertz : dict
        Setup name -> laboratory's label -> reading.
    redraws : int
        Draws that were passed over because a label was in doubt, as a laboratory could not name such a mode.
    """

    values: Values
    noise: Mapping[str, float]
    hertz: Readings
    redraws: int


def prior_text() -> str:
    """A prior card with the spread of the generator's own boards: spruce, chosen as such."""
    tables = [
        f'[{name}]\ndistribution = "log-normal"\nmedian_gpa = {median / 1e9}\nfactor = {factor}\nsource = "made"'
        for name, (median, factor) in MEDIANS.items()
    ]
    return "\n".join(['format = 1\nname = "spread"', *tables]) + "\n"


def prepared(folder: Path, name: str, hertz: Readings, place: Place) -> PreparedBoard:
    """The card of a case with these readings, read as a user's is."""
    case = CASES[name]
    text = card_text(
        "planted",
        DESIGNS[case.design],
        hertz,
        noise_cents=0.0,
        places=(place,) if case.is_attached else (),
        driven=(place,) if case.is_driven else (),
        prior="./spread.toml",
        stated={"effects": f'["{effect_of(name)}"]', "poisson_xy": POISSON, "noise_percent": NOISE, **case.stated},
    )
    (folder / "spread.toml").write_text(prior_text())
    (folder / "planted.toml").write_text(text)
    return prepare(folder / "planted.toml")


def drawn(quantity: Quantity, rng: np.random.Generator) -> float:
    """A draw from a prior, within its bounds."""
    while True:
        value = float(quantity.value(rng.standard_normal()))
        if quantity.lower <= value <= quantity.upper:
            return value


def short_names(values: Values, board: Board) -> dict[str, float]:
    """Values by the effect's own names: compliance for clamp_rotation.compliance[cantilever]."""
    keys = {parameter.name: parameter.key for parameter in board.parameters}
    return {keys.get(name, name): value for name, value in values.items()}


def draw_truth(name: str, asked: PreparedBoard, place: Place, rng: np.random.Generator) -> Truth:
    """Draw everything from the priors of a prepared card, until the generator names every mode beyond doubt."""
    for redraws in range(MOST_REDRAWS):
        values = {key: float(density.sample(rng, 1)[0]) for key, density in asked.prior.constants.items()}
        values |= {key: drawn(quantity, rng) for key, quantity in asked.board.uncertain_inputs.items()}
        noise = {setup.name: drawn(setup.noise, rng) for setup in asked.board.setups}
        read: dict[str, dict[Label, float]] = {}
        for setup in DESIGNS[CASES[name].design].setups:
            exact, correlation = _frequencies(name, asked.board, setup, values, place)
            if correlation < LEAST_CORRELATION:
                break
            own = noise[setup.name]
            read[setup.name] = {
                setup.label(b): f * float(np.exp(own * rng.standard_normal())) for b, f in exact.items()
            }
        else:
            return Truth(values, noise, read, redraws)
    raise RuntimeError(f"{name}: wanted a board with clear labels, got none in {MOST_REDRAWS} draws")


def _frequencies(
    name: str, board: Board, setup: Setup, values: Values, place: Place
) -> tuple[dict[Label, float], float]:
    """What the generator gives for a setup, with the effect where it acts, and how clear its labels are."""
    covered = values.get(f"clamped_x0[{setup.name}]", setup.covered)
    constants = {key: values[key] for key in MODULI}
    design = DESIGNS[CASES[name].design]
    plate = design.plate(replace(setup, covered=covered), {**constants, "nu_xy": values["poisson_xy"]})
    acts = RECIPES[effect_of(name)].acts(setup)
    acting = [CASES[name].make(short_names(values, board), plate, place)] if acts else []
    return frequencies(plate, acting, setup.beams, CASES[name].n)


def fitted(problem: PosedProblem, settings: Settings, rng: np.random.Generator) -> tuple[Draws, int]:
    """Draws of a problem and how many runs they took; under the exact law where the linear one turns out too rough.

    A run that fails the gate is started anew with other random numbers: to leave the board out would favour easy ones.
    """
    inference = None
    for attempt in range(1, MOST_ATTEMPTS + 1):
        seed = int(rng.integers(2**31))
        inference = infer(problem, settings.sampler(seed))
        if not inference.convergence.passed:
            continue
        draws = named_draws(inference, seed)
        if problem.posterior.law == "exact" or linear_is_enough(draws):
            return draws, attempt
        problem = problem.under("exact")
    assert inference is not None
    raise BayesplateError("; ".join(inference.convergence.reasons) or "no law serves")


def intervals(board: Board, truth: Truth, draws: Draws) -> dict[str, dict[str, float]]:
    """Truth, q05, q50 and q95 of every quantity, as the summary of a fit gives them, and its sd over the prior's."""
    found: dict[str, dict[str, float]] = {}
    by_name = {**draws.moduli, **draws.inputs}
    for name, values in by_name.items():
        found[name] = {"truth": truth.values[name], **_quantiles(values)}
    for name, quantity in board.uncertain_inputs.items():
        found[name]["narrowing"] = float(np.std(quantity.standard(draws.inputs[name])) / _prior_sd(quantity))
    first = board.setups[0].name
    found["noise"] = {"truth": truth.noise[first], **_quantiles(draws.noise[..., 0])}
    return found


def _quantiles(values: np.ndarray) -> dict[str, float]:
    one = Spread.of(values, "")
    return {"q05": one.q05, "q50": one.q50, "q95": one.q95}


def _prior_sd(quantity: Quantity) -> float:
    """Standard deviation of the standard coordinate within the bounds."""
    z = np.random.default_rng(0).standard_normal(10_000)
    values = quantity.value(z)
    return float(np.std(z[(values >= quantity.lower) & (values <= quantity.upper)]))


def identity(settings: Settings) -> dict[str, Any]:
    """What a file of records must agree in before more are added to it: settings, cards and priors."""
    cases = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, case in CASES.items():
            asked = prepared(Path(folder), name, unread(DESIGNS[case.design]), (0.1, 0.1))
            uncertain = asked.board.uncertain_inputs | {"noise": asked.board.setups[0].noise}
            priors = {n: f"{q.kind} {q.mean:g} +- {q.sd:g}, {q.lower:g} to {q.upper:g}" for n, q in uncertain.items()}
            cases[name] = {"design": case.design, **priors}
    return {"format": 1, "settings": asdict(settings), "constants": {n: list(v) for n, v in MEDIANS.items()}, **cases}


def unread(design: Design) -> Readings:
    """Readings for a card of which only the priors are asked."""
    return {setup.name: {setup.label(beams): 100.0 for beams in setup.beams} for setup in design.setups}


def cover_one(settings: Settings, name: str, index: int) -> dict[str, Any]:
    """Plant one board and fit it.

    Parameters
    ----------
    settings : Settings
    name : str
        One of `CASES`.
    index : int
        Seeds everything random, together with the case and the base seed.

    Returns
    -------
    dict
        effect, board, and either quantities, seconds, law, attempts, redraws, or error.
    """
    started = time.perf_counter()
    seeds = np.random.SeedSequence([settings.base_seed, *name.encode(), index]).spawn(2)
    for_truth, for_draws = (np.random.default_rng(seed) for seed in seeds)
    record: dict[str, Any] = {"effect": name, "board": index}
    design = DESIGNS[CASES[name].design]
    with tempfile.TemporaryDirectory() as folder:
        try:
            place = _place(design, for_truth)
            truth = draw_truth(name, prepared(Path(folder), name, unread(design), place), place, for_truth)
            asked = prepared(Path(folder), name, truth.hertz, place)
            draws, attempts = fitted(pose(asked.board, asked.prior), settings, for_draws)
        except BayesplateError as error:
            return record | {"error": f"{type(error).__name__}: {error}"}
    return record | {
        "quantities": intervals(asked.board, truth, draws),
        "seconds": round(time.perf_counter() - started, 2),
        "law": draws.problem.posterior.law,
        "attempts": attempts,
        "redraws": truth.redraws,
    }


def _place(design: Design, rng: np.random.Generator) -> Place:
    """Anywhere on the board but its rim, to a tenth of a millimetre, as a card gives it."""
    x, y = (round(float(length * rng.uniform(0.05, 0.95)), 4) for length in (design.L_x, design.L_y))
    return x, y
