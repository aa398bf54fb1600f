"""A campaign from its card to its files, and what is refused on the way."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from made_campaigns import write_campaign

import bayesplate
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.campaign.boards import Member
from bayesplate.campaign.pulls import Pull
from bayesplate.campaign.shared import Shared
from bayesplate.commands.check import expected_sds
from bayesplate.errors import InputError
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.results.folder import OutputFolder


def test_the_files_of_a_campaign(fitted_campaign):
    folder = fitted_campaign.folder
    summary = json.loads((folder / "summary.json").read_text())

    assert list(summary) == [
        "format", "name", "seed", "versions", "card_sha256", "converged", "shared", "left_out_boards",
        "common_residual", "population", "boards", "sampler", "warnings",
    ]  # fmt: skip
    for board in ("board-0", "board-1", "board-2"):
        own = json.loads((folder / "boards" / board / "summary.json").read_text())
        assert own == summary["boards"][board]
        assert (folder / "boards" / board / "posterior.nc").exists()
    assert not (folder / "checkpoint").exists()
    card = load_prior(folder / "together-population.toml")
    low, high = (summary["population"]["next_board"]["E_x"][q] for q in ("q05", "q95"))
    assert low < card.constants["E_x"].median < high


def test_a_folder_in_use_is_refused_and_force_clears_it(fitted_campaign, card):
    with pytest.raises(InputError, match="one that exists"):
        bayesplate.fit(card, out=fitted_campaign.folder)


def test_the_prior_card_of_an_earlier_run_goes_with_its_other_results(tmp_path):
    """The next run may have no population, or not converge: a card that is left would pass for its own."""
    (tmp_path / "summary.json").write_text("earlier")
    (tmp_path / "together-population.toml").write_text("earlier")
    (tmp_path / "mine.toml").write_text("mine")
    folder = OutputFolder(tmp_path)
    folder.open(resume=False)
    (tmp_path / "summary.json").write_text("new")
    folder.close()
    folder.release()

    assert {path.name for path in tmp_path.iterdir()} == {"summary.json", "mine.toml"}


def test_what_cannot_be_shared_is_refused_board_by_board(tmp_path):
    path = write_campaign(tmp_path)
    text = path.read_text()
    path.write_text(text.replace('"attached_mass"', '"attached_mass"\nas = "ratio"'))
    with pytest.raises(InputError, match="only transverse_shear has ratios"):
        bayesplate.Campaign.from_card(path)
    path.write_text(text)
    board = tmp_path / "board-1.toml"
    board.write_text(board.read_text().replace('kind = "accelerometer"', 'kind = "accelerometer"\nmass_g = 3'))
    with pytest.raises(InputError, match=r"\[\[shared\]\] 1 \"attached_mass\", board board-1: .*mass known for sure"):
        bayesplate.Campaign.from_card(path)
    board.write_text(board.read_text().replace("mass_g = 3", "mass_g = { mean = 3, sd = 1 }"))
    with pytest.raises(InputError, match="one prior, because it is one number, got 2 different ones of mass"):
        bayesplate.Campaign.from_card(path)


def test_a_board_and_its_copy_do_not_count_as_two(tmp_path):
    path = write_campaign(tmp_path)
    copy = (tmp_path / "board-0.toml").read_text().replace('"board-0"', '"other"').replace("format = 1", "format = 1\n")
    (tmp_path / "other.toml").write_text(copy)
    path.write_text(path.read_text().replace('"./board-2.toml"', '"./other.toml"'))
    with pytest.raises(InputError, match="boards: wanted each board once, got other with every reading of board-0"):
        bayesplate.Campaign.from_card(path)


def test_effects_of_the_campaign_are_declared_on_every_board_as_its_own(tmp_path):
    path = write_campaign(tmp_path)
    text = path.read_text()
    path.write_text(text.replace("\n[[shared]]", '\neffects = ["support_stiffness"]\n[[shared]]', 1))
    own = bayesplate.Campaign.from_card(path)
    assert [one.prepared.board.effects for one in own.problems] == [("support_stiffness", "attached_mass")] * len(
        own.problems
    )
    assert {one.effect for one in own.shared} == {"attached_mass"}
    replaced = bayesplate.Campaign.from_card(path, effects=("fluid_loading",))
    assert {one.prepared.board.effects for one in replaced.problems} == {("fluid_loading", "attached_mass")}
    path.write_text(text.replace("\n[[shared]]", '\neffects = ["clamp_rotation"]\n[[shared]]', 1))
    with pytest.raises(InputError, match=r"together.toml boards 1 -> board-0.toml .*clamp_rotation"):
        bayesplate.Campaign.from_card(path)


def test_faults_of_several_boards_come_at_once(tmp_path):
    path = write_campaign(tmp_path)
    for i in (0, 2):
        board = tmp_path / f"board-{i}.toml"
        board.write_text(board.read_text().replace("length_x_mm", "lenght_x_mm"))
    with pytest.raises(InputError) as refused:
        bayesplate.fit(path)

    places = [fault.place for fault in refused.value.faults]
    assert sum(place.startswith("together.toml boards 1 -> board-0.toml") for place in places) == 2
    assert sum(place.startswith("together.toml boards 3 -> board-2.toml") for place in places) == 2


def test_a_campaign_takes_nothing_beside_it(campaign):
    with pytest.raises(InputError, match="nothing beside a Campaign"):
        bayesplate.fit(campaign, effects=[])


def test_a_number_that_could_be_negative_does_not_scatter(tmp_path):
    path = write_campaign(tmp_path)
    text = path.read_text().replace('"attached_mass"', '"attached_mass"\nscatter_percent = 20')
    path.write_text(text)
    assert [one.scatter for one in bayesplate.Campaign.from_card(path).shared] == [0.2]
    path.write_text(text.replace("attached_mass", "density_gradient"))
    with pytest.raises(InputError, match=r"scatter_percent: wanted a positive number.*got .* whose prior is normal"):
        bayesplate.Campaign.from_card(path)


def test_check_says_what_the_boards_would_share(campaign):
    report = bayesplate.check(campaign)

    (one,) = report.shared.values()
    assert set(report.boards) == set(one.boards) == {"board-0", "board-1", "board-2"}
    assert one.expected_sd < min(one.boards.values()) < 1.0
    assert report.population == "spruce"


@pytest.mark.parametrize(("lower", "sd_before"), [(-np.inf, 1.0), (0.0, np.sqrt(1.0 - 2.0 / np.pi))])
def test_the_sd_to_expect_is_over_that_of_the_prior(lower, sd_before):
    """That of a half-normal prior is 0.6 of its scale: far from its bound two boards of sd 0.1 leave 0.1 / 2^0.5."""
    prior = Quantity.from_mean(0.0, 2e4, "normal", lower=lower)
    shared = (Shared("support_stiffness", "stiffness", prior, "N/m^3"),)
    z = np.random.default_rng(1).normal(1.2, 0.1, (20000, 1))
    pull = Pull.of_draws(z, np.full(len(z), 1.0 / len(z)), [prior])

    assert expected_sds(shared, [pull])[0] == pytest.approx(0.1 / sd_before, rel=0.03)
    assert expected_sds(shared, [pull, pull])[0] == pytest.approx(0.1 / np.sqrt(2.0) / sd_before, rel=0.03)
    assert expected_sds(shared, [Pull(np.zeros((1, 1)), np.zeros(1))]) == pytest.approx([1.0])


def test_members_of_a_ratio_have_the_campaign_s_prior(fitted_campaign):
    """Where a value is shared nothing is weighted."""
    for member in fitted_campaign.learnt.members:
        assert isinstance(member, Member)
        assert np.array_equal(member.alone.log_weights, np.zeros(len(member.alone.z)))


@pytest.mark.slow
def test_the_shipped_half_tops_pass_the_gate():
    """Boards of up to 17 parameters: what is proposed to them is learnt from a pilot of their own."""
    found = bayesplate.fit("spruce-half-tops")

    assert found.summary.converged
    assert list(found.boards) == [f"spruce-free-{name}" for name in ("1L", "1R", "2L", "2R", "3L", "3R")]
    assert all(one.summary.sampler.ess_min >= 400 for one in found.alone.values())


@pytest.mark.slow
def test_an_interrupted_campaign_goes_on_to_the_same_bytes(campaign, fitted_campaign, tmp_path):
    def interrupt(progress):
        if progress.stage == "board board-1" and progress.n_steps > 50:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bayesplate.fit(campaign, out=tmp_path / "out", progress=interrupt)
    bayesplate.fit(campaign, out=tmp_path / "out", resume=True)

    for name in ("summary.json", "boards/board-2/summary.json", "posterior.nc"):
        assert (tmp_path / "out" / name).read_bytes() == (fitted_campaign.folder / name).read_bytes()


def test_a_campaign_that_does_not_converge_says_so(campaign, tmp_path, monkeypatch):
    never = replace(campaign, problems=campaign.problems[1:], shared=())
    monkeypatch.setattr("bayesplate.commands.fitting.SamplerSettings", lambda seed: SamplerSettings(seed, max_steps=25))
    with pytest.raises(bayesplate.NotConvergedError, match="board board-1"):
        bayesplate.fit(never, out=tmp_path / "out")

    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["converged"] is False
    assert "boards" not in summary
