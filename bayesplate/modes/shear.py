"""The shear-flexible plate as a budget of energies: the thin plate's terms, two shear stiffnesses, two rotary inertias.

Unknowns on the unit square are the deflection w and the shear strains g_x = L_x gamma_x and g_y = L_y gamma_y; the
cross-section turns by (w_x - g_x) / L_x and (w_y - g_y) / L_y where a thin plate has the slope. So

    K_xx = int (w_xx - g_x,x)^2                       K_yy = int (w_yy - g_y,y)^2
    K_mix = 2 int (w_xx - g_x,x) (w_yy - g_y,y)       K_xy = int (w_xy - g_x,y / 2 - g_y,x / 2)^2
    K_shear_x = int g_x^2                             K_shear_y = int g_y^2
    M = int w^2                                       M_x = int (w_x - g_x)^2,  M_y = int (w_y - g_y)^2

keep the thin plate's weights, joined by S_x L_y / (L_x m) and S_y L_x / (L_y m) for shear, S_x = kappa h G_xz and
S_y = kappa h G_yz, and by h^2 / (12 L_x^2) and h^2 / (12 L_y^2) for rotary inertia (m: the vibrating mass). Because the
strains are unknowns themselves, stiff shear drives them to zero and leaves the thin plate of the same functions: there
is nothing to lock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from bayesplate.modes.element import Products
from bayesplate.modes.fields import UNIFORM, Fabric, Group, Measure, layout
from bayesplate.modes.hermite import end_products, even_and_odd, kept_unknowns, products, slopes_as_values
from bayesplate.modes.line import Line, line
from bayesplate.modes.plate import (
    Block,
    EdgeTurn,
    KronSum,
    Parity,
    PlateMatrices,
    Term,
    count_rigid,
    kron_sum,
)
from bayesplate.modes.sparse import on_one_pattern, sum_of_krons
from bayesplate.modes.thin import THIN_TERMS, thin_groups
from bayesplate.plate.setup import Ends

SHEAR_TERMS = (*THIN_TERMS, "shear_x", "shear_y")
SHEAR_MASSES = ("board", "rotary_x", "rotary_y")

SHEAR_CORRECTION = 5.0 / 6.0
"""kappa: what the parabolic course of the shear stress over the thickness leaves of the shear stiffness."""

SHEAR_ELEMENTS_PER_SIDE = 16
"""Elements per side for `bayesplate.modes.mesh.mesh`: six modes within 0.15 cent, twelve within 0.3, in about 60 ms."""

_UNKNOWNS = ("w", "g_x", "g_y")


class Derivative(NamedTuple):
    """A field, differentiated so many times along x and along y, times a factor."""

    factor: float
    field: str
    along_x: int
    along_y: int


_DEFLECTION = (Derivative(1.0, "w", 0, 0),)
_SHEAR_X = (Derivative(1.0, "g_x", 0, 0),)
_SHEAR_Y = (Derivative(1.0, "g_y", 0, 0),)
_TURN_X = (Derivative(1.0, "w", 1, 0), Derivative(-1.0, "g_x", 0, 0))
_TURN_Y = (Derivative(1.0, "w", 0, 1), Derivative(-1.0, "g_y", 0, 0))
_BEND_X = (Derivative(1.0, "w", 2, 0), Derivative(-1.0, "g_x", 1, 0))
_BEND_Y = (Derivative(1.0, "w", 0, 2), Derivative(-1.0, "g_y", 0, 1))
_TWIST = (Derivative(1.0, "w", 1, 1), Derivative(-0.5, "g_x", 0, 1), Derivative(-0.5, "g_y", 1, 0))

Strain = tuple[Derivative, ...]

_TWICE_TWIST = tuple(d._replace(factor=2.0 * d.factor) for d in _TWIST)
_STIFFNESSES: tuple[tuple[Strain, Strain], ...] = (
    (_BEND_X, _BEND_X),
    (_BEND_Y, _BEND_Y),
    (_BEND_X, _BEND_Y),
    (_TWIST, _TWIST),
    (_SHEAR_X, _SHEAR_X),
    (_SHEAR_Y, _SHEAR_Y),
    (_BEND_X, _TWICE_TWIST),
    (_BEND_Y, _TWICE_TWIST),
    (_SHEAR_X, _SHEAR_Y),
)
"""Pairs of strains whose product each stiffness term integrates, twice where they differ; the last three couple."""

_MASSES: tuple[tuple[Strain, Strain], ...] = ((_DEFLECTION, _DEFLECTION), (_TURN_X, _TURN_X), (_TURN_Y, _TURN_Y))


class Piece(NamedTuple):
    """A share of a field: whose unknowns it is made of, and how these spread over the functions of the free lines."""

    unknowns: str
    along_x: Any
    along_y: Any


Fields = Mapping[str, tuple[Piece, ...]]


@lru_cache(maxsize=16)
def shear_flexible_plate(ends_x: Ends, ends_y: Ends, n_x: int, n_y: int) -> PlateMatrices:
    """Assemble the shear-flexible plate; the result is shared, so it must not be changed.

    A free edge holds nothing. A supported one (a hard support) holds the deflection and the turning along the edge. A
    clamped one holds the turning across it as well, w_n = g_n: the deflection meets the clamp at the angle of the shear
    strain.

    Parameters
    ----------
    ends_x, ends_y : tuple of str
        Condition at the two ends of each side: (x0, x1) and (y0, y1).
    n_x, n_y : int
        Numbers of elements along x and y, graded towards free edges.

    Returns
    -------
    PlateMatrices
        Stiffness terms in the order of `SHEAR_TERMS`, mass terms in that of `SHEAR_MASSES`.

    References
    ----------
    Reissner (1945) and Mindlin (1951); the shear strains as unknowns in place of the turning: Endo and Kimura (2007).
    """
    return assemble_shear_flexible(line(ends_x, n_x, is_sheared=True), line(ends_y, n_y, is_sheared=True))


def assemble_shear_flexible(
    x: Line,
    y: Line,
    stiffness: Sequence[Term] = (),
    masses: Sequence[KronSum] = (),
    fabric: Fabric = UNIFORM,
) -> PlateMatrices:
    """The shear-flexible plate on two sheared lines, joined by further terms.

    Parameters
    ----------
    x, y : Line
        Unsplit along a side on which a further term is not symmetric.
    stiffness : sequence of Term
    masses : sequence of KronSum
        Further terms; they come after the plate's own.
    fabric : Fabric
        Varying properties repeat the plate's own terms in the order of `bayesplate.modes.fields.layout`.

    Returns
    -------
    PlateMatrices
    """
    groups = shear_groups(fabric.is_turned)
    measures = fabric.measures({*groups[0], *groups[1]}, x, y)
    blocks = tuple(
        _block(Parity(i, j), x, y, measures, groups, stiffness, masses)
        for i in range(len(x.parts))
        for j in range(len(y.parts))
    )
    return PlateMatrices(x, y, blocks)


def shear_groups(is_turned: bool = False) -> tuple[tuple[Group, ...], tuple[Group, ...]]:
    """Group of each stiffness and of each mass term that is the shear-flexible plate's own.

    Where the grain runs at an angle, the terms that couple bending with twist and the two shear strains come last.
    """
    bending, _ = thin_groups(is_turned)
    own, coupling = bending[: len(THIN_TERMS)], bending[len(THIN_TERMS) :]
    strains: tuple[Group, ...] = ("shear",) if is_turned else ()
    return (*own, "shear", "shear", *coupling, *strains), ("mass", "rotary", "rotary")


def _block(
    parity: Parity,
    x: Line,
    y: Line,
    measures: Mapping[Group, Sequence[Measure]],
    groups: tuple[tuple[Group, ...], tuple[Group, ...]],
    further_stiffness: Sequence[Term],
    further_masses: Sequence[KronSum],
) -> Block:
    from scipy.sparse import coo_array

    deflected_x, strained_x, tied_x = _functions(x, parity.x)
    deflected_y, strained_y, tied_y = _functions(y, parity.y)
    fields: Fields = {
        "w": (Piece("w", deflected_x, deflected_y),),
        "g_x": (Piece("g_x", strained_x, deflected_y), Piece("w", tied_x, deflected_y)),
        "g_y": (Piece("g_y", deflected_x, strained_y), Piece("w", deflected_x, tied_y)),
    }

    def energy(first: Strain, second: Strain, measure: Measure) -> Any:
        product = _energy(fields, first, second, measure)
        return product if first is second else product + product.T

    counts = {group: len(made) for group, made in measures.items()}

    def own(pairs: Sequence[tuple[Strain, Strain]], group: Sequence[Group]) -> list[Any]:
        return [energy(*pairs[term], measures[group[term]][k]) for term, k in layout(group, counts)]

    stiffnesses, inertias = own(_STIFFNESSES, groups[0]), own(_MASSES, groups[1])
    spread_x, spread_y = x.parts[parity.x], y.parts[parity.y]

    def on_deflection(term: KronSum) -> Any:
        small = coo_array(kron_sum(term, spread_x, spread_y))
        return coo_array((small.data, small.coords), shape=stiffnesses[0].shape)

    products_x, products_y = products(tuple(x.nodes)), products(tuple(y.nodes))

    def along_edges(turn: EdgeTurn) -> Any:
        if turn.axis == 0:
            return _energy(fields, _TURN_X, _TURN_X, ((end_products(x.n_elements, turn.at), products_y),))
        return _energy(fields, _TURN_Y, _TURN_Y, ((products_x, end_products(y.n_elements, turn.at)),))

    further = [along_edges(t) if isinstance(t, EdgeTurn) else on_deflection(t) for t in further_stiffness]
    terms = [*stiffnesses, *further]
    stored, indices, indptr = on_one_pattern([*terms, *inertias, *(on_deflection(term) for term in further_masses)])
    stiff, inert = stored[: len(terms)], stored[len(terms) :]
    return Block(parity, stiff, inert, indices, indptr, spread_x, spread_y, count_rigid(parity, x, y))


def _functions(side: Line, parity: int) -> tuple[Any, Any, Any]:
    """Functions of one class along one side, each a sparse array onto the functions of the free line.

    Returns
    -------
    deflected : (n_free, n_deflection)
    strained : (n_free, n_strain)
        The strain along this side, of opposite parity and without its value at ends that hold the turning.
    tied : (n_free, n_deflection)
        That value, which is the slope of the deflection.
    """
    from scipy.sparse import csr_array, identity

    strain_held = slopes_as_values(side.held)
    kept = kept_unknowns(strain_held, side.n_elements)
    free = identity(2 * (side.n_elements + 1), format="csr")
    deflected = free[:, side.kept] @ side.parts[parity]
    strained = free[:, kept]
    if side.is_symmetric:
        strained = strained @ even_and_odd(side.ends, side.n_elements, kept)[-1 - parity]
    values = [2 * node for end, node in zip(strain_held, (0, side.n_elements), strict=True) if end == "supported"]
    slopes = [value + 1 for value in values]
    value_from_slope = csr_array(([1.0] * len(values), (values, slopes)), shape=free.shape)
    return deflected, strained, value_from_slope @ deflected


def _energy(fields: Fields, first: Strain, second: Strain, measure: Sequence[tuple[Products, Products]]) -> Any:
    """Integral of the product of two strains or motions, on all unknowns of a class."""
    from scipy.sparse import csc_array

    sizes = [fields[field][0].along_x.shape[1] * fields[field][0].along_y.shape[1] for field in _UNKNOWNS]
    starts = dict(zip(_UNKNOWNS, np.cumsum([0, *sizes]), strict=False))
    values, rows, columns = [], [], []
    for s in first:
        for t in second:
            pairs = [(along_x[s.along_x, t.along_x], along_y[s.along_y, t.along_y]) for along_x, along_y in measure]
            for a in fields[s.field]:
                for b in fields[t.field]:
                    part = sum_of_krons(pairs, (a.along_x, b.along_x), (a.along_y, b.along_y))
                    values.append(s.factor * t.factor * part.data)
                    rows.append(starts[a.unknowns] + part.row)
                    columns.append(starts[b.unknowns] + part.col)
    at = np.concatenate(rows), np.concatenate(columns)
    return csc_array((np.concatenate(values), at), shape=(sum(sizes), sum(sizes)))
