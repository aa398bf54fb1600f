"""What a board's prior foretells of its frequencies, and the one mistake that makes all of them wrong together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, density
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.prior import PriorCard
from bayesplate.board.reading import NO_OFFSET, Reading
from bayesplate.errors import Fault, InputError, NotIdentifiableError
from bayesplate.estimates.least_squares import log_measured, starting_rigidities
from bayesplate.frequencies.prior_bands import prior_draws, with_rigidities
from bayesplate.frequencies.terms import term_weights
from bayesplate.labels import Label
from bayesplate.plate.beams import N_BEAMS, product_coefficients

FASTEST = 15_000.0
"""Speed of sound in m/s that stiffness and density may imply: 5,000 in spruce and steel, 13,000 in carbon fibre."""

SLOWEST = 50.0
"""The same from below, in the stiffer direction: foams have some hundreds."""


@dataclass(frozen=True)
class Suspect:
    """One mistake that makes all readings wrong together, and the question to ask."""

    question: str
    frequency: float = 1.0  # what the frequencies on the card are, over what they would be in Hz
    wrong: tuple[tuple[str, float], ...] = ()  # inputs, and what the card says of each over what it would be
    exchanged: tuple[str, ...] = ()  # two inputs, or two rigidities
    is_transposed: bool = False  # labels (m,n) are written as (n,m)
    first_label: Label = NO_OFFSET  # where the labels begin, if not where the card says

    @property
    def is_of_a_unit(self) -> bool:
        return self.frequency != 1.0 or bool(self.wrong)

    @property
    def speed(self) -> float:
        """The speed of sound that the card implies, over what it would be: of the side's square over the thickness."""
        wrong = dict(self.wrong)
        return float(self.frequency * wrong.get("length_x", 1.0) ** 2 / wrong.get("thickness", 1.0))

    def mended(self, values: Mapping[str, Floats]) -> dict[str, Floats]:
        stated = {name: value for name, value in values.items() if name not in RIGIDITIES or "E_x" not in values}
        found = with_rigidities(stated | {name: values[name] / factor for name, factor in self.wrong})
        coupling = found["poisson_xy"] * found["D_y"]
        found |= dict(zip(self.exchanged, [found[name] for name in reversed(self.exchanged)], strict=True))
        return found | {"poisson_xy": coupling / found["D_y"]}

    def beams(self, reading: Reading, first: Label) -> tuple[int, int]:
        """Orders of the beam functions that a label would name; negative where there is no such mode."""
        label = reading.label
        if self.first_label != NO_OFFSET:
            return label.m - self.first_label.m, label.n - self.first_label.n
        return (label.n - first.m, label.m - first.n) if self.is_transposed else reading.beams


_SIDES = ("length_x", "length_y")
_LENGTHS = (*_SIDES, "thickness")
SUSPECTS = (
    Suspect("in rad/s? in Hz they are that over 2 pi = 6.28", frequency=2.0 * np.pi),
    Suspect("in kHz? 1 kHz is 1000 Hz", frequency=1e-3),
    Suspect("are length_x_mm and length_y_mm in cm? 1 cm is 10 mm", wrong=tuple((side, 0.1) for side in _SIDES)),
    Suspect("are length_x_mm and length_y_mm ten times too large?", wrong=tuple((side, 10.0) for side in _SIDES)),
    Suspect("is thickness_mm ten times too large?", wrong=(("thickness", 10.0),)),
    Suspect("is thickness_mm ten times too small?", wrong=(("thickness", 0.1),)),
    Suspect("are all three lengths in cm?", wrong=tuple((size, 0.1) for size in _LENGTHS)),
    Suspect("are all three lengths ten times too large?", wrong=tuple((size, 10.0) for size in _LENGTHS)),
    Suspect(
        "are length_x_mm and length_y_mm in inches? 1 inch is 25.4 mm", wrong=tuple((side, 1 / 25.4) for side in _SIDES)
    ),
    Suspect("are all three lengths in inches? 1 inch is 25.4 mm", wrong=tuple((size, 1 / 25.4) for size in _LENGTHS)),
    Suspect("is thickness_mm in thousandths of an inch? 118 of them are 3 mm", wrong=(("thickness", 1 / 0.0254),)),
    Suspect("are the constants of the prior in MPa? 1 GPa is 1000 MPa", frequency=1e-3**0.5),
    Suspect("are length_x_mm and length_y_mm exchanged? x is along the grain", exchanged=_SIDES),
    Suspect("is y along the grain in all of the card? x should be", exchanged=("D_x", "D_y")),
    Suspect("are all labels (m,n) written as (n,m)?", is_transposed=True),
    Suspect("does m count from 1 in all labels? then first_label = [1, 0]", first_label=Label(1, 0)),
    Suspect("does n count from 1 in all labels? then first_label = [0, 1]", first_label=Label(0, 1)),
    Suspect("do m and n count from 1 in all labels? then first_label = [1, 1]", first_label=Label(1, 1)),
)
"""What makes all frequencies wrong by one mistake, and lengths and constants that one mistake exchanges."""

