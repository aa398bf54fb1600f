"""A card's file is found, regular, small, UTF-8 and TOML, or the message says where it is not."""

from __future__ import annotations

import hashlib
import os
import re
import socket
import time
import tracemalloc
from pathlib import Path

import pytest
from stated import CARD, changed, read

from bayesplate.board.board import Board
from bayesplate.board.coefficients import load_coefficients
from bayesplate.board.prior import load_prior
from bayesplate.board.shelf import card_names
from bayesplate.errors import InputError


@pytest.fixture
def path(tmp_path):
    """The file of a sound card."""
    path = tmp_path / "my-board.toml"
    path.write_text(CARD, encoding="utf-8")
    return path


def refused(message):
    """A refusal that says so."""
    return pytest.raises(InputError, match=re.escape(message))


MISSPELT = [
    (Board.from_toml, "board", "finish-spruce-cantilever", "finnish-spruce-cantilever"),
    (Board.from_toml, "board", "fiemme", "fiemme-spruce-clamped"),
    (Board.from_toml, "board", "2r", "spruce-free-2R"),
    (load_prior, "prior", "spruse", "spruce"),
    (load_coefficients, "coefficient", "paper-clampd", "paper-clamped"),
]


def test_a_misspelt_name_names_the_shelf_and_the_nearest_card():
    for load, kind, name, meant in MISSPELT:
        wanted = f'"{name}": wanted the name of a {kind} card, or a path that ends in .toml, got no card'
        with refused(wanted) as caught:
            load(name)
        assert f"models{os.sep}{kind}" in str(caught.value)
        assert f"did you mean {meant}?" in str(caught.value)


def test_what_is_no_name_of_a_card_is_answered_with_what_to_do(path, monkeypatch):
    """A part of several names stands for none; a path tells where it led; a file of that name here is offered."""
    here = path.parent
    monkeypatch.chdir(here)
    Path("peaks.csv").write_text("label,hz\n(1;1),35\n", encoding="utf-8")
    for name, said in [
        ("free", f"(a card in {here} is given as a path)"),
        (str(here / "no.toml"), f"{here / 'no.toml'}: wanted a card, got no such file (looked in {here})"),
        ("my-board", '(there is a file here: write "my-board.toml")'),
        ("peaks.csv", "a card is a TOML file"),
        ("./peaks.csv", "a card is a TOML file"),
    ]:
        with refused(said):
            Board.from_toml(name)
    for argument in (str(path), path, "my-board.toml"):
        card = Board.from_toml(argument)
        assert (card.folder, card.file, card.name) == (Path(argument).parent, "my-board.toml", "my-board")


def test_the_name_must_be_that_of_the_file(path):
    other = path.rename(path.with_name("other.toml"))
    with refused('other.toml name: wanted "other", the name of the file, got "my-board"'):
        Board.from_toml(other)
    rule = "A-Z, a-z, 0-9, '.', '_' or '-', beginning with a letter or digit, at most 80 characters"
    with refused(f'my board.toml: wanted {rule}, got "my board" (rename the file to my-board.toml)'):
        Board.from_toml(other.rename(path.with_name("my board.toml")))


def test_neither_shelf_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr("bayesplate.board.shelf._INSTALLED_SHELF", tmp_path / "one")
    monkeypatch.setattr("bayesplate.board.shelf._CHECKOUT_SHELF", tmp_path / "two")
    with refused(f"neither {tmp_path / 'one' / 'boards'} nor {tmp_path / 'two' / 'boards'}"):
        card_names("boards")


def make_socket(path: Path) -> None:
    place = os.getcwd()
    os.chdir(path.parent)  # the address of a socket has about a hundred characters at most
    try:
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(path.name)
    finally:
        os.chdir(place)


def link_to_zero(path: Path) -> None:
    path.symlink_to("/dev/zero")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs FIFOs, sockets and devices in the file system")
def test_what_is_no_regular_file_is_refused_at_once(tmp_path):
    kinds = [(Path.mkdir, "a directory"), (os.mkfifo, "a FIFO"), (make_socket, "a socket"), (link_to_zero, "a device")]
    for number, (make, kind) in enumerate(kinds):
        path = tmp_path / f"{number}.toml"
        make(path)
        begin = time.monotonic()
        with pytest.raises(InputError) as error:
            Board.from_toml(path)
        assert str(error.value) == f"{path}: wanted a regular file, got {kind}"
        assert time.monotonic() - begin < 1, kind


def test_a_file_that_cannot_be_read(path, monkeypatch):
    def denied(*_: object, **__: object) -> int:
        raise PermissionError(13, "Permission denied")

    for name in ["a\0b.toml", "./" + "a" * 5000 + ".toml"]:
        with refused(".toml: wanted a readable file, got"):
            Board.from_toml(name)
    monkeypatch.setattr("bayesplate.board.toml.os.open", denied)  # a file mode would not stop a test run by root
    with refused("my-board.toml: wanted a readable file, got permission denied"):
        Board.from_toml(path)


@pytest.mark.parametrize("load", [Board.from_toml, load_prior, load_coefficients])
def test_no_more_of_a_large_file_is_read_than_a_card_may_hold(path, load):
    """Half a gigabyte of nothing costs as much memory as the largest card, a few times over at most."""
    for n_bytes in (1_000_001, 500_000_000):
        os.truncate(path, n_bytes)
        tracemalloc.start()
        try:
            with refused("wanted a file of at most 1,000,000 bytes, got a larger one"):
                load(path)
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        assert peak < 5_000_000


