"""The words of the check against a closed form: passed, failed, or why it does not apply; one is always said."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_summaries import SUMMARY

from bayesplate.posterior.certificate import Certificate, does_not_apply
from bayesplate.results.certified import certificate_sentence, contradiction
from bayesplate.workflow.shown import show_fit

FAILED = Certificate(True, False, "", 20, "median of ln D_y", 7.25, 3000.0)


@pytest.mark.parametrize(
    ("certificate", "line"),
    [
        (SUMMARY.certificate, "draws against a closed form: agree within 1.5 Monte Carlo errors (4 allowed)"),
        (does_not_apply("a label is not sure"), "draws against a closed form: does not apply, a label is not sure"),
    ],
)
def test_one_line_of_the_screen_says_what_was_found(certificate, line):
    shown = show_fit(replace(SUMMARY, certificate=certificate))

    assert shown.remarks[-1] == line
    assert contradiction(certificate) == ()


def test_draws_that_contradict_the_closed_form_are_warned_of_and_not_praised():
    (warning,) = contradiction(FAILED)
    shown = show_fit(replace(SUMMARY, certificate=FAILED, warnings=(warning,)))

    assert warning.startswith("draws against a closed form: DO NOT AGREE, the median of ln D_y is off by 7.2 Monte ")
    assert "do not use these constants" in warning
    assert shown.warnings == (warning,)
    assert certificate_sentence(FAILED) not in shown.remarks
