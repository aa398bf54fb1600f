"""Modes followed by their shapes from the plate without an effect to the plate with it.

A laboratory names a mode by its figure. Where an effect breaks the symmetry, modes that crossed before now veer, and
the rank by frequency no longer says which figure it is. So each mode is sought among those of the plate with the effect
by its share in the shape that it has without. Within a symmetry class of the plate without the effect the rank decides,
there as everywhere: the lower reading is the lower mode, whatever the two are called.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.reduced import ReducedClass
from bayesplate.modes.terms import Weights

Floats = NDArray[np.float64]

_BEYOND = 3


@dataclass(frozen=True, eq=False)
class Following:
    """Shapes of a block without the effect.

    Attributes
    ----------
    block : ReducedClass
    shapes : (n_modes, r) array
        Shape times mass of its lowest modes: their product with another shape is the share.
    wanted : (n_wanted,) array of int
        Which of them are labelled.
    groups : tuple of array of int
        Positions in `wanted` of the modes of one symmetry class, in the order of their ranks.
    """

    block: ReducedClass
    shapes: Floats
    wanted: NDArray[np.intp]
    groups: tuple[NDArray[np.intp], ...]

    @classmethod
    def of(
        cls, block: ReducedClass, without: Weights, wanted: NDArray[np.intp], groups: tuple[NDArray[np.intp], ...]
    ) -> Following:
        """Take the shapes at the weights of one draw without the effect."""
        _, vectors = block.modes(without, int(wanted.max()) + 1 + _BEYOND)
        return cls(block, vectors[0].T @ block.mass(without)[0], wanted, groups)

    def eigenvalues(self, weights: Weights) -> Floats:
        """Eigenvalue of each labelled mode for many draws: (n_draws, n_wanted) array, s^-2.

        Not a number where the weights are those of no material.
        """
        from scipy.optimize import linear_sum_assignment

        values, vectors = self.block.modes(weights, len(self.shapes) + _BEYOND)
        shares = (self.shapes @ vectors) ** 2
        found = np.full((len(values), self.wanted.size), np.nan)
        for draw in np.flatnonzero(np.isfinite(values).all(axis=1)):
            picked = linear_sum_assignment(shares[draw], maximize=True)[1][self.wanted]
            found[draw] = values[draw, picked]
        for group in self.groups:
            found[:, group] = np.sort(found[:, group], axis=1)
        return found
