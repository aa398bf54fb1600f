"""Two figures of a diagnosis: what each candidate effect would do to the modes, and the error before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.effects.words import effect_name
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREY,
    ORANGE,
    SKY,
    SMALL,
    VERMILLION,
    WORDS,
    Picture,
    legend_below,
    stacked,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW = 0.34
_UNLIKELY = 0.01
ERRORS = {
    "in_sample_rms_cents": "in the fit",
    "leave_one_out_rms_cents": "of a mode left out",
    "nested_leave_one_out_rms_cents": "left out, search and all",
}
"""The errors of before and after that are drawn, as people read them."""


def signatures_picture(diagnosis: Mapping[str, Any]) -> Picture | None:
    """How much each candidate would shift the modes, and how much of that could be seen; None without candidates."""
    shown = [one for one in diagnosis.get("candidates") or () if one.get("visible_rms_cents") is not None]
    if not shown:
        return None
    several = has_several_setups(shown)
    names = [candidate_name(one, several) for one in shown]
    figure, (panel,) = stacked([_ROW * len(shown) + 0.1], left=1.75, bottom=0.78)
    rows = np.arange(len(shown))
    raw = np.array([float(one.get("raw_rms_cents") or 0.0) for one in shown])
    visible = np.array([float(one["visible_rms_cents"]) for one in shown])
    panel.barh(rows - 0.18, raw, height=0.32, color=SKY, hatch="///", edgecolor="white", lw=0, label="in all")
    panel.barh(rows + 0.18, visible, height=0.32, color=BLUE, label="visible, after the constants are fitted again")
    for row, one in zip(rows, shown, strict=True):
        if one.get("below_sight"):
            panel.text(visible[row], row + 0.18, " lost in noise", fontsize=SMALL - 1, va="center", color=DARK)
    panel.set(ylim=(len(shown) - 0.5, -0.5))
    panel.set_yticks(rows, [name[:30] for name in names], fontsize=SMALL, parse_math=False)
    panel.tick_params(axis="y", length=0)
    panel.spines["left"].set_visible(False)
    panel.set_xlabel("shift of the modes at a usual size, rms cents", fontsize=SMALL)
    legend_below(figure, panel.get_legend_handles_labels()[0], 1)
    told = "; ".join(
        f"{name} {a:.0f} cents, of which {b:.1f} visible" for name, a, b in zip(names, raw, visible, strict=True)
    )
    caption = (
        "An effect shifts the modes, but most of that shift looks like other constants. Only what is left after the "
        "constants have been fitted again can give it away; the rest goes into the constants unseen."
    )
    return Picture("signatures", "What each effect would do", f"{told}.", caption, figure)


def before_after_picture(diagnosis: Mapping[str, Any]) -> Picture | None:
    """Error before and after, and the shift of each constant; None where nothing was refitted."""
    before, after = diagnosis.get("before"), diagnosis.get("after")
    if not before or not after or not is_refitted(diagnosis):
        return None
    names = [name for name in ERRORS if before.get(name) is not None or after.get(name) is not None]
    shifts = {name: one["shift_in_sd"] for name, one in (diagnosis.get("elastic_shift") or {}).items()}
    heights = [_ROW * len(names) + 0.1, *([0.25 * len(shifts) + 0.1] if shifts else [])]
    figure, panels = stacked(heights, left=1.75, top=0.3, bottom=0.75, gap=0.85)
    rows = np.arange(len(names))
    hatched: Any = {"color": GREY, "hatch": "///", "edgecolor": "white", "label": "before"}
    plain: Any = {"color": BLUE, "label": "after"}
    for offset, errors, style in ((-0.18, before, hatched), (0.18, after, plain)):
        found = (errors.get(name) for name in names)
        values = np.array([np.nan if value is None else float(value) for value in found])
        panels[0].barh(rows + offset, values, height=0.32, lw=0, **style)
    _named(panels[0], [ERRORS[name] for name in names], "error, rms cents", "Error of the frequencies")
    if shifts:
        rows = np.arange(len(shifts))
        values = np.array([np.nan if v is None else float(v) for v in shifts.values()])
        panels[1].hlines(rows, 0, np.nan_to_num(values), color=ORANGE, lw=4)
        panels[1].plot(values, rows, "o", color=VERMILLION, mec="black", mew=0.6, ms=6)
        panels[1].axvline(0, color=DARK, lw=0.8)
        reach = max(1.2, 1.15 * float(np.nanmax(np.abs(values), initial=0.0)))
        panels[1].set_xlim(-reach, reach)
        _named(panels[1], list(shifts), "standard deviations", "Shift of the constants")
    legend_below(figure, panels[0].get_legend_handles_labels()[0], 2)
    told = "; ".join(
        f"{ERRORS[name]}: {_cents(before.get(name))} before, {_cents(after.get(name))} after" for name in names
    )
    moved = "; ".join(f"{name} by {value:+.1f} sd" for name, value in shifts.items() if value is not None)
    alt = f"Error {told}." + (f" The constants move: {moved}." if moved else "")
    caption = (
        "The first error falls with any effect that is added. The last is the honest one: each mode is left out of the "
        "search as well as of the fit."
    )
    return Picture("before-after", "Error before and after, and what it does to the constants", alt, caption, figure)


def is_refitted(diagnosis: Mapping[str, Any]) -> bool:
    """Whether something was added to the model, so that there is an after."""
    if "refitted" in diagnosis:
        return bool(diagnosis["refitted"])
    return bool(diagnosis.get("after")) and diagnosis["after"] != diagnosis.get("before")


def candidate_name(candidate: Mapping[str, Any], several: bool) -> str:
    """Name of a candidate; with its setup where there are several, with the labels that it would exchange."""
    name = effect_name(str(candidate["name"]))
    if candidate.get("labels"):
        name += f" {' and '.join(str(label) for label in candidate['labels'])}"
    return f"{name}, {candidate['setup']}" if several and candidate.get("setup") else name


def has_several_setups(candidates: Sequence[Mapping[str, Any]]) -> bool:
    """Whether candidates act in different setups, so that their names must say in which."""
    return len({one.get("setup") for one in candidates} - {None, "", "board"}) > 1


def worth_showing(diagnosis: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Every effect, and of the exchanged labels those that are not out of the question."""
    return [
        one
        for one in diagnosis.get("candidates") or ()
        if not one.get("labels") or (one.get("inclusion_probability") or 0.0) >= _UNLIKELY
    ]


def _named(panel: Axes, names: Sequence[str], unit: str, title: str) -> None:
    panel.set(ylim=(len(names) - 0.5, -0.5))
    panel.set_yticks(range(len(names)), names, fontsize=SMALL)
    panel.tick_params(axis="y", length=0)
    panel.spines["left"].set_visible(False)
    panel.set_xlabel(unit, fontsize=SMALL)
    panel.set_title(title, fontsize=WORDS, loc="left", weight="bold")


def _cents(value: float | None) -> str:
    return "not known" if value is None else f"{value:.1f} cents"
