"""The constants as the search sees them: under one hypothesis, or averaged over all by their probability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.evidence.terms import normalised
from bayesplate.diagnosis.shifts.baseline import Baseline
from bayesplate.plate.material import MODULI, RIGIDITIES, moduli

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
    """Draw the constants from the normal terms of hypotheses.

    Parameters
    ----------
    found : Found
    rng : numpy.random.Generator
    n_draws : int
    among : sequence of int, optional
        Hypotheses to average over, weighted by their probability; by default all.

    Returns
    -------
    ConstantDraws
        Linear in the residual about each cell; uncertain inputs are drawn along with the constants.
    """
    indices = np.arange(len(found.ground.hypotheses)) if among is None else np.asarray(among)
    shares = found.probability[indices] / found.probability[indices].sum()
    counts = rng.multinomial(n_draws, shares)
    drawn = [_draws(found, int(i), rng, int(n)) for i, n in zip(indices, counts, strict=True) if n]
    log_rigidities, nu_xy, thickness = (np.concatenate(parts) for parts in zip(*drawn, strict=True))
    values = dict(zip(RIGIDITIES, np.exp(log_rigidities).T, strict=True))
    constants = moduli(values["D_x"], values["D_y"], values["D_s"], thickness, nu_xy)
    return ConstantDraws(values | dict(zip(MODULI, constants, strict=True)))


def _draws(found: Found, index: int, rng: np.random.Generator, n: int) -> tuple[Floats, Floats, Floats]:
    """ln D, nu_xy and thickness (m) under one hypothesis: (n, 3), (n,) and (n,) arrays."""
    ground, hypothesis = found.ground, found.ground.hypotheses[index]
    baseline, table = ground.baseline, hypothesis.table
    residual = hypothesis.seen(baseline, found.residual[None, :])[0]
    log_density = hypothesis.terms(ground.whole).log_densities(residual[None, :])[:, 0]
    picked, counts = np.unique(rng.choice(log_density.size, size=n, p=normalised(log_density)), return_counts=True)
    result: list[Floats] = []
    thickness: list[Floats] = []
    poisson: list[Floats] = []
    first_input = 3 + table.slopes.shape[2]
    for term, count in zip(picked, counts, strict=True):
        level, cell = divmod(int(term), table.n_cells)
        variance = hypothesis.noise.sd[level][baseline.setup_index] ** 2 + baseline.own_variance
        columns = np.hstack([baseline.slopes, table.slopes[cell], baseline.input_slopes])
        mean, spread = _regression(columns, variance, residual - table.shift[cell])
        joint = rng.multivariate_normal(mean, spread, size=int(count), method="cholesky")
        moved = table.moved[cell] + joint[:, 3:first_input] @ table.moved_slopes[cell].T
        result.append(baseline.log_rigidities + joint[:, :3] + moved)
        inputs = joint[:, first_input:]
        replaced = _replaced_inputs(found, index, cell)
        for name, drawn in (("thickness", thickness), ("poisson_xy", poisson)):
            own = replaced.get(name)
            drawn.append(_input(baseline, name, inputs) if own is None else np.full(count, own))
    return np.concatenate(result), np.concatenate(poisson), np.concatenate(thickness)


def _input(baseline: Baseline, name: str, z: Floats) -> Floats:
    """An input of the board from the standard coordinates of all uncertain ones: (n,) array from (n, n_inputs)."""
    uncertain = tuple(baseline.board.uncertain_inputs)
    if name not in uncertain:
        return np.full(len(z), float(baseline.values[name]))
    quantity = baseline.board.inputs[name]
    low, high = (float(quantity.standard(bound)) for bound in (quantity.lower, quantity.upper))
    return quantity.value(np.clip(z[:, uncertain.index(name)], low, high))


def _regression(columns: Floats, variance: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Mean and covariance of coefficients: flat on the three constants, standard normal on all others."""
    prior = np.r_[np.zeros(3), np.ones(columns.shape[1] - 3)]
    spread = np.linalg.inv(columns.T @ (columns / variance[:, None]) + np.diag(prior))
    spread = 0.5 * (spread + spread.T)
    return spread @ (columns.T @ (target / variance)), spread


def _replaced_inputs(found: Found, index: int, cell: int) -> dict[str, float]:
    """Inputs of the board whose place a parameter of the hypothesis takes, in the middle of one of its cells."""
    hypothesis = found.ground.hypotheses[index]
    baseline = found.ground.baseline
    values: dict[str, float] = {}
    for member, name in enumerate(hypothesis.members):
        if name not in found.ground.candidates:
            continue
        candidate = found.ground.candidates[name]
        alone = len(hypothesis.members) == 1
        table, row = (hypothesis.table, cell) if alone else (candidate.coarse, _own_cell(found, index, cell, member))
        for i, free in enumerate(candidate.laws[int(table.form[row])].form.free):
            if free.replaces in baseline.board.inputs:
                values[free.replaces] = float(free.prior.value(table.z[row, i]))
    return values


def _own_cell(found: Found, index: int, cell: int, member: int) -> int:
    """The cell of one of two effects behind a cell of both together."""
    other = found.ground.candidates[found.ground.hypotheses[index].members[1]].coarse
    return divmod(cell, other.n_cells)[member]
