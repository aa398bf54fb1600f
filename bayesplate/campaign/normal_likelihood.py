"""A board's own likelihood of the shared parameters, as a normal one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.quantity import Quantity
from bayesplate.campaign.likelihood import moments


@dataclass(frozen=True, eq=False)
class NormalLikelihood:
    """A normal likelihood of the shared parameters: exp(h'z - z'Pz / 2)."""

    precision: Floats  # (n_shared, n_shared) array: P, positive semi-definite
    precision_times_mode: Floats  # (n_shared,) array: h = P times the mode

    @classmethod
    def of_draws(cls, z: Floats, weights: Floats, priors: Sequence[Quantity] = ()) -> NormalLikelihood:
        """The likelihood from draws of the board's own posterior under these priors of z, by default standard normal.

        The weights sum to 1. A direction in which the posterior is wider than the prior has no precision.
        """
        mean, covariance = moments(z, weights)
        prior_stats = np.array([prior_moments(prior) for prior in priors] or [(0.0, 1.0)] * mean.size)
        posterior_precision = np.linalg.inv(covariance)
        eigenvalues, directions = np.linalg.eigh(posterior_precision - np.diag(1.0 / prior_stats[:, 1]))
        precision = (directions * np.maximum(eigenvalues, 0.0)) @ directions.T
        precision_times_mode = posterior_precision @ mean - prior_stats[:, 0] / prior_stats[:, 1]
        return cls(precision, (directions * (eigenvalues > 0.0)) @ directions.T @ precision_times_mode)

    def scattered(self, width: Floats) -> NormalLikelihood:
        """The likelihood of the middle about which the boards' own numbers scatter, with these standard deviations."""
        shrinkage = np.linalg.inv(np.eye(width.size) + self.precision * width**2)
        return NormalLikelihood(
            np.asarray(shrinkage @ self.precision), np.asarray(shrinkage @ self.precision_times_mode)
        )


def prior_moments(prior: Quantity) -> tuple[float, float]:
    """Prior mean and variance of a standard coordinate, within its bounds."""
    from scipy.stats import truncnorm

    low, high = prior.standard_bounds
    mean, variance = truncnorm.stats(low, high, moments="mv")
    return float(mean), float(variance)


def normal_posterior(likelihoods: Sequence[NormalLikelihood]) -> tuple[Floats, Floats]:
    """Mean and covariance of z from several boards, its prior being standard normal."""
    covariance = np.linalg.inv(
        np.eye(likelihoods[0].precision_times_mode.size)
        + np.sum([likelihood.precision for likelihood in likelihoods], axis=0)
    )
    return covariance @ np.sum([likelihood.precision_times_mode for likelihood in likelihoods], axis=0), covariance
