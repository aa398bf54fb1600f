"""Figures in files are the same whatever style the user has set, and in threads."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from made_reports import Fit
from matplotlib import rc_context
from runs import files_in

import bayesplate

STYLE = {"axes.facecolor": "black", "font.family": "serif", "savefig.bbox": "tight", "text.usetex": True}


def test_a_style_of_the_user_and_another_thread_change_no_file(clamped, clamped_folder, tmp_path):
    def write(fit: Fit, name: str) -> None:
        fit.write(tmp_path / name)

    with rc_context(STYLE), ThreadPoolExecutor(2) as threads:
        for done in [threads.submit(write, clamped, name) for name in ("one", "two")]:
            done.result()

    assert files_in(tmp_path / "one") == files_in(tmp_path / "two") == files_in(clamped_folder)


def test_nor_do_they_change_the_sheet_of_modes(tmp_path):
    bayesplate.modes("fiemme-spruce-clamped", out=tmp_path / "plain")
    with rc_context(STYLE):
        bayesplate.modes("fiemme-spruce-clamped", out=tmp_path / "style")

    assert files_in(tmp_path / "style") == files_in(tmp_path / "plain")
