"""Sessions: setups that hold a board alike, on several days or after it was taken out of the clamp and put back.

What a board does that its plate does not is the same in all of them: two sessions that both find a mode 1 % too low
tell once, not twice, that the plate is wrong there. What clamping anew changes differs. The noise of a session is what
scatters about the board's own frequencies, and between these and the plate's lies the model discrepancy of each mode,

    ln f of the board = ln f of the plate + s d,

d standard normal for each mode and s, the discrepancy of the board, a parameter with a prior.

References
----------
M. C. Kennedy and A. O'Hagan, Bayesian calibration of computer models, Journal of the Royal Statistical Society B 63
(2001), 425-464.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.parameter import Owner, Parameter, shown_name
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import DEFAULT_NOISE, Setup
from bayesplate.labels import Label

DISCREPANCY, OF_MODES = "discrepancy", "discrepancies of the modes"
_SOURCE = "free boards, which no clamp disturbs, settle at 0.24-0.30 %"


def sessions(board: Board) -> tuple[tuple[Setup, ...], ...]:
    """Groups of two setups or more that hold the board alike, load it alike and name its modes alike."""
    groups: list[list[Setup]] = []
    for setup in board.setups:
        own = next((group for group in groups if _is_held_alike(group[0], setup)), None)
        if own is None:
            groups.append([setup])
        else:
            own.append(setup)
    return tuple(tuple(group) for group in groups if len(group) > 1)


def notes(board: Board) -> tuple[str, ...]:
    """A sentence for each group of sessions."""
    return tuple(
        f"{', '.join(setup.name for setup in group[:-1])} and {group[-1].name} hold the board alike: they are taken "
        "for sessions of one setup, which share how the real board departs from the ideal plate"
        for group in sessions(board)
    )


def _is_held_alike(one: Setup, other: Setup) -> bool:
    covered = ({edge: length.mean for edge, length in each.clamped.items()} for each in (one, other))
    return next(covered) == next(covered) and all(
        getattr(one, name) == getattr(other, name)
        for name in ("ends_x", "ends_y", "first_label", "attached", "fluid", "bounce")
    )


def with_discrepancies(board: Board) -> Board:
    """The board with the discrepancies that its sessions share, one for each labelled mode; own priors stay."""
    found = board
    for group in sessions(board):
        owner = Owner("group", f"{group[0].name} to {group[-1].name}")
        labels = sorted({label for setup in group for label in setup.labels})
        new = (one for one in _parameters(owner, labels) if one.name not in board.inputs)
        setups = tuple(replace(one, group=owner) if one in group else one for one in found.setups)
        found = replace(found.with_parameters(new), setups=setups)
    return found


def _parameters(owner: Owner, labels: Sequence[Label]) -> Iterator[Parameter]:
    words = "discrepancy of the board from its plate"
    yield Parameter(DISCREPANCY, owner, DEFAULT_NOISE, "1", source=_SOURCE, words=words)
    standard = Quantity.from_mean(0.0, 1.0, "normal")
    for label in labels:
        look = f"shifts mode {label} in all sessions"
        yield Parameter(_key(label), owner, standard, "1", words=OF_MODES, look=look)


def shared_share(setup: Setup) -> float:
    """Share of the variance of a setup's noise that a further session would find again, by the medians of the priors.

    None where its sessions share their discrepancies already: what is called noise there is the scatter of a session.
    """
    if setup.group is not None:
        return 0.0
    shared = DEFAULT_NOISE.median**2
    return float(shared / (shared + setup.noise.median**2))


def same_modes(board: Board) -> tuple[tuple[int, ...], ...]:
    """Which readings are of one mode in sessions of one setup, each reading in one of the groups, in their order.

    A reading tells what the same mode is in another session, whatever the model: who asks how well a model predicts a
    mode leaves all its readings out.
    """
    found: dict[tuple[Owner | int, Label], list[int]] = {}
    reading = 0
    for place, setup in enumerate(board.setups):
        for label in setup.labels:
            found.setdefault((place if setup.group is None else setup.group, label), []).append(reading)
            reading += 1
    return tuple(map(tuple, found.values()))


def discrepancy_names(setup: Setup, label: Label) -> tuple[str, str] | None:
    """Names of the parameters whose product shifts ln f of a mode of a setup; None where it shares nothing."""
    if setup.group is None:
        return None
    return shown_name(DISCREPANCY, setup.group), shown_name(_key(label), setup.group)


def unknown_discrepancies(board: Board, setup: Setup) -> Floats:
    """Variance of the discrepancies of a setup's modes that no session has read: (n_modes,) array.

    Zero of those whose discrepancy is a parameter of the board, and where sessions share nothing and the noise has it.
    """
    variance = np.zeros(len(setup.labels))
    for i, label in enumerate(setup.labels):
        names = discrepancy_names(setup, label)
        if names is not None and names[1] not in board.inputs:
            scale = board.inputs[names[0]]
            variance[i] = scale.mean**2 + scale.sd**2
    return variance


def under_prior_scales(board: Board, values: Values, slopes: Floats, inputs: Floats) -> tuple[Floats, Floats]:
    """Slopes (n_modes, n_inputs) and standard coordinates (n_inputs,) where discrepancies have their prior size.

    A fit lets their scale follow the residual. Who judges the residual must not: like noise that is left free, a scale
    that has followed it would let any residual pass. The discrepancies stay what they were; their scale moves nothing.
    """
    slopes, inputs = slopes.copy(), inputs.copy()
    for i, one in enumerate(board.uncertain):
        if one.owner.kind != "group":
            continue
        scale = shown_name(DISCREPANCY, one.owner)
        prior = board.inputs[scale]
        factor = float(np.hypot(prior.mean, prior.sd) / values[scale]) if one.name != scale else 0.0
        slopes[:, i] *= factor
        inputs[i] = inputs[i] / factor if factor else 0.0
    return slopes, inputs


def _key(label: Label) -> str:
    return f"{DISCREPANCY} {label}"
