"""What is said of known effects: which lower the error, which raise it, in a table, a sentence, CSV and LaTeX."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from diagnoses import DIAGNOSES, KNOWN, known_model
from payloads import PAYLOADS

from bayesplate.diagnosis.evidence.known import KnownFit
from bayesplate.diagnosis.wording.exports import known_csv, known_tex, write_known
from bayesplate.diagnosis.wording.known import known_models, known_sentence, known_table
from bayesplate.estimates.leave_one_out import Errors, Leverages
from bayesplate.report.verdict import diagnosis_section

CENTS = np.log(2.0) / 1200.0
STANDS, SHEAR, AIR, BOTH, SENSOR = KNOWN
BEGINNING = "Computed at its known size, with nothing fitted but the three constants by weighted least squares, "
RISE = "Where the error rises, something that acts the other way is lacking"


def test_what_is_told_of_a_fit_by_hand():
    def fit(effects, moduli, in_sample, left_out):
        nobody = Leverages(np.zeros(2), np.full(2, -1))
        errors = Errors(*(CENTS * np.array(one) for one in (in_sample, left_out)), nobody)
        return KnownFit(effects, (), np.zeros(3), np.array(moduli), errors)

    first = fit((), [10e9, 1e9, 0.5e9], [3.0, -4.0], [6.0, 8.0])
    second = fit(("fluid_loading",), [10.5e9, 0.9e9, 0.5e9], [1.0, 7.0], [np.nan, np.nan])
    stands, air = known_models((first, second))
    assert stands.in_sample_rms_cents == pytest.approx(np.sqrt(12.5))
    assert stands.leave_one_out_rms_cents == pytest.approx(np.sqrt(50.0))
    assert set(stands.change_percent.values()) == {0.0}
    assert (air.effects, air.without, air.leave_one_out_rms_cents) == (("fluid_loading",), (), None)
    assert air.in_sample_rms_cents == pytest.approx(5.0)
    without = known_models((first, second), carried=(1,))
    assert [one.leave_one_out_rms_cents for one in without] == [pytest.approx(6.0), None]
    assert air.change_percent == pytest.approx({"E_x": 5.0, "E_y": -10.0, "G_xy": 0.0})


def test_the_table_has_a_row_a_model_and_no_change_where_nothing_was_changed():
    table = known_table(KNOWN)
    assert table.columns == ("model", "in the fit", "left out", "E_x, %", "E_y, %", "G_xy, %")
    assert table.rows[0] == ("as it stands", "21.2", "46.5", "–", "–", "–")
    assert table.rows[2] == ("with fluid loading", "42.8", "94.0", "+1.2", "-2.5", "+0.0")
    assert [row[0] for row in table.rows[3:]] == ["with transverse shear and fluid loading", "without attached mass"]
    assert known_table((STANDS, replace(AIR, leave_one_out_rms_cents=None))).rows[1][2] == "–"
    assert known_table(KNOWN[:1]) is known_table(()) is None


def test_falls_and_rises_are_said_plainly():
    assert known_sentence(KNOWN) == (
        f"{BEGINNING}transverse shear lowers the left-out error from 46 to 12 cents; fluid loading raises it from 46 "
        "to 94 cents; transverse shear and fluid loading together raise it from 46 to 88 cents; attached mass, as the "
        f"card states it, lowers it from 61 to 46 cents. {RISE}, or the effect has another size on this board, or the "
        "fit was that good by chance."
    )
    assert known_sentence(KNOWN[:1]) == known_sentence(()) == ""


@pytest.mark.parametrize(
    ("models", "words", "rises"),
    [
        ((STANDS, SHEAR), "transverse shear lowers the left-out error from 46 to 12 cents.", False),
        ((STANDS, AIR), "fluid loading raises the left-out error from 46 to 94 cents. ", True),
        ((STANDS, BOTH), "together raise the left-out error from 46 to 88 cents. ", True),
        ((STANDS, SENSOR), "as the card states it, lowers the left-out error from 61 to 46 cents.", False),
        (
            (STANDS, replace(SENSOR, leave_one_out_rms_cents=12.0)),
            "attached mass, as the card states it, raises the left-out error from 12 to 46 cents. ",
            True,
        ),
        ((STANDS, replace(AIR, leave_one_out_rms_cents=46.6)), "raises the left-out error from 46 to 47 cents. ", True),
        ((STANDS, replace(AIR, leave_one_out_rms_cents=46.3)), "leaves the left-out error at 46 cents.", False),
        ((STANDS, replace(BOTH, leave_one_out_rms_cents=46.3)), "leave the left-out error at 46 cents.", False),
        ((STANDS, replace(AIR, leave_one_out_rms_cents=None)), "the error in the fit from 21 to 43 cents.", True),
        ((known_model(4.0, 6.0), known_model(5.0, 8.25, "fluid_loading")), "from 6.0 to 8.2 cents. ", True),
    ],
)  # fmt: skip
def test_each_effect_is_told_by_its_own_error(models, words, rises):
    told = known_sentence(models)
    assert words in told
    assert (RISE in told) is rises


def test_the_page_shows_the_table_and_the_sentence_where_there_are_any():
    named, bare = (diagnosis_section(DIAGNOSES[word]) for word in ("named", "none needed"))
    assert named.known == known_sentence(KNOWN)
    assert named.known_effects == known_table(KNOWN)
    assert bare.known == ""
    assert bare.known_effects is None


def test_the_same_as_csv_at_full_precision():
    header, *rows = csv.reader(io.StringIO(known_csv(KNOWN)))
    assert header[:3] == ["model", "in_sample_rms_cents", "leave_one_out_rms_cents"]
    assert rows[2] == ["with fluid loading", "42.75", "94.0", "1.25", "-2.5", "0.0"]
    assert len(rows) == len(KNOWN)
    unknown = known_csv((STANDS, replace(AIR, leave_one_out_rms_cents=None)))
    assert unknown.splitlines()[2] == "with fluid loading,42.75,,1.25,-2.5,0.0"


@pytest.mark.parametrize("payload", ["A board", *PAYLOADS], ids=range(len(PAYLOADS) + 1))
def test_the_same_as_latex_that_no_title_can_break(payload):
    comment, begin, *body, last = known_tex(KNOWN, payload).splitlines()
    assert comment.startswith("% What physics knows")
    assert (begin, last) == (r"\begin{tabular}{lrrrrr}", r"\end{tabular}")
    assert {line.count(" & ") for line in body if line.endswith(r"\\")} == {5}
    assert r"model & in the fit & left out & $E_{x}$, \% & $E_{y}$, \% & $G_{xy}$, \% \\" in body
    assert r"as it stands & 21.2 & 46.5 & -- & -- & -- \\" in body


def test_files_are_written_only_where_there_is_something_to_tell(tmp_path):
    assert write_known(tmp_path, DIAGNOSES["none needed"], "x") == ()
    assert list(tmp_path.iterdir()) == []
    written = [path.name for path in write_known(tmp_path, DIAGNOSES["named"], "x")]
    assert written == sorted(path.name for path in tmp_path.iterdir()) == ["known-effects.csv", "known-effects.tex"]
