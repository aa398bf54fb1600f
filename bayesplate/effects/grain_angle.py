"""Grain angle: the grain runs at an angle to the long side of the board."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayesplate.board.board import Board, Values, vibrating_lengths
from bayesplate.board.parameter import Parameter
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.attached_mass import AttachedMass
from bayesplate.effects.base import Effect, Scope
from bayesplate.effects.exciter import Exciter
from bayesplate.plate.terms import Weights
from bayesplate.plate.thin import THIN_TERMS

DEGREE = np.pi / 180.0
DEFAULT_ANGLE = Quantity.from_mean(0.0, 3.0 * DEGREE, "normal", lower=0.0, upper=6.0 * DEGREE)
_PLACED = AttachedMass.name, Exciter.name
_SOURCE = (
    "half-normal of 3 degrees up to 6: boards are sawn along the grain by eye; a rectangle rings alike for either sign"
)


@dataclass(frozen=True)
class GrainAngle(Effect):
    """Stiffness turned by an angle; D_x, D_y, D_s and nu_xy stay those along and across the grain.

    All terms keep their form, with weights that are functions of the angle; the coupling of bending with twist (D_16,
    D_26), and of the two shear strains, joins them. Q' = T^-1 Q R T R^-1: Mascia and Lahr (2006).

    Where the plate mirrors about a middle line both signs give the same frequencies, and one sign stands for both. An
    item at a corner, or a thickness that was read at places, makes them differ: with 3 g on 250 g the signs are up to
    50 cents apart at 3 degrees. A search tries both there, and `notes` says that a fit has tried one sign only.
    """

    sign: int = 0  # 1 or -1, from x towards y or away from it, where both signs are tried; 0: one stands for both

    name: ClassVar[str] = "grain_angle"
    scope: ClassVar[Scope] = "board"
    sentence: ClassVar[str] = "The grain runs at an angle to the sides, so bending and twist are no longer separate."
    turns_grain: ClassVar[bool] = True
    references: ClassVar[tuple[str, ...]] = (
        "N. T. Mascia, F. A. R. Lahr: Remarks on orthotropic elastic models applied to wood. Materials Research 9, "
        "301-310 (2006), doi:10.1590/S1516-14392006000300010. [the turned grain]",
    )

    @classmethod
    def of(cls, board: Board, setup: Setup) -> GrainAngle:
        return cls()

    @classmethod
    def refusal(cls, board: Board, setup: Setup) -> str:
        return "the board is isotropic: turned by any angle it is the same" if board.isotropic else ""

    @classmethod
    def candidates(cls, board: Board, setup: Setup) -> tuple[GrainAngle, ...]:
        """Both signs where they are two boards, in one setup at least."""
        if cls.refusal(board, setup):
            return ()
        return tuple(cls(sign=sign) for sign in ((1, -1) if _signs_differ(board) else (0,)))

    @property
    def detail(self) -> str:
        """Which way the grain is turned, where the signs differ."""
        return {0: "", 1: "from x towards y", -1: "from x away from y"}[self.sign]

    @classmethod
    def notes(cls, board: Board) -> tuple[str, ...]:
        """A sentence that the other sign of the angle is another board, where the plate has no mirror line."""
        are_both_tried = any(form.sign for form in board.effect_forms if isinstance(form, cls))
        if cls.name not in board.effects or are_both_tried or not _signs_differ(board):
            return ()
        return (
            "the sign of the grain angle counts on this board, which its edges, what is attached and what was read at "
            "places leave without a line to mirror about, and only angles from x towards y are tried: fit it with y0 "
            "and y1 exchanged and all places mirrored as well, and take the better of the two fits",
        )

    def parameters(self) -> tuple[Parameter, ...]:
        return (self.parameter(self._angle_key, DEFAULT_ANGLE, "rad", 0.0, _SOURCE, self._angle_key.replace("_", " ")),)

    @property
    def _angle_key(self) -> str:
        return "angle_away_from_y" if self.sign < 0 else "angle"

    def keeps_symmetry(self) -> tuple[bool, bool]:
        """Neither half mirrors the other; only half a turn leaves the plate as it was."""
        return False, False

    def reweigh(self, base: Weights, values: Values, setup: Setup) -> Weights:
        """Weights of the plate's own terms turned by the angle, then those of the coupling terms."""
        length_x, length_y = vibrating_lengths(values, setup)
        ratio = length_x / length_y
        angle = self.value(values, self._angle_key)
        cosine, sine = np.cos(angle), (-1.0 if self.sign < 0 else 1.0) * np.sin(angle)
        cc, ss, cs = cosine**2, sine**2, cosine * sine
        xx, yy, mix, xy = base.stiffness[:, : len(THIN_TERMS)].T
        # Rigidities over m L_x L_y, with D_66 = D_s / 4.
        d_11, d_22, d_12, d_66 = xx * ratio**2, yy / ratio**2, mix, xy / 4.0
        mixed = d_12 + 2.0 * d_66
        left, right = d_11 - mixed, mixed - d_22
        turned = [
            (d_11 * cc**2 + 2.0 * mixed * cs**2 + d_22 * ss**2) / ratio**2,
            (d_11 * ss**2 + 2.0 * mixed * cs**2 + d_22 * cc**2) * ratio**2,
            d_12 + (left - right) * cs**2,
            4.0 * (d_66 + (left - right) * cs**2),
        ]
        coupling = [cs * (left * cc + right * ss) / ratio, cs * (left * ss + right * cc) * ratio]
        if base.stiffness.shape[1] > len(THIN_TERMS):
            shear_x, shear_y = base.stiffness[:, len(THIN_TERMS) :].T
            s_x, s_y = shear_x * ratio, shear_y / ratio
            turned += [(s_x * cc + s_y * ss) / ratio, (s_x * ss + s_y * cc) * ratio]
            coupling.append((s_x - s_y) * cs)
        return Weights(np.stack(np.broadcast_arrays(*turned, *coupling), axis=-1), base.mass)


def _signs_differ(board: Board) -> bool:
    """Whether a plate of the board has no line to mirror about, in one setup at least."""
    return any(_lacks_mirror_line(board, setup) for setup in board.setups)


def _lacks_mirror_line(board: Board, setup: Setup) -> bool:
    """Whether edges, attached items and profiles that were read leave a plate without a line to mirror about.

    A taper or gradient that was not read may as well be the mirrored one.
    """
    from bayesplate.effects import effects_of

    effects = [effect for effect in effects_of(board, setup) if effect.name in _PLACED or effect.is_implied(board)]
    edges = (setup.ends_x[0] == setup.ends_x[1], setup.ends_y[0] == setup.ends_y[1])
    return not any(edges[axis] and all(effect.is_own_mirror()[axis] for effect in effects) for axis in (0, 1))
