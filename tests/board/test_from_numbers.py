"""Boards, setups and priors from numbers: what is taken where nothing is said, and what is refused."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from stated import assert_said

import bayesplate
from bayesplate.board.prior import load_prior
from bayesplate.board.setup import CLAMPED_NOISE, DEFAULT_NOISE
from bayesplate.commands.prepare import prepare

Q = bayesplate.Quantity
CLAMPED = {"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"}
FREQUENCIES = {"(1,1)": 134.0, (2, 0): [241, 242], (0, 2): np.array([312.0, 311.0]), "(2,1)": Q.from_mean(363, 1.0)}
CONSTANTS = {"E_x": Q.from_median(12e9, 1.3), "E_y": Q.from_range(0.4e9, 2e9), "G_xy": Q.from_median(0.7e9, 1.4)}


def setup(**changed):
    """A free board's readings."""
    return bayesplate.Setup.from_frequencies(
        FREQUENCIES, **{"name": "free", "edges": "free", "resolution": 1} | changed
    )


def board(**changed):
    """A sound board."""
    sizes = {"length_x": 0.253, "length_y": [0.114, 0.1142], "thickness": Q.from_mean(0.003, 0.00005), "mass": 0.041}
    return bayesplate.Board.from_numbers("my-board", **sizes | {"prior": "spruce", "setups": setup()} | changed)


def prior(constants=CONSTANTS, **more):
    """A prior from quantities."""
    return bayesplate.PriorCard.from_quantities("mine", constants, **{"source": "my shop"} | more)


def test_what_is_not_said_is_what_a_card_assumes():
    one, silent = board(prior="weakly-informative"), bayesplate.Setup.from_frequencies({"(1,1)": 134}, edges="free")
    ratio = one.parameter("poisson_xy")

    assert (ratio.prior, ratio.is_assumed) == (Q.from_mean(0.4, 0.08, "normal"), True)
    assert bayesplate.Board.from_text(one.to_toml(), "my-board").parameter("poisson_xy") == ratio
    assert (one.title, one.effects) == ("", ())
    assert (silent.name, silent.first_label, silent.missed, silent.spurious) == ("setup", (0, 0), 0.2, 0.02)
    assert {(one.sign, one.confidence) for one in silent.readings} == {("", 1.0)}
    assert silent.noise == DEFAULT_NOISE
    assert setup(edges=CLAMPED).noise == CLAMPED_NOISE
    assert board().inputs["poisson_xy"] == load_prior("spruce").poisson_xy
    assert setup(first_label=(0, 0)).readings[1].beams == (2, 0)
    with pytest.raises(FrozenInstanceError):
        one.name = "other"


def test_what_nobody_stated_is_that_of_the_prior_which_is_given_in_the_end():
    noise, ratio = Q.from_median(0.02, 1.3), Q.from_mean(0.3, 0.01, "normal")
    mine = prior(noise=noise, poisson_xy=ratio)
    fewer = replace(board(), setups=tuple(replace(one, readings=one.readings[:3]) for one in board().setups))
    for one in (board(), fewer, board(prior=mine), prepare("spruce-free-2R").card):
        text = one.to_toml()
        assert not any(key in text for key in ("noise_percent", "poisson_xy"))
        found = prepare(one, prior=mine).board
        assert (found.inputs["poisson_xy"], found.setups[0].noise.median) == (ratio, pytest.approx(0.02))
    assert board(prior=mine).setups[0].noise.median == pytest.approx(0.02)
    usual = {"setups": setup(noise=DEFAULT_NOISE), "poisson_xy": Q.from_mean(0.4, 0.08, "normal")}
    (same,) = (replace(one, noise=DEFAULT_NOISE) for one in board().setups)
    for one in (
        board(**usual),
        board(prior=mine, **usual),
        replace(board(), setups=(same,)).with_priors({"poisson_xy": usual["poisson_xy"]}),
    ):
        found = prepare(one, prior=mine).board
        assert found.inputs["poisson_xy"] == usual["poisson_xy"]
        assert found.setups[0].noise.median == pytest.approx(0.003)


def test_the_prior_of_a_board_is_named_by_a_path_too(tmp_path):
    path = tmp_path / "mine.toml"
    prior(noise=Q.from_median(0.02, 1.3)).to_toml(path)
    for made in (board(prior=path), board(prior=str(path))):
        found = prepare(made)
        assert (found.prior.name, found.board.setups[0].noise.median) == ("mine", pytest.approx(0.02))


