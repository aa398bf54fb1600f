"""A summary made by hand, for tests of what is made of one: no board, no sampling."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from bayesplate.results.contract import JOINT_NAMES, Elastic, JointMoments, Rigidity, Spread
from bayesplate.results.modes import AssignedPeak, Assignment, ModeRow, PredictedMode, Prediction, Spectrum, ratio_cents
from bayesplate.results.summary import (
    ErrorFigures,
    LawMeans,
    ModelHeader,
    Percentile,
    PercentileValue,
    PointEstimate,
    SamplerHealth,
    Summary,
)


def spread(mean: float, sd: float, unit: str) -> Spread:
    """Quantiles at one and two sd from the mean: round numbers, no distribution's."""
    return Spread(mean, sd, mean - 2 * sd, mean - sd, mean, mean + sd, mean + 2 * sd, unit)


def mode(label: str, measured: float, predicted: float, half_width: float, **changed: Any) -> ModeRow:
    """A reading and a prediction that agree with their residual; the 90 % interval is ± the half width, Hz."""
    low, high = predicted - half_width, predicted + half_width
    row = ModeRow(
        setup="bench",
        label=label,
        measured_hz=measured,
        predicted_hz=Prediction(predicted, low, high),
        residual_cents=ratio_cents(measured, predicted),
        residual_interval_cents=(ratio_cents(measured, high), ratio_cents(measured, low)),
        rounding_cents=(ratio_cents(measured - 0.5, measured), ratio_cents(measured + 0.5, measured)),
        left_out_cents=12.25,
        leverage=0.5,
        label_correlation=0.99,
    )
    return replace(row, **changed)


POINT = PointEstimate(E_x=10.25e9, E_y=None, G_xy=0.5e9, D_x=10.0, D_y=1.0, D_s=2.0, condition_number=4.0)
WEIGHTED = replace(POINT, E_y=1.125e9)
DERIVED = {
    **{f"{name}_{axis}": 1000.0 for name in ("wave_speed", "radiation_ratio", "impedance") for axis in "xy"},
    **{f"specific_stiffness_{axis}": 2e7 for axis in "xy"},
    "anisotropy": 10.0,
    "E_x_over_G_xy": 20.0,
    "density": 400.0,
}

SUMMARY = Summary(
    format=1,
    name="made",
    seed=1,
    versions={"bayesplate": "0"},
    card_sha256="0" * 64,
    model=ModelHeader("thin", "exact", ("attached_mass",), False, "weakly-informative"),
    converged=True,
    elastic=Elastic(spread(10.5e9, 0.25e9, "Pa"), spread(1.0e9, 0.125e9, "Pa"), spread(0.5e9, 0.0625e9, "Pa")),
    rigidity=Rigidity(*(spread(10.5, 0.25, "N m") for _ in range(3))),
    effects={"bench": {"attached_mass": {"mass": spread(2e-3, 5e-4, "kg")}}},
    noise={"bench": spread(0.005, 0.001, "1")},
    inputs={"thickness": spread(3e-3, 5e-5, "m")},
    derived={name: spread(value, value / 50, "1") for name, value in DERIVED.items()},
    joint=JointMoments(JOINT_NAMES, (0.0,) * 7, ((0.0,) * 7,) * 7),
    least_squares=POINT,
    weighted_least_squares=WEIGHTED,
    percentile=Percentile(
        E_x=PercentileValue(10e9, 2.0), E_y=PercentileValue(None, None), G_xy=PercentileValue(0.5e9, None), n_subsets=42
    ),
    linear_means=LawMeans(*[None] * 6, effective_draws=12.5),
    exact_means=LawMeans(10.5e9, 1e9, 0.5e9, 10.5, 10.5, 10.5, effective_draws=4000.0),
    modes=(
        mode("(1,0)", 52.0, 51.75, 0.5),
        mode("(1,1)", 400.0, 402.0, 2.0),
        mode("(2,0)", 310.0, 310.0, 2.0, rounding_cents=None, left_out_cents=None),
    ),
    peaks=(
        AssignedPeak(
            "bench",
            860.0,
            "(3,1)",
            (Assignment("(3,1)", 0.75, 850.0), Assignment("(2,2)", 0.125, 800.0)),
            0.125,
            Prediction(850.0, 845.0, 855.0),
            ratio_cents(860.0, 850.0),
        ),
    ),
    spectra=(
        Spectrum(
            "bench",
            0.2,
            0.02,
            (
                PredictedMode("bench", "(2,2)", Prediction(800.0, 795.0, 805.0), 0.125),
                PredictedMode("bench", "(3,1)", Prediction(850.0, 845.0, 855.0), 0.75),
            ),
        ),
    ),
    error=ErrorFigures(7.5, 12.25, 0.5, 0.125, None, None),
    sampler=SamplerHealth(4, 32, 2000, 30.5, 1.0025, 6000.0, 0.5),
    identifiability=("the modes tell E_y least well",),
    warnings=("made by hand",),
)
