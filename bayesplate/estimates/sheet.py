"""The lowest modes of a setup for its sheet: names, frequencies, energies, shapes, and combined modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.effects.part import aspect_ratio_of
from bayesplate.frequencies.columns import ModalCoefficients, mean_coefficients, modal_coefficients
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import SetupModel
from bayesplate.frequencies.spectrum import NamedMode, spectrum
from bayesplate.frequencies.system import System, WidthLimits
from bayesplate.plate.naming import modes_to_hold
from bayesplate.plate.solve import Modes, collect_modes, solve_classes

COMBINED_NAMES = ("alpha", "beta", "gamma")
"""Combined modes for D_x, D_y and D_s: mixtures of modes that each depend on one constant alone."""

NUMBERS_OF_MODES = (12, 16, 20)
"""Numbers of modes to solve for: the first that includes every measured label, or the last."""

LOWEST_COMBINED = 12
"""Modes that are combined where too few were measured: the lowest six of a long board hardly bend in one direction."""

_GRID = 121
N_POINTS = 61
"""Along each side of the shapes of labelled modes: half a sheet's, for panels of half its size."""
_WORST_CONDITION = 1e3
"""Condition number of modes' coefficients, each constant's scaled to one, beyond which they leave a constant open."""
_TWO_THIRDS = 0.967
"""Standard deviations of a normal distribution on either side of its middle that hold two thirds of it."""
_BY_PRIOR = "by the prior alone"
_BY_MODES = "by what the measured modes tell"


@dataclass(frozen=True, eq=False)
class SheetMode:
    name: str  # its label, or "cannot tell"
    hertz: float
    measured_hz: float | None
    band_hz: tuple[float, float] | None  # where it is expected two times in three
    shares: Floats  # (4,): of D_x, D_y, D_s and of effects in its energy
    coefficients: Floats  # (3,): the paper's a, b, c
    shape: Floats  # (n_x, n_y): of `sample_shapes` at `grid_points`

    @property
    def residual_cents(self) -> float | None:
        """Measured over computed, cents; None if it was not measured."""
        return None if self.measured_hz is None else float(cents(np.log(self.measured_hz / self.hertz)))


@dataclass(frozen=True, eq=False)
class CombinedMode:
    """A mixture of modes that depends on one constant alone: name, modulus, weight of each mode, shape."""

    name: str
    modulus: str
    weights: Mapping[str, float]
    shape: Floats


@dataclass(frozen=True, eq=False)
class Sheet:
    """Everything that a sheet of one setup shows."""

    title: str
    setup: str
    edges: Mapping[str, str]
    first_label: str
    aspect_ratio: float  # L_x / L_y of the part that vibrates, L_y where it is widest
    theory: str
    basis: str  # at which constants the modes are computed
    modes: tuple[SheetMode, ...]  # in the order of frequency
    combined: tuple[CombinedMode, ...]  # empty with fewer than three modes
    likely: str = ""  # what the bands come from
    # where the board begins and ends along y at `grid_points`, as fractions of its widest width; None: a rectangle
    limits: WidthLimits | None = None
    isotropic: bool = False

    def drawn_at(self, x: float, y: float) -> tuple[float, float]:
        """A place, as fractions of the length and of the width there, as fractions of the sides that are drawn."""
        if self.limits is None:
            return x, y
        low, high = (float(np.interp(x, grid_points(), limit)) for limit in self.limits)
        return x, low + y * (high - low)


@dataclass(frozen=True, eq=False)
class Precision:
    """Precision with which the modes measured so far predict the others."""

    covariance: Floats  # (3, 3): of ln D_x, ln D_y, ln D_s
    noise: Mapping[str, float]  # relative, by setup

    def band(self, frequency: float, shares: Floats, setup: str) -> tuple[float, float]:
        """Band, Hz, that holds a reading two times in three, to first order, from (3,) shares in the energy."""
        variance = 0.25 * shares @ self.covariance @ shares + self.noise[setup] ** 2
        factor = float(np.exp(_TWO_THIRDS * np.sqrt(variance)))
        return frequency / factor, frequency * factor


