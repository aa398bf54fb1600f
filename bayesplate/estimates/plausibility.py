"""Prior predictions of a board's frequencies, and mistakes in a card that make all of them wrong together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtrc

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, board_density, vibrating_lengths
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.prior import PriorCard
from bayesplate.board.reading import NO_OFFSET, Reading
from bayesplate.errors import Fault, InputError, NotIdentifiableError
from bayesplate.estimates.least_squares import log_measured, starting_rigidities, with_read_setups
from bayesplate.frequencies.prior_bands import prior_draws, with_rigidities
from bayesplate.frequencies.terms import term_weights
from bayesplate.labels import Label
from bayesplate.plate.beams import N_BEAMS, product_coefficients

FASTEST_SOUND = 15_000.0
"""Speed of sound in m/s that stiffness and density may imply: 5,000 in spruce and steel, 13,000 in carbon fibre."""

SLOWEST_SOUND = 50.0
"""The same from below, in the stiffer direction: foams have some hundreds."""


@dataclass(frozen=True)
class CardMistake:
    """A mistake that makes all readings wrong together, and the question to ask."""

    question: str
    frequency: float = 1.0  # frequencies as stated by the card, over the true ones in Hz
    wrong: tuple[tuple[str, float], ...] = ()  # inputs, and the value that the card states over the true value
    exchanged: tuple[str, ...] = ()  # two inputs, or two rigidities
    is_transposed: bool = False  # labels (m,n) are written as (n,m)
    first_label: Label = NO_OFFSET  # where the labels begin, if not where the card says

    @property
    def is_of_a_unit(self) -> bool:
        return self.frequency != 1.0 or bool(self.wrong)

    @property
    def speed(self) -> float:
        """Speed of sound that the card implies, over the true one: it goes with length^2 / thickness."""
        wrong = dict(self.wrong)
        return float(self.frequency * wrong.get("length_x", 1.0) ** 2 / wrong.get("thickness", 1.0))

    def corrected(self, values: Mapping[str, Floats]) -> dict[str, Floats]:
        stated_values = {name: value for name, value in values.items() if name not in RIGIDITIES or "E_x" not in values}
        inputs = with_rigidities(stated_values | {name: values[name] / factor for name, factor in self.wrong})
        coupling = inputs["poisson_xy"] * inputs["D_y"]
        inputs |= dict(zip(self.exchanged, [inputs[name] for name in reversed(self.exchanged)], strict=True))
        return inputs | {"poisson_xy": coupling / inputs["D_y"]}

    def beams(self, reading: Reading, first: Label) -> tuple[int, int]:
        """Orders of the beam functions that a label would name; negative where there is no such mode."""
        label = reading.label
        if self.first_label != NO_OFFSET:
            return label.m - self.first_label.m, label.n - self.first_label.n
        return (label.n - first.m, label.m - first.n) if self.is_transposed else reading.beams


_SIDES = ("length_x", "length_y")
_LENGTHS = (*_SIDES, "thickness")
CARD_MISTAKES = (
    CardMistake("in rad/s? in Hz they are that over 2 pi = 6.28", frequency=2.0 * np.pi),
    CardMistake("in kHz? 1 kHz is 1000 Hz", frequency=1e-3),
    CardMistake("are length_x_mm and length_y_mm in cm? 1 cm is 10 mm", wrong=tuple((side, 0.1) for side in _SIDES)),
    CardMistake("are length_x_mm and length_y_mm ten times too large?", wrong=tuple((side, 10.0) for side in _SIDES)),
    CardMistake("is thickness_mm ten times too large?", wrong=(("thickness", 10.0),)),
    CardMistake("is thickness_mm ten times too small?", wrong=(("thickness", 0.1),)),
    CardMistake("are all three lengths in cm?", wrong=tuple((size, 0.1) for size in _LENGTHS)),
    CardMistake("are all three lengths ten times too large?", wrong=tuple((size, 10.0) for size in _LENGTHS)),
    CardMistake(
        "are length_x_mm and length_y_mm in inches? 1 inch is 25.4 mm", wrong=tuple((side, 1 / 25.4) for side in _SIDES)
    ),
    CardMistake(
        "are all three lengths in inches? 1 inch is 25.4 mm", wrong=tuple((size, 1 / 25.4) for size in _LENGTHS)
    ),
    CardMistake("is thickness_mm in thousandths of an inch? 118 of them are 3 mm", wrong=(("thickness", 1 / 0.0254),)),
    CardMistake("are the constants of the prior in MPa? 1 GPa is 1000 MPa", frequency=1e-3**0.5),
    CardMistake("are length_x_mm and length_y_mm exchanged? x is along the grain", exchanged=_SIDES),
    CardMistake("is y along the grain in all of the card? x should be", exchanged=("D_x", "D_y")),
    CardMistake("are all labels (m,n) written as (n,m)?", is_transposed=True),
    CardMistake("does m count from 1 in all labels? then first_label = [1, 0]", first_label=Label(1, 0)),
    CardMistake("does n count from 1 in all labels? then first_label = [0, 1]", first_label=Label(0, 1)),
    CardMistake("do m and n count from 1 in all labels? then first_label = [1, 1]", first_label=Label(1, 1)),
)
"""Mistakes that make all frequencies wrong, and mistakes that exchange lengths or constants."""

_NO_MISTAKE = CardMistake("")

_SLACK = 0.1
"""Relative error of Rayleigh quotients, noise and unmodelled effects together."""

_IMPROBABLE, _PROBABLE = 1e-4, 1e-2
_NEAR_DISTANCE = 6.0  # a factor 20 of the density
_N_DRAWS = 4000
_FEWEST_POSSIBLE = 0.05
"""Least share of draws that are a possible material: fewer do not represent the prior."""

_FEWEST_OTHERS, _MOST_STRAYS = 4, 2
"""Least number of other readings for a question about a single reading, and most readings to ask about together."""

_BAND = (0.025, 0.975)


@dataclass(frozen=True, eq=False)
class PriorPredictive:
    """Prior predictive distribution of a board's readings."""

    draws: Floats  # (n_draws, n_readings) ln f (Hz), setup after setup; a row shares its constants

    @property
    def median(self) -> Floats:
        return np.median(self.draws, axis=0)

    @property
    def spread(self) -> Floats:
        return self.draws.std(axis=0)

    def distance(self, log_frequencies: Floats) -> float:
        """Squared distance of readings from the middle of the draws, in units of their joint spread.

        About chi-squared with a degree of freedom for each reading where the prior holds.
        """
        offsets = log_frequencies - self.draws.mean(axis=0)
        return float(offsets @ np.linalg.solve(self._covariance, offsets))

    def without(self, reading: int, log_frequencies: Floats) -> tuple[float, float]:
        """Distance of all readings but one, and the ln f that they predict for that one."""
        other_readings = np.delete(np.arange(log_frequencies.size), reading)
        offsets = log_frequencies[other_readings] - self.draws.mean(axis=0)[other_readings]
        weights = np.linalg.solve(self._covariance[np.ix_(other_readings, other_readings)], offsets)
        expected = self.draws[:, reading].mean() + self._covariance[reading, other_readings] @ weights
        return float(offsets @ weights), float(expected)

    @cached_property
    def _covariance(self) -> Floats:
        return np.atleast_2d(np.cov(self.draws, rowvar=False)) + _SLACK**2 * np.eye(self.draws.shape[1])


