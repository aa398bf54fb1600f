"""What boards share: parameters of their effects, as values or as ratios to the boards' own moduli."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.campaign import CampaignCard, SharedSection
from bayesplate.board.material import MODULI, moduli
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.effects import EFFECTS
from bayesplate.effects.base import Ratio
from bayesplate.errors import Fault, InputError

MOST_PARAMETERS = 3
"""Nodes over more would grow as a power of their number."""


@dataclass(frozen=True)
class Shared:
    """One number that all boards of a campaign have in common, or about which their own scatter."""

    effect: str  # with the key: the parameter of the boards that it sets
    key: str
    prior: Quantity  # of the number itself; its standard coordinate is what is sampled
    unit: str  # SI; "1" for a ratio
    source: str = ""  # where the prior comes from; empty if a card states it
    to: str = ""  # the modulus that it is a ratio to; empty for a value
    # scale of the half-normal prior of how much the boards' own differ from it, as the standard deviation of the
    # logarithm; 0 where all boards have the same
    scatter: float = 0.0

    @property
    def name(self) -> str:
        """The name in results: "attached_mass.mass", "transverse_shear.G_xz / E_x"."""
        return f"{self.effect}.{self.key}" + (f" / {self.to}" if self.to else "")

    def parameters(self, board: Board) -> tuple[Parameter, ...]:
        """The uncertain parameters of a board that it sets: one per setup that has its own."""
        return tuple(one for one in board.uncertain if (one.effect, one.key) == (self.effect, self.key))

    def of_board(self, value: Floats, values: Values) -> Floats:
        """What the board's parameters are where the shared number has a value: (n,) arrays, SI."""
        return value * modulus(self.to, values) if self.to else value

    def from_board(self, parameter: Floats, values: Values) -> Floats:
        """The shared number that a board's parameter amounts to: the inverse of `of_board`."""
        return parameter / modulus(self.to, values) if self.to else parameter


def modulus(name: str, values: Values) -> Floats:
    """E_x, E_y or G_xy of a board from its rigidities: (n,) array, Pa; not a number where no material exists."""
    found = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    return np.asarray(found[MODULI.index(name)])


def shared_by(card: CampaignCard, boards: Sequence[Board]) -> tuple[Shared, ...]:
    """What the boards of a campaign, its effects declared, share: in the order of the card and of each effect's
    parameters.

    InputError with everything that cannot be shared, board by board.
    """
    file = card.path.name
    found: list[Shared] = []
    faults: list[Fault] = []
    for number, section in enumerate(card.shared, start=1):
        place = f'{file} [[shared]] {number} "{section.effect}"'
        try:
            found += _of_effect(section, boards, place)
        except InputError as error:
            faults += error.faults
    if len(found) > MOST_PARAMETERS and not faults:
        names = ", ".join(one.name for one in found)
        remedy = "share fewer effects; the others stay each board's own"
        faults.append(Fault(f"{file} [[shared]]", f"at most {MOST_PARAMETERS} shared parameters", names, remedy))
    if faults:
        raise InputError(faults)
    return tuple(found)


def _of_effect(section: SharedSection, boards: Sequence[Board], place: str) -> list[Shared]:
    """The parameters of one effect that all boards have, all uncertain and with one prior."""
    ratios = EFFECTS[section.effect].ratios
    if section.way == "ratio" and not ratios:
        able = ", ".join(name for name, effect in EFFECTS.items() if effect.ratios)
        raise InputError(Fault(f"{place} as", "value", "ratio", f"only {able} has ratios to the boards' moduli"))
    faults: list[Fault] = []
    of_boards = [[one for one in board.parameters if one.effect == section.effect] for board in boards]
    uncertain = {one.key for every in of_boards for one in every if not one.prior.is_exact}
    keys = [one for one in dict.fromkeys(one.key for every in of_boards for one in every) if one in uncertain]
    for board, every in zip(boards, of_boards, strict=True):
        where = f"{place}, board {board.name}"
        missing = [key for key in keys if key not in {one.key for one in every}]
        known = [one.key for one in every if one.prior.is_exact and (one.key in keys or not keys)]
        alone = [one.key for one in every if one.is_component or not one.is_of_effect]
        if missing or not every:
            faults.append(Fault(where, f"the parameters {', '.join(keys) or 'of the effect'}", "a board without them"))
        if known:
            remedy = "leave it out of the shared effects, or state its uncertainty on the board's card"
            faults.append(Fault(where, "something unknown to share", f"{', '.join(known)} known for sure", remedy))
        if alone:
            faults.append(Fault(where, "an effect that boards can share", f"{alone[0]}, which is each board's own"))
    if faults:
        raise InputError(faults)
    return [_shared(section, key, ratios.get(key), of_boards, place) for key in keys]


def _shared(
    section: SharedSection, key: str, ratio: Ratio | None, of_boards: Sequence[Sequence[Parameter]], place: str
) -> Shared:
    scatter = 0.01 * section.scatter_percent
    if section.way == "ratio" and ratio is not None:
        return Shared(section.effect, key, ratio.prior, "1", ratio.source, ratio.to, scatter)
    same = [one for every in of_boards for one in every if one.key == key]
    first = same[0]
    if any(one.prior != first.prior for one in same):
        got = f"{len({repr(one.prior) for one in same})} different ones of {key}"
        raise InputError(Fault(place, "one prior, because it is one number", got, "state the same on every board"))
    if scatter and first.prior.kind != "log-normal":
        wanted = "a positive number, which boards differ in by a percentage"
        raise InputError(Fault(f"{place} scatter_percent", wanted, f"{key}, whose prior is {first.prior.kind}"))
    return Shared(section.effect, key, first.prior, first.unit, first.source, scatter=scatter)
