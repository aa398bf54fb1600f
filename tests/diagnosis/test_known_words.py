"""What is said of known effects: which lower the error, which raise it, in a table, a sentence, CSV and LaTeX."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
from diagnoses import DIAGNOSES, KNOWN, known_model
from made_searches import baseline

from bayesplate.diagnosis.known import KnownFit
from bayesplate.diagnosis.known_words import known_models, known_sentence, known_table
from bayesplate.diagnosis.tables import write_diagnosis_tables
from bayesplate.estimates.leave_one_out import Leverages, PredictionErrors
from bayesplate.results.tables import render

CENTS = np.log(2.0) / 1200.0
STANDS, SHEAR, AIR, _, SENSOR = KNOWN
BEGINNING = "Computed at its known size, with nothing fitted but the constants by weighted least squares, "
RISE = "Where the error rises, something that acts the other way is lacking"


def test_what_is_told_of_a_fit_by_hand():
    def fit(effects, moduli, in_sample, left_out, carried=-1):
        nobody = Leverages(np.zeros(2), np.array([-1, carried]))
        errors = PredictionErrors(*(CENTS * np.array(one) for one in (in_sample, left_out)), nobody)
        return KnownFit(effects, effects, (), baseline(np.random.default_rng(1), 2), np.array(moduli), errors)

    first = fit((), [10e9, 1e9, 0.5e9], [3.0, -4.0], [6.0, 8.0])
    second = fit(("fluid_loading",), [10.5e9, 0.9e9, 0.5e9], [1.0, 7.0], [np.nan, 5.0])
    stands, air = known_models((first, second))
    assert stands.in_sample_rms_cents == pytest.approx(np.sqrt(12.5))
    assert (stands.leave_one_out_rms_cents, air.leave_one_out_rms_cents) == pytest.approx((8.0, 5.0))
    assert (stands.n_left_out, stands.n_readings) == (1, 2)
    assert set(stands.change_percent.values()) == {0.0}
    assert (air.combination, air.effects, air.without) == (("fluid_loading",), ("fluid_loading",), ())
    assert air.in_sample_rms_cents == pytest.approx(5.0)
    assert known_models((first,), carrying_readings=(1,))[0].leave_one_out_rms_cents == pytest.approx(6.0)
    assert [one.leave_one_out_rms_cents for one in known_models((first, second), carrying_readings=(1,))] == [
        None,
        None,
    ]
    carrying = fit((), [10e9, 1e9, 0.5e9], [3.0, -4.0], [6.0, 8.0], carried=0)
    assert known_models((carrying,))[0].leave_one_out_rms_cents == pytest.approx(6.0)
    assert air.change_percent == pytest.approx({"E_x": 5.0, "E_y": -10.0, "G_xy": 0.0})
    third = fit(("fluid_loading",), [10e9, 1e9, 0.5e9], [1.0, 7.0], [5.0, np.nan])
    assert [one.leave_one_out_rms_cents for one in known_models((first, second, third))] == [None] * 3


def test_the_table_has_a_row_a_model_and_no_change_where_nothing_was_changed():
    table = known_table(KNOWN)
    assert table.columns == ("model", "in the fit", "left out", "E_x, %", "E_y, %", "G_xy, %")
    assert table.texts[0] == ("as it stands", "21.2", "46.5", "0.0", "0.0", "0.0")
    assert table.texts[2] == ("with fluid loading and attached mass", "42.8", "94.0", "+1.2", "-2.5", "0.0")
    assert [row[0] for row in table.texts[3:]] == [
        "with transverse shear, fluid loading and attached mass",
        "without attached mass",
    ]
    both = replace(AIR, combination=("fluid_loading",), without=("attached_mass",), leave_one_out_rms_cents=None)
    assert known_table((STANDS, both)).texts[1][:3] == ("with fluid loading, without attached mass", "42.8", "–")
    assert known_table(KNOWN[:1]) is known_table(()) is None

    header, *rows = csv.reader(io.StringIO(render(table, "csv")))
    assert header[:3] == ["model", "in_sample_rms_cents", "leave_one_out_rms_cents"]
    assert rows[2] == ["with fluid loading and attached mass", "42.75", "94.0", "1.25", "-2.5", "0.0"]
    assert len(rows) == len(KNOWN)
    assert render(known_table((STANDS, both)), "csv").splitlines()[2].endswith('",42.75,,1.25,-2.5,0.0')


def test_falls_and_rises_are_said_plainly():
    assert known_sentence(KNOWN) == (
        f"{BEGINNING}transverse shear lowers the leave-one-out error from 46 to 12 cents; fluid loading raises it from "
        "46 to 94 cents; attached mass, as declared, lowers it from 61 to 46 cents. "
        f"{RISE}, or the effect has another size on this board, or the fit was that good by chance. Of 5 combinations "
        "the board with transverse shear and attached mass has the lowest leave-one-out error, 12 cents."
    )
    assert known_sentence(KNOWN[:1]) == known_sentence(()) == ""
    some = [replace(one, n_left_out=4) for one in KNOWN]
    words = "Leave-one-out errors are of 4 of 6 readings: the others carry a constant or a size alone, or are no mode,"
    assert words in known_sentence(some)


def test_what_is_declared_without_a_size_is_compared_at_its_known_size():
    """As it stands the board has the size that the readings made of it; shear is added beside the known one."""
    stands = replace(STANDS, combination=("fluid_loading",), leave_one_out_rms_cents=25.0)
    known = replace(stands, leave_one_out_rms_cents=27.0)
    bare = replace(stands, combination=(), without=("fluid_loading",), leave_one_out_rms_cents=19.0)
    shear = replace(SHEAR, combination=("fluid_loading", "transverse_shear"), leave_one_out_rms_cents=17.0)
    told = known_sentence((stands, bare, shear, known))
    assert "transverse shear lowers it from 27 to 17 cents" in told
    assert "fluid loading, as declared, raises the leave-one-out error from 19 to 27 cents" in told


TOLD = [
    ((STANDS, SHEAR), "transverse shear lowers the leave-one-out error from 46 to 12 cents.", False),
    (
        (STANDS, replace(SENSOR, leave_one_out_rms_cents=12.0)),
        "attached mass, as declared, raises the leave-one-out error from 12 to 46 cents. ",
        True,
    ),
    ((STANDS, replace(AIR, leave_one_out_rms_cents=46.6)), "the leave-one-out error from 46 to 47 cents. ", True),
    ((STANDS, replace(AIR, leave_one_out_rms_cents=46.3)), "leaves the leave-one-out error at 46 cents.", False),
    ((STANDS, replace(AIR, leave_one_out_rms_cents=None)), "the error in the fit from 21 to 43 cents.", True),
    ((known_model(4.0, 6.0), known_model(5.0, 8.25, "fluid_loading")), "from 6.0 to 8.2 cents. ", True),
]  # fmt: skip


def test_each_effect_is_told_by_its_own_error():
    for models, words, rises in TOLD:
        told = known_sentence(models)
        assert words in told
        assert (RISE in told) is rises


def of_errors(neither, first, second, both):
    """A board that declares nothing, with shear, with air, with both."""
    names = ((), ("transverse_shear",), ("fluid_loading",), ("transverse_shear", "fluid_loading"))
    return tuple(
        replace(known_model(value, value), combination=one, effects=one)
        for one, value in zip(names, (neither, first, second, both), strict=True)
    )


NONE_BETTER = "No combination has a lower leave-one-out error than the board as it stands."
BEST = (
    "Of 4 combinations the board with transverse shear and fluid loading has the lowest leave-one-out error, {} cents."
)


@pytest.mark.parametrize(
    ("both", "told"),
    [(11.0, BEST.format(11)), (21.0, NONE_BETTER), (15.8, NONE_BETTER), (15.4, BEST.format(15))],  # 15.8 is shown as 16
)
def test_the_best_combination_is_told_or_that_there_is_none(both, told):
    models = of_errors(16.0, 20.0, 43.0, both)
    assert told in known_sentence(models)
    assert "combinations" not in known_sentence(models[:3])


TOGETHER = [
    ((16.0, 20.0, 43.0, 4.0), True),
    ((16.0, 15.9, 43.0, 4.0), False),
    ((16.0, 20.0, 15.9, 4.0), False),
    ((16.0, 20.0, 43.0, 16.1), False),
]


def test_two_effects_that_work_only_together_are_told_so():
    words = (
        "Transverse shear and fluid loading work only together: transverse shear alone takes the leave-one-out error "
        "from 16.0 to 20.0 cents, fluid loading alone to 43.0, both to 4.0."
    )
    for errors, is_told in TOGETHER:
        told = known_sentence(of_errors(*errors))
        assert (words in told) is ("only together" in told) is is_told


def test_two_effects_of_which_one_is_declared_are_seen_to_work_only_together():
    """The board as it stands has the sensor: without it the error is the reference."""
    stands, air, bare, both = (
        replace(known_model(value, value, without=without), combination=names, effects=effects)
        for value, names, effects, without in (
            (20.0, ("attached_mass",), (), ()),
            (4.0, ("fluid_loading", "attached_mass"), ("fluid_loading",), ()),
            (16.0, (), (), ("attached_mass",)),
            (43.0, ("fluid_loading",), ("fluid_loading",), ("attached_mass",)),
        )
    )
    told = known_sentence((stands, bare, both, air))
    assert "work only together" in told
    assert "from 16.0 to" in told


def test_files_are_written_only_where_there_is_something_to_tell(tmp_path):
    always = ["before-after.csv", "before-after.tex"]
    for word, wanted in (("none needed", always), ("named", [*always, "known-effects.csv", "known-effects.tex"])):
        written = [path.name for path in write_diagnosis_tables(tmp_path, DIAGNOSES[word], "x")]
        assert written == sorted(path.name for path in tmp_path.iterdir()) == wanted
