"""What an effect does between the sizes at which it was solved: polynomials through as many nodes as there are."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesplate.diagnosis.shifts import cells_along
from bayesplate.planning.shifts import _along, _lagrange, _middle


@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_polynomial_of_the_order_that_the_nodes_allow_comes_out(n):
    at, value = np.array([-1.0, 0.5, 2.0])[:n], np.linspace(-1.0, 2.0, 7)
    weights = _lagrange(at, value)

    for power in range(n):
        assert weights @ at**power == pytest.approx(value**power)
    assert weights.sum(axis=1) == pytest.approx(1.0)


def table(n_parameters, n_cells):
    axis = np.linspace(-1.0, 1.0, n_cells) if n_cells > 1 else np.zeros(1)
    z = np.stack(np.meshgrid(*[axis] * n_parameters, indexing="ij"), axis=-1).reshape(-1, n_parameters)
    return SimpleNamespace(form=np.zeros(len(z), dtype=int), z=z)


@pytest.mark.parametrize(("n_parameters", "n_cells"), [(1, 9), (2, 5), (6, 2), (9, 1)])
def test_nodes_along_a_parameter_are_distinct_however_few_cells_there_are(n_parameters, n_cells):
    """Six setups with a size of their own each leave two cells along each, nine leave one."""
    made = table(n_parameters, n_cells)
    for peak in (0, len(made.z) // 2, len(made.z) - 1):
        shares = np.full(len(made.z), 1e-12)
        shares[peak] = 1.0
        for j in range(n_parameters):
            found = _along(made, shares / shares.sum(), 0, j)
            values = made.z[found, j]
            assert len(found) == min(n_cells, 3)
            assert (np.diff(values) > 0).all()
            assert 0 <= _middle(found) < len(found)


def test_so_few_cells_do_occur():
    assert [cells_along(n, (17, 9, 256)) for n in (6, 9)] == [2, 1]
