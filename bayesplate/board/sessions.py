"""Sessions: setups that hold a board alike, on several days or after it was taken out of the clamp and put back.

The real board departs from its ideal plate in the same way in all sessions: two sessions that both read a mode 1 % too
low say once, not twice, that the plate is wrong there. The change from clamping anew differs between sessions. The
noise of a session is the scatter about the board's own frequencies, and between these and the plate's lies the model
discrepancy of each mode,

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
from bayesplate.board.parameter import Owner, Parameter, parameter_name
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import DEFAULT_NOISE, Setup
from bayesplate.labels import Label

DISCREPANCY, MODE_DISCREPANCIES = "discrepancy", "discrepancies of the modes"
_SOURCE = "free boards, which no clamp disturbs, settle at 0.24-0.30 %"


def session_groups(board: Board) -> tuple[tuple[Setup, ...], ...]:
    """Groups of two setups or more that hold the board alike, load it alike and name its modes alike."""
    groups: list[list[Setup]] = []
    for setup in board.setups:
        matching_group = next((group for group in groups if _is_held_alike(group[0], setup)), None)
        if matching_group is None:
            groups.append([setup])
        else:
            matching_group.append(setup)
    return tuple(tuple(group) for group in groups if len(group) > 1)


def session_notes(board: Board) -> tuple[str, ...]:
    """A sentence for each group of sessions."""
    return tuple(
        f"{', '.join(setup.name for setup in group[:-1])} and {group[-1].name} hold the board alike: they are taken "
        "for sessions of one setup, which share how the real board departs from the ideal plate; what is predicted in "
        "the fit includes it, of a mode left out nobody knows it"
        for group in session_groups(board)
    )


def _is_held_alike(setup: Setup, other: Setup) -> bool:
    covered = ({edge: length.mean for edge, length in session.clamped.items()} for session in (setup, other))
    return next(covered) == next(covered) and all(
        getattr(setup, name) == getattr(other, name)
        for name in ("ends_x", "ends_y", "first_label", "attached", "fluid", "bounce")
    )


def with_discrepancies(board: Board) -> Board:
    """The board with the discrepancies that its sessions share, one for each labelled mode; stated priors stay."""
    extended_board = board
    for group in session_groups(board):
        owner = Owner("group", f"{group[0].name} to {group[-1].name}")
        labels = sorted({label for setup in group for label in setup.labels})
        parameters = (
            parameter for parameter in _discrepancy_parameters(owner, labels) if parameter.name not in board.inputs
        )
        setups = tuple(replace(setup, group=owner) if setup in group else setup for setup in extended_board.setups)
        extended_board = replace(extended_board.with_parameters(parameters), setups=setups)
    return extended_board


def _discrepancy_parameters(owner: Owner, labels: Sequence[Label]) -> Iterator[Parameter]:
    words = "discrepancy of the board from its plate"
    yield Parameter(DISCREPANCY, owner, DEFAULT_NOISE, "1", source=_SOURCE, display_name=words)
    standard_normal = Quantity.from_mean(0.0, 1.0, "normal")
    for label in labels:
        look = f"shifts mode {label} in all sessions"
        yield Parameter(
            _discrepancy_key(label), owner, standard_normal, "1", display_name=MODE_DISCREPANCIES, description=look
        )


def discrepancy_columns(board: Board) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Indices among the uncertain parameters of the discrepancies of the modes, and of their scales."""
    of_groups = [(i, parameter) for i, parameter in enumerate(board.uncertain) if parameter.owner.kind == "group"]
    return (
        tuple(i for i, parameter in of_groups if parameter.key != DISCREPANCY),
        tuple(i for i, parameter in of_groups if parameter.key == DISCREPANCY),
    )


def shared_variance_share(setup: Setup) -> float:
    """Share of the variance of a setup's noise that a further session would repeat, by the medians of the priors.

    Zero where its sessions share their discrepancies already: the noise is then the scatter of a session alone.
    """
    if setup.group is not None:
        return 0.0
    shared_variance = DEFAULT_NOISE.median**2
    return float(shared_variance / (shared_variance + setup.noise.median**2))


def readings_by_mode(board: Board) -> tuple[tuple[int, ...], ...]:
    """Indices of the readings of each mode in all sessions of one setup; every reading is in one group, in its order.

    A reading predicts the same mode in another session whatever the model: a test of how well a model predicts a mode
    leaves all readings of the mode out.
    """
    groups: dict[tuple[Owner | int, Label], list[int]] = {}
    reading = 0
    for position, setup in enumerate(board.setups):
        for label in setup.labels:
            groups.setdefault((position if setup.group is None else setup.group, label), []).append(reading)
            reading += 1
    return tuple(map(tuple, groups.values()))


def discrepancy_names(setup: Setup, label: Label) -> tuple[str, str] | None:
    """Names of the parameters whose product shifts ln f of a mode; None where the setup shares no discrepancies."""
    if setup.group is None:
        return None
    return parameter_name(DISCREPANCY, setup.group), parameter_name(_discrepancy_key(label), setup.group)


def unknown_discrepancy_variance(board: Board, setup: Setup) -> Floats:
    """Variance of the discrepancies of a setup's modes that no session has read: (n_modes,) array.

    Zero for modes whose discrepancy is a parameter of the board, and where sessions share none and the noise includes
    it.
    """
    variance = np.zeros(len(setup.labels))
    for i, label in enumerate(setup.labels):
        names = discrepancy_names(setup, label)
        if names is not None and names[1] not in board.inputs:
            scale = board.inputs[names[0]]
            variance[i] = scale.mean**2 + scale.sd**2
    return variance


def rescale_discrepancies(board: Board, values: Values, slopes: Floats, inputs: Floats) -> tuple[Floats, Floats]:
    """Slopes (n_modes, n_inputs) and standard coordinates (n_inputs,) with the discrepancies at their prior scale.

    In a fit the scale follows the residual. A test of the residual takes the prior scale: like free noise, a fitted
    scale would let any residual pass. The discrepancies keep their values; the slope by their scale is zero.
    """
    slopes, inputs = slopes.copy(), inputs.copy()
    for i, parameter in enumerate(board.uncertain):
        if parameter.owner.kind != "group":
            continue
        scale = parameter_name(DISCREPANCY, parameter.owner)
        prior = board.inputs[scale]
        factor = float(np.hypot(prior.mean, prior.sd) / values[scale]) if parameter.name != scale else 0.0
        slopes[:, i] *= factor
        inputs[i] = inputs[i] / factor if factor else 0.0
    return slopes, inputs


def _discrepancy_key(label: Label) -> str:
    return f"{DISCREPANCY} {label}"
