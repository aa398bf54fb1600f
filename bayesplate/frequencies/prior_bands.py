"""Range of each frequency under the prior alone, before anything is measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES, isotropic_moduli, rigidities
from bayesplate.board.prior import PriorCard
from bayesplate.board.setup import Setup
from bayesplate.frequencies.terms import term_weights
from bayesplate.labels import Label
from bayesplate.plate.beams import N_BEAMS, product_coefficients

BAND_QUANTILES = (1 / 6, 5 / 6)
"""Quantiles that hold two thirds of the draws."""

_N_DRAWS = 4000


def prior_medians(board: Board, prior: PriorCard) -> dict[str, Floats]:
    """Constants at the median of the prior, and the nominal inputs: dict of float."""
    medians = {name: np.asarray(density.median) for name, density in prior.constants.items()}
    return with_rigidities({**board.nominal(), **medians})


def prior_bands(
    board: Board, prior: PriorCard, setup: Setup, labels: Sequence[Label], rng: np.random.Generator
) -> dict[str, tuple[float, float]]:
    """Factors between which the prior expects each frequency, relative to the one at its median, by label.

    From Rayleigh quotients of beam-function products at each draw: each frequency is a few per cent off, but this
    cancels in the factors. Labels of an order above that of the beam functions are left out.
    """
    values = prior_draws(board, prior, rng, _N_DRAWS)
    products = product_coefficients(setup.ends_x, setup.ends_y)
    median_weights = term_weights(prior_medians(board, prior), setup).stiffness[0]
    weights = term_weights(values, setup).stiffness
    bands = {}
    for label in labels:
        i, j = label.m - setup.first_label.m, label.n - setup.first_label.n
        if max(i, j) < N_BEAMS:
            squared = weights @ products[:, i, j] / (median_weights @ products[:, i, j])
            factors = np.sqrt(squared[np.isfinite(squared) & (squared > 0)])
            low, high = np.quantile(factors, BAND_QUANTILES)
            bands[str(label)] = (float(low), float(high))
    return bands


def prior_draws(board: Board, prior: PriorCard, rng: np.random.Generator, n: int) -> dict[str, Floats]:
    """Draws of the constants and of the board's inputs: dict of (n,) array, SI."""
    constants = {name: density.sample(rng, n) for name, density in prior.constants.items()}
    inputs = {name: quantity.value(rng.standard_normal(n)) for name, quantity in board.inputs.items()}
    return with_rigidities({**inputs, **constants})


def with_rigidities(values: Values) -> dict[str, Floats]:
    """Values with D_x, D_y, D_s added, from the moduli where these are given: all three, or one if isotropic."""
    if set(RIGIDITIES) <= set(values):
        return dict(values)
    if "E_y" not in values:
        values = {**values, **isotropic_moduli(values["E_x"], values["poisson_xy"])._asdict()}
    E_x, E_y, G_xy = (values[name] for name in MODULI)
    return {**values, **rigidities(E_x, E_y, G_xy, values["thickness"], values["poisson_xy"])._asdict()}
