"""Sizes of the effects of a hypothesis: their posterior, whether one is at its limit, and the board to fit again."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.parameter import display_unit
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.draws import draw_terms, standard_sizes_of
from bayesplate.diagnosis.forms import Form, with_forms, with_labels_exchanged
from bayesplate.diagnosis.search import SearchResult

LIMIT_PROBABILITY = 0.005
"""Prior probability between the posterior median of a size and a bound below which the size is at its limit."""
_N_DRAWS = 2000


def size_posterior(result: SearchResult, index: int, member: int, form: int, parameter: int) -> tuple[Floats, Floats]:
    """Probability and standard coordinate of each cell of a member's form, under one hypothesis."""
    table, cells = result.ground.hypotheses[index].table.member(member)
    by_cell = np.bincount(cells, weights=result.cells(index), minlength=table.n_cells)
    of_form = table.form == form
    return by_cell[of_form], table.z[of_form, parameter]


def likely_form(result: SearchResult, index: int, member: int) -> int:
    """Which form of one effect of a hypothesis is most probable."""
    table, cells = result.ground.hypotheses[index].table.member(member)
    laws = result.ground.members(index)[member].laws
    return int(np.argmax(np.bincount(table.form[cells], weights=result.cells(index), minlength=len(laws))))


def likely_forms(result: SearchResult, index: int) -> list[Form]:
    """The most probable form of each effect of a hypothesis."""
    members = enumerate(result.ground.members(index))
    return [candidate.laws[likely_form(result, index, member)].form for member, candidate in members]


def refit_board(result: SearchResult, index: int) -> Board:
    """The board under a hypothesis: with its effects declared in their most probable forms, or two labels exchanged."""
    hypothesis, board = result.ground.hypotheses[index], result.ground.baseline.board
    if hypothesis.swap is not None:
        return with_labels_exchanged(board, hypothesis.swap.first, hypothesis.swap.second)
    return with_forms(board, likely_forms(result, index))


def size_at_limit(result: SearchResult, index: int) -> str:
    """The size of a hypothesis that is at the limit of its range, in words; empty if none is.

    Zero is no limit of a size that may be zero: it means no effect. The median is that of draws, because a cell of the
    table may be wider than the limit.
    """
    draws = draw_terms(result, index, np.random.default_rng(0), _N_DRAWS)
    for member in range(len(result.ground.members(index))):
        for _, law, rows, z in standard_sizes_of(result, index, draws, member):
            if 2 * rows.size < draws.n_draws:
                continue
            for free, column in zip(law.form.free, z.T, strict=True):
                median = _median_within(free.prior, column)
                if _is_extreme(free.prior, median):
                    factor, unit = display_unit(free.unit)
                    return f"{free.key} = {factor * float(free.prior.value(median)):.3g} {unit}".rstrip()
    return ""


def _median_within(prior: Quantity, z: Floats) -> float:
    """Median of the draws within the bounds of a prior; the bound next to the draws where none is within."""
    low, high = prior.standard_bounds
    inside = z[(low <= z) & (z <= high)]
    return float(np.median(inside) if inside.size else np.clip(np.median(z), low, high))


def _is_extreme(prior: Quantity, z: float) -> bool:
    """Whether a prior has hardly any mass between a size and a bound; a zero that means no effect is no bound."""
    from scipy.special import ndtr

    low, high = prior.standard_bounds
    prior_mass = ndtr(high) - ndtr(low)
    starts_at_zero = prior.lower == 0.0 and prior.mean == 0.0
    near_top = np.isfinite(high) and (ndtr(high) - ndtr(z)) / prior_mass < LIMIT_PROBABILITY
    near_bottom = np.isfinite(low) and not starts_at_zero and (ndtr(z) - ndtr(low)) / prior_mass < LIMIT_PROBABILITY
    return bool(near_top or near_bottom)
