"""The decision table row by row, on searches whose probabilities are set by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import (
    BEYOND_NOISE,
    QUIET,
    bare,
    baseline,
    candidate,
    decided,
    exchanged,
    found_with,
    ground_of,
    visible_of,
)

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.hypotheses import RELABELLING, Hypothesis, Swap
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.search import SearchResult
from bayesplate.diagnosis.sizes import likely_forms, size_at_limit, size_posterior
from bayesplate.diagnosis.terms import noise_grid
from bayesplate.diagnosis.verdict import rank_explanations

PAIR = ("a", "b")
SWAPPED = (RELABELLING,)
BOUNDED = Quantity.from_mean(0.4, 0.15, "normal", lower=0.0, upper=0.9)


@pytest.fixture(scope="module")
def base():
    return baseline(np.random.default_rng(1))


MIXED = exchanged(baseline(np.random.default_rng(1)), Swap(1, 2), np.zeros((1, 6)))[0]
"""Residual of readings of which two have each other's labels."""

DECISIONS = {
    "none is needed from a probability of a tenth on": (QUIET, {(): 0.1, ("a",): 0.9}, "none needed", (), 0),
    "nor then, though the bare model fails": (BEYOND_NOISE, {(): 0.1, ("a",): 0.9}, "unexplained", (), 0),
    "the best fails the gate": (BEYOND_NOISE, {("a",): 1.0}, "unexplained", (), 0),
    "below a tenth it is named": (None, {(): 0.0999, ("a",): 0.9001}, "named", ("a",), 1),
    "three times the next": (None, {("a",): 0.75, ("b",): 0.25}, "named", ("a",), 1),
    "less than that": (None, {("a",): 0.7, ("b",): 0.24, ("c",): 0.03}, "indistinguishable group", ("a", "b"), 1),
    "within ten": (None, {("a",): 0.6, ("b",): 0.33, ("c",): 0.061}, "indistinguishable group", ("a", "b", "c"), 1),
    "beyond ten": (None, {("a",): 0.6, ("b",): 0.33, ("c",): 0.059}, "indistinguishable group", ("a", "b"), 1),
    "a pair three times its better member": (None, {("a",): 0.2, ("b",): 0.1, PAIR: 0.7}, "named", PAIR, 5),
    "a pair counts for its better member": (None, {("a",): 0.3, ("b",): 0.15, PAIR: 0.55}, "named", ("a",), 1),
    "exchanged labels": (MIXED, {SWAPPED: 0.9, ("a",): 0.1}, "named", SWAPPED, 4),
}
"""Readings (those of "a" where none are given), probabilities, and the verdict with its effects and its hypothesis."""


@pytest.mark.parametrize("case", DECISIONS)
def test_the_decision_table(case):
    residual, probability, *expected = DECISIONS[case]
    found = found_with(probability, residual=residual)
    verdict = decided(found)
    assert [verdict.word, verdict.effects, verdict.index] == expected
    assert verdict.best == rank_explanations(found)[0]
    is_nearest = case == "the best fails the gate"
    assert verdict.nearest == (verdict.best if is_nearest else None)
    assert verdict.refitted_explanations == ((verdict.best,) if is_nearest else verdict.explanations)
    assert sum(one.support for one in rank_explanations(found)) == pytest.approx(sum(found.probability[1:]))


def test_the_reason_of_a_misfit_and_what_a_pair_adds_to_its_better_member():
    assert "p < 0.001" in decided(found_with({("a",): 1.0}, residual=BEYOND_NOISE)).reason
    best = rank_explanations(found_with({("a",): 0.3, ("b",): 0.15, PAIR: 0.55}))[0]
    assert (best.members, best.index, best.support) == (("a",), 1, pytest.approx(0.85))


def test_undetectable_if_every_effect_is_below_sight_and_not_if_one_could_be_seen():
    found = found_with({(): 0.5, ("a",): 0.5}, size=1e-4, residual=QUIET)
    assert decided(found).word == "undetectable"
    seen = found_with({}).ground.candidates["b"]
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


def test_a_pair_that_the_card_states_stands_for_itself_however_improbable(monkeypatch):
    monkeypatch.setattr("bayesplate.diagnosis.verdict.are_stated", lambda board, members: members == PAIR)
    found = found_with({("a",): 0.9, ("b",): 0.09, PAIR: 0.01})
    assert {one.members: round(one.support, 6) for one in rank_explanations(found)}[PAIR] == 0.01
    assert rank_explanations(found)[0].support == pytest.approx(0.9)


def test_a_size_at_the_limit_of_its_range_is_never_named():
    """A Poisson ratio between 0 and 0.9: most probable at 0.76 and 0.79."""
    found = found_with({("a",): 1.0}, size=1.0, prior=BOUNDED)
    cells = found.ground.candidates["a"].fine
    for z, word in [(2.4, "named"), (2.6, "unexplained")]:
        verdict = decided(replace(found, residual=cells.shift[int(np.argmin(np.abs(cells.z[:, 0] - z)))]))
        assert (verdict.word, verdict.is_needed) == (word, True)
        assert verdict.reason.startswith("a fits only at the limit of its range: size = 0.7") is (word != "named")
    at_zero = found_with({("a",): 1.0}, size=1.0, residual=QUIET)
    assert size_at_limit(at_zero, 1) == ""  # zero is no limit of a size that may be nothing


