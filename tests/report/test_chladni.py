"""The sheet of Chladni figures: its panels, its words, its nodal lines, and that nothing overlaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesplate.estimates.sheet import CombinedMode, Sheet, SheetMode, grid_points
from bayesplate.report.chladni import A4, chladni_sheet, sheet_layout

EDGES = {"x0": "clamped", "x1": "free", "y0": "supported", "y1": "free"}


def shape(m, n):
    """A plate's mode by hand: m and n nodal lines across."""
    return np.outer(np.cos(m * np.pi * grid_points()), np.cos(n * np.pi * grid_points()))


def made(aspect_ratio=2.0, title="A board", *, n_modes=12, measured=50.0):
    labels = [(m, n) for m in range(4) for n in range(5)][:n_modes]
    modes = tuple(
        SheetMode(
            f"({m},{n})", 50.0 + 30 * i, measured if i == 0 else None, (40.0, 1560.0) if i == 1 else None,
            np.array([0.5, 0.3, 0.2, 0.0]), np.ones(3), shape(m, n),
        )
        for i, (m, n) in enumerate(labels)
    )  # fmt: skip
    combined = tuple(
        CombinedMode(name, modulus, {"(1,0)": 1.0}, shape(1, 1))
        for name, modulus in zip(("alpha", "beta", "gamma"), ("E_x", "E_y", "G_xy"), strict=True)
    )
    return Sheet(title, "bench", EDGES, "(1,0)", aspect_ratio, "thin", "at the estimate", modes, combined)


def words(figure):
    captions = [note.get_text() for panel in figure.axes for note in panel.texts]
    return captions, [text.get_text() for text in figure.texts]


def test_a_panel_a_mode_and_its_words():
    figure = chladni_sheet(made())
    captions, texts = words(figure)

    assert len(figure.axes) == 12 + 3
    assert tuple(figure.get_size_inches()) == pytest.approx(A4)
    assert captions[:6] == ["(0,0)   50.0 Hz", "measured 50 Hz", "(0,1)   80.0 Hz", "likely 40.0 to 1560 Hz",
                            "(0,2)   110 Hz", "not measured"]  # fmt: skip
    assert captions[-6::2] == ["alpha", "beta", "gamma"]
    assert texts[0] == "Chladni figures: A board"
    assert "Hz at the estimate" in texts[1]
    assert any("Edges: hatched = clamped, thin = free, dashed = supported." in text for text in texts)
    assert any("begin at (1,0)" in text for text in texts)
    assert any("Mixtures of the lowest named modes" in text for text in texts)  # which mix (1,0), not measured


def test_mixtures_of_measured_modes_are_said_to_be_that_and_dollar_signs_of_a_title_stay():
    """They would be mathematics to matplotlib, and an unclosed brace an error."""
    sheet = made(title=r"Half $\frac{1$ top")
    combined = tuple(replace(one, weights={"(0,0)": 1.0}) for one in sheet.combined)
    figure = chladni_sheet(replace(sheet, combined=combined))
    figure.draw_without_rendering()

    _, texts = words(figure)
    assert texts[0].endswith(r"Half $\frac{1$ top")
    assert any("Mixtures of the measured modes" in text for text in texts)


def test_nodal_lines_lie_where_the_shape_is_zero_and_edges_are_drawn_as_they_are_held():
    """(1,2): one line half way along, two at a quarter and three quarters across."""
    panels = chladni_sheet(made()).axes
    panel = panels[7]  # labels count 0 to 4 across first: (1,2)
    (nodal,) = (c for c in panel.collections if np.allclose(c.get_linewidth(), 1.8))
    x, y = np.concatenate([path.vertices for path in nodal.get_paths()]).T

    on_a_line = (np.abs(x - 0.5) < 0.01) | (np.abs(np.abs(y - 0.5) - 0.25) < 0.01)
    assert on_a_line.all()
    assert {0.25, 0.5, 0.75} <= set(np.round(np.concatenate([x, y]), 2))

    styles = {line.get_label(): line.get_linestyle() for line in panels[0].lines}
    assert styles == {"edge x0 clamped": "-", "edge x1 free": "-", "edge y0 supported": "--", "edge y1 free": "-"}
    (held,) = panels[0].patches
    assert held.get_hatch() == "//////"
    assert held.get_x() < 0


@pytest.mark.parametrize("aspect_ratio", [0.2, 6.0])
def test_nothing_overlaps_or_leaves_the_page(aspect_ratio):
    figure = chladni_sheet(made(aspect_ratio, "A long title of a board that somebody wrote " * 3, n_modes=20))
    figure.draw_without_rendering()
    width, height = figure.bbox.size
    boxes = [panel.get_position().transformed(figure.transFigure) for panel in figure.axes]
    boxes += [note.get_window_extent() for panel in figure.axes for note in panel.texts]
    boxes += [text.get_window_extent() for text in figure.texts]

    for box in boxes:
        assert 0 <= box.x0 < box.x1 <= width
        assert 0 <= box.y0 < box.y1 <= height
    for i, one in enumerate(boxes):
        for other in boxes[i + 1 :]:
            overlap_x = min(one.x1, other.x1) - max(one.x0, other.x0)
            overlap_y = min(one.y1, other.y1) - max(one.y0, other.y0)
            assert overlap_x < 0.5 or overlap_y < 0.5


def test_few_figures_fill_the_sheet_and_panels_keep_the_boards_proportions():
    """Two columns where no mixtures, three in a row, set the width: a sheet for the bench is read from afar."""
    few = sheet_layout(6, 2.2, has_combined=False)
    assert (few.n_columns, few.n_rows) == (2, 3)
    assert few.panel[0] == pytest.approx((8.27 - 2 * 0.55) / 2 - 0.30)  # half of A4 between its margins, less a gap
    assert sheet_layout(6, 2.2, has_combined=True).n_columns == 3
    for aspect_ratio in (0.4, 1.0, 2.2):
        plan = sheet_layout(12, aspect_ratio, has_combined=True)
        assert plan.panel[0] / plan.panel[1] == pytest.approx(aspect_ratio)
        assert plan.n_columns * plan.n_rows >= 12
