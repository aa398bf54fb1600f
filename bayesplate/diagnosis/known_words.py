"""Known effects in words and in a table: whether the error falls or rises with effects that are not fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from bayesplate.board.material import MODULI
from bayesplate.diagnosis.known import KnownFit
from bayesplate.diagnosis.stated import LEAST_ERROR_FALL, StatedClaim
from bayesplate.effects.words import as_sentence, effect_name, effect_names
from bayesplate.frequencies.laws import cents
from bayesplate.results.contract import rms
from bayesplate.results.tables import Row, Table
from bayesplate.results.words import cents_texts, number, percent

_COMPUTED_WORDS = "Computed at its known size, with nothing fitted but the constants by weighted least squares, "
AS_IT_STANDS = "as it stands"
_RISE_WORDS = (
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
    n_left_out: int  # readings that have a leave-one-out error
    n_readings: int  # all of them


def known_models(fits: Sequence[KnownFit], carrying_readings: Sequence[int] = ()) -> tuple[KnownModel, ...]:
    """Errors in cents and changes in percent, in the order of the fits, the board as it stands first.

    Modes that alone carry a constant in one of the fits do not count in the leave-one-out errors, nor do
    `carrying_readings`, whose mode alone carries one or a size elsewhere.
    """
    if not fits:
        return ()
    left_out = np.array([fit.errors.left_out for fit in fits])
    is_of_all = np.isfinite(left_out).all(axis=0)
    for fit in fits:
        is_of_all &= fit.errors.leverages.carries < 0
    is_of_all[list(carrying_readings)] = False
    return tuple(
        KnownModel(
            combination=fit.combination,
            effects=fit.effects,
            without=fit.without,
            in_sample_rms_cents=rms(cents(fit.errors.in_sample)) or 0.0,
            leave_one_out_rms_cents=rms(cents(fit.errors.left_out[is_of_all])),
            n_left_out=int(is_of_all.sum()),
            n_readings=is_of_all.size,
            change_percent={
                name: 100.0 * float(new / old - 1.0)
                for name, new, old in zip(MODULI, fit.moduli, fits[0].moduli, strict=True)
            },
        )
        for fit in fits
    )


def known_table(known_models: Sequence[KnownModel]) -> Table | None:
    """Errors and changes, model by model; None where there is nothing to compute."""
    if len(known_models) < 2:
        return None
    rows: list[Row] = []
    for words, model in zip(known_titles(known_models), known_models, strict=True):
        errors = (number(value, 1) for value in (model.in_sample_rms_cents, model.leave_one_out_rms_cents))
        changes = (number(value, 1, signed=True) for value in model.change_percent.values())
        rows.append((words, *errors, *changes))
    columns = ("model", "in the fit", "left out", *(f"{name}, %" for name in MODULI))
    keys = ("model", "in_sample_rms_cents", "leave_one_out_rms_cents", *(f"{name}_percent" for name in MODULI))
    title = (
        "What physics knows, computed and not fitted: error by weighted least squares, rms cents, and change of the "
        "constants"
    )
    return Table(title, columns, tuple(rows), keys)


def known_titles(known_models: Sequence[KnownModel]) -> list[str]:
    """A title of each model; the first is the board as it stands."""
    return [AS_IT_STANDS, *map(model_words, known_models[1:])]


def model_words(known_model: KnownModel) -> str:
    """A model in words: the known effects that it has and the declared ones that it lacks."""
    phrases = [f"with {effect_names(known_model.combination)}"] if known_model.combination else []
    phrases += [f"without {effect_names(known_model.without)}"] if known_model.without else []
    return ", ".join(phrases) or AS_IT_STANDS


def known_sentence(known_models: Sequence[KnownModel]) -> str:
    """How each known effect changes the error, which model has the lowest, and which pairs work only together.

    Empty if the board has no known effect.
    """
    if len(known_models) < 2:
        return ""
    errors = _ComparedError(known_models)
    single_models = [model for model in known_models[1:] if len(model.effects) + len(model.without) == 1]
    # the board as it stands has the sizes of declared effects where the fit has them: an effect is added to them at its
    # known size where that is computed too
    at_known_sizes = next((model for model in known_models[1:] if not model.effects and not model.without), None)
    effect_clauses = [_effect_clause(model, at_known_sizes or known_models[0], errors) for model in single_models]
    clauses = "; ".join(
        words.format(error=f"the {errors.name}" if i == 0 else "it") for i, (words, _) in enumerate(effect_clauses)
    )
    rises = _RISE_WORDS if any(is_rise for _, is_rise in effect_clauses) else ""
    further_sentences = (
        *_best_sentences(known_models, errors),
        *_pair_sentences(known_models, errors),
        *_partial_error_sentences(known_models),
    )
    first_sentences = [f"{_COMPUTED_WORDS}{clauses}.{rises}"] if clauses else []
    return " ".join([*first_sentences, *further_sentences])


def _partial_error_sentences(known: Sequence[KnownModel]) -> list[str]:
    """A sentence on how many readings have a leave-one-out error, where not all have one."""
    n, n_all = known[0].n_left_out, known[0].n_readings
    if n in (0, n_all):
        return []
    return [
        f"Leave-one-out errors are of {n} of {n_all} readings: the others carry a constant or a size alone, or are no "
        "mode, in one of the models compared."
    ]


class _ComparedError:
    """The error that models are compared by: left out where every model has one, in the fit otherwise."""

    def __init__(self, known: Sequence[KnownModel]) -> None:
        self._is_left_out = all(model.leave_one_out_rms_cents is not None for model in known)
        self.name = "leave-one-out error" if self._is_left_out else "error in the fit"

    def of(self, model: KnownModel) -> float:
        left_out = model.leave_one_out_rms_cents if self._is_left_out else None
        return model.in_sample_rms_cents if left_out is None else left_out

    def texts(self, *models: KnownModel) -> list[str]:
        """Errors of some models, cents, with the same decimals."""
        return cents_texts(*map(self.of, models))


def _effect_clause(model: KnownModel, as_it_stands: KnownModel, errors: _ComparedError) -> tuple[str, bool]:
    """How an effect changes {error}, in words, and whether it rises; a stated effect from the model without it."""
    before_and_after = (model, as_it_stands) if model.without else (as_it_stands, model)
    old, new = errors.texts(*before_and_after)
    subject = f"{effect_name(model.without[0])}, as declared," if model.without else effect_names(model.effects)
    if old == new:
        return f"{subject} leaves {{error}} at {new} cents", False
    is_rise = errors.of(before_and_after[1]) > errors.of(before_and_after[0])
    return f"{subject} {'raises' if is_rise else 'lowers'} {{error}} from {old} to {new} cents", is_rise


def _best_sentences(known: Sequence[KnownModel], errors: _ComparedError) -> list[str]:
    """A sentence on the combination with the lowest error, where there are combinations of several effects."""
    if len(known) < 4:
        return []
    best = min(known, key=errors.of)
    best_error, standing_error = errors.texts(best, known[0])
    if best_error == standing_error:
        return [f"No combination has a lower {errors.name} than the board as it stands."]
    return [
        f"Of {len(known)} combinations the board {model_words(best)} has the lowest {errors.name}, {best_error} cents."
    ]


def _pair_sentences(known: Sequence[KnownModel], errors: _ComparedError) -> list[str]:
    """A sentence on each pair of effects that lower the error together, though each alone raises it."""
    models_by_effects = {frozenset(model.combination): model for model in reversed(known)}
    standing_effects = frozenset(known[0].combination)
    sentences = []
    for pair in combinations(dict.fromkeys(name for model in known for name in model.combination), 2):
        other_effects = standing_effects - set(pair)
        models = [
            models_by_effects[combination]
            for members in ((), pair[:1], pair[1:], pair)
            if (combination := other_effects | set(members)) in models_by_effects
        ]
        if len(models) < 4:
            continue
        without_pair, first, second, with_pair = map(errors.of, models)
        if with_pair < without_pair < min(first, second):
            texts = errors.texts(*models)
            name, other = map(effect_name, pair)
            sentences.append(
                f"{as_sentence(effect_names(pair))} work only together: {name} alone takes the {errors.name} from "
                f"{texts[0]} to {texts[1]} cents, {other} alone to {texts[2]}, both to {texts[3]}."
            )
    return sentences


def stated_sentence(claim: StatedClaim) -> str:
    """The predicted setup, its error without and with the stated effects, and whether it is reduced, in words."""
    subject = f"{effect_names(claim.effects)}, as stated and not chosen by the readings,"
    verb = "takes" if len(claim.effects) == 1 else "take"
    if claim.predicts:
        prediction = f"the error of setup '{claim.predicts}', predicted by the constants of the first setup alone,"
    else:
        prediction = "the leave-one-out error"
    sentence = (
        f"{as_sentence(subject)} {verb} {prediction} from {claim.before_rms_cents:.1f} to "
        f"{claim.after_rms_cents:.1f} cents; the log score changes by {claim.log_score_gain:+.1f} ± "
        f"{claim.standard_error:.1f} over {claim.n_modes} modes"
    )
    if claim.holds:
        return f"{sentence}: error reduced."
    condition = (
        f"that asks for a fall by {percent(LEAST_ERROR_FALL)} and a score that rises by more than two standard errors"
    )
    return f"{sentence}. That an error is reduced is not claimed: {condition}."