@pytest.mark.parametrize(
    ("members", "index", "size", "limited"),
    [(("a",), 1, 1.9, False), (("a",), 1, 1.98, True), (PAIR, 5, 1.9, False), (PAIR, 5, 2.05, True)],
)
def test_a_cell_may_be_wider_than_what_counts_as_the_limit(members, index, size, limited):
    """An angle of up to two standard deviations: the last of nine cells has three hundredths of its prior.

    A two hundredth lies between 1.956 and the bound. Of a pair it is the second effect that is looked at.
    """
    prior = Quantity.from_mean(0.0, 1.0, "normal", lower=0.0, upper=2.0)
    found = found_with({members: 1.0}, size=1.0, prior=prior)
    *others, last = (visible_of(found.ground.candidates[name]) for name in members)
    assert bool(size_at_limit(replace(found, residual=size * last + sum(others)), index)) is limited


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
        return SearchResult(ground, 1.005 * visible_of(one), np.zeros(2), np.ones(2))

    even = found_by(table.weights / 2.0)
    first, second = (size_posterior(even, 1, 0, form, 0)[0].sum() for form in (0, 1))
    odds = share / (1.0 - share) * first / second
    weights = np.where(table.form == 1, odds, 1.0) * table.weights
    found = found_by(weights / weights.sum())
    assert size_posterior(found, 1, 0, 1, 0)[0].sum() == pytest.approx(share)
    assert bool(size_at_limit(found, 1)) is (share > 0.5)
    assert likely_forms(found, 1) == [(other if share > 0.5 else one).laws[0].form]


def test_without_candidates_there_is_nothing_to_name(base):
    ground = ground_of(base, bare(base, noise_grid(base.board)))
    for residual, word in [(QUIET, "none needed"), (BEYOND_NOISE, "unexplained")]:
        verdict = decided(SearchResult(ground, residual, np.zeros(1), np.ones(1)))
        assert (verdict.word, verdict.best) == (word, None)


def test_needed_is_what_the_null_simulations_do_not_reach_and_is_three_times_as_probable_as_nothing():
    """Odds against no effect of four to one, beyond 98 % of the null sets or within them; and odds of two to one."""
    for p_none, top, is_needed in [(0.2, 0.0, True), (0.2, 2.0, False), (1 / 3, 0.0, False)]:
        found = found_with({(): p_none, ("a",): 1.0 - p_none})
        verdict = decided(found, NullControl(np.linspace(-4.0, top, 101), None))
        assert (verdict.word == "named") is verdict.is_needed is is_needed


def turned(probability, words="if the noise is larger"):
    return words, found_with(probability)


def test_a_name_that_another_assumption_changes_is_a_group_with_what_it_turned_into():
    """Unless it stays three times as probable as every other there."""
    found = found_with({("a",): 0.9, ("b",): 0.06, ("c",): 0.04})
    stays = turned({("a",): 0.75, ("b",): 0.25})
    changes = turned({("a",): 0.70, ("b",): 0.28, ("c",): 0.02})
    assert decided(found, others=[stays]).word == "named"
    assert decided(found, others=[stays]).explanations == (rank_explanations(found)[0],)
    told = decided(found, others=[stays, changes])
    assert (told.word, told.effects, told.index) == ("indistinguishable group", ("a", "b"), 1)
    assert [(one.members, round(one.support, 6)) for one in told.explanations] == [(("a",), 0.9), (("b",), 0.06)]
    assert told.reason == "if the noise is larger b comes within a factor 3 of it"
    gone = turned({(): 0.2, ("c",): 0.8})
    assert decided(found, others=[gone]).effects == ("a", "c")


def test_a_name_that_has_no_support_at_all_there_is_turned_by_the_three_best():
    found = found_with({("a",): 0.9, ("b",): 0.04, ("c",): 0.06})
    told = decided(found, others=[turned({("b",): 0.06, ("c",): 0.30, SWAPPED: 0.33, PAIR: 0.31})])
    assert [one.members for one in told.explanations] == [("a",), SWAPPED, PAIR, ("c",)]
    missing = found_with({})  # which does not know of it at all
    alone = replace(missing.ground, hypotheses=missing.ground.hypotheses[2:4])
    other = replace(missing, ground=alone, probability=np.array([0.2, 0.1]))
    assert decided(found, others=[("as it is", other)]).word == "indistinguishable group"


def test_the_searches_that_a_name_has_to_survive_are_made_only_for_a_name():
    def refused():
        raise AssertionError("nothing is named")
        yield

    group = found_with({("a",): 0.5, ("b",): 0.5})
    assert decided(group, others=refused()).word == "indistinguishable group"