def grid_points(n: int = _GRID) -> Floats:
    """Points of each side, (n,) fractions of it, at which shapes are sampled, all a hair within the edges."""
    return np.linspace(1e-3, 1.0 - 1e-3, n)


def sample_shapes(modes: Modes, limits: WidthLimits | None, grid: Floats) -> Floats:
    """Deflections of modes, (n_modes, n, n), positive next to the corner of x1 and y1.

    The grid is in fractions of the length, and of the width at each of its points; `limits` are those of the plate
    there.
    """
    if limits is None:
        shapes = modes.displacement(grid, grid)
    else:
        low, high = (limit[:, None] for limit in limits)
        shapes = modes.displacement_across(grid, low + (high - low) * grid)
    return np.asarray(shapes * corner_signs(shapes)[:, None, None])


def sheet(
    board: Board,
    system: System,
    values: Values,
    basis: str,
    bands: Mapping[str, tuple[float, float]] | None = None,
    precision: Precision | None = None,
    numbers: Sequence[int] = NUMBERS_OF_MODES,
) -> Sheet:
    """Solve a setup and gather what its sheet shows.

    `basis` says at which constants in one clause. `bands`: factors on a frequency between which the prior expects it,
    by label. `precision`: of the estimate at which the modes are computed, for the bands of the modes that were not
    measured. The first of the `numbers` of modes that holds every measured label is solved, or the last.
    """
    setup = system.setup
    measured = {str(reading.label): reading.frequency.mean for reading in setup.readings}
    for n_modes in numbers:
        modes, named = spectrum(system, values, n_modes)
        if set(measured) <= {mode.name for mode in named}:
            break
    modal = modal_coefficients(system, values, modes.coefficients)
    named, modal = _mean_over_places(system, values, named, modal)
    shares = modal.shares(np.array([float(values[name]) for name in RIGIDITIES]))
    limits = system.limits(grid_points())
    shapes = sample_shapes(modes, limits, grid_points())
    rows = tuple(
        SheetMode(
            name=mode.name,
            hertz=mode.frequency,
            measured_hz=measured.get(mode.name),
            band_hz=(
                precision.band(mode.frequency, shares[i, : len(RIGIDITIES)], setup.name)
                if precision is not None and mode.label is not None and mode.name not in measured
                else _band(mode, bands)
            ),
            shares=shares[i],
            coefficients=modal.coefficients[i],
            shape=shapes[i],
        )
        for i, mode in enumerate(named)
    )
    title = board.title or board.name
    ratio = aspect_ratio_of(system.adjusted(values), setup)
    first_label = str(setup.first_label)
    band_source = "" if all(row.band_hz is None for row in rows) else _BY_MODES if precision is not None else _BY_PRIOR
    mixtures = _combined_modes(rows)
    return Sheet(
        title, setup.name, setup.edges, first_label, ratio, system.theory, basis, rows, mixtures, band_source, limits,
        board.isotropic,
    )  # fmt: skip


def _mean_over_places(
    system: System, values: Values, named: tuple[NamedMode, ...], modal: ModalCoefficients
) -> tuple[tuple[NamedMode, ...], ModalCoefficients]:
    """Modes of the first place of what roved, their frequencies and coefficients those of the mean over its places.

    A mode without a clear name at one of the places is that of the first place alone.
    """
    stations = [(named, modal)]
    for station in system.stations[1:]:
        modes, at_place = spectrum(station, values, len(named))
        stations.append((at_place, modal_coefficients(station, values, modes.coefficients)))
    rows_by_label = [{mode.label: row for row, mode in enumerate(names)} for names, _ in stations]
    coefficients, rest = modal.coefficients.copy(), modal.rest.copy()
    mean_modes = list(named)
    for i, mode in enumerate(named):
        if mode.label is not None and all(mode.label in rows for rows in rows_by_label):
            at_label = [rows[mode.label] for rows in rows_by_label]
            frequencies = np.array([names[row].frequency for (names, _), row in zip(stations, at_label, strict=True)])
            of_mode = [
                ModalCoefficients(m.coefficients[[row]], m.rest[[row]])
                for (_, m), row in zip(stations, at_label, strict=True)
            ]
            (coefficients[i],), (rest[i],) = mean_coefficients(of_mode, frequencies[:, None])
            mean_modes[i] = replace(mode, frequency=float(frequencies.mean()))
    return tuple(mean_modes), ModalCoefficients(coefficients, rest)


