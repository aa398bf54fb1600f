"""A board card taken to SI units: the board, its setups, and what was assumed because the card does not say it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from bayesplate.board.board import Board, made_board
from bayesplate.board.board_card import BoardCard
from bayesplate.board.coefficients import CoefficientCard
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import DEFAULT_NOISE, AttachedItem, DeclaredFluid, Setup
from bayesplate.board.setup_card import SetupSection

NO_TABLES: Mapping[str, CoefficientCard] = MappingProxyType({})

_MILLI = 1e-3
_PERCENT = 1e-2


def board_from_card(
    card: BoardCard, prior: PriorCard | None = None, tables: Mapping[str, CoefficientCard] = NO_TABLES
) -> Board:
    """Take a board card to SI units.

    Parameters
    ----------
    card : BoardCard
    prior : PriorCard, optional
        Its noise and Poisson ratio stand where it states them and the board card does not.
    tables : dict of CoefficientCard
        By setup, those that the card names: see `bayesplate.board.named.load_named`.

    Returns
    -------
    Board
    """
    setups = tuple(_setup(section, prior, tables.get(section.name)) for section in card.setups)
    inputs = {
        "length_x": card.plate.length_x_mm.scaled(_MILLI).with_places_scaled(_MILLI),
        "length_y": card.plate.length_y_mm.scaled(_MILLI).with_places_scaled(_MILLI),
        "thickness": card.plate.thickness_mm.scaled(_MILLI).with_places_scaled(_MILLI),
    }
    if card.plate.mass_g is not None:
        inputs["mass"] = card.plate.mass_g.scaled(_MILLI)
    elif card.plate.density_kg_m3 is not None:
        inputs["density"] = card.plate.density_kg_m3
    assumed = _assumed_poisson(card, prior)
    if assumed is None:
        inputs["poisson_xy"] = card.material.poisson_xy
    return made_board(
        card.name,
        inputs,
        setups,
        assumed_poisson=assumed,
        title=card.title,
        source=card.source,
        prior=card.material.prior,
        effects=card.effects,
        implies=bool(card.effects) or "effects" not in card.model_fields_set,
        shear_xz=_optional(card.material.shear_xz_gpa, 1e9),
        shear_yz=_optional(card.material.shear_yz_gpa, 1e9),
        warp={name: rise.scaled(_MILLI) for name, rise in card.plate.warp_mm.items()},
        isotropic=card.material.isotropic,
        notes=_notes(assumed),
    )


def _optional(quantity: Quantity | None, factor: float) -> Quantity | None:
    return None if quantity is None else quantity.scaled(factor)


def _assumed_poisson(card: BoardCard, prior: PriorCard | None) -> Quantity | None:
    """The Poisson ratio of the prior, or else the usual one, if the card states none."""
    if not card.material.poisson_is_default:
        return None
    return prior.poisson_xy if prior is not None and prior.poisson_xy is not None else card.material.usual_poisson


def _joined_with_rounding(frequency: Quantity, resolution: float | None) -> Quantity:
    """A list of readings with their standard error joined with the rounding error; a single number stays as it is."""
    if len(frequency.readings) < 2 or frequency.resolution or not resolution:
        return frequency
    return Quantity.from_readings(frequency.readings, resolution)


def _setup(section: SetupSection, prior: PriorCard | None, table: CoefficientCard | None) -> Setup:
    edges, first = section.edges, section.first_label
    stated, around = section.noise_percent, section.surroundings
    made = Setup(
        name=section.name,
        ends_x=(edges.x0, edges.x1),
        ends_y=(edges.y0, edges.y1),
        clamped={edge: length.scaled(_MILLI) for edge, length in section.clamped_mm.items()},
        readings=tuple(
            Reading(
                label,
                (label.m - first.m, label.n - first.n),
                _joined_with_rounding(frequency, section.resolution_hz),
                section.signs.get(label, ""),
                section.confidence_in(label),
            )
            for label, frequency in section.frequencies_hz.items()
        ),
        resolution=section.resolution_hz or 0.0,
        peaks=tuple(_peaks(section)),
        missed=section.missed_probability,
        spurious=section.spurious_probability,
        noise=DEFAULT_NOISE if stated is None else stated.scaled(_PERCENT),
        first_label=first,
        published_coefficients=table,
        attached=tuple(
            AttachedItem(
                item.kind,
                tuple((x * _MILLI, y * _MILLI) for x, y in item.at_mm),
                _optional(item.mass_g, _MILLI),
                _optional(item.coil_mass_g, _MILLI),
                item.suspension_n_per_m,
                item.resonance_hz,
                item.magnet,
            )
            for item in section.attached
        ),
        hammer=None if section.hammer is None else (section.hammer.at_mm[0] * _MILLI, section.hammer.at_mm[1] * _MILLI),
        fluid=None if around is None else DeclaredFluid(around.density_kg_m3, around.baffle),
        bounce=None if section.support is None else section.support.bounce_hz,
    )
    return made.assuming_noise(prior) if stated is None else made


def _peaks(section: SetupSection) -> Iterator[Peak]:
    """The peaks without a label: those that are listed, then those with tables of their own."""
    for frequency in section.unlabelled_hz:
        yield Peak(_joined_with_rounding(frequency, section.resolution_hz))
    for peak in section.peaks:
        damping = None if peak.damping_percent is None else peak.damping_percent * _PERCENT
        yield Peak(_joined_with_rounding(peak.hz, section.resolution_hz), peak.sign, peak.amplitude, damping)


def _notes(assumed_poisson: Quantity | None) -> tuple[str, ...]:
    if assumed_poisson is None:
        return ()
    told = f"nu_xy = {assumed_poisson.mean:g} ± {assumed_poisson.sd:g} was assumed"
    return (f"the card gives no Poisson ratio: {told}",)
