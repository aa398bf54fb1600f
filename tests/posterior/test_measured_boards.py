"""Measured boards with the effects that their reports suggest: two free half-tops with a sensor of unknown mass.

In the open data the accelerometer's mass is not stated, and the boards are thick enough to shear. An exact thin plate
misses the nine labelled readings of both boards by some ten cents; shear and a sensor of two or three grams at the
place that the card states halve that, without a prior that knows the board. The peaks without a label, with which
other numbers are found (`docs/validation/closing-the-loop.md`), are left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesplate.commands.fit import fit
from bayesplate.commands.prepare import prepare
from bayesplate.estimates.least_squares import log_measured
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.laplace import law_tolerance, worst_cents
from bayesplate.posterior.posing import pose

pytestmark = pytest.mark.slow

MOST = {"spruce-free-2R": 0.5, "spruce-free-2L": 0.6}
"""Residual rms with both effects over that of the thin plate; physics: 0.70 to 0.30 % and 0.64 to 0.34 %."""
BOTH = ("transverse_shear", "attached_mass")
MASS = "attached_mass.mass[free]"
PLAUSIBLE = (1e-3, 5e-3)
"""kg; the two boards were measured on one rig, with one sensor."""


def labelled(card, effects):
    """A board with its labelled readings alone, and its prior."""
    prepared = prepare(card, effects)
    setups = tuple(replace(setup, peaks=()) for setup in prepared.board.setups)
    return replace(prepared.board, setups=setups), prepared.prior


def centre_of(card, effects):
    """The problem, its residual rms (cents) and the values at the centre of the posterior's region."""
    problem = pose(*labelled(card, effects), law="exact")
    theta = problem.centre[None, :]
    residuals = log_measured(problem.board) - np.concatenate(problem.posterior.log_frequencies(theta), axis=1)[0]
    return problem, float(np.sqrt(np.mean(cents(residuals) ** 2))), problem.parameters.values(theta)


@pytest.mark.parametrize("card", MOST)
def test_shear_and_the_sensor_explain_half_of_the_residuals_and_neither_does_alone(card):
    """At the most likely point; each effect alone is the negative control."""
    _, thin, _ = centre_of(card, [])
    problem, rms, values = centre_of(card, BOTH)

    assert rms <= MOST[card] * thin
    assert PLAUSIBLE[0] < values[MASS][0] < PLAUSIBLE[1]
    assert worst_cents(problem.posterior.models) <= law_tolerance(problem.board)
    for alone in BOTH:
        assert centre_of(card, [alone])[1] > MOST[card] * thin


@pytest.mark.parametrize("card", MOST)
def test_a_fit_with_both_effects_converges_and_halves_the_residuals(card):
    thin, summary = (fit(labelled(card, effects)[0], effects=effects).summary for effects in ([], BOTH))

    assert summary.converged
    assert summary.error.in_sample_rms_cents <= MOST[card] * thin.error.in_sample_rms_cents
    assert summary.error.exact_law_worst_cents <= law_tolerance(labelled(card, BOTH)[0])
    mass = summary.effects["free"]["attached_mass"]["mass"]
    assert PLAUSIBLE[0] < mass.q50 < PLAUSIBLE[1]
