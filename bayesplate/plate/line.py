"""One side of the plate: cubic Hermite functions on line elements, by scikit-fem.

Where both ends of a side are alike each mode is even or odd about the middle, so that the first half gives the whole:
an even function has no slope in the middle, an odd one no value. Lengths enter later, as weights of the energies.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np

from bayesplate.arrays import Bools, Floats, Indices
from bayesplate.board.setup import EdgeConditions

EndCondition = Literal["clamped", "supported", "guided", "free"]
"""What an end holds: value and slope, the value, the slope, nothing. No card can state a guided end: it is a clamped
end that an effect has released."""
EndConditions = tuple[EndCondition, EndCondition]

N_POINTS = 5
"""Gauss points per element: the product of two cubics, with a field of degree three, is integrated exactly."""
N_POINTS_CUT = 7
"""The same where an outline cuts elements; see `bayesplate.plate.fields`."""

_EDGE_LAYER = (1 / 4, 1 / 16)


@dataclass(frozen=True, eq=False)
class Line:
    """The functions of one side on [0, 1]; value and slope at node i are the unknowns 2 i and 2 i + 1."""

    ends: EdgeConditions  # of the board: they name the modes and tell the rigid motions
    # what the functions hold: the same, or less where an effect has put springs in place of a clamp
    end_conditions: EndConditions
    is_split: bool  # the first half alone
    basis: Any

    @property
    def nodes(self) -> Floats:
        """Ends of the elements, from 0 to 1 or to the middle."""
        return np.asarray(self.basis.mesh.p[0])

    @property
    def n_functions(self) -> int:
        return int(self.basis.N)

    @property
    def share(self) -> float:
        """Integral over the whole side over that of the line's own elements: 2 where the line is split."""
        return 2.0 if self.is_split else 1.0

    @cached_property
    def points(self) -> Floats:
        """Gauss points, element by element: (n_points,) array."""
        return np.asarray(self.basis.global_coordinates())[0].ravel()

    @cached_property
    def weights(self) -> Floats:
        """Weights of the Gauss points in an integral over the whole side: (n_points,) array."""
        return self.share * np.asarray(self.basis.dx).ravel()

    @cached_property
    def local(self) -> Floats:
        """Functions of each element and their two derivatives at its Gauss points: (3, n_elements, n_q, 4) array."""
        functions = [self.basis.basis[i][0] for i in range(4)]
        orders = [[np.asarray(f), f.grad[0], f.hess[0, 0]] for f in functions]
        return np.moveaxis(np.array(orders), 0, -1)

    @cached_property
    def unknowns(self) -> Indices:
        """Unknowns of each element: (n_elements, 4) array."""
        return np.asarray(self.basis.element_dofs.T, dtype=np.intp)

    @cached_property
    def derivatives(self) -> Floats:
        """All functions and their two derivatives at all Gauss points: (3, n_points, n_functions) array."""
        derivatives = np.zeros((3, *self.local.shape[1:3], self.n_functions))
        for element, columns in enumerate(self.unknowns):
            derivatives[:, element][:, :, columns] = self.local[:, element]
        return derivatives.reshape(3, -1, self.n_functions)

    def shapes(self, points: Floats, parity: int = 0) -> Any:
        """Values of the functions at points of [0, 1]: (n_points, n_functions) sparse array.

        The functions of a half line continue beyond the middle with a parity: 0 even, 1 odd.
        """
        positions = np.asarray(points, dtype=np.float64)
        is_beyond = positions > 0.5 if self.is_split else np.zeros(positions.shape, dtype=bool)
        values = self.basis.probes(np.where(is_beyond, 1.0 - positions, positions)[None, :]).tocsr()
        return values.multiply(np.where(is_beyond, (-1.0) ** parity, 1.0)[:, None]).tocsr()

    def at_ends(self, at: tuple[bool, bool], order: int) -> tuple[Floats, Floats]:
        """Values (order 0) or slopes (1) at the selected ends, and their weights in a sum: (n, n_functions), (n,).

        A half line has one end, which is selected together with its mirror image and counts twice.
        """
        ends = [(0, at[0])] if self.is_split else [(0, at[0]), (len(self.nodes) - 1, at[1])]
        nodes = [node for node, is_selected in ends if is_selected]
        rows = np.zeros((len(nodes), self.n_functions))
        rows[np.arange(len(nodes)), [2 * node + order for node in nodes]] = 1.0
        return rows, np.full(len(nodes), self.share)

    def deflection_functions(self, parity: int, is_sheared: bool) -> Bools:
        """Which functions the deflection keeps: (n_functions,) array.

        On a shear-flexible plate the slope at a clamp stays free: it is the angle of the shear strain there.
        """
        fixed = {"clamped": (True, not is_sheared), "supported": (True, False), "guided": (False, not is_sheared)}
        return self._without_fixed([fixed.get(end, (False, False)) for end in self.end_conditions], parity)

    def strain_functions(self, parity: int) -> Bools:
        """Which functions the shear strain along this side keeps: its value is zero where the turning is held."""
        return self._without_fixed([(end in ("clamped", "guided"), False) for end in self.end_conditions], 1 - parity)

    def ties(self) -> list[tuple[int, int]]:
        """Values of the shear strain that are slopes of the deflection, where an end holds the turning."""
        last = self.n_functions - 2
        nodes = (
            [(0, self.end_conditions[0])]
            if self.is_split
            else [(0, self.end_conditions[0]), (last, self.end_conditions[1])]
        )
        return [(value, value + 1) for value, end in nodes if end in ("clamped", "guided")]

    def _without_fixed(self, fixed: list[tuple[bool, bool]], parity: int) -> Bools:
        first, last = fixed
        if self.is_split:
            last = (parity == 1, parity == 0)
        is_kept = np.ones(self.n_functions, dtype=bool)
        is_kept[:2] = np.logical_not(first)
        is_kept[-2:] = np.logical_not(last)
        return is_kept


