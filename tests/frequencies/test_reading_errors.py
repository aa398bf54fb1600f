"""The error of a reading: against densities and quadrature, its deviances, its weight, simulation, and the card."""

from __future__ import annotations

import numpy as np
import pytest
import ritz
from made_baselines import baseline_at
from made_boards import board_of, setup_of
from scipy import integrate, stats

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.estimates.least_squares import reading_scales, weighted_least_squares
from bayesplate.frequencies.reading_errors import DEGREES_OF_FREEDOM, ReadingErrors, reading_sd

EPS = np.finfo(float).eps
LAWS = {False: stats.norm, True: stats.t(DEGREES_OF_FREEDOM)}
BOTH = pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])


def errors_of(*frequencies, resolution=0.0, robust=False):
    setup = setup_of(ritz.ALL_FREE, {(1, i): f for i, f in enumerate(frequencies, start=1)}, resolution=resolution)
    return ReadingErrors.of(setup, robust)


def interval(low, high, robust):
    """ln of the production probability of ln f between two numbers of noise from the prediction, and those it took."""
    noise = 1e-3
    # 1 Hz, so that ln f is 0, rounded to the step whose two ends are that far apart
    step = 2.0 * np.tanh(0.5 * noise * (high - low))
    errors = ReadingErrors(np.ones(1), np.zeros(1), np.array([step]), robust)
    predicted = errors.log_low - low * noise
    ends = [float((end - predicted)[0] / noise) for end in (errors.log_low, errors.log_high)]
    return errors.log_likelihood(predicted, noise)[0], *ends


def log_probability(low, high, robust):
    """Logarithm of the integral of the density, taken relative to the density at the end nearer to the middle."""
    nearest = float(np.clip(0.0, low, high))

    def relative(z):
        difference = (z - nearest) * (z + nearest)
        return (1.0 + difference / (4.0 + nearest**2)) ** -2.5 if robust else np.exp(-0.5 * difference)

    # beyond e^-60 of the density at the near end a normal interval has nothing left
    reach = np.inf if robust else 60.0 / max(abs(nearest), 1.0)
    low, high = max(low, nearest - reach), min(high, nearest + reach)
    value, _ = integrate.quad(relative, low, high, epsabs=0, epsrel=1e-12, limit=400)
    return LAWS[robust].logpdf(nearest) + np.log(value)


INTERVALS = [
    (-1.0, 1.0),
    (-0.3, 2.0),
    (0.5, 0.6),
    (2.0, 3.0),
    (-9.0, -8.0),
    (8.0, 9.0),
    (38.0, 39.0),  # Phi is zero to double precision from here on
    (-60.0, -41.0),
    (300.0, 301.0),
    (-1e4, -0.999e4),
    (-3.0, 50.0),
]


@BOTH
@pytest.mark.parametrize(("low", "high"), INTERVALS)
def test_an_interval_has_the_integral_of_its_density(low, high, robust):
    found, *ends = interval(low, high, robust)
    assert ends == pytest.approx([low, high], rel=1e-9)
    # the quadrature is good to 1e-12 of the probability; far out ln p is about -z^2 / 2, to the rounding of z
    assert found == pytest.approx(log_probability(*ends, robust), rel=1e-12, abs=1e-11)


@BOTH
@pytest.mark.parametrize(("z", "width"), [(0.0, 1e-6), (1.3, 1e-4), (-2.7, 1e-2), (12.0, 1e-4)])
def test_a_narrow_interval_is_density_times_width(z, width, robust):
    found, low, high = interval(z - width / 2, z + width / 2, robust)
    expected = LAWS[robust].logpdf(0.5 * (low + high)) + np.log(high - low)
    # the next term of the series is width^2 / 24 p''/p, and |p''/p| <= z^2 + 5/4 in both laws; the difference of two
    # logarithms of that size, relative to the width, loses some eps / width
    tolerance = width**2 / 24 * (z**2 + 1.25) + 10 * EPS * max(1.0, abs(expected)) / width
    assert found == pytest.approx(expected, rel=0, abs=tolerance)
    assert interval(z - width, z + width, robust)[0] - expected == pytest.approx(np.log(2), abs=1e-2)


