"""`Problem`: densities and the map from the unit cube, as other samplers use them, and what the commands make of it."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from runs import files_in

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.material import moduli
from bayesplate.commands.problem import pose_all
from bayesplate.errors import NotIdentifiableError

BOARD = "fiemme-spruce-clamped"
UNCERTAIN = "spruce-free-2R"


@pytest.fixture(scope="module")
def problem() -> bayesplate.Problem:
    """A board whose sizes, mass and Poisson ratio are uncertain, with effects whose priors have one bound and two.

    How stiff its support is is not stated: the effect's own prior ends at zero.
    """
    board = bayesplate.Problem.from_card(UNCERTAIN).prepared.card
    lying = replace(board, setups=tuple(replace(one, bounce=None) for one in board.setups))
    return bayesplate.Problem.from_card(lying, effects=["fluid_loading", "support_stiffness"])


@pytest.fixture(scope="module")
def clamped() -> bayesplate.Problem:
    return bayesplate.Problem.from_card(BOARD)


def points(problem: bayesplate.Problem, n: int, seed: int = 1) -> np.ndarray:
    """Draws from the prior."""
    return problem.prior_transform(np.random.default_rng(seed).uniform(size=(n, problem.n_dim)))


def near(problem: bayesplate.Problem, n: int) -> np.ndarray:
    """Points where the posterior lies."""
    posed = problem.posed
    theta = np.random.default_rng(1).multivariate_normal(posed.centre, 0.01 * posed.covariance, n)
    columns, bounds = posed.parameters.fitted_columns, posed.parameters.fitted_bounds
    theta[:, columns] = np.clip(theta[:, columns], bounds.lower + 1e-6, bounds.upper - 1e-6)
    return theta


def test_one_point_gives_what_many_give(problem):
    theta, given = near(problem, 3), {}
    for name in ("log_prob", "log_prior", "log_likelihood", "predict"):
        method = getattr(problem, name)
        given[name] = method(theta)
        ones = np.array([method(at.tolist()) for at in theta])
        assert ones.shape == ((3, len(problem.labels)) if name == "predict" else (3,))
        assert np.isfinite(ones).all()
        np.testing.assert_allclose(ones, given[name], rtol=1e-12)  # sums of one row and of three round differently
    assert np.ndim(problem.log_prior(theta[0])) == 0
    np.testing.assert_allclose(given["log_prob"], given["log_prior"] + given["log_likelihood"], rtol=1e-12)
    u = np.full((3, problem.n_dim), 0.3)
    np.testing.assert_array_equal(problem.prior_transform(u)[1], problem.prior_transform(u[0]))


def test_the_columns_and_the_readings_are_those_of_the_archive(problem, clamped, fiemme):
    assert len(problem.names) == problem.n_dim == problem.posed.centre.size
    assert {"z[thickness]", "z[poisson_xy]", "z[support_stiffness.stiffness[free]]"} < set(problem.names)
    made = fiemme.to_arviz()
    assert clamped.labels == tuple(made.observed_data["reading"].values)
    assert clamped.names == tuple(made.sample_stats["parameter"].values)


def test_what_sessions_share_is_among_the_columns(clamped):
    """A board clamped twice: the discrepancies of its modes are sampled, so whoever else samples needs them too."""
    (setup,) = clamped.board.setups
    again = bayesplate.Problem.from_card(replace(clamped.board, setups=(setup, replace(setup, name="again"))))
    theta = near(again, 3)
    assert again.n_dim == len(again.names) == again.posed.centre.size
    assert sum("discrepancy" in name for name in again.names) == 1 + len(setup.labels)
    assert np.isfinite(again.log_prob(theta)).all()
    assert again.predict(theta).shape == (3, 2 * len(setup.labels))
    assert np.isfinite(again.log_prior(points(again, 20))).any()


def test_predict_and_the_likelihood_are_those_of_the_fit(clamped, fiemme):
    draws = fiemme.draws
    flat = draws.flat[:50]
    np.testing.assert_allclose(np.log(clamped.predict(flat)), draws.log_frequency.reshape(-1, 6)[:50], rtol=1e-12)
    np.testing.assert_allclose(clamped.log_prob(flat), draws.log_posterior.ravel()[:50], rtol=1e-9)
    own = draws.log_likelihood.reshape(-1, 6)[:50].sum(axis=1)
    np.testing.assert_allclose(clamped.log_likelihood(flat), own, rtol=1e-12)


def test_the_factors_of_the_prior_multiply_to_it(problem, fiemme):
    """A board with exact inputs has two of them, one with uncertain ones three."""
    group = fiemme.to_arviz().log_prior
    held = {name: group[name].values.ravel() for name in group.data_vars}
    at = points(problem, 3)
    factors = problem.posed.posterior.log_prior_factors(at)

    assert group["constants"].values.shape == fiemme.draws.theta.shape[:2]
    assert (set(held), set(factors)) == ({"constants", "noise"}, {"constants", "noise", "inputs"})
    np.testing.assert_allclose(sum(held.values()), fiemme.problem.log_prior(fiemme.draws.flat), rtol=1e-12)
    np.testing.assert_allclose(sum(factors.values()), problem.log_prior(at), rtol=1e-12)


def log_density_of(problem: bayesplate.Problem, u: np.ndarray) -> float:
    """Log density of theta that the map from the cube implies at a point: less the log of its Jacobian there."""
    step = 1e-6
    ways = np.eye(problem.n_dim) * step
    jacobian = (problem.prior_transform(u + ways) - problem.prior_transform(u - ways)) / (2.0 * step)
    return -float(np.linalg.slogdet(jacobian)[1])


IN_RIGIDITIES = {
    "D_x": bayesplate.Quantity.from_range(5.0, 60.0),
    "D_y": bayesplate.Quantity.from_median(2.0, 1.8),
    "D_s": bayesplate.Quantity.from_median(5.0, 1.5),
}


@pytest.mark.parametrize("prior", [None, "in-rigidities"])
def test_the_map_from_the_cube_has_the_density_of_the_prior(problem, prior):
    """By the change of variables; central differences of a step of 1e-6 are good to some 1e-8 of the slopes."""
    if prior is not None:
        card = bayesplate.PriorCard.from_quantities(prior, IN_RIGIDITIES, source="a test")
        named = replace(problem.prepared.named, prior=card)
        problem = replace(problem, prepared=replace(problem.prepared, named=named))
    bounds = [one.prior.standard_bounds for one in problem.prepared.board.uncertain]
    assert {int(np.isfinite(pair).sum()) for pair in bounds} == {0, 1, 2}
    cube = np.random.default_rng(4).uniform(0.02, 0.98, (20, problem.n_dim))
    possible = np.isfinite(problem.log_prior(problem.prior_transform(cube)))
    assert possible.sum() > 15
    for u in cube[possible]:
        assert log_density_of(problem, u) == pytest.approx(problem.log_prior(problem.prior_transform(u)), abs=1e-5)
        # the control: a point that the map leads elsewhere has another density
        moved = problem.prior_transform(np.clip(u + 0.015, 0.0, 1.0))
        assert log_density_of(problem, u) != pytest.approx(problem.log_prior(moved), abs=1e-5)


WIDE = {
    "E_x": bayesplate.Quantity.from_median(2e9, 2.5),
    "E_y": bayesplate.Quantity.from_median(1e9, 2.5),
    "G_xy": bayesplate.Quantity.from_median(0.5e9, 1.5),
}


@pytest.fixture(scope="module")
def wide() -> bayesplate.Problem:
    """Moduli so uncertain that a part of the prior is no material's, at an uncertain thickness and Poisson ratio."""
    board = bayesplate.Problem.from_card(UNCERTAIN).board
    (setup,) = board.setups
    labelled = replace(setup, peaks=(), readings=tuple(replace(one, confidence=1.0) for one in setup.readings))
    free = replace(board, setups=(labelled,)).with_priors(
        {"poisson_xy": bayesplate.Quantity.from_mean(0.6, 0.2, "normal")}
    )
    prior = bayesplate.PriorCard.from_quantities("wide", WIDE, source="a test")
    return bayesplate.Problem.from_card(free, prior=prior)


