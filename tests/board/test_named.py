"""The cards that a board card names: found beside it, read once, and every one that is not there named at once."""

from __future__ import annotations

import hashlib

import pytest

from bayesplate.board.board import Board
from bayesplate.board.named import load_named
from bayesplate.board.shelf import shelf_folder

RESOLUTION = "resolution_hz = 1\n"
NO_PRIOR = ("poisson_xy = 0.51", 'prior = "spruse"')
NO_TABLE = (RESOLUTION, RESOLUTION + 'published_coefficients = "paper"\n')
PRIOR_PLACE = 'my-board.toml [material] prior -> "spruse"'
TABLE_PLACE = 'my-board.toml [setup] published_coefficients -> "paper"'


@pytest.mark.parametrize(
    ("changes", "places"),
    [([NO_PRIOR], [PRIOR_PLACE]), ([NO_TABLE], [TABLE_PLACE]), ([NO_PRIOR, NO_TABLE], [PRIOR_PLACE, TABLE_PLACE])],
    ids=["prior", "table", "both"],
)
def test_cards_that_are_not_there(spoiled, board_text, changes, places):
    for old, new in changes:
        board_text = spoiled(old, new, board_text)
    named = load_named(Board.from_text(board_text, "my-board"))

    assert [fault.place for fault in named.faults] == places
    assert (named.prior is None) == (NO_PRIOR in changes)
    assert named.tables == {}


def test_they_are_found_beside_the_board(board_file, spoiled, board_text):
    """Wherever the program was started: a relative path begins at the folder of the board card."""
    text = spoiled("poisson_xy = 0.51", 'prior = "./mine.toml"', board_text)
    board_file.write_text(spoiled(RESOLUTION, RESOLUTION + 'published_coefficients = "sub/own.toml"\n', text))
    missing = load_named(Board.from_toml(board_file))
    (board_file.parent / "sub").mkdir()
    shipped = (("priors", "spruce", "mine.toml", "mine"), ("coefficients", "paper-cantilever", "sub/own.toml", "own"))
    for kind, name, target, own in shipped:
        text = (shelf_folder(kind) / f"{name}.toml").read_text(encoding="utf-8")
        (board_file.parent / target).write_text(text.replace(f'name = "{name}"', f'name = "{own}"'), encoding="utf-8")
    found = load_named(Board.from_toml(board_file))

    assert [fault.got for fault in missing.faults] == ["no such file", "no such file"]
    assert found.faults == ()
    assert found.prior is not None
    assert (found.prior.name, found.tables["cantilever"].name) == ("mine", "own")


@pytest.mark.parametrize("end", ["\n", "\r\n"], ids=["unix", "windows"])
@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["plain", "byte order mark"])
def test_the_text_of_a_card_is_what_its_hash_is_of(board_file, board_text, end, mark):
    board_file.write_text(mark + board_text, encoding="utf-8", newline=end)
    card = Board.from_toml(board_file)
    board_file.unlink()

    assert hashlib.sha256(card.text.encode("utf-8")).hexdigest() == card.sha256
    assert card.text.removeprefix("\ufeff").replace("\r\n", "\n") == board_text
    again = Board.from_text(card.text, "my-board")
    assert (again.sha256, again.text) == (card.sha256, card.text)
