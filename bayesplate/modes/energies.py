"""The energies of a plate as matrices: each integrates the product of two strains, which are derivatives of fields.

A field is the deflection, or a shear strain. On the mesh every derivative is a product of one function along x and one
along y, and so is every product of two; weighted with a field of the board, it is a short sum of such products. The
integrals along each side are few, and are worked out once for all terms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.element import ORDERS, LineProducts, line_places
from bayesplate.modes.fields import UNIFORM, Fabric, Group, Measure, layout
from bayesplate.modes.hermite import end_products, products
from bayesplate.modes.line import Line
from bayesplate.modes.plate import Beside, Block, EdgeTurn, KronSum, Parity, PlateMatrices, Term, count_rigid
from bayesplate.modes.sparse import Entries, Kron, lower_triangles


class Derivative(NamedTuple):
    """A field, differentiated so many times along x and along y, times a factor."""

    factor: float
    field: str
    along_x: int
    along_y: int


Strain = tuple[Derivative, ...]
"""A strain or a motion: a sum of derivatives."""


Strains = tuple[Strain, Strain]
"""Two whose product is integrated: twice where they differ, so that the matrix is symmetric."""


_ONE = Entries(np.ones((1, 1)), np.zeros(1, dtype=np.intp), np.zeros(1, dtype=np.intp), (1, 1))


class Energy(NamedTuple):
    """The integral of the product of two strains."""

    strains: Strains
    measure: Measure


class Piece(NamedTuple):
    """A share of a field: whose unknowns it is made of, and which functions along x and y these belong to."""

    unknowns: str
    along_x: str
    along_y: str


Fields = Mapping[str, tuple[Piece, ...]]
"""By name, in the order of their unknowns: the deflection "w" first. The first piece is on the field's own unknowns."""

Functions = Mapping[str, Any]
"""Functions along one side by name, as columns of a sparse array on those of the free line."""


Groups = tuple[tuple[Group, ...], tuple[Group, ...]]
"""Of each stiffness and of each mass term."""


class Kinematics(NamedTuple):
    """How a plate deforms.

    Attributes
    ----------
    fields : Fields
    stiffnesses, masses : tuple of Strains
        Of each of the plate's own terms.
    turns : (Strain, Strain)
        How the cross-sections turn along x and along y.
    functions : callable
        From a line and the parity of a class to the class's functions along that side.
    groups : callable
        From whether the grain runs at an angle to the group of each of the plate's own stiffness and mass terms.
    """

    fields: Fields
    stiffnesses: tuple[Strains, ...]
    masses: tuple[Strains, ...]
    turns: Strains
    functions: Callable[[Line, int], Functions]
    groups: Callable[[bool], Groups]


def deflected(side: Line, parity: int) -> Any:
    """Functions of the deflection of one class along one side, as columns on those of the free line."""
    from scipy.sparse import identity

    return identity(2 * (side.n_elements + 1), format="csr")[:, side.kept] @ side.parts[parity]


@dataclass(frozen=True, eq=False)
class _Integrals:
    """Integrals along one side with several weights, on any of its functions; each is worked out once.

    Attributes
    ----------
    whole : Entries
        On the functions of the free line: the matrices of all weights for the first two orders of `ORDERS`, then for
        the next.
    functions : Functions
    """

    whole: Entries
    functions: Functions
    _of_all_orders: dict[tuple[str, str], Entries] = field(default_factory=dict)
    _of_orders: dict[tuple[tuple[int, int], str, str], Entries] = field(default_factory=dict)

    @classmethod
    def of(cls, weighted: Sequence[LineProducts], functions: Functions) -> _Integrals:
        """Those with the given weights."""
        stored = np.concatenate([one.stored[:, None] for one in weighted], axis=1)
        n = 2 * (weighted[0].n_elements + 1)
        rows, columns = np.divmod(line_places(weighted[0].n_elements), n)
        return cls(Entries(stored.reshape(-1, rows.size), rows, columns, (n, n)), functions)

    def between(self, orders: tuple[int, int], left: str, right: str) -> Entries:
        """Of some functions' derivatives of one order (rows) times others' of another (columns), with all weights."""
        key = orders, left, right
        if key not in self._of_orders:
            if (left, right) not in self._of_all_orders:
                ends = self.functions[left], self.functions[right]
                self._of_all_orders[left, right] = self.whole.between(*ends)
            every, at = self._of_all_orders[left, right], ORDERS.index(orders)
            n = len(every.values) // len(ORDERS)
            self._of_orders[key] = every.some(slice(at * n, (at + 1) * n))
        return self._of_orders[key]


def assembled_plate(
    kinematics: Kinematics,
    x: Line,
    y: Line,
    stiffness: Sequence[Term] = (),
    masses: Sequence[KronSum | Beside] = (),
    fabric: Fabric = UNIFORM,
) -> PlateMatrices:
    """A plate on two lines, class by class.

    Parameters
    ----------
    kinematics : Kinematics
    x, y : Line
        Unsplit along a side on which a further term is not symmetric.
    stiffness, masses : sequence of Term, sequence of KronSum or Beside
        Further terms; they come after the plate's own. A coordinate beside the plate is in every class of it.
    fabric : Fabric
        Varying properties repeat the plate's own terms in the order of `bayesplate.modes.fields.layout`.

    Returns
    -------
    PlateMatrices
    """
    groups = kinematics.groups(fabric.is_turned)
    measures = fabric.measures({*groups[0], *groups[1]}, x, y)
    counts = {group: len(made) for group, made in measures.items()}

    def own(pairs: Sequence[Strains], group: Sequence[Group]) -> list[Energy]:
        return [Energy(pairs[term], measures[group[term]][k]) for term, k in layout(group, counts)]

    stiff: list[Energy | KronSum | Beside] = [*own(kinematics.stiffnesses, groups[0])]
    stiff += [_along_edges(one, kinematics, x, y) if isinstance(one, EdgeTurn) else one for one in stiffness]
    inert: list[Energy | KronSum | Beside] = [*own(kinematics.masses, groups[1]), *masses]
    classes = (Parity(*each) for each in np.ndindex(len(x.parts), len(y.parts)))
    return PlateMatrices(x, y, tuple(_block(each, kinematics, x, y, stiff, inert) for each in classes))


