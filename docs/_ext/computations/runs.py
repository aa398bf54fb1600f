"""What the commands of the pages have left in the folder that they ran in."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

from bayesplate.board.sessions import DISCREPANCY
from commands import bench, printed
from computations.markdown import picture, table, words_table

SOURCE = Path(__file__).resolve().parents[2]
_MOST_WORDS = {
    "summary.json": "every number above and many more, in SI units;",
    "posterior.nc": "all draws, for [ArviZ](https://python.arviz.org) and for your own plots;",
    "constants.csv": "the constants as a table, and the same for LaTeX in `constants.tex`;",
    "figures": "the figures of the report, as PNG and SVG;",
    "report.html": "the report: one page with all figures, readable on a phone, that needs nothing else.",
}


def _summary(card: str, *options: str) -> dict[str, Any]:
    """The summary of a fit that a page runs, or has run: the same command is never run twice."""
    folder = bench(SOURCE)
    path = folder / "results" / card / "summary.json"
    named = card if not (folder / f"{card}.toml").exists() else f"{card}.toml"
    code, text = printed(" ".join(["fit", named, *options]), folder)
    assert code == 0, text
    return json.loads(path.read_text(encoding="utf-8"))


def sheet_of(folder: Path, card: str) -> str:
    """The sheet of Chladni figures that `modes` has written."""
    code, text = printed(f"modes {card}.toml", bench(SOURCE))
    assert code == 0, text
    name = f"sheet-{card}.png"
    shutil.copy(bench(SOURCE) / "results" / card / "modes.png", folder / name)
    return picture(name, "a sheet with the Chladni figures of the lowest modes, each with its label and frequency")


def files_of(folder: Path, card: str, *options: str) -> str:
    """What a fit has written, each file with a few words; the report is linked where there is one."""
    _summary(card, *options)
    results = bench(SOURCE) / "results" / card
    lines = [f"`{name}`\n: {words}\n" for name, words in _MOST_WORDS.items() if (results / name).exists()]
    if (results / "report.html").exists():
        extra = SOURCE / "_generated" / "extra"
        extra.mkdir(parents=True, exist_ok=True)
        shutil.copy(results / "report.html", extra / f"report-{card}.html")
        lines.append(f'<a href="report-{card}.html">The report of this board</a>, as the command wrote it.\n')
    return "\n".join(lines)


def thickness_part(folder: Path, card: str) -> str:
    """How much of each constant's uncertainty the thickness makes, by its third power at a given mass."""
    summary = _summary(card)
    entry = summary["inputs"]["thickness"]
    known = 100 * entry["sd"] / entry["mean"]
    whole = [100 * e["sd"] / e["mean"] for e in summary["elastic"].values()]
    return (
        f"The readings of the caliper leave the mean thickness uncertain by {known:.1f} %. At a given mass a constant "
        f"goes with its third power, so that alone makes it uncertain by {3 * known:.1f} %; all together leave "
        f"{min(whole):.1f} to {max(whole):.1f} %.\n"
    )


def provenance(folder: Path, card: str) -> str:
    """The entries of a summary that say what a run depends on."""
    summary = _summary(card)
    kept = {name: summary[name] for name in ("seed", "card_sha256", "versions", "model")}
    kept["card_sha256"] = kept["card_sha256"][:16] + "..."
    return "```json\n" + json.dumps(kept, indent=2) + "\n```\n"


def both_laws(folder: Path, card: str) -> str:
    """Posterior means under both laws, and the error of the linear one."""
    summary = _summary(card)
    rows = [
        (
            f"${name}$",
            f"{summary['linear_means'][name] / 1e9:.3f}",
            f"{summary['exact_means'][name] / 1e9:.3f}",
            f"{entry['sd'] / 1e9:.3f}",
        )
        for name, entry in ((n, summary["elastic"][n]) for n in ("E_x", "E_y"))
    ]
    rows.append(
        (
            "$G_{xy}$",
            *(f"{summary[which]['G_xy'] / 1e9:.3f}" for which in ("linear_means", "exact_means")),
            f"{summary['elastic']['G_xy']['sd'] / 1e9:.3f}",
        )
    )
    error = summary["error"]["linearisation_rms_cents"]
    noise = ", ".join(f"{100 * entry['q50']:.2f} %" for entry in summary["noise"].values())
    return (
        table(("GPa", "mean, linear law", "mean, exact law", "standard deviation"), rows)
        + f"\nThe linear law is off by {error:.1f} cents (rms over the posterior), beside a noise of {noise}; this fit "
        f"used the {summary['model']['law']} law.\n"
    )


def exact_law(folder: Path, *cards: str) -> str:
    """The worst error of the exact law against full solves that it has not seen."""
    rows = [(f"`{card}`", f"{_summary(card)['error']['exact_law_worst_cents']:.3f}") for card in cards]
    text = words_table(("board", "largest error over all modes and held-out points, cents"), rows)
    return (
        text
        + "\nEvery fit makes this comparison and states it; a fifth of the smallest scatter of a reading is accepted.\n"
    )


def sessions_together(folder: Path) -> str:
    """What three sessions of one board say together: the scatter of each, and what the board does in all of them."""
    summary = _summary("nemus-D")
    rows = [(f"noise of {name}", _percents(entry)) for name, entry in summary["noise"].items()]
    rows += [
        ("discrepancy of the board", _percents(entry))
        for name, entry in summary["inputs"].items()
        if name.startswith(DISCREPANCY)
    ]
    return table(("", "median, %", "90 % interval, %"), [(words, *numbers) for words, numbers in rows])


def _percents(entry: dict[str, float]) -> tuple[str, str]:
    low, median, high = (100 * entry[key] for key in ("q05", "q50", "q95"))
    return f"{median:.2f}", f"{low:.2f} to {high:.2f}"