NO_CARDS = [
    (b"", "my-board.toml: wanted a card, got an empty file"),
    (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
     "my-board.toml: wanted a text file, got binary data, a zero byte at offset 8"),
    (b'a = 1\nb = "caf\xe9"\n', "my-board.toml line 2: wanted UTF-8 text, got the byte 0xe9 at offset 14"),
    ("format = 1\n".encode("utf-16"), "my-board.toml: wanted UTF-8 text, got UTF-16 (save the file as UTF-8)"),
    ("format = 1\n".encode("utf-16-le"), "my-board.toml: wanted UTF-8 text, got UTF-16"),
    (b"format = 1\nformat = 1\n", "my-board.toml line 2: wanted each key and each table once, got \"format = 1\""),
    (b"a = 1\nb = 52,5\n", 'my-board.toml line 2: wanted TOML, got "b = 52,5"'),
    (b"a = 52,5\n", "(a number has a decimal point, not a comma)"),
    (b"a = [34,05, 35,2]\n", "(a number has a decimal point, not a comma)"),
    (b"[setup]\nx = 1\n[setup]\n",
     "(several setups are written [[setup]], in double brackets, each with a name)"),
    (b"label;Hz\n(1,1);35\n", "(a card is a TOML file with lines like length_x_mm = 550; bayesplate new writes"),
    (b"name = \xe2\x80\x9cboard\xe2\x80\x9d\n", '(straight quotes: name = "board")'),
    (b"(1,0) = 52\n", '(a label stands in quotes: "(1,0)" = 52)'),
    (b"notes =\n", "(a value after the sign, or leave the line out)"),
    (b"notes = K\xc3\xbcche\n", "(a text stands in quotes)"),
    (b"a = 52 Hz\n", "(the unit stands in the key: write the number alone)"),
    (b"thickness_mm = 118 thou\n", "(118 thou are 2.997 mm: write 2.997 alone, the unit stands in the key)"),
    ("length_x_mm = 2\u00a0530\n".encode(), "(it holds a non-breaking space: write a plain one, or none)"),
    ("bow = \u22121\n".encode(), "(it holds a typographic minus: write the hyphen -, which is the minus sign of a"),
    (b'a = 1\nb = "open\n', 'my-board.toml line 2: wanted TOML, got "b = \\"open"'),
    (b"<html><script>", 'my-board.toml line 1: wanted TOML, got "<html><script>"'),
    (b"a = \x1b[2J", 'got "a = \\x1b[2J"'),
    (b"a = " + b"9" * 5000, "my-board.toml line 1: wanted TOML"),
    (b"a = " + b"[" * 100_000, "my-board.toml: wanted tables and lists nested at most 20 deep"),
    (b"x = 1\n" + b".".join([b"a"] * 400_000) + b" = 1", "my-board.toml line 2: wanted a key of at most 20 parts"),
    (b"[" + b".".join([b'"a b"'] * 100_000) + b"]", "my-board.toml line 1: wanted a key of at most 20 parts"),
    # what the guard against long keys is quick about
    (b'"' * 900_000, "my-board.toml"),
    (b"'\"" * 450_000, "my-board.toml"),
    (b"a" * 900_000, "my-board.toml"),
    (b"a." * 10 + b" " * 900_000, "my-board.toml"),
]  # fmt: skip


def test_what_is_no_card_is_refused_soon(path):
    for content, message in NO_CARDS:
        path.write_bytes(content)
        begin = time.monotonic()
        with refused(message):
            Board.from_toml(path)
        assert time.monotonic() - begin < 5, message


SAME = [
    CARD.replace("\n", "\r\n"),
    "\ufeff" + CARD,
    "\ufeff" + CARD.replace("\n", "\r\n"),
    CARD.replace("\n", "  \n") + "\n\n",
    changed('"(1,0)" = 52\n', '" ( 1 , 0 ) " = 52\n'),
    CARD.replace("[setup]", "[[setup]]"),
    changed("[setup.fluid]", "[setup.air]"),
]


def test_how_a_card_is_written_changes_its_hash_alone(path):
    """The hash is that of the file's bytes, and the text that the board keeps is what it is of."""
    plain = read()
    for text in SAME:
        path.write_text(text, encoding="utf-8", newline="")
        card = Board.from_toml(path)
        data = path.read_bytes()
        path.unlink()

        assert card == plain
        assert card.text.encode("utf-8") == data
        assert card.sha256 == hashlib.sha256(data).hexdigest() == read(card.text).sha256 != plain.sha256


def test_texts_of_a_card_are_texts(tmp_path):
    """Kept as they are, and nothing in them is executed."""
    canary = tmp_path / "canary"
    code = f"!!python/object/apply:eval [__import__('pathlib').Path({str(canary)!r}).touch()]"
    title = f"<script>alert(1)</script> $\\frac{{1}}{{2}}$ 🪵 \u202eabc {code} {{{code}}}"
    text = changed("A test board", title.replace("\\", "\\\\"), 'source = "invented"', 'notes = "Küche, 21 °C, Tür zu"')
    card = read(changed('name = "cantilever"', 'name = "cantilever"\nnotes = "früh"', text=text))

    assert card.title == title
    assert card.card is not None
    assert (card.card.table["notes"], card.card.table["setup"]["notes"]) == ("Küche, 21 °C, Tür zu", "früh")
    assert not canary.exists()
