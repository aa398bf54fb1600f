"""Makers' figures as powers of a board's constants, and the probability that they lie between limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.results.contract import JOINT_NAMES


@dataclass(frozen=True)
class LogFigure:
    """A factor times powers of constants and density, by their names in `JOINT_NAMES`."""

    words: str
    powers: Mapping[str, float]
    unit: str  # for people
    per_unit: float = 1.0  # SI value of the unit
    factor: float = 1.0

    @property
    def direction(self) -> Floats:
        """The powers in the order of `JOINT_NAMES`: (7,) array."""
        return np.array([self.powers.get(name, 0.0) for name in JOINT_NAMES])

    def log(self, log_mean: Floats, log_covariance: Floats) -> tuple[Floats, Floats]:
        """Mean and standard deviation of the figure's logarithm, SI: (n,) arrays from (n, 7) and (n, 7, 7) arrays."""
        variance = covariance_along(self.direction[None], log_covariance)[:, 0, 0]
        return log_mean @ self.direction + np.log(self.factor), np.sqrt(np.maximum(variance, 0.0))


def covariance_along(directions: Floats, covariance: Floats) -> Floats:
    """Covariance of k linear combinations, (k, 7) coefficients, for each board: (n, k, k) from (n, 7, 7)."""
    return directions @ covariance @ directions.T


def _figures_along(axis: str) -> dict[str, LogFigure]:
    grain = {"x": "along the grain", "y": "across the grain"}[axis]
    E = f"E_{axis}"
    return {
        f"wave_speed_{axis}": LogFigure(f"wave speed {grain}", {E: 0.5, "density": -0.5}, "m/s"),
        f"radiation_ratio_{axis}": LogFigure(f"radiation ratio {grain}", {E: 0.5, "density": -1.5}, "m^4/(kg s)"),
        f"impedance_{axis}": LogFigure(f"impedance {grain}", {E: 0.5, "density": 0.5}, "kg/(m^2 s)"),
    }


_THICKNESS_POWERS = {"D_s": 1.0 / 3.0, "G_xy": -1.0 / 3.0}
"""D_s = G_xy h^3 / 3."""

FIGURES: Mapping[str, LogFigure] = {
    "E_x": LogFigure("stiffness along the grain", {"E_x": 1.0}, "GPa", 1e9),
    "E_y": LogFigure("stiffness across the grain", {"E_y": 1.0}, "GPa", 1e9),
    "G_xy": LogFigure("shear stiffness", {"G_xy": 1.0}, "GPa", 1e9),
    "D_x": LogFigure("rigidity along the grain", {"D_x": 1.0}, "N m"),
    "D_y": LogFigure("rigidity across the grain", {"D_y": 1.0}, "N m"),
    "D_s": LogFigure("rigidity against twist", {"D_s": 1.0}, "N m"),
    "density": LogFigure("density", {"density": 1.0}, "kg/m^3"),
    "thickness": LogFigure("thickness", _THICKNESS_POWERS, "mm", 1e-3, 3.0 ** (1.0 / 3.0)),
    "anisotropy": LogFigure("stiffness along over across", {"E_x": 1.0, "E_y": -1.0}, "1"),
    **_figures_along("x"),
    **_figures_along("y"),
}
"""Figures that a specification may limit, by name."""


def target_thickness(rigidity: float) -> LogFigure:
    """The thickness at which a board of the same moduli has D_x = `rigidity` (N m): h (rigidity / D_x)^(1/3)."""
    powers = {**_THICKNESS_POWERS, "D_x": -1.0 / 3.0}
    words = f"thickness for D_x = {rigidity:g} N m"
    return LogFigure(words, powers, "mm", 1e-3, (3.0 * rigidity) ** (1.0 / 3.0))


def limit_text(name: str, limit: tuple[float | None, float | None]) -> str:
    """A limit in words: "E_x from 10 to 14 GPa"."""
    figure = FIGURES[name]
    low, high = ("" if bound is None else f"{bound / figure.per_unit:g}" for bound in limit)
    ends = f"from {low} to {high}" if low and high else f"from {low}" if low else f"up to {high}"
    return f"{name} {ends} {figure.unit}".removesuffix(" 1")


_LOG2_POINTS = 10
_CHUNK_SIZE = 256
"""Boards integrated at once: a bound on the memory."""
_RIDGE = 1e-12
"""Ridge added to a correlation matrix, which is singular where one figure follows from others."""


def box_probability(mean: Floats, covariance: Floats, low: Floats, high: Floats) -> Floats:
    """Probability (n,) that low <= x <= high, (k,) limits, for normals of mean (n, k) and covariance (n, k, k).

    Each component is drawn conditionally on those before it, at Sobol points of the unit cube; accurate to 1e-3 with
    three components: Genz, "Numerical computation of multivariate normal probabilities", J. Comp. Graph. Stat. 1, 1992,
    141.
    """
    starts = range(0, len(mean), _CHUNK_SIZE)
    chunks = (slice(start, start + _CHUNK_SIZE) for start in starts)
    return np.concatenate(
        [np.empty(0), *(_chunk_probability(low - mean[c], high - mean[c], covariance[c]) for c in chunks)]
    )


def _chunk_probability(low: Floats, high: Floats, covariance: Floats) -> Floats:
    """`box_probability` of a few boards, from limits less means: (n, k) arrays."""
    from scipy.special import ndtr, ndtri
    from scipy.stats.qmc import Sobol

    n, k = low.shape
    scale = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 1e-24))
    low, high = low / scale, high / scale
    correlation = covariance / (scale[:, :, None] * scale[:, None, :])
    np.einsum("nii->ni", correlation)[:] = 1.0  # also where rounding leaves an exact figure no variance
    root = np.linalg.cholesky(correlation + _RIDGE * k * np.eye(k))
    points = Sobol(k, scramble=False).random_base2(_LOG2_POINTS) + 0.5**_LOG2_POINTS / 2.0
    normals = np.zeros((n, k, len(points)))
    product = np.ones((n, len(points)))
    for i in range(k):
        mean = np.einsum("nj,njp->np", root[:, i, :i], normals[:, :i])
        sd = root[:, i, i, None]
        below, above = ndtr((low[:, i, None] - mean) / sd), ndtr((high[:, i, None] - mean) / sd)
        width = np.maximum(above - below, 0.0)
        product *= width
        normals[:, i] = ndtri(np.clip(below + points[:, i] * width, 1e-300, 1.0 - 1e-16))
    return np.asarray(product.mean(axis=1))
