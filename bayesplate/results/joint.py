"""How the constants and the density of a board vary together: means and covariance of their logarithms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.posterior.draws import Draws

JOINT = (*MODULI, *RIGIDITIES, "density")
"""Whatever makers compute is a product of powers of these, so that its logarithm is a sum of theirs."""


@dataclass(frozen=True)
class Joint:
    """Natural logarithms of constants and density together, in SI units.

    Attributes
    ----------
    names : tuple of str
        E_x, E_y, G_xy (Pa), D_x, D_y, D_s (N m), density (kg m^-3).
    log_mean : tuple of float
        In that order.
    log_covariance : tuple of tuple of float
        Row after row.
    """

    names: tuple[str, ...]
    log_mean: tuple[float, ...]
    log_covariance: tuple[tuple[float, ...], ...]

    @classmethod
    def of(cls, draws: Draws) -> Joint:
        """That of draws."""
        return cls.of_values({**draws.moduli, **draws.rigidities, "density": draws.derived["density"].values})

    @classmethod
    def of_values(cls, values: Mapping[str, NDArray[np.float64]]) -> Joint:
        """That of draws by name, each an array of the same shape, SI."""
        logs = np.stack([np.log(np.ravel(values[name])) for name in JOINT])
        mean = logs.mean(axis=1)
        apart = logs - mean[:, None]
        covariance = (apart[:, None] * apart[None]).sum(axis=2) / (logs.shape[1] - 1)
        return cls(
            JOINT,
            tuple(float(one) for one in mean),
            tuple(tuple(float(one) for one in row) for row in covariance),
        )
