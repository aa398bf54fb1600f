"""Shared parameters of boards' effects, as values or as ratios to the boards' own moduli."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.campaign import CampaignCard, SharedSection
from bayesplate.board.material import MODULI, moduli_of
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.effects import EFFECTS
from bayesplate.effects.base import Ratio
from bayesplate.errors import Fault, InputError

MOST_PARAMETERS = 3
"""Largest number of shared parameters: quadrature nodes grow exponentially with it."""


@dataclass(frozen=True)
class SharedParameter:
    """A number that all boards of a campaign share, or about which their own numbers scatter."""

    effect: str  # with the key: the parameter of the boards that it sets
    key: str
    prior: Quantity  # of the number itself; its standard coordinate is sampled
    unit: str  # SI; "1" for a ratio
    source: str = ""  # where the prior comes from; empty if a card states it
    ratio_to: str = ""  # the modulus that it is a ratio to; empty for a value
    # scale of the half-normal prior of how much the boards' own differ from it, as the standard deviation of the
    # logarithm; 0 where all boards have the same
    scatter: float = 0.0

    @property
    def name(self) -> str:
        """The name in results: "attached_mass.mass", "transverse_shear.G_xz / E_x"."""
        return f"{self.effect}.{self.key}" + (f" / {self.ratio_to}" if self.ratio_to else "")

    def parameters(self, board: Board) -> tuple[Parameter, ...]:
        """The uncertain parameters of a board that it sets: one, or one per setup."""
        return tuple(
            parameter for parameter in board.uncertain if (parameter.effect, parameter.key) == (self.effect, self.key)
        )

    def of_board(self, value: Floats, values: Values) -> Floats:
        """The board's parameter from a value of the shared number: (n,) arrays, SI."""
        return value * modulus(self.ratio_to, values) if self.ratio_to else value

    def from_board(self, parameter: Floats, values: Values) -> Floats:
        """The shared number from a board's parameter: the inverse of `of_board`."""
        return parameter / modulus(self.ratio_to, values) if self.ratio_to else parameter


def modulus(name: str, values: Values) -> Floats:
    """E_x, E_y or G_xy of a board from its rigidities: (n,) array, Pa; not a number where no material exists."""
    constants = moduli_of(values)
    return np.asarray(constants[MODULI.index(name)])


def find_shared_parameters(card: CampaignCard, boards: Sequence[Board]) -> tuple[SharedParameter, ...]:
    """The shared parameters of a campaign, whose effects the boards declare, in the order of the card and of each
    effect's parameters.

    InputError with all faults of effects that cannot be shared, board by board.
    """
    file = card.path.name
    shared_parameters: list[SharedParameter] = []
    faults: list[Fault] = []
    for number, section in enumerate(card.shared, start=1):
        place = f'{file} [[shared]] {number} "{section.effect}"'
        try:
            shared_parameters += _parameters_of_effect(section, boards, place)
        except InputError as error:
            faults += error.faults
    if len(shared_parameters) > MOST_PARAMETERS and not faults:
        names = ", ".join(parameter.name for parameter in shared_parameters)
        remedy = "share fewer effects; the others stay each board's own"
        faults.append(Fault(f"{file} [[shared]]", f"at most {MOST_PARAMETERS} shared parameters", names, remedy))
    if faults:
        raise InputError(faults)
    return tuple(shared_parameters)


def _parameters_of_effect(section: SharedSection, boards: Sequence[Board], place: str) -> list[SharedParameter]:
    """The shared parameters of one effect, which all boards must have, uncertain and with one prior."""
    ratios = EFFECTS[section.effect].ratios
    if section.way == "ratio" and not ratios:
        names = ", ".join(name for name, effect in EFFECTS.items() if effect.ratios)
        raise InputError(Fault(f"{place} as", "value", "ratio", f"only {names} has ratios to the boards' moduli"))
    faults: list[Fault] = []
    parameters_by_board = [
        [parameter for parameter in board.parameters if parameter.effect == section.effect] for board in boards
    ]
    uncertain_keys = {
        parameter.key
        for board_parameters in parameters_by_board
        for parameter in board_parameters
        if not parameter.prior.is_exact
    }
    keys = [
        key
        for key in dict.fromkeys(
            parameter.key for board_parameters in parameters_by_board for parameter in board_parameters
        )
        if key in uncertain_keys
    ]
    for board, board_parameters in zip(boards, parameters_by_board, strict=True):
        board_place = f"{place}, board {board.name}"
        missing_keys = [key for key in keys if key not in {parameter.key for parameter in board_parameters}]
        known_keys = [
            parameter.key
            for parameter in board_parameters
            if parameter.prior.is_exact and (parameter.key in keys or not keys)
        ]
        own_keys = [
            parameter.key for parameter in board_parameters if parameter.is_component or not parameter.is_of_effect
        ]
        if missing_keys or not board_parameters:
            faults.append(
                Fault(board_place, f"the parameters {', '.join(keys) or 'of the effect'}", "a board without them")
            )
        if known_keys:
            remedy = "leave it out of the shared effects, or state its uncertainty on the board's card"
            faults.append(
                Fault(board_place, "something unknown to share", f"{', '.join(known_keys)} known for sure", remedy)
            )
        if own_keys:
            faults.append(
                Fault(board_place, "an effect that boards can share", f"{own_keys[0]}, which is each board's own")
            )
    if faults:
        raise InputError(faults)
    return [_shared_parameter(section, key, ratios.get(key), parameters_by_board, place) for key in keys]


def _shared_parameter(
    section: SharedSection,
    key: str,
    ratio: Ratio | None,
    parameters_by_board: Sequence[Sequence[Parameter]],
    place: str,
) -> SharedParameter:
    scatter = 0.01 * section.scatter_percent
    if section.way == "ratio" and ratio is not None:
        return SharedParameter(section.effect, key, ratio.prior, "1", ratio.source, ratio.to, scatter)
    same_parameters = [
        parameter for board_parameters in parameters_by_board for parameter in board_parameters if parameter.key == key
    ]
    first = same_parameters[0]
    if any(parameter.prior != first.prior for parameter in same_parameters):
        got = f"{len({repr(parameter.prior) for parameter in same_parameters})} different ones of {key}"
        raise InputError(Fault(place, "one prior, because it is one number", got, "state the same on every board"))
    if scatter and first.prior.kind != "log-normal":
        wanted = "a positive number, which boards differ in by a percentage"
        raise InputError(Fault(f"{place} scatter_percent", wanted, f"{key}, whose prior is {first.prior.kind}"))
    return SharedParameter(section.effect, key, first.prior, first.unit, first.source, scatter=scatter)
