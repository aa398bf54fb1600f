"""The figures of the report by what is drawn in them: numbers where they belong, nothing cut off, no mathematics."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from diagnoses import DIAGNOSES
from made_isotropic import steel
from made_reports import FIGURES, cut_off
from made_summaries import spread
from matplotlib.text import Text

from bayesplate.board.material import MODULI
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak
from bayesplate.commands.prepare import prepare
from bayesplate.commands.problem import Problem
from bayesplate.estimates.sheet import sheet
from bayesplate.frequencies.system import system_of
from bayesplate.report.board import board_picture
from bayesplate.report.chladni import chladni_sheet
from bayesplate.report.constants import modulus_title, percentiles_pictures
from bayesplate.report.content import inputs_table, priors_table
from bayesplate.report.corner_plot import axis_label
from bayesplate.report.diagnosis import null_picture
from bayesplate.report.modes import modes_pictures, predictive_picture
from bayesplate.report.page import fit_pictures
from bayesplate.report.posterior import SampledQuantity, health_picture, sampled_quantities
from bayesplate.report.style import NO_GLYPH, drawable_text, mathtext
from bayesplate.results.words import MISSING


@pytest.fixture(scope="module")
def drawn(clamped):
    groups = fit_pictures(clamped.draws, clamped.summary, DIAGNOSES["named"])
    return {one.name: one for found in groups.values() for one in found}


def words(figure):
    """Every text that is seen: of ticks only those within their panel."""
    found = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    for panel in figure.axes:
        found += [*panel.texts, panel.title, panel._left_title, panel.xaxis.label, panel.yaxis.label]
        for axis, (low, high) in ((panel.xaxis, sorted(panel.get_xlim())), (panel.yaxis, sorted(panel.get_ylim()))):
            if panel.axison:
                found += [tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    return [text for text in found if text.get_text().strip()]


def test_residuals_lie_where_the_summary_says(drawn, clamped):
    (panel,) = drawn["residuals"].figure.axes
    lines = {line.get_label(): line.get_xydata() for line in panel.lines}
    modes = clamped.summary.modes

    np.testing.assert_allclose(lines["error of the fit"][:, 0], [mode.residual_cents for mode in modes])
    np.testing.assert_allclose(lines["error if left out of the fit"][:, 0], [mode.left_out_cents for mode in modes])
    bars = {one.get_label(): np.array([path[:, 0] for path in one.get_segments()]) for one in panel.collections}
    np.testing.assert_allclose(bars["error of the fit, 90 %"], [mode.residual_interval_cents for mode in modes])
    rounded = [[mode.residual_cents + end for end in mode.rounding_cents] for mode in modes]
    np.testing.assert_allclose(bars["what rounding may hide"], rounded)
    assert [tick.get_text() for tick in panel.get_yticklabels()] == [mode.label for mode in modes]
    assert panel.get_ylim()[0] > panel.get_ylim()[1]  # the first on top


def test_the_board_is_to_scale(drawn):
    """600 mm by 412 mm: the panel has the board's proportions, its edges are all drawn as clamped."""
    (panel,) = drawn["board"].figure.axes
    width, height = panel.get_position().size * drawn["board"].figure.get_size_inches()

    assert width / height == pytest.approx(600 / 412, rel=1e-6)
    assert panel.get_xlim() == pytest.approx((0, 0.600))
    assert sum(patch.get_hatch() is not None for patch in panel.patches) == 4
    assert {"600 mm, along the grain", "412 mm across"} <= {text.get_text() for text in panel.texts}


TAPERED = """\
format = 1
name = "tapered"
[plate]
length_x_mm = 550
length_y_mm = { readings = [220, 210, 200, 190, 180], resolution = 1, at_x_mm = [0, 137.5, 275, 412.5, 550] }
thickness_mm = { mean = 2.8, sd = 0.03 }
mass_g = 125
[material]
poisson_xy = 0.4
[[setup]]
name = "held"
edges = { x0 = "clamped", x1 = "free", y0 = "supported", y1 = "free" }
clamped_mm = { x0 = 30 }
[setup.frequencies_hz]
"(1,1)" = 70.1
[[setup.attached]]
kind = "exciter"
mass_g = 1
at_mm = [500, 100]
[[setup]]
name = "free"
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
[setup.frequencies_hz]
"(1,1)" = 34.71
"(2,0)" = 50.65
"(0,2)" = 98.26
[setup.hammer]
at_mm = [0, 10]
"""