def rigid_degrees(ends: EdgeConditions) -> tuple[int, ...]:
    """Degrees of the rigid motions of a line, in the order of its beam functions.

    A free line can shift (0) and turn (1), a line supported at one end only can turn, others cannot move.
    """
    if ends == ("free", "free"):
        return (0, 1)
    if set(ends) == {"supported", "free"}:
        return (1,)
    return ()


def graded_nodes(ends: EndConditions, n_elements: int) -> Floats:
    """Nodes of equal elements, but the element at each free end is split at 1/4 and 1/16 of its length.

    Along a free edge the twist of a shear-flexible plate dies out over about a third of the thickness times sqrt(G_xy /
    G_xz): a layer too narrow for as many equal elements, whose frequencies lie up to 3 cents too high. The split
    elements count among `n_elements`; where these are too few to be split, all stay equal.
    """
    n_equal = n_elements - len(_EDGE_LAYER) * ends.count("free")
    if n_equal < 3:
        return np.linspace(0.0, 1.0, n_elements + 1)
    first, last = (np.array(_EDGE_LAYER if end == "free" else ()) / n_equal for end in ends)
    return np.sort(np.concatenate([np.linspace(0.0, 1.0, n_equal + 1), first, 1.0 - last]))


@lru_cache(maxsize=64)
def line(
    ends: EdgeConditions,
    n_elements: int,
    is_sheared: bool = False,
    is_split: bool = True,
    end_conditions: EndConditions | None = None,
    n_points: int = N_POINTS,
) -> Line:
    """The functions of one side; the result is shared, so it must not be changed.

    `is_sheared`: of a shear-flexible plate, graded towards free ends. `is_split`: the first half alone where both ends
    are alike; False if something else on the plate makes the halves differ. A line with an element across its middle is
    never split. `end_conditions`: what the ends hold where that is less than `ends` says.
    """
    from skfem import Basis, ElementLineHermite, MeshLine

    nodes = graded_nodes(ends, n_elements) if is_sheared else np.linspace(0.0, 1.0, n_elements + 1)
    is_split = is_split and ends[0] == ends[1] and n_elements % 2 == 0
    if is_split:
        nodes = nodes[: n_elements // 2 + 1]
    basis = Basis(MeshLine.init_tensor(nodes), ElementLineHermite(), intorder=2 * n_points - 1)
    return Line(ends, ends if end_conditions is None else end_conditions, is_split, basis)
