"""The example of an uncertainty budget: its parts against powers worked out by hand and a fit with exact inputs."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture(scope="module")
def example(load):
    return load("uncertainty_report")


@pytest.fixture(scope="module")
def numbers(example, tmp_path_factory):
    """Of the fit, whose page is not drawn; the results and the figure are written where told."""
    folder = tmp_path_factory.mktemp("uncertainty")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("bayesplate.commands.fitting.FitResult.write_page", lambda *_: None)
        found = example.run(folder)
    assert (folder / "uncertainty.png").read_bytes().startswith(b"\x89PNG")
    assert {"summary.json", "posterior.nc"} <= {path.name for path in folder.iterdir()}
    return found


@pytest.fixture(scope="module")
def error(numbers):
    """Four relative standard errors of a standard deviation from so many draws."""
    return 4 / np.sqrt(2 * numbers["effective_draws"])


@pytest.mark.parametrize("name", ["E_x", "E_y", "G_xy"])
def test_parts_of_thickness_and_mass_are_those_worked_out_by_hand_and_the_rest_that_of_exact_inputs(
    numbers, error, name
):
    """Cubed and to the first power; squared, as if the density were given, is the control that must fail.

    The rest is the spread of a fit with exact inputs, each fit with its error; the Poisson ratio stays open in both.
    """
    row = numbers["budget"][name]

    slope = 4 * row["parts"]["frequencies"] / np.sqrt(numbers["effective_draws"])  # of a regression on so many draws
    for known in ("thickness", "mass"):
        by_hand = row["by_hand"][known]
        assert row["parts"][known] == pytest.approx(by_hand, abs=np.hypot(error * by_hand, slope))
    squared = 2 / 3 * row["by_hand"]["thickness"]
    assert row["parts"]["thickness"] != pytest.approx(squared, abs=np.hypot(error * squared, slope))

    left = np.hypot(row["parts"]["frequencies"], row["parts"]["poisson_xy"])
    assert left == pytest.approx(row["exact_inputs_percent"], rel=2 * error)
    assert row["sd_percent"] ** 2 == pytest.approx(sum(part**2 for part in row["parts"].values()), rel=2 * error)


def test_the_frequencies_teach_the_constants_and_not_the_sizes(numbers, error):
    widths = numbers["widths"]

    for name in ("E_x", "E_y", "G_xy"):
        assert widths[name]["after"] < widths[name]["before"] / 50
    for name in ("thickness", "mass", "length_x", "length_y"):
        assert widths[name]["after"] == pytest.approx(widths[name]["before"], rel=error)


def test_parts_of_a_made_up_constant(example):
    """ln c = 3 a - b + noise: parts 3 sd(a), sd(b), sd(noise)."""
    rng = np.random.default_rng(3)
    n, sds = 20_000, np.array([0.02, 0.01, 0.005])
    a, b, noise = sds[:, None] * rng.standard_normal((3, n))
    parts = example.parts_of(np.exp(3 * a - b + noise), {"a": np.exp(a), "b": np.exp(b)})

    for name, wanted in {"a": 6.0, "b": 1.0, "frequencies": 0.5}.items():
        assert parts[name] == pytest.approx(wanted, rel=4 / np.sqrt(2 * n))
