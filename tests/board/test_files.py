"""A card's file is found, regular, small, UTF-8 and TOML, or the message says where it is not."""

from __future__ import annotations

import os
import re
import socket
import time
import tracemalloc
from pathlib import Path

import pytest

from bayesplate.board.board import Board
from bayesplate.board.coefficients import load_coefficients
from bayesplate.board.prior import load_prior
from bayesplate.board.shelf import card_names
from bayesplate.errors import InputError


@pytest.fixture
def write(tmp_path):
    def write_card(content: bytes | str) -> Path:
        path = tmp_path / "my-board.toml"
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    return write_card


def refused(message: str) -> object:
    return pytest.raises(InputError, match=re.escape(message))


def test_a_missing_file_names_the_path_and_the_folder(tmp_path):
    path = tmp_path / "nowhere.toml"
    with refused(f"{path}: wanted a card, got no such file (looked in {tmp_path})"):
        Board.from_toml(str(path))


MISSPELT = [
    (Board.from_toml, "board", "finish-spruce-cantilever", "finnish-spruce-cantilever"),
    (Board.from_toml, "board", "fiemme", "fiemme-spruce-clamped"),
    (Board.from_toml, "board", "2r", "spruce-free-2R"),
    (load_prior, "prior", "spruse", "spruce"),
    (load_coefficients, "coefficient", "paper-clampd", "paper-clamped"),
]


def test_a_misspelt_name_names_the_shelf_and_the_nearest_card():
    for load, kind, name, meant in MISSPELT:
        with refused(
            f'"{name}": wanted the name of a {kind} card, or a path that ends in .toml, got no card'
        ) as caught:
            load(name)
        assert f"models{os.sep}{kind}" in str(caught.value)
        assert f"did you mean {meant}?" in str(caught.value)


def test_a_part_of_several_names_stands_for_none():
    with refused("(a card in") as caught:
        Board.from_toml("free")
    assert "did you mean" not in str(caught.value)


def test_a_name_far_from_all_others_names_the_working_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with refused(f"(a card in {tmp_path} is given as a path)"):
        Board.from_toml("qqqq")


def test_a_table_of_readings_is_no_card(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("peaks.csv").write_text("label,hz\n(1;1),35\n", encoding="utf-8")
    for name in ("peaks.csv", "./peaks.csv"):
        with refused("a card is a TOML file"):
            Board.from_toml(name)


def test_a_file_of_that_name_here_is_offered(board_file, monkeypatch):
    monkeypatch.chdir(board_file.parent)
    with refused('(there is a file here: write "my-board.toml")'):
        Board.from_toml("my-board")
    assert Board.from_toml("my-board.toml").name == "my-board"


def test_a_card_is_read_by_path(board_file):
    for as_argument in [str, Path]:
        card = Board.from_toml(as_argument(board_file))

        assert (card.folder, card.file) == (board_file.parent, "my-board.toml")
        assert card.name == "my-board"


def test_the_name_must_be_that_of_the_file(board_file):
    other = board_file.rename(board_file.with_name("other.toml"))
    with refused('other.toml name: wanted "other", the name of the file, got "my-board"'):
        Board.from_toml(other)
    rule = "A-Z, a-z, 0-9, '.', '_' or '-', beginning with a letter or digit, at most 80 characters"
    with refused(f'my board.toml: wanted {rule}, got "my board" (rename the file to my-board.toml)'):
        Board.from_toml(other.rename(board_file.with_name("my board.toml")))


def test_neither_shelf_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr("bayesplate.board.shelf._INSTALLED", tmp_path / "one")
    monkeypatch.setattr("bayesplate.board.shelf._CHECKOUT", tmp_path / "two")
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


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs FIFOs and sockets in the file system")
@pytest.mark.parametrize(
    ("make", "kind"), [(Path.mkdir, "a directory"), (os.mkfifo, "a FIFO"), (make_socket, "a socket")]
)
def test_what_is_no_regular_file_is_refused_at_once(tmp_path, make, kind):
    path = tmp_path / "my-board.toml"
    make(path)
    begin = time.monotonic()
    with pytest.raises(InputError) as error:
        Board.from_toml(path)
    assert str(error.value) == f"{path}: wanted a regular file, got {kind}"
    assert time.monotonic() - begin < 1


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs /dev/zero")
def test_a_device_is_refused():
    with refused("/dev/zero: wanted a regular file, got a device"):
        Board.from_toml("/dev/zero")


def test_an_unreadable_file(board_file, monkeypatch):
    def denied(*_: object, **__: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("bayesplate.board.toml.os.open", denied)  # a file mode would not stop a test run by root
    with refused("my-board.toml: wanted a readable file, got permission denied"):
        Board.from_toml(board_file)


def test_an_impossible_path():
    for name in ["a\0b.toml", "./" + "a" * 5000 + ".toml"]:
        with refused(".toml: wanted a readable file, got"):
            Board.from_toml(name)


def test_a_large_file(write):
    for make in [lambda n: b"#" * n, lambda n: b"a = '" + b"x" * n]:
        with refused("wanted a file of at most 1,000,000 bytes, got a larger one"):
            Board.from_toml(write(make(1_000_001)))


@pytest.mark.parametrize("load", [Board.from_toml, load_prior, load_coefficients])
def test_no_more_of_a_large_file_is_read_than_a_card_may_hold(write, load):
    """Half a gigabyte of nothing costs as much memory as the largest card, a few times over at most."""
    path = write(b"")
    os.truncate(path, 500_000_000)
    tracemalloc.start()
    try:
        with refused("got a larger one"):
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
]  # fmt: skip


def test_what_is_no_card(write):
    for content, message in NO_CARDS:
        begin = time.monotonic()
        with refused(message):
            Board.from_toml(write(content))
        assert time.monotonic() - begin < 5


def test_the_guard_against_long_keys_is_quick(write):
    for content in [b'"' * 900_000, b"'\"" * 450_000, b"a" * 900_000, b"a." * 10 + b" " * 900_000]:
        begin = time.monotonic()
        with refused("my-board.toml"):
            Board.from_toml(write(content))
        assert time.monotonic() - begin < 5


def test_line_ends_and_byte_order_mark_change_nothing(write, board_text):
    plain = Board.from_text(board_text, "my-board")
    for content in (board_text.replace("\n", "\r\n"), "\ufeff" + board_text, board_text.replace("\n", "  \n") + "\n\n"):
        other = Board.from_toml(write(content))
        assert other == plain
        assert other.sha256 != plain.sha256


def test_nothing_in_a_card_is_executed(write, tmp_path, board_text):
    canary = tmp_path / "canary"
    code = f"__import__('pathlib').Path({str(canary)!r}).touch()"
    card = Board.from_toml(write(board_text.replace("A test board", f"!!python/object/apply:eval [{code}] {{{code}}}")))

    assert code in card.title
    assert not canary.exists()


def test_notes_are_free_text(write, board_text):
    text = board_text.replace("title =", 'notes = "Küche, 21 °C, Tür zu"\ntitle =')
    text = text.replace('name = "cantilever"', 'name = "cantilever"\nnotes = "früh"')
    card = Board.from_toml(write(text))

    assert card.card is not None
    assert (card.card.table["notes"], card.card.table["setup"]["notes"]) == ("Küche, 21 °C, Tür zu", "früh")


def test_strange_titles_are_kept_as_they_are(write, board_text):
    title = "<script>alert(1)</script> $\\\\frac{1}{2}$ 🪵 \u202eabc"
    card = Board.from_toml(write(board_text.replace("A test board", title)))

    assert card.title == title.replace("\\\\", "\\")
