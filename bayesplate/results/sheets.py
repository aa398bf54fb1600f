"""The report of `modes` as types: the lowest modes of each setup, and their mixtures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bayesplate.board.board import Board
from bayesplate.estimates.sheet import Sheet, SheetMode
from bayesplate.posterior.first_labels import Labelling


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
    residual_cents: float | None  # measured over computed
    likely_hz: tuple[float, float] | None  # interval of probability 2/3 of a mode that was not measured
    share_percent: EnergyShares
    # a, b, c: the paper's coefficients
    a: float
    b: float
    c: float


@dataclass(frozen=True)
class MixtureRow:
    """A mixture of modes that depends on one modulus alone: weight of each mode by label."""

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
    """The label proposed for a peak, and the probability of each label."""

    setup: str
    measured_hz: float
    label: str | None  # in the most probable labelling of all peaks; None where the peak is no mode of the plate
    # of each label, "none" for no mode, over all labellings examined; the highest first
    probability: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class ModesReport:
    """The lowest modes of a board.

    Attributes
    ----------
    name, title : str
    basis : str
        The constants with which the modes are computed.
    setups : tuple of SheetReport
    proposed : tuple of ProposedLabel
        One per peak if no peak has a label; the modes are then computed with the most probable labels.
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
        sheets = "; ".join(
            f"{sheet.setup}: {len(sheet.modes)} from {sheet.modes[0].hz:.4g} Hz" for sheet in self.setups
        )
        return f"<ModesReport of {self.name}: {sheets}>"


def proposed_labels(board: Board, labellings: Sequence[tuple[Labelling, float]]) -> tuple[ProposedLabel, ...]:
    """The proposed label of each peak of a board, from labellings of all peaks and their probabilities."""
    if not labellings:
        return ()
    return tuple(
        _proposed_label(
            setup.name, hertz, [(_peak_label(labelling, setup.name, hertz), share) for labelling, share in labellings]
        )
        for setup in board.setups
        for hertz in sorted(setup.unlabelled)
    )


def _proposed_label(setup: str, hertz: float, labels: Sequence[tuple[str | None, float]]) -> ProposedLabel:
    total: dict[str, float] = {}
    for label, share in labels:
        total[label or "none"] = total.get(label or "none", 0.0) + share
    return ProposedLabel(setup, hertz, labels[0][0], dict(sorted(total.items(), key=lambda item: -item[1])))


def _peak_label(labelling: Labelling, setup_name: str, hertz: float) -> str | None:
    """Label of a peak in a labelling; None where the peak is no mode."""
    readings = (reading for setup in labelling.board.setups if setup.name == setup_name for reading in setup.readings)
    return next((str(reading.label) for reading in readings if reading.frequency.mean == hertz), None)


def sheet_report(sheet: Sheet) -> SheetReport:
    mixtures = tuple(MixtureRow(mixture.name, mixture.modulus, dict(mixture.weights)) for mixture in sheet.combined)
    rows = tuple(_sheet_row(mode) for mode in sheet.modes)
    return SheetReport(sheet.setup, dict(sheet.edges), sheet.theory, rows, mixtures)


def _sheet_row(mode: SheetMode) -> SheetRow:
    shares = EnergyShares(*(round(100.0 * float(share), 1) for share in mode.shares))
    a, b, c = (float(value) for value in mode.coefficients)
    return SheetRow(mode.name, mode.hertz, mode.measured_hz, mode.residual_cents, mode.band_hz, shares, a, b, c)
