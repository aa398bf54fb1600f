"""A thickness or a width that was read at places: a smooth random field, conditioned on readings with errors.

The field is constant but for a Gaussian process: a polynomial over the board whose coefficients are those of smooth
random functions, as far as polynomials of this degree hold them. The constant is its mean over the board; everything
else has none. A reading is the field at its place, plus scatter, plus a rounding error of its own, plus what the field
changes by if the place is not quite the stated one.
"""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.legendre import legder, leggauss, legval

from bayesplate.arrays import Floats
from bayesplate.board.quantity import Quantity

Degrees = tuple[tuple[int, int], ...]

DEGREE = 6
"""Highest degree of the polynomials, x and y together."""
LENGTH_SCALE = 0.5
"""Length over which the field varies, as a fraction of each side."""
_N_POINTS = 24
_SMALLEST_VARIANCE = 1e-9
_AMPLITUDES, _SCATTERS = np.geomspace(1e-4, 0.2, 27), np.geomspace(1e-5, 0.1, 19)
_N_PASSES = 2


@dataclass(frozen=True)
class FieldScales:
    """Scales of the half-Cauchy priors, as fractions of the mean: half of all boards lie below, half above."""

    field: float  # standard deviation over the board
    scatter: float  # standard deviation of a reading besides its rounding


THICKNESS_SCALES = FieldScales(field=0.015, scatter=0.005)
"""0.015 is the root mean square over the board of a taper of 5 % from end to end, what hand-planed boards have."""
WIDTH_SCALES = FieldScales(field=0.01, scatter=0.001)


@dataclass(frozen=True)
class Surface:
    """A smooth function over the board: a sum of polynomials that are orthonormal over the unit square."""

    degrees: Degrees  # along x and y of each polynomial
    coefficients: tuple[float, ...]

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """Values at points, fractions of the sides: arrays that broadcast."""
        along = [legendre(i, x) for i in range(max(i for i, _ in self.degrees) + 1)]
        across = [legendre(j, y) for j in range(max(j for _, j in self.degrees) + 1)]
        total = np.zeros(np.broadcast_shapes(np.shape(x), np.shape(y)))
        for (i, j), coefficient in zip(self.degrees, self.coefficients, strict=True):
            total = total + coefficient * along[i] * across[j]
        return np.asarray(total)

    @property
    def size(self) -> float:
        """Root mean square over the board."""
        return float(np.linalg.norm(self.coefficients))


@dataclass(frozen=True, eq=False)
class ConditionedField:
    """The posterior of a field given its readings, normal in its mean and its n coefficients."""

    degrees: Degrees  # of the polynomials besides the constant
    mean: float  # of the field's mean over the board, in the unit of the readings, and so its sd
    sd: float
    shape: Floats  # (n,) expected coefficients, as fractions of the mean
    covariance: Floats  # (n, n), as fractions of the mean
    mean_gain: Floats  # (n,) gain of the coefficients where the mean is one of its sd higher


@dataclass(frozen=True)
class PlacedReadings:
    """Readings at places of a board."""

    values: tuple[float, ...]
    x: tuple[float, ...]  # fractions of the sides, and so y
    y: tuple[float, ...]
    resolution: float  # in the unit of the readings
    place_sd: tuple[float, float]  # of the places, fractions of the sides
    scales: FieldScales
    is_along_x_only: bool = False


def thickness_readings(thickness: Quantity, length_x: Quantity, length_y: Quantity) -> PlacedReadings | None:
    """The thickness as read at places; None unless these are two at least."""
    if not (thickness.at_x and thickness.at_y):
        return None
    x, y = _fractions(thickness.at_x, length_x), _fractions(thickness.at_y, length_y)
    if len(set(zip(x, y, strict=True))) < 2:
        return None
    place_sd = (thickness.place_sd / length_x.mean, thickness.place_sd / length_y.mean)
    return PlacedReadings(thickness.readings, x, y, thickness.resolution, place_sd, THICKNESS_SCALES)


