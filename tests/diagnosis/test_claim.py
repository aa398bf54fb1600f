"""The claim that an error is reduced: each of its five conditions, met and not met."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from made_searches import baseline, candidate, decided, ground_of, singles, visible_of

from bayesplate.diagnosis.claim import Claim, Condition, judge_claim, nested_errors_of_board
from bayesplate.diagnosis.folds import NestedErrors, log_score, log_score_gains
from bayesplate.diagnosis.null_control import NullControl, force_choices, null_control
from bayesplate.diagnosis.search import run_search
from bayesplate.diagnosis.sensitivity import vary_priors
from bayesplate.diagnosis.verdict import rank_explanations

DIRECTION = 0.05 * np.random.default_rng(2).standard_normal(9)
CONTROL = NullControl(log_odds=np.linspace(-3.0, 0.0, 101), ratio=np.linspace(0.4, 1.4, 101))


def searched(size: float, direction: np.ndarray = DIRECTION, n_modes: int = 9, others: Sequence[np.ndarray] = ()):
    """A search on readings that hold an effect, so many times its nominal size, with a little noise."""
    base = baseline(np.random.default_rng(1), n_modes)
    directions = zip("abcd", (direction[:n_modes], *others), strict=False)
    effects = {name: candidate(base, name, each) for name, each in directions}
    ground = ground_of(base, *singles(base, effects, prior=0.5 / len(effects)), candidates=effects)
    noise = 0.004 * np.random.default_rng(3).standard_normal(n_modes)
    return run_search(ground, size * visible_of(effects["a"]) + noise)


@pytest.fixture(scope="module")
def found():
    return searched(1.5)


def judged(found, verdict, control):
    """The claim on a board whose own readings are left out here, those that alone carry something not counted."""
    folded = nested_errors_of_board(found, control, verdict.index)
    return judge_claim(found, verdict, control.without(() if folded is None else folded.carrying_readings), folded)


def folds(found, ratio: float = 0.1) -> NestedErrors:
    """Errors of a given ratio; every fold chose the effect."""
    told = nested_errors_of_board(found, CONTROL)
    return NestedErrors(told.before, ratio * told.before, np.ones_like(told.choices))


def test_an_effect_that_is_there_meets_all_of_them(found):
    claim = judged(found, decided(found), CONTROL)
    names = ["chance selection", "log score", "probability of none", "probability of another", "prior predictive"]
    assert [(one.name, one.is_met) for one in claim.conditions] == [(name, True) for name in names]
    assert claim.holds


def test_one_that_is_not_met_is_enough():
    missing = 2
    conditions = tuple(Condition("log score", 1.0, 0.5, i != missing) for i in range(5))
    assert not Claim(conditions).holds
    assert Claim(conditions[:missing] + conditions[missing + 1 :]).holds
    assert not Claim().holds


def test_the_error_falls_further_than_in_95_of_100_null_sets(found):
    for ratio, is_met in [(0.449, True), (0.451, False)]:
        told = judge_claim(found, decided(found), CONTROL, folds(found, ratio)).conditions[0]
        assert (told.name, told.is_met) == ("chance selection", is_met)
        assert (told.value, told.limit) == pytest.approx((ratio, 0.45))


def test_an_error_that_rises_is_not_reduced_though_it_rises_further_by_chance(found):
    control = replace(CONTROL, ratio=3.0 * CONTROL.ratio)
    for ratio, is_met in [(0.99, True), (1.01, False)]:
        assert judge_claim(found, decided(found), control, folds(found, ratio)).conditions[0].is_met == is_met


def test_the_log_score_rises_by_two_standard_errors_of_the_paired_differences(found):
    told = judge_claim(found, decided(found), CONTROL, folds(found)).conditions[1]
    gains = log_score_gains(found.ground, found.residual, np.ones(9, dtype=int))
    assert gains.sum() == pytest.approx(
        log_score(found.ground, 1, found.residual) - log_score(found.ground, 0, found.residual)
    )
    assert told.value == pytest.approx(gains.sum())
    assert told.limit == pytest.approx(2.0 * 3.0 * gains.std(ddof=1))
    none = replace(folds(found), choices=np.zeros((1, 9), dtype=int))
    told = judge_claim(found, decided(found), CONTROL, none).conditions[1]
    assert (told.value, told.limit, told.is_met) == (0.0, 0.0, False)


def test_a_gain_within_two_standard_errors_is_not_enough():
    weak = searched(0.12)
    told = judge_claim(weak, replace(decided(weak), index=1), CONTROL, folds(weak)).conditions[1]
    assert 0.0 < told.value < told.limit
    assert not told.is_met


@pytest.mark.parametrize(("size", "widest"), [(0.15, 2.0), (1.2, 0.5)])
def test_halved_and_doubled_priors_may_refuse_the_claim(size, widest):
    """Of a small effect none is most probable under wide priors, of one beyond its prior under narrow ones.

    Of the small one its probability is below one in twenty with the usual priors and above it with the wide ones.
    """
    one = searched(size)
    each = {factor: vary_priors(one, width=factor).probability_of_none for factor in (0.5, 1.0, 2.0)}
    assert max(each, key=each.get) == widest
    told = judged(one, replace(decided(one), index=1), CONTROL).conditions[2]
    assert told.value == pytest.approx(each[widest], rel=1e-9, abs=0.0)
    assert (told.limit, told.is_met) == (0.05, size > 1.0)
    assert each[1.0] < 0.05


def with_a_rival(size: float, alike: float):
    """A search of an effect that is there and of one whose shifts are so much like its own (cosine)."""
    own = 0.05 * np.random.default_rng(4).standard_normal(9)
    return searched(size, others=(alike * DIRECTION + np.sqrt(1.0 - alike**2) * own,))


@pytest.mark.parametrize(("alike", "is_met"), [(0.0, True), (0.95, False)])
def test_a_name_with_a_rival_is_no_claim_unless_the_rival_is_told_too(alike, is_met):
    """The rival is three times less probable, as a name asks for, and yet not out of the question."""
    found = with_a_rival(0.65, alike)
    verdict = decided(found)
    assert (verdict.word, verdict.effects) == ("named", ("a",))
    told = judged(found, verdict, CONTROL).conditions[3]
    assert (told.name, told.limit, told.is_met) == ("probability of another", 0.05, is_met)
    assert told.value >= found.probability[2]
    both = replace(verdict, explanations=rank_explanations(found))
    assert judged(found, both, CONTROL).conditions[3].value == 0.0


def test_another_effect_is_improbable_with_other_priors_too():
    """The probability of the rival is below one in twenty with the usual priors and above it with others."""
    found = with_a_rival(0.7, 0.95)
    told = judged(found, decided(found), CONTROL).conditions[3]
    assert found.probability[2] < 0.05 < told.value
    assert not told.is_met


def test_the_misfit_that_is_left_passes_its_gate(found):
    assert judged(found, decided(found), CONTROL).conditions[4].value == pytest.approx(found.p_value(1))
    off = replace(found, residual=found.residual + 0.05 * np.random.default_rng(8).standard_normal(9))
    told = judge_claim(off, replace(decided(found), index=1), CONTROL, folds(found)).conditions[4]
    assert told.value < 0.05
    assert not told.is_met


def test_nothing_is_claimed_where_nothing_was_added_or_nothing_is_left_to_judge_by(found):
    assert judged(found, replace(decided(found), index=0), CONTROL) == Claim()
    few = searched(1.5, n_modes=4)
    told = judged(few, replace(decided(few), index=1), CONTROL)
    assert [(one.value, one.is_met) for one in told.conditions[:2]] == [(None, False)] * 2
    silent = judged(found, decided(found), replace(CONTROL, ratio=None))
    assert silent.conditions[0].value is None
    assert not silent.holds


def test_the_folds_of_the_board_add_an_effect_where_the_null_simulations_call_for_one(found):
    """A quiet control adds it from odds of three to one on, a loud one from nine to one, others where they end."""
    weak = searched(0.16)
    quiet, loud, between = (replace(CONTROL, log_odds=np.full(100, level)) for level in (-50.0, 50.0, np.log(5.0)))
    added = [nested_errors_of_board(weak, control).choices.sum() for control in (quiet, between, loud)]
    assert added == [9, 8, 6]


def test_modes_that_alone_carry_something_count_in_no_condition(found):
    """Not in the ratio, not in that of the null sets, not in the score; before and after by the same modes."""
    null = null_control(found.ground, np.random.default_rng(5), 100)
    control = force_choices(found.ground, null)
    spoilt = folds(found, 0.5)
    spoilt.before[0, 3] = 1.0  # without the reading that nobody else foretells the error was hundreds of cents
    assert spoilt.ratio[0] < 0.2
    folded, same = spoilt.without((3,)), control.without((3,))
    kept = np.delete(np.arange(9), 3)
    after, before = (getattr(control.nested_errors, name)[:, kept] for name in ("after", "before"))
    assert same.ratio == pytest.approx(np.sqrt((after**2).sum(axis=1) / (before**2).sum(axis=1)))
    assert force_choices(found.ground, null, carrying_readings=(3,)).ratio == pytest.approx(same.ratio)
    gains = log_score_gains(found.ground, found.residual, np.ones(9, dtype=int))
    by_ratio, by_score, *_ = judge_claim(found, decided(found), same, folded).conditions
    assert by_ratio.value == pytest.approx(0.5)
    assert by_score.value == pytest.approx(gains[kept].sum())
    assert by_score.value != pytest.approx(gains.sum())
    scores = [log_score(found.ground, index, found.residual, (3,)) for index in (0, 1)]
    assert scores[1] - scores[0] == pytest.approx(gains[kept].sum())


def test_nothing_is_claimed_where_every_mode_alone_carries_something(found):
    none = folds(found).without(range(9))
    told = judge_claim(found, decided(found), CONTROL.without(range(9)), none)
    assert [(one.value, one.is_met) for one in told.conditions[:2]] == [(None, False)] * 2
    assert not told.holds
    assert np.isnan(none.ratio[0])


def test_the_folds_of_the_board_do_not_count_what_carries_something():
    """By the leverages of the search: an effect that shifts one mode alone."""
    alone = searched(1.5, 0.2 * np.eye(9)[4])
    folded = nested_errors_of_board(alone, CONTROL, 1)
    assert set(nested_errors_of_board(alone, CONTROL).carrying_readings) | {4} == set(folded.carrying_readings)
    assert not folded.is_counted[0, 4]
    claim = judged(alone, replace(decided(alone), index=1), CONTROL)
    gains = log_score_gains(alone.ground, alone.residual, folded.choices[0], folded.carrying_readings)
    assert claim.conditions[1].value == pytest.approx(gains.sum())
