"""One setup: how the board is held, and what was read there; SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bayesplate.board.attached import AttachedItem, DeclaredFluid
from bayesplate.board.coefficients import CoefficientCard
from bayesplate.board.parameter import Owner, Parameter, parameter_name
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity, is_number
from bayesplate.board.reading import FREQUENCY, NO_OFFSET, Peak, Reading, label_text
from bayesplate.board.setup_keys import (
    DEFAULT_MISSED,
    DEFAULT_SPURIOUS,
    EdgeCondition,
    Edges,
    HammerKeys,
    SetupKeys,
    SupportKeys,
)
from bayesplate.board.stated import are_instances, is_place, quantities_of, quantity_of, type_faults
from bayesplate.board.words import EDGE_WORDS, EDGES, show_value
from bayesplate.errors import Fault, InputError
from bayesplate.labels import Label

EdgeConditions = tuple[EdgeCondition, EdgeCondition]
DEFAULT_NOISE = Quantity.from_median(0.003, np.exp(0.5))
CLAMPED_NOISE = Quantity.from_median(0.008, np.exp(0.5))
"""Relative noise of a frequency: free boards settle at 0.24-0.30 %; re-clamping one board spreads it by 1-2.4 %."""
_FIELDS_AS_STATED = ("name", "clamped", "first_label", "resolution", "missed", "spurious", "attached")
"""Fields that a setup and its table have in common."""
NOISE_WANTED = "a relative noise and how far it may be off: Quantity.from_median(0.005, 2)"


def assumed_noise(edges: Sequence[str], prior: PriorCard | None = None) -> Quantity:
    """The relative noise where none is stated, from the prior or else from the edges: a new object."""
    if prior is not None and prior.noise_percent is not None:
        return prior.noise_percent.scaled(1e-2)
    return replace(CLAMPED_NOISE if "clamped" in edges else DEFAULT_NOISE)


@dataclass(frozen=True)
class Setup:
    """How the board is held, and what was read.

    Attributes
    ----------
    name : str
    ends_x, ends_y : tuple of str
        Conditions at (x0, x1) and (y0, y1).
    clamped : dict of Quantity, m
        What a clamp covers, by edge.
    readings : tuple of Reading
    resolution : float, Hz
        Readings that are plain numbers are rounded to this; 0 if not rounded.
    peaks : tuple of Peak
        Peaks without a label.
    missed : float
        Probability that a mode below the highest peak left no peak.
    spurious : float
        Probability that a peak is no mode.
    noise : Quantity
        Relative noise of a frequency (log-normal).
    first_label : Label
    published_coefficients : CoefficientCard or None
        Table of the paper's least squares and percentile method, and of nothing else.
    attached : tuple of AttachedItem
    hammer : tuple of float or None, m
    fluid : DeclaredFluid or None
        The air or the water around the board; None: not declared.
    bounce : Quantity or None, Hz
        Frequency at which a free board moves as a whole on its support; None: not stated.
    table_name : str
        Of the published coefficients on a card, until they are read.
    group : Owner or None
        The group of sessions that the setup is one of (`bayesplate.board.sessions`).
    assumed : Quantity or None
        The noise that was taken because nobody stated one; see `is_noise_assumed`.
    """

    name: str
    ends_x: EdgeConditions
    ends_y: EdgeConditions
    readings: tuple[Reading, ...]
    noise: Quantity
    clamped: Mapping[str, Quantity] = field(default_factory=dict)
    resolution: float = 0.0
    peaks: tuple[Peak, ...] = ()
    missed: float = DEFAULT_MISSED
    spurious: float = DEFAULT_SPURIOUS
    first_label: Label = NO_OFFSET
    published_coefficients: CoefficientCard | None = None
    attached: tuple[AttachedItem, ...] = ()
    hammer: tuple[float, float] | None = None
    fluid: DeclaredFluid | None = None
    bounce: Quantity | None = None
    table_name: str = ""
    group: Owner | None = None
    assumed: Quantity | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "noise", quantity_of(self.noise, f"{self.name} noise", "relative"))
        covered = {
            edge: quantity_of(length, f"{self.name} clamped {edge}", "in m") for edge, length in self.clamped.items()
        }
        object.__setattr__(self, "clamped", covered)
        if self.bounce is not None:
            object.__setattr__(self, "bounce", quantity_of(self.bounce, f"{self.name} bounce", "in Hz"))

    @classmethod
    def from_frequencies(
        cls,
        frequencies: Mapping[str | tuple[int, int], Quantity | ArrayLike],
        *,
        edges: str | Mapping[str, str],
        name: str = "setup",
        resolution: float = 0.0,
        noise: Quantity | None = None,
        first_label: tuple[int, int] = NO_OFFSET,
        clamped: Mapping[str, Quantity | ArrayLike] | None = None,
        signs: Mapping[str | tuple[int, int], str] | None = None,
        unlabelled: Sequence[Peak | Quantity | ArrayLike] = (),
        attached: Sequence[AttachedItem] = (),
        hammer: tuple[float, float] | None = None,
        fluid: DeclaredFluid | None = None,
        bounce: Quantity | ArrayLike | None = None,
        published_coefficients: CoefficientCard | None = None,
    ) -> Setup:
        """A setup from numbers and arrays.

        Faults other than those of edge names and labels are reported with their place on a card, when a board with this
        setup is used.

        Parameters
        ----------
        frequencies : dict of Quantity, number or array of readings, Hz
            By label, "(1,0)" or (1, 0).
        edges : str or dict of str
            "clamped", "supported" or "free": one word for all four edges, or one per edge x0, x1, y0, y1.
        name : str
        resolution : float, Hz
            Step to which plain numbers are rounded; 0 if they are not.
        noise : Quantity, optional
            Relative, log-normal: 0.005 is half a per cent. By default that of the prior that the board is used with,
            or else of the edges, as on a card.
        first_label : tuple of int
        clamped : dict of Quantity, number or array of readings, m
            What a clamp covers, by edge.
        signs : dict of str, optional
            "+" or "-", by label.
        unlabelled : sequence of Peak, Quantity, number or array of readings, Hz
            Peaks without a label.
        attached : sequence of AttachedItem
        hammer : tuple of float, optional, m
        fluid : DeclaredFluid, optional
            The air or the water around the board.
        bounce : Quantity, number or array of readings, optional, Hz
            At which the free board moves as a whole on its support.
        published_coefficients : CoefficientCard, optional

        Returns
        -------
        Setup

        Raises
        ------
        InputError
            With every label, frequency, peak and name of an edge that cannot be read.
        """
        faults = list(type_faults(str(name), (
            ("name", name, isinstance(name, str), "a text"),
            ("frequencies", frequencies, isinstance(frequencies, Mapping), "a dict of frequencies by label"),
            ("edges", edges, isinstance(edges, str | Mapping), "a word, or a dict of words by edge"),
            ("noise", noise, noise is None or (isinstance(noise, Quantity) and not noise.is_exact), NOISE_WANTED),
            ("resolution", resolution, is_number(resolution), "a number, in Hz"),
            ("first_label", first_label, is_place(first_label) and all(isinstance(m, Integral) for m in first_label),
             "a pair of whole numbers"),
            ("clamped", clamped, isinstance(clamped, Mapping | None), "a dict of lengths by edge"),
            ("signs", signs, isinstance(signs, Mapping | None), "a dict of signs by label"),
            ("unlabelled", unlabelled, isinstance(unlabelled, list | tuple | np.ndarray), "a list of peaks"),
            ("attached", attached, are_instances(attached, AttachedItem), "a list of AttachedItem"),
            ("hammer", hammer, hammer is None or is_place(hammer), "a place (x, y) in m"),
            ("fluid", fluid, isinstance(fluid, DeclaredFluid | None), "a DeclaredFluid"),
            ("published_coefficients", published_coefficients,
             isinstance(published_coefficients, CoefficientCard | None), "a CoefficientCard"),
        )))  # fmt: skip
        if faults:
            raise InputError(faults)
        words = dict.fromkeys(EDGES, edges) if isinstance(edges, str) else {edge: edges.get(edge, "") for edge in EDGES}
        if not isinstance(edges, str) and set(edges) != set(EDGES):
            stated_edges = ", ".join(map(str, edges)) or "none"
            faults.append(Fault(f"{name} edges", "a word for each of x0, x1, y0, y1", stated_edges))
        elif unknown_words := [word for word in dict.fromkeys(words.values()) if word not in EDGE_WORDS]:
            wanted = '"clamped", "supported" or "free", for all edges or for each of x0, x1, y0, y1'
            faults.append(Fault(f"{name} edges", wanted, ", ".join(map(show_value, unknown_words))))
        signs_by_label = {}
        for label, sign in (signs or {}).items():
            try:
                signs_by_label[Label.parse(label_text(label))] = sign
            except InputError as error:
                faults += [replace(fault, place=f"{name} signs {fault.place}".rstrip()) for fault in error.faults]
        frequencies_by_label: dict[Label, Quantity] = {}
        for label, frequency in frequencies.items():
            try:
                reading = Reading.of(label, frequency)
            except InputError as error:
                faults += [replace(fault, place=f"{name} {fault.place}") for fault in error.faults]
                continue
            if reading.label in frequencies_by_label:
                faults.append(Fault(f"{name} frequencies", f"the label {reading.label} once", f"{label!r} again"))
            frequencies_by_label[reading.label] = reading.frequency
        stray = [label for label in signs_by_label if label not in frequencies_by_label]
        faults += [Fault(f"{name} signs", "a label among the frequencies", str(label)) for label in stray]
        faults += [
            Fault(f"{name} clamped", "one of x0, x1, y0, y1", str(edge)) for edge in clamped or {} if edge not in EDGES
        ]
        covered, length_faults = quantities_of(clamped or {}, f"{name} clamped", "in m")
        peaks = {i: peak for i, peak in enumerate(unlabelled, start=1) if isinstance(peak, Peak)}
        plain_frequencies = {i: value for i, value in enumerate(unlabelled, start=1) if not isinstance(value, Peak)}
        quantities, peak_faults = quantities_of(plain_frequencies, f"{name} unlabelled", "in Hz, or a Peak")
        peaks |= {i: Peak(quantity) for i, quantity in quantities.items()}
        faults += [*length_faults, *peak_faults]
        if faults:
            raise InputError(faults)
        keys = SetupKeys.model_construct(
            name=name,
            edges=Edges.model_construct(None, **words),
            clamped=covered,
            first_label=Label(*first_label),
            resolution=float(resolution),
            noise=noise,
            peaks=tuple(peaks[i] for i in sorted(peaks)),
            frequencies=frequencies_by_label,
            signs=signs_by_label,
            attached=tuple(attached),
            hammer=None if hammer is None else HammerKeys.model_construct(place=(float(hammer[0]), float(hammer[1]))),
            support=None if bounce is None else SupportKeys.model_construct(bounce=bounce),
            fluid=fluid,
        )
        return replace(cls.from_keys(keys), published_coefficients=published_coefficients)

    @classmethod
    def from_keys(cls, keys: SetupKeys) -> Setup:
        """The setup that a table [setup] of a card states; its published coefficients are still to be read."""
        edges, first_label = keys.edges, keys.first_label
        setup = cls(
            **{name: getattr(keys, name) for name in _FIELDS_AS_STATED},
            ends_x=(edges.x0, edges.x1),
            ends_y=(edges.y0, edges.y1),
            readings=tuple(
                Reading(
                    label,
                    (label.m - first_label.m, label.n - first_label.n),
                    _join_rounding_error(frequency, keys.resolution),
                    keys.signs.get(label, ""),
                    keys.confidence_in(label),
                )
                for label, frequency in keys.frequencies.items()
            ),
            noise=DEFAULT_NOISE if keys.noise is None else keys.noise,
            peaks=tuple(
                replace(peak, frequency=_join_rounding_error(peak.frequency, keys.resolution))
                for peak in (*map(Peak, keys.unlabelled), *keys.peaks)
            ),
            hammer=None if keys.hammer is None else keys.hammer.place,
            fluid=keys.fluid or keys.air,
            bounce=None if keys.support is None else keys.support.bounce,
            table_name=keys.published_coefficients,
        )
        return setup.assuming_noise() if keys.noise is None else setup

    def table(self) -> dict[str, Any]:
        """The table [setup] of a card that states the setup.

        A label that stands twice is written twice, the second time with a space, for the reader of the card to refuse.
        """
        frequencies: dict[str, Any] = {}
        for reading in self.readings:
            text = str(reading.label)
            while text in frequencies:
                text = text.replace(",", ", ", 1)
            frequencies[text] = FREQUENCY.write(reading.frequency)
        confidences = {reading.label: reading.confidence for reading in self.readings if reading.confidence != 1}
        is_alike = len(confidences) == len(self.readings) and len({*confidences.values()}) == 1
        bare_peaks = tuple(takewhile(lambda peak: peak.is_bare, self.peaks))
        coefficient_card = self.published_coefficients
        keys = SetupKeys.model_construct(
            None,
            **{name: getattr(self, name) for name in _FIELDS_AS_STATED},
            edges=Edges.model_construct(None, **self.edges),
            published_coefficients=self.table_name if coefficient_card is None else coefficient_card.name,
            noise=None if self.is_noise_assumed else self.noise,
            unlabelled=tuple(peak.frequency for peak in bare_peaks),
            peaks=self.peaks[len(bare_peaks) :],
            signs={reading.label: reading.sign for reading in self.readings if reading.sign},
            label_confidence=next(iter(confidences.values())) if is_alike else confidences or 1.0,
            hammer=None if self.hammer is None else HammerKeys.model_construct(place=self.hammer),
            support=None if self.bounce is None else SupportKeys.model_construct(bounce=self.bounce),
            fluid=self.fluid,
        )
        stated = keys.model_dump(by_alias=True, exclude_defaults=True)
        return {"name": self.name, **stated, **({"frequencies_hz": frequencies} if frequencies else {})}

    def assuming_noise(self, prior: PriorCard | None = None) -> Setup:
        """The setup with the noise of a prior, or else of its edges, in place of any that it has."""
        noise = assumed_noise(self.ends_x + self.ends_y, prior)
        return replace(self, noise=noise, assumed=noise)

    @property
    def is_noise_assumed(self) -> bool:
        """Whether the noise is still the very object that was assumed: a stated noise replaces it."""
        return self.noise is self.assumed

    @property
    def edges(self) -> dict[str, str]:
        """Condition of each edge."""
        return dict(zip(EDGES, self.ends_x + self.ends_y, strict=True))

    @property
    def labels(self) -> tuple[Label, ...]:
        """Labels of the readings, in their order."""
        return tuple(reading.label for reading in self.readings)

    @property
    def unlabelled(self) -> tuple[float, ...]:
        """Mean frequencies of the peaks without a label, Hz, in their order."""
        return tuple(peak.frequency.mean for peak in self.peaks)

    @property
    def measured(self) -> NDArray[np.float64]:
        """Measured frequencies: (n_modes,) array, Hz."""
        return np.array([reading.frequency.mean for reading in self.readings])

    @property
    def relative_sd(self) -> NDArray[np.float64]:
        """Relative uncertainty of each reading itself, apart from the noise: (n_modes,) array."""
        return np.array([reading.frequency.sd / reading.frequency.mean for reading in self.readings])

    @property
    def owner(self) -> Owner:
        """The owner of the setup's parameters."""
        return Owner("setup", self.name)

    @property
    def sensor(self) -> tuple[float, float] | None:
        """Where the one accelerometer stands, m; None where there is none, there are several, or it roved."""
        fixed = [item for item in self.attached if item.kind == "accelerometer" and len(item.places) == 1]
        return fixed[0].places[0] if len(fixed) == 1 else None

    @property
    def is_free(self) -> bool:
        """Whether no edge is held."""
        return {*self.ends_x, *self.ends_y} == {"free"}

    @property
    def noise_parameter(self) -> Parameter:
        """The relative noise of a frequency as a parameter."""
        return Parameter("noise", self.owner, self.noise, "1", display_name="noise")

    @property
    def clamped_parameters(self) -> tuple[Parameter, ...]:
        """What the clamps cover, one parameter per clamped edge for which the card states it."""
        return tuple(
            Parameter(f"clamped_{edge}", self.owner, length, "m", display_name=f"covered by the clamp on {edge}")
            for edge, length in self.clamped.items()
        )

    def input_name(self, edge: str) -> str:
        """Name of the clamped length of an edge among the board's inputs."""
        return parameter_name(f"clamped_{edge}", self.owner)


def _join_rounding_error(frequency: Quantity, resolution: float) -> Quantity:
    """A list of readings with their standard error joined with the rounding error; a single number stays as it is."""
    if len(frequency.readings) < 2 or frequency.resolution or not resolution:
        return frequency
    return Quantity.from_readings(frequency.readings, resolution)
