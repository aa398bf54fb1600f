"""Whatever stands in a file, it is read or refused with faults; nothing else is ever raised."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bayesplate.board.board import Board
from bayesplate.board.checks import physical_faults
from bayesplate.board.shelf import CardFile, shelf_folder
from bayesplate.board.toml import read_table
from bayesplate.errors import Fault, InputError

SEED = (shelf_folder("boards") / "finnish-spruce-cantilever.toml").read_text(encoding="utf-8")
PIECES = [*'[]{}=,."#-\n\t\0\'', "[[", "]]", '"""', "1e999", "nan", "0x", "true", "\\u0000", "\ufeff", "\u202e", "é",
          "[setup]", "[[setup]]", "(1,0)", "x0", "readings", "9" * 400]  # fmt: skip

LEAVES = st.one_of(
    st.booleans(),
    st.integers(-(10**400), 10**400),
    st.floats(),
    st.text(max_size=20),
    st.just(""),
    st.dates(),
    st.sampled_from(["clamped", "free", "+", "my-board", "log-normal", "accelerometer", "exciter", "held"]),
)
CARD_KEYS = [
    *("mean", "sd", "readings", "resolution", "at_x_mm", "at_y_mm", "median", "factor", "x0", "y1", "name"),
    *("(1,0)", "( 1,0)", "(0,0)", "edges", "kind", "at_mm", "mass_g"),
    *("peaks", "hz", "sign", "label_confidence", "missed_probability"),
    *("warp_mm", "cup", "bow", "twist", "support", "bounce_hz", "fluid", "air", "density_kg_m3", "baffle"),
    *("coil_mass_g", "suspension_n_per_m", "resonance_hz", "magnet"),
]
KEYS = st.one_of(st.text(max_size=8), st.sampled_from(CARD_KEYS))
TREES = st.recursive(LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4))
SOUND: dict[str, Any] = read_table(SEED.encode(), "seed.toml")


def check(faults: tuple[Fault, ...]) -> None:
    """A refusal lists faults that say something, in characters that cannot steer a terminal."""
    assert faults
    for fault in faults:
        assert fault.place
        assert fault.wanted
        assert fault.got
        assert str(fault).isprintable()


@settings(max_examples=400, deadline=None)
@given(st.integers(0, len(SEED)), st.integers(0, 40), st.lists(st.sampled_from(PIECES), max_size=4))
def test_mutated_text(start, length, pieces):
    text = SEED[:start] + "".join(pieces) + SEED[start + length :]
    try:
        card = Board.from_text(text, "finnish-spruce-cantilever")
    except InputError as error:
        check(error.faults)
    else:
        check_means_something(card)


@st.composite
def mutated_tables(draw: st.DrawFn) -> dict[str, Any]:
    """The sound card with one node replaced, added or removed, at any depth."""

    def mutate(node: Any) -> Any:
        if isinstance(node, dict) and node and draw(st.integers(0, 3)):
            key = draw(st.sampled_from(sorted(node)))
            kept = {name: value for name, value in node.items() if name != key}
            action = draw(st.integers(0, 5))
            if action == 0:
                return kept
            if action == 1:
                return {**node, draw(KEYS): draw(TREES)}
            return {**kept, key: mutate(node[key])}
        return draw(TREES)

    table = mutate(SOUND)
    return table if isinstance(table, dict) else {"plate": table}


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(mutated_tables())
def test_mutated_tables(table):
    try:
        card = Board.from_card(CardFile(table, f"{table.get('name')}.toml"))
    except InputError as error:
        check(error.faults)
    else:
        check_means_something(card)


def check_means_something(card: Board) -> None:
    assert all(isinstance(fault, Fault) for fault in physical_faults(card))
    for setup in card.setups:
        for quantity in (one.frequency for one in (*setup.readings, *setup.peaks)):
            assert math.isfinite(float(quantity.value(1.0)))
            assert 0.1 <= quantity.mean <= 1e6
