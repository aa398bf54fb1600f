"""Coefficient tables: the paper's printed numbers, under their labels."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bayesplate.board.coefficients import load_coefficients
from bayesplate.board.setup_keys import edge_letters
from bayesplate.errors import InputError

TABLE = """\
format = 1
name = "mine"
source = "a paper"
aspect_ratio = [223, 114]
first_label = [1, 0]
edges = { x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }
[training]
steps = [0.8, 1.2]
[coefficients]
"(1,0)" = { a = 3.21, b = -0.34, c = 0.00, r_squared = 1.00 }
"(1,1)" = { a = 3.99, b = 0.94, c = 40.5 }
"""


def load(tmp_path: Path, text: str) -> object:
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return load_coefficients(path)


def test_the_cantilever_table_as_printed():
    card = load_coefficients("paper-cantilever")

    # columns of the paper's table, in its order
    labels = [(1, 0), (1, 1), (2, 0), (1, 2), (2, 1), (2, 2)]
    a, b, c = (3.21, 3.99, 117, 14.4, 124, 134), (0, 0.94, 41.9, 1720, 15.6, 1910), (0, 40.5, 13.6, 155, 328, 1260)
    assert card.table == dict(zip(labels, zip(a, b, c, strict=True), strict=True))
    assert list(card.r_squared.values()) == [1.00, 1.00, 0.999, 0.999, 1.00, 1.00]
    assert edge_letters(card.edges.words) == "CFFF"
    assert card.first_label == (1, 0)
    assert card.aspect_ratio == pytest.approx(223 / 114)
    assert (card.training.E_x_gpa, card.training.E_y_gpa, card.training.G_xy_gpa) == (10.7, 0.716, 0.50)
    assert (card.training.G_xz_gpa, card.training.G_yz_gpa, card.training.nu_xy) == (0.62, 0.023, 0.51)


def test_the_clamped_table_as_printed():
    card = load_coefficients("paper-clamped")

    labels = [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)]
    a = (236, 237.5, 1790, 242, 1792, 1799)
    b = (1214, 8589, 1652, 31910, 10180, 35250)
    c = (146.9, 552.3, 534.9, 1196, 2051, 4469)
    assert card.table == dict(zip(labels, zip(a, b, c, strict=True), strict=True))
    assert edge_letters(card.edges.words) == "CCCC"
    assert card.first_label == (0, 0)
    assert card.aspect_ratio == pytest.approx(600 / 412)


FAULTS = [
    ("a = 3.21, ", "", '[coefficients] "(1,0)".a', "a value", "nothing"),
    ("r_squared = 1.00", "r_squared = 1.1", '[coefficients] "(1,0)".r_squared', "a number from 0 to 1", "1.1"),
    ('"(1,1)"', '"( 1,0)"', "[coefficients]", "the label (1,0) once",
     '"(1,0)" = a table with a, b, c, r_squared and'),
    ("[223, 114]", "[223]", "aspect_ratio", "two numbers, [L_x, L_y]", "a list of 1"),
    ("[223, 114]", "0", "aspect_ratio", "a positive number", "0"),
    ("steps", "step", "[training] step", "one of length_x_mm", "an unknown key (did you mean steps?)"),
    ("[0.8, 1.2]", "0.8", "[training] steps", "a list of factors", "0.8"),
    ('source = "a paper"\n', "", "source", "where the numbers come from", "nothing"),
]  # fmt: skip


def test_faults(tmp_path):
    for old, new, place, wanted, got in FAULTS:
        if TABLE.count(old) != 1:
            raise ValueError(old)
        pattern = re.escape(f"mine.toml {place}: wanted {wanted}") + ".*, got " + re.escape(got)
        with pytest.raises(InputError, match=pattern):
            load(tmp_path, TABLE.replace(old, new))
