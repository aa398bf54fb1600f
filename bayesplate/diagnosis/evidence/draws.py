"""Draws of constants, inputs and sizes under one hypothesis, from the normal terms of its table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.search import Candidate, Found
from bayesplate.diagnosis.evidence.terms import normalised
from bayesplate.diagnosis.shifts.laws import FormLaw

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TermDraws:
    """Draws under one hypothesis, linear in the residual about each cell.

    Attributes
    ----------
    index : int
        Of the hypothesis.
    log_rigidities : (n_draws, 3) array
        ln D_x, ln D_y, ln D_s.
    inputs : (n_draws, n_inputs) array
        Standard coordinates of the board's uncertain inputs.
    cells : (n_draws, n_members) array of int
        For each effect of the hypothesis its cell; for one effect that of its fine table, for two of the coarse ones.
    within : (n_draws, n_tangents) array
        Place within the cell, standard deviations; those of the first effect come first.
    predicted : (n_draws, n_modes) array
        ln f (Hz) as the terms have it.
    variance : (n_draws, n_modes) array
        Of each reading, relative.
    """

    index: int
    log_rigidities: Floats
    inputs: Floats
    cells: NDArray[np.intp]
    within: Floats
    predicted: Floats
    variance: Floats

    @property
    def n_draws(self) -> int:
        """How many."""
        return len(self.log_rigidities)

    def at(self, picked: NDArray[np.intp]) -> TermDraws:
        """Some of the draws."""
        return TermDraws(
            index=self.index,
            log_rigidities=self.log_rigidities[picked],
            inputs=self.inputs[picked],
            cells=self.cells[picked],
            within=self.within[picked],
            predicted=self.predicted[picked],
            variance=self.variance[picked],
        )


def draw_terms(found: Found, index: int, rng: np.random.Generator, n_draws: int) -> TermDraws:
    """Draw from the posterior under one hypothesis.

    Parameters
    ----------
    found : Found
    index : int
    rng : numpy.random.Generator
    n_draws : int

    Returns
    -------
    TermDraws
        Sorted by cell.
    """
    ground, hypothesis = found.ground, found.ground.hypotheses[index]
    baseline, table = ground.baseline, hypothesis.table
    residual = hypothesis.seen(baseline, found.residual[None, :])[0]
    log_density = hypothesis.terms(ground.whole).log_densities(residual[None, :])[:, 0]
    picked = np.sort(rng.choice(log_density.size, size=n_draws, p=normalised(log_density)))
    levels, cells = np.divmod(picked, table.n_cells)
    first_input = 3 + table.slopes.shape[2]
    variance = hypothesis.noise.sd[levels][:, baseline.setup_index] ** 2 + baseline.own_variance
    columns = np.concatenate(
        [
            np.broadcast_to(baseline.slopes, (n_draws, *baseline.slopes.shape)),
            table.slopes[cells],
            np.broadcast_to(baseline.input_slopes, (n_draws, *baseline.input_slopes.shape)),
        ],
        axis=2,
    )
    joint = _regressed(columns, variance, residual - table.shift[cells], rng)
    inside = joint[:, 3:first_input]
    return TermDraws(
        index=index,
        log_rigidities=baseline.log_rigidities
        + joint[:, :3]
        + table.moved[cells]
        + np.einsum("nkp,np->nk", table.moved_slopes[cells], inside),
        inputs=joint[:, first_input:],
        cells=_of_members(found, index, cells),
        within=inside,
        predicted=baseline.log_frequency + table.shift[cells] + np.einsum("nmp,np->nm", columns, joint),
        variance=variance,
    )


def members_of(found: Found, index: int) -> tuple[Candidate, ...]:
    """The effects of a hypothesis; none where it only exchanges labels."""
    ground = found.ground
    return tuple(ground.candidates[name] for name in ground.hypotheses[index].members if name in ground.candidates)


def sizes_of(
    found: Found, drawn: TermDraws, member: int
) -> Iterator[tuple[FormLaw, NDArray[np.intp], dict[str, Floats]]]:
    """Sizes of one effect of a hypothesis at each draw, form by form: its law, the draws that it has, and their sizes.

    The sizes are in SI units, by the name of the parameter, within the bounds of their priors.
    """
    every = members_of(found, drawn.index)
    candidate = every[member]
    table = candidate.fine if len(every) == 1 else candidate.coarse
    first = sum(one.coarse.slopes.shape[2] for one in every[:member])
    cells = drawn.cells[:, member]
    for index, law in enumerate(candidate.laws):
        rows = np.flatnonzero(table.form[cells] == index)
        values = {}
        for i, free in enumerate(law.form.free):
            z = table.z[cells[rows], i] + table.z_slopes[cells[rows], i] * drawn.within[rows, first + i]
            low, high = (float(free.prior.standard(bound)) for bound in (free.prior.lower, free.prior.upper))
            values[free.name] = np.asarray(free.prior.value(np.clip(z, low, high)))
        if rows.size:
            yield law, rows, values


def _of_members(found: Found, index: int, cells: NDArray[np.intp]) -> NDArray[np.intp]:
    """Cells of each member: the table of two runs over those of the second fastest."""
    members = members_of(found, index)
    if len(members) < 2:
        return cells[:, None]
    return np.stack(np.divmod(cells, members[1].coarse.n_cells), axis=1)


def _regressed(columns: Floats, variance: Floats, target: Floats, rng: np.random.Generator) -> Floats:
    """A draw of the coefficients for each target: flat on the three constants, standard normal on all others.

    Parameters
    ----------
    columns : (n, n_modes, n_coefficients) array
    variance, target : (n, n_modes) arrays
    rng : numpy.random.Generator

    Returns
    -------
    (n, n_coefficients) array
    """
    weighted = np.swapaxes(columns / variance[:, :, None], 1, 2)
    prior = np.r_[np.zeros(3), np.ones(columns.shape[2] - 3)]
    precision = weighted @ columns + np.diag(prior)
    factor = np.linalg.cholesky(precision)
    mean = np.linalg.solve(precision, (weighted @ target[:, :, None]))
    normal = rng.standard_normal((len(columns), columns.shape[2], 1))
    return np.asarray((mean + np.linalg.solve(np.swapaxes(factor, 1, 2), normal))[:, :, 0])