def prior_predictive(
    board: Board, prior: PriorCard, rng: np.random.Generator, mistakes: Sequence[CardMistake] = (_NO_MISTAKE,)
) -> list[PriorPredictive | None]:
    """Frequencies of a board's labelled modes under its prior, from Rayleigh quotients of beam-function products.

    Frequencies are those of the bare thin plate and err by a few per cent; uncertain inputs are drawn too. One result
    for each of the `mistakes`, which is corrected first; None where a label would name no mode, or too few
    draws are a material.
    """
    values = prior_draws(board, prior, rng, _N_DRAWS)
    products = [product_coefficients(setup.ends_x, setup.ends_y) for setup in board.setups]
    return [_predict_readings(board, products, values, mistake) for mistake in mistakes]


def _predict_readings(
    board: Board, products: Sequence[Floats], values: Mapping[str, Floats], mistake: CardMistake
) -> PriorPredictive | None:
    corrected, columns = mistake.corrected(values), []
    for setup, coefficients in zip(board.setups, products, strict=True):
        if not all((length > 0.0).all() for length in vibrating_lengths(corrected, setup)):
            return None
        weights = term_weights(corrected, setup).stiffness
        for reading in setup.readings:
            i, j = mistake.beams(reading, setup.first_label)
            if min(i, j) < 0 or max(i, j) >= N_BEAMS:
                return None
            columns.append(weights @ coefficients[:, i, j])
    squared = np.column_stack(columns)
    is_possible = np.all(np.isfinite(squared) & (squared > 0), axis=1)
    if is_possible.mean() < _FEWEST_POSSIBLE:
        return None
    log_hertz = 0.5 * np.log(squared[is_possible]) - np.log(2.0 * np.pi)
    return PriorPredictive(log_hertz + np.log(mistake.frequency))


