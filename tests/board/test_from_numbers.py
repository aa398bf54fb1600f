"""Boards, setups, readings and priors from numbers: what they hold, how they are varied, and the cards they become."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bayesplate
from bayesplate.board.prior import load_prior
from bayesplate.board.setup import CLAMPED_NOISE, DEFAULT_NOISE
from bayesplate.commands.prepare import prepare

Q = bayesplate.Quantity
FREQUENCIES = {"(1,1)": 134.0, (2, 0): [241, 242], (0, 2): np.array([312.0, 311.0]), "(2,1)": Q.from_mean(363, 1.0)}

CARD = """\
format = 1
name = "my-board"
title = "Half a top"

[plate]
length_x_mm = 253
length_y_mm = [114, 114.2]
thickness_mm = { mean = 3.0, sd = 0.05 }
mass_g = 41

[material]
prior = "spruce"

[setup]
name = "free"
resolution_hz = 1
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
unlabelled_hz = [448.8]

[setup.frequencies_hz]
"(1,1)" = 134
"(2,0)" = [241, 242]
"(0,2)" = [312, 311]
"(2,1)" = { mean = 363, sd = 1 }

[setup.signs]
"(2,0)" = "-"

[[setup.attached]]
kind = "accelerometer"
at_mm = [200, 20]
"""


def setup(**changed):
    """The setup of the card."""
    options = {
        "name": "free", "edges": "free", "resolution": 1, "signs": {(2, 0): "-"}, "unlabelled": [448.8],
        "attached": [bayesplate.AttachedItem("accelerometer", ((0.2, 0.02),))],
    }  # fmt: skip
    return bayesplate.Setup.from_frequencies(FREQUENCIES, **options | changed)


def board(**changed):
    """The board of the card."""
    options = {
        "length_x": 0.253, "length_y": [0.114, 0.1142], "thickness": Q.from_mean(0.003, 0.00005), "mass": 0.041,
        "prior": "spruce", "title": "Half a top", "setups": setup(),
    }  # fmt: skip
    return bayesplate.Board.from_numbers("my-board", **options | changed)


def test_a_board_from_numbers_is_that_of_the_card_with_the_same_numbers(tmp_path):
    """Exactly: readings, inputs, noise, the prior's Poisson ratio; what the card left unsaid stays unsaid."""
    path = tmp_path / "my-board.toml"
    path.write_text(CARD, encoding="utf-8")
    made, read = prepare(board()).board, prepare(path).board

    assert made.setups == read.setups
    assert [(one.name, one.prior) for one in made.parameters] == [(one.name, one.prior) for one in read.parameters]
    assert (made.prior, made.title, made.effects) == (read.prior, read.title, read.effects)


def test_numbers_are_exact_arrays_are_readings_and_quantities_stay():
    one = board()

    assert one.inputs["length_x"] == Q.exact(0.253)
    assert one.inputs["length_y"].readings == (0.114, 0.1142)
    assert one.inputs["thickness"] == Q.from_mean(0.003, 0.00005)
    by_label = {str(reading.label): reading.frequency for reading in one.setups[0].readings}
    assert by_label["(1,1)"].is_exact
    assert by_label["(0,2)"].readings == (312.0, 311.0)
    assert by_label["(2,1)"] == Q.from_mean(363, 1.0)
    assert one.setups[0].readings[1].sign == "-"


def test_what_is_not_said_is_what_a_card_assumes():
    assert board().inputs["poisson_xy"] == load_prior("spruce").poisson_xy
    assert board(prior="weakly-informative").inputs["poisson_xy"] == Q.from_mean(0.4, 0.08, "normal")
    edges = {"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"}
    assert setup().noise == DEFAULT_NOISE
    assert setup(edges=edges).noise == CLAMPED_NOISE
    noisy = prior(noise=Q.from_median(0.01, 1.5))
    assert board(prior=noisy).setups[0].noise.median == pytest.approx(0.01)
    own = Q.from_median(0.002, 1.2)
    assert board(prior=noisy, setups=setup(noise=own)).setups[0].noise == own


