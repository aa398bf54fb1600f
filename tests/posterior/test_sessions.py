"""Sessions of one setup: what the board does that its plate does not tells once, what clamping changes each time."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, NARROW, board_of, models_at, peaks_of, setup_of
from normal_case import NormalCase, differences, draws_of

from bayesplate.board.attached import AttachedItem, DeclaredFluid
from bayesplate.board.board import Board, make_board
from bayesplate.board.parameter import BOARD_OWNER
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import discrepancy_names, session_groups, with_discrepancies
from bayesplate.board.setup import DEFAULT_NOISE
from bayesplate.diagnosis import baseline as home
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.forms import forms
from bayesplate.diagnosis.laws import form_law
from bayesplate.diagnosis.search import prepare_search, run_search
from bayesplate.diagnosis.signatures import signatures
from bayesplate.effects import declare
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import OtherMode
from bayesplate.plate.naming import ModePlace
from bayesplate.plate.terms import Parity
from bayesplate.posterior.assessment import carried_in_fit, mode_errors
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.sampling import SamplerSettings

SCATTER, DISCREPANCY, N_SESSIONS = 0.003, 0.006, 2
SCALE = "discrepancy[day 1 to day 2]"


def board(discrepancy: float | None = DISCREPANCY, *, is_rough: bool = False) -> Board:
    """A board in some sessions of one setup, of known noise and, unless it is none, known discrepancy."""
    hertz = ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS)
    noise = Quantity.from_median(SCATTER, NARROW)
    if is_rough:  # the third and the fifth mode of the board lie elsewhere than those of its plate, every day
        hertz |= {label: 1.03 * hertz[label] for label in (CANTILEVER_LABELS[2], CANTILEVER_LABELS[4])}
    days = [setup_of(ritz.CANTILEVER, hertz, name=f"day {i + 1}", noise=noise) for i in range(N_SESSIONS)]
    made = with_discrepancies(board_of(ritz.FINNISH, days))
    return made if discrepancy is None else made.with_priors({SCALE: Quantity.exact(discrepancy)})


@pytest.fixture(scope="module")
def problem() -> PosedProblem:
    """The problem of a board of known discrepancy."""
    return pose(board(), load_prior("weakly-informative"), law="linear")


def test_setups_that_hold_and_load_the_board_alike_are_sessions():
    hertz = ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS)
    one = setup_of(ritz.CANTILEVER, hertz, name="one")
    others = [
        replace(one, name="another day", hammer=(0.01, 0.01)),
        replace(one, name="deeper", clamped={"x0": Quantity.exact(0.03)}),
        replace(one, name="loaded", attached=(AttachedItem("weight", ((0.1, 0.1),), Quantity.exact(1e-3)),)),
        replace(one, name="free", ends_x=("free", "free")),
        replace(one, name="wet", fluid=DeclaredFluid(997.0)),
        replace(one, name="on foam", bounce=20.0),
        replace(one, name="third day", noise=Quantity.from_median(0.01, 2.0)),
    ]
    made = board_of(ritz.FINNISH, [one, *others])

    assert [[setup.name for setup in group] for group in session_groups(made)] == [["one", "another day", "third day"]]
    found = with_discrepancies(made)
    assert [one.name for one in found.setups if one.group is not None] == ["one", "another day", "third day"]
    assert found.inputs["discrepancy[one to third day]"] == DEFAULT_NOISE
    assert len(found.parameters) == len(made.parameters) + 1 + len(CANTILEVER_LABELS)
    assert with_discrepancies(found) == found
    assert found.to_toml() == made.to_toml()
    alone = board_of(ritz.FINNISH, [one, *others[1:6]])
    assert with_discrepancies(alone) == alone


def test_the_constants_are_as_uncertain_as_readings_that_share_a_part_of_their_errors(problem):
    """Generalised least squares with the covariance of the readings written out, and what independent errors say."""
    slopes = problem.estimate.sensitivities
    mode = np.tile(np.arange(len(CANTILEVER_LABELS)), N_SESSIONS)
    alike = (mode[:, None] == mode).astype(float)
    covariances = SCATTER**2 * np.eye(mode.size) + DISCREPANCY**2 * np.stack([alike, np.eye(mode.size)])
    expected, if_independent = (np.linalg.inv(slopes.T @ np.linalg.solve(one, slopes)) for one in covariances)

    assert problem.covariance[:3, :3] == pytest.approx(expected, rel=0.01)
    assert (np.sqrt(np.diagonal(expected) / np.diagonal(if_independent)) > 1.3).all()  # control


def test_draws_of_constants_and_discrepancies_are_those_of_the_closed_form(problem):
    inference = infer(problem, SamplerSettings(seed=5))
    case, (theta, log_posterior) = NormalCase.of(problem), draws_of(inference)
    discrepancy = case.parameters.n_constants + N_SESSIONS
    control = theta.copy()
    control[..., discrepancy:] *= 0.8

    assert differences(case, theta, log_posterior) == []
    assert differences(case, control, log_posterior)


def test_a_discrepancy_moves_the_mode_in_all_sessions_and_no_other(problem):
    parameters, label = problem.parameters, problem.board.setups[0].labels[2]
    theta = np.tile(problem.centre, (2, 1))
    _, standard = discrepancy_names(problem.board.setups[0], label)
    theta[1, parameters.names.index(f"z[{standard}]")] += 1.5
    moved = [there[1] - there[0] for there in problem.posterior.log_frequencies(theta)]

    expected = np.zeros((N_SESSIONS, len(CANTILEVER_LABELS)))
    expected[:, 2] = 1.5 * DISCREPANCY
    assert np.stack(moved) == pytest.approx(expected, abs=1e-12)


def test_a_peak_that_may_be_the_mode_is_moved_too():
    made = board()
    setup = replace(made.setups[0], readings=made.setups[0].readings[:3], peaks=peaks_of(300.0))
    beams, values = CANTILEVER_LABELS[3], {**made.nominal(), "discrepancy (0,2)[day 1 to day 2]": np.array([2.0, -1.0])}
    (model,) = models_at(replace(made, setups=(setup,)), [30.0, 1.6, 6.0])
    model = replace(
        model, other_modes=(OtherMode(ModePlace(Parity(0, 1), 1, 0.9), beams), OtherMode(model.places[0], None))
    )

    assert model.discrepancies(values) == pytest.approx(DISCREPANCY * np.outer([2.0, -1.0], [0, 0, 0, 1, 0]))


@pytest.fixture(scope="module")
def rough():
    """A board that is far from its plate in two modes, every day, with a discrepancy that may follow."""
    return pose(board(None, is_rough=True), load_prior("weakly-informative"), law="linear")


def test_modes_carry_what_they_carry_in_one_session(rough):
    """How the board departs from its plate is noise to its modes: none of them is said to carry that."""
    alone = pose(replace(rough.board, setups=rough.board.setups[:1]).without(()), rough.prior)
    carried = []
    for problem, n in ((rough, N_SESSIONS), (alone, 1)):
        errors = mode_errors(SimpleNamespace(problem=problem, median_noise=np.full(n, SCATTER)))
        carried.append({(mode.label, mode.carries) for mode in carried_in_fit(problem.board, errors)})
        assert np.isfinite(errors.left_out[errors.leverages.carries < 0]).sum() >= 4 * n

    assert carried[0] == carried[1]


def test_a_search_begins_where_the_board_is_and_not_where_its_plate_would_be(rough):
    """At the size at which it does nothing an effect shifts nothing, though the board is not its plate."""
    baseline = baseline_of(rough)
    assert np.abs(baseline.possible_modes.discrepancy).max() > 1e-3
    for name in ("attached_mass", "density_gradient"):  # the one follows shapes, the other the ranks of classes
        every = forms(baseline.board)
        form = every[name][0]
        nothing = {free.name: np.array([free.neutral_value + 1e-9]) for free in form.free}
        law = form_law(baseline, form).with_modes_of(baseline)
        shift = law.log_frequencies(baseline, baseline.log_rigidities[None, :], nothing) - baseline.log_frequency
        assert np.abs(shift).max() < 2e-4, name


@pytest.mark.parametrize("judge", ["prior", "fit"])
def test_a_scale_that_has_followed_the_residual_does_not_excuse_it(judge, rough, monkeypatch):
    """By the prior of the discrepancies the residual is too large for chance, by the scale of the fit it is not."""
    if judge == "fit":
        monkeypatch.setattr(home, "rescale_discrepancies", lambda board, values, slopes, inputs: (slopes, inputs))
    baseline = baseline_of(rough)
    found = run_search(prepare_search(baseline, effects=()))

    assert rough.parameters.values(rough.centre[None])[SCALE][0] > 2.0 * DEFAULT_NOISE.median
    of_plate = baseline.log_frequency - baseline.possible_modes.discrepancy
    assert judge == "fit" or baseline.middle == pytest.approx(of_plate, abs=1e-9)
    assert (found.p_value(0) < 0.01) == (judge == "prior"), found.p_value(0)


@pytest.mark.parametrize("effects", [(), ("clamp_rotation",)])
def test_sessions_that_are_one_plate_have_one_law_and_others_each(effects):
    """A clamp that gives way differently on each day makes them different plates."""
    days = board(None)
    sizes = {q.name: q.prior for q in days.parameters if q.owner == BOARD_OWNER}
    made = declare(make_board("made", sizes, [replace(one, group=None) for one in days.setups], effects=effects))
    problem = pose(made, load_prior("weakly-informative"), law="exact")
    theta = np.random.default_rng(4).multivariate_normal(problem.centre, problem.covariance, 20)

    first, *others = problem.posterior.mode_log_frequencies(theta)

    for other in others:
        # What the days share is all without a clamp, and their laws are made alike.
        assert np.abs(first - other).max() > 1e-4 if effects else np.abs(first - other).max() < 1e-9


@pytest.mark.slow
def test_what_an_effect_shifts_is_told_beside_the_discrepancies():
    """`check` and `diagnose` tell the same; the air makes every mode lower, whatever the board does otherwise."""
    problem = pose(board(is_rough=True), load_prior("weakly-informative"), law="linear")
    base = baseline_of(problem)
    law = form_law(base, forms(problem.board)["fluid_loading"][0]).with_modes_of(base)
    nominal = {one.name: np.array([one.nominal]) for one in law.form.free}
    raw = law.log_frequencies(base, base.log_rigidities[None, :], nominal)[0] - base.log_frequency
    (told,) = signatures(problem, ["fluid_loading"])
    assert (told.raw < 0.0).all()
    assert cents(raw) == pytest.approx(told.raw, abs=0.3)
