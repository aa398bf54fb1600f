"""Figures of picked modes: every name stands in the figure whole, and a mode without one is a question mark."""

from __future__ import annotations

import numpy as np
from made_reports import cut_off

from bayesplate.recordings.contract import LabelChance, PickedRow, PickReport
from bayesplate.report.recordings import AveragedResponse, spectra_picture
from bayesplate.results.modes import UNNAMED_MODE


def row(hertz: float, label: str) -> PickedRow:
    sizes = 0.01, 0.01, 0.0, 0.0, 0.7, 0.01
    return PickedRow(hertz, *sizes, "+", 1.0, 0.0, "", 1.0, 1.0, (LabelChance(label, 0.9),), 0.1)


def test_names_of_modes_are_whole_within_the_figure():
    peaks = row(55.1, "(1,1)"), row(210.9, UNNAMED_MODE), row(985.1, "(10,10)")
    report = PickReport(1, ("a.csv",), 1, 1, 2.0, 20.0, 1000.0, peaks, "", "board", "", ())
    hertz = np.linspace(20.0, 1000.0, 99)
    figure = spectra_picture(report, [AveragedResponse("a.csv", hertz, np.ones(99), None)]).figure
    names = [text for panel in figure.axes for text in panel.texts]

    assert [text.get_text() for text in names] == ["55.1 (1,1)", "210.9 ?", "985.1 (10,10)"]
    assert cut_off(figure, names) == []
