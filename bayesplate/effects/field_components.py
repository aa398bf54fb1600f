"""What is left open of a field over the board, as few independent parameters: those that move frequencies most.

The components are directions of the covariance of the conditioned field (Karhunen and Loeve's expansion), taken in the
order of what they do to the energies of the lowest products of beam functions. So no parameter is spent on what no
frequency sees.
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
from bayesplate.board.setup import Ends
from bayesplate.effects.base import Effect
from bayesplate.effects.part import Part, vibrating_part
from bayesplate.plate.beams import beam_functions

CARRIED = 0.95
"""Share of the variance of the energies that the components carry, where `MOST` of them can."""
MOST = 3
SMALLEST = 5e-4
"""Root mean square over the board below which a surface is nothing."""
_N_BEAMS = 4
_HELD = 1e-6
_TOLD = 0.2
"""Share of a surface's mean square from which on one of its polynomials is told."""
_WHERE = {
    (1, 0): ("towards x0", "towards x1"),
    (0, 1): ("towards y0", "towards y1"),
    (2, 0): ("at mid-length", "at both ends"),
    (0, 2): ("along the middle", "along both sides"),
    (1, 1): ("at the corners x0 y1 and x1 y0", "at the corners x0 y0 and x1 y1"),
}
"""Where a polynomial has its highest places, with a negative coefficient and with a positive one."""
_MOST_TOLD = 2


@dataclass(frozen=True)
class FieldProfile:
    """A profile 1 + d(x, y), with no mean of d over the board: what is expected, and what is open."""

    expected: Surface
    with_mean: Surface | None  # what d gains where the board's mean is one of its standard deviations higher
    components: tuple[Surface, ...]  # what d gains where a parameter of standard normal prior is one
    mean: float  # over the board, SI
    mean_sd: float

    @property
    def is_uniform(self) -> bool:
        """Whether there is nothing to be done: no course of the profile, and nothing open."""
        return self.expected.size < SMALLEST and not self.open

    @property
    def open(self) -> tuple[Surface, ...]:
        """Everything that d gains besides what is expected: with the mean first, where it does, then the components."""
        return self.components if self.with_mean is None else (self.with_mean, *self.components)


@dataclass(frozen=True)
class Held:
    """How a setup holds the board: its ends, and which part of it vibrates."""

    ends_x: Ends
    ends_y: Ends
    part_x: Part
    part_y: Part


def held_in(board: Board) -> tuple[Held, ...]:
    return tuple(
        Held(one.ends_x, one.ends_y, vibrating_part(board, one, "x"), vibrating_part(board, one, "y"))
        for one in board.setups
    )


@lru_cache(maxsize=64)
def field_profile(found: ConditionedField, held: tuple[Held, ...], power: int, mean_is_known: bool) -> FieldProfile:
    """The profile of a field, with the components that the frequencies of the setups, as they hold the board, see.

    The stiffness goes with the `power` of the field, the mass with its first: 3 for a thickness, 1 for a width. A mean
    that is known is no parameter, so that nothing can go with it.
    """

    def surface(coefficients: Floats) -> Surface:
        return Surface(found.degrees, tuple(float(one) for one in coefficients))

    with_mean = np.zeros_like(found.shape) if mean_is_known else found.with_mean
    if np.linalg.norm(with_mean) < SMALLEST:
        with_mean = np.zeros_like(found.shape)
    left = found.covariance - np.outer(with_mean, with_mean)
    seen = np.concatenate([_energy_shifts(found.degrees, one, power) for one in held])
    variances, directions = np.linalg.eigh(left)
    root = directions * np.sqrt(np.maximum(variances, 0.0))
    _, shifts, turns = np.linalg.svd(seen @ root, full_matrices=False)
    carried = np.cumsum(shifts**2) / max(float(np.sum(shifts**2)), 1e-300)
    n_open = min(int(np.searchsorted(carried, CARRIED)) + 1, MOST - bool(with_mean.any()))
    components = (surface(root @ turn) for turn in turns[:n_open])
    return FieldProfile(
        surface(found.shape),
        surface(with_mean) if with_mean.any() else None,
        tuple(one for one in components if one.size >= SMALLEST),
        found.mean,
        found.sd,
    )


def _energy_shifts(degrees: Degrees, held: Held, power: int) -> Floats:
    """Relative gain of stiffness less that of mass, to first order, per coefficient: (n_energies, n) array.

    Of each of the three stiffness energies of each product of two beam functions; a frequency's shift is a mean of
    half of them, whatever the constants.
    """
    most = [max(both) for both in zip(*degrees, strict=True)]
    along = _weighted_energies(held.ends_x, held.part_x, most[0])
    across = _weighted_energies(held.ends_y, held.part_y, most[1])
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
def _weighted_energies(ends: Ends, part: Part, highest: int) -> tuple[Floats, Floats, Floats]:
    """Means of the polynomials over one side, weighted with X^2, X'^2 and X''^2: (highest + 1, n_beams) arrays.

    Not a number where a rigid motion has no such energy.
    """
    beams = beam_functions(ends)
    at = part.on_whole(beams.side.points)
    found = np.array(
        [
            [beams.integrals(order, order, legendre(degree, at))[:_N_BEAMS] for degree in range(highest + 1)]
            for order in range(3)
        ]
    )
    whole = found[:, 0].copy()
    whole[whole < _HELD] = np.nan
    zero, one, two = found / whole[:, None]
    return zero, one, two


def field_parameters(effect: Effect, profile: FieldProfile, source: str, more: str) -> tuple[Parameter, ...]:
    """The components' parameters: standard normal, zero where the profile is the expected one.

    `more` says what the board is where the field is high: "thicker".
    """
    standard = Quantity.from_mean(0.0, 1.0, "normal")
    return tuple(
        replace(
            effect.parameter(f"field_{k}", standard, "1", 0.0, source, f"shape {k}"),
            look=look(component, profile.mean, more),
        )
        for k, component in enumerate(profile.components, start=1)
    )


def look(surface: Surface, mean: float, more: str) -> str:
    """Words for where a surface, a fraction of a mean in m, is high, and for its size; `more`: "thicker" or "wider"."""
    terms = sorted(zip(surface.coefficients, surface.degrees, strict=True), key=lambda one: -abs(one[0]))
    told = [(value, degrees) for value, degrees in terms[:_MOST_TOLD] if value**2 >= _TOLD * surface.size**2]
    places = [_WHERE[degrees][value > 0] if degrees in _WHERE else "in waves" for value, degrees in told]
    where = " and ".join(dict.fromkeys(places)) or "in waves"
    return f"at +1 {more} {where}, {1e3 * mean * surface.size:.2g} mm rms"


def coordinates(profile: FieldProfile, mean: Floats, components: Sequence[Floats]) -> list[Floats]:
    """Standard coordinates of everything that is open: the mean's, where d goes with it, then the components'."""
    if profile.with_mean is None:
        return list(components)
    return [(np.asarray(mean) - profile.mean) / profile.mean_sd, *components]
