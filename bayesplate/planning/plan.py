"""The classes of plan.json: proposals of measurements, the best first, and modes to look for at the bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

FORMAT = 1


@dataclass(frozen=True)
class ExplanationEntry:
    """An explanation of the readings that may be true."""

    effects: tuple[str, ...]  # empty for no effect
    words: str
    probability: float  # among the surviving explanations


@dataclass(frozen=True)
class Gain:
    """The expected gain of readings."""

    # E_x, E_y, G_xy: expected standard deviation of the constant's logarithm after, over that before; of several boards
    # the geometric mean
    E_x: float
    E_y: float
    G_xy: float
    constants: float  # mean of the logarithms of before over after, nats
    constants_error: float  # its standard error; 0 where it is exact
    explanations: float | None  # expected drop of the entropy of the explanations, nats; None where there is one only
    explanations_error: float | None  # its standard error
    # half the log determinant of the information gained on the constants, the explanation being known, nats; on E alone
    # for an isotropic board; on the shared parameters where boards share some
    information: float
    shared: Mapping[str, float]  # of a campaign: the same as E_x for each parameter that its boards share
    score: float  # by which the plan is ordered, nats
    score_per_minute: float


@dataclass(frozen=True)
class ProposalEntry:
    """A measurement that could be made next."""

    what: str  # "modes", "edges", "mass", "again", "size" or "board"
    board: str
    setup: str  # empty where no frequency is read
    sentence: str  # the instruction
    cost_minutes: float
    modes: tuple[str, ...]  # labels of the modes to read
    gain: Gain


@dataclass(frozen=True)
class SequenceEntry:
    """Proposals that are best together."""

    steps: tuple[str, ...]  # their sentences, in the order in which they can be done
    cost_minutes: float
    gain: Gain  # of all steps together


@dataclass(frozen=True)
class ModeToFind:
    """A mode to look for at the bench."""

    label: str
    hz: float  # expected frequency: the median over all explanations
    # low_hz, high_hz: between which it lies two times in three
    low_hz: float
    high_hz: float
    # residue between hammer and sensor over the largest that its figure could give: 0 on a nodal line, 1 at best
    seen: float


@dataclass(frozen=True)
class BenchEntry:
    """The work at the bench for one way to hold the board."""

    board: str
    setup: str
    edges: Mapping[str, str]
    # sensor_mm, hammer_mm: places on the whole board
    sensor_mm: tuple[float, float]
    hammer_mm: tuple[float, float]
    taps_mm: tuple[tuple[float, float], ...]  # places to tap that distinguish the figures
    modes: tuple[ModeToFind, ...]
    added_mass: str = ""  # the known mass that is stuck on, and where, in words; empty without one


@dataclass(frozen=True, repr=False)
class Plan:
    """What to measure next.

    Attributes
    ----------
    format : int
    name : str
    title : str
    seed : int
    card_sha256 : str
    basis : str
        Source of the present beliefs: "readings", "prior" or "campaign".
    goal : str or None
        The requested goal; None for all.
    costs : dict of float
        Minutes of each class of work.
    explanations : tuple of ExplanationEntry
    entropy : float
        Entropy of the explanations, nats.
    first : str
        The first line: what to do next and its expected gain; empty where nothing would help.
    proposals : tuple of ProposalEntry
        The best first.
    sequences : tuple of SequenceEntry
        The best two, and the best three.
    bench : tuple of BenchEntry
    notes : tuple of str
    """

    format: int
    name: str
    title: str
    seed: int
    card_sha256: str
    basis: str
    goal: str | None
    costs: Mapping[str, float]
    explanations: tuple[ExplanationEntry, ...]
    entropy: float
    first: str
    proposals: tuple[ProposalEntry, ...]
    sequences: tuple[SequenceEntry, ...]
    bench: tuple[BenchEntry, ...]
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<Plan for {self.name}: {self.first or 'nothing would help'}>"
