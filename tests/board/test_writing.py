"""Round trips: a card says what the same numbers say in Python, and what is written is read again as it was."""

from __future__ import annotations

import errno
import os
from dataclasses import replace

import numpy as np
import pytest
from stated import PRIOR, assert_said

from bayesplate import AttachedItem, Board, DeclaredFluid, InputError, Peak, PriorCard, Quantity, Setup
from bayesplate.board.named import load_named_cards
from bayesplate.board.prior import load_prior
from bayesplate.board.shelf import card_names
from bayesplate.commands.prepare import prepare

WHOLE = """\
format = 1
name = "whole"
title = "Fichte, \\"quer\\" – ÄÖÜ"
source = "line\\nbreak"
effects = ["grain_angle"]

[plate]
length_x_mm = 253.0
length_y_mm = { readings = [114.0, 113.8], at_x_mm = [0.0, 200.0] }
mass_g = { mean = 41.0, sd = 0.2 }
warp_mm = { cup = [1.0, 1.5], bow = { mean = -1.0, sd = 0.5 }, twist = 0.0 }

[plate.thickness_mm]
readings = [3.0, 2.9]
resolution = 0.1
at_x_mm = [10.0, 200.0]
at_y_mm = [50.0, 50.0]
place_sd_mm = 20.0

[material]
poisson_xy = { mean = 0.4, sd = 0.1 }
shear_xz_gpa = 0.6
shear_yz_gpa = { mean = 0.03, sd = 0.01 }
prior = "spruce"

[[setup]]
name = "held"
edges = { x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }
clamped_mm = { x0 = { mean = 30.0, sd = 0.5 } }
first_label = [1, 0]
resolution_hz = 0.5
noise_percent = { median = 0.5, factor = 2.0 }
unlabelled_hz = [448.8, { readings = [594.0, 595.0], resolution = 0.5 }, { mean = 640.0, sd = 1.0 }]
missed_probability = 0.1
spurious_probability = 0.05
signs = { "(1,0)" = "+", "(2,0)" = "-" }
label_confidence = { "(1,0)" = 0.9, "(2,0)" = 0.75 }
hammer = { at_mm = [60.0, 20.0] }
fluid = { density_kg_m3 = 1.2, baffle = "none" }

[[setup.peaks]]
hz = { readings = [671.0, 672.0], resolution = 0.1 }
sign = "-"
amplitude = 0.25
damping_percent = 1.23
spurious_probability = 0.3

[[setup.peaks]]
hz = 707.0
amplitude = 3.0

[[setup.peaks]]
hz = 810.0

[[setup.attached]]
kind = "accelerometer"
at_mm = [200.0, 20.0]
mass_g = { mean = 0.6, sd = 0.1 }

[[setup.attached]]
kind = "weight"
at_mm = [[100.0, 20.0], [200.0, 100.0]]

[[setup.attached]]
kind = "exciter"
mass_g = 48.0
coil_mass_g = 1.6
suspension_n_per_m = { mean = 2700.0, sd = 300.0 }
magnet = "held"

[[setup.attached]]
kind = "exciter"
at_mm = [100.0, 50.0]
resonance_hz = [28.3, 28.5]

[setup.frequencies_hz]
"(1,0)" = { readings = [52.0, 53.0], resolution = 0.5 }
"(1,1)" = 98.0
"(2,0)" = { mean = 310.0, sd = 2.0 }
"(1,2)" = 337.0
"(2,1)" = 398.0

[[setup]]
name = "free"
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
support = { bounce_hz = [3.5, 5.0] }
fluid = { density_kg_m3 = { mean = 997.0, sd = 2.0 } }
frequencies_hz = { "(1,1)" = 134.0 }
"""
"""A card that says nearly all that one may, as it is written."""


