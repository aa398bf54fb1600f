"""A campaign as a problem of inference: its boards as problems, and what they share; every fault of all at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, TypeVar

from bayesplate.board.campaign import CampaignCard, is_campaign, load_campaign
from bayesplate.board.checks import readings_sha256
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.words import name_complaint
from bayesplate.campaign.population import require_moduli
from bayesplate.campaign.shared import SharedParameter, find_shared_parameters
from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.options import ANY_PATH, Effects, Law, Robust
from bayesplate.commands.prepare import CardSource, PreparedBoard, prepare
from bayesplate.commands.problem import Problem, as_problem, pose_all
from bayesplate.errors import Fault, InputError
from bayesplate.frequencies.laws import LawName
from bayesplate.results.folder import POPULATION_SUFFIX

CampaignPath = str | os.PathLike[str]
OfBoard = TypeVar("OfBoard")
OfCampaign = TypeVar("OfCampaign")


@dataclass(frozen=True, eq=False, repr=False)
class Campaign:
    """Boards that are fitted together: `bayesplate.fit(campaign)`.

    Attributes
    ----------
    card : CampaignCard
    problems : tuple of Problem
        One per board, the shared effects declared.
    shared : tuple of SharedParameter
        What the boards have in common, none for boards that are fitted side by side.
    population : PriorCard or None
        The prior of the distribution of their constants, where they share one.
    """

    card: CampaignCard
    problems: tuple[Problem, ...]
    shared: tuple[SharedParameter, ...]
    population: PriorCard | None

    @classmethod
    @check_arguments()
    def from_card(
        cls,
        card: Annotated[CampaignPath, ANY_PATH],
        effects: Effects = None,
        law: Law = None,
        robust: Robust = False,
    ) -> Campaign:
        """The campaign of a card.

        Parameters
        ----------
        card : str or path
            Name of a shipped campaign card, or a path.
        effects : sequence of str, optional
            Declared effects of every board in place of those of its card and of the campaign's; the shared ones are
            declared in any case.
        law : "linear" or "exact", optional
            By default each board's own choice.
        robust : bool
            Student's distribution for the noise.

        Returns
        -------
        Campaign

        Raises
        ------
        InputError
            With every fault of the card; if there is none, with those of all boards; if there is none, with what cannot
            be shared.
        """
        campaign_card = load_campaign(card)
        prepared_boards, population = _prepare_boards(campaign_card, effects)
        shared = find_shared_parameters(campaign_card, [prepared.board for prepared in prepared_boards])
        return cls(
            campaign_card, tuple(Problem(prepared, law, robust) for prepared in prepared_boards), shared, population
        )

    @property
    def name(self) -> str:
        """Name of the campaign."""
        return self.card.name

    def pose(self) -> None:
        """Solve every board around its estimate, so that what cannot be fitted is known before anything is sampled.

        Raises
        ------
        NotIdentifiableError
            With every board that leaves a constant open.
        """
        pose_all(self.problems)

    def __repr__(self) -> str:
        shared = ", ".join(parameter.name for parameter in self.shared) or "nothing shared"
        return f"<Campaign {self.name}: {len(self.problems)} boards; {shared}>"


def dispatch_card(
    card: Problem | CardSource | Campaign,
    of_board: Callable[[Problem], OfBoard],
    of_campaign: Callable[[Campaign], OfCampaign],
    *,
    effects: Sequence[str] | None = None,
    law: LawName | None = None,
    robust: bool = False,
    setup: str | os.PathLike[str] | None = None,
    may_lack_frequencies: bool = False,
) -> OfBoard | OfCampaign:
    """Call the function for a board or that for a campaign, as the card is one or the other; options as `as_problem`.

    Raises InputError as `Problem.from_card` and `Campaign.from_card`; also for a Campaign beside what it states itself.
    """
    if isinstance(card, Campaign) or is_campaign(card):
        if setup is not None:
            wanted, remedy = "a board, whose setup it completes", "write it into the board's card"
            raise InputError(Fault("setup", wanted, "a campaign", remedy))
        if not isinstance(card, Campaign):
            return of_campaign(Campaign.from_card(card, effects, law, robust))
        if effects is not None or law is not None or robust:
            wanted, remedy = "nothing beside a Campaign", "Campaign.from_card takes it"
            raise InputError(Fault("effects, law, robust", wanted, "a value", remedy))
        return of_campaign(card)
    return of_board(
        as_problem(
            card, effects=effects, law=law, robust=robust, setup=setup, may_lack_frequencies=may_lack_frequencies
        )
    )


def _prepare_boards(card: CampaignCard, effects: Sequence[str] | None) -> tuple[list[PreparedBoard], PriorCard | None]:
    """Every board with the effects that the campaign declares or shares, and the prior of the population."""
    file = card.path.name
    declared = [*(card.effects if effects is None else ()), *(section.effect for section in card.shared)]
    faults: list[Fault] = []
    prepared_boards: list[PreparedBoard] = []
    for number, board in enumerate(card.boards, start=1):
        place = f"{file} boards {number}"
        try:
            prepared = prepare(card.board_path(board), effects)
            if declared:
                place = f"{file} effects"
                prepared = prepared.with_effects(tuple(dict.fromkeys((*prepared.board.effects, *declared))))
            prepared_boards.append(prepared)
        except InputError as error:
            faults += [replace(fault, place=f"{place} -> {fault.place}") for fault in error.faults]
    names = [prepared.board.name.casefold() for prepared in prepared_boards]
    faults += [
        Fault(f"{file} boards", "boards with names of their own", f"{prepared.board.name} again")
        for i, prepared in enumerate(prepared_boards)
        if prepared.board.name.casefold() in names[:i]
    ]
    hashes = [readings_sha256(prepared.card) for prepared in prepared_boards]
    faults += [
        Fault(
            f"{file} boards",
            "each board once",
            f"{prepared.board.name} with every reading of {prepared_boards[hashes.index(hashes[i])].board.name}",
            "a board and its copy would count twice",
        )
        for i, prepared in enumerate(prepared_boards)
        if hashes[i] in hashes[:i] and prepared.board.name.casefold() not in names[:i]
    ]
    population = None
    if card.population is not None:
        place = f"{file} [population] prior"
        try:
            population = load_prior(card.population.prior, Path(card.path).parent)
            require_moduli(population, place)
            isotropic = [prepared.board.name for prepared in prepared_boards if prepared.board.isotropic]
            if isotropic:
                remedy = "leave [population] out, or those boards"
                got = f"{', '.join(isotropic)}, whose E_y and G_xy follow from E_x"
                raise InputError(Fault(place, "boards of three constants", got, remedy))
        except InputError as error:
            faults += [
                fault if fault.place == place else replace(fault, place=f"{place} -> {fault.place}")
                for fault in error.faults
            ]
        complaint = name_complaint(f"{card.name}{POPULATION_SUFFIX}")
        if complaint:
            remedy = f"the prior card of its population is named {card.name}{POPULATION_SUFFIX}"
            faults.append(Fault(f"{file} name", complaint, card.name, remedy))
    if faults:
        raise InputError(faults)
    return prepared_boards, population
