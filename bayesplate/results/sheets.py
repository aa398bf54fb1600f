"""The report of `modes` as types: the lowest modes of each setup, and their mixtures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bayesplate.board.board import Board
from bayesplate.estimates.sheet import Sheet, SheetMode
from bayesplate.posterior.first_labels import Way


@dataclass(frozen=True)
class EnergyShares:
    """Share of each rigidity and of effects in a mode's energy, per cent."""

    D_x: float
    D_y: float
    D_s: float
    effects: float


@dataclass(frozen=True)
class SheetRow:
    """One mode."""

    label: str  # or "cannot tell"
    hz: float
    measured_hz: float | None
    miss_cents: float | None  # computed over measured
    likely_hz: tuple[float, float] | None  # where it is expected two times in three, if it was not measured
    share_percent: EnergyShares
    # a, b, c: the paper's coefficients
    a: float
    b: float
    c: float


@dataclass(frozen=True)
class MixtureRow:
    """A mixture of modes that answers to one modulus alone: weight of each mode by label."""

    name: str
    modulus: str
    weights: Mapping[str, float]


@dataclass(frozen=True)
class SheetReport:
    """The lowest modes of one setup, in the order of frequency, and their mixtures."""

    setup: str
    edges: Mapping[str, str]
    theory: str
    modes: tuple[SheetRow, ...]
    combined: tuple[MixtureRow, ...]


@dataclass(frozen=True)
class ProposedLabel:
    """What a peak without a label may be."""

    setup: str
    measured_hz: float
    label: str | None  # in the most probable way to label all peaks; None where it is no mode of the plate
    # of each label, "none" for no mode, over all ways that were looked at; the highest first
    probability: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class ModesReport:
    """The lowest modes of a board.

    Attributes
    ----------
    name, title : str
    basis : str
        At which constants they are computed.
    setups : tuple of SheetReport
    proposed : tuple of ProposedLabel
        One per peak where no label was given at all; the modes are then those of the most probable labels.
    notes : tuple of str
    files : tuple of str
        Sheets that were written.
    """

    name: str
    title: str
    basis: str
    setups: tuple[SheetReport, ...]
    proposed: tuple[ProposedLabel, ...]
    notes: tuple[str, ...]
    files: tuple[str, ...]

    def __repr__(self) -> str:
        told = "; ".join(f"{one.setup}: {len(one.modes)} from {one.modes[0].hz:.4g} Hz" for one in self.setups)
        return f"<ModesReport of {self.name}: {told}>"


def proposed_labels(board: Board, ways: Sequence[tuple[Way, float]]) -> tuple[ProposedLabel, ...]:
    """What each peak of a board without a label may be, by the ways to label all of them; empty without any."""
    if not ways:
        return ()
    return tuple(
        _proposed(setup.name, hertz, [(_label(way, setup.name, hertz), share) for way, share in ways])
        for setup in board.setups
        for hertz in sorted(setup.unlabelled)
    )


def _proposed(setup: str, hertz: float, found: Sequence[tuple[str | None, float]]) -> ProposedLabel:
    total: dict[str, float] = {}
    for label, share in found:
        total[label or "none"] = total.get(label or "none", 0.0) + share
    return ProposedLabel(setup, hertz, found[0][0], dict(sorted(total.items(), key=lambda item: -item[1])))


def _label(way: Way, setup: str, hertz: float) -> str | None:
    """Label of a peak in one way to label them; None where it is no mode."""
    readings = (one for each in way.board.setups if each.name == setup for one in each.readings)
    return next((str(one.label) for one in readings if one.frequency.mean == hertz), None)


def sheet_report(sheet: Sheet) -> SheetReport:
    mixtures = tuple(MixtureRow(one.name, one.modulus, dict(one.weights)) for one in sheet.combined)
    rows = tuple(_row(mode) for mode in sheet.modes)
    return SheetReport(sheet.setup, dict(sheet.edges), sheet.theory, rows, mixtures)


def _row(mode: SheetMode) -> SheetRow:
    shares = EnergyShares(*(round(100.0 * float(share), 1) for share in mode.shares))
    a, b, c = (float(value) for value in mode.coefficients)
    return SheetRow(mode.name, mode.hertz, mode.measured_hz, mode.miss_cents, mode.band_hz, shares, a, b, c)
