"""One sound card, and the means to spoil it in one place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

BOARD = """\
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


def spoil(old: str, new: str, text: str = BOARD) -> str:
    """The card with one passage replaced; the passage must stand there exactly once."""
    if text.count(old) != 1:
        raise ValueError(f"{old!r} stands {text.count(old)} times in the card")
    return text.replace(old, new)


@pytest.fixture
def board_text() -> str:
    return BOARD


@pytest.fixture
def spoiled() -> Callable[..., str]:
    return spoil


@pytest.fixture
def board_file(tmp_path: Path) -> Path:
    path = tmp_path / "my-board.toml"
    path.write_text(BOARD, encoding="utf-8")
    return path