def require_plausible(board: Board, prior: PriorCard, rng: np.random.Generator) -> None:
    """Refuse a card whose readings are all wrong by one mistake, with a question about it, or that is impossible.

    The question is asked where the readings are out of the prior's reach, or would need a material that does not exist,
    and correcting one of `CARD_MISTAKES` brings them within reach. A card is refused in any case where no material
    carries sound so fast or so slowly. InputError for units and for the impossible, NotIdentifiableError for sides,
    constants or orders that are exchanged.
    """
    board = with_read_setups(board)  # the others are refused later, or still to be measured
    if not board.setups:
        return
    speed, ratio = speed_and_ratio(board)
    is_material = bool(board.nominal()["poisson_xy"] ** 2 * ratio < 1.0)
    fault = _prior_fault(board, prior, speed, rng) if is_material else _material_fault(board, ratio)
    if fault is None:
        return
    likely_mistakes = _likeliest_mistakes(
        board,
        prior,
        [
            mistake
            for mistake in CARD_MISTAKES
            if SLOWEST_SOUND < speed / mistake.speed < FASTEST_SOUND and (is_material or not mistake.is_of_a_unit)
        ],
        rng,
    )
    questions = [mistake.question for mistake in likely_mistakes]
    if not is_material and not likely_mistakes:
        questions = _stray_questions(board, prior, rng)
    refusal = replace(fault, remedy="; ".join(filter(None, (*questions, fault.remedy))))
    if any(mistake.is_of_a_unit for mistake in likely_mistakes):
        raise InputError(refusal)
    if likely_mistakes or not is_material:
        raise NotIdentifiableError(str(refusal))
    if not SLOWEST_SOUND < speed < FASTEST_SOUND:
        raise InputError(refusal)


def _likeliest_mistakes(
    board: Board, prior: PriorCard, mistakes: Sequence[CardMistake], rng: np.random.Generator
) -> list[CardMistake]:
    """Mistakes whose correction brings the readings within the prior's reach: the best one, and all almost as good."""
    measured = log_measured(board)
    predictives = prior_predictive(board, prior, rng, mistakes)
    distances = [np.inf if predictive is None else predictive.distance(measured) for predictive in predictives]
    nearest = min(distances, default=np.inf)
    if chdtrc(measured.size, nearest) < _PROBABLE:
        return []
    return [
        mistake for mistake, distance in zip(mistakes, distances, strict=True) if distance < nearest + _NEAR_DISTANCE
    ]


def _stray_questions(board: Board, prior: PriorCard, rng: np.random.Generator) -> list[str]:
    """Questions about a single wrong reading, without which the others are within the prior's reach."""
    (predictive,) = prior_predictive(board, prior, rng)
    measured = log_measured(board)
    if predictive is None or measured.size <= _FEWEST_OTHERS:
        return []
    predictions = [predictive.without(i, measured) for i in range(measured.size)]
    nearest = min(distance for distance, _ in predictions)
    if chdtrc(measured.size - 1, nearest) < _PROBABLE:
        return []
    questions = [
        f"is {name} at {np.exp(log_f):.4g} Hz right? the others expect about {float(f'{np.exp(expected):.2g}'):g} Hz"
        for name, log_f, (distance, expected) in zip(board.short_reading_names, measured, predictions, strict=True)
        if distance < nearest + _NEAR_DISTANCE
    ]
    return questions if len(questions) <= _MOST_STRAYS else []


def _material_fault(board: Board, ratio: float) -> Fault:
    """The fault that the ratio of the constants is larger than nu_xy allows for any material."""
    wanted = (
        f"a plate of a material: nu_xy nu_yx is below 1, so E_y below {board.nominal()['poisson_xy'] ** -2:.3g} E_x"
    )
    return Fault(f"{board.name}.toml", wanted, f"frequencies with E_y about {ratio:.3g} E_x", "or a smaller poisson_xy")


def _prior_fault(board: Board, prior: PriorCard, speed: float, rng: np.random.Generator) -> Fault | None:
    """The fault that no material carries sound as the readings imply, or that they are out of the prior's reach."""
    place = f"{board.name}.toml frequencies_hz"
    if not SLOWEST_SOUND < speed < FASTEST_SOUND:
        wanted = f"those of a material that carries sound at {SLOWEST_SOUND:g} to {FASTEST_SOUND:g} m/s"
        return Fault(place, wanted, f"{speed:.3g} m/s", "are units, sizes and labels right?")
    measured = log_measured(board)
    (predicted,) = prior_predictive(board, prior, rng)
    if predicted is None or chdtrc(measured.size, predicted.distance(measured)) > _IMPROBABLE:
        return None
    readings = [reading for setup in board.setups for reading in setup.readings]
    worst = int(np.argmax(np.abs(measured - predicted.median) / np.hypot(predicted.spread, _SLACK)))
    low, high = np.exp(np.quantile(predicted.draws[:, worst], _BAND))
    wanted = f"those that the prior '{prior.name}' foretells, {readings[worst].label} at {low:.3g} to {high:.3g} Hz"
    stated = f"{readings[worst].frequency.mean:.4g} Hz"
    return Fault(place, wanted, stated, "or another prior, if nothing is wrong")


def speed_and_ratio(board: Board) -> tuple[float, float]:
    """Speed of sound in the stiffer direction, sqrt(12 D / rho h^3) in m/s, and D_y / D_x, from rough rigidities."""
    values = board.nominal()
    D_x, D_y, _ = starting_rigidities(board)
    return float(np.sqrt(12.0 * max(D_x, D_y) / (board_density(values) * values["thickness"] ** 3))), float(D_y / D_x)
