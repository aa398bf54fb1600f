"""The modes and peaks of a summary: each reading and its posterior prediction."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
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
from bayesplate.results.contract import NOT_IN_JSON, finite_or_none

LabelOrigin = Literal["card", "doubtful", "proposed"]


@dataclass(frozen=True)
class Prediction:
    """The posterior of a frequency: mean and ends of the 90 % interval, Hz."""

    mean: float
    q05: float
    q95: float

    @classmethod
    def of(cls, hertz: NDArray[np.float64]) -> Prediction:
        """The prediction of draws: (n_draws,) array, Hz."""
        low, high = np.quantile(hertz, [0.05, 0.95])
        return cls(float(hertz.mean()), float(low), float(high))


SURE_LABEL = 0.99
"""Confidence from which a label counts as stated without a doubt."""


@dataclass(frozen=True)
class ModeRow:
    """A labelled mode; its numbers are of the posterior, except `left_out_cents` and `leverage`."""

    setup: str
    label: str
    measured_hz: float
    predicted_hz: Prediction
    residual_cents: float  # measured over the posterior mean of the prediction
    # measured over the ends of the predicted 90 % interval, the lower one first
    residual_interval_cents: tuple[float, float]
    # ends of the rounding interval over the reading; None where the reading is not rounded
    rounding_cents: tuple[float, float] | None
    # measured over predicted by the most likely constants of the other readings; None where too few are left. It has no
    # meaning for a mode that alone carries a constant or a size, and no error counts that mode.
    left_out_cents: float | None
    leverage: float  # share of the reading in its own prediction, all free parameters included
    label_correlation: float  # of the mode's shape with the beam functions of its label
    # "card": stated as sure, or nearly; "doubtful": stated with a doubt; "proposed": the likeliest label of a peak
    # without one. `Summary.peaks` has the probabilities of the latter two
    label_origin: LabelOrigin = "card"


def _label_origin(confidence: float) -> LabelOrigin:
    return "card" if confidence >= SURE_LABEL else "doubtful" if confidence else "proposed"


def ratio_cents(measured: float, predicted: float) -> float:
    """Ratio of a measured to a predicted frequency, cents."""
    return float(cents(np.log(measured / predicted)))


def mode_rows(draws: Draws, assessment: Assessment) -> tuple[ModeRow, ...]:
    """One row per labelled mode, setup after setup."""
    problem = draws.problem
    predicted = np.exp(draws.log_frequency).reshape(-1, draws.log_frequency.shape[-1])
    rounding = rounding_intervals(problem)
    placed_readings = [
        (setup.name, reading, place)
        for setup, model in zip(problem.board.setups, problem.posterior.models, strict=True)
        for reading, place in zip(setup.readings, model.places, strict=True)
    ]
    rows = []
    for i, (setup, reading, place) in enumerate(placed_readings):
        hertz = reading.frequency.mean
        prediction = Prediction.of(predicted[:, i])
        row = ModeRow(
            setup=setup,
            label=str(reading.label),
            measured_hz=hertz,
            predicted_hz=prediction,
            residual_cents=ratio_cents(hertz, prediction.mean),
            residual_interval_cents=(ratio_cents(hertz, prediction.q95), ratio_cents(hertz, prediction.q05)),
            rounding_cents=rounding[i],
            left_out_cents=finite_or_none(float(cents(assessment.left_out[i]))),
            leverage=float(assessment.leverages[i]),
            label_correlation=place.correlation,
            label_origin=_label_origin(reading.confidence),
        )
        rows.append(row)
    return tuple(rows)


AnyLabelledRow = TypeVar("AnyLabelledRow", bound="LabelledRow")


class LabelledRow(Protocol):
    """A row with the setup and the label of a mode."""

    @property
    def setup(self) -> str: ...

    @property
    def label(self) -> str: ...


def drop_carrying_modes(rows: Iterable[AnyLabelledRow], carrying: Iterable[CarryingMode]) -> list[AnyLabelledRow]:
    """Rows without the carrying modes, which no other mode predicts: those that count in a leave-one-out error."""
    carried = {(mode.setup, mode.label) for mode in carrying}
    return [row for row in rows if (row.setup, row.label) not in carried]


def rounding_intervals(problem: PosedProblem) -> list[tuple[float, float] | None]:
    """Ends of the rounding interval of each reading, cents over it; None where a reading is not rounded."""
    intervals: list[tuple[float, float] | None] = []
    for readings in problem.posterior.readings:
        ends = zip(
            cents(readings.log_low - readings.log_frequency),
            cents(readings.log_high - readings.log_frequency),
            strict=True,
        )
        intervals += [(float(low), float(high)) if high > low else None for low, high in ends]
    return intervals


UNNAMED_MODE = "cannot tell"
"""Label of a mode whose shape is no clear product of beam functions."""
LEAST_MODE_PROBABILITY = 0.005
"""Probability below which a mode is not listed."""


@dataclass(frozen=True)
class Assignment:
    """A mode that a peak may be, with its probability."""

    label: str
    probability: float
    predicted_hz: float = field(metadata=NOT_IN_JSON)  # of that mode, on average


@dataclass(frozen=True)
class AssignedPeak:
    """A peak without a label or with a doubtful one."""

    setup: str
    hz: float  # reading
    stated: str | None  # label on the card
    assignments: tuple[Assignment, ...]  # the most probable mode first; modes below half a per cent are left out
    spurious_probability: float  # that the peak is no mode of the plate
    predicted_hz: Prediction  # of the most probable mode
    residual_cents: float  # the reading over the mean prediction of that mode


@dataclass(frozen=True)
class PredictedMode:
    """A predicted mode of a setup whose peaks have no sure labels."""

    setup: str
    label: str
    predicted_hz: Prediction
    seen_probability: float  # that one of the peaks is this mode


@dataclass(frozen=True)
class Spectrum:
    """The modes that the peaks of a setup may be, and the prior probabilities of missed modes and spurious peaks."""

    setup: str
    missed_probability: float  # prior, that a mode has no peak
    spurious_probability: float  # prior, that a peak is no mode
    modes: tuple[PredictedMode, ...]  # in the order of frequency, up to a little above the highest peak


def assigned_peaks(draws: Draws) -> tuple[tuple[AssignedPeak, ...], tuple[Spectrum, ...]]:
    """The peaks whose label is not sure, by frequency, and the modes of their setups, averaged over the posterior."""
    problem = draws.problem
    peaks: list[AssignedPeak] = []
    spectra = []
    for i, (setup, likelihood) in enumerate(zip(problem.board.setups, problem.posterior.peaks, strict=True)):
        if likelihood is None:
            continue
        log_frequency = draws.mode_log_frequencies[i]
        flat, noise = log_frequency.reshape(-1, log_frequency.shape[-1]), draws.noise[..., i].ravel()
        predicted = [Prediction.of(np.exp(column)) for column in flat[:, likelihood.columns].T]
        step = max(1, len(flat) // MOST_DRAWS_OF_LABELS)
        probabilities = likelihood.probabilities(flat[::step], noise[::step])
        peaks += _assign_peaks(setup, likelihood, probabilities, predicted)
        seen_probabilities = probabilities.sum(axis=0)
        modes = (
            PredictedMode(setup.name, _label_text(label), prediction, float(probability))
            for label, prediction, probability in zip(likelihood.labels, predicted, seen_probabilities, strict=True)
        )
        sorted_modes = tuple(sorted(modes, key=lambda mode: mode.predicted_hz.mean))
        spectra.append(Spectrum(setup.name, setup.missed, setup.spurious, sorted_modes))
    return tuple(peaks), tuple(spectra)


def _assign_peaks(
    setup: Setup, likelihood: PeakLikelihood, probabilities: NDArray[np.float64], predicted: list[Prediction]
) -> Iterator[AssignedPeak]:
    for i, (row, index) in enumerate(zip(probabilities, likelihood.readings, strict=True)):
        order = np.argsort(-row, kind="stable")
        reading = setup.readings[index] if index >= 0 else None
        stated_label = None if reading is None or not reading.confidence else reading.stated or reading.label
        hertz = float(likelihood.errors.frequency[i])
        best = predicted[order[0]]
        yield AssignedPeak(
            setup=setup.name,
            hz=hertz,
            stated=None if stated_label is None else str(stated_label),
            assignments=tuple(
                Assignment(_label_text(likelihood.labels[j]), float(row[j]), predicted[j].mean)
                for j in order
                if row[j] >= LEAST_MODE_PROBABILITY
            ),
            spurious_probability=float(max(1.0 - row.sum(), 0.0)),
            predicted_hz=best,
            residual_cents=ratio_cents(hertz, best.mean),
        )


def _label_text(label: Label | None) -> str:
    return UNNAMED_MODE if label is None else str(label)
