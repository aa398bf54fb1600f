"""Two effects at once: found where neither alone lowers the error, and solved together where shifts do not add."""

from __future__ import annotations

from dataclasses import replace

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
from bayesplate.diagnosis.search import PASSES, prepare_search, search
from bayesplate.diagnosis.sensitivity import exact_log_frequencies
from bayesplate.diagnosis.shifts import joint_law, joint_table, together
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
    return prepare_search(baseline_of_card(planted), tried=TRIED)


def test_a_pair_is_found_of_which_neither_alone_lowers_the_misfit(ground):
    found = search(ground)
    base = ground.baseline

    def squares(residual):
        return np.sum(((residual - base.slopes @ (base.absorbing @ residual)) / base.scales) ** 2)

    beside = base.residual - visible_of(ground.candidates["fluid_loading"])
    assert squares(beside) > 2.0 * squares(base.residual)  # the error rises with what is there
    evidence = {one.members: value for one, value in zip(ground.hypotheses, found.log_evidence, strict=True)}
    assert all(evidence[(name,)] < evidence[()] for name in PAIR)
    both = with_joint_pairs(found, ground)
    assert [set(one.members) for one in both.hypotheses if one.joint] == [PAIR]
    verdict = decided(search(both))
    assert (verdict.word, set(verdict.effects)) == ("named", PAIR)


def test_a_pair_is_formed_of_what_can_be_seen_not_of_what_does_well_alone(ground):
    seen = {name for name in ground.candidates if ground.candidates[name].trace >= 2.0}
    assert seen >= PAIR
    assert len(seen) < len(ground.candidates)
    pairs = {frozenset(one.members) for one in ground.hypotheses if len(one.members) == 2}
    assert pairs == {frozenset((a, b)) for a in seen for b in seen if a != b}


@pytest.fixture(scope="module")
def solved(ground):
    """The search, its ground with the pair solved together, and which hypothesis that is."""
    found = search(ground)
    index = next(i for i, one in enumerate(ground.hypotheses) if set(one.members) == PAIR)
    found.probability[:] = np.where(np.arange(found.probability.size) == index, 1.0, 0.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint, "PLAUSIBLE", 0.0)
        patch.setattr(joint, "_MOST_PAIRS", 1)
        patch.setattr(joint, "_WORTH", 0.3)  # one form of the tension is enough here
        return found, with_joint_pairs(found, ground), index


def test_both_at_once_are_a_full_solve_of_both(solved):
    """At a place that is in the middle of no cell: the tables' tangents have to hold as well."""
    _, ground, index = solved
    members = ground.hypotheses[index].members
    place, law = next(iter(ground.hypotheses[index].joint.items()))
    base = ground.baseline
    one, other = (ground.candidates[name] for name in members)
    added = together(one.coarse, other.coarse)
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
    drawn = draw_terms(search(ground), index, np.random.default_rng(1), 8)
    exact = exact_log_frequencies(search(ground), index, drawn)
    apart = exact_log_frequencies(found, index, drawn)
    law = next(iter(ground.hypotheses[index].joint.values()))
    base, one = ground.baseline, ground.candidates[ground.hypotheses[index].members[0]]
    first, other = one.coarse, ground.candidates[ground.hypotheses[index].members[1]].coarse
    cells = np.divmod(drawn.cells, other.n_cells)
    z = np.hstack(
        [
            first.z[cells[0]] + first.z_slopes[cells[0]] * drawn.within[:, : first.z.shape[1]],
            other.z[cells[1]] + other.z_slopes[cells[1]] * drawn.within[:, first.z.shape[1] :],
        ]
    )
    values = {free.name: free.prior.value(z[:, i]) for i, free in enumerate(law.form.free)}
    values = {
        n: np.clip(v, free.prior.lower, free.prior.upper)
        for (n, v), free in zip(values.items(), law.form.free, strict=True)
    }
    direct = law.every_log_frequency(base, drawn.log_rigidities, values)

    assert np.abs(exact - (direct + (drawn.inputs - base.every.inputs) @ base.every.input_slopes.T)).max() < 1e-9
    assert np.abs(cents(apart - exact)).max() > CENT


def test_only_plausible_pairs_are_solved_together(solved, monkeypatch):
    found, ground, index = solved
    assert [
        i for i, (a, b) in enumerate(zip(ground.hypotheses, found.ground.hypotheses, strict=True)) if a is not b
    ] == [index]
    assert with_joint_pairs(found, ground) is ground  # once is enough
    found.probability[:] = np.where(np.arange(found.probability.size) == 0, 1.0, joint.PLAUSIBLE / 2)
    quiet = replace(found, residual=np.zeros(found.residual.size))
    assert quiet.p_value(0) >= PASSES
    assert with_joint_pairs(quiet, found.ground) is found.ground
    loud = replace(found, residual=0.2 * np.sign(np.random.default_rng(1).standard_normal(found.residual.size)))
    assert loud.p_value(0) < PASSES  # nothing explains these: the sum of shifts may be why
    monkeypatch.setattr(joint, "_MOST_PAIRS", 1)
    monkeypatch.setattr(joint, "_WORTH", 0.3)
    assert len([one for one in with_joint_pairs(loud, found.ground).hypotheses if one.joint]) == 1


def test_pairs_with_shear_are_left_to_the_sampler(finnish_few):
    """Each takes minutes to solve on a board with many peaks."""
    laws = {name: one.laws[0] for name, one in finnish_few.ground.candidates.items()}

    assert not joint._is_cheap(laws["transverse_shear"])
    assert joint._is_cheap(laws["clamp_translation"])


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
