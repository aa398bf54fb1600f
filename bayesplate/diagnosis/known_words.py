"""What physics knows, in words: the error with effects that were computed and not fitted, whether it falls or rises."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from bayesplate.board.material import MODULI
from bayesplate.diagnosis.known import KnownFit
from bayesplate.diagnosis.stated import LEAST_FALL, StatedClaim
from bayesplate.effects.words import effect_name, effect_names
from bayesplate.frequencies.laws import cents
from bayesplate.results.contract import rms
from bayesplate.results.tables import Row, Table
from bayesplate.results.words import cents_alike, number, percent

_COMPUTED = "Computed at its known size, with nothing fitted but the constants by weighted least squares, "
AS_IT_STANDS = "as it stands"
_RISES = (
    " Where the error rises, something that acts the other way is lacking, or the effect has another size on this "
    "board, or the fit was that good by chance."
)


@dataclass(frozen=True, kw_only=True)
class KnownModel:
    """The board with effects of known sizes, nothing fitted but the constants: errors and change of the moduli."""

    effects: tuple[str, ...]  # those beyond what is declared; empty for the board as it stands
    # declared ones that are left out, as the stated mass of a sensor, to show what they do; mostly none
    without: tuple[str, ...]
    # of the readings, by weighted least squares, all inputs at their nominal values, declared sizes that the card
    # leaves open where the fit has them
    in_sample_rms_cents: float
    # of each reading, predicted by a fit that has not seen it; of those that every model predicts so, but of modes that
    # alone carry a constant or a size in any of the models compared; None where they are too few
    leave_one_out_rms_cents: float | None
    change_percent: Mapping[str, float]  # of E_x, E_y, G_xy against the board as it stands
    combination: tuple[str, ...]  # all known effects that it has, declared or not
    n_left_out: int  # readings that have a left-out error
    n_readings: int  # all of them


def known_models(fits: Sequence[KnownFit], carried: Sequence[int] = ()) -> tuple[KnownModel, ...]:
    """Errors in cents and changes in percent, the board as it stands first, as in the fits.

    Readings that are carried, whose mode alone carries a constant or a size, count in the left-out error of none.
    """
    if not fits:
        return ()
    left_out = np.array([one.errors.left_out for one in fits])
    is_of_all = np.isfinite(left_out).all(axis=0)
    is_of_all[list(carried)] = False
    return tuple(
        KnownModel(
            combination=one.combination,
            effects=one.effects,
            without=one.without,
            in_sample_rms_cents=rms(cents(one.errors.in_sample)) or 0.0,
            leave_one_out_rms_cents=rms(cents(one.errors.left_out[is_of_all])),
            n_left_out=int(is_of_all.sum()),
            n_readings=is_of_all.size,
            change_percent={
                name: 100.0 * float(new / old - 1.0)
                for name, new, old in zip(MODULI, one.moduli, fits[0].moduli, strict=True)
            },
        )
        for one in fits
    )


def known_table(known: Sequence[KnownModel]) -> Table | None:
    """Errors and changes, model by model; None where there is nothing to compute."""
    if len(known) < 2:
        return None
    rows: list[Row] = []
    for words, one in zip(known_titles(known), known, strict=True):
        errors = (number(value, 1) for value in (one.in_sample_rms_cents, one.leave_one_out_rms_cents))
        changes = (number(value, 1, signed=True) for value in one.change_percent.values())
        rows.append((words, *errors, *changes))
    columns = ("model", "in the fit", "left out", *(f"{name}, %" for name in MODULI))
    keys = ("model", "in_sample_rms_cents", "leave_one_out_rms_cents", *(f"{name}_percent" for name in MODULI))
    title = (
        "What physics knows, computed and not fitted: error by weighted least squares, rms cents, and change of the "
        "constants"
    )
    return Table(title, columns, tuple(rows), keys)


def known_titles(known: Sequence[KnownModel]) -> list[str]:
    """A title of each model; the first is the board as it stands."""
    return [AS_IT_STANDS, *map(model_words, known[1:])]


def model_words(one: KnownModel) -> str:
    """Which model it is, by all known effects that it has and the declared ones that it lacks."""
    parts = [f"with {effect_names(one.combination)}"] if one.combination else []
    parts += [f"without {effect_names(one.without)}"] if one.without else []
    return ", ".join(parts) or AS_IT_STANDS


def known_sentence(known: Sequence[KnownModel]) -> str:
    """What each known effect does to the error, which model has the lowest, and which two work only together.

    Empty if there is nothing to tell.
    """
    if len(known) < 2:
        return ""
    errors = _Errors(known)
    alone = [one for one in known[1:] if len(one.effects) + len(one.without) == 1]
    said = [_clause(one, known[0], errors) for one in alone]
    clauses = "; ".join(
        words.format(error=f"the {errors.name}" if i == 0 else "it") for i, (words, _) in enumerate(said)
    )
    rises = _RISES if any(is_rise for _, is_rise in said) else ""
    further = (*_best(known, errors), *_only_together(known, errors), *_of_some(known))
    return " ".join([f"{_COMPUTED}{clauses}.{rises}", *further])


def _of_some(known: Sequence[KnownModel]) -> list[str]:
    """A sentence where left-out errors are not of all readings."""
    n, n_all = known[0].n_left_out, known[0].n_readings
    if n in (0, n_all):
        return []
    return [
        f"Left-out errors are of {n} of {n_all} readings: without one of the others a model leaves a constant open."
    ]


class _Errors:
    """The error that models are compared by: left out where every model has one, in the fit otherwise."""

    def __init__(self, known: Sequence[KnownModel]) -> None:
        self._is_left_out = all(one.leave_one_out_rms_cents is not None for one in known)
        self.name = "left-out error" if self._is_left_out else "error in the fit"

    def of(self, one: KnownModel) -> float:
        left_out = one.leave_one_out_rms_cents if self._is_left_out else None
        return one.in_sample_rms_cents if left_out is None else left_out

    def shown(self, *models: KnownModel) -> list[str]:
        """Errors of some models, cents, with the same decimals."""
        return cents_alike(*map(self.of, models))


def _clause(one: KnownModel, as_it_stands: KnownModel, errors: _Errors) -> tuple[str, bool]:
    """What an effect does to {error}, in words, and whether that rises; a stated one from the model without it."""
    ends = (one, as_it_stands) if one.without else (as_it_stands, one)
    old, new = errors.shown(*ends)
    who = f"{effect_name(one.without[0])}, as the card states it," if one.without else effect_names(one.effects)
    if old == new:
        return f"{who} leaves {{error}} at {new} cents", False
    is_rise = errors.of(ends[1]) > errors.of(ends[0])
    return f"{who} {'raises' if is_rise else 'lowers'} {{error}} from {old} to {new} cents", is_rise


def _best(known: Sequence[KnownModel], errors: _Errors) -> list[str]:
    """Which combination has the lowest error, where there are any beyond single effects."""
    if len(known) < 4:
        return []
    best = min(known, key=errors.of)
    told, first = errors.shown(best, known[0])
    if told == first:
        return [f"None of {len(known) - 1} other combinations has a lower {errors.name} than the board as it stands."]
    return [f"Of {len(known)} combinations the board {model_words(best)} has the lowest {errors.name}, {told} cents."]


def _only_together(known: Sequence[KnownModel], errors: _Errors) -> list[str]:
    """Two effects of which either alone raises the error, which both together lower: a sentence each."""
    found = {frozenset(one.combination): one for one in reversed(known)}
    standing = frozenset(known[0].combination)
    said = []
    for pair in combinations(dict.fromkeys(name for one in known for name in one.combination), 2):
        rest = standing - set(pair)
        models = [found[one] for some in ((), pair[:1], pair[1:], pair) if (one := rest | set(some)) in found]
        if len(models) < 4:
            continue
        neither, first, second, both = map(errors.of, models)
        if both < neither < min(first, second):
            shown = errors.shown(*models)
            name, other = map(effect_name, pair)
            said.append(
                f"{effect_names(pair).capitalize()} work only together: {name} alone takes the {errors.name} from "
                f"{shown[0]} to {shown[1]} cents, {other} alone to {shown[2]}, both to {shown[3]}."
            )
    return said


def stated_sentence(one: StatedClaim) -> str:
    """What is predicted, the error without and with the stated effects, and whether it is reduced."""
    who = f"{effect_names(one.effects)}, as stated and not chosen by the readings,"
    verb = "takes" if len(one.effects) == 1 else "take"
    if one.predicts:
        what = f"the error of setup '{one.predicts}', predicted by the constants of the first setup alone,"
    else:
        what = "the left-out error"
    told = (
        f"{who[0].upper()}{who[1:]} {verb} {what} from {one.before_rms_cents:.1f} to {one.after_rms_cents:.1f} cents; "
        f"the log score changes by {one.log_score_gain:+.1f} ± {one.standard_error:.1f} over {one.n_modes} modes"
    )
    if one.holds:
        return f"{told}: error reduced."
    needs = f"that asks for a fall by {percent(LEAST_FALL)} and a score that rises by more than two standard errors"
    return f"{told}. That an error is reduced is not claimed: {needs}."
