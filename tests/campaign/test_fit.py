"""A campaign from its card to its files, and what is refused on the way."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import bayesplate
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.campaign.normal_likelihood import NormalLikelihood
from bayesplate.campaign.shared import SharedParameter
from bayesplate.commands.check import expected_shared_sds
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


HELD, UNBOUNDED = '\neffects = ["clamp_rotation"]\n[[shared]]', 'effect = "density_gradient"\nscatter_percent = 20'
SENSOR, SHARED, HEAD = 'kind = "accelerometer"', 'effect = "attached_mass"', "\n[[shared]]"


def changed(card, folder, old, new, *names):
    """The card of the campaign and its boards, with other words in those of some names."""
    for path in card.parent.glob("*.toml"):
        text = path.read_text()
        (folder / path.name).write_text(text.replace(old, new) if path.stem in names else text)
    return folder / card.name


@pytest.mark.parametrize(
    ("name", "old", "new", "told"),
    [
        ("together", SHARED, f'{SHARED}\nas = "ratio"', "only transverse_shear has ratios"),
        ("board-1", SENSOR, f"{SENSOR}\nmass_g = 3", r'\]\] 1 "attached_mass", board board-1: .*mass known for sure'),
        ("board-1", SENSOR, f"{SENSOR}\nmass_g = {{ mean = 3, sd = 1 }}", "one number, got 2 different ones of mass"),
        ("together", SHARED, UNBOUNDED, "scatter_percent: wanted a positive number.*got .* whose prior is normal"),
        ("together", HEAD, HELD, "together.toml effects -> board-0.toml .*clamp_rotation"),
    ],
)
def test_what_cannot_be_shared_is_refused_with_its_place(card, tmp_path, name, old, new, told):
    with pytest.raises(InputError, match=told):
        bayesplate.Campaign.from_card(changed(card, tmp_path, old, new, name))


def test_a_board_and_its_copy_do_not_count_as_two(card, tmp_path):
    path = changed(card, tmp_path, "board-2.toml", "other.toml", "together")
    copy = (tmp_path / "board-0.toml").read_text().replace('"board-0"', '"other"').replace("format = 1", "format = 1\n")
    (tmp_path / "other.toml").write_text(copy)
    with pytest.raises(InputError, match="boards: wanted each board once, got other with every reading of board-0"):
        bayesplate.Campaign.from_card(path)


def test_faults_of_several_boards_come_at_once(card, tmp_path):
    with pytest.raises(InputError) as refused:
        bayesplate.fit(changed(card, tmp_path, "length_x_mm", "lenght_x_mm", "board-0", "board-2"))

    places = [fault.place for fault in refused.value.faults]
    for start in ("together.toml boards 1 -> board-0.toml", "together.toml boards 3 -> board-2.toml"):
        assert sum(place.startswith(start) for place in places) == 2


def test_effects_of_the_campaign_are_declared_on_every_board_as_its_own(card, tmp_path):
    path = changed(card, tmp_path, HEAD, f'\neffects = ["support_stiffness"]{HEAD}', "together")
    own = bayesplate.Campaign.from_card(path)
    replaced = bayesplate.Campaign.from_card(path, effects=("fluid_loading",))

    for found, effect in ((own, "support_stiffness"), (replaced, "fluid_loading")):
        assert [one.prepared.board.effects for one in found.problems] == [(effect, "attached_mass")] * 3
        assert {one.effect for one in found.shared} == {"attached_mass"}


def test_numbers_of_boards_may_scatter(card, tmp_path):
    path = changed(card, tmp_path, SHARED, f"{SHARED}\nscatter_percent = 20", "together")
    assert [one.scatter for one in bayesplate.Campaign.from_card(path).shared] == [0.2]


def test_a_campaign_takes_nothing_beside_it(campaign):
    with pytest.raises(InputError, match="nothing beside a Campaign"):
        bayesplate.fit(campaign, effects=[])


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
    shared = (SharedParameter("support_stiffness", "stiffness", prior, "N/m^3"),)
    z = np.random.default_rng(1).normal(1.2, 0.1, (20000, 1))
    pull = NormalLikelihood.of_draws(z, np.full(len(z), 1.0 / len(z)), [prior])

    assert expected_shared_sds(shared, [pull])[0] == pytest.approx(0.1 / sd_before, rel=0.03)
    assert expected_shared_sds(shared, [pull, pull])[0] == pytest.approx(0.1 / np.sqrt(2.0) / sd_before, rel=0.03)
    assert expected_shared_sds(shared, [NormalLikelihood(np.zeros((1, 1)), np.zeros(1))]) == pytest.approx([1.0])


def test_where_a_value_is_shared_no_draw_is_weighted(fitted_campaign):
    for member in fitted_campaign.shared_posterior.members:
        assert np.array_equal(member.own_sample.log_weights, np.zeros(len(member.own_sample.z)))


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
