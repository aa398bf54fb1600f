"""The board on the bench: its size, its mass, what is known of its material, and the setups it was measured in."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayesplate.board.board_keys import BoardKeys, MaterialKeys, PlateKeys, read_board
from bayesplate.board.coefficients import CoefficientCard
from bayesplate.board.inputs import (
    DENSITY_KINDS,
    INPUTS,
    default_poisson,
    input_parameters,
    unknown_name_fault,
    warp_quantities,
)
from bayesplate.board.material import ISOTROPIC, ORTHOTROPIC, Symmetry
from bayesplate.board.parameter import BOARD_OWNER, Parameter
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.board.shelf import CardFile
from bayesplate.board.stated import are_instances, quantities_of, type_faults
from bayesplate.board.unstatable import attribute_faults, unstatable_faults
from bayesplate.board.words import canonical_effect
from bayesplate.board.writing import toml_text, write_card
from bayesplate.errors import Fault, InputError

Values = Mapping[str, NDArray[np.float64]]
"""Values of named quantities, SI: each a number or an (n_draws,) array."""


@dataclass(frozen=True)
class Board:
    """A board and its setups, in SI units.

    `Board.from_toml` reads one from a card and `to_toml` writes one, `Board.from_numbers` makes one from numbers,
    `dataclasses.replace` and `with_priors` make another one from it.

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
    has_implied_effects : bool
        Whether stated data of the board (a sensor's mass, the fluid, a bounce) declare effects beside these; an empty
        list of effects on the card declares none.
    effect_forms : tuple
        Effects (`bayesplate.effects.Effect`) in another form than that of the card.
    shear_xz, shear_yz : Quantity or None, Pa
    warp : dict of Quantity, m
        Straightedge readings of a board that is not flat, as far as stated: "cup", the rise across the
        width; "bow", that along the length, negative on a saddle; "twist", a corner's lift off a table that the other
        three touch.
    isotropic : bool
        One modulus in all directions: E_y = E_x = E and G_xy = E / (2 (1 + nu)), nu the input poisson_xy.
    notes : tuple of str
        What was assumed because the card does not say it.
    card : CardFile or None
        The card it was read from, or that of the board it was made from; None if it was made in Python.
    """

    name: str
    parameters: tuple[Parameter, ...]
    setups: tuple[Setup, ...]
    prior: str = "weakly-informative"
    title: str = ""
    source: str = ""
    effects: tuple[str, ...] = ()
    has_implied_effects: bool = True
    effect_forms: tuple[Any, ...] = ()
    shear_xz: Quantity | None = None
    shear_yz: Quantity | None = None
    warp: Mapping[str, Quantity] = field(default_factory=dict)
    isotropic: bool = False
    notes: tuple[str, ...] = ()
    card: CardFile | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        effects: object = self.effects  # of any type until the board is used
        if isinstance(effects, Iterable) and not isinstance(effects, str):
            object.__setattr__(self, "effects", tuple(map(canonical_effect, effects)))

    @property
    def symmetry(self) -> Symmetry:
        """Which of its rigidities are free."""
        return ISOTROPIC if self.isotropic else ORTHOTROPIC

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
        """The parameter of a name; raises InputError with the names that there are."""
        return _find_by_name("parameter", name, self.parameters)

    def setup(self, name: str) -> Setup:
        """The setup of a name; raises InputError with the names that there are."""
        return _find_by_name("setup", name, self.setups)

    def nominal(self) -> dict[str, NDArray[np.float64]]:
        """Mean of every parameter."""
        return {name: np.asarray(quantity.mean) for name, quantity in self.inputs.items()}

    def with_parameters(self, parameters: Iterable[Parameter]) -> Board:
        """The board with further parameters; one of the same name takes the place of the earlier one."""
        joined = {parameter.name: parameter for parameter in (*self.parameters, *parameters)}
        return replace(self, parameters=tuple(joined.values()))

    def with_priors(self, priors: Mapping[str, Quantity | ArrayLike]) -> Board:
        """The board with other priors of some of its parameters, by their names; numbers as in `from_numbers`."""
        if not isinstance(priors, Mapping):
            raise InputError(type_faults(self.name, [("priors", priors, False, "a dict of quantities by name")]))
        faults = [unknown_name_fault("priors", name, self.inputs) for name in priors if name not in self.inputs]
        quantities, quantity_faults = quantities_of(priors, "priors", "SI", DENSITY_KINDS)
        if faults or quantity_faults:
            raise InputError([*faults, *quantity_faults])
        return replace(
            self,
            parameters=tuple(
                replace(parameter, prior=quantities[parameter.name], assumed=None)
                if parameter.name in quantities
                else parameter
                for parameter in self.parameters
            ),
            setups=tuple(
                replace(
                    setup,
                    clamped={
                        edge: quantities.get(setup.input_name(edge), length) for edge, length in setup.clamped.items()
                    },
                )
                for setup in self.setups
            ),
        )

    def without(self, effects: Collection[str]) -> Board:
        """The board without some of its declared effects, by their names; InputError for a plain text.

        What the board states of an effect stays, so that `fit` declares it again; `fit(board, effects=[])` does not.
        """
        if isinstance(effects, str):
            raise InputError(Fault("effects", "a list of names", repr(effects), f"[{effects!r}]"))
        effects = {*map(canonical_effect, effects)}
        return replace(
            self,
            effects=tuple(name for name in self.effects if name not in effects),
            effect_forms=tuple(effect for effect in self.effect_forms if effect.name not in effects),
            parameters=tuple(parameter for parameter in self.parameters if parameter.effect not in effects),
        )

    @classmethod
    def from_numbers(
        cls,
        name: str,
        *,
        length_x: Quantity | ArrayLike,
        length_y: Quantity | ArrayLike,
        thickness: Quantity | ArrayLike,
        setups: Setup | Sequence[Setup],
        mass: Quantity | ArrayLike | None = None,
        density: Quantity | ArrayLike | None = None,
        poisson_xy: Quantity | ArrayLike | None = None,
        prior: str | os.PathLike[str] | PriorCard = "weakly-informative",
        effects: Sequence[str] | None = None,
        shear_xz: Quantity | ArrayLike | None = None,
        shear_yz: Quantity | ArrayLike | None = None,
        warp: Mapping[str, Quantity | ArrayLike] | None = None,
        isotropic: bool = False,
        title: str = "",
        source: str = "",
    ) -> Board:
        """A board from numbers, arrays and quantities in SI units: a number is exact, an array holds readings.

        Further faults are reported with their place on a card when the board is used: `bayesplate.check(board)`.

        Parameters
        ----------
        name : str
            Letters, digits, . _ -
        length_x, length_y, thickness : Quantity, number or array of readings, m
        setups : Setup or sequence of Setup
        mass : Quantity, number or array of readings, kg
            Or the density; exactly one of the two.
        density : Quantity, number or array of readings, kg m^-3
        poisson_xy : Quantity, number or array of readings
            By default that of the prior that the board is used with, where it states one, else 0.4 ± 0.08, or
            0.3 ± 0.06 where the board is isotropic.
        prior : str, path or PriorCard
            Name of a shipped prior card, a path, or the card itself; a card that is not on the shelf must be passed
            again where the board is used: `Problem.from_card(board, prior=prior)`. Noise and Poisson ratio that are not
            stated come from that prior.
        effects : sequence of str, optional
            Declared effects, beside those that are implied by what is stated; an empty list declares nothing at all.
        shear_xz, shear_yz : Quantity, number or array of readings, Pa
        warp : dict of Quantity, number or array of readings, m
            "cup", "bow" and "twist", as far as they were read with a straightedge; a quantity is a normal one.
        isotropic : bool
            One modulus in all directions, as of metal, glass, foam or MDF; then the prior is its density of E.
        title, source : str

        Returns
        -------
        Board

        Raises
        ------
        InputError
            With every value that is no number, no array of numbers and no quantity, and every argument of another type.

        Examples
        --------
        >>> import bayesplate
        >>> free = bayesplate.Setup.from_frequencies({(1, 1): 134, (2, 0): [240, 242]}, edges="free", resolution=1)
        >>> board = bayesplate.Board.from_numbers(
        ...     "my-board", length_x=0.253, length_y=0.114, thickness=0.003, mass=0.041, setups=free
        ... )
        >>> board.inputs["thickness"].mean
        0.003
        """
        faults = list(type_faults(str(name), (
            ("name", name, isinstance(name, str), "a text"),
            ("setups", setups, isinstance(setups, Setup) or are_instances(setups, Setup), "a Setup or a list of them"),
            ("prior", prior, isinstance(prior, str | os.PathLike | PriorCard), "a name, a path or a PriorCard"),
            ("effects", effects, effects is None or are_instances(effects, str), "a list of names of effects"),
            ("isotropic", isotropic, isinstance(isotropic, bool), "True or False"),
            ("title", title, isinstance(title, str), "a text"),
            ("source", source, isinstance(source, str), "a text"),
            ("warp", warp, isinstance(warp, Mapping | None), "a dict of heights by cup, bow and twist"),
        )))  # fmt: skip
        stated = {
            "length_x": length_x, "length_y": length_y, "thickness": thickness, "mass": mass, "density": density,
            "poisson_xy": poisson_xy, "shear_xz": shear_xz, "shear_yz": shear_yz,
        }  # fmt: skip
        needed = ("length_x", "length_y", "thickness")
        values = {key: value for key, value in stated.items() if value is not None or key in needed}
        quantities, quantity_faults = quantities_of(values, str(name), "SI", DENSITY_KINDS)
        warps, warp_faults = warp_quantities(warp, str(name)) if isinstance(warp, Mapping) else ({}, [])
        quantity_faults += warp_faults
        if faults or quantity_faults:
            raise InputError([*faults, *quantity_faults])
        card = prior if isinstance(prior, PriorCard) else load_prior(prior)
        shear = {key: quantities.pop(key, None) for key in ("shear_xz", "shear_yz")}
        return make_board(
            name,
            quantities,
            (setups,) if isinstance(setups, Setup) else tuple(setups),
            assumed_poisson=None if "poisson_xy" in quantities else default_poisson(isotropic),
            prior=prior.name if isinstance(prior, PriorCard) else os.fspath(prior),
            effects=tuple(effects or ()),
            has_implied_effects=effects is None or bool(effects),
            isotropic=isotropic,
            title=title,
            source=source,
            warp=warps,
            **shear,
        ).assuming(card)

    @classmethod
    def from_toml(
        cls,
        name_or_path: str | os.PathLike[str],
        *,
        may_lack_frequencies: bool = False,
        setup: str | os.PathLike[str] | None = None,
    ) -> Board:
        """Read a board card; the cards that it names are not read.

        Parameters
        ----------
        name_or_path : str or path
            Name of a shipped card, or a path: it contains a separator or ends in .toml.
        may_lack_frequencies : bool
            Whether a board that was not measured yet will do.
        setup : str or path, optional
            A file with a table [setup] that takes the place of the card's, key by key.

        Returns
        -------
        Board

        Raises
        ------
        InputError
            If there is no such card, it cannot be read, or it does not follow the format; lists every such fault at
            once.
        """
        return cls.from_card(CardFile.load("boards", name_or_path), may_lack_frequencies, setup)

    @classmethod
    def from_text(cls, text: str, name: str, may_lack_frequencies: bool = False) -> Board:
        """Read a board card from a text, as if it stood in NAME.toml."""
        return cls.from_card(CardFile.of(text, f"{name.removesuffix('.toml')}.toml"), may_lack_frequencies)

    @classmethod
    def from_card(
        cls, card: CardFile, may_lack_frequencies: bool = False, setup: str | os.PathLike[str] | None = None
    ) -> Board:
        """Read a board card from its table; the options are those of `from_toml`."""
        keys, card = read_board(card, may_lack_frequencies, setup)
        plate, material = keys.plate, keys.material
        inputs = {**dict(plate), "poisson_xy": material.poisson_xy}
        return make_board(
            keys.name,
            {key: inputs[key] for key in INPUTS if inputs[key] is not None},
            [Setup.from_keys(setup_keys) for setup_keys in keys.setups],
            assumed_poisson=default_poisson(material.isotropic) if material.poisson_xy is None else None,
            title=keys.title,
            source=keys.source,
            prior=material.prior,
            effects=keys.effects or (),
            has_implied_effects=keys.effects != (),
            shear_xz=material.shear_xz,
            shear_yz=material.shear_yz,
            warp=plate.warp,
            isotropic=material.isotropic,
            card=card,
        )

    def assuming(self, prior: PriorCard | None, tables: Mapping[str, CoefficientCard] | None = None) -> Board:
        """The board with the noise and Poisson ratio of a prior where it states none, and coefficient tables."""
        poisson = (prior and prior.poisson_xy) or default_poisson(self.isotropic)
        setups = [setup.assuming_noise(prior) if setup.is_noise_assumed else setup for setup in self.setups]
        if tables is not None:
            setups = [replace(setup, published_coefficients=tables.get(setup.name), table_name="") for setup in setups]
        return replace(
            self,
            setups=tuple(setups),
            parameters=tuple(
                replace(parameter, prior=poisson, assumed=poisson) if parameter.is_assumed else parameter
                for parameter in self.parameters
            ),
        )

    def table(self) -> dict[str, Any]:
        """The table of its card; raises InputError if an attribute is of a type or a density that no card can state."""
        wrong_types = attribute_faults(self)
        if wrong_types:
            raise InputError(wrong_types)
        stated_parameters = [
            parameter
            for parameter in self.parameters
            if parameter.owner == BOARD_OWNER and not parameter.is_of_effect and not parameter.is_assumed
        ]
        inputs = {parameter.name: parameter.prior for parameter in stated_parameters}
        unstatable = [*unstatable_faults(self)]
        if unstatable:
            raise InputError(unstatable)
        poisson_xy = inputs.pop("poisson_xy", None)
        material = {name: getattr(self, name) for name in ("isotropic", "shear_xz", "shear_yz")}
        keys = BoardKeys.model_construct(
            format=1,
            name=self.name,
            title=self.title,
            source=self.source,
            effects=self.effects if self.effects or not self.has_implied_effects else None,
            plate=PlateKeys.model_construct(None, **inputs, warp=self.warp),
            material=MaterialKeys.model_construct(poisson_xy=poisson_xy, **material, prior=self.prior),
        )
        setups = [setup.table() for setup in self.setups]
        return {
            **keys.model_dump(by_alias=True, exclude_defaults=True, exclude={"setups"}),
            "setup": setups[0] if len(setups) == 1 else setups,
        }

    def to_toml(self, path: str | os.PathLike[str] | None = None, *, force: bool = False) -> str:
        """The board as a card, in TOML.

        Parameters
        ----------
        path : path, optional
            File to write, NAME.toml; nothing is written without it.
        force : bool
            Replace a file that is there.

        Returns
        -------
        str
            The text of the card; reading it gives the board again.

        Raises
        ------
        InputError
            If a quantity has a density that no card can state, or the file cannot be written.
        """
        text = toml_text(self.table())
        if path is not None:
            write_card(path, self.name, text, force=force)
        return text

    @property
    def file(self) -> str:
        """The name of its card, as messages show it."""
        return self.card.display_name if self.card is not None else f"{self.name}.toml"

    @property
    def folder(self) -> Path | None:
        """Folder from which its relative paths start; None for the working directory."""
        return None if self.card is None else self.card.folder

    @property
    def text(self) -> str:
        """Its card as it was read; that of a board made in Python is written."""
        return self.to_toml() if self.card is None else self.card.text

    @property
    def sha256(self) -> str:
        """Hexadecimal SHA-256 of its card."""
        return (self.card or CardFile(self.table(), self.file)).sha256

    @property
    def reading_names(self) -> tuple[str, ...]:
        """Setup and label of every reading, in the order of all results: "cantilever (1,0)"."""
        return tuple(f"{setup.name} {label}" for setup in self.setups for label in setup.labels)

    @property
    def short_reading_names(self) -> tuple[str, ...]:
        """The same for sentences: without the setup where there is only one, "(1,0)"."""
        return self.reading_names if len(self.setups) > 1 else tuple(map(str, self.setups[0].labels))


Named = TypeVar("Named", Parameter, Setup)


def _find_by_name(place: str, name: str, items: Iterable[Named]) -> Named:
    by_name = {item.name: item for item in items}
    if name not in by_name:
        raise InputError(unknown_name_fault(place, name, by_name))
    return by_name[name]


def poisson_notes(board: Board) -> tuple[str, ...]:
    """A sentence on the Poisson ratio if it was assumed."""
    nu = board.parameter("poisson_xy")
    value = f"nu_xy = {nu.prior.mean:g} ± {nu.prior.sd:g} was assumed"
    return (f"the card gives no Poisson ratio: {value}",) if nu.is_assumed else ()


def make_board(
    name: str,
    inputs: Mapping[str, Quantity],
    setups: Sequence[Setup],
    assumed_poisson: Quantity | None = None,
    **more: Any,
) -> Board:
    """A board from quantities in SI units, without a card; `more` are other attributes of `Board`."""
    is_isotropic = more.get("isotropic", False)
    parameters = input_parameters(inputs, setups, assumed_poisson, is_isotropic=is_isotropic)
    return Board(name, parameters, tuple(setups), **more)


def board_density(values: Values) -> NDArray[np.float64]:
    """Density of the board from the values of its inputs, kg m^-3."""
    if "density" in values:
        return np.asarray(values["density"])
    return np.asarray(values["mass"] / (values["length_x"] * values["length_y"] * values["thickness"]))


def nominal_mass(board: Board) -> float:
    """Mean mass of the whole board, kg, from its mass or its density."""
    means = board.nominal()
    return float(board_density(means) * means["length_x"] * means["length_y"] * means["thickness"])


def vibrating_lengths(values: Values, setup: Setup) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Side lengths left free by the clamps of a setup, m."""
    sides = []
    for axis in ("x", "y"):
        covered = sum(values[setup.input_name(edge)] for edge in setup.clamped if edge.startswith(axis))
        sides.append(np.asarray(values[f"length_{axis}"] - covered))
    return sides[0], sides[1]
