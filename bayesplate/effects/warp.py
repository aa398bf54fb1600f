"""Warp: a board that is not flat stretches where it bends, and its lowest modes ring higher."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from bayesplate.board.board import Board, Values, board_density
from bayesplate.board.parameter import BOARD_OWNER, Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Contribution, Effect, Floats, Scope, Stiffness
from bayesplate.effects.part import aspect_ratio_of
from bayesplate.plate.fields import Field, Outline
from bayesplate.plate.membrane import MODULI, Curvature, curvature_pairs, membrane_terms
from bayesplate.plate.terms import ProjectedTerms, Term

RISES: tuple[Curvature, ...] = ("cup", "bow", "twist")
"""The rises that a maker reads: across the width, along the length, of the fourth corner."""

_PRIOR_SPREADS = {"cup": 0.005, "bow": 0.004, "twist": 0.01}
_PRIOR_SOURCES = {
    "cup": "half-normal: half a per cent of the width; turning the board over changes nothing",
    "bow": "normal: 0.4 per cent of the length; below zero the board is a saddle, above a dome",
    "twist": "half-normal: one per cent of the longer side; turning the board over changes nothing",
}
_ONE_CENT = 2.0 * np.log(2.0) / 1200.0
"""Relative rise of omega^2 that is one cent of frequency."""


@dataclass(frozen=True)
class Warp(Effect):
    """A stress-free shape of three constant curvatures, as read with a straightedge and feeler gauges.

    Cup, the rise across the width, makes k_y = 8 cup / L_y^2; bow, the rise along the length, k_x = 8 bow / L_x^2;
    twist, the lift of the fourth corner off a table, k_xy = twist / (L_x L_y), the sides of the whole board where it is
    widest. All of a plate's membrane is in `bayesplate.plate.membrane`: the in-plane fields are those of the moduli
    where the plate is solved. Edges that are clamped hold the board in its plane, others do not; inertia in the plane
    is left out, so is an angle of the grain there.

    All signs at once change nothing, and that of the twist alone nothing either: cup and twist are positive, the sign
    of the bow tells a dome from a saddle.
    """

    rises: tuple[tuple[Curvature, Quantity, str], ...] = ()  # name, rise in m, source of its prior (empty: the card)
    aspect_ratio: float = 1.0  # L_x / L_y of the vibrating part, L_y where it is widest
    edge: Outline | None = None  # where the plate ends; None: the whole rectangle

    name: ClassVar[str] = "warp"
    scope: ClassVar[Scope] = "board"
    sentence: ClassVar[str] = (
        "The board is not flat, so its lowest modes ring higher: lay a straightedge across it and along it, and see "
        "whether it rocks on a flat table. Supports at a few places raise the same modes."
    )
    references: ClassVar[tuple[str, ...]] = (
        "Donnell, L. H., Stability of thin-walled tubes under torsion, NACA report 479 (1933), for the shallow shell",
    )

    @classmethod
    def of(cls, board: Board, setup: Setup) -> Warp:
        """The effect with what the board states of its rises, and priors for the others."""
        rises = ((name, *_rise_prior(board, name)) for name in RISES)
        nonzero = tuple(rise for rise in rises if not (rise[1].is_exact and rise[1].mean == 0.0))
        return cls(BOARD_OWNER, nonzero, aspect_ratio_of(board.nominal(), setup))

    @classmethod
    def is_implied(cls, board: Board) -> bool:
        return bool(board.warp)

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        if board.warp or _can_shift_modes(board):
            return ""
        return "the board is so thick that the warp of a sawn board would move no mode by a cent"

    def in_setup(self, board: Board, setup: Setup) -> Warp | None:
        if self.refusal(board, setup):
            return None
        return replace(self, aspect_ratio=aspect_ratio_of(board.nominal(), setup))

    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(self.parameter(name, rise, "m", 0.0, source) for name, rise, source in self.rises)

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """The halves stay alike, except with a twist and another curvature: together they make the corners differ."""
        is_both = len(self.rises) > 1 and any(name == "twist" for name, *_ in self.rises)
        return not is_both, not is_both

    def within_outline(self, shaped: Effect) -> Warp:
        low, high = (shaped.from_plate(0.5, end)[1] for end in (0.0, 1.0))
        return replace(self, aspect_ratio=self.aspect_ratio / (high - low), edge=shaped.outline())

    def contributions(self) -> tuple[Contribution, ...]:
        """Membrane energies: the product of two curvatures and a modulus, over the density."""
        curvatures = tuple(name for name, *_ in self.rises)
        if not curvatures:
            return ()

        pairs = curvature_pairs(curvatures)

        def terms(values: Values, field: Field | None) -> tuple[Term, ...]:
            moduli = tuple(float(modulus) for modulus in np.ravel(_moduli(values)))
            membrane = partial(
                membrane_terms,
                aspect_ratio=self.aspect_ratio,
                moduli=tuple(round(modulus / max(moduli), 6) for modulus in moduli),
                curvatures=curvatures,
                thickness=field,
                outline=self.edge,
            )
            return (ProjectedTerms(membrane, len(pairs) * len(MODULI)),)

        def weight(values: Values, setup: Setup) -> Floats:
            moduli = _moduli(values) / np.asarray(board_density(values))[..., None]
            curvature = self._curvatures(values)
            columns = [np.asarray(curvature[first] * curvature[second])[..., None] * moduli for first, second in pairs]
            return np.concatenate(np.broadcast_arrays(*columns), axis=-1)

        return (Stiffness(terms, weight),)

    def _curvatures(self, values: Values) -> Mapping[Curvature, Floats]:
        """Curvatures of the board by the name of the rise, 1/m."""
        length_x, length_y = (np.asarray(values[f"length_{axis}"]) for axis in "xy")
        per_rise = {"cup": 8.0 / length_y**2, "bow": 8.0 / length_x**2, "twist": 1.0 / (length_x * length_y)}
        return {name: self.value(values, name) * per_rise[name] for name, *_ in self.rises}


def _rise_prior(board: Board, name: Curvature) -> tuple[Quantity, str]:
    """A rise as stated, or the prior of a sawn board."""
    if name in board.warp:
        return board.warp[name], ""
    length_x, length_y = (board.inputs[f"length_{axis}"].mean for axis in "xy")
    side = {"cup": length_y, "bow": length_x, "twist": max(length_x, length_y)}[name]
    lower = -np.inf if name == "bow" else 0.0
    return Quantity.from_mean(0.0, _PRIOR_SPREADS[name] * side, "normal", lower=lower), _PRIOR_SOURCES[name]


def _can_shift_modes(board: Board) -> bool:
    """Whether a rise c of its prior's spread stiffens a section, by (4/45) c^2 / (h^2 / 12), by more than one cent."""
    length_x, length_y, thickness = (board.inputs[name].mean for name in ("length_x", "length_y", "thickness"))
    rise = max(_PRIOR_SPREADS["cup"] * length_y, _PRIOR_SPREADS["bow"] * length_x)
    return bool(4.0 / 45.0 * 12.0 * (rise / thickness) ** 2 > _ONE_CENT)


def _moduli(values: Values) -> Floats:
    """Q_11, Q_12, Q_22 and Q_66 of plane stress, Pa: (..., 4) array."""
    cube = 12.0 / np.asarray(values["thickness"]) ** 3
    D_x, D_y, D_s = (np.asarray(values[name]) for name in ("D_x", "D_y", "D_s"))
    columns = (D_x * cube, np.asarray(values["poisson_xy"]) * D_y * cube, D_y * cube, 0.25 * D_s * cube)
    return np.stack(np.broadcast_arrays(*columns), axis=-1)
