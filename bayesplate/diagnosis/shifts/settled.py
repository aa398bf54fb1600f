"""Labels that a search for effects may rest on: those that are certain, whichever of the usual plates the board is."""

from __future__ import annotations

from dataclasses import replace

from bayesplate.cards import PriorCard
from bayesplate.diagnosis.shifts.forms import forms, with_forms
from bayesplate.estimates.labelling import propose_labels
from bayesplate.frequencies.peaks import takes_part
from bayesplate.labels import Label
from bayesplate.plate.board import Board
from bayesplate.plate.measured import Peak, Reading
from bayesplate.plate.setup import Setup
from bayesplate.quantities import Quantity

CERTAIN = 0.9
"""Probability from which on a label is taken for sure."""

_WHERE_PLATES_DIFFER = ("transverse_shear",)
"""Effects that may change the order of modes on any board: a label has to be certain with them too."""

Labels = dict[tuple[str, Quantity], Label]
"""By setup and frequency of the peak."""


def with_settled_labels(board: Board, prior: PriorCard) -> tuple[Board, tuple[str, ...]]:
    """The board with the labels that are certain, and nothing but them.

    A search compares hypotheses by the residuals of one list of readings. So a peak takes part in it if it is the same
    mode with a probability of at least 0.9 on the plate as it is declared and on the one with transverse shear.

    Parameters
    ----------
    board : Board
    prior : PriorCard
        For the first labels of a board that has too few.

    Returns
    -------
    board : Board
        The same where every label is sure and no peak lacks one.
    notes : tuple of str
        Which peaks are left out, a sentence per setup.
    """
    if not any(takes_part(setup) for setup in board.setups):
        return board, ()
    every = [_labels(propose_labels(plate, prior, CERTAIN).board) for plate in _plates(board)]
    agreed = {key: label for key, label in every[0].items() if all(other.get(key) == label for other in every)}
    setups = tuple(_settled(setup, agreed) for setup in board.setups)
    return replace(board, setups=tuple(setups)), tuple(
        _left_out(before, after) for before, after in zip(board.setups, setups, strict=True) if _n(before) > _n(after)
    )


def _plates(board: Board) -> list[Board]:
    tried = (forms(board).get(name) for name in _WHERE_PLATES_DIFFER)
    return [board, *(with_forms(board, found[:1]) for found in tried if found)]


def _labels(board: Board) -> Labels:
    return {(setup.name, reading.frequency): reading.label for setup in board.setups for reading in setup.readings}


def _settled(setup: Setup, agreed: Labels) -> Setup:
    """A setup with those readings that are sure, and those peaks whose label is agreed upon."""
    readings = [reading for reading in setup.readings if reading.is_sure]
    others: list[Reading | Peak] = [*(one for one in setup.readings if not one.is_sure), *setup.peaks]
    for one in sorted(others, key=lambda one: one.frequency.mean):
        label = agreed.get((setup.name, one.frequency))
        if label is not None:
            beams = (label.m - setup.first_label.m, label.n - setup.first_label.n)
            readings.append(Reading(label, beams, one.frequency, one.sign))
    return replace(setup, readings=tuple(readings), peaks=())


def _n(setup: Setup) -> int:
    return len(setup.readings) + len(setup.peaks)


def _left_out(before: Setup, after: Setup) -> str:
    kept = {reading.frequency for reading in after.readings}
    every = [*(one.frequency for one in before.readings), *(one.frequency for one in before.peaks)]
    hertz = ", ".join(f"{one.mean:.5g}" for one in sorted(every, key=lambda one: one.mean) if one not in kept)
    return (
        f"setup {before.name}: {len(after.readings)} of {_n(before)} peaks are one certain mode and take part in the "
        f"search; left out: {hertz} Hz"
    )
