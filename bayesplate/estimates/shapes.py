"""Shapes of the labelled modes: which parts of the board move, and where sand would gather."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Values
from bayesplate.estimates.sheet import points, sampled
from bayesplate.frequencies.model import SetupModel
from bayesplate.plate.solve import collect, solve_classes
from bayesplate.plate.terms import Parity

N_POINTS = 61
"""Along each side: half a sheet's, for panels of half its size."""


def labelled_shapes(models: Sequence[SetupModel], values: Values) -> dict[str, dict[str, NDArray[np.float64]]]:
    """Shapes of every labelled mode: by rank and symmetry class, as the likelihood means the label.

    Parameters
    ----------
    values : dict of float
        D_x, D_y, D_s (N m), the board's inputs and the effects' parameters.

    Returns
    -------
    dict of dict of (n_x, n_y) array
        By setup and label; as `sampled` at `points(N_POINTS)`.
    """
    grid = points(N_POINTS)
    result = {}
    for model in models:
        counts: dict[Parity, int] = {}
        for place in model.places:
            counts[place.parity] = max(counts.get(place.parity, 0), place.rank + 1)
        modes = collect(model.plate, solve_classes(model.plate, model.system.weights(values).at(0), counts))
        where = {place: i for i, place in enumerate(zip(modes.parities, modes.ranks.tolist(), strict=True))}
        shapes = sampled(modes, model.system.limits(grid), grid)
        result[model.setup.name] = {
            str(label): shapes[where[place.parity, place.rank]]
            for label, place in zip(model.setup.labels, model.places, strict=True)
        }
    return result
