"""A label has one grammar: (m,n)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayesplate.errors import InputError
from bayesplate.labels import Label

INDEX = st.integers(0, 11)
SPACE = st.text(" \t", max_size=3)


@given(INDEX, INDEX, SPACE, SPACE, SPACE, SPACE, SPACE)
def test_spaces_beside_the_numbers_are_ignored(m, n, a, b, c, d, e):
    label = Label.parse(f"{a}({b}{m}{c},{d}{n}{e})")

    assert label == Label(m, n)
    assert Label.parse(str(label)) == label


REFUSED = ["10", "(1;0)", "(1.0,0)", "(-1,0)", "(12,0)", "(0,12)", "(01,0)", "(1 1,0)", "1,0", "(1,0", "", "(1,0,0)"]
REFUSED += ["(m,n)", "(1,0)\n", "(١,٠)", "[1,0]"]


def test_anything_else_is_refused():
    for text in REFUSED:
        with pytest.raises(
            InputError, match=r'mode label: wanted two whole numbers from 0 to 11, written like "\(1,0\)", got'
        ):
            Label.parse(text)
