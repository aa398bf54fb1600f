"""`new`: what is asked or given becomes a card that is read; nothing is overwritten."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from stated import frequencies, millimetres

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.prior import load_prior
from bayesplate.board.setup_keys import edge_letters
from bayesplate.cli import main
from bayesplate.commands.new import new
from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError
from bayesplate.frequencies.labels import label_faults
from bayesplate.labels import Label

ANSWERS = ["", "550", "2,0", "200", "2.8", "125", "", "spruce", "35", "50", "111", "86", "", "", "", "", "Küche, 21 °C"]


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def invoke(*arguments: str, answers: str = ""):
    return CliRunner().invoke(main, ["new", *arguments], input=answers)


def test_answers_become_a_card_without_a_fault():
    result = invoke(answers="\n".join(ANSWERS) + "\n")
    card = Board.from_toml("my-board.toml")

    assert result.exit_code == 0, result.output
    assert "a number with a decimal point" in result.stderr
    assert millimetres(card, "length_x", "length_y") == (550, 200)
    assert card.inputs["mass"].mean == 0.125
    assert (card.inputs["thickness"].mean, card.inputs["thickness"].sd) == pytest.approx((2.8e-3, 5e-5))
    assert card.prior == "spruce"
    assert card.card.table["notes"] == "Küche, 21 °C"
    readings = {str(label): hz.mean for label, hz in frequencies(card.setups[0]).items()}
    assert readings == {"(1,1)": 35, "(2,0)": 50, "(0,2)": 111, "(2,1)": 86}
    assert prepare("my-board.toml").board.name == "my-board"


def test_the_line_for_peaks_without_a_label_can_be_used():
    text = new("a", frequencies={"(1,1)": 35}).read_text(encoding="utf-8")

    assert Board.from_text(text, "a").setups[0].unlabelled == ()
    used = text.replace("# unlabelled_hz", "unlabelled_hz")
    assert Board.from_text(used, "a").setups[0].unlabelled == (404, 448.8)


def test_every_question_can_be_skipped_and_modes_works_on_the_card():
    result = invoke("first.toml", answers="\n" * 20)

    assert result.exit_code == 0, result.output
    assert "# an example: put yours here" in Path("first.toml").read_text(encoding="utf-8")
    assert bayesplate.modes("first.toml").summary.basis == "at the median of the prior"


def test_the_examples_are_modes_that_the_board_has():
    for edges, lowest in {"free": '"(1,1)" "(2,0)" "(0,2)"', "cantilever": "", "CFSF": ""}.items():
        text = new(f"a-{edges}", edges=edges).read_text(encoding="utf-8")
        labels = [line[2:9] for line in text.splitlines() if line.startswith('# "(')]
        named = "\n".join(f"{label} = {100 + 7 * i}" for i, label in enumerate(labels))

        assert len(labels) == 8
        assert label_faults(Board.from_text(f"{text}{named}\n", f"a-{edges}")) == []
        assert " ".join(labels).startswith(lowest)


def test_a_name_and_edges_that_cannot_be_are_asked_again_at_once():
    Path("there.toml").write_text("mine", encoding="utf-8")
    answers = ["Böden", "there", "mine", "nan", "", "", "", "", "round", "cantilever", "sprouce", "spruce", *[""] * 12]
    result = invoke(answers="\n".join(answers))

    assert result.exit_code == 0, result.output
    for said in ("name: wanted A-Z, a-z, 0-9", "there.toml: wanted a new file", 'edges: wanted "free"',
                 "a number with a decimal point", '"sprouce": wanted the name of a prior card'):  # fmt: skip
        assert said in result.stderr
    assert 'x0 = "clamped"' in Path("mine.toml").read_text(encoding="utf-8")


def test_the_end_of_the_answers_is_an_interruption():
    result = invoke("first", answers="550\n")

    assert result.exit_code == 130
    assert result.stderr.endswith("interrupted\n")
    assert list(Path().iterdir()) == []


def test_options_ask_nothing():
    options = ["--length-x", "253", "--edges", "cantilever", "--title", 'a "b" \\ ü', "--frequency", "( 1, 0 ) = 52"]
    result = invoke("mine", *options)
    card = Board.from_toml("mine.toml")

    assert result.exit_code == 0, result.output
    assert card.title == 'a "b" \\ ü'
    assert "Next: bayesplate check mine.toml" in result.output
    assert "Next: bayesplate modes bare.toml" in invoke("bare", "--length-x", "253").output
    assert edge_letters(card.setups[0].edges) == "CFFF"
    assert frequencies(card.setups[0])[Label(1, 0)].mean == 52


def test_a_prior_is_looked_for_where_the_card_will_look_and_digits_are_kept():
    Path("own.toml").write_text(load_prior("spruce").to_toml().replace('"spruce"', '"own"'), encoding="utf-8")
    with pytest.raises(InputError, match=r"b\.toml \[material\] prior -> sub/own\.toml: wanted"):
        new("sub/b", prior="own.toml")
    new("sub/b", prior="../own.toml", sizes={"mass": 1234.567}, frequencies={"(1,1)": 1234.567})
    board = Board.from_toml("sub/b.toml")

    assert board.inputs["mass"].mean == pytest.approx(1.234567, rel=1e-12)
    assert board.setups[0].readings[0].frequency.mean == 1234.567


def test_a_folder_is_no_name_of_a_card():
    told = CliRunner().invoke(main, ["new", "./", "--length-x", "400"])
    assert (told.exit_code, told.stderr) == (3, 'name: wanted a file name, got "./" (choose another name)\n')


def test_a_frequency_that_is_given_twice_is_refused(tmp_path):
    path = tmp_path / "twice.toml"
    told = CliRunner().invoke(main, ["new", str(path), "--frequency", "(1,1)=35", "--frequency", "(1,1)=36"])
    assert told.exit_code == 2
    assert "(1,1) is given twice" in told.stderr
    assert not path.exists()
