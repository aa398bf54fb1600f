"""What to measure next: the further readings that would tell the surviving explanations apart, or make them visible."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.shifts.forms import Form
from bayesplate.effects.words import effect_names, joined
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
_REFITS = 2
_WORTH = 0.05
"""A likeness that falls by less is no reason to measure."""


@dataclass(frozen=True, eq=False)
class Option:
    """Further readings, and what they would show.

    Attributes
    ----------
    sentence : str
        What to measure.
    likeness : float
        Largest |cos| between the visible parts of two of the effects asked about; 0 for a single one.
    seen : tuple of float
        Visible rms of each of them, in units of the rms below which a visible part drowns in the noise.
    """

    sentence: str
    likeness: float
    seen: tuple[float, ...]

    @property
    def visibility(self) -> float:
        """The smallest of these."""
        return min(self.seen, default=0.0)


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
    candidates = found.ground.candidates
    asked = [candidates[name].laws[candidates[name].shown].form for name in effects if name in candidates]
    return tuple(
        _judged(sentence, board, baseline.values, asked[:_MOST_EFFECTS])
        for sentence, board in _boards(baseline.board, baseline.values)
    )


def recommendation(found: Found, effects: Sequence[str]) -> str:
    """One sentence: what to measure next, and why; empty where no further reading that was looked at would help.

    Parameters
    ----------
    found : Found
    effects : sequence of str
        The explanations that are left, or the effects that cannot be seen; at most four are looked at.
    """
    asked = tuple(effects)[:_MOST_EFFECTS]
    if not asked:
        return ""
    now, *further = options(found, asked)
    if not further:
        return ""
    return _to_tell_apart(asked, now, further) or _to_see(asked, now, further)


def _to_tell_apart(asked: Sequence[str], now: Option, further: Sequence[Option]) -> str:
    """What would make effects that show less alike."""
    best = min(further, key=lambda option: option.likeness)
    can_be_seen = len(asked) > 1 and min(now.visibility, best.visibility) >= 1.0
    if not can_be_seen or best.likeness > now.likeness - _WORTH:
        return ""
    return (
        f"{best.sentence}: the largest likeness among {effect_names(asked)} would fall from {now.likeness:.2f} to "
        f"{best.likeness:.2f}."
    )


def _to_see(asked: Sequence[str], now: Option, further: Sequence[Option]) -> str:
    """What would bring the most of the hidden effects into sight."""

    def revealed(option: Option) -> list[int]:
        return [i for i, (old, new) in enumerate(zip(now.seen, option.seen, strict=True)) if old < 1.0 <= new]

    best = max(further, key=lambda option: (len(revealed(option)), option.visibility))
    shown = revealed(best)
    if not shown:
        return ""
    then, today = (joined([f"{option.seen[i]:.1f}" for i in shown]) for option in (best, now))
    return (
        f"{best.sentence}: {effect_names([asked[i] for i in shown])} would then show, with {then} times the smallest "
        f"trace that can be seen ({today} times now)."
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
        left, moved = raw, np.zeros(len(RIGIDITIES))
        for _ in range(_REFITS):
            moved = moved + absorbing @ left
            left = raw - (_solved(board, _moved(values, moved))[0] - bare)
        visible.append((left - slopes @ (absorbing @ left)) / scales)
    limit = 2.0 / np.sqrt(scales.size)
    seen = tuple(float(np.sqrt(np.mean(one**2))) / limit for one in visible)
    likeness = [abs(_cosine(one, other)) for one, other in combinations(visible, 2)]
    return Option(sentence, max(likeness, default=0.0), seen)


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
