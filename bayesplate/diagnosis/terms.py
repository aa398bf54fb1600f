"""The density of readings under an effect: a sum over its sizes and the noise, constants projected out.

With a flat prior on the logarithms of the constants the marginal density of the readings is that of their projection
on the directions that the constants cannot reach, n - 3 for a board of wood (the restricted likelihood). Under one cell
of a table and one level of noise the projection is normal, with the precision Q of the readings; the evidence is a sum
of such terms. Each term also predicts readings m that are left out: they differ from the prediction by
Q_mm^-1 (Q g)_m, where g is the residual of all readings under the term, and the density of the other readings is that
of all over that of this difference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.shifts import Cells

_MOST_ARRAY_ELEMENTS = 200_000
"""Elements of an array, at most: larger arrays cost more to allocate and to free than to fill."""
_LOG_TWO_PI = float(np.log(2.0 * np.pi))
_LEAST_PRECISION = 1e-12
"""Least share of its precision without the constants that a reading keeps: one that alone carries a constant has 0."""


@dataclass(frozen=True, eq=False)
class NormalTerms:
    """Normal terms of a table: one per level of noise and cell, cells running fastest."""

    table: Cells  # of the modes of the readings, by their labels
    baseline: Baseline
    noise: NoiseGrid

    @cached_property
    def log_weights(self) -> Floats:
        """Logarithm of the prior probability of each term: (n_terms,) array."""
        with np.errstate(divide="ignore"):
            return np.log(np.outer(self.noise.weights, self.table.weights).ravel())

    @cached_property
    def _whitening(self) -> Floats:
        """L^-1 B, with B the blind directions and L L' their covariance by noise and inputs: (n_levels, d, n) array."""
        base, blind = self.baseline, self.baseline.residual_directions
        variances = self.noise.sd[:, base.setup_index] ** 2 + base.own_variance
        inputs = blind @ base.input_slopes
        covariance = np.einsum("di,li,ei->lde", blind, variances, blind) + inputs @ inputs.T
        return np.linalg.inv(np.linalg.cholesky(covariance)) @ blind

    @cached_property
    def _tangents(self) -> tuple[Floats, Floats]:
        """The whitened tangents T of the cells, by which the squares of whitened readings are reduced.

        C^-1 T' with C C' = I + T' T, (n_levels, n_cells, p, d) array, and ln of the determinant of C.
        """
        n_cells, n_modes, p = self.table.slopes.shape
        n_levels, d, _ = self._whitening.shape
        spread = np.moveaxis(self.table.slopes, 1, 0).reshape(n_modes, n_cells * p)
        along = np.moveaxis((self._whitening @ spread).reshape(n_levels, d, n_cells, p), 1, 3)
        factors = np.linalg.cholesky(np.eye(p) + along @ np.swapaxes(along, 2, 3))
        return np.linalg.solve(factors, along), np.log(np.diagonal(factors, axis1=2, axis2=3)).sum(axis=2)

    def _densities(self, residuals: Floats) -> tuple[Floats, Floats]:
        """ln of weight times density, (n_levels, n_cells, n_sets) array, and the readings along the tangents."""
        along, log_factor = self._tangents
        n_levels, n_cells, p, d = along.shape
        whitened = np.swapaxes(residuals @ np.swapaxes(self._whitening, 1, 2), 1, 2)
        middles = self.table.shift @ np.swapaxes(self._whitening, 1, 2)
        squares = (whitened**2).sum(axis=1)[:, None] + (middles**2).sum(axis=2)[:, :, None] - 2.0 * (middles @ whitened)
        inside = (along.reshape(n_levels, n_cells * p, d) @ whitened).reshape(n_levels, n_cells, p, len(residuals))
        inside -= np.einsum("lkpd,lkd->lkp", along, middles)[:, :, :, None]
        squares -= (inside**2).sum(axis=2)
        gram = self._whitening @ np.swapaxes(self._whitening, 1, 2)
        volume = 0.5 * np.linalg.slogdet(gram)[1][:, None] - log_factor - 0.5 * d * _LOG_TWO_PI
        offsets = self.log_weights.reshape(n_levels, n_cells) + volume
        return offsets[:, :, None] - 0.5 * squares, inside

    def log_densities(self, residuals: Floats) -> Floats:
        """Logarithm of weight times density of each term: (n_terms, n_sets) array."""
        return self._densities(residuals)[0].reshape(-1, len(residuals))

    def log_evidence(self, residuals: Floats) -> Floats:
        """Logarithm of the restricted marginal density of data sets: (n_sets,) array."""
        parts = [log_sum(part.log_densities(residuals)) for part in self._in_parts(len(residuals))]
        return np.asarray(log_sum(np.stack(parts)) - self.baseline.half_log_det)

    def left_out(self, residuals: Floats) -> tuple[Floats, Floats]:
        """ln evidence without each mode, (n_same_modes, n_sets), and the errors of its readings, (n_modes, n_sets), ln
        f.

        An error is a reading less its mean prediction by the others; not a number where the reading is no mode.
        """
        parts = [part._left_out_of_cells(residuals) for part in self._in_parts(len(residuals))]
        log_masses, errors = (np.stack(values) for values in zip(*parts, strict=True))
        mean = (normalised_weights(log_masses)[:, self.baseline.mode_index] * errors).sum(axis=0)
        return np.asarray(log_sum(log_masses) - self.baseline.half_log_det), np.asarray(mean)

    def _left_out_of_cells(self, residuals: Floats) -> tuple[Floats, Floats]:
        """`left_out` for these cells alone, with ln of their weight, without `half_log_det`, in place of the
        evidence."""
        log_densities, inside = self._densities(residuals)
        white, along = self._whitening, self._tangents[0] @ self._whitening[:, None]
        weighted_residuals = np.swapaxes(white, 1, 2) @ (white @ residuals.T)
        middles = self.table.shift @ (np.swapaxes(white, 1, 2) @ white)
        log_mass = np.empty((len(self.baseline.readings_by_mode), len(residuals)))
        errors = np.full((self.baseline.n_modes, len(residuals)), np.nan)
        for i, mode in enumerate(self.baseline.readings_by_mode):
            rows = [reading for reading in mode if self.baseline.is_mode[reading]]
            white_readings, tangents = white[:, :, rows], along[:, :, :, rows]
            weighted_errors = (
                weighted_residuals[:, None, rows] - middles[:, :, rows, None] - np.swapaxes(tangents, 2, 3) @ inside
            )
            bare_precision = np.swapaxes(white_readings, 1, 2) @ white_readings
            least = _LEAST_PRECISION * bare_precision * np.eye(len(rows))
            precision = (bare_precision + least)[:, None] - np.swapaxes(tangents, 2, 3) @ tangents
            misses = np.linalg.inv(precision) @ weighted_errors
            log_others = log_densities + 0.5 * (weighted_errors * misses).sum(axis=2) + 0.5 * len(rows) * _LOG_TWO_PI
            log_others -= 0.5 * np.linalg.slogdet(precision)[1][:, :, None]
            log_mass[i] = log_sum(log_others.reshape(-1, len(residuals)))
            errors[rows] = np.einsum("lks,lkms->ms", np.exp(log_others - log_mass[i]), misses)
        return log_mass, errors

    def _in_parts(self, n_sets: int) -> Iterator[NormalTerms]:
        """The terms in parts, with so few cells each that their arrays over the data sets stay small."""
        n_modes, n_tangents = self.table.slopes.shape[1:]
        step = max(1, _MOST_ARRAY_ELEMENTS // (self.noise.weights.size * max(n_sets, n_modes * n_tangents)))
        for first in range(0, self.table.n_cells, step):
            part = self.table.select(slice(first, first + step))
            yield self if step >= self.table.n_cells else replace(self, table=part)


def log_sum(values: Floats) -> Floats:
    """ln of the sum of exponentials over the first axis."""
    top = values.max(axis=0)
    return np.asarray(top + np.log(np.exp(values - top).sum(axis=0)))


def normalised_weights(log_values: Floats) -> Floats:
    """Probabilities from logarithms of weights, summing to one over the first axis."""
    shares = np.exp(log_values - log_values.max(axis=0))
    return np.asarray(shares / shares.sum(axis=0))


_LOW, _HIGH, _HIGHEST = -2.5, 3.5, 9.0
_MARGIN = 1.5
"""Standard deviations of the prior above the rms: the noise may be a few tenths off it, and is also tried 1.5 times
smaller."""
_LEVELS, _FEW_LEVELS = {1: 9, 2: 5}, {1: 5, 2: 4}
"""Levels along each axis, by the number of setups."""
_POINTS, _FEW_POINTS = 64, 32
"""Points for more setups, where a grid would grow without bound; powers of two, as Sobol's sequence requires."""


@dataclass(frozen=True, eq=False)
class NoiseGrid:
    """Levels of the relative noise."""

    sd: Floats  # (n_levels, n_setups) array
    weights: Floats  # (n_levels,) array: prior probability, summing to 1


def noise_grid(board: Board, *, is_coarse: bool = False, reach: Sequence[float] = ()) -> NoiseGrid:
    """A grid of noise levels, equidistant in ln noise, for one or two setups, and scattered points for more.

    The points are the first of Sobol's sequence (USSR Comput. Math. Math. Phys. 7, 1967), each in the middle of its
    share of the prior: as many for twenty setups as for three, so that they are coarser with more setups. A coarse
    grid, for combinations of effects, has a few of them. The levels of one or two setups go up to `reach` at least, in
    standard coordinates, so that a misfit of many times the noise has a level near it.
    """
    n_setups = len(board.setups)
    counts = _FEW_LEVELS if is_coarse else _LEVELS
    if n_setups in counts:
        axes = [_noise_levels(counts[n_setups], top) for top in reach or (_HIGH,) * n_setups]
        t = np.array(list(product(*axes)))
        weights = np.exp(-0.5 * (t**2).sum(axis=1))
    else:
        t = _normal_points(_FEW_POINTS if is_coarse else _POINTS, n_setups)
        weights = np.ones(len(t))
    levels = [setup.noise.median * np.exp(setup.noise.log_sd * t[:, i]) for i, setup in enumerate(board.setups)]
    return NoiseGrid(np.stack(levels, axis=1), weights / weights.sum())


def noise_reach(board: Board, setup_index: Indices, residual: Floats) -> tuple[float, ...]:
    """The highest noise level that each setup needs for its residual (ln f; NaN: no mode), in standard coordinates."""
    reaches = []
    for i, setup in enumerate(board.setups):
        own_residual = residual[(setup_index == i) & np.isfinite(residual)]
        rms = float(np.sqrt(np.mean(own_residual**2))) if own_residual.size else 0.0
        needed = np.log(rms / setup.noise.median) / setup.noise.log_sd + _MARGIN if rms > 0.0 else _HIGH
        reaches.append(float(np.clip(needed, _HIGH, _HIGHEST)))
    return tuple(reaches)


def _noise_levels(n_levels: int, top: float) -> Floats:
    """`n_levels` levels over the usual range of the prior, and more of the same distance up to the top."""
    step = (_HIGH - _LOW) / n_levels
    n_more = int(np.ceil((top - _HIGH) / step - 1e-9))
    return np.asarray(_LOW + step * (np.arange(n_levels + n_more) + 0.5))


def _normal_points(n_points: int, n_dim: int) -> Floats:
    """Standard normal coordinates of equally weighted points: (n_points, n_dim) array."""
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    shares = Sobol(n_dim, scramble=False).random(n_points) + 0.5 / n_points
    return np.asarray(ndtri(shares))
