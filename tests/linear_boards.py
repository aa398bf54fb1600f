"""Boards that are linear and Gaussian: readings d = A x + B z + noise, whose marginal likelihoods are closed forms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesplate.board.quantity import Quantity
from bayesplate.campaign.combined import CombinedBoards
from bayesplate.campaign.normal_likelihood import NormalLikelihood
from bayesplate.campaign.shared import SharedParameter


@dataclass(frozen=True)
class LinearBoard:
    """A board with own parameters x of standard normal prior, and shared ones z."""

    own: np.ndarray
    shared: np.ndarray
    sd: float
    readings: np.ndarray

    def log_density(self, x, z):
        """ln p(d | x, z) + ln p(x)."""
        left = self.readings - x @ self.own.T - z @ self.shared.T
        n = self.readings.size
        likelihood = -0.5 * (left**2).sum(axis=1) / self.sd**2 - n * np.log(self.sd) - 0.5 * n * np.log(2 * np.pi)
        return likelihood - 0.5 * (x**2).sum(axis=1) - 0.5 * x.shape[1] * np.log(2 * np.pi)

    @property
    def covariance(self):
        """Of the readings where z is given."""
        return self.own @ self.own.T + self.sd**2 * np.eye(self.readings.size)

    def at(self, z):
        """ln p(d | z): the closed form, (n,) array."""
        left = self.readings - z @ self.shared.T
        inverse = np.linalg.inv(self.covariance)
        _, log_det = np.linalg.slogdet(2 * np.pi * self.covariance)
        return -0.5 * np.einsum("ni,ij,nj->n", left, inverse, left) - 0.5 * log_det

    def draws(self, rng, n):
        """Draws of x and z from the board's own posterior, the prior of z being standard normal."""
        design = np.column_stack([self.own, self.shared])
        precision = design.T @ design / self.sd**2 + np.eye(design.shape[1])
        covariance = np.linalg.inv(precision)
        mean = covariance @ design.T @ self.readings / self.sd**2
        both = rng.multivariate_normal(mean, covariance, n)
        return both[:, : self.own.shape[1]], both[:, self.own.shape[1] :]


def linear_boards(rng, n_boards, n_shared, z_true, n_own=4, n_readings=9, sd=0.5, without=()):
    """Boards with the same truth; those in `without` do not have what the others share."""
    boards = []
    for board in range(n_boards):
        own, shared = rng.normal(size=(n_readings, n_own)), rng.normal(size=(n_readings, n_shared))
        z = np.zeros(n_shared) if board in without else np.asarray(z_true)
        readings = own @ rng.normal(size=n_own) + shared @ z + sd * rng.normal(size=n_readings)
        boards.append(LinearBoard(own, shared, sd, readings))
    return boards


def joint_posterior(boards):
    """Mean and covariance of z from some boards, the closed form."""
    n = boards[0].shared.shape[1]
    precision, lean = np.eye(n), np.zeros(n)
    for one in boards:
        inverse = np.linalg.inv(one.covariance)
        precision = precision + one.shared.T @ inverse @ one.shared
        lean = lean + one.shared.T @ inverse @ one.readings
    covariance = np.linalg.inv(precision)
    return covariance @ lean, covariance


def log_evidence(boards):
    """ln of the joint probability of all readings, the closed form."""
    design = np.concatenate([one.shared for one in boards])
    n = len(design)
    covariance, start = design @ design.T, 0
    for one in boards:
        stop = start + one.readings.size
        covariance[start:stop, start:stop] += one.covariance
        start = stop
    readings = np.concatenate([one.readings for one in boards])
    _, log_det = np.linalg.slogdet(covariance)
    return float(-0.5 * (readings @ np.linalg.solve(covariance, readings) + log_det + n * np.log(2 * np.pi)))


def standard_shared(n):
    """Shared numbers whose values are their standard coordinates."""
    return tuple(SharedParameter("effect", f"z{i}", Quantity(0.0, 1.0, "normal"), "1") for i in range(n))


def pull_of(board):
    """The normal likelihood of a linear board, exactly."""
    inverse = np.linalg.inv(board.covariance)
    return NormalLikelihood(board.shared.T @ inverse @ board.shared, board.shared.T @ inverse @ board.readings)


def exactly_together(boards, shared=None):
    """Linear boards with their closed forms."""
    shared = standard_shared(boards[0].shared.shape[1]) if shared is None else shared
    names = [f"board {i}" for i in range(len(boards))]
    return CombinedBoards.of(shared, names, boards, [pull_of(one) for one in boards])