def width_readings(width: Quantity, length_x: Quantity) -> PlacedReadings | None:
    """The width as read at stations along the board; None unless these are two at least."""
    x = _fractions(width.at_x, length_x)
    if len(set(x)) < 2:
        return None
    place_sd = (width.place_sd / length_x.mean, 0.0)
    return PlacedReadings(width.readings, x, (0.5,) * len(x), width.resolution, place_sd, WIDTH_SCALES, True)


def _fractions(places: tuple[float, ...], side: Quantity) -> tuple[float, ...]:
    return tuple(min(max(place / side.mean, 0.0), 1.0) for place in places)


@lru_cache(maxsize=64)
def condition_field(read: PlacedReadings) -> ConditionedField:
    """The field given its readings, averaged over amplitudes and scatters by their probabilities.

    Where the readings do not support a field the small amplitudes are the probable ones, and the field shrinks to
    its mean.
    """
    scale = statistics.mean(read.values)
    relative = np.array(read.values) / scale
    degrees = _polynomial_degrees(read.is_along_x_only)
    x, y = np.array(read.x), np.array(read.y)
    design = _design_matrix(degrees, x, y)
    rounding_variance = np.full(relative.size, (read.resolution / scale) ** 2 / 12.0)
    slopes = [np.zeros(relative.size)] * 2
    for _ in range(_N_PASSES if any(read.place_sd) else 1):
        place_variance = sum((sd * slope) ** 2 for sd, slope in zip(read.place_sd, slopes, strict=True))
        mean, covariance = _average(relative, design, rounding_variance + place_variance, degrees, read.scales)
        slopes = [_design_matrix(degrees, x, y, order)[:, 1:] @ mean[1:] for order in ((1, 0), (0, 1))]
    sd = float(np.sqrt(covariance[0, 0]))
    with_mean = covariance[1:, 0] / sd / mean[0]
    return ConditionedField(
        degrees[1:],
        float(mean[0] * scale),
        sd * scale,
        mean[1:] / mean[0],
        covariance[1:, 1:] / mean[0] ** 2,
        with_mean,
    )


def sd_after_readings(read: PlacedReadings, x: Floats, y: Floats) -> float:
    """Expected standard deviation of the field's mean after readings at further places (n,), fractions of the sides.

    The further readings are taken to scatter as the present ones do, so that amplitudes and scatters keep their present
    probabilities.
    """
    scale = statistics.mean(read.values)
    field = condition_field(read)
    degrees = _polynomial_degrees(read.is_along_x_only)
    places = np.concatenate([read.x, x]), np.concatenate([read.y, y])
    slope = field.shape * field.mean / scale
    variances = np.full(len(places[0]), (read.resolution / scale) ** 2 / 12.0)
    for sd, order in zip(read.place_sd, ((1, 0), (0, 1)), strict=True):
        variances += (sd * (_design_matrix(degrees, *places, order)[:, 1:] @ slope)) ** 2
    design, relative, n = (
        _design_matrix(degrees, *places) @ _smooth_basis(degrees),
        np.array(read.values) / scale,
        len(read.values),
    )
    log_weights = _regress(relative, design[:n], variances[:n], read.scales)[0]
    weights = np.exp(log_weights - log_weights.max())
    mean_variances = _regress(np.ones(len(design)), design, variances, read.scales)[2][..., 0, 0]
    return float(scale * np.sqrt(np.average(mean_variances, weights=weights)))


def _average(
    readings: Floats, design: Floats, variances: Floats, degrees: Degrees, scales: FieldScales
) -> tuple[Floats, Floats]:
    """Mean and covariance of all coefficients, the constant first, over amplitudes and scatters."""
    basis = _smooth_basis(degrees)
    log_weights, means, covariances = _regress(readings, design @ basis, variances, scales)
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    mean = np.tensordot(weights, means, axes=2)
    second_moments = covariances + (means - mean)[..., :, None] * (means - mean)[..., None, :]
    return basis @ mean, basis @ np.tensordot(weights, second_moments, axes=2) @ basis.T


