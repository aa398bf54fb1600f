"""What the effects of the surviving explanations would do to modes that were not read yet.

A few full solves along each size of an effect, the constants where the search has moved them, and a parabola between:
what remains beside the constants' own linear law is small and smooth. Cells of the search's tables take their place on
it, so that what is expected of a further reading goes with what the readings at hand say of the size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.forms import Form
from bayesplate.diagnosis.search import Candidate, Found
from bayesplate.diagnosis.shifts import Table
from bayesplate.diagnosis.terms import normalised
from bayesplate.planning.station_laws import BareLaw, SolvedStation

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_QUANTILES = (0.03, 0.5, 0.97)
_LIKELY = 0.05
"""Share of an effect's probability below which one of its forms is left out."""
_MOST_FORMS = 3
_TOO_FAR = 0.4
"""A shift of ln f beyond which a mode has lost its name."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Sizes at which a form is solved: cells of its table in the middle, and beside it along each parameter.

    Attributes
    ----------
    form : Form
    index : int
        Of the form among those of its effect.
    middle : int
        A likely cell.
    along : tuple of (3,) array of int
        For each parameter three cells, the middle one between the others.
    """

    form: Form
    index: int
    middle: int
    along: tuple[Rows, ...]

    @property
    def cells(self) -> Rows:
        """All of them, each once."""
        return np.unique(np.concatenate([np.array([self.middle]), *self.along]))


def nodes_of(found: Found, name: str) -> tuple[Nodes, ...]:
    """Where to solve an effect: at its forms that are likely, about the sizes that are."""
    candidate = found.ground.candidates[name]
    shares = _shares(found, name)
    table = candidate.fine
    by_form = np.array([shares[table.form == i].sum() for i in range(len(candidate.laws))])
    likely = [int(i) for i in np.argsort(-by_form)[:_MOST_FORMS] if by_form[i] >= _LIKELY * by_form.sum()]
    return tuple(_nodes(candidate, shares, i) for i in likely)


def _nodes(candidate: Candidate, shares: Floats, index: int) -> Nodes:
    form, table = candidate.laws[index].form, candidate.fine
    along = tuple(_along(table, shares, index, j) for j in range(len(form.free)))
    rows = np.flatnonzero(table.form == index)
    middle = int(along[0][_middle(along[0])]) if along else int(rows[np.argmax(shares[rows])])
    return Nodes(form, index, middle, along)


def _shares(found: Found, name: str) -> Floats:
    """Probability of each cell of an effect's table, the effect alone being present: (n_cells,) array."""
    hypotheses = found.ground.hypotheses
    one = next(h for h in hypotheses if h.members == (name,) and h.swap is None)
    terms = one.terms
    log_density = terms.log_densities(one.seen(found.ground.baseline, found.residual[None, :]))[:, 0]
    return np.asarray(normalised(log_density).reshape(-1, terms.table.n_cells).sum(axis=0))


