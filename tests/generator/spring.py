"""Springs along an edge that gives way, or turns, where a rigid clamp would not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generator.basis import Basis, Floats, edge_points, symmetric


@dataclass(frozen=True)
class Spring:
    """What holds an edge: N (N m per m and rad) against rotation, N m^-2 against translation; infinity is rigid."""

    rotation: float = np.inf
    translation: float = np.inf


def spring_matrix(basis: Basis, edge: str, spring: Spring) -> Floats:
    """Twice the energy of the springs along a released edge; what is rigid is in the basis."""
    x, y, weights = edge_points(basis, edge)
    matrix = np.zeros((basis.size, basis.size))
    if np.isfinite(spring.translation):
        w = basis.deflection(x, y)
        matrix += spring.translation * symmetric(w, w, weights)
    if np.isfinite(spring.rotation):
        turned = basis.rotation("xy".index(edge[0]), x, y)
        matrix += spring.rotation * symmetric(turned, turned, weights)
    return matrix