@pytest.fixture(scope="module")
def tapered(tmp_path_factory):
    card = tmp_path_factory.mktemp("boards") / "tapered.toml"
    card.write_text(TAPERED, encoding="utf-8")
    return prepare(card).board


def test_a_board_that_narrows_is_drawn_so(tapered):
    """220 mm at x0 (217.8 at the clamp), 180 at x1: two free edges share it; places start at the board's own corner."""
    picture = board_picture(tapered)
    held, free = picture.figure.axes
    ends = {"held": ((0, 217.8), (0, 180)), "free": ((0, 220), (20, 200))}
    for panel, name in ((held, "held"), (free, "free")):
        lines = {line.get_label()[5:7]: 1e3 * line.get_xydata() for line in panel.lines if "edge" in line.get_label()}
        for at, wanted in zip((0, -1), ends[name], strict=True):
            assert (lines["y0"][at, 1], lines["y1"][at, 1]) == pytest.approx(wanted, abs=1.0), name
        assert lines["x1"][:, 1] == pytest.approx(ends[name][1], abs=1.0)
        assert any(text.get_text() == "180.1 to 219.9 mm across" for text in panel.texts)
    (exciter,) = (line for line in held.lines if line.get_label() == "exciter")
    (hammer,) = (line for line in free.lines if line.get_label() == "hammer")
    assert 1e3 * exciter.get_xydata()[0] == pytest.approx([500, 100])
    assert 1e3 * hammer.get_xydata()[0] == pytest.approx([0, 10], abs=0.1)
    assert picture.alt.startswith("A board whose width varies, 550 mm along the grain, 180.1 to 219.9 mm across.")
    assert "both are drawn to recede alike" in picture.caption


def test_a_board_that_is_not_flat_is_drawn_so():
    """The largest rise at an eighth of the width, the other to the same scale, a sign as read, zero not at all."""
    board = prepare("spruce-free-2R").board
    rises = {"cup": Quantity.exact(1e-3), "bow": Quantity.exact(-4e-3), "twist": Quantity.exact(0.0)}
    picture = board_picture(replace(board, warp=rises))
    lines = {line.get_label(): 1e3 * line.get_xydata() for line in picture.figure.axes[0].lines}
    length, width = (1e3 * board.inputs[f"length_{axis}"].mean for axis in "xy")
    cup, bow = lines["cup 1 mm"][:, 0] - length / 2, lines["bow -4 mm"][:, 1] - width / 2
    assert bow.min() == pytest.approx(-4.0 * cup.max())
    assert bow.min() == pytest.approx(-0.12 * width, rel=0.25)  # a round number of times
    assert not any(str(label).startswith("twist") for label in lines)
    assert picture.alt.endswith("Not flat: cup 1 mm, bow -4 mm.")
    assert "lies along it and across it" in picture.caption


def test_a_plate_without_grain_is_drawn_and_told_so():
    """Board, panels of the constants, fitted modes and printed sheet; with a grain it has lines and words of it."""
    told = {}
    for isotropic in (True, False):
        board = steel(isotropic=isotropic)
        picture = board_picture(board)
        panel = picture.figure.axes[0]
        words = [picture.alt, picture.caption, modulus_title("E_x", isotropic=isotropic)]
        constants = {"D_x": np.float64(13e3), "D_y": np.float64(13e3), "D_s": np.float64(18e3)}
        values = {**board.nominal(), **constants}
        draws = SimpleNamespace(problem=Problem.from_card(board).posed, rigidities=constants, inputs={})
        (modes,) = modes_pictures(draws, SimpleNamespace(modes=()))
        words.append(modes.caption)
        estimates = SimpleNamespace(problem=draws.problem, moduli=dict.fromkeys(MODULI, np.geomspace(1e11, 3e11, 8)))
        words += [text.get_text() for one in percentiles_pictures(estimates) for text in one.figure.findobj(Text)]
        drawn = chladni_sheet(sheet(board, system_of(board, board.setups[0]), values, "as given")).texts
        words += [text.get_text() for text in (*panel.texts, *drawn)]
        told[isotropic] = sum("grain" in text for text in words), len(panel.lines)

    assert told[True][0] == 0
    assert told[False][0] >= 6
    assert told[False][1] > told[True][1], "the lines of the grain"


