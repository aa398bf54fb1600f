"""What an ideal plate lacks: one protocol (`base.py`), one file an effect, and the list of them here."""

from __future__ import annotations

from dataclasses import replace

from bayesplate.effects.air_loading import AirLoading
from bayesplate.effects.attached_mass import AttachedMass
from bayesplate.effects.base import Effect, EffectParameter
from bayesplate.effects.clamp_rotation import ClampRotation
from bayesplate.effects.clamp_translation import ClampTranslation
from bayesplate.effects.density_gradient import DensityGradient
from bayesplate.effects.grain_angle import GrainAngle
from bayesplate.effects.membrane_tension import MembraneTension
from bayesplate.effects.outline_profile import OutlineProfile
from bayesplate.effects.poisson_ratio import PoissonRatio
from bayesplate.effects.support_mass import SupportMass
from bayesplate.effects.support_stiffness import SupportStiffness
from bayesplate.effects.thickness_profile import ThicknessProfile
from bayesplate.effects.transverse_shear import TransverseShear
from bayesplate.errors import Fault
from bayesplate.plate.board import Board
from bayesplate.plate.setup import Setup

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        TransverseShear,
        AttachedMass,
        ClampRotation,
        ClampTranslation,
        MembraneTension,
        SupportMass,
        SupportStiffness,
        AirLoading,
        ThicknessProfile,
        OutlineProfile,
        DensityGradient,
        GrainAngle,
        PoissonRatio,
    )
}
"""Every effect of the library by name."""

__all__ = [
    "EFFECTS",
    "Effect",
    "EffectParameter",
    "declare",
    "effect_faults",
    "effects_of",
    "implied_effects",
    "is_effect_parameter",
]


def is_effect_parameter(name: str) -> bool:
    """Whether a board's input of that name is a parameter of an effect."""
    return name.split(".")[0] in EFFECTS


def effects_of(board: Board, setup: Setup) -> tuple[Effect, ...]:
    """The declared effects as they act in a setup, in the order of their declaration."""
    chosen = {(effect.name, effect.setup_name): effect for effect in board.chosen}
    return tuple(
        chosen.get((name, setup.name)) or EFFECTS[name].of(board, setup)
        for name in board.effects
        if not EFFECTS[name].refusal(board, setup)
    )


def implied_effects(board: Board) -> tuple[str, ...]:
    """Effects that the card declares by what it states, where they can act or a setup wants them to."""
    return tuple(
        name
        for name, effect in EFFECTS.items()
        if effect.is_implied(board)
        and any(effect.is_wanted(setup) or not effect.refusal(board, setup) for setup in board.setups)
    )


def declare(board: Board) -> Board:
    """A board whose inputs hold the parameters of its declared effects, so that they are known or marginalised."""
    inputs = dict(board.inputs)
    for setup in board.setups:
        for effect in effects_of(board, setup):
            inputs |= {effect.key(parameter.name): parameter.prior for parameter in effect.parameters()}
    return replace(board, inputs=inputs)


def effect_faults(board: Board) -> list[Fault]:
    """Declared effects that act in no setup of the board, or not in the one that states them, with the reasons."""
    faults = []
    file = f"{board.name}.toml"
    for name in board.effects:
        effect = EFFECTS.get(name)
        if effect is None:
            faults.append(Fault(f"{file} effects", f"one of {', '.join(EFFECTS)}", name))
            continue
        reasons = [effect.refusal(board, setup) for setup in board.setups]
        places = [
            f"{file} [setup]" if len(board.setups) == 1 else f'{file} [[setup]] {number} "{setup.name}"'
            for number, setup in enumerate(board.setups, start=1)
        ]
        wanting = [
            Fault(place, f"a setup in which {name} can act", reason)
            for place, reason, setup in zip(places, reasons, board.setups, strict=True)
            if reason and effect.is_wanted(setup)
        ]
        if wanting:
            faults += wanting
        elif all(reasons):
            wanted = f"a board on which {name} can act"
            faults.append(Fault(f"{file} effects", wanted, reasons[0], f"leave {name} out of the effects"))
    return faults
