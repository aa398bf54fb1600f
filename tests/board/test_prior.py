"""Prior cards: proper densities of the logarithm of each constant, or a fault that names the key."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from scipy.integrate import quad

from bayesplate.board.prior import PriorCard, StatedPrior, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.errors import InputError

PRIOR = """\
format = 1
name = "mine"
[E_x]
distribution = "log-normal"
median_gpa = 11
factor = 1.35
source = "a book"
[E_y]
distribution = "log-uniform"
lower_gpa = 0.1
upper_gpa = 10
source = "a guess"
[G_xy]
distribution = "log-normal"
median_gpa = 0.67
factor = 1.5
source = "a book"
[noise_percent]
median = 0.3
factor = 1.65
source = "repeated hits"
[poisson_xy]
mean = 0.4
sd = 0.12
source = "a table"
"""
EITHER = "all of E_x, E_y, G_xy or all of D_x, D_y, D_s"


@pytest.fixture
def read(tmp_path):
    def read_text(text: str) -> PriorCard:
        path = tmp_path / "mine.toml"
        path.write_text(text, encoding="utf-8")
        return load_prior(path)

    return read_text


def test_a_sound_card_is_read_in_si_units(read):
    card = read(PRIOR)

    assert list(card.constants) == ["E_x", "E_y", "G_xy"]
    assert card.stated_constants["E_x"] == StatedPrior(Quantity.from_median(11e9, 1.35), "a book")
    assert (card.constants["E_y"].lower, card.constants["E_y"].upper) == (1e8, 1e10)
    assert card.noise_percent is not None
    assert card.noise_percent.median == pytest.approx(0.3)
    assert card.poisson_xy is not None
    assert (card.poisson_xy.mean, card.poisson_xy.sd, card.poisson_xy.kind) == (0.4, 0.12, "normal")
    assert card.sources["noise_percent"] == "repeated hits"


def test_rigidities_are_read_in_newton_metres(read):
    rows = "".join(
        f'[{name}]\ndistribution = "log-normal"\nmedian_n_m = {median}\nfactor = 2\nsource = "-"\n'
        for name, median in (("D_x", 30), ("D_y", 2), ("D_s", 6))
    )
    card = read('format = 1\nname = "mine"\n' + rows)

    medians = {name: prior.median for name, prior in card.constants.items()}
    assert medians == pytest.approx({"D_x": 30, "D_y": 2, "D_s": 6})
    assert card.noise_percent is None
    assert card.poisson_xy is None


FAULTS = [
    ("median_gpa = 11", "median_gpa = -1", "[E_x] median_gpa", "a positive number", "-1"),
    ("median_gpa = 11", "median_gpa = 1e300", "[E_x] median_gpa", "a number from 1e-06 to 1000000 GPa", "1e+300"),
    ("median_gpa = 11", "median_mpa = 11000", "[E_x] median_mpa", "one of distribution, source, median_gpa, factor",
     "an unknown key (did you mean median_gpa?)"),
    ("factor = 1.35", "factor = 1", "[E_x] factor", "a factor above 1", "1"),
    ("factor = 1.35\n", "", "[E_x] factor", "a value", "nothing"),
    ("lower_gpa = 0.1", "lower_gpa = 10", "[E_y]", "lower_gpa below upper_gpa", "10 and 10"),
    ("lower_gpa = 0.1", "lower_gpa = 0", "[E_y] lower_gpa", "a positive number", "0"),
    ('"log-uniform"', '"uniform"', "[E_y] distribution", '"log-normal" or "log-uniform"', '"uniform"'),
    ('distribution = "log-uniform"\n', "", "[E_y] distribution", '"log-normal" or "log-uniform"', "nothing"),
    ('source = "a guess"\n', "", "[E_y] source", "a value", "nothing"),
    ('source = "repeated hits"\n', "", "[noise_percent] source", "where the numbers come from", "nothing"),
    ("[E_y]", "[E_z]", "", EITHER, "E_x, G_xy"),
    ("[E_y]", "[D_y]", "", EITHER, "E_x, G_xy, D_y"),
    ("[E_y]", "[E_z]", "E_z", "one of format, name", "an unknown key (did you mean"),
    ("[poisson_xy]\nmean = 0.4\nsd = 0.12\nsource = \"a table\"\n", "[poisson_xy.mean]\n", "[poisson_xy] source",
     "where the numbers come from", "nothing"),
    ('name = "mine"', 'name = "yours"', "name", '"mine", the name of the file', '"yours"'),
]  # fmt: skip


def test_faults(read):
    for old, new, place, wanted, got in FAULTS:
        if PRIOR.count(old) != 1:
            raise ValueError(old)
        where = f"mine.toml {place}".strip() if place != "E_z" else "mine.toml [E_z]"
        pattern = re.escape(f"{where}: wanted {wanted}") + ".*, got " + re.escape(got)
        with pytest.raises(InputError, match=pattern):
            read(PRIOR.replace(old, new))


@pytest.mark.parametrize("name", ["E_x", "E_y"])
def test_densities_of_the_logarithm_are_normalised_and_sampled(read, name):
    density = read(PRIOR).constants[name]
    middle = math.log(density.median)
    low, high = middle - 9 * density.log_sd, middle + 9 * density.log_sd
    edges = [math.log(1e8), math.log(1e10)] if name == "E_y" else None

    def moment(power: int, centre: float) -> float:
        return float(quad(lambda x: (x - centre) ** power * math.exp(float(density.log_density_of_log(x))), low, high,
                          points=edges, limit=200)[0])  # fmt: skip

    assert moment(0, 0.0) == pytest.approx(1, rel=1e-7)
    assert moment(1, middle) == pytest.approx(0, abs=1e-7)
    assert math.sqrt(moment(2, middle)) == pytest.approx(density.log_sd, rel=1e-6)

    n = 40_000
    draws = np.log(density.sample(np.random.default_rng(1), n))
    assert abs(draws.mean() - middle) < 4 * density.log_sd / math.sqrt(n)
    assert abs(draws.std() / density.log_sd - 1) < 4 / math.sqrt(2 * n)


def test_outside_a_log_uniform_density(read):
    density = read(PRIOR).constants["E_y"]

    assert np.isneginf(density.log_density([0.99e8, 1.01e10])).all()


def test_the_default_prior_does_not_know_the_axes():
    priors = load_prior("weakly-informative").constants

    assert set(priors.values()) == {Quantity.from_median(3e9, 10)}
