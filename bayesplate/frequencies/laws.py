"""The two laws that give frequencies from the weights of terms: the linear and the exact one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.reduced import ReducedOrderModel
from bayesplate.plate.terms import Weights

LawName = Literal["linear", "exact"]

_LARGEST = 1e150
"""Weight above which a draw is no plate: its matrices, or their products, would not be finite."""


@dataclass(frozen=True, eq=False)
class LinearLaw:
    """omega^2 as a ratio of weighted energies of the modes at the estimate: the paper's law."""

    stiffness: Floats  # (n_modes, n_terms)
    mass: Floats  # (n_modes, n_masses)

    def squared(self, weights: Weights) -> Floats:
        """omega^2 in s^-2: (n_draws, n_modes) array; may be negative far from the estimate."""
        return np.asarray((weights.stiffness @ self.stiffness.T) / (weights.mass @ self.mass.T))


@dataclass(frozen=True, eq=False)
class ExactLaw:
    """omega^2 as eigenvalues of a reduced-order model."""

    reduced: ReducedOrderModel

    def squared(self, weights: Weights) -> Floats:
        """omega^2 in s^-2: (n_draws, n_modes) array; not a number at a draw that is no plate.

        Weights that are not finite are kept from the eigenvalue solver, which would raise for all draws together.
        """
        is_finite = [np.abs(weight).max(axis=1) < _LARGEST for weight in weights]
        is_plate = is_finite[0] & is_finite[1]
        if is_plate.all():
            return self.reduced.eigenvalues(weights)
        squared = np.full((is_plate.size, len(self.reduced.places)), np.nan)
        if is_plate.any():
            squared[is_plate] = self.reduced.eigenvalues(Weights(*(weight[is_plate] for weight in weights)))
        return squared

    def tangent(self, weights: Weights) -> LinearLaw:
        """The linear law of the modes at one draw, which has the same slopes there."""
        return LinearLaw(*self.reduced.energies(weights))


def log_frequency(squared: Floats) -> Floats:
    """ln f (f in Hz) from omega^2; not a number where omega^2 is not positive."""
    return 0.5 * np.log(np.where(squared > 0, squared, np.nan)) - np.log(2.0 * np.pi)


def mean_log_frequency(log_frequencies: Sequence[Floats]) -> Floats:
    """ln of the mean of several frequencies, from the ln of each: arrays of one shape."""
    return (
        log_frequencies[0]
        if len(log_frequencies) == 1
        else np.asarray(np.log(np.mean(np.exp(log_frequencies), axis=0)))
    )


def cents(log_ratio: Floats) -> Floats:
    """1200 log2 of a frequency ratio, from its natural logarithm."""
    return np.asarray(log_ratio) * (1200.0 / np.log(2.0))
