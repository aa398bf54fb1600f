"""Leave-one-out by ArviZ beside refits, as the example of ArviZ computes it."""

from __future__ import annotations

import runpy
from functools import cache
from pathlib import Path
from typing import Any

from computations.markdown import table

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "arviz_checks.py"


@cache
def _found() -> dict[str, Any]:
    found: dict[str, Any] = runpy.run_path(str(EXAMPLE))["run"]()
    return found


def pareto(folder: Path) -> str:
    """Every reading of the board: how much the fit leans on it, Pareto k, both densities, the package's own error."""
    found = _found()
    rows = [
        (
            label.partition(" ")[2],
            f"{found['leverage'][label]:.2f}",
            f"**{k:.2f}**" if k > 0.7 else f"{k:.2f}",
            _with_error(found["weighed"][label]),
            "open" if found["refitted"][label] is None else _with_error(found["refitted"][label]),
            f"{found['left_out_cents'][label]:+.0f}",
        )
        for label, k in found["pareto_k"].items()
    ]
    columns = ("mode", "leverage", "Pareto k", "ln density by weights", "by a refit", "leave-one-out error, cents")
    return table(columns, rows)


def _with_error(known: tuple[float, float]) -> str:
    return f"{known[0]:.2f} ± {known[1]:.2f}"


def pareto_told(folder: Path) -> str:
    """The same in a sentence."""
    found = _found()
    high = [label.partition(" ")[2] for label, k in found["pareto_k"].items() if k > 0.7]
    unseen = [label.partition(" ")[2] for label, value in found["refitted"].items() if value is None]
    highest = max(found["pareto_k"].values())
    refitted = {label: known[0] for label, known in found["refitted"].items() if known is not None}
    worst = max(abs(found["weighed"][label][0] - value) for label, value in refitted.items())
    return (
        f"Weights do not serve for {' and '.join(high)}, with a Pareto k of up to {highest:.2f}. "
        f"Without {' and '.join(unseen)} the other readings leave a constant open: `fit` refuses to go on, while the "
        f"weights still give a number. Elsewhere both densities differ by at most {worst:.2f}. The effective number of "
        f"parameters is {found['effective_parameters']:.1f} for {len(found['pareto_k'])} readings.\n"
    )
