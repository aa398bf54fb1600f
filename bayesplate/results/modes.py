"""The modes of a summary: each reading beside what the fitted model predicts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, Protocol, TypeVar

import numpy as np

from bayesplate.estimates.leave_one_out import CarryingMode
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.assessment import Assessment
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.posing import PosedProblem
from bayesplate.results.contract import finite

LabelOrigin = Literal["card", "doubtful", "proposed"]


@dataclass(frozen=True)
class Prediction:
    """What the posterior says of a frequency, Hz."""

    mean: float
    q05: float
    q95: float


@dataclass(frozen=True)
class ModeRow:
    """A labelled mode; but for `left_out_cents` and `leverage` every number belongs to the posterior.

    Attributes
    ----------
    setup, label : str
    measured_hz : float
    predicted_hz : Prediction
    residual_cents : float
        Measured over the posterior mean of the prediction.
    residual_interval_cents : tuple of float
        Measured over the ends of the predicted 90 % interval, the lower one first.
    rounding_cents : tuple of float or None
        Ends of the rounding interval over the reading; None where it is not rounded.
    left_out_cents : float or None
        Measured over predicted by the most likely constants of the other readings; None where too few are left. Of a
        mode that alone carries a constant or a size it says nothing, and no error counts it.
    leverage : float
        Share of the mode in its own prediction, what else is free counted in.
    label_correlation : float
        Of the mode's shape with what its label names.
    label_origin : "card", "doubtful" or "proposed"
        Whether the card states the label as sure or with a doubt, or the peak has none and this one is its likeliest;
        the probabilities of the latter two stand in `Summary.peaks`.
    """

    setup: str
    label: str
    measured_hz: float
    predicted_hz: Prediction
    residual_cents: float
    residual_interval_cents: tuple[float, float]
    rounding_cents: tuple[float, float] | None
    left_out_cents: float | None
    leverage: float
    label_correlation: float
    label_origin: LabelOrigin = "card"


def over(measured: float, predicted: float) -> float:
    """A frequency over another, cents."""
    return float(cents(np.log(measured / predicted)))


def mode_rows(problem: PosedProblem, draws: Draws, assessment: Assessment) -> tuple[ModeRow, ...]:
    """One row per labelled mode, setup after setup.

    Parameters
    ----------
    problem : PosedProblem
    draws : Draws
    assessment : Assessment

    Returns
    -------
    tuple of ModeRow
    """
    predicted = np.exp(draws.log_frequency).reshape(-1, draws.log_frequency.shape[-1])
    low, high = np.quantile(predicted, [0.05, 0.95], axis=0)
    rounding = rounding_intervals(problem)
    rows = [
        (setup.name, reading, place)
        for setup, model in zip(problem.board.setups, problem.posterior.models, strict=True)
        for reading, place in zip(setup.readings, model.places, strict=True)
    ]
    made = []
    for i, (setup, reading, place) in enumerate(rows):
        hertz = reading.frequency.mean
        prediction = Prediction(float(predicted[:, i].mean()), float(low[i]), float(high[i]))
        row = ModeRow(
            setup=setup,
            label=str(reading.label),
            measured_hz=hertz,
            predicted_hz=prediction,
            residual_cents=over(hertz, prediction.mean),
            residual_interval_cents=(over(hertz, prediction.q95), over(hertz, prediction.q05)),
            rounding_cents=rounding[i],
            left_out_cents=finite(float(cents(assessment.left_out[i]))),
            leverage=float(assessment.leverages[i]),
            label_correlation=place.correlation,
            label_origin="card" if reading.is_sure else "doubtful" if reading.confidence else "proposed",
        )
        made.append(row)
    return tuple(made)


Row = TypeVar("Row", bound="Labelled")


class Labelled(Protocol):
    """A row of a mode of a setup."""

    @property
    def setup(self) -> str:
        """Name of the setup."""

    @property
    def label(self) -> str:
        """Label of the mode."""


def foretold(rows: Iterable[Row], carrying: Iterable[CarryingMode]) -> list[Row]:
    """Rows of the modes that others foretell: those that count in an error of modes left out."""
    carried = {(one.setup, one.label) for one in carrying}
    return [one for one in rows if (one.setup, one.label) not in carried]


def rounding_intervals(problem: PosedProblem) -> list[tuple[float, float] | None]:
    """Ends of the rounding interval of each reading, cents over it; None where a reading is not rounded."""
    found: list[tuple[float, float] | None] = []
    for one in problem.posterior.readings:
        ends = zip(cents(one.log_low - one.log_frequency), cents(one.log_high - one.log_frequency), strict=True)
        found += [(float(low), float(high)) if high > low else None for low, high in ends]
    return found