def test_where_no_material_exists_the_likelihood_is_zero_and_nothing_is_not_a_number(wide):
    theta = points(wide, 500)
    values = wide.posed.parameters.values(theta)
    E_x = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"]).E_x
    none = np.isnan(E_x)

    assert np.isfinite(theta).all()
    assert 5 < none.sum() < 250
    for method in (wide.log_likelihood, wide.log_prior, wide.log_prob):
        density = method(theta)
        assert not np.isnan(density).any()
        np.testing.assert_array_equal(np.isfinite(density), ~none)
    np.testing.assert_array_equal(np.isfinite(wide.predict(theta)).all(axis=1), ~none)


def test_far_outside_the_density_is_zero(clamped):
    theta = clamped.posed.centre.copy()
    for column, value in product(range(clamped.n_dim), (np.nan, -np.inf, 1e6)):
        there = np.where(np.arange(clamped.n_dim) == column, value, theta)
        assert clamped.log_prob(there) == clamped.log_likelihood(there) == -np.inf


def test_beyond_a_bound_the_density_is_zero(problem):
    (column,) = (i for i, name in enumerate(problem.names) if name.startswith("z[support_stiffness"))
    low = problem.prepared.board.uncertain[column - problem.n_dim].prior.standard_bounds[0]
    theta = np.tile(problem.posed.centre, (2, 1))
    theta[:, column] = low + 0.01, low - 0.01

    assert np.isfinite(problem.log_prob(theta)).tolist() == [True, False]


