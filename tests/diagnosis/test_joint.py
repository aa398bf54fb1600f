"""Two effects at once: found where neither alone lowers the error, and solved together where shifts do not add."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from full_refits import full_refit
from generator.boards import plant
from made_searches import decided, visible_of
from validation.trial.cells import SENSORS
from validation.trial.shared import baseline_of_card

from bayesplate.commands.problem import Problem
from bayesplate.diagnosis import joint
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.draws import draw_terms
from bayesplate.diagnosis.forms import forms
from bayesplate.diagnosis.joint import with_joint_pairs
from bayesplate.diagnosis.search import LEAST_P_VALUE, prepare_search, run_search
from bayesplate.diagnosis.sensitivity import exact_log_frequencies
from bayesplate.diagnosis.shifts import combine_cells, joint_law, joint_table
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import full_log_frequencies, setup_model
from bayesplate.frequencies.system import system_of

PAIR = {"fluid_loading", "membrane_tension"}
CENT = 1.0
TRIED = (*PAIR, "clamp_rotation", "density_gradient")


@pytest.fixture(scope="module")
def ground():
    """A clamped guitar top in air, under tension, noise of 5 cents: one slows all modes, the other speeds them up."""
    planted = plant(np.random.default_rng(0), "clamped-9", tuple(sorted(PAIR)), 2.0, 5.0, sensor=SENSORS["clamped-9"])
    return prepare_search(baseline_of_card(planted), effects=TRIED)


@pytest.fixture(scope="module")
def solved(ground):
    """The search, its ground with the pair solved together, and which hypothesis that is."""
    found = run_search(ground)
    index = next(i for i, one in enumerate(ground.hypotheses) if set(one.members) == PAIR)
    return found, with_joint_pairs(found, ground), index


def test_a_pair_is_found_of_which_neither_alone_lowers_the_misfit(solved):
    found, both, index = solved
    ground, base = found.ground, found.ground.baseline

    def squares(residual):
        return np.sum(((residual - base.slopes @ (base.absorption @ residual)) / base.scales) ** 2)

    beside = base.residual - visible_of(ground.candidates["fluid_loading"])
    assert squares(beside) > 2.0 * squares(base.residual)  # the error rises with what is there
    evidence = {one.members: value for one, value in zip(ground.hypotheses, found.log_evidence, strict=True)}
    assert all(evidence[(name,)] < evidence[()] for name in PAIR)
    changed = [i for i, one in enumerate(both.hypotheses) if one is not ground.hypotheses[i]]
    assert changed == [i for i, one in enumerate(both.hypotheses) if one.joint] == [index]
    assert with_joint_pairs(found, both) is both  # once is enough
    verdict = decided(run_search(both))
    assert (verdict.word, set(verdict.effects)) == ("named", PAIR)


def test_a_pair_is_formed_of_what_can_be_seen_not_of_what_does_well_alone(ground):
    seen = {name for name in ground.candidates if ground.candidates[name].trace >= 2.0}
    assert PAIR <= seen < set(ground.candidates)
    pairs = {frozenset(one.members) for one in ground.hypotheses if len(one.members) == 2}
    assert pairs == set(map(frozenset, combinations(seen, 2)))


def test_both_at_once_are_a_full_solve_of_both(solved):
    """At a place that is in the middle of no cell: the tables' tangents have to hold as well."""
    _, ground, index = solved
    members = ground.hypotheses[index].members
    place, law = next(iter(ground.hypotheses[index].joint.items()))
    base = ground.baseline
    one, other = (ground.candidates[name] for name in members)
    added = combine_cells(one.coarse, other.coarse)
    table = joint_table(base, added, {place: law})
    first, second = np.divmod(np.arange(table.n_cells), other.coarse.n_cells)
    at = np.hstack([one.coarse.z[first], other.coarse.z[second]])
    width = np.hstack([one.coarse.z_slopes[first], other.coarse.z_slopes[second]])
    wanted = np.full(at.shape[1], 1.0)
    away = ((at - wanted) ** 2).sum(axis=1)
    away[(one.coarse.form[first] != place[0]) | (other.coarse.form[second] != place[1])] = np.inf
    cell = int(np.argmin(away))
    step = 0.5 * np.ones(at.shape[1])
    z = at[cell] + step * width[cell]
    values = {free.name: float(free.prior.value(z[i])) for i, free in enumerate(law.form.free)}
    exact, moved = full_refit(base, law.form.board, values, 1 / base.scales)

    assert np.abs(cents(table.shift[cell] + table.slopes[cell] @ step - exact)).max() < CENT
    assert np.abs(table.moved[cell] + table.moved_slopes[cell] @ step - moved).max() < 0.01
    assert np.abs(cents(added.shift[cell] + added.slopes[cell] @ step - exact)).max() > CENT  # the negative control


