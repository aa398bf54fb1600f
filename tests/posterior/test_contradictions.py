"""What the readings contradict is told before anything is sampled: exit 4, the numbers, and no folder."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from runs import fit

from bayesplate.board.prior import StatedPrior, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.shelf import shelf_folder
from bayesplate.commands.prepare import prepare
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.posterior.posing import pose, require_possible_noise

BOARD = "fiemme-spruce-clamped"
ALMOST_EXACT = 1.000_01
"""Factor of a noise prior whose largest noise is its median to 0.006 %."""


@pytest.fixture(scope="module")
def board():
    return prepare(BOARD).board


@pytest.fixture(scope="module")
def problem(board):
    return pose(board, load_prior("weakly-informative"))


def prior_with(name: str, lower: float, upper: float):
    """The default prior with one constant between two limits."""
    prior = load_prior("weakly-informative")
    return prior.model_copy(update={name: StatedPrior(Quantity.from_range(lower, upper), "")})


def with_noise(board, median: float, factor: float):
    setups = tuple(replace(setup, noise=Quantity.from_median(median, factor), resolution=0.0) for setup in board.setups)
    return replace(board, setups=setups)


@pytest.mark.parametrize(("errors_away", "is_refused"), [(4.0, False), (20.0, True)])
def test_a_prior_is_refused_where_none_of_a_thousand_draws_reaches_it(board, problem, errors_away, is_refused):
    """Draws three standard errors wide: they reach an edge 4 away (one in ten is beyond it), none one of 20 away."""
    estimate, error = problem.centre[0], np.sqrt(problem.covariance[0, 0])
    thickness, nu = (float(board.nominal()[name]) for name in ("thickness", "poisson_xy"))
    ratio = float(np.exp(problem.centre[1] - problem.centre[0]))
    modulus = 12.0 * np.exp(estimate) * (1.0 - nu**2 * ratio) / thickness**3
    lower = modulus * np.exp(errors_away * error)
    prior = prior_with("E_x", lower, 2.0 * lower)

    if not is_refused:
        assert pose(board, prior).prior is prior
        return
    with pytest.raises(NotIdentifiableError, match="0 of 1000 draws around the least-squares estimate") as caught:
        pose(board, prior)
    assert f"E_x is about {modulus / 1e9:.3g} GPa, the prior wants {lower / 1e9:g} to" in str(caught.value)
    assert caught.value.exit_code == 4


@pytest.mark.parametrize(("share", "is_refused"), [(0.98, True), (1.02, False)])
def test_a_noise_is_refused_a_hundredth_of_the_residuals(board, share, is_refused):
    """Of six modes less three constants: sigma^2 = SSR / (3 x 10^4), in the paper's residuals without rounding."""
    residuals = weighted_least_squares(with_noise(board, 0.01, 2.0)).residuals
    limit = float(np.sqrt(np.sum(residuals**2) / 3.0)) / 100.0
    declared = with_noise(board, share * limit, ALMOST_EXACT)

    if not is_refused:
        assert pose(declared, load_prior("weakly-informative")).board is declared
        return
    with pytest.raises(NotIdentifiableError, match=r"contradicts the data: chi\^2 / dof = 1e\+04 at") as no:
        pose(declared, load_prior("weakly-informative"))
    assert f"at a noise of {100.0 * share * limit:.2g} %" in str(no.value)


def test_a_small_noise_that_may_grow_or_coarse_rounding_explain_the_residuals(board, problem):
    """Six standard deviations of the logarithm reach from 1e-6 to the residuals; coarse rounding hides them."""
    residuals = weighted_least_squares(with_noise(board, 0.01, 2.0)).residuals
    limit = float(np.sqrt(np.sum(residuals**2) / 3.0)) / 100.0
    reach = (limit / 1e-6) ** (1.0 / 6.0)

    def require(declared):
        require_possible_noise(replace(problem.posterior, board=declared), problem.centre)

    require(with_noise(board, 1e-6, reach * 1.05))
    with pytest.raises(NotIdentifiableError, match="declared noise"):
        require(with_noise(board, 1e-6, reach * 0.95))
    tiny = with_noise(board, 1e-6, ALMOST_EXACT)
    require(replace(tiny, setups=tuple(replace(setup, resolution=50.0) for setup in tiny.setups)))
    with pytest.raises(NotIdentifiableError, match="declared noise"):
        require(tiny)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[material]\n", '[material]\nprior = "./mine.toml"\n', "0 of 1000 draws around the least-squares estimate"),
        ("resolution_hz = 1\n", "noise_percent = { median = 0.0001, factor = 1.1 }\n", "chi^2 / dof ="),
    ],
    ids=["prior", "noise"],
)  # fmt: skip
def test_the_command_ends_with_exit_4_before_sampling(tmp_path, old, new, said, monkeypatch):
    """And leaves no folder."""
    monkeypatch.setattr("bayesplate.commands.fitting.infer", lambda *_, **__: pytest.fail("sampled"))
    text = (shelf_folder("boards") / f"{BOARD}.toml").read_text(encoding="utf-8")
    assert text.count(old) == 1
    flat = '[{}]\ndistribution = "log-uniform"\nlower_gpa = {}\nupper_gpa = {}\nsource = "-"\n'
    bounds = {"E_x": (100, 200), "E_y": (0.1, 2), "G_xy": (0.1, 2)}
    prior = 'format = 1\nname = "mine"\n' + "".join(flat.format(name, *limits) for name, limits in bounds.items())
    (tmp_path / "mine.toml").write_text(prior, encoding="utf-8")
    (tmp_path / f"{BOARD}.toml").write_text(text.replace(old, new), encoding="utf-8")

    run = fit(tmp_path / "out", str(tmp_path / f"{BOARD}.toml"))

    assert (run.exit_code, run.stdout, run.files) == (4, "", {})
    assert said in run.stderr
    assert not run.folder.exists()
