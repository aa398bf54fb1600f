"""The constants as the search sees them: under one hypothesis, or averaged over all by their probability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI, moduli
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.draws import sizes_of
from bayesplate.diagnosis.search import Found
from bayesplate.diagnosis.sensitivity import draw_exact, under_exact_law

Floats = NDArray[np.float64]
Constants = Mapping[str, Floats]
"""Draws of rigidities (N m) and moduli (Pa) by name."""


def draw_constants(
    found: Found,
    rng: np.random.Generator,
    n_draws: int,
    among: Sequence[int] | None = None,
    sampled: Mapping[int, Constants] | None = None,
) -> Constants:
    """Draws of the constants and inputs by name, (n_draws,) arrays, from the terms of hypotheses, weighted to the exact
    law.

    Over the hypotheses `among` by their probability, by default over all by that under the exact law; of hypotheses
    that were `sampled` from those draws.
    """
    weighed = (under_exact_law(found) or found) if among is None else found
    indices = np.arange(len(found.ground.hypotheses)) if among is None else np.asarray(among)
    shares = weighed.probability[indices] / weighed.probability[indices].sum()
    parts: list[Constants] = []
    for index, n in zip(indices.tolist(), rng.multinomial(n_draws, shares).tolist(), strict=True):
        if n and sampled and index in sampled:
            picked = rng.integers(next(iter(sampled[index].values())).size, size=n)
            parts.append({name: np.ravel(values)[picked] for name, values in sampled[index].items()})
        elif n:
            parts.append(_drawn(found, index, rng, n))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _drawn(found: Found, index: int, rng: np.random.Generator, n_draws: int) -> Constants:
    """The same under one hypothesis, whose effects may replace thickness (m) and nu_xy by their own."""
    drawn, symmetry = draw_exact(found, index, rng, n_draws), found.ground.baseline.board.symmetry
    inputs = {name: _input(found.ground.baseline, name, drawn.inputs) for name in ("thickness", "poisson_xy")}
    for which in range(len(found.ground.members(index))):
        for _, law, rows, values in sizes_of(found, index, drawn, which):
            for free in law.form.free:
                if free.replaces in inputs:
                    inputs[free.replaces][rows] = values[free.name]
    D = symmetry.rigidities(np.exp(drawn.log_rigidities).T, inputs["poisson_xy"])
    constants = moduli(D["D_x"], D["D_y"], D["D_s"], inputs["thickness"], inputs["poisson_xy"])
    return D | dict(zip(MODULI, constants, strict=True))


def _input(baseline: Baseline, name: str, z: Floats) -> Floats:
    """An input of the board from the standard coordinates of all uncertain ones: (n,) array from (n, n_inputs)."""
    uncertain = tuple(baseline.board.uncertain_inputs)
    if name not in uncertain:
        return np.full(len(z), float(baseline.values[name]))
    quantity = baseline.board.inputs[name]
    low, high = (float(quantity.standard(bound)) for bound in (quantity.lower, quantity.upper))
    return np.array(quantity.value(np.clip(z[:, uncertain.index(name)], low, high)))
