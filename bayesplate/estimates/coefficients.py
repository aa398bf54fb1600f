"""Where the paper's coefficients a, b, c come from: one solve, a training of 25 plates, or a printed table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board, Values, vibrating_lengths
from bayesplate.board.coefficients import CoefficientCard
from bayesplate.board.material import RIGIDITIES, moduli_of
from bayesplate.board.setup import Setup
from bayesplate.board.words import setup_places
from bayesplate.effects.part import aspect_ratio_of
from bayesplate.effects.words import effect_names
from bayesplate.errors import Fault, InputError, NotIdentifiableError
from bayesplate.frequencies.columns import mean_coefficients, modal_coefficients
from bayesplate.frequencies.model import SetupModel
from bayesplate.frequencies.terms import shear_moduli
from bayesplate.labels import Label
from bayesplate.plate.beams import Beams
from bayesplate.plate.naming import find_named_modes
from bayesplate.plate.terms import Theory
from bayesplate.plate.training import (
    MODULUS_FACTORS,
    TrainingConstants,
    train,
    training_matrices,
    training_weights,
)

CoefficientSource = Literal["sensitivity", "training", "published"]
SAME_ASPECT = 0.01
"""Relative difference up to which a table counts as made for the aspect ratio of a board."""
SAME_POISSON = 0.01
"""Difference up to which a table counts as made for the Poisson ratio of a board; it moves E_y by 0.1 %."""
_TRAINING_EFFECTS = ("transverse_shear", "poisson_ratio")
"""Effects that the plates of a training include where the board has them."""
_GPA = 1e9


@dataclass(frozen=True, eq=False)
class CoefficientRows:
    """Coefficients of a setup's labelled modes, in the order of its readings, and the plates that they are made for."""

    source: CoefficientSource
    # (n_modes,): readings of the setup; a printed table may lack modes of peaks without a sure label
    readings: Indices
    coefficients: Floats  # (n_modes, 3): a, b, c
    # (n_modes,), N m: part of omega^2 / lambda due to effects; training and table have shear in a, b, c
    rest: Floats
    aspect_ratio: float  # L_x / L_y
    theory: str
    sentence: str
    r_squared: Mapping[Label, float]  # where a plane was fitted


def coefficient_rows(
    board_name: str,
    model: SetupModel,
    values: Values,
    source: CoefficientSource | None = None,
    *,
    compared: bool = True,
) -> CoefficientRows:
    """Coefficients of a setup's readings, of a model that is solved at the values.

    By default the published table where the setup names one, else the sensitivity of one solve. `compared`: also solve
    plates of both theories to say which a table is of, half a second where it has many modes. Raises InputError where
    the table that is asked for is not named, and NotIdentifiableError where a mode is recognised in fewer than three
    training plates.
    """
    if source is None:
        source = "sensitivity" if model.setup.published_coefficients is None else "published"
    if source == "sensitivity":
        return _by_sensitivity(model, values)
    if source == "training":
        return _by_training(model, values)
    return _by_published_table(board_name, model, values, compared)


def _by_sensitivity(model: SetupModel, values: Values) -> CoefficientRows:
    modal = mean_coefficients(
        [modal_coefficients(station.system, values, station.linear.stiffness) for station in model.stations],
        np.exp([station.mode_log_frequencies(values, "linear")[0] for station in model.stations]),
    )
    ratio = aspect_ratio_of(values, model.setup)
    theory = model.system.theory
    sentence = f"energy shares of one solve at the weighted least-squares estimate, {theory} plate, ratio {ratio:.4g}"
    if modal.rest.any():
        sentence += "; what the effects give is taken off first"
    readings = np.arange(len(model.setup.readings))
    return CoefficientRows("sensitivity", readings, modal.coefficients, modal.rest, ratio, theory, sentence, {})


def _by_training(model: SetupModel, values: Values) -> CoefficientRows:
    setup, theory = model.setup, model.system.theory
    ratio = aspect_ratio_of(values, setup)
    centre, origin = _centre_of_training(model, values)
    beams = [reading.beams for reading in setup.readings]
    trained = train(setup.ends_x, setup.ends_y, ratio, _thickness_ratio(values, setup), centre, theory, beams).modes
    rows = np.array([[trained[b].a, trained[b].b, trained[b].c] for b in beams])
    counts = [trained[b].n_plates for b in beams]
    sentence = (
        f"non-negative planes through {min(counts)} to {max(counts)} of {len(MODULUS_FACTORS) ** 2} computed plates, "
        f"{theory}, ratio {ratio:.4g}, around E_x {centre.E_x / _GPA:.3g}, E_y {centre.E_y / _GPA:.3g}, "
        f"G_xy {centre.G_xy / _GPA:.3g} GPa ({origin})"
        f"{_lacking_effects(model)}"
    )
    r_squared = {reading.label: trained[reading.beams].r_squared for reading in setup.readings}
    readings = np.arange(len(beams))
    return CoefficientRows("training", readings, rows, np.zeros(len(beams)), ratio, theory, sentence, r_squared)


