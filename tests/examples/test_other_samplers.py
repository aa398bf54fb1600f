"""The example of other samplers: three ways to one posterior, and a difference that is seen where there is one."""

from __future__ import annotations

import numpy as np
import pytest
from statistics_checks import furthest

import bayesplate

CONSTANTS = ("E_x", "E_y", "G_xy")
FURTHEST = furthest(12)
"""Monte Carlo errors of a difference: twelve are compared."""


@pytest.fixture(scope="module")
def found(load, tmp_path_factory):
    figure = tmp_path_factory.mktemp("samplers") / "samplers.png"
    rows = load("other_samplers").run(figure)
    assert figure.read_bytes().startswith(b"\x89PNG")
    return rows


def differences(one, other, key):
    """How far two samplers lie apart by constant, in errors of the difference."""
    return [
        abs(one[name][key] - other[name][key]) / np.hypot(one[name][f"{key}_error"], other[name][f"{key}_error"])
        for name in CONSTANTS
    ]


def test_another_sampler_finds_the_same_posterior(found):
    """The control: under the weakly informative prior the shear modulus, which the modes tell least, lies elsewhere."""
    for sampler in ("emcee", "dynesty"):
        for key in ("mean", "sd"):
            assert max(differences(found["fit"], found[sampler], key)) < FURTHEST, (sampler, key)
        assert max(differences(found["other_prior"], found[sampler], "mean")) > FURTHEST, sampler


def test_the_evidence_is_that_of_importance_sampling(found):
    """The probability of the readings, as a mean over draws from a normal approximation of the posterior."""
    problem = bayesplate.Problem.from_card("fiemme-spruce-clamped", prior="spruce")
    posed, rng, n = problem.posed, np.random.default_rng(3), 40_000
    wide = 1.5 * posed.covariance
    draws = rng.multivariate_normal(posed.centre, wide, n)
    away = draws - posed.centre
    log_density = -0.5 * np.einsum("ij,jk,ik->i", away, np.linalg.inv(wide), away)
    log_density -= 0.5 * np.linalg.slogdet(2.0 * np.pi * wide)[1]
    ratios = np.exp(problem.log_prob(draws) - log_density)
    log, error = np.log(ratios.mean()), ratios.std() / ratios.mean() / np.sqrt(n)

    assert error < 0.05
    assert abs(found["evidence"]["log"] - log) < FURTHEST * np.hypot(found["evidence"]["error"], error)
