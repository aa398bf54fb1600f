"""Draws of constants, inputs and sizes under one hypothesis, from the normal terms of its table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.laws import FormLaw
from bayesplate.diagnosis.search import SearchResult
from bayesplate.diagnosis.terms import normalised_weights

FormSizes = Iterator[tuple[int, FormLaw, Indices, Floats]]
"""For each form: its index, its law, the indices of its draws, and their sizes."""


@dataclass(frozen=True, eq=False)
class TermDraws:
    """Draws under one hypothesis, linear in the residual about each cell."""

    log_rigidities: Floats  # (n_draws, n_constants) array: ln D_x, ln D_y, ln D_s
    inputs: Floats  # (n_draws, n_inputs) array: standard coordinates of the board's uncertain inputs
    cells: Indices  # (n_draws,) array of int: indices of cells of the hypothesis' table
    within: Floats  # (n_draws, n_tangents) array: place within the cell, standard deviations
    # (n_draws, n_modes) array: ln f (Hz) of all modes by the linear terms; zero `inputs` are the middle of their priors
    predicted: Floats
    variance: Floats  # (n_draws, n_modes) array: relative variance of each reading; infinite where it is no mode
    noise: Floats  # (n_draws, n_setups) array: relative noise

    @property
    def n_draws(self) -> int:
        return len(self.log_rigidities)

    def select(self, indices: Indices) -> TermDraws:
        return TermDraws(*(getattr(self, field.name)[indices] for field in fields(self)))


def draw_terms(result: SearchResult, index: int, rng: np.random.Generator, n_draws: int) -> TermDraws:
    """Draw from the posterior under one hypothesis of a search, sorted by noise and cell."""
    return draw_hypothesis(result.ground.baseline, result.ground.hypotheses[index], result.residual, rng, n_draws)


def draw_hypothesis(
    baseline: Baseline, hypothesis: Hypothesis, residual: Floats, rng: np.random.Generator, n_draws: int
) -> TermDraws:
    """Draw from the posterior under a hypothesis, given the residual of a baseline, which may have other labels."""
    terms, table, modes = hypothesis.terms, hypothesis.table, baseline.possible_modes
    labelled_baseline, labelled_table = terms.baseline, terms.table
    own_residual = hypothesis.residual_under_labels(baseline, residual[None, :])[0]
    log_density = terms.log_densities(own_residual[None, :])[:, 0]
    picked_terms = np.sort(rng.choice(log_density.size, size=n_draws, p=normalised_weights(log_density)))
    levels, cells = np.divmod(picked_terms, table.n_cells)
    n = labelled_baseline.log_rigidities.size
    first_input = n + table.slopes.shape[2]
    noise = terms.noise.sd[levels]
    variance = noise[:, labelled_baseline.setup_index] ** 2 + labelled_baseline.own_variance
    variance[:, ~labelled_baseline.is_mode] = np.inf
    columns = _regression_columns(
        labelled_baseline.slopes, labelled_table.slopes[cells], labelled_baseline.input_slopes
    )
    joint = _draw_coefficients(columns, variance, own_residual - labelled_table.shift[cells], rng, n)
    within = joint[:, n:first_input]
    every_column = _regression_columns(modes.slopes, table.slopes[cells], modes.input_slopes)
    return TermDraws(
        log_rigidities=labelled_baseline.log_rigidities
        + joint[:, :n]
        + table.moved[cells]
        + np.einsum("nkp,np->nk", table.moved_slopes[cells], within),
        inputs=joint[:, first_input:],
        cells=cells,
        within=within,
        predicted=modes.middle + table.shift[cells] + np.einsum("nmp,np->nm", every_column, joint),
        variance=variance,
        noise=noise,
    )


def _regression_columns(slopes: Floats, size_slopes: Floats, input_slopes: Floats) -> Floats:
    """Change of ln f with constants, sizes and inputs at each draw: (n, n_modes, n_coefficients) array."""
    n = len(size_slopes)
    fixed = [np.broadcast_to(block, (n, *block.shape)) for block in (slopes, input_slopes)]
    return np.concatenate([fixed[0], size_slopes, fixed[1]], axis=2)


def _draw_coefficients(
    columns: Floats, variance: Floats, target: Floats, rng: np.random.Generator, n_constants: int
) -> Floats:
    """One draw of the coefficients per target, (n, n_coefficients): flat prior on constants, standard normal on the
    others."""
    weighted = np.swapaxes(columns / variance[:, :, None], 1, 2)
    prior = np.r_[np.zeros(n_constants), np.ones(columns.shape[2] - n_constants)]
    precision = weighted @ columns + np.diag(prior)
    factor = np.linalg.cholesky(precision)
    mean = np.linalg.solve(precision, (weighted @ target[:, :, None]))
    normal = rng.standard_normal((len(columns), columns.shape[2], 1))
    return np.asarray((mean + np.linalg.solve(np.swapaxes(factor, 1, 2), normal))[:, :, 0])


def standard_sizes_of(result: SearchResult, index: int, draws: TermDraws, member: int) -> FormSizes:
    """Sizes of one effect of a hypothesis at each draw, in standard coordinates: (n, n_parameters) arrays.

    They may lie beyond a bound of the prior, for a cell that ends there is normal.
    """
    hypothesis_table = result.ground.hypotheses[index].table
    table, cells = hypothesis_table.member(member, draws.cells)
    within = draws.within[:, hypothesis_table.tangents(member)]
    for i, law in enumerate(result.ground.members(index)[member].laws):
        rows = np.flatnonzero(table.form[cells] == i)
        if rows.size:
            n = len(law.form.free)
            yield i, law, rows, table.z[cells[rows], :n] + table.z_slopes[cells[rows], :n] * within[rows, :n]


def sizes_of(
    result: SearchResult, index: int, draws: TermDraws, member: int
) -> Iterator[tuple[int, FormLaw, Indices, dict[str, Floats]]]:
    """Sizes of one effect at each draw in SI units, by parameter, within the bounds of their priors."""
    for i, law, rows, z in standard_sizes_of(result, index, draws, member):
        values = {}
        for free, column in zip(law.form.free, z.T, strict=True):
            values[free.name] = np.asarray(free.prior.value(np.clip(column, *free.prior.standard_bounds)))
        yield i, law, rows, values


def joint_sizes_of(
    result: SearchResult, index: int, draws: TermDraws
) -> Iterator[tuple[FormLaw, Indices, dict[str, Floats]]]:
    """Sizes of both effects of a pair, at the draws of forms that have a joint law."""
    laws = result.ground.hypotheses[index].joint
    if not laws:
        return
    for i, _, rows_first, values_first in sizes_of(result, index, draws, 0):
        for j, _, rows_second, values_second in sizes_of(result, index, draws, 1):
            rows, in_first, in_second = np.intersect1d(rows_first, rows_second, return_indices=True)
            if (i, j) in laws and rows.size:
                values = {name: value[in_first] for name, value in values_first.items()}
                yield laws[i, j], rows, values | {name: value[in_second] for name, value in values_second.items()}