def test_what_nobody_stated_is_that_of_the_prior_which_is_given_in_the_end():
    noise, ratio = Q.from_median(0.02, 1.3), Q.from_mean(0.3, 0.01, "normal")
    mine = prior(noise=noise, poisson_xy=ratio)
    fewer = replace(board(), setups=tuple(replace(one, readings=one.readings[:3]) for one in board().setups))
    for one in (board(), fewer, board(prior=mine), prepare("spruce-free-2R").card):
        text = one.to_toml()
        assert not any(key in text for key in ("noise_percent", "poisson_xy"))
        found = prepare(one, prior=mine).board
        assert (found.inputs["poisson_xy"], found.setups[0].noise.median) == (ratio, pytest.approx(0.02))
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


def test_peaks_are_numbers_readings_quantities_or_peaks():
    vague = bayesplate.Peak(Q.from_mean(671.2, 0.3), "-", amplitude=0.4, damping=0.005)
    one = setup(unlabelled=[448.8, [594.0, 595.0], Q.from_mean(640.0, 1.0), vague, bayesplate.Peak(707)])
    read = Q.from_readings([594, 595], 1.0)  # rounded as the setup says
    numbers = (Q.exact(448.8), read, Q.from_mean(640.0, 1.0), vague.frequency, Q.exact(707))

    assert tuple(peak.frequency for peak in one.peaks) == numbers
    assert one.peaks[3] == vague
    assert one.unlabelled == (448.8, 594.5, 640.0, 671.2, 707.0)
    assert [peak.is_bare for peak in one.peaks] == [True, True, True, False, True]


def test_labels_count_from_the_first_one():
    one = bayesplate.Reading.of("(1,0)", 52, "+", first_label=(1, 0))

    assert (one.label, one.beams, one.sign) == (bayesplate.Label(1, 0), (0, 0), "+")
    assert setup(first_label=(0, 0)).readings[1].beams == (2, 0)


def test_a_board_is_varied_by_replace_and_written_as_a_card(tmp_path):
    one = board()
    lighter = one.with_priors({"mass": Q.exact(0.040)})
    quieter = replace(one, setups=tuple(replace(held, noise=Q.from_median(0.001, 1.2)) for held in one.setups))
    path = tmp_path / "my-board.toml"
    text = lighter.to_toml(path)

    assert path.read_text(encoding="utf-8") == text
    assert prepare(path).board.inputs["mass"] == Q.exact(0.040)
    assert prepare(path).board.inputs["thickness"] == prepare(one).board.inputs["thickness"]
    assert "noise_percent = { median = 0.1, factor = 1.2 }" in quieter.to_toml()


def test_another_length_of_a_clamp_reaches_the_card():
    one = board(setups=setup(edges={"x0": "clamped", "x1": "free", "y0": "free", "y1": "free"}, clamped={"x0": 0.03}))
    other = one.with_priors({"clamped_x0[free]": Q.exact(0.035)})

    assert prepare(other).board.inputs["clamped_x0[free]"] == other.setups[0].clamped["x0"] == Q.exact(0.035)
    assert one.setups[0].clamped["x0"] == Q.exact(0.03)


def test_a_number_is_exact_wherever_a_quantity_is_meant():
    exact = Q.exact(0.001)
    reading = board().setups[0].readings[0]

    assert board().with_priors({"mass": 0.04}).inputs["mass"] == Q.exact(0.04)
    assert bayesplate.AttachedItem("weight", ((0.2, 0.1),), 0.001).mass == exact
    assert bayesplate.DeclaredFluid(1.2).density == Q.exact(1.2)
    assert replace(reading, frequency=135.0).frequency == Q.exact(135.0)
    assert replace(setup(), clamped={"x0": 0.001}).clamped == {"x0": exact}
    with pytest.raises(bayesplate.InputError, match="free noise: wanted a relative noise"):
        board(setups=replace(setup(), noise=0.01)).to_toml()


