"""Measured frequencies: a reading has a label, a peak has none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from numpy.typing import ArrayLike
from pydantic import ConfigDict, Field

from bayesplate.board.measures import QuantityReader
from bayesplate.board.quantity import Quantity
from bayesplate.board.repeated import LARGEST_FREQUENCY_RATIO
from bayesplate.board.stated import quantity_of
from bayesplate.board.values import Choice, Key, Number
from bayesplate.labels import Label

NO_OFFSET = Label(0, 0)
_FREQUENCY_NUMBER = Number(
    0.1, 1e6, "Hz", "in Hz; the zero-frequency modes of a free board are not listed", "in Hz: 1 kHz is 1000 Hz"
)
FREQUENCY = QuantityReader(_FREQUENCY_NUMBER, furthest=LARGEST_FREQUENCY_RATIO).key
SIGN = Key(Choice(("+", "-")))
SMALLEST_PROBABILITY, PROBABILITY_HINT = 1e-9, "a probability: 98 % is 0.98"
PROBABILITY = Number(SMALLEST_PROBABILITY, 1 - SMALLEST_PROBABILITY, hint=PROBABILITY_HINT).key
_DAMPING = Number(1e-6, 100, "%", "the damping ratio in percent: half the loss factor").key


@dataclass(frozen=True)
class Reading:
    """A measured frequency of a named mode.

    Attributes
    ----------
    label : Label
        This laboratory's label.
    beams : tuple of int
        Orders of the beam functions along x and y, from 0: the label less `Setup.first_label`.
    frequency : Quantity, Hz
    sign : str
        Sign of the residue between hammer and sensor, "+" or "-"; empty if not known.
    confidence : float
        Probability, before the fit, that the label is right; 0 for a label that the program proposes for a bare peak.
    stated : Label or None
        The label on the card, where another is proposed.
    amplitude, damping, spurious : float or None
        Of the peak: see `Peak`.
    """

    label: Label
    beams: tuple[int, int]
    frequency: Quantity
    sign: str = ""
    confidence: float = 1.0
    stated: Label | None = None
    amplitude: float | None = None
    damping: float | None = None
    spurious: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "frequency", quantity_of(self.frequency, f"frequency of {self.label}", "in Hz"))

    @property
    def is_sure(self) -> bool:
        """Whether the label cannot be wrong."""
        return self.confidence >= 1.0

    @classmethod
    def of(
        cls,
        label: str | tuple[int, int],
        frequency: Quantity | ArrayLike,
        sign: str = "",
        first_label: tuple[int, int] = NO_OFFSET,
    ) -> Reading:
        """A reading from numbers.

        Parameters
        ----------
        label : str or tuple of int
            "(1,0)" or (1, 0).
        frequency : Quantity, number or array of readings, Hz
            A number is rounded to the resolution of its setup, an array holds repeated readings of one mode.
        sign : str
        first_label : tuple of int
            The laboratory's label of the lowest beam functions.

        Returns
        -------
        Reading

        Raises
        ------
        InputError
            If the label cannot be read, or the frequency is no number.
        """
        parsed_label = Label.parse(label_text(label))
        quantity = quantity_of(frequency, f"frequency of {parsed_label}", "in Hz")
        return cls(parsed_label, (parsed_label.m - first_label[0], parsed_label.n - first_label[1]), quantity, sign)


@dataclass(frozen=True)
class Peak:
    """A peak of the spectrum without a label.

    Attributes
    ----------
    frequency : Quantity, Hz
    sign : str
        Sign of the residue between hammer and sensor, "+" or "-"; empty if not known.
    amplitude : float or None
        Height relative to other peaks of the same setup; None if not known.
    damping : float or None
        Damping ratio, 1; None if not known.
    spurious : float or None
        Probability that it is no mode; None for that of its setup.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    frequency: Annotated[Quantity, Field(alias="hz", description="its frequency in Hz"), FREQUENCY]
    sign: Annotated[str, SIGN] = ""
    amplitude: Annotated[float | None, Number(1e-12, 1e12).key] = None
    damping: Annotated[float | None, Field(alias="damping_percent"), _DAMPING] = None
    spurious: Annotated[float | None, Field(alias="spurious_probability"), PROBABILITY] = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "frequency", quantity_of(self.frequency, "frequency of a peak", "in Hz"))

    @property
    def is_bare(self) -> bool:
        """Whether nothing but its frequency is known."""
        return not self.sign and self.amplitude is self.damping is self.spurious is None


def label_text(label: str | tuple[int, int]) -> str:
    """A label as a card writes it."""
    return f"({','.join(map(str, label))})" if isinstance(label, tuple) else str(label)
