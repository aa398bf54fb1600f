"""What makers compute of a board as sums of logarithms, and the probability that such figures lie between limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.results.contract import JOINT

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LogFigure:
    """A product of powers of constants and density.

    Attributes
    ----------
    words : str
        What it is.
    powers : dict of float
        Name of `JOINT` -> its power.
    unit : str
        As people write it.
    per_unit : float
        That unit in SI.
    factor : float
        What the product is multiplied by.
    """

    words: str
    powers: Mapping[str, float]
    unit: str
    per_unit: float = 1.0
    factor: float = 1.0

    @property
    def direction(self) -> Floats:
        """The powers in the order of `JOINT`: (7,) array."""
        return np.array([self.powers.get(name, 0.0) for name in JOINT])

    def log(self, log_mean: Floats, triangles: Floats) -> tuple[Floats, Floats]:
        """Mean and standard deviation of its logarithm, SI: (n,) arrays from (n, 7) and (n, 28) arrays."""
        variance = covariance_along(self.direction[None], triangles)[:, 0, 0]
        return log_mean @ self.direction + np.log(self.factor), np.sqrt(np.maximum(variance, 0.0))


_ROW, _COLUMN = np.triu_indices(len(JOINT))


def triangle(log_covariance: Sequence[Sequence[float]]) -> list[float]:
    """The upper triangle of a covariance of `JOINT`, row after row: 28 numbers say all of it."""
    return [log_covariance[i][j] for i, j in zip(_ROW.tolist(), _COLUMN.tolist(), strict=True)]


def covariance_along(directions: Floats, triangles: Floats) -> Floats:
    """Covariance of some sums of logarithms.

    Parameters
    ----------
    directions : (k, 7) array
        Their coefficients.
    triangles : (n, 28) array
        Of each board's covariance.

    Returns
    -------
    (n, k, k) array
    """
    product = directions[:, None, _ROW] * directions[None, :, _COLUMN]
    both = np.where(_ROW == _COLUMN, product, product + product.swapaxes(0, 1))
    return np.einsum("np,abp->nab", triangles, both)


def _along(axis: str) -> dict[str, LogFigure]:
    grain = {"x": "along the grain", "y": "across the grain"}[axis]
    E = f"E_{axis}"
    return {
        f"wave_speed_{axis}": LogFigure(f"wave speed {grain}", {E: 0.5, "density": -0.5}, "m/s"),
        f"radiation_ratio_{axis}": LogFigure(f"radiation ratio {grain}", {E: 0.5, "density": -1.5}, "m^4/(kg s)"),
        f"impedance_{axis}": LogFigure(f"impedance {grain}", {E: 0.5, "density": 0.5}, "kg/(m^2 s)"),
    }


_THICKNESS = {"D_s": 1.0 / 3.0, "G_xy": -1.0 / 3.0}
"""D_s = G_xy h^3 / 3."""

FIGURES: Mapping[str, LogFigure] = {
    "E_x": LogFigure("stiffness along the grain", {"E_x": 1.0}, "GPa", 1e9),
    "E_y": LogFigure("stiffness across the grain", {"E_y": 1.0}, "GPa", 1e9),
    "G_xy": LogFigure("shear stiffness", {"G_xy": 1.0}, "GPa", 1e9),
    "D_x": LogFigure("rigidity along the grain", {"D_x": 1.0}, "N m"),
    "D_y": LogFigure("rigidity across the grain", {"D_y": 1.0}, "N m"),
    "D_s": LogFigure("rigidity against twist", {"D_s": 1.0}, "N m"),
    "density": LogFigure("density", {"density": 1.0}, "kg/m^3"),
    "thickness": LogFigure("thickness", _THICKNESS, "mm", 1e-3, 3.0 ** (1.0 / 3.0)),
    "anisotropy": LogFigure("stiffness along over across", {"E_x": 1.0, "E_y": -1.0}, "1"),
    **_along("x"),
    **_along("y"),
}
"""By name: what a specification may limit."""


def target_thickness(rigidity: float) -> LogFigure:
    """The thickness at which a board of the same constants has a rigidity along the grain.

    D_x grows with the third power of the thickness: h_target = h (D_target / D_x)^(1/3).

    Parameters
    ----------
    rigidity : float, N m
        D_target.
    """
    powers = {**_THICKNESS, "D_x": -1.0 / 3.0}
    words = f"thickness for D_x = {rigidity:g} N m"
    return LogFigure(words, powers, "mm", 1e-3, (3.0 * rigidity) ** (1.0 / 3.0))


def limit_told(name: str, limit: tuple[float | None, float | None]) -> str:
    """A limit as people say it: "E_x from 10 to 14 GPa"."""
    figure = FIGURES[name]
    low, high = ("" if one is None else f"{one / figure.per_unit:g}" for one in limit)
    ends = f"from {low} to {high}" if low and high else f"from {low}" if low else f"up to {high}"
    return f"{name} {ends} {figure.unit}".removesuffix(" 1")


_N_POINTS = 1024
_AT_ONCE = 8
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
MOST = len(_PRIMES) + 1
"""Numbers that may be limited together."""
_RIDGE = 1e-12
"""Share of a variance that is added to it, so that numbers that follow from one another are no obstacle."""


def box_probability(mean: Floats, covariance: Floats, low: Floats, high: Floats) -> Floats:
    """Probability of low <= x <= high in every component.

    The components are taken one after the other, each given those before it, at the points of a lattice in the unit
    cube: with three of them the result errs by less than 1e-3.

    Parameters
    ----------
    mean : (n, k) array
    covariance : (n, k, k) array
    low, high : (k,) arrays
        May be infinite.

    Returns
    -------
    (n,) array

    References
    ----------
    Genz, "Numerical computation of multivariate normal probabilities", J. Comp. Graph. Stat. 1, 1992, 141.
    """
    found = np.empty(len(mean))
    for start in range(0, len(mean), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        found[some] = _some(low - mean[some], high - mean[some], covariance[some])
    return found


def _some(low: Floats, high: Floats, covariance: Floats) -> Floats:
    """The same of a few, limits less means: (n, k) arrays."""
    from scipy.special import ndtr, ndtri

    n, k = low.shape
    scale = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 1e-24))
    low, high = low / scale, high / scale
    correlation = covariance / (scale[:, :, None] * scale[:, None, :])
    root = np.linalg.cholesky(correlation + _RIDGE * k * np.eye(k))
    points = _lattice(k - 1)
    given = np.zeros((n, k, points.shape[0]))
    product = np.ones((n, points.shape[0]))
    for i in range(k):
        before = np.einsum("nj,njp->np", root[:, i, :i], given[:, :i])
        own = root[:, i, i, None]
        below, above = ndtr((low[:, i, None] - before) / own), ndtr((high[:, i, None] - before) / own)
        width = np.maximum(above - below, 0.0)
        product *= width
        if i < k - 1:
            inside = np.clip(below + points[:, i] * width, 1e-300, 1.0 - 1e-16)
            given[:, i] = ndtri(inside)
    return np.asarray(product.mean(axis=1))


def _lattice(k: int) -> Floats:
    """Points that fill the unit cube evenly: (n_points, k) array."""
    steps = np.sqrt(np.array(_PRIMES[:k], dtype=float))
    at = np.mod(np.outer(np.arange(1, _N_POINTS + 1), steps) + 0.5 * steps, 1.0)
    return np.abs(2.0 * at - 1.0) if k else np.zeros((1, 0))
