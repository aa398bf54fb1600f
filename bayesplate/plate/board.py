"""The board on the bench: its size, its mass, what is known of its material, and the setups it was measured in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import BoardCard, CoefficientCard, PriorCard, SetupSection
from bayesplate.plate.parameter import BOARD, Parameter
from bayesplate.plate.setup import CLAMPED_NOISE, DEFAULT_NOISE, AttachedItem, DeclaredAir, Reading, Setup
from bayesplate.quantities import Quantity

Values = Mapping[str, NDArray[np.float64]]
"""Values of named quantities, SI: each a number or an (n_draws,) array."""

NO_TABLES: Mapping[str, CoefficientCard] = MappingProxyType({})

_MILLI = 1e-3


INPUTS = {
    "length_x": ("m", "length along the grain"),
    "length_y": ("m", "length across the grain"),
    "thickness": ("m", "thickness"),
    "mass": ("kg", "mass"),
    "density": ("kg/m^3", "density"),
    "poisson_xy": ("1", "Poisson ratio nu_xy"),
}
"""What a card states of a board: unit, and what people call it."""


@dataclass(frozen=True)
class Board:
    """A board and its setups, in SI units.

    `board_from_card` makes one from a card, `made_board` from numbers.

    Attributes
    ----------
    name : str
    parameters : tuple of Parameter
        What is known of the board besides the readings: length_x, length_y, thickness (m), mass (kg) or density
        (kg m^-3), poisson_xy, the length each clamp covers, and what the declared effects take. A parameter with an
        uncertainty is marginalised.
    setups : tuple of Setup
    prior : str
        Name of the prior card.
    title, source : str
    effects : tuple of str
        Declared effects.
    chosen : tuple
        Effects (`bayesplate.effects.Effect`) in another form than the card itself would give them.
    shear_xz, shear_yz : Quantity or None, Pa
    notes : tuple of str
        What was assumed because the card does not say it.
    """

    name: str
    parameters: tuple[Parameter, ...]
    setups: tuple[Setup, ...]
    prior: str = "weakly-informative"
    title: str = ""
    source: str = ""
    effects: tuple[str, ...] = ()
    chosen: tuple[Any, ...] = ()
    shear_xz: Quantity | None = None
    shear_yz: Quantity | None = None
    notes: tuple[str, ...] = ()

    @cached_property
    def inputs(self) -> Mapping[str, Quantity]:
        """Prior of every parameter by its name."""
        return {parameter.name: parameter.prior for parameter in self.parameters}

    @cached_property
    def uncertain(self) -> tuple[Parameter, ...]:
        """Parameters that carry an uncertainty, in a fixed order."""
        return tuple(parameter for parameter in self.parameters if not parameter.prior.is_exact)

    @property
    def uncertain_inputs(self) -> dict[str, Quantity]:
        """Priors of the uncertain parameters by name, in their order."""
        return {parameter.name: parameter.prior for parameter in self.uncertain}

    def parameter(self, name: str) -> Parameter:
        """The parameter of a name."""
        return next(parameter for parameter in self.parameters if parameter.name == name)

    def setup(self, name: str) -> Setup:
        """The setup of a name."""
        return next(setup for setup in self.setups if setup.name == name)

    def nominal(self) -> dict[str, NDArray[np.float64]]:
        """Mean of every parameter."""
        return {name: np.asarray(quantity.mean) for name, quantity in self.inputs.items()}

    def with_parameters(self, parameters: Iterable[Parameter]) -> Board:
        """The board with further parameters; one of the same name takes the place of the earlier one."""
        joined = {parameter.name: parameter for parameter in (*self.parameters, *parameters)}
        return replace(self, parameters=tuple(joined.values()))

    def with_priors(self, priors: Mapping[str, Quantity]) -> Board:
        """The board with other priors of some of its parameters, by their names."""
        unknown = set(priors) - set(self.inputs)
        if unknown:
            raise ValueError(f"priors: wanted names of {', '.join(self.inputs)}, got {', '.join(sorted(unknown))}")
        return replace(
            self, parameters=tuple(replace(one, prior=priors.get(one.name, one.prior)) for one in self.parameters)
        )


def made_board(name: str, inputs: Mapping[str, Quantity], setups: Sequence[Setup], **more: Any) -> Board:
    """A board from quantities in SI units, without a card.

    Parameters
    ----------
    name : str
    inputs : dict of Quantity
        length_x, length_y, thickness (m), mass (kg) or density (kg m^-3), and poisson_xy.
    setups : sequence of Setup
        What their clamps cover becomes parameters too.
    **more
        Other attributes of `Board`.

    Returns
    -------
    Board
    """
    stated = [Parameter(key, BOARD, prior, INPUTS[key][0], words=INPUTS[key][1]) for key, prior in inputs.items()]
    covered = [parameter for setup in setups for parameter in setup.clamped_parameters]
    return Board(name, (*stated, *covered), tuple(setups), **more)


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
        By setup, those that the card names: see `bayesplate.cards.load_named`.

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
    inputs["poisson_xy"] = _poisson(card, prior)
    return made_board(
        card.name,
        inputs,
        setups,
        title=card.title,
        source=card.source,
        prior=card.material.prior,
        effects=tuple(card.effects),
        shear_xz=_optional(card.material.shear_xz_gpa, 1e9),
        shear_yz=_optional(card.material.shear_yz_gpa, 1e9),
        notes=_notes(card, inputs["poisson_xy"]),
    )


def density(values: Values) -> NDArray[np.float64]:
    """Density of the board from the values of its inputs, kg m^-3."""
    if "density" in values:
        return np.asarray(values["density"])
    return np.asarray(values["mass"] / (values["length_x"] * values["length_y"] * values["thickness"]))


def vibrating_lengths(values: Values, setup: Setup) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Side lengths left free by the clamps of a setup, m."""
    sides = []
    for axis in ("x", "y"):
        covered = sum(values[setup.input_name(e)] for e in setup.clamped if e.startswith(axis))
        sides.append(np.asarray(values[f"length_{axis}"] - covered))
    return sides[0], sides[1]


