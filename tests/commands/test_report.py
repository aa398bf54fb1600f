"""The report among the files of a fit: replaced with them, left out where nobody wants it."""

from __future__ import annotations

import runs

BOARD = "fiemme-spruce-clamped"


def test_a_new_run_takes_the_old_report_away(quick_fit):
    """Also where the new one writes none: a page must not stand beside numbers that are not its own."""
    run = quick_fit(BOARD, "--quiet")
    (run.folder / "figures").mkdir()
    tables = [
        f"{table}.{ending}" for table in ("constants", "before-after", "known-effects") for ending in ("csv", "tex")
    ]
    for name in ("report.html", *tables):
        (run.folder / name).write_bytes(b"old")
    (run.folder / "figures" / "board.svg").write_bytes(b"old")
    (run.folder / "figures" / "mine.txt").write_bytes(b"mine")
    again = quick_fit(BOARD, "--quiet", "--force")

    assert again.exit_code == 0
    assert set(runs.files_in(run.folder)) == {"summary.json", "posterior.nc", "figures/mine.txt"}


def test_the_page_tells_of_the_numbers_beside_it(fiemme, fiemme_files):
    page = fiemme_files["report.html"].decode()
    mean, sd = (value / 1e9 for value in (fiemme.summary.elastic.E_x.mean, fiemme.summary.elastic.E_x.sd))

    assert f"{mean:.2f} ± {sd:.2f}" in page
    assert "Fiemme Valley red spruce guitar top, clamped" in page
