"""The example of ArviZ on a fit: it agrees with the package where both judge, and has all that it asks for."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "arviz_checks.py"


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    figure = tmp_path_factory.mktemp("arviz") / "pareto.png"
    numbers = runpy.run_path(str(EXAMPLE))["run"](figure)
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


def test_the_likelihood_says_more_than_either_prior(found):
    """By power scaling: one more reading's worth of likelihood moves a constant further than the priors do."""
    for name in ("E_x", "E_y", "G_xy"):
        for factor in ("constants", "noise"):
            assert 0.0 < found[factor][name] < 0.5 * found["likelihood"][name]