def _band(mode: NamedMode, bands: Mapping[str, tuple[float, float]] | None) -> tuple[float, float] | None:
    if bands is None or mode.name not in bands:
        return None
    low, high = bands[mode.name]
    return low * mode.frequency, high * mode.frequency


def _combined_modes(modes: tuple[SheetMode, ...]) -> tuple[CombinedMode, ...]:
    """Combinations of the measured modes, or of the lowest where fewer than three were measured."""
    named = [mode for mode in modes if mode.name.startswith("(")]
    measured = [mode for mode in named if mode.measured_hz is not None]
    combined = measured if len(measured) >= len(RIGIDITIES) else named[:LOWEST_COMBINED]
    if len(combined) < len(RIGIDITIES):
        return ()
    coefficients = np.stack([mode.coefficients for mode in combined])
    if np.linalg.cond(coefficients / np.linalg.norm(coefficients, axis=0)) > _WORST_CONDITION:
        return ()
    shapes = combined_shapes(coefficients, np.stack([mode.shape for mode in combined]))
    mixtures = combination_weights(coefficients)
    return tuple(
        CombinedMode(name, modulus, {m.name: float(w) for m, w in zip(combined, row, strict=True)}, shape)
        for name, modulus, row, shape in zip(COMBINED_NAMES, MODULI, mixtures, shapes, strict=True)
    )


def combination_weights(coefficients: Floats) -> Floats:
    """How much of each mode makes each combined mode, (3, n_modes): the inverse of X = (a, b, c) by Moore and Penrose.

    Its product with X is the unit matrix: the combined psi are d_x, d_y and d_s (Ducceschi et al., section 3).
    ValueError if the modes do not separate the three constants.
    """
    if coefficients.shape[0] < 3 or np.linalg.matrix_rank(coefficients) < 3:
        raise ValueError(f"combined modes: wanted modes that tell three constants apart, got {len(coefficients)} modes")
    return np.asarray(np.linalg.pinv(coefficients))


def combined_shapes(coefficients: Floats, shapes: Floats) -> Floats:
    """Shapes of the combined modes alpha, beta and gamma, (3, n_x, n_y), from (n_modes, n_x, n_y) shapes on one grid.

    Each mode enters with unit norm, positive next to the corner of x1 and y1: the paper does not state its signs, and
    the combined shapes depend on them.
    """
    norms = np.sqrt(np.sum(shapes**2, axis=(1, 2)))
    units = shapes * (corner_signs(shapes) / norms)[:, None, None]
    return np.asarray(np.tensordot(combination_weights(coefficients), units, axes=1))


def corner_signs(shapes: Floats) -> Floats:
    """Sign of each shape next to the corner of x1 and y1, where held edges may be zero themselves."""
    n_x, n_y = shapes.shape[1] // 10 + 2, shapes.shape[2] // 10 + 2
    near = shapes[:, -n_x:, -n_y:].sum(axis=(1, 2))
    return np.where(near < 0, -1.0, 1.0)


def labelled_shapes(models: Sequence[SetupModel], values: Values) -> dict[str, dict[str, Floats]]:
    """Shapes of every labelled mode by setup and label, of `sample_shapes` at `grid_points(N_POINTS)`.

    A label means a rank within a symmetry class, as in the likelihood.
    """
    grid = grid_points(N_POINTS)
    result = {}
    for model in models:
        weights = model.system.weights(values).at(0)
        modes = collect_modes(model.plate, solve_classes(model.plate, weights, modes_to_hold(model.places)))
        rows = {place: i for i, place in enumerate(zip(modes.parities, modes.ranks.tolist(), strict=True))}
        shapes = sample_shapes(modes, model.system.limits(grid), grid)
        result[model.setup.name] = {
            str(label): shapes[rows[place.parity, place.rank]]
            for label, place in zip(model.setup.labels, model.places, strict=True)
        }
    return result
