"""What the readings determine before any sampling: standard errors, condition number, leverages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.effects.words import joined
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.leave_one_out import HIGH_LEVERAGE
from bayesplate.plate.board import Board
from bayesplate.plate.material import RIGIDITIES

WITHIN_A_FACTOR = 2.0
"""A constant is identifiable if its 95 % interval at the expected noise stays within this factor of the estimate."""

LOW_SHARE_PERCENT = 60.0
_HELD = {"clamped", "supported"}
"""Edges that do not move: where all are, the integral of w_xx w_yy is that of w_xy^2."""
_MODULUS = {"D_x": "E_x", "D_y": "E_y", "D_s": "G_xy"}
_HELP = {
    "D_x": "a mode that bends along the grain",
    "D_y": "a mode that bends across the grain",
    "D_s": "a mode that twists",
}


@dataclass(frozen=True, eq=False)
class Identifiability:
    """How well n readings determine the three constants, to first order at the estimate.

    Attributes
    ----------
    condition_number : float
        Of the weighted sensitivities d ln f / d ln D: dimensionless, free of the units of the constants.
    covariance : (3, 3) array
        Of ln D_x, ln D_y, ln D_s at the expected noise.
    leverages : (n_modes,) array
        Share of each reading in its own prediction, 0 to 1; they sum to 3.
    shares : (n_modes, 3) array
        Share of each constant in each mode's energy; rows sum to 1.
    """

    condition_number: float
    covariance: NDArray[np.float64]
    leverages: NDArray[np.float64]
    shares: NDArray[np.float64]

    @property
    def standard_errors(self) -> NDArray[np.float64]:
        """Of the logarithms of D_x, D_y, D_s: (3,) array."""
        return np.sqrt(np.diagonal(self.covariance))

    def blind(self) -> tuple[str, ...]:
        """Constants that the readings do not determine within the factor `WITHIN_A_FACTOR`."""
        limit = np.log(WITHIN_A_FACTOR) / 1.96
        return tuple(n for n, error in zip(RIGIDITIES, self.standard_errors, strict=True) if not error <= limit)


def identifiability(sensitivities: NDArray[np.float64], scales: NDArray[np.float64]) -> Identifiability:
    """First-order identifiability from sensitivities and the relative uncertainties of the readings.

    Parameters
    ----------
    sensitivities : (n_modes, 3) array
        d ln f / d ln D.
    scales : (n_modes,) array
        Relative uncertainty of each reading.

    Returns
    -------
    Identifiability
        With infinite variances where the readings leave a direction open.
    """
    weighted = sensitivities / scales[:, None]
    left, singular, right = np.linalg.svd(weighted, full_matrices=False)
    seen = singular > 1e-10 * singular[0]
    with np.errstate(divide="ignore"):
        inverse = np.where(seen, 1.0 / singular, np.inf) if seen.sum() == 3 else np.full(3, np.inf)
    covariance = (right.T * inverse**2) @ right if np.isfinite(inverse).all() else np.diag(np.full(3, np.inf))
    condition = float(singular[0] / singular[-1]) if seen.sum() == 3 else float("inf")
    return Identifiability(condition, covariance, np.sum(left[:, seen] ** 2, axis=1), 2.0 * sensitivities)


def require_labels(board: Board) -> None:
    """Refuse a board whose labelled modes are too few for three constants, or a setup without any.

    Raises
    ------
    NotIdentifiableError
    """
    for setup in board.setups:
        if not setup.readings:
            n = len(setup.peaks)
            are = "is" if n == 1 else "are"
            peaks = f"and its {n} peak{'s' * (n != 1)} {are} none with certainty" if n else "it has no peaks either"
            raise NotIdentifiableError(
                f"{board.name}: setup {setup.name!r} has no labelled mode, {peaks}; give at least one label"
            )
    n_modes = sum(len(setup.readings) for setup in board.setups)
    if n_modes < 3:
        raise NotIdentifiableError(
            f"{board.name}: {n_modes} labelled mode{'s' * (n_modes != 1)} for three constants D_x, D_y, D_s: at least "
            f"{3 - n_modes} more needed, bending along the grain, across it, and twisting between them"
        )


def require_identifiable(board: Board, found: Identifiability) -> None:
    """Refuse readings that leave a constant open, naming it and what would help.

    Raises
    ------
    NotIdentifiableError
    """
    blind = found.blind()
    if not blind:
        return
    with np.errstate(over="ignore"):
        spread = np.exp(1.96 * found.standard_errors)
    parts = []
    for name, factor in zip(RIGIDITIES, spread, strict=True):
        if name in blind:
            reach = f"only within a factor {factor:.3g}" if np.isfinite(factor) and factor < 1e6 else "not at all"
            parts.append(f"{name} (so {_MODULUS[name]}) {reach}; add {_HELP[name]}")
    raise NotIdentifiableError(
        f"{board.name}: the modes {_modes(board)} determine " + "; ".join(parts) + f" (condition number "
        f"{found.condition_number:.3g})"
    )


def _modes(board: Board) -> str:
    """Labels of the readings, setup by setup where there are several: two sessions may have the same ones."""
    by_setup = {setup.name: ", ".join(str(label) for label in setup.labels) for setup in board.setups}
    if len(by_setup) == 1:
        return "".join(by_setup.values())
    return joined([f"{labels} of {name}" for name, labels in by_setup.items()])


def remarks(board: Board, found: Identifiability, carrying: str | None = None) -> tuple[str, ...]:
    """Sentences on what is weakly known, for the table and the summary; empty where there is nothing to say.

    Parameters
    ----------
    board : Board
    found : Identifiability
    carrying : str, optional
        What a fit says of modes that alone carry something; before there is one, their leverages here say it.
    """
    sentences = [_weakest(found)]
    names = [
        (f"{label}" if len(board.setups) == 1 else f"{label} of {setup.name}")
        for setup in board.setups
        for label in setup.labels
    ]
    if len(names) == 3:
        sentences.append(
            "three modes fix three constants exactly: nothing is left to check the model with, and the noise comes "
            "from its prior alone"
        )
    elif carrying is not None:
        sentences += [carrying] if carrying else []
    else:
        for name, leverage in zip(names, found.leverages, strict=True):
            if leverage > HIGH_LEVERAGE:
                sentences.append(
                    f"mode {name} alone carries a constant (leverage {leverage:.2f}): an error in it cannot be seen"
                )
    if all(set(setup.edges.values()) <= _HELD for setup in board.setups):
        for setup in board.setups:
            held = "clamped" if set(setup.edges.values()) == {"clamped"} else "held"
            sentences.append(
                f"setup {setup.name} is {held} all round: only D_s + 2 nu_xy D_y is seen, so G_xy depends on nu_xy"
            )
    return tuple(sentences)


def _weakest(found: Identifiability) -> str:
    errors: Mapping[str, float] = dict(zip(RIGIDITIES, found.standard_errors, strict=True))
    weakest = max(errors, key=lambda name: errors[name])
    share, error = 100 * found.shares[:, RIGIDITIES.index(weakest)].max(), 100 * errors[weakest]
    sentence = (
        f"the modes tell {_MODULUS[weakest]} least well: the expected noise alone leaves it "
        f"{error:.{max(1 - int(np.floor(np.log10(min(error, 10.0)))), 0)}f} % uncertain"
    )
    if share < LOW_SHARE_PERCENT:
        sentence += f", because no mode has more than {share:.0f} % of its energy in it"
    return sentence
