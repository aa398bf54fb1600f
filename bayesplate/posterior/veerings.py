"""Labels that may belong to another mode because two modes of one class exchange their shapes nearby: a veering.

In the likelihood a label means the rank of its mode in its class at the estimate. Where the frequencies of two modes
come close to each other within the posterior, the label names one mode on this side of the veering and the other mode
on the far side, and it is unknown on which side the board lies. This is harmless where both modes were read and the
higher reading is of the higher mode: the frequencies are in the right order whatever the names of the shapes. Otherwise
the label may be wrong, with a probability that is the share of plausible plates in which it names another mode; it is
treated like any other doubtful label (`bayesplate.frequencies.peaks`).

Where the data are faulty, the posterior may lie beyond the veering, where the modes of those ranks clearly have each
other's figures: then it contradicts its own labels, and the report says so.
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
from bayesplate.plate.naming import CERTAIN_CORRELATION

_CONTRADICTING_SHARE = 0.95
"""A fit contradicts a label where its mode certainly has another name on at least this share of the fit's plates."""


def with_veering_doubts(board: Board, models: Sequence[SetupModel], values: Values) -> tuple[Board, tuple[str, ...]]:
    """The board with reduced confidence in labels near a veering, and a sentence for each setup with such labels.

    The confidence is the share of plausible plates that agree on the mode. `values`, (n_draws,) each, are of the
    estimate, then of plausible plates; the models have the exact law. Without a doubtful label the board is the same
    object.
    """
    doubts = [_label_doubts(model, values) for model in models]
    if not any(doubts):
        return board, ()
    setups = []
    for setup, doubtful in zip(board.setups, doubts, strict=True):
        readings = (
            replace(reading, confidence=doubtful[reading.beams].confidence) if reading.beams in doubtful else reading
            for reading in setup.readings
        )
        setups.append(replace(setup, readings=tuple(readings)))
    remarks = (
        _remark(setup, doubtful, len(board.setups) > 1)
        for setup, doubtful in zip(board.setups, doubts, strict=True)
        if doubtful
    )
    return replace(board, setups=tuple(setups)), tuple(remarks)


def _remark(setup: Setup, doubts: Mapping[Beams, _LabelDoubt], are_several: bool) -> str:
    where = f"setup {setup.name}: " if are_several else ""
    phrases = [
        f"{_label(setup, beams)} {100.0 * doubt.confidence:.0f} % "
        f"(its shape mixes with that of {' and '.join(str(_label(setup, other)) for other in doubt.others)})"
        for beams, doubt in doubts.items()
    ]
    return (
        f"{where}near this plate modes of one kind exchange their shapes (a veering), so that a "
        "figure may be the neighbour's; before the fit the label is taken as right with a probability of: "
        f"{', '.join(phrases)}; a reading of the neighbour too, or another look at both figures, settles it"
    )


def _label(setup: Setup, beams: Beams) -> Label:
    return Label(beams[0] + setup.first_label.m, beams[1] + setup.first_label.n)


def contradicted_labels(models: Sequence[SetupModel], values: Values) -> tuple[str, ...]:
    """A sentence for each setup with sure labels that a fit contradicts, with the figures that its modes have.

    `values`, (n_draws,) each, are draws of the posterior under the exact law, which the models have.
    """
    sentences = []
    for model in models:
        setup = model.setup
        other_labels = {i: _label(setup, beams) for i, beams in _other_names(model, values).items()}
        phrases = [
            f"the mode at {setup.measured[i]:.5g} Hz, read as {setup.readings[i].label}, has that of {label}"
            for i, label in other_labels.items()
        ]
        if phrases:
            where = f" of setup {setup.name}" if len(models) > 1 else ""
            sentences.append(
                f"the constants are those of a plate with other figures than the labels{where} say: "
                f"{'; '.join(phrases)}; do not trust them before the labels, these and the others, have been looked at "
                "again"
            )
    return tuple(sentences)


def _other_names(model: SetupModel, values: Values) -> dict[int, Beams]:
    """For readings with a sure label, by index: another name that their mode certainly has on nearly all draws."""
    names: dict[int, Beams] = {}
    ranks = _ranks(model, values, CERTAIN_CORRELATION)
    if not next(iter(ranks.values())).size:  # no draw is a plate
        return names
    for i, (reading, place) in enumerate(zip(model.setup.readings, model.places, strict=True)):
        candidates = [beams for beams in ranks if beams != reading.beams and model.plate.parity(beams) == place.parity]
        certain = [beams for beams in candidates if np.mean(ranks[beams] == place.rank) >= _CONTRADICTING_SHARE]
        if reading.is_sure and certain:  # at most one: a mode has one name
            names[i] = certain[0]
    return names


def _ranks(model: SetupModel, values: Values, least_correlation: float = 0.0) -> dict[Beams, Indices]:
    """Rank in its class of the mode named by each product of beam functions, at the draws that are a plate."""
    assert model.exact is not None
    ranks = model.exact.reduced.ranks(model.system.weights(values), least_correlation)
    is_plate = np.all([mode_ranks >= 0 for mode_ranks in ranks.values()], axis=0)
    return {beams: mode_ranks[is_plate] for beams, mode_ranks in ranks.items()}


class _LabelDoubt(NamedTuple):
    confidence: float  # in the label: the share of plates that agree with the estimate
    others: tuple[Beams, ...]  # other shapes that its mode may have


def _label_doubts(model: SetupModel, values: Values) -> dict[Beams, _LabelDoubt]:
    """Doubts about labels that may belong to another mode."""
    measured = {reading.beams: reading.frequency.mean for reading in model.setup.readings if reading.is_sure}
    if not measured:
        return {}
    ranks = _ranks(model, values)
    doubts = {}
    for beams, hertz in measured.items():
        others = [other for other in ranks if other != beams and _are_of_one_class(model.setup, other, beams)]
        is_above = np.array([ranks[other] > ranks[beams] for other in others]).reshape(len(others), ranks[beams].size)
        has_changed = is_above != is_above[:, :1]
        in_order = [other in measured and (measured[other] >= hertz if above else measured[other] <= hertz)
                    for other, above in zip(others, is_above[:, 0], strict=True)]  # fmt: skip
        if has_changed[~np.array(in_order, dtype=bool)].any():
            mixed = (other for other, changed in zip(others, has_changed, strict=True) if changed.any())
            doubts[beams] = _LabelDoubt(1.0 - float(has_changed.any(axis=0).mean()), tuple(mixed))
    return doubts


def _are_of_one_class(setup: Setup, beams: Beams, other: Beams) -> bool:
    """Whether two products of beam functions have the same parities: modes of different classes cross and hardly mix.

    This also holds where an effect breaks the symmetry.
    """
    axes = zip(beams, other, (setup.ends_x, setup.ends_y), strict=True)
    return all((a - b) % 2 == 0 for a, b, (first, last) in axes if first == last)
