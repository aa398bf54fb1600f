"""What the functions return: short and long representations, figures, and the draws as ArviZ works with them."""

from __future__ import annotations

import inspect

import pytest
from matplotlib.figure import Figure
from read_pages import ALLOWED, Read

import bayesplate
from bayesplate.results.contract import as_json


@pytest.fixture(scope="module")
def results(fiemme):
    """One result of every function that needs no sampling of its own, by its function."""
    return {"fit": fiemme, "check": bayesplate.check(fiemme.problem), "modes": bayesplate.modes(fiemme.problem)}


SHOWN = [
    ("fit", "<FitResult of fiemme-spruce-clamped: E_x = {mean:.2f} ± {sd:.2f} GPa, ", "Ex, along grain"),
    ("check", "<CheckResult of fiemme-spruce-clamped: 6 modes, E_x ± ", "Ex, along grain"),
    ("modes", "<ModesResult of fiemme-spruce-clamped: clamped: 12 from ", "(0,0)"),
]


def test_a_result_shows_itself(results):
    for name, short, cell in SHOWN:
        result = results[name]
        page = result._repr_html_()
        E_x = results["fit"].summary.elastic.E_x

        assert repr(result).startswith(short.format(mean=E_x.mean / 1e9, sd=E_x.sd / 1e9))
        assert len(repr(result).splitlines()) == 1
        assert page.startswith(f"<h3>{result.problem.board.title if name == 'fit' else result.summary.title}</h3>")
        assert cell in Read(page).text
        assert {name for name, _ in Read(page).elements} <= ALLOWED


def test_the_summary_of_a_check_is_the_report_and_its_problem_can_be_fitted(results):
    checked = results["check"]

    assert isinstance(checked.summary, bayesplate.CheckReport)
    assert "problem" not in as_json(checked)
    assert checked.problem is results["fit"].problem


def figures(plots):
    """Name and method of every figure that needs no argument."""
    names = (name for name in dir(plots) if not name.startswith("_") and callable(getattr(plots, name)))
    return {name: getattr(plots, name) for name in names}


@pytest.mark.parametrize("name", ["fit", "check", "modes"])
def test_every_figure_is_drawn(results, name):
    plots = results[name].plot
    found = figures(plots)

    assert len(found) >= {"fit": 11, "check": 2, "modes": 1}[name]
    for title, draw in found.items():
        figure = draw()
        assert isinstance(figure, Figure), title
        assert figure.axes, title
        assert inspect.getdoc(draw), title
        assert f".{title}()" in repr(plots)


def test_a_figure_of_what_is_not_there_is_refused(results):
    with pytest.raises(bayesplate.InputError, match="setup: wanted one of clamped, got 'free'"):
        results["fit"].plot.modes("free")
    with pytest.raises(bayesplate.InputError, match="name: wanted one of E_x, E_y, G_xy, D_x, D_y, D_s, got 'E_z'"):
        results["fit"].plot.corner(["E_x", "E_z"])
    for names in ([], ["E_x", "E_x"], "E_x"):
        with pytest.raises(bayesplate.InputError, match=r"names: wanted a list of one or more of E_x.* each once, got"):
            results["fit"].plot.corner(names)
    assert len(results["fit"].plot.corner(["E_x"]).axes) == 1
