"""Any table in any medium: one escape for every text, full precision for programs, LaTeX that needs no package."""

from __future__ import annotations

import csv
import io
import re

import pytest
from payloads import DIRECTION_MARKS, EVERY, PAYLOADS, shown
from read_pages import Read, faults

from bayesplate.results.tables import Table, escape, notebook, render, visible
from bayesplate.results.words import Value, percent

FORMULAS = ("=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "  =1")
STEERS = ("\x1b[2J\x1b]0;owned\x07", "a\rb", "\x9b31m")


def table_of(text):
    """One that holds a text wherever a text may stand."""
    return Table(text, (text, "value"), ((text, Value(1.25, 0.5)), (text, None)))


@pytest.mark.parametrize("payload", [EVERY, *FORMULAS, *STEERS], ids=repr)
def test_a_text_stays_a_text_in_every_medium(payload):
    """It is seen as it stands, and nothing else happens."""
    seen = " ".join(visible(payload).split())
    page = Read("<title></title>" + notebook(payload, [payload], [table_of(payload)]))
    on_terminal = escape(payload, "terminal")
    _, (cell, *_), _ = csv.reader(io.StringIO(render(table_of(payload), "csv")), strict=True)
    latex = render(table_of(payload), "latex")
    comment, begin, *body, last = latex.splitlines()

    assert faults(page) == []
    assert " ".join(page.text.split()).count(seen) == 6
    assert not [c for c in on_terminal if not c.isprintable() and c not in "\n\u200c\u200d"]
    assert " ".join(on_terminal.split()) == " ".join(visible(payload.replace("\r", " ")).split()) or "\r" in payload
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
    assert visible("a\nb\tc") == "a b c"
    assert visible("\U0001f469\u200d\U0001f527") == "\U0001f469\u200d\U0001f527"
    assert visible("\u202ex\u202c\x07\x1b[0m\ufeff") == "x[0m"


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
    assert [visible(one) for one in PAYLOADS] == [shown(one) for one in PAYLOADS]
