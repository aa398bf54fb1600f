"""Leave one mode out: refit without it by the exact law, and see how far its frequency is missed.

A mode of leverage above `HIGH_LEVERAGE` alone carries a constant or a size: without it no reading determines that
parameter, and the prediction of the mode, hundreds of cents off, says nothing about the model. Such a mode counts in no
leave-one-out error and in no score; where models are compared, it counts for none of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board
from bayesplate.effects import EFFECTS
from bayesplate.effects.words import effect_name, join_words
from bayesplate.estimates.refit import (
    Bounds,
    Misfit,
    Predict,
    has_come_to_rest,
    most_likely,
    n_constants,
    sensitivities,
)

HIGH_LEVERAGE = 0.9
"""Share of a mode in its own prediction above which it alone carries a constant or a size."""


@dataclass(frozen=True, eq=False)
class Leverages:
    """How much each reading decides its own prediction, to first order."""

    # (n_readings,), 0 to 1; for a mode that was read in several sessions, of these readings together
    values: Floats
    # (n_readings,): parameter that the mode alone carries, constants first; -1: none, or too few modes to leave one out
    carries: Indices


@dataclass(frozen=True, eq=False)
class PredictionErrors:
    """ln measured - ln predicted of every mode, by one estimator."""

    in_sample: Floats  # (n_modes,)
    # (n_modes,): by a refit without the mode; nan where the other modes leave a constant open, and everywhere if there
    # are no more modes than constants
    left_out: Floats
    leverages: Leverages  # at the fit of all modes

    def at(self, readings: Indices, n_readings: int) -> PredictionErrors:
        """The errors placed among those of `n_readings` readings, by their indices; nan for the other readings."""
        in_sample, left_out, values = (np.full(n_readings, fill) for fill in (np.nan, np.nan, 0.0))
        carries = np.full(n_readings, -1, dtype=np.intp)
        in_sample[readings], left_out[readings] = self.in_sample, self.left_out
        values[readings], carries[readings] = self.leverages.values, self.leverages.carries
        return PredictionErrors(in_sample, left_out, Leverages(values, carries))


@dataclass(frozen=True)
class CarryingMode:
    """A mode that alone carries a constant or a size, so that it does not count in leave-one-out errors.

    Attributes
    ----------
    leverage : float
        Share of the mode in its own prediction, above 0.9.
    carries : str
        What it carries: "E_y", or the name of an effect or an input.
    """

    setup: str
    label: str
    leverage: float
    carries: str


def leverages_of(
    columns: Floats,
    scales: Floats,
    modes: Sequence[Sequence[int]] | None = None,
    n_open: int = 3,
    noise_columns: Sequence[int] = (),
) -> Leverages:
    """Leverages of readings that are fitted by weighted squares; zero where the fit has no slopes.

    `columns` is (n_readings, n_free): d ln f by ln of the `n_open` free rigidities, and by the standard coordinates of
    the other free parameters, whose priors count as one more observation each. A scale is infinite where a reading is
    not used. `noise_columns` are of parameters that act as noise which the readings of one mode share: no reading
    carries them.
    """
    from scipy.linalg import solve_triangular

    weighted = np.nan_to_num(columns / scales[:, None])
    if not np.isfinite(weighted.T @ weighted).all():
        return Leverages(np.zeros(len(weighted)), np.full(len(weighted), -1))
    shared_noise = weighted[:, list(noise_columns)]
    root = np.linalg.cholesky(np.eye(len(weighted)) + shared_noise @ shared_noise.T)
    weighted[:, list(noise_columns)] = 0.0
    weighted = solve_triangular(root, weighted, lower=True)
    is_prior = np.arange(columns.shape[1]) >= n_open
    covariance = np.linalg.pinv(weighted.T @ weighted + np.diag(is_prior.astype(np.float64)), hermitian=True)
    hat = weighted @ covariance @ weighted.T
    values, carries = np.zeros(len(weighted)), np.full(len(weighted), -1)
    modes = [(i,) for i in range(len(weighted))] if modes is None else modes
    for mode in map(list, modes):
        shares, directions = np.linalg.eigh(hat[np.ix_(mode, mode)])
        values[mode] = shares[-1]
        if shares[-1] > HIGH_LEVERAGE and len(modes) > n_open:  # of fewer modes none is left out
            # the mode carries the parameter that would be known least well without it
            gains = covariance @ weighted[mode].T @ directions[:, -1]
            carries[mode] = np.argmax(gains**2 / np.maximum(np.diagonal(covariance), np.finfo(float).tiny))
    return Leverages(values, carries)


def carrying_modes(board: Board, leverages: Leverages, names: Sequence[str]) -> tuple[CarryingMode, ...]:
    """The modes of a board that alone carry one of the named parameters, of which the constants come first."""
    return tuple(
        CarryingMode(setup, label, float(leverage), names[column])
        for (setup, label), leverage, column in zip(
            _reading_names(board), leverages.values, leverages.carries, strict=True
        )
        if column >= 0
    )


def unite_carrying_modes(*mode_sets: Iterable[CarryingMode]) -> tuple[CarryingMode, ...]:
    """Modes that alone carry a parameter under any of several models, each as under the first: none of them counts."""
    modes: dict[tuple[str, str], CarryingMode] = {}
    for mode in chain.from_iterable(mode_sets):
        modes.setdefault((mode.setup, mode.label), mode)
    return tuple(modes.values())


def indices_of(modes: Iterable[CarryingMode], board: Board) -> tuple[int, ...]:
    """Indices of the readings of some modes among all readings of a board."""
    names = {(mode.setup, mode.label) for mode in modes}
    return tuple(i for i, reading in enumerate(_reading_names(board)) if reading in names)


def carrying_sentence(modes: Sequence[CarryingMode]) -> str:
    """Sentence on the modes that alone carry a parameter, and what follows; empty where there are none.

    Sessions read one mode together: what it carries is told once, without the name of a session.
    """
    if not modes:
        return ""
    has_several_setups = len({mode.setup for mode in modes}) > 1
    setups: dict[tuple[str, str], list[str]] = {}
    for mode in modes:
        setups.setdefault((mode.label, mode.carries), []).append(mode.setup)
    clauses = []
    for (label, carries), names in setups.items():
        carried = f"the size of {effect_name(carries)}" if carries in EFFECTS else carries
        where = f" of {names[0]}" if has_several_setups and len(names) == 1 else ""
        clauses.append(f"mode {label}{where} alone carries {carried}")
    verb = "it does" if len(clauses) == 1 else "they do"
    return f"{join_words(clauses)}: {verb} not count in the leave-one-out error"


def _reading_names(board: Board) -> list[tuple[str, str]]:
    return [(setup.name, str(label)) for setup in board.setups for label in setup.labels]


def prediction_errors(
    predict: Predict,
    target: Floats,
    misfit: Misfit,
    starts: Floats,
    bounds: Bounds | None = None,
    modes: Sequence[Sequence[int]] | None = None,
    scales: Floats | None = None,
    noise_columns: Sequence[int] = (),
    held_columns: Sequence[int] = (),
) -> PredictionErrors:
    """Errors of the most likely constants, in sample and with each mode left out in turn.

    Each fit begins where its own sum of squares is lowest, among the (n_starts, n_free) `starts` and the fit of all
    modes: Student's likelihood may have another peak without the mode. `target` is ln of the measured frequencies,
    `modes` the readings of each mode, by default one each, and `scales` weigh the readings in the leverages, by default
    as normal errors. In the leverages the parameters `noise_columns` act as noise, and `held_columns` are held.
    """
    n = n_constants(predict)

    def best_start(starts: Floats, squares: Floats) -> Floats:
        totals = squares.sum(axis=1) + np.sum(starts[:, n:] ** 2, axis=1)
        return np.asarray(starts[np.argmin(np.where(np.isfinite(totals), totals, np.inf))])

    def squared_misfit(x: Floats) -> Floats:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a start may be no plate
            return misfit(predict(x))[0] ** 2

    squares = squared_misfit(starts)
    fit = most_likely(predict, misfit, best_start(starts, squares), bounds)
    in_sample = np.asarray(target - predict(fit[None, :])[0])
    left_out = np.full(target.size, np.nan)
    modes = [(reading,) for reading in range(target.size)] if modes is None else modes
    if len(modes) > n:
        starts, squares = (np.concatenate(pair) for pair in ((starts, fit[None]), (squares, squared_misfit(fit[None]))))
        fit_starts = np.stack([best_start(starts, np.delete(squares, list(mode), axis=1)) for mode in modes])
        fitted = np.stack(
            [most_likely(predict, misfit, start, bounds, mode) for start, mode in zip(fit_starts, modes, strict=True)]
        )
        fitted[~has_come_to_rest(fitted, fit_starts, n)] = np.nan
        for mode, predicted in zip(map(list, modes), predict(fitted), strict=True):
            left_out[mode] = (target - predicted)[mode]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # the fit may be no plate
        scales = 1.0 / np.abs(misfit(target)[1]) if scales is None else scales
        columns = sensitivities(predict, fit)
        columns[:, list(held_columns)] = 0.0
        return PredictionErrors(in_sample, left_out, leverages_of(columns, scales, modes, n, noise_columns))
