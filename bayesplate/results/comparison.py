"""compare.json as types: every method's constants side by side, and the exact law's predictions at each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from bayesplate.estimates.leave_one_out import CarryingMode, PredictionErrors
from bayesplate.estimates.paper import PaperSystem
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.posing import PosedProblem
from bayesplate.results.contract import Elastic, finite_or_none, rms
from bayesplate.results.modes import drop_carrying_modes

FORMAT = 1
SAME_CENTS = 0.5
"""Cents; two theories whose leave-one-out errors differ by less are equally good."""


@dataclass(frozen=True)
class ModulusEstimate:
    """A modulus by one method; None where the method gives no such number."""

    mean: float | None
    sd: float | None
    q05: float | None
    q95: float | None
    unit: str


@dataclass(frozen=True)
class ForwardPrediction:
    """The exact law's prediction of one mode at a method's constants, and the reading over it."""

    setup: str
    label: str
    predicted_hz: float | None
    cents: float | None


@dataclass(frozen=True)
class MethodRow:
    """One method: its constants and its errors; None where a number does not exist."""

    name: str
    elastic: Elastic[ModulusEstimate]
    condition_number: float | None
    n_subsets: int | None
    forward: tuple[ForwardPrediction, ...]
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
class CoefficientOrigin:
    """The source of the coefficients of one setup."""

    setup: str
    source: str
    theory: str
    aspect_ratio: float
    sentence: str
    r_squared: Mapping[str, float]


@dataclass(frozen=True)
class TheoryRow:
    """A board under one plate theory: all methods, and the errors of weighted least squares."""

    theory: str
    effects: tuple[str, ...]
    inputs: Mapping[str, float]
    coefficients: tuple[CoefficientOrigin, ...]
    methods: tuple[MethodRow, ...]
    modes: tuple[ComparedMode, ...]
    error: LeastSquaresErrors


@dataclass(frozen=True)
class BetterTheory:
    """The theory that predicts left-out modes better, and a sentence on it; None where neither is better."""

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
        Modes that alone carry a constant or a size in one of the theories; no leave-one-out error counts them.
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


def theory_row(
    problem: PosedProblem, system: PaperSystem, methods: Sequence[MethodRow], errors: PredictionErrors
) -> TheoryRow:
    """A board under one plate theory; the errors are those of the most likely constants under the exact law."""
    board = problem.board
    rows = [(setup.name, str(r.label), r.frequency.mean) for setup in board.setups for r in setup.readings]
    in_sample, left_out = cents(errors.in_sample), cents(errors.left_out)
    return TheoryRow(
        theory=problem.posterior.models[0].system.theory,
        effects=tuple(board.effects),
        inputs={
            parameter.name: float(parameter.prior.mean) for parameter in board.parameters if parameter.is_of_effect
        },
        coefficients=tuple(
            CoefficientOrigin(
                setup.name,
                origin.source,
                origin.theory,
                origin.aspect_ratio,
                origin.sentence,
                {str(label): r for label, r in origin.r_squared.items()},
            )
            for setup, origin in zip(board.setups, system.origins, strict=True)
        ),
        methods=tuple(methods),
        modes=tuple(
            ComparedMode(*row, float(fitted), finite_or_none(float(without)))
            for row, fitted, without in zip(rows, in_sample, left_out, strict=True)
        ),
        error=LeastSquaresErrors(rms(in_sample), rms(left_out)),
    )


def recompute_left_out_errors(rows: Sequence[TheoryRow], carrying: Sequence[CarryingMode]) -> tuple[TheoryRow, ...]:
    """The theories with leave-one-out errors over the same modes: those that carry nothing alone under any theory."""

    def with_left_out_error(row: TheoryRow) -> TheoryRow:
        left_out = rms([mode.left_out_cents for mode in drop_carrying_modes(row.modes, carrying)])
        return replace(row, error=replace(row.error, leave_one_out_rms_cents=left_out))

    return tuple(map(with_left_out_error, rows))


def better_theory(thin: TheoryRow, sheared: TheoryRow) -> BetterTheory:
    """Compare the two theories by their errors of left-out modes."""
    thin_error, sheared_error = thin.error.leave_one_out_rms_cents, sheared.error.leave_one_out_rms_cents
    if thin_error is None or sheared_error is None:
        return BetterTheory(None, "No mode can be left out and foretold: the two theories cannot be told apart.")
    if abs(sheared_error - thin_error) < SAME_CENTS:
        better, word = None, "changes nothing"
    else:
        better, word = (
            ("shear-flexible", "lowers the error") if sheared_error < thin_error else ("thin", "raises the error")
        )
    sentence = f"Transverse shear {word}: {thin_error:.1f} -> {sheared_error:.1f} cents for modes left out of the fit"
    in_sample = (thin.error.in_sample_rms_cents, sheared.error.in_sample_rms_cents)
    return BetterTheory(better, f"{sentence}, {in_sample[0]:.1f} -> {in_sample[1]:.1f} for those in it.")