def _along_edges(turn: EdgeTurn, kinematics: Kinematics, x: Line, y: Line) -> Energy:
    """The squared turning of the cross-sections along edges."""
    along_x, along_y = products(tuple(x.nodes)), products(tuple(y.nodes))
    if turn.axis == 0:
        along_x = end_products(x.n_elements, turn.at)
    else:
        along_y = end_products(y.n_elements, turn.at)
    turning = kinematics.turns[turn.axis]
    return Energy((turning, turning), ((along_x, along_y),))


def _block(
    parity: Parity,
    kinematics: Kinematics,
    x: Line,
    y: Line,
    stiffness: Sequence[Energy | KronSum | Beside],
    masses: Sequence[Energy | KronSum | Beside],
) -> Block:
    """One symmetry class: its further terms are on the deflection."""
    functions_x, functions_y = kinematics.functions(x, parity.x), kinematics.functions(y, parity.y)
    terms = [*stiffness, *masses]
    # Terms that differ in their strains alone have the measure in common.
    measures = {id(term.measure): term.measure for term in terms if isinstance(term, Energy)}
    ends = np.cumsum([0, *(len(measure) for measure in measures.values())]).tolist()
    places = dict(zip(measures, map(slice, ends[:-1], ends[1:]), strict=True))
    pairs = [pair for measure in measures.values() for pair in measure]
    along_x = _Integrals.of([pair[0] for pair in pairs], functions_x)
    along_y = _Integrals.of([pair[1] for pair in pairs], functions_y)
    own = [(functions_x[pieces[0].along_x], functions_y[pieces[0].along_y]) for pieces in kinematics.fields.values()]
    nodes = [(_nodes(on_x)[:, None] * (y.n_elements + 1) + _nodes(on_y)).ravel() for on_x, on_y in own]
    starts = dict(zip(kinematics.fields, np.cumsum([0, *(each.size for each in nodes)]).tolist(), strict=False))
    spread_x, spread_y = x.parts[parity.x], y.parts[parity.y]
    of_plate = np.concatenate(nodes)
    n_beside = 1 + max((term.coordinate for term in terms if isinstance(term, Beside)), default=-1)

    def parts(term: Energy | KronSum | Beside) -> list[Kron]:
        if isinstance(term, Energy):
            return list(_parts(term.strains, places[id(term.measure)], kinematics.fields, starts, along_x, along_y))
        if isinstance(term, Beside):
            own_row = of_plate.size + term.coordinate
            if not term.rows:
                return [Kron(_ONE, _ONE, (own_row, own_row))]
            rows = ((on_x @ spread_x, on_y @ spread_y) for on_x, on_y in term.rows)
            return [Kron(Entries.of([on_x]), Entries.of([on_y]), (own_row, 0)) for on_x, on_y in rows]
        on_x, on_y = (Entries.of(each) for each in zip(*term, strict=True))
        return [Kron(on_x.between(spread_x, spread_x), on_y.between(spread_y, spread_y))]

    every_node = np.concatenate([of_plate, of_plate.max() + 1 + np.arange(n_beside)])
    stored, indices, indptr = lower_triangles([parts(term) for term in terms], every_node)
    stiff, inert = stored[: len(stiffness)], stored[len(stiffness) :]
    return Block(parity, stiff, inert, indices, indptr, spread_x, spread_y, count_rigid(parity, x, y), n_beside)


def _nodes(functions: Any) -> NDArray[np.intp]:
    """Where along a side each function begins: a node of the line has two functions, of a value and of a slope."""
    rows, columns = functions.nonzero()
    first = np.full(functions.shape[1], functions.shape[0])
    np.minimum.at(first, columns, rows)
    return first // 2


def _parts(
    strains: Strains,
    which: slice,
    fields: Fields,
    starts: Mapping[str, int],
    along_x: _Integrals,
    along_y: _Integrals,
) -> Iterator[Kron]:
    """An energy on all unknowns of a class, without what lies wholly above the diagonal, for some of the weights."""
    pairs = [strains] if strains[0] is strains[1] else [strains, strains[::-1]]
    for s, t in (each for pair in pairs for each in product(*pair)):
        for a, b in product(fields[s.field], fields[t.field]):
            start = starts[a.unknowns], starts[b.unknowns]
            if start[0] >= start[1]:
                x = along_x.between((s.along_x, t.along_x), a.along_x, b.along_x)
                y = along_y.between((s.along_y, t.along_y), a.along_y, b.along_y)
                if x.rows.size and y.rows.size:
                    weighed = x._replace(values=s.factor * t.factor * x.values[which])
                    yield Kron(weighed, y._replace(values=y.values[which]), start)
