"""Two figures of a diagnosis: what each candidate effect would do to the modes, and the error before and after."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesplate.diagnosis.candidates import EffectEntry
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.diagnosis.words import MERITS, names_of
from bayesplate.report.colours import BLUE, DARK, GREY, ORANGE, SKY, VERMILLION
from bayesplate.report.style import SMALL, Picture, heading, in_rows, legend_below, name_rows, stacked
from bayesplate.report.symbols import in_figure

_ROW = 0.34


def signatures_picture(diagnosis: Diagnosis) -> Picture | None:
    """How much each candidate would shift the modes, and how much of that could be seen; None without candidates."""
    effects = [one for one in diagnosis.candidates if isinstance(one, EffectEntry)]
    shown = [one for one in effects if one.visible_rms_cents is not None]
    if not shown:
        return None
    names = names_of(shown)
    figure, panel = in_rows([name[:30] for name in names], row=_ROW, left=1.75, bottom=0.78)
    rows = np.arange(len(shown))
    raw = np.array([one.raw_rms_cents or 0.0 for one in shown])
    visible = np.array([one.visible_rms_cents for one in shown])
    panel.barh(rows - 0.18, raw, height=0.32, color=SKY, hatch="///", edgecolor="white", lw=0, label="in all")
    panel.barh(rows + 0.18, visible, height=0.32, color=BLUE, label="visible, after the constants are fitted again")
    for row, one in zip(rows, shown, strict=True):
        if one.below_detection_limit:
            panel.text(visible[row], row + 0.18, " lost in noise", fontsize=SMALL - 1, va="center", color=DARK)
    panel.set(xlabel="shift of the modes at a usual size, rms cents")
    legend_below(figure, 1)
    told = "; ".join(
        f"{name} {a:.0f} cents, of which {b:.1f} visible" for name, a, b in zip(names, raw, visible, strict=True)
    )
    caption = (
        "An effect shifts the modes, but most of that shift looks like other constants. Only what is left after the "
        "constants have been fitted again can give it away; the rest goes into the constants unseen."
    )
    return Picture("signatures", "What each effect would do", f"{told}.", caption, figure)


def before_after_picture(diagnosis: Diagnosis) -> Picture | None:
    """Error before and after, and the shift of each constant; None where nothing was added."""
    if not diagnosis.is_refitted:
        return None
    before, after = diagnosis.before, diagnosis.after
    drawn = [one for one in MERITS if one.is_rms and (one.of(before) is not None or one.of(after) is not None)]
    shifts = {name: one.shift_in_sd for name, one in diagnosis.elastic_shift.items()}
    heights = [_ROW * len(drawn) + 0.1, 0.25 * len(shifts) + 0.1]
    figure, panels = stacked(heights, left=1.75, top=0.3, bottom=0.75, gap=0.85)
    rows = np.arange(len(drawn))
    hatched: Any = {"color": GREY, "hatch": "///", "edgecolor": "white", "label": "before"}
    plain: Any = {"color": BLUE, "label": "after"}
    for offset, errors, style in ((-0.18, before, hatched), (0.18, after, plain)):
        values = np.array([one.of(errors) for one in drawn], dtype=float)
        panels[0].barh(rows + offset, values, height=0.32, lw=0, **style)
    name_rows(panels[0], [one.words for one in drawn])
    heading(panels[0], "Error of the frequencies")
    panels[0].set(xlabel="error, rms cents")
    rows, values = np.arange(len(shifts)), np.array(list(shifts.values()))
    panels[1].hlines(rows, 0, values, color=ORANGE, lw=4)
    panels[1].plot(values, rows, "o", color=VERMILLION, mec="black", mew=0.6, ms=6)
    panels[1].axvline(0, color=DARK, lw=0.8)
    reach = max(1.2, 1.15 * float(np.abs(values).max()))
    name_rows(panels[1], [in_figure(name) for name in shifts], parse_math=True)
    heading(panels[1], "Shift of the constants")
    panels[1].set(xlim=(-reach, reach), xlabel="standard deviations")
    legend_below(figure, 2)
    told = "; ".join(f"{one.words}: {_cents(one.of(before))} before, {_cents(one.of(after))} after" for one in drawn)
    moved = "; ".join(f"{name} by {value:+.1f} sd" for name, value in shifts.items())
    alt = f"Error {told}. The constants move: {moved}."
    caption = "The first error falls with any effect that is added."
    if after.nested_leave_one_out_rms_cents is not None:
        caption += " The last is the honest one: each mode is left out of the search as well as of the fit."
    return Picture("before-after", "Error before and after, and what it does to the constants", alt, caption, figure)


def _cents(value: float | None) -> str:
    return "not known" if value is None else f"{value:.1f} cents"
