"""Cards, fragments, campaigns and tables of boards with anything in them: read or refused with faults, nothing else."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from fuzzing import accepted_or_refused, fuzzed, stopped_if_it_hangs
from hypothesis import strategies as st
from made_campaigns import TWO_BOARDS as CAMPAIGN

from bayesplate.board.board import Board
from bayesplate.board.campaign import load_campaign
from bayesplate.board.checks import physical_faults
from bayesplate.board.fragment import merge_fragment
from bayesplate.board.shelf import CardFile, shelf_folder
from bayesplate.board.toml import parse_toml
from bayesplate.board.writing import toml_text
from bayesplate.commands.batch_boards import list_boards
from bayesplate.errors import Fault, InputError

BOARD = "finnish-spruce-cantilever"
CARD = (shelf_folder("boards") / f"{BOARD}.toml").read_text(encoding="utf-8")
TEMPLATE = CARD.partition("[setup.frequencies_hz]")[0].replace(BOARD, "template")
FRAGMENT = """\
# Picked from hit1.wav
[setup]
spurious_probability = 0.02
[setup.frequencies_hz]
"(1,0)" = { mean = 52.1, sd = 0.1 }
[setup.label_confidence]
"(1,0)" = 0.99
[setup.signs]
"(1,0)" = "+"
[[setup.peaks]]  # (2,1) 80 %
hz = { mean = 404.0, sd = 0.2 }
amplitude = 0.2
[setup.hammer]
at_mm = [20, 20]
[[setup.attached]]
kind = "accelerometer"
at_mm = [200, 20]
"""
PIECES = [
    *'[]{}=,."#-\n\t\0\'', "[[", "]]", '"""', "1e999", "nan", "-inf", "true", "\\u0000", "\\u007F", "\ufeff", "\u202e",
    "é", "\x1b", "[setup]", "[[setup]]", "[[setup.peaks]]", "[shared]", "name", 'name = "free"\n', "(1,0)", "edges",
    "readings", "9" * 400, "0x" + "f" * 5000, "1979-05-27T07:32:00Z", "07:32:00", "boards", '"../../x.toml"', '"CON"',
]  # fmt: skip
WORDS = ["clamped", "free", "+", "log-normal", "accelerometer", "exciter", "held", "", "\x7f", "../x.toml", "my-board"]
LEAVES = st.one_of(
    st.booleans(),
    st.integers(-(10**400), 10**400),
    st.floats(),
    st.sampled_from(WORDS),
    st.text(max_size=20),
    st.datetimes().map(lambda one: one.replace(fold=0)),
    st.dates(),
)
CARD_KEYS = [
    *("mean", "sd", "readings", "resolution", "at_x_mm", "at_y_mm", "median", "factor", "x0", "y1", "name", "setup"),
    *("(1,0)", "( 1,0)", "(0,0)", "edges", "kind", "at_mm", "mass_g", "a.b", "\x7f"),
    *("peaks", "hz", "sign", "label_confidence", "missed_probability"),
    *("warp_mm", "cup", "bow", "twist", "support", "bounce_hz", "fluid", "air", "density_kg_m3", "baffle"),
    *("coil_mass_g", "suspension_n_per_m", "resonance_hz", "magnet"),
]
KEYS = st.one_of(st.text(max_size=8), st.sampled_from(CARD_KEYS))
TREES = st.recursive(LEAVES, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4))
SOUND: dict[str, Any] = parse_toml(CARD.encode(), "board.toml")
BENCH: dict[str, Path] = {}


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Where the files lie."""
    BENCH["folder"] = tmp_path_factory.mktemp("fuzz")
    (BENCH["folder"] / "template.toml").write_text(TEMPLATE, encoding="utf-8")


def spliced(text: str, pieces: Sequence[str] = PIECES) -> st.SearchStrategy[str]:
    """A text with some of it taken out and pieces put in."""
    part = st.tuples(st.integers(0, len(text)), st.integers(0, 30), st.lists(st.sampled_from(pieces), max_size=3))

    def put(parts: list[tuple[int, int, list[str]]]) -> str:
        found = text
        for at, length, pieces in parts:
            found = found[:at] + "".join(pieces) + found[at + length :]
        return found

    return st.lists(part, min_size=1, max_size=3).map(put)


def written(name: str, content: str | bytes) -> Path:
    """A file with a text."""
    path = BENCH["folder"] / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8", "replace"))
    return path


@st.composite
def mutated_cards(draw: st.DrawFn) -> dict[str, Any]:
    """The sound card with one node replaced, added or removed, at any depth."""

    def mutate(node: Any) -> Any:
        if isinstance(node, dict) and node and draw(st.integers(0, 3)):
            key = draw(st.sampled_from(sorted(node)))
            kept = {name: value for name, value in node.items() if name != key}
            action = draw(st.integers(0, 5))
            if action == 0:
                return kept
            return {**node, draw(KEYS): draw(TREES)} if action == 1 else {**kept, key: mutate(node[key])}
        return draw(TREES)

    table = mutate(SOUND)
    return table if isinstance(table, dict) else {"plate": table}


def read_card(card: str | dict[str, Any]) -> None:
    """A card, which means something where it is read."""

    def read() -> Board:
        if isinstance(card, str):
            return Board.from_text(card, BOARD)
        return Board.from_card(CardFile(card, f"{card.get('name')}.toml"))

    if isinstance(found := accepted_or_refused(read), Board):
        assert all(isinstance(fault, Fault) for fault in physical_faults(found))
        for quantity in (one.frequency for setup in found.setups for one in (*setup.readings, *setup.peaks)):
            assert math.isfinite(float(quantity.value(1.0)))
            assert 0.1 <= quantity.mean <= 1e6


def reading(name: str, read: Callable[[Path], Any]) -> Callable[..., None]:
    """The test of a reader of files: a file with any content is read or refused, and nothing else."""

    def body(content: str | bytes) -> None:
        path = written(name, content)
        accepted_or_refused(lambda: read(path), BENCH["folder"])

    return body


def each_of(table: Path, template: Path | None) -> list[Any]:
    """The boards of a table or of a folder: a fault of one is that one's alone."""
    boards, _ = list_boards(table, template)
    return [accepted_or_refused(board.card) for board in boards]


