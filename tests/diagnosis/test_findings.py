"""From a search to its result: what each candidate is told to have been rejected for, the claim, and three readings."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnoses import spread
from made_searches import (
    BEYOND_NOISE,
    HALF_NORMAL,
    NOISE,
    QUIET,
    bare,
    baseline,
    decided,
    found_with,
    ground_of,
)
from made_summaries import SUMMARY, mode
from scipy.special import ndtr
from scipy.stats import halfnorm

from bayesplate.board.parameter import BOARD_OWNER, Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.commands.printout import show_diagnosis
from bayesplate.diagnosis import findings, sensitivity
from bayesplate.diagnosis.claim import Claim, Condition
from bayesplate.diagnosis.entries import _size_quantiles, effect_entry, exchange_entries, fate_of
from bayesplate.diagnosis.findings import Case, FittedModel, _nearest_sentence, diagnosis_of
from bayesplate.diagnosis.folds import NestedErrors, log_score, nested_leave_one_out
from bayesplate.diagnosis.hypotheses import RELABELLING, Swap, probabilities
from bayesplate.diagnosis.null_control import NullControl, null_control
from bayesplate.diagnosis.result import Diagnosis, EffectEntry, diagnosis_json
from bayesplate.diagnosis.search import SearchResult, run_search
from bayesplate.diagnosis.terms import noise_grid
from bayesplate.diagnosis.verdict import Explanation, rank_explanations
from bayesplate.diagnosis.words import verdict_sentence, verdict_sentences, warnings
from bayesplate.effects import EFFECTS
from bayesplate.estimates.leave_one_out import CarryingMode, indices_of
from bayesplate.report.verdict import diagnosis_section, quoted_summary
from bayesplate.results.contract import Elastic, json_text

SHEAR, AIR, GRAIN = NAMES = ("transverse_shear", "fluid_loading", "grain_angle")
FIGURES = replace(
    SUMMARY,
    seed=3,
    error=replace(SUMMARY.error, in_sample_rms_cents=21.25, leave_one_out_rms_cents=46.5),
    elastic=Elastic(*(spread(1e9) for _ in range(3))),
    effects={},
)
MOVED = replace(
    FIGURES,
    error=replace(FIGURES.error, in_sample_rms_cents=4.25),
    elastic=Elastic(*(spread(1.25e9) for _ in range(3))),
    effects={"board": {SHEAR: {"size": spread(1.0, "1")}, "declared": {"x": spread(1.0)}}},
)


def made(probability, **changed) -> SearchResult:
    """The search of the three effects; the readings are those of shear at its nominal size."""
    return found_with(probability, NAMES, **changed)


def entries(found: SearchResult) -> dict[str, EffectEntry]:
    verdict, ranked = decided(found), rank_explanations(found)
    told = [effect_entry(found, verdict, ranked, one, 0.5) for one in found.ground.candidates.values()]
    return {one.name: one for one in told} | {RELABELLING: exchange_entries(found, verdict, ranked)[0]}


def draws_of(predictive: np.ndarray, E_x: float = 10e9) -> SimpleNamespace:
    constants = {"moduli": {"E_x": E_x, "E_y": 1e9, "G_xy": 1e9}, "rigidities": {"D_x": 30.0, "D_y": 2.0, "D_s": 5.0}}
    every = {kind: {name: np.full((1, 5), value) for name, value in each.items()} for kind, each in constants.items()}
    return SimpleNamespace(predictive=predictive, **every)


def case_of(found: SearchResult, control: NullControl, folded: NestedErrors | None, **changed) -> Case:
    verdict = decided(found)
    readings = np.concatenate([setup.measured for setup in found.ground.baseline.board.setups])
    draws = draws_of(readings * np.linspace(0.99, 1.01, 21)[None, :, None])
    after = (
        FittedModel(verdict.index, MOVED, draws, readings)
        if verdict.index
        else FittedModel(0, FIGURES, draws, readings)
    )
    case = Case(
        found, verdict, control, folded, FittedModel(0, FIGURES, draws, readings), after, Claim(), "Measure on."
    )
    return replace(case, **changed)


NAMED = {(): 0.01, (SHEAR,): 0.79, (AIR,): 0.15, (GRAIN,): 0.05}


def control_of(found: SearchResult, to_beat: float) -> NullControl:
    n = 101
    return NullControl(np.linspace(-5.0, 1.0, n), np.full(n, to_beat))


def folds_of(found: SearchResult, ratio: float) -> NestedErrors:
    errors = 0.01 * np.ones((1, found.ground.baseline.n_modes))
    return NestedErrors(errors, ratio * errors, np.ones(errors.shape, dtype=np.intp))


def test_what_became_of_each_candidate_of_a_named_effect():
    found = made(NAMED)
    told = entries(found)
    assert {name: one.fate for name, one in told.items()} == {
        SHEAR: "in the verdict", AIR: "does not fit", GRAIN: "does not fit", RELABELLING: "does not fit",
    }  # fmt: skip
    assert (told[SHEAR].rejected_because, told[SHEAR].setup) == (None, "board")
    p_value = found.p_value([one.members for one in found.ground.hypotheses].index((AIR,)))
    assert 0.001 < p_value < 0.05
    assert told[AIR].rejected_because == f"with it alone the misfit is still too large (p = {p_value:.3f})"
    assert told[RELABELLING].labels == ("(1,0)", "(2,0)")


def test_less_probable_is_only_what_is_so_and_would_fit():
    """Readings of pure noise, which every candidate fits: the answer's own probability beside the winner's."""
    quiet = made({(SHEAR,): 0.6, (AIR,): 0.1, (RELABELLING,): 0.05}, residual=QUIET)
    told = entries(quiet)
    assert told[SHEAR].fate == "in the verdict"
    assert (told[AIR].fate, told[AIR].rejected_because) == (
        "less probable", "less probable (0.100) than transverse shear (0.600)",
    )  # fmt: skip
    assert told[RELABELLING].rejected_because.startswith("with it alone the misfit is still too large (p < 0.001); ")
    alike = fate_of(quiet, replace(decided(quiet), effects=()), rank_explanations(quiet), SHEAR, 1)
    assert alike == ("less probable", "no more probable (0.600) than transverse shear (0.600)")


def test_an_exchange_is_told_with_its_likelihood_ratio():
    for gained, words in [(3.0, "20 times likelier"), (-1.0, "2.7 times less likely"),
                                              (30.0, "more than a million times likelier")]:  # fmt: skip
        found = made({(): 0.5, (RELABELLING,): 0.1}, residual=QUIET)
        found = replace(found, log_evidence=np.array([2.0, 0.0, 0.0, 0.0, 2.0 + gained, 0.0]))
        told = entries(found)[RELABELLING]
        assert told.rejected_because.startswith(
            "not needed: that nothing is missing has a probability of 0.50; with these"
        )
        assert told.rejected_because.endswith(f" labels exchanged the readings are {words}")
        assert told.log_bayes_factor == pytest.approx(gained)


def test_only_the_exchange_that_the_verdict_stands_for_is_in_it():
    """A second pair of labels within reach of nothing stays out, and the verdict says which two it means."""
    found = made({(SHEAR,): 0.5, (RELABELLING,): 0.45})
    ground = found.ground
    more = replace(ground.hypotheses[4], swap=Swap(3, 4))
    shares = np.array([*found.probability, 0.01])
    ground = replace(ground, hypotheses=(*ground.hypotheses, more))
    found = SearchResult(ground, found.residual, np.log(shares + 1e-300), shares)
    verdict, ranked = decided(found), rank_explanations(found)
    assert verdict.effects == (SHEAR, RELABELLING)
    assert [one.fate for one in exchange_entries(found, verdict, ranked)] == ["in the verdict", "does not fit"]
    told = diagnosis_of(case_of(found, control_of(found, 0.5), folds_of(found, 0.25)))
    assert told.words == "transverse shear or relabelling (1,0) and (2,0)"
    assert [one.words for one in told.explanations][:2] == ["transverse shear", "relabelling (1,0) and (2,0)"]
    assert any("The labels (1,0) and (2,0) may have been exchanged" in one for one in told.sentences)


def test_the_constants_to_quote_are_averaged_and_never_those_of_one_member(monkeypatch):
    """Draws of each model that was fitted, by its probability: here 10 GPa without and 20 GPa with shear."""
    found = made({(): 0.4, (SHEAR,): 0.6}, residual=QUIET)
    found = replace(found, probability=np.array([0.04, 0.96, 0.0, 0.0, 0.0, 0.0]))
    case = case_of(found, control_of(found, 0.5), folds_of(found, 0.25))
    monkeypatch.setattr(sensitivity, "under_exact_law", lambda _: None)  # the probabilities are made by hand
    group = replace(case.verdict, word="indistinguishable group", index=1)
    fitted = replace(case.after, index=1, draws=draws_of(case.before.draws.predictive, 20e9))
    told = diagnosis_of(replace(case, verdict=group, finalists=[(group.best, fitted)]))
    n = 8000
    assert told.elastic_averaged["E_x"].mean / 1e9 == pytest.approx(19.6, abs=4 * 10 * np.sqrt(0.04 * 0.96 / n))
    assert told.elastic_averaged["E_x"].sd / 1e9 == pytest.approx(10 * np.sqrt(0.04 * 0.96), rel=0.15)
    assert (told.rigidity_averaged["D_x"].mean, told.rigidity_averaged["D_x"].unit) == (30.0, "N m")

    unexplained = diagnosis_of(replace(case, verdict=replace(group, word="unexplained", index=0), after=case.before))
    assert unexplained.elastic_averaged == dict(FIGURES.elastic.items())
    assert unexplained.rigidity_averaged == dict(FIGURES.rigidity.items())


def test_a_size_that_the_card_fixes_is_shown():
    found = made(NAMED)
    one = found.ground.candidates[AIR]
    fixed = Parameter("density", BOARD_OWNER, Quantity.exact(1.2), "kg/m^3", 0.0, effect=AIR)
    board = replace(one.laws[0].form.board, parameters=(fixed,))
    law = replace(one.laws[0], form=replace(one.laws[0].form, free=(), board=board))
    ground = replace(found.ground, candidates={**found.ground.candidates, AIR: replace(one, laws=(law,))})
    size = entries(replace(found, ground=ground))[AIR].amplitude
    assert (size.parameter, size.q05, size.q50, size.q95, size.unit) == ("density", 1.2, 1.2, 1.2, "kg/m^3")


def test_a_candidate_that_is_not_needed_is_told_with_the_probability_of_none():
    calm = made({(): 0.1, (SHEAR,): 0.9}, residual=QUIET)
    for found, fate in ((calm, "not needed"), (replace(calm, residual=BEYOND_NOISE), "not established")):
        told = entries(found)[SHEAR]
        assert (told.fate, told.rejected_because) == (
            fate,
            f"{fate}: that nothing is missing has a probability of 0.10",
        )


def test_the_winner_that_fails_the_gate_is_told_so():
    told = entries(made({(SHEAR,): 1.0}, residual=BEYOND_NOISE))
    assert {told[name].fate for name in (SHEAR, AIR)} == {"does not fit"}
    assert told[SHEAR].rejected_because.startswith("with transverse shear the misfit is still too large (p ")


def test_what_would_not_show_at_its_usual_size_is_told_so_unless_it_is_probable_at_another():
    """A candidate that is found with a tenth or more is told by its probability; with less it could not have been."""
    hidden = entries(made({(): 0.5, (SHEAR,): 0.5}, size=1e-4, residual=QUIET))
    assert {hidden[name].fate for name in NAMES} == {"not detectable"}
    assert hidden[AIR].rejected_because == "its visible part is below what these readings could show"
    assert all(hidden[name].below_detection_limit for name in NAMES)
    probable = entries(made({(SHEAR,): 0.8, (AIR,): 0.11, (GRAIN,): 0.09}, size=1e-4, residual=QUIET))
    assert [probable[name].fate for name in NAMES] == ["in the verdict", "less probable", "not detectable"]


def test_an_entry_by_hand():
    """Cents from logarithms of the shift at the nominal size, and what the constants leave of it."""
    found = made(NAMED)
    base, direction = found.ground.baseline, found.ground.candidates[AIR].laws[0].direction
    raw = 1200.0 / np.log(2.0) * direction * float(HALF_NORMAL.value(1.0))
    told = entries(found)[AIR]
    assert told.raw_rms_cents == pytest.approx(np.sqrt(np.mean(raw**2)))
    assert told.visible_cents == pytest.approx(raw - base.slopes @ (base.absorption @ raw))
    assert told.log_bayes_factor == pytest.approx(np.log(0.15 / 0.01))
    assert told.amplitude.form == ""


def test_what_the_width_of_a_prior_costs_and_how_far_a_size_left_it():
    """The evidence is a mean of the density over the prior; its logarithm less that of the best size is the cost.

    Readings far out move the size; readings of large noise leave it where its prior has it.
    """
    made_up = made(NAMED)
    found = run_search(made_up.ground, made_up.residual)
    table, one = found.ground.candidates[SHEAR].fine, found.ground.hypotheses[1]
    log_terms = one.terms.log_densities(found.residual[None, :])[:, 0]
    after = np.exp(log_terms.reshape(one.noise.weights.size, table.n_cells)).sum(axis=0)
    by_size, share = after / table.weights, after / after.sum()
    told = entries(found)[SHEAR]
    assert told.ockham_log_factor == pytest.approx(np.log(table.weights @ by_size / by_size.max()))
    assert told.ockham_log_factor < -0.5
    assert told.learnt_bits == {"size": pytest.approx(np.sum(share * np.log2(share / table.weights)))}
    assert told.learnt_bits["size"] > 0.5
    assert entries(made(NAMED, size=1e-5))[SHEAR].learnt_bits["size"] == pytest.approx(0.0, abs=1e-3)


@pytest.fixture(scope="module")
def named() -> Case:
    """A named effect before it is fitted again, with half of what chance gives to beat."""
    found = made(NAMED)
    return case_of(found, control_of(found, 0.5), folds_of(found, 0.25))


def test_a_named_effect_that_was_refitted(named):
    answer = rank_explanations(named.result)[0]
    told = diagnosis_of(replace(named, finalists=[(answer, replace(named.after, index=answer.index, summary=MOVED))]))
    assert (told.verdict, told.effects, told.refitted) == ("named", (SHEAR,), (SHEAR,))
    assert told.sentences == (EFFECTS[SHEAR].sentence,)
    assert (told.before.in_sample_rms_cents, told.after.in_sample_rms_cents) == (21.25, 4.25)
    nested_cents = told.before.nested_leave_one_out_rms_cents
    assert nested_cents == pytest.approx(0.01 * 1200 / np.log(2))
    assert told.after.nested_leave_one_out_rms_cents == pytest.approx(0.25 * nested_cents)
    assert told.elastic_shift["E_x"].shift_in_sd == pytest.approx(2.5)
    assert told.p_value.before < 0.05 < told.p_value.after
    assert told.null_control.nested_ratio == pytest.approx(0.25)
    assert told.null_control.nested_ratio_percentile == 100.0
    assert told.gain_null_percentile == 100.0  # ln (0.99 / 0.01) is beyond the last of the null sets
    (finalist,) = told.finalists
    assert (finalist.effects, list(finalist.sizes["board"])) == ((SHEAR,), [SHEAR])
    assert told.after.log_score > told.before.log_score
    assert told.probability_of_none + sum(one.probability for one in told.explanations) == pytest.approx(1.0)


def test_a_finalist_has_the_forms_of_its_effects_that_were_tried_in_several(named, monkeypatch):
    forms = [SimpleNamespace(effect=SHEAR, detail="at 20, 30 mm"), SimpleNamespace(effect="warp", detail="")]
    monkeypatch.setattr(findings, "likely_forms", lambda result, index: forms)
    answer = rank_explanations(named.result)[0]
    told = diagnosis_of(replace(named, finalists=[(answer, replace(named.after, index=answer.index, summary=MOVED))]))

    assert told.finalists[0].forms == {SHEAR: "at 20, 30 mm"}


def test_a_claim_is_told_with_its_conditions_and_the_notes_of_the_run(named):
    met, missed = (Condition("prior predictive", value, 0.05, value >= 0.05) for value in (0.5, 0.01))
    for conditions, holds in (((met,), True), ((met, missed), False)):
        told = diagnosis_of(replace(named, claim=Claim(conditions), notes=("mind this",)))
        assert (told.claim, told.conditions, told.notes) == (holds, conditions, ("mind this",))


def test_readings_outside_their_band_are_counted(named):
    # the last two lie at the 2.5 and 97.5 % quantiles of the draws, outside the 90 % but inside the range
    off = np.array([1.0, 1.0, 1.0, 1.0, 1.0095, 0.9905]) * named.before.measured
    draws = draws_of(off * np.linspace(0.99, 1.01, 201)[None, :, None])
    told = diagnosis_of(replace(named, before=replace(named.before, draws=draws)))
    assert (told.before.hits_90, told.after.hits_90) == (pytest.approx(4 / 6), 1.0)


@pytest.mark.parametrize("members", [(AIR,), (RELABELLING,)])
def test_what_comes_nearest_is_told_though_it_is_not_enough(members):
    """Effects may be declared, beside what is declared already and once no reading looks wrong; an exchange may not."""
    found = made({members: 0.99, (): 0.01})
    (nearest, *_), base = rank_explanations(found), found.ground.baseline
    case = case_of(found, control_of(found, 0.5), folds_of(found, 0.25))
    case = replace(case, finalists=[(nearest, replace(case.after, index=nearest.index, summary=MOVED))])
    assert (case.verdict.word, case.verdict.nearest) == ("unexplained", nearest)
    declared = replace(base, board=replace(base.board, effects=("thickness_profile",)))
    beside = replace(found, ground=replace(found.ground, baseline=declared))
    advice = (
        "If you can see it on the board, declare it, effects = [{}], and diagnose again to look for what else is "
        "lacking."
    )
    for changed, told in [
        ({}, advice.format('"fluid_loading"')),
        ({"result": beside}, advice.format('"thickness_profile", "fluid_loading"')),
        ({"has_slip": True}, "Before you declare it, look at the readings that are told below."),
    ]:
        (sentence,) = diagnosis_of(replace(case, after=case.before, **changed)).sentences
        assert "comes nearest: with it the error goes from 21.2 to 4.2 cents in the fit, and from 46.5" in sentence
        assert sentence.endswith(told if members == (AIR,) else " for a mode left out.")


def judged(n_modes: int) -> tuple[SearchResult, Diagnosis]:
    """The whole road of a diagnosis without a refit, on readings that are nothing but noise."""
    found = made({}, n_modes=n_modes)
    rng = np.random.default_rng(4)
    found = run_search(found.ground, NOISE * rng.standard_normal(n_modes))
    folded = nested_leave_one_out(found.ground, found.residual[None, :])
    return found, diagnosis_of(case_of(found, null_control(found.ground, rng, 40), folded))


def test_three_modes_leave_nothing_to_judge_by():
    found, told = judged(3)
    assert found.ground.n_directions == 0
    priors = np.array([one.prior for one in found.ground.hypotheses])
    assert found.probability == pytest.approx(priors / priors.sum())  # nothing was learned
    assert (told.verdict, told.effects, told.refitted, told.claim) == ("undetectable", (), (), False)
    assert told.reason == "three modes determine the three constants and leave nothing to judge by"
    content = diagnosis_json(told)
    for place, name in (
        ("before", "nested_leave_one_out_rms_cents"), ("before", "log_score"),
        ("p_value", "before"), ("p_value", "after"),
        ("null_control", "nested_ratio"), ("null_control", "nested_ratio_to_beat"),
    ):  # fmt: skip
        assert content[place][name] is None
    assert content["gain_null_percentile"] is None
    assert [one["look_alikes"] for one in content["candidates"]] == [[]] * 4
    assert all(one["below_detection_limit"] and one["p_value"] is None for one in content["candidates"][:3])
    assert [one["visible_rms_cents"] for one in content["candidates"]] == [None] * 4
    assert content["candidates"][0]["visible_cents"] == [None] * 3
    assert content["candidates"][0]["raw_rms_cents"] > 0.0
    amplitude = told.candidates[0].amplitude  # its half-normal prior, to half a cell of 33 over three deviations
    assert [amplitude.q05, amplitude.q50, amplitude.q95] == pytest.approx([0.0627, 0.6745, 1.96], abs=1.5 / 33)


def test_an_effect_without_a_plate_at_its_usual_size_has_no_shift_and_no_bias():
    found = made({})
    name, candidate = next(iter(found.ground.candidates.items()))
    nowhere = np.full_like(candidate.signature.raw, np.nan)
    bias = dict.fromkeys(candidate.signature.bias_percent, np.nan)
    signature = replace(candidate.signature, raw=nowhere, visible=nowhere, bias_percent=bias)
    candidates = {**found.ground.candidates, name: replace(candidate, signature=signature)}
    entry = entries(replace(found, ground=replace(found.ground, candidates=candidates)))[name]
    assert (entry.raw_rms_cents, entry.visible_rms_cents, entry.bias_percent) == (None, None, None)
    json_text(entry)


def test_four_and_five_modes_are_judged():
    for n_modes in [4, 5]:
        found, told = judged(n_modes)
        assert (found.ground.n_directions, told.verdict) == (n_modes - 3, "none needed")
        assert 0.0 < told.p_value.before <= 1.0
        assert 0.0 <= told.gain_null_percentile <= 100.0
        assert (told.before.log_score is None) is (n_modes < 5)


def test_a_misfit_beyond_all_doubt_has_odds():
    """Probabilities of none below the smallest number there is: the odds are those of the logarithms."""
    found = made(NAMED)
    evidence = np.array([-2000.0, -3.0, -9.0, -9.0, -9.0, -np.inf])
    sure = SearchResult(found.ground, found.residual, evidence, probabilities(found.ground.hypotheses, evidence))
    assert sure.probability_of_none == 0.0
    wanted = 1997.0 + np.log(0.1 / 0.5) + np.log1p(3.0 * np.exp(-6.0))
    assert sure.log_odds == pytest.approx(wanted)
    told = diagnosis_of(case_of(sure, control_of(sure, 0.5), folds_of(sure, 0.25)))
    assert told.null_control.log_odds == pytest.approx(wanted)
    assert told.gain_null_percentile == 100.0
    json_text(diagnosis_json(told))


def test_a_board_that_declares_every_effect_has_no_odds():
    base = baseline(np.random.default_rng(1))
    ground = ground_of(base, bare(base, noise_grid(base.board), 1.0))
    found = run_search(ground, 0.003 * np.random.default_rng(2).standard_normal(6))
    control = null_control(ground, np.random.default_rng(3), 100, found.log_odds)
    told = diagnosis_of(case_of(found, control, folds_of(found, 1.0)))
    assert (told.verdict, told.null_control.log_odds, told.gain_null_percentile) == ("none needed", None, None)
    assert told.null_control.flagged_percent == 0.0
    json_text(diagnosis_json(told))


def test_two_effects_that_are_one_alternative_stay_together():
    found = made({(): 0.02, (SHEAR,): 0.01, (AIR,): 0.01, (SHEAR, AIR): 0.55, (GRAIN,): 0.41}, residual=QUIET)
    told = diagnosis_of(case_of(found, control_of(found, 0.5), folds_of(found, 0.25)))
    assert (told.verdict, told.effects) == ("indistinguishable group", (SHEAR, AIR, GRAIN))
    assert told.words == "transverse shear and fluid loading, or grain angle"


def test_two_effects_come_nearest_where_one_comes_nearest(named):
    told = _nearest_sentence(named, Explanation((SHEAR, AIR), 1, 0.9), MOVED)
    assert told.startswith("Transverse shear and fluid loading come nearest: with them the error goes from")
    assert 'see them on the board, declare them, effects = ["transverse_shear", "fluid_loading"],' in told


UNEXPLAINED = {(): 1e-6, (SHEAR,): 0.97, (AIR,): 0.02, (GRAIN,): 0.01}


def test_what_is_named_in_part_stands_beside_the_word_unexplained_and_nothing_is_claimed():
    """The best answer fails the gate, and was fitted again; without a part the model stays as it was."""
    found = made(UNEXPLAINED, residual=np.array([0.2, -0.2, 0.15, 0.1, -0.3, 0.2]))
    case = case_of(found, control_of(found, 0.4), folds_of(found, 0.5))
    after = FittedModel(1, MOVED, case.before.draws, case.before.measured)
    case = replace(case, after=after, finalists=[(case.verdict.nearest, after)], effects_in_part=(SHEAR,))
    assert case.verdict.judged_index == 1
    told, whole = diagnosis_of(case), diagnosis_of(replace(case, after=case.before, effects_in_part=()))
    for one, part in ((told, (SHEAR,)), (whole, ())):
        assert (one.verdict, one.effects, one.claim, one.conditions) == ("unexplained", (), False, ())
        assert one.named_in_part == one.refitted == part
        assert diagnosis_json(one)["named_in_part"] == list(part)
    assert (told.in_part_words, told.refitted_words) == ("transverse shear", "transverse shear")
    assert (told.before.in_sample_rms_cents, told.after.in_sample_rms_cents) == (21.25, 4.25)
    assert told.after.nested_leave_one_out_rms_cents == pytest.approx(0.5 * told.before.nested_leave_one_out_rms_cents)
    assert told.p_value.after < 0.05
    assert told.elastic_averaged["E_x"].mean == told.elastic_shift["E_x"].after == 1.25e9
    words = verdict_sentence(told)
    assert words.startswith("Verdict: unexplained. Named in part: transverse shear; something else remains.")
    assert "The constants are not to be trusted." in words
    assert "No improvement is claimed: the misfit that is left is too large." in words
    section = diagnosis_section(told)
    assert section.heading == "Part of what is missing was found"
    assert any(one.startswith("Named in part: transverse shear") for one in section.sentences)
    assert "The model does not explain the readings" in warnings(told)[0]
    assert quoted_summary(MOVED, told).error.in_sample_rms_cents == 4.25
    assert whole.before == whole.after
    assert "in part" not in verdict_sentence(whole)
    assert diagnosis_section(whole).heading == "Something is missing that was not found"


def carrying_case(*carried: str):
    """A named effect; some modes alone carry something, in one of the two fits or by the search."""
    found = made(NAMED)
    rows = tuple(
        mode(str(label), 100.0, 100.0, 1.0, setup="setup-0", left_out_cents=10.0 * (i + 1))
        for i, label in enumerate(found.ground.baseline.board.setups[0].labels)
    )
    modes = tuple(CarryingMode("setup-0", label, 0.95, "E_y") for label in carried)
    case = case_of(
        found, control_of(found, 0.4), folds_of(found, 0.5).without(indices_of(modes, found.ground.baseline.board))
    )
    before, after = (replace(side, summary=replace(side.summary, modes=rows)) for side in (case.before, case.after))
    return replace(case, before=before, after=after, carrying_modes=modes), found


def test_modes_that_alone_carry_something_count_neither_before_nor_after():
    case, found = carrying_case("(2,0)", "(5,0)")
    told = diagnosis_of(case)
    kept = np.sqrt(np.mean(np.square([10.0, 20.0, 40.0, 50.0])))
    assert told.before.leave_one_out_rms_cents == pytest.approx(kept)
    assert told.after.leave_one_out_rms_cents == pytest.approx(kept)
    assert told.before.log_score == pytest.approx(log_score(found.ground, 0, found.residual, (2, 5)))
    assert told.after.log_score == pytest.approx(log_score(found.ground, 1, found.residual, (2, 5)))
    assert told.before.log_score != pytest.approx(log_score(found.ground, 0, found.residual))
    assert [one["label"] for one in diagnosis_json(told)["carrying_modes"]] == ["(2,0)", "(5,0)"]
    sentence = (
        "Mode (2,0) alone carries E_y and mode (5,0) alone carries E_y: they do not count in the leave-one-out error, "
        "before and after alike."
    )
    assert sentence in verdict_sentences(told)
    assert sentence in show_diagnosis(told).remarks


def test_where_every_mode_alone_carries_something_there_is_no_left_out_error():
    case, _ = carrying_case(*(f"({i},0)" for i in range(6)))
    told = diagnosis_of(case)
    for errors in (told.before, told.after):
        assert errors.leave_one_out_rms_cents is errors.nested_leave_one_out_rms_cents is errors.log_score is None
    assert told.null_control.nested_ratio is None
    assert "no mode is left to judge by, and nothing can be claimed" in " ".join(verdict_sentences(told))
    json_text(diagnosis_json(told))


def test_the_interval_of_a_size_reaches_beyond_its_first_node():
    """Half a normal law on eight nodes in the middle of their cells: its quantiles, to a quarter of a cell."""
    z = (np.arange(8) + 0.5) * 0.5
    order = np.random.default_rng(1).permutation(8)
    share = 3.0 * np.diff(2.0 * ndtr(np.arange(9) * 0.5))
    levels = (0.05, 0.5, 0.95)
    low, middle, high = _size_quantiles(HALF_NORMAL, z[order], share[order], levels)

    assert low < z[0] < middle
    assert [low, middle, high] == pytest.approx(halfnorm.ppf([0.05, 0.5, 0.95]), abs=0.125)
    alone = _size_quantiles(HALF_NORMAL, np.array([0.7]), np.array([1.0]), levels)
    assert alone == pytest.approx(halfnorm.ppf(levels))  # a single node says nothing
    of_two = np.tile(z, 5), np.tile(share, 5) / 5.0  # cells of another size beside it
    assert _size_quantiles(HALF_NORMAL, *of_two, levels) == pytest.approx([low, middle, high])
