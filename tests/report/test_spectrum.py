"""The figure of a spectrum by what is drawn in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_reports import cut_off
from made_summaries import SUMMARY

from bayesplate.report.modes import spectrum_pictures
from bayesplate.report.style import BLUE, ORANGE
from bayesplate.results.modes import AssignedPeak, Assignment, PredictedMode, Prediction, Spectrum

HERTZ = {"(1,1)": 101.0, "(2,0)": 102.0, "(0,2)": 258.0}


def peak(hertz, *assignments, spurious=0.0):
    found = tuple(Assignment(label, share, HERTZ[label]) for label, share in assignments)
    return AssignedPeak("bench", hertz, None, found, spurious, Prediction(hertz, 0.99 * hertz, 1.01 * hertz), 0.0)


def mode(label, hertz, seen):
    return PredictedMode("bench", label, Prediction(hertz, 0.99 * hertz, 1.01 * hertz), seen)


PEAKS = (peak(100.0, ("(1,1)", 0.9), ("(2,0)", 0.1)), peak(180.0, spurious=0.8), peak(260.0, ("(0,2)", 1.0)))
MODES = (
    mode("(1,1)", 101.0, 0.9),
    mode("(2,0)", 102.0, 0.1),
    mode("(0,2)", 258.0, 1.0),
    mode("cannot tell", 900.0, 0.0),
)


def drawn(modes=MODES, peaks=PEAKS):
    """The picture of peaks and modes."""
    (picture,) = spectrum_pictures(replace(SUMMARY, peaks=peaks, spectra=(Spectrum("bench", 0.2, 0.02, modes),)))
    return picture


@pytest.fixture(scope="module")
def picture():
    return drawn()


def test_a_line_ends_at_its_own_mode_where_several_have_no_clear_label():
    unclear = [mode("cannot tell", 899.0, 0.5), mode("cannot tell", 930.0, 0.5)]
    found = tuple(Assignment("cannot tell", share, hz) for share, hz in ((0.7, 899.0), (0.3, 930.0)))
    read = AssignedPeak("bench", 905.0, None, found, 0.0, Prediction(899.0, 895.0, 903.0), 11.0)
    (panel,) = drawn(unclear, (read,)).figure.axes
    lines = [line for line in panel.lines if list(line.get_ydata()) == [1.0, 0.0]]
    assert [line.get_xdata()[1] for line in lines] == [899.0, 930.0]


def test_lines_join_peaks_to_the_modes_that_they_may_be_and_what_is_none_looks_otherwise(picture):
    (panel,) = picture.figure.axes
    joined = {(line.get_xdata()[0], line.get_xdata()[1]): line for line in panel.lines if len(line.get_xdata()) == 2}
    ends = [pair for pair, line in joined.items() if list(line.get_ydata()) == [1.0, 0.0]]
    assert ends == [(100.0, 101.0), (100.0, 102.0), (260.0, 258.0)]
    assert joined[100.0, 101.0].get_linewidth() > joined[100.0, 102.0].get_linewidth()

    dots = {float(line.get_xdata()[0]): line for line in panel.lines if line.get_marker() in ("v", "o")}
    assert dots[180.0].get_color() == ORANGE
    assert dots[100.0].get_color() == dots[260.0].get_color() == "black"
    assert dots[101.0].get_markerfacecolor() == dots[258.0].get_markerfacecolor() == BLUE
    assert dots[102.0].get_markerfacecolor() == "white"
    assert 900.0 not in dots
    assert picture.alt == "3 peaks, 2 of them likely a mode of the plate. Modes without a likely peak: (2,0)."


def test_a_question_mark_is_explained_where_there_is_one(picture):
    other = drawn((*MODES, mode("cannot tell", 259.0, 0.2)))

    assert "?" in [text.get_text() for text in other.figure.axes[0].texts]
    assert other.caption.endswith("A question mark: a mode whose figure fits no label.")
    assert "question mark" not in picture.caption


def test_names_that_crowd_at_the_upper_end_stay_within_the_figure():
    crowd = tuple(mode(f"({k},4)", 258.0 + k, 1.0 / (k + 1)) for k in range(14))
    figure = drawn((MODES[0], *crowd)).figure
    texts = figure.axes[0].texts

    assert len(texts) == 3 + 15
    assert cut_off(figure, texts) == []
    boxes = [text.get_window_extent() for text in texts]
    assert not any(box.overlaps(other) for i, box in enumerate(boxes) for other in boxes[:i])


def test_peaks_below_all_modes_that_they_may_be_are_drawn_alone():
    """As where every mode so low has a label that is sure, and peaks of something else were read."""
    peaks = tuple(replace(one, assignments=(), spurious_probability=1.0) for one in PEAKS)
    picture = drawn(MODES[-1:], peaks)
    (panel,) = picture.figure.axes

    assert [text.get_text() for text in panel.texts] == ["100", "180", "260"]
    assert picture.alt.endswith("Every mode of the plate up to there has a label that is sure.")


def test_one_picture_per_setup_with_peaks():
    assert [one.name for one in spectrum_pictures(SUMMARY)] == ["spectrum"]
    assert spectrum_pictures(replace(SUMMARY, peaks=(), spectra=())) == []
    two = tuple(Spectrum(name, 0.2, 0.02, MODES) for name in ("bench", "other"))
    peaks = (*PEAKS, *(replace(one, setup="other") for one in PEAKS))
    found = spectrum_pictures(replace(SUMMARY, peaks=peaks, spectra=two))
    assert [one.name for one in found] == ["spectrum_bench", "spectrum_other"]
    assert "other" in found[1].title
    assert np.isfinite(found[1].figure.get_size_inches()).all()
