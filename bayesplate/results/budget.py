"""Where the uncertainty of the constants comes from: which input to measure better."""

from __future__ import annotations

import numpy as np

from bayesplate.cards import PriorCard
from bayesplate.plate.board import Board
from bayesplate.posterior.draws import Draws

LARGE_SHARE = 0.5


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
    shares = input_shares(draws)
    sentences = []
    for name in draws.inputs:
        ruled = {modulus: by_input[name] for modulus, by_input in shares.items() if by_input[name] > LARGE_SHARE}
        if ruled:
            least, most = 100 * min(ruled.values()), 100 * max(ruled.values())
            share = f"{most:.0f} %" if most - least < 1 else f"{least:.0f} to {most:.0f} %"
            sentences.append(
                f"{share} of the uncertainty (variance) of {', '.join(ruled)} comes from the "
                f"{board.parameter(name).words}: measure it better before anything else"
            )
    return sentences
