"""A board that was not measured yet: what the prior believes of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.prior import PriorCard
from bayesplate.frequencies.prior_bands import prior_medians, with_rigidities
from bayesplate.planning.beliefs import (
    N_TERMS,
    NOTHING_LACKS,
    Beliefs,
    Explanation,
    KnownBoard,
    laws_of,
    levels,
    log_moduli,
)
from bayesplate.posterior.parameters import Parameters

Floats = NDArray[np.float64]

_N_PLATES = 12
"""Plates drawn from the prior at which the slopes of the frequencies are taken."""


def prior_beliefs(board: Board, prior: PriorCard, rng: np.random.Generator, notes: tuple[str, ...] = ()) -> Beliefs:
    """What the prior believes of a board; the notes say why its readings, if there are any, were left aside.

    Its frequencies are not linear over a prior that wide, so that the slopes are taken at plates drawn from it.
    """
    values, one = prior_medians(board, prior), prior_explanation(board, prior, rng)
    laws = laws_of(board, values, prior, _plates(prior, values, rng))
    known = KnownBoard(board, values, laws, np.eye(one.mean.shape[1]))
    return Beliefs((known,), (one,), basis="prior", notes=(*notes, *board.notes))


def prior_explanation(board: Board, prior: PriorCard, rng: np.random.Generator) -> Explanation:
    """What the prior says of a board, normal in the logarithms of its constants: no effect is thought of."""
    values, n, n_u = prior_medians(board, prior), board.symmetry.n, Parameters(board).fitted_columns.size
    middle, gradient = log_moduli(board, np.log(board.symmetry.free_of(values)))
    names = tuple(prior.constants)
    is_of_moduli = set(names) <= set(MODULI)
    order = [names.index(name) for name in (MODULI if is_of_moduli else RIGIDITIES) if name in names]
    # The stated constants are independent of the inputs; rigidities follow from moduli, thickness and Poisson ratio.
    to_stated = np.eye(n, n_u)
    if is_of_moduli:
        to_stated = gradient[[MODULI.index(names[i]) for i in order]]
    design = np.vstack([to_stated, np.eye(n_u)[n:]])
    spread = np.r_[[prior.constants[names[i]].log_sd for i in order], np.ones(n_u - n)]
    root = np.linalg.solve(design, np.diag(spread))
    return Explanation(
        members=(),
        words=NOTHING_LACKS,
        probability=1.0,
        mean=np.zeros((N_TERMS, n_u)),
        covariance=np.tile(root @ root.T, (N_TERMS, 1, 1)),
        noise=np.stack([levels(setup.noise, N_TERMS, rng) for setup in board.setups], axis=1),
        middle=np.tile(middle, (N_TERMS, 1)),
        wanted=np.tile(gradient, (N_TERMS, 1, 1)),
    )


def _plates(prior: PriorCard, values: Values, rng: np.random.Generator) -> list[Mapping[str, Floats]]:
    """Plates drawn from the prior; those of no material, nu_xy nu_yx >= 1, are passed over."""
    plain = {name: value for name, value in values.items() if name not in (*MODULI, *RIGIDITIES)}
    drawn = {name: one.sample(rng, _N_PLATES) for name, one in prior.constants.items()}
    every = ({name: np.asarray(each[i]) for name, each in drawn.items()} for i in range(_N_PLATES))
    plates = [with_rigidities({**plain, **one}) for one in every]
    return [one for one in plates if all(np.isfinite(one[name]) for name in RIGIDITIES)]