def _along(table: Table, shares: Floats, form: int, parameter: int) -> Rows:
    """Three cells along a parameter, or all if fewer, the other ones near the middle of what is likely."""
    rows = np.flatnonzero(table.form == form)
    z, weights = table.z[rows], shares[rows] / shares[rows].sum()
    middle = weights @ z
    sd = np.sqrt(weights @ (z - middle) ** 2) + 1e-9
    order = np.argsort(z[:, parameter])
    places = np.minimum(np.searchsorted(np.cumsum(weights[order]), _QUANTILES), len(order) - 1)
    wanted = [float(one) for one in z[order[places], parameter]]
    chosen = []
    for value in wanted:
        goal = middle.copy()
        goal[parameter] = value
        distance = ((z - goal) / sd) ** 2
        chosen.append(int(rows[np.argmin(distance.sum(axis=1))]))
    if len(set(chosen)) < 3:  # all in one cell: its neighbours along the parameter
        same = [int(i) for i in rows if np.allclose(np.delete(table.z[i] - table.z[chosen[1]], parameter), 0.0)]
        same.sort(key=lambda i: float(table.z[i, parameter]))
        at = max(min(same.index(chosen[1]), len(same) - 2), 1)
        chosen = same[at - 1 : at + 2]
    return np.array(chosen, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class FormShift:
    """What a form does to the modes of a station beside what the constants do: a parabola along each parameter, or what
    fewer nodes allow.

    Everything is kept flat: the modes, then what a known mass at each spot adds to each.

    Attributes
    ----------
    nodes : Nodes
    at : tuple of (n_nodes,) array
        Values of each parameter at its nodes, SI.
    beside : tuple of (n_nodes, n) array
        ln f there, less ln f without the effect and what the constants' linear law says.
    middle : (n,) array
        The same in the middle cell.
    """

    nodes: Nodes
    at: tuple[Floats, ...]
    beside: tuple[Floats, ...]
    middle: Floats

    def __call__(self, z: Floats) -> Floats:
        """At standard coordinates of the parameters: (n_cells, n) array from (n_cells, n_parameters)."""
        total = np.tile(self.middle, (len(z), 1))
        for j, (at, beside) in enumerate(zip(self.at, self.beside, strict=True)):
            value = np.clip(self.nodes.form.free[j].prior.value(z[:, j]), at.min(), at.max())
            total = total + _lagrange(at, value) @ beside - beside[_middle(at)]
        return np.asarray(total)


def _middle(nodes: Rows | Floats) -> int:
    """Which of one, two or three nodes in a row the others are beside."""
    return len(nodes) // 2


def _lagrange(at: Floats, value: Floats) -> Floats:
    """Weights of nodes at values between them: (n, n_nodes) array, of the polynomial through all of them."""
    others = [np.delete(at, i) for i in range(at.size)]
    return np.column_stack(
        [np.prod((value[:, None] - rest) / (one - rest), axis=1) for one, rest in zip(at, others, strict=True)]
    )


def form_shift(found: Found, candidate: Candidate, nodes: Nodes, law: BareLaw) -> FormShift:
    """Solve a form at its nodes in a station; not a number where a mode cannot be followed."""
    cells = nodes.cells.tolist()
    solved = [_beside(found, candidate.fine, nodes.form, cell, law) for cell in cells]
    by_cell = dict(zip(cells, solved, strict=True))
    at, beside = [], []
    for j, cells in enumerate(nodes.along):
        at.append(np.asarray(nodes.form.free[j].prior.value(candidate.fine.z[cells, j])))
        beside.append(np.stack([by_cell[int(cell)] for cell in cells]))
    return FormShift(nodes, tuple(at), tuple(beside), by_cell[nodes.middle])


def _beside(found: Found, table: Table, form: Form, cell: int, law: BareLaw) -> Floats:
    """What a form does in one cell, less what the linear law of the constants says: (n,) array.

    On the mesh for the baseline's constants, so that all cells of a form have the same matrices.
    """
    baseline = found.ground.baseline
    sizes = {free.name: np.asarray(free.prior.value(table.z[cell, j])) for j, free in enumerate(form.free)}
    exact = {name: np.asarray(q.mean) for name, q in form.board.inputs.items() if q.is_exact}
    known = {**exact, **baseline.values, **sizes}
    constants = (np.exp(baseline.log_rigidities + moved) for moved in (table.moved[cell], 0.0))
    there, meshed = ({**known, **baseline.board.symmetry.rigidities(each, known["poisson_xy"])} for each in constants)
    shift = SolvedStation.of(law.station, form.board, there, meshed).bare_and_added - law.solved
    shift[0] -= law.slopes[:, : table.moved.shape[1]] @ table.moved[cell]
    shift[:, np.abs(shift[0]) > _TOO_FAR] = np.nan
    return np.asarray(shift.ravel())


@dataclass(frozen=True, eq=False)
class EffectShift:
    """What an effect does to the modes of a station, over all cells of a table of it.

    Attributes
    ----------
    forms : dict of FormShift
        By the index of the form.
    """

    forms: Mapping[int, FormShift]

    def beside(self, table: Table, cells: Sequence[int] | Rows) -> tuple[Floats, Floats]:
        """Shift, and its change over one standard deviation of the cell along each parameter.

        Cells of a form that was not solved take the place of the likeliest one.

        Returns
        -------
        shift : (n_cells, n) array
        slopes : (n_cells, n, n_parameters) array
        """
        rows = np.asarray(cells, dtype=np.intp)
        z, steps, form = table.z[rows], table.z_slopes[rows], table.form[rows]
        first = next(iter(self.forms))
        n = self.forms[first].middle.size
        shift, slopes = np.zeros((len(rows), n)), np.zeros((len(rows), n, z.shape[1]))
        for i in np.unique(form):
            of_form = form == i
            law = self.forms.get(int(i), self.forms[first])
            n_free = len(law.at)
            shift[of_form] = law(z[of_form, :n_free])
            for j in range(n_free):
                step = np.zeros((int(of_form.sum()), n_free))
                step[:, j] = steps[of_form, j]
                both = law(z[of_form, :n_free] + step) - law(z[of_form, :n_free] - step)
                slopes[of_form, :, j] = 0.5 * both
        return shift, slopes
