"""What each effect would do to the frequencies, how much of it the constants hide, and which effects look alike.

A fit of the constants absorbs most of any effect: only its visible part, what is left after the constants have been
fitted again, can ever be traced, and the rest has gone into the constants as a bias. All of it by exact solves at the
effect's nominal size; first-order columns of the bare plate are wrong by factors here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, Moduli, moduli
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.shifts.baseline import weighted_rms
from bayesplate.effects import EFFECTS, declare, effects_of
from bayesplate.estimates.refit import refit
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.posing import PosedProblem

Floats = NDArray[np.float64]

LOOK_ALIKE = 0.95
"""Cosine of two visible parts above which two effects look alike: they differ by less than a third of their trace.

Below its negative too, if one of them may act either way: a mass that can only lower what a tension can only raise is
told from it at sight. A remark, no rule: whether the readings tell two apart is said by their probabilities.
"""
_ROUNDING = 1e-9
_WITHIN = 3.0
"""Standard deviations of its prior within which a size may lie."""

INVISIBLE = (
    "A uniform change of thickness, density or side lengths cannot be seen in the frequencies: it goes into the "
    "constants. Measure these; their uncertainty is carried along."
)


@dataclass(frozen=True, eq=False)
class Signature:
    """One effect at its nominal size.

    Attributes
    ----------
    effect : str
    size : dict of float
        Value of each parameter, SI.
    raw : (n_modes,) array, cents
        Shift of every frequency, constants unchanged.
    visible : (n_modes,) array, cents
        What remains after the constants have been fitted again without the effect.
    bias_percent : dict of float
        What ignoring the effect does to E_x, E_y, G_xy.
    detection_limit_cents : float
        Rms below which a visible part drowns in the noise: 2 noise / sqrt(n).
    scales : (n_modes,) array
        Relative uncertainty of each reading: its weight in the fit, in every rms and in the likeness of two effects.
    acts_both_ways : bool
        Whether it may also be the opposite of what it is here: see `acts_both_ways`.
    """

    effect: str
    size: Mapping[str, float]
    raw: Floats
    visible: Floats
    bias_percent: Mapping[str, float]
    detection_limit_cents: float
    scales: Floats
    acts_both_ways: bool = False

    @property
    def raw_rms(self) -> float:
        """Weighted rms shift over the modes, cents."""
        return weighted_rms(self.raw, self.scales)

    @property
    def visible_rms(self) -> float:
        """Weighted rms over the modes of the visible part, cents: never more than the raw one."""
        return weighted_rms(self.visible, self.scales)

    @property
    def is_below_detection_limit(self) -> bool:
        """Whether this experiment could not see the effect even if it were there."""
        return bool(self.visible_rms < self.detection_limit_cents)


def candidates(board: Board) -> tuple[str, ...]:
    """Effects that are not declared and can act in at least one setup of the board."""
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if name not in board.effects and any(not effect.refusal(board, setup) for setup in board.setups)
    )


def signatures(problem: PosedProblem, names: Sequence[str] | None = None) -> tuple[Signature, ...]:
    """Signatures of effects around the estimate of a problem.

    Parameters
    ----------
    problem : PosedProblem
    names : sequence of str, optional
        By default all candidates.

    Returns
    -------
    tuple of Signature
        Without an effect that at its nominal size leaves no plate with these modes, or none to fit them.
    """
    predict = constants_predictor(problem)
    start = problem.centre[: problem.parameters.n_constants]
    base = predict(start[None, :])[0]
    scales = problem.estimate.scales
    noise = float(1.0 / np.sqrt(np.mean(1.0 / cents(scales) ** 2)))
    result = []
    for name in candidates(problem.board) if names is None else names:
        shifted, sizes = frequencies_with(problem, name)
        if not np.isfinite(shifted).all():
            continue
        fitted = refit(predict, shifted, scales, start)
        bias = _bias(problem, start, fitted)
        if not np.isfinite([*bias.values()]).all():
            continue
        result.append(
            Signature(
                effect=name,
                size={one.name: one.nominal for one in sizes},
                raw=cents(shifted - base),
                visible=cents(shifted - predict(fitted[None, :])[0]),
                bias_percent=bias,
                detection_limit_cents=2.0 * noise / np.sqrt(base.size),
                scales=scales,
                acts_both_ways=acts_both_ways(sizes),
            )
        )
    return tuple(result)


def constants_predictor(problem: PosedProblem) -> Predictor:
    """ln f of all modes as a function of the logarithms of the free rigidities alone, inputs as at the estimate."""
    predict = predictor(problem.board, problem.posterior.models, "exact", problem.centre)
    return predict.with_fixed(problem.centre[problem.parameters.fitted_columns][predict.n_constants :])


def frequencies_with(problem: PosedProblem, name: str) -> tuple[Floats, tuple[Parameter, ...]]:
    """ln f of all modes with one more effect at its nominal size, by full solves; and what has that size."""
    board = declare(replace(problem.board, effects=(*problem.board.effects, name)))
    values = problem.parameters.values_at(problem.centre)
    acting = (one for setup in board.setups for one in effects_of(board, setup) if one.name == name)
    sizes = {one.name: one for effect in acting for one in effect.parameters()}
    for key, quantity in board.inputs.items():
        values.setdefault(key, np.asarray(quantity.mean))
    values |= {key: np.asarray(one.nominal) for key, one in sizes.items()}
    parts = []
    for setup, fitted in zip(board.setups, problem.posterior.models, strict=True):
        plate = setup_model(system_of(board, setup), values).log_frequencies(values, "linear")[0]
        parts.append(plate + fitted.discrepancies(values)[0, : plate.size])
    return np.concatenate(parts), tuple(sizes.values())


def look_alikes(found: Sequence[Signature]) -> dict[str, tuple[str, ...]]:
    """For each effect, the others that look like it."""
    return {
        one.effect: tuple(
            other.effect
            for other in found
            if other is not one and are_alike(cosine(one, other), one.acts_both_ways or other.acts_both_ways)
        )
        for one in found
    }


def are_alike(likeness: float, either_way: bool) -> bool:
    """Whether two effects look alike, from the cosine of their visible parts.

    Parameters
    ----------
    likeness : float
    either_way : bool
        Whether one of them may act the other way round.
    """
    return (abs(likeness) if either_way else likeness) > LOOK_ALIKE


def acts_both_ways(sizes: Iterable[Parameter]) -> bool:
    """Whether a size of an effect may lie on either side of that of no effect."""
    return any(_is_within(one.prior, one.null) for one in sizes if one.null is not None)


def _is_within(prior: Quantity, value: float) -> bool:
    """Whether an uncertain quantity may as well lie on either side of a value."""
    inside = not prior.is_exact and prior.lower < value < prior.upper
    return inside and abs(float(prior.standard(value))) < _WITHIN


def cosine(one: Signature, other: Signature) -> float:
    """Cosine of the visible parts of two effects; 0 if one has none but rounding."""
    if any(each.visible_rms <= _ROUNDING * each.raw_rms for each in (one, other)):
        return 0.0
    first, second = one.visible / one.scales, other.visible / other.scales
    return float(first @ second / (np.linalg.norm(first) * np.linalg.norm(second)))


def _bias(problem: PosedProblem, true: Floats, fitted: Floats) -> dict[str, float]:
    values = problem.parameters.values(problem.centre[None, :])
    thickness, nu_xy = values["thickness"], values["poisson_xy"]

    def constants(x: Floats) -> Moduli:
        found = problem.board.symmetry.rigidities(np.exp(x), nu_xy)
        return moduli(found["D_x"], found["D_y"], found["D_s"], thickness, nu_xy)

    before, after = constants(true), constants(fitted)
    return {name: 100.0 * float(np.ravel(b / a)[0] - 1.0) for name, a, b in zip(MODULI, before, after, strict=True)}