@BOTH
def test_the_reading_s_own_uncertainty_is_joined_with_the_noise_of_each_draw(robust):
    own, away = 0.004, 0.01
    errors = errors_of(Quantity.from_mean(100.0, 100.0 * own), 100.0, robust=robust)
    noises = np.array([0.003, 0.02])
    scales = np.array([[0.005, 0.003], [np.hypot(0.02, own), 0.02]])
    found = errors.log_likelihood(np.full((2, 2), np.log(100.0) - away), noises)
    assert found == pytest.approx(LAWS[robust].logpdf(away / scales) - np.log(scales), rel=1e-12)
    assert np.array_equal(errors.sd(noises), np.stack([errors.sd(one) for one in noises]))


def test_a_reading_with_an_uncertainty_of_its_own_is_not_rounded_on_top():
    errors = errors_of(Quantity.from_mean(100.0, 0.4), 100.0, resolution=1.0)
    assert errors.log_high[0] == errors.log_low[0] == errors.log_frequency[0]
    assert np.exp([errors.log_low[1], errors.log_high[1]]) == pytest.approx([99.5, 100.5])


@BOTH
@pytest.mark.parametrize("resolution", [0.0, 1.0])
def test_no_prediction_has_no_probability(resolution, robust):
    errors = errors_of(100.0, 150.0, resolution=resolution, robust=robust)
    predicted = np.log([[100.0, np.nan], [100.0, 150.0]])
    found = errors.log_likelihood(predicted, 0.01)
    assert found[0, 1] == -np.inf
    assert np.isfinite(found[[0, 1, 1], [0, 0, 1]]).all()


@BOTH
def test_simulated_readings_follow_the_density(robust):
    n, noise, own = 20_000, 0.003, 0.004
    errors = errors_of(Quantity.from_mean(100.0, 100.0 * own), robust=robust)
    rng = np.random.default_rng(20)
    draws = errors.simulate(np.full((n, 1), np.log(90.0)), np.full(n, noise), rng)[:, 0]
    standard = np.log(draws / 90.0) / 0.005
    # false alarm once in 1000 seeds; the other law, and the noise alone as scale, must be told apart
    assert stats.kstest(standard, LAWS[robust].cdf).pvalue > 1e-3
    assert stats.kstest(standard, LAWS[not robust].cdf).pvalue < 1e-6
    assert stats.kstest(standard * 5 / 3, LAWS[robust].cdf).pvalue < 1e-6


def test_the_logarithm_of_a_noise_is_refused():
    """Noise is relative and positive; its logarithm, which the posterior samples, would pass for a huge one."""
    with pytest.raises(ValueError, match="is it a logarithm"):
        errors_of(100.0).log_likelihood(np.zeros((1, 1)), np.log([0.003]))


@BOTH
def test_simulated_readings_are_rounded_where_the_measured_ones_are(robust):
    """The plain number to its grid, with the probabilities of the likelihood; the reading with its own sd to none."""
    n, noise = 20_000, 0.02
    errors = errors_of(50.0, Quantity.from_mean(100.0, 0.4), resolution=2.0, robust=robust)
    predicted = np.log([50.6, 100.0])
    draws = errors.simulate(np.tile(predicted, (n, 1)), noise, np.random.default_rng(5))
    assert np.all(draws[:, 0] == 2.0 * np.round(draws[:, 0] / 2.0))
    assert np.mean(draws[:, 1] == 2.0 * np.round(draws[:, 1] / 2.0)) < 0.01
    for hertz in (48.0, 50.0, 52.0):
        one = ReadingErrors(np.array([hertz]), np.zeros(1), np.array([2.0]), robust)
        p = np.exp(one.log_likelihood(predicted[:1], noise)[0])
        assert stats.binomtest(int(np.sum(draws[:, 0] == hertz)), n, p).pvalue > 1e-3
        assert stats.binomtest(int(np.sum(draws[:, 0] == hertz + 2.0)), n, p).pvalue < 1e-6  # control


DEVIANCES = [(0.0, 0.004), (1.0, 0.004), (1.0, 0.02), (1.0, 3e-4)]
"""Resolution, Hz, of a reading of 52 Hz, and noise: not rounded, then a step of 5, 1 and 64 noises."""


