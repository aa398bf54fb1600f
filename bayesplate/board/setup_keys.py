"""The keys of a [setup]: how the edges are held, and the frequencies that were measured that way."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from bayesplate.board.attached import AttachedItem, DeclaredFluid
from bayesplate.board.measures import (
    FIRST_LABEL,
    MOST_MODES,
    MOST_MODES_REASON,
    NOISE,
    PLACE,
    Place,
    QuantityReader,
    table_by_label,
)
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import (
    FREQUENCY,
    NO_OFFSET,
    PROBABILITY,
    PROBABILITY_HINT,
    SIGN,
    SMALLEST_PROBABILITY,
    Peak,
)
from bayesplate.board.repeated import LARGEST_SIZE_RATIO, RULE, peak_comma_complaint
from bayesplate.board.schema import Section
from bayesplate.board.values import (
    CardReference,
    Choice,
    Complaint,
    Key,
    Number,
    Refusal,
    Text,
    read_entries,
    read_items,
    read_list,
    read_name,
    refuse,
)
from bayesplate.board.words import EDGE_WORDS, EDGES, show_value
from bayesplate.labels import Label

MOST_ATTACHED = 50
DEFAULT_SETUP_NAME = "setup"
DEFAULT_MISSED, DEFAULT_SPURIOUS = 0.2, 0.02
"""Probabilities where a card states none: that a mode below the highest peak left no peak, that a peak is no mode."""

_CONFIDENCE = Number(SMALLEST_PROBABILITY, 1, hint=PROBABILITY_HINT).key
_CONFIDENCES = table_by_label(_CONFIDENCE)
_CLAMPED_NUMBER = Number(0.01, 100_000, "mm", "leave the edge out if the clamp covers nothing")
_CLAMPED_LENGTH = QuantityReader(_CLAMPED_NUMBER, furthest=LARGEST_SIZE_RATIO, resolution=RULE).key
_BOUNCE = QuantityReader(Number(0.01, 1000, "Hz"), furthest=LARGEST_SIZE_RATIO).key
_EDGE_WANTED = 'a word for each of the four edges x0, x1, y0, y1: "clamped", "supported" or "free"'

EdgeCondition = Literal["clamped", "supported", "free"]
EdgeConditionField = Annotated[EdgeCondition, Key(Choice(EDGE_WORDS))]


class Edges(Section):
    """How the four edges are held; x0 is the edge at x = 0."""

    x0: EdgeConditionField = Field(description=_EDGE_WANTED)
    x1: EdgeConditionField = Field(description=_EDGE_WANTED)
    y0: EdgeConditionField = Field(description=_EDGE_WANTED)
    y1: EdgeConditionField = Field(description=_EDGE_WANTED)

    @property
    def words(self) -> dict[str, EdgeCondition]:
        """Edge name to word, in the order x0, x1, y0, y1."""
        return dict(self)


def edge_letters(end_conditions: Mapping[str, str]) -> str:
    """The paper's four letters, "CFFF", in its order x0, y0, x1, y1, from the words of the four edges."""
    return "".join(end_conditions[edge][0].upper() for edge in ("x0", "y0", "x1", "y1"))


def edge_words(text: object) -> dict[str, EdgeCondition] | None:
    """All four edges from one word, or from four letters in the paper's order x0, y0, x1, y1; None from other texts."""
    letters: dict[str, EdgeCondition] = {"C": "clamped", "S": "supported", "F": "free"}
    for word in letters.values():
        if text == word:
            return dict.fromkeys(EDGES, word)
    if not (isinstance(text, str) and len(text) == len(EDGES) and {*text} <= {*letters}):
        return None
    x0, y0, x1, y1 = (letters[letter] for letter in text)
    return {"x0": x0, "x1": x1, "y0": y0, "y1": y1}


def _check_edges_table(value: object) -> object:
    """Refuse a word in place of the table of edges, with the table that it may mean as the remedy."""
    if isinstance(value, dict):
        return value
    words = edge_words(value)
    table = ", ".join(f'{edge} = "{word}"' for edge, word in (words or {}).items())
    raise Refusal(
        Complaint("a table", show_value(value), f"edges = {{ {table} }}" if words else "x0 is the edge at x = 0")
    )


class HammerKeys(Section):
    """Where the hammer hit."""

    place: Annotated[Place, PLACE] = Field(alias="at_mm", description="the place [x, y] in mm")


class SupportKeys(Section):
    """What the record says of the support of a free board."""

    bounce: Annotated[Quantity | None, _BOUNCE] = Field(default=None, alias="bounce_hz")


def _read_setup_name(value: object) -> str:
    name = read_name(value)
    if name.casefold() == "board":
        raise Refusal(Complaint("another name", '"board"', "results use it for the board's own effects"))
    return name


def _read_unlabelled(value: object) -> tuple[Quantity, ...]:
    if value == []:
        return ()
    items = read_list(value, "frequencies", MOST_MODES, MOST_MODES_REASON)
    refuse(peak_comma_complaint(items))
    return tuple(read_items(enumerate(items), FREQUENCY.read))


def _read_clamped(value: object) -> dict[str, Quantity]:
    if not isinstance(value, dict):
        raise Refusal(Complaint("a table of clamped edges, { x0 = 30 }", show_value(value)))
    return read_entries(value, dict.fromkeys(EDGES, _CLAMPED_LENGTH.read))


