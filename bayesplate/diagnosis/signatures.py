"""What each effect would do to the frequencies, how much of it the constants hide, and which effects look alike.

A fit of the constants absorbs most of any effect: only its visible part, what is left after the constants have been
fitted again, can ever be traced, and the rest has gone into the constants as a bias. All of it by exact solves at the
effect's nominal size; first-order columns of the bare plate are wrong by factors here.
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
    """One effect at its nominal size."""

    effect: str
    size: Mapping[str, float]  # value of each parameter, SI
    # (n_modes,) array, cents: shift of every frequency, constants unchanged; not a number where there is no frequency
    raw: Floats
    # (n_modes,) array, cents: what remains after the constants have been fitted again without the effect
    visible: Floats
    bias_percent: Mapping[str, float]  # what ignoring the effect does to E_x, E_y, G_xy
    # (n_modes,) array: relative uncertainty of each reading: its weight in the fit, in every rms and in the likeness of
    # two effects
    scales: Floats
    acts_both_ways: bool = False  # whether it may also be the opposite of what it is here: see `acts_both_ways`

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
        """Whether this experiment could not see the effect even if it were there."""
        return self.visible_rms < self.detection_limit_cents

    def _rms(self, shift: Floats) -> float:
        return float(np.sqrt(np.average(shift**2, weights=1.0 / self.scales**2)))


def signature(baseline: Baseline, effect: str, sizes: Sequence[Parameter], log_frequency: Floats) -> Signature:
    """The signature of an effect that takes a baseline's modes to other ln f (Hz), constants unchanged."""
    raw = log_frequency - baseline.log_frequency
    visible, step = baseline.refitted_to(raw)
    return Signature(
        effect=effect,
        size={one.name: one.nominal for one in sizes},
        raw=cents(raw),
        visible=cents(visible),
        bias_percent=_bias(baseline, step),
        scales=baseline.scales,
        acts_both_ways=acts_both_ways(sizes),
    )


def signatures(problem: PosedProblem, names: Sequence[str] | None = None) -> tuple[Signature, ...]:
    """Signatures of all effects that can act, or of those named, around the estimate of a problem, by full solves.

    Without an effect that at its nominal size leaves no plate with these modes, or none to fit them.
    """
    baseline = baseline_of(problem)
    found = (_solved(baseline, problem, name) for name in _acting(problem.board) if names is None or name in names)
    return tuple(one for one in found if np.isfinite([*one.raw, *one.bias_percent.values()]).all())


def _acting(board: Board) -> Iterable[str]:
    for name, effect in EFFECTS.items():
        if name not in board.effects and any(not effect.refusal(board, setup) for setup in board.setups):
            yield name


def _solved(baseline: Baseline, problem: PosedProblem, name: str) -> Signature:
    """The signature of one more effect at its nominal size."""
    board = declare(replace(baseline.board, effects=(*baseline.board.effects, name)))
    acting = (one for setup in board.setups for one in effects_of(board, setup) if one.name == name)
    sizes = {one.name: one for effect in acting for one in effect.parameters()}
    values = {key: np.asarray(quantity.mean) for key, quantity in board.inputs.items()} | dict(baseline.values)
    values |= {key: np.asarray(one.nominal) for key, one in sizes.items()}
    parts = []
    for setup, fitted in zip(board.setups, problem.posterior.models, strict=True):
        plate = setup_model(system_of(board, setup), values).log_frequencies(values, "linear")[0]
        parts.append(plate + fitted.discrepancies(values)[0, : plate.size])
    return signature(baseline, name, tuple(sizes.values()), np.concatenate(parts))


def look_alikes(found: Sequence[Signature]) -> dict[str, tuple[str, ...]]:
    """For each effect, the others of which the visible part is like its own, or opposite if one acts either way."""

    def are_alike(one: Signature, other: Signature) -> bool:
        likeness = cosine(one, other)
        return (abs(likeness) if one.acts_both_ways or other.acts_both_ways else likeness) > LOOK_ALIKE

    return {
        one.effect: tuple(other.effect for other in found if other is not one and are_alike(one, other))
        for one in found
    }


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


def _bias(baseline: Baseline, step: Floats) -> dict[str, float]:
    """What the moduli of a fit are off by, percent, whose ln D have moved by a step that hides an effect."""
    values, symmetry = baseline.values, baseline.board.symmetry
    thickness, nu_xy = values["thickness"], values["poisson_xy"]
    free = symmetry.free_of(values)
    ignoring, knowing = (
        moduli(np.asarray(D["D_x"]), np.asarray(D["D_y"]), np.asarray(D["D_s"]), thickness, nu_xy)
        for D in (symmetry.rigidities(free, nu_xy), symmetry.rigidities(free * np.exp(-step), nu_xy))
    )
    return {name: 100.0 * float(a / b - 1.0) for name, a, b in zip(MODULI, ignoring, knowing, strict=True)}
