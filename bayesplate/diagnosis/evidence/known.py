"""What physics knows and nobody needs to search: shear, air, what the card states; computed, and the error it leads to.

Known effects are computed in every combination of up to three, for two of them may lower an error that each of them
alone raises. Each says itself whether it is known (`Effect.is_known`). Its sizes are what the card states, or the
medians of their priors. Sizes of other effects that the board declares without stating them stand where its own fit has
them, all other inputs at their nominal values, as in `bayesplate.estimates.least_squares`. Nothing is fitted but the
constants, so that an error may rise as well as fall.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.board.material import RIGIDITIES, moduli
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import same_modes
from bayesplate.diagnosis.evidence.combinations import (
    acting_at_known_size,
    every_combination,
    in_order,
    is_stated_in_full,
    known_effects,
    with_combination,
)
from bayesplate.diagnosis.evidence.peaks import likely_labels
from bayesplate.diagnosis.shifts.baseline import baseline_of, symmetry_of
from bayesplate.diagnosis.shifts.laws import FormLaw
from bayesplate.effects import effects_of
from bayesplate.estimates.least_squares import log_measured, reading_scales
from bayesplate.estimates.leave_one_out import Errors, prediction_errors
from bayesplate.estimates.refit import normal_misfit, refit, sensitivities
from bayesplate.frequencies.model import SetupModel, setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.posing import PosedProblem

Floats = NDArray[np.float64]
Models = Sequence[SetupModel]
Rows = NDArray[np.intp]

_MOST_LABELLINGS, _MOST_PLACES = 4, 4
_ACCEPTED_CENTS = 0.1
"""Error of a law of a known effect: it is shown beside what `check` solves in full."""
_NEAR = 0.1
"""Change of ln D up to which a law holds that was made before it: half a side of the smallest box it is trained in."""


@dataclass(frozen=True, eq=False)
class KnownFit:
    """The constants fitted to a board with known effects of fixed sizes.

    Attributes
    ----------
    combination : tuple of str
        All known effects that it has.
    effects : tuple of str
        Those beyond what the board declares.
    without : tuple of str
        Known ones that the board declares and that are left out.
    log_rigidities : (n_constants,) array
        ln of the free rigidities (N m).
    moduli : (3,) array, Pa
        E_x, E_y, G_xy.
    errors : Errors
        Of ln f of every reading, in sample and left out; not a number where the reading is no mode.
    slopes : (n_readings, n_constants) array
        d ln f by ln of the free rigidities there.
    """

    combination: tuple[str, ...]
    effects: tuple[str, ...]
    without: tuple[str, ...]
    log_rigidities: Floats
    moduli: Floats
    errors: Errors
    slopes: Floats


def known_fits(
    problem: PosedProblem, laws: Mapping[str, FormLaw], tell: Callable[[float], None] | None = None
) -> tuple[KnownFit, ...]:
    """The board as it stands, and with its known effects in every combination of up to three, fewer ones first.

    Parameters
    ----------
    problem : PosedProblem
    laws : dict of FormLaw
        Of effects that were solved already, by name.
    tell : callable, optional
        Told which share of the fits is done.

    Returns
    -------
    tuple of KnownFit
        The board as it stands first. Of what the card states all together is among them, however much it is.
    """
    board = problem.board
    own = set(known_effects(board)) & set(board.effects)
    is_full = is_stated_in_full(board, own)  # then the board as it stands is one of the combinations
    sets = [set(one) for one in every_combination(board) if set(one) != own or not is_full]
    near = [one for one in sets if len(one ^ own) == 1]
    far = [one for one in sets if len(one ^ own) != 1]
    n_fits = 1 + len(sets)

    def told(fits: Iterable[KnownFit], n_before: int = 0) -> list[KnownFit]:
        found = []
        for one in fits:
            found.append(one)
            if tell is not None:
                tell((n_before + len(found)) / n_fits)
        return found

    def fit(combination: set[str]) -> KnownFit:
        solved = [laws[name] for name in combination - own if is_full and combination > own and name in laws]
        models = [one.models for one in solved if _is_as_known(board, one)]
        return known_fit(problem, in_order(combination), solved=models[0] if models else ())

    (stands,) = told([known_fit(problem, solved=problem.posterior.models)])
    single = told((fit(one) for one in near), 1)
    shifts = {
        next(iter(one ^ own)): found.log_rigidities - stands.log_rigidities
        for one, found in zip(near, single, strict=True)
    }

    def fit_from_shifts(combination: set[str]) -> KnownFit:
        start = sum((shifts[name] for name in combination ^ own if name in shifts), stands.log_rigidities)
        return known_fit(problem, in_order(combination), start=start)

    several = told((fit_from_shifts(one) for one in far), 1 + len(near))
    found = [*single, *several]
    return (stands, *sorted(found, key=lambda one: sets.index(set(one.combination))))


def known_fit(
    problem: PosedProblem,
    combination: Sequence[str] | None = None,
    *,
    start: Floats | None = None,
    solved: Models = (),
) -> KnownFit:
    """Fit the constants of a board with some of its known effects and without the others.

    Parameters
    ----------
    problem : PosedProblem
        The board as it stands.
    combination : sequence of str, optional
        By default the board as it stands, with sizes that it leaves open where its own fit has them.
    start : (n_constants,) array, optional
        ln of the free rigidities (N m) where the fit begins; by default the estimate of the board as it stands.
    solved : sequence of SetupModel
        With the exact law, made near the start; by default they are solved there.

    Returns
    -------
    KnownFit
    """
    own = [name for name in known_effects(problem.board) if name in problem.board.effects]
    board = problem.board if combination is None else with_combination(problem.board, combination)
    combination = own if combination is None else combination
    inputs, target, scales = inputs_of(problem, board), log_measured(board), reading_scales(board)
    start = _estimated(problem) if start is None else start
    models = solved or _solved(problem, board, start)
    law, rows = _law(board, models, inputs), _labelled(models)
    for _ in range(_MOST_LABELLINGS):
        fitted = _refit(law, rows, target, scales, start)
        if np.abs(fitted - start).max() > _NEAR:
            law = _law(board, _solved(problem, board, fitted), inputs)
            fitted = _refit(law, rows, target, scales, fitted)
        before, start = rows, fitted
        rows = _relabelled(problem, law(fitted[None, :]), rows)
        if np.array_equal(rows, before):
            break
    kept = np.flatnonzero(before >= 0)
    modes = [np.flatnonzero(np.isin(kept, mode)).tolist() for mode in same_modes(problem.board)]
    modes = [mode for mode in modes if mode]
    of_kept = law.of(before[kept])
    misfit = normal_misfit(target[kept], scales[kept])
    errors = prediction_errors(of_kept, target[kept], misfit, fitted[None, :], modes=modes)
    found = _values(board, fitted, inputs)
    D_x, D_y, D_s = (found[name] for name in RIGIDITIES)
    return KnownFit(
        combination=tuple(combination),
        effects=tuple(name for name in combination if name not in own),
        without=tuple(name for name in own if name not in combination),
        log_rigidities=fitted,
        moduli=np.array(moduli(D_x, D_y, D_s, inputs["thickness"], inputs["poisson_xy"])),
        errors=errors.at(kept, target.size),
        slopes=_of_all(sensitivities(of_kept, fitted), kept, target.size),
    )


def predicted_errors(problem: PosedProblem, combination: Sequence[str]) -> tuple[Floats, Floats]:
    """Errors of all readings by the constants that the first setup alone tells, and their slopes.

    Parameters
    ----------
    problem : PosedProblem
    combination : sequence of str
        The known effects of the board.

    Returns
    -------
    errors : (n_readings,) array
        ln measured - ln predicted; those of the first setup are of the fit.
    slopes : (n_readings, n_constants) array
    """
    board = with_combination(problem.board, combination)
    inputs, target, scales = inputs_of(problem, board), log_measured(board), reading_scales(board)
    first = np.arange(len(board.setups[0].readings))
    fitted = _estimated(problem)
    for _ in range(_MOST_PLACES):
        start, models = fitted, _solved(problem, board, fitted)
        every = _law(board, models, inputs)
        law, rows = every.of(_labelled(models)), _labelled(models)[first]
        fitted = refit(every.of(rows), target[first], scales[first], start)
        if np.abs(fitted - start).max() <= _NEAR:
            break
    return target - law(fitted[None, :])[0], sensitivities(law, fitted)


def _is_as_known(board: Board, law: FormLaw) -> bool:
    """Whether the form that a law was made for is the one that is computed."""
    name = law.form.effect
    tried = (one for setup in board.setups for one in effects_of(law.form.board, setup) if one.name == name)
    return list(tried) == acting_at_known_size(board, name)


def _of_all(values: Floats, kept: Rows, n_readings: int) -> Floats:
    """Values of the readings that are a mode among those of all, not numbers elsewhere."""
    found = np.full((n_readings, *values.shape[1:]), np.nan)
    found[kept] = values
    return found


def _labelled(models: Models) -> Rows:
    """Where the labelled modes of each setup stand among all that its model has: (n_modes,) array."""
    starts = np.cumsum([0, *(len(model.every_place) for model in models)])[:-1]
    return np.concatenate([start + np.arange(len(one.places)) for start, one in zip(starts, models, strict=True)])


def _refit(law: Predictor, rows: Rows, target: Floats, scales: Floats, start: Floats) -> Floats:
    """The constants fitted to the readings that are a mode."""
    kept = np.flatnonzero(rows >= 0)
    return refit(law.of(rows[kept]), target[kept], scales[kept], start)


def _relabelled(problem: PosedProblem, predicted: Floats, rows: Rows) -> Rows:
    """The likely labels at fitted constants, whose own misfit tells the noise.

    The same where all labels are certain, and where the plate's symmetry is another, so that modes cannot be told.
    """
    if not any(problem.posterior.peaks) or predicted.shape[1] != sum(problem.posterior.n_every):
        return rows
    kept = np.flatnonzero(rows >= 0)
    off = log_measured(problem.board)[kept] - predicted[0, rows[kept]]
    medians = np.array([setup.noise.median for setup in problem.board.setups])
    noise = np.maximum(medians, float(np.sqrt(np.mean(off**2))))
    return likely_labels(baseline_of(problem), predicted, noise[None, :], rows)


def inputs_of(problem: PosedProblem, board: Board) -> Values:
    """Nominal inputs of a board, but for sizes that it declares and leaves to a prior of the library.

    The readings tell those: they stand at the centre of the posterior of the problem's board.
    """
    there = problem.parameters.values(problem.centre[None, :])
    learnt = (one.name for one in board.uncertain if one.is_of_effect and one.source and not one.is_component)
    return {**board.nominal(), **{name: np.asarray(there[name][0]) for name in learnt}}


def _law(board: Board, models: Models, inputs: Values) -> Predictor:
    """ln f (Hz) of all modes from (n, n_constants) ln D by the exact law, all else at its nominal value."""
    return Predictor(lambda x: _values(board, x, inputs), models, "exact", n_constants=board.symmetry.n)


def _values(board: Board, log_rigidities: Floats, inputs: Values) -> Values:
    return {**inputs, **board.symmetry.rigidities(np.exp(log_rigidities).T, inputs["poisson_xy"])}


def _estimated(problem: PosedProblem) -> Floats:
    """ln of the free rigidities of the board as it stands."""
    return np.log(problem.board.symmetry.free_of(problem.estimate.values))


def _solved(problem: PosedProblem, board: Board, at: Floats) -> Models:
    """Every setup solved at given ln D, with the exact law around them for the constants alone.

    The mesh is that of the board as it stands, so that its matrices serve again. A mode keeps its class and its rank
    there, as long as the plate keeps its symmetry: where two modes lie close, their shapes would exchange names from
    one model to the next, and errors of different modes would be compared.
    """
    inputs = inputs_of(problem, board)
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