def test_draws_of_a_pair_that_was_solved_have_its_law(solved):
    found, ground, index = solved
    drawn = draw_terms(run_search(ground), index, np.random.default_rng(1), 8)
    exact = exact_log_frequencies(run_search(ground), index, drawn)
    apart = exact_log_frequencies(found, index, drawn)
    base = ground.baseline
    first, second = (ground.candidates[name].coarse for name in ground.hypotheses[index].members)
    of_first, of_second = np.divmod(drawn.cells, second.n_cells)
    at = np.hstack([first.z[of_first], second.z[of_second]])
    width = np.hstack([first.z_slopes[of_first], second.z_slopes[of_second]])
    places = list(zip(first.form[of_first].tolist(), second.form[of_second].tolist(), strict=True))
    for draw, place in enumerate(places):
        law = ground.hypotheses[index].joint[place]
        values = {}
        for i, free in enumerate(law.form.free):
            size = free.prior.value(at[draw, i] + width[draw, i] * drawn.within[draw, i])
            values[free.name] = np.clip(np.array([size]), free.prior.lower, free.prior.upper)
        (direct,) = law.mode_log_frequencies(base, drawn.log_rigidities[[draw]], values)
        direct += base.possible_modes.input_slopes @ (drawn.inputs[draw] - base.possible_modes.inputs)
        assert np.abs(exact[draw] - direct).max() < 1e-9
    assert np.abs(cents(apart - exact)).max() > CENT


def test_only_plausible_pairs_are_solved_together(solved, monkeypatch):
    """From a probability of a twentieth on; where nothing explains the readings up to three, however improbable."""
    found, _, index = solved
    monkeypatch.setattr(joint, "joint_law", lambda baseline, *forms: forms)
    monkeypatch.setattr(joint, "joint_table", lambda baseline, table, laws: table)

    def asked(residual, share):
        shares = np.zeros(found.probability.size)
        shares[0], shares[index] = 1.0, share
        told = replace(found, residual=residual, probability=shares)
        return told, [i for i, one in enumerate(with_joint_pairs(told, found.ground).hypotheses) if one.joint]

    quiet, loud = np.zeros(found.residual.size), np.random.default_rng(1).choice([-0.2, 0.2], found.residual.size)
    for share, pairs in ((0.049, []), (0.051, [index])):
        told, solved_pairs = asked(quiet, share)
        assert (told.p_value(0) >= LEAST_P_VALUE, solved_pairs) == (True, pairs)
    told, solved_pairs = asked(loud, 0.049)
    assert told.p_value(0) < LEAST_P_VALUE  # the sum of shifts may be why
    assert (index in solved_pairs, len(solved_pairs)) == (True, 3)


@pytest.mark.slow
def test_air_and_exciter_keep_the_labels_of_the_board_without_either():
    """The air has an exact density: where both are absent it is too, or modes are followed from those of a board in it.

    Against full solves: a law errs by half a cent, and a place between nodes by another half.
    """
    base = baseline_of(Problem.from_card("fiemme-spruce-clamped").posed)
    tried = forms(base.board)
    (air,), (exciter,) = tried["fluid_loading"], tried["exciter"]
    law = joint_law(base, air, exciter)
    sizes = {"fluid_loading.baffle": 0.2, "exciter.suspension": 2700.0, "exciter.place_x": 0.3, "exciter.place_y": 0.2}
    sizes = {f"{name}[clamped]": np.array([value]) for name, value in sizes.items()}
    found = law.log_frequencies(base, base.log_rigidities[None], sizes)[0]

    board = law.form.board
    values = {**board.nominal(), **base.values, **{name: value[0] for name, value in sizes.items()}}
    model = setup_model(system_of(board, board.setups[0]), values)
    assert np.abs(cents(found - full_log_frequencies(model, values))).max() < CENT


def test_a_board_that_is_cupped_and_twisted_is_not_taken_for_one_on_a_stiff_support():
    """Both raise the lowest modes; cup or twist alone would fit worse than the support, together they fit exactly."""
    shape = {"cup": 1.5e-3, "bow": 1.2e-3, "twist": 8e-3}
    planted = plant(np.random.default_rng(0), "free-12", ["warp"], 1.0, 5.0, fixed={"warp": shape})
    exact = replace(planted, readings=planted.exact)

    result = run_search(prepare_search(baseline_of_card(exact), effects=("warp", "support_stiffness")))

    evidence = {
        hypothesis.members: value
        for hypothesis, value in zip(result.ground.hypotheses, result.log_evidence, strict=True)
    }
    assert evidence[("warp",)] > evidence[("support_stiffness",)] > evidence[()]
