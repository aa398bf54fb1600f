"""Figures in files are the same whatever style the user has set, and in threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from matplotlib import rc_context
from runs import files_in

import bayesplate
from bayesplate.report.board import board_picture
from bayesplate.report.constants import constants_picture

STYLE = {"axes.facecolor": "black", "font.family": "serif", "savefig.bbox": "tight", "text.usetex": True}


def two_pictures(draws, summary, diagnosis):
    """Two of the report, as quick to draw as any."""
    places = dict.fromkeys(("diagnosis_first", "diagnosis_more", "modes", "errors", "folded"), ())
    constants, board = constants_picture(summary, draws.moduli), board_picture(draws.problem.board)
    return places | {"constants": [constants], "board": [board]}


def test_a_style_of_the_user_and_another_thread_change_no_file(clamped, clamped_folder, tmp_path, monkeypatch):
    monkeypatch.setattr("bayesplate.report.page.fit_pictures", two_pictures)
    with rc_context(STYLE), ThreadPoolExecutor(2) as threads:
        for done in [threads.submit(clamped.write, tmp_path / name) for name in ("one", "two")]:
            done.result()
    one, plain = files_in(tmp_path / "one"), files_in(clamped_folder)

    assert one == files_in(tmp_path / "two")
    assert len(one) == len(plain) - 2 * 8
    assert {name for name, content in one.items() if content != plain[name]} == {"report.html"}  # of fewer figures


def test_nor_do_they_change_the_sheet_of_modes(tmp_path):
    bayesplate.modes("fiemme-spruce-clamped", out=tmp_path / "plain")
    with rc_context(STYLE):
        bayesplate.modes("fiemme-spruce-clamped", out=tmp_path / "style")

    assert files_in(tmp_path / "style") == files_in(tmp_path / "plain")
