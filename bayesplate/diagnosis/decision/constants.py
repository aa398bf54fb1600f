"""The constants as the search sees them: under one hypothesis, or averaged over all by their probability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI, moduli
from bayesplate.diagnosis.evidence.draws import TermDraws, members_of, sizes_of
from bayesplate.diagnosis.evidence.exact import draw_exact, under_exact_law
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.shifts.baseline import Baseline

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ConstantDraws:
    """Draws of rigidities (N m) and moduli (Pa) by name: (n_draws,) arrays."""

    values: dict[str, Floats]

    def interval(self, name: str, probability: float = 0.9) -> tuple[float, float]:
        """Equal-tailed interval."""
        tail = 0.5 * (1.0 - probability)
        low, high = np.quantile(self.values[name], [tail, 1.0 - tail])
        return float(low), float(high)


def draw_constants(
    found: Found, rng: np.random.Generator, n_draws: int, among: Sequence[int] | None = None
) -> ConstantDraws:
    """Draw the constants from the normal terms of hypotheses, corrected to the exact law by weights.

    Parameters
    ----------
    found : Found
    rng : numpy.random.Generator
    n_draws : int
    among : sequence of int, optional
        Hypotheses to average over, weighted by their probability; by default all, by that under the exact law.

    Returns
    -------
    ConstantDraws
        Uncertain inputs are drawn along with the constants.
    """
    weighed = (under_exact_law(found) or found) if among is None else found
    indices = np.arange(len(found.ground.hypotheses)) if among is None else np.asarray(among)
    shares = weighed.probability[indices] / weighed.probability[indices].sum()
    counts = rng.multinomial(n_draws, shares)
    drawn = [draw_exact(found, int(i), rng, int(n)) for i, n in zip(indices, counts, strict=True) if n]
    parts = [(one.log_rigidities, *_inputs(found, one)) for one in drawn]
    log_rigidities, thickness, nu_xy = (np.concatenate(part) for part in zip(*parts, strict=True))
    values = found.ground.baseline.board.symmetry.rigidities(np.exp(log_rigidities).T, nu_xy)
    constants = moduli(values["D_x"], values["D_y"], values["D_s"], thickness, nu_xy)
    return ConstantDraws(values | dict(zip(MODULI, constants, strict=True)))


def _inputs(found: Found, drawn: TermDraws) -> tuple[Floats, Floats]:
    """Thickness (m) and nu_xy of each draw, where an effect replaces them by its own: (n,) arrays."""
    names = ("thickness", "poisson_xy")
    result = [_input(found.ground.baseline, name, drawn.inputs) for name in names]
    for member in range(len(members_of(found, drawn.index))):
        for law, rows, values in sizes_of(found, drawn, member):
            for free in law.form.free:
                if free.replaces in names:
                    result[names.index(free.replaces)][rows] = values[free.name]
    return result[0], result[1]


def _input(baseline: Baseline, name: str, z: Floats) -> Floats:
    """An input of the board from the standard coordinates of all uncertain ones: (n,) array from (n, n_inputs)."""
    uncertain = tuple(baseline.board.uncertain_inputs)
    if name not in uncertain:
        return np.full(len(z), float(baseline.values[name]))
    quantity = baseline.board.inputs[name]
    low, high = (float(quantity.standard(bound)) for bound in (quantity.lower, quantity.upper))
    return np.array(quantity.value(np.clip(z[:, uncertain.index(name)], low, high)))