def test_figures_of_a_board_that_narrows_end_at_its_outline(tapered):
    """Twist of a free board, symmetric across: its line along stays in the middle, and nothing is drawn beyond.

    Places are stated from its own corner, by hand: half the width in from y0 at x1 is 20 + 90 mm on the rectangle, and
    110 of the mean 200 as stated.
    """
    system = system_of(tapered, tapered.setups[1])
    values = {**tapered.nominal(), "D_x": 21.0, "D_y": 1.4, "D_s": 5.0}
    twist = sheet(tapered, system, values, "as given")
    first = replace(twist, modes=twist.modes[:1], combined=())

    assert first.modes[0].name == "(1,1)"
    assert first.aspect_ratio == pytest.approx(550 / 219.9, rel=1e-3)
    assert first.drawn_at(1.0, 1.0)[1] - first.drawn_at(1.0, 0.0)[1] == pytest.approx(180 / 220, abs=0.005)
    np.testing.assert_allclose(first.modes[0].shape, -first.modes[0].shape[:, ::-1], atol=1e-6)
    (panel,) = chladni_sheet(first).axes
    drawn = np.concatenate([path.vertices for one in panel.collections for path in one.get_paths()])
    low, high = np.array([first.drawn_at(x, y)[1] for y in (0.0, 1.0) for x in drawn[:, 0]]).reshape(2, -1)
    assert (drawn[:, 1] > low - 0.01).all()
    assert (drawn[:, 1] < high + 0.01).all()
    shaped = system.shaped
    assert shaped.from_plate(1.0, 0.5) == pytest.approx((1.0, 110 / 200), abs=0.003)
    assert shaped.to_plate(*shaped.from_plate(0.7, 0.3)) == pytest.approx((0.7, 0.3))


def test_the_table_of_inputs_says_what_became_of_an_effect(clamped):
    """Beside what the card states of it; what is exact stays so."""
    board = prepare("finnish-spruce-cantilever", ["clamp_rotation"]).board
    (own,) = (one for one in board.parameters if one.effect == "clamp_rotation")
    found = {own.owner.title: {own.effect: {own.key: spread(0.3 * own.prior.mean, 0.1 * own.prior.mean, own.unit)}}}
    told = {row[0]: row[1:] for row in inputs_table(board, replace(clamped.summary, effects=found)).texts}
    (after,) = (cells[1] for words, cells in told.items() if "clamp rotation" in words)

    assert after != MISSING
    assert told["thickness, mm"] == ("3 (taken as exact)", MISSING)


def test_the_bars_of_the_constants_hold_ninety_per_cent(drawn, clamped):
    for panel, (name, entry) in zip(drawn["constants"].figure.axes, clamped.summary.elastic.items(), strict=True):
        bar = next(line for line in panel.lines if line.get_label() == "posterior, bar: 90 %")
        low, high = np.array(bar.get_xdata()) * 1e9
        draws = clamped.draws.moduli[name]

        assert np.mean((draws >= low) & (draws <= high)) == pytest.approx(0.9, abs=0.001)
        assert (low, high) == pytest.approx((entry.q05, entry.q95))


def test_shares_fill_each_mode(drawn):
    (panel,) = drawn["shares"].figure.axes
    ends: dict[float, float] = {}
    for bar in panel.patches:
        row = bar.get_y() + bar.get_height() / 2
        ends[row] = max(ends.get(row, 0.0), bar.get_x() + bar.get_width())

    assert len(ends) == 6
    assert list(ends.values()) == pytest.approx([100.0] * 6, abs=0.5)


