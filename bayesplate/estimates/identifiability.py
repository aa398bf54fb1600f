"""What the readings determine before any sampling: standard errors, condition number, leverages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.material import ORTHOTROPIC, Symmetry
from bayesplate.effects.words import join_words
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.leave_one_out import HIGH_LEVERAGE

IDENTIFIABLE_FACTOR = 2.0
"""A constant is identifiable if its 95 % interval at the expected noise stays within this factor of the estimate."""

OTHERS_FACTOR = 10.0
"""Factor within which the other constants are taken to be known, when each constant is judged by itself."""
LOW_SHARE_PERCENT = 60.0
_HELD_EDGES = {"clamped", "supported"}
"""Edges that do not move: where all are, the integral of w_xx w_yy is that of w_xy^2."""
_HELPFUL_MODES = {
    "D_x": "a mode that bends along the grain",
    "D_y": "a mode that bends across the grain",
    "D_s": "a mode that twists",
    "D": "any mode",
}


@dataclass(frozen=True, eq=False)
class Identifiability:
    """How well n readings determine the constants of a board, to first order at the estimate."""

    condition_number: float  # of the weighted sensitivities d ln f / d ln D: free of the units of the constants
    covariance: Floats  # (n_constants, n_constants): of ln of the free rigidities, at the expected noise
    leverages: Floats  # (n_modes,): share of each reading in its own prediction; their sum is n_constants
    shares: Floats  # (n_modes, 3): of D_x, D_y, D_s in each mode's energy; rows sum to 1
    symmetry: Symmetry = ORTHOTROPIC
    # (n_constants,) standard errors of ln D where the others are known within `OTHERS_FACTOR`: so that a constant that
    # hardly enters the modes does not make another look undetermined
    errors_beside_known: Floats | None = None

    @property
    def standard_errors(self) -> Floats:
        """Standard errors of ln of the free rigidities: (n_constants,) array."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def of_rigidities(self) -> Floats:
        """Covariance of ln D_x, ln D_y, ln D_s: (3, 3) array, of rank one where they follow one of them."""
        follows = list(self.symmetry.follows)
        return np.asarray(self.covariance[np.ix_(follows, follows)])

    @property
    def errors_of_rigidities(self) -> Floats:
        """Standard errors of ln D_x, ln D_y, ln D_s: (3,) array."""
        return np.sqrt(np.diagonal(self.of_rigidities))

    def undetermined_constants(self) -> tuple[str, ...]:
        """Constants that the readings do not determine within the factor `IDENTIFIABLE_FACTOR`."""
        limit = np.log(IDENTIFIABLE_FACTOR) / 1.96
        return tuple(n for n, error in zip(self.symmetry.free, self.standard_errors, strict=True) if not error <= limit)


def identifiability(sensitivities: Floats, scales: Floats, symmetry: Symmetry = ORTHOTROPIC) -> Identifiability:
    """First-order identifiability from (n_modes, 3) d ln f / d ln D and the relative uncertainties of the readings.

    Variances are infinite where the readings leave a direction open.
    """
    n = symmetry.n
    weighted = symmetry.along(sensitivities) / scales[:, None]
    left, singular, right = np.linalg.svd(weighted, full_matrices=False)
    is_seen = singular > 1e-10 * singular[0]
    tells_all = is_seen.sum() == n
    covariance = (right.T * (1.0 / singular) ** 2) @ right if tells_all else np.diag(np.full(n, np.inf))
    condition = float(singular[0] / singular[-1]) if tells_all else float("inf")
    leverages = np.sum(left[:, is_seen] ** 2, axis=1)
    beside_known = _errors_beside_known(weighted.T @ weighted)
    return Identifiability(condition, covariance, leverages, 2.0 * sensitivities, symmetry, beside_known)


def _errors_beside_known(information: Floats) -> Floats:
    """Standard error of ln of each constant where the others have a 95 % interval of `OTHERS_FACTOR`."""
    precision = (1.96 / np.log(OTHERS_FACTOR)) ** 2
    errors = []
    for i in range(len(information)):
        rest = np.delete(np.arange(len(information)), i)
        block = information[np.ix_(rest, rest)] + precision * np.eye(len(rest))
        across = information[i, rest]
        remaining = information[i, i] - across @ np.linalg.solve(block, across) if len(rest) else information[i, i]
        errors.append(1.0 / np.sqrt(remaining) if remaining > 0.0 else np.inf)
    return np.array(errors)


def require_labels(board: Board) -> None:
    """Refuse (NotIdentifiableError) too few labelled modes for the constants, or a setup without any."""
    for setup in board.setups:
        if not setup.readings:
            n = len(setup.peaks)
            verb = "is" if n == 1 else "are"
            peaks = f"and its {n} peak{'s' * (n != 1)} {verb} none with certainty" if n else "it has no peaks either"
            raise NotIdentifiableError(
                f"{board.name}: setup {setup.name!r} has no labelled mode, {peaks}; give at least one label"
            )
    n_modes = sum(len(setup.readings) for setup in board.setups)
    if n_modes < board.symmetry.n:  # an isotropic board has one constant, and every setup one label
        raise NotIdentifiableError(
            f"{board.name}: {n_modes} labelled mode{'s' * (n_modes != 1)} for three constants D_x, D_y, D_s: at least "
            f"{3 - n_modes} more needed, bending along the grain, across it, and twisting between them"
        )


