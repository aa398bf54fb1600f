"""One setup of a board: how its edges are held, and the frequencies that were measured that way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainValidator, ValidationInfo, field_validator

from bayesplate.board.measures import (
    MOST_MODES,
    WHY_MOST_MODES,
    Place,
    QuantityReader,
    read_by_label,
    read_first_label,
    read_noise,
    read_place,
    read_places,
)
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import FINE_SCALES, FURTHEST_FREQUENCIES, FURTHEST_SIZES, RULE, peak_comma_complaint
from bayesplate.board.schema import Section
from bayesplate.board.values import (
    Choice,
    Complaint,
    Number,
    Refusal,
    read_each,
    read_list,
    read_name,
    read_reference,
    read_text,
    refuse,
)
from bayesplate.board.values import read_table as read_entries
from bayesplate.board.words import ATTACHED_KINDS, BAFFLES, EDGE_NAMES, EDGE_WORDS, MAGNETS, quoted, shown
from bayesplate.labels import Label

MOST_ATTACHED = 50
DEFAULT_SETUP_NAME = "setup"
MISSED, SPURIOUS = 0.2, 0.02
"""Probabilities where a card states none: that a mode below the highest peak left no peak, that a peak is no mode."""

_KILOHERTZ = "in Hz: 1 kHz is 1000 Hz"
_HERTZ = Number(0.1, 1e6, "Hz", "in Hz; the zero-frequency modes of a free board are not listed", _KILOHERTZ)
_FREQUENCY = QuantityReader(_HERTZ, furthest=FURTHEST_FREQUENCIES)
_OPEN, _PROBABILITY = 1e-9, "a probability: 98 % is 0.98"
_CONFIDENCE = Number(_OPEN, 1, hint=_PROBABILITY)
_CHANCE = Number(_OPEN, 1 - _OPEN, hint=_PROBABILITY)
_CLAMPED = Number(0.01, 100_000, "mm", "leave the edge out if the clamp covers nothing")
_CLAMPED_LENGTH = QuantityReader(_CLAMPED, furthest=FURTHEST_SIZES, resolution=RULE)
_ATTACHED_MASS = QuantityReader(Number(1e-4, 1e6, "g"), furthest=FURTHEST_SIZES, resolution=FINE_SCALES)
_COIL_MASS = QuantityReader(Number(1e-4, 1e6, "g"), furthest=FURTHEST_SIZES, resolution=FINE_SCALES)
_SUSPENSION = QuantityReader(Number(0.1, 1e8, "N/m", "1 N/mm is 1000 N/m"), furthest=FURTHEST_SIZES)
_RESONANCE = QuantityReader(Number(0.1, 10_000, "Hz"), furthest=FURTHEST_FREQUENCIES)
_BOUNCE = QuantityReader(Number(0.01, 1000, "Hz"), furthest=FURTHEST_SIZES)
_FLUID_DENSITY = QuantityReader(Number(1e-6, 2000, "kg/m3", "air at the ground is 1.2 kg/m3, water is 997"))
_SIGN = Choice(("+", "-"))
_EDGE_WANTED = 'a word for each of the four edges x0, x1, y0, y1: "clamped", "supported" or "free"'

EdgeWord = Literal["clamped", "supported", "free"]
ReadEdge = Annotated[EdgeWord, PlainValidator(Choice(EDGE_WORDS))]


class Edges(Section):
    """How the four edges are held; x0 is the edge at x = 0."""

    x0: ReadEdge = Field(description=_EDGE_WANTED)
    x1: ReadEdge = Field(description=_EDGE_WANTED)
    y0: ReadEdge = Field(description=_EDGE_WANTED)
    y1: ReadEdge = Field(description=_EDGE_WANTED)

    @property
    def words(self) -> dict[str, EdgeWord]:
        """Edge name to word, in the order x0, x1, y0, y1."""
        return {"x0": self.x0, "x1": self.x1, "y0": self.y0, "y1": self.y1}

    @property
    def letters(self) -> str:
        """The paper's four letters, "CFFF", in its order x0, y0, x1, y1."""
        return edge_letters(self.words)


def edge_letters(words: Mapping[str, str]) -> str:
    """The paper's four letters, "CFFF", in its order x0, y0, x1, y1, from the words of the four edges."""
    return "".join(words[edge][0].upper() for edge in ("x0", "y0", "x1", "y1"))


def edge_words(text: object) -> dict[str, EdgeWord] | None:
    """All four edges from one word, or from four letters in the paper's order x0, y0, x1, y1; None from other texts."""
    letters: dict[str, EdgeWord] = {"C": "clamped", "S": "supported", "F": "free"}
    for word in letters.values():
        if text == word:
            return dict.fromkeys(EDGE_NAMES, word)
    if not (isinstance(text, str) and len(text) == len(EDGE_NAMES) and {*text} <= {*letters}):
        return None
    x0, y0, x1, y1 = (letters[letter] for letter in text)
    return {"x0": x0, "x1": x1, "y0": y0, "y1": y1}


