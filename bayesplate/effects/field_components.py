"""Components of an uncertain field over the board: the few independent parameters that shift frequencies most.

The components are directions of the covariance of the conditioned field (Karhunen and Loeve's expansion), in the order
of the shifts that they cause in the energies of the lowest products of beam functions. So no parameter is spent on a
direction that no frequency depends on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import ConditionedField, Degrees, Surface, legendre
from bayesplate.board.setup import EdgeConditions
from bayesplate.effects.base import Effect
from bayesplate.effects.part import VibratingPart, vibrating_part
from bayesplate.plate.beams import beam_functions

CARRIED_VARIANCE = 0.95
"""Share of the variance of the energies that the components carry, unless `MOST_COMPONENTS` carry less."""
MOST_COMPONENTS = 3
SMALLEST_SURFACE = 5e-4
"""Root mean square over the board below which a surface counts as zero."""
_N_BEAMS = 4
_RIGID_ENERGY = 1e-6
_NAMED_SHARE = 0.2
"""Share of a surface's mean square above which one of its polynomials is named."""
_PLACE_WORDS = {
    (1, 0): ("towards x0", "towards x1"),
    (0, 1): ("towards y0", "towards y1"),
    (2, 0): ("at mid-length", "at both ends"),
    (0, 2): ("along the middle", "along both sides"),
    (1, 1): ("at the corners x0 y1 and x1 y0", "at the corners x0 y0 and x1 y1"),
}
"""Where a polynomial is highest, with a negative coefficient and with a positive one."""
_MOST_NAMED = 2


@dataclass(frozen=True)
class FieldProfile:
    """A profile 1 + d(x, y), with no mean of d over the board: its expected course and its uncertain components."""

    expected: Surface
    mean_gain: Surface | None  # change of d where the board's mean is one of its standard deviations higher
    components: tuple[Surface, ...]  # change of d where a parameter of standard normal prior is one
    mean: float  # over the board, SI
    mean_sd: float

    @property
    def is_uniform(self) -> bool:
        """Whether the profile is flat and certain: no expected course, and no component."""
        return self.expected.size < SMALLEST_SURFACE and not self.uncertain_changes

    @property
    def uncertain_changes(self) -> tuple[Surface, ...]:
        """All uncertain changes of d: first the one that goes with the mean, if there is one, then the components."""
        return self.components if self.mean_gain is None else (self.mean_gain, *self.components)


@dataclass(frozen=True)
class Mounting:
    """How a setup holds the board: end conditions along x and y, and which part of each side vibrates."""

    ends_x: EdgeConditions
    ends_y: EdgeConditions
    part_x: VibratingPart
    part_y: VibratingPart


def mountings(board: Board) -> tuple[Mounting, ...]:
    return tuple(
        Mounting(setup.ends_x, setup.ends_y, vibrating_part(board, setup, "x"), vibrating_part(board, setup, "y"))
        for setup in board.setups
    )


@lru_cache(maxsize=64)
def field_profile(
    field: ConditionedField, mountings: tuple[Mounting, ...], power: int, mean_is_known: bool
) -> FieldProfile:
    """The profile of a conditioned field, with the components on which frequencies under the mountings depend.

    The stiffness goes with the `power` of the field, the mass with its first power: 3 for a thickness, 1 for a width. A
    mean that is known is no parameter, so that nothing can go with it.
    """

    def surface(coefficients: Floats) -> Surface:
        return Surface(field.degrees, tuple(float(c) for c in coefficients))

    with_mean = np.zeros_like(field.shape) if mean_is_known else field.mean_gain
    if np.linalg.norm(with_mean) < SMALLEST_SURFACE:
        with_mean = np.zeros_like(field.shape)
    covariance = field.covariance - np.outer(with_mean, with_mean)
    shifts_by_coefficient = np.concatenate([_energy_shifts(field.degrees, mounting, power) for mounting in mountings])
    variances, directions = np.linalg.eigh(covariance)
    root = directions * np.sqrt(np.maximum(variances, 0.0))
    _, shifts, turns = np.linalg.svd(shifts_by_coefficient @ root, full_matrices=False)
    carried = np.cumsum(shifts**2) / max(float(np.sum(shifts**2)), 1e-300)
    n_open = min(int(np.searchsorted(carried, CARRIED_VARIANCE)) + 1, MOST_COMPONENTS - bool(with_mean.any()))
    components = (surface(root @ turn) for turn in turns[:n_open])
    return FieldProfile(
        surface(field.shape),
        surface(with_mean) if with_mean.any() else None,
        tuple(component for component in components if component.size >= SMALLEST_SURFACE),
        field.mean,
        field.sd,
    )