@BOTH
@pytest.mark.parametrize(("resolution", "noise"), DEVIANCES)
def test_squares_of_deviance_residuals_are_twice_the_loss_of_log_likelihood(resolution, noise, robust):
    errors = errors_of(52.0, Quantity.from_mean(52.0, 0.1), resolution=resolution, robust=robust)
    middle = np.array([0.5 * (errors.log_low + errors.log_high)[0], np.log(52.0)])
    scale = np.array([max(noise, resolution / 104.0), 0.01])
    offsets = np.array([-30.0, -3.0, -1.0, -0.3, -0.03, -1e-3, -1e-5, -1e-9, 0.0, 1e-9, 1e-5, 1e-3, 0.03, 1.0, 30.0])
    predicted = middle + scale * offsets[:, None]
    residuals, slopes = errors.deviance_residuals(predicted, noise)
    log_p = errors.log_likelihood(predicted, noise)
    lost = 2.0 * (errors.log_likelihood(middle, noise) - log_p)
    assert residuals**2 == pytest.approx(lost, rel=1e-10, abs=1e-10)
    assert np.all(lost >= -1e-12)  # the middle is the highest
    # positive where the reading lies above the prediction; in the middle of a wide interval there is nothing to see
    assert np.all(residuals * -offsets[:, None] >= 0)
    assert np.all(residuals[offsets == -30.0] > 3.0)
    assert np.all(slopes <= 0)
    # the gradient of the sum of squares is that of the log likelihood, by differences a thousandth of a scale wide
    step = 1e-3 * np.array([noise, np.hypot(noise, 0.1 / 52.0)])
    ahead, behind = (errors.log_likelihood(predicted + one, noise) for one in (step, -step))
    gradient = (ahead - behind) / 2e-3
    # a third derivative of order one times step^2, and the digits that the difference of two logarithms loses
    tolerance = 2e-6 * np.maximum(1.0, np.abs(gradient)) + 1e3 * 4 * EPS * np.abs(log_p)
    assert np.all(np.abs(-residuals * slopes * step * 1e3 - gradient) < tolerance)


def test_a_normal_reading_s_deviance_residual_is_its_standardised_one_to_the_last_digit():
    errors = errors_of(52.0, Quantity.from_mean(98.0, 0.3))
    predicted, noise = np.log([51.3, 99.9]), 0.004
    sd = np.hypot(noise, [0.0, 0.3 / 98.0])
    residuals, slopes = errors.deviance_residuals(predicted, noise)
    assert np.array_equal(residuals, (np.log([52.0, 98.0]) - predicted) / sd)
    assert np.array_equal(slopes, -1.0 / sd)
    assert errors.deviance_residuals(np.log([52.0, 98.0]), noise)[1] == pytest.approx(-1.0 / sd, rel=1e-15)
    # control: Student's and a rounded reading's are others
    for other in (errors_of(52.0, 98.0, robust=True), errors_of(52.0, 98.0, resolution=1.0)):
        assert not np.isclose(other.deviance_residuals(predicted, noise)[0], residuals, rtol=0.05).any()


def test_an_interval_much_wider_than_the_noise_is_flat_within_and_steep_beyond():
    errors, noise = errors_of(50.0, resolution=10.0), 1e-5
    within, beyond = np.log([[46.0], [50.0], [54.0]]), np.log([[44.99], [55.01]])
    assert np.abs(errors.deviance_residuals(within, noise)).max() < 1e-7
    residuals, slopes = errors.deviance_residuals(beyond, noise)
    assert np.sign(residuals[:, 0]).tolist() == [1.0, -1.0]
    # beyond an edge the far one does not count: as good as a normal error about the edge
    assert slopes[:, 0] == pytest.approx(-1.0 / noise, rel=0.01)


MIXED = {
    "hung": (1.0, {(1, 1): 52.0, (2, 0): Quantity.from_mean(98.0, 0.3), (2, 1): 211.0}),
    "held": (0.0, {(1, 1): 310.0, (2, 0): Quantity.from_readings([98, 98, 99], 1.0)}),
}
"""Resolution and readings of two setups: rounded numbers, exact ones, and readings with an uncertainty of their own."""


def mixed_board():
    setups = [
        setup_of(ritz.ALL_FREE, hertz, name=name, resolution=resolution, noise=Quantity.from_median(0.004, 1.5))
        for name, (resolution, hertz) in MIXED.items()
    ]
    return board_of(ritz.FREE_SPRUCE, setups)


