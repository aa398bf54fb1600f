"""The summary of a trial written for documents: trial.json, trial.md to be read, and a paragraph of it in short."""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from validation.trial.cells import CELLS, Cell
from validation.trial.counts import CONSTANTS, Record
from validation.trial.history import BEFORE, CHANGED
from validation.trial.limits import PLANNED
from validation.trial.published import publish_records
from validation.trial.summary import COLUMNS, CONDITIONS, summarise

from bayesplate.diagnosis.null_control import FALSE_ALARMS
from bayesplate.diagnosis.search import LEAST_P_VALUE

WAYS = {
    "without": "without tracing",
    "after": "by the hypothesis of the verdict",
    "averaged": "averaged over all hypotheses",
}
SHORT = "trial-short.md"
WORDS: tuple[str, ...] = (
    "Cells are written in short: `one cantilever-6 5c 2x` are cantilevers of which six modes are read with a noise of "
    "5 cents, each with one effect of twice the nominal size. `null` has no effect, `two` has two, `outside` has one "
    "that the library does not know, a crack or a glued rib; `cantilever-6-free-6` is the cantilever measured free as "
    "well. The noise that a card states is a prior: the true noise is its median, or `drawn` from it, or the median "
    "and `known` to 5 %; readings may be `rounded` to 1 Hz.",
    "",
    "- *named*, *unique*: the verdict is one answer. A name is wrong if it holds an effect that is not planted; one "
    "of two planted effects is counted by itself.",
    "- *flagged*: the verdict is a name, a group of effects that cannot be told apart, or unexplained.",
    "- *the set given*: the effects of the name or the group, and those at most ten times less probable than the best.",
    "- *top-1*, *best is right*: the most probable answer, whatever the verdict, is what is planted; it may be that "
    "nothing is lacking.",
    "- *relabelling*: no effect, but the labels of two neighbouring modes exchanged.",
    "- *after tracing*: constants averaged over all hypotheses, each by its probability; *without tracing*: those of "
    "the ideal plate.",
    "",
    "Bounds in brackets are 95 % bounds, those of shares exact (Clopper and Pearson). An acceptance limit is an "
    "upper or a lower one, or a range. It is met if both bounds keep to it, and not the estimate alone: with 300 "
    "boards, a limit of 2 % is met if at most one is named. One that is missed stays here as missed. A board "
    f"that lacks nothing is flagged by design, on {100 * LEAST_P_VALUE:g} % by the gate of the misfit and on "
    f"{100 * FALSE_ALARMS:g} % by the need of an effect: that limit is met unless the lower bound is above their sum. "
    "A limit counts all classes of effects that are planted; what the classes that were planned first would give by "
    "themselves stands in the notes: "
    f"{', '.join(sorted(PLANNED))}.",
    "",
    "`diagnose` solves two plausible effects together, for their shifts need not add. The trial does not: that would "
    "take several times as long; pairs are judged as if their shifts added.",
)


def write(records: Sequence[Record], base_seed: int, folder: Path, cells: Sequence[Cell] = CELLS) -> dict[str, Any]:
    """Summarise, write the files, of a whole trial the short one and the records too, and return the summary."""
    summary: dict[str, Any] = plain(summarise(records, base_seed, cells))
    folder.mkdir(parents=True, exist_ok=True)
    is_whole = cells == CELLS and len(records) == summary["boards"]["wanted"]
    summary["records"] = publish_records(records, base_seed, folder) if is_whole else None
    (folder / "trial.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n")
    (folder / "trial.md").write_text("\n".join(page(summary)) + "\n")
    if cells == CELLS:
        (folder / SHORT).write_text(in_short(summary) + "\n")
    return summary


