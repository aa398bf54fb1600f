"""Draws of constants, inputs and sizes under one hypothesis, from the normal terms of its table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import Hypothesis
from bayesplate.diagnosis.evidence.search import Candidate, Found
from bayesplate.diagnosis.evidence.terms import Fold, normalised
from bayesplate.diagnosis.shifts.laws import FormLaw

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TermDraws:
    """Draws under one hypothesis, linear in the residual about each cell.

    Attributes
    ----------
    index : int
        Of the hypothesis.
    log_rigidities : (n_draws, n_constants) array
        ln D_x, ln D_y, ln D_s.
    inputs : (n_draws, n_inputs) array
        Standard coordinates of the board's uncertain inputs.
    cells : (n_draws, n_members) array of int
        For each effect of the hypothesis its cell; for one effect that of its fine table, for two of the coarse ones.
    within : (n_draws, n_tangents) array
        Place within the cell, standard deviations; those of the first effect come first.
    predicted : (n_draws, n_every) array
        ln f (Hz) of all modes as the terms have it, with the inputs at the middle of their priors where they are zero.
    variance : (n_draws, n_modes) array
        Of each reading, relative; infinite where it is no mode.
    noise : (n_draws, n_setups) array
        Relative.
    """

    index: int
    log_rigidities: Floats
    inputs: Floats
    cells: NDArray[np.intp]
    within: Floats
    predicted: Floats
    variance: Floats
    noise: Floats

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
            noise=self.noise[picked],
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
    drawn = draw_hypothesis(found.ground.whole, found.ground.hypotheses[index], found.residual, rng, n_draws)
    return replace(drawn, index=index, cells=_of_members(found, index, drawn.cells[:, 0]))


def draw_hypothesis(
    whole: Fold, hypothesis: Hypothesis, residual: Floats, rng: np.random.Generator, n_draws: int
) -> TermDraws:
    """Draw from the posterior under a hypothesis that belongs to no search yet; cells are those of its table."""
    terms = hypothesis.terms(whole)
    baseline, table = terms.fold.baseline, hypothesis.table
    seen = hypothesis.seen(whole.baseline, residual[None, :])[0]
    log_density = terms.log_densities(seen[None, :])[:, 0]
    picked = np.sort(rng.choice(log_density.size, size=n_draws, p=normalised(log_density)))
    levels, cells = np.divmod(picked, table.n_cells)
    n = baseline.log_rigidities.size
    first_input = n + table.slopes.shape[2]
    noise = hypothesis.noise.sd[levels]
    variance = noise[:, baseline.setup_index] ** 2 + baseline.own_variance
    variance[:, ~baseline.is_mode] = np.inf
    columns = _columns(baseline.slopes, table.slopes[cells], baseline.input_slopes)
    joint = _regressed(columns, variance, seen - table.shift[cells], rng, n)
    inside = joint[:, n:first_input]
    every, wide = baseline.every, table if hypothesis.wide is None else hypothesis.wide
    middle = every.log_frequency - every.input_slopes @ every.inputs
    moving = _columns(every.slopes, wide.slopes[cells], every.input_slopes)
    return TermDraws(
        index=0,
        log_rigidities=baseline.log_rigidities
        + joint[:, :n]
        + table.moved[cells]
        + np.einsum("nkp,np->nk", table.moved_slopes[cells], inside),
        inputs=joint[:, first_input:],
        cells=cells[:, None],
        within=inside,
        predicted=middle + wide.shift[cells] + np.einsum("nmp,np->nm", moving, joint),
        variance=variance,
        noise=noise,
    )


def _columns(slopes: Floats, of_sizes: Floats, of_inputs: Floats) -> Floats:
    """What constants, sizes and inputs do to ln f at each draw: (n, n_modes, n_coefficients) array."""
    n = len(of_sizes)
    fixed = [np.broadcast_to(part, (n, *part.shape)) for part in (slopes, of_inputs)]
    return np.concatenate([fixed[0], of_sizes, fixed[1]], axis=2)


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
    for law, rows, z in standard_sizes_of(found, drawn, member):
        values = {}
        for free, column in zip(law.form.free, z.T, strict=True):
            low, high = (float(free.prior.standard(bound)) for bound in (free.prior.lower, free.prior.upper))
            values[free.name] = np.asarray(free.prior.value(np.clip(column, low, high)))
        yield law, rows, values


def standard_sizes_of(
    found: Found, drawn: TermDraws, member: int
) -> Iterator[tuple[FormLaw, NDArray[np.intp], Floats]]:
    """The same in standard coordinates, (n, n_parameters) arrays; a cell that ends at a bound reaches beyond it."""
    every = members_of(found, drawn.index)
    candidate = every[member]
    table = candidate.fine if len(every) == 1 else candidate.coarse
    first = sum(one.coarse.slopes.shape[2] for one in every[:member])
    cells = drawn.cells[:, member]
    for index, law in enumerate(candidate.laws):
        rows = np.flatnonzero(table.form[cells] == index)
        if rows.size:
            n = len(law.form.free)
            within = drawn.within[rows, first:][:, :n]
            yield law, rows, table.z[cells[rows], :n] + table.z_slopes[cells[rows], :n] * within


def joint_sizes_of(found: Found, drawn: TermDraws) -> Iterator[tuple[FormLaw, NDArray[np.intp], dict[str, Floats]]]:
    """The same of both effects of a pair at once, of those of its draws for which there is a law of both."""
    laws = found.ground.joint.get(found.ground.hypotheses[drawn.index].members, {})
    if not laws:
        return
    one, other = members_of(found, drawn.index)
    for first, rows_first, values_first in sizes_of(found, drawn, 0):
        for second, rows_second, values_second in sizes_of(found, drawn, 1):
            law = laws.get((_place(first, one), _place(second, other)))
            rows, in_first, in_second = np.intersect1d(rows_first, rows_second, return_indices=True)
            if law is not None and rows.size:
                values = {name: value[in_first] for name, value in values_first.items()}
                yield law.law, rows, values | {name: value[in_second] for name, value in values_second.items()}


def _place(law: FormLaw, candidate: Candidate) -> int:
    return next(i for i, one in enumerate(candidate.laws) if one is law)


def _of_members(found: Found, index: int, cells: NDArray[np.intp]) -> NDArray[np.intp]:
    """Cells of each member: the table of two runs over those of the second fastest."""
    members = members_of(found, index)
    if len(members) < 2:
        return cells[:, None]
    return np.stack(np.divmod(cells, members[1].coarse.n_cells), axis=1)


def _regressed(columns: Floats, variance: Floats, target: Floats, rng: np.random.Generator, n_constants: int) -> Floats:
    """A draw of the coefficients for each target: flat on the constants, standard normal on all others.

    Parameters
    ----------
    columns : (n, n_modes, n_coefficients) array
    variance, target : (n, n_modes) arrays
    rng : numpy.random.Generator
    n_constants : int

    Returns
    -------
    (n, n_coefficients) array
    """
    weighted = np.swapaxes(columns / variance[:, :, None], 1, 2)
    prior = np.r_[np.zeros(n_constants), np.ones(columns.shape[2] - n_constants)]
    precision = weighted @ columns + np.diag(prior)
    factor = np.linalg.cholesky(precision)
    mean = np.linalg.solve(precision, (weighted @ target[:, :, None]))
    normal = rng.standard_normal((len(columns), columns.shape[2], 1))
    return np.asarray((mean + np.linalg.solve(np.swapaxes(factor, 1, 2), normal))[:, :, 0])
