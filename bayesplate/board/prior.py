"""The prior card: priors of the elastic constants, or of the rigidities, each with its source."""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator

from bayesplate.board.board_card import LARGEST_POISSON, name_faults
from bayesplate.board.measures import DENSITY, QuantityReader, read_factor, read_noise, read_whole_table
from bayesplate.board.quantity import Quantity
from bayesplate.board.schema import Section, validated
from bayesplate.board.shelf import find
from bayesplate.board.stated import wrong_types
from bayesplate.board.toml import read_file, read_table
from bayesplate.board.values import Choice, Complaint, Number, Refusal, read_format, read_name, read_text
from bayesplate.board.words import did_you_mean, shown
from bayesplate.errors import Fault, InputError, plain

ELASTIC = ("E_x", "E_y", "G_xy")
RIGIDITY = ("D_x", "D_y", "D_s")
OF_ISOTROPIC = "E"
"""The one modulus of an isotropic board, stated beside the three or alone."""


_CONSTANTS = (*ELASTIC, *RIGIDITY, OF_ISOTROPIC)


@dataclass(frozen=True)
class StatedPrior:
    """A prior of a card, in SI units or percent, and the source it was taken from."""

    quantity: Quantity
    source: str


@dataclass(frozen=True)
class _ConstantReader:
    """Reads { distribution, median_gpa, factor, source } or { distribution, lower_gpa, upper_gpa, source }."""

    unit: Literal["gpa", "n_m"]

    def __call__(self, value: object) -> StatedPrior:
        distributions = ("log-normal", "log-uniform")
        if not isinstance(value, dict):
            raise Refusal(Complaint("a table with a distribution", shown(value)))
        if value.get("distribution") not in distributions:
            raise Refusal(_distribution_complaint(value.get("distribution"), distributions))
        si, number = (1e9, Number(1e-6, 1e6, "GPa")) if self.unit == "gpa" else (1.0, Number(1e-9, 1e9, "N m"))
        median, lower, upper = (f"{key}_{self.unit}" for key in ("median", "lower", "upper"))
        common: dict[str, Any] = {"distribution": Choice(distributions), "source": read_text}
        if value["distribution"] == "log-normal":
            read = read_whole_table(value, {**common, median: number, "factor": read_factor})
            return StatedPrior(Quantity.from_median(read[median] * si, read["factor"]), read["source"])
        read = read_whole_table(value, {**common, lower: number, upper: number})
        if not read[lower] < read[upper]:
            both = f"{shown(value[lower])} and {shown(value[upper])}"
            raise Refusal(Complaint(f"{lower} below {upper}", both))
        return StatedPrior(Quantity.from_range(read[lower] * si, read[upper] * si), read["source"])


def _distribution_complaint(value: object, distributions: tuple[str, ...]) -> Complaint:
    try:
        Choice(distributions)(value)
    except Refusal as refusal:
        (one,) = refusal.complaints
        return Complaint(one.wanted, one.got, one.remedy, ("distribution",))
    raise AssertionError("unreachable: the word was refused before")


def _stated(value: object, read: Any) -> StatedPrior:
    """Read a quantity whose table holds its source too."""
    if not isinstance(value, dict):
        raise Refusal(Complaint("a table with a source", shown(value)))
    if "source" not in value:
        raise Refusal(Complaint("where the numbers come from", "nothing", inside=("source",)))
    quantity = read({key: entry for key, entry in value.items() if key != "source"})
    return StatedPrior(quantity, read_text(value["source"]))


_Elastic = Annotated[StatedPrior | None, PlainValidator(_ConstantReader("gpa"))]
_Rigidity = Annotated[StatedPrior | None, PlainValidator(_ConstantReader("n_m"))]
_POISSON = QuantityReader(Number(-LARGEST_POISSON, LARGEST_POISSON), "normal")
_DENSITY = QuantityReader(DENSITY)


