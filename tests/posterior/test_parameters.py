"""The columns that are sampled: their names, their meaning, there and back."""

from __future__ import annotations

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, board_of, setup_of
from scipy import stats

from bayesplate.board.quantity import Quantity
from bayesplate.posterior.parameters import Parameters

CLAMPED = {"x0": Quantity.from_mean(0.030, 0.0005)}


@pytest.fixture
def parameters():
    """Two setups, three uncertain inputs: one log-normal, one normal, one of a setup."""
    setups = [
        setup_of(ritz.CANTILEVER, dict.fromkeys(CANTILEVER_LABELS, 100.0), name="cantilever", clamped=CLAMPED),
        setup_of(ritz.ALL_FREE, {(1, 1): 100.0}, name="free"),
    ]
    uncertain = {"thickness": Quantity.from_mean(3e-3, 3e-5), "poisson_xy": Quantity.from_mean(0.4, 0.1, "normal")}
    return Parameters(board_of(ritz.FINNISH, setups, **uncertain))


def test_names_are_rigidities_then_noises_then_inputs(parameters):
    assert parameters.names == (
        "log_D_x",
        "log_D_y",
        "log_D_s",
        "log_noise[cantilever]",
        "log_noise[free]",
        "z[thickness]",
        "z[poisson_xy]",
        "z[clamped_x0[cantilever]]",
    )
    assert parameters.n_dim == len(parameters.names)


def test_values_lead_back_to_theta(parameters):
    theta = np.random.default_rng(1).normal(size=(5, parameters.n_dim))
    values = parameters.values(theta)
    noise = np.exp(parameters.log_noise(theta))
    for i, row in enumerate(theta):
        one = {name: np.broadcast_to(value, 5)[i] for name, value in values.items()}
        assert parameters.theta(one, noise[i]) == pytest.approx(row, rel=1e-12, abs=1e-12)


def test_every_column_means_what_its_name_says(parameters):
    theta = np.zeros((1, parameters.n_dim))
    theta[0, :3] = np.log([30.0, 1.6, 6.0])
    theta[0, 3:5] = np.log([0.003, 0.008])
    theta[0, 5:] = [1.0, -2.0, 0.0]
    values = parameters.values(theta)
    assert [values[name][0] for name in ("D_x", "D_y", "D_s")] == pytest.approx([30.0, 1.6, 6.0])
    assert np.exp(parameters.log_noise(theta))[0] == pytest.approx([0.003, 0.008])
    thickness = parameters.board.inputs["thickness"]
    assert values["thickness"][0] == pytest.approx(thickness.median * np.exp(thickness.log_sd))
    assert values["poisson_xy"][0] == pytest.approx(0.4 - 2 * 0.1)
    assert values["clamped_x0[cantilever]"][0] == pytest.approx(CLAMPED["x0"].median)
    assert values["density"] == ritz.FINNISH.rho  # exact inputs have no column


def test_the_inputs_are_standard_normal(parameters):
    theta = np.random.default_rng(2).normal(size=(4, parameters.n_dim))
    expected = stats.norm.logpdf(theta[:, 5:]).sum(axis=1)
    assert parameters.log_prior_inputs(theta) == pytest.approx(expected, rel=1e-13)
