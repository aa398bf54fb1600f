"""`new`: what is asked or given becomes a card that is read; nothing is overwritten."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from stated import frequencies, millimetres

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.setup_keys import edge_letters
from bayesplate.cli import main
from bayesplate.commands.new import new
from bayesplate.commands.prepare import prepare
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
    path = new("a", frequencies={"(1,1)": 35})
    line, *_ = (line for line in path.read_text(encoding="utf-8").splitlines() if "unlabelled_hz" in line)
    text = path.read_text(encoding="utf-8").replace(line, line.removeprefix("# "))

    assert Board.from_text(path.read_text(encoding="utf-8"), "a").setups[0].unlabelled == ()
    assert Board.from_text(text, "a").setups[0].unlabelled == (404, 448.8)


def test_every_question_can_be_skipped_and_modes_works_on_the_card():
    from bayesplate.commands.modes import modes

    result = invoke("first.toml", answers="\n" * 20)

    assert result.exit_code == 0, result.output
    assert "# an example: put yours here" in Path("first.toml").read_text(encoding="utf-8")
    assert modes("first.toml").summary.basis == "at the median of the prior"


@pytest.mark.parametrize("edges", ["free", "cantilever", "CFSF"])
def test_the_examples_are_modes_that_the_board_has(edges):
    text = new("a", edges=edges).read_text(encoding="utf-8")
    labels = [line[2:9] for line in text.splitlines() if line.startswith('# "(')]
    named = "\n".join(f"{label} = {100 + 7 * i}" for i, label in enumerate(labels))
    Path("b.toml").write_text(text.replace('name = "a"', 'name = "b"') + named + "\n", encoding="utf-8")

    assert len(labels) == 8
    assert label_faults(Board.from_toml("b.toml")) == []
    if edges == "free":
        assert labels[:3] == ['"(1,1)"', '"(2,0)"', '"(0,2)"']


def test_a_name_and_edges_that_cannot_be_are_asked_again_at_once():
    Path("there.toml").write_text("mine", encoding="utf-8")
    answers = ["Böden", "there", "mine", "", "", "", "", "round", "cantilever", *[""] * 12]
    result = invoke(answers="\n".join(answers))

    assert result.exit_code == 0, result.output
    for said in ("name: wanted A-Z, a-z, 0-9", "there.toml: wanted a new file", 'edges: wanted "free"'):
        assert said in result.stderr
    assert 'x0 = "clamped"' in Path("mine.toml").read_text(encoding="utf-8")
    assert invoke("Böden").exit_code == 3  # with nothing to answer


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


REFUSED = [
    (["--thickness", "2,8", "--length-x=-3", "--edges", "round"], 3,
     ['thickness: wanted a number, got "2,8" (a decimal point and no quotes: 2.8)',
      "[plate] length_x_mm: wanted a positive number, got -3", 'edges: wanted "free", "cantilever"']),
    (["--frequency", "(0,0)=35"], 3, ["a motion without bending, at 0 Hz"]),
    (["--frequency", "10=35"], 3, ["wanted two whole numbers"]),
    (["--prior", "spruse"], 3, ["did you mean spruce?"]),
    (["--frequency", "35"], 2, ["write a label and its frequency"]),
]  # fmt: skip


def test_what_cannot_stand_on_a_card_is_refused_and_nothing_written():
    for options, code, said in REFUSED:
        result = invoke("mine", *options)

        assert result.exit_code == code
        assert [passage for passage in said if passage not in result.stderr] == []
        assert list(Path().iterdir()) == []


UNLIKE = [
    ({"sizes": {"length_x_mm": 300, "length": 1}},
     ["sizes length_x_mm: wanted one of length_x, length_y, thickness, mass, got", "did you mean length_x?",
      "sizes length: wanted one of"]),
    ({"sizes": {"mass": None, "thickness": [1]}}, ["mass: wanted a number, got nothing", "thickness: wanted a n"]),
    ({"sizes": [1], "edges": None}, ["edges: wanted a text, got None", "sizes: wanted a dict of numbers, got [1]"]),
]  # fmt: skip


def test_what_is_given_in_python_is_held_to_its_kind():
    for given, said in UNLIKE:
        with pytest.raises(bayesplate.InputError) as refused:
            new("mine", **given)
        assert [passage for passage in said if passage not in str(refused.value)] == []
        assert list(Path().iterdir()) == []


def test_a_card_that_is_there_is_not_overwritten():
    for arguments in [["mine"], ["mine.toml", "--mass", "40"]]:
        Path("mine.toml").write_text("mine", encoding="utf-8")
        result = invoke(*arguments, answers="\n" * 20)

        assert result.exit_code == 3
        assert "mine.toml: wanted a new file, got one that exists" in result.stderr
        assert Path("mine.toml").read_text(encoding="utf-8") == "mine"