def test_the_figures_of_a_diagnosis_show_its_own_numbers(drawn):
    """What the effect changes, and where the board stands among simulated ones."""
    errors, shifts = drawn["before-after"].figure.axes
    assert [bar.get_width() for bar in errors.patches] == [21.25, 46.5, 46.5, 4.25, 9.5, 12.5]
    np.testing.assert_array_equal(shifts.lines[0].get_xdata(), [2.5, -1.25, 0.0])

    odds, ratios = drawn["null-control"].figure.axes
    assert [line.get_xdata()[0] for line in odds.lines] == [4.5, 3.0]
    assert [line.get_xdata()[0] for line in ratios.lines] == [0.25, 0.75]
    assert [one.get_title("right") for one in (odds, ratios)] == ["dashed: needed beyond", "dashed: claimed below"]
    assert [text.get_text() for text in odds.get_xticklabels()] == ["1 : 100", "1 : 10", "1 : 1", "10 : 1", "100 : 1"]


@pytest.mark.parametrize(
    ("log_odds", "words"),
    [(np.log(90.0), "90 : 1"), (-np.log(4.0), "1 : 4"), (12.0, "10^5 : 1"), (12_000.0, "10^5212 : 1")],
)
def test_odds_are_told_and_drawn_as_odds(log_odds, words):
    """To who does not see the axis too; even where no number holds them no label runs into the next."""
    named = DIAGNOSES["named"]
    null = replace(named.null_control, log_odds=log_odds, log_odds_needed=np.log(2.0))
    picture = null_picture(replace(named, null_control=null))
    assert picture.alt.startswith(
        f"odds that something is lacking: this board {words}, limit 2 : 1; leave-one-out error"
    )
    picture.figure.canvas.draw()
    labels = picture.figure.axes[0].get_xticklabels()
    boxes = [one.get_window_extent() for one in labels]
    assert "1 : 1" in [one.get_text() for one in labels]
    assert 3 <= len(labels) <= 6
    assert all(right.x0 - left.x1 > 3.0 for left, right in pairwise(boxes))


def test_the_expected_readings_have_a_bar_where_all_round_to_one(clamped):
    """A model that always expects the reading itself: both bars reach as far as rounding hides, by the summary."""
    modes = clamped.summary.modes
    always = np.array([[mode.measured_hz for mode in modes]] * 4)
    (panel,) = predictive_picture(clamped.summary, always).figure.axes
    bars = {one.get_label(): np.array([path[:, 0] for path in one.get_segments()]) for one in panel.collections}

    assert all(mode.rounding_cents[0] < 0 < mode.rounding_cents[1] for mode in modes)
    for label in ("expected, 90 %", "expected, 50 %"):
        np.testing.assert_allclose(bars[label], [mode.rounding_cents for mode in modes])


def test_no_word_is_cut_off_or_too_small(drawn, clamped):
    """Nor by rigidities of 20 000 N m, as well known as those of the board: no number stands apart as an offset."""
    chains = clamped.draws.inference.chains
    draws = chains.draws.copy()
    draws[..., :3] = np.log(2e4) + draws[..., :3] - draws[..., :3].mean(axis=(0, 1, 2))
    large = health_picture(replace(clamped.draws.inference, chains=replace(chains, draws=draws)))

    assert set(drawn) == {*FIGURES, "before-after", "null-control", "signatures"}
    for picture in (*drawn.values(), large):
        texts = words(picture.figure)
        assert cut_off(picture.figure, texts, margin=1.0) == [], picture.name
        assert min(text.get_fontsize() for text in texts) >= 6.5, picture.name
        assert picture.alt, picture.name
        assert picture.caption, picture.name
    assert not any(panel.yaxis.get_offset_text().get_text() for panel in large.figure.axes)


def test_signs_that_the_font_lacks_are_shown_as_such_and_symbols_as_mathematics():
    assert drawable_text("violin \U0001f3bb") == f"violin {NO_GLYPH}"
    assert drawable_text("Ø $x$ é") == "Ø $x$ é"
    assert mathtext("E_x, nu_xy, GPa") == r"$E_{x}$, $\nu_{xy}$, GPa"


