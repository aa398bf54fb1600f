"""The tables of a diagnosis, text cells only: the terminal, the page and notebooks lay out the same ones."""

from __future__ import annotations

from collections.abc import Mapping

from bayesplate.diagnosis.wording.candidates import Amplitude, CandidateEntry
from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.words import MERITS, MISSING, Merit, names_of, worth_showing
from bayesplate.effects.words import effect_name, effect_names
from bayesplate.results.contract import Spread
from bayesplate.results.tables import Table
from bayesplate.results.words import GPA, decimals, interval, plus_minus

_GPA = 1e9
_NARROW = ("effect", "shift", "visible", "probable", "range (90 %)", "fate")
_WIDE = (
    "effect",
    "shift",
    "visible",
    "E_x / E_y / G_xy off by, %",
    "probable",
    "size (90 %)",
    "looks like",
    "rejected because",
)


def errors_table(diagnosis: Diagnosis) -> Table:
    """Every figure of merit, before and after where something was added."""
    if diagnosis.is_refitted:
        title = "Error before and after"
        columns = {"before": diagnosis.before, f"after: {effect_names(diagnosis.refitted)}": diagnosis.after}
    else:
        title, columns = "Error", {"as it is": diagnosis.before}
    rows = tuple((one.title, *(_merit(one, one.of(errors)) for errors in columns.values())) for one in MERITS)
    return Table(f"{title}: {diagnosis.name}", ("", *columns), rows)


def shift_table(diagnosis: Diagnosis) -> Table | None:
    """Each modulus before and after; None where nothing was added."""
    if not diagnosis.is_refitted:
        return None
    rows = []
    for name, one in diagnosis.elastic_shift.items():
        digits = decimals(0.01 * one.before / _GPA)
        before, after = (f"{value / _GPA:.{digits}f}" for value in (one.before, one.after))
        rows.append((name, before, after, f"{one.shift_in_sd:+.1f}"))
    return Table("Shift of the constants, GPa", ("constant", "before", "after", "shift, sd"), tuple(rows))


def averaged_table(diagnosis: Diagnosis) -> Table:
    """The moduli averaged over every model that was weighed."""
    rows = tuple((name, *_spread(one)) for name, one in diagnosis.elastic_averaged.items())
    title = "The constants if any of the effects may be there, each by its probability, GPa"
    return Table(title, ("constant", "mean ± sd", "90 % interval"), rows)


def candidates_table(diagnosis: Diagnosis, *, narrow: bool = False) -> Table | None:
    """Candidates, the most probable first: what each would do, and why it was rejected; None if there are none.

    Parameters
    ----------
    diagnosis : Diagnosis
    narrow : bool
        Fit for a terminal: without the bias and the look-alikes, the reason of a rejection in two words.
    """
    shown = sorted(worth_showing(diagnosis), key=lambda one: -one.inclusion_probability)
    if not shown:
        return None
    columns = _NARROW if narrow else _WIDE
    rows = []
    for name, one in zip(names_of(shown), shown, strict=True):
        cells = _cells(name, one)
        rows.append(tuple(cells[column] for column in columns))
    title = "Candidates at their usual size: shift of the modes, rms cents, and what of it shows"
    return Table(title, columns, tuple(rows))


def _cells(name: str, one: CandidateEntry) -> Mapping[str, str]:
    """Every cell that a row of a candidate may have, by its column."""
    return {
        "effect": name,
        "shift": _number(one.raw_rms_cents),
        "visible": _number(one.visible_rms_cents),
        "E_x / E_y / G_xy off by, %": _bias(one.bias_percent),
        "probable": f"{one.inclusion_probability:.3f}",
        "size (90 %)": _size(one.amplitude),
        "range (90 %)": _range(one.amplitude),
        "looks like": ", ".join(effect_name(other) for other in one.look_alikes) or MISSING,
        "rejected because": one.rejected_because or MISSING,
        "fate": one.fate,
    }


def _merit(one: Merit, value: float | None) -> str:
    return MISSING if value is None else one.shown(value)


def _number(value: float | None) -> str:
    return MISSING if value is None else f"{value:.1f}"


def _spread(one: Spread) -> tuple[str, str]:
    """Mean ± sd and the middle 90 %, GPa."""
    return plus_minus(one, GPA), interval(one, GPA)


def _bias(bias: Mapping[str, float] | None) -> str:
    return MISSING if bias is None else " / ".join(f"{value:+.1f}" for value in bias.values())


def _size(amplitude: Amplitude | None) -> str:
    if amplitude is None:
        return MISSING
    low, high = f"{amplitude.q05:.3g}", f"{amplitude.q95:.3g}"
    return f"{amplitude.parameter} {amplitude.q50:.3g} ({low} to {high}){_unit(amplitude)}"


def _range(amplitude: Amplitude | None) -> str:
    """The same without the median, for which a terminal has no room."""
    if amplitude is None:
        return MISSING
    return f"{amplitude.parameter} {amplitude.q05:.3g} to {amplitude.q95:.3g}{_unit(amplitude)}"


def _unit(amplitude: Amplitude) -> str:
    return "" if amplitude.unit == "1" else f" {amplitude.unit}"
