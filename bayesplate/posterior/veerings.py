"""Labels that may be another mode's because two modes of one class exchange their shapes nearby: a veering.

In the likelihood a label means the rank of its mode in its class at the estimate. Where the frequencies of two modes
come close to each other within the posterior, the label names one of them on this side of the veering and the other on
the far side, and which side the board lies on is not known. That does no harm where both modes were read and the higher
reading is the higher mode's: the frequencies are in the right order whatever the shapes are called. Otherwise the label
is one that may be wrong, with the share of plausible plates in which it names another mode; it takes part like any
other doubtful one (`bayesplate.frequencies.peaks`).

Where something is wrong, the posterior may move on to where the modes of those ranks plainly have each other's figures:
then it contradicts the labels that it rests on, and the report says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Indices
from bayesplate.board.board import Board, Values
from bayesplate.board.setup import Setup
from bayesplate.frequencies.model import SetupModel
from bayesplate.labels import Label
from bayesplate.plate.beams import Beams
from bayesplate.plate.naming import CERTAIN

_CONTRADICTED = 0.95
"""Share of a fit's plates on which a label's mode certainly has another name, from which on it contradicts that."""


def with_doubts(board: Board, models: Sequence[SetupModel], values: Values) -> tuple[Board, tuple[str, ...]]:
    """The board with doubtful labels as sure as plausible plates agree on their modes, and a sentence per such setup.

    `values`, (n_draws,) each, are of the estimate, then of plausible plates; the models have the exact law. Where no
    label may be another mode's the board is the same object.
    """
    doubts = [_doubts(model, values) for model in models]
    if not any(doubts):
        return board, ()
    setups = []
    for setup, own in zip(board.setups, doubts, strict=True):
        readings = (
            replace(one, confidence=own[one.beams].confidence) if one.beams in own else one for one in setup.readings
        )
        setups.append(replace(setup, readings=tuple(readings)))
    remarks = (_remark(setup, own) for setup, own in zip(board.setups, doubts, strict=True) if own)
    return replace(board, setups=tuple(setups)), tuple(remarks)


def _remark(setup: Setup, doubts: Mapping[Beams, _Doubt]) -> str:
    each = [
        f"{_label(setup, beams)} {100.0 * one.confidence:.0f} % "
        f"(its shape mixes with that of {' and '.join(str(_label(setup, other)) for other in one.others)})"
        for beams, one in doubts.items()
    ]
    return (
        f"setup {setup.name}: near this plate modes of one kind exchange their shapes (a veering), so that a "
        "figure may be the neighbour's; before the fit the label is taken as right with a probability of: "
        f"{', '.join(each)}; a reading of the neighbour too, or another look at both figures, settles it"
    )


def _label(setup: Setup, beams: Beams) -> Label:
    return Label(beams[0] + setup.first_label.m, beams[1] + setup.first_label.n)


def contradicted_labels(models: Sequence[SetupModel], values: Values) -> tuple[str, ...]:
    """A sentence per setup with sure labels that a fit contradicts: which figures its modes have instead.

    `values`, (n_draws,) each, are draws of the posterior under the exact law, which the models have.
    """
    sentences = []
    for model in models:
        setup = model.setup
        others = {at: _label(setup, beams) for at, beams in _named_otherwise(model, values).items()}
        read = [
            f"the mode at {setup.measured[at]:.5g} Hz, read as {setup.readings[at].label}, has that of {label}"
            for at, label in others.items()
        ]
        if read:
            where = f" of setup {setup.name}" if len(models) > 1 else ""
            sentences.append(
                f"the constants are those of a plate with other figures than the labels{where} say: {'; '.join(read)}; "
                "do not trust them before the labels, these and the others, have been looked at again"
            )
    return tuple(sentences)


def _named_otherwise(model: SetupModel, values: Values) -> dict[int, Beams]:
    """By position of a reading whose label is sure: the certain name of its mode on nearly all draws, if another."""
    found: dict[int, Beams] = {}
    every = _ranks(model, values, CERTAIN)
    if not next(iter(every.values())).size:  # no draw is a plate
        return found
    for at, (one, place) in enumerate(zip(model.setup.readings, model.places, strict=True)):
        of_class = [beams for beams in every if beams != one.beams and model.plate.parity(beams) == place.parity]
        certain = [beams for beams in of_class if np.mean(every[beams] == place.rank) >= _CONTRADICTED]
        if one.is_sure and certain:  # one at most: a mode has one name
            found[at] = certain[0]
    return found


def _ranks(model: SetupModel, values: Values, least: float = 0.0) -> dict[Beams, Indices]:
    """Rank in its class of the mode that each product of beam functions names, at those draws that are a plate."""
    assert model.exact is not None
    every = model.exact.reduced.ranks(model.system.weights(values), least)
    is_plate = np.all([one >= 0 for one in every.values()], axis=0)
    return {beams: one[is_plate] for beams, one in every.items()}


class _Doubt(NamedTuple):
    confidence: float  # of a label: the share of plates that agree with the estimate
    others: tuple[Beams, ...]  # whose shapes its mode may have


def _doubts(model: SetupModel, values: Values) -> dict[Beams, _Doubt]:
    """Labels that may be another mode's."""
    sure = {one.beams: one.frequency.mean for one in model.setup.readings if one.is_sure}
    if not sure:
        return {}
    ranks = _ranks(model, values)
    found = {}
    for beams, hertz in sure.items():
        others = [one for one in ranks if one != beams and _are_of_one_class(model.setup, one, beams)]
        is_above = np.array([ranks[one] > ranks[beams] for one in others]).reshape(len(others), ranks[beams].size)
        has_changed = is_above != is_above[:, :1]
        in_order = [one in sure and (sure[one] >= hertz if above else sure[one] <= hertz)
                    for one, above in zip(others, is_above[:, 0], strict=True)]  # fmt: skip
        if has_changed[~np.array(in_order, dtype=bool)].any():
            mixed = (one for one, changed in zip(others, has_changed, strict=True) if changed.any())
            found[beams] = _Doubt(1.0 - float(has_changed.any(axis=0).mean()), tuple(mixed))
    return found


def _are_of_one_class(setup: Setup, one: Beams, other: Beams) -> bool:
    """Whether products of beam functions are even and odd alike: modes of other classes cross, and mix hardly.

    That holds where an effect breaks the symmetry, too.
    """
    both = zip(one, other, (setup.ends_x, setup.ends_y), strict=True)
    return all((a - b) % 2 == 0 for a, b, (first, last) in both if first == last)
