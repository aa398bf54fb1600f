"""The shift of the frequencies by each effect, the part that the constants hide, and which effects look alike.

A fit of the constants absorbs most of any effect: only its visible part, the shift that remains after a refit of the
constants, can be traced; the rest biases the constants. Shifts come from exact solves at the effect's nominal size,
because first-order columns of the bare plate are wrong by factors here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, moduli
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.baseline import Baseline, baseline_of
from bayesplate.effects import EFFECTS, declare, effects_of
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.posing import PosedProblem

LOOK_ALIKE_COSINE = 0.95
"""Cosine of two visible parts above which two effects look alike: they differ by less than a third of their trace.

Below its negative too, if one of them may act either way: a mass, which can only lower frequencies, and a tension,
which can only raise them, do not look alike. This is a remark, no rule: the probabilities say whether the readings tell
two effects apart.
"""
_ROUNDING = 1e-9
_MOST_SD = 3.0
"""Standard deviations of its prior within which a size may be."""

INVISIBLE_CHANGES = (
    "A uniform change of thickness, density or side lengths cannot be seen in the frequencies: it goes into the "
    "constants. Measure these; their uncertainty is carried along."
)


@dataclass(frozen=True, eq=False)
class Signature:
    """One effect at its nominal size."""

    effect: str
    size: Mapping[str, float]  # value of each parameter, SI
    # (n_modes,) array, cents: shift of every frequency, constants unchanged; not a number where there is no frequency
    raw: Floats
    # (n_modes,) array, cents: what remains after the constants have been fitted again without the effect
    visible: Floats
    bias_percent: Mapping[str, float]  # bias of E_x, E_y, G_xy in a fit without the effect
    # (n_modes,) array: relative uncertainty of each reading: its weight in the fit, in every rms and in the likeness of
    # two effects
    scales: Floats
    acts_both_ways: bool = False  # whether its shifts may also have the opposite sign: see the function of this name

    @property
    def raw_rms(self) -> float:
        """Weighted rms shift over the modes, cents."""
        return self._rms(self.raw)

    @property
    def visible_rms(self) -> float:
        """Weighted rms over the modes of the visible part, cents: never more than the raw one."""
        return self._rms(self.visible)

    @property
    def detection_limit_cents(self) -> float:
        """Rms below which a visible part drowns in the noise: 2 noise / sqrt(n)."""
        return 2.0 / float(np.sqrt(np.sum(1.0 / cents(self.scales) ** 2)))

    @property
    def is_below_detection_limit(self) -> bool:
        """Whether these readings could not show the effect even if it were present."""
        return self.visible_rms < self.detection_limit_cents

    def _rms(self, shift: Floats) -> float:
        return float(np.sqrt(np.average(shift**2, weights=1.0 / self.scales**2)))


def signature(baseline: Baseline, effect: str, sizes: Sequence[Parameter], log_frequency: Floats) -> Signature:
    """The signature of an effect that takes a baseline's modes to other ln f (Hz), constants unchanged."""
    raw = log_frequency - baseline.log_frequency
    visible, step = baseline.refitted_to(raw)
    return Signature(
        effect=effect,
        size={parameter.name: parameter.nominal for parameter in sizes},
        raw=cents(raw),
        visible=cents(visible),
        bias_percent=_bias(baseline, step),
        scales=baseline.scales,
        acts_both_ways=acts_both_ways(sizes),
    )


def signatures(problem: PosedProblem, names: Sequence[str] | None = None) -> tuple[Signature, ...]:
    """Signatures of all effects that can act, or of those in `names`, around the estimate of a problem, by full solves.

    Without effects of which the plate at nominal size lacks one of these modes, or cannot be fitted to them.
    """
    baseline = baseline_of(problem)
    solved_signatures = (
        _solve_signature(baseline, problem, name)
        for name in _acting_effects(problem.board)
        if names is None or name in names
    )
    return tuple(
        signature
        for signature in solved_signatures
        if np.isfinite([*signature.raw, *signature.bias_percent.values()]).all()
    )


def _acting_effects(board: Board) -> Iterable[str]:
    for name, effect in EFFECTS.items():
        if name not in board.effects and any(not effect.refusal(board, setup) for setup in board.setups):
            yield name


def _solve_signature(baseline: Baseline, problem: PosedProblem, name: str) -> Signature:
    """The signature of one more effect at its nominal size."""
    board = declare(replace(baseline.board, effects=(*baseline.board.effects, name)))
    acting_effects = (effect for setup in board.setups for effect in effects_of(board, setup) if effect.name == name)
    sizes = {parameter.name: parameter for effect in acting_effects for parameter in effect.parameters()}
    values = {key: np.asarray(quantity.mean) for key, quantity in board.inputs.items()} | dict(baseline.values)
    values |= {key: np.asarray(parameter.nominal) for key, parameter in sizes.items()}
    log_frequencies = []
    for setup, fitted in zip(board.setups, problem.posterior.models, strict=True):
        plate_log_frequency = setup_model(system_of(board, setup), values).log_frequencies(values, "linear")[0]
        log_frequencies.append(plate_log_frequency + fitted.discrepancies(values)[0, : plate_log_frequency.size])
    return signature(baseline, name, tuple(sizes.values()), np.concatenate(log_frequencies))


def look_alikes(signatures: Sequence[Signature]) -> dict[str, tuple[str, ...]]:
    """For each effect, the others with a like visible part, or an opposite one if one of the two acts either way."""

    def are_alike(first: Signature, second: Signature) -> bool:
        likeness = cosine(first, second)
        return (abs(likeness) if first.acts_both_ways or second.acts_both_ways else likeness) > LOOK_ALIKE_COSINE

    return {
        first.effect: tuple(second.effect for second in signatures if second is not first and are_alike(first, second))
        for first in signatures
    }


def acts_both_ways(sizes: Iterable[Parameter]) -> bool:
    """Whether a size of an effect may be on either side of its null value."""
    return any(
        _is_within(parameter.prior, parameter.neutral_value)
        for parameter in sizes
        if parameter.neutral_value is not None
    )


def _is_within(prior: Quantity, value: float) -> bool:
    """Whether an uncertain quantity may be on either side of a value."""
    inside = not prior.is_exact and prior.lower < value < prior.upper
    return inside and abs(float(prior.standard(value))) < _MOST_SD


def cosine(first: Signature, second: Signature) -> float:
    """Cosine of the visible parts of two effects; 0 if one has none but rounding."""
    if any(signature.visible_rms <= _ROUNDING * signature.raw_rms for signature in (first, second)):
        return 0.0
    first_shape, second_shape = first.visible / first.scales, second.visible / second.scales
    return float(first_shape @ second_shape / (np.linalg.norm(first_shape) * np.linalg.norm(second_shape)))


def _bias(baseline: Baseline, step: Floats) -> dict[str, float]:
    """Bias of the moduli of a fit, percent, whose ln D have moved by a step that hides an effect."""
    values, symmetry = baseline.values, baseline.board.symmetry
    thickness, nu_xy = values["thickness"], values["poisson_xy"]
    free = symmetry.free_of(values)
    ignoring, knowing = (
        moduli(np.asarray(D["D_x"]), np.asarray(D["D_y"]), np.asarray(D["D_s"]), thickness, nu_xy)
        for D in (symmetry.rigidities(free, nu_xy), symmetry.rigidities(free * np.exp(-step), nu_xy))
    )
    return {name: 100.0 * float(a / b - 1.0) for name, a, b in zip(MODULI, ignoring, knowing, strict=True)}
