"""The numbers that decide what a fit warns of, each from just below and just above; no sampler runs here."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import bayesplate.frequencies.spectrum
import bayesplate.posterior.assessment
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.prior import load_prior
from bayesplate.commands.prepare import prepare
from bayesplate.estimates.identifiability import Identifiability, remarks
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.spectrum import sign_conflicts, spectrum
from bayesplate.frequencies.system import system_of
from bayesplate.labels import Label
from bayesplate.posterior.assessment import assess as assessed
from bayesplate.posterior.convergence import assess
from bayesplate.posterior.draws import named_draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.posing import pose
from bayesplate.posterior.reweighting import linearisation
from bayesplate.posterior.sampling import Chains
from bayesplate.posterior.statistics import walker_major
from bayesplate.posterior.target import linear_suffices
from bayesplate.results.budget import input_remarks, prior_remarks
from bayesplate.results.summarise import summarise

LINEAR = "the linear law is off by more than a quarter of the noise"
EXACT = "the exact law misses full solves"
VEERING = "fits its label only to"
NAMES = (*MODULI, *RIGIDITIES)


@pytest.fixture(scope="module")
def inference():
    """Draws from the normal approximation of the clamped board's posterior, shear declared, under the linear law."""
    prepared = prepare("fiemme-spruce-clamped", ["transverse_shear"])
    problem = pose(prepared.board, prepared.prior, law="linear")
    rng = np.random.default_rng(1)
    theta = rng.multivariate_normal(problem.centre, problem.covariance, (4, 60, 10))
    log_prob = problem.posterior(theta.reshape(-1, theta.shape[-1])).reshape(theta.shape[:-1])
    return Inference(problem, Chains(theta, log_prob, 0), assess(theta), walker_major(theta), walker_major(log_prob))


def summary_of(inference, errors=0.0):
    """The summary where the linear law errs by this share of the noise, in every mode and draw."""
    draws = named_draws(inference, 1)
    off = np.full_like(linearisation(inference, draws), errors * cents(np.median(draws.noise)))
    return summarise(inference, draws, assessed(inference, draws, off), 1, {}, "")


def told(inference, sentence, errors=0.0):
    return any(sentence in warning for warning in summary_of(inference, errors).warnings)


def test_units_of_effects_reach_the_summary(inference):
    effects = summary_of(inference).effects["board"]["transverse_shear"]

    assert {name: entry.unit for name, entry in effects.items()} == {"G_xz": "Pa", "G_yz": "Pa"}


@pytest.mark.parametrize(("share", "is_told"), [(0.249, False), (0.251, True)])
def test_the_linear_law_is_warned_of_from_a_quarter_of_the_noise_on(inference, share, is_told):
    assert told(inference, LINEAR, share) is is_told


@pytest.mark.parametrize(("share", "suffices"), [(0.249, True), (0.251, False)])
def test_the_linear_law_serves_below_a_quarter_of_the_noise(inference, share, suffices):
    """For every mode, rms over the draws."""
    errors = np.zeros((10, 6))
    errors[:, 4] = share * cents(0.01) * np.array([1, -1] * 5)

    assert linear_suffices([6], errors, [0.01]) is suffices


@pytest.mark.parametrize(("worst", "is_told"), [(0.499, False), (0.501, True)])
def test_the_exact_law_is_warned_of_from_half_a_cent_on(inference, worst, is_told, monkeypatch):
    monkeypatch.setattr(bayesplate.posterior.assessment, "worst_cents", lambda _: worst)

    assert told(inference, EXACT) is is_told


@pytest.mark.parametrize(("correlation", "is_told"), [(0.751, False), (0.749, True)])
def test_a_label_is_doubted_below_a_correlation_of_three_quarters(inference, correlation, is_told):
    problem = inference.problem
    (model,) = problem.posterior.models
    places = (replace(model.places[0], correlation=correlation), *model.places[1:])
    posterior = replace(problem.posterior, models=(replace(model, places=places),))

    assert told(replace(inference, problem=replace(problem, posterior=posterior)), VEERING) is is_told


@pytest.mark.parametrize(("correlation", "is_named"), [(0.751, True), (0.749, False)])
def test_a_mode_is_named_from_a_correlation_of_three_quarters_on(inference, correlation, is_named, monkeypatch):
    problem = inference.problem
    monkeypatch.setattr(
        bayesplate.frequencies.spectrum, "name_modes", lambda modes: [((0, 0), correlation)] * len(modes.eigenvalues)
    )
    system = system_of(problem.board, problem.board.setups[0])
    values = {name: np.ravel(value)[0] for name, value in problem.parameters.values(problem.centre[None, :]).items()}
    _, (lowest,) = spectrum(system, values, 1, problem.posterior.models[0].plate)

    assert lowest.name == ("(0,0)" if is_named else "cannot tell")