def written_and_read(tree: dict[str, Any]) -> None:
    """What is written as TOML is read again as it was."""
    found = parse_toml(toml_text({"tree": tree}).encode("utf-8"), "a.toml")
    assert in_order(found) == in_order({"tree": tree})


def in_order(node: Any) -> str:
    """A tree with its keys sorted, as text: numbers that are none are then equal."""
    if isinstance(node, dict):
        return repr({key: in_order(node[key]) for key in sorted(node)})
    return repr([in_order(one) for one in node]) if isinstance(node, list) else repr(node)


ROWS = """name,thickness_mm,thickness_mm sd,mass_g,title,"(1,0)","(1,0) sd","(2,0)"
a,3.1,0.1,300,first,52,0.5,310
b,2.9;3.0;3.1,,,second,52,,310
"""
CELLS = [",", '"', "\n", "\r", ";", "nan", "inf", "1e999", "1_000", "=cmd()", "\0", "\x7f", "\x1b[2J", "../x", "a", "٣"]
BYTES = st.binary(max_size=80)
NAMED = st.dictionaries(KEYS, TREES, max_size=4)
CARDS = [BYTES, spliced(CARD), NAMED.map(toml_text), spliced(CARD.replace("length_x_mm = 253", "length_x_mm = 1"))]


