"""What a board says of the shared parameters by itself, as a normal likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.quantity import Quantity
from bayesplate.campaign.likelihood import moments


@dataclass(frozen=True, eq=False)
class Pull:
    """What a board's likelihood of the shared parameters amounts to as a normal one: exp(h'z - z'Pz / 2)."""

    precision: Floats  # (n_shared, n_shared) array: P, positive semi-definite
    lean: Floats  # (n_shared,) array: h = P times where it is highest

    @classmethod
    def of_draws(cls, z: Floats, weights: Floats, priors: Sequence[Quantity] = ()) -> Pull:
        """From draws of the board's own posterior under these priors of z, by default standard normal; weights sum to
        1.

        A posterior that is wider than the prior in a direction says nothing there.
        """
        mean, covariance = moments(z, weights)
        before = np.array([moments_before(one) for one in priors] or [(0.0, 1.0)] * mean.size)
        after = np.linalg.inv(covariance)
        gained, directions = np.linalg.eigh(after - np.diag(1.0 / before[:, 1]))
        told = (directions * np.maximum(gained, 0.0)) @ directions.T
        lean = after @ mean - before[:, 0] / before[:, 1]
        return cls(told, (directions * (gained > 0.0)) @ directions.T @ lean)

    def scattered(self, width: Floats) -> Pull:
        """What it says of the middle about which boards' own numbers scatter, with these standard deviations."""
        weaker = np.linalg.inv(np.eye(width.size) + self.precision * width**2)
        return Pull(np.asarray(weaker @ self.precision), np.asarray(weaker @ self.lean))


def moments_before(prior: Quantity) -> tuple[float, float]:
    """Mean and variance of a standard coordinate before any reading, its bounds kept."""
    from scipy.stats import truncnorm

    low, high = prior.standard_bounds
    mean, variance = truncnorm.stats(low, high, moments="mv")
    return float(mean), float(variance)


def normal_posterior(pulls: Sequence[Pull]) -> tuple[Floats, Floats]:
    """Mean and covariance of z from several boards, its prior being standard normal."""
    covariance = np.linalg.inv(np.eye(pulls[0].lean.size) + np.sum([one.precision for one in pulls], axis=0))
    return covariance @ np.sum([one.lean for one in pulls], axis=0), covariance
