"""The example of a campaign: its page says what was found, on simulated boards of which the truth is known."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest
from made_campaigns import write_campaign

import bayesplate
from bayesplate.board.shelf import card_names

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("campaign_example", ROOT / "examples" / "campaign.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_the_page_of_boards_with_one_sensor(example, tmp_path):
    found = bayesplate.diagnose(write_campaign(tmp_path, population=""))
    text = example.page(found)

    assert found.diagnosis.claim
    assert "The boards share attached mass: 3 of 3 boards that were left out are predicted better" in text
    assert found.diagnosis.after.in_sample_rms_cents < found.diagnosis.before.in_sample_rms_cents
    for board in found.before:
        assert text.count(f"| {board} |") == 3  # left out, taught, side by side


def test_the_example_runs_the_shipped_campaign(example):
    assert example.CAMPAIGN in card_names("campaigns")


def test_other_commands_say_that_it_is_a_campaign():
    with pytest.raises(bayesplate.InputError, match="check, fit, diagnose and plan take it"):
        bayesplate.compare("spruce-half-tops")