def test_another_prior_of_a_board_reaches_its_card(tmp_path):
    one = board(setups=setup(edges=CLAMPED, clamped={"x0": 0.03}))
    other = one.with_priors({"mass": 0.040, "clamped_x0[free]": Q.exact(0.035)})
    text = other.to_toml(tmp_path / "my-board.toml")
    found = prepare(tmp_path / "my-board.toml").board

    assert (tmp_path / "my-board.toml").read_text(encoding="utf-8") == text
    assert found.inputs["mass"] == Q.exact(0.040)
    assert found.inputs["thickness"] == prepare(one).board.inputs["thickness"]
    assert found.inputs["clamped_x0[free]"] == other.setups[0].clamped["x0"] == Q.exact(0.035)
    assert one.setups[0].clamped["x0"] == Q.exact(0.03)


def test_a_number_is_exact_wherever_a_quantity_is_meant():
    assert bayesplate.AttachedItem("weight", ((0.2, 0.1),), 0.001).mass == Q.exact(0.001)
    assert bayesplate.DeclaredFluid(1.2).density == Q.exact(1.2)
    assert replace(board().setups[0].readings[0], frequency=135.0).frequency == Q.exact(135.0)
    assert replace(setup(), clamped={"x0": 0.001}).clamped == {"x0": Q.exact(0.001)}
    one = bayesplate.Reading.of("(1,0)", 52, "+", first_label=(1, 0))
    assert (one.label, one.beams, one.sign, one.frequency) == (bayesplate.Label(1, 0), (0, 0), "+", Q.exact(52.0))


