"""What boards lack in common: probabilities against sums by hand, and which effects can be searched for."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest
from made_campaigns import MASS, write_campaign

import bayesplate
from bayesplate.campaign.diagnosis import campaign_verdict
from bayesplate.campaign.search import (
    PRIOR_SHARE_OF_TWO,
    SHARING_PRIOR,
    CampaignExplanation,
    log_evidence_shared,
    rank_campaign_explanations,
    search_board,
    visible_effects,
)
from bayesplate.commands.campaign_diagnose import _share_effects, shareable_effects
from bayesplate.diagnosis.baseline import baseline_of


class Cells:
    """A board whose likelihood in each cell of the sizes of effects is given, all as probable beforehand."""

    def __init__(self, name, none, **effects):
        self.name, self.none, self.effects = name, none, effects

    def cells(self, effects):
        values = self.effects.get("_".join(effects), {})
        return {(0.0, z): (-np.log(len(values)), value) for z, value in values.items()}

    def cells_in_pair(self, shared, own):
        """A board's likelihood is the product of what it says of the two."""
        return {
            key: (prior, value + self.log_evidence((own,))) for key, (prior, value) in self.cells((shared,)).items()
        }

    def log_evidence(self, effects):
        return float(np.log(np.mean(np.exp(list(self.effects["_".join(effects)].values()))))) if effects else self.none


SIZES = (-1.0, 0.0, 1.0, 2.0)


def board(name, peak, height=8.0, none=0.0):
    return Cells(name, none, mass={z: height - 4.0 * (z - peak) ** 2 for z in SIZES})


def test_one_size_for_all_is_summed_over_the_cells_that_all_boards_have():
    boards = [board("a", 1.0), board("b", 1.0), Cells("c", 0.0, mass=dict.fromkeys(SIZES[1:3], 8.0))]
    kept = [np.exp(sum(one.effects["mass"][z] for one in boards)) for z in SIZES[1:3]]

    assert log_evidence_shared(boards, ("mass",)) == pytest.approx(np.log(np.mean(kept)))


def test_each_way_has_the_probability_of_its_prior_and_its_evidence():
    """Of two boards and two effects, by hand: one size for all is the sum over cells of the product over boards."""
    one, other = (
        Cells("one", -1.0, a={0.0: 0.0, 1.0: 2.0}, b={0.0: 1.0}),
        Cells("other", -2.0, a={0.0: 0.5, 1.0: 1.0}, b={0.0: 0.0}),
    )
    of_one, of_other = np.log(0.5 + 0.5 * np.exp(2.0)), np.log(0.5 * np.exp(0.5) + 0.5 * np.exp(1.0))
    half_own = 0.5 * (SHARING_PRIOR["own"] + SHARING_PRIOR["shared and own"])  # no two effects are asked for
    by_hand = {
        ("none", (), ""): (SHARING_PRIOR["none"], -3.0),
        ("shared", ("a",), ""): (0.5 * SHARING_PRIOR["shared"], np.log(0.5 * np.exp(0.5) + 0.5 * np.exp(3.0))),
        ("shared", ("b",), ""): (0.5 * SHARING_PRIOR["shared"], 1.0),
        ("own", ("a",), ""): (half_own, of_one + of_other),
        ("own", ("b",), ""): (half_own, 1.0),
        ("one board", ("a",), "one"): (0.25 * SHARING_PRIOR["one board"], of_one - 2.0),
        ("one board", ("a",), "other"): (0.25 * SHARING_PRIOR["one board"], of_other - 1.0),
        ("one board", ("b",), "one"): (0.25 * SHARING_PRIOR["one board"], 1.0 - 2.0),
        ("one board", ("b",), "other"): (0.25 * SHARING_PRIOR["one board"], 0.0 - 1.0),
    }
    total = sum(prior * np.exp(log_evidence) for prior, log_evidence in by_hand.values())
    found = rank_campaign_explanations([one, other], [("a",), ("b",)])

    assert len(found) == len(by_hand)
    for each in found:
        prior, log_evidence = by_hand[each.way, each.effects, each.board]
        assert each.log_evidence == pytest.approx(log_evidence), each
        assert each.probability == pytest.approx(prior * np.exp(log_evidence) / total), each
    assert [each.probability for each in found] == sorted((each.probability for each in found), reverse=True)
    assert sum(SHARING_PRIOR.values()) == pytest.approx(1.0)


