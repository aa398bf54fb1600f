"""What `pick` found, as its JSON has it and as tables and pages are made from it."""

from __future__ import annotations

from dataclasses import dataclass

_NOTED = 0.1
"""Probability of having no label from which on it is listed among the labels."""


@dataclass(frozen=True)
class LabelChance:
    """A label that a peak may have, and the probability that it is this one."""

    label: str
    probability: float


@dataclass(frozen=True)
class PickedRow:
    """One peak.

    Attributes
    ----------
    hz, sd_hz : float
        Frequency and its standard error.
    noise_hz, scatter_hz, window_hz : float
        Its parts: noise, scatter between hits and places beyond it, choice of lines.
    sign : str
        "+" or "-" between hammer and sensor, where their polarity is known or was found; otherwise empty.
    amplitude : float
        Strength over the strongest.
    spurious_probability : float
        That it is no mode of the board.
    kind : str
        What it would be then; empty where nothing speaks of it.
    seen : float
        Share of the widths of windows in which the search found it.
    alike : float
        Share of its power that is the same from hit to hit.
    labels : tuple of LabelChance
        The most probable first; none without a card.
    unlabelled_probability : float or None
        That it is none of the modes that the board of the card has, though a mode by the recordings; None without a
        card, and for a peak that is likely no mode.
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
        """The most probable labels and that it has none where that is not improbable; empty without a card."""
        found = {one.label: one.probability for one in self.labels[:most]}
        if self.unlabelled_probability is not None and self.unlabelled_probability >= _NOTED:
            found["none"] = self.unlabelled_probability
        return found


@dataclass(frozen=True)
class PickReport:
    """What `pick` found.

    Attributes
    ----------
    format : int
    files : tuple of str
    n_hits, n_places : int
    seconds : float
        Of each ring-down.
    lowest_hz, highest_hz : float
        Between which modes were looked for.
    peaks : tuple of PickedRow
        In the order of frequency, those that are likely no mode included.
    polarity : str
        "same" or "opposite" of force and response, as given or found; empty where it is not known.
    board : str
        Of the card from which labels were computed; empty without one.
    fragment : str
        The [setup] that a card takes.
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
