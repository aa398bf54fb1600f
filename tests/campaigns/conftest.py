"""One small campaign: three simulated boards with one accelerometer, fitted once."""

from __future__ import annotations

import pytest
from made_campaigns import write_campaign

import bayesplate


@pytest.fixture(scope="package")
def card(tmp_path_factory):
    """The card of the campaign."""
    return write_campaign(tmp_path_factory.mktemp("campaign"))


@pytest.fixture(scope="package")
def campaign(card):
    """The campaign, its boards solved once."""
    return bayesplate.Campaign.from_card(card)


@pytest.fixture(scope="package")
def fitted_campaign(card, campaign):
    """Its fit, with files."""
    return bayesplate.fit(campaign, out=card.parent / "out")