class PriorCard(Section):
    """Priors of E_x, E_y, G_xy or of D_x, D_y, D_s, of E for isotropic boards, and optionally the noise and nu_xy.

    `load_prior` makes one.
    """

    format: Annotated[Literal[1], PlainValidator(read_format)] = Field(description="1")
    name: Annotated[str, PlainValidator(read_name)] = Field(description="the name of the file without .toml")
    title: Annotated[str, PlainValidator(read_text)] = ""
    E_x: _Elastic = None
    E_y: _Elastic = None
    G_xy: _Elastic = None
    D_x: _Rigidity = None
    D_y: _Rigidity = None
    D_s: _Rigidity = None
    E: _Elastic = None
    stated_noise: Annotated[StatedPrior | None, PlainValidator(lambda value: _stated(value, read_noise))] = Field(
        default=None, alias="noise_percent"
    )
    stated_poisson: Annotated[StatedPrior | None, PlainValidator(lambda value: _stated(value, _POISSON))] = Field(
        default=None, alias="poisson_xy"
    )
    stated_density: Annotated[StatedPrior | None, PlainValidator(lambda value: _stated(value, _DENSITY))] = Field(
        default=None, alias="density_kg_m3"
    )

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
            kg m^-3; no density is taken from it, but a board of another one is asked about.
        title : str

        Returns
        -------
        PriorCard

        Raises
        ------
        InputError
            With everything that a prior card cannot hold, and its place on the card.
        """
        from bayesplate.board.writing import prior_text

        faults = list(wrong_types(str(name), (
            ("name", name, isinstance(name, str), "a text"),
            ("title", title, isinstance(title, str), "a text"),
            ("constants", constants, isinstance(constants, Mapping), "a dict of quantities by name"),
            ("source", source, isinstance(source, str | Mapping), "a text, or a dict of texts by name"),
        )))  # fmt: skip
        if faults:
            raise InputError(faults)
        if not isinstance(source, str):  # as `sources` has it, for a prior that is made of another one
            source = {"noise" if key == "noise_percent" else key: one for key, one in source.items()}
        faults = [Fault(f"{name} {key}", f"one of {', '.join(_CONSTANTS)}", "an unknown name")
                  for key in constants if key not in _CONSTANTS]  # fmt: skip
        known = "Quantity.from_median or Quantity.from_range, a constant known to some extent"
        for key, quantity, kinds, wanted in (
            *((key, one, ("log-normal", "log-uniform"), known) for key, one in constants.items()),
            ("noise", noise, ("log-normal",), "Quantity.from_median"),
            ("poisson_xy", poisson_xy, ("normal",), 'Quantity.from_mean(0.4, 0.08, "normal")'),
            ("density", density, ("log-normal",), "Quantity.from_mean(430, 60)"),
        ):
            if not (_is_of_a_card(quantity, kinds) or (quantity is None and key not in constants)):
                got = "another kind of quantity" if isinstance(quantity, Quantity) else repr(quantity)
                faults.append(Fault(f"{name} {key}", f"{wanted}, without bounds", got))
        further = {"noise": noise, "poisson_xy": poisson_xy, "density_kg_m3": density}
        stated = {**constants, **{key: one for key, one in further.items() if one is not None}}
        faults += _source_faults(name, source, stated)
        if faults:
            raise InputError(faults)

        fields = {"noise": "stated_noise", "poisson_xy": "stated_poisson", "density_kg_m3": "stated_density"}
        priors: dict[str, Any] = {
            fields.get(key, key): StatedPrior(
                one.scaled(100.0) if key == "noise" else one, source if isinstance(source, str) else source[key]
            )
            for key, one in stated.items()
        }
        return read_prior_text(prior_text(cls.model_construct(format=1, name=name, title=title, **priors)), name)

    def to_card(self, path: str | os.PathLike[str] | None = None, *, force: bool = False) -> str:
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
        from bayesplate.board.writing import prior_text, write_card

        text = prior_text(self)
        if path is not None:
            write_card(path, self.name, text, force=force)
        return text

    @property
    def stated_constants(self) -> dict[str, StatedPrior]:
        """Name of the constant to its prior and source: all of E_x, E_y, G_xy or all of D_x, D_y, D_s.

        Of a prior of isotropic boards alone E_x, which is their E.
        """
        found = {name: stated for name in (*ELASTIC, *RIGIDITY) if (stated := getattr(self, name)) is not None}
        return found if found or self.E is None else {"E_x": self.E}

    @property
    def is_of_isotropic(self) -> bool:
        """Whether it is a prior of isotropic boards alone, which states E and nothing else of the constants."""
        return self.E is not None and not any(getattr(self, name) for name in (*ELASTIC, *RIGIDITY))

    def for_board(self, is_isotropic: bool) -> PriorCard | None:
        """The prior as a board takes it: of E alone where that is isotropic; None where it states no such constants."""
        if not is_isotropic:
            return None if self.is_of_isotropic else self
        return None if self.E is None else self.model_copy(update=dict.fromkeys((*ELASTIC, *RIGIDITY)))

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
        return {name: one.source for name, one in (self.stated_constants | stated).items() if one}


def load_prior(name_or_path: str | os.PathLike[str], beside: Path | None = None) -> PriorCard:
    """Read a prior card.

    Parameters
    ----------
    name_or_path : str or path
        Name of a shipped card, or a path: it contains a separator or ends in .toml.
    beside : Path, optional
        Folder that a relative path starts from: that of the board card which names the prior.

    Raises
    ------
    InputError
        If there is no such card, it cannot be read, or it does not follow the format; lists every such fault at once.
    """
    path = find("priors", name_or_path, beside)
    return _read_prior(read_file(path), plain(path.name), path.stem)


def read_prior_text(text: str, name: str) -> PriorCard:
    """Read a prior card from a text, as if it stood in NAME.toml; raises InputError like `load_prior`."""
    return _read_prior(text.encode("utf-8", "surrogatepass"), f"{plain(name)}.toml", name)


def _read_prior(data: bytes, file: str, stem: str) -> PriorCard:
    table = read_table(data, file)
    return validated(PriorCard, table, file, faults=[*name_faults(table, file, stem), *_set_faults(table, file)])


def _is_of_a_card(quantity: object, kinds: tuple[str, ...]) -> bool:
    """Whether a prior card can state a density: it is of such a kind, and has no bounds but those of its kind."""
    if not isinstance(quantity, Quantity) or quantity.is_exact or quantity.kind not in kinds:
        return False
    return quantity.kind == "log-uniform" or (quantity.lower == -math.inf and quantity.upper == math.inf)


def _source_faults(name: str, source: str | Mapping[str, str], stated: Collection[str]) -> Iterator[Fault]:
    """Sources that are empty or lacking, and those of a name that a prior cannot have."""
    wanted = "where the numbers come from"
    if isinstance(source, str):
        if not source.strip():
            yield Fault(f"{name} source", wanted, "an empty text")
        return
    known = (*_CONSTANTS, "noise", "poisson_xy", "density_kg_m3")
    for key in source:
        if key not in known:
            yield Fault(f"{name} source {key}", f"one of {', '.join(known)}", str(key), did_you_mean(str(key), known))
    for key in stated:
        if not isinstance(source.get(key), str) or not source[key].strip():
            yield Fault(f"{name} source {key}", wanted, repr(source.get(key)))


def _set_faults(table: Mapping[str, Any], file: str) -> list[Fault]:
    """Three priors that belong together, no mixture and no gap; or that of an isotropic board alone."""
    given = [name for name in (*ELASTIC, *RIGIDITY) if name in table]
    if tuple(given) in (ELASTIC, RIGIDITY) or (not given and OF_ISOTROPIC in table):
        return []
    wanted = f"all of {', '.join(ELASTIC)} or all of {', '.join(RIGIDITY)}"
    return [Fault(file, wanted, ", ".join(given) or "none of them")]
