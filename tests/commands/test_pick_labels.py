"""Labels of picked peaks: which a card states, and how sure it is said to be."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from generator.sand import photograph
from made_recordings import CARD, SENSOR, SIDES, board

from bayesplate.board.board import Board
from bayesplate.commands.pick_labels import Labels, assign_pictures, label_peaks
from bayesplate.commands.pick_words import moved_hit_remarks
from bayesplate.commands.prepare import PreparedBoard, prepare
from bayesplate.recordings.contract import LabelChance, PickedRow
from bayesplate.recordings.picking import PickedModes
from bayesplate.recordings.sand import straighten_picture
from bayesplate.recordings.spectra import Spectra
from bayesplate.recordings.strength import ModeMobility
from bayesplate.results.words import probabilities_text

CASES = {
    "both say the same: the confidence is that of sand and residues": (
        {"(3,1)": 0.999, "(2,2)": 0.001}, {"(3,1)": 0.6, "(2,2)": 0.4}, ("(3,1)", 0.6),
    ),
    "sand and residues tell nothing: beyond doubt by its frequency": ({"(3,1)": 0.995}, {}, ("(3,1)", 0.995)),
    "they tell nothing, and its frequency leaves some doubt": ({"(3,1)": 0.98, "(2,2)": 0.02}, {}, None),
    "they prefer another, yet all together leave no doubt": (
        {"(2,2)": 0.999}, {"(3,1)": 0.68, "(2,2)": 0.32}, ("(2,2)", 0.999),
    ),
    "they prefer another, and doubt is left": ({"(5,0)": 0.69, "(3,3)": 0.31}, {"(3,3)": 0.9, "(5,0)": 0.1}, None),
    "they are not sure": ({"(3,1)": 0.9, "(2,2)": 0.1}, {"(3,1)": 0.45, "(2,2)": 0.4}, None),
    "rather no mode": ({"(1,2)": 0.35}, {"(1,2)": 0.73}, None),
    "a mode of no clear name": ({"mode 7": 1.0}, {}, None),
}  # fmt: skip


def test_the_label_stated_is_never_another_than_the_most_probable():
    for by_all, by_evidence, expected in CASES.values():
        assert Labels((by_all,), (by_evidence,), None).label_to_state(0) == expected


PEAK = PickedRow(
    hz=0.0, sd_hz=0.0, noise_hz=0.0, scatter_hz=0.0, window_hz=0.0, damping_percent=1.0, damping_sd_percent=0.1,
    sign="", amplitude=1.0, spurious_probability=0.0, kind="", seen=1.0, alike=1.0,
)  # fmt: skip


def planted(material: str = "poisson_xy = 0.4") -> PreparedBoard:
    """The board that rings, before anything of it was read."""
    text = CARD.replace("poisson_xy = 0.4", material)
    return prepare(Board.from_text(text, "planted", may_lack_frequencies=True), may_lack_frequencies=True)


def heard(likely: tuple[PickedRow, ...]) -> SimpleNamespace:
    """What was picked without a force, between places that nobody knows."""
    spectra = SimpleNamespace(force=None, place_pairs=((None, None),))
    return SimpleNamespace(likely=likely, likely_mobilities=(), spectra=spectra)


def test_a_picture_of_another_mode_or_crosswise_is_told():
    """The picture is of one of its two peaks: of the other it is told."""
    prepared = planted()
    likely = tuple(replace(PEAK, hz=hz, sd_hz=1e-3 * hz) for hz in board().damped[:5])
    rng = np.random.default_rng(4)
    sand = [photograph(rng, board().modes.shape(m), SIDES) for m in (2, 3)]
    names = ["({},{})".format(*name) for name, _ in board().modes.names()[:4]]

    shown = [straighten_picture(picture) for picture in sand]
    labels = label_peaks(prepared.card, prepared.prior, heard(likely), None, {2: [shown[1]], 3: [shown[1]]})
    kept, told = assign_pictures(prepared.board, likely, {likely[2].hz: sand[0], 150.0: sand[1].T})

    (doubt,) = labels.doubts
    assert f"shows {names[3]}, and its frequency is that of {names[2]}: is it the picture of this peak" in doubt
    assert [*kept] == [2]
    assert told[0].startswith(
        "the sand at 150 Hz left out: the picture is higher than wide, the board 580 mm along x and"
    )


def test_false_peaks_among_the_lowest_do_not_change_the_labels_of_the_others():
    """Three are no modes. One lies 4 % from a mode, and might be it of a plate that is 1 % unlike the board."""
    prepared = planted()
    names = ["({},{})".format(*name) for name, _ in board().modes.names()[:6]]
    truth = board().damped[:6]
    true = [(hz, 0.0, name) for hz, name in zip(truth, names, strict=True)]
    false = [(0.5 * truth[0], 0.1, ""), (1.04 * truth[0], 0.15, ""), (1.05 * truth[2], 0.2, "")]
    every = sorted(true + false)
    likely = tuple(replace(PEAK, hz=hz, sd_hz=1e-3 * hz, spurious_probability=spurious) for hz, spurious, _ in every)

    labels = label_peaks(prepared.card, prepared.prior, heard(likely), None, {})

    for found, (_, _, name) in zip(labels.probabilities, every, strict=True):
        assert not name or found.get(name, 0.0) > 0.95, name


HAMMERS = ((0.03, 0.02), (0.29, 0.02), (0.145, 0.19), (0.43, 0.1))


def hit_at(given: tuple[tuple[float, float], ...]) -> PickedModes:
    """What was picked with a force, the hammer at four places of which others may be given."""
    ring = board()
    hz = ring.damped[:6]
    residues = np.stack([ring.residues(hammer, SENSOR)[:6] for hammer in HAMMERS], axis=1)
    answers = tuple(ModeMobility(row + 0j, np.full(4, 0.01 * np.abs(residues).max()), 1.0) for row in residues)
    lines, n = np.linspace(0.0, 500.0, 9), np.arange(4)
    spectra = Spectra(
        lines, np.ones((9, 4), dtype=complex), np.ones((9, 4), dtype=complex), ("a", "b", "c", "d"), n, n, n,
        tuple((hammer, SENSOR) for hammer in given), "acceleration", 2.0,
    )  # fmt: skip
    return PickedModes(tuple(replace(PEAK, hz=one, sd_hz=1e-3 * one) for one in hz), answers, spectra, (), 20.0, 500.0)


def test_places_that_contradict_every_label_say_nothing_and_are_asked_about():
    """Grain along either side makes two plates of nearly these peaks, and a wrong order may name the other."""
    prepared = planted('prior = "spruce"')
    names = ["({},{})".format(*name) for name, _ in board().modes.names()[:6]]

    right, wrong = (
        label_peaks(prepared.card, prepared.prior, hit_at(given), None, {}) for given in (HAMMERS, HAMMERS[::-1])
    )

    for labels in (right, wrong):
        assert [next(iter(own)) for own in labels.probabilities] == names
    assert not right.doubts
    assert right.flips is False
    assert wrong.doubts[0].startswith("the residues are those of no modes between these places")
    assert wrong.flips is None


ROW = PickedRow(
    hz=184.6, sd_hz=0.2, noise_hz=0.1, scatter_hz=0.0, window_hz=0.18, damping_percent=1.1, damping_sd_percent=0.06,
    sign="-", amplitude=0.13, spurious_probability=0.1, kind="", seen=1.0, alike=0.99,
    labels=(LabelChance("(1,2)", 0.35), LabelChance("(3,0)", 0.04), LabelChance("(0,2)", 0.01)),
    unlabelled_probability=0.6,
)  # fmt: skip


def test_a_peak_that_fits_none_of_the_boards_modes_is_rather_no_mode_of_it():
    """Though it is one by the recordings, which alone decide without a card: a support rings too."""
    bare = replace(ROW, labels=(), unlabelled_probability=None)
    assert ROW.is_likely
    assert ROW.mode_probability == pytest.approx(0.9 * 0.4)
    assert bare.mode_probability == pytest.approx(0.9)
    assert probabilities_text(ROW.may_be(2)) == "(1,2) 35 %, (3,0) 4 %, none 60 %"
    assert probabilities_text(replace(ROW, unlabelled_probability=0.05).may_be(1)) == "(1,2) 35 %"
    assert probabilities_text(bare.may_be(2)) == "–"


def test_loud_peaks_that_differ_from_hit_to_hit_ask_whether_the_hits_were_at_one_place():
    unlike = replace(ROW, kind="not alike from hit to hit", spurious_probability=0.9, amplitude=0.5)
    steady, faint = replace(unlike, damping_percent=0.01), replace(unlike, amplitude=0.02)
    moved = [replace(unlike, hz=hz) for hz in (181.0, 263.9, 283.3)]

    assert moved_hit_remarks([ROW, *moved[:2], steady, faint], 2.0) == []
    (told,) = moved_hit_remarks([ROW, *moved], 2.0)
    assert told.startswith("3 loud peaks ring down but are not alike from hit to hit, 181.0, 263.9, 283.3 Hz: were all")
