"""Prior widths, constants as the search sees them, null control, and the size that a refit must find clear of zero."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_searches import bare, baseline, candidate, ground_of, one_level

from bayesplate.diagnosis.decision.constants import draw_constants
from bayesplate.diagnosis.decision.refits import excludes_zero
from bayesplate.diagnosis.evidence.hypotheses import Hypothesis
from bayesplate.diagnosis.evidence.noise_grid import noise_grid
from bayesplate.diagnosis.evidence.null_control import gain, null_control, simulate_null
from bayesplate.diagnosis.evidence.search import Found, search
from bayesplate.diagnosis.evidence.sensitivity import inclusion_with_width
from bayesplate.diagnosis.evidence.terms import Fold, Terms
from bayesplate.diagnosis.shifts.forms import Form
from bayesplate.plate.parameter import BOARD, Parameter
from bayesplate.quantities import Quantity


@pytest.fixture
def small():
    """A board of six readings with one effect whose shift is a direction times a half-normal size."""
    base = baseline(np.random.default_rng(1))
    direction = 0.02 * np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0][0]
    one = candidate(base, "a", direction)
    levels = noise_grid(base.board)
    ground = ground_of(base, bare(base, levels), Hypothesis(("a",), 0.4, one.fine, levels), candidates={"a": one})
    return ground, one


def test_a_width_of_one_changes_nothing(finnish):
    found = search(finnish.ground)
    same = inclusion_with_width(found, 1.0)
    assert same.pop("") == pytest.approx(found.none, rel=1e-9)
    assert same == pytest.approx({name: found.inclusion(name) for name in finnish.ground.candidates}, rel=1e-9)


def test_twice_the_width_halves_the_density_at_zero(small):
    """A size that the readings put at zero loses log 2 of evidence; one far out gains what the wider prior gives it."""
    ground, one = small
    for z, wanted in ((0.0, -np.log(2.0)), (2.0, -np.log(2.0) + 0.5 * 2.0**2 * (1 - 1 / 4))):
        sharp = Terms(one.fine, Fold(ground.baseline), one_level(ground.baseline, 1e-4))
        cell = int(np.argmin(np.abs(one.fine.z[:, 0] - z)))
        residual = one.fine.shift[cell]
        found = Found(ground, residual, np.zeros(2), np.array([0.5, 0.5]))
        narrow = inclusion_with_width(found, 1.0)
        wide = inclusion_with_width(found, 2.0)
        odds = np.log(wide["a"] / wide[""]) - np.log(narrow["a"] / narrow[""])
        assert sharp.log_evidence(residual[None, :]).size == 1
        at = float(one.fine.z[cell, 0])
        assert odds == pytest.approx(wanted, abs=0.25 + 0.75 * abs(at - z))


def test_poisson_ratio_is_not_named_with_twice_its_width_either(finnish):
    doubled = inclusion_with_width(search(finnish.ground), 2.0)
    assert doubled[""] > 0.1
    assert doubled["poisson_ratio"] < 0.5


def test_constants_are_those_of_a_direct_regression():
    """One cell and one level: generalised least squares with the place in the cell and the input as unknowns."""
    rng = np.random.default_rng(3)
    base = baseline(rng, n_inputs=1, resolution=1.0)
    thickness = Quantity.from_mean(3e-3, 3e-5)
    base = replace(base, board=base.board.with_priors({"thickness": thickness}))
    one = candidate(base, "a", 0.02 * rng.standard_normal(6), n_cells=1)
    ground = ground_of(base, Hypothesis(("a",), 1.0, one.fine, one_level(base)), candidates={"a": one})
    residual = 0.01 * rng.standard_normal(6)
    n = 40_000
    drawn = draw_constants(Found(ground, residual, np.zeros(1), np.ones(1)), rng, n).values

    weights = 1.0 / (one_level(base).sd[0, 0] ** 2 + base.own_variance)
    columns = np.hstack([base.slopes, one.fine.slopes[0], base.input_slopes])
    spread = np.linalg.inv(columns.T @ (weights[:, None] * columns) + np.diag([0, 0, 0, 1, 1]))
    middle = spread @ (columns.T @ (weights * (residual - one.fine.shift[0])))
    reach = np.hstack([np.eye(3), one.fine.moved_slopes[0], np.zeros((3, 1))])
    mean = base.log_rigidities + one.fine.moved[0] + reach @ middle
    sd = np.sqrt(np.diagonal(reach @ spread @ reach.T))
    logs = np.log([drawn[name] for name in ("D_x", "D_y", "D_s")])
    assert np.abs((logs.mean(axis=1) - mean) / sd).max() < 4.0 / np.sqrt(n)
    assert np.abs(logs.std(axis=1) / sd - 1.0).max() < 4.0 / np.sqrt(2 * n)

    # G_xy = 3 D_s / h^3: the thickness is drawn along with D_s, not kept
    row = reach[2] - 3.0 * thickness.log_sd * np.eye(5)[4]
    found = np.log(drawn["G_xy"])
    assert found.std() == pytest.approx(np.sqrt(row @ spread @ row), rel=4.0 / np.sqrt(2 * n))
    assert abs(np.sqrt(row @ spread @ row) / sd[2] - 1.0) > 0.05


def test_simulated_nulls_have_the_noise_of_the_fit(small):
    ground, _ = small
    base = ground.baseline
    found = search(ground, 0.02 * np.random.default_rng(4).standard_normal(6))
    terms = Terms(ground.hypotheses[0].table, ground.whole, ground.hypotheses[0].noise)
    shares = np.exp(terms.log_densities(found.residual[None, :])[:, 0])
    levels = noise_grid(base.board).sd[:, 0]
    expected = float(shares @ levels**2 / shares.sum())
    simulated = simulate_null(found, np.random.default_rng(5), 20_000)
    fourth = float(3.0 * shares @ levels**4 / shares.sum())
    error = np.sqrt((fourth - expected**2) / 20_000)
    assert np.abs(simulated.var(axis=0) - expected).max() < 4.0 * error
    assert np.abs(simulated.mean(axis=0)).max() < 4.0 * np.sqrt(expected / 20_000)


def test_the_null_control_finds_little_where_there_is_nothing_and_sees_what_there_is(small):
    ground, one = small
    rng = np.random.default_rng(6)
    calm = null_control(search(ground, 0.005 * rng.standard_normal(6)), rng, 500)
    assert calm.gain.shape == (500,)
    assert calm.flagged < 0.1
    assert calm.ratio_to_beat <= 1.0
    priors = np.array([h.prior for h in ground.hypotheses])
    there = search(ground, 1.5 * one.visible + 0.001 * rng.standard_normal(6))
    strong = float(gain(there.log_evidence[:, None], priors)[0])
    assert strong == pytest.approx(np.log(there.probability[1] / there.probability[0]))
    assert calm.percentile_of_gain(strong) > 95.0


@pytest.mark.parametrize(
    ("values", "clear"),
    [
        (np.abs(np.random.default_rng(7).standard_normal(4000)), False),
        (5.0 + np.random.default_rng(7).standard_normal(4000), True),
        (-5.0 + np.random.default_rng(7).standard_normal(4000), True),
        (1.5 + np.random.default_rng(7).standard_normal(4000), False),
    ],
)
def test_a_size_is_clear_of_zero_only_if_its_interval_is(values, clear):
    size = Parameter("size", BOARD, Quantity.from_mean(0.0, 1.0, "normal"), "1", 0.0, effect="a")
    form = Form("a", "", None, (size,))
    draws = SimpleNamespace(inputs={"a.size": values.reshape(4, -1)})
    assert excludes_zero(None, (form,), draws) is clear


def test_an_effect_of_known_size_cannot_be_zero():
    assert excludes_zero(None, (Form("a", "", None, ()),), SimpleNamespace(inputs={}))
