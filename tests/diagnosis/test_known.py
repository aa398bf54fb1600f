"""Known effects, computed: the same figures as a check of a card that declares them, and errors that fall and rise."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from generator.boards import plant
from scipy.stats import chi2

from bayesplate import Board, Setup
from bayesplate.board.material import RIGIDITIES, moduli
from bayesplate.board.parameter import BOARD_OWNER, Owner
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.commands.problem import Problem
from bayesplate.diagnosis import known
from bayesplate.diagnosis.known import (
    known_combinations,
    known_effects,
    known_fit,
    known_fits,
    stated_effects,
    with_combination,
)
from bayesplate.diagnosis.stated import stated_claims
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.posing import pose

FIEMME = "fiemme-spruce-clamped"
SHEAR, AIR, MASS = "transverse_shear", "fluid_loading", "attached_mass"
SHEAR_LINES = ("shear_xz_gpa", "shear_yz_gpa")
ATTACHED = '\n[[setup.attached]]\nkind = "accelerometer"\nmass_g = {mass}\nat_mm = [450, 100]\n'
UNWEIGHED = '\n[[setup.attached]]\nkind = "accelerometer"\nat_mm = [100, 200]\n'
EXCITER = "\n[[setup.attached]]"
"""Begins what the card says of the exciter, which it states and, by an empty list of effects, does not declare."""
WITHIN = 0.02
"""Cents by which the exact law on few vectors, and the mesh of the board as it stands, may differ from full solves."""


def card_of(tmp_path, *, lines=(), without=(), after=""):
    """The clamped card without its exciter, with lines of its material in place of others, and more after it."""
    text = Problem.from_card(FIEMME).prepared.card.text.partition(EXCITER)[0]
    kept = [line for line in text.splitlines() if not line.startswith((*without, "effects ="))]
    at = kept.index("[material]") + 1
    path = tmp_path / f"{FIEMME}.toml"
    path.write_text("\n".join([*kept[:at], *lines, *kept[at:]]) + "\n" + after, encoding="utf-8")
    return path


def by_hand(card, effects=None):
    """Rms error, cents, and moduli, Pa, of the least squares with full solves of a card with declared effects."""
    board = Problem.from_card(card, effects=effects).prepared.board
    estimate = weighted_least_squares(board)
    inputs = board.nominal()
    D_x, D_y, D_s = estimate.rigidities
    return rms(estimate.residuals), np.array(moduli(D_x, D_y, D_s, inputs["thickness"], inputs["poisson_xy"]))


def are_alike(found, error, constants):
    return rms(found.errors.in_sample) == pytest.approx(error, abs=WITHIN) and found.moduli == pytest.approx(
        constants, rel=5e-4
    )


def rms(errors):
    return float(np.sqrt(np.mean(cents(errors) ** 2)))


@pytest.fixture(scope="module")
def fiemme(tmp_path_factory):
    return Problem.from_card(card_of(tmp_path_factory.mktemp("bare"))).posed


@pytest.fixture(scope="module")
def fits(fiemme):
    """Air alone and beside shear, every model solved anew, by what is computed."""
    return {one: known_fit(fiemme, one) for one in ((AIR,), (SHEAR, AIR))}


def test_the_figures_are_those_of_full_solves_with_the_effects_declared(fits):
    """This card states exact shear moduli, and half a baffle is the mean of its prior as well as the median."""
    assert are_alike(fits[SHEAR, AIR], *by_hand(FIEMME, (SHEAR, AIR)))


def test_the_left_out_errors_are_those_of_full_refits(fiemme, fits):
    board, left_out = with_combination(fiemme.board, (AIR,)), 3
    (setup,) = board.setups
    fewer = replace(setup, readings=setup.readings[:left_out] + setup.readings[left_out + 1 :])
    values = weighted_least_squares(replace(board, setups=(fewer,))).values
    predicted = setup_model(system_of(board, setup), values).log_frequencies(values, "linear")[0]
    error = log_measured(board)[left_out] - predicted[left_out]
    assert cents(fits[AIR,].errors.left_out[left_out]) == pytest.approx(cents(error), abs=0.2, rel=2e-3)


def test_nothing_is_fitted_but_the_constants(fiemme, fits, monkeypatch):
    """However uncertain an input is: with the same middle the same fit, of three parameters."""
    sizes, fitted = [], known.refit

    def spy(law, target, scales, start):
        sizes.append(start.size)
        return fitted(law, target, scales, start)

    monkeypatch.setattr(known, "refit", spy)
    board = fiemme.board.with_priors({"thickness": Quantity.from_mean(fiemme.board.inputs["thickness"].mean, 1e-4)})
    assert "thickness" in board.uncertain_inputs
    found = known_fit(replace(fiemme, board=board), (AIR,))
    assert set(sizes) == {3}
    assert rms(found.errors.in_sample) == pytest.approx(rms(fits[AIR,].errors.in_sample), abs=WITHIN)
    assert found.moduli == pytest.approx(fits[AIR,].moduli, rel=1e-4)


def test_sizes_are_fixed_at_their_medians_and_all_else_is_left(fiemme):
    prior = Quantity.from_median(3e7, 3.0)
    broad = replace(fiemme.board, shear_yz=prior)
    sized = with_combination(broad, (SHEAR, AIR))
    added = {one.name: one.prior for one in sized.parameters if one.effect in (SHEAR, AIR)}
    assert added == {
        f"{SHEAR}.G_xz": Quantity.exact(0.62e9),
        f"{SHEAR}.G_yz": Quantity.exact(prior.median),
        f"{AIR}.density[clamped]": Quantity.exact(1.2),
        f"{AIR}.baffle[clamped]": Quantity.exact(0.5),
    }
    assert {name: sized.inputs[name] for name in broad.inputs} == broad.inputs
    assert {one.owner for one in sized.parameters if one.effect == AIR} == {Owner("setup", "clamped")}
    assert {one.owner for one in sized.parameters if one.effect == SHEAR} == {BOARD_OWNER}


def test_every_combination_is_computed_whatever_is_declared(fiemme):
    for declared in [(), (SHEAR,), (AIR, SHEAR)]:
        board = replace(fiemme.board, effects=declared)
        assert known_effects(board) == (SHEAR, AIR)
        assert known_combinations(board) == [(), (SHEAR,), (AIR,), (SHEAR, AIR)]


def test_an_exciter_of_stated_mass_is_known_and_stated_though_an_empty_list_declares_nothing():
    board = Problem.from_card(FIEMME).prepared.board
    assert board.effects == ()
    assert (known_effects(board), stated_effects(board)) == ((SHEAR, AIR, "exciter"), ("exciter",))
    assert len(known_combinations(board)) == 2**3


def test_four_known_effects_are_combined_by_up_to_three_and_all_where_the_card_states_them(fiemme, monkeypatch):
    names = (MASS, "exciter", SHEAR, AIR)
    monkeypatch.setattr(known, "known_effects", lambda _: names)
    monkeypatch.setattr(known, "stated_effects", lambda _: names[:2])
    found = known_combinations(fiemme.board)
    assert [len(one) for one in found] == [0] + 4 * [1] + 6 * [2] + 4 * [3]
    assert len(set(found)) == len(found)
    monkeypatch.setattr(known, "stated_effects", lambda _: names)
    assert known_combinations(fiemme.board) == [*found, names]


def test_a_sensor_of_stated_mass_is_shown_by_leaving_it_out(tmp_path, monkeypatch):
    problem = Problem.from_card(card_of(tmp_path, after=ATTACHED.format(mass=5))).posed
    assert problem.board.effects == (MASS,)
    as_it_stands, without = known_fit(problem), known_fit(problem, ())
    assert (as_it_stands.combination, without.effects, without.without) == ((MASS,), (), (MASS,))
    assert are_alike(without, *by_hand(FIEMME))
    assert abs(as_it_stands.moduli / without.moduli - 1.0).max() > 0.005

    told: list[float] = []
    monkeypatch.setattr(known, "known_fit", lambda _, combination: combination)
    assert known_fits(problem, told.append) == (
        None, (), (SHEAR,), (AIR,), (SHEAR, AIR), (SHEAR, MASS), (AIR, MASS), (SHEAR, AIR, MASS),
    )  # fmt: skip
    assert told == pytest.approx(np.arange(1.0, 9.0) / 8.0)


THICK = dict(zip(
    [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2), (0, 3), (2, 0), (1, 3), (2, 1), (2, 2)],
    [679.3, 1052.4, 1700.2, 1786.1, 1934.7, 2497.6, 2832.4, 3288.5, 3419.0, 3475.5, 3924.2],
    strict=True,
))  # fmt: skip
"""Hz; products of beam functions on a clamped board, 11.9 and 3.06 GPa, as if it were thin."""


def test_a_combination_with_which_nothing_bounds_the_constants_is_left_out():
    """A board of 74 mm whose modes lie above all that a board that gives in shear can reach, however stiff."""
    setup = Setup.from_frequencies(THICK, edges="clamped")
    board = Board.from_numbers(
        "thick", length_x=0.861, length_y=0.867, thickness=0.0745, density=375.0, poisson_xy=0.4, setups=[setup]
    )
    problem = pose(board, load_prior("spruce"))
    with pytest.raises(NotIdentifiableError, match=r"thick: wanted .* with transverse_shear, got none near"):
        known_fit(problem, (SHEAR,))
    assert [fit.combination for fit in known_fits(problem)] == [(), (AIR,)]
    stating = replace(problem, board=replace(board, effects=(SHEAR,)))
    assert stated_claims(stating, [known_fit(problem)]) == ()


def test_there_is_nothing_to_compare_with_where_the_board_as_it_stands_has_no_fit(fiemme, monkeypatch):
    def refuse_as_it_stands(_, combination):
        if combination is None:
            raise NotIdentifiableError("no constants")
        return combination

    monkeypatch.setattr(known, "known_fit", refuse_as_it_stands)
    assert known_fits(fiemme) == ()


def test_a_declared_size_of_the_library_is_fixed_in_combinations(tmp_path, monkeypatch):
    """Beside the board as it stands, which learns it."""
    board = Problem.from_card(card_of(tmp_path, without=SHEAR_LINES), effects=(SHEAR,)).prepared.board
    fixed = with_combination(board, (SHEAR,)).inputs
    sizes = {one.name: one.prior for one in board.uncertain if one.effect == SHEAR}
    assert len(sizes) == 2
    assert {name: fixed[name] for name in sizes} == {n: Quantity.exact(prior.median) for n, prior in sizes.items()}
    monkeypatch.setattr(known, "known_fit", lambda _, combination: combination)
    assert known_fits(SimpleNamespace(board=board)) == (None, (), (SHEAR,), (AIR,), (SHEAR, AIR))


@pytest.mark.parametrize(
    ("after", "effects", "expected"),
    [
        (ATTACHED.format(mass="{ mean = 0.6, sd = 0.1 }"), None, (MASS,)),
        (ATTACHED.format(mass=0.6), (), (MASS,)),
        (UNWEIGHED, (MASS,), ()),
        (UNWEIGHED, (), ()),
        ('\n[setup.fluid]\nbaffle = "none"\n', None, (AIR,)),
        ('\n[setup.fluid]\nbaffle = "none"\n', (SHEAR,), (SHEAR, AIR)),
        ("", (), ()),
        ("", ("grain_angle",), ()),
    ],
)
def test_what_a_card_states_or_declares_of_known_effects_counts_as_stated(tmp_path, after, effects, expected):
    board = Problem.from_card(card_of(tmp_path, after=after), effects=effects).prepared.board
    assert stated_effects(board) == expected


SUPPORT = "support_stiffness"


def test_a_declared_size_that_the_readings_tell_stands_where_they_have_it(tmp_path):
    """A support far stiffer than the median of its prior, and readings of another discretisation.

    Chi-squared of the misfit is below its 99.9 % point, and far above it at that median.
    """
    noise, stiffness = 2.0, 5e4
    board = plant(
        np.random.default_rng(1), "free-12", [SUPPORT], noise_cents=noise, fixed={SUPPORT: {"stiffness": stiffness}}
    )
    path = tmp_path / f"{board.name}.toml"
    path.write_text(board.card_text(), encoding="utf-8")
    problem = Problem.from_card(path, effects=(SUPPORT,)).posed
    (size,) = (one for one in problem.board.uncertain if one.effect == SUPPORT)
    assert size.prior.median < 0.5 * stiffness
    at_the_median = replace(problem, board=problem.board.with_priors({size.name: Quantity.exact(size.prior.median)}))
    errors = [known_fit(one).errors.in_sample for one in (problem, at_the_median)]
    squares = [one.size * (rms(one) / noise) ** 2 for one in errors]
    assert squares[0] < chi2.ppf(0.999, errors[0].size - 4) < squares[1]


MOVED = np.array([0.06, -0.02, 0.05])
"""Change of ln D that the air makes on the board below."""


@pytest.mark.slow
def test_modes_that_lie_close_keep_their_names_from_one_model_to_the_next():
    """On this board air brings two modes so close that their shapes would exchange names."""
    problem = Problem.from_card("spruce-free-3L").posed
    board = with_combination(problem.board, (AIR,))
    (solved,) = known._solve_models(problem, board, board.nominal(), np.log(problem.estimate.rigidities) + MOVED)
    (before,) = problem.posterior.models
    assert [(one.parity, one.rank) for one in solved.places] == [(one.parity, one.rank) for one in before.places]
    constants = dict(zip(RIGIDITIES, problem.estimate.rigidities * np.exp(MOVED), strict=True))
    anew = setup_model(solved.system, {**board.nominal(), **constants}, solved.plate)
    assert [one.rank for one in anew.places] != [one.rank for one in solved.places]
