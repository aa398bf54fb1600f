"""Where the uncertainty of a constant comes from: what to measure better, and what the frequencies taught.

A free guitar half-top, nine modes, and a caliper that read the thickness ten times to 0.1 mm. The script fits the
board, writes the results of the fit where it is told to, and answers two questions.

*What should be measured better?* Each uncertain input (thickness, mass, lengths, Poisson ratio) is given its part of
the standard deviation of each constant; what is left belongs to the frequencies. Two computations that share nothing
with this one stand beside it: the same fit with all sizes taken as exact, whose standard deviation is what the
frequencies and the Poisson ratio leave, and, in the numbers that are returned, the powers in which a constant depends
on the inputs at given frequencies, worked out by hand.

*What did the frequencies teach?* Each width before the measurement stands beside the width after it. The constants
shrink by a factor of fifty and more. The thickness and the mass do not shrink at all: no frequency can tell them, so
their uncertainty goes into the constants as it is.

    python examples/uncertainty_report.py uncertainty
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

import bayesplate
from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import prepare
from bayesplate.posterior.draws import named_draws
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import pose
from bayesplate.posterior.sampling import SamplerSettings

CARD = "spruce-free-2R"
UNIFORM: tuple[str, ...] = ()
"""Effects: no field of the thickness, so that each size is one number."""
POWERS = {
    "E_x": {"thickness": 3, "mass": 1, "length_x": 3, "length_y": 1},
    "E_y": {"thickness": 3, "mass": 1, "length_x": 1, "length_y": 3},
    "G_xy": {"thickness": 3, "mass": 1, "length_x": 1, "length_y": 1},
}
"""Of each input in a constant at given frequencies and mass, signs left out: D_x goes with m L_x^3 / L_y, E_x with
D_x / h^3, and so on. The Poisson ratio spoils the powers of the lengths, a little; those of h and m are exact."""
FREQUENCIES = "frequencies"
WORDS = {
    "thickness": "thickness",
    "mass": "mass",
    "length_x": "length, along",
    "length_y": "length, across",
    "poisson_xy": "Poisson ratio",
    FREQUENCIES: "the frequencies",
}
MARKS = {"E_x": ("o", "#0072B2"), "E_y": ("s", "#D55E00"), "G_xy": ("^", "#009E73")}
"""Okabe and Ito's colours, told apart by every eye; the shapes serve in grey."""


def run(folder: Path | None = None, card: str = CARD, seed: int = 1) -> dict[str, Any]:
    """Fit a board, share out its uncertainty, and compare before with after.

    Parameters
    ----------
    folder : Path, optional
        Where to write the results of the fit and the figure of the budget.
    card : str
    seed : int

    Returns
    -------
    dict
        budget: by constant, sd_percent, parts (by input and for the frequencies, per cent of the constant; where the
        inputs are independent their squares sum to that of sd_percent), by_hand (the same for inputs whose power is
        known) and exact_inputs_percent (the sd of a fit with exact sizes). widths: by quantity, before and after, the
        standard deviation of its logarithm in per cent. effective_draws: of the parameter that has the fewest.
    """
    labelled = with_sure_labels(bayesplate.Problem.from_card(card).board)
    result = bayesplate.fit(labelled, out=folder, force=True, seed=seed, effects=UNIFORM)
    board, draws = result.inference.problem.board, result.draws
    means = {name: float(np.mean(values)) for name, values in draws.inputs.items()}
    alone = exact_inputs(labelled, seed, means)
    budget = {}
    for name, values in draws.moduli.items():
        powers = {one: power for one, power in POWERS[name].items() if one in draws.inputs}
        budget[name] = {
            "sd_percent": 100 * float(np.std(np.log(values))),
            "parts": parts_of(values, draws.inputs),
            "by_hand": {one: power * percent(board.inputs[one]) for one, power in powers.items()},
            "exact_inputs_percent": alone[name],
        }
    effective = result.summary.sampler.ess_min
    numbers = {"budget": budget, "widths": widths(result), "effective_draws": effective}
    if folder is not None:
        figure_of(board, numbers).savefig(folder / "uncertainty.png", dpi=150)
    return numbers


