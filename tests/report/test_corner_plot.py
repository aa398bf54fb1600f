"""The corner plot by the `corner` package: what is drawn, what is marked, and that nothing else is left behind."""

from __future__ import annotations

import re

import numpy as np
import pytest

from bayesplate.report.corner_plot import corner_figure, write_corner_plot

N_DRAWS = 4000
WORDS = ("E_x, GPa", "E_y, GPa", "G_xy, GPa")


@pytest.fixture
def columns():
    """Draws of a chain shape, each constant with its own mean."""
    rng = np.random.default_rng(1)
    return {name: rng.normal(mean, 0.1, (4, N_DRAWS // 4)) for name, mean in zip(WORDS, (11.0, 0.9, 0.7), strict=True)}


def test_every_pair_has_a_panel_with_its_draws_and_what_is_marked_its_line(columns):
    panels = np.array(corner_figure(columns, {WORDS[0]: 11.05}).axes).reshape(3, 3)

    assert tuple(panel.get_xlabel() for panel in panels[-1]) == WORDS
    assert tuple(panel.get_ylabel() for panel in panels[1:, 0]) == WORDS[1:]
    for i, name in enumerate(WORDS):
        for j, other in enumerate(WORDS[:i]):
            low, high = panels[i, j].get_xlim()
            assert low < columns[other].mean() < high
            low, high = panels[i, j].get_ylim()
            assert low < columns[name].mean() < high
    assert [line.get_xdata()[0] for line in panels[0, 0].lines] == [11.05]
    assert not panels[1, 1].lines


@pytest.mark.parametrize("n", [6, 9])
def test_a_panel_has_two_ticks_and_none_where_it_would_run_into_the_next_panel(n):
    """As wide as the page up to six columns; every column ten times narrower than the one before, in full numbers."""
    rng = np.random.default_rng(2)
    figure = corner_figure({f"D_{i}": rng.normal(10.0, 3.0 * 0.1**i, N_DRAWS) for i in range(n)})
    shown = [panel for panel in figure.axes if panel.get_frame_on()]

    assert len(shown) == n * (n + 1) / 2
    assert (figure.get_figwidth() == pytest.approx(4.5)) == (n <= 6)
    figure.draw_without_rendering()
    for panel in shown:
        assert not panel.xaxis.get_offset_text().get_text()
        assert not panel.yaxis.get_offset_text().get_text()
        at = (panel.get_xticks() - panel.get_xlim()[0]) / np.ptp(panel.get_xlim())
        assert len(at) >= 2
        assert ((at > 0.07) & (at < 0.93)).all()


def test_one_column_is_drawn_alone(columns):
    for value, lines in ((11.05, [11.05]), (None, [])):
        (panel,) = corner_figure({WORDS[0]: columns[WORDS[0]]}, {WORDS[0]: value}).axes

        assert panel.get_xlabel() == WORDS[0]
        assert [line.get_xdata()[0] for line in panel.lines] == lines, value


def test_the_same_draws_give_the_same_file_and_no_state_of_pyplot(columns, tmp_path):
    from matplotlib import pyplot

    before = pyplot.get_fignums()
    for name, marked in (("one.svg", None), ("other.svg", None), ("marked.svg", {WORDS[0]: 11.05})):
        write_corner_plot(tmp_path / name, columns, marked)

    one, other, marked = ((tmp_path / name).read_bytes() for name in ("one.svg", "other.svg", "marked.svg"))
    assert one == other != marked
    assert re.match(rb"<\?xml", one)
    assert pyplot.get_fignums() == before
