"""The decision table row by row, on searches whose probabilities are set by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import bare, baseline, candidate, decided, exchanged, found_among, ground_of, singles, visible_of

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.hypotheses import RELABELLING, Hypothesis, Swap
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.search import PASSES, Found
from bayesplate.diagnosis.shifts import nothing, together
from bayesplate.diagnosis.sizes import at_limit, size_posterior
from bayesplate.diagnosis.terms import noise_grid
from bayesplate.diagnosis.verdict import NOTHING_LEFT, alternatives, answers

NAMES = ("a", "b", "c")
PAIR = ("a", "b")
SWAPPED = (RELABELLING,)
BOUNDED = Quantity.from_mean(0.4, 0.15, "normal", lower=0.0, upper=0.9)


@pytest.fixture(scope="module")
def base():
    return baseline(np.random.default_rng(1))


def found_with(base, probability, size=0.05, residual=None, prior=None):
    """A search that found given probabilities by members; readings of which "a" at its nominal size is the cause."""
    directions = size * np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0][:3]
    chosen = {} if prior is None else {"prior": prior}
    candidates = {n: candidate(base, n, d, **chosen) for n, d in zip(NAMES, directions, strict=True)}
    every, swap = singles(base, candidates), Swap(1, 2)
    both = together(candidates["a"].coarse, candidates["b"].coarse)
    every += [Hypothesis(SWAPPED, 0.1, nothing(6), every[0].noise, swap.applied(base), swap)]
    every += [Hypothesis(PAIR, 0.1, both, every[0].noise, base)]
    residual = visible_of(candidates["a"]) if residual is None else residual
    return found_among(base, candidates, every, [probability.get(one.members, 0.0) for one in every], residual)


NOTHING = np.zeros(6)


def large(base):
    """Readings that neither noise nor any effect explains."""
    return 0.3 * base.log_frequency * np.array([1, -1, 1, 1, -1, -1])


def test_none_needed(base):
    verdict = decided(found_with(base, {(): 0.1, ("a",): 0.9}, residual=NOTHING))
    assert verdict.word == "none needed"
    assert (verdict.effects, verdict.index) == ((), 0)
    assert verdict.best.members == ("a",)


def test_undetectable_if_every_effect_is_below_sight_and_not_if_one_could_be_seen(base):
    found = found_with(base, {(): 0.5, ("a",): 0.5}, size=1e-4, residual=NOTHING)
    assert decided(found).word == "undetectable"
    seen = found_with(base, {}, residual=NOTHING).ground.candidates["b"]
    ground = replace(found.ground, candidates={**found.ground.candidates, "b": seen})
    assert decided(replace(found, ground=ground)).word == "none needed"


@pytest.mark.parametrize(("times", "is_seen"), [(0.95, False), (1.05, True)])
def test_an_effect_is_seen_from_twice_the_noise_over_root_n_on(base, times, is_seen):
    """Its visible rms, for the verdict; its trace in units of the noise, for being one of two."""
    one = candidate(base, "a", np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0][0])
    rms = float(np.sqrt(np.mean((visible_of(one) / base.scales) ** 2)))
    factor = times * 2.0 / np.sqrt(6.0) / rms
    seen = replace(one.signature, visible=factor * one.signature.visible)
    ground = ground_of(base, candidates={"a": replace(one, signature=seen, trace=factor * one.trace)})
    assert seen.is_below_detection_limit is not is_seen
    assert ground.paired == (("a",) if is_seen else ())


def test_undetectable_where_three_modes_leave_nothing_to_judge_by():
    few = baseline(np.random.default_rng(1), 3)
    effects = {"a": candidate(few, "a", np.zeros(3))}
    verdict = decided(found_among(few, effects, singles(few, effects), [0.01, 0.99], np.zeros(3)))
    assert (verdict.word, verdict.reason) == ("undetectable", NOTHING_LEFT)


def test_unexplained_if_the_bare_model_fails_and_what_comes_nearest_is_told_where_something_is_needed(base):
    """The best of the answers is as improbable as chance leaves it, or fails the gate."""
    idle = decided(found_with(base, {(): 0.1, ("a",): 0.9}, residual=large(base)))
    assert (idle.word, idle.effects, idle.index, idle.nearest, idle.fitted_again) == ("unexplained", (), 0, None, ())
    found = found_with(base, {("a",): 1.0}, residual=large(base))
    assert found.p_value(1) < PASSES
    needed = decided(found)
    assert (needed.word, needed.effects, needed.index, needed.nearest) == ("unexplained", (), 0, needed.best)
    assert "p < 0.001" in needed.reason


def test_the_bound_for_none_is_a_tenth(base):
    assert decided(found_with(base, {(): 0.0999, ("a",): 0.9001})).word == "named"
    assert decided(found_with(base, {(): 0.1, ("a",): 0.9})).word != "named"


def test_named_from_three_times_the_next_on_and_a_group_below(base):
    verdict = decided(found_with(base, {("a",): 0.75, ("b",): 0.25}))
    assert (verdict.word, verdict.effects, verdict.index) == ("named", ("a",), 1)
    verdict = decided(found_with(base, {("a",): 0.70, ("b",): 0.24, ("c",): 0.03}))
    assert (verdict.word, verdict.effects, verdict.index) == ("indistinguishable group", ("a", "b"), 1)


def test_a_group_holds_what_is_within_a_factor_ten(base):
    within = found_with(base, {("a",): 0.60, ("b",): 0.33, ("c",): 0.061})
    beyond = found_with(base, {("a",): 0.60, ("b",): 0.33, ("c",): 0.059})
    assert decided(within).effects == ("a", "b", "c")
    assert decided(beyond).effects == ("a", "b")
    assert [one.members for one in alternatives(beyond, answers(beyond))] == [("a",), ("b",)]


def test_a_pair_stands_for_itself_from_three_times_its_better_member_on_and_else_counts_for_that(base):
    verdict = decided(found_with(base, {("a",): 0.2, ("b",): 0.1, PAIR: 0.7}))
    assert (verdict.word, verdict.effects, verdict.index) == ("named", PAIR, 5)
    found = found_with(base, {("a",): 0.3, ("b",): 0.15, PAIR: 0.55})
    best = answers(found)[0]
    assert (best.members, best.index) == (("a",), 1)
    assert best.support == pytest.approx(0.85)
    assert decided(found).effects == ("a",)
    assert sum(one.support for one in answers(found)) == pytest.approx(1.0)


def test_a_pair_that_the_card_states_stands_for_itself_however_improbable(base, monkeypatch):
    monkeypatch.setattr("bayesplate.diagnosis.verdict.are_stated", lambda board, members: members == PAIR)
    found = found_with(base, {("a",): 0.9, ("b",): 0.09, PAIR: 0.01})
    assert {one.members: round(one.support, 6) for one in answers(found)}[PAIR] == 0.01
    assert answers(found)[0].support == pytest.approx(0.9)


def test_exchanged_labels_can_win(base):
    swap = Swap(1, 2)
    mixed = exchanged(base, swap, np.zeros((1, 6)))[0]
    verdict = decided(found_with(base, {SWAPPED: 0.9, ("a",): 0.1}, residual=mixed))
    assert (verdict.word, verdict.effects, verdict.index) == ("named", SWAPPED, 4)


@pytest.mark.parametrize(("z", "limited"), [(0.0, False), (2.4, False), (2.6, True), (-2.55, True)])
def test_a_size_at_the_limit_of_its_range_is_never_named(base, z, limited):
    """A Poisson ratio between 0 and 0.9: most probable at 0.4, 0.76, 0.79 and 0.02."""
    found = found_with(base, {("a",): 1.0}, size=1.0, prior=BOUNDED)
    of_a = found.ground.candidates["a"]
    cell = int(np.argmin(np.abs(of_a.fine.z[:, 0] - z)))
    found = replace(found, residual=of_a.fine.shift[cell])
    verdict = decided(found)
    assert bool(at_limit(found, 1)) is limited
    assert verdict.word == ("unexplained" if limited else "named")
    assert ("limit" in verdict.reason) is limited


def test_zero_is_no_limit_of_a_size_that_may_be_nothing_and_a_limit_is_found_in_a_pair_too(base):
    assert at_limit(found_with(base, {("a",): 1.0}, residual=NOTHING), 1) == ""
    found = found_with(base, {PAIR: 1.0}, size=1.0, prior=BOUNDED)
    of_b = found.ground.candidates["b"]
    found = replace(found, residual=of_b.coarse.shift[np.argmax(of_b.coarse.z[:, 0])])
    assert at_limit(found, 5) != ""


@pytest.mark.parametrize(
    ("members", "index", "size", "limited"),
    [(("a",), 1, 1.9, False), (("a",), 1, 1.98, True), (PAIR, 5, 1.9, False), (PAIR, 5, 2.05, True)],
)
def test_a_cell_may_be_wider_than_what_counts_as_the_limit(base, members, index, size, limited):
    """An angle of up to two standard deviations: the last of nine cells has three hundredths of its prior.

    A two hundredth lies between 1.956 and the bound.
    """
    prior = Quantity.from_mean(0.0, 1.0, "normal", lower=0.0, upper=2.0)
    found = found_with(base, {members: 1.0}, size=1.0, prior=prior)
    other = 0.0 if len(members) == 1 else visible_of(found.ground.candidates["b"])
    found = replace(found, residual=size * visible_of(found.ground.candidates["a"]) + other)
    assert bool(at_limit(found, index)) is limited


@pytest.mark.parametrize("share", [0.55, 0.45])
def test_a_form_that_is_not_the_likelier_one_may_be_at_its_limit(base, share):
    """Two forms of one shift, the second with a bound next to it; told only where it has the larger share."""
    wide, narrow = (Quantity.from_mean(0.0, 1.0, "normal", lower=0.0, upper=top) for top in (3.0, 1.0))
    direction = np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0][0]
    one, other = (candidate(base, "a", direction, prior=prior) for prior in (wide, narrow))
    both = {
        key: np.concatenate([getattr(one.fine, key), getattr(other.fine, key)])
        for key in ("weights", "shift", "slopes", "moved", "moved_slopes", "form", "z", "z_slopes")
    }
    both["form"][one.fine.n_cells :] = 1
    table = replace(one.fine, **both)
    levels = noise_grid(base.board)

    def found_by(weights):
        changed = replace(table, weights=weights)
        whole = replace(one, laws=(*one.laws, *other.laws), fine=changed)
        every = bare(base, levels), Hypothesis(("a",), 0.5, changed, levels, base)
        ground = ground_of(base, *every, candidates={"a": whole})
        return Found(ground, 1.005 * visible_of(one), np.zeros(2), np.ones(2))

    even = found_by(table.weights / 2.0)
    first, second = (size_posterior(even, 1, 0, form, 0)[0].sum() for form in (0, 1))
    odds = share / (1.0 - share) * first / second
    weights = np.where(table.form == 1, odds, 1.0) * table.weights
    found = found_by(weights / weights.sum())
    assert size_posterior(found, 1, 0, 1, 0)[0].sum() == pytest.approx(share)
    assert bool(at_limit(found, 1)) is (share > 0.5)


def test_without_candidates_there_is_nothing_to_name(base):
    ground = ground_of(base, bare(base, noise_grid(base.board)))
    calm = Found(ground, NOTHING, np.zeros(1), np.ones(1))
    assert decided(calm).word == "none needed"
    assert decided(calm).best is None
    assert decided(replace(calm, residual=large(base))).word == "unexplained"


def test_needed_is_what_the_null_simulations_do_not_reach(base):
    """Odds against no effect of two to one: beyond 98 % of the null sets, or within them."""
    found = found_with(base, {(): 1 / 3, ("a",): 2 / 3})
    calm, loud = (NullControl(np.linspace(-4.0, top, 101), None) for top in (0.0, 2.0))
    assert decided(found, calm).word == "named"
    assert decided(found, calm).is_needed
    assert decided(found, loud).word != "named"
    assert not decided(found, loud).is_needed


def turned(base, probability, words="if the noise is larger"):
    return words, found_with(base, probability)


def test_a_name_that_another_assumption_changes_is_a_group_with_what_it_turned_into(base):
    """Unless it stays three times as probable as every other there."""
    found = found_with(base, {("a",): 0.9, ("b",): 0.06, ("c",): 0.04})
    stays = turned(base, {("a",): 0.75, ("b",): 0.25})
    changes = turned(base, {("a",): 0.70, ("b",): 0.28, ("c",): 0.02})
    assert decided(found, others=[stays]).word == "named"
    assert decided(found, others=[stays]).stands_for == (answers(found)[0],)
    told = decided(found, others=[stays, changes])
    assert (told.word, told.effects, told.index) == ("indistinguishable group", ("a", "b"), 1)
    assert [(one.members, round(one.support, 6)) for one in told.stands_for] == [(("a",), 0.9), (("b",), 0.06)]
    assert told.reason == "if the noise is larger b may be as probable"
    gone = turned(base, {(): 0.2, ("c",): 0.8})
    assert decided(found, others=[gone]).effects == ("a", "c")


def test_a_name_that_has_no_support_at_all_there_is_turned_by_the_three_best(base):
    found = found_with(base, {("a",): 0.9, ("b",): 0.04, ("c",): 0.06})
    told = decided(found, others=[turned(base, {("b",): 0.06, ("c",): 0.30, SWAPPED: 0.33, PAIR: 0.31})])
    assert [one.members for one in told.stands_for] == [("a",), SWAPPED, PAIR, ("c",)]
    missing = found_with(base, {})  # which does not know of it at all
    alone = replace(missing.ground, hypotheses=missing.ground.hypotheses[2:4])
    other = replace(missing, ground=alone, probability=np.array([0.2, 0.1]))
    assert decided(found, others=[("as it is", other)]).word == "indistinguishable group"


def test_the_searches_that_a_name_has_to_survive_are_made_only_for_a_name(base):
    def refused():
        raise AssertionError("nothing is named")
        yield

    group = found_with(base, {("a",): 0.5, ("b",): 0.5})
    assert decided(group, others=refused()).word == "indistinguishable group"
