"""Cards: boards, priors and coefficient tables in TOML, read into frozen models with every fault named at once."""

from bayesplate.cards.board import (
    BoardCard,
    MaterialSection,
    PlateSection,
    load_board,
    load_board_in,
    read_board_text,
    usual_poisson,
)
from bayesplate.cards.campaign import CampaignCard, SharedSection, is_campaign, load_campaign
from bayesplate.cards.coefficients import CoefficientCard, load_coefficients
from bayesplate.cards.copies import readings_sha256
from bayesplate.cards.named import NamedCards, load_named
from bayesplate.cards.physical import off_the_board, physical_faults, plate_mass_g, too_heavy
from bayesplate.cards.prior import PriorCard, StatedPrior, load_prior
from bayesplate.cards.remarks import remarks
from bayesplate.cards.rows import Columns
from bayesplate.cards.setup import (
    MISSED,
    SPURIOUS,
    AttachedItem,
    Edges,
    FluidSection,
    HammerSection,
    PeakSection,
    SetupSection,
)
from bayesplate.cards.shelf import card_names, find
from bayesplate.cards.template import Template
from bayesplate.cards.words import EDGE_NAMES, EDGE_WORDS, EFFECT_NAMES
from bayesplate.errors import plain

__all__ = [
    "EDGE_NAMES",
    "EDGE_WORDS",
    "EFFECT_NAMES",
    "MISSED",
    "SPURIOUS",
    "AttachedItem",
    "BoardCard",
    "CampaignCard",
    "CoefficientCard",
    "Columns",
    "Edges",
    "FluidSection",
    "HammerSection",
    "MaterialSection",
    "NamedCards",
    "PeakSection",
    "PlateSection",
    "PriorCard",
    "SetupSection",
    "SharedSection",
    "StatedPrior",
    "Template",
    "card_names",
    "find",
    "is_campaign",
    "load_board",
    "load_board_in",
    "load_campaign",
    "load_coefficients",
    "load_named",
    "load_prior",
    "off_the_board",
    "physical_faults",
    "plain",
    "plate_mass_g",
    "read_board_text",
    "readings_sha256",
    "remarks",
    "too_heavy",
    "usual_poisson",
]