def test_what_is_no_point_or_no_problem_or_states_it_again_is_refused(clamped):
    """A diagnosis wants normal noise, which its search assumes."""
    campaign = bayesplate.Campaign.from_card("spruce-half-tops")
    robust = bayesplate.Problem.from_card(BOARD, robust=True)
    robust_campaign = bayesplate.Campaign.from_card("spruce-half-tops", robust=True)
    points = r"theta: wanted .* \(4,\) or \(n, 4\), columns log_D_x.* got "
    no_board = r"card: wanted a board: .* got a Campaign \(its boards are"
    for function, given, options, said in (
        (clamped.log_prob, np.zeros((2, 5)), {}, rf"{points}one of shape \(2, 5\)"),
        (clamped.log_prob, "point", {}, f"{points}str"),
        (clamped.log_prob, [[1.0], [1.0, 2.0]], {}, f"{points}list"),
        (clamped.prior_transform, [0.5, 1.5, 0.5, 0.5], {}, r"u: wanted numbers from 0 to 1, got 1\.5"),
        (bayesplate.Problem.from_card, campaign, {}, no_board),
        (bayesplate.modes, campaign, {}, no_board),
        (bayesplate.compare, campaign, {}, no_board),
        (bayesplate.cite, campaign, {}, no_board),
        (bayesplate.Problem.from_card, clamped, {}, r"card: wanted a board: .* got a Problem \(it is one: use it"),
        (bayesplate.fit, clamped, {"law": "exact"}, "law: wanted nothing beside a Problem"),
        (bayesplate.fit, clamped, {"robust": True}, "robust: wanted nothing beside a Problem"),
        (bayesplate.modes, clamped, {"effects": []}, "effects: wanted nothing beside a Problem"),
        (bayesplate.cite, clamped, {"effects": []}, "effects: wanted nothing beside a Problem"),
        (bayesplate.diagnose, robust, {}, "robust: wanted a problem with normal noise"),
        (bayesplate.plan, robust, {}, "robust: wanted a problem with normal noise"),
        (bayesplate.diagnose, robust_campaign, {}, "robust: wanted a problem with normal noise"),
        (bayesplate.Campaign.from_card, clamped, {}, "card: wanted a name or a path"),
        (bayesplate.Board.from_toml, 3, {}, "board card: wanted a name or a path, got 3"),
        (bayesplate.Board.from_text, 3, {"name": "b"}, r"b\.toml: wanted the text of a card, got 3"),
    ):
        with pytest.raises(bayesplate.InputError, match=said):
            function(given, **options)


def test_the_plates_are_solved_once_and_not_before_they_are_needed(monkeypatch):
    from bayesplate.commands import problem as module

    calls, pose = [], module.pose
    monkeypatch.setattr("bayesplate.commands.check.signatures", lambda _: [])  # which take their time
    monkeypatch.setattr(module, "pose", lambda *given, **options: calls.append(1) or pose(*given, **options))
    one = bayesplate.Problem.from_card(BOARD)
    theta = one.prior_transform(np.full(one.n_dim, 0.5))
    one.log_prior(theta)
    assert (calls, "4 parameters" in repr(one)) == ([], True)
    one.log_prob(theta)
    one.predict(theta)
    bayesplate.check(one)
    assert calls == [1]