def test_two_effects_alike_take_their_share_of_what_is_shared():
    """They need a cell in common of both; where a board would not show one of them, there is none."""
    sizes = {0.0: 3.0, 1.0: 5.0}
    boards = [Cells(name, 0.0, mass=sizes, stiffness=sizes, mass_stiffness=sizes) for name in "ab"]
    effects = [("mass",), ("stiffness",), ("mass", "stiffness")]
    both = {one.effects: one for one in rank_campaign_explanations(boards, effects) if one.way == "shared"}

    assert both["mass", "stiffness"].log_evidence == pytest.approx(np.log(0.5 * np.exp(6.0) + 0.5 * np.exp(10.0)))
    ratio = both["mass", "stiffness"].probability / both["mass",].probability
    assert (ratio, PRIOR_SHARE_OF_TWO) == (pytest.approx(PRIOR_SHARE_OF_TWO / (0.5 * (1.0 - PRIOR_SHARE_OF_TWO))), 0.2)
    one_shows_less = [boards[0], Cells("b", 0.0, mass=sizes, stiffness=sizes)]
    alone = {one.effects: one for one in rank_campaign_explanations(one_shows_less, effects) if one.way == "shared"}
    assert set(alone) == {("mass",), ("stiffness",)}


@pytest.mark.parametrize("sizes", [(-1.0, 0.0, 2.0), (1.0, 1.0, 1.0)])
def test_an_effect_alike_is_found_beside_another_that_each_board_has_of_its_own(sizes):
    """With the share that it has beforehand; where the other is of one size too, the boards share both."""
    boards = [board(name, 1.0) for name in "abc"]
    for one, size in zip(boards, sizes, strict=True):
        one.effects["support"] = {z: 8.0 - 4.0 * (z - size) ** 2 for z in SIZES}
        both = {(a, b): one.effects["mass"][a] + one.effects["support"][b] for a in SIZES for b in SIZES}
        one.effects["mass_support"] = both
    found = rank_campaign_explanations(boards, [("mass",), ("support",), ("mass", "support")])
    by_kind = {(one.way, one.effects): one for one in found if not one.board}
    one = by_kind["shared and own", ("mass", "support")]

    own = by_kind["own", ("support",)].log_evidence
    assert one.log_evidence == pytest.approx(by_kind["shared", ("mass",)].log_evidence + own)
    none = by_kind["none", ()]
    ratio = 0.5 * SHARING_PRIOR["shared and own"] / SHARING_PRIOR["none"] * np.exp(one.log_evidence - none.log_evidence)
    assert one.probability / none.probability == pytest.approx(ratio)
    assert sum(each.probability for each in found) == pytest.approx(1.0)
    assert (found[0].way == "shared and own") is (sizes[0] != sizes[1])
    assert found[0].effects == ("mass", "support")


def explanation(way, probability, *effects):
    return CampaignExplanation(way, () if way == "none" else effects or ("attached_mass",), "", 0.0, probability)


@pytest.mark.parametrize(
    ("found", "verdict", "effects"),
    [
        ([("shared", 0.9), ("none", 0.01), ("own", 0.09)], "named", ("attached_mass",)),
        ([("none", 0.9), ("shared", 0.1)], "none needed", ()),
        ([("shared", 0.5), ("own", 0.45), ("none", 0.04)], "indistinguishable group", ("attached_mass",)),
        ([("own", 0.9), ("shared", 0.08), ("none", 0.01)], "unexplained", ()),
        ([("shared and own", 0.5, "a", "b"), ("none", 0.01)], "unexplained", ()),
        ([("shared", 0.5, "a"), ("shared and own", 0.4, "a", "b"), ("none", 0.01)], "indistinguishable group", ("a",)),
        ([("shared", 0.9, "a", "b"), ("shared", 0.05, "a"), ("none", 0.01)], "named", ("a", "b")),
        ([("shared", 0.5, "a", "b"), ("shared", 0.4, "a"), ("none", 0.01)], "indistinguishable group", ("a", "b")),
    ],
)
def test_what_a_search_allows_to_say(found, verdict, effects):
    said = campaign_verdict([explanation(*one) for one in found])

    assert said[:2] == (verdict, effects)
    assert said[2]


def test_what_may_be_as_probable_as_something_that_is_not_shared_is_told():
    found = [explanation("own", 0.5, "b"), explanation("shared and own", 0.4, "a", "b"), explanation("none", 0.01)]

    assert campaign_verdict(found)[2] == (
        "the most probable is b of another size on each board, which the boards do not share; a alike on all boards "
        "beside b of another size on each comes within a factor 3 of it"
    )


def searching(folder, twice="", **planted):
    """A campaign that names nothing shared; one board may have its setup a second time."""
    path = write_campaign(folder, **planted)
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
    found = shareable_effects(campaign)

    single = {"transverse_shear", "attached_mass", "fluid_loading", "support_stiffness"}
    assert {each for each in found if len(each) == 1} == {(name,) for name in single}
    assert {frozenset(each) for each in found if len(each) == 2} == {frozenset(two) for two in combinations(single, 2)}
    for effects in found:
        assert _share_effects(campaign, effects).shared
    assert [one.name for one in _share_effects(campaign, ("fluid_loading",)).shared] == ["fluid_loading.baffle"]


def test_an_effect_that_each_setup_has_at_a_size_of_its_own_is_not_searched_for(tmp_path):
    assert shareable_effects(searching(tmp_path, twice="board-1")) == (("transverse_shear",),)