_AS_STATED = Suspect("")

_SLACK = 0.1
"""Relative error of a Rayleigh quotient, of the noise, and of what an effect that is not modelled does, in all."""

_IMPROBABLE, _PROBABLE = 1e-4, 1e-2
_AS_NEAR = 6.0  # a factor 20 of the density
_N_DRAWS = 4000
_FEWEST_POSSIBLE = 0.05
"""Share of the draws that must be of a material: elsewhere those few say nothing of the others."""

_FEWEST_OTHERS, _MOST_STRAYS = 4, 2
"""Readings beside one that is asked about, at least; and readings asked about, at most: more say nothing."""

_WITHIN = (0.025, 0.975)


@dataclass(frozen=True, eq=False)
class PriorPredictive:
    """What the prior of a board foretells of its readings."""

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
        off = log_frequencies - self.draws.mean(axis=0)
        return float(off @ np.linalg.solve(self._covariance, off))

    def without(self, reading: int, log_frequencies: Floats) -> tuple[float, float]:
        """Distance of all readings but one, and ln f that they expect of that one."""
        others = np.delete(np.arange(log_frequencies.size), reading)
        off = log_frequencies[others] - self.draws.mean(axis=0)[others]
        pulled = np.linalg.solve(self._covariance[np.ix_(others, others)], off)
        expected = self.draws[:, reading].mean() + self._covariance[reading, others] @ pulled
        return float(off @ pulled), float(expected)

    @property
    def _covariance(self) -> Floats:
        return np.atleast_2d(np.cov(self.draws, rowvar=False)) + _SLACK**2 * np.eye(self.draws.shape[1])


def prior_predictive(
    board: Board, prior: PriorCard, rng: np.random.Generator, suspects: Sequence[Suspect] = (_AS_STATED,)
) -> list[PriorPredictive | None]:
    """Frequencies of a board's labelled modes under its prior, from Rayleigh quotients of beam-function products.

    A few per cent off each frequency, of the bare thin plate; inputs that are uncertain are drawn too. One result for
    each mistake that is mended first; None where a label would name no mode, or no draw is a material.
    """
    values = prior_draws(board, prior, rng, _N_DRAWS)
    products = [product_coefficients(setup.ends_x, setup.ends_y) for setup in board.setups]
    return [_predicted(board, products, values, suspect) for suspect in suspects]


def _predicted(
    board: Board, products: Sequence[Floats], values: Mapping[str, Floats], suspect: Suspect
) -> PriorPredictive | None:
    mended, columns = suspect.mended(values), []
    for setup, coefficients in zip(board.setups, products, strict=True):
        weights = term_weights(mended, setup).stiffness
        for reading in setup.readings:
            i, j = suspect.beams(reading, setup.first_label)
            if min(i, j) < 0 or max(i, j) >= N_BEAMS:
                return None
            columns.append(weights @ coefficients[:, i, j])
    squared = np.column_stack(columns)
    possible = np.all(np.isfinite(squared) & (squared > 0), axis=1)
    if possible.mean() < _FEWEST_POSSIBLE:
        return None
    hertz = 0.5 * np.log(squared[possible]) - np.log(2.0 * np.pi)
    return PriorPredictive(hertz + np.log(suspect.frequency))


