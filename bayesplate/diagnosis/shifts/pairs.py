"""Two effects whose shifts do not add: both solved at once, at every pair of their cells.

A mass that slows a mode makes the tension that speeds it up count the less: both together shift it by something else
than the sum. The table of such a pair has the cells of the two effects, the exact shifts of both at once, and the exact
refit of the constants.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.shifts.baseline import Baseline
from bayesplate.diagnosis.shifts.forms import Form, with_forms
from bayesplate.diagnosis.shifts.laws import FormLaw, form_law
from bayesplate.diagnosis.shifts.tables import Table, refitted, together

Floats = NDArray[np.float64]
Solve = Callable[[Baseline, Form], FormLaw]
"""Makes the law of a form around a baseline."""


@dataclass(frozen=True, eq=False)
class JointLaw:
    """Frequencies of a board with one form of each of two effects.

    Attributes
    ----------
    law : FormLaw
        Its free parameters are those of the first effect, then those of the second.
    n_first : int
        How many are of the first.
    """

    law: FormLaw
    n_first: int

    @property
    def n_second(self) -> int:
        """How many free parameters are of the second effect."""
        return len(self.law.form.free) - self.n_first


JointLaws = Mapping[tuple[int, int], JointLaw]
"""By the indices of the two effects' forms."""


def joint_law(baseline: Baseline, one: Form, other: Form, solve: Solve = form_law) -> JointLaw:
    """Solve a board with two effects around a baseline and over the priors of both."""
    detail = ", ".join(part for part in (one.detail, other.detail) if part)
    board = with_forms(baseline.board, (one, other))
    both = Form(f"{one.effect} and {other.effect}", detail, board, (*one.free, *other.free))
    return JointLaw(solve(baseline, both).placed(baseline), len(one.free))


def joint_table(baseline: Baseline, one: Table, other: Table, laws: JointLaws) -> Table:
    """Two effects at once, exactly where there are laws of both; elsewhere their shifts add.

    Parameters
    ----------
    baseline : Baseline
    one, other : Table
        Of the effects alone.
    laws : JointLaws

    Returns
    -------
    Table
        With the cells, and the order of them, of `bayesplate.diagnosis.shifts.tables.together`.
    """
    added = together(one, other)
    values = np.concatenate([added.shift, added.moved], axis=1)
    slopes = np.concatenate([added.slopes, added.moved_slopes], axis=1)
    first, second = np.divmod(np.arange(added.n_cells), other.n_cells)
    n_first = one.slopes.shape[2]
    for (i, j), law in laws.items():
        cells = np.flatnonzero((one.form[first] == i) & (other.form[second] == j))
        z, width = (
            np.hstack([of_one[first[cells], : law.n_first], of_other[second[cells], : law.n_second]])
            for of_one, of_other in ((one.z, other.z), (one.z_slopes, other.z_slopes))
        )
        found, slope = _refitted(baseline, law.law, z, width)
        good = np.isfinite(found).all(axis=1) & np.isfinite(slope).all(axis=(1, 2))
        values[cells[good]] = found[good]
        columns = [*range(law.n_first), *range(n_first, n_first + law.n_second)]
        slopes[np.ix_(cells[good], np.arange(slopes.shape[1]), columns)] = slope[good]
    n = added.shift.shape[1]
    return replace(added, shift=values[:, :n], slopes=slopes[:, :n], moved=values[:, n:], moved_slopes=slopes[:, n:])


def _refitted(baseline: Baseline, law: FormLaw, z: Floats, width: Floats) -> tuple[Floats, Floats]:
    """Shifts and refits side by side, and their changes over one standard deviation of a cell."""
    sides = []
    for k in range(z.shape[1]):
        step = np.zeros_like(z)
        step[:, k] = width[:, k]
        above, below = (np.hstack(refitted(baseline, law, z + sign * step)) for sign in (1.0, -1.0))
        sides.append(0.5 * (above - below))
    return np.hstack(refitted(baseline, law, z)), np.stack(sides, axis=2)