def _edges_table(value: object) -> object:
    """Refuse a word where the table of the edges stands, and write out the table that it may mean."""
    if isinstance(value, dict):
        return value
    words = edge_words(value)
    table = ", ".join(f'{edge} = "{word}"' for edge, word in (words or {}).items())
    raise Refusal(Complaint("a table", shown(value), f"edges = {{ {table} }}" if words else "x0 is the edge at x = 0"))


class AttachedItem(Section):
    """A thing fixed to the board: declared if it has a mass, otherwise a candidate at its place, or anywhere.

    An exciter is a coil on the board and a magnet on a spring; its mass is that of both.
    """

    kind: Annotated[Literal["accelerometer", "exciter", "shaker", "weight"], PlainValidator(Choice(ATTACHED_KINDS))] = (
        Field(description="what it is")
    )
    mass_g: Annotated[Quantity | None, PlainValidator(_ATTACHED_MASS)] = None
    at_mm: Annotated[tuple[Place, ...], PlainValidator(read_places)] = Field(
        default=(), description="its place [x, y] in mm from the corner of the edges x0 and y0"
    )
    coil_mass_g: Annotated[Quantity | None, PlainValidator(_COIL_MASS)] = None
    suspension_n_per_m: Annotated[Quantity | None, PlainValidator(_SUSPENSION)] = None
    resonance_hz: Annotated[Quantity | None, PlainValidator(_RESONANCE)] = None
    magnet: Annotated[Literal["free", "held"], PlainValidator(Choice(MAGNETS))] = "free"

    @field_validator("coil_mass_g", "suspension_n_per_m", "resonance_hz", "magnet")
    @classmethod
    def _is_of_an_exciter(cls, value: Any, info: ValidationInfo) -> Any:
        kind = info.data.get("kind", "exciter")
        if kind != "exciter":
            remedy = 'leave it out, or kind = "exciter" if it drives the board by a coil'
            raise Refusal(Complaint("it on an exciter only", f"a thing of kind {quoted(kind)}", remedy))
        return value

    @field_validator("resonance_hz")
    @classmethod
    def _is_stated_once(cls, value: Quantity | None, info: ValidationInfo) -> Quantity | None:
        if info.data.get("suspension_n_per_m") is not None:
            remedy = "each gives the other with the magnet's mass"
            raise Refusal(Complaint("one of suspension_n_per_m and resonance_hz", "both", remedy))
        return value


class PeakSection(Section):
    """A peak without a label: its frequency, and what else was read there."""

    hz: Annotated[Quantity, PlainValidator(_FREQUENCY)] = Field(description="its frequency in Hz")
    sign: Annotated[str, PlainValidator(_SIGN)] = ""
    amplitude: Annotated[float | None, PlainValidator(Number(1e-12, 1e12))] = None
    damping_percent: Annotated[
        float | None, PlainValidator(Number(1e-6, 100, "%", "the damping ratio in percent: half the loss factor"))
    ] = None


class HammerSection(Section):
    """Where the hammer hit."""

    at_mm: Annotated[Place, PlainValidator(read_place)] = Field(description="the place [x, y] in mm")


class FluidSection(Section):
    """The air or the water around the board; a value that is absent keeps the effect's own prior."""

    density_kg_m3: Annotated[Quantity | None, PlainValidator(_FLUID_DENSITY)] = None
    baffle: Annotated[Literal["none", "full"] | None, PlainValidator(Choice(BAFFLES))] = None


class SupportSection(Section):
    """What the record says of the support of a free board."""

    bounce_hz: Annotated[Quantity | None, PlainValidator(_BOUNCE)] = None


def _read_setup_name(value: object) -> str:
    name = read_name(value)
    if name.casefold() == "board":
        raise Refusal(Complaint("another name", '"board"', "results use it for the board's own effects"))
    return name


def _read_unlabelled(value: object) -> tuple[Quantity, ...]:
    if value == []:
        return ()
    items = read_list(value, "frequencies", MOST_MODES, WHY_MOST_MODES)
    refuse(peak_comma_complaint(items))
    return tuple(read_each(enumerate(items), _FREQUENCY))


def _read_frequencies(value: object) -> dict[Label, Quantity]:
    return read_by_label(value, _FREQUENCY)


def _read_signs(value: object) -> dict[Label, str]:
    return read_by_label(value, _SIGN)


def _read_confidence(value: object) -> float | Mapping[Label, float]:
    return read_by_label(value, _CONFIDENCE) if isinstance(value, dict) else _CONFIDENCE(value)


def _read_clamped(value: object) -> dict[str, Quantity]:
    if not isinstance(value, dict):
        raise Refusal(Complaint("a table of clamped edges, { x0 = 30 }", shown(value)))
    return read_entries(value, dict.fromkeys(EDGE_NAMES, _CLAMPED_LENGTH))


