"""What physics knows and nobody needs to search: shear, air, what the card states; computed, and the error it leads to.

Known effects are computed in every combination of up to three, for two of them may lower an error that each of them
alone raises. Each says itself whether it is known (`Effect.is_known`) and how it is computed (`Effect.at_known_size`):
its sizes are what the card states, or the medians of their priors. Sizes of other effects that the board declares
without stating them stand where its own fit has them, all other inputs at their nominal values, as in
`bayesplate.estimates.least_squares`. Nothing is fitted but the constants, so that an error may rise as well as fall.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import RIGIDITIES, moduli
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import same_modes
from bayesplate.diagnosis.baseline import Baseline, PossibleModes, Rows, baseline_of, labelled_rows, symmetry_of
from bayesplate.diagnosis.peaks import likely_labels
from bayesplate.effects import EFFECTS, Effect
from bayesplate.estimates.least_squares import log_measured, reading_scales
from bayesplate.estimates.leave_one_out import Errors, prediction_errors
from bayesplate.estimates.refit import normal_misfit, refit, sensitivities
from bayesplate.frequencies.model import SetupModel, setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.posing import PosedProblem

Models = Sequence[SetupModel]

MOST_TOGETHER = 3
"""Known effects that are computed together, at most."""
_MOST_LABELLINGS, _MOST_PLACES = 4, 4
_ACCEPTED_CENTS = 0.1
"""Error of a law of a known effect: it is shown beside what `check` solves in full."""
_NEAR = 0.1
"""Change of ln D up to which a law holds that was made before it: half a side of the smallest box it is trained in."""


@dataclass(frozen=True, eq=False)
class KnownFit:
    """The constants fitted to a board with known effects of fixed sizes."""

    combination: tuple[str, ...]  # all known effects that it has
    effects: tuple[str, ...]  # those beyond what the board declares
    without: tuple[str, ...]  # known ones that the board declares and that are left out
    baseline: Baseline  # the fit, all inputs fixed, with the labels that it makes likely
    moduli: Floats  # (3,) array, Pa: E_x, E_y, G_xy
    errors: Errors  # of ln f of every reading, in sample and left out; not a number where the reading is no mode


def known_fits(problem: PosedProblem, tell: Callable[[float], None] | None = None) -> tuple[KnownFit, ...]:
    """The board as it stands, then with its known effects in every combination of up to three, fewer ones first.

    All that the card states together is among them, however much it is.
    """
    board = problem.board
    own = {name for name in known_effects(board) if name in board.effects}
    is_stated = not any(one.source for one in board.uncertain if one.effect in own)
    every = [None, *(one for one in every_combination(board) if set(one) != own or not is_stated)]
    found = []
    for one in every:
        found.append(known_fit(problem, one))
        if tell is not None:
            tell(len(found) / len(every))
    return tuple(found)


def known_fit(problem: PosedProblem, combination: Sequence[str] | None = None) -> KnownFit:
    """The constants fitted to a board with some of its known effects and no others; by default as it stands."""
    own = [name for name in known_effects(problem.board) if name in problem.board.effects]
    baseline = fit_with(problem, combination)
    kept, law = baseline.used, baseline.every.predict
    assert isinstance(law, Predictor)
    modes = [np.flatnonzero(np.isin(kept, mode)).tolist() for mode in same_modes(problem.board)]
    errors = prediction_errors(
        law.of(baseline.rows[kept]),
        baseline.log_readings[kept],
        normal_misfit(baseline.log_readings[kept], baseline.scales[kept]),
        baseline.log_rigidities[None, :],
        modes=[mode for mode in modes if mode],
    )
    D_x, D_y, D_s, thickness, nu_xy = (baseline.values[name] for name in (*RIGIDITIES, "thickness", "poisson_xy"))
    combination = own if combination is None else combination
    return KnownFit(
        combination=tuple(combination),
        effects=tuple(name for name in combination if name not in own),
        without=tuple(name for name in own if name not in combination),
        baseline=baseline,
        moduli=np.array(moduli(D_x, D_y, D_s, thickness, nu_xy)),
        errors=errors.at(kept, baseline.n_modes),
    )


def fit_with(problem: PosedProblem, combination: Sequence[str] | None, n_first: int | None = None) -> Baseline:
    """The constants fitted to a board with known effects (None: as it stands), the law made anew where they move far.

    Only the first `n_first` of the readings tell them, by default all.
    """
    board = problem.board if combination is None else with_combination(problem.board, combination)
    inputs, fitted = _inputs_of(problem, board), _estimated(problem)
    models = problem.posterior.models if combination is None else _solved(problem, board, inputs, fitted)
    rows = labelled_rows(models)
    for _ in range(_MOST_PLACES):
        start = fitted
        law = Predictor(lambda x: _values(board, x, inputs), models, "exact", n_constants=board.symmetry.n)
        for _ in range(_MOST_LABELLINGS):
            kept = np.flatnonzero(rows[:n_first] >= 0)  # readings that are a mode
            fitted = refit(law.of(rows[kept]), log_measured(board)[kept], reading_scales(board)[kept], fitted)
            before, rows = rows, _likely(problem, law, rows, fitted)
            if np.array_equal(rows, before):
                break
        rows = before
        if np.abs(fitted - start).max() <= _NEAR:
            break
        models = _solved(problem, board, inputs, fitted)
    return Baseline(
        board=board,
        values=_values(board, fitted, inputs),
        log_rigidities=fitted,
        log_readings=log_measured(board),
        every=PossibleModes(
            log_frequency=law(fitted[None, :])[0],
            slopes=sensitivities(law, fitted),
            input_slopes=np.zeros((sum(len(one.every_place) for one in law.models), 0)),
            places=tuple(one.every_place for one in law.models),
            inputs=np.zeros(0),
            peaks=(None,) * len(law.models),
            predict=law,
        ),
        rows=rows,
        symmetry=symmetry_of(law.models),
    )


def _likely(problem: PosedProblem, law: Predictor, rows: Rows, fitted: Floats) -> Rows:
    """The likely labels at fitted constants, whose own misfit tells the noise.

    The same where all labels are certain, and where the plate's symmetry is another, so that modes cannot be told.
    """
    if not any(problem.posterior.peaks):
        return rows
    predicted = law(fitted[None, :])
    if predicted.shape[1] != sum(problem.posterior.n_every):
        return rows
    kept = np.flatnonzero(rows >= 0)
    off = log_measured(problem.board)[kept] - predicted[0, rows[kept]]
    medians = np.array([setup.noise.median for setup in problem.board.setups])
    noise = np.maximum(medians, float(np.sqrt(np.mean(off**2))))
    return likely_labels(baseline_of(problem), predicted, noise[None, :], rows)


def _inputs_of(problem: PosedProblem, board: Board) -> Values:
    """Nominal inputs of a board, but for sizes that it declares and leaves to a prior of the library.

    The readings tell those: they stand at the centre of the posterior of the problem's board.
    """
    there = problem.parameters.values(problem.centre[None, :])
    learnt = (one.name for one in board.uncertain if one.is_of_effect and one.source and not one.is_component)
    return {**board.nominal(), **{name: np.asarray(there[name][0]) for name in learnt}}


def _values(board: Board, log_rigidities: Floats, inputs: Values) -> Values:
    return {**inputs, **board.symmetry.rigidities(np.exp(log_rigidities).T, inputs["poisson_xy"])}


def _estimated(problem: PosedProblem) -> Floats:
    """ln of the free rigidities of the board as it stands."""
    return np.log(problem.board.symmetry.free_of(problem.estimate.values))


def _solved(problem: PosedProblem, board: Board, inputs: Values, at: Floats) -> Models:
    """Every setup solved at given ln D, with the exact law around them for the constants alone.

    The mesh is that of the board as it stands, so that its matrices serve again. A mode keeps its class and its rank
    there, as long as the plate keeps its symmetry: where two modes lie close, their shapes would exchange names from
    one model to the next, and errors of different modes would be compared.
    """
    values, meshed = _values(board, at, inputs), _values(board, _estimated(problem), inputs)
    models = []
    for setup, before in zip(board.setups, problem.posterior.models, strict=True):
        system = system_of(board, setup)
        model = setup_model(system, values, system.plate(meshed))
        keeps = symmetry_of([model]) == symmetry_of([before])
        models.append(replace(model, places=before.places, others=before.others) if keeps else model)
    slopes = board.symmetry.along(np.concatenate([one.sensitivities(values) for one in models]))
    weighted = slopes / reading_scales(board)[:, None]
    fixed = board.with_priors({name: Quantity.exact(float(value)) for name, value in inputs.items()})
    parameters = Parameters(fixed)
    n, covariance = parameters.n_constants, np.eye(parameters.n_dim)
    covariance[:n, :n] = np.linalg.inv(weighted.T @ weighted)
    centre = parameters.theta(values, np.array([setup.noise.median for setup in board.setups]))
    return exact_models(fixed, models, centre, covariance, is_rough=True, accepted_cents=_ACCEPTED_CENTS)


def known_effects(board: Board) -> tuple[str, ...]:
    """Effects of known size that can act in a setup of the board, declared or not, in the order of the library."""
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if effect.is_known(board) and (name in board.effects or acting_at_known_size(board, name))
    )


def stated_effects(board: Board) -> tuple[str, ...]:
    """Known effects that the card states or declares: nothing about them is chosen by the readings."""
    return tuple(name for name in known_effects(board) if name in board.effects or EFFECTS[name].is_implied(board))


def every_combination(board: Board) -> list[tuple[str, ...]]:
    """Combinations of up to three known effects, fewer ones first, and of all that the card states."""
    names = known_effects(board)
    found = [one for n in range(min(MOST_TOGETHER, len(names)) + 1) for one in combinations(names, n)]
    stated = stated_effects(board)
    return [*found, *([stated] if len(stated) > MOST_TOGETHER else [])]


def with_combination(board: Board, combination: Sequence[str]) -> Board:
    """A board with some of its known effects and without the others, whether it declares them or not.

    What it declares and states in full stays as it is; every other size is fixed at the median of its prior.
    """
    others = [name for name in known_effects(board) if name in board.effects and name not in combination]
    kept, new = board.without(others), [name for name in combination if name not in board.effects]
    acting = [one for name in new for one in acting_at_known_size(board, name)]
    added = replace(kept, effects=(*kept.effects, *new), chosen=(*kept.chosen, *acting))
    sizes = {one.name: one for effect in acting for one in effect.parameters()}
    sizes |= {one.name: one for one in kept.uncertain if one.effect in combination and one.source}
    return added.with_parameters(replace(size, prior=Quantity.exact(size.prior.median)) for size in sizes.values())


def acting_at_known_size(board: Board, name: str) -> list[Effect]:
    """An effect at its known size in each setup in which it can act."""
    found = (EFFECTS[name].at_known_size(board, setup) for setup in board.setups)
    return [one for one in found if one is not None]