def _regress(
    readings: Floats, design: Floats, reading_variances: Floats, scales: FieldScales
) -> tuple[Floats, Floats, Floats]:
    """Regression on the constant and on standard smooth functions, for each amplitude and scatter, the constant first.

    Log probability (n_a, n_s), mean (n_a, n_s, r) and covariance (n_a, n_s, r, r).
    """
    amplitude, scatter = _AMPLITUDES, _SCATTERS
    variances = reading_variances + scatter[:, None] ** 2  # (n_s, n)
    weighted_design = design / variances[..., None]
    precision = np.zeros((amplitude.size, scatter.size, *(design.shape[1],) * 2))
    precision += np.einsum("sni,nj->sij", weighted_design, design)
    smooth_terms = np.arange(1, design.shape[1])
    precision[:, :, smooth_terms, smooth_terms] += amplitude[:, None, None] ** -2.0
    covariance = np.linalg.inv(precision)
    deviations = readings - 1.0
    weighted_deviations = np.einsum("sni,n->si", weighted_design, deviations)
    mean = np.einsum("asij,sj->asi", covariance, weighted_deviations)
    misfit = np.sum(deviations**2 / variances, axis=1) - np.einsum("asi,si->as", mean, weighted_deviations)
    log_size = np.log(variances).sum(axis=1) + np.linalg.slogdet(precision)[1]
    log_size += 2.0 * smooth_terms.size * np.log(amplitude)[:, None]
    priors = (np.log(steps / (1.0 + (steps / scale) ** 2)) for steps, scale in
              ((amplitude[:, None], scales.field), (scatter, scales.scatter)))  # fmt: skip
    mean[..., 0] += 1.0
    return np.asarray(-0.5 * (misfit + log_size) + sum(priors)), mean, np.asarray(covariance)


@lru_cache(maxsize=8)
def _smooth_basis(degrees: Degrees) -> Floats:
    """Coefficients of the constant and of independent functions that together vary as smooth ones do: (n, r) array.

    Their covariance is that of exp(-d^2 / (2 LENGTH_SCALE^2)) with the mean over the board taken out; its trace is one,
    so that the amplitude is the standard deviation over the board.
    """
    points, weights = leggauss(_N_POINTS)
    coordinates, weights = 0.5 * (points + 1.0), 0.5 * weights
    values = weights * np.stack([legendre(k, coordinates) for k in range(DEGREE + 1)])
    side_covariance = values @ np.exp(-0.5 * ((coordinates[:, None] - coordinates) / LENGTH_SCALE) ** 2) @ values.T
    i, j = np.array(degrees).T
    across_covariance = side_covariance[j][:, j] if j.any() else 1.0
    covariance = (side_covariance[i][:, i] * across_covariance)[1:, 1:]
    variances, directions = np.linalg.eigh(covariance / np.trace(covariance))
    is_spanned = variances > _SMALLEST_VARIANCE
    basis = np.zeros((len(degrees), 1 + int(is_spanned.sum())))
    basis[0, 0] = 1.0
    basis[1:, 1:] = directions[:, is_spanned] * np.sqrt(variances[is_spanned])
    return basis


def _polynomial_degrees(is_along_x_only: bool) -> Degrees:
    """Degrees of all polynomials, the constant first."""
    if is_along_x_only:
        return tuple((i, 0) for i in range(DEGREE + 1))
    return tuple((total - j, j) for total in range(DEGREE + 1) for j in range(total + 1))


def _design_matrix(degrees: Degrees, x: Floats, y: Floats, order: tuple[int, int] = (0, 0)) -> Floats:
    """Derivatives of every polynomial at places: (n_places, n) array."""
    return np.stack([legendre(i, x, order[0]) * legendre(j, y, order[1]) for i, j in degrees], axis=-1)


def legendre(degree: int, at: Floats, order: int = 0) -> Floats:
    """A derivative of the Legendre polynomial that is orthonormal on [0, 1]."""
    series = np.zeros(degree + 1)
    series[degree] = np.sqrt(2.0 * degree + 1.0)
    return np.asarray(legval(2.0 * np.asarray(at) - 1.0, legder(series, order) * 2.0**order if order else series))
