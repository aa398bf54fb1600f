"""A sound card and a prior, what is told of a change of it, and what a board states in the units of its keys."""

from __future__ import annotations

import re
from collections.abc import Sequence

from bayesplate.board.board import Board
from bayesplate.board.checks import physical_faults
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.errors import InputError
from bayesplate.labels import Label

CARD = """\
format = 1
name = "my-board"
title = "A test board"
source = "invented"
effects = ["transverse_shear"]

[plate]
length_x_mm = 253
length_y_mm = 114
thickness_mm = { mean = 3.0, sd = 0.03 }
mass_g = 41.0

[material]
poisson_xy = 0.51
shear_yz_gpa = { mean = 0.03, sd = 0.01 }

[setup]
name = "cantilever"
edges = { x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }
clamped_mm = { x0 = 30 }
first_label = [1, 0]
resolution_hz = 1
unlabelled_hz = [448.8, 594.1]
noise_percent = { median = 0.5, factor = 2 }

[setup.frequencies_hz]
"(1,0)" = 52
"(1,1)" = [98, 98, 99]
"(2,0)" = { mean = 310, sd = 2 }

[setup.signs]
"(1,0)" = "+"

[setup.hammer]
at_mm = [60, 20]

[setup.fluid]
density_kg_m3 = 1.2
baffle = "none"

[[setup.attached]]
kind = "accelerometer"
mass_g = { mean = 0.6, sd = 0.1 }
at_mm = [200, 20]
"""

PRIOR = """\
format = 1
name = "mine"
title = "Mine"

[E_x]
distribution = "log-normal"
median_gpa = 12.0
factor = 1.3
source = "a"

[E_y]
distribution = "log-uniform"
lower_gpa = 0.4
upper_gpa = 2.0
source = "b"

[G_xy]
distribution = "log-normal"
median_gpa = 0.7
factor = 1.4
source = "c"

[E]
distribution = "log-normal"
median_gpa = 70.0
factor = 2.0
source = "g"

[noise_percent]
median = 0.5
factor = 1.6
source = "d"

[poisson_xy]
mean = 0.37
sd = 0.05
source = "e"

[density_kg_m3]
mean = 430.0
sd = 60.0
source = "f"
"""
"""A prior card that says all that one may, as it is written."""


def changed(*passages: str, text: str = CARD) -> str:
    """The card with passages replaced, OLD, NEW, OLD, NEW; each must stand there exactly once."""
    for old, new in zip(passages[::2], passages[1::2], strict=True):
        if text.count(old) != 1:
            raise ValueError(f"{old!r} stands {text.count(old)} times in the card")
        text = text.replace(old, new)
    return text


def read(text: str = CARD) -> Board:
    """The board of my-board.toml with this text."""
    return Board.from_text(text, "my-board")


def told(text: str) -> list[str]:
    """Every fault of my-board.toml with this text, of its writing or else of its meaning, without the file's name."""
    try:
        faults: Sequence[object] = physical_faults(read(text))
    except InputError as error:
        faults = error.faults
    return [str(fault).removeprefix("my-board.toml ").removeprefix("my-board.toml") for fault in faults]


def assert_said(found: Sequence[str], said: Sequence[str]) -> None:
    """Every message and no other one, in order; "…" stands for any passage."""
    patterns = [".*".join(map(re.escape, one.split("…"))) for one in said]
    as_said = [re.fullmatch(pattern, one) is not None for pattern, one in zip(patterns, found, strict=False)]
    assert len(found) == len(said), (found, said)
    assert all(as_said), (found, said)


def frequencies(setup: Setup) -> dict[Label, Quantity]:
    """Quantity of every label, Hz."""
    return {reading.label: reading.frequency for reading in setup.readings}


def millimetres(board: Board, *names: str) -> tuple[float, ...]:
    """Means of some of its lengths."""
    return tuple(round(1e3 * board.inputs[name].mean, 9) for name in names)
