"""What to measure next: the further readings that would tell the surviving explanations apart, or make them visible."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.shifts.forms import Form
from bayesplate.effects.words import effect_names
from bayesplate.estimates.least_squares import reading_scales
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import system_of
from bayesplate.labels import Label
from bayesplate.plate.board import Board, Values
from bayesplate.plate.material import RIGIDITIES
from bayesplate.plate.setup import DEFAULT_NOISE, Reading, Setup
from bayesplate.quantities import Quantity

Floats = NDArray[np.float64]

_FURTHER_MODES = 3
_FREE_MODES = 6
_SEARCHED = 24
_MOST_EFFECTS = 4


@dataclass(frozen=True, eq=False)
class Option:
    """Further readings, and what they would show.

    Attributes
    ----------
    sentence : str
        What to measure.
    likeness : float
        Largest |cos| between the visible parts of two of the effects asked about; 0 for a single one.
    visibility : float
        Smallest visible rms among them, in units of the rms below which a visible part drowns in the noise.
    """

    sentence: str
    likeness: float
    visibility: float


def options(found: Found, effects: Sequence[str]) -> tuple[Option, ...]:
    """What each way to go on measuring would show of some effects, by full solves at their nominal sizes.

    Parameters
    ----------
    found : Found
    effects : sequence of str
        Names of candidates.

    Returns
    -------
    tuple of Option
        The readings as they are first, their sentence empty.
    """
    baseline = found.ground.baseline
    asked = [found.ground.candidates[name].laws[0].form for name in effects if name in found.ground.candidates]
    return tuple(
        _judged(sentence, board, baseline.values, asked[:_MOST_EFFECTS])
        for sentence, board in _boards(baseline.board, baseline.values)
    )


def recommendation(found: Found, effects: Sequence[str]) -> str:
    """One sentence: what to measure next, and why.

    Parameters
    ----------
    found : Found
    effects : sequence of str
        The explanations that are left, or the effects that cannot be seen; at most four are looked at.
    """
    judged = options(found, effects)
    if len(judged) < 2 or not effects:
        return "Measure the same modes again on another day: the spread between sessions is the noise to expect."
    now, further = judged[0], judged[1:]
    if len(effects) > 1 and now.visibility >= 1.0:
        best = min(further, key=lambda option: option.likeness)
        if best.likeness < now.likeness:
            return (
                f"{best.sentence}: the largest likeness among {effect_names(effects[:_MOST_EFFECTS])} would fall from "
                f"{now.likeness:.2f} to {best.likeness:.2f}."
            )
    best = max(further, key=lambda option: option.visibility)
    return (
        f"{best.sentence}: the least visible of {effect_names(effects[:_MOST_EFFECTS])} would show with "
        f"{best.visibility:.1f} times the smallest trace that can be seen, {now.visibility:.1f} times now."
    )


def _boards(board: Board, values: Values) -> Iterator[tuple[str, Board]]:
    """The board as it was measured, and with further readings where the model expects them."""
    yield "", board
    for setup in board.setups:
        more = _next_modes(board, setup, values, _FURTHER_MODES)
        if len(more) == _FURTHER_MODES:
            names = ", ".join(str(reading.label) for reading in more)
            longer = replace(setup, readings=(*setup.readings, *more))
            setups = tuple(longer if one is setup else one for one in board.setups)
            where = f" in setup {setup.name}" if len(board.setups) > 1 else ""
            yield f"Measure modes {names} as well{where}", replace(board, setups=setups)
    if not any(setup.is_free for setup in board.setups):
        free = Setup("free", ("free", "free"), ("free", "free"), (), DEFAULT_NOISE, attached=board.setups[0].attached)
        longer = replace(free, readings=_next_modes(board, free, values, _FREE_MODES))
        sentence = f"Measure the {_FREE_MODES} lowest modes of the same board with all edges free"
        yield sentence, replace(board, setups=(*board.setups, longer))


def _next_modes(board: Board, setup: Setup, values: Values, n: int) -> tuple[Reading, ...]:
    """The lowest modes with a clear name that were not read."""
    _, named = spectrum(system_of(board, setup), _with_effects(board, setup, values), _SEARCHED)
    taken = set(setup.labels)
    first = setup.first_label
    new = [one for one in named if one.label is not None and one.label not in taken]
    return tuple(
        Reading(one.label, (one.label.m - first.m, one.label.n - first.n), Quantity.exact(one.frequency))
        for one in new[:n]
        if isinstance(one.label, Label)
    )


def _with_effects(board: Board, setup: Setup, values: Values) -> Values:
    """Values that also hold the declared effects' parameters in a setup that was not measured."""
    missing: dict[str, Floats] = {}
    for effect in system_of(board, setup).effects:
        for parameter in effect.parameters():
            if parameter.name not in values:
                missing[parameter.name] = np.asarray(parameter.prior.median)
    return {**values, **missing}


