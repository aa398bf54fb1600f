"""A few recordings of the calibration: errors within their standard errors, and the highest lines are not."""

from __future__ import annotations

import json

import pytest
from validation.calibration import run_recordings
from validation.calibration.picked import WITHIN, is_calibrated, told

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def records(tmp_path_factory):
    """Two recordings, the second made by a run that goes on."""
    out = tmp_path_factory.mktemp("recordings") / "recordings.jsonl"
    run_recordings.study(1).run(out, 1, quiet=True)
    before = out.read_text()
    found = run_recordings.study(2).run(out, 1, quiet=True)
    assert out.read_text().startswith(before)
    return found


def test_errors_are_as_stated(records):
    assert is_calibrated(records)
    assert sum(len(record["modes"]) for record in records) > 35
    assert "all modes" in "\n".join(told(records))


def test_the_control_is_found_out(records):
    """The highest line, with the error of a line: it would pass if everything did."""
    assert not is_calibrated(records, key="control")


def test_more_false_peaks_than_stated_are_found_out(records):
    spoilt = json.loads(json.dumps(records))
    spoilt[0]["false"] = [0.01] * 25

    assert not is_calibrated(spoilt)
    assert "MISSED: false peaks no more than stated" in told(spoilt)
    assert set(WITHIN) == {1.0, 2.0}