def whole():
    """The board of that card, from numbers in SI units."""
    held = Setup.from_frequencies(
        {(1, 0): [52.0, 53.0], "(1,1)": 98, "(2,0)": Quantity.from_mean(310.0, 2.0), (1, 2): 337.0, (2, 1): 398.0},
        name="held",
        edges={"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"},
        clamped={"x0": Quantity.from_mean(0.03, 0.0005)},
        first_label=(1, 0),
        resolution=0.5,
        noise=Quantity.from_median(0.005, 2.0),
        signs={"(1,0)": "+", (2, 0): "-"},
        unlabelled=[
            448.8,
            [594, 595],
            Quantity.from_mean(640.0, 1.0),
            Peak(Quantity.from_readings([671, 672], 0.1), "-", amplitude=0.25, damping=0.0123, spurious=0.3),
            Peak(707, amplitude=3),
            Peak(810),
        ],
        attached=[
            AttachedItem("accelerometer", ((0.2, 0.02),), Quantity.from_mean(0.6e-3, 0.1e-3)),
            AttachedItem("weight", ((0.1, 0.02), (0.2, 0.1))),
            AttachedItem("exciter", mass=0.048, coil=1.6e-3, suspension=Quantity.from_mean(2700, 300), magnet="held"),
            AttachedItem("exciter", ((0.1, 0.05),), resonance=np.array([28.3, 28.5])),
        ],
        hammer=(0.06, 0.02),
        fluid=DeclaredFluid(1.2, "none"),
    )
    confidence = (0.9, 1.0, 0.75, 1.0, 1.0)
    readings = tuple(replace(one, confidence=c) for one, c in zip(held.readings, confidence, strict=True))
    water = DeclaredFluid(Quantity.from_mean(997.0, 2.0))
    free = Setup.from_frequencies({(1, 1): 134.0}, name="free", edges="free", fluid=water, bounce=[3.5, 5.0])
    return Board.from_numbers(
        "whole",
        length_x=0.253,
        length_y=Quantity.from_readings([0.114, 0.1138], 0.0, [0.0, 0.2]),
        thickness=Quantity.from_readings([3.0e-3, 2.9e-3], 1e-4, [0.01, 0.2], [0.05, 0.05], place_sd=0.02),
        mass=Quantity.from_mean(0.041, 0.0002),
        poisson_xy=Quantity.from_mean(0.4, 0.1, "normal"),
        shear_xz=0.6e9,
        shear_yz=Quantity.from_mean(3e7, 1e7),
        warp={"cup": [1.0e-3, 1.5e-3], "bow": Quantity.from_mean(-1e-3, 5e-4, "normal"), "twist": 0.0},
        setups=[replace(held, readings=readings, missed=0.1, spurious=0.05), free],
        effects=["grain_angle"],
        prior="spruce",
        title='Fichte, "quer" – ÄÖÜ',
        source="line\nbreak",
    )


def again(board, text=None):
    """The board of a card, or of the card that another board is written as."""
    found = Board.from_text(text or board.to_toml(), board.name)
    named = load_named_cards(found)
    return found.assuming(named.prior, named.tables)


def as_stated(board):
    """Without what a card does not hold: notes, and parameters of effects, which it names."""
    return replace(board, notes=(), parameters=tuple(one for one in board.parameters if not one.is_of_effect))


def test_a_card_and_the_same_numbers_in_python_are_one_board():
    board = whole()

    assert board.to_toml() == WHOLE
    assert again(board, WHOLE) == board
    as_read = WHOLE.replace("{ readings = [52.0, 53.0], resolution = 0.5 }", "[52, 53]")
    as_read = as_read.replace("{ readings = [594.0, 595.0], resolution = 0.5 }", "[594, 595]")
    assert again(board, as_read) == board  # rounded as their setup says
    assert board.setup("held").readings[0].beams == (0, 0)
    assert board.warp["cup"].lower == 0.0
    alone = again(board, WHOLE.replace("twist = 0.0", "twist = { mean = 1.0, sd = 1.0 }")).warp["twist"]
    assert alone == Quantity.from_mean(1e-3, 1e-3, "normal", lower=0.0)


def test_readings_that_are_all_alike_are_not_taken_as_rounded_once_they_are_in_python():
    setup = Setup.from_frequencies({"(1,1)": 50.0, "(2,0)": 60.0, "(0,2)": 70.0}, edges="free", hammer=[0.02, 0.01])
    board = Board.from_numbers(
        "alike", length_x=0.5, length_y=0.2, thickness=[0.003, 0.003], mass=np.array([0.1]), setups=setup
    )
    read_again = Board.from_text(board.to_toml(), "alike")

    assert (board.inputs["thickness"].sd, board.inputs["mass"].sd) == (0.0, 0.0)
    assert read_again == board
    assert read_again.setups[0].hammer == (0.02, 0.01)


