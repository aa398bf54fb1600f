"""The page that grades many boards: what it says, and what names and messages cannot do to it."""

from __future__ import annotations

import re

import numpy as np
import pytest
from payloads import EVERY
from read_pages import Read, faults, not_as_text

from bayesplate.grading.boards import BatchSummary, BoardRow, FailedBoard
from bayesplate.grading.matching import GradingRequest, grade
from bayesplate.report.grading import MOST_NAMED_ROWS, pairs_picture, speed_picture, write_grading_page
from bayesplate.results.contract import JOINT_NAMES, JointMoments

LOG = np.log([12e9, 0.9e9, 0.7e9, 25.0, 2.0, 5.0, 440.0])
EVIL = "<script>alert(1)</script>"


def rows_of(n: int, name: str = "top", spread: float = 0.05, doubt: str = "") -> list[BoardRow]:
    """Boards made by hand, whose densities differ by a spread; of the second there may be a doubt."""
    mean = LOG + np.random.default_rng(7).standard_normal((n, 7)) * np.r_[np.full(6, 0.05), spread]
    covariance = tuple(map(tuple, 4e-4 * np.eye(7)))
    joints = [JointMoments(JOINT_NAMES, tuple(one), covariance) for one in mean]
    doubts = [doubt if i == 1 else "" for i in range(n)]
    return [BoardRow(f"{name}-{i}", "fitted", doubt=doubts[i], joint=one) for i, one in enumerate(joints)]


def page_of(folder, n: int, request: GradingRequest, said: str = EVIL, doubt: str = ""):
    """The page of boards made by hand, and its text."""
    rows = rows_of(n, doubt=doubt)
    failed = (FailedBoard("<b>" if said == EVIL else said, "refused", said),)
    summary = BatchSummary(1, 1, {}, n + 1, n, 1, failed, (), ())
    graded = grade(rows, request)
    path = write_grading_page(folder, graded, summary, has_pages=True)
    return graded, path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def few(tmp_path_factory):
    folder = tmp_path_factory.mktemp("few")
    limits = {"E_x": (11e9, 13e9), "density": (None, 450.0)}
    return folder, *page_of(folder, 6, GradingRequest(limits=limits, rigidity=20.0))


@pytest.mark.parametrize("spread", [0.0, 0.05])
def test_no_name_stands_over_another_whether_boards_have_one_density_or_many(spread):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.text import Annotation, Text

    figure = speed_picture(grade(rows_of(12, "half-top", spread), GradingRequest())).figure
    FigureCanvasAgg(figure).draw()
    named = [one for one in figure.axes[0].get_children() if isinstance(one, Annotation) and "half" in one.get_text()]
    boxes = [Text.get_window_extent(one) for one in named]

    assert len(boxes) == 12
    assert not any(one.overlaps(other) for i, one in enumerate(boxes) for other in boxes[:i])


def test_each_value_of_a_pair_lies_on_its_own_tolerance():
    tolerances = {"E_x": 5.0, "E_y": 15.0, "density": 3.0}
    graded = grade(rows_of(6, spread=0.005), GradingRequest(tolerances))
    (panel,) = pairs_picture(graded).figure.axes

    assert len(graded.pairs) > 1
    greys = sorted((bar.get_y(), bar.get_x(), bar.get_width()) for bar in panel.patches)
    expected = [ends for _ in graded.pairs for ends in ((-100 * p / (100 + p), p) for p in tolerances.values())]
    np.testing.assert_allclose([(x, x + width) for _, x, width in greys], expected, rtol=1e-12)


def test_the_page_says_what_was_found(few):
    folder, graded, page = few
    expected = float(graded.all_limits_probability.sum())

    assert "6 of 7 boards were fitted" in page
    assert f"{expected:.1f} are to be expected" in page
    assert "Two boards match where" in page
    assert "wanted rigidity" in page
    assert {path.name for path in (folder / "figures").iterdir()} == {
        f"{stem}.{ending}"
        for stem in ("boards-sorted", "density-speed", "limits", "pairs")
        for ending in ("png", "svg")
    }
    assert not re.search(r'(src|href)="(?!data:|boards/top-\d/report\.html")', page)  # nothing is fetched
    assert faults(Read(page)) == []
    assert EVIL in Read(page).text
    # the negative control: what a message would bring in is found by the same reader
    assert "element script" in faults(Read(page.replace("&lt;", "<").replace("&gt;", ">")))


def test_a_board_in_doubt_has_its_place_on_the_page_and_is_not_counted(tmp_path):
    graded, page = page_of(tmp_path, 6, GradingRequest(limits={"E_x": (11e9, 13e9)}), doubt=EVIL)
    text = " ".join(Read(page).text.split())

    assert faults(Read(page)) == []
    assert text.count("Boards in doubt") >= 2
    assert text.count(EVIL) == 2  # the doubt, and the message of a board that was not fitted
    assert "1 board is in doubt" in text
    assert f"{float(np.delete(graded.all_limits_probability, 1).sum()):.1f} are to be expected" in text


def test_names_and_messages_stay_texts(tmp_path):
    """Of boards that could not be fitted: the only ones whose names may be anything."""
    _, page = page_of(tmp_path, 0, GradingRequest(), said=EVERY)

    assert not_as_text(page, EVERY, 2) == []


def test_many_boards_are_drawn_without_names_and_none_at_all_is_a_page_too(tmp_path):
    n = MOST_NAMED_ROWS + 80
    _, page = page_of(tmp_path / "many", n, GradingRequest())
    assert f"the first 100 of {n}" in page
    _, page = page_of(tmp_path / "none", 0, GradingRequest(limits={"E_x": (1e9, None)}))
    assert "Boards that were not fitted" in page
    assert "<img" not in page
