"""Shapes of the fitted modes, at the posterior mean: which parts of the board move, and where sand would gather."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.combined import corner_signs
from bayesplate.modes.plate import Parity
from bayesplate.modes.solve import collect, solve_classes
from bayesplate.posterior.inference import Problem
from bayesplate.results.draws import Draws
from bayesplate.results.modes import posterior_mean_values
from bayesplate.results.sheet import points

N_POINTS = 61
"""Along each side: half a sheet's, for panels of half its size."""


def fitted_shapes(problem: Problem, draws: Draws) -> dict[str, dict[str, NDArray[np.float64]]]:
    """Shapes of every labelled mode: by rank and symmetry class, as the likelihood means the label.

    Parameters
    ----------
    problem : Problem
    draws : Draws

    Returns
    -------
    dict of dict of (n_x, n_y) array
        By setup and label; sampled at `points(N_POINTS)` of both sides, positive next to the corner of x1 and y1.
    """
    values = posterior_mean_values(problem, draws)
    grid = points(N_POINTS)
    result = {}
    for setup, model in zip(problem.board.setups, problem.posterior.models, strict=True):
        counts: dict[Parity, int] = {}
        for place in model.places:
            counts[place.parity] = max(counts.get(place.parity, 0), place.rank + 1)
        modes = collect(model.plate, solve_classes(model.plate, model.system.weights(values).at(0), counts))
        where = {place: i for i, place in enumerate(zip(modes.parities, modes.ranks.tolist(), strict=True))}
        shapes = modes.displacement(grid, grid)
        shapes = shapes * corner_signs(shapes)[:, None, None]
        result[setup.name] = {
            str(label): shapes[where[place.parity, place.rank]]
            for label, place in zip(setup.labels, model.places, strict=True)
        }
    return result
