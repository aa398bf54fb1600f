"""What is said of a diagnosis: one word list for terminal, page, figures and files, and JSON as the contract has it."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import fields, replace
from typing import get_args

import pytest
from diagnoses import AFTER, AIR, BEFORE, DIAGNOSES, EXCHANGE, GRAIN, NEXT, TENSION, candidate
from read_pages import Read

from bayesplate.commands.printout import show_diagnosis
from bayesplate.diagnosis.result import Amplitude, ModelErrors, diagnosis_json
from bayesplate.diagnosis.tables import (
    averaged_table,
    before_after_table,
    candidates_table,
    errors_table,
    explanations_table,
    shift_table,
    sizes_table,
)
from bayesplate.diagnosis.verdict import VerdictWord
from bayesplate.diagnosis.words import (
    IN_PART_HEADING,
    MERITS,
    VERDICTS,
    alike_sentence,
    claim_sentence,
    headline_sentence,
    known_sentences,
    reason_and_notes,
    shown_model_sentence,
    verdict_meaning,
    verdict_sentence,
    verdict_sentences,
    warnings,
)
from bayesplate.effects.words import as_sentence
from bayesplate.results.tables import render

KEYS = [
    "format", "name", "seed", "card_sha256", "verdict", "claim", "conditions", "effects", "refitted", "reason",
    "sentences", "declared", "known", "stated_claims", "probability_of_none", "probability_of_none_with_halved_priors",
    "probability_of_none_with_doubled_priors", "p_value", "before", "after", "gain_null_percentile", "null_control",
    "elastic_shift", "finalists", "elastic_averaged", "explanations", "candidates", "recommendation", "notes",
    "named_in_part", "carrying_modes",
]  # fmt: skip
ERRORS = [
    "in_sample_rms_cents", "leave_one_out_rms_cents", "nested_leave_one_out_rms_cents", "log_score", "hits_90",
]  # fmt: skip
EFFECT = [
    "name", "setup", "raw_rms_cents", "visible_rms_cents", "visible_cents", "below_detection_limit", "bias_percent",
    "inclusion_probability", "inclusion_probability_with_doubled_priors", "log_bayes_factor", "ockham_log_factor",
    "p_value", "amplitude", "learnt_bits", "look_alikes", "rejected_because",
]  # fmt: skip
EXCHANGED = [
    "name", "setup", "labels", "raw_rms_cents", "visible_rms_cents", "bias_percent", "inclusion_probability",
    "log_bayes_factor", "amplitude", "look_alikes", "rejected_because",
]  # fmt: skip
NAMED = replace(DIAGNOSES["named"], candidates=(TENSION, AIR, GRAIN, EXCHANGE))


def test_the_json_has_the_names_and_the_order_of_the_contract():
    """Files of this format are read by others: a name that is changed here breaks their scripts."""
    content = diagnosis_json(NAMED)

    assert list(content) == KEYS
    assert list(content["before"]) == list(content["after"]) == ERRORS
    assert [list(one) for one in content["candidates"]] == [EFFECT, EFFECT, EFFECT, EXCHANGED]
    assert list(content["candidates"][0]["amplitude"]) == ["parameter", "form", "q05", "q50", "q95", "unit"]
    assert [list(one) for one in content["known"]] == 5 * [
        [
            "effects", "without", "in_sample_rms_cents", "leave_one_out_rms_cents", "change_percent", "combination",
            "n_left_out", "n_readings",
        ]
    ]  # fmt: skip
    assert [list(one) for one in content["stated_claims"]] == [[
        "effects", "predicts", "before_rms_cents", "after_rms_cents", "log_score_gain", "standard_error", "n_modes",
        "holds",
    ]]  # fmt: skip
    assert list(content["known"][0]["change_percent"]) == ["E_x", "E_y", "G_xy"]
    assert list(content["p_value"]) == ["before", "after"]
    assert list(content["null_control"]) == [
        "n_sets", "flagged_percent", "log_odds", "log_odds_needed", "log_odds_of_sets", "nested_ratio",
        "nested_ratio_to_beat", "nested_ratio_percentile", "nested_ratio_of_sets",
    ]  # fmt: skip
    assert list(content["elastic_shift"]["E_x"]) == ["before", "after", "shift_in_sd"]
    spread = ["mean", "sd", "q05", "q25", "q50", "q75", "q95", "unit"]
    assert list(content["elastic_averaged"]["G_xy"]) == spread
    assert list(content["explanations"][0]) == ["effects", "probability"]
    (finalist,) = content["finalists"]
    assert list(finalist) == [
        "effects", "forms", "probability", "in_sample_rms_cents", "leave_one_out_rms_cents", "elastic", "sizes",
    ]  # fmt: skip
    assert list(finalist["sizes"]["clamped"]["membrane_tension"]["tension"]) == spread


def test_the_json_has_the_values_and_nothing_that_json_lacks():
    content = diagnosis_json(NAMED)

    assert json.loads(json.dumps(content, allow_nan=False)) == content
    assert (content["format"], content["effects"], content["before"]["log_score"]) == (1, ["membrane_tension"], -24.75)
    assert content["candidates"][3]["labels"] == ["(1,0)", "(0,1)"]
    assert content["candidates"][3]["bias_percent"] is None


def test_every_word_of_the_verdict_and_every_error_has_its_words():
    assert set(VERDICTS) == set(get_args(VerdictWord))
    read = [one.value_of(ModelErrors(**{name: i for i, name in enumerate(ERRORS)})) for one in MERITS]
    assert read == list(range(len(fields(ModelErrors))))


PASSAGES = [
    ("none needed", "no more than their noise would make them"),
    ("named", "point to membrane tension. The reason: the reason of it. The error of the prediction is reduced: "
     "the nested leave-one-out error fell from 46 to 12 cents, and every condition of that claim is met."),
    ("indistinguishable group", "cannot tell which: membrane tension or fluid loading."),
    ("unexplained", "none of the effects that were tried is, at a possible size, a probable explanation"),
    ("undetectable", "could not show them even if they were there"),
]  # fmt: skip


@pytest.mark.parametrize(("word", "words"), PASSAGES)
def test_the_terminal_and_the_page_tell_the_same(word, words):
    one = DIAGNOSES[word]
    closing, page = verdict_sentence(one), verdict_sentences(one)
    assert closing.startswith(f"Verdict: {word}. {page[0]}")
    assert words in closing
    assert ("reduced" in closing) is one.claim
    assert ("No improvement is claimed" in closing) is (one.is_refitted and not one.claim)
    assert closing.endswith(page[-1]) or not one.is_refitted


def test_the_page_says_what_its_constants_are():
    assert reason_and_notes(replace(NAMED, notes=("mind this",))) == ["The reason: the reason of it.", "mind this"]
    assert shown_model_sentence(NAMED).endswith("averaged ones; all else below is of the model with membrane tension.")
    assert "only one of the explanations. Quote the averaged" in shown_model_sentence(
        DIAGNOSES["indistinguishable group"]
    )
    # the averaged constants stand beside figures of the fit alone
    assert shown_model_sentence(DIAGNOSES["none needed"]).endswith("below is of the fit without a further effect.")
    assert shown_model_sentence(DIAGNOSES["unexplained"]) == ""
    for word, one in DIAGNOSES.items():
        assert ("averaged" in headline_sentence(one)) is (word != "unexplained")
        assert ("averaged" in averaged_table(one).title) is (word != "unexplained")
        assert ("too narrow" in " ".join(warnings(one))) is (word == "unexplained")
        assert show_diagnosis(one).tables[0] == averaged_table(one)
        assert warnings(replace(one, notes=("mind this",)))[-1] == "mind this"
    assert show_diagnosis(DIAGNOSES["unexplained"]).warnings == tuple(warnings(DIAGNOSES["unexplained"]))


ROSE = [
    (53.2, 61.4, "The nested leave-one-out error rose from 53 to 61 cents. No improvement is claimed."),
    (53.2, 53.4, "The nested leave-one-out error stayed at 53 cents. No improvement is claimed."),
    (5.2, 5.44, "The nested leave-one-out error rose from 5.2 to 5.4 cents. No improvement is claimed."),
    (61.4, 53.2, "The nested leave-one-out error fell from 61 to 53 cents. No improvement is claimed: the readings "
     "left out are not predicted better beyond two standard errors."),
]  # fmt: skip


def test_an_error_that_rises_is_said_to_rise():
    for before, after, words in ROSE:
        one = replace(
            DIAGNOSES["indistinguishable group"],
            before=replace(BEFORE, nested_leave_one_out_rms_cents=before),
            after=replace(AFTER, nested_leave_one_out_rms_cents=after),
        )
        assert claim_sentence(one) == words


def test_with_too_few_readings_the_error_that_both_models_have_is_told():
    """Nothing was chosen anew without a reading: what that would have given is not said to fail, for nobody knows."""
    one, missing = DIAGNOSES["indistinguishable group"], {}
    for lost, told in [
        ("nested_leave_one_out_rms_cents", "The leave-one-out error fell from 46.5 to 9.5 cents. "),
        ("leave_one_out_rms_cents", "The error in the fit fell from 21.2 to 4.2 cents. "),
    ]:
        missing[lost] = None
        unjudged = [
            replace(each, value=None, limit=None, is_met=False)
            if each.name in ("chance selection", "log score")
            else each
            for each in one.conditions
        ]
        few = replace(
            one, before=replace(BEFORE, **missing), after=replace(AFTER, **missing), conditions=tuple(unjudged)
        )
        assert claim_sentence(few) == (
            f"{told}No improvement is claimed: too few modes are left to choose anew without each of them."
        )


def test_probabilities_of_what_does_not_explain_the_readings_stand_under_that_title():
    for verdict in DIAGNOSES:
        title = explanations_table(replace(NAMED, verdict=verdict)).title
        assert ("none of it is a probable explanation" in title) == (verdict == "unexplained")


def test_the_probabilities_sum_to_one_as_they_are_printed():
    table = explanations_table(NAMED)
    assert (table.columns, table.texts) == (
        ("explanation", "probability"),
        (("nothing is lacking", "2.0 %"), ("membrane tension", "97.0 %"), ("any of 2 others", "1.0 %")),
    )
    thirds = [replace(NAMED.explanations[0], probability=share, words=f"{i}") for i, share in enumerate((1 / 3, 1 / 3))]
    equal = replace(NAMED, probability_of_none=1 / 3, explanations=tuple(thirds))
    shares = [row[1] for row in explanations_table(equal).texts]
    assert sorted(shares) == ["33.3 %", "33.3 %", "33.4 %"]
    for share, n_rows in ((0.0099, 3), (0.01, 4)):  # worth a row of its own from one per cent on
        one = (NAMED.explanations[0], replace(NAMED.explanations[0], words="x", probability=share))
        assert len(explanations_table(replace(NAMED, explanations=(*one, *NAMED.explanations[1:]))).texts) == n_rows


def test_what_looks_like_the_named_effect_is_told():
    alike = replace(TENSION, look_alikes=("fluid_loading", "attached_mass"))
    one = replace(NAMED, candidates=(alike, AIR))
    assert alike_sentence(one).startswith(
        "Fluid loading and attached mass would look much the same (likeness above 0.95)"
    )
    assert alike_sentence(one) in verdict_sentences(one)
    assert alike_sentence(one) in show_diagnosis(one).remarks
    both = replace(one, effects=("membrane_tension", "fluid_loading"), candidates=(alike, AIR))
    assert alike_sentence(both).startswith("Attached mass would look")  # a member of the verdict is no rival
    assert alike_sentence(NAMED) == alike_sentence(replace(one, verdict="indistinguishable group")) == ""


SIZES = [
    ("kg", (1e-4, 8e-4, 1.8e-3), "mass 0.80 g (0.10 to 1.80)"),
    ("rad", (0.01745329, 0.03490659, 0.05235988), "mass 2.00 degrees (1.00 to 3.00)"),
    ("Pa", (6.2e8, 6.2e8, 6.2e8), "mass 0.62 GPa (fixed)"),
    ("m", (1e-4, 2e-4, 3e-4), "mass 0.200 mm (0.100 to 0.300)"),
    ("1", (0.1, 0.2, 0.3), "mass 0.200 (0.100 to 0.300)"),
    ("kg", (2.5, 8.3, 44.5), "mass 8300 g (2500 to 44500)"),
    ("1", (-0.1, 1e-9, 0.1), "mass 0.000 (-0.100 to 0.100)"),
]


@pytest.mark.parametrize(("unit", "sizes", "shown"), SIZES)
def test_sizes_have_the_units_of_people(unit, sizes, shown):
    size = Amplitude(parameter="mass", form="", **dict(zip(("q05", "q50", "q95"), sizes, strict=True)), unit=unit)
    one = replace(NAMED, candidates=(replace(TENSION, amplitude=size),))
    for narrow in (False, True):
        table = candidates_table(one, narrow=narrow)
        assert dict(zip(table.columns, table.texts[0], strict=True))["size (90 %)"] == shown


def test_the_size_of_an_effect_that_was_tried_at_several_places_has_the_likeliest():
    size = Amplitude(parameter="mass", form="at 209, 28 mm", q05=1e-4, q50=8e-4, q95=1.8e-3, unit="kg")
    table = candidates_table(replace(NAMED, candidates=(replace(TENSION, amplitude=size),)), narrow=True)
    shown = dict(zip(table.columns, table.texts[0], strict=True))
    assert shown["size (90 %)"] == "mass 0.80 g (0.10 to 1.80) at 209, 28 mm"


def test_the_sizes_of_what_was_fitted_again():
    """The same effect alone and beside another has two sizes, which nobody could tell apart without the explanation."""
    assert sizes_table(NAMED).texts == (("membrane tension, clamped", "tension", "120 ± 12 N/m", "102 to 138 N/m"),)
    assert sizes_table(DIAGNOSES["none needed"]) is None
    (alone,) = NAMED.finalists
    both = replace(alone, effects=(*alone.effects, "fluid_loading"))
    table = sizes_table(replace(NAMED, finalists=(both, alone)))
    assert table.columns[:2] == ("fitted with", "effect")
    assert [row[:2] for row in table.texts] == [
        ("membrane tension and fluid loading", "membrane tension, clamped"),
        ("membrane tension", "membrane tension, clamped"),
    ]
    placed = replace(alone, forms={"membrane_tension": "along x"})
    assert sizes_table(replace(NAMED, finalists=(placed,))).texts[0][0] == "membrane tension along x, clamped"


def test_errors_before_and_after_or_as_they_are():
    both, alone = errors_table(NAMED), errors_table(DIAGNOSES["none needed"])

    assert (both.title, both.columns) == ("Error before and after: a-board", ("", "before", "after: membrane tension"))
    assert both.texts == (
        ("error in the fit, rms cents", "21.2", "4.2"),
        ("leave-one-out error, rms cents", "46.5", "9.5"),
        ("nested leave-one-out error, rms cents", "46.5", "12.5"),
        ("log score", "-24.75", "-15.50"),
        ("readings inside their 90 % intervals", "50 %", "100 %"),
    )
    assert (alone.title, alone.columns) == ("Error of the fit: a-board", ("", "as it is"))
    assert [row[1] for row in alone.texts] == [row[1] for row in both.texts]
    unknown = replace(DIAGNOSES["none needed"], before=replace(BEFORE, leave_one_out_rms_cents=None))
    assert errors_table(unknown).texts[1][1] == "–"


def test_constants_shift_only_where_something_was_added():
    assert shift_table(NAMED).texts[0] == ("E_x, along grain", "10.25", "11.50", "+2.5")
    assert shift_table(DIAGNOSES["none needed"]) is None
    assert averaged_table(NAMED).texts[0] == ("E_x, along grain", "10.2 ± 1.0", "8.7 to 11.8")


def test_candidates_stand_in_the_order_of_their_probability():
    wide, narrow = candidates_table(NAMED), candidates_table(NAMED, narrow=True)
    by_name = {row[0]: dict(zip(wide.columns, row, strict=True)) for row in wide.texts}

    assert list(by_name) == ["membrane tension", "relabelling (1,0) and (0,1)", "fluid loading", "grain angle"]
    assert by_name["membrane tension"] == {
        "effect": "membrane tension", "shift": "45.0", "visible": "12.5", "inclusion probability": "97.0 %",
        "E_x / E_y / G_xy off by, %": "+1.5 / -2.5 / +0.5", "size (90 %)": "tension 120 N/m (10 to 230)",
        "looks like": "–", "rejected because": "–",
    }  # fmt: skip
    assert by_name["fluid loading"]["looks like"] == "attached mass"
    assert by_name["fluid loading"]["size (90 %)"] == by_name["relabelling (1,0) and (0,1)"]["shift"] == "–"
    assert narrow.texts[0][-2:] == ("tension 120 N/m (10 to 230)", "in the verdict")
    assert not any("probab" in column for column in narrow.columns)
    assert [row[-1] for row in narrow.texts] == ["in the verdict", "less probable", "not detectable", "less probable"]
    assert candidates_table(DIAGNOSES["undetectable"]) is None


def test_an_improbable_exchange_of_labels_is_not_shown_and_setups_are_named_where_there_are_several():
    for share, n_shown in ((0.0099, 1), (0.01, 2)):
        one = replace(NAMED, candidates=(TENSION, replace(EXCHANGE, inclusion_probability=share)))
        assert len(candidates_table(one).texts) == n_shown
    several = replace(NAMED, candidates=(candidate("fluid_loading", "one"), candidate("fluid_loading", "two")))
    assert [row[0] for row in candidates_table(several).texts] == ["fluid loading, one", "fluid loading, two"]


def test_the_terminal_shows_only_tables_that_there_are():
    shown, bare = show_diagnosis(NAMED), show_diagnosis(DIAGNOSES["undetectable"])
    assert [table.title.partition(":")[0] for table in shown.tables] == [
        "The constants, averaged over all explanations by their probability, GPa",
        "What physics knows, computed and not fitted", "What may be the case", "Error before and after",
        "May a lower error be claimed? Only if every condition is met",
        "Shift of the constants by membrane tension, GPa", "Sizes of what was fitted again",
        "Candidates at their usual size",
    ]  # fmt: skip
    assert [table.title for table in bare.tables[1:]] == ["What may be the case", "Error of the fit: a-board"]
    assert shown.remarks == (*known_sentences(NAMED), *NAMED.sentences, NEXT)
    assert bare.remarks == (NEXT,)


def test_before_and_after_in_one_csv_and_as_latex():
    header, *rows = csv.reader(io.StringIO(render(before_after_table(NAMED), "csv")))
    by_name = {row[0]: dict(zip(header[1:], row[1:], strict=True)) for row in rows}
    assert by_name["error in the fit, rms cents"] == {
        "before": "21.25", "after": "4.25", "shift_in_sd": "", "averaged": "", "averaged_sd": "",
    }  # fmt: skip
    assert {name: float(value) for name, value in by_name["E_x, GPa"].items()} == pytest.approx(
        {"before": 10.25, "after": 11.5, "shift_in_sd": 2.5, "averaged": 10.25, "averaged_sd": 1.025}
    )
    assert by_name["membrane tension tension, clamped, N/m"]["after"] == "120.0"
    latex = render(before_after_table(NAMED), "latex")
    assert r"$E_{x}$, GPa & 10.25 & 11.50 & $+2.5$ & 10.2 $\pm$ 1.0 \\" in latex
    assert r"membrane tension tension, clamped, N/m & -- & 120 & -- & -- \\" in latex

    bare = before_after_table(replace(DIAGNOSES["undetectable"], before=replace(BEFORE, log_score=None)))
    assert render(bare, "csv").splitlines()[0] == "quantity,before,averaged,averaged_sd"
    assert "after" not in render(bare, "latex").partition("\n")[2]
    assert r"log score & -- & -- \\" in render(bare, "latex")


def test_it_shows_itself():
    assert repr(NAMED) == "<Diagnosis of a-board, named: membrane_tension, error reduced>"
    assert repr(DIAGNOSES["none needed"]) == "<Diagnosis of a-board, none needed>"
    page = Read(NAMED._repr_html_())
    assert len(page.all("table")) == 8
    assert all(sentence in page.text for sentence in known_sentences(NAMED))
    for words in ("An effect was found", "point to membrane tension", "46.5", f"{AFTER.leave_one_out_rms_cents}", NEXT):
        assert words in page.text
    in_part = replace(DIAGNOSES["unexplained"], named_in_part=("membrane_tension",))
    assert f"a-board: {IN_PART_HEADING}" in Read(in_part._repr_html_()).text


def test_a_sentence_keeps_the_capitals_of_its_names():
    assert as_sentence("relabelling (2,0) in setup Body") == "Relabelling (2,0) in setup Body"


def test_a_plate_with_declared_effects_is_not_called_ideal():
    calm = DIAGNOSES["none needed"]
    assert verdict_meaning(calm).startswith(
        "The readings differ from those of an ideal plate by no more than their noise"
    )
    told = verdict_meaning(replace(calm, declared=("grain_angle", "fluid_loading")))
    assert "those of a plate with grain angle and fluid loading by no more than" in told
    assert "No further effect is needed" in told
