"""The result of `pick` as its JSON holds it; tables and pages are made from it."""

from __future__ import annotations

from dataclasses import dataclass

_NOTED_PROBABILITY = 0.1
"""Probability of having no label from which on "none" is listed among the labels."""


@dataclass(frozen=True)
class LabelChance:
    """A label that a peak may have, and its probability."""

    label: str
    probability: float


@dataclass(frozen=True)
class PickedRow:
    """One picked peak.

    Attributes
    ----------
    hz, sd_hz : float
        Frequency and its standard error.
    noise_hz, scatter_hz, window_hz : float
        Its parts: noise, scatter between hits and places beyond the noise, choice of lines.
    sign : str
        "+" or "-" between hammer and sensor, where their polarity is known or was found; otherwise empty.
    amplitude : float
        Strength over that of the strongest peak.
    spurious_probability : float
        Probability that it is no mode of the board.
    kind : str
        What it is if it is no mode; empty where no other explanation is likely.
    seen : float
        Share of the widths of windows in which the search found it.
    alike : float
        Share of its power that is the same from hit to hit.
    labels : tuple of LabelChance
        The most probable first; none without a card.
    unlabelled_probability : float or None
        Probability that it is none of the modes that the board of the card has, though a mode by the recordings; None
        without a card, and for a peak that is likely no mode.
    """

    hz: float
    sd_hz: float
    noise_hz: float
    scatter_hz: float
    window_hz: float
    damping_percent: float
    damping_sd_percent: float
    sign: str
    amplitude: float
    spurious_probability: float
    kind: str
    seen: float
    alike: float
    labels: tuple[LabelChance, ...] = ()
    unlabelled_probability: float | None = None

    @property
    def is_likely(self) -> bool:
        return self.spurious_probability < 0.5

    @property
    def mode_probability(self) -> float:
        """Probability of a mode of the board, by the recordings and by the modes that the board has."""
        return (1.0 - self.spurious_probability) * (1.0 - (self.unlabelled_probability or 0.0))

    def may_be(self, most: int) -> dict[str, float]:
        """Probabilities of the most probable labels, and of "none" where it is not small; empty without a card."""
        chances = {chance.label: chance.probability for chance in self.labels[:most]}
        if self.unlabelled_probability is not None and self.unlabelled_probability >= _NOTED_PROBABILITY:
            chances["none"] = self.unlabelled_probability
        return chances


@dataclass(frozen=True)
class PickReport:
    """The result of `pick`.

    Attributes
    ----------
    format : int
    files : tuple of str
    n_hits, n_places : int
    seconds : float
        Of each ring-down.
    lowest_hz, highest_hz : float
        Band in which modes were searched.
    peaks : tuple of PickedRow
        In the order of frequency, those that are likely no mode included.
    polarity : str
        "same" or "opposite" of force and response, as given or found; empty where it is not known.
    board : str
        Name of the board of the card from which labels were computed; empty without one.
    fragment : str
        The [setup] to put into a card.
    remarks : tuple of str
    """

    format: int
    files: tuple[str, ...]
    n_hits: int
    n_places: int
    seconds: float
    lowest_hz: float
    highest_hz: float
    peaks: tuple[PickedRow, ...]
    polarity: str
    board: str
    fragment: str
    remarks: tuple[str, ...]

    @property
    def likely(self) -> tuple[PickedRow, ...]:
        """The peaks that are modes rather than not."""
        return tuple(peak for peak in self.peaks if peak.is_likely)
