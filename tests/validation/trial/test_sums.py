"""What records of a trial add up to: sums by hand, the confusion, the page and the records that are published."""

from __future__ import annotations

import gzip
import hashlib
import json
from pathlib import Path

import pytest
from validation.trial import warped_or_driven
from validation.trial.again import told
from validation.trial.cells import WARPED_OR_DRIVEN, Cell
from validation.trial.counts import is_best
from validation.trial.made_records import found_right, made
from validation.trial.page import in_short, page, plain, write
from validation.trial.published import as_text, publish_records, published_records
from validation.trial.summary import by_class, summarise

ONE = Cell("one", "cantilever-6", 5, size=2.0)
NULL = Cell("null", "cantilever-6", 4)


@pytest.fixture
def by_hand():
    """Five boards with one effect, four without."""
    group = "indistinguishable group"
    return [
        made(ONE, 0, ["air"], "named", ["air"], ["air", "mass"], claim=True),
        made(ONE, 1, ["air"], "named", ["mass"], ["mass"], holds=(True, False, False)),
        made(ONE, 2, ["mass"], group, ["air", "mass", "clamp"], ["air", "mass", "clamp"]),
        made(ONE, 3, ["mass"], group, ["air", "clamp"], ["air", "clamp"], none=0.6),
        made(ONE, 4, ["mass"], "none needed", best=["mass"], near=["mass"], none=0.4, holds=(False,) * 3,
             averaged=(True,) * 3),
        made(NULL, 0, [], "none needed", none=0.9),
        made(NULL, 1, [], "undetectable", none=0.9),
        made(NULL, 2, [], "unexplained", none=0.9),
        made(NULL, 3, [], "named", ["air"], ["air"], claim=True),
    ]  # fmt: skip


def test_sums_by_hand(by_hand):
    summary = summarise(by_hand, 1, (ONE, NULL))
    one, null = summary["cells"][ONE.name], summary["cells"][NULL.name]
    found = {limit["quantity"]: limit for limit in summary["limits"]}

    assert one["top_1"]["count"] == 2  # boards 0 and 4: the verdict does not matter
    assert null["top_1"]["count"] == 3  # nothing is an answer, and the right one
    assert not is_best(by_hand[4] | {"none": 0.5})
    assert is_best(by_hand[8] | {"none": 0.5})
    assert (one["claimed"]["count"], null["claimed"]["count"]) == (1, 1)
    assert {name: (c["claimed"]["count"], c["claimed"]["n"]) for name, c in summary["claims"].items()} == {
        "nothing planted": (1, 4), "named right": (1, 1), "named wrong": (0, 1),
        "group with everything planted": (0, 1), "group without": (0, 1),
    }  # fmt: skip
    assert (one["right_name"]["count"], one["wrong_name"]["count"], one["named"]["count"]) == (1, 1, 2)
    assert (one["wrong_of_named"]["count"], one["wrong_of_named"]["n"]) == (1, 2)
    assert (one["covered"]["count"], one["covered"]["n"]) == (2, 4)  # boards 0 and 2 of the four with a set
    assert one["set_size"]["value"] == pytest.approx((2 + 1 + 3 + 2) / 4)
    assert one["constants"]["after"]["E_x"]["count"] == 4
    assert one["constants"]["after"]["all"]["value"] == pytest.approx((3 + 1 + 3 + 3 + 0) / 15)
    assert one["constants"]["without"]["all"]["value"] == 0.0
    assert (null["named"]["count"], null["flagged"]["count"]) == (1, 2)
    assert found["null, cantilever-6, noise at its prior's median: flagged at all"]["share"] == 0.5
    assert by_class(by_hand[:5])["air"]["after"] == pytest.approx((1 + 1 / 3) / 2)
    assert by_class(by_hand[:5])["mass"]["after"] == pytest.approx(2 / 3)
    title = "constants after tracing, cantilever-6, 2x: 90 % intervals"
    assert found[title]["share"] == pytest.approx((2 / 3 + 1) / 2)  # averaged over hypotheses, then over classes
    assert "alone 66.7 %" in found[title]["note"]


def test_boards_without_an_answer_are_listed(by_hand, tmp_path):
    failed = {"cell": ONE.name, "index": 9, "truth": {"effects": ["air"]}, "error": "InputError: no", "seconds": 1.0}
    summary = write([*by_hand, failed], 1, tmp_path, (ONE, NULL))
    assert summary["boards"] == {"judged": 9, "failed": 1, "wanted": 9}
    assert json.loads((tmp_path / "trial.json").read_text()) == summary
    text = (tmp_path / "trial.md").read_text()
    assert "InputError: no" in text
    assert "**missed**" in text
    assert text == "\n".join(page(summary)) + "\n"