def parts_of(constant: np.ndarray, inputs: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Parts of the standard deviation of a constant that go with each input and with none of them, per cent.

    By a regression of its logarithm on all inputs at once: a correlation with one input alone is blurred by the others.
    """
    logs = np.column_stack([np.log(np.abs(values)).ravel() for values in inputs.values()])
    logs -= logs.mean(axis=0)
    wanted = np.log(constant).ravel() - np.log(constant).mean()
    slopes, *_ = np.linalg.lstsq(logs, wanted, rcond=None)
    parts = dict(zip(inputs, 100 * np.abs(slopes) * logs.std(axis=0), strict=True))
    parts[FREQUENCIES] = 100 * np.std(wanted - logs @ slopes)
    return {name: float(part) for name, part in parts.items()}


def percent(quantity: Quantity) -> float:
    """Standard deviation of a quantity, per cent of its mean."""
    return 100 * quantity.sd / abs(quantity.mean)


def with_sure_labels(board: Board) -> Board:
    """The board without its bare peaks: a posterior that mixes several ways to take them has no parts that add up."""
    setups = (
        replace(setup, peaks=(), readings=tuple(replace(reading, confidence=1.0) for reading in setup.readings))
        for setup in board.setups
    )
    return replace(board, setups=tuple(setups))


def exact_inputs(board: Board, seed: int, means: Mapping[str, float]) -> dict[str, float]:
    """Standard deviation of each constant, per cent, with every size exact: what the frequencies leave open."""
    prepared = prepare(board, UNIFORM)
    sure = {
        name: replace(prepared.board.inputs[name], mean=mean, sd=0.0)
        for name, mean in means.items()
        if name != "poisson_xy"
    }
    problem = pose(prepared.board.with_priors(sure), prepared.prior)
    draws = named_draws(infer(problem, SamplerSettings(seed=seed)), seed)
    return {name: 100 * float(np.std(np.log(values))) for name, values in draws.moduli.items()}


def widths(result: bayesplate.FitResult) -> dict[str, dict[str, float]]:
    """Standard deviation of the logarithm of constants, noise and inputs before and after, per cent."""
    problem, draws = result.inference.problem, result.draws
    (setup,) = problem.board.setups
    rows = {
        name: {"before": 100 * problem.prior.constants[name].log_sd, "after": 100 * float(np.std(np.log(values)))}
        for name, values in draws.moduli.items()
    }
    rows["noise"] = {"before": 100 * setup.noise.log_sd, "after": 100 * float(np.std(np.log(draws.noise)))}
    for name, values in draws.inputs.items():
        rows[name] = {
            "before": percent(problem.board.inputs[name]),
            "after": 100 * float(np.std(values) / abs(np.mean(values))),
        }
    return rows


def figure_of(board: Board, numbers: dict[str, Any]) -> Any:
    """The budget above, before and after below."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 7.2), layout="constrained")
    above, below = figure.subplots(2, 1)
    figure.suptitle(board.title or board.name, fontsize=11)
    rows = [name for name in WORDS if name in numbers["budget"]["E_x"]["parts"]]
    for offset, (name, (mark, colour)) in zip((-0.18, 0.0, 0.18), MARKS.items(), strict=True):
        parts = numbers["budget"][name]["parts"]
        places = np.arange(len(rows)) + offset
        above.hlines(places, 0, [parts[row] for row in rows], color=colour, lw=1.2)
        above.plot([parts[row] for row in rows], places, mark, color=colour, ms=6, label=name)
    above.set_yticks(range(len(rows)), [WORDS[row] for row in rows])
    above.set_xlabel("part of the standard deviation, % of the constant")
    above.set_title("What should be measured better", fontsize=10, loc="left")
    above.legend(frameon=False, fontsize=9, loc="lower right")
    learnt = numbers["widths"]
    names = [name for name in (*MARKS, "noise", *WORDS) if name in learnt]
    for place, name in enumerate(names):
        before, after = learnt[name]["before"], learnt[name]["after"]
        below.plot([after, before], [place, place], color="0.6", lw=1.5, zorder=1)
        below.plot(before, place, "o", mfc="white", mec="black", ms=7, label="before" if place == 0 else None)
        below.plot(after, place, "o", color="#0072B2", ms=5, label="after" if place == 0 else None)
    below.set_yticks(range(len(names)), [WORDS.get(name, name) for name in names])
    below.set_xscale("log")
    below.set_xticks([0.1, 1, 10, 100], ["0.1", "1", "10", "100"])
    below.set_xlabel("uncertainty before and after the frequencies were read, %")
    below.set_title("What the frequencies taught", fontsize=10, loc="left")
    below.legend(frameon=False, fontsize=9, loc="lower right")
    for panel in (above, below):
        panel.invert_yaxis()
        panel.spines[["top", "right"]].set_visible(False)
        panel.grid(axis="x", color="0.9", lw=0.8)
        panel.set_axisbelow(True)
    return figure


def _print(numbers: dict[str, Any]) -> None:
    for name, row in numbers["budget"].items():
        parts = ", ".join(f"{WORDS[one]} {part:.2f}" for one, part in row["parts"].items())
        print(f"{name:5s} ± {row['sd_percent']:.2f} %: {parts}; with exact sizes {row['exact_inputs_percent']:.2f}")
    for name, row in numbers["widths"].items():
        print(f"{WORDS.get(name, name):15s} {row['before']:7.2f} % before, {row['after']:6.2f} % after")


if __name__ == "__main__":
    _print(run(Path(sys.argv[1]) if len(sys.argv) > 1 else None))
