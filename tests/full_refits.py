"""A board with an effect at a given size, solved in full, its constants fitted to frequencies without the effect."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayesplate.board.board import Board
from bayesplate.board.material import RIGIDITIES
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of

_STEPS = 8


def full_solve(board: Board, values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """ln f of all readings and d ln f / d ln D by a full solve: (n_modes,) and (n_modes, 3) arrays."""
    there = {name: np.asarray(value) for name, value in values.items()}
    models = [setup_model(system_of(board, setup), there) for setup in board.setups]
    logs = np.concatenate([model.log_frequencies(there, "linear")[0] for model in models])
    return logs, np.concatenate([model.sensitivities(there) for model in models])


def full_refit(
    baseline: Baseline, board: Board, sizes: Mapping[str, float], weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What is left of a shift once the constants have been fitted again, and how far they went, all by full solves.

    Parameters
    ----------
    baseline : Baseline
        Whose frequencies are aimed at.
    board : Board
        With the effect declared.
    sizes : dict of float
        The effect's parameters by the names of the board's inputs.
    weights : (n_modes,) array
        One over the relative uncertainty of each reading.

    Returns
    -------
    shift : (n_modes,) array
        ln f with the effect, constants fitted, less that of the baseline: what the baseline's slopes cannot absorb.
    moved : (3,) array
        Change of ln D.
    """
    exact = {name: quantity.mean for name, quantity in board.inputs.items() if quantity.is_exact}
    inputs = exact | {n: float(v) for n, v in baseline.values.items() if n not in RIGIDITIES} | dict(sizes)
    moved = np.zeros(3)
    seen = np.diag(weights) @ baseline.slopes
    for _ in range(_STEPS):
        constants = dict(zip(RIGIDITIES, np.exp(baseline.log_rigidities + moved), strict=True))
        logs, slopes = full_solve(board, inputs | constants)
        shift = logs - baseline.log_frequency
        # the orthogonality that defines the fit is that of the baseline's slopes: a Newton step towards it
        step = -np.linalg.solve(seen.T @ (weights[:, None] * slopes), seen.T @ (weights * shift))
        moved = moved + step * min(1.0, 0.3 / max(np.abs(step).max(), 1e-300))
        if np.abs(step).max() < 1e-7:
            break
    return shift, moved
