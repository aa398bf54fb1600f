"""Tables of a fit from a summary made by hand: columns that agree with each other, and rounding where it decides."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from made_summaries import SUMMARY, mode, spread

from bayesplate.commands.prepare import prepare
from bayesplate.commands.printout import show_fit
from bayesplate.report import content
from bayesplate.results.contract import Elastic
from bayesplate.results.fit_tables import (
    compared_constants,
    deciding_rounding,
    exported_constants,
    fitted_constants,
    modes_table,
    peaks_table,
    write_constants,
)
from bayesplate.results.modes import Assignment
from bayesplate.results.tables import render
from bayesplate.results.words import (
    decimals,
    interval,
    is_isotropic,
    number,
    percent,
    plus_minus,
    rounded_texts,
    two_digits,
)


def column(table, name):
    return [row[table.columns.index(name)] for row in table.texts]


def test_constants_beside_their_least_squares():
    table = fitted_constants(SUMMARY)

    assert table.texts[0] == ("E_x, along grain", "10.50 ± 0.25", "10.00 to 11.00", "2.4", "10.25")
    assert column(table, "weighted least squares") == ["10.25", "1.12", "0.500"]
    assert table.title == "Elastic constants of made, GPa"


def test_an_isotropic_plate_has_no_grain():
    """Its two moduli are one, which is all that a report without the card's word can see."""
    one = replace(SUMMARY, model=replace(SUMMARY.model, isotropic=True))

    for found in (fitted_constants(one), compared_constants(one, "made")):
        assert [row[0] for row in found.texts] == ["E_x, any direction", "E_y, any direction", "G_xy, shear"]
    assert "grain" in SUMMARY._repr_html_()
    assert "grain" not in one._repr_html_()
    assert is_isotropic({"E_x": 2.0, "E_y": 2.0})
    assert not is_isotropic({"E_x": 2.0, "E_y": 2.0 + 1e-12})


def test_the_columns_of_the_modes_agree_with_each_other():
    """By hand from the printed cells: the error is the one column over the other, and so are its ends."""
    table = modes_table(SUMMARY)
    assert table.columns == ("mode", "measured", "predicted", "error", "90 % interval", "rounding", "left out")

    for i, row in enumerate(table.texts):
        measured, predicted, error = (float(cell) for cell in row[1:4])
        tenth = 1200 / np.log(2) * 0.05 / predicted  # what the printed decimal of the prediction leaves open, cents
        assert error == pytest.approx(1200 * np.log2(measured / predicted), abs=tenth + 0.05), row
        low, high = (float(cell) for cell in row[4].split(" to "))
        ends = SUMMARY.modes[i].predicted_hz
        assert (low, high) == pytest.approx(
            (1200 * np.log2(measured / ends.q95), 1200 * np.log2(measured / ends.q05)), abs=0.0501
        )
    assert column(table, "left out") == ["+12.2", "+12.2", "–"]


def test_rounding_is_shown_where_it_is_wider_than_the_noise():
    """A hertz at 52 Hz is 33.3 cents wide; noise of 0.5 % is 8.66 cents, and a hertz at 400 Hz only 4.3."""
    assert column(modes_table(SUMMARY), "rounding") == ["± 16.6", "–", "–"]
    wide, narrow, unrounded = SUMMARY.modes
    assert deciding_rounding(SUMMARY, wide) == pytest.approx(600 * np.log2(52.5 / 51.5))
    assert deciding_rounding(SUMMARY, narrow) is deciding_rounding(SUMMARY, unrounded) is None

    width = np.log(52.5 / 51.5)
    for noise, shown in ((0.99 * width, True), (1.01 * width, False)):
        noisy = replace(SUMMARY, noise={"bench": spread(noise, noise / 10, "1")})
        assert ("rounding" in modes_table(noisy).columns) == shown


def test_modes_of_several_setups_say_in_which():
    both = replace(SUMMARY, modes=(mode("(1,0)", 52.0, 51.75, 0.5), mode("(1,1)", 60.0, 60.0, 1.0, setup="free")),
                   noise={**SUMMARY.noise, "free": SUMMARY.noise["bench"]})  # fmt: skip

    assert column(modes_table(both), "mode") == ["(1,0) bench", "(1,1) free"]
    assert column(modes_table(SUMMARY), "mode") == ["(1,0)", "(1,1)", "(2,0)"]


