"""Reduced-order models of shipped boards with effects: as exact as the readings ask, over the region."""

from __future__ import annotations

import numpy as np
import pytest
from effect_plates import posed

from bayesplate.board.attached import AttachedItem
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import full_log_frequencies
from bayesplate.posterior.laplace import law_tolerance, worst_cents

N_FRESH = 6
CANTILEVER, CLAMPED, FREE = "finnish-spruce-cantilever", "fiemme-spruce-clamped", "spruce-free-2R"
SENSOR = AttachedItem("accelerometer", ((0.23, 0.09),))
KNOWN_DRIVE = AttachedItem("exciter", ((0.19, 0.13),))
QUICK = [
    (CANTILEVER, "clamp_rotation clamp_translation"),
    (CANTILEVER, "grain_angle"),
    (CLAMPED, "support_mass"),
]
MORE = [
    (FREE, "thickness_profile"),
    (CANTILEVER, "attached_mass"),
    (CANTILEVER, "warp"),
    (CANTILEVER, "density_gradient transverse_shear"),
    (CANTILEVER, "grain_angle transverse_shear"),
    (CLAMPED, "exciter"),
    (CLAMPED, "clamp_rotation clamp_translation transverse_shear"),
    (FREE, "exciter"),
    (FREE, "fluid_loading"),
    (FREE, "thickness_profile transverse_shear"),
]
ATTACHED = {(CANTILEVER, "attached_mass"): SENSOR, (FREE, "exciter"): KNOWN_DRIVE}
"""What the cards do not have; the clamped board's own exciter may be anywhere."""


def errors(problem):
    """Exact law less full solves at fresh draws within the bounds of the priors, cents."""
    theta = np.random.default_rng(5).multivariate_normal(problem.centre, problem.covariance, N_FRESH)
    columns, bounds = problem.parameters.fitted_columns, problem.parameters.fitted_bounds
    theta[:, columns] = np.clip(theta[:, columns], bounds.lower, bounds.upper)
    values = {n: np.broadcast_to(v, N_FRESH) for n, v in problem.parameters.values(theta).items()}
    (model,) = problem.posterior.models
    solved = np.stack([full_log_frequencies(model, {n: v[i] for n, v in values.items()}) for i in range(N_FRESH)])
    return cents(model.log_frequencies(values, "exact") - solved)


@pytest.mark.parametrize(("card", "effects"), [*QUICK, *(pytest.param(*one, marks=pytest.mark.slow) for one in MORE)])
def test_reduced_order_model_is_exact(card, effects):
    problem = posed(card, effects.split(), ATTACHED.get((card, effects)), with_peaks=True)
    assert worst_cents(problem.posterior.models) <= law_tolerance(problem.board)
    # what a mode's own error adds to the variance of its reading is the mean square over the posterior
    assert np.sqrt(np.mean(errors(problem) ** 2, axis=0)).max() <= law_tolerance(problem.board)
