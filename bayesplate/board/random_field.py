"""What readings at places say of a thickness or a width: a smooth random field, conditioned on readings with errors.

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
"""Over which the field varies, as a fraction of each side."""
_N_POINTS = 24
_SPANNED = 1e-9
_STEPS_AMPLITUDE, _STEPS_SCATTER = np.geomspace(1e-4, 0.2, 27), np.geomspace(1e-5, 0.1, 19)
_PASSES = 2


@dataclass(frozen=True)
class UsualSizes:
    """Scales of the half-Cauchy priors, as fractions of the mean: half of all boards lie below, half above."""

    field: float  # standard deviation over the board
    scatter: float  # standard deviation of a reading besides its rounding


THICKNESS = UsualSizes(field=0.015, scatter=0.005)
"""0.015 is the root mean square over the board of a taper of 5 % from end to end, what hand-planed boards have."""
WIDTH = UsualSizes(field=0.01, scatter=0.001)


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
    """A field as its readings leave it, normal in its mean and its n coefficients."""

    degrees: Degrees  # of the polynomials besides the constant
    mean: float  # of the field's mean over the board, in the unit of the readings, and so its sd
    sd: float
    shape: Floats  # (n,) expected coefficients, as fractions of the mean
    covariance: Floats  # (n, n), as fractions of the mean
    with_mean: Floats  # (n,) gain of the coefficients where the mean is one of its sd higher


@dataclass(frozen=True)
class PlacedReadings:
    """Readings at places of a board."""

    values: tuple[float, ...]
    x: tuple[float, ...]  # fractions of the sides, and so y
    y: tuple[float, ...]
    resolution: float  # in the unit of the readings
    place_sd: tuple[float, float]  # of the places, fractions of the sides
    usual: UsualSizes
    is_along_x_only: bool = False


def thickness_readings(thickness: Quantity, length_x: Quantity, length_y: Quantity) -> PlacedReadings | None:
    """The thickness as read at places; None unless these are two at least."""
    if not (thickness.at_x and thickness.at_y):
        return None
    x, y = _fractions(thickness.at_x, length_x), _fractions(thickness.at_y, length_y)
    if len(set(zip(x, y, strict=True))) < 2:
        return None
    place_sd = (thickness.place_sd / length_x.mean, thickness.place_sd / length_y.mean)
    return PlacedReadings(thickness.readings, x, y, thickness.resolution, place_sd, THICKNESS)


def width_readings(width: Quantity, length_x: Quantity) -> PlacedReadings | None:
    """The width as read at stations along the board; None unless these are two at least."""
    x = _fractions(width.at_x, length_x)
    if len(set(x)) < 2:
        return None
    place_sd = (width.place_sd / length_x.mean, 0.0)
    return PlacedReadings(width.readings, x, (0.5,) * len(x), width.resolution, place_sd, WIDTH, True)


def _fractions(places: tuple[float, ...], side: Quantity) -> tuple[float, ...]:
    return tuple(min(max(at / side.mean, 0.0), 1.0) for at in places)


@lru_cache(maxsize=64)
def conditioned(read: PlacedReadings) -> ConditionedField:
    """The field given its readings, averaged over amplitudes and scatters by their probabilities.

    Where the readings do not support a field the small amplitudes are the probable ones, and the field shrinks to
    its mean.
    """
    scale = statistics.mean(read.values)
    relative = np.array(read.values) / scale
    degrees = _degrees(read.is_along_x_only)
    x, y = np.array(read.x), np.array(read.y)
    at_places = _design(degrees, x, y)
    own = np.full(relative.size, (read.resolution / scale) ** 2 / 12.0)
    slopes = [np.zeros(relative.size)] * 2
    for _ in range(_PASSES if any(read.place_sd) else 1):
        moved = sum((sd * slope) ** 2 for sd, slope in zip(read.place_sd, slopes, strict=True))
        mean, covariance = _averaged(relative, at_places, own + moved, degrees, read.usual)
        slopes = [_design(degrees, x, y, order)[:, 1:] @ mean[1:] for order in ((1, 0), (0, 1))]
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


def sd_after(read: PlacedReadings, x: Floats, y: Floats) -> float:
    """Expected standard deviation of the field's mean after readings at further places (n,), fractions of the sides.

    What will be read there scatters as the readings at hand do, so that amplitudes and scatters keep the probabilities
    that they have now.
    """
    scale = statistics.mean(read.values)
    known = conditioned(read)
    degrees = _degrees(read.is_along_x_only)
    at = np.concatenate([read.x, x]), np.concatenate([read.y, y])
    slope = known.shape * known.mean / scale
    own = np.full(len(at[0]), (read.resolution / scale) ** 2 / 12.0)
    for sd, order in zip(read.place_sd, ((1, 0), (0, 1)), strict=True):
        own += (sd * (_design(degrees, *at, order)[:, 1:] @ slope)) ** 2
    design, relative, n = _design(degrees, *at) @ _smooth(degrees), np.array(read.values) / scale, len(read.values)
    log_weights = _regressed(relative, design[:n], own[:n], read.usual)[0]
    weights = np.exp(log_weights - log_weights.max())
    after = _regressed(np.ones(len(design)), design, own, read.usual)[2][..., 0, 0]
    return float(scale * np.sqrt(np.average(after, weights=weights)))


def _averaged(
    readings: Floats, at_places: Floats, own: Floats, degrees: Degrees, usual: UsualSizes
) -> tuple[Floats, Floats]:
    """Mean and covariance of all coefficients, the constant first, over amplitudes and scatters."""
    spanned = _smooth(degrees)
    log_weights, means, covariances = _regressed(readings, at_places @ spanned, own, usual)
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    mean = np.tensordot(weights, means, axes=2)
    spread = covariances + (means - mean)[..., :, None] * (means - mean)[..., None, :]
    return spanned @ mean, spanned @ np.tensordot(weights, spread, axes=2) @ spanned.T


def _regressed(readings: Floats, design: Floats, own: Floats, usual: UsualSizes) -> tuple[Floats, Floats, Floats]:
    """Regression on the constant and on standard smooth functions, for each amplitude and scatter, the constant first.

    Log probability (n_a, n_s), mean (n_a, n_s, r) and covariance (n_a, n_s, r, r).
    """
    amplitude, scatter = _STEPS_AMPLITUDE, _STEPS_SCATTER
    variances = own + scatter[:, None] ** 2  # (n_s, n)
    weighted = design / variances[..., None]
    precision = np.zeros((amplitude.size, scatter.size, *(design.shape[1],) * 2))
    precision += np.einsum("sni,nj->sij", weighted, design)
    inner = np.arange(1, design.shape[1])
    precision[:, :, inner, inner] += amplitude[:, None, None] ** -2.0
    covariance = np.linalg.inv(precision)
    about = readings - 1.0
    told = np.einsum("sni,n->si", weighted, about)
    mean = np.einsum("asij,sj->asi", covariance, told)
    misfit = np.sum(about**2 / variances, axis=1) - np.einsum("asi,si->as", mean, told)
    log_size = np.log(variances).sum(axis=1) + np.linalg.slogdet(precision)[1]
    log_size += 2.0 * inner.size * np.log(amplitude)[:, None]
    priors = (np.log(steps / (1.0 + (steps / scale) ** 2)) for steps, scale in
              ((amplitude[:, None], usual.field), (scatter, usual.scatter)))  # fmt: skip
    mean[..., 0] += 1.0
    return np.asarray(-0.5 * (misfit + log_size) + sum(priors)), mean, np.asarray(covariance)


@lru_cache(maxsize=8)
def _smooth(degrees: Degrees) -> Floats:
    """Coefficients of the constant and of independent functions that together vary as smooth ones do: (n, r) array.

    Their covariance is that of exp(-d^2 / (2 LENGTH_SCALE^2)) with the mean over the board taken out; its trace is one,
    so that the amplitude is the standard deviation over the board.
    """
    points, weights = leggauss(_N_POINTS)
    at, weights = 0.5 * (points + 1.0), 0.5 * weights
    values = weights * np.stack([legendre(k, at) for k in range(DEGREE + 1)])
    one = values @ np.exp(-0.5 * ((at[:, None] - at) / LENGTH_SCALE) ** 2) @ values.T
    i, j = np.array(degrees).T
    across = one[j][:, j] if j.any() else 1.0
    covariance = (one[i][:, i] * across)[1:, 1:]
    variances, directions = np.linalg.eigh(covariance / np.trace(covariance))
    kept = variances > _SPANNED
    spanned = np.zeros((len(degrees), 1 + int(kept.sum())))
    spanned[0, 0] = 1.0
    spanned[1:, 1:] = directions[:, kept] * np.sqrt(variances[kept])
    return spanned


def _degrees(is_along_x_only: bool) -> Degrees:
    """Degrees of all polynomials, the constant first."""
    if is_along_x_only:
        return tuple((i, 0) for i in range(DEGREE + 1))
    return tuple((total - j, j) for total in range(DEGREE + 1) for j in range(total + 1))


def _design(degrees: Degrees, x: Floats, y: Floats, order: tuple[int, int] = (0, 0)) -> Floats:
    """Derivatives of every polynomial at places: (n_places, n) array."""
    return np.stack([legendre(i, x, order[0]) * legendre(j, y, order[1]) for i, j in degrees], axis=-1)


def legendre(degree: int, at: Floats, order: int = 0) -> Floats:
    """A derivative of the Legendre polynomial that is orthonormal on [0, 1]."""
    series = np.zeros(degree + 1)
    series[degree] = np.sqrt(2.0 * degree + 1.0)
    return np.asarray(legval(2.0 * np.asarray(at) - 1.0, legder(series, order) * 2.0**order if order else series))
