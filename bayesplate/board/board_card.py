"""The board card: what lies on the bench, what is known about its material, and its setups."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainValidator, PrivateAttr

from bayesplate.board.fragment import merged
from bayesplate.board.measures import DENSITY, QuantityReader
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import CALIPER, FEELER, FURTHEST_SIZES, RULE, SCALES
from bayesplate.board.schema import Section, place, validated
from bayesplate.board.setup_card import SetupSection
from bayesplate.board.shelf import CAMPAIGN_REMEDY, find
from bayesplate.board.toml import read_file
from bayesplate.board.toml import read_table as read_toml
from bayesplate.board.values import (
    Complaint,
    Number,
    Refusal,
    read_effects,
    read_format,
    read_list,
    read_name,
    read_reference,
    read_switch,
    read_table,
    read_text,
)
from bayesplate.board.words import name_complaint, quoted, shown
from bayesplate.errors import Fault, InputError, plain

DEFAULT_PRIOR = "weakly-informative"
DEFAULT_POISSON = Quantity.from_mean(0.4, 0.08, "normal")
ISOTROPIC_POISSON = Quantity.from_mean(0.3, 0.06, "normal")
"""Of an isotropic board: foams and glass lie near 0.2, most metals near 0.3, acrylic near 0.37."""
LARGEST_POISSON = 1.5
ISOTROPIC_RANGE = (-1.0, 0.5)
"""Between which the Poisson ratio of a solid that is alike in all directions lies."""
MOST_SETUPS = 20
EffectNames = Annotated[tuple[str, ...], PlainValidator(read_effects)]
"""Effects that a card declares."""
_LENGTH = Number(1, 100_000, "mm", too_small="in mm: 1 m is 1000 mm, 1 cm is 10 mm")
_THICKNESS = Number(0.01, 1000, "mm")
_MASS = Number(1e-3, 1e8, "g")
_SIZE = partial(QuantityReader, furthest=FURTHEST_SIZES)
_LENGTH_X = _SIZE(_LENGTH, places=("at_y_mm",), resolution=RULE)
_LENGTH_Y = _SIZE(_LENGTH, places=("at_x_mm",), resolution=RULE)
_THICKNESSES = _SIZE(_THICKNESS, places=("at_x_mm", "at_y_mm"), resolution=CALIPER)
_OVER = "seen from below every warp has the other sign, and turning the board over changes nothing"
_WARPS: dict[str, Callable[[object], Any]] = {
    name: QuantityReader(
        Number(low, 1000, "mm", hint), "normal", resolution=FEELER, widest=1000, lower=0.0 if low == 0 else -math.inf
    )
    for name, low, hint in (("cup", 0, _OVER), ("bow", -1000, ""), ("twist", 0, _OVER))
}
_SHEAR = QuantityReader(Number(1e-4, 1000, "GPa"))


def _read_warp(value: object) -> dict[str, Quantity]:
    """The rise across the width, along the length and of a corner, as a straightedge tells them."""
    if not isinstance(value, dict):
        raise Refusal(Complaint("a table of cup, bow and twist, { cup = 0.8 }", shown(value)))
    return read_table(value, _WARPS)


class PlateSection(Section):
    """The whole board before clamping: lengths in mm; its mass in g or its density in kg/m3, one of the two.

    Its warp is what a straightedge tells, in mm: `cup` is the rise across the width, `bow` that along the length, of
    the cup's sign on a dome and negative on a saddle, `twist` a corner's lift off a table that the other three touch.
    """

    length_x_mm: Annotated[Quantity, PlainValidator(_LENGTH_X)] = Field(description="the length along the grain in mm")
    length_y_mm: Annotated[Quantity, PlainValidator(_LENGTH_Y)] = Field(description="the length across the grain in mm")
    thickness_mm: Annotated[Quantity, PlainValidator(_THICKNESSES)] = Field(description="the thickness in mm")
    mass_g: Annotated[Quantity | None, PlainValidator(_SIZE(_MASS, resolution=SCALES))] = None
    density_kg_m3: Annotated[Quantity | None, PlainValidator(_SIZE(DENSITY))] = None
    warp_mm: Annotated[Mapping[str, Quantity], PlainValidator(_read_warp)] = Field(default_factory=dict)


class MaterialSection(Section):
    """What is known of the material: nu_xy, thick-plate shear moduli in GPa, and the prior card of the constants.

    An isotropic one has E_y = E_x, and G_xy = E_x / (2 (1 + nu_xy)).
    """

    poisson_xy: Annotated[
        Quantity, PlainValidator(QuantityReader(Number(-LARGEST_POISSON, LARGEST_POISSON), "normal"))
    ] = DEFAULT_POISSON
    shear_xz_gpa: Annotated[Quantity | None, PlainValidator(_SHEAR)] = None
    shear_yz_gpa: Annotated[Quantity | None, PlainValidator(_SHEAR)] = None
    isotropic: Annotated[bool, PlainValidator(read_switch)] = False
    prior: Annotated[str, PlainValidator(read_reference)] = DEFAULT_PRIOR

    @property
    def poisson_is_default(self) -> bool:
        """Whether the card gives no Poisson ratio, so that the default stands in its place."""
        return "poisson_xy" not in self.model_fields_set

    @property
    def usual_poisson(self) -> Quantity:
        """The Poisson ratio that stands where neither the card nor its prior gives one."""
        return usual_poisson(self.isotropic)


def usual_poisson(is_isotropic: bool) -> Quantity:
    """The Poisson ratio of a board of which nothing is known: of wood, or of an isotropic material."""
    return ISOTROPIC_POISSON if is_isotropic else DEFAULT_POISSON


def _as_list(value: object) -> list[Any]:
    """One [setup] is a list of one; the tables themselves are read by SetupSection."""
    if isinstance(value, dict):
        return [value]
    return read_list(value, "[[setup]] tables", MOST_SETUPS)


class BoardCard(Section):
    """A board and what was measured on it; values stay in the units of their keys.

    `load_board` and `read_board_text` make one.
    """

    format: Annotated[Literal[1], PlainValidator(read_format)] = Field(description="1")
    name: Annotated[str, PlainValidator(read_name)] = Field(description="the name of the file without .toml")
    title: Annotated[str, PlainValidator(read_text)] = ""
    source: Annotated[str, PlainValidator(read_text)] = ""
    notes: Annotated[str, PlainValidator(read_text)] = ""
    effects: EffectNames = ()
    plate: PlateSection = Field(description="a [plate] table")
    material: MaterialSection = MaterialSection()
    setups: Annotated[tuple[SetupSection, ...], BeforeValidator(_as_list)] = Field(
        alias="setup", description="a [setup] table, or several [[setup]]"
    )
    _written: Mapping[str, Any] = PrivateAttr({})
    _folder: Path | None = PrivateAttr(None)
    _file: str = PrivateAttr("")
    _sha256: str = PrivateAttr("")
    _text: str = PrivateAttr("")

    def model_post_init(self, context: Any) -> None:
        """Keep where the card comes from."""
        self._written = (context or {}).get("written", {})
        self._folder = (context or {}).get("folder")
        self._file = (context or {}).get("file", "")
        self._sha256 = (context or {}).get("sha256", "")
        self._text = (context or {}).get("text", "")

    @property
    def written(self) -> Mapping[str, Any]:
        """The table that the card's file holds: what was stated, before anything was assumed."""
        return self._written

    @property
    def path(self) -> Path | None:
        """The card's file; None if it was read from a text."""
        return None if self._folder is None else self._folder / self._file

    @property
    def folder(self) -> Path | None:
        """Where cards that it names by a relative path are looked for; None for the working directory."""
        return self._folder

    @property
    def file(self) -> str:
        """The name of its file, as messages show it."""
        return plain(self._file) or f"{self.name}.toml"

    @property
    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes."""
        return self._sha256

    @property
    def text(self) -> str:
        """The file as it was read: in UTF-8 it is the bytes that `sha256` is of, whatever the file holds by now."""
        return self._text

    def setup(self, name: str) -> SetupSection:
        """The setup of a name."""
        return next(setup for setup in self.setups if setup.name == name)


def load_board(
    name_or_path: str | os.PathLike[str],
    *,
    may_lack_frequencies: bool = False,
    setup: str | os.PathLike[str] | None = None,
) -> BoardCard:
    """Read a board card.

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
    BoardCard

    Raises
    ------
    InputError
        If there is no such card, it cannot be read, or it does not follow the format; lists every such fault at once.
    """
    path = find("boards", name_or_path)
    return _read_board(read_file(path), path.name, path.stem, path.parent, may_lack_frequencies, setup)


def load_board_in(folder: Path, file: str) -> BoardCard:
    """Read a board card of a folder; raises InputError like `load_board`.

    It makes no path of the file's name: Python's table of the names in paths would grow with the cards that are read.
    """
    return _read_board(read_file(os.path.join(folder, file)), file, os.path.splitext(file)[0], folder)


def read_board_text(
    text: str,
    name: str,
    *,
    may_lack_frequencies: bool = False,
    setup: str | os.PathLike[str] | None = None,
    beside: Path | None = None,
) -> BoardCard:
    """Read a board card from a text, as if it stood in NAME.toml; raises InputError like `load_board`.

    The cards that it names by a relative path are looked for in the folder `beside`, by default the working directory.
    """
    stem = name.removesuffix(".toml")
    data = text.encode("utf-8", "surrogatepass")
    return _read_board(data, f"{plain(stem)}.toml", stem, beside, may_lack_frequencies, setup)


def _read_board(
    data: bytes,
    file: str,
    stem: str,
    folder: Path | None,
    may_lack_frequencies: bool = False,
    setup: str | os.PathLike[str] | None = None,
) -> BoardCard:
    own, file = file, plain(file)
    table = read_toml(data, file)
    if {*table} == {"setup"} and isinstance(table["setup"], dict):
        remedy = f"it completes a card: CARD --setup {file}"
        raise InputError(Fault(file, "a card, which has a [plate]", "a [setup] alone, as pick writes it", remedy))
    if "boards" in table and not {"plate", "setup"} & table.keys():
        raise InputError(Fault(file, "a board card", "a campaign", CAMPAIGN_REMEDY))
    if setup is not None:
        together, file = merged(table, file, setup)
        data = together.encode("utf-8", "surrogatepass")
        table = read_toml(data, file)
    faults = [*name_faults(table, file, stem), *_mass_faults(table, file), *_setup_name_faults(table, file)]
    context = {
        "written": table,
        "folder": folder,
        "file": own,
        "sha256": hashlib.sha256(data).hexdigest(),
        "text": data.decode("utf-8"),
        "may_lack_frequencies": may_lack_frequencies,
    }
    return validated(BoardCard, table, file, context, faults)


# These compare keys with one another or with the file. They look at the raw table, so that they are reported
# together with the faults of single keys.


def name_faults(table: Mapping[str, Any], file: str, stem: str) -> list[Fault]:
    """The name of a card must be the name of its file."""
    name = table.get("name")
    if not isinstance(name, str) or name == stem:
        return []
    complaint = name_complaint(stem)
    if complaint:
        remedy = "rename the file" + ("" if name_complaint(name) else f" to {name}.toml")
        return [Fault(file, complaint, quoted(stem), remedy)]
    return [Fault(f"{file} name", f"{quoted(stem)}, the name of the file", quoted(name))]


def _mass_faults(table: Mapping[str, Any], file: str) -> list[Fault]:
    plate = table.get("plate")
    if not isinstance(plate, dict):
        return []
    given = [key for key in ("mass_g", "density_kg_m3") if key in plate]
    if len(given) == 1:
        return []
    got = f"both, {shown(plate['mass_g'])} and {shown(plate['density_kg_m3'])}" if given else "neither"
    return [Fault(place(file, table, ("plate",)), "exactly one of mass_g and density_kg_m3", got)]


def _setup_name_faults(table: Mapping[str, Any], file: str) -> list[Fault]:
    setups = table.get("setup")
    if not isinstance(setups, list) or len(setups) < 2 or len(setups) > MOST_SETUPS:
        return []
    faults = []
    seen: set[str] = set()
    for index, setup in enumerate(setups):
        if not isinstance(setup, dict):
            continue
        name = setup.get("name")
        where = place(file, table, ("setup", index, "name"))
        if name is None:
            faults.append(Fault(where, "a name, because there are several setups", "nothing"))
        elif isinstance(name, str) and name.casefold() in seen:
            faults.append(Fault(where, "a name of its own", f"{quoted(name)} again"))
        seen.add(str(name).casefold())
    return faults