def require_identifiable(board: Board, identifiability: Identifiability) -> None:
    """Refuse (NotIdentifiableError) readings that leave a constant open, naming it and what would help."""
    if not identifiability.undetermined_constants():
        return
    joint_reaches = _interval_factors(identifiability.standard_errors)
    reaches = (
        joint_reaches
        if identifiability.errors_beside_known is None
        else _interval_factors(identifiability.errors_beside_known)
    )
    well_known = {
        n for n, factor in zip(identifiability.symmetry.free, reaches, strict=True) if factor <= IDENTIFIABLE_FACTOR
    }
    if len(well_known) == identifiability.symmetry.n:  # each is known beside the others, but not all of them together
        well_known, reaches = set(), joint_reaches
    clauses = []
    for name, modulus, factor in zip(
        identifiability.symmetry.free, identifiability.symmetry.moduli, reaches, strict=True
    ):
        if name not in well_known:
            reach = f"only within a factor {factor:.3g}" if np.isfinite(factor) and factor < 1e6 else "not at all"
            clauses.append(f"{name} (so {modulus}) {reach}; add {_HELPFUL_MODES[name]}")
    known_clauses = [
        f"{modulus} they tell"
        for n, modulus in zip(identifiability.symmetry.free, identifiability.symmetry.moduli, strict=True)
        if n in well_known
    ]
    raise NotIdentifiableError(
        f"{board.name}: the modes {_mode_names(board)} determine "
        + "; ".join([*clauses, *known_clauses])
        + f" (condition number "
        f"{identifiability.condition_number:.3g})"
    )


def _interval_factors(errors: Floats) -> Floats:
    """Factors that a 95 % interval spans on either side, from standard errors of logarithms."""
    with np.errstate(over="ignore"):
        return np.asarray(np.exp(1.96 * errors))


def _mode_names(board: Board) -> str:
    """Labels of the readings, setup by setup where there are several: two sessions may have the same ones."""
    by_setup = {setup.name: ", ".join(str(label) for label in setup.labels) for setup in board.setups}
    if len(by_setup) == 1:
        return "".join(by_setup.values())
    return join_words([f"{labels} of {name}" for name, labels in by_setup.items()])


def identifiability_remarks(
    board: Board, identifiability: Identifiability, carrying: str | None = None
) -> tuple[str, ...]:
    """Sentences on constants that are weakly known, for the table and the summary.

    `carrying` is the sentence of a fit on modes that alone carry a parameter; None before a fit: then the leverages of
    `identifiability` give it.
    """
    sentences = [_weakest_constant_sentence(identifiability)]
    names = [
        (f"{label}" if len(board.setups) == 1 else f"{label} of {setup.name}")
        for setup in board.setups
        for label in setup.labels
    ]
    if len(names) == identifiability.symmetry.n:
        clause = (
            "one mode fixes the one constant"
            if identifiability.symmetry.is_isotropic
            else "three modes fix three constants"
        )
        sentences.append(
            f"{clause} exactly: nothing is left to check the model with, and the noise comes from its prior alone"
        )
    elif carrying is not None:
        sentences += [carrying] if carrying else []
    else:
        for name, leverage in zip(names, identifiability.leverages, strict=True):
            if leverage > HIGH_LEVERAGE:
                sentences.append(
                    f"mode {name} alone carries a constant (leverage {leverage:.2f}): an error in it cannot be seen"
                )
    if all(set(setup.edges.values()) <= _HELD_EDGES for setup in board.setups):
        for setup in board.setups:
            held = "clamped" if set(setup.edges.values()) == {"clamped"} else "held"
            sentences.append(f"setup {setup.name} is {held} all round: {_held_edges_clause(identifiability.symmetry)}")
    return tuple(sentences)


def _held_edges_clause(symmetry: Symmetry) -> str:
    """Which combination a plate with edges that do not move determines: int w_xx w_yy equals int w_xy^2 there."""
    if symmetry.is_isotropic:
        return "only D is seen, whatever nu is, so E = 12 (1 - nu^2) D / h^3 depends on nu"
    return "only D_s + 2 nu_xy D_y is seen, so G_xy depends on nu_xy"


def _weakest_constant_sentence(result: Identifiability) -> str:
    errors: Mapping[str, float] = dict(zip(result.symmetry.moduli, result.standard_errors, strict=True))
    weakest = max(errors, key=lambda name: errors[name])
    if result.symmetry.is_isotropic:
        return f"all modes tell one modulus: the expected noise alone leaves it {_per_cent(errors[weakest])} uncertain"
    share = 100 * result.shares[:, result.symmetry.moduli.index(weakest)].max()
    sentence = (
        f"the modes tell {weakest} least well: the expected noise alone leaves it {_per_cent(errors[weakest])} "
        "uncertain"
    )
    if share < LOW_SHARE_PERCENT:
        sentence += f", because no mode has more than {share:.0f} % of its energy in it"
    return sentence


def _per_cent(error: float) -> str:
    error *= 100
    return f"{error:.{max(1 - int(np.floor(np.log10(np.clip(error, 1e-3, 10.0)))), 0)}f} %"
