"""One small campaign: three simulated boards with one accelerometer, fitted once."""

from __future__ import annotations

import pytest
from made_campaigns import write_campaign

import bayesplate
from bayesplate.campaign import combined
from bayesplate.commands.fitting import FitResult
from bayesplate.posterior.slips import Remarks


@pytest.fixture(scope="module", autouse=True)
def _no_slips():
    """Without the search for slips of the readings, which takes most of a fit and has tests of its own."""
    with pytest.MonkeyPatch.context() as patch:
        leave_out_slips(patch)
        yield


@pytest.fixture
def _few_points(monkeypatch):
    """For rates over many campaigns, where moments of few points are enough."""
    monkeypatch.setattr(combined, "_N_POINTS_BY_DIMENSION", dict.fromkeys((1, 2), 2**11))
    monkeypatch.setattr(combined, "FEWEST_POINTS", 100)


def leave_out_slips(patch):
    patch.setattr("bayesplate.posterior.posing.reading_remarks", lambda *_: Remarks((), ()))


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
    """Its fit, with files; the page of a board is that of its fit, and written whole for the first one only."""
    whole = FitResult.write_page

    def first_whole(result, folder):
        return whole(result, folder) if folder.name == "board-0" else (folder / "report.html").write_text("a page")

    with pytest.MonkeyPatch.context() as patch:
        leave_out_slips(patch)  # what is made for all modules comes before what is patched for each
        patch.setattr(FitResult, "write_page", first_whole)
        return bayesplate.fit(campaign, out=card.parent / "out")
