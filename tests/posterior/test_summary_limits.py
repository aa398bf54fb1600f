"""The numbers that decide what a fit warns of, each from just below and just above; no sampler runs here."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import bayesplate.frequencies.spectrum
import bayesplate.posterior.assessment
from bayesplate.board.prior import load_prior
from bayesplate.commands.prepare import prepare
from bayesplate.estimates.identifiability import Identifiability, identifiability_remarks
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.spectrum import sign_conflicts, spectrum
from bayesplate.frequencies.system import system_of
from bayesplate.labels import Label
from bayesplate.posterior.assessment import assess as assessed
from bayesplate.posterior.convergence import judge_convergence
from bayesplate.posterior.draws import named_draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.posing import pose
from bayesplate.posterior.reweighting import linearisation
from bayesplate.posterior.sampling import Chains
from bayesplate.posterior.statistics import walker_major
from bayesplate.posterior.target import linear_suffices
from bayesplate.results.budget import input_remarks, prior_remarks
from bayesplate.results.summarise import summarise


@pytest.fixture(scope="module")
def inference():
    """Draws from the normal approximation of the clamped board's posterior, shear declared, under the linear law."""
    prepared = prepare("fiemme-spruce-clamped", ["transverse_shear"])
    problem = pose(prepared.board, prepared.prior, law="linear")
    rng = np.random.default_rng(1)
    theta = rng.multivariate_normal(problem.centre, problem.covariance, (4, 60, 10))
    log_prob = problem.posterior(theta.reshape(-1, theta.shape[-1])).reshape(theta.shape[:-1])
    return Inference(
        problem, Chains(theta, log_prob, 0), judge_convergence(theta), walker_major(theta), walker_major(log_prob)
    )


def summary_of(inference, errors=0.0):
    """The summary where the linear law errs by this share of the noise, in every mode and draw."""
    draws = named_draws(inference, 1)
    off = np.full_like(linearisation(draws), errors * cents(np.median(draws.noise)))
    return summarise(draws, assessed(draws, off), 1, {}, "")


def is_told(inference, sentence, errors=0.0):
    return any(sentence in warning for warning in summary_of(inference, errors).warnings)


def test_units_of_effects_reach_the_summary(inference):
    effects = summary_of(inference).effects["board"]["transverse_shear"]

    assert {name: entry.unit for name, entry in effects.items()} == {"G_xz": "Pa", "G_yz": "Pa"}


def warns_of_linear_law(share, inference, patch):
    return is_told(inference, "the linear law is off by more than a quarter of the noise", share)


def linear_law_is_not_enough(share, inference, patch):
    """In one mode, rms over the draws."""
    errors = np.zeros((10, 6))
    errors[:, 4] = share * cents(0.01) * np.array([1, -1] * 5)
    return not linear_suffices([6], errors, [0.01])


def warns_of_exact_law(worst, inference, patch):
    patch.setattr(bayesplate.posterior.assessment, "worst_cents", lambda _: worst)
    return is_told(inference, "the exact law misses full solves")


def doubts_label(correlation, inference, patch):
    problem = inference.problem
    (model,) = problem.posterior.models
    places = (replace(model.places[0], correlation=correlation), *model.places[1:])
    posterior = replace(problem.posterior, models=(replace(model, places=places),))
    return is_told(replace(inference, problem=replace(problem, posterior=posterior)), "fits its label only to")


def names_mode(correlation, inference, patch):
    problem = inference.problem
    patch.setattr(
        bayesplate.frequencies.spectrum, "name_modes", lambda modes: [((0, 0), correlation)] * len(modes.eigenvalues)
    )
    system = system_of(problem.board, problem.board.setups[0])
    _, (lowest,) = spectrum(system, problem.parameters.values_at(problem.centre), 1, problem.posterior.models[0].plate)
    assert lowest.name in ("(0,0)", "cannot tell")
    return lowest.name == "(0,0)"


def names_input(share, inference, patch):
    """ln E = sqrt(share) a + sqrt(1 - share) b, with a the logarithm of the thickness and b at right angles to it."""
    a, b = np.linalg.qr(np.column_stack([np.ones(500), np.random.default_rng(1).standard_normal((500, 2))]))[0].T[1:]
    draws = SimpleNamespace(
        moduli={"E_x": np.exp(np.sqrt(share) * a + np.sqrt(1.0 - share) * b)}, inputs={"thickness": np.exp(a)}
    )
    said = input_remarks(draws, inference.problem.board)
    assert all("51 % of the uncertainty (variance) of E_x comes from the thickness" in one for one in said)
    return bool(said)


