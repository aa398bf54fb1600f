"""The modes and peaks of a summary: each reading beside what the fitted model predicts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.setup import Setup
from bayesplate.estimates.leave_one_out import CarryingMode
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.labels import Label
from bayesplate.posterior.assessment import Assessment
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.likely_labels import MOST_DRAWS_OF_LABELS
from bayesplate.posterior.posing import PosedProblem
from bayesplate.results.contract import finite

LabelOrigin = Literal["card", "doubtful", "proposed"]


@dataclass(frozen=True)
class Prediction:
    """What the posterior says of a frequency, Hz."""

    mean: float
    q05: float
    q95: float

    @classmethod
    def of(cls, hertz: NDArray[np.float64]) -> Prediction:
        """That of draws: (n_draws,) array, Hz."""
        low, high = np.quantile(hertz, [0.05, 0.95])
        return cls(float(hertz.mean()), float(low), float(high))


@dataclass(frozen=True)
class ModeRow:
    """A labelled mode; but for `left_out_cents` and `leverage` every number belongs to the posterior."""

    setup: str
    label: str
    measured_hz: float
    predicted_hz: Prediction
    residual_cents: float  # measured over the posterior mean of the prediction
    # measured over the ends of the predicted 90 % interval, the lower one first
    residual_interval_cents: tuple[float, float]
    # ends of the rounding interval over the reading; None where it is not rounded
    rounding_cents: tuple[float, float] | None
    # measured over predicted by the most likely constants of the other readings; None where too few are left. Of a mode
    # that alone carries a constant or a size it says nothing, and no error counts it.
    left_out_cents: float | None
    leverage: float  # share of the mode in its own prediction, what else is free counted in
    label_correlation: float  # of the mode's shape with what its label names
    # whether the card states the label as sure or with a doubt, or the peak has none and this one is its likeliest; the
    # probabilities of the latter two stand in `Summary.peaks`
    label_origin: LabelOrigin = "card"


def over(measured: float, predicted: float) -> float:
    """A frequency over another, cents."""
    return float(cents(np.log(measured / predicted)))


def mode_rows(problem: PosedProblem, draws: Draws, assessment: Assessment) -> tuple[ModeRow, ...]:
    """One row per labelled mode, setup after setup."""
    predicted = np.exp(draws.log_frequency).reshape(-1, draws.log_frequency.shape[-1])
    rounding = rounding_intervals(problem)
    rows = [
        (setup.name, reading, place)
        for setup, model in zip(problem.board.setups, problem.posterior.models, strict=True)
        for reading, place in zip(setup.readings, model.places, strict=True)
    ]
    made = []
    for i, (setup, reading, place) in enumerate(rows):
        hertz = reading.frequency.mean
        prediction = Prediction.of(predicted[:, i])
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
    def setup(self) -> str: ...

    @property
    def label(self) -> str: ...


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


UNNAMED = "cannot tell"
"""A mode whose shape is no clear product of beam functions."""
LEAST = 0.005
"""Probability below which a mode is not listed."""


@dataclass(frozen=True)
class Assignment:
    """A mode that a peak may be, and the probability that it is."""

    label: str
    probability: float


@dataclass(frozen=True)
class AssignedPeak:
    """A peak without a label, or with one that may be wrong."""

    setup: str
    hz: float  # as read
    stated: str | None  # its label on the card
    assignments: tuple[Assignment, ...]  # the most probable mode first; those below half a per cent are left out
    spurious_probability: float  # that it is no mode of the plate
    predicted_hz: Prediction  # of its most probable mode
    residual_cents: float  # the peak over that mode's mean


@dataclass(frozen=True)
class PredictedMode:
    """A mode that peaks may be."""

    setup: str
    label: str
    predicted_hz: Prediction
    seen_probability: float  # that one of the peaks is this mode


@dataclass(frozen=True)
class Spectrum:
    """How the peaks of a setup were taken for modes."""

    setup: str
    missed_probability: float  # beforehand, that a mode left no peak
    spurious_probability: float  # beforehand, that a peak is no mode
    modes: tuple[PredictedMode, ...]  # in the order of frequency, up to a little above the highest peak


def assigned_peaks(problem: PosedProblem, draws: Draws) -> tuple[tuple[AssignedPeak, ...], tuple[Spectrum, ...]]:
    """Every peak whose label is not sure, by frequency, and the modes of its setup, averaged over the posterior."""
    peaks: list[AssignedPeak] = []
    spectra = []
    for i, (setup, likelihood) in enumerate(zip(problem.board.setups, problem.posterior.peaks, strict=True)):
        if likelihood is None:
            continue
        every = draws.every_log_frequency[i]
        flat, noise = every.reshape(-1, every.shape[-1]), draws.noise[..., i].ravel()
        predicted = [Prediction.of(np.exp(column)) for column in flat[:, likelihood.columns].T]
        step = max(1, len(flat) // MOST_DRAWS_OF_LABELS)
        probabilities = likelihood.probabilities(flat[::step], noise[::step])
        peaks += _of_setup(setup, likelihood, probabilities, predicted)
        seen = probabilities.sum(axis=0)
        modes = (
            PredictedMode(setup.name, _name(label), one, float(share))
            for label, one, share in zip(likelihood.labels, predicted, seen, strict=True)
        )
        in_order = tuple(sorted(modes, key=lambda mode: mode.predicted_hz.mean))
        spectra.append(Spectrum(setup.name, setup.missed, setup.spurious, in_order))
    return tuple(peaks), tuple(spectra)


def _of_setup(
    setup: Setup, likelihood: PeakLikelihood, probabilities: NDArray[np.float64], predicted: list[Prediction]
) -> Iterator[AssignedPeak]:
    for i, (row, at) in enumerate(zip(probabilities, likelihood.readings, strict=True)):
        order = np.argsort(-row, kind="stable")
        reading = setup.readings[at] if at >= 0 else None
        stated = None if reading is None or not reading.confidence else reading.stated or reading.label
        hertz = float(likelihood.errors.frequency[i])
        best = predicted[order[0]]
        yield AssignedPeak(
            setup=setup.name,
            hz=hertz,
            stated=None if stated is None else str(stated),
            assignments=tuple(Assignment(_name(likelihood.labels[j]), float(row[j])) for j in order if row[j] >= LEAST),
            spurious_probability=float(max(1.0 - row.sum(), 0.0)),
            predicted_hz=best,
            residual_cents=over(hertz, best.mean),
        )


def _name(label: Label | None) -> str:
    return UNNAMED if label is None else str(label)