def test_peaks_whose_label_is_not_sure():
    told = "(3,1) 75 %, (2,2) 12 %, no mode 12 %"
    assert peaks_table(SUMMARY).texts == (("860", "(3,1)", told, "850.0", "+20.2"),)
    assert peaks_table(replace(SUMMARY, peaks=())) is None
    bare = replace(SUMMARY.peaks[0], stated=None, spurious_probability=0.004)
    assert peaks_table(replace(SUMMARY, peaks=(bare,))).texts[0][1:3] == ("–", "(3,1) 75 %, (2,2) 12 %")


def test_modes_without_a_clear_label_count_together():
    unclear = tuple(Assignment("cannot tell", share, hz) for share, hz in ((0.62, 850.0), (0.31, 870.0)))
    peak = replace(
        SUMMARY.peaks[0], assignments=(*unclear, Assignment("(3,3)", 0.06, 900.0)), spurious_probability=0.01
    )
    assert peaks_table(replace(SUMMARY, peaks=(peak,))).texts[0][2] == "cannot tell 93 %, (3,3) 6 %, no mode 1 %"


def test_labels_that_are_not_sure_are_marked():
    for origin, mark, told in [("doubtful", " ?", "in doubt"), ("proposed", " *", "proposed here")]:
        first = replace(SUMMARY.modes[0], label_origin=origin)
        table = modes_table(replace(SUMMARY, modes=(first, *SUMMARY.modes[1:])))

        assert [cell.endswith(mark) for cell in column(table, "mode")] == [True, False, False]
        assert told in table.title
        assert told not in modes_table(SUMMARY).title


def test_what_fit_prints():
    shown = show_fit(SUMMARY)

    _, modes, peaks = (table.title for table in shown.tables)
    assert (modes, peaks) == (
        "Modes, Hz; errors, cents (17 cents are about 1 %)",
        "Peaks and the modes that they may be",
    )
    assert (shown.remarks, shown.warnings) == (SUMMARY.identifiability, SUMMARY.warnings)
    assert shown.closing == (
        "thin plate with attached mass, exact law. Error rms 7.5 cents in sample, 12.2 left out; noise 0.50 %; the "
        "linear law is off by 0.50 cents."
    )
    both = {"bench": SUMMARY.noise["bench"], "free": SUMMARY.noise["bench"]}
    model = replace(SUMMARY.model, effects=())
    closing = show_fit(replace(SUMMARY, model=model, noise=both)).closing
    assert closing.startswith("thin plate, exact law.")
    assert "noise 0.50 % in bench, 0.50 % in free;" in closing


def test_what_a_page_says():
    first, missed, weakest = content.summary_sentences(SUMMARY)

    assert first.startswith("From 3 modes: 10.50 ± 0.25 GPa along the grain, 1.00 ± 0.12 GPa across it, and a shear")
    assert missed == (
        "The fit misses the frequencies by 7.5 cents (0.43 %); a mode that it has not seen, by 12 cents (0.71 %)."
    )
    assert weakest == "Least well known is G_xy, shear: ± 12 %."
    alike = Elastic(*(spread(mean, 0.033 * mean, "Pa") for mean in (11e9, 0.75e9, 0.68e9)))
    assert (
        content.summary_sentences(replace(SUMMARY, elastic=alike))[-1] == "All three are known equally well: ± 3.3 %."
    )
    assert compared_constants(SUMMARY, "Constants").texts == (
        ("E_x, along grain", "10.50 ± 0.25", "10.00 to 11.00", "10.25", "10.25", "10.00 ± 0.20"),
        ("E_y, across grain", "1.00 ± 0.12", "0.75 to 1.25", "–", "1.12", "–"),
        ("G_xy, shear", "0.500 ± 0.062", "0.375 to 0.625", "0.500", "0.500", "0.500"),
    )
    board = prepare("spruce-free-2L").board
    assert content.effects_table(board, SUMMARY).texts == (("attached mass, bench", "mass", "2.00 ± 0.50", "g"),)
    of_field = replace(SUMMARY, effects={"board": {"thickness_profile": {"field_2": spread(0.5, 1.0, "1")}}})
    ((effect, shape, *_),) = content.effects_table(board, of_field).texts
    assert effect.startswith("thickness profile, board: at +1 thicker along the middle and at mid-length, ")
    assert shape == "shape 2"
    assert content.laws_table(SUMMARY).texts[0] == ("E_x, along grain", "–", "10.50")
    assert {name: str(told) for name, told in content.sampler_rows(SUMMARY)} == {
        "ensembles, walkers, steps": "4, 32, 2000",
        "largest R-hat (at most 1.01)": "1.0025",
        "smallest effective size (at least 400)": "6000",
        "largest autocorrelation time, steps": "30.5",
        "accepted proposals": "50 %",
    }