def in_short(summary: Mapping[str, Any]) -> str:
    """What a reader asks first, in sentences: false names, right ones, and the constants."""
    limits = {limit["quantity"]: limit for limit in summary["limits"]}
    nothing = [limit for name, limit in limits.items() if name.startswith("null") and name.endswith("uniquely named")]

    def share(name: str) -> str:
        known = limits[name]["share"]
        return "a share not known yet" if known is None else f"{100 * known:.1f} %"

    n_missed = sum(not limit["met"] for limit in limits.values())
    right = "top-1, {}, 5 cents, 2x"
    sentences = (
        f"Of {sum(limit['n'] for limit in nothing)} simulated boards that lack nothing, an effect was named on "
        f"{sum(limit['count'] for limit in nothing):.0f} and claimed on {limits['claim made on a null']['count']:.0f}.",
        "With one large effect, the most probable answer is the right one on "
        f"{share(right.format('cantilever-6'))} of the boards by six modes of a cantilever, and on "
        f"{share(right.format('cantilever-6-free-6'))} with six of the free board as well.",
        "Intervals of 90 % for the constants, averaged over the effects, hold the truth on "
        f"{share('constants after tracing, cantilever-6, 2x: 90 % intervals')}, those of the ideal plate on "
        f"{share('constants without tracing, cantilever-6, 2x: visibly worse')}{_held_outside(summary)}.",
        f"Of the {len(limits)} limits set for the trial {n_missed} are missed.",
    )
    return textwrap.fill(" ".join(sentences), 139, break_on_hyphens=False)


def _held_outside(summary: Mapping[str, Any]) -> str:
    """How often intervals hold the worst constant of boards with an effect that the library does not know."""
    cells = [cell for name, cell in summary["cells"].items() if name.startswith("outside") and "constants" in cell]
    if not cells:
        return ""
    shares = {name: [cell["constants"]["averaged"][name]["share"] for cell in cells] for name in CONSTANTS}
    worst = min(shares, key=lambda name: max(shares[name]))
    shown = " and ".join(f"{100 * one:.0f} %" for one in shares[worst])
    return f"; with an effect that the library does not know they hold {worst} on {shown}"


def plain(value: Any) -> Any:
    """The same with six digits and None for what is not a number, as JSON wants it."""
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value


def page(summary: Mapping[str, Any]) -> list[str]:
    """Lines of the page."""
    return [
        "# The trial of `diagnose`",
        "",
        "Written by `make trial`; do not edit. Boards are planted by an independent generator (a Ritz solver with "
        "other formulations and quadratures than the package's), read from their cards, and judged as `diagnose` "
        "judges them: the same search, verdict and claim, which need no draws of the sampler. Null simulations are "
        "made once for all boards of a design whose cards state the same noise. Every board carries a sensor of "
        "unstated mass at the same place of its design, so that a card does not tell what is planted. Sizes are "
        "multiples of a nominal size; air and transverse shear keep theirs.",
        "",
        *WORDS,
        "",
        BEFORE,
        "",
        *judged(summary),
        *_records(summary),
        "",
        *tables(summary),
        "",
        *CHANGED,
    ]


def judged(summary: Mapping[str, Any]) -> list[str]:
    """How many boards were judged, and those that gave no answer."""
    boards = summary["boards"]
    return [
        f"{boards['judged']} boards of {boards['wanted']} judged, {boards['failed']} gave no answer, base seed "
        f"{summary['base_seed']}.",
        *(f"- no answer: {one['cell']}, board {one['index']}: {one['error']}" for one in summary["failures"]),
    ]


def tables(summary: Mapping[str, Any]) -> list[str]:
    """What the boards of a summary add up to, from the acceptance limits on."""
    return [
        "## Acceptance limits",
        "",
        *_table(("quantity", "acceptance limit", "found", "", "note"), map(_limit_row, summary["limits"])),
        *_confusions(summary),
        *_cells(summary),
        *_constants(summary),
        *_amplitudes(summary),
        *_claims(summary),
    ]


def _records(summary: Mapping[str, Any]) -> Iterable[str]:
    """Where the records are, or how they are made again and known to be the same."""
    kept = summary["records"]
    if not kept:
        return
    lines = f"{kept['lines']} lines of JSON, SHA-256 of the text `{kept['sha256']}`"
    where = f"in [{kept['file']}]({kept['file']})" if kept["file"] else f"made by `{kept['command']}`"
    yield from ("", f"The records of all boards: {lines}, {where}.")


