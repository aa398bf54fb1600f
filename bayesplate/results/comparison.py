"""compare.json as types: every method's constants side by side, and what the exact law predicts at each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayesplate.board.material import MODULI
from bayesplate.estimates.leave_one_out import CarryingMode, Errors
from bayesplate.estimates.paper import PaperSystem
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.methods import Method
from bayesplate.posterior.posing import PosedProblem
from bayesplate.results.contract import Elastic, finite, rms
from bayesplate.results.modes import foretold

FORMAT = 1
SAME_CENTS = 0.5
"""Two theories whose errors left out differ by less are not told apart."""


@dataclass(frozen=True)
class Estimated:
    """A modulus by one method; None where the method gives no such number."""

    mean: float | None
    sd: float | None
    q05: float | None
    q95: float | None
    unit: str


@dataclass(frozen=True)
class Forward:
    """What the exact law predicts for one mode at a method's constants, and by how much that exceeds the reading."""

    setup: str
    label: str
    predicted_hz: float | None
    cents: float | None


@dataclass(frozen=True)
class MethodRow:
    """One method: its constants, and how far it misses the readings; None where a number does not exist."""

    name: str
    elastic: Elastic[Estimated]
    condition_number: float | None
    n_subsets: int | None
    forward: tuple[Forward, ...]
    forward_rms_cents: float | None


@dataclass(frozen=True)
class ComparedMode:
    """A reading over the most likely constants under the exact law: fitted with it, and without it."""

    setup: str
    label: str
    measured_hz: float
    residual_cents: float
    left_out_cents: float | None


@dataclass(frozen=True)
class LeastSquaresErrors:
    """Rms over the modes of a theory, cents; None where too few are left."""

    in_sample_rms_cents: float | None
    leave_one_out_rms_cents: float | None


@dataclass(frozen=True)
class Origin:
    """Where the coefficients of one setup come from."""

    setup: str
    source: str
    theory: str
    aspect_ratio: float
    sentence: str
    r_squared: Mapping[str, float]


@dataclass(frozen=True)
class TheoryRow:
    """What one theory of the plate makes of a board: all methods, and the errors of weighted least squares."""

    theory: str
    effects: tuple[str, ...]
    inputs: Mapping[str, float]
    coefficients: tuple[Origin, ...]
    methods: tuple[MethodRow, ...]
    modes: tuple[ComparedMode, ...]
    error: LeastSquaresErrors


@dataclass(frozen=True)
class BetterTheory:
    """Which theory predicts the left-out modes better, and that in one sentence; None where neither does."""

    better: str | None
    sentence: str


@dataclass(frozen=True, repr=False)
class Comparison:
    """All methods on a board, as a thin and as a shear-flexible plate.

    Attributes
    ----------
    format : int
    name : str
    seed : int
    versions : dict of str
    card_sha256, prior : str
    theories : tuple of TheoryRow
        Thin, then shear-flexible.
    verdict : BetterTheory
    carrying_modes : tuple of CarryingMode
        Modes that alone carry a constant or a size in one of the theories: they count in the left-out error of none.
    """

    format: int
    name: str
    seed: int
    versions: Mapping[str, str]
    card_sha256: str
    prior: str
    theories: tuple[TheoryRow, ...]
    verdict: BetterTheory
    carrying_modes: tuple[CarryingMode, ...] = field(default=(), kw_only=True)

    def __repr__(self) -> str:
        return f"<Comparison of {self.name}: {self.verdict.sentence}>"


def theory_row(problem: PosedProblem, system: PaperSystem, methods: Sequence[Method], errors: Errors) -> TheoryRow:
    """What one theory of the plate makes of a board; errors are of the most likely constants under the exact law."""
    board = problem.board
    rows = [(setup.name, str(r.label), r.frequency.mean) for setup in board.setups for r in setup.readings]
    in_sample, left_out = cents(errors.in_sample), cents(errors.left_out)
    return TheoryRow(
        theory=problem.posterior.models[0].system.theory,
        effects=tuple(board.effects),
        inputs={one.name: float(one.prior.mean) for one in board.parameters if one.is_of_effect},
        coefficients=tuple(
            Origin(
                setup.name,
                one.source,
                one.theory,
                one.aspect_ratio,
                one.sentence,
                {str(label): r for label, r in one.r_squared.items()},
            )
            for setup, one in zip(board.setups, system.origins, strict=True)
        ),
        methods=tuple(_method_row(method, rows) for method in methods),
        modes=tuple(
            ComparedMode(*row, float(fitted), finite(float(without)))
            for row, fitted, without in zip(rows, in_sample, left_out, strict=True)
        ),
        error=LeastSquaresErrors(rms(in_sample), rms(left_out)),
    )


def judged_alike(rows: Sequence[TheoryRow], carrying: Sequence[CarryingMode]) -> tuple[TheoryRow, ...]:
    """The theories with left-out errors in which no mode counts that alone carries something in one of them."""

    def judged(row: TheoryRow) -> TheoryRow:
        left_out = rms([one.left_out_cents for one in foretold(row.modes, carrying)])
        return replace(row, error=replace(row.error, leave_one_out_rms_cents=left_out))

    return tuple(map(judged, rows))


def better_theory(thin: TheoryRow, sheared: TheoryRow) -> BetterTheory:
    """Which theory predicts the left-out modes better."""
    before, after = thin.error.leave_one_out_rms_cents, sheared.error.leave_one_out_rms_cents
    if before is None or after is None:
        return BetterTheory(None, "No mode can be left out and foretold: the two theories cannot be told apart.")
    if abs(after - before) < SAME_CENTS:
        better, word = None, "changes nothing"
    else:
        better, word = ("shear-flexible", "lowers the error") if after < before else ("thin", "raises the error")
    sentence = f"Transverse shear {word}: {before:.1f} -> {after:.1f} cents for modes left out of the fit"
    in_sample = (thin.error.in_sample_rms_cents, sheared.error.in_sample_rms_cents)
    return BetterTheory(better, f"{sentence}, {in_sample[0]:.1f} -> {in_sample[1]:.1f} for those in it.")


def _method_row(method: Method, rows: Sequence[tuple[str, str, float]]) -> MethodRow:
    missed = cents(method.misses)
    elastic = {}
    for name in MODULI:
        sd = method.sd[name] if method.sd else np.nan
        low, high = method.interval[name] if method.interval else (np.nan, np.nan)
        elastic[name] = Estimated(finite(method.mean[name]), finite(sd), finite(low), finite(high), "Pa")
    return MethodRow(
        name=method.name,
        elastic=Elastic(**elastic),
        condition_number=method.condition_number,
        n_subsets=method.n_subsets,
        forward=tuple(
            Forward(setup, label, finite(hertz * float(np.exp(log_ratio))), finite(float(miss)))
            for (setup, label, hertz), log_ratio, miss in zip(rows, method.misses, missed, strict=True)
        ),
        forward_rms_cents=rms(missed) if np.isfinite(missed).all() else None,
    )