def _judged(sentence: str, board: Board, values: Values, asked: Sequence[Form]) -> Option:
    bare, slopes = _solved(board, values)
    scales = reading_scales(board)
    absorbing = np.linalg.pinv(slopes / scales[:, None]) / scales
    visible = []
    for form in asked:
        with_form = _carrying(board, form)
        there = _at_nominal(with_form, form, values)
        raw = _solved(with_form, there)[0] - bare
        moved = -absorbing @ raw
        again = _solved(with_form, _moved(there, moved))[0] - bare
        visible.append((again - slopes @ (absorbing @ again)) / scales)
    limit = 2.0 / np.sqrt(scales.size)
    rms = [float(np.sqrt(np.mean(one**2))) / limit for one in visible]
    likeness = [abs(_cosine(one, other)) for one, other in combinations(visible, 2)]
    return Option(sentence, max(likeness, default=0.0), min(rms, default=0.0))


def _carrying(board: Board, form: Form) -> Board:
    """A board with the effect of a form, also in setups that the form does not know."""
    own = [one for one in form.board.chosen if one.name == form.effect]
    known = {setup.name for setup in form.board.setups}
    new = [s for s in board.setups if own[0].scope == "setup" and s.name not in known]
    chosen = (*form.board.chosen, *(one for s in new if (one := own[0].in_setup(board, s)) is not None))
    return replace(board, effects=form.board.effects, chosen=chosen, parameters=form.board.parameters)


def _at_nominal(board: Board, form: Form, values: Values) -> dict[str, Floats]:
    there = {name: np.asarray(quantity.median) for name, quantity in form.board.inputs.items()} | dict(values)
    nominal = {free.key: np.asarray(free.nominal) for free in form.free}
    for setup in board.setups:
        for effect in system_of(board, setup).effects:
            for parameter in effect.parameters():
                if effect.name == form.effect and parameter.key in nominal:
                    there[parameter.name] = nominal[parameter.key]
                elif parameter.name not in there:
                    there[parameter.name] = np.asarray(parameter.prior.median)
    return there


def _solved(board: Board, values: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """ln f of all readings and their slopes in ln D: (n,) and (n, 3) arrays."""
    models = [setup_model(system_of(board, s), _with_effects(board, s, values)) for s in board.setups]
    logs = [
        model.log_frequencies(_with_effects(board, s, values), "linear")[0]
        for model, s in zip(models, board.setups, strict=True)
    ]
    slopes = [
        model.sensitivities(_with_effects(board, s, values)) for model, s in zip(models, board.setups, strict=True)
    ]
    return np.concatenate(logs), np.concatenate(slopes)


def _moved(values: Mapping[str, Floats], moved: Floats) -> dict[str, Floats]:
    factors = dict(zip(RIGIDITIES, np.exp(np.clip(moved, -0.5, 0.5)), strict=True))
    return {name: value * factors.get(name, 1.0) for name, value in values.items()}


def _cosine(one: Floats, other: Floats) -> float:
    norms = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / norms if norms > 0 else 0.0


__all__ = ["Option", "options", "recommendation"]
