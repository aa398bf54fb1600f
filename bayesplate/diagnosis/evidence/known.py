"""What physics knows and nobody needs to search: shear, air, a stated sensor; computed, and the error they lead to.

The sizes of a computed effect are the medians of their priors. Sizes that the board declares without stating them
stand where its own fit has them, all other inputs at their nominal values, as in `bayesplate.estimates.least_squares`.
Nothing is fitted but the constants, so that an error may rise as well as fall.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.peaks import likely_labels
from bayesplate.diagnosis.shifts.baseline import baseline_of, symmetry_of
from bayesplate.diagnosis.shifts.laws import FormLaw
from bayesplate.effects import EFFECTS, effects_of
from bayesplate.estimates.least_squares import log_measured, reading_scales
from bayesplate.estimates.leave_one_out import Errors, prediction_errors
from bayesplate.estimates.refit import normal_misfit, refit
from bayesplate.frequencies.model import SetupModel, setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.system import system_of
from bayesplate.modes.threads import in_threads
from bayesplate.plate.board import Board, Values
from bayesplate.plate.material import RIGIDITIES, moduli
from bayesplate.plate.sessions import same_modes
from bayesplate.posterior.inference import PosedProblem
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import Parameters
from bayesplate.quantities import Quantity

Floats = NDArray[np.float64]
Models = Sequence[SetupModel]
Rows = NDArray[np.intp]

COMPUTED = ("transverse_shear", "fluid_loading")
"""Effects of every board whose sizes are known: from its own size, and from what is published."""
STATED = ("attached_mass", "fluid_loading")
"""Effects that a card may state in full, so that they are declared."""

_MOST_LABELLINGS = 4
_NEAR = 0.1
"""Change of ln D up to which a law holds that was made before it: half a side of the smallest box it is trained in."""


@dataclass(frozen=True, eq=False)
class KnownFit:
    """The constants fitted to a board with known effects of fixed sizes.

    Attributes
    ----------
    effects : tuple of str
        Computed beyond those that the board declares.
    without : tuple of str
        Declared ones that are left out.
    log_rigidities : (n_constants,) array
        ln of the free rigidities (N m).
    moduli : (3,) array, Pa
        E_x, E_y, G_xy.
    errors : Errors
        Of ln f, in sample and left out; not numbers for readings that are no mode.
    """

    effects: tuple[str, ...]
    without: tuple[str, ...]
    log_rigidities: Floats
    moduli: Floats
    errors: Errors


def known_fits(
    problem: PosedProblem, laws: Mapping[str, FormLaw], tell: Callable[[float], None] | None = None
) -> tuple[KnownFit, ...]:
    """The board as it stands; with each known effect that it lacks, with all of them; without each stated one.

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
        The board as it stands first.
    """
    known, own = computable(problem.board), stated(problem.board)
    fits = [partial(known_fit, problem, solved=problem.posterior.models)]
    fits += [partial(known_fit, problem, (name,), solved=laws[name].models if name in laws else ()) for name in known]
    fits += [partial(known_fit, problem, without=(name,)) for name in own]
    n_fits = len(fits) + (len(known) > 1)

    def reached(n_done: float) -> None:
        if tell is not None:
            tell(n_done / n_fits)

    found = in_threads(lambda fit: fit(), fits, lambda share: reached(share * len(fits)))
    if len(known) > 1:
        first, *each = (one.log_rigidities for one in found[: 1 + len(known)])
        together = known_fit(problem, known, start=first + sum(one - first for one in each))
        found.insert(1 + len(known), together)
        reached(n_fits)
    return tuple(found)


def computable(board: Board) -> tuple[str, ...]:
    """Effects of known size that are not declared and can act in a setup of the board."""
    return tuple(
        name
        for name in COMPUTED
        if name not in board.effects and not all(EFFECTS[name].refusal(board, setup) for setup in board.setups)
    )


def stated(board: Board) -> tuple[str, ...]:
    """Effects that are declared because the card states them, with no size left to a prior of the library."""
    return tuple(
        name
        for name in STATED
        if name in board.effects and not any(one.source for one in board.uncertain if one.effect == name)
    )


def known_fit(
    problem: PosedProblem,
    effects: Sequence[str] = (),
    without: Sequence[str] = (),
    *,
    start: Floats | None = None,
    solved: Models = (),
) -> KnownFit:
    """Fit the constants of a board with some effects at their known sizes, and without some of its own.

    Parameters
    ----------
    problem : PosedProblem
        The board as it stands.
    effects, without : sequence of str
    start : (n_constants,) array, optional
        ln of the free rigidities (N m) where the fit begins; by default the estimate of the board as it stands.
    solved : sequence of SetupModel
        With the exact law, made near the start; by default they are solved there.

    Returns
    -------
    KnownFit
    """
    board = with_known_sizes(problem.board.without(without), effects)
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
    target, scales = target[kept], scales[kept]
    labelled = before[kept]
    modes = [np.flatnonzero(np.isin(kept, mode)).tolist() for mode in same_modes(problem.board)]
    modes = [mode for mode in modes if mode]
    misfit = normal_misfit(target, scales)
    errors = prediction_errors(law.of(labelled), target, misfit, fitted[None, :], modes=modes).at(kept, before.size)
    found = _values(board, fitted, inputs)
    D_x, D_y, D_s = (found[name] for name in RIGIDITIES)
    constants = np.array(moduli(D_x, D_y, D_s, inputs["thickness"], inputs["poisson_xy"]))
    return KnownFit(tuple(effects), tuple(without), fitted, constants, errors)


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


def with_known_sizes(board: Board, effects: Sequence[str]) -> Board:
    """A board with further effects, every size of theirs fixed at the median of its prior."""
    added = replace(board, effects=(*board.effects, *effects))
    acting = (one for setup in board.setups for one in effects_of(added, setup) if one.name in effects)
    sizes = (size for one in acting for size in one.parameters())
    return added.with_parameters(replace(size, prior=Quantity.exact(size.prior.median)) for size in sizes)


def inputs_of(problem: PosedProblem, board: Board) -> Values:
    """Nominal inputs of a board, but for sizes that the problem's board declares and leaves to a prior of the library.

    The readings tell those: they stand at the centre of the posterior.
    """
    there = problem.parameters.values(problem.centre[None, :])
    learnt = (one.name for one in problem.board.uncertain if one.is_of_effect and one.source and not one.is_component)
    nominal = board.nominal()
    return {**nominal, **{name: np.asarray(there[name][0]) for name in learnt if name in nominal}}


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
    return exact_models(fixed, models, centre, covariance, is_rough=True)
