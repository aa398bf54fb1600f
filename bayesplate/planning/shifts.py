"""What the effects of an explanation do to the modes of a station beside what the constants do.

A few full solves about the likely sizes, the constants where the readings then have them, and a parabola along each
size between: what remains beside the constants' own linear law is small and smooth. Each term of the explanation is
linear about its own place on it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.planning.beliefs import Explanation, FormTerms, KnownBoard
from bayesplate.planning.laws import BareLaw, SolvedStation

Floats = NDArray[np.float64]

_QUANTILES = (0.03, 0.97)
"""Of a size over the terms, at which it is solved besides its mean."""
_TOO_FAR = 0.4
"""A shift of ln f beyond which a mode has lost its name."""


def add_effects(one: Explanation, known: KnownBoard, law: BareLaw, shift: Floats, slopes: Floats) -> None:
    """Add what the effects of an explanation do to what is expected of the modes of a station, in place.

    To the shift where u is zero, (n_terms, (1 + n_spots) n_modes), of the modes, then of what a known mass at each spot
    adds to each, and to the slopes, (.., n_u). Not a number where a mode cannot be followed in the middle of a size, or
    to neither side of it.
    """
    n = len(law.middle)
    for form in one.forms:
        mean = one.mean[form.rows]
        sizes, own = mean[:, form.columns], one.covariance[form.rows][:, form.columns, form.columns]
        centre, narrow = sizes.mean(axis=0), np.sqrt(own.mean(axis=0))
        low, high = np.quantile(sizes, _QUANTILES, axis=0)
        ends = np.stack([np.minimum(low, centre - narrow), np.maximum(high, centre + narrow)])
        bounds = np.array([one.prior.standard_bounds for one in form.parameters]).reshape(-1, 2).T
        away = np.clip(ends, *bounds) - centre
        # the constants follow the size
        design = np.column_stack([np.ones(len(mean)), sizes - centre])
        constants = np.linalg.lstsq(design, mean[:, : known.board.symmetry.n], rcond=None)[0]

        to_either_side = (np.outer(two, unit) for two, unit in zip(away.T, np.eye(centre.size), strict=True))
        steps = np.concatenate([[0.0 * centre], *to_either_side])
        followed = np.column_stack([np.ones(len(steps)), steps]) @ constants
        pairs = zip(centre + steps, followed, strict=True)
        solved = np.stack([_beside(known, law, form, at, moved) for at, moved in pairs])
        shift[form.rows] += solved[0]
        for j, column in enumerate(form.columns):
            two, pair = away[:, j], solved[1 + 2 * j : 3 + 2 * j] - solved[0]
            across = (
                pair[::-1] * (two / two[::-1])[:, None]
            )  # a straight line where a mode is followed to one side only
            pair[:, :n] = np.where(np.isnan(pair), across, pair)[:, :n]
            linear, square = np.linalg.solve(np.column_stack([two, two**2]), pair)
            place = np.clip(sizes[:, j] - centre[j], *two)[:, None]
            along = linear + 2.0 * square * place
            shift[form.rows] += linear * place + square * place**2 - along * sizes[:, j, None]
            slopes[form.rows, :, column] += along


def _beside(known: KnownBoard, law: BareLaw, form: FormTerms, sizes: Floats, constants: Floats) -> Floats:
    """What a form does at some sizes, less what the linear law of the constants says: ((1 + n_spots) n_modes,) array.

    On the mesh for the estimate's constants, so that all sizes of a form have the same matrices.
    """
    exact = {name: np.asarray(q.mean) for name, q in form.board.inputs.items() if q.is_exact}
    named = {one.name: np.asarray(one.prior.value(z)) for one, z in zip(form.parameters, sizes, strict=True)}
    values, symmetry = {**exact, **known.values, **named}, known.board.symmetry
    at = np.log(symmetry.free_of(known.values))
    there, meshed = (
        {**values, **symmetry.rigidities(np.exp(each), values["poisson_xy"])} for each in (at + constants, at)
    )
    shift = SolvedStation.of(law.station, form.board, there, meshed).bare_and_added - law.solved
    shift[0] -= law.slopes[0, :, : at.size] @ constants
    shift[:, np.abs(shift[0]) > _TOO_FAR] = np.nan
    return np.asarray(shift.ravel())