class SetupSection(Section):
    """A [setup] of a board card. Frequencies are in Hz, lengths in mm, keyed by label or by edge, never by position."""

    name: Annotated[str, PlainValidator(_read_setup_name)] = DEFAULT_SETUP_NAME
    notes: Annotated[str, PlainValidator(read_text)] = ""
    edges: Annotated[Edges, BeforeValidator(_edges_table)] = Field(description=_EDGE_WANTED)
    clamped_mm: Annotated[Mapping[str, Quantity], PlainValidator(_read_clamped)] = Field(default_factory=dict)
    first_label: Annotated[Label, PlainValidator(read_first_label)] = Label(0, 0)
    resolution_hz: Annotated[float | None, PlainValidator(Number(1e-6, 1000, "Hz"))] = None
    published_coefficients: Annotated[str | None, PlainValidator(read_reference)] = None
    noise_percent: Annotated[Quantity | None, PlainValidator(read_noise)] = None
    unlabelled_hz: Annotated[tuple[Quantity, ...], PlainValidator(_read_unlabelled)] = ()
    peaks: tuple[PeakSection, ...] = Field(default=(), max_length=MOST_MODES)
    missed_probability: Annotated[float, PlainValidator(_CHANCE)] = MISSED
    spurious_probability: Annotated[float, PlainValidator(_CHANCE)] = SPURIOUS
    frequencies_hz: Annotated[Mapping[Label, Quantity], PlainValidator(_read_frequencies)] = Field(
        default_factory=dict, validate_default=True
    )
    signs: Annotated[Mapping[Label, str], PlainValidator(_read_signs)] = Field(default_factory=dict)
    label_confidence: Annotated[float | Mapping[Label, float], PlainValidator(_read_confidence)] = 1.0
    attached: tuple[AttachedItem, ...] = Field(default=(), max_length=MOST_ATTACHED)
    hammer: HammerSection | None = None
    support: SupportSection | None = None
    fluid: FluidSection | None = None
    air: FluidSection | None = None

    @property
    def surroundings(self) -> FluidSection | None:
        """What stands in [setup.fluid], or in [setup.air], which means the same."""
        return self.air if self.fluid is None else self.fluid

    def confidence_in(self, label: Label) -> float:
        """Probability that a label is right."""
        stated = self.label_confidence
        return stated.get(label, 1.0) if isinstance(stated, Mapping) else stated

    # These compare two keys. They read info.data, which holds the earlier keys that were themselves in order, so that
    # they complain beside the faults of other keys and never because of one.

    @field_validator("clamped_mm")
    @classmethod
    def _names_clamped_edges(cls, value: Mapping[str, Quantity], info: ValidationInfo) -> Mapping[str, Quantity]:
        edges = info.data.get("edges")
        if edges is not None:
            loose = [edge for edge in value if edges.words[edge] != "clamped"]
            if loose:
                raise Refusal(*(Complaint("a clamped edge", f"a {edges.words[e]} one", inside=(e,)) for e in loose))
        return value

    @field_validator("air")
    @classmethod
    def _is_no_second_fluid(cls, value: FluidSection | None, info: ValidationInfo) -> FluidSection | None:
        if info.data.get("fluid") is not None:
            raise Refusal(Complaint("[setup.fluid] alone, which means the same", "both", "leave [setup.air] out"))
        return value

    @field_validator("peaks")
    @classmethod
    def _stands_once(cls, value: tuple[PeakSection, ...]) -> tuple[PeakSection, ...]:
        firsts = [(i, value.index(peak)) for i, peak in enumerate(value)]
        wanted, remedy = "a peak of its own", "repeated readings of one peak are a list: hz = [.., ..]"
        again = [Complaint(wanted, f"peak {first + 1} again", remedy, (i,)) for i, first in firsts if first < i]
        if again:
            raise Refusal(*again)
        return value

    @field_validator("frequencies_hz")
    @classmethod
    def _holds_a_frequency(cls, value: Mapping[Label, Quantity], info: ValidationInfo) -> Mapping[Label, Quantity]:
        may_lack = (info.context or {}).get("may_lack_frequencies", False)
        peaks = [info.data.get(key) for key in ("unlabelled_hz", "peaks")]
        if not value and peaks == [(), ()] and not may_lack:
            raise Refusal(Complaint('measured frequencies, "(1,0)" = 52', "no modes"))
        return value

    @field_validator("signs", "label_confidence")
    @classmethod
    def _have_a_frequency(cls, value: Any, info: ValidationInfo) -> Any:
        frequencies: Mapping[Label, Any] | None = info.data.get("frequencies_hz")
        if frequencies is not None and isinstance(value, Mapping):
            stray = [str(label) for label in value if label not in frequencies]
            if stray:
                wanted = "a label among the frequencies_hz"
                raise Refusal(*(Complaint(wanted, text, inside=(text,)) for text in stray))
        return value
