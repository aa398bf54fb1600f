"""Where the uncertainty of the constants comes from: which input to measure better."""

from __future__ import annotations

import numpy as np

from bayesplate.board.board import Board
from bayesplate.board.prior import PriorCard
from bayesplate.board.sessions import MODE_DISCREPANCIES
from bayesplate.posterior.draws import Draws

LARGE_SHARE = 0.5
_SAME_INPUT = 1e-9
"""Variance of a combination of inputs, relative to one input's, below which it is redundant."""
_DISCREPANCY_ADVICE = (
    ", which more sessions do not narrow: read other modes, or look for what the plate lacks (diagnose)"
)


def input_shares(draws: Draws) -> dict[str, dict[str, float]]:
    """Share of the variance of the logarithm of each modulus that goes with each uncertain input, 0 to 1.

    Readings that depend on two inputs at once leave them correlated, and the squared correlations with each would add
    up to more than the variance. So the inputs are decorrelated first, each changed as little as possible; the squared
    correlations with the decorrelated inputs add up to what a regression on all inputs explains.

    The logarithm of a modulus is taken to be linear in the inputs themselves: an input centred on zero, such as a
    taper, has no logarithm, and that of a positive input is nearly linear over its few per cent.

    References
    ----------
    V. Zuber and K. Strimmer, High-dimensional regression and variable selection using CAR scores, Statistical
    Applications in Genetics and Molecular Biology 10 (2011), doi:10.2202/1544-6115.1730.
    """
    names, n = list(draws.inputs), len(draws.inputs)
    moduli = [np.log(values).ravel() for values in draws.moduli.values()]
    correlations = np.atleast_2d(np.corrcoef([*(column.ravel() for column in draws.inputs.values()), *moduli]))
    variances, directions = np.linalg.eigh(correlations[:n, :n])
    distinct = variances > _SAME_INPUT * n
    uncorrelated = (directions[:, distinct] / np.sqrt(variances[distinct])) @ directions[:, distinct].T
    shares = (uncorrelated @ correlations[:n, n:]) ** 2
    return {modulus: dict(zip(names, shares[:, i].tolist(), strict=True)) for i, modulus in enumerate(draws.moduli)}


def budget(draws: Draws, board: Board) -> dict[str, dict[str, float]]:
    """Share of the variance of the logarithm of each modulus that goes with each row of the budget, 0 to 1.

    A row is an uncertain input, as in `input_shares`, or a group of inputs that has a meaning only as a whole: the
    components of an effect, or the discrepancies of all modes. The share of a group is the sum of its shares.
    """
    rows = {
        parameter.name: (parameter.effect or parameter.display_name) if parameter.is_component else parameter.name
        for parameter in board.uncertain
    }
    result = {}
    for modulus, by_input in input_shares(draws).items():
        of_row: dict[str, float] = {}
        for name, share in by_input.items():
            row = rows.get(name, name)
            of_row[row] = of_row.get(row, 0.0) + share
        result[modulus] = of_row
    return result


def row_words(row: str, board: Board) -> str:
    """A row of the budget in words."""
    return next(
        (parameter.display_name for parameter in board.uncertain if parameter.name == row), row.replace("_", " ")
    )


def prior_remarks(draws: Draws, prior: PriorCard) -> list[str]:
    """One sentence on the constants whose posterior is more than half as wide as their prior; empty without any."""
    constants = {**draws.moduli, **draws.rigidities}
    widths = {
        name: float(np.std(np.log(constants[name]))) / quantity.log_sd for name, quantity in prior.constants.items()
    }
    wide = [f"{name} ({width:.2f} times as wide)" for name, width in widths.items() if width > LARGE_SHARE]
    if not wide:
        return []
    return [
        f"the readings add little to the prior '{prior.name}' on {', '.join(wide)}: it decides much of what is shown"
    ]


def input_remarks(draws: Draws, board: Board) -> list[str]:
    """One sentence per input that makes more than half of the uncertainty of a modulus."""
    shares = budget(draws, board)
    sentences = []
    for name in next(iter(shares.values())):
        large_shares = {modulus: by_input[name] for modulus, by_input in shares.items() if by_input[name] > LARGE_SHARE}
        if large_shares:
            least, most = 100 * min(large_shares.values()), 100 * max(large_shares.values())
            share = f"{most:.0f} %" if most - least < 1 else f"{least:.0f} to {most:.0f} %"
            sentences.append(
                f"{share} of the uncertainty (variance) of {', '.join(large_shares)} comes from the "
                f"{row_words(name, board)}"
                f"{_DISCREPANCY_ADVICE if name == MODE_DISCREPANCIES else ': measure it better before anything else'}"
            )
    return sentences