def _centre_of_training(model: SetupModel, values: Values) -> tuple[TrainingConstants, str]:
    """Plate in the middle of the training: that of the named table, otherwise the estimate itself; and its origin.

    Its Poisson ratio and shear moduli are the board's own, because the coefficients depend on them.
    """
    adjusted = model.system.adjusted(values)
    moduli_of_shear = zip(("G_xz", "G_yz"), shear_moduli(adjusted), strict=True)
    shear = {name: float(modulus) for name, modulus in moduli_of_shear if model.system.theory == "shear-flexible"}
    E_x, E_y, G_xy = moduli_of(values)
    centre = TrainingConstants(float(E_x), float(E_y), float(G_xy), float(values["poisson_xy"]), **shear)
    table = model.setup.published_coefficients
    printed = None if table is None else _constants_of(table)
    if table is None or printed is None:
        return centre, "the weighted least-squares estimate"
    return replace(centre, E_x=printed.E_x, E_y=printed.E_y, G_xy=printed.G_xy), f"those of {table.name}"


def _lacking_effects(model: SetupModel) -> str:
    """Clause on the board's effects that the plates of a training or of a printed table lack; empty if none."""
    lacking = [effect.name for effect in model.system.effects if effect.name not in _TRAINING_EFFECTS]
    return f"; its plates have no {effect_names(lacking, 'or')}, which the board has" if lacking else ""


def _constants_of(card: CoefficientCard) -> TrainingConstants | None:
    """Material of a table's training plates, Pa; None if the table does not state it."""
    t = card.training
    if t.E_x_gpa is None or t.E_y_gpa is None or t.G_xy_gpa is None or t.nu_xy is None:
        return None
    G_xz, G_yz = (None if G is None else G * _GPA for G in (t.G_xz_gpa, t.G_yz_gpa))
    return TrainingConstants(t.E_x_gpa * _GPA, t.E_y_gpa * _GPA, t.G_xy_gpa * _GPA, t.nu_xy, G_xz, G_yz)


def _by_published_table(board_name: str, model: SetupModel, values: Values, compared: bool) -> CoefficientRows:
    setup = model.setup
    card = named_table(board_name, setup)
    table_labels = [_label_in_table(card, setup, label) for label in setup.labels]
    readings = np.array([i for i, label in enumerate(table_labels) if label in card.table], dtype=np.intp)
    table_label_of = {setup.labels[i]: table_labels[i] for i in readings}
    rows = np.array([card.table[entry] for entry in table_label_of.values()]).reshape(-1, len(RIGIDITIES))
    beams = [setup.readings[i].beams for i in readings]
    distances = (
        _table_distances(card, setup, beams, rows, _thickness_ratio(values, setup)) if compared and beams else {}
    )
    theory = min(distances.items(), key=lambda item: item[1])[0] if distances else "not stated"
    sentence = f"printed table {card.name}: {card.title}"
    if distances:
        distance_words = " and ".join(f"{rms:.1f} cents from {name} plates" for name, rms in distances.items())
        sentence += f"; at its own material it lies {distance_words} solved here, so it holds for the {theory} plate"
    nu_xy = float(values["poisson_xy"])
    if card.training.nu_xy is not None and abs(card.training.nu_xy - nu_xy) > SAME_POISSON:
        sentence += f"; its nu_xy is {card.training.nu_xy:.3g}, the board's {nu_xy:.3g}"
    sentence += _lacking_effects(model)
    r_squared = {label: card.r_squared[entry] for label, entry in table_label_of.items() if entry in card.r_squared}
    rest = np.zeros(len(rows))
    return CoefficientRows("published", readings, rows, rest, card.aspect_ratio, theory, sentence, r_squared)


def named_table(board_name: str, setup: Setup) -> CoefficientCard:
    """The table that a setup names; InputError if it names none."""
    if setup.published_coefficients is None:
        place = f"{board_name} [setup] published_coefficients"
        raise InputError(Fault(place, "the name of a table", "nothing", "take --coefficients sensitivity or training"))
    return setup.published_coefficients


