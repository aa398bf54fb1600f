"""What physics knows, in words: the error with effects that were computed and not fitted, whether it falls or rises."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.diagnosis.evidence.known import KnownFit
from bayesplate.effects.words import effect_name, effect_names
from bayesplate.frequencies.laws import cents
from bayesplate.plate.material import MODULI
from bayesplate.results.contract import rms
from bayesplate.results.tables import Table
from bayesplate.results.words import MISSING

_COMPUTED = "Computed at its known size, with nothing fitted but the three constants by weighted least squares, "
_RISES = (
    " Where the error rises, something that acts the other way is lacking, or the effect has another size on this "
    "board, or the fit was that good by chance."
)


@dataclass(frozen=True, kw_only=True)
class KnownModel:
    """The board with effects of known sizes, nothing fitted but the three constants: errors and change of the moduli.

    Attributes
    ----------
    effects : tuple of str
        Computed beyond those that are declared; empty for the board as it stands.
    without : tuple of str
        Declared ones that are left out, as the stated mass of a sensor, to show what they do; mostly none.
    in_sample_rms_cents : float
        Of the readings, by weighted least squares, all inputs at their nominal values, declared sizes that the card
        leaves open where the fit has them.
    leave_one_out_rms_cents : float or None
        Of each reading, predicted by a fit that has not seen it, but of modes that alone carry a constant or a size in
        any of the models compared; None where too few are left.
    change_percent : dict of float
        Of E_x, E_y, G_xy against the board as it stands.
    """

    effects: tuple[str, ...]
    without: tuple[str, ...]
    in_sample_rms_cents: float
    leave_one_out_rms_cents: float | None
    change_percent: Mapping[str, float]


def known_models(fits: Sequence[KnownFit], carried: Sequence[int] = ()) -> tuple[KnownModel, ...]:
    """Errors in cents and changes in percent, the board as it stands first, as in the fits.

    Readings that are carried, whose mode alone carries a constant or a size, count in the left-out error of none.
    """
    return tuple(
        KnownModel(
            effects=one.effects,
            without=one.without,
            in_sample_rms_cents=rms(cents(one.errors.in_sample)) or 0.0,
            leave_one_out_rms_cents=rms(np.delete(cents(one.errors.left_out), list(carried))),
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
    rows = []
    for one in known:
        left_out = MISSING if one.leave_one_out_rms_cents is None else f"{one.leave_one_out_rms_cents:.1f}"
        changes = (MISSING if one is known[0] else f"{value:+.1f}" for value in one.change_percent.values())
        rows.append((model_words(one), f"{one.in_sample_rms_cents:.1f}", left_out, *changes))
    columns = ("model", "in the fit", "left out", *(f"{name}, %" for name in MODULI))
    title = (
        "What physics knows, computed and not fitted: error by weighted least squares, rms cents, and change of the "
        "constants"
    )
    return Table(title, columns, tuple(rows))


def model_words(one: KnownModel) -> str:
    """Which model it is."""
    if one.without:
        return f"without {effect_names(one.without)}"
    return f"with {effect_names(one.effects)}" if one.effects else "as it stands"


def known_sentence(known: Sequence[KnownModel]) -> str:
    """Which known effects lower the error, which raise it, and what a rise tells; empty if there is nothing to tell."""
    if len(known) < 2:
        return ""
    is_left_out = all(one.leave_one_out_rms_cents is not None for one in known)
    said = [_clause(one, known[0], is_left_out) for one in known[1:]]
    name = "left-out error" if is_left_out else "error in the fit"
    clauses = "; ".join(words.format(error=f"the {name}" if i == 0 else "it") for i, (words, _) in enumerate(said))
    rises = _RISES if any(is_rise for _, is_rise in said) else ""
    return f"{_COMPUTED}{clauses}.{rises}"


def _clause(one: KnownModel, as_it_stands: KnownModel, is_left_out: bool) -> tuple[str, bool]:
    """What an effect does to {error}, and whether that rises; a stated one from the model without it."""
    ends = (one, as_it_stands) if one.without else (as_it_stands, one)
    values = [end.leave_one_out_rms_cents if is_left_out else end.in_sample_rms_cents for end in ends]
    before, after = (0.0 if value is None else value for value in values)
    old, new = (f"{value:.0f}" if min(before, after) >= 10.0 else f"{value:.1f}" for value in (before, after))
    several = len(one.effects) > 1
    who = effect_names(one.effects) + " together" * several
    if one.without:
        who = f"{effect_name(one.without[0])}, as the card states it,"
    if old == new:
        return f"{who} leave{'' if several else 's'} {{error}} at {new} cents", False
    verb = ("lower" if after < before else "raise") + ("" if several else "s")
    return f"{who} {verb} {{error}} from {old} to {new} cents", after > before