FRAGMENTS = [BYTES, spliced(FRAGMENT), NAMED.map(lambda tree: toml_text({"setup": tree}))]
read_fragment = reading("fragment.toml", lambda path: Board.from_card(CardFile(SOUND, f"{BOARD}.toml"), setup=path))
read_boards = reading("boards.csv", lambda path: each_of(path, BENCH["folder"] / "template.toml"))
read_folder = reading("fragment.toml", lambda path: each_of(path.parent, None))
read_campaign = reading("together.toml", load_campaign)

test_cards, test_cards_at_length = fuzzed(read_card, 300, card=st.one_of(spliced(CARD), mutated_cards()))
test_fragments, test_fragments_at_length = fuzzed(read_fragment, 100, content=st.one_of(*FRAGMENTS))
test_campaigns, test_campaigns_at_length = fuzzed(read_campaign, 80, content=st.one_of(BYTES, spliced(CAMPAIGN)))
test_tables, test_tables_at_length = fuzzed(read_boards, 60, content=st.one_of(BYTES, spliced(ROWS, CELLS)))
test_folders, test_folders_at_length = fuzzed(read_folder, 60, content=st.one_of(*CARDS))
test_toml, test_toml_at_length = fuzzed(written_and_read, 80, tree=NAMED)


def test_what_is_spoilt_here_was_sound():
    """The negative control."""
    whole, _ = merge_fragment(SOUND, "board.toml", written("fragment.toml", FRAGMENT))
    assert len(Board.from_text(toml_text(whole), BOARD).setups[0].readings) == 1
    assert load_campaign(written("my-campaign.toml", CAMPAIGN)).name == "my-campaign"
    boards, _ = list_boards(written("boards.csv", ROWS), BENCH["folder"] / "template.toml")
    assert [board.card().name for board in boards] == ["a", "b"]


def test_a_card_without_a_setup_has_that_of_the_fragment_alone():
    bare = {key: value for key, value in SOUND.items() if key != "setup"}
    for name in ("", 'name = "held"\n'):
        fragment = f'[setup]\n{name}edges = {{ x0 = "free", x1 = "free", y0 = "free", y1 = "free" }}\n'
        whole, _ = merge_fragment(bare, "board.toml", written("fragment.toml", fragment))
        assert isinstance(whole["setup"], dict), name


HUGE = "0x" + "f" * 5000
"""A whole number of 20,000 bits, which TOML may have and Python does not write in tens."""


def test_a_huge_number_is_a_fault_of_its_key_and_stops_no_batch(tmp_path):
    """It was once an error of the arithmetic, before any board had its turn."""
    for name, length in (("a", "253"), ("b", HUGE), ("c", "9" * 400)):
        text = CARD.replace(BOARD, name).replace("length_x_mm = 253", f"length_x_mm = {length}")
        (tmp_path / f"{name}.toml").write_text(text)
    found = each_of(tmp_path, None)
    assert [isinstance(one, InputError) for one in found] == [False, True, True]

    huge = CardFile(parse_toml((tmp_path / "b.toml").read_bytes(), "b.toml"), "b.toml")
    (tmp_path / "fragment.toml").write_text(FRAGMENT)
    (tmp_path / "template.toml").write_text(TEMPLATE.replace("length_x_mm = 253", f"length_x_mm = {HUGE}"))
    (tmp_path / "boards.csv").write_text(ROWS)
    beside = accepted_or_refused(lambda: Board.from_card(huge, setup=tmp_path / "fragment.toml"))
    for refused in (found[1], beside, each_of(tmp_path / "boards.csv", tmp_path / "template.toml")[0]):
        assert re.search(r"length_x_mm: wanted a number from .*, got a whole number of 20000 bits", str(refused))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs FIFOs in the file system")
def test_a_table_that_is_a_fifo_is_refused_without_waiting(tmp_path):
    os.mkfifo(tmp_path / "boards.csv")

    with stopped_if_it_hangs(1.0), pytest.raises(InputError, match=r"boards\.csv: wanted a regular file"):
        list_boards(tmp_path / "boards.csv", tmp_path / "template.toml")
