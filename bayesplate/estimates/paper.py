"""The paper's least squares: psi = X d, unweighted, with coefficients from any of their three sources."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board, Values
from bayesplate.board.material import Moduli, moduli
from bayesplate.estimates.coefficients import CoefficientRows, CoefficientSource, coefficient_rows
from bayesplate.estimates.least_squares import Estimate
from bayesplate.frequencies.columns import inverse_lambda


@dataclass(frozen=True, eq=False)
class PaperSystem:
    """The linear system psi = X d of a board."""

    # (n_modes,), N m: measured omega^2 / lambda, lambda = 1 / (rho h A^2), less the part due to effects
    psi: Floats
    coefficients: Floats  # X, (n_modes, 3): a, b, c
    values: Values  # nominal inputs, for the moduli
    origins: tuple[CoefficientRows, ...] = ()  # one per setup

    def solve(self, rows: Indices | slice = slice(None)) -> Floats:
        """Unweighted least squares of the modes `rows`, (..., n_some) for many subsets: (..., 3) d_x, d_y, d_s in N m.

        Ducceschi et al., eq. (13). The shortest solution where a subset leaves a constant open; not a number where it
        has fewer than three modes, as an isotropic board may.
        """
        coefficients, psi = self.coefficients[rows], self.psi[rows]
        if psi.shape[-1] < coefficients.shape[-1]:
            return np.full((*psi.shape[:-1], coefficients.shape[-1]), np.nan)
        cutoff = np.finfo(np.float64).eps * max(coefficients.shape[-2:])
        return np.asarray((np.linalg.pinv(coefficients, cutoff) @ psi[..., None])[..., 0])

    def moduli(self, constants: Floats, nu_yx: float | None = None) -> Moduli:
        """Elastic moduli of (..., 3) rigidities, Pa; Ducceschi et al., eq. (14).

        With `nu_yx` given, the Poisson factor 1 - nu_xy nu_yx is fixed as the paper does; otherwise nu_yx follows from
        the estimate itself.
        """
        D_x, D_y, D_s = np.moveaxis(np.asarray(constants, dtype=float), -1, 0)
        h, nu_xy = self.values["thickness"], self.values["poisson_xy"]
        if nu_yx is None:
            return moduli(D_x, D_y, D_s, h, nu_xy)
        factor = 12.0 * (1.0 - nu_xy * nu_yx) / h**3
        return Moduli(D_x * factor, D_y * factor, 3.0 * D_s / h**3)

    @property
    def condition_number(self) -> float:
        return float(np.linalg.cond(self.coefficients))


def paper_system(
    board: Board, estimate: Estimate, source: CoefficientSource | None = None, *, compared: bool = True
) -> PaperSystem:
    """The paper's linear system of all readings of a board; of the source and `compared` see `coefficient_rows`."""
    values = board.nominal()
    origins = tuple(
        coefficient_rows(board.name, model, estimate.values, source, compared=compared) for model in estimate.models
    )
    psi = [
        (2.0 * np.pi * setup.measured[origin.readings]) ** 2 * inverse_lambda(values, setup) - origin.rest
        for setup, origin in zip(board.setups, origins, strict=True)
    ]
    rows = [origin.coefficients for origin in origins]
    return PaperSystem(np.concatenate(psi), np.concatenate(rows), values, origins)