def test_every_shipped_card_comes_back():
    for name in card_names("boards"):
        board = prepare(name).board
        assert again(board) == as_stated(board), name
        assert again(board).to_toml() == board.to_toml(), name
    for name in card_names("priors"):
        card = load_prior(name)
        further = {"noise": None if card.noise_percent is None else card.noise_percent.scaled(0.01)}
        own = {} if card.E is None else {"E": card.E}
        made = PriorCard.from_quantities(
            name,
            card.constants | {key: one.quantity for key, one in own.items()},
            source=card.sources | {key: one.source for key, one in own.items()},
            poisson_xy=card.poisson_xy,
            density=card.density,
            title=card.title,
            **further,
        )
        assert made == card, name


CONSTANTS = {
    "E_x": Quantity.from_median(12e9, 1.3),
    "E_y": Quantity.from_range(0.4e9, 2e9),
    "G_xy": Quantity.from_median(0.7e9, 1.4),
}
FURTHER = {
    "noise": Quantity.from_median(0.005, 1.6),
    "poisson_xy": Quantity.from_mean(0.37, 0.05, "normal"),
    "density": Quantity.from_mean(430.0, 60.0),
}
RIGIDITIES = {
    "D_x": Quantity.from_median(30.0, 2.0),
    "D_y": Quantity.from_range(1.0, 4.0),
    "D_s": Quantity.from_median(6.0, 2.0),
}


def test_a_prior_card_and_the_same_quantities_are_one_prior(tmp_path):
    path = tmp_path / "mine.toml"
    source = dict(zip((*CONSTANTS, "noise", "poisson_xy", "density_kg_m3", "E"), "abcdefg", strict=True))
    prior = PriorCard.from_quantities(
        "mine", CONSTANTS | {"E": Quantity.from_median(70e9, 2.0)}, source=source, **FURTHER, title="Mine"
    )
    prior.to_toml(path)

    assert path.read_text(encoding="utf-8") == prior.to_toml() == PRIOR
    assert load_prior(path) == prior
    assert (prior.constants, prior.poisson_xy, prior.density) == (CONSTANTS, FURTHER["poisson_xy"], FURTHER["density"])
    assert prior.noise_percent == FURTHER["noise"].scaled(100.0)
    assert "".join(prior.sources.values()) == "abcdef"
    for constants, names, written in [
        (RIGIDITIES, list(RIGIDITIES), '[D_x]\ndistribution = "log-normal"\nmedian_n_m = 30.0\n'),
        ({"E": Quantity.from_median(70e9, 2.0)}, ["E_x"], '[E]\ndistribution = "log-normal"\nmedian_gpa = 70.0\n'),
    ]:
        prior = PriorCard.from_quantities("mine", constants, source="a test")
        prior.to_toml(path, force=True)
        assert load_prior(path) == prior
        assert prior.constants == dict(zip(names, constants.values(), strict=True))
        assert written in prior.to_toml()
        assert (prior.noise_percent, prior.poisson_xy) == (None, None)


def test_a_confidence_that_all_labels_share_is_one_number():
    setup = replace(whole().setups[0], readings=whole().setups[0].readings[:3])
    for confidence, written in [
        ((0.5, 0.5, 0.5), "label_confidence = 0.5\n"),
        ((0.5, 0.5, 1.0), 'label_confidence = { "(1,0)" = 0.5, "(1,1)" = 0.5 }\n'),
        ((0.5, 0.75, 0.5), 'label_confidence = { "(1,0)" = 0.5, "(1,1)" = 0.75, "(2,0)" = 0.5 }\n'),
    ]:
        readings = tuple(replace(one, confidence=c) for one, c in zip(setup.readings, confidence, strict=True))
        board = replace(whole(), setups=(replace(setup, readings=readings),))

        assert written in board.to_toml()
        assert tuple(one.confidence for one in again(board).setups[0].readings) == confidence


def test_a_peak_of_which_more_is_known_than_its_frequency_keeps_it():
    for more in [{"sign": "+"}, {"amplitude": 0.5}, {"damping": 0.01}, {"spurious": 0.1}]:
        peaks = (Peak(Quantity.exact(448.8), **more), Peak(Quantity.exact(594.1)))
        board = replace(whole(), setups=(replace(whole().setups[0], peaks=peaks),))

        assert again(board).setups[0].peaks == peaks


