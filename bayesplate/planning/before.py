"""A board that was not measured yet: what the prior believes of it, and where to begin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.prior import PriorCard
from bayesplate.errors import BayesplateError
from bayesplate.frequencies.prior_bands import prior_medians, with_rigidities
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import N_TERMS, NOTHING_LACKS, Beliefs, Explanation, moduli_at
from bayesplate.planning.gains import Readings
from bayesplate.planning.modes_read import levels
from bayesplate.planning.station_laws import BareLaw, bare_law
from bayesplate.planning.stations import Station
from bayesplate.posterior.parameters import Parameters

Floats = NDArray[np.float64]

N_PLATES = 12
"""Plates drawn from the prior at which the slopes of the frequencies are taken."""


def prior_beliefs(board: Board, prior: PriorCard, rng: np.random.Generator) -> tuple[Beliefs, dict[str, Floats]]:
    """What the prior believes of a board, and the values of its median, SI.

    Parameters
    ----------
    board : Board
    prior : PriorCard
    rng : numpy.random.Generator
        Deals the levels of the noise.
    """
    values = prior_medians(board, prior)
    n, n_inputs = board.symmetry.n, len(Parameters(board).inputs)
    n_u = n + n_inputs
    log_rigidities = np.log(board.symmetry.free_of(values))
    log_moduli, gradient = moduli_at(board, log_rigidities, n_u)
    names = tuple(prior.constants)
    spread = np.array([prior.constants[name].log_sd for name in names])
    covariance = np.eye(n_u)
    if set(names) <= set(MODULI):
        order = [names.index(name) for name in MODULI if name in names]
        stated = gradient[[MODULI.index(names[i]) for i in order]]
        back = np.linalg.inv(stated[:, :n])
        of_inputs = -back @ stated[:, n:]
        covariance[:n, n:] = of_inputs
        covariance[n:, :n] = of_inputs.T
        own = back @ np.diag(spread[order] ** 2) @ back.T
        covariance[:n, :n] = own + of_inputs @ of_inputs.T
    else:
        order = [names.index(name) for name in RIGIDITIES]
        covariance[:n, :n] = np.diag(spread[order] ** 2)
    one = Explanation(
        members=(),
        words=NOTHING_LACKS,
        probability=1.0,
        mean=np.zeros((N_TERMS, n_u)),
        covariance=np.tile(covariance, (N_TERMS, 1, 1)),
        noise=np.stack([levels(setup.noise, N_TERMS, rng) for setup in board.setups], axis=1),
        log_moduli=np.tile(log_moduli, (N_TERMS, 1)),
        to_moduli=np.tile(gradient, (N_TERMS, 1, 1)),
        cells=np.zeros(N_TERMS, dtype=np.intp),
    )
    return Beliefs(board, (one,), n_inputs), values


def prior_laws(
    beliefs: Beliefs, prior: PriorCard, station: Station, values: Values, rng: np.random.Generator
) -> tuple[BareLaw, ...]:
    """The modes of a station at the prior's median, and at plates drawn from it; the median first.

    A plate of no material, nu_xy nu_yx >= 1, and one on which a mode is not to be found are passed over.
    """
    laws = [bare_law(beliefs.board, station, values)]
    drawn = {name: one.sample(rng, N_PLATES) for name, one in prior.constants.items()}
    for i in range(N_PLATES):
        plain = {name: value for name, value in values.items() if name not in (*MODULI, *RIGIDITIES)}
        there = with_rigidities({**plain, **{name: np.asarray(each[i]) for name, each in drawn.items()}})
        if not all(np.isfinite(there[name]) for name in RIGIDITIES):
            continue
        try:
            laws.append(bare_law(beliefs.board, station, there))
        except (KeyError, BayesplateError):
            continue
    return tuple(laws)


def prior_readings(beliefs: Beliefs, laws: Sequence[BareLaw], rng: np.random.Generator) -> Readings:
    """The modes of a station as readings: each term with the slopes of one of the plates that were drawn."""
    (one,) = beliefs.explanations
    station, median = laws[0].station, laws[0]
    drawn = laws[1:] or laws
    slopes = np.zeros((one.n_terms, len(station.setup.readings), one.mean.shape[1]))
    for term in range(one.n_terms):
        law = drawn[term % len(drawn)]
        slopes[term, :, : law.slopes.shape[1]] = law.slopes
    names = [setup.name for setup in beliefs.board.setups]
    is_own = not station.is_new
    noise = one.noise[:, names.index(station.base.name)] if is_own else levels(station.setup.noise, one.n_terms, rng)
    own = ReadingErrors.of(station.setup).own_variance
    shift = np.tile(median.middle, (one.n_terms, 1))
    return Readings((shift,), (slopes,), (noise[:, None] ** 2 + own,))
