"""Known effects, which need no search: shear, air, effects that the card states; computed, with the resulting error.

Known effects are computed in every combination of up to three, because two of them may lower an error that each of them
alone raises. The library says whether an effect is known (`Effect.is_known`) and how it is computed
(`Effect.at_known_size`): its sizes are those that the card states, or the medians of their priors. Sizes of other
effects that the board declares without stating them have the values of its own fit, all other inputs their nominal
values, as in `bayesplate.estimates.least_squares`. Only the constants are fitted, so that an error may rise or fall.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board, Values
from bayesplate.board.material import moduli_of
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import readings_by_mode
from bayesplate.diagnosis.baseline import Baseline, PossibleModes, baseline_of, labelled_rows, symmetry_of
from bayesplate.diagnosis.peaks import likely_labels
from bayesplate.effects import EFFECTS, Effect
from bayesplate.errors import Fault, NotIdentifiableError
from bayesplate.estimates.least_squares import log_measured, reading_scales
from bayesplate.estimates.leave_one_out import PredictionErrors, prediction_errors
from bayesplate.estimates.refit import has_come_to_rest, normal_misfit, refit, sensitivities
from bayesplate.frequencies.model import SetupModel, setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.posing import PosedProblem

Models = Sequence[SetupModel]

MOST_KNOWN_EFFECTS = 3
"""Largest number of known effects that are computed together."""
_MOST_LABELLINGS, _MOST_SOLVES = 4, 4
_ACCEPTED_CENTS = 0.1
"""Accepted error of the law of a known effect, cents: its result is shown beside the full solves of `check`."""
_LAW_REACH = 0.1
"""Change of ln D up to which a law holds: half a side of the smallest box in which it is trained."""


@dataclass(frozen=True, eq=False)
class KnownFit:
    """The constants fitted to a board with known effects of fixed sizes."""

    combination: tuple[str, ...]  # all known effects of the fit
    effects: tuple[str, ...]  # known effects that the board does not declare
    without: tuple[str, ...]  # known effects that the board declares and that are left out
    baseline: Baseline  # the fit, all inputs fixed, with its likely labels
    moduli: Floats  # (3,) array, Pa: E_x, E_y, G_xy
    errors: PredictionErrors  # of ln f of each reading, in sample and left out; not a number where it is no mode


def known_fits(problem: PosedProblem, tell: Callable[[float], None] | None = None) -> tuple[KnownFit, ...]:
    """The board as it stands, then with its known effects in every combination of up to three, smaller ones first.

    The combination of all effects that the card states is among them, however large. One with which the readings no
    longer determine the constants is left out; there are no fits where they do not determine those of the board as it
    stands.
    """
    board = problem.board
    declared = {name for name in known_effects(board) if name in board.effects}
    is_stated = not any(parameter.source for parameter in board.uncertain if parameter.effect in declared)
    all_combinations = [
        None,
        *(combination for combination in known_combinations(board) if set(combination) != declared or not is_stated),
    ]
    fits = []
    for n_done, combination in enumerate(all_combinations, start=1):
        try:
            fits.append(known_fit(problem, combination))
        except NotIdentifiableError:
            if combination is None:
                return ()
        if tell is not None:
            tell(n_done / len(all_combinations))
    return tuple(fits)


def known_fit(problem: PosedProblem, combination: Sequence[str] | None = None) -> KnownFit:
    """The constants fitted to a board with a combination of its known effects; by default to the board as it stands."""
    declared = [name for name in known_effects(problem.board) if name in problem.board.effects]
    baseline = fit_with_effects(problem, combination)
    used_readings, law = baseline.mode_readings, baseline.possible_modes.predict
    assert isinstance(law, Predictor)
    modes = [np.flatnonzero(np.isin(used_readings, mode)).tolist() for mode in readings_by_mode(problem.board)]
    errors = prediction_errors(
        law.of(baseline.rows[used_readings]),
        baseline.log_readings[used_readings],
        normal_misfit(baseline.log_readings[used_readings], baseline.scales[used_readings]),
        baseline.log_rigidities[None, :],
        modes=[mode for mode in modes if mode],
    )
    combination = declared if combination is None else combination
    return KnownFit(
        combination=tuple(combination),
        effects=tuple(name for name in combination if name not in declared),
        without=tuple(name for name in declared if name not in combination),
        baseline=baseline,
        moduli=np.array(moduli_of(baseline.values)),
        errors=errors.at(used_readings, baseline.n_modes),
    )


def fit_with_effects(problem: PosedProblem, combination: Sequence[str] | None, n_first: int | None = None) -> Baseline:
    """The constants fitted to a board with known effects (None: as it stands), solved again where they move far.

    They are fitted to the first `n_first` readings, by default to all; the others, which are predicted, keep their
    labels. Raises NotIdentifiableError where the readings do not determine the constants.
    """
    board = problem.board if combination is None else with_combination(problem.board, combination)
    inputs, estimate = _inputs_of(problem, board), _estimated_log_rigidities(problem)
    log_rigidities = estimate
    models = problem.posterior.models if combination is None else _solve_models(problem, board, inputs, log_rigidities)
    rows = labelled_rows(models)
    for _ in range(_MOST_SOLVES):
        start = log_rigidities
        law = Predictor(lambda x: _values(board, x, inputs), models, "exact", n_constants=board.symmetry.n)
        for _ in range(_MOST_LABELLINGS):
            used_readings = np.flatnonzero(rows[:n_first] >= 0)  # readings that are a mode
            log_rigidities = refit(
                law.of(rows[used_readings]),
                log_measured(board)[used_readings],
                reading_scales(board)[used_readings],
                log_rigidities,
            )
            previous_rows, rows = rows, _likely_rows(problem, law, rows, log_rigidities)
            if n_first is not None:
                rows = np.concatenate([rows[:n_first], previous_rows[n_first:]])
            if np.array_equal(rows, previous_rows):
                break
        if not has_come_to_rest(log_rigidities, estimate, board.symmetry.n):
            wanted = f"constants that the readings determine with {', '.join(board.effects) or 'no effect'}"
            raise NotIdentifiableError(Fault(board.name, wanted, "none near those of the board as it stands"))
        rows = previous_rows
        if np.abs(log_rigidities - start).max() <= _LAW_REACH:
            break
        models = _solve_models(problem, board, inputs, log_rigidities)
    return Baseline(
        board=board,
        values=_values(board, log_rigidities, inputs),
        log_rigidities=log_rigidities,
        log_readings=log_measured(board),
        possible_modes=PossibleModes(
            log_frequency=law(log_rigidities[None, :])[0],
            slopes=sensitivities(law, log_rigidities),
            input_slopes=np.zeros((sum(len(model.mode_places) for model in law.models), 0)),
            places=tuple(model.mode_places for model in law.models),
            inputs=np.zeros(0),
            peaks=(None,) * len(law.models),
            predict=law,
        ),
        rows=rows,
        symmetry=symmetry_of(law.models),
    )


def _likely_rows(problem: PosedProblem, law: Predictor, rows: Indices, log_rigidities: Floats) -> Indices:
    """The likely labels of the readings at fitted constants, with the noise from the misfit there.

    `rows` where all labels are certain, and where the plate has another symmetry, so that its modes do not correspond.
    """
    if not any(problem.posterior.peaks):
        return rows
    predicted = law(log_rigidities[None, :])
    if predicted.shape[1] != sum(problem.posterior.n_modes):
        return rows
    used_readings = np.flatnonzero(rows >= 0)
    residual = log_measured(problem.board)[used_readings] - predicted[0, rows[used_readings]]
    medians = np.array([setup.noise.median for setup in problem.board.setups])
    noise = np.maximum(medians, float(np.sqrt(np.mean(residual**2))))
    return likely_labels(baseline_of(problem), predicted, noise[None, :], rows)


def _inputs_of(problem: PosedProblem, board: Board) -> Values:
    """Nominal inputs of a board, but for sizes of declared effects with a prior of the library.

    The readings determine these: they have their values at the centre of the posterior of the problem's board.
    """
    estimates = problem.parameters.values(problem.centre[None, :])
    learnt_names = (
        parameter.name
        for parameter in board.uncertain
        if parameter.is_of_effect and parameter.source and not parameter.is_component
    )
    return {**board.nominal(), **{name: np.asarray(estimates[name][0]) for name in learnt_names}}


def _values(board: Board, log_rigidities: Floats, inputs: Values) -> Values:
    return {**inputs, **board.symmetry.rigidities(np.exp(log_rigidities).T, inputs["poisson_xy"])}


def _estimated_log_rigidities(problem: PosedProblem) -> Floats:
    """ln of the free rigidities of the board as it stands."""
    return np.log(problem.board.symmetry.free_of(problem.estimate.values))


def _solve_models(problem: PosedProblem, board: Board, inputs: Values, log_rigidities: Floats) -> Models:
    """A model of each setup at given ln D, with the exact law around them for the constants alone.

    The mesh is that of the board as it stands, so that its matrices are used again. A mode keeps its class and its rank
    of that board, as long as the plate keeps its symmetry: where two modes lie close, their shapes would exchange names
    from one model to the next, and errors of different modes would be compared.
    """
    values, mesh_values = (
        _values(board, log_rigidities, inputs),
        _values(board, _estimated_log_rigidities(problem), inputs),
    )
    models = []
    for setup, fitted_model in zip(board.setups, problem.posterior.models, strict=True):
        system = system_of(board, setup)
        model = setup_model(system, values, system.plate(mesh_values))
        keeps_symmetry = symmetry_of([model]) == symmetry_of([fitted_model])
        models.append(
            replace(model, places=fitted_model.places, other_modes=fitted_model.other_modes)
            if keeps_symmetry
            else model
        )
    slopes = board.symmetry.along(np.concatenate([model.sensitivities(values) for model in models]))
    weighted = slopes / reading_scales(board)[:, None]
    fixed_board = board.with_priors({name: Quantity.exact(float(value)) for name, value in inputs.items()})
    parameters = Parameters(fixed_board)
    n, covariance = parameters.n_constants, np.eye(parameters.n_dim)
    covariance[:n, :n] = np.linalg.inv(weighted.T @ weighted)
    centre = parameters.theta(values, np.array([setup.noise.median for setup in board.setups]))
    return exact_models(fixed_board, models, centre, covariance, is_rough=True, accepted_cents=_ACCEPTED_CENTS)


def known_effects(board: Board) -> tuple[str, ...]:
    """Effects of known size that can act in a setup of the board, declared or not, in the order of the library."""
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if effect.is_known(board) and (name in board.effects or effects_at_known_size(board, name))
    )


def stated_effects(board: Board) -> tuple[str, ...]:
    """Known effects that the card states or declares: nothing about them is chosen by the readings."""
    return tuple(name for name in known_effects(board) if name in board.effects or EFFECTS[name].is_implied(board))


def known_combinations(board: Board) -> list[tuple[str, ...]]:
    """Combinations of up to three known effects, smaller ones first, and that of all effects that the card states."""
    names = known_effects(board)
    small_combinations = [
        combination for n in range(min(MOST_KNOWN_EFFECTS, len(names)) + 1) for combination in combinations(names, n)
    ]
    stated = stated_effects(board)
    return [*small_combinations, *([stated] if len(stated) > MOST_KNOWN_EFFECTS else [])]


def with_combination(board: Board, combination: Sequence[str]) -> Board:
    """A board with a combination of its known effects and without the others, whether it declares them or not.

    A size that the card states for a declared effect stays; every other size is fixed at the median of its prior.
    """
    left_out = [name for name in known_effects(board) if name in board.effects and name not in combination]
    kept_board, new_effects = board.without(left_out), [name for name in combination if name not in board.effects]
    acting_effects = [effect for name in new_effects for effect in effects_at_known_size(board, name)]
    extended_board = replace(
        kept_board,
        effects=(*kept_board.effects, *new_effects),
        effect_forms=(*kept_board.effect_forms, *acting_effects),
    )
    sizes = {size.name: size for effect in acting_effects for size in effect.parameters()}
    sizes |= {size.name: size for size in kept_board.uncertain if size.effect in combination and size.source}
    return extended_board.with_parameters(
        replace(size, prior=Quantity.exact(size.prior.median)) for size in sizes.values()
    )


def effects_at_known_size(board: Board, name: str) -> list[Effect]:
    """An effect at its known size in each setup in which it can act."""
    effects = (EFFECTS[name].at_known_size(board, setup) for setup in board.setups)
    return [effect for effect in effects if effect is not None]