def require_plausible(board: Board, prior: PriorCard, rng: np.random.Generator) -> None:
    """Ask about the one mistake that makes all readings wrong together, where there is one; refuse the impossible.

    Asked where the readings are out of the prior's reach, or would need a material that there is not, and mending one
    of `SUSPECTS` brings them within it. Refused in any case where no material carries sound so fast or so slowly.
    InputError for units and for the impossible, NotIdentifiableError for sides, constants or orders that stand for each
    other.
    """
    if not all(setup.readings for setup in board.setups):  # refused later, or still to be measured
        return
    speed, ratio = speed_and_ratio(board)
    is_material = bool(board.nominal()["poisson_xy"] ** 2 * ratio < 1.0)
    fault = _contradiction(board, prior, speed, rng) if is_material else _no_material(board, ratio)
    if fault is None:
        return
    likeliest = _likeliest(
        board,
        prior,
        [one for one in SUSPECTS if SLOWEST < speed / one.speed < FASTEST and (is_material or not one.is_of_a_unit)],
        rng,
    )
    questions = [one.question for one in likeliest]
    if not is_material and not likeliest:
        questions = _strays(board, prior, rng)
    asked = replace(fault, remedy="; ".join(filter(None, (*questions, fault.remedy))))
    if any(one.is_of_a_unit for one in likeliest):
        raise InputError(asked)
    if likeliest or not is_material:
        raise NotIdentifiableError(str(asked))
    if not SLOWEST < speed < FASTEST:
        raise InputError(asked)


def _likeliest(board: Board, prior: PriorCard, suspects: Sequence[Suspect], rng: np.random.Generator) -> list[Suspect]:
    """The suspects that bring the readings within the prior's reach, all that are hardly farther off than the best."""
    measured = log_measured(board)
    mended = prior_predictive(board, prior, rng, suspects)
    distances = [np.inf if found is None else found.distance(measured) for found in mended]
    nearest = min(distances, default=np.inf)
    if chdtrc(measured.size, nearest) < _PROBABLE:
        return []
    return [one for one, distance in zip(suspects, distances, strict=True) if distance < nearest + _AS_NEAR]


def _strays(board: Board, prior: PriorCard, rng: np.random.Generator) -> list[str]:
    """Questions after the one reading without which the others are within the prior's reach; none where any may be."""
    (found,) = prior_predictive(board, prior, rng)
    measured = log_measured(board)
    if found is None or measured.size <= _FEWEST_OTHERS:
        return []
    alone = [found.without(i, measured) for i in range(measured.size)]
    nearest = min(distance for distance, _ in alone)
    if chdtrc(measured.size - 1, nearest) < _PROBABLE:
        return []
    asked = [
        f"is {name} at {np.exp(read):.4g} Hz right? the others expect about {float(f'{np.exp(expected):.2g}'):g} Hz"
        for name, read, (distance, expected) in zip(board.short_reading_names, measured, alone, strict=True)
        if distance < nearest + _AS_NEAR
    ]
    return asked if len(asked) <= _MOST_STRAYS else []


def _no_material(board: Board, ratio: float) -> Fault:
    """The fault that the ratio of the constants is larger than nu_xy allows: no material is like that."""
    wanted = (
        f"a plate of a material: nu_xy nu_yx is below 1, so E_y below {board.nominal()['poisson_xy'] ** -2:.3g} E_x"
    )
    return Fault(f"{board.name}.toml", wanted, f"frequencies with E_y about {ratio:.3g} E_x", "or a smaller poisson_xy")


def _contradiction(board: Board, prior: PriorCard, speed: float, rng: np.random.Generator) -> Fault | None:
    """The fault that no material carries sound as the readings want, or that they are out of the prior's reach."""
    place = f"{board.name}.toml frequencies_hz"
    if not SLOWEST < speed < FASTEST:
        wanted = f"those of a material that carries sound at {SLOWEST:g} to {FASTEST:g} m/s"
        return Fault(place, wanted, f"{speed:.3g} m/s", "are units, sizes and labels right?")
    measured = log_measured(board)
    (predicted,) = prior_predictive(board, prior, rng)
    if predicted is None or chdtrc(measured.size, predicted.distance(measured)) > _IMPROBABLE:
        return None
    readings = [reading for setup in board.setups for reading in setup.readings]
    worst = int(np.argmax(np.abs(measured - predicted.median) / np.hypot(predicted.spread, _SLACK)))
    low, high = np.exp(np.quantile(predicted.draws[:, worst], _WITHIN))
    wanted = f"those that the prior '{prior.name}' foretells, {readings[worst].label} at {low:.3g} to {high:.3g} Hz"
    got = f"{readings[worst].frequency.mean:.4g} Hz"
    return Fault(place, wanted, got, "or another prior, if nothing is wrong")


def speed_and_ratio(board: Board) -> tuple[float, float]:
    """Speed of sound in the stiffer direction, sqrt(12 D / rho h^3) in m/s, and D_y / D_x, from rough rigidities."""
    values = board.nominal()
    D_x, D_y, _ = starting_rigidities(board)
    return float(np.sqrt(12.0 * max(D_x, D_y) / (density(values) * values["thickness"] ** 3))), float(D_y / D_x)
