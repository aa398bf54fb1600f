"""What boards lack in common: probabilities against sums by hand, and which effects can be searched for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from made_campaigns import write_campaign

import bayesplate
from bayesplate.campaigns.diagnosis import named
from bayesplate.campaigns.search import PRIOR, explanations, log_evidence_shared
from bayesplate.workflow.campaign_diagnose import _sharing, shareable


@dataclass(frozen=True)
class Tables:
    """A board's cells of one effect: ln of prior and likelihood of each size, and the evidence of none."""

    name: str
    none: float
    likelihood: dict
    prior: float = float(np.log(0.25))

    def cells(self, effect):
        return {(0.0, z): (self.prior, value) for z, value in self.likelihood.items()}

    def log_evidence(self, effect):
        if not effect:
            return self.none
        return float(np.log(np.sum([np.exp(a + b) for a, b in self.cells(effect).values()])))


SIZES = (-1.0, 0.0, 1.0, 2.0)


def board(name, peak, height=8.0, none=0.0):
    return Tables(name, none, {z: height - 4.0 * (z - peak) ** 2 for z in SIZES})


def test_one_size_for_all_is_the_sum_over_sizes_of_the_product_over_boards():
    boards = [board("a", 1.0), board("b", 1.0), board("c", 0.0)]
    by_hand = np.log(np.sum([0.25 * np.exp(sum(one.likelihood[z] for one in boards)) for z in SIZES]))

    assert log_evidence_shared(boards, "mass") == pytest.approx(by_hand)
    fewer = [*boards, Tables("d", 0.0, dict.fromkeys(SIZES[1:3], 8.0))]
    kept = [np.exp(sum(one.likelihood[z] for one in fewer)) for z in SIZES[1:3]]
    assert log_evidence_shared(fewer, "mass") == pytest.approx(np.log(np.mean(kept)))


def test_boards_that_agree_share_and_boards_that_differ_do_not():
    agreeing = explanations([board(name, 1.0) for name in "abc"], ["mass"])
    differing = explanations([board(name, peak) for name, peak in zip("abc", (-1.0, 0.0, 2.0), strict=True)], ["mass"])
    one = explanations([board("a", 1.0), *(board(name, 0.0, height=-6.0) for name in "bc")], ["mass"])

    assert (agreeing[0].way, agreeing[0].effect) == ("shared", "mass")
    assert differing[0].way == "own"
    assert (one[0].way, one[0].board) == ("one board", "a")
    for found in (agreeing, differing, one):
        assert sum(each.probability for each in found) == pytest.approx(1.0)
        assert len(found) == 6
    assert named(agreeing)[:2] == ("named", ("mass",))
    assert named(differing)[0] == named(one)[0] == "unexplained"


def test_the_probability_is_the_evidence_times_the_stated_prior():
    boards = [board(name, 1.0, height=0.5) for name in "ab"]
    found = {(one.way, one.board): one for one in explanations(boards, ["mass", "stiffness"])}
    ratio = found["shared", ""].probability / found["none", ""].probability
    evidence = log_evidence_shared(boards, "mass")

    assert ratio == pytest.approx(np.exp(evidence) * 0.5 * PRIOR["shared"] / PRIOR["none"])


def searching(folder, twice=""):
    """A campaign that names nothing shared; one board may have its setup a second time."""
    path = write_campaign(folder)
    path.write_text(path.read_text().replace('[[shared]]\neffect = "attached_mass"\n', ""))
    if twice:
        card = folder / f"{twice}.toml"
        text = card.read_text()
        setup = text[text.index("[[setup]]") :]
        card.write_text(text + "\n" + setup.replace('name = "free"', 'name = "again"'))
    return bayesplate.Campaign.from_card(path)


def test_what_a_fit_could_not_share_is_not_searched_for(tmp_path):
    """Of the air only the baffle's share is not known; a Poisson ratio is each board's own."""
    campaign = searching(tmp_path)
    found = shareable(campaign)

    assert set(found) == {"transverse_shear", "attached_mass", "air_loading", "support_stiffness"}
    for effect in found:
        assert _sharing(campaign, (effect,)).shared
    assert [one.name for one in _sharing(campaign, ("air_loading",)).shared] == ["air_loading.baffle"]


def test_an_effect_that_each_setup_has_at_a_size_of_its_own_is_not_searched_for(tmp_path):
    assert shareable(searching(tmp_path, twice="board-1")) == ("transverse_shear",)
