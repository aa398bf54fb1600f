"""A board of the calibration of roving sensors: each mode once, and constants that hold the truth."""

from __future__ import annotations

import pytest
from validation.calibration import run_roving


@pytest.mark.slow
def test_a_roving_sensor_gives_each_mode_once_and_the_constants(tmp_path):
    (record,) = run_roving.study(1).run(tmp_path / "roving.jsonl", 1, quiet=True)

    assert (record["twice"], record["false"]) == (0, 0)
    assert record["missed"] <= 1
    assert max(map(abs, record["constants"])) < 3.5
    assert run_roving.told([record])[1]
    assert not run_roving.told([record | {"twice": 1}])[1]
    assert not run_roving.told([record | {"constants": [5.0, 0.0, 0.0]}])[1]
