"""Cubic Hermite functions on the free line [0, 1]: their integrals, which of them an end holds, and their symmetry.

Node i carries its value as unknown 2 i and its slope as unknown 2 i + 1.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.element import ORDERS, LineProducts, assembled, line_places, uniform_products
from bayesplate.plate.setup import Ends

Hold = Literal["clamped", "supported", "guided", "free"]
"""What an end holds: value and slope, the value, the slope, nothing. No card can ask for a guided end: it is a clamped
one that an effect has released."""
Holds = tuple[Hold, Hold]

_LAYER = (1 / 4, 1 / 16)


@lru_cache(maxsize=64)
def products(nodes: tuple[float, ...]) -> LineProducts:
    """Integrals of products of derivatives over the free line.

    Parameters
    ----------
    nodes : tuple of float
        Where the elements meet, increasing.

    Returns
    -------
    LineProducts
        (n_unknowns, n_unknowns) arrays by the orders of the two derivatives.
    """
    return assembled(uniform_products(np.diff(nodes)))


def graded_nodes(ends: Holds, n_elements: int) -> NDArray[np.float64]:
    """Equal elements, save that the one at each free end is split at a quarter and at a sixteenth of its length.

    Along a free edge the twist of a shear-flexible plate dies out over about a third of the thickness times
    sqrt(G_xy / G_xz): a layer too narrow for as many equal elements, whose frequencies lie up to 3 cents too high.

    Parameters
    ----------
    ends : tuple of str
    n_elements : int
        All elements, the split ones among them; too few to be split stay equal.

    Returns
    -------
    (n_elements + 1,) array
    """
    n_equal = n_elements - len(_LAYER) * ends.count("free")
    if n_equal < 3:
        return np.linspace(0.0, 1.0, n_elements + 1)
    first, last = (np.array(_LAYER if end == "free" else ()) / n_equal for end in ends)
    return np.sort(np.concatenate([np.linspace(0.0, 1.0, n_equal + 1), first, 1.0 - last]))


def values_held(ends: Holds) -> Holds:
    """The ends with only the value held where it is held at all."""
    held: dict[Hold, Hold] = {"clamped": "supported", "supported": "supported", "guided": "free", "free": "free"}
    return held[ends[0]], held[ends[1]]


def slopes_as_values(ends: Holds) -> Holds:
    """The ends with the value held where the slope was."""
    held: dict[Hold, Hold] = {"clamped": "supported", "supported": "free", "guided": "supported", "free": "free"}
    return held[ends[0]], held[ends[1]]


def kept_unknowns(ends: Holds, n_elements: int) -> NDArray[np.intp]:
    """Unknowns that the ends leave: (n_dof,) array."""
    held: list[int] = []
    for end, node in zip(ends, (0, n_elements), strict=True):
        value, slope = 2 * node, 2 * node + 1
        held += {"clamped": [value, slope], "supported": [value], "guided": [slope], "free": []}[end]
    return np.setdiff1d(np.arange(2 * (n_elements + 1)), held)


def even_and_odd(ends: Ends, n_elements: int, kept: NDArray[np.intp]) -> tuple[Any, ...]:
    """Orthonormal bases of the even and the odd functions of a line whose nodes mirror, or the identity alone.

    Values mirror with the parity's sign, slopes against it.

    Parameters
    ----------
    ends : tuple of str
    n_elements : int
    kept : (n_dof,) array of int
        The unknowns that the functions have.

    Returns
    -------
    tuple of (n_dof, n_part) sparse array
    """
    from scipy.sparse import csr_array, identity

    if ends[0] != ends[1]:
        return (csr_array(identity(kept.size)),)
    position = {int(unknown): i for i, unknown in enumerate(kept)}
    parts = []
    for parity in (1.0, -1.0):
        rows: list[int] = []
        columns: list[int] = []
        values: list[float] = []
        n_columns = 0
        for unknown in kept:
            node, is_slope = divmod(int(unknown), 2)
            mirror = 2 * (n_elements - node) + is_slope
            sign = -parity if is_slope else parity
            if mirror < unknown or (mirror == unknown and sign < 0):
                continue
            members = [(int(unknown), 1.0)] if mirror == unknown else [(int(unknown), 1.0), (mirror, sign)]
            for member, weight in members:
                rows.append(position[member])
                columns.append(n_columns)
                values.append(weight / np.sqrt(len(members)))
            n_columns += 1
        parts.append(csr_array((values, (rows, columns)), shape=(kept.size, n_columns)))
    return tuple(parts)


def end_products(n_elements: int, at: tuple[bool, bool]) -> LineProducts:
    """Products of derivatives, up to the first, at the ends of the free line, summed over the ends asked for.

    Parameters
    ----------
    n_elements : int
    at : tuple of bool
        Whether the ends at 0 and at 1 count.

    Returns
    -------
    LineProducts
        Those of second derivatives, which no edge holds, are zero.
    """
    nodes = np.array([0, n_elements])[list(at)]
    rows, columns = np.divmod(line_places(n_elements), 2 * (n_elements + 1))
    # The unknowns of a node are the value and the first derivative there.
    stored = np.zeros((len(ORDERS), rows.size))
    for held, (i, j) in zip(stored, ORDERS, strict=True):
        if max(i, j) < 2:
            held[np.isin(rows, 2 * nodes + i) & (columns - rows == j - i)] = 1.0
    return LineProducts(n_elements, stored)
