"""The log posterior of a board under the linear law from one JSON file, in NumPy: what samplers of others are given.

Two sets of columns. `theta` is the package's: ln D_x, ln D_y, ln D_s (N m), ln of the relative noise. `x` is ln E_x,
ln E_y, ln G_xy (Pa), ln of the relative noise: there the prior is a product of normal densities. Volumes are
the same.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import log_ndtr, ndtri


@dataclass(frozen=True, eq=False)
class Density:
    """Priors, coefficients of the law and rounded readings of one board.

    Attributes
    ----------
    names : tuple of str
        Of the columns of theta.
    per_rigidity : (n_modes, 3) array
        omega^2 (s^-2) = per_rigidity @ (D_x, D_y, D_s).
    log_low, log_high : (n_modes,) array
        ln of the ends of the rounding intervals, Hz.
    thickness, poisson_xy : float
    prior_mean, prior_sd : (4,) array
        Of x.
    centre, covariance : (4,) and (4, 4) array
        Normal approximation of the posterior of theta, for starts.
    """

    names: tuple[str, ...]
    per_rigidity: np.ndarray
    log_low: np.ndarray
    log_high: np.ndarray
    thickness: float
    poisson_xy: float
    prior_mean: np.ndarray
    prior_sd: np.ndarray
    centre: np.ndarray
    covariance: np.ndarray

    @classmethod
    def read(cls, path: Path) -> Density:
        """The density of a file that `statement.stated` describes."""
        return cls.of(json.loads(path.read_text(encoding="utf-8")))

    @classmethod
    def of(cls, stated: dict) -> Density:
        """The same from the content of the file."""
        hertz, half = np.array(stated["readings_hz"]), 0.5 * np.array(stated["resolution_hz"])
        priors = [stated["priors"][name] for name in ("E_x", "E_y", "G_xy", "noise")]
        return cls(
            names=tuple(stated["parameters"]),
            per_rigidity=np.array(stated["squared_per_rigidity"]),
            log_low=np.log(hertz - half),
            log_high=np.log(hertz + half),
            thickness=stated["thickness_m"],
            poisson_xy=stated["poisson_xy"],
            prior_mean=np.array([prior["log_median"] for prior in priors]),
            prior_sd=np.array([prior["log_sd"] for prior in priors]),
            centre=np.array(stated["centre"]),
            covariance=np.array(stated["covariance"]),
        )

    @property
    def log_factors(self) -> np.ndarray:
        """ln of the rigidities of a plate whose moduli are 1 Pa and whose Poisson ratio is 0: (3,) array."""
        return np.log(self.thickness**3 / np.array([12.0, 12.0, 3.0]))

    def theta(self, x: np.ndarray) -> np.ndarray:
        """The package's columns, (n_draws, 4); not a number where no material has these moduli."""
        remainder = 1.0 - self.poisson_xy**2 * np.exp(x[:, 1] - x[:, 0])
        result = np.array(x, dtype=float)
        result[:, :3] += self.log_factors
        result[:, :2] -= np.log(np.where(remainder > 0.0, remainder, np.nan))[:, None]
        return result

    def x(self, theta: np.ndarray) -> np.ndarray:
        """The columns in which the prior is normal, (n_draws, 4); the inverse of `theta`."""
        remainder = 1.0 - self.poisson_xy**2 * np.exp(theta[:, 1] - theta[:, 0])
        result = np.array(theta, dtype=float)
        result[:, :3] -= self.log_factors
        result[:, :2] += np.log(np.where(remainder > 0.0, remainder, np.nan))[:, None]
        return result

    def log_frequency(self, theta: np.ndarray) -> np.ndarray:
        """ln f (Hz): (n_draws, n_modes) array."""
        return 0.5 * np.log(np.exp(theta[:, :3]) @ self.per_rigidity.T) - np.log(2.0 * np.pi)

    def log_likelihood(self, theta: np.ndarray) -> np.ndarray:
        """ln of the probability of the readings, each known as the interval that is rounded to it: (n_draws,) array."""
        return self.log_interval(self.log_frequency(theta), np.exp(theta[:, 3])[:, None]).sum(axis=1)

    def log_interval(self, log_frequency: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """ln of the probability of each reading's interval about ln f: array of the shape of `log_frequency`."""
        low, high = (self.log_low - log_frequency) / noise, (self.log_high - log_frequency) / noise
        is_above = low + high > 0.0
        low, high = np.where(is_above, -high, low), np.where(is_above, -low, high)
        below = log_ndtr(high)
        with np.errstate(divide="ignore", invalid="ignore"):  # both ends so far out that they are one number
            return below + np.log(-np.expm1(log_ndtr(low) - below))

    def log_prior(self, x: np.ndarray) -> np.ndarray:
        """ln of the prior density, but for a constant where no material is: (n_draws,) array."""
        z = (x - self.prior_mean) / self.prior_sd
        return np.sum(-0.5 * z**2 - np.log(self.prior_sd) - 0.5 * np.log(2.0 * np.pi), axis=1)

    def log_posterior(self, theta: np.ndarray) -> np.ndarray:
        """ln of prior times likelihood at columns of the package: (n_draws,) array; -inf where no material is."""
        total = self.log_prior(self.x(theta)) + self.log_likelihood(theta)
        return np.where(np.isnan(total), -np.inf, total)

    def log_likelihood_of_x(self, x: np.ndarray) -> np.ndarray:
        """ln of the likelihood at columns in which the prior is normal: (n_draws,) array; -inf where no material is."""
        found = self.log_likelihood(self.theta(x))
        return np.where(np.isnan(found), -np.inf, found)

    def from_cube(self, u: np.ndarray) -> np.ndarray:
        """x of numbers that are uniform between 0 and 1, by the quantiles of the prior: array of the same shape."""
        return self.prior_mean + self.prior_sd * ndtri(u)

    def starts(self, n_walkers: int, rng: np.random.Generator) -> np.ndarray:
        """Theta of walkers about the estimate: (n_walkers, 4) array."""
        return rng.multivariate_normal(self.centre, self.covariance, n_walkers)