def coefficient_faults(board: Board) -> list[Fault]:
    """Tables that are not of their setup's edges, aspect ratio and labels: every fault of every setup."""
    places = setup_places(f"{board.name}.toml", [setup.name for setup in board.setups])
    faults = []
    for setup, where in zip(board.setups, places, strict=True):
        if setup.published_coefficients is not None:
            faults += _table_faults(setup.published_coefficients, setup, board, f"{where} published_coefficients")
    return faults


def require_sides(board: Board) -> None:
    """Refuse (NotIdentifiableError) a board with the aspect ratio of a printed table once its sides are exchanged."""
    nominal = board.nominal()
    exchanged = {**nominal, "length_x": nominal["length_y"], "length_y": nominal["length_x"]}
    for setup in board.setups:
        table = setup.published_coefficients
        if table is None:
            continue
        ratio, other = (aspect_ratio_of(values, setup) / table.aspect_ratio for values in (nominal, exchanged))
        if abs(other - 1.0) < 2.0 * SAME_ASPECT < abs(ratio - 1.0):
            place = f"{board.name}.toml setup '{setup.name}' published_coefficients"
            wanted = f"the aspect ratio L_x / L_y of {table.name}, {table.aspect_ratio:.3g}"
            remedy = "are length_x_mm and length_y_mm exchanged? x is along the grain"
            raise NotIdentifiableError(Fault(place, wanted, f"{ratio * table.aspect_ratio:.3g}", remedy))


def _table_faults(card: CoefficientCard, setup: Setup, board: Board, place: str) -> list[Fault]:
    faults = []
    if card.edges.words != setup.edges:
        wanted = f"a table for the edges {_edge_words(setup.edges)}"
        faults.append(Fault(place, wanted, f"{card.name}, made for {_edge_words(card.edges.words)}"))
    length_x, length_y = (float(side) for side in vibrating_lengths(board.nominal(), setup))
    is_board = min(length_x, length_y) > 0.0  # clamps that cover the whole board are a fault of their own
    if is_board and abs(card.aspect_ratio * length_y / length_x - 1.0) > SAME_ASPECT:
        wanted = f"a table of aspect ratio {length_x / length_y:.4g}"
        faults.append(Fault(place, wanted, f"{card.name}, made for {card.aspect_ratio:.4g}"))
    missing = [str(label) for label in setup.labels if _label_in_table(card, setup, label) not in card.table]
    if missing:
        m, n = setup.first_label.m - card.first_label.m, setup.first_label.n - card.first_label.n
        labels = ", ".join(f"({label.m + m},{label.n + n})" for label in card.table)
        faults.append(Fault(place, f"a table with the labels {', '.join(missing)}", f"{card.name} with {labels}"))
    return faults


def _label_in_table(card: CoefficientCard, setup: Setup, label: Label) -> Label:
    """Label in a table of the mode that a setup's label names: each counts from a first label of its own."""
    return Label(label.m - setup.first_label.m + card.first_label.m, label.n - setup.first_label.n + card.first_label.n)


def _table_distances(
    card: CoefficientCard, setup: Setup, beams: Sequence[Beams], rows: Floats, thickness_ratio: float
) -> dict[Theory, float]:
    """Distance of a table's frequencies from plates of each theory in the middle of its training: rms, cents."""
    constants = _constants_of(card)
    if constants is None:
        return {}
    training = card.training
    if training.thickness_mm is not None and training.length_x_mm is not None:
        thickness_ratio = training.thickness_mm / training.length_x_mm
    theories: tuple[Theory, ...] = ("thin",) if constants.G_xz is None or constants.G_yz is None else get_args(Theory)
    distances: dict[Theory, float] = {}
    for theory in theories:
        weights = training_weights(card.aspect_ratio, thickness_ratio, constants, theory)
        p, q = weights.stiffness[0] * card.aspect_ratio**2, weights.stiffness[1] / card.aspect_ratio**2
        solved = find_named_modes(training_matrices(setup.ends_x, setup.ends_y, theory), weights, beams)
        ratios = rows @ np.array([p, q, 1.0]) / np.array([solved[b].eigenvalue for b in beams])
        distances[theory] = float(np.sqrt(np.mean((600.0 * np.log2(ratios)) ** 2)))
    return distances


def _thickness_ratio(values: Values, setup: Setup) -> float:
    return float(values["thickness"] / vibrating_lengths(values, setup)[0])


def _edge_words(edges: Mapping[str, str]) -> str:
    return ", ".join(f"{edge} {word}" for edge, word in edges.items())
