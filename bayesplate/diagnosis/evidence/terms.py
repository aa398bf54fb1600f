"""How probable readings are under an effect: a sum over its sizes and the noise, constants projected out.

With a flat prior on the logarithms of the constants the marginal density of the readings is that of their projection
on the directions that they cannot reach, n - 3 of a board of wood (the restricted likelihood). Under one cell of a
table and one level of noise the projection is normal, so that evidence, the prediction of a reading that was left out
and the posterior of constants and sizes are sums of normal terms; many data sets go through at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.noise_grid import NoiseGrid
from bayesplate.diagnosis.shifts.baseline import Baseline
from bayesplate.diagnosis.shifts.tables import Table

Floats = NDArray[np.float64]

_MOST_NUMBERS = 200_000
"""Held at once of any one kind: larger arrays cost more to fetch and to give back than to fill."""
_LOG_TWO_PI = float(np.log(2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class Fold:
    """The readings that are used: all, or all but one, or but those of one mode.

    Attributes
    ----------
    baseline : Baseline
    left_out : int or None
        Index of the reading that is left out.
    others : tuple of int
        Those that are left out with it.
    """

    baseline: Baseline
    left_out: int | None = None
    others: tuple[int, ...] = ()

    @cached_property
    def used(self) -> NDArray[np.intp]:
        """Indices of the readings that are used: those that are modes."""
        kept = self.baseline.is_mode.copy()
        if self.left_out is not None:
            kept[[self.left_out, *self.others]] = False
        return np.flatnonzero(kept)

    @cached_property
    def blind(self) -> Floats:
        """Orthonormal directions that the constants cannot reach: (n_left, n_modes) array, zero where not used."""
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
        """Takes readings to the error of predicting the one that was left out: (n_modes,) array.

        Not numbers where that reading is no mode.
        """
        assert self.left_out is not None
        if not self.baseline.is_mode[self.left_out]:
            return np.full(self.baseline.n_modes, np.nan)
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

    @property
    def _variances(self) -> Floats:
        """Of the noise of each reading, its own error included: (n_levels, n_modes) array."""
        base = self.fold.baseline
        return np.asarray(self.noise.sd[:, base.setup_index] ** 2 + base.own_variance)

    @cached_property
    def noise_covariance(self) -> Floats:
        """Covariance of the projection without the cells' own: (n_levels, d, d) array."""
        blind = self.fold.blind
        inputs = blind @ self.fold.baseline.input_slopes
        return np.einsum("di,li,ei->lde", blind, self._variances, blind) + inputs @ inputs.T

    @cached_property
    def _parts(self) -> _Parts:
        """What the densities of all terms are made of."""
        factors = np.linalg.cholesky(self.noise_covariance)
        whitening = np.linalg.inv(factors)
        half = np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
        n_levels, d, _ = whitening.shape
        n_cells, n_modes, p = self.table.slopes.shape
        spread = np.moveaxis(self.table.slopes, 1, 0).reshape(n_modes, n_cells * p)
        along = ((whitening @ self.fold.blind).reshape(n_levels * d, n_modes) @ spread).reshape(n_levels, d, n_cells, p)
        along = np.ascontiguousarray(along.transpose(0, 2, 3, 1))
        inner = _cholesky_of_one_plus(along)
        for j in range(p):
            for k in range(j):
                along[:, :, j] -= inner[j][k][:, :, None] * along[:, :, k]
            along[:, :, j] /= inner[j][j][:, :, None]
        half = half[:, None] + np.sum([np.log(inner[j][j]) for j in range(p)], axis=0)
        return _Parts(whitening, np.broadcast_to(half, (n_levels, n_cells)), along, inner)

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
        parts = self._parts
        n_levels, n_cells, p, d = parts.along.shape
        seen = (residuals @ self.fold.blind.T) @ np.swapaxes(parts.whitening, 1, 2)
        middles = self.middles @ np.swapaxes(parts.whitening, 1, 2)
        across = np.swapaxes(seen, 1, 2)
        squares = (seen**2).sum(axis=2)[:, None] + (middles**2).sum(axis=2)[:, :, None] - 2.0 * (middles @ across)
        inside = (parts.along.reshape(n_levels, n_cells * p, d) @ across).reshape(n_levels, n_cells, p, len(residuals))
        inside -= np.einsum("lkpd,lkd->lkp", parts.along, middles)[:, :, :, None]
        squares -= (inside**2).sum(axis=2)
        offsets = self.log_weights - parts.half.ravel() - 0.5 * d * _LOG_TWO_PI
        return np.asarray(offsets[:, None] - 0.5 * squares.reshape(n_levels * n_cells, len(residuals)))

    def log_evidence(self, residuals: Floats) -> Floats:
        """Logarithm of the restricted marginal density of data sets: (n_sets,) array."""
        parts = [log_sum(part.log_densities(residuals)) for part in self._in_parts(len(residuals))]
        return np.asarray(log_sum(np.stack(parts)) - self.fold.half_log_det)

    def _in_parts(self, n_sets: int) -> Iterator[Terms]:
        """The terms of some cells at a time, so many that what they make of the data sets stays small."""
        n_modes, n_tangents = self.table.slopes.shape[1:]
        per_cell = self.noise.weights.size * max(n_sets, n_modes * n_tangents)
        step = max(1, _MOST_NUMBERS // per_cell)
        for first in range(0, self.table.n_cells, step):
            yield replace(self, table=self.table.some(slice(first, first + step)))

    def left_out_errors(self, residuals: Floats) -> Floats:
        """Reading that was left out less its mean prediction: (n_sets,) array, ln f."""
        parts = [part._mean_errors(residuals) for part in self._in_parts(len(residuals))]
        log_masses, errors = (np.stack(each) for each in zip(*parts, strict=True))
        return np.asarray((normalised(log_masses) * errors).sum(axis=0))

    def _mean_errors(self, residuals: Floats) -> tuple[Floats, Floats]:
        """ln of the weighted density of all cells, and the error of their mean prediction: (n_sets,) arrays."""
        log_densities = self.log_densities(residuals)
        log_mass = np.asarray(log_sum(log_densities))
        shares = np.exp(log_densities - log_mass)
        misses = self.fold.misses
        by_cell = shares.reshape(self.noise.weights.size, self.table.n_cells, -1).sum(axis=0)
        total = residuals @ misses * by_cell.sum(axis=0) - (self.table.shift @ misses) @ by_cell
        seen = residuals @ self.fold.blind.T
        rows = np.repeat(self._gains_without_cells[:, None], self.table.n_cells, axis=1)
        if self.table.slopes.shape[2] > 0:
            there = np.einsum("di,kip->kdp", self.fold.blind, self.table.slopes)
            along = np.einsum("i,kip->kp", misses, self.table.slopes) - np.einsum("lkd,kdp->lkp", rows, there)
            rows = rows + np.einsum("lkp,lkpd->lkd", along, self._gains)
        # the mean over the terms first: what is told of each data set by every one of them would be a large array
        inside = ((shares.T @ rows.reshape(len(shares), -1)) * seen).sum(axis=1)
        inside -= np.einsum("lkd,kd->lk", rows, self.middles).ravel() @ shares
        return log_mass, np.asarray(total - inside)

    @cached_property
    def _gains_without_cells(self) -> Floats:
        """Takes what is seen to what it tells of the error in `Fold.misses`, no cell's sizes told: (n_levels, d) array.

        Inputs move both; and where readings differ in noise at this level otherwise than at its median, so does the
        noise of those that the constants were fitted to.
        """
        base, misses, blind = self.fold.baseline, self.fold.misses, self.fold.blind
        of_noise = np.einsum("i,li,di->ld", misses, self._variances, blind)
        of_inputs = (misses @ base.input_slopes) @ (blind @ base.input_slopes).T
        return np.asarray(np.linalg.solve(self.noise_covariance, (of_noise + of_inputs)[:, :, None])[:, :, 0])

    @cached_property
    def _gains(self) -> Floats:
        """Takes what is seen, less a cell's middle, to the place within the cell: (n_levels, n_cells, p, d) array."""
        parts = self._parts
        result = parts.along.copy()
        for j in reversed(range(result.shape[2])):
            for k in range(j + 1, result.shape[2]):
                result[:, :, j] -= parts.inner[k][j][:, :, None] * result[:, :, k]
            result[:, :, j] /= parts.inner[j][j][:, :, None]
        return np.asarray(result @ parts.whitening[:, None])


class _Parts(NamedTuple):
    """Terms of covariance N + S S' with the few tangents S of a cell: only I + T T' with T = (L^-1 S)' is factorised.

    Attributes
    ----------
    whitening : (n_levels, d, d) array
        L^-1 with N = L L'.
    half : (n_levels, n_cells) array
        Half the log determinant of the whole covariance.
    along : (n_levels, n_cells, p, d) array
        C^-1 T with I + T T' = C C': what takes off the squares of whitened readings.
    inner : list of list of (n_levels, n_cells) array
        Lower triangle of C.
    """

    whitening: Floats
    half: Floats
    along: Floats
    inner: list[list[Floats]]


def _cholesky_of_one_plus(along: Floats) -> list[list[Floats]]:
    """Lower triangle of the Cholesky factor of I + T T', element by element over all terms, T of few rows.

    Thousands of matrices of one to four rows: a call of a library for each would take ten times as long.
    """
    inner: list[list[Floats]] = []
    for i in range(along.shape[2]):
        row: list[Floats] = []
        for j in range(i + 1):
            value = np.einsum("lkd,lkd->lk", along[:, :, i], along[:, :, j]) + (1.0 if i == j else 0.0)
            for k in range(j):
                value = value - row[k] * (row[k] if i == j else inner[j][k])
            row.append(np.sqrt(value) if i == j else value / inner[j][j])
        inner.append(row)
    return inner


def log_sum(values: Floats) -> Floats:
    """ln of the sum of exponentials over the first axis."""
    top = values.max(axis=0)
    return np.asarray(top + np.log(np.exp(values - top).sum(axis=0)))


def normalised(log_values: Floats) -> Floats:
    """Probabilities from logarithms of weights, summing to one over the first axis."""
    shares = np.exp(log_values - log_values.max(axis=0))
    return np.asarray(shares / shares.sum(axis=0))
