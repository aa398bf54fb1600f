"""The modes that alone carry a constant or a size under a hypothesis: what they say when left out says nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.draws import members_of
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.estimates.leave_one_out import CarryingMode, carrying_modes, leverages_of, united

Floats = NDArray[np.float64]


def carrying(found: Found, index: int) -> tuple[CarryingMode, ...]:
    """Modes that alone carry something without any effect or under a hypothesis: both are judged without them.

    Parameters
    ----------
    found : Found
    index : int
        Of the hypothesis; 0: without any effect.
    """
    return united(*(_under(found, one) for one in dict.fromkeys((0, index))))


def _under(found: Found, index: int) -> tuple[CarryingMode, ...]:
    """The same under one hypothesis, at its most probable sizes: their priors count as one more observation each."""
    ground, hypothesis = found.ground, found.ground.hypotheses[index]
    terms = hypothesis.terms(ground.whole)
    baseline, table = terms.fold.baseline, hypothesis.table
    log_densities = terms.log_densities(hypothesis.seen(ground.baseline, found.residual[None, :]))[:, 0]
    cell = int(np.argmax(np.exp(log_densities - log_densities.max()).reshape(-1, table.n_cells).sum(axis=0)))
    owners, widths = _tangents(found, index, cell)
    sizes = np.divide(table.slopes[cell], widths, out=np.zeros_like(table.slopes[cell]), where=widths > 0.0)
    columns = np.hstack([baseline.slopes, baseline.input_slopes, sizes])
    scales = np.where(baseline.is_mode, baseline.scales, np.inf)
    board = ground.baseline.board
    names = (*board.symmetry.moduli, *(one.effect or one.name for one in board.uncertain), *owners)
    leverages = leverages_of(columns, scales, ground.baseline.same_modes, board.symmetry.n)
    return carrying_modes(board, leverages, names)


def _tangents(found: Found, index: int, cell: int) -> tuple[list[str], Floats]:
    """Of each tangent of a hypothesis' table, at one of its cells: its effect, and its length in standard coordinates.

    Lengths are zero of tangents that the form of the effect does not have.
    """
    members = members_of(found, index)
    if len(members) < 2:
        cells, tables = [cell], [one.fine for one in members]
    else:
        cells, tables = list(divmod(cell, members[1].coarse.n_cells)), [one.coarse for one in members]
    owners, widths = [], [np.zeros(0)]
    for one, table, own in zip(members, tables, cells, strict=False):
        n_tangents = table.slopes.shape[2]
        owners += [one.name] * n_tangents
        widths.append(table.z_slopes[own, :n_tangents])
    return owners, np.concatenate(widths)
