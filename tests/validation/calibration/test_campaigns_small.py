"""Simulated campaigns: how they are judged, and one small campaign from its truth to its record."""

from __future__ import annotations

import json

import pytest
from validation.calibration.campaigns import CampaignDesign, identity, judge, simulate_one
from validation.calibration.records import read_done
from validation.calibration.run_campaigns import main


def record(kind, number, claim, shear=2.0, mass=2.0):
    """Intervals of both from 1 to 3."""
    shared = {"shear": [1.0, 2.0, 3.0], "mass": [1.0, 2.0, 3.0]}
    own = {"truth": {"shear": shear, "mass": mass}, "shared": shared, "refused_by": [], "seconds": 1.0}
    return {"kind": kind, "campaign": number, "claim": claim, **own}


def test_campaigns_that_are_right_pass():
    good = [record("all", i, True, 2.0 if i % 10 else 5.0, 2.8 if i % 5 else 0.9) for i in range(100)]
    good += [record("some", i, False) for i in range(100)] + [record("none", i, i < 4) for i in range(100)]
    lines, well = judge(good)

    assert well
    assert lines[:3] == [
        "sensor and shear on all boards, 100 campaigns of a median of 1 s: claimed 100 times, refused by a board 0",
        "  90 % intervals of shear hold 90, wanted 79 to 98; of half the width 90",
        "  90 % intervals of mass hold 80, wanted 79 to 98; of half the width 0",
    ]


@pytest.mark.parametrize(
    "bad",
    [
        [record("all", i, True, 2.0 if i % 3 else 5.0) for i in range(100)],
        [record("all", i, True, 2.0, 2.0 if i % 3 else 5.0) for i in range(100)],
        [record("some", i, i < 20) for i in range(100)],
        [record("none", i, i < 20) for i in range(100)],
        [{"kind": "all", "campaign": 0, "error": "it fell over"}],
    ],
)
def test_campaigns_that_are_wrong_do_not(bad):
    """The negative control."""
    assert not judge(bad)[1]


def test_a_file_of_another_design_is_refused(tmp_path):
    path = tmp_path / "campaigns.jsonl"
    assert read_done(path, identity(CampaignDesign())) == []
    with pytest.raises(SystemExit, match="made with another design"):
        read_done(path, identity(CampaignDesign(n_boards=3)))


def test_a_run_that_is_not_whole_says_so(tmp_path, capsys, monkeypatch):
    out = tmp_path / "campaigns.jsonl"
    monkeypatch.setattr("sys.argv", ["run_campaigns.py", "--workers", "0", "--boards", "3", "--out", str(out)])
    assert main() == 1
    assert "not whole: 0 of 300 were run" in capsys.readouterr().out
    assert read_done(out, identity(CampaignDesign(n_boards=3))) == []


@pytest.mark.slow
def test_a_campaign_of_two_boards_leaves_a_record():
    found = simulate_one(CampaignDesign(n_boards=2), "all", 0)

    assert "error" not in found
    assert set(found["truth"]) == set(found["shared"])
    assert all(low < middle < high for low, middle, high in found["shared"].values())
    assert found["with"] == ["board-0", "board-1"]
    assert json.loads(json.dumps(found)) == found
