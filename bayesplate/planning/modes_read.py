"""Frequencies of modes that could be read: their mean and variance under each explanation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.sessions import shared_variance_share, unknown_discrepancy_variance
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import Beliefs, ExplanationTerms, FormTerms, KnownBoard, prior_levels
from bayesplate.planning.gains import PlannedReadings
from bayesplate.planning.laws import BareLaw, SolvedStation
from bayesplate.planning.stations import Station

REPEAT_SCATTER = 2e-4
"""Relative scatter of a frequency that is read once more in one session, with five hits on a free board."""


@dataclass(frozen=True, eq=False)
class StationReadings:
    """All readings of frequencies that could be taken in a station."""

    law: BareLaw
    # unread modes, in the session that goes on, or in a new one where the board is held anew
    further: PlannedReadings
    rows: tuple[int, ...]  # their indices among the station's modes
    # indices of the readings at hand that can be taken once more: those which every explanation takes for a mode
    repeatable_rows: tuple[int, ...]
    # these in another session; None where there are none, or where the beliefs are those of the prior
    repeats: PlannedReadings | None
    # these with a known mass, in the session that goes on, by the index of its spot; none with a single explanation:
    # the shifts by a known mass only distinguish explanations
    with_mass: Mapping[int, PlannedReadings]


def station_readings(
    beliefs: Beliefs, known_board: KnownBoard, law: BareLaw, rng: np.random.Generator
) -> StationReadings:
    """All readings that could be taken in a station of a board, as each explanation expects them."""
    station, board = law.station, known_board.board
    n, n_old = len(station.setup.readings), station.n_old
    expected = [_expected_modes(explanation, known_board, law) for explanation in beliefs.explanations]
    is_followed = np.all([np.isfinite(shift).all(axis=0) for shift, _ in expected], axis=0)
    own_variance = ReadingErrors.of(station.setup).own_variance + unknown_discrepancy_variance(board, station.setup)
    setup_index = known_board.first_setup + [setup.name for setup in board.setups].index(station.base.name)
    kept_variances = [explanation.noise[:, setup_index] ** 2 for explanation in beliefs.explanations]
    new_variances = [
        prior_levels(station.setup.noise, explanation.n_terms, rng) ** 2 for explanation in beliefs.explanations
    ]

    def readings(rows: Sequence[int], noise: Sequence[Floats], spot: int = 0) -> PlannedReadings:
        columns = [spot * n + row for row in rows]
        return PlannedReadings(
            tuple(shift[:, columns] for shift, _ in expected),
            tuple(slopes[:, columns] for _, slopes in expected),
            tuple(level[:, None] + own_variance[list(rows)] for level in noise),
        )

    rows = [i for i in range(n_old, n) if is_followed[i]]
    repeatable_rows = [i for i in range(n_old) if is_followed[i]]
    further = readings(rows, new_variances if station.is_new else kept_variances)
    repeated, with_mass = None, {}
    if repeatable_rows and not beliefs.is_prior:
        other_day = [np.full(len(level), shared_variance_share(station.base)) for level in kept_variances]
        repeated = repeat_readings(
            station, repeatable_rows, readings(repeatable_rows, new_variances), kept_variances, other_day
        )
    if repeated and len(beliefs.explanations) > 1:
        same_day = [np.maximum(1.0 - REPEAT_SCATTER**2 / level, 0.0) for level in kept_variances]
        once_more = repeat_readings(
            station, repeatable_rows, readings(repeatable_rows, kept_variances), kept_variances, same_day
        )
        for spot, mass_shift_sd in enumerate(law.mass_shift_sd[:, repeatable_rows]):
            added = readings(repeatable_rows, kept_variances, 1 + spot)
            if all(np.isfinite(values).all() for values in added.shift):
                shift = tuple(a + b for a, b in zip(once_more.shift, added.shift, strict=True))
                variance = tuple(level + mass_shift_sd**2 for level in once_more.variance)
                slopes = tuple(a + b for a, b in zip(once_more.slopes, added.slopes, strict=True))
                with_mass[spot] = PlannedReadings(shift, slopes, variance)
    return StationReadings(law, further, tuple(rows), tuple(repeatable_rows), repeated, with_mass)


def repeat_readings(
    station: Station,
    indices: Sequence[int],
    readings: PlannedReadings,
    first_variances: Sequence[Floats],
    shares: Sequence[Floats],
) -> PlannedReadings:
    """Repeats of some readings at hand, by their indices, conditional on the first readings.

    A repeat shares a part of the first reading's noise. `readings` are the repeats with independent noise;
    `first_variances` is the variance of the first readings' noise and `shares` the part of it that a repeat shares,
    (n_terms,) arrays by explanation.
    """
    rows = list(indices)
    first, own_variance = np.log(station.base.measured)[rows], ReadingErrors.of(station.base).own_variance[rows]
    new = ReadingErrors.of(station.setup).own_variance[rows]
    by_explanation = []
    for k, (first_variance, terms_share) in enumerate(zip(first_variances, shares, strict=True)):
        share = terms_share[:, None]
        common = share * first_variance[:, None]
        weight = common / (first_variance[:, None] + own_variance)
        shift = (1.0 - weight) * readings.shift[k] + weight * first
        variance = new + (1.0 - share) * (readings.variance[k] - new) + common * (1.0 - weight)
        by_explanation.append((shift, (1.0 - weight)[:, :, None] * readings.slopes[k], variance))
    return PlannedReadings.of(by_explanation)


def _expected_modes(explanation: ExplanationTerms, known_board: KnownBoard, law: BareLaw) -> tuple[Floats, Floats]:
    """The modes where u is zero, then their shifts by a known mass at each spot; and the slopes of both.

    Arrays of (n_terms, (1 + n_spots) n_modes) and (.., n_u). NaN where an explanation takes a reading for no mode, or a
    mode cannot be followed.
    """
    station, n = law.station, len(law.middle)
    shift = np.tile(np.concatenate([law.middle, law.solved[1:].ravel()]), (explanation.n_terms, 1))
    slopes = np.zeros((*shift.shape, explanation.mean.shape[1]))
    own_slopes = law.slopes @ known_board.columns
    slopes[:, :n, : own_slopes.shape[2]] = own_slopes[np.arange(explanation.n_terms) % len(own_slopes)]
    add_effects(explanation, known_board, law, shift, slopes)
    if explanation.readings_at_hand is None or not station.n_old:
        return shift, slopes
    reading_index, setups, read_rows = np.arange(n), known_board.board.setups, slice(station.n_old)
    start = sum(len(setup.readings) for setup in setups[: [setup.name for setup in setups].index(station.base.name)])
    at_hand = slice(start, start + station.n_old)
    reading_index[read_rows] = np.where(
        explanation.readings_at_hand.reading_index[at_hand] < 0,
        -1,
        explanation.readings_at_hand.reading_index[at_hand] - start,
    )
    columns = np.arange(shift.shape[1]).reshape(-1, n)[:, reading_index].ravel()
    shift, slopes = shift[:, columns], slopes[:, columns]
    shift[:, read_rows], slopes[:, read_rows] = (
        explanation.readings_at_hand.shift[:, at_hand],
        explanation.readings_at_hand.slopes[:, at_hand],
    )
    return np.where(np.tile(reading_index < 0, len(law.solved)), np.nan, shift), slopes


_SIZE_QUANTILES = (0.03, 0.97)
"""Quantiles of a size over the terms at which the modes are solved besides its mean."""
_NO_SIDE = 1e-9
"""Standard deviations of a size below which it has no side."""
_MOST_SHIFT = 0.4
"""A shift of ln f beyond which a mode has lost its name."""


def add_effects(
    explanation: ExplanationTerms, known_board: KnownBoard, law: BareLaw, shift: Floats, slopes: Floats
) -> None:
    """Add the effects of an explanation to the expected modes of a station, in place.

    They are added to the shift where u is zero, (n_terms, (1 + n_spots) n_modes), of the modes, then of the shifts by a
    known mass at each spot, and to the slopes, (.., n_u). NaN where a mode cannot be followed at the middle of a size,
    or to either side of it.

    The effects are solved in full at a few likely sizes, with the constants that the readings then give, and a parabola
    is laid along each size: the remainder beside the linear law of the constants is small and smooth. Each term is
    linear about its own place on the parabola.
    """
    n = len(law.middle)
    for form in explanation.forms:
        mean = explanation.mean[form.rows]
        sizes, covariance = mean[:, form.columns], explanation.covariance[form.rows][:, form.columns, form.columns]
        bounds = np.array([parameter.prior.standard_bounds for parameter in form.parameters]).reshape(-1, 2).T
        # normal terms may have their mean beyond a bound
        centre, narrow = np.clip(sizes.mean(axis=0), *bounds), np.sqrt(covariance.mean(axis=0))
        low, high = np.quantile(sizes, _SIZE_QUANTILES, axis=0)
        ends = np.stack([np.minimum(low, centre - narrow), np.maximum(high, centre + narrow)])
        reach = np.clip(ends, *bounds) - centre
        # regression of the constants on the sizes
        design = np.column_stack([np.ones(len(mean)), sizes - centre])
        constants = np.linalg.lstsq(design, mean[:, : known_board.board.symmetry.n], rcond=None)[0]

        to_either_side = (np.outer(sides, unit) for sides, unit in zip(reach.T, np.eye(centre.size), strict=True))
        steps = np.concatenate([[0.0 * centre], *to_either_side])
        followed = np.column_stack([np.ones(len(steps)), steps]) @ constants
        pairs = zip(centre + steps, followed, strict=True)
        solved = np.stack([_form_shift(known_board, law, form, point, moved) for point, moved in pairs])
        shift[form.rows] += solved[0]
        for j, column in enumerate(form.columns):
            sides, pair = reach[:, j], solved[1 + 2 * j : 3 + 2 * j] - solved[0]
            linear, square = parabola_through(sides, pair, n)
            place = np.clip(sizes[:, j] - centre[j], *sides)[:, None]
            slope = linear + 2.0 * square * place
            shift[form.rows] += linear * place + square * place**2 - slope * sizes[:, j, None]
            slopes[form.rows, :, column] += slope


def parabola_through(sides: Floats, pair: Floats, n_followed: int) -> tuple[Floats, Floats]:
    """Linear and square coefficient of each column of a (2, n) pair of values at two sides of zero, where it is zero.

    A straight line where a size is at its bound, so that it has one side only, and in the first `n_followed` columns
    where a mode is followed to one side only; zero where a size has no side.
    """
    at_bound = np.abs(sides) < _NO_SIDE
    if at_bound.all():
        return np.zeros(pair.shape[1]), np.zeros(pair.shape[1])
    sides = np.where(at_bound, -sides[::-1], sides)
    pair = np.where(at_bound[:, None], -pair[::-1], pair)
    straight = pair[::-1] * (sides / sides[::-1])[:, None]
    pair[:, :n_followed] = np.where(np.isnan(pair), straight, pair)[:, :n_followed]
    linear, square = np.linalg.solve(np.column_stack([sides, sides**2]), pair)
    return linear, square


def _form_shift(known_board: KnownBoard, law: BareLaw, form: FormTerms, sizes: Floats, constants: Floats) -> Floats:
    """Change of the modes by a form at some sizes, less the linear law of the constants: ((1 + n_spots) n_modes,).

    Solved on the mesh for the estimate's constants, so that all sizes of a form have the same matrices.
    """
    exact = {name: np.asarray(q.mean) for name, q in form.board.inputs.items() if q.is_exact}
    named = {
        parameter.name: np.asarray(parameter.prior.value(z))
        for parameter, z in zip(form.parameters, sizes, strict=True)
    }
    values, symmetry = {**exact, **known_board.values, **named}, known_board.board.symmetry
    log_constants = np.log(symmetry.free_of(known_board.values))
    moved_values, mesh_values = (
        {**values, **symmetry.rigidities(np.exp(logs), values["poisson_xy"])}
        for logs in (log_constants + constants, log_constants)
    )
    with np.errstate(invalid="ignore", divide="ignore"):  # far out a form need not be a plate
        solved = SolvedStation.of(law.station, form.board, moved_values, mesh_values)
        shift = solved.log_hertz_and_mass_shifts - law.solved
    shift[0] -= law.slopes[0, :, : log_constants.size] @ constants
    shift[:, ~(np.abs(shift[0]) <= _MOST_SHIFT)] = np.nan
    return np.asarray(shift.ravel())
