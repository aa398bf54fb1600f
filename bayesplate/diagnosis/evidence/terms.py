"""How probable readings are under an effect: a sum over its sizes and the noise, constants projected out.

With a flat prior on the logarithms of the three constants the marginal density of the readings is that of their
projection on the n - 3 directions that the constants cannot reach (the restricted likelihood). Under one cell of a
table and one level of noise the projection is normal, so that evidence, the prediction of a reading that was left out
and the posterior of constants and sizes are sums of normal terms; many data sets go through at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.noise_grid import NoiseGrid
from bayesplate.diagnosis.shifts.baseline import Baseline
from bayesplate.diagnosis.shifts.tables import Table

Floats = NDArray[np.float64]

_LOG_TWO_PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class Fold:
    """The readings that are used: all, or all but one.

    Attributes
    ----------
    baseline : Baseline
    left_out : int or None
        Index of the reading that is left out.
    """

    baseline: Baseline
    left_out: int | None = None

    @cached_property
    def used(self) -> NDArray[np.intp]:
        """Indices of the readings that are used."""
        every = np.arange(self.baseline.n_modes)
        return every if self.left_out is None else np.delete(every, self.left_out)

    @cached_property
    def blind(self) -> Floats:
        """Orthonormal directions that the constants cannot reach: (n_used - 3, n_modes) array, zero where not used."""
        slopes = self.baseline.slopes[self.used]
        left = np.linalg.svd(slopes, full_matrices=True)[0][:, slopes.shape[1] :]
        full = np.zeros((left.shape[1], self.baseline.n_modes))
        full[:, self.used] = left.T
        return full

    @cached_property
    def absorbing(self) -> Floats:
        """Takes readings to the constants fitted to those that are used: (3, n_modes) array, zero where not used."""
        scales = self.baseline.scales[self.used]
        inverse = np.linalg.pinv(self.baseline.slopes[self.used] / scales[:, None]) / scales
        full = np.zeros((inverse.shape[0], self.baseline.n_modes))
        full[:, self.used] = inverse
        return full

    @cached_property
    def half_log_det(self) -> float:
        """Half the logarithm of the determinant of X'X: the restricted density's change of volume."""
        slopes = self.baseline.slopes[self.used]
        return 0.5 * float(np.linalg.slogdet(slopes.T @ slopes)[1])

    @cached_property
    def misses(self) -> Floats:
        """Takes readings to the error of predicting the one that was left out: (n_modes,) array."""
        assert self.left_out is not None
        row = -self.baseline.slopes[self.left_out] @ self.absorbing
        row[self.left_out] += 1.0
        return np.asarray(row)


@dataclass(frozen=True, eq=False)
class Terms:
    """Normal terms of a table in a fold: one per level of noise and cell, cells running fastest.

    Attributes
    ----------
    table : Table
    fold : Fold
    noise : NoiseGrid
    """

    table: Table
    fold: Fold
    noise: NoiseGrid

    @cached_property
    def log_weights(self) -> Floats:
        """Logarithm of the prior probability of each term: (n_terms,) array."""
        with np.errstate(divide="ignore"):
            return np.log(np.outer(self.noise.weights, self.table.weights).ravel())

    @cached_property
    def noise_covariance(self) -> Floats:
        """Covariance of the projection without the cells' own: (n_levels, d, d) array."""
        base = self.fold.baseline
        blind = self.fold.blind
        inputs = blind @ base.input_slopes
        variances = self.noise.sd[:, base.setup_index] ** 2 + base.own_variance
        return np.einsum("di,li,ei->lde", blind, variances, blind) + inputs @ inputs.T

    @cached_property
    def _whitening(self) -> tuple[Floats, Floats]:
        """Inverse Cholesky factors and half log determinants of all terms: (n_terms, d, d) and (n_terms,) arrays."""
        spread = np.einsum("di,kip->kdp", self.fold.blind, self.table.slopes)
        own = spread @ np.swapaxes(spread, 1, 2)
        covariance = self.noise_covariance[:, None] + own[None]
        n_levels, n_cells, d, _ = covariance.shape
        factors = np.linalg.cholesky(covariance.reshape(n_levels * n_cells, d, d))
        half = np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
        return np.linalg.inv(factors), half

    @cached_property
    def middles(self) -> Floats:
        """Projection of each cell's shift: (n_cells, d) array."""
        return self.table.shift @ self.fold.blind.T

    def log_densities(self, residuals: Floats) -> Floats:
        """Logarithm of weight times density of each term: (n_terms, n_sets) array.

        Parameters
        ----------
        residuals : (n_sets, n_modes) array
            ln measured less ln f of the baseline.
        """
        whitening, half = self._whitening
        n_terms, d, _ = whitening.shape
        seen = residuals @ self.fold.blind.T
        n_levels = self.noise.weights.size
        middles = np.tile(self.middles, (n_levels, 1))
        whitened = (whitening.reshape(n_terms * d, d) @ seen.T).reshape(n_terms, d, len(seen))
        whitened -= np.einsum("kde,ke->kd", whitening, middles)[:, :, None]
        squares = np.einsum("kdn,kdn->kn", whitened, whitened)
        result: Floats = (self.log_weights - half - 0.5 * d * _LOG_TWO_PI)[:, None] - 0.5 * squares
        return result

    def log_evidence(self, residuals: Floats) -> Floats:
        """Logarithm of the restricted marginal density of data sets: (n_sets,) array."""
        return np.asarray(log_sum(self.log_densities(residuals)) - self.fold.half_log_det)

    def left_out_errors(self, residuals: Floats) -> Floats:
        """Reading that was left out less its mean prediction: (n_sets,) array, ln f."""
        shares = normalised(self.log_densities(residuals))
        misses = self.fold.misses
        by_cell = shares.reshape(self.noise.weights.size, self.table.n_cells, -1)
        own = (residuals @ misses)[None, :] - (self.table.shift @ misses)[:, None]
        if not self.table.slopes.shape[2]:
            return np.asarray((by_cell.sum(axis=0) * own).sum(axis=0))
        gains = self._gains
        seen = residuals @ self.fold.blind.T
        along = np.einsum("i,kip->kp", misses, self.table.slopes)
        total = (by_cell.sum(axis=0) * own).sum(axis=0)
        rows = np.einsum("kp,lkpd->lkd", along, gains)
        offsets = np.einsum("lkd,kd->lk", rows, self.middles)
        inside = np.einsum("lkd,nd->lkn", rows, seen) - offsets[:, :, None]
        return np.asarray(total - (by_cell * inside).sum(axis=(0, 1)))

    @cached_property
    def _gains(self) -> Floats:
        """Takes what is seen, less a cell's middle, to the place within the cell: (n_levels, n_cells, p, d) array."""
        whitening, _ = self._whitening
        n_levels = self.noise.weights.size
        spread = np.einsum("di,kip->kdp", self.fold.blind, self.table.slopes)
        d, p = spread.shape[1:]
        precision = (np.swapaxes(whitening, 1, 2) @ whitening).reshape(n_levels, -1, d, d)
        return np.einsum("kdp,lkde->lkpe", spread, precision).reshape(n_levels, -1, p, d)


def log_sum(values: Floats) -> Floats:
    """ln of the sum of exponentials over the first axis."""
    top = values.max(axis=0)
    return np.asarray(top + np.log(np.exp(values - top).sum(axis=0)))


def normalised(log_values: Floats) -> Floats:
    """Probabilities from logarithms of weights, summing to one over the first axis."""
    shares = np.exp(log_values - log_values.max(axis=0))
    return np.asarray(shares / shares.sum(axis=0))
