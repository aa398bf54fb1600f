"""The prior card: priors of the elastic constants, or of the rigidities, each with its source."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import Field

from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.board.prior_keys import DensityPrior, ElasticPrior, NoisePrior, PoissonPrior, RigidityPrior
from bayesplate.board.prior_keys import StatedPrior as StatedPrior
from bayesplate.board.quantity import Quantity
from bayesplate.board.schema import BaseCard, validate_card
from bayesplate.board.shelf import CardFile
from bayesplate.board.stated import type_faults
from bayesplate.board.words import did_you_mean
from bayesplate.board.writing import toml_text, write_card
from bayesplate.errors import Fault, InputError

ISOTROPIC_MODULUS = "E"
"""The one modulus of an isotropic board, stated beside the three or alone."""
_CONSTANTS = (*MODULI, *RIGIDITIES, ISOTROPIC_MODULUS)


class PriorCard(BaseCard):
    """Priors of E_x, E_y, G_xy or of D_x, D_y, D_s, of E for isotropic boards, and optionally the noise and nu_xy.

    `load_prior` makes one.
    """

    E_x: ElasticPrior = None
    E_y: ElasticPrior = None
    G_xy: ElasticPrior = None
    D_x: RigidityPrior = None
    D_y: RigidityPrior = None
    D_s: RigidityPrior = None
    E: ElasticPrior = None
    stated_noise: NoisePrior = Field(default=None, alias="noise_percent")
    stated_poisson: PoissonPrior = Field(default=None, alias="poisson_xy")
    stated_density: DensityPrior = Field(default=None, alias="density_kg_m3")

    @classmethod
    def from_quantities(
        cls,
        name: str,
        constants: Mapping[str, Quantity],
        *,
        source: str | Mapping[str, str],
        noise: Quantity | None = None,
        poisson_xy: Quantity | None = None,
        density: Quantity | None = None,
        title: str = "",
    ) -> PriorCard:
        """A prior from quantities.

        Parameters
        ----------
        name : str
        constants : dict of Quantity
            E_x, E_y, G_xy in Pa, or D_x, D_y, D_s in N m, and E in Pa of isotropic boards, beside them or alone; each
            from `Quantity.from_median` or `Quantity.from_range`.
        source : str or dict of str
            Where the numbers come from: one text, or one for each of them (also noise, poisson_xy, density_kg_m3).
        noise : Quantity, optional
            Relative noise of a frequency, from `Quantity.from_median`.
        poisson_xy : Quantity, optional
            Normal: `Quantity.from_mean(0.4, 0.08, "normal")`.
        density : Quantity, optional
            kg m^-3; it is no input of a fit, but a board of another density gets a question.
        title : str

        Returns
        -------
        PriorCard

        Raises
        ------
        InputError
            With everything that a prior card cannot hold, and its place on the card.
        """
        faults = list(type_faults(str(name), (
            ("name", name, isinstance(name, str), "a text"),
            ("title", title, isinstance(title, str), "a text"),
            ("constants", constants, isinstance(constants, Mapping), "a dict of quantities by name"),
            ("source", source, isinstance(source, str | Mapping), "a text, or a dict of texts by name"),
        )))  # fmt: skip
        if faults:
            raise InputError(faults)
        if not isinstance(source, str):  # as `sources` has it, for a prior that is made of another one
            source = {"noise" if key == "noise_percent" else key: text for key, text in source.items()}
        faults = [Fault(f"{name} {key}", f"one of {', '.join(_CONSTANTS)}", "an unknown name")
                  for key in constants if key not in _CONSTANTS]  # fmt: skip
        constant_wanted = "Quantity.from_median or Quantity.from_range, a constant known to some extent"
        for key, quantity, kinds, wanted in (
            *((key, constant, ("log-normal", "log-uniform"), constant_wanted) for key, constant in constants.items()),
            ("noise", noise, ("log-normal",), "Quantity.from_median"),
            ("poisson_xy", poisson_xy, ("normal",), 'Quantity.from_mean(0.4, 0.08, "normal")'),
            ("density", density, ("log-normal",), "Quantity.from_mean(430, 60)"),
        ):
            if not (_can_be_stated(quantity, kinds) or (quantity is None and key not in constants)):
                got = "another kind of quantity" if isinstance(quantity, Quantity) else repr(quantity)
                faults.append(Fault(f"{name} {key}", f"{wanted}, without bounds", got))
        other_priors = {"noise": noise, "poisson_xy": poisson_xy, "density_kg_m3": density}
        stated = {**constants, **{key: prior for key, prior in other_priors.items() if prior is not None}}
        faults += _source_faults(name, source, stated)
        if faults:
            raise InputError(faults)

        fields = {"noise": "stated_noise", "poisson_xy": "stated_poisson", "density_kg_m3": "stated_density"}
        priors: dict[str, Any] = {
            fields.get(key, key): StatedPrior(
                prior.scaled(100.0) if key == "noise" else prior, source if isinstance(source, str) else source[key]
            )
            for key, prior in stated.items()
        }
        card = cls.model_construct(format=1, name=name, title=title, **priors)
        return validate_card(cls, CardFile(card.table(), f"{name}.toml"), _constant_faults)

    def table(self) -> dict[str, Any]:
        """The table of the card."""
        return self.model_dump(by_alias=True, exclude_defaults=True)

    def to_toml(self, path: str | os.PathLike[str] | None = None, *, force: bool = False) -> str:
        """The prior as a card, in TOML.

        Parameters
        ----------
        path : path, optional
            File to write, NAME.toml; nothing is written without it.
        force : bool
            Replace a file that is there.

        Returns
        -------
        str
            The text of the card.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        text = toml_text(self.table())
        if path is not None:
            write_card(path, self.name, text, force=force)
        return text

    @property
    def stated_constants(self) -> dict[str, StatedPrior]:
        """Name of the constant to its prior and source: all of E_x, E_y, G_xy or all of D_x, D_y, D_s.

        Of a prior of isotropic boards alone E_x, which is their E.
        """
        constants = {name: prior for name in (*MODULI, *RIGIDITIES) if (prior := getattr(self, name)) is not None}
        return constants if constants or self.E is None else {"E_x": self.E}

    @property
    def is_of_isotropic(self) -> bool:
        """Whether it is a prior of isotropic boards alone, which states E and nothing else of the constants."""
        return self.E is not None and not any(getattr(self, name) for name in (*MODULI, *RIGIDITIES))

    def for_board(self, is_isotropic: bool) -> PriorCard | None:
        """The prior as a board takes it: of E alone where that is isotropic; None where it states no such constants."""
        if not is_isotropic:
            return None if self.is_of_isotropic else self
        return None if self.E is None else self.model_copy(update=dict.fromkeys((*MODULI, *RIGIDITIES)))

    @property
    def constants(self) -> dict[str, Quantity]:
        """Name of the constant to its prior, in SI units."""
        return {name: stated.quantity for name, stated in self.stated_constants.items()}

    @property
    def noise_percent(self) -> Quantity | None:
        """Prior of the noise in percent, if the card states one."""
        return self.stated_noise.quantity if self.stated_noise else None

    @property
    def poisson_xy(self) -> Quantity | None:
        """Prior of nu_xy, if the card states one."""
        return self.stated_poisson.quantity if self.stated_poisson else None

    @property
    def density(self) -> Quantity | None:
        """Densities that such boards have, kg m^-3, if the card states them."""
        return self.stated_density.quantity if self.stated_density else None

    @property
    def sources(self) -> dict[str, str]:
        """Name of each stated prior to its source."""
        stated = {
            "noise_percent": self.stated_noise,
            "poisson_xy": self.stated_poisson,
            "density_kg_m3": self.stated_density,
        }
        return {name: prior.source for name, prior in (self.stated_constants | stated).items() if prior}


