"""The page of limits: what tests note, which of several values is shown, and that its rows name existing tests."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import pytest
from limits import NOTES, meets
from validation.calibration.limit_rows import ROWS
from validation.calibration.run_limits import ROOT, measuring, page, passed

EVERY = [row for rows in ROWS.values() for row in rows]


@pytest.fixture
def noted(tmp_path, monkeypatch):
    """Where this test notes, away from any page."""
    path = tmp_path / "notes.jsonl"
    monkeypatch.setenv(NOTES, str(path))
    return path


def read(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


@pytest.mark.parametrize(("value", "limit"), [(0.6, {"at_most": 0.5}), (3.6, {"at_least": 3.7, "at_most": 4.3})])
def test_a_value_outside_its_limit_fails_and_is_noted_as_missed(noted, value, limit):
    with pytest.raises(AssertionError, match=r"V10, twelve modes: wanted at (least|most) .* cents, got "):
        meets("V10", "twelve modes", value, **limit, unit="cents")

    assert [note["met"] for note in read(noted)] == [False]


def test_what_is_no_number_misses_every_limit(noted):
    with pytest.raises(AssertionError):
        meets("V10", "twelve modes", float("nan"), at_most=0.5)
    meets("V10", "twelve modes", 0.4, at_most=0.5)

    assert any("twelve modes: nan (at most 0.5), worst of 2 | **missed** |" in line for line in page(read(noted), {}))


def test_a_limit_has_a_bound(noted):
    with pytest.raises(AssertionError, match="a limit has a bound"):
        meets("V10", "twelve modes", 1.0)


def test_the_page_shows_the_value_nearest_to_breaking_its_limit(noted):
    for value in (3.9, 4.2, 4.0):
        meets("V10", "order", value, at_least=3.7, at_most=4.3)
    meets("V11", "full solves", 0.2, at_most=0.5, unit="cents")
    lines = page(read(noted), {})

    assert any("order: 4.2 (at least 3.7 and at most 4.3), worst of 3 | met |" in line for line in lines)
    assert any("full solves: 0.2 cents (at most 0.5) | met |" in line for line in lines)
    assert sum("not measured" in line for line in lines) == sum(not row.page for row in EVERY) - 2


def test_the_page_says_what_is_missed(noted):
    with pytest.raises(AssertionError):
        meets("V12", "linear problem", 1e-3, at_most=1e-9)
    tests = {"commands/test_killed.py::test_killed_at_any_moment[fit-2]": False}
    lines = page(read(noted), tests | {"commands/test_killed.py::test_killed_at_any_moment[batch-20]": True})

    assert any("linear problem: 0.001 (at most 1e-09) | **missed** |" in line for line in lines)
    assert any("holds in 1 of 2 cases | **missed** |" in line for line in lines)


def test_a_note_without_a_row_is_refused(noted):
    meets("V99", "anything", 0.0, at_most=1.0)
    with pytest.raises(ValueError, match="no row for V99"):
        page(read(noted), {})


def test_tests_are_read_by_file_and_name():
    text = (
        '<testsuites><testsuite><testcase classname="tests.commands.test_killed" name="test_a[fit-2]"/>'
        '<testcase classname="commands.test_killed" name="test_b"><failure/></testcase>'
        '<testcase classname="commands.test_killed" name="test_c"><skipped/></testcase></testsuite></testsuites>'
    )
    assert passed(ElementTree.fromstring(text)) == {
        "commands/test_killed.py::test_a[fit-2]": True,
        "commands/test_killed.py::test_b": False,
    }


def test_every_row_names_tests_that_there_are_or_is_measured_by_one():
    """A test that is renamed would leave its row behind as not measured."""
    noting = "".join(file.read_text(encoding="utf-8") for file in measuring() if file.name != "test_limits.py")
    for row in EVERY:
        for test in row.tests:
            file, _, name = test.partition("::")
            assert f"def {name}" in (ROOT / "tests" / file).read_text(encoding="utf-8"), test
        assert row.tests or row.page or f'meets("{row.check}"' in noting, row.check
    assert len({row.check for row in EVERY}) == len(EVERY)
