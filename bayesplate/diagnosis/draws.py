"""Draws of constants, inputs and sizes under one hypothesis, from the normal terms of its table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.diagnosis.baseline import Baseline, Rows
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.laws import FormLaw
from bayesplate.diagnosis.search import SearchResult
from bayesplate.diagnosis.terms import normalised

OfForms = Iterator[tuple[int, FormLaw, Rows, Floats]]
"""Form by form: its index, its law, the draws that it has, and their sizes."""


@dataclass(frozen=True, eq=False)
class TermDraws:
    """Draws under one hypothesis, linear in the residual about each cell."""

    log_rigidities: Floats  # (n_draws, n_constants) array: ln D_x, ln D_y, ln D_s
    inputs: Floats  # (n_draws, n_inputs) array: standard coordinates of the board's uncertain inputs
    cells: Rows  # (n_draws,) array of int: of the hypothesis' table
    within: Floats  # (n_draws, n_tangents) array: place within the cell, standard deviations
    # (n_draws, n_every) array: ln f (Hz) of all modes as the terms have it, with the inputs at the middle of their
    # priors where they are zero
    predicted: Floats
    variance: Floats  # (n_draws, n_modes) array: of each reading, relative; infinite where it is no mode
    noise: Floats  # (n_draws, n_setups) array: relative

    @property
    def n_draws(self) -> int:
        return len(self.log_rigidities)

    def at(self, picked: Rows) -> TermDraws:
        return TermDraws(*(getattr(self, one.name)[picked] for one in fields(self)))


def draw_terms(found: SearchResult, index: int, rng: np.random.Generator, n_draws: int) -> TermDraws:
    """Draw from the posterior under one hypothesis of a search, sorted by noise and cell."""
    return draw_hypothesis(found.ground.baseline, found.ground.hypotheses[index], found.residual, rng, n_draws)


def draw_hypothesis(
    of: Baseline, hypothesis: Hypothesis, residual: Floats, rng: np.random.Generator, n_draws: int
) -> TermDraws:
    """Draw from the posterior under a hypothesis, given the residual of a baseline, which may have other labels."""
    terms, table, every = hypothesis.terms, hypothesis.table, of.every
    baseline, own = terms.baseline, terms.table
    seen = hypothesis.seen(of, residual[None, :])[0]
    log_density = terms.log_densities(seen[None, :])[:, 0]
    picked = np.sort(rng.choice(log_density.size, size=n_draws, p=normalised(log_density)))
    levels, cells = np.divmod(picked, table.n_cells)
    n = baseline.log_rigidities.size
    first_input = n + table.slopes.shape[2]
    noise = terms.noise.sd[levels]
    variance = noise[:, baseline.setup_index] ** 2 + baseline.own_variance
    variance[:, ~baseline.is_mode] = np.inf
    columns = _columns(baseline.slopes, own.slopes[cells], baseline.input_slopes)
    joint = _regressed(columns, variance, seen - own.shift[cells], rng, n)
    inside = joint[:, n:first_input]
    moving = _columns(every.slopes, table.slopes[cells], every.input_slopes)
    return TermDraws(
        log_rigidities=baseline.log_rigidities
        + joint[:, :n]
        + table.moved[cells]
        + np.einsum("nkp,np->nk", table.moved_slopes[cells], inside),
        inputs=joint[:, first_input:],
        cells=cells,
        within=inside,
        predicted=every.middle + table.shift[cells] + np.einsum("nmp,np->nm", moving, joint),
        variance=variance,
        noise=noise,
    )


def _columns(slopes: Floats, of_sizes: Floats, of_inputs: Floats) -> Floats:
    """What constants, sizes and inputs do to ln f at each draw: (n, n_modes, n_coefficients) array."""
    n = len(of_sizes)
    fixed = [np.broadcast_to(part, (n, *part.shape)) for part in (slopes, of_inputs)]
    return np.concatenate([fixed[0], of_sizes, fixed[1]], axis=2)


def _regressed(columns: Floats, variance: Floats, target: Floats, rng: np.random.Generator, n_constants: int) -> Floats:
    """(n, n_coefficients) draws, one for each target: flat on the constants, standard normal on all others."""
    weighted = np.swapaxes(columns / variance[:, :, None], 1, 2)
    prior = np.r_[np.zeros(n_constants), np.ones(columns.shape[2] - n_constants)]
    precision = weighted @ columns + np.diag(prior)
    factor = np.linalg.cholesky(precision)
    mean = np.linalg.solve(precision, (weighted @ target[:, :, None]))
    normal = rng.standard_normal((len(columns), columns.shape[2], 1))
    return np.asarray((mean + np.linalg.solve(np.swapaxes(factor, 1, 2), normal))[:, :, 0])


def standard_sizes_of(found: SearchResult, index: int, drawn: TermDraws, which: int) -> OfForms:
    """Sizes of one effect of a hypothesis at each draw, in standard coordinates: (n, n_parameters) arrays.

    A cell that ends at a bound reaches beyond it.
    """
    whole = found.ground.hypotheses[index].table
    table, cells = whole.member(which, drawn.cells)
    within = drawn.within[:, whole.tangents(which)]
    for i, law in enumerate(found.ground.members(index)[which].laws):
        rows = np.flatnonzero(table.form[cells] == i)
        if rows.size:
            n = len(law.form.free)
            yield i, law, rows, table.z[cells[rows], :n] + table.z_slopes[cells[rows], :n] * within[rows, :n]


def sizes_of(
    found: SearchResult, index: int, drawn: TermDraws, which: int
) -> Iterator[tuple[int, FormLaw, Rows, dict[str, Floats]]]:
    """Sizes of one effect at each draw in SI units, by parameter, within the bounds of their priors."""
    for i, law, rows, z in standard_sizes_of(found, index, drawn, which):
        values = {}
        for free, column in zip(law.form.free, z.T, strict=True):
            values[free.name] = np.asarray(free.prior.value(np.clip(column, *free.prior.standard_bounds)))
        yield i, law, rows, values


def joint_sizes_of(
    found: SearchResult, index: int, drawn: TermDraws
) -> Iterator[tuple[FormLaw, Rows, dict[str, Floats]]]:
    """Sizes of both effects of a pair at once, at those draws for which there is a law of both."""
    laws = found.ground.hypotheses[index].joint
    if not laws:
        return
    for i, _, rows_first, values_first in sizes_of(found, index, drawn, 0):
        for j, _, rows_second, values_second in sizes_of(found, index, drawn, 1):
            rows, in_first, in_second = np.intersect1d(rows_first, rows_second, return_indices=True)
            if (i, j) in laws and rows.size:
                values = {name: value[in_first] for name, value in values_first.items()}
                yield laws[i, j], rows, values | {name: value[in_second] for name, value in values_second.items()}