BAD = [
    (lambda: board(thickness="3 mm", mass=[0.041, np.nan], warp={"cub": 1e-3}),
     "my-board thickness: wanted a number, an array of readings or a Quantity, SI, got '3 mm'",
     "my-board mass: wanted finite numbers, SI, got [0.041, nan]",
     "my-board warp: wanted one of cup, bow, twist, got cub (did you mean cup?)"),
    (lambda: bayesplate.Setup.from_frequencies({"1,1": 134, (2, 0): "x"}, edges={"x0": "free"}, clamped={"z0": 0.03}),
     "setup edges: wanted a word for each of x0, x1, y0, y1, got x0",
     'setup mode label: wanted two whole numbers from 0 to 11, written like "(1,0)", got "1,1"',
     "setup frequency of (2,0): wanted a number, an array of readings or a Quantity, in Hz, got…",
     "setup clamped: wanted one of x0, x1, y0, y1, got z0"),
    (lambda: bayesplate.Setup.from_frequencies({"(1,1)": 134, (1, 1): 135}, edges="free"),
     "setup frequencies: wanted the label (1,1) once, got (1, 1) again"),
    (lambda: setup(signs={(3, 3): "+"}), "free signs: wanted a label among the frequencies, got (3,3)"),
    (lambda: setup(edges={1: "free"}, signs={"1;1": "+"}),
     "free edges: wanted a word for each of x0, x1, y0, y1, got 1",
     'free signs mode label: wanted two whole numbers from 0 to 11, written like "(1,0)", got "1;1"'),
    (lambda: bayesplate.check(board(mass=None)),
     "my-board.toml [plate]: wanted exactly one of mass_g and density_kg_m3, got neither"),
    (lambda: bayesplate.check(board(setups=replace(setup(), ends_x=("fixed", "free")))),
     'my-board.toml [setup] edges.x0: wanted "clamped", "supported" or "free", got "fixed"'),
    (lambda: setup(edges="fixed"), 'free edges: wanted "clamped", "supported" or "free", for all…, got "fixed"'),
    (lambda: setup(edges={"x0": "held", "x1": 3, "y0": "free", "y1": "free"}),
     'free edges: wanted "clamped", "supported" or "free", for all edges or for each…, got "held", 3'),
    (lambda: bayesplate.check(board(warp={"twist": -1e-3})),
     "my-board.toml [plate] warp_mm.twist: wanted a number from 0 to 1000 mm, got -1.0 (…)"),
    (lambda: bayesplate.check(board(mass=41.0)),
     "my-board.toml [plate] mass_g: wanted a density from 20 to 25000 kg/m3, …"),
    (lambda: setup(noise=0.005, resolution="1 Hz"),
     "free noise: wanted a relative noise and how far it may be off: Quantity.from_median(…",
     "free resolution: wanted a number, in Hz, got '1 Hz'"),
    (lambda: setup(unlabelled=[448.8, "594 Hz", np.nan]),
     "free unlabelled 2: wanted a number, an array of readings or a Quantity, in Hz, or a Peak, got '594 Hz'",
     "free unlabelled 3: wanted finite numbers, in Hz, or a Peak, got nan"),
    (lambda: bayesplate.Peak(np.nan), "frequency of a peak: wanted finite numbers, in Hz, got nan"),
    (lambda: bayesplate.AttachedItem("weight", (0.2, 0.1), 0.001),
     "weight places: wanted ((x, y), ...) in m, got (0.2, 0.1)"),
    (lambda: setup(name=1, edges=None, noise=None, first_label=1, clamped=[0.03], signs="+",
              unlabelled=448.8, attached="weight", hammer=0.1, fluid=1.2),
     "1 name: wanted a text, got 1", "1 edges: wanted a word, or a dict of…, got None",
     "1 first_label: wanted a pair of whole numbers, got 1",
     "1 clamped: wanted a dict of lengths by edge, got [0.03]", "1 signs: wanted a dict of…",
     "1 unlabelled: wanted a list of peaks, got 448.8", "1 attached: wanted a list of Attach…",
     "1 hammer: wanted a place (x, y) in m, got 0.1", "1 fluid: wanted a DeclaredFluid, got 1.2"),
    (lambda: bayesplate.Setup.from_frequencies([134], edges="free"),
     "setup frequencies: wanted a dict of frequencies by label, got [134]"),
    (lambda: board(setups=None, length_x=None, prior=3, effects="warp", title=None, warp=1e-3),
     "my-board setups: wanted a Setup or a list of them, got None",
     "my-board prior: wanted a name, a path or a PriorCard, got 3",
     "my-board effects: wanted a list of names of effects, got 'warp'", "my-board title: wanted a text, got None",
     "my-board warp: wanted a dict of heights by cup, bow and twist, got 0.001",
     "my-board length_x: wanted a number, an array of readings or a Quantity, SI, got None"),
    (lambda: board().with_priors({"masss": 0.04, "mass": "40 g"}),
     "priors: wanted one of length_x, length_y, thickness, mass, poisson_xy, got masss (did you mean mass?)",
     "priors mass: wanted a number, an array of readings or a Quantity, SI, got '40 g'"),
    (lambda: board().with_priors([0.04]), "my-board priors: wanted a dict of quantities by name, got [0.04]"),
    (lambda: board().setup("fre"), "setup: wanted one of free, got fre (did you mean free?)"),
    (lambda: board().parameter("nu"), "parameter: wanted one of length_x, length_y, thickness, mass, …"),
    (lambda: board(prior="spruse"), '"spruse": wanted the name of…(did you mean spruce?)'),
    (lambda: prior({"E_x": CONSTANTS["E_x"]}),
     "mine.toml: wanted all of E_x, E_y, G_xy or all of D_x, D_y, D_s, got E_x"),
    (lambda: prior(CONSTANTS | {"E_z": CONSTANTS["E_x"]}),
     "mine E_z: wanted one of E_x, E_y, G_xy, D_x, D_y, D_s, E, got an unknown name"),
    (lambda: prior(CONSTANTS | {"E_x": Q.exact(1e10)}),
     "mine E_x: wanted Quantity.from_median or Quantity.from_range, …, got another kind of…"),
    (lambda: prior(CONSTANTS | {"E_x": Q.from_mean(1e10, 1e9, "normal")}), "mine E_x: wanted Quantity.from_median or…"),
    (lambda: prior(CONSTANTS | {"E_x": Q.from_median(12.0, 1.3)}), "mine.toml [E_x] median_gpa: wanted a number from…"),
    (lambda: prior(CONSTANTS | {"E_x": 12e9}), "mine E_x: wanted Quantity.from_median or …, got 12000000000.0"),
    (lambda: prior(noise=Q.from_range(0.001, 0.01)), "mine noise: wanted Quantity.from_median, …"),
    (lambda: prior(density=Q.exact(430.0)), "mine density: wanted Quantity.from_mean(430, 60), …"),
    (lambda: prior(density=Q.from_mean(430, 60, lower=300.0)),
     "mine density: wanted Quantity.from_mean(430, 60), without bounds, got another kind of…"),
    (lambda: prior(poisson_xy=Q.from_mean(0.4, 0.1, "normal", 0.0)), "mine poisson_xy: wanted …"),
    (lambda: prior(poisson_xy=Q.exact(0.4)),
     'mine poisson_xy: wanted Quantity.from_mean(0.4, 0.08, "normal"), without bounds, got another…'),
    (lambda: prior(poisson_xy=0.4, noise=0.01), "mine noise: wanted …, got 0.01", "mine poisson_xy: wanted …, got 0.4"),
    (lambda: prior(None, source=None, title=1),
     "mine title: wanted a text, got 1", "mine constants: wanted a dict of quantities by name, …",
     "mine source: wanted a text, or a dict of texts by name, got None"),
    (lambda: prior(source=" "), "mine source: wanted where the numbers come from, got an empty text"),
    (lambda: prior(source={"E_x": "a", "E_y": "", "Gxy": "b"}),
     "mine source Gxy: wanted one of E_x, …(did you mean G_xy?)",
     "mine source E_y: wanted where the numbers come from, got ''",
     "mine source G_xy: wanted where the numbers come from, got None"),
]  # fmt: skip


def test_what_cannot_be_used_is_refused_with_all_faults():
    for make, *said in BAD:
        with pytest.raises(bayesplate.InputError) as refused:
            make()
        assert_said(str(refused.value).splitlines(), said)