def with_peak(frequency):
    return replace(whole(), setups=(replace(whole().setups[0], peaks=(Peak(frequency),)),))


UNSTATABLE = [
    (lambda: whole().with_priors({"thickness": Quantity.from_range(2e-3, 4e-3)}),
     "thickness: wanted a log-normal quantity without bounds, as cards state it, got a log-uniform one with bounds"),
    (lambda: whole().with_priors({"poisson_xy": Quantity.from_mean(0.4, 0.1, "normal", 0.0)}),
     "poisson_xy: wanted a normal quantity without bounds, as cards state it, got a normal one with bounds"),
    (lambda: with_peak(Quantity.from_range(440.0, 450.0)),
     "held peak 1: wanted a log-normal quantity without bounds, as cards state it, got a log-uniform one with bounds"),
    (lambda: replace(whole(), warp={"cup": Quantity.from_mean(1e-3, 2e-4)}),
     "warp cup: wanted a normal quantity from 0 on, as cards state it, got a log-normal one"),
    (lambda: replace(whole(), warp={"cup": Quantity.from_mean(1e-3, 2e-4, "normal")}),
     "warp cup: wanted a normal quantity from 0 on, as cards state it, got a normal one"),
    (lambda: replace(whole(), warp={"bow": Quantity.from_mean(1e-3, 2e-4, "normal", lower=0.0)}),
     "warp bow: wanted a normal quantity without bounds, as cards state it, got a normal one with bounds"),
    (lambda: replace(whole(), setups=(replace(whole().setups[0], noise=0.01),)),
     "held noise: wanted a relative noise and how far it may be off: Quantity.from_median(0.005, 2), got an exact…"),
]  # fmt: skip


def test_what_no_card_can_state_is_refused():
    """It would come back as something else."""
    for make, said in UNSTATABLE:
        with pytest.raises(InputError) as refused:
            make().to_toml()
        assert_said(str(refused.value).splitlines(), [said])


def test_attributes_of_wrong_types_are_refused_together():
    first = whole().setups[0]
    board = replace(whole(), title=3, warp=None, setups=(replace(first, readings=[1], ends_x="free"), first.noise))

    with pytest.raises(InputError) as refused:
        board.to_toml()

    assert_said(
        str(refused.value).splitlines(),
        ["board.setups[0].ends_x: wanted a valid tuple, got 'free'",
         "board.setups[0].readings: wanted a valid tuple, got [1]",
         "board.setups[1]: wanted an instance of Setup, got…", "board.title: wanted a valid string, got 3",
         "board.warp: wanted a valid dictionary, got None"],
    )  # fmt: skip
    with pytest.raises(InputError, match=r"path: wanted whole\.toml, or a path to it, got 3"):
        whole().to_toml(3)


PLACES = [
    ("whole.toml", False, r"wanted a new file, got one that exists \(force=True replaces it\)"),
    ("other.toml", True, "wanted whole.toml, the name of the card, got other.toml"),
    ("nowhere/whole.toml", True, "wanted a place for the card, got No such file"),
]


def test_a_card_is_not_written_over_another_one_and_whole_or_not_at_all(tmp_path, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "whole.toml"
    path.write_text("mine", encoding="utf-8")
    for place, force, said in PLACES:
        with pytest.raises(InputError, match=said):
            whole().to_toml(tmp_path / place, force=force)
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(InputError, match="No space left on device"):
            whole().to_toml(path, force=True)
    assert [one.read_text(encoding="utf-8") for one in tmp_path.iterdir()] == ["mine"]
    whole().to_toml(path, force=True)
    assert path.read_text(encoding="utf-8") == WHOLE


def test_a_prior_card_with_readings_is_written_and_read(tmp_path):
    density = Quantity.from_readings([420.0, 430.0])
    prior = PriorCard.from_quantities("mine", CONSTANTS, source="a test", density=density)
    assert "readings = [420.0, 430.0]" in prior.to_toml(tmp_path / "mine.toml")
    assert load_prior(tmp_path / "mine.toml").density == prior.density