def test_what_the_readings_made_of_each_prior(clamped):
    """By hand: a normal log density of mean 1 and sd 0.5, against draws of known mean and spread."""

    def told(mean, sd):
        draws = np.exp(mean + sd * np.array([-1.0, 1.0]))
        return SampledQuantity("x", "", draws, Quantity.from_median(np.e, np.exp(0.5))).change_text

    assert told(1.0, 0.005) == "100 times narrower"
    assert told(1.0, 0.2) == "2.5 times narrower"
    assert told(1.0, 0.5) == "as before: nothing was learned"
    assert told(1.2, 0.5) == "moved, as wide as before"
    found = {one.name: one for one in sampled_quantities(clamped.draws)}
    assert np.log(found["E_x"].prior.median) == pytest.approx(np.log(3))
    mean = clamped.summary.elastic.E_x.mean / 1e9
    assert np.log(found["E_x"].draws).mean() == pytest.approx(np.log(mean), rel=1e-3)
    assert np.log(found["noise"].prior.median) == pytest.approx(np.log(0.8))


def test_a_prior_is_told_in_the_unit_of_its_constant_whatever_its_size():
    thick = {name: Quantity.from_median(8e5, 2.0) for name in ("D_x", "D_y", "D_s")}
    soft = {name: Quantity.from_median(8e3, 2.0) for name in MODULI}
    for constants, words in ((thick, "median 8e+05 N m"), (soft, "median 8e-06 GPa")):
        prior = PriorCard.from_quantities("mine", constants, source="made")
        assert all(words in row[1] for row in priors_table(prior).rows)


def test_the_corner_plot_names_a_quantity_in_two_lines():
    """Of at most 17 characters an inch, where one line is too short for it; only a symbol of ours is mathematics."""
    assert axis_label("thickness, mm", 0.75) == "thickness,\nmm"
    assert axis_label("shape 2 of thickness profile", 0.75) == "shape 2,\nthickness"
    assert axis_label("compliance of clamp rotation", 0.75) == "compliance,\nclamp rotat…"
    assert axis_label("a very long name", 0.75) == "a very long…"
    assert axis_label("E_x, GPa", 0.6) == "$E_{x}$, GPa"
    assert axis_label("Poisson ratio nu_xy", 0.6) == r"$\nu_{xy}$"
    assert axis_label("G_yz of transverse shear, GPa", 0.5) == "$G_{yz}$,\nGPa"
    assert axis_label("G_yz of transverse shear ($x$), GPa", 0.8) == "G_yz (\\$x\\$),\nGPa"  # a user's own text


def test_percentiles_are_of_the_modes_that_the_table_has():
    """A peak of the paper's board whose mode the printed table lacks takes no part: 42 subsets of six modes.

    Three modes have one subset of three, whose spread is none: no picture.
    """
    board = prepare("finnish-spruce-cantilever").board
    moduli = dict.fromkeys(("E_x", "E_y", "G_xy"), np.geomspace(5e8, 2e10, 8).reshape(2, 4))

    def drawn_of(**changed):
        problem = Problem.from_card(replace(board, setups=(replace(board.setups[0], **changed),))).posed
        drawn = percentiles_pictures(SimpleNamespace(problem=problem, moduli=moduli))
        return len(problem.board.setups[0].readings), drawn

    n_readings, (picture,) = drawn_of(peaks=(Peak(Quantity.exact(898.0)),))
    assert n_readings == 7
    assert "42" in picture.caption
    bands = [one for one in picture.figure.axes[0].patches if "percentile method" in str(one.get_label())]
    low, high = bands[0].get_extents().transformed(picture.figure.axes[0].transData.inverted()).intervalx
    assert 10.0 < low < high < 16.0  # E_x of the board in GPa, within a few sd
    kept = [one for one in board.setups[0].readings if str(one.label) in {"(1,0)", "(1,1)", "(1,2)"}]
    assert drawn_of(readings=tuple(kept)) == (3, [])
