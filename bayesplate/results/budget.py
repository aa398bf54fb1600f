"""Where the uncertainty of the constants comes from: which input to measure better."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import PriorCard
from bayesplate.plate.board import Board
from bayesplate.plate.sessions import OF_MODES
from bayesplate.posterior.draws import Draws

LARGE_SHARE = 0.5
_OF_DISCREPANCIES = ", which more sessions do not narrow: read other modes, or look for what the plate lacks (diagnose)"


def input_shares(draws: Draws) -> dict[str, dict[str, float]]:
    """Share of the variance of the logarithm of each modulus that goes with each uncertain input, 0 to 1.

    The squared correlation with the input itself: one centred on zero, a taper, has no logarithm, and that of a
    positive one hardly differs over its few per cent.
    """
    shares: dict[str, dict[str, float]] = {}
    for modulus, values in draws.moduli.items():
        log_modulus = np.log(values).ravel()
        shares[modulus] = {
            name: float(np.corrcoef(log_modulus, column.ravel())[0, 1] ** 2) for name, column in draws.inputs.items()
        }
    return shares


def budget(draws: Draws, board: Board) -> dict[str, dict[str, float]]:
    """Share of the variance of the logarithm of each modulus that goes with each row of the budget, 0 to 1.

    A row is an uncertain input, as in `input_shares`, or what means nothing but together, an effect's components or the
    discrepancies of all modes: theirs is the part of the variance that a regression on all of them explains.
    """
    together: dict[str, list[str]] = {}
    for one in board.uncertain:
        if one.is_component:
            together.setdefault(one.effect or one.words, []).append(one.name)
    components = {name for names in together.values() for name in names}
    shares = input_shares(draws)
    for modulus, values in draws.moduli.items():
        kept = {name: share for name, share in shares[modulus].items() if name not in components}
        shares[modulus] = kept | {
            effect: _explained(np.log(values).ravel(), np.column_stack([draws.inputs[name].ravel() for name in names]))
            for effect, names in together.items()
        }
    return shares


def row_words(row: str, board: Board) -> str:
    """What people call a row of the budget."""
    return next((one.words for one in board.uncertain if one.name == row), row.replace("_", " "))


def _explained(values: NDArray[np.float64], columns: NDArray[np.float64]) -> float:
    """Part of the variance of (n,) values that a regression on (n, k) columns explains."""
    about, centred = values - values.mean(), columns - columns.mean(axis=0)
    fitted = centred @ np.linalg.lstsq(centred, about, rcond=None)[0]
    return float(fitted @ fitted / (about @ about))


def prior_remarks(draws: Draws, prior: PriorCard) -> list[str]:
    """One sentence on the constants whose posterior is more than half as wide as their prior, or none."""
    drawn = {**draws.moduli, **draws.rigidities}
    widths = {name: float(np.std(np.log(drawn[name]))) / one.log_sd for name, one in prior.constants.items()}
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
        ruled = {modulus: by_input[name] for modulus, by_input in shares.items() if by_input[name] > LARGE_SHARE}
        if ruled:
            least, most = 100 * min(ruled.values()), 100 * max(ruled.values())
            share = f"{most:.0f} %" if most - least < 1 else f"{least:.0f} to {most:.0f} %"
            sentences.append(
                f"{share} of the uncertainty (variance) of {', '.join(ruled)} comes from the {row_words(name, board)}"
                f"{_OF_DISCREPANCIES if name == OF_MODES else ': measure it better before anything else'}"
            )
    return sentences
