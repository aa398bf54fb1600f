"""Baselines at a least-squares estimate, without a problem that is posed: the trial makes thousands of them."""

from __future__ import annotations

import numpy as np

from bayesplate.board.board import Board
from bayesplate.diagnosis.baseline import Baseline, PossibleModes, symmetry_of
from bayesplate.estimates.least_squares import Estimate, log_measured
from bayesplate.estimates.refit import Predict
from bayesplate.posterior.parameters import Parameters


def baseline_at(board: Board, estimate: Estimate, predict: Predict | None = None) -> Baseline:
    """The baseline of a board whose inputs are exact, with certain labels, at its least-squares estimate.

    Parameters
    ----------
    board : Board
    estimate : Estimate
    predict : callable, optional
        The exact law without effects: (n, n_modes) ln f (Hz) from (n, n_constants) ln D; by default it is linear.
    """
    if Parameters(board).inputs:
        raise ValueError("wanted a board of exact inputs, got uncertain ones: pose the problem instead")
    log_rigidities = np.log(board.symmetry.free_of(estimate.values))
    log_frequency, slopes = log_measured(board) - estimate.residuals, board.symmetry.along(estimate.sensitivities)
    return Baseline(
        board=board,
        values=estimate.values,
        log_rigidities=log_rigidities,
        log_readings=log_measured(board),
        possible_modes=PossibleModes(
            log_frequency=log_frequency,
            slopes=slopes,
            input_slopes=np.zeros((log_frequency.size, 0)),
            places=tuple(model.places for model in estimate.models),
            inputs=np.zeros(0),
            peaks=(None,) * len(estimate.models),
            predict=predict or (lambda x: log_frequency + (x - log_rigidities) @ slopes.T),
        ),
        rows=np.arange(log_frequency.size),
        symmetry=symmetry_of(estimate.models),
    )