def moment(errors, mode, noise):
    """Standard deviation of the likelihood of one reading, normalised as a function of the predicted ln f."""
    grid = errors.log_frequency[mode] + 12 * errors.sd(noise)[mode] * np.linspace(-1, 1, 20_001)
    predicted = np.tile(errors.log_frequency, (grid.size, 1))
    predicted[:, mode] = grid
    p = np.exp(errors.log_likelihood(predicted, noise)[:, mode])
    mean = np.sum(p * grid) / np.sum(p)
    return float(np.sqrt(np.sum(p * (grid - mean) ** 2) / np.sum(p)))


def test_least_squares_search_and_likelihood_weigh_a_reading_alike():
    board = mixed_board()
    noise = [setup.noise.median for setup in board.setups]
    scales = reading_scales(board)
    by_hand = np.sqrt(0.004**2 + np.array([1 / 52**2 / 12, (0.3 / 98) ** 2, 1 / 211**2 / 12, 0.0,
                                           (1 / 9 + 1 / 12) / (295 / 3) ** 2]))  # fmt: skip
    assert scales == pytest.approx(by_hand, rel=1e-12)
    assert np.array_equal(reading_sd(board.setups, noise), scales)
    baseline = baseline_at(board, weighted_least_squares(board))
    assert np.array_equal(baseline.scales, scales)
    assert np.sqrt(baseline.own_variance + 0.004**2) == pytest.approx(scales, rel=1e-12)
    moments = [
        moment(errors, mode, level)
        for errors, level in zip(map(ReadingErrors.of, board.setups), noise, strict=True)
        for mode in range(errors.frequency.size)
    ]
    # the interval of ln f is wider than resolution / f by (resolution / f)^2 / 12; half of 6e-5 of the variance at most
    assert moments == pytest.approx(scales, rel=5e-5)
    # control: without its rounding the lowest reading would be told from its scale
    assert 0.004 / scales[0] < 0.9


CARD = """\
format = 1
name = "lists"
[plate]
length_x_mm = 580
length_y_mm = 217
thickness_mm = 4.7
mass_g = 250
[setup]
edges = {{ x0 = "free", x1 = "free", y0 = "free", y1 = "free" }}
{resolution}
[setup.frequencies_hz]
"(1,1)" = {frequency}
"(0,2)" = 90
"""


@pytest.mark.parametrize(
    ("frequency", "resolution", "mean", "variance"),
    [
        ("[98, 98, 99]", 1, 295 / 3, 1 / 9 + 1 / 12),  # s^2 = 1/3, over three readings
        ("[98, 98, 98]", 1, 98, 1 / 12),
        ("[98, 98, 99]", None, 295 / 3, 1 / 9),
        ("{ readings = [98, 98, 99], resolution = 0.5 }", 1, 295 / 3, 1 / 9 + 0.25 / 12),  # its own step is nearer
        ("{ readings = [98, 98, 99] }", 1, 295 / 3, 1 / 9 + 1 / 12),
        ("{ mean = 98, sd = 0.4 }", 1, 98, 0.16),
        ("98", 1, 98, 0),
        ("[98]", 1, 98, 0),  # one number, in brackets or not, is its interval
    ],
)
def test_a_list_of_readings_joins_its_standard_error_with_the_rounding_of_the_setup(
    frequency, resolution, mean, variance
):
    said = "" if resolution is None else f"resolution_hz = {resolution}"
    (setup,) = Board.from_text(CARD.format(frequency=frequency, resolution=said), "lists.toml").setups
    read, plain = (reading.frequency for reading in setup.readings)
    assert (read.mean, read.sd**2) == pytest.approx((mean, variance), rel=1e-12)
    assert plain.is_exact
    errors = ReadingErrors.of(setup)
    step = resolution or 0.0
    assert errors.resolution.tolist() == [step if variance == 0 else 0.0, step]
    own = np.array([variance / mean**2, 0.0]) + (errors.resolution / [mean, 90]) ** 2 / 12
    assert errors.own_variance == pytest.approx(own, rel=1e-12)


def test_a_simulated_reading_equals_the_measured_one_that_it_rounds_to():
    """Also in the last digit: 483 * 0.1 is no 48.3, and a third of exact readings lay outside their intervals."""
    hertz = [float(f"{40.1 + 7.1 * i:.1f}") for i in range(40)]
    errors = ReadingErrors(np.array(hertz), np.zeros(40), np.full(40, 0.1))
    draws = errors.simulate(np.tile(np.log(hertz), (10, 1)), 1e-6, np.random.default_rng(6))
    np.testing.assert_array_equal(draws, np.tile(hertz, (10, 1)))