def test_sizes_that_the_cards_state_differently_are_not_compared_as_equal(tmp_path):
    """The search goes by each board's own prior: the same coordinate would be another shear modulus."""
    path = searching(tmp_path).card.path
    card = tmp_path / "board-1.toml"
    text = card.read_text()
    assert "shear_xz_gpa" in text
    line = next(one for one in text.splitlines() if one.startswith("shear_xz_gpa"))
    card.write_text(text.replace(line, "shear_xz_gpa = { mean = 0.3, sd = 0.05 }"))
    found = shareable_effects(bayesplate.Campaign.from_card(path))

    assert ("attached_mass",) in found
    assert not any("transverse_shear" in effects for effects in found)


SHEAR_AND_SENSOR = ("transverse_shear", "attached_mass")


PLANTED = [
    ((MASS, MASS), True, "shared", SHEAR_AND_SENSOR),
    ((MASS, MASS), False, "shared", ("attached_mass",)),
    ((0.3 * MASS, 4.0 * MASS), True, "shared and own", SHEAR_AND_SENSOR),
]
"""Sensors, whether shear is planted besides, and what is to be found."""


@pytest.fixture(
    scope="module", params=[PLANTED[0], *(pytest.param(one, marks=pytest.mark.slow) for one in PLANTED[1:])]
)
def found_on_boards(request, tmp_path_factory):
    """What is planted on boards, and their tables of shear and a sensor."""
    masses, has_shear, *_ = request.param
    campaign = searching(tmp_path_factory.mktemp("boards"), masses=masses, has_shear=has_shear)
    boards = [search_board(one.board.name, baseline_of(one.posed), SHEAR_AND_SENSOR) for one in campaign.problems]
    return request.param, boards


def test_shear_and_a_sensor_are_found_together(found_on_boards):
    """And the sensor alone where it is alone, though no board by itself would show one sensor beside shear."""
    (masses, _, way, expected), boards = found_on_boards
    effects = visible_effects(boards, [*((name,) for name in SHEAR_AND_SENSOR), SHEAR_AND_SENSOR])
    best = rank_campaign_explanations(boards, effects)[0]

    assert max(masses) > MASS or not any("attached_mass" in one.ground.paired for one in boards)
    assert (best.way, best.effects) == (way, expected)
    assert best.probability > 0.5


def test_the_cells_of_two_effects_are_those_of_each_and_make_up_the_evidence(found_on_boards):
    one = found_on_boards[1][0]
    cells = one.cells(SHEAR_AND_SENSOR)
    tables = [one.ground.candidates[name].coarse for name in SHEAR_AND_SENSOR]
    hypothesis = one.hypothesis(SHEAR_AND_SENSOR)
    seen = hypothesis.residual_under_labels(one.ground.baseline, one.ground.baseline.residual[None, :])

    assert len(cells) == tables[0].n_cells * tables[1].n_cells
    expected = hypothesis.terms.log_evidence(seen)[0] + hypothesis.log_labels
    assert one.log_evidence(SHEAR_AND_SENSOR) == pytest.approx(expected)
    for key, (log_prior, _) in cells.items():
        at = [np.isclose(table.z, z).all(axis=1) for table, z in zip(tables, (key[1:3], key[4:]), strict=True)]
        assert np.exp(log_prior) == pytest.approx(tables[0].weights[at[0]][0] * tables[1].weights[at[1]][0])


@pytest.mark.parametrize("order", [1, -1])
def test_the_cells_of_one_effect_beside_another_are_sums_over_those_of_both(found_on_boards, order):
    one = found_on_boards[1][0]
    shared, own = SHEAR_AND_SENSOR[::order]
    beside = one.cells_in_pair(shared, own)
    by_hand = {}
    for key, (log_prior, log_likelihood) in one.cells(SHEAR_AND_SENSOR).items():
        kept = key[:3] if shared == "transverse_shear" else key[3:]
        prior, joint = by_hand.get(kept, (0.0, 0.0))
        by_hand[kept] = prior + np.exp(log_prior), joint + np.exp(log_prior + log_likelihood)

    assert set(beside) == set(by_hand)
    for key, (log_prior, log_likelihood) in beside.items():
        prior, joint = by_hand[key]
        assert np.exp(log_prior) == pytest.approx(prior)
        assert np.exp(log_prior + log_likelihood) == pytest.approx(joint)


def test_a_pair_is_asked_for_where_the_boards_together_would_show_both():
    def seen(**traces):
        candidates = {name: SimpleNamespace(trace=trace) for name, trace in traces.items()}
        return SimpleNamespace(ground=SimpleNamespace(candidates=candidates))

    effects = [("mass",), ("shear",), ("mass", "shear")]
    assert visible_effects([seen(mass=1.5, shear=9.0)], effects) == (("mass",), ("shear",))
    assert visible_effects([seen(mass=1.5, shear=9.0)] * 2, effects) == tuple(effects)
