"""A board written as a card and read again is the same board."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesplate.board.attached import AttachedItem, DeclaredFluid
from bayesplate.board.board import Board, made_board
from bayesplate.board.named import load_named
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import Setup
from bayesplate.board.shelf import card_names
from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError
from bayesplate.labels import Label


def numbers(thing):
    """Every number of a nested thing of dataclasses, tuples and dicts, and every text, in order."""
    if isinstance(thing, float | int | np.ndarray) and not isinstance(thing, bool):
        return [float(thing)]
    if isinstance(thing, dict):
        return [n for key, value in thing.items() for n in (*numbers(key), *numbers(value))]
    if isinstance(thing, list | tuple):
        return [n for value in thing for n in numbers(value)]
    return numbers(vars(thing)) if hasattr(thing, "__dict__") else [thing]


def assert_same(one, other):
    first, second = numbers(one), numbers(other)
    assert len(first) == len(second)
    for a, b in zip(first, second, strict=True):
        assert a == (pytest.approx(b, rel=1e-11, nan_ok=True) if isinstance(b, float) else b)


def again(board):
    read = Board.from_text(board.to_toml(), board.name)
    named = load_named(read)
    return read.assuming(named.prior, named.tables)


def comparable(board):
    """Without what a card does not hold: its own file, notes, and parameters of effects, which it names."""
    own = tuple(one for one in board.parameters if not one.is_of_effect)
    fields = {k: v for k, v in vars(board).items() if k in board.__dataclass_fields__}
    return fields | {"card": None, "notes": (), "parameters": own}


def test_every_shipped_board_comes_back():
    for name in card_names("boards"):
        board = prepare(name).board
        assert comparable(again(board)) == comparable(board)
        assert again(board).to_toml() == board.to_toml()


def everything():
    """A board that uses every key of a card."""
    places = Quantity.from_readings([3.0e-3, 2.9e-3], 1e-4, [0.01, 0.2], [0.05, 0.05], place_sd=0.02)
    held = Setup(
        name="held",
        ends_x=("clamped", "free"),
        ends_y=("free", "free"),
        readings=(
            Reading(Label(1, 0), (0, 0), Quantity.from_readings([52.0, 53.0], 1.0), "+", 0.9),
            Reading(Label(1, 1), (0, 1), Quantity.exact(98.0)),
            Reading(Label(2, 0), (1, 0), Quantity.from_mean(310.0, 2.0), "-", 0.75),
        ),
        noise=Quantity.from_median(0.004, 1.7),
        clamped={"x0": Quantity.from_mean(0.03, 0.0005)},
        resolution=0.5,
        peaks=(
            Peak(Quantity.exact(448.8)),
            Peak(Quantity.from_readings([594.1, 594.4], 0.5)),
            Peak(Quantity.from_mean(671.2, 0.3), "-", 0.25, 0.0123),
            Peak(Quantity.exact(707.0), amplitude=3.0),
        ),
        missed=0.1,
        spurious=0.05,
        first_label=Label(1, 0),
        attached=(
            AttachedItem("accelerometer", ((0.2, 0.02),), Quantity.from_mean(0.6e-3, 0.1e-3)),
            AttachedItem("weight", ((0.1, 0.02), (0.2, 0.1))),
            AttachedItem("weight"),
            AttachedItem(
                "exciter",
                mass=Quantity.from_mean(0.048, 0.001),
                coil=Quantity.exact(1.6e-3),
                suspension=Quantity.from_mean(2700.0, 300.0),
                magnet="held",
            ),
            AttachedItem("exciter", ((0.1, 0.05),), resonance=Quantity.from_readings([28.3, 28.5])),
        ),
        hammer=(0.02, 0.02),
        fluid=DeclaredFluid(Quantity.exact(1.2), "none"),
    )
    free = Setup("free", ("free", "free"), ("free", "free"), (), Quantity.from_median(0.003, 1.65),
                 fluid=DeclaredFluid(Quantity.from_mean(997.0, 2.0)), bounce=Quantity.from_mean(4.5, 1.0))  # fmt: skip
    inputs = {
        "length_x": Quantity.exact(0.253),
        "length_y": Quantity.from_readings([0.114, 0.1138], 0.0, [0.0, 0.2]),
        "thickness": places,
        "mass": Quantity.from_mean(0.041, 0.0002),
        "poisson_xy": Quantity.from_mean(0.4, 0.1, "normal"),
    }
    more = {"title": 'Fichte, "quer" – ÄÖÜ', "source": "line\nbreak", "effects": ("grain_angle",), "prior": "spruce"}
    more["warp"] = {
        "cup": Quantity.from_mean(0.8e-3, 0.5e-3, "normal", lower=0.0),
        "bow": Quantity.from_readings([-1.0e-3, -1.4e-3], 1e-4, kind="normal"),
        "twist": Quantity.exact(0.0),
    }
    setups = (replace(free, readings=(Reading(Label(1, 1), (1, 1), Quantity.exact(134.0)),)), held)
    return made_board("whole", inputs, setups, shear_xz=Quantity.exact(0.6e9), shear_yz=Quantity.exact(3e7), **more)


def test_every_key_comes_back():
    """To the rounding of a change of units at first, and from then on without any."""
    first = again(everything())
    assert_same(comparable(first), comparable(everything()))
    assert comparable(again(first)) == comparable(first)
    assert again(first).to_toml() == first.to_toml()


def test_a_changed_number_does_not_come_back_as_the_same():
    board = everything()
    thicker = board.with_priors({"thickness": board.inputs["thickness"].scaled(1.0 + 1e-9)})
    with pytest.raises(AssertionError):
        assert_same(comparable(again(thicker)), comparable(board))


def test_what_no_card_can_state_is_refused():
    """A log-uniform thickness or a bounded ratio would come back as something else."""
    for name in ["thickness", "poisson_xy"]:
        known = {
            "thickness": Quantity.from_range(2e-3, 4e-3),
            "poisson_xy": Quantity.from_mean(0.4, 0.1, "normal", 0.0),
        }
        with pytest.raises(
            InputError, match=f"{name}: wanted a .*normal quantity without bounds, as cards state it, got"
        ):
            everything().with_priors({name: known[name]}).to_toml()


OTHER_WARPS = [
    ("cup", Quantity.from_mean(1e-3, 2e-4)),
    ("cup", Quantity.from_mean(1e-3, 2e-4, "normal")),
    ("bow", Quantity.from_mean(1e-3, 2e-4, "normal", lower=0.0)),
]


def test_a_warp_of_another_density_is_refused():
    for name, rise in OTHER_WARPS:
        with pytest.raises(
            InputError, match=f"warp {name}: wanted a normal quantity (from 0 on|without bounds), as cards"
        ):
            replace(everything(), warp={name: rise}).to_toml()


def test_peaks_and_what_is_believed_of_them_are_written_where_they_say_something():
    """The bare ones first as a list, then tables, in their order; the confidence of some labels by label."""
    text, bare = everything().to_toml(), replace(everything(), setups=everything().setups[:1]).to_toml()

    assert "unlabelled_hz = [448.8, { readings = [594.1, 594.4], resolution = 0.5 }]" in text
    first = '[[setup.peaks]]\nhz = { mean = 671.2, sd = 0.3 }\nsign = "-"\namplitude = 0.25\ndamping_percent = 1.23\n'
    assert f"{first}\n[[setup.peaks]]\nhz = 707.0\namplitude = 3.0\n" in text
    assert 'label_confidence = { "(1,0)" = 0.9, "(2,0)" = 0.75 }' in text
    assert "missed_probability = 0.1\nspurious_probability = 0.05\n" in text
    assert not any(key in bare for key in ("unlabelled", "peaks", "confidence", "missed", "spurious"))


SHARED = [
    ((0.5, 0.5, 0.5), "label_confidence = 0.5\n"),
    ((0.5, 0.5, 1.0), 'label_confidence = { "(1,0)" = 0.5, "(1,1)" = 0.5 }\n'),
    ((0.5, 0.75, 0.5), 'label_confidence = { "(1,0)" = 0.5, "(1,1)" = 0.75, "(2,0)" = 0.5 }\n'),
]


def test_a_confidence_that_all_labels_share_is_one_number():
    for confidence, written in SHARED:
        setup = everything().setups[1]
        readings = tuple(replace(one, confidence=c) for one, c in zip(setup.readings, confidence, strict=True))
        board = replace(everything(), setups=(replace(setup, readings=readings),))

        assert written in board.to_toml()
        assert tuple(one.confidence for one in again(board).setups[0].readings) == confidence


def test_a_peak_of_which_more_is_known_than_its_frequency_keeps_it():
    for more in [{"sign": "+"}, {"amplitude": 0.5}, {"damping": 0.01}]:
        peaks = (Peak(Quantity.exact(448.8), **more), Peak(Quantity.exact(594.1)))
        board = replace(everything(), setups=(replace(everything().setups[0], peaks=peaks),))

        assert again(board).setups[0].peaks == peaks
