"""summary.json, key by key, how a summary shows itself, and what it warns of; from one that was made by hand."""

from __future__ import annotations

import json
from dataclasses import FrozenInstanceError, replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_summaries import SUMMARY

from bayesplate.posterior.reweighting import FEWEST_WEIGHTED_DRAWS
from bayesplate.results.contract import Elastic, Spread, finite_or_none, json_text, rms
from bayesplate.results.summarise import HIGH_EXACT_ERROR, fit_doubts, fit_warnings, law_means
from bayesplate.results.summary import ModelHeader, SamplerHealth, UnconvergedSummary

SPREAD = ["mean", "sd", "q05", "q25", "q50", "q75", "q95", "unit"]
ELASTIC = ["E_x", "E_y", "G_xy"]
RIGIDITY = ["D_x", "D_y", "D_s"]
POINT = [*ELASTIC, *RIGIDITY, "condition_number"]
MEANS = [*ELASTIC, *RIGIDITY, "effective_draws"]

CONTRACT = {
    "": ["format", "name", "seed", "versions", "card_sha256", "model", "converged", "elastic", "rigidity", "effects",
         "noise", "inputs", "derived", "joint", "least_squares", "weighted_least_squares", "percentile", "linear_means",
         "exact_means", "modes", "peaks", "spectra", "error", "sampler", "identifiability", "warnings",
         "doubts", "carrying_modes"],
    "model": ["theory", "law", "effects", "robust", "prior", "isotropic"],
    "elastic": ELASTIC, "elastic/E_x": SPREAD,
    "rigidity": RIGIDITY, "rigidity/D_x": SPREAD,
    "effects/bench/attached_mass/mass": SPREAD, "noise/bench": SPREAD, "inputs/thickness": SPREAD,
    "derived/anisotropy": SPREAD, "joint": ["names", "log_mean", "log_covariance"],
    "least_squares": POINT, "weighted_least_squares": POINT,
    "percentile": [*ELASTIC, "n_subsets"], "percentile/E_x": ["mean", "sd_percent"],
    "linear_means": MEANS, "exact_means": MEANS,
    "modes/0": ["setup", "label", "measured_hz", "predicted_hz", "residual_cents", "residual_interval_cents",
                "rounding_cents", "left_out_cents", "leverage", "label_correlation", "label_origin"],
    "modes/0/predicted_hz": ["mean", "q05", "q95"],
    "peaks/0": ["setup", "hz", "stated", "assignments", "spurious_probability", "predicted_hz", "residual_cents"],
    "peaks/0/assignments/0": ["label", "probability"],
    "spectra/0": ["setup", "missed_probability", "spurious_probability", "modes"],
    "spectra/0/modes/0": ["setup", "label", "predicted_hz", "seen_probability"],
    "error": ["in_sample_rms_cents", "leave_one_out_rms_cents", "linearisation_rms_cents", "exact_law_worst_cents",
              "surrogate_rms_cents", "surrogate_worst_cents"],
    "sampler": ["ensembles", "walkers", "steps", "tau_max", "rhat_max", "ess_min", "acceptance", "drawn_from",
                "pareto_k"],
}  # fmt: skip
"""Keys of summary.json in their order, by the place where they stand."""


def read(result):
    return json.loads(json_text(result))


def keys_at(place):
    """Keys of summary.json at a place, in their order."""
    entry = read(SUMMARY)
    for step in place.split("/") if place else ():
        entry = entry[int(step) if isinstance(entry, list) else step]
    return list(entry)


def test_the_json_has_the_keys_of_the_contract_in_their_order():
    assert {place: keys_at(place) for place in CONTRACT} == CONTRACT


def test_values_stand_where_they_belong_and_what_does_not_exist_is_null():
    found = read(SUMMARY)

    assert found["elastic"]["E_y"]["mean"] == 1.0e9
    assert found["percentile"]["E_x"] == {"mean": 10e9, "sd_percent": 2.0}
    assert found["least_squares"]["E_y"] is found["percentile"]["E_y"]["mean"] is found["linear_means"]["D_s"] is None
    assert found["modes"][2]["rounding_cents"] is found["modes"][2]["left_out_cents"] is None
    assert found["modes"][0]["residual_interval_cents"] == list(SUMMARY.modes[0].residual_interval_cents)
    assert found["model"]["effects"] == ["attached_mass"]
    assert read(replace(SUMMARY, percentile=None))["percentile"] is None


def test_no_number_that_json_does_not_have_is_written():
    wrong = replace(SUMMARY, error=replace(SUMMARY.error, in_sample_rms_cents=float("nan")))

    with pytest.raises(ValueError, match="not JSON compliant"):
        json_text(wrong)
    assert [finite_or_none(value) for value in (1.5, float("nan"), float("inf"))] == [1.5, None, None]


def test_a_run_that_failed_the_gate_has_no_constants():
    model, sampler = ModelHeader("thin", "linear", (), False, "x"), SamplerHealth(4, 32, 10, None, None, None, 0.5)
    failed = UnconvergedSummary(1, "made", 1, {}, "0", model, False, sampler, ("too short",))
    header = CONTRACT[""][:6]

    assert list(read(failed)) == [*header, "converged", "sampler", "warnings"]
    assert (read(failed)["converged"], read(SUMMARY)["converged"]) == (False, True)
    assert read(failed)["sampler"]["rhat_max"] is None