ROUNDED = [
    (13.0, 0.032, "13.000 ± 0.032"),
    (0.899, 0.22, "0.90 ± 0.22"),
    (5304.0, 123.0, "5\N{NARROW NO-BREAK SPACE}300 ± 120"),
    (12345.6, 12.0, "12\N{NARROW NO-BREAK SPACE}346 ± 12"),
    (0.12, 0.0997, "0.12 ± 0.10"),
    (-0.004, 0.5, "0.00 ± 0.50"),
    (0.00012, 0.0000066, "0.0001200 ± 0.0000066"),
    (399.0, 0.0, "399"),
    (2.5, 0.0, "2.5"),
]


def test_one_rule_rounds_every_mean_and_its_sd():
    """Two significant digits of the sd, the mean to the same decimal place: by hand."""
    for mean, sd, printed in ROUNDED:
        assert str(plus_minus(spread(mean, sd, "1"))) == printed
        assert " ± ".join(text for text in rounded_texts(mean, sd) if text) == printed


def test_numbers_as_people_read_them():
    signed = [number(value, 1, signed=True) for value in (1.25, -0.04, -0.06)]
    assert [decimals(sd) for sd in (0.0, 123.0, 9.96, 9.94, 0.0996, 0.0994, 1e-9)] == [0, 0, 0, 1, 2, 3, 8]
    assert str(interval(spread(10.0e9, 0.5e9, "Pa"), 1e-9)) == "9.00 to 11.00"
    assert [*map(str, signed)] == ["+1.2", "0.0", "-0.1"]
    assert [str(number(None, 1)), str(number(-2.0, 0, factor=-1.0))] == ["–", "2"]
    assert [str(two_digits(value)) for value in (0.028, 3.0, 17.3, 0.0, None)] == ["0.028", "3.0", "17", "0", "–"]
    assert str(two_digits(1e-13)) == "0"
    assert [str(one) for one in (percent(None), percent(0.125), percent(0.125, 1))] == ["–", "12 %", "12.5 %"]


SPREAD = {"mean": 10.5, "sd": 0.25, "q05": 10.0, "q25": 10.25, "q50": 10.5, "q75": 10.75, "q95": 11.0}


def read(text):
    header, *rows = csv.reader(io.StringIO(text))
    return {row[0]: dict(zip(header, row, strict=True)) for row in rows}


def test_constants_keep_their_numbers():
    rows = read(render(exported_constants(SUMMARY), "csv"))

    assert list(rows) == ["E_x", "E_y", "G_xy", "D_x", "D_y", "D_s"]
    assert {key: float(rows["E_x"][key]) for key in SPREAD} == pytest.approx(SPREAD)
    assert {key: float(rows["D_s"][key]) for key in SPREAD} == SPREAD
    assert (rows["E_x"]["unit"], rows["D_x"]["unit"]) == ("GPa", "N m")
    assert float(rows["E_x"]["least_squares"]) == pytest.approx(10.25)
    assert float(rows["E_x"]["percentile_sd_percent"]) == 2.0
    assert rows["E_y"]["least_squares"] == rows["E_y"]["percentile_mean"] == rows["D_x"]["percentile_mean"] == ""
    without = read(render(exported_constants(replace(SUMMARY, percentile=None)), "csv"))
    assert without["E_x"]["percentile_mean"] == ""


def test_the_files(tmp_path):
    assert [path.name for path in write_constants(tmp_path, SUMMARY, "x")] == ["constants.csv", "constants.tex"]
    assert len(list(tmp_path.iterdir())) == 2
    text = (tmp_path / "constants.tex").read_text(encoding="utf-8")
    row = r"$E_{x}$, along grain & 10.50 $\pm$ 0.25 & 10.00 to 11.00 & 10.25 & 10.25 & 10.00 $\pm$ 0.20 \\"
    assert row in text.splitlines()