def _energy_shifts(degrees: Degrees, mounting: Mounting, power: int) -> Floats:
    """Relative gain of stiffness less that of mass, to first order, per coefficient: (n_energies, n) array.

    One row for each of the three stiffness energies of each product of two beam functions; a frequency's shift is a
    mean of half of them, whatever the constants.
    """
    most = [max(exponents) for exponents in zip(*degrees, strict=True)]
    along = _weighted_energies(mounting.ends_x, mounting.part_x, most[0])
    across = _weighted_energies(mounting.ends_y, mounting.part_y, most[1])
    i, j = np.array(degrees).T
    rows = []
    for orders in ((2, 0), (0, 2), (1, 1)):
        for m in range(_N_BEAMS):
            for n in range(_N_BEAMS):
                if np.isfinite(along[orders[0]][0, m] * across[orders[1]][0, n]):
                    stiffness = along[orders[0]][i, m] * across[orders[1]][j, n]
                    rows.append(power * stiffness - along[0][i, m] * across[0][j, n])
    return np.array(rows)


@lru_cache(maxsize=32)
def _weighted_energies(ends: EdgeConditions, part: VibratingPart, highest: int) -> tuple[Floats, Floats, Floats]:
    """Means of the polynomials over one side, weighted with X^2, X'^2 and X''^2: (highest + 1, n_beams) arrays.

    Not a number where a rigid motion has no such energy.
    """
    beams = beam_functions(ends)
    at = part.on_whole(beams.side.points)
    energies = np.array(
        [
            [beams.integrals(order, order, legendre(degree, at))[:_N_BEAMS] for degree in range(highest + 1)]
            for order in range(3)
        ]
    )
    totals = energies[:, 0].copy()
    totals[totals < _RIGID_ENERGY] = np.nan
    zeroth, first, second = energies / totals[:, None]
    return zeroth, first, second


def field_parameters(effect: Effect, profile: FieldProfile, source: str, comparative: str) -> tuple[Parameter, ...]:
    """The components' parameters: standard normal, zero where the profile is the expected one.

    `comparative` is the word for the board where the field is high: "thicker".
    """
    standard = Quantity.from_mean(0.0, 1.0, "normal")
    return tuple(
        replace(
            effect.parameter(f"field_{k}", standard, "1", 0.0, source, f"shape {k}"),
            description=surface_words(component, profile.mean, comparative),
        )
        for k, component in enumerate(profile.components, start=1)
    )


def surface_words(surface: Surface, mean: float, comparative: str) -> str:
    """Words for where a surface, a fraction of a mean in m, is high, and for its rms.

    `comparative` is "thicker" or "wider".
    """
    terms = sorted(zip(surface.coefficients, surface.degrees, strict=True), key=lambda term: -abs(term[0]))
    named = [(value, degrees) for value, degrees in terms[:_MOST_NAMED] if value**2 >= _NAMED_SHARE * surface.size**2]
    places = [_PLACE_WORDS[degrees][value > 0] if degrees in _PLACE_WORDS else "in waves" for value, degrees in named]
    where = " and ".join(dict.fromkeys(places)) or "in waves"
    return f"at +1 {comparative} {where}, {1e3 * mean * surface.size:.2g} mm rms"


def standard_coordinates(profile: FieldProfile, mean: Floats, components: Sequence[Floats]) -> list[Floats]:
    """Standard coordinates of all uncertain changes: the mean's, where d goes with it, then the components'."""
    if profile.mean_gain is None:
        return list(components)
    return [(np.asarray(mean) - profile.mean) / profile.mean_sd, *components]