def names_prior(width, inference, patch):
    """ln E_x spread evenly with so many times the standard deviation of its prior's logarithm."""
    prior = load_prior("spruce")
    even = np.linspace(-1.0, 1.0, 2001) * np.sqrt(3.0 * 2000 / 2002)
    columns = {
        name: np.exp((width if name == "E_x" else 0.1) * one.log_sd * even) for name, one in prior.constants.items()
    }
    said = prior_remarks(SimpleNamespace(moduli=columns, rigidities={}), prior)
    assert all("little to the prior 'spruce' on E_x (0.51 times as wide):" in one for one in said)
    return bool(said)


def says_what_carries(leverage, inference, patch):
    found = Identifiability(10.0, 1e-4 * np.eye(3), np.array([leverage, *[0.4] * 5]), np.full((6, 3), 1 / 3))
    return any(
        "mode (0,0) alone carries a constant" in one for one in identifiability_remarks(inference.problem.board, found)
    )


def gives_low_share_as_reason(share, inference, patch):
    shares = np.tile([share, 1.0 - share, 0.0], (6, 1))
    found = Identifiability(10.0, np.diag([4e-4, 1e-4, 1e-4]), np.full(6, 0.5), shares)
    (sentence, *_) = identifiability_remarks(inference.problem.board, found)
    assert sentence.startswith("the modes tell E_x least well")
    return "because no mode has more than 60 % of its energy in it" in sentence


def sign_counts(at, inference, patch):
    """A shape w = x between a hammer at x = 1 and a sensor at x = `at`: the product is `at` of its largest."""
    board = inference.problem.board
    setup = board.setups[0]
    length_x, length_y = (float(board.nominal()[name]) for name in ("length_x", "length_y"))
    sensor = SimpleNamespace(kind="accelerometer", places=((at * length_x, 0.5 * length_y),))
    reading = replace(setup.readings[0], label=Label(0, 0), sign="-")
    setup = replace(setup, hammer=(length_x, 0.5 * length_y), attached=(sensor,), readings=(reading,))
    modes = SimpleNamespace(displacement=lambda x, y: (x[:, None] + 0.0 * y)[None])
    named = (SimpleNamespace(label=Label(0, 0), name="(0,0)"),)
    return bool(sign_conflicts(setup, modes, named, board.nominal()))


LIMITS = {
    "the linear law is warned of from a quarter of the noise on": (warns_of_linear_law, 0.249, 0.251),
    "the linear law serves below a quarter of the noise": (linear_law_is_not_enough, 0.249, 0.251),
    "the exact law is warned of from half a cent on": (warns_of_exact_law, 0.499, 0.501),
    "a label is doubted below a correlation of three quarters": (doubts_label, 0.751, 0.749),
    "a mode is named from a correlation of three quarters on": (names_mode, 0.749, 0.751),
    "an input is named that makes half of the variance": (names_input, 0.49, 0.51),
    "a prior is named at most twice as wide as the posterior": (names_prior, 0.49, 0.51),
    "a mode carries a constant from a leverage of nine tenths on": (says_what_carries, 0.899, 0.901),
    "a low share is the reason below sixty per cent": (gives_low_share_as_reason, 0.601, 0.599),
    "a sign counts from a twentieth of the largest product on": (sign_counts, 0.049, 0.051),
}
"""What is said or done at a value, a value at which it is not, and one at which it is."""


@pytest.mark.parametrize("limit", LIMITS)
def test_each_limit_of_what_is_told(limit, inference, monkeypatch):
    is_so, silent, telling = LIMITS[limit]

    assert not is_so(silent, inference, monkeypatch)
    assert is_so(telling, inference, monkeypatch)


@pytest.mark.parametrize(("sd", "told"), [(0.00487, "0.49 %"), (0.027, "2.7 %"), (0.183, "18 %"), (np.inf, "inf %")])
def test_the_sentence_has_the_digits_of_the_table(inference, sd, told):
    """Two significant ones, as the table of where the uncertainty comes from."""
    found = Identifiability(10.0, np.diag([sd**2, 1e-8, 1e-8]), np.full(6, 0.5), np.eye(6, 3))
    (sentence, *_) = identifiability_remarks(inference.problem.board, found)

    assert sentence == f"the modes tell E_x least well: the expected noise alone leaves it {told} uncertain"
