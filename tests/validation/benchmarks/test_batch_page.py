"""The page of many boards: every limit is missed where it is passed, and met where it is not."""

import re
from dataclasses import replace

import pytest
from validation.benchmarks.batch import Measured, page, ratios

FEW = Measured(50, "1", 14.0, 1.0, 13.0, 90.0, 250.0, 0.1, "a")
ONE = Measured(200, "1", 200.0, 2.0, 198.0, 91.0, 252.0, 0.1, "b")
TWO = replace(ONE, workers="2", seconds=105.0)
CLUSTER = replace(ONE, workers="dask-2", seconds=120.0)
MANY = replace(TWO, boards=10_000, seconds=5500.0, table="c")
RUNS = [FEW, ONE, TWO, CLUSTER, MANY]


def test_all_is_met():
    assert [ratio.row.split("|")[-2].strip() for ratio in ratios(RUNS)] == ["met"] * 8


@pytest.mark.parametrize(
    ("place", "change", "missed"),
    [
        (2, {"seconds": 115.0}, "speed beside one worker, 200 boards, two workers"),
        (3, {"seconds": 140.0}, "speed beside one worker, 200 boards, a Dask cluster"),
        (4, {"seconds": 6400.0}, "time of a board, 10,000 boards beside 200"),
        (1, {"peak_parent": 100.0}, "memory of the command, 200 boards beside 50, one worker"),
        (4, {"peak_worker": 300.0}, "memory of a worker, 10,000 boards beside 200, two workers"),
        (3, {"table": "x"}, "different tables of 200 boards"),
    ],
)
def test_what_passes_its_limit_is_missed(place, change, missed):
    rows = [*RUNS[:place], replace(RUNS[place], **change), *RUNS[place + 1 :]]
    lines = [line for line in page(rows).splitlines() if line.endswith("| missed |")]
    assert len(lines) == 1
    assert re.match(rf"\| {re.escape(missed)}", lines[0])