def test_the_prior_of_a_board_is_named_by_a_path_too(tmp_path):
    path = tmp_path / "mine.toml"
    prior(noise=Q.from_median(0.02, 1.3)).to_toml(path)
    for made in (board(prior=path), board(prior=str(path))):
        found = prepare(made)
        assert (found.prior.name, found.board.setups[0].noise.median) == ("mine", pytest.approx(0.02))


PLACES = [
    ("my-board.toml", False, r"wanted a new file, got one that exists \(force=True replaces it\)"),
    ("other.toml", True, "wanted my-board.toml, the name of the card, got other.toml"),
    ("nowhere/my-board.toml", True, "wanted a place for the card, got No such file"),
]


def test_a_card_is_not_written_over_another_one(tmp_path):
    for place, force, said in PLACES:
        (tmp_path / "my-board.toml").write_text("mine", encoding="utf-8")
        with pytest.raises(bayesplate.InputError, match=said):
            board().to_toml(tmp_path / place, force=force)
        assert [path.read_text(encoding="utf-8") for path in tmp_path.iterdir()] == ["mine"]
        board().to_toml(tmp_path / "my-board.toml", force=True)
        assert (tmp_path / "my-board.toml").read_text(encoding="utf-8") == board().to_toml()


BAD = {
    "no number": (lambda: board(thickness="3 mm", mass=[0.041, np.nan]),
                  ["my-board thickness: wanted a number, an array of readings or a Quantity, SI, got",
                   "my-board mass: wanted finite numbers, SI, got"]),
    "labels and edges": (lambda: bayesplate.Setup.from_frequencies({"1,1": 134, (2, 0): "x"}, edges={"x0": "free"},
                                                                   clamped={"z0": 0.03}),
                         ["setup edges: wanted a word for each of x0, x1, y0, y1, got x0",
                          'setup mode label: wanted two whole numbers from 0 to 11, written like "(1,0)", got "1,1"',
                          "setup frequency of (2,0): wanted a number, an array of readings or a Quantity, in Hz",
                          "setup clamped: wanted one of x0, x1, y0, y1, got z0"]),
    "a label twice": (lambda: bayesplate.Setup.from_frequencies({"(1,1)": 134, (1, 1): 135}, edges="free"),
                      ["setup frequencies: wanted the label (1,1) once, got (1, 1) again"]),
    "a sign without a frequency": (lambda: setup(signs={(3, 3): "+"}),
                                   ["free signs: wanted a label among the frequencies, got (3,3)"]),
    "what a card would refuse": (lambda: bayesplate.check(board(mass=None, setups=setup(edges="fixed"))),
                                 ["my-board.toml [plate]: wanted exactly one of mass_g and density_kg_m3, got neither",
                                  'my-board.toml [setup] edges.x0: wanted "clamped", "supported" or "free", got',
                                  'my-board.toml [setup] edges.y1: wanted "clamped"']),
    "noise and resolution": (lambda: setup(noise=0.005, resolution="1 Hz"),
                             ["free noise: wanted a relative noise and how far it may be off: Quantity.from_median(",
                              "free resolution: wanted a number, in Hz, got '1 Hz'"]),
    "peaks": (lambda: setup(unlabelled=[448.8, "594 Hz", np.nan]),
              ["free unlabelled 2: wanted a number, an array of readings or a Quantity, in Hz, or a Peak, got '594 Hz'",
               "free unlabelled 3: wanted finite numbers, in Hz, or a Peak, got nan"]),
    "a peak": (lambda: bayesplate.Peak(np.nan), ["frequency of a peak: wanted finite numbers, in Hz, got nan"]),
    "types of a setup": (lambda: setup(name=1, edges=None, noise=None, first_label=1, clamped=[0.03], signs="+",
                                       unlabelled=448.8, attached="weight", hammer=0.1, fluid=1.2),
                         ["1 name: wanted a text, got 1", "1 edges: wanted a word", "1 first_label: wanted a pair",
                          "1 clamped: wanted a dict of lengths by edge, got [0.03]", "1 signs: wanted a dict",
                          "1 unlabelled: wanted a list of peaks, got 448.8", "1 attached: wanted a list of Attach",
                          "1 hammer: wanted a place (x, y) in m, got 0.1", "1 fluid: wanted a DeclaredFluid, got 1.2"]),
    "frequencies in a list": (lambda: bayesplate.Setup.from_frequencies([134], edges="free"),
                              ["setup frequencies: wanted a dict of frequencies by label, got [134]"]),
    "types of a board": (lambda: board(setups=None, length_x=None, prior=3, effects="transverse_shear", title=None),
                         ["my-board setups: wanted a Setup or a list of them, got None",
                          "my-board length_x: wanted a number", "my-board prior: wanted a name, a path or a PriorCard",
                          "my-board effects: wanted a list of names of effects, got 'transverse_shear'",
                          "my-board title: wanted a text, got None"]),
    "a place": (lambda: bayesplate.AttachedItem("weight", (0.2, 0.1), 0.001), ["weight places: wanted ((x, y), ...)"]),
    "priors": (lambda: board().with_priors({"masss": 0.04, "mass": "40 g"}),
               ["priors: wanted one of length_x, length_y, thickness, mass, poisson_xy, got masss (did you mean mass?)",
                "priors mass: wanted a number, an array of readings or a Quantity, SI, got '40 g'"]),
    "priors in a list": (lambda: board().with_priors([0.04]), ["my-board priors: wanted a dict of quantities by name"]),
    "a setup": (lambda: board().setup("fre"), ["setup: wanted one of free, got fre (did you mean free?)"]),
    "a parameter": (lambda: board().parameter("nu"), ["parameter: wanted one of length_x, length_y, thickness, mass"]),
    "a bounded peak": (lambda: board(setups=setup(unlabelled=[Q.from_range(440.0, 450.0)])).to_toml(),
                       ["free peak 1: wanted a log-normal quantity without bounds, as cards state it, got"]),
    "exact noise": (lambda: board(setups=replace(setup(), noise=Q.exact(0.005))).to_toml(),
                    ["free noise: wanted a relative noise", "got an exact number"]),
    "physics": (lambda: bayesplate.check(board(mass=41.0)),
                ["my-board.toml [plate] mass_g: wanted a density from 20 to 25000 kg/m3"]),
    "an unknown prior": (lambda: board(prior="spruse"), ["did you mean spruce?"]),
}  # fmt: skip


