"""A plate's stiffness and mass as whole arrays, for dense solvers."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from bayesplate.plate.terms import Weights


def dense(own, weights):
    """Stiffness and mass of a class, without the terms that exist on deflections only: (n_dof, n_dof) arrays."""
    stiffness, mass = own.pencil(own.plate.elements(weights))
    return stiffness.toarray(), mass.toarray()


def whole(own, weights):
    """The same from every term on all unknowns, one by one, those that exist on deflections only among them."""
    unit = np.eye(own.n_dof)
    both = zip(weights, (own.project_stiffness(unit), own.project_masses(unit)), strict=True)
    stiffness, mass = (np.tensordot(part, terms, axes=1) for part, terms in both)
    return stiffness, mass


def spectrum(own, weights):
    """All eigenvalues of a class, rigid motions among them, by a dense solver."""
    return eigh(*dense(own, weights), eigvals_only=True)


def together(weights):
    """Weights of several draws."""
    return Weights(*(np.stack(part) for part in zip(*weights, strict=True)))