def load_prior(name_or_path: str | os.PathLike[str], folder: Path | None = None) -> PriorCard:
    """Read a prior card, a shipped one or a path from `folder`; InputError names every fault at once."""
    return validate_card(PriorCard, CardFile.load("priors", name_or_path, folder), _constant_faults)


def _can_be_stated(quantity: object, kinds: tuple[str, ...]) -> bool:
    """Whether a prior card can state a density: of one of these kinds, without bounds but those of its kind."""
    if not isinstance(quantity, Quantity) or quantity.is_exact or quantity.kind not in kinds:
        return False
    return quantity.kind == "log-uniform" or (quantity.lower == -math.inf and quantity.upper == math.inf)


def _source_faults(name: str, source: str | Mapping[str, str], stated: Collection[str]) -> Iterator[Fault]:
    """Faults of sources that are empty, lacking, or of an unknown name."""
    wanted = "where the numbers come from"
    if isinstance(source, str):
        if not source.strip():
            yield Fault(f"{name} source", wanted, "an empty text")
        return
    names = (*_CONSTANTS, "noise", "poisson_xy", "density_kg_m3")
    for key in source:
        if key not in names:
            yield Fault(
                f"{name} source {key}",
                f"one of {', '.join(names)}",
                str(key),
                did_you_mean(str(key), names),
            )
    for key in stated:
        if not isinstance(source.get(key), str) or not source[key].strip():
            yield Fault(f"{name} source {key}", wanted, repr(source.get(key)))


def _constant_faults(table: Mapping[str, Any], file: str) -> list[Fault]:
    """The constants are all moduli, all rigidities, or E alone."""
    names = [name for name in (*MODULI, *RIGIDITIES) if name in table]
    if tuple(names) in (MODULI, RIGIDITIES) or (not names and ISOTROPIC_MODULUS in table):
        return []
    wanted = f"all of {', '.join(MODULI)} or all of {', '.join(RIGIDITIES)}"
    return [Fault(file, wanted, ", ".join(names) or "none of them")]
