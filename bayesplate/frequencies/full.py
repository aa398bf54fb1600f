"""Exact frequencies by full solves at any constants, each label kept at its rank of its class."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Values
from bayesplate.frequencies.laws import log_frequency, mean_log_frequency
from bayesplate.frequencies.model import SetupModel
from bayesplate.plate.solve import solve_classes
from bayesplate.plate.terms import Parity


def full_log_frequencies(model: SetupModel, values: Values) -> NDArray[np.float64]:
    """ln f (Hz) of a setup's labelled modes, solved at given constants instead of taken from a law.

    Parameters
    ----------
    model : SetupModel
        Its places say which rank of which class a label means.
    values : dict of float
        D_x, D_y, D_s (N m), the board's inputs and the effects' parameters.

    Returns
    -------
    (n_modes,) array
    """
    if model.roved:
        return mean_log_frequency([full_log_frequencies(one, values) for one in model.stations])
    ranks: dict[Parity, int] = {}
    for place in model.places:
        ranks[place.parity] = max(ranks.get(place.parity, 0), place.rank + 1)
    solved = solve_classes(model.plate, model.system.weights(values).at(0), ranks)
    return log_frequency(np.array([solved[place.parity].eigenvalues[place.rank] for place in model.places]))