def _limit_row(limit: Mapping[str, Any]) -> tuple[str, ...]:
    return limit["quantity"], limit["limit"], limit["shown"], "met" if limit["met"] else "**missed**", limit["note"]


def _confusions(summary: Mapping[str, Any]) -> Iterable[str]:
    for name, rows in summary["confusion"].items():
        yield from ("", f"## What became of each effect: {name}", "")
        body = [
            (
                effect,
                *(str(row[column]) for column in ("n", *COLUMNS)),
                _percent(row["top_1"]),
                ", ".join(f"{wrong} {count}" for wrong, count in row["wrong_names"].items()),
            )
            for effect, row in rows.items()
        ]
        yield from _table(("planted", "boards", *COLUMNS, "best is right", "wrong names"), body)


def _cells(summary: Mapping[str, Any]) -> Iterable[str]:
    yield from ("", "## Cells", "")
    words = ("named", "indistinguishable group", "none needed", "undetectable", "unexplained")
    body = [
        (
            name,
            str(cell["n"]),
            *(str(cell["words"].get(word, 0)) for word in words),
            _percent(cell.get("top_1")),
            _percent(cell.get("wrong_name")),
            _percent(cell.get("part_name")) if name.startswith("two") else "",
            _percent(cell["claimed"]),
            _percent(cell.get("covered")),
            _number(cell.get("set_size")),
        )
        for name, cell in summary["cells"].items()
    ]
    head = ("cell", "boards", *words, "best is right", "unique and wrong", "one of two named", "claimed",
            "in the set given", "mean size of the set")  # fmt: skip
    yield from _table(head, body)


def _constants(summary: Mapping[str, Any]) -> Iterable[str]:
    yield from ("", "## Intervals of 90 % for the constants: how many hold the truth, percent", "")
    body = []
    for name, cell in summary["cells"].items():
        if "constants" not in cell:
            continue
        shares = [[cell["constants"][way][c]["share"] for c in CONSTANTS] for way in WAYS]
        body.append((name, *(" / ".join(f"{100 * one:.0f}" for one in each) for each in shares)))
    yield from _table(("cell", *(f"{shown}: {' / '.join(CONSTANTS)}" for shown in WAYS.values())), body)


def _amplitudes(summary: Mapping[str, Any]) -> Iterable[str]:
    yield from ("", "## Sizes of what is named right", "")
    body = [
        (effect, str(one["covered"]["n"]), _percent(one["median_error"], "value"), _percent(one["covered"]))
        for effect, one in summary["amplitudes"].items()
    ]
    yield from _table(("effect", "boards", "median relative error", "90 % intervals that hold the truth"), body)


def _claims(summary: Mapping[str, Any]) -> Iterable[str]:
    yield from ("", "## How often an effect is claimed to reduce the error, and each condition is met", "")
    judged = [
        condition
        for condition in CONDITIONS
        if all(condition in one["conditions"] for one in summary["claims"].values())
    ]
    body = [
        (
            name,
            str(one["claimed"]["n"]),
            _percent(one["claimed"]),
            *(_percent(one["conditions"][condition]) for condition in judged),
        )
        for name, one in summary["claims"].items()
    ]
    yield from _table(("boards that are", "boards", "claimed", *judged), body)
    yield from (
        "",
        "The conditions are judged only where the verdict is a name or a group: their shares are of those boards, the "
        "share claimed is of all.",
    )


def _percent(found: Mapping[str, Any] | None, key: str = "share") -> str:
    """A share with its bounds, percent; empty where there is none."""
    if not found or found[key] is None:
        return ""
    bounds = [found["low"], found["high"]]
    shown = "" if None in bounds else f" ({100 * bounds[0]:.1f} to {100 * bounds[1]:.1f})"
    return f"{100 * found[key]:.1f} %{shown}"


def _number(found: Mapping[str, Any] | None) -> str:
    return "" if not found or found["value"] is None else f"{found['value']:.2f}"


def _table(head: Sequence[str], body: Iterable[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *body)]