def test_published_records_are_the_same_bytes_and_add_up_to_the_same(by_hand, tmp_path):
    """Without the seconds; where they would take too many bytes there is their digest alone, and no old file stays."""
    slower = [record | {"seconds": 7.0} for record in by_hand]
    kept, again = (publish_records(records, 4, tmp_path) for records in (by_hand, slower))
    packed = (tmp_path / "trial-records.jsonl.gz").read_bytes()
    assert kept == again
    assert packed[4:8] == bytes(4)  # the time of a gzip file
    assert hashlib.sha256(gzip.decompress(packed)).hexdigest() == kept["sha256"]
    cells = (ONE, NULL)
    assert summarise(published_records(tmp_path), 4, cells) == summarise(by_hand, 4, cells)
    digest = publish_records(by_hand, 4, tmp_path, most_bytes=len(packed))
    assert digest == kept | {"file": None}
    assert not (tmp_path / "trial-records.jsonl.gz").exists()


def test_records_in_the_repository_are_those_of_the_page():
    """Once a whole trial has been published: its records add up to every number of its summary."""
    root = Path(__file__).parents[3] / "docs" / "validation"
    shown = json.loads((root / "trial.json").read_text(encoding="utf-8"))
    if not shown.get("records") or not shown["records"]["file"]:
        pytest.skip("the records of this trial are not in the repository")
    records = published_records(root)
    assert hashlib.sha256(as_text(records)).hexdigest() == shown["records"]["sha256"]
    again = plain(summarise(records, shown["base_seed"]))
    assert again == {key: value for key, value in shown.items() if key != "records"}


def test_the_short_form_is_that_of_the_summary():
    root = Path(__file__).parents[3] / "docs" / "validation"
    shown = json.loads((root / "trial.json").read_text(encoding="utf-8"))
    assert in_short(shown) == (root / "trial-short.md").read_text(encoding="utf-8").strip()
    few = in_short(shown | {"cells": {}})
    assert "does not know they hold E_y" in in_short(shown)
    assert "they hold E_y" not in few


def test_the_readme_says_in_short_what_the_trial_found():
    """The paragraph is that of the published run, to the word."""
    root = Path(__file__).parents[3]
    shown = (root / "README.md").read_text(encoding="utf-8")
    inside = shown.partition("<!-- trial -->")[2].partition("<!-- /trial -->")[0]
    assert inside.strip() == (root / "docs" / "validation" / "trial-short.md").read_text(encoding="utf-8").strip()


def test_boards_judged_again_are_worse_where_more_of_the_changed_ones_are_than_chance_makes():
    """Seven of seven changed for the worse have a chance of 1/128; with one for the better it is 9/256."""
    right = [made(ONE, i, ["air"], "named", ["air"], ["air"]) for i in range(8)]
    wrong = [made(ONE, i, ["air"], "named", ["mass"], ["mass"]) for i in range(8)]
    before = [*right[:7], wrong[7]]

    assert told(right, right)[1]
    lines, is_well = told(before, [*wrong[:7], wrong[7]])
    assert not is_well
    assert any(line.startswith("one      wrong name              8      1      8  WORSE") for line in lines)
    assert told(before, [*wrong[:7], right[7]])[1]
    assert "7 of 8 boards have another verdict" in "\n".join(lines)
    assert "one cantilever-6 5c 2x, board 0: named (air) -> named (mass)" in "\n".join(lines)


def test_the_page_of_warp_and_exciter_counts_who_is_named_in_part_and_rightly():
    """Three boards are unexplained: one named in part rightly, one by what is not there, one not at all."""
    cell = WARPED_OR_DRIVEN[3]
    records = [made(cell, i, ["warp"], "unexplained") for i in range(3)] + [found_right(cell, 3, ["warp"])]
    records[0]["in_part"], records[1]["in_part"] = ["warp"], ["fluid_loading"]
    lines = warped_or_driven.page(plain(summarise(records, 8, WARPED_OR_DRIVEN)), records)
    assert f"- {cell.name}: 3 unexplained, 2 named in part, 1 of these rightly" in lines
    assert any(line.startswith("4 boards of 1450 judged, 0 gave no answer") for line in lines)