@pytest.mark.parametrize(("effective", "is_given"), [(199.0, False), (200.0, True)])
def test_means_of_the_other_law_need_two_hundred_effective_draws(inference, effective, is_given, monkeypatch):
    monkeypatch.setattr(
        bayesplate.posterior.assessment, "means_under", lambda *_: (dict.fromkeys(NAMES, 1e10), effective)
    )

    means = summary_of(inference).exact_means

    assert (means.E_x, means.effective_draws) == (1e10 if is_given else None, effective)


@pytest.mark.parametrize(("share", "is_told"), [(0.49, False), (0.51, True)])
def test_an_input_is_named_that_makes_half_of_the_variance(share, is_told):
    """ln E = sqrt(share) a + sqrt(1 - share) b, with a the logarithm of the thickness and b at right angles to it."""
    a, b = np.linalg.qr(np.column_stack([np.ones(500), np.random.default_rng(1).standard_normal((500, 2))]))[0].T[1:]
    draws = SimpleNamespace(
        moduli={"E_x": np.exp(np.sqrt(share) * a + np.sqrt(1.0 - share) * b)}, inputs={"thickness": np.exp(a)}
    )
    said = input_remarks(draws, prepare("fiemme-spruce-clamped").board)

    assert bool(said) is is_told
    assert all("51 % of the uncertainty (variance) of E_x comes from the thickness" in one for one in said)


@pytest.mark.parametrize(("width", "is_told"), [(0.49, False), (0.51, True)])
def test_a_prior_is_named_that_is_at_most_twice_as_wide_as_the_posterior(width, is_told):
    """ln E_x spread evenly with so many times the standard deviation of its prior's logarithm."""
    prior = load_prior("spruce")
    even = np.linspace(-1.0, 1.0, 2001) * np.sqrt(3.0 * 2000 / 2002)
    columns = {
        name: np.exp((width if name == "E_x" else 0.1) * one.log_sd * even) for name, one in prior.constants.items()
    }
    said = prior_remarks(SimpleNamespace(moduli=columns, rigidities={}), prior)

    assert bool(said) is is_told
    assert all("little to the prior 'spruce' on E_x (0.51 times as wide):" in one for one in said)


@pytest.mark.parametrize(("leverage", "is_told"), [(0.899, False), (0.901, True)])
def test_a_mode_carries_a_constant_from_a_leverage_of_nine_tenths_on(inference, leverage, is_told):
    found = Identifiability(10.0, 1e-4 * np.eye(3), np.array([leverage, *[0.4] * 5]), np.full((6, 3), 1 / 3))

    sentences = remarks(inference.problem.board, found)
    assert any("mode (0,0) alone carries a constant" in one for one in sentences) is is_told


@pytest.mark.parametrize(("share", "is_told"), [(0.599, True), (0.601, False)])
def test_a_low_share_is_given_as_the_reason_below_sixty_percent(inference, share, is_told):
    shares = np.tile([share, 1.0 - share, 0.0], (6, 1))
    found = Identifiability(10.0, np.diag([4e-4, 1e-4, 1e-4]), np.full(6, 0.5), shares)
    (sentence, *_) = remarks(inference.problem.board, found)

    assert sentence.startswith("the modes tell E_x least well")
    assert ("because no mode has more than 60 % of its energy in it" in sentence) is is_told


@pytest.mark.parametrize(("sd", "told"), [(0.00487, "0.49 %"), (0.027, "2.7 %"), (0.183, "18 %"), (np.inf, "inf %")])
def test_the_sentence_has_the_digits_of_the_table(inference, sd, told):
    """Two significant ones, as the table of where the uncertainty comes from."""
    found = Identifiability(10.0, np.diag([sd**2, 1e-8, 1e-8]), np.full(6, 0.5), np.eye(6, 3))
    (sentence, *_) = remarks(inference.problem.board, found)

    assert sentence == f"the modes tell E_x least well: the expected noise alone leaves it {told} uncertain"


@pytest.mark.parametrize(("at", "is_told"), [(0.049, False), (0.051, True)])
def test_a_sign_counts_where_the_product_of_the_shape_is_a_twentieth_of_the_largest(inference, at, is_told):
    """A shape w = x between a hammer at x = 1 and a sensor at x = `at`: the product is `at` of its largest."""
    board = inference.problem.board
    setup = board.setups[0]
    length_x, length_y = (float(board.nominal()[name]) for name in ("length_x", "length_y"))
    sensor = SimpleNamespace(kind="accelerometer", places=((at * length_x, 0.5 * length_y),))
    reading = replace(setup.readings[0], label=Label(0, 0), sign="-")
    setup = replace(setup, hammer=(length_x, 0.5 * length_y), attached=(sensor,), readings=(reading,))
    modes = SimpleNamespace(displacement=lambda x, y: (x[:, None] + 0.0 * y)[None])
    named = (SimpleNamespace(label=Label(0, 0), name="(0,0)"),)

    assert bool(sign_conflicts(setup, modes, named, board.nominal())) is is_told