def test_the_prior_and_the_law_can_be_given(clamped):
    other = bayesplate.Problem.from_card(BOARD, prior="spruce", law="exact", robust=True)
    theta = clamped.posed.centre

    assert (other.prior.name, other.law, other.posed.posterior.robust) == ("spruce", "exact", True)
    assert (clamped.prior.name, clamped.law) == ("weakly-informative", "linear")
    assert other.log_prior(theta) != pytest.approx(clamped.log_prior(theta), abs=0.1)


def test_a_setup_that_took_the_place_of_the_card_s_is_in_the_text_and_in_its_digest(tmp_path, clamped):
    """posterior.nc and summary.json have them: nothing else has to be kept for a run to be repeated."""
    fragment = tmp_path / "setup.toml"
    fragment.write_text('[setup.frequencies_hz]\n"(0,0)" = 53\n', encoding="utf-8")
    card = bayesplate.Problem.from_card(BOARD, setup=fragment).prepared.card

    assert "= 53" in card.text
    assert hashlib.sha256(card.text.encode()).hexdigest() == card.sha256 != clamped.prepared.card.sha256


@pytest.mark.usefixtures("quickly")
def test_a_problem_a_board_and_a_card_give_the_same_draws_and_write_where_they_are_told_alone(
    tmp_path, monkeypatch, clamped
):
    """Writing and checkpoints change no draw; another seed does."""
    monkeypatch.chdir(tmp_path)
    board = clamped.board
    card = tmp_path / f"{BOARD}.toml"
    board.to_toml(card)
    before = files_in(tmp_path)
    results = [bayesplate.fit(given, seed=3) for given in (clamped, board)]
    other = bayesplate.fit(clamped, seed=4)

    assert files_in(tmp_path) == before
    assert [result.folder for result in results] == [None] * 2
    results.append(bayesplate.fit(card, seed=3, out=tmp_path / "out", report=False))
    assert len({result.draws.theta.tobytes() for result in results}) == 1
    assert other.draws.theta.tobytes() != results[0].draws.theta.tobytes()
    assert (other.summary.seed, results[0].summary.seed) == (4, 3)
    assert results[1].summary == results[2].summary
    assert results[1].summary.card_sha256 == Board.from_toml(card).sha256


def test_a_board_whose_effects_a_card_cannot_state_is_refused(problem):
    """The parameters of declared effects have their own priors; another one would be lost on the way, unsaid."""
    declared = problem.prepared.board
    name = next(one.name for one in declared.uncertain if one.effect == "support_stiffness")
    changed = declared.with_priors({name: declared.inputs[name].scaled(2.0)})

    assert bayesplate.Problem.from_card(declared, effects=declared.effects).names == problem.names
    with pytest.raises(bayesplate.InputError, match="wanted the prior of a declared effect, got another one"):
        bayesplate.Problem.from_card(changed)


def test_of_several_boards_each_that_fails_is_named_once(problem):
    class Open:
        board = problem.board

        @property
        def posed(self):
            raise NotIdentifiableError(self.said)

    bare, named = Open(), Open()
    bare.said, named.said = "leaves E_y open", f"{problem.board.name}: leaves E_y open"
    with pytest.raises(NotIdentifiableError) as refused:
        pose_all([bare, named])
    assert str(refused.value).splitlines() == [f"{problem.board.name}: leaves E_y open"] * 2


def test_a_faulty_board_is_refused_as_its_card_would_be(tmp_path, clamped):
    thick = bayesplate.Quantity.exact(-3e-3)
    board = replace(clamped.board.with_priors({"thickness": thick}), effects=("grain_angel",))
    Path(tmp_path / f"{BOARD}.toml").write_text(board.to_toml(), encoding="utf-8")
    told = []
    for given in (board, tmp_path / f"{BOARD}.toml"):
        with pytest.raises(bayesplate.InputError) as refused:
            bayesplate.check(given)
        told.append(str(refused.value))

    assert told[0] == told[1]
    assert f"{BOARD}.toml [plate] thickness_mm: wanted a positive number, got -3.0" in told[0]
    assert "did you mean grain_angle?" in told[0]
