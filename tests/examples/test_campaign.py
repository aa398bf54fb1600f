"""The example of a campaign: its page says what was found, on simulated boards of which the truth is known."""

from __future__ import annotations

import pytest
from made_campaigns import write_campaign

import bayesplate
from bayesplate.board.shelf import card_names


@pytest.mark.slow
def test_the_page_of_boards_with_one_sensor(load, tmp_path):
    found = bayesplate.diagnose(write_campaign(tmp_path, population=""))
    text = load("campaign").page(found)

    assert found.diagnosis.claim
    assert "The boards share attached mass: 3 of 3 boards that were left out are predicted better" in text
    assert found.diagnosis.after.in_sample_rms_cents < found.diagnosis.before.in_sample_rms_cents
    for board in found.before:
        assert text.count(f"| {board} |") == 3  # left out, taught, side by side


def test_the_example_runs_the_shipped_campaign_which_other_commands_refuse(load):
    assert load("campaign").CAMPAIGN in card_names("campaigns")
    with pytest.raises(bayesplate.InputError, match="check, fit, diagnose and plan take it"):
        bayesplate.compare("spruce-half-tops")
