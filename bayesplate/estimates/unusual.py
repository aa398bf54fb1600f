"""Unusual boards: constants out of their prior's reach, an extreme ratio of moduli, a density of another wood."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, board_density
from bayesplate.board.material import MODULI, RIGIDITIES, moduli_of
from bayesplate.board.prior import PriorCard
from bayesplate.estimates.least_squares import log_measured, weighted_least_squares, without_reading

MOST_ORTHOTROPIC = 100.0
"""E_x over E_y that no plate reaches: 10 to 20 in spruce, up to 70 in balsa."""

LIGHTEST_WOOD = 90.0
"""Density in kg m^-3 below which only foams and honeycombs lie."""

HEAVIEST_FIBRES = 2300.0
"""Density in kg m^-3 above which no wood and no fibre composite lies, but metals, ceramics and stone."""

LIKE_METAL = 2.0
"""E_x over E_y, either way, that these do not reach, rolled or not."""

_ODD_RATIO = 10.0
"""Ratio by which the error falls without a reading that is odd."""
_TOLERANCE = 1e-3
"""Accepted error of ln D where a reading is tried."""
_STIFFER_ACROSS = 1.5
_USUAL_SHARES = (0.001, 0.999)


def unusual_sentences(board: Board, prior: PriorCard, rigidities: Floats) -> tuple[str, ...]:
    """Sentences on an unusual density and on unusual constants that a board's readings imply; rigidities in N m."""
    values = board.nominal() | dict(zip(RIGIDITIES, rigidities, strict=True))
    elastic = moduli_of(values)
    by_name = values | elastic._asdict()
    sentences, out_of_reach = [], []
    for name, constant_prior in prior.constants.items():
        low, high = (float(constant_prior.quantile(np.array(share))) for share in _USUAL_SHARES)
        if not low <= by_name[name] <= high:
            unit, factor = ("GPa", 1e9) if name in MODULI else ("N m", 1.0)
            expected = f"{low / factor:.3g} to {high / factor:.3g}"
            shown_name = board.symmetry.moduli[0] if board.isotropic else name
            out_of_reach.append(
                f"{shown_name} comes out as {by_name[name] / factor:.3g} {unit}, expected were {expected}"
            )
    if out_of_reach:
        sentences.append(
            f"out of reach of the prior '{prior.name}': {'; '.join(out_of_reach)}; are sizes, labels and prior right?"
        )
    ratio = float(elastic.E_x / elastic.E_y)
    if ratio > MOST_ORTHOTROPIC:
        sentences.append(
            f"E_x comes out {ratio:.3g} times as large as E_y, more than in any wood: are length_x_mm and length_y_mm, "
            "or all labels, exchanged?"
        )
    elif ratio < 1.0 / _STIFFER_ACROSS:
        sentences.append(f"E_y comes out {1.0 / ratio:.3g} times as large as E_x: is x along the grain?")
    rho = float(board_density(values))
    if prior.density is not None:
        low, high = (float(prior.density.quantile(np.array(share))) for share in _USUAL_SHARES)
        if not low <= rho <= high:
            sentences.append(
                f"the density comes out as {rho:.3g} kg/m3, the prior '{prior.name}' is of boards of {low:.3g} to "
                f"{high:.3g}: are the mass and the three lengths right?"
            )
    elif rho < LIGHTEST_WOOD:
        sentences.append(
            f"the density comes out as {rho:.3g} kg/m3, lighter than balsa: are the mass and the three lengths right?"
        )
    elif rho > HEAVIEST_FIBRES and (either_way := max(ratio, 1.0 / ratio)) > LIKE_METAL:
        sentences.append(
            f"the density comes out as {rho:.0f} kg/m3, more than that of any wood or fibre composite, and no metal is "
            f"{either_way:.3g} times as stiff one way as the other: are the mass and the three lengths right?"
        )
    return tuple(sentences)


def odd_reading(board: Board) -> str:
    """Words on the one reading without which the others fit ten times as well; empty if there is none."""
    n = len(board.reading_names)
    if n < board.symmetry.n + 2:
        return ""
    errors = [_error_without(board, i) for i in range(n)]
    least, next_least, *_ = sorted(errors)
    if not _ODD_RATIO * least < next_least:
        return ""
    i = errors.index(least)
    hertz = float(np.exp(log_measured(board)[i]))
    return f"without {board.short_reading_names[i]} at {hertz:.5g} Hz the others fit to {100.0 * least:.2g} %; "


def _error_without(board: Board, left_out: int) -> float:
    """Rms error of the other readings, fitted without one, relative; infinite where that is no plate."""
    try:
        residuals = weighted_least_squares(without_reading(board, left_out), accepted=_TOLERANCE).residuals
    except (ValueError, KeyError):  # LinAlgError among them
        return np.inf
    return float(np.sqrt(np.mean(residuals**2)))
