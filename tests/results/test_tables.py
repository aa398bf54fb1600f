"""Any table in any medium: one escape for every text, full precision for programs, nothing cut on a terminal."""

from __future__ import annotations

import csv
import io
import re
from itertools import product

import pytest
from diagnoses import DIAGNOSES
from made_summaries import SUMMARY
from payloads import DIRECTION_MARKS, EVERY, PAYLOADS, shown
from read_pages import Read, faults

from bayesplate.commands.printout import show_diagnosis, show_fit
from bayesplate.diagnosis.tables import candidates_table
from bayesplate.results.layout import column_widths
from bayesplate.results.tables import Table, escape, notebook_html, render, strip_control_characters
from bayesplate.results.words import Value, hertz_range, percent

FORMULAS = ("=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "  =1")
STEERS = ("\x1b[2J\x1b]0;owned\x07", "a\rb", "\x9b31m")


def table_of(text):
    """One that holds a text wherever a text may stand."""
    return Table(text, (text, "value"), ((text, Value(1.25, 0.5)), (text, None)))


@pytest.mark.parametrize("payload", [EVERY, *FORMULAS, *STEERS], ids=repr)
def test_a_text_stays_a_text_in_every_medium(payload):
    """It is seen as it stands, and nothing else happens."""
    seen = " ".join(strip_control_characters(payload).split())
    page = Read("<title></title>" + notebook_html(payload, [payload], [table_of(payload)]))
    on_terminal = escape(payload, "terminal")
    _, (cell, *_), _ = csv.reader(io.StringIO(render(table_of(payload), "csv")), strict=True)
    latex = render(table_of(payload), "latex")
    comment, begin, *body, last = latex.splitlines()

    assert faults(page) == []
    assert " ".join(page.text.split()).count(seen) == 6
    assert not [c for c in on_terminal if not c.isprintable() and c not in "\n\u200c\u200d"]
    assert (
        " ".join(on_terminal.split()) == " ".join(strip_control_characters(payload.replace("\r", " ")).split())
        or "\r" in payload
    )
    assert not cell.startswith(("=", "+", "-", "@", "\t", "\r", " "))
    assert cell.removeprefix("" if payload.startswith("'") else "'") == seen
    assert comment.startswith("% ")
    assert (begin, last) == (r"\begin{tabular}{lr}", r"\end{tabular}")
    assert [line.count(" & ") for line in body if line.endswith(r"\\")] == [1, 1, 1]
    assert seen not in latex or not set('\\{}$&#^_~%<>|"') & set(seen)
    assert not set(DIRECTION_MARKS) & set("".join((page.source, on_terminal, cell, latex)))


def test_a_text_that_is_not_escaped_would_be_noticed():
    """The negative control: the same table with its escapes undone."""
    html = render(table_of(PAYLOADS[4]), "html")
    broken = html.replace("&lt;", "<").replace("&gt;", ">").replace("&#34;", '"').replace("&#39;", "'")

    assert "img onerror" in faults(Read(broken))


def test_symbols_are_set_with_lowered_indices():
    assert escape("E_x and G_xy of <b>", "html") == "<i>E</i><sub>x</sub> and <i>G</i><sub>xy</sub> of &lt;b&gt;"
    assert escape("nu_xy = 0.4 ± 0.1, 3 %, kg/m^3", "html") == (
        "<i>ν</i><sub>xy</sub> = 0.4\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}0.1, 3\N{NO-BREAK SPACE}%, kg/m³"
    )
    assert escape("a_board E_xtra shear_xz", "html") == "a_board E_xtra shear_xz"
    assert escape("E_x, nu_xy: -0.5 to +1.5 ± 2 %", "latex") == r"$E_{x}$, $\nu_{xy}$: $-0.5$ to $+1.5$ $\pm$ 2\,\%"


def test_visible_keeps_joined_emoji_and_turns_breaks_into_spaces():
    assert strip_control_characters("a\nb\tc") == "a b c"
    assert strip_control_characters("\U0001f469\u200d\U0001f527") == "\U0001f469\u200d\U0001f527"
    assert strip_control_characters("\u202ex\u202c\x07\x1b[0m\ufeff") == "x[0m"


def test_latex_prints_what_stands_there():
    """By hand: every character that means something to LaTeX."""
    assert escape("50 % & #1 $x_1^2$ {a} ~b\\c", "latex") == (
        r"50\,\% \& \#1 \$x\_1\textasciicircum{}2\$ \{a\} \textasciitilde{}b\textbackslash{}c"
    )
    assert escape("one\ntwo", "latex") == "one two"


def test_programs_read_numbers_at_full_precision():
    """A number with its uncertainty has two columns, an interval too; where there is nothing the cell is empty."""
    third = 1.0 / 3.0
    table = Table(
        "made",
        ("constant", "mean ± sd", "90 % interval", "n", "share"),
        (
            ("E_x", Value(third, 0.25), Value(ends=(0.1, third)), 3, percent(0.125)),
            ("D_x", None, None, None, 2.5),
        ),
        keys=("constant", "mean", "interval", "n", "share"),
    )

    assert render(table, "csv") == (
        "constant,mean,mean_sd,interval_q05,interval_q95,n,share\n"
        f"E_x,{third!r},0.25,0.1,{third!r},3,0.125\n"
        "D_x,,,,,,2.5\n"
    )
    assert table.texts == (("E_x", "0.33 ± 0.25", "0 to 0", "3", "12 %"), ("D_x", "–", "–", "–", "2.5"))


def test_latex_needs_no_package():
    table = Table("Made, 50 %", ("constant", "mean ± sd"), (("E_x", Value(13.32, 0.4)), ("E_y", None)))

    assert render(table, "latex").splitlines() == [
        r"% Made, 50\,\%",
        r"\begin{tabular}{lr}",
        r"\hline",
        r"constant & mean $\pm$ sd \\",
        r"\hline",
        r"$E_{x}$ & 13.32 $\pm$ 0.40 \\",
        r"$E_{y}$ & -- \\",
        r"\hline",
        r"\end{tabular}",
    ]


def test_a_sentence_and_a_table_on_a_terminal():
    assert render("one two three", "terminal", width=8) == "one two \nthree\n"
    assert "\x1b[1m" in render(table_of("a"), "terminal", styled=True)
    assert "\x1b" not in render(table_of("a"), "terminal")
    assert re.search(r"│ a +│ 1.25 ± 0.50 │", render(table_of("a"), "terminal"))


def test_shown_is_what_is_left_of_a_payload():
    """The two ways to say so agree where nothing but direction marks steers."""
    assert [strip_control_characters(one) for one in PAYLOADS] == [shown(one) for one in PAYLOADS]


TABLES = (
    *show_fit(SUMMARY).tables,
    *show_diagnosis(DIAGNOSES["named"]).tables,
    candidates_table(DIAGNOSES["named"]),
)


def printed(table: Table, width: int) -> list[str]:
    """The lines of a table on a terminal."""
    return [line.rstrip() for line in render(table, "terminal", width=width).splitlines()]


def test_no_number_is_cut_on_a_narrow_terminal():
    for table, width in product(TABLES, (40, 80)):
        lines = printed(table, width)
        words = set(re.findall(r"[^\s│┃]+", "\n".join(lines)))

        assert max(map(len, lines)) <= width
        assert "…" not in "".join(lines)
        for row in table.texts:
            for cell in row:
                assert {word for word in cell.split() if len(word) < width - 4} <= words, cell


def test_a_table_that_fits_is_a_grid_and_one_that_does_not_is_stacked():
    table = Table("Made", ("mode", "90 % interval", "a reason in words"), (("(1,0)", "-35.3 to +45.7", "not needed"),))

    assert column_widths(table.columns, table.texts, 80) == [5, 14, 17]
    assert column_widths(table.columns, table.texts, 40) == [5, 14, 11]  # by hand: 40 less 10 of rules leaves 30
    assert column_widths(table.columns, table.texts, 30) is None
    assert printed(table, 30) == [
        "Made",
        "mode (1,0)",
        "  90 % interval: -35.3 to",
        "  +45.7",
        "  a reason in words: not",
        "  needed",
    ]


def test_numbers_end_at_the_right_and_sentences_begin_at_the_left():
    rows = (("a", "1.5", "a sentence of more characters than any number has"), ("b", "12", "short"))
    assert "│ b     │    12 │ short " in "\n".join(printed(Table("t", ("board", "value", "doubt"), rows), 80))


@pytest.mark.parametrize(
    ("ends", "text"),
    [
        ((23.9, 151.6), "23.9 to 152"),
        ((110.2, 112.4), "110 to 112"),
        ((163.62, 164.18), "163.6 to 164.2"),
        ((64.957, 65.043), "64.96 to 65.04"),
        ((65.0, 65.0), "65.0 to 65.0"),
    ],
)
def test_an_interval_of_frequencies_has_the_digits_that_tell_its_ends_apart(ends, text):
    assert hertz_range(*ends) == text
