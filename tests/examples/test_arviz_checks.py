"""The example of ArviZ on a fit: it agrees with the package where both judge, and has all that it asks for."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture(scope="module")
def found(load, tmp_path_factory):
    figure = tmp_path_factory.mktemp("arviz") / "pareto.png"
    numbers = load("arviz_checks").run(figure)
    assert figure.read_bytes().startswith(b"\x89PNG")
    return numbers


def test_convergence_is_judged_alike(found):
    """Thinning to half an autocorrelation time loses at most some 20 % of the effective draws; R-hat passes both."""
    assert found["rhat_max"] < 1.01
    assert found["own"]["rhat_max"] < 1.01
    assert 0.7 < found["ess_min"] / found["own"]["ess_min"] < 1.2


def test_every_reading_has_a_pareto_k_and_some_are_beyond_weights(found):
    """Three of six readings have more than half of themselves in their own prediction."""
    labels = ("(0,0)", "(0,1)", "(1,0)", "(1,1)", "(0,2)", "(1,2)")
    assert list(found["pareto_k"]) == [f"clamped {label}" for label in labels]
    assert any(k > 0.7 for k in found["pareto_k"].values())
    assert any(k < 0.6 for k in found["pareto_k"].values())
    # Three constants and a noise, each at most known by the data alone
    assert 2.0 < found["effective_parameters"] < 6.0


def test_weights_agree_with_refits_where_pareto_k_is_low(found):
    """Both densities are those of one reading given the others, each known to its Monte Carlo error.

    How many readings are below 0.5 hangs on the draws: one to three of them at ten seeds.
    """
    serve = [label for label, k in found["pareto_k"].items() if k < 0.5]

    assert serve
    for label in serve:
        (weighed, error), (refitted, its_error) = found["weighed"][label], found["refitted"][label]
        assert weighed == pytest.approx(refitted, abs=4.0 * np.hypot(error, its_error))
        assert np.hypot(error, its_error) < 0.05


def test_a_reading_without_which_a_constant_is_open_has_the_highest_pareto_k(found):
    """Without it the others leave D_s open by a factor; what the fit leans on most is what weights cannot take away."""
    (open_without,) = [label for label, value in found["refitted"].items() if value is None]

    assert open_without == max(found["pareto_k"], key=found["pareto_k"].get) == "clamped (0,2)"
    assert found["left_out_cents"][open_without] is not None  # the most likely constants are there, if badly known
    leant_on = sorted(found["leverage"], key=found["leverage"].get)[-2:]
    assert {label for label, k in found["pareto_k"].items() if k > 0.7} == set(leant_on)


def test_the_likelihood_says_more_than_either_prior(found):
    """By power scaling: one more reading's worth of likelihood moves a constant further than the priors do."""
    for name in ("E_x", "E_y", "G_xy"):
        for factor in ("constants", "noise"):
            assert 0.0 < found[factor][name] < 0.5 * found["likelihood"][name]
