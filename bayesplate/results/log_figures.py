"""What makers compute of a board as sums of logarithms: stiffnesses, wave speeds, radiation ratio, thickness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.results.joint import JOINT

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
