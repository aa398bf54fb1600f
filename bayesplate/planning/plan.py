"""plan.json as types: what to measure next, the best first, and what to look for at the bench."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

FORMAT = 1


@dataclass(frozen=True)
class ExplanationEntry:
    """An explanation that is to be told from the others.

    Attributes
    ----------
    effects : tuple of str
        Empty for no effect.
    probability : float
        Among those that survive.
    """

    effects: tuple[str, ...]
    words: str
    probability: float


@dataclass(frozen=True)
class Gain:
    """What readings are expected to give.

    Attributes
    ----------
    E_x, E_y, G_xy : float
        Expected standard deviation of the constant's logarithm after, over that before; of several boards the geometric
        mean.
    constants : float
        Mean of the logarithms of before over after, nats.
    constants_error : float
        Its standard error; 0 where it is exact.
    explanations : float or None
        Expected drop of the entropy of the explanations, nats; None where there is one only.
    explanations_error : float or None
        Its standard error.
    information : float
        Half the log determinant of what the constants gain, the explanation being known, nats; of an isotropic board
        of what E gains; where boards share something, of what that gains.
    shared : dict of float
        Of a campaign: the same as E_x for each parameter that its boards share.
    score : float
        What the plan is ordered by, nats.
    """

    E_x: float
    E_y: float
    G_xy: float
    constants: float
    constants_error: float
    explanations: float | None
    explanations_error: float | None
    information: float
    shared: Mapping[str, float]
    score: float
    score_per_minute: float

    def shrinkage(self, name: str) -> float:
        """ln of the standard deviation of a modulus before over that after."""
        return -math.log(getattr(self, name))


@dataclass(frozen=True)
class ProposalEntry:
    """One thing that could be measured next.

    Attributes
    ----------
    what : str
        "modes", "edges", "mass", "again", "size" or "board".
    setup : str
        Empty where no frequency is read.
    sentence : str
        What to do, as an order.
    modes : tuple of str
        Labels of the modes to read.
    """

    what: str
    board: str
    setup: str
    sentence: str
    cost_minutes: float
    modes: tuple[str, ...]
    gain: Gain


@dataclass(frozen=True)
class SequenceEntry:
    """Proposals that are best together.

    Attributes
    ----------
    steps : tuple of str
        Their sentences, in the order in which they can be done.
    gain : Gain
        Of all together.
    """

    steps: tuple[str, ...]
    cost_minutes: float
    gain: Gain


@dataclass(frozen=True)
class ModeToFind:
    """A mode to look for at the bench.

    Attributes
    ----------
    hz : float
        Where it is expected: the median over all explanations.
    low_hz, high_hz : float
        Between which it lies two times in three.
    seen : float
        Residue between hammer and sensor over the largest that its figure could give: 0 on a nodal line, 1 at best.
    """

    label: str
    hz: float
    low_hz: float
    high_hz: float
    seen: float


@dataclass(frozen=True)
class BenchEntry:
    """What to do at the bench for one way to hold the board.

    Attributes
    ----------
    sensor_mm, hammer_mm : tuple of float
        Places on the whole board.
    taps_mm : tuple of tuple of float
        Where to tap to tell the figures apart.
    """

    board: str
    setup: str
    edges: Mapping[str, str]
    sensor_mm: tuple[float, float]
    hammer_mm: tuple[float, float]
    taps_mm: tuple[tuple[float, float], ...]
    modes: tuple[ModeToFind, ...]


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
        What is believed now: "readings", "prior" or "campaign".
    goal : str or None
        What was asked for.
    costs : dict of float
        Minutes by class.
    explanations : tuple of ExplanationEntry
    entropy : float
        Of them, nats.
    first : str
        The first line: what to do next and what it is expected to give; empty where nothing would help.
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