def test_what_cannot_be_used_is_refused_with_all_faults():
    for make, wanted in BAD.values():
        with pytest.raises(bayesplate.InputError) as refused:
            make()
        assert [passage for passage in wanted if passage not in str(refused.value)] == []


CONSTANTS = {"E_x": Q.from_median(12e9, 1.3), "E_y": Q.from_range(0.4e9, 2e9), "G_xy": Q.from_median(0.7e9, 1.4)}


def prior(**more):
    """A prior from quantities."""
    return bayesplate.PriorCard.from_quantities("mine", CONSTANTS, source="my shop", **more)


def test_a_prior_from_quantities_holds_them_and_becomes_a_card(tmp_path):
    sources = {"E_x": "a", "E_y": "b", "G_xy": "c", "noise": "d", "poisson_xy": "e"}
    noise, ratio = Q.from_median(0.005, 1.6), Q.from_mean(0.37, 0.05, "normal")
    one = bayesplate.PriorCard.from_quantities("mine", CONSTANTS, source=sources, noise=noise, poisson_xy=ratio)
    one.to_toml(tmp_path / "mine.toml")
    again = load_prior(tmp_path / "mine.toml")

    assert one.constants == CONSTANTS
    assert (one.noise_percent, one.poisson_xy) == (noise.scaled(100.0), ratio)
    assert set(one.sources.values()) == set("abcde")
    more = {"noise": noise, "poisson_xy": ratio}
    assert bayesplate.PriorCard.from_quantities("mine", CONSTANTS, source=one.sources, **more) == one
    assert again == one
    assert again.to_toml() == one.to_toml()


