"""The page and the figures of a campaign: what they say, and what a title cannot do to them."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from payloads import DIRECTION_MARKS, EVERY, shown
from read_pages import Read, faults

import bayesplate
from bayesplate.campaign.claim import SharedClaim, TaughtBoard
from bayesplate.campaign.diagnosis import CampaignDiagnosis, PooledErrors, campaign_claim_sentence
from bayesplate.campaign.search import CampaignExplanation
from bayesplate.campaign.tables import shared_table
from bayesplate.commands.printout import show_campaign_diagnosis, show_campaign_fit
from bayesplate.errors import InputError
from bayesplate.report import campaign as home
from bayesplate.report.campaign import shared_picture, write_campaign_report
from bayesplate.results.contract import Spread

SENSOR = "attached_mass.mass"
PLACES = ("diagnosis", "shared", "boards", "common")


@pytest.fixture(scope="module")
def diagnosis(fitted_campaign):
    """A diagnosis as the boards left out would have it."""
    summary = fitted_campaign.summary
    others = summary.shared[SENSOR].others
    taught = {
        name: TaughtBoard(gain, 7.0, 5.0, 0.4, False, {SENSOR: others[name]})
        for name, gain in zip(others, (3.0, 2.5, -0.5), strict=True)
    }
    return CampaignDiagnosis(
        format=1,
        name="together",
        seed=1,
        card_sha256="",
        verdict="named",
        claim=True,
        effects=("attached_mass",),
        declared=True,
        reason="the card names what the boards share",
        explanations=(),
        probability_of_none=None,
        conditions=SharedClaim(5.0, 1.5, (), 2, True),
        left_out_boards=taught,
        before=PooledErrors(7.0, 7.0),
        after=PooledErrors(5.0, 5.0),
        common_residual=summary.common_residual,
        common_residual_before=summary.common_residual,
        recommendation="",
        notes=(),
    )


def test_the_page_of_a_fit(fitted_campaign):
    folder = fitted_campaign.folder
    page = (folder / "report.html").read_text(encoding="utf-8")

    for board in fitted_campaign.boards:
        assert f'href="boards/{board}/report.html"' in page
        assert (folder / "boards" / board / "report.html").exists()
    assert {path.name for path in (folder / "figures").iterdir()} == {
        f"{stem}.{ending}" for stem in ("shared-attached-mass-mass", "boards", "common") for ending in ("png", "svg")
    }
    assert "90 %" in page
    assert not re.search(r'(src|href)="(?!data:|boards/)', page)  # nothing is fetched


def test_the_page_of_a_diagnosis(fitted_campaign, diagnosis, tmp_path):
    page = write_campaign_report(tmp_path, "three boards", fitted_campaign.summary, diagnosis)

    assert "The boards share attached mass: 2 of 3 boards" in page.read_text(encoding="utf-8")
    assert (tmp_path / "figures" / "left-out.png").exists()


def test_a_text_stays_a_text(fitted_campaign, diagnosis, tmp_path, monkeypatch):
    """The title of the card, warnings, reasons and what is recommended; figures have none of them."""
    monkeypatch.setattr(f"{home.__name__}.campaign_pictures", lambda *_: dict.fromkeys(PLACES, ()))
    told = replace(diagnosis, declared=False, reason=EVERY, recommendation=EVERY)
    summary = replace(fitted_campaign.summary, warnings=(EVERY,))
    text = write_campaign_report(tmp_path, EVERY, summary, told).read_text(encoding="utf-8")
    page = Read(text)

    assert faults(page) == []
    assert " ".join(page.text.split()).count(" ".join(shown(EVERY).split())) >= 5
    assert not set(DIRECTION_MARKS) & set(text)


def test_what_is_claimed_is_said_and_what_is_not_is_said_too(diagnosis):
    """Of a group the sentence names what the boards were fitted with."""
    refused = replace(diagnosis, claim=False, conditions=SharedClaim(5.0, 1.5, ("board-1",), 2, False))
    nothing = replace(diagnosis, claim=False, conditions=None, left_out_boards={}, reason="nothing is lacking")
    both = CampaignExplanation("shared", ("transverse_shear", "attached_mass"), "", 0.0, 0.6)
    other = CampaignExplanation("shared", ("transverse_shear", "fluid_loading"), "", 0.0, 0.4)
    every = ("transverse_shear", "attached_mass", "fluid_loading")
    group = replace(diagnosis, claim=False, effects=every, explanations=(both, other))

    assert campaign_claim_sentence(diagnosis).startswith("The boards share attached mass: 2 of 3")
    assert "5.0 ± 1.5 in log score" in campaign_claim_sentence(diagnosis)
    assert campaign_claim_sentence(refused).startswith("It is not claimed that the boards share attached mass")
    assert "board-1 disagrees with the others" in campaign_claim_sentence(refused)
    assert campaign_claim_sentence(nothing) == "Nothing is claimed: nothing is lacking."
    assert "that the boards share transverse shear and attached mass: 2 of 3" in campaign_claim_sentence(group)


def test_what_the_terminal_shows(fitted_campaign, diagnosis):
    tables = show_campaign_fit(fitted_campaign.summary).tables
    titles = [table.title for table in tables]
    mass = fitted_campaign.summary.shared[SENSOR].all_boards
    ((name, mean_and_sd, ends),) = tables[0].texts

    assert titles[0] == "Shared by all boards"
    assert name == "attached mass, g"
    in_grams = [float(text) for text in (*mean_and_sd.split(" ± "), *ends.split(" to "))]
    assert in_grams == pytest.approx([1e3 * one for one in (mass.mean, mass.sd, mass.q05, mass.q95)], rel=0.05)
    assert any("each board alone" in title for title in titles)
    assert any(title.startswith("Population") for title in titles)
    told = show_campaign_diagnosis(diagnosis)
    assert told.closing == f"Verdict: named. {campaign_claim_sentence(diagnosis)}"
    assert told.remarks[0] == f"the reason: {diagnosis.reason}"


def test_figures_and_draws_of_a_result(fitted_campaign):
    plot = fitted_campaign.plot
    for figure in (plot.shared(), plot.shared(SENSOR), plot.boards(), plot.common()):
        assert figure.axes
    with pytest.raises(InputError, match=r"attached_mass\.mass"):
        plot.shared("mass")
    with pytest.raises(InputError, match="leaves them out"):
        plot.left_out()
    draws = fitted_campaign.to_arviz()["posterior"][SENSOR]
    assert float(draws.mean()) == pytest.approx(fitted_campaign.summary.shared[SENSOR].all_boards.mean, rel=0.02)
    assert "<table" in fitted_campaign._repr_html_()
    assert repr(fitted_campaign) == "<CampaignFitResult of together: 3 boards; attached_mass.mass>"


def test_a_campaign_that_shares_nothing_is_boards_side_by_side(campaign, fitted_campaign, monkeypatch):
    """Boards as they were fitted before anything was shared."""
    alone = {name: one for name, one in fitted_campaign.alone.items() if name != "board-0"}
    monkeypatch.setattr("bayesplate.commands.campaign_fit.fit_boards", lambda *_: alone)
    found = bayesplate.fit(replace(campaign, problems=campaign.problems[1:], shared=(), population=None))

    assert found.shared_posterior is None
    assert found.summary.shared == {}
    assert set(found.summary.boards) == {"board-1", "board-2"}
    with pytest.raises(InputError, match="nothing shared"):
        found.to_arviz()


def test_where_boards_differ_the_page_says_by_how_much_and_what_the_band_is(fitted_campaign):
    """And nothing of it where they do not."""
    summary = fitted_campaign.summary
    differing = replace(summary.shared[SENSOR], scatter=Spread(0.16, 0.12, 0.01, 0.06, 0.14, 0.23, 0.4, "1"))
    summaries = {"alike": summary, "differing": replace(summary, shared={SENSOR: differing})}
    captions = {which: shared_picture(one, SENSOR).caption for which, one in summaries.items()}
    tables = {which: str(shared_table(one.shared).texts) for which, one in summaries.items()}

    assert "the grey band is where their median lies" in captions["differing"]
    assert "median" not in captions["alike"]
    assert "16 ± 12" in tables["differing"]
    assert "The boards' own differ from it by 16 ± 12 %." in home.campaign_sentences(summaries["differing"])
    assert "scatter" not in tables["alike"]
