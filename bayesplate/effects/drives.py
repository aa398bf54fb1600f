"""An exciter as a board carries it: its masses, its spring, and the places where it may be."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import EdgeConditions, Setup
from bayesplate.effects.attached_items import Fractions, fractions_on
from bayesplate.effects.base import Floats

_MASS = Quantity.from_median(50e-3, 1.6), "log-normal: voice-coil exciters weigh 20-120 g"
_COIL = Quantity.from_median(1.6e-3, 1.3), "log-normal: the coils of exciters of 25 mm weigh 1.5-1.8 g"
_SUSPENSION = (
    Quantity.from_median(2700.0, 1.5),
    "log-normal: suspensions of exciters of 25 mm were measured at 2650-2810 N/m; others differ by half",
)
_PLACES_A_SIDE = 8


@dataclass(frozen=True)
class PlaceRange:
    """Range along one side where an exciter may be, as fractions of the vibrating part; one place where it is known."""

    low: float
    high: float
    n_nodes: int = 1  # of the polynomial that the squared deflection is between them

    @property
    def nodes(self) -> Floats:
        """Chebyshev's points of the second kind, or the place itself."""
        if self.n_nodes == 1:
            return np.array([self.low])
        steps = np.cos(np.pi * np.arange(self.n_nodes) / (self.n_nodes - 1))
        return np.asarray(self.low + 0.5 * (self.high - self.low) * (1.0 - steps))

    def shares(self, at: Floats) -> Floats:
        """Share of each node in a polynomial's value at places: (..., n_nodes) array, summing to one.

        A place beyond the ends, where the prior is zero but a proposal may fall, counts as the end: far from its nodes
        a polynomial loses all digits. Lagrange's polynomials in their barycentric form (Berrut and Trefethen, SIAM
        Review 46, 2004).
        """
        if self.n_nodes == 1:
            return np.ones((*np.shape(at), 1))
        nodes = self.nodes
        signs = (-1.0) ** np.arange(self.n_nodes)
        signs[[0, -1]] *= 0.5
        distances = np.clip(at, self.low, self.high)[..., None] - nodes
        is_node = np.abs(distances) < 1e-12
        weights = signs / np.where(is_node, 1.0, distances)
        weights = np.where(is_node.any(axis=-1, keepdims=True), is_node, weights)
        return np.asarray(weights / weights.sum(axis=-1, keepdims=True))


@dataclass(frozen=True)
class Drive:
    """One exciter: its masses and its suspension; a source is empty where the card states the value."""

    mass: tuple[Quantity, str]  # kg, of the whole
    coil: tuple[Quantity, str]  # kg, with what is glued to the board
    suspension: tuple[Quantity, str]  # N/m, or the resonance of the magnet on its suspension, Hz
    is_resonance: bool = False
    is_held: bool = False  # the magnet is held, so that the suspension is a spring to the ground
    places: Fractions = ()  # several are those over which it roved, none: anywhere


def drive_of(board: Board, setup: Setup, item: AttachedItem) -> Drive:
    """An exciter of the card, with the priors of its kind for what the card does not state."""
    suspension = item.suspension if item.resonance is None else item.resonance
    return Drive(
        mass=_MASS if item.mass is None else (item.mass, ""),
        coil=_COIL if item.coil is None else (item.coil, ""),
        suspension=_SUSPENSION if suspension is None else (suspension, ""),
        is_resonance=item.resonance is not None,
        is_held=item.magnet == "held",
        places=fractions_on(board, setup, item.places),
    )


def has_stated_mass(item: AttachedItem) -> bool:
    return item.mass is not None or (item.magnet == "held" and item.coil is not None)


def with_known_coil(drive: Drive) -> Drive:
    """An exciter with the usual coil where the card states none."""
    coil, source = drive.coil
    return replace(drive, coil=(Quantity.exact(coil.median), "")) if source else drive


def places_at_station(places: Fractions, k: int) -> Fractions:
    """The k-th place of an exciter that roved; one that stayed has a single place."""
    return (places[k % len(places)],) if places else ()


def place_shares(low: float, high: float) -> list[float]:
    """Shares of a range of places, so dense that the modes that are read hardly change from one to the next."""
    n_places = round(_PLACES_A_SIDE * (high - low))
    return [(k + 1) / n_places for k in range(n_places)]


def place_range(ends: EdgeConditions) -> tuple[float, float]:
    """Range along a side where an exciter may be, mirror places once, as fractions of the vibrating part."""
    return (0.0, 0.5) if ends[0] == ends[1] else (0.0, 1.0)