def test_a_shipped_prior_comes_back():
    for name in ("spruce", "weakly-informative"):
        card = load_prior(name)
        further = {"noise": None if card.noise_percent is None else card.noise_percent.scaled(0.01)}
        isotropic = {} if card.E is None else {"E": card.E}
        made = bayesplate.PriorCard.from_quantities(
            name,
            card.constants | {key: one.quantity for key, one in isotropic.items()},
            source=card.sources | {key: one.source for key, one in isotropic.items()},
            poisson_xy=card.poisson_xy,
            density=card.density,
            title=card.title,
            **further,
        )
        assert made == card


NO_PRIORS = [
    ({"E_x": CONSTANTS["E_x"]}, {}, "wanted all of E_x, E_y, G_xy or all of D_x, D_y, D_s, got E_x"),
    (CONSTANTS | {"E_z": CONSTANTS["E_x"]}, {}, "mine E_z: wanted one of E_x, E_y, G_xy, D_x, D_y, D_s"),
    (CONSTANTS | {"E_x": Q.exact(1e10)}, {}, "mine E_x: wanted Quantity.from_median or Quantity.from_range"),
    (CONSTANTS | {"E_x": Q.from_mean(1e10, 1e9, "normal")}, {}, "mine E_x: wanted Quantity.from_median"),
    (CONSTANTS | {"E_x": Q.from_median(12.0, 1.3)}, {}, r"mine.toml \[E_x\] median_gpa: wanted a number from"),
    (CONSTANTS, {"noise": Q.from_range(0.001, 0.01)}, "mine noise: wanted Quantity.from_median"),
    (CONSTANTS, {"density": Q.exact(430.0)}, r"mine density: wanted Quantity.from_mean\(430, 60\)"),
    (CONSTANTS, {"density": Q.from_mean(430, 60, lower=300.0)}, "mine density: wanted .* without bounds"),
    (CONSTANTS, {"poisson_xy": Q.from_mean(0.4, 0.1, "normal", 0.0)}, "mine poisson_xy: wanted .* without bounds"),
    (CONSTANTS, {"poisson_xy": 0.4, "noise": 0.01}, "mine noise: wanted .*\nmine poisson_xy: wanted "),
    (CONSTANTS | {"E_x": 12e9}, {}, "mine E_x: wanted Quantity.from_median or .*, got 12000000000.0"),
    (None, {"source": None, "title": 1}, "mine title: wanted .*\nmine constants: wanted .*\nmine source: wanted a"),
    (CONSTANTS, {"source": " "}, "mine source: wanted where the numbers come from, got an empty text"),
    (CONSTANTS, {"source": {"E_x": "a", "E_y": "", "Gxy": "b"}},
     "mine source Gxy: wanted one of E_x, .* mean G_xy.*\nmine source E_y: wanted .*\nmine source G_xy: wanted "),
    (CONSTANTS, {"poisson_xy": Q.exact(0.4)}, r'mine poisson_xy: wanted Quantity.from_mean\(0.4, 0.08, "normal"\)'),
]  # fmt: skip


def test_what_is_no_prior_is_refused():
    for constants, more, said in NO_PRIORS:
        with pytest.raises(bayesplate.InputError, match=said):
            bayesplate.PriorCard.from_quantities("mine", constants, **{"source": "my shop"} | more)