def test_constants_are_reached_by_attribute_and_by_name_and_read_like_a_dict():
    elastic, one = SUMMARY.elastic, Elastic(1.0, 2.0, 3.0)

    assert dict(one) == {"E_x": 1.0, "E_y": 2.0, "G_xy": 3.0} == dict(one.items())
    assert ("E_x" in one, "D_x" in one, list(one), len(one)) == (True, False, ELASTIC, 3)
    assert elastic.E_x is elastic["E_x"]
    assert [name for name, _ in elastic.items()] == ELASTIC
    assert dict(SUMMARY.least_squares.items())["D_s"] == SUMMARY.least_squares.D_s == 2.0
    with pytest.raises(KeyError, match="items"):
        _ = elastic["items"]
    with pytest.raises(FrozenInstanceError):
        elastic.E_x = None


def test_a_spread_by_hand_and_that_of_an_exact_value_is_none():
    """Of 0, 1, ..., 100: quantiles are their own percentages, the sample variance of n numbers is n (n + 1) / 12."""
    found = Spread.of(np.arange(101.0).reshape(1, 101), "m")

    assert (found.mean, found.q05, found.q25, found.q50, found.q75, found.q95) == (50, 5, 25, 50, 75, 95)
    assert found.sd == pytest.approx(np.sqrt(101 * 102 / 12))
    assert found.unit == "m"
    # the mean of many 1.2 is 1.2 but for rounding, which no reader may take for an uncertainty of 2e-16
    alike = np.full((1000, 32), 1.2)
    exact = Spread.of(alike, "kg/m3")
    assert (exact.mean, exact.sd, exact.q05, exact.q95) == (1.2, 0.0, 1.2, 1.2)
    assert np.std(alike, ddof=1) > 0, "else the test shows nothing"


def test_an_rms_is_of_the_numbers_that_there_are():
    assert rms([3.0, None, 4.0]) == pytest.approx(np.sqrt(12.5))
    assert rms(np.array([np.nan, 2.0])) == 2.0
    assert rms([None]) is rms([]) is None


def test_it_shows_itself_in_a_line_and_in_a_notebook():
    assert repr(SUMMARY) == (
        "<Summary of made: E_x = 10.50 ± 0.25 GPa, E_y = 1.00 ± 0.12 GPa, G_xy = 0.500 ± 0.062 GPa; 3 modes, exact law>"
    )
    html = replace(SUMMARY, name="<b>")._repr_html_()
    assert "<caption>&lt;b&gt;, GPa</caption>" in html
    assert "<bdi><i>E</i><sub>y</sub>, across grain</bdi></th>" in html
    assert "<bdi>0.75 to 1.25</bdi>" in html
    assert html.count("<tr>") == 1 + len(Elastic.NAMES)


OF_DRAWS = dict.fromkeys(("E_x", "E_y", "G_xy", "D_x", "D_y", "D_s"), 1.5)


def warned(*, law="linear", settled=True, enough=True, exact_worst=0.0, doubts=()):
    problem = SimpleNamespace(
        doubts=(),
        board=SimpleNamespace(notes=("noted",)),
        estimate=SimpleNamespace(converged=settled),
        posterior=SimpleNamespace(law=law),
    )
    return fit_warnings(problem, SimpleNamespace(doubts=doubts, linear_is_enough=enough, exact_worst=exact_worst))


WARNINGS = [
    ({}, []),
    ({"settled": False}, ["the least-squares steps did not settle"]),
    ({"doubts": ("check its label",)}, ["check its label"]),
    ({"enough": False}, ["the linear law is off by more than a quarter of the noise"]),
    ({"law": "exact", "enough": False}, []),  # the exact law has no linear law to be warned of
    ({"exact_worst": 0.99 * HIGH_EXACT_ERROR}, []),
    ({"exact_worst": 1.01 * HIGH_EXACT_ERROR}, ["the exact law misses full solves by up to 0.51 cents"]),
]


def test_each_fault_is_told_once_after_what_the_board_notes():
    assert HIGH_EXACT_ERROR == 0.5
    for case, words in WARNINGS:
        noted, *told = warned(**case)
        assert (noted, len(told)) == ("noted", len(words)), case
        assert all(passage in one for passage, one in zip(words, told, strict=True)), told


def test_what_speaks_against_the_constants_is_a_doubt_and_a_label_that_is_left_open_is_none():
    problem = SimpleNamespace(doubts=("misread?", "near this plate"), veerings=("near this plate",))

    assert fit_doubts(problem, SimpleNamespace(doubts=("check its label",))) == ("misread?", "check its label")


def test_means_that_rest_on_too_few_draws_are_not_given():
    assert FEWEST_WEIGHTED_DRAWS == 200
    assert law_means(OF_DRAWS, 200.0).E_x == 1.5
    few = law_means(OF_DRAWS, 199.0)
    assert [value for _, value in few.items()] == [None] * 6
    assert few.effective_draws == 199.0