def _optional(quantity: Quantity | None, factor: float) -> Quantity | None:
    return None if quantity is None else quantity.scaled(factor)


def _poisson(card: BoardCard, prior: PriorCard | None) -> Quantity:
    if card.material.poisson_is_default and prior is not None and prior.poisson_xy is not None:
        return prior.poisson_xy
    return card.material.poisson_xy


def _noise(section: SetupSection, prior: PriorCard | None) -> Quantity:
    stated = section.noise_percent or (prior.noise_percent if prior is not None else None)
    if stated is not None:
        return stated.scaled(1e-2)
    return CLAMPED_NOISE if "clamped" in section.edges.words.values() else DEFAULT_NOISE


def _joined_with_rounding(frequency: Quantity, resolution: float | None) -> Quantity:
    """A list of readings with their standard error joined with the rounding error; a single number stays as it is."""
    if len(frequency.readings) < 2 or frequency.resolution or not resolution:
        return frequency
    return Quantity.from_readings(frequency.readings, resolution)


def _setup(section: SetupSection, prior: PriorCard | None, table: CoefficientCard | None) -> Setup:
    edges, first = section.edges, section.first_label
    return Setup(
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
            )
            for label, frequency in section.frequencies_hz.items()
        ),
        resolution=section.resolution_hz or 0.0,
        unlabelled=tuple(peak.mean for peak in section.unlabelled_hz),
        noise=_noise(section, prior),
        first_label=first,
        published_coefficients=table,
        attached=tuple(
            AttachedItem(
                item.kind,
                tuple((x * _MILLI, y * _MILLI) for x, y in item.at_mm),
                _optional(item.mass_g, _MILLI),
            )
            for item in section.attached
        ),
        hammer=None if section.hammer is None else (section.hammer.at_mm[0] * _MILLI, section.hammer.at_mm[1] * _MILLI),
        air=None if section.air is None else DeclaredAir(section.air.density_kg_m3, section.air.baffle),
    )


def _notes(card: BoardCard, poisson: Quantity) -> tuple[str, ...]:
    notes = []
    if card.material.poisson_is_default:
        notes.append(f"the card gives no Poisson ratio: nu_xy = {poisson.mean:g} +- {poisson.sd:g} was assumed")
    return tuple(notes)