_CLAMPED_LENGTHS = Key(
    _read_clamped, lambda lengths: {edge: _CLAMPED_LENGTH.write(length) for edge, length in lengths.items()}
)
_UNLABELLED = Key(_read_unlabelled, lambda frequencies: [FREQUENCY.write(frequency) for frequency in frequencies])
_CONFIDENCE_OR_TABLE = Key(
    lambda value: _CONFIDENCES.read(value) if isinstance(value, dict) else _CONFIDENCE.read(value),
    lambda confidence: _CONFIDENCES.write(confidence) if isinstance(confidence, Mapping) else confidence,
)


class SetupKeys(Section):
    """A [setup] of a board card, in SI units, keyed by label or by edge, never by position."""

    name: Annotated[str, Key(_read_setup_name)] = DEFAULT_SETUP_NAME
    notes: Text = ""
    edges: Annotated[Edges, BeforeValidator(_check_edges_table)] = Field(description=_EDGE_WANTED)
    clamped: Annotated[Mapping[str, Quantity], _CLAMPED_LENGTHS] = Field(default={}, alias="clamped_mm")
    first_label: Annotated[Label, FIRST_LABEL] = NO_OFFSET
    resolution: Annotated[float, Number(1e-6, 1000, "Hz").key] = Field(default=0.0, alias="resolution_hz")
    published_coefficients: CardReference = ""
    noise: Annotated[Quantity | None, NOISE] = Field(default=None, alias="noise_percent")
    unlabelled: Annotated[tuple[Quantity, ...], _UNLABELLED] = Field(default=(), alias="unlabelled_hz")
    peaks: tuple[Peak, ...] = Field(default=(), max_length=MOST_MODES)
    missed: Annotated[float, PROBABILITY] = Field(default=DEFAULT_MISSED, alias="missed_probability")
    spurious: Annotated[float, PROBABILITY] = Field(default=DEFAULT_SPURIOUS, alias="spurious_probability")
    frequencies: Annotated[Mapping[Label, Quantity], table_by_label(FREQUENCY)] = Field(
        default={}, alias="frequencies_hz"
    )
    signs: Annotated[Mapping[Label, str], table_by_label(SIGN)] = {}
    label_confidence: Annotated[float | Mapping[Label, float], _CONFIDENCE_OR_TABLE] = 1.0
    attached: tuple[AttachedItem, ...] = Field(default=(), max_length=MOST_ATTACHED)
    hammer: HammerKeys | None = None
    support: SupportKeys | None = None
    fluid: DeclaredFluid | None = None
    air: DeclaredFluid | None = None

    @model_validator(mode="before")
    @classmethod
    def _always_has_frequencies(cls, table: Any) -> Any:
        """Missing frequencies are a fault of their key, like an empty table."""
        return {"frequencies_hz": {}, **table} if isinstance(table, dict) else table

    def confidence_in(self, label: Label) -> float:
        """Probability that a label is right."""
        stated = self.label_confidence
        return stated.get(label, 1.0) if isinstance(stated, Mapping) else stated

    # The validators below compare two keys. info.data holds the earlier keys that are valid, so that the fault of one
    # key never causes another fault.

    @field_validator("clamped")
    @classmethod
    def _names_clamped_edges(cls, value: Mapping[str, Quantity], info: ValidationInfo) -> Mapping[str, Quantity]:
        edges = info.data.get("edges")
        if edges is not None:
            unclamped = [edge for edge in value if edges.words[edge] != "clamped"]
            if unclamped:
                raise Refusal(
                    *(Complaint("a clamped edge", f"a {edges.words[edge]} one", path=(edge,)) for edge in unclamped)
                )
        return value

    @field_validator("air")
    @classmethod
    def _is_no_second_fluid(cls, value: DeclaredFluid | None, info: ValidationInfo) -> DeclaredFluid | None:
        if info.data.get("fluid") is not None:
            raise Refusal(Complaint("[setup.fluid] alone, which means the same", "both", "leave [setup.air] out"))
        return value

    @field_validator("peaks")
    @classmethod
    def _stands_once(cls, value: tuple[Peak, ...]) -> tuple[Peak, ...]:
        firsts = [(i, value.index(peak)) for i, peak in enumerate(value)]
        wanted, remedy = "a peak of its own", "repeated readings of one peak are a list: hz = [.., ..]"
        complaints = [Complaint(wanted, f"peak {first + 1} again", remedy, (i,)) for i, first in firsts if first < i]
        if complaints:
            raise Refusal(*complaints)
        return value

    @field_validator("frequencies")
    @classmethod
    def _holds_a_frequency(cls, value: Mapping[Label, Quantity], info: ValidationInfo) -> Mapping[Label, Quantity]:
        may_lack = (info.context or {}).get("may_lack_frequencies", False)
        peaks = [info.data.get(key) for key in ("unlabelled", "peaks")]
        if not value and peaks == [(), ()] and not may_lack:
            raise Refusal(Complaint('measured frequencies, "(1,0)" = 52', "no modes"))
        return value

    @field_validator("signs", "label_confidence")
    @classmethod
    def _have_a_frequency(cls, value: Any, info: ValidationInfo) -> Any:
        frequencies: Mapping[Label, Any] | None = info.data.get("frequencies")
        if frequencies is not None and isinstance(value, Mapping):
            stray = [str(label) for label in value if label not in frequencies]
            if stray:
                wanted = "a label among the frequencies_hz"
                raise Refusal(*(Complaint(wanted, text, path=(text,)) for text in stray))
        return value
