"""What readings can see of an effect: visible parts, look-alikes, rounding, leverages, and what other designs see."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.signatures import cosine, look_alikes, signatures
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.posing import pose
from commands import bench
from computations.markdown import BLUE, GREEN, GREY, VERMILLION, empty_figure, figure, plain, signed, table
from computations.runs import SOURCE
from designs import DESIGNS

MODULI = ("E_x", "E_y", "G_xy")
DESIGN_WORDS = {"six-modes": "six modes", "nine-modes": "nine modes", "two-ways": "six, and six free"}


@lru_cache(maxsize=8)
def _seen(card: str) -> tuple[Any, tuple[Any, ...]]:
    """A board ready to be sampled, and the signatures of its candidates."""
    path = bench(SOURCE) / f"{card}.toml"
    prepared = prepare(path if path.exists() else card)
    problem = pose(prepared.board, prepared.prior)
    return problem, signatures(problem)


def visible_parts(folder: Path, card: str) -> str:
    """Figure and table: the shift by each effect, what is visible of it, and the bias of ignoring it."""
    _, found = _seen(card)
    ordered = sorted(found, key=lambda one: one.raw_rms)
    drawn, (panel,) = empty_figure(0.55 + 0.34 * len(ordered))
    for place, one in enumerate(ordered):
        panel.plot([one.visible_rms, one.raw_rms], [place, place], color=GREY, lw=1.5, zorder=1)
        panel.plot(one.raw_rms, place, "o", mfc="white", mec="black", ms=7)
        panel.plot(one.visible_rms, place, "o", color=BLUE, ms=6)
    limit = ordered[0].detection_limit_cents
    panel.axvline(limit, color=VERMILLION, ls=":", lw=1.4)
    panel.set_xscale("log")
    ticks = [t for t in (1, 3, 10, 30, 100) if t < 1.5 * ordered[-1].raw_rms]
    panel.set_xticks(ticks, [str(t) for t in ticks])
    panel.set_xticks([], minor=True)
    panel.set_yticks(range(len(ordered)), [plain(one.effect) for one in ordered])
    panel.set_xlabel("cents, rms: shift ○ and visible part ●; dotted: detection limit", fontsize=9)
    alt = "for each effect the shift of the frequencies and its visible part, which is smaller"
    rows = [
        (
            plain(one.effect),
            f"{one.raw_rms:.1f}",
            f"{one.visible_rms:.1f}" + (" ·" if one.is_below_detection_limit else ""),
            " / ".join(signed(one.bias_percent[name]) for name in MODULI),
        )
        for one in reversed(ordered)
    ]
    below = sum(one.is_below_detection_limit for one in found)
    said = f"\nA dot (·): below the detection limit, here {limit:.1f} cents: {below} of {len(found)}.\n"
    text = table(("effect, usual size", "shift, cents", "visible, cents", "bias of $E_x$ / $E_y$ / $G_{xy}$, %"), rows)
    return figure(drawn, folder, f"visible-{card}", alt) + "\n" + text + said


def rounding(folder: Path, card: str) -> str:
    """What half a step of rounding is worth on each mode."""
    board = prepare(card).board
    (setup,) = board.setups
    half = setup.resolution / 2
    rows = [
        (str(reading.label), f"{hz:g}", f"± {cents(np.log1p(half / hz)):.1f}")
        for reading, hz in zip(setup.readings, setup.measured, strict=True)
    ]
    said = f"The readings of this board are printed as multiples of {setup.resolution:g} Hz. On each mode that is\n\n"
    return said + table(("mode", "Hz", "rounding, cents"), rows)


def cosines(folder: Path, card: str) -> str:
    """Cosines between the visible parts of all candidates."""
    _, found = _seen(card)
    drawn, (panel,) = empty_figure(4.6)
    matrix = np.array([[cosine(one, other) for other in found] for one in found])
    shown = np.ma.masked_where(np.triu(np.ones_like(matrix)) > 0, matrix)
    panel.imshow(shown, vmin=-1, vmax=1, cmap="PuOr")
    for i, j in zip(*np.tril_indices(len(matrix), -1), strict=True):
        on_dark = not -0.75 < matrix[i, j] < 0.5
        colour = "white" if on_dark else "black"
        panel.text(j, i, signed(matrix[i, j], 2), ha="center", va="center", fontsize=7, color=colour)
    names = [plain(one.effect) for one in found]
    alike = look_alikes(found)
    panel.set_yticks(range(len(names)), names, fontsize=8)
    panel.set_xticks(range(len(names)), names, fontsize=8, rotation=90)
    panel.spines[:].set_visible(False)
    panel.tick_params(length=0)
    alt = "triangle of cosines between the visible parts of every two effects; several are close to one"
    pairs = [
        f"{plain(found[i].effect)} and {plain(found[j].effect)} ({signed(matrix[i, j], 2)})"
        for i in range(len(found))
        for j in range(i)
        if found[j].effect in alike[found[i].effect]
    ]
    said = f"\nThese look alike to the readings: {'; '.join(pairs)}.\n" if pairs else "\nNo pair is above 0.95.\n"
    return figure(drawn, folder, f"cosines-{card}", alt) + said


def leverages(folder: Path, card: str) -> str:
    """Share of each reading in its own prediction."""
    problem, _ = _seen(card)
    found = problem.identifiability
    (setup,) = problem.board.setups
    rows = [
        (str(label), f"{leverage:.2f}", " / ".join(f"{100 * share:.0f}".replace("-", "−") for share in shares))
        for label, leverage, shares in zip(setup.labels, found.leverages, found.shares, strict=True)
    ]
    rows.append(("sum", f"{found.leverages.sum():.2f}", ""))
    return table(("mode", "leverage", "energy in $D_x$ / $D_y$ / $D_s$, %"), rows)


def designs(folder: Path) -> str:
    """Visible part of each effect of the cantilever under three designs."""
    seen = {name: {one.effect: one for one in _seen(name)[1]} for name in DESIGNS}
    common = [name for name in seen["six-modes"] if all(name in one for one in seen.values())]
    common.sort(key=lambda name: seen["six-modes"][name].visible_rms)
    drawn, (panel,) = empty_figure(0.9 + 0.42 * len(common))
    styles = zip(DESIGNS, ("o", "s", "^"), (BLUE, GREEN, VERMILLION), (-0.2, 0.0, 0.2), strict=True)
    for design, mark, colour, offset in styles:
        places = np.arange(len(common)) - offset
        shown = [seen[design][name].visible_rms for name in common]
        panel.hlines(places, 0, shown, color=colour, lw=1.0)
        panel.plot(shown, places, mark, color=colour, ms=5, label=DESIGN_WORDS[design])
    panel.set_yticks(range(len(common)), [plain(name) for name in common])
    panel.set_xlabel("visible part, cents rms")
    panel.set_xlim(left=0)
    panel.legend(frameon=False, fontsize=8, loc="lower right")
    alt = "visible part of each effect under three designs: a soft clamp rises to the largest"
    rows = []
    for design in DESIGNS:
        problem, found = _seen(design)
        alike = sum(len(others) for others in look_alikes(found).values()) // 2
        soft = seen[design]["clamp_rotation"]
        n_modes = len(problem.identifiability.leverages)
        rows.append(
            (
                DESIGN_WORDS[design],
                f"{n_modes - 3}",
                f"{sum(one.is_below_detection_limit for one in found)} of {len(found)}",
                f"{alike}",
                f"{soft.visible_rms:.1f} of {soft.raw_rms:.1f}",
            )
        )
    columns = (
        "design",
        "directions left",
        "effects below the detection limit",
        "pairs above 0.95",
        "soft clamp, visible cents",
    )
    return figure(drawn, folder, "designs", alt) + "\n" + table(columns, rows)
