"""Cards of isotropic boards, and the priors that they take."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_isotropic import sheet

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.campaign.population import require_moduli
from bayesplate.errors import InputError

HZ = {(2, 0): 144.5, (1, 1): 159.8, (2, 1): 358.1}
OF_E = 'format = 1\nname = "metals"\n[E]\ndistribution = "log-normal"\nmedian_gpa = 70\nfactor = 2\nsource = "a test"\n'


def card(**more):
    return sheet(HZ, **more).to_toml()


def test_anything_but_true_or_false_is_refused():
    for written in ['"yes"', "1", "[]"]:
        with pytest.raises(InputError, match=r"sheet.toml \[material\] isotropic: wanted true or false, got"):
            Board.from_text(card().replace("isotropic = true", f"isotropic = {written}"), "sheet")


@pytest.mark.parametrize(("nu", "is_possible"), [(0.5, True), (0.51, False), (-0.99, True), (-1.0, False)])
def test_a_poisson_ratio_is_one_of_an_isotropic_solid(nu, is_possible):
    """Outside -1 < nu <= 1/2 its bulk or shear modulus would be negative; wood has larger ones."""
    board = sheet(HZ, poisson_xy=nu)
    assert bayesplate.Problem.from_card(sheet(HZ, poisson_xy=0.51, isotropic=False)).board is not None
    if is_possible:
        assert bayesplate.Problem.from_card(board).board.isotropic
        return
    with pytest.raises(InputError, match=r"poisson_xy: wanted more than -1 and at most 0.5 where isotropic = true"):
        bayesplate.Problem.from_card(board)


def test_the_shipped_prior_reaches_from_foam_to_ceramics():
    """Proper, and 0.005 to 500 GPa lie within its middle 95 %."""
    density = load_prior("weakly-informative").for_board(True).constants["E_x"]
    low, high = (float(density.quantile(share)) for share in (0.025, 0.975))

    assert low < 0.005e9
    assert high > 500e9
    assert low > 0.004e9
    assert high < 600e9


def test_a_prior_of_wood_is_refused_with_what_would_do():
    with pytest.raises(InputError, match=r"prior: wanted a prior of E, because isotropic = true, got spruce") as told:
        bayesplate.Problem.from_card(sheet(HZ, prior="spruce"))
    assert "a card of your own with [E]" in str(told.value)


def prior_of(folder: Path, text: str, name: str) -> PriorCard:
    """The prior of a card in a folder."""
    path = folder / f"{name}.toml"
    path.write_text(text)
    return load_prior(path)


def test_a_prior_of_one_modulus_serves_isotropic_boards_alone(tmp_path):
    prior = prior_of(tmp_path, OF_E, "metals")

    assert list(bayesplate.Problem.from_card(sheet(HZ), prior=prior).prior.constants) == ["E_x"]
    with pytest.raises(InputError, match="wanted a prior of three constants, got metals, which states E alone"):
        bayesplate.Problem.from_card(sheet(HZ, isotropic=False), prior=prior)
    with pytest.raises(InputError, match="wanted a prior card of E_x, E_y, G_xy, got metals, which states E alone"):
        require_moduli(prior, "[population] prior")


def test_a_prior_of_one_modulus_comes_back_from_its_card(tmp_path):
    made = bayesplate.PriorCard.from_quantities("metals", {"E": Quantity.from_median(70e9, 2.0)}, source="a test")

    assert made == prior_of(tmp_path, OF_E, "metals")
    assert prior_of(tmp_path, made.to_toml(), "metals") == made
    whole = load_prior("weakly-informative")
    assert prior_of(tmp_path, whole.to_toml(), whole.name) == whole


def test_the_prior_that_a_problem_has_may_be_given_again():
    problem = bayesplate.Problem.from_card(sheet(HZ))
    again = bayesplate.Problem.from_card(sheet(HZ), prior=problem.prior)

    assert again.prior == problem.prior


def test_a_population_of_three_constants_takes_no_isotropic_board(tmp_path):
    for i in (1, 2):
        text = sheet({label: hz * (1.0 + 0.001 * i) for label, hz in HZ.items()}).to_toml()
        (tmp_path / f"board-{i}.toml").write_text(text.replace('"sheet"', f'"board-{i}"'))
    path = tmp_path / "together.toml"
    head = 'format = 1\nname = "together"\nboards = ["./board-1.toml", "./board-2.toml"]\n'
    path.write_text(head + '[population]\nprior = "spruce"\n')

    with pytest.raises(InputError, match="wanted boards of three constants, got board-1, board-2, whose E_y and G_xy"):
        bayesplate.Campaign.from_card(path)
    path.write_text(head)
    assert len(bayesplate.Campaign.from_card(path).problems) == 2
